"""dolfinx's assemblers for the forms of a System, to check the C loops."""

import numpy as np
from dolfinx import cpp
from petsc4py import PETSc

from dolfbuoy.solver.system import System


class Assemblers:
    """dolfinx's assemblers for a System's forms in its present state: into `b`, and into `A` with its pattern."""

    def __init__(self, system: System):
        self.b, self.A = np.zeros(system.size), system.A.duplicate()
        self.A.setLGMap(system.numbering.lgmap, system.numbering.lgmap)
        for c in (*system.residuals, *system.jacobians):
            c.prepare()
        self._residuals = system.residuals
        self._jacobians = [(c, self.A.getLocalSubMatrix(*map(_numbers, c.sides))) for c in system.jacobians]

    def residuals(self) -> None:
        """Add all residuals."""
        for c in self._residuals:
            c.add_to_vector(self.b)

    def jacobians(self) -> None:
        """Add all Jacobians; the caller then assembles A in PETSc."""
        for c, block in self._jacobians:
            _add(c, block)


def _add(c, block):
    unrolled = any(part.function.function_space.dofmap.index_map_bs > 1 for part in c.sides)  # a block knows no blocks
    cpp.fem.petsc.assemble_matrix(block, c.cpp, c.constants, c.coefficients, [], unrolled)


def _numbers(part):
    numbers = np.arange(part.slice.start, part.slice.stop, dtype=PETSc.IntType)
    return PETSc.IS().createGeneral(numbers, comm=PETSc.COMM_SELF)
