"""Natural modes of a scene about its equilibrium, the slowest first, each named after its main motions."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.sparse import block_diag, csr_matrix, diags, identity

from ..errors import InputError
from ..solver.quadratic import RESTARTS, lowest_pairs
from .layout import Body, half_turns
from .linearisation import Linearisation
from .moving import Moving, named
from .radiated import Radiated

#: Tension relative to the typical force of the scene below which a line is slack, and angle between two segments above
#: which it is kinked [deg].
LEAST_TENSION, KINK = 1e-6, 90.0
#: Relative difference below which drifts are the same.
ALIKE = 1e-3
#: Relative difference below which roots are equal, so that their vectors may be combined.
SAME = 1e-7
#: Growth relative to |lambda| below which it is rounding error.
ROUNDING = 1e-7


@dataclass
class Mode:
    """Mode x exp(lambda t): `root` is lambda [1/s], `vector` x, all unknowns, with largest displacement 1 m or 1 rad.

    kind: "oscillates", "overdamped" (lambda < 0), "drifts" (0: unrestrained), "leaves" (lambda > 0) or "grows".
    residual: backward error of the pair.  shares: shares of kinetic energy by motion.
    """

    root: complex
    vector: NDArray[Any]
    residual: float
    kind: str
    shares: dict[str, float]
    name: str

    @property
    def omega(self) -> float:
        """|lambda| [rad/s]."""
        return abs(self.root)

    @property
    def damping_ratio(self) -> float:
        """-Re(lambda)/|lambda|; nan if lambda = 0."""
        return -self.root.real / abs(self.root) if self.root else np.nan

    @property
    def period(self) -> float:
        """2 pi/|lambda| [s] of an oscillating mode, else nan."""
        return 2 * np.pi / abs(self.root) if self.root.imag else np.nan


def lowest_modes(
    found: Linearisation, number: int = 10, direction_deg: float = 0.0, restarts: int = RESTARTS
) -> list[Mode]:
    """The `number` modes of smallest |lambda|, or all if there are fewer; collective, the same on all ranks.

    direction_deg: direction of surge, from x.  restarts: see `Quadratic`.  Raises InputError for a state about which
    there is no linear motion, SolveError if the solver fails.
    """
    check_smooth(found)
    comm = found.problem.comm
    quaternions = UnitQuaternions(found.bodies, found.K.shape[1])
    first = comm.exscan(found.K.shape[0]) or 0
    K, E, M = quaternions.without_lengths(first, found.K, found.E, found.M)
    pairs = lowest_pairs(comm, K, E, M, number + 6 * len(found.bodies), restarts)
    moving = Moving(found, direction_deg)
    drifting = _drifting(moving, quaternions.as_they_were(pairs.at_zero()))
    unheld = pairs.residuals_at_zero(quaternions.exchanged(drifting))
    modes = [mode_of(moving, 0j, x, residual) for x, residual in zip(drifting.T, unheld, strict=True)]
    shown = np.flatnonzero(~pairs.zero)
    roots, vectors = pairs.roots[shown], quaternions.as_they_were(pairs.vectors[:, shown])
    apart = np.flatnonzero(np.abs(np.diff(roots)) > SAME * np.abs(roots[1:])) + 1
    for same in (rows for rows in np.split(np.arange(len(roots)), apart) if len(rows) > 1):
        vectors[:, same] = moving.separated(vectors[:, same])
    radiated = Radiated(found)
    for root, x, residual in zip(roots, vectors.T, pairs.residuals[shown], strict=True):
        own = radiated.followed(complex(root), x) if radiated.there else (complex(root), x, residual)
        modes.append(mode_of(moving, *own))
    return sorted(modes, key=lambda mode: mode.omega)[:number] if radiated.there else modes[:number]


def _drifting(moving: Moving, vectors: NDArray[Any]) -> Any:
    """Columns of one drift each, from the vectors with lambda = 0, which include two equal ones per drift."""
    vectors = moving.at_rest(np.hstack([vectors.real, vectors.imag]))
    motions = moving.motions(vectors)
    if not motions.size:
        return vectors[:, :0]
    left, values, right = np.linalg.svd(motions, full_matrices=False)
    count = int(np.count_nonzero(values > ALIKE * values[0]))
    leading = qr(left[:, :count].T, pivoting=True)[2][:count]  # each drift without the leading motion of the others
    return vectors @ (right[:count].T / values[:count]) @ np.linalg.inv(left[leading, :count])


def mode_of(moving: Moving, root: complex, vector: NDArray[Any], residual: float) -> Mode:
    """The mode of a root and its vector among all unknowns."""
    vector = moving.sized(vector)
    shares = moving.shares(vector)
    if root.imag == 0:
        kind = "drifts" if root == 0 else "overdamped" if root.real < 0 else "leaves"
    else:
        kind = "grows" if root.real > ROUNDING * abs(root) else "oscillates"
    return Mode(root, vector, float(residual), kind, shares, named(shares, moving.half_waves(vector)))


def check_smooth(found: Linearisation) -> None:
    """Refuse a line that is slack or kinked at rest.  Raises InputError with one sentence."""
    if (said := slack_in(found)) is not None:
        raise InputError(f"{said}, and small motions no modes.")
    for line in found.lines:
        cosines = (line.tangents[1:] * line.tangents[:-1]).sum(axis=1)
        if cosines.min(initial=1.0) < np.cos(np.radians(KINK)):
            s, article = line.s[1 + int(cosines.argmin())], "" if len(found.lines) > 1 else "the "
            raise InputError(
                f"At rest {article}{line.name} is kinked at s = {s:.4g} m, where it turns by "
                f"{np.degrees(np.arccos(np.clip(cosines.min(), -1, 1))):.0f} degrees from one piece to the next: its "
                "fold is finer than its elements, and its modes would be those of the elements; take more of them."
            )


def slack_in(found: Linearisation) -> str | None:
    """Beginning of a message about a line that is slack at rest; None if there is none."""
    problem = found.problem
    smallest = np.inf if problem.lines is None else problem.smallest_tension(of_rods=False)
    if smallest > LEAST_TENSION * problem.typical_force:
        return None
    return f"At rest a line is slack (smallest tension {smallest:.3g} N): its equations have no slope there"


class UnitQuaternions:
    """Transformation of the quaternion rows and columns of some bodies; size: number of all unknowns."""

    def __init__(self, bodies: list[Body], size: int):
        blocks, self._kept, done = [], np.ones(size), 0
        for body in bodies:
            place = body.at.orientation[0]
            blocks += [identity(place - done), np.column_stack([body.orientation, 2 * half_turns(body.orientation)])]
            self._kept[place], done = 0.0, place + 4
        self._turn = csr_matrix(block_diag([*blocks, identity(size - done)]))

    def without_lengths(self, first: int, *matrices: Any) -> list[csr_matrix]:
        """The rows of a rank, from `first` on, of K and of the matrices multiplied by powers of lambda, transformed.

        All rows of a body are on one rank.
        """
        rows = slice(first, first + matrices[0].shape[0])
        left, kept = diags(self._kept[rows]) @ self._turn.T[rows, rows], diags(self._kept)
        K, *others = (left @ A @ self._turn @ kept for A in matrices)
        return [csr_matrix(A) for A in (K + diags(1 - self._kept).tocsr()[rows], *others)]

    def exchanged(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Columns of all unknowns, transformed."""
        return np.asarray(self._turn.T @ vectors)

    def as_they_were(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Columns of all unknowns, transformed back."""
        return np.asarray(self._turn @ vectors)
