"""Functions of PETSc's library that petsc4py does not know, or that are to be called from C."""

import ctypes
import functools

from petsc4py import PETSc


@functools.cache
def _library():
    return ctypes.CDLL(PETSc.__file__)


def call(name, *arguments):
    """Call a function of PETSc by its name.  Raises PETSc.Error."""
    error = getattr(_library(), name)(*arguments)
    if error:
        raise PETSc.Error(error)


def address(name) -> int:
    """Of a function of PETSc."""
    return ctypes.cast(getattr(_library(), name), ctypes.c_void_p).value
