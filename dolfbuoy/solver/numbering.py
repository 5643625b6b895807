"""Numbering of the unknowns of all ranks in PETSc's vectors and matrices."""

from typing import Any

import numpy as np
from petsc4py import PETSc

from . import Array
from .c_code import address, check, core


class Numbering:
    """Global numbers of the free unknowns: rank after rank, `order` within a rank.

    comm: that of the whole problem.  size: number of local unknowns.  order: free local unknowns owned by this rank, in
    matrix order.  keys: (k, n) sort keys of `order`, the last ones first, which also give the elimination order over
    all ranks.  ghosts: (local index, global index) arrays of unknowns owned elsewhere.  ties: arrays of local unknowns
    and of those, in `order` or ghosts, whose global index they share.

    Constrained dofs (an anchored end) are not unknowns: PETSc gets the index -1 for them and drops their rows and
    columns.  `visible` are the owned free unknowns, in order, followed by the ghosts.
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
        #: Tied local unknowns, and the places in `visible` of those they are tied to.
        none: Array = np.zeros(0, dtype=np.int64)
        self.tied, self.tied_to = self._tie(*ties) if ties is not None else (none, none)
        self.lgmap = PETSc.LGMap().create(self.global_index, comm=comm)
        #: vector of owned unknowns and ghosts, if other ranks add to this rank's rows
        self.ghosted: Any = None
        #: global numbers in elimination order; by global number the ranks follow one another
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
        """A PETSc matrix whose pattern is not yet set."""
        n, N = len(self.order), self.unknowns
        A = PETSc.Mat().create(self.comm)
        A.setSizes([[n, N], [n, N]])
        A.setType("aij")
        A.setLGMap(self.lgmap, self.lgmap)
        return A

    def destroy(self) -> None:
        """Free PETSc objects."""
        self.lgmap.destroy()
        if self.ghosted is not None:
            self.ghosted.destroy()
            self.elimination.destroy()


# Matrices from (row, column, value) triples are made by the core, because petsc4py of Debian 12 lacks the functions.


def preallocate(A: PETSc.Mat, rows: Array, columns: Array) -> None:
    """Set the nonzero pattern of a matrix by global (row, column) pairs; negative ones are ignored."""
    rows, columns = (np.array(a, dtype=PETSc.IntType) for a in (rows, columns))  # PETSc may change them
    places = (core().ffi.cast("PetscInt *", a.ctypes.data) for a in (rows, columns))
    check(core().lib.MatSetPreallocationCOO(core().ffi.cast("Mat", A.handle), len(rows), *places))


def set_values(A: PETSc.Mat, values: Array) -> None:
    """Set the matrix from `values`, one for each pair of `preallocate`; duplicates are summed."""
    insert = int(PETSc.InsertMode.INSERT_VALUES)
    check(core().lib.MatSetValuesCOO(core().ffi.cast("Mat", A.handle), address(values), insert))
