"""PETSc matrices from (row, column, value) triples, also where petsc4py does not know these functions of PETSc."""

import ctypes

import numpy as np
from petsc4py import PETSc

from . import petsc_library


def preallocate(A, rows, columns):
    """Fix the nonzero pattern of a matrix by global (row, column) pairs; negative ones are left out."""
    rows, columns = (np.array(a, dtype=PETSc.IntType) for a in (rows, columns))  # PETSc may change them
    if hasattr(A, "setPreallocationCOO"):
        A.setPreallocationCOO(rows, columns)
    else:
        places = (ctypes.c_void_p(a.ctypes.data) for a in (rows, columns))
        count = ctypes.c_ssize_t(len(rows))
        petsc_library.call("MatSetPreallocationCOO", ctypes.c_void_p(A.handle), count, *places)


def set_values(A, values):
    """Set the matrix to the sums of `values`, one for each pair of `preallocate`."""
    if hasattr(A, "setValuesCOO"):
        A.setValuesCOO(values, addv=PETSc.InsertMode.INSERT_VALUES)
    else:
        pointer, mode = ctypes.c_void_p(values.ctypes.data), ctypes.c_int(PETSc.InsertMode.INSERT_VALUES)
        petsc_library.call("MatSetValuesCOO", ctypes.c_void_p(A.handle), pointer, mode)
