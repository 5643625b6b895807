"""Forces that hold the upper ends of lines, as rows below the linearised equations.

What holds a line on a buoy is an unknown.  At an end that is given, or at a joint, it is the residual of Eq. (11)_1 of
that line there, which is no equation of the system: its slopes stand in rows of their own.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, vstack

from .linearisation import Linearisation, free_rows, jacobian, without_rates


class WithReactions:
    """K, E and M (n + 3 r, n) of n unknowns and r such ends; on one rank alone.

    ends: cable -> (its force at rest [N], its three rows).
    """

    def __init__(self, found: Linearisation):
        problem: Any = found.problem
        self.found = found
        self.size, self._dofs, self.ends = found.K.shape[1], np.zeros(0, dtype=int), dict[int, Any]()
        without_rates(problem)
        residual = problem.system.evaluate()
        for cable in range(len(problem.network.cables)):
            piece = problem.network.last_of(cable)
            if problem.network.pieces[piece].ends[1].kind in ("fixed", "prescribed", "joint"):
                dofs = problem.lines.top_dofs(piece)
                self.ends[cable] = residual[dofs].copy(), self.size + len(self._dofs) + np.arange(3)
                self._dofs = np.concatenate([self._dofs, dofs])
        self._rows: Any = problem.system.rows_of_jacobian(self._dofs) if self.ends else None
        self.K = self.jacobian(0.0, 0.0)
        self.E, self.M = self.jacobian(1.0, 0.0) - self.K, self.jacobian(0.0, 1.0) - self.K

    @property
    def rows(self) -> int:
        """Equations and reactions."""
        return int(self.size + len(self._dofs))

    def jacobian(self, gamma_v: float, gamma_a: float, velocities: NDArray[Any] | None = None) -> csr_matrix:
        """K + gamma_v E + gamma_a M, as `linearisation.jacobian`."""
        inner = jacobian(self.found.problem, gamma_v, gamma_a, velocities)
        return csr_matrix(vstack([inner, self._rows()])) if self.ends else inner

    def of_residual(self, residual: NDArray[Any]) -> NDArray[Any]:
        """Its rows of a local residual."""
        return np.concatenate([free_rows(self.found.problem, residual), residual[self._dofs]])
