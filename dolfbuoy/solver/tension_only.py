"""A rope cannot push: the tension-only law as a complementarity of the discrete tension.

With g_i the row of the strain equation (11)_2 that belongs to the dof T_i of the tension,

    0 <= T_i   perpendicular to   -g_i >= 0,

so that an element is as long as its tension says, or slack: shorter, and without tension.  Written as one equation,

    max(g_i, -c_i T_i) = 0,   c_i > 0,

and solved by Newton with the generalised derivative of the maximum, an active-set method: a row is that of the
two-sided law where g_i > -c_i T_i, and T_i = 0 elsewhere.  The solution does not depend on c_i.  T_h is nonnegative
wherever the basis of the tension is, that is everywhere for tension degrees 0 and 1; for higher degrees at its nodes.
"""

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from .system import System


class TensionOnlySystem(System):
    """A System whose rows of the tension are one-sided.

    cable: the CableModel; force: a typical tension [N]; the other arguments are those of System.
    """

    def __init__(self, cable, force, *args, **kwargs):
        owned, section = cable.space.dofmap.index_map.size_local, cable.section
        sizes = np.broadcast_to(np.diff(cable.cell_ends, axis=1), cable.T_dofs.shape)
        mine = cable.T_dofs < owned
        self._rows = cable.T_dofs[mine].astype(PETSc.IntType)
        self._weights = sizes[mine] / (section.tension_degree + 1)  # about the integral of a basis function
        self._mass_times_size = section.line_density * (sizes[mine] / section.position_degree) ** 2
        self._rest = 1 / min(section.axial_stiffness, 0.1 * force)  # measured: the fewest iterations
        self._elastic, self._dynamic = 1 / section.axial_stiffness, hasattr(cable, "gamma_a")
        self._slack = np.zeros(len(self._rows), dtype=bool)
        super().__init__(*args, **kwargs)
        self.A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
        self._diagonal = self._vector()
        place = np.empty(self.size, dtype=np.int64)
        place[self.order] = np.arange(len(self.order))
        self._places = place[self._rows]

    def set_scales(self, gamma):
        """c_i is the strain that a unit of tension causes: elastic, and by the motion of a step of size 1/gamma.

        Then g_i > -c_i T_i asks whether the tension of the coming iterate is positive rather than the present strain.
        """
        super().set_scales(gamma)
        strain = self._elastic + 2 / (self._mass_times_size * gamma**2) if self._dynamic else self._rest
        self._c = self._weights * strain

    def _assemble_residual(self):
        b = super()._assemble_residual()
        g, bound = b[self._rows], -self._c * self.u[self._rows]
        self._slack = ~(g > bound)
        b[self._rows] = np.where(self._slack, bound, g)
        return b

    def _converged(self, snes, iteration, norms):
        """As a smooth system, and the rows must be the ones that the last increment was computed with."""
        reason = super()._converged(snes, iteration, norms)
        changed = reason > 0 and bool(np.any(self._slack != self._slack_before))
        if self.comm.allreduce(changed, op=MPI.LOR) and self._last_increment > self.tolerance:
            return PETSc.SNES.ConvergedReason.ITERATING
        return reason

    def _assemble_matrix(self):
        super()._assemble_matrix()
        slack = self._slack_before = self._slack
        self.A.zeroRowsLocal(self._rows[slack], diag=0.0)
        self.A.getDiagonal(self._diagonal)
        values = self._diagonal.array
        values[self._places[slack]] = -self._c[slack]
        self._diagonal.setArray(values)
        self.A.setDiagonal(self._diagonal)

    def destroy(self):
        super().destroy()
        self._diagonal.destroy()
