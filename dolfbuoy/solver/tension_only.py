"""A rope cannot push: the tension-only law as a complementarity of the discrete tension.

With g_i the row of the strain equation (11)_2 that belongs to the dof T_i of the tension,

    0 <= T_i   perpendicular to   -g_i >= 0,

so that an element has the length of its tension, or is slack: shorter, and without tension.  Written as one equation,

    max(g_i, -c_i T_i) = 0,   c_i > 0,

and solved by Newton with the generalised derivative of the maximum, an active-set method: a row is that of the
two-sided law where g_i > -c_i T_i, and T_i = 0 elsewhere.  The solution does not depend on c_i.  T_h is nonnegative
wherever the basis of the tension is, that is everywhere for tension degrees 0 and 1; for higher degrees at its nodes.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from petsc4py import PETSc

from . import Array
from .c_code import address, check, core

if TYPE_CHECKING:
    from .system import System


@dataclass(frozen=True)
class OneSidedRows:
    """Local rows of the tension that this rank owns, and sizes of each.

    weights: about the integral of a basis function [m].  inertia: mass per length times the square of an element's
    size [kg m], or None at rest.  compliance: 1/EA [1/N].  rest: strain per tension at rest [1/N].
    """

    rows: Array
    weights: Array
    inertia: Array | None
    compliance: Array | float
    rest: Array | float


class TensionOnly:
    """The law of a System whose rows of the tension are one-sided."""

    def __init__(self, rows: OneSidedRows) -> None:
        self._of, self.rows = rows, rows.rows.astype(PETSc.IntType)
        count = len(self.rows)
        self.slack = np.zeros(count, dtype=bool)  #: which rows hold T = 0 at the latest evaluation
        self.slack_before = np.zeros(count, dtype=bool)  #: ... and did in the latest matrix
        self.c = np.zeros(count)

    def attach(self, system: "System") -> None:
        """Be the law of this System."""
        system.A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
        self._diagonal, ffi = system.numbering.vector(), core().ffi
        place = np.empty(system.size, dtype=np.int64)
        place[system.order] = np.arange(len(system.order))
        arrays = {"places": place[self.rows], "c": self.c, "u": system.u}
        arrays |= {"slack": self.slack, "slack_before": self.slack_before}
        rows = {"rows": self.rows, "zeroed": np.zeros_like(self.rows)}
        self._alive = arrays, rows
        found = {name: address(array) for name, array in arrays.items()}
        found |= {name: ffi.cast("PetscInt *", array.ctypes.data) for name, array in rows.items()}
        diagonal = ffi.cast("Vec", self._diagonal.handle)
        self.described = ffi.new("one_sided *", {**found, "count": len(self.rows), "diagonal": diagonal})

    def resize(self, rows: OneSidedRows) -> None:
        """Other sizes of the same rows."""
        self._of = rows

    def set_scales(self, gamma: float) -> None:
        """c_i is the strain that a unit of tension causes: elastic, and by the motion of a step of size 1/gamma.

        Then g_i > -c_i T_i tests the tension of the coming iterate rather than the present strain.
        """
        of = self._of
        strain = of.rest if of.inertia is None else of.compliance + 2 / (of.inertia * gamma**2)
        self.c[:] = of.weights * strain

    def change_residual(self, b: Array) -> None:
        """Rows of the tension become those of the maximum."""
        core().lib.change_residual(self.described, address(b))

    def change_matrix(self, A: PETSc.Mat) -> None:
        """Slack rows become -c_i."""
        check(core().lib.change_matrix(self.described, core().ffi.cast("Mat", A.handle)))

    def destroy(self) -> None:
        """Give PETSc's objects back."""
        self._diagonal.destroy()
