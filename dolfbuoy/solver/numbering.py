"""Which unknown of which rank stands where in PETSc's vectors and matrices."""

from typing import Any

import numpy as np
from petsc4py import PETSc

from . import Array
from .c_code import address, check, core


class Numbering:
    """Global numbers of the free unknowns: rank after rank, `order` within a rank.

    comm: of the whole problem.  size: number of local unknowns.  order: free local unknowns owned by this rank, in the
    order of the matrix.  keys: (k, n) numbers that `order` is sorted by, the last ones first, and by which those of
    all ranks are eliminated.  ghosts: (local index, global index) arrays of unknowns owned elsewhere.  ties: arrays of
    local unknowns and of those, in the order or ghosts, whose global index they have.

    Constrained dofs (an anchored end) are no unknowns: PETSc is given the index -1 for them and drops their rows and
    columns.  `visible` are the owned free unknowns, in their order, and the ghosts after them.
    """

    def __init__(
        self,
        comm: Any,
        size: int,
        order: Array,
        keys: Array | None = None,
        ghosts: tuple[Array, Array] | None = None,
        ties: tuple[Array, Array] | None = None,
    ) -> None:
        self.comm, self.size, self.order = comm, size, np.asarray(order)
        first = comm.scan(len(order)) - len(order)
        self.unknowns = comm.allreduce(len(order))  #: free unknowns of all ranks
        self.global_index = np.full(size, -1, dtype=PETSc.IntType)
        self.global_index[self.order] = first + np.arange(len(order))
        self.ghosts = np.zeros(0, dtype=np.int64)
        if ghosts is not None:
            local, number = ghosts
            free = number >= 0
            self.ghosts = local[free]
            self.global_index[self.ghosts] = number[free]
        self.visible = np.concatenate([self.order, self.ghosts]).astype(np.int64)
        #: Local unknowns that are tied, and where in `visible` those stand that they are tied to.
        none: Array = np.zeros(0, dtype=np.int64)
        self.tied, self.tied_to = self._tie(*ties) if ties is not None else (none, none)
        self.lgmap = PETSc.LGMap().create(self.global_index, comm=comm)
        #: vector of the owned unknowns and the ghosts, where other ranks add to this rank's rows
        self.ghosted: Any = None
        #: global numbers in the order of elimination, where ranks follow each other in `order`
        self.elimination: Any = None
        if comm.size > 1:
            everywhere = np.lexsort(np.concatenate(comm.allgather(keys), axis=1)).astype(PETSc.IntType)
            self.elimination = PETSc.IS().createGeneral(everywhere, comm=PETSc.COMM_SELF)
            numbers = self.global_index[self.ghosts]
            self.ghosted = PETSc.Vec().createGhost(numbers, (len(self.order), self.unknowns), comm=comm)

    def _tie(self, tied: Array, standing: Array) -> tuple[Array, Array]:
        self.global_index[tied] = self.global_index[standing]
        place = np.empty(self.size, dtype=np.int64)
        place[self.visible] = np.arange(len(self.visible))
        return np.asarray(tied, dtype=np.int64), place[standing]

    def vector(self) -> PETSc.Vec:
        """A PETSc vector of the free unknowns."""
        x = PETSc.Vec().create(self.comm)
        x.setSizes([len(self.order), self.unknowns])
        x.setUp()
        return x

    def matrix(self) -> PETSc.Mat:
        """A PETSc matrix without a pattern yet."""
        n, N = len(self.order), self.unknowns
        A = PETSc.Mat().create(self.comm)
        A.setSizes([[n, N], [n, N]])
        A.setType("aij")
        A.setLGMap(self.lgmap, self.lgmap)
        return A

    def destroy(self) -> None:
        """Give PETSc's objects back."""
        self.lgmap.destroy()
        if self.ghosted is not None:
            self.ghosted.destroy()
            self.elimination.destroy()


# Matrices from (row, column, value) triples go through the core, for petsc4py of Debian 12 cannot make them.


def preallocate(A: PETSc.Mat, rows: Array, columns: Array) -> None:
    """Fix the nonzero pattern of a matrix by global (row, column) pairs; negative ones are left out."""
    rows, columns = (np.array(a, dtype=PETSc.IntType) for a in (rows, columns))  # PETSc may change them
    places = (core().ffi.cast("PetscInt *", a.ctypes.data) for a in (rows, columns))
    check(core().lib.MatSetPreallocationCOO(core().ffi.cast("Mat", A.handle), len(rows), *places))


def set_values(A: PETSc.Mat, values: Array) -> None:
    """Set the matrix to the sums of `values`, one for each pair of `preallocate`."""
    insert = int(PETSc.InsertMode.INSERT_VALUES)
    check(core().lib.MatSetValuesCOO(core().ffi.cast("Mat", A.handle), address(values), insert))
