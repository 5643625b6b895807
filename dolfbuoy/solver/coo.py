"""PETSc matrices from (row, column, value) triples: through the core, for petsc4py of Debian 12 cannot."""

import numpy as np
from petsc4py import PETSc

from .c_code import address, check, core


def preallocate(A: PETSc.Mat, rows: np.ndarray, columns: np.ndarray) -> None:
    """Fix the nonzero pattern of a matrix by global (row, column) pairs; negative ones are left out."""
    rows, columns = (np.array(a, dtype=PETSc.IntType) for a in (rows, columns))  # PETSc may change them
    places = (core().ffi.cast("PetscInt *", a.ctypes.data) for a in (rows, columns))
    check(core().lib.MatSetPreallocationCOO(core().ffi.cast("Mat", A.handle), len(rows), *places))


def set_values(A: PETSc.Mat, values: np.ndarray) -> None:
    """Set the matrix to the sums of `values`, one for each pair of `preallocate`."""
    insert = int(PETSc.InsertMode.INSERT_VALUES)
    check(core().lib.MatSetValuesCOO(core().ffi.cast("Mat", A.handle), address(values), insert))
