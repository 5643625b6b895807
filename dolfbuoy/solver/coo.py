"""PETSc matrices from (row, column, value) triples, also where petsc4py does not know these functions of PETSc."""

import ctypes
import functools

import numpy as np
from petsc4py import PETSc


@functools.cache
def _petsc_library():
    return ctypes.CDLL(PETSc.__file__)


def _petsc(name, *arguments):
    """Call a function of PETSc's library that this petsc4py does not know."""
    error = getattr(_petsc_library(), name)(*arguments)
    if error:
        raise PETSc.Error(error)


def preallocate(A, rows, columns):
    """Fix the nonzero pattern of a matrix by global (row, column) pairs; negative ones are left out."""
    rows, columns = (np.array(a, dtype=PETSc.IntType) for a in (rows, columns))  # PETSc may change them
    if hasattr(A, "setPreallocationCOO"):
        A.setPreallocationCOO(rows, columns)
    else:
        places = (ctypes.c_void_p(a.ctypes.data) for a in (rows, columns))
        _petsc("MatSetPreallocationCOO", ctypes.c_void_p(A.handle), ctypes.c_ssize_t(len(rows)), *places)


def set_values(A, values):
    """Set the matrix to the sums of `values`, one for each pair of `preallocate`."""
    if hasattr(A, "setValuesCOO"):
        A.setValuesCOO(values, addv=PETSc.InsertMode.INSERT_VALUES)
    else:
        pointer = ctypes.c_void_p(values.ctypes.data)
        _petsc("MatSetValuesCOO", ctypes.c_void_p(A.handle), pointer, ctypes.c_int(PETSc.InsertMode.INSERT_VALUES))
