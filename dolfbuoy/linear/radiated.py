"""Radiation memory of buoys in linear motion: forces -K v on the five velocities of each (`forms.radiation`).

Modes are found without memory, with A_inf alone, and followed by continuation in the memory, with Newton's method on
(K + lambda E + lambda^2 M + share G(lambda)) x = 0, because the memory states have roots of their own, which are not
modes of a buoy.

At a frequency K* = B - i omega (A - A_inf) of the file is used, for motions Re[X exp(-i omega t)]; for exp(lambda t)
that of the states, K(lambda) = out (lambda - rate)^-1 into.  A_inf is already in the linearised equations.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.sparse import csr_matrix

from ..errors import SolveError
from ..model.potential_flow import Coefficients, coefficients_of, on_five, plane_and_heave
from ..model.rigid import rotation_of
from .layout import Body
from .linearisation import Equilibrated, Linearisation

#: Shares of the memory in the continuation; largest number of iterations for each, and final change of the root.
SHARES, MOST, SETTLED = (0.25, 0.5, 0.75, 1.0), 30, 1e-10
#: Iterations, least cosine of the vectors and largest change of the root to accept one step to the full memory.
FEW, ALIKE, NEAR = 6, 0.99, 0.1


class Radiated:
    """Radiation memory of all buoys of a linearised scene; `there`: True if any has one.

    Matrices (rows of equations, unknowns) are those of the whole scene.
    """

    def __init__(self, found: Linearisation):
        self.found = found
        scene, self.size = found.problem.scene, found.K.shape[1]
        buoys = scene.network.buoys
        self._bodies = [(body, buoys[body.name]) for body in found.bodies if buoys[body.name].potential_flow]
        self._bodies = self._bodies if scene.sea is not None else []
        self._known = [(_places(body), coefficients_of(scene, b)) for body, b in self._bodies]
        self._states = [plane_and_heave(scene, b) for _, b in self._bodies]
        self._splines = [_over_frequency(c) for _, c in self._known]
        self.there = bool(self._known)

    def at_frequency(self, omega: float) -> csr_matrix:
        """K* at an angular frequency [rad/s]; outside the file's range from the states."""
        found = []
        for (_, c), states, spline in zip(self._known, self._states, self._splines, strict=True):
            inside = c.omega[0] <= omega <= c.omega[-1]
            found.append(spline(omega) if inside else states(omega).conj())
        return self._matrix(found)

    def at_root(self, root: complex) -> csr_matrix:
        """K(lambda) of the states."""
        return self._matrix([states(-1j * root) for states in self._states])

    def followed(self, root: complex, vector: NDArray[Any]) -> tuple[complex, NDArray[Any], float]:
        """(root, vector, backward error) of a mode with memory, continued from one without.

        Raises SolveError if it is lost.
        """
        K, E, M = self.found.whole
        first, before = vector / np.linalg.norm(vector), root
        found = self._settled(root, first, 1.0, FEW)
        near = found is not None and abs(found[0] - before) < NEAR * abs(before)
        if found is None or not near or abs(first.conj() @ found[1]) < ALIKE:
            found = before, first
            for share in SHARES:
                if (found := self._settled(*found, share, MOST)) is None:
                    raise SolveError(f"a mode next to {root:.3g}/s is lost among the states of the radiation memory")
        root, x = found
        parts = [K, abs(root) * E, abs(root) ** 2 * M, self.at_root(root)]
        size = sum(abs(A) for A in parts[1:]) + abs(K)
        rows = np.maximum(size.max(axis=1).toarray().ravel(), 1e-300)
        left = K @ x + root * (E @ x) + root**2 * (M @ x) + parts[-1] @ x
        return root, x, float((np.abs(left) / rows).max() / (size @ np.abs(x) / rows).max())

    def _settled(self, root: complex, x: NDArray[Any], share: float, most: int) -> tuple[complex, NDArray[Any]] | None:
        """(root, vector) with a share of the memory, by Newton's method; None if not converged in `most` iterations."""
        K, E, M = self.found.whole
        for _ in range(most):
            G, step = self.at_root(root), 1e-6 * abs(root)
            slope = (self.at_root(root + step) - G) / step
            try:
                solve = Equilibrated(K + root * E + root**2 * M + share * G)
                u = solve(((E + 2 * root * M + share * slope) @ x)[:, None])[:, 0]
            except RuntimeError:  # singular: x is the eigenvector
                return root, x
            change, x = 1 / (x.conj() @ u), u / np.linalg.norm(u)
            root -= change
            if abs(change) < SETTLED * abs(root):
                return root, x
        return None

    def _matrix(self, kernels: list[NDArray[Any]]) -> csr_matrix:
        total = csr_matrix((self.size, self.size), dtype=complex)
        for ((places, rows, columns), _), K in zip(self._known, kernels, strict=True):
            block = rows @ on_five(K) @ columns
            where = np.repeat(places, len(places)), np.tile(places, len(places))
            total = total + csr_matrix((block.ravel(), where), total.shape)
        return total


def _over_frequency(c: Coefficients) -> Any:
    """K* (3, 3) over omega."""
    return CubicSpline(c.omega, c.damping - 1j * c.omega[:, None, None] * (c.added_mass - c.at_once))


def _places(body: Body) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Places of the momenta, matrix (6, 5) from the five forces to their rows, matrix (5, 6) to the five velocities."""
    d, inverse = rotation_of(body.orientation)[:, 2], np.linalg.inv(body.inertia)
    rows, columns = np.zeros((6, 5)), np.zeros((5, 6))
    rows[:3, :3], columns[:3, :3] = np.eye(3), np.eye(3) / body.mass
    for k in range(2):
        rows[3:, 3 + k] = np.cross(d, np.eye(3)[k])
        columns[3 + k, 3:] = rows[3:, 3 + k] @ inverse  # (omega x d)_k = omega . (d x e_k)
    return np.concatenate([body.at.momentum, body.at.angular_momentum]), rows, columns
