"""A rope cannot push: the tension-only law as a complementarity of the discrete tension.

With g_i the row of the strain equation (11)_2 that belongs to the dof T_i of the tension,

    0 <= T_i   perpendicular to   -g_i >= 0,

so that an element is as long as its tension says, or slack: shorter, and without tension.  Written as one equation,

    max(g_i, -c_i T_i) = 0,   c_i > 0,

and solved by Newton with the generalised derivative of the maximum, an active-set method: a row is that of the
two-sided law where g_i > -c_i T_i, and T_i = 0 elsewhere.  The solution does not depend on c_i.  T_h is nonnegative
wherever the basis of the tension is, that is everywhere for tension degrees 0 and 1; for higher degrees at its nodes.
"""

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from ..elsewhere import MPI


@dataclass(frozen=True)
class OneSidedRows:
    """Local rows of the tension that this rank owns, and sizes of each.

    weights: about the integral of a basis function [m].  inertia: mass per length times the square of an element's
    size [kg m], or None at rest.  compliance: 1/EA [1/N].  rest: strain per tension at rest [1/N].
    """

    rows: np.ndarray
    weights: np.ndarray
    inertia: np.ndarray | None
    compliance: np.ndarray | float
    rest: np.ndarray | float


class TensionOnly:
    """The law of a System whose rows of the tension are one-sided."""

    def __init__(self, rows: OneSidedRows):
        self._of, self.rows = rows, rows.rows.astype(PETSc.IntType)
        count = len(self.rows)
        self.slack = np.zeros(count, dtype=bool)  #: which rows hold T = 0 at the latest evaluation
        self.slack_before = np.zeros(count, dtype=bool)  #: ... and did in the latest matrix
        self.c = np.zeros(count)

    def attach(self, system):
        """Be the law of this System."""
        self.u, self._comm = system.u, system.comm
        system.A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
        self.diagonal = system.numbering.vector()
        place = np.empty(system.size, dtype=np.int64)
        place[system.order] = np.arange(len(system.order))
        self.places = place[self.rows]

    def resize(self, rows: OneSidedRows):
        """Other sizes of the same rows."""
        self._of = rows

    def set_scales(self, gamma):
        """c_i is the strain that a unit of tension causes: elastic, and by the motion of a step of size 1/gamma.

        Then g_i > -c_i T_i asks whether the tension of the coming iterate is positive rather than the present strain.
        """
        of = self._of
        strain = of.rest if of.inertia is None else of.compliance + 2 / (of.inertia * gamma**2)
        self.c[:] = of.weights * strain

    def change_residual(self, b):
        """Rows of the tension become those of the maximum."""
        g, bound = b[self.rows], -self.c * self.u[self.rows]
        self.slack[:] = ~(g > bound)
        b[self.rows] = np.where(self.slack, bound, g)

    def change_matrix(self, A):
        """Slack rows become -c_i."""
        slack = self.slack
        self.slack_before[:] = slack
        A.zeroRowsLocal(self.rows[slack], diag=0.0)
        A.getDiagonal(self.diagonal)
        values = self.diagonal.array
        values[self.places[slack]] = -self.c[slack]
        self.diagonal.setArray(values)
        A.setDiagonal(self.diagonal)

    def unsettled(self, converged) -> bool:
        """Whether on any rank that takes itself for converged the rows are not those of the last increment."""
        changed = converged and bool(np.any(self.slack != self.slack_before))
        return self._comm.allreduce(changed, op=MPI.LOR)

    def destroy(self):
        """Give PETSc's objects back."""
        self.diagonal.destroy()
