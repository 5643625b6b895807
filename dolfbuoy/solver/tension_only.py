"""The tension-only law (a rope cannot push) as a complementarity of the discrete tension.

With g_i the row of the strain equation (11)_2 for the dof T_i of the tension,

    0 <= T_i   perpendicular to   -g_i >= 0,

so an element has the length given by its tension, or is slack: shorter, and without tension.  As one equation,

    max(g_i, -c_i T_i) = 0,   c_i > 0,

this is solved by Newton with the generalised derivative of the maximum, an active-set method: a row is that of the
two-sided law where g_i > -c_i T_i, and T_i = 0 elsewhere.  The solution does not depend on c_i.  T_h is nonnegative
wherever the basis of the tension is: everywhere for tension degrees 0 and 1, at the nodes for higher degrees.
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
    """Local rows of the tension owned by this rank, with typical sizes.

    weights: approximate integral of a basis function [m].  inertia: mass per length times the square of the element
    size [kg m], or None in statics.  compliance: 1/EA [1/N].  rest: strain per tension in statics [1/N].
    """

    rows: Array
    weights: Array
    inertia: Array | None
    compliance: Array | float
    rest: Array | float


class TensionOnly:
    """The law of a System with one-sided tension rows."""

    def __init__(self, rows: OneSidedRows) -> None:
        self._of, self.rows = rows, rows.rows.astype(PETSc.IntType)
        count = len(self.rows)
        self.slack = np.zeros(count, dtype=bool)  #: rows with T = 0 at the latest evaluation
        self.slack_before = np.zeros(count, dtype=bool)  #: rows with T = 0 in the latest matrix
        self.c = np.zeros(count)

    def attach(self, system: "System") -> None:
        """Attach the law to a System."""
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
        """Set other typical sizes for the same rows."""
        self._of = rows

    def set_scales(self, gamma: float) -> None:
        """Set c_i to the strain caused by unit tension, elastic and by motion during a step of size 1/gamma.

        Then g_i > -c_i T_i tests the tension of the next iterate rather than the present strain.
        """
        of = self._of
        strain = of.rest if of.inertia is None else of.compliance + 2 / (of.inertia * gamma**2)
        self.c[:] = of.weights * strain

    def change_residual(self, b: Array) -> None:
        """Replace tension rows by those of the maximum."""
        core().lib.change_residual(self.described, address(b))

    def change_matrix(self, A: PETSc.Mat) -> None:
        """Replace slack rows by -c_i on the diagonal."""
        check(core().lib.change_matrix(self.described, core().ffi.cast("Mat", A.handle)))

    def destroy(self) -> None:
        """Free PETSc objects."""
        self._diagonal.destroy()
