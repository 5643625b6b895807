"""Modes of the linearised equations: (K + lambda E + lambda^2 M) x = 0.

About a shift sigma, mu = 1/(lambda - sigma) are eigenvalues of a standard problem of twice the size, whose operator
takes one solve with K + sigma E + sigma^2 M: unknowns without mass and constraints, whose eigenvalues are infinite, all
go to mu = 0.  With a buoy K is singular (|q|, yaw, the place of a free buoy), so no shift may be 0.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import diags
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs, splu

from ..errors import SolveError
from .linearisation import Linearisation

#: Up to this size of the standard problem all its eigenvalues are computed.
DENSE = 500
#: Of ARPACK, which needs some tens at most where it converges.
RESTARTS = 60


def modes_near(found: Linearisation, shift: complex, count: int = 20) -> tuple[NDArray[Any], NDArray[Any]]:
    """Eigenvalues next to a shift, the nearest first, and their vectors (unknowns of `system.order`, modes), physical.

    At least `count` of them if there are as many; sum of squares of a vector in the system's scales is 1.
    """
    system, n = found.problem.system, len(found.problem.system.order)
    scales = diags(system.unknown_scales)
    K, E, M = (diags(system.row_scales) @ matrix @ scales for matrix in (found.K, found.E, found.M))
    try:
        solve = splu((K + shift * E + shift**2 * M).astype(complex).tocsc()).solve
    except RuntimeError:
        raise SolveError(f"no modes next to {shift:.3g}/s: the linearised equations are singular there") from None

    def invert(v: NDArray[Any]) -> NDArray[Any]:
        """(C - shift B)^-1 B v of the companion form in (x, lambda x)."""
        x, y = v[:n], v[n:]
        first = -solve(E @ x + shift * (M @ x) + M @ y)
        return np.concatenate([first, x + shift * first])

    if 2 * n <= DENSE:
        mu, vectors = np.linalg.eig(invert(np.eye(2 * n, dtype=complex)))
    else:
        operator = LinearOperator((2 * n, 2 * n), invert, dtype=complex)
        start = np.random.default_rng(0).standard_normal(2 * n).astype(complex)
        try:
            mu, vectors = eigs(operator, k=min(count, 2 * n - 2), which="LM", v0=start, tol=1e-10, maxiter=RESTARTS)
        except ArpackError as error:
            mu, vectors = getattr(error, "eigenvalues", []), getattr(error, "eigenvectors", None)
            if not len(mu):
                raise SolveError(f"no modes next to {shift:.3g}/s: ARPACK finds none in {RESTARTS} restarts") from None
    order = [k for k in np.argsort(-np.abs(mu)) if abs(mu[k]) > 1e-12 * np.abs(mu).max()]
    x = vectors[:n, order]
    x = x / np.linalg.norm(x, axis=0)
    return shift + 1 / mu[order], scales @ x
