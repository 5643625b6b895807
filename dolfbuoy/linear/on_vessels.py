"""Stiffness of the mooring of a vessel: what its lines answer to a small motion of it at rest, buoys following.

Held ends are no unknowns, so that their columns of K are central differences of the residual, whose error is of second
order in a motion of which the strains are small; the rest is condensed as for buoys.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from ..errors import InputError, SolveError
from ..scene import Scene
from .linearisation import Linearisation, free_rows, without_rates
from .stiffness import STIFF, Condensed, compliance, condensed, momenta_of, solved

#: Motion of an end for a difference, of the shortest element.
MOVED = 1e-5
#: Stiffness of buoys below this part of their largest is none: what turns or drifts freely does not pull.  The same
#: where the largest is that of an inextensible line.
NOTHING, BESIDE_RIGID = 1e-9, 1e-12


class OnVessel(NamedTuple):
    """name; pull (6,): force [N] and moment [N m] of its lines about its reference point at rest; stiffness (6, 6):
    forces and moments that hold a displacement or a turn, world axes."""

    name: str
    pull: NDArray[Any]
    stiffness: NDArray[Any]


def on_vessels(found: Linearisation) -> list[OnVessel]:
    """Matrices of all vessels, of each with the others held; on one rank alone.

    Raises SolveError if a line has no stiffness of its own.
    """
    without_rates(found.problem)
    try:
        K, buoys, nothing = csc_matrix(found.K), condensed(found), NOTHING
    except SolveError:
        # a taut inextensible line between what is held; with a buoy there, which follows, its compliance is no matter
        more = compliance(found, STIFF[0])
        K, buoys, nothing = csc_matrix(found.K + more), condensed(found, more), BESIDE_RIGID
    return [
        _of_vessel(found, lambda slopes: _following(buoys, K, slopes, nothing), vessel)
        for vessel in found.problem.scene.vessel or []
    ]


def refuse_directions(scene: Scene) -> None:
    """Raise InputError for a vessel that holds a line in a direction."""
    for vessel in scene.vessel or []:
        if any(end.clamp and _is_on(end, vessel) for piece in scene.network.pieces for end in piece.ends):
            raise InputError(
                f"vessel.{vessel.name}: it holds a line in a direction, whose moment its stiffness does not count; "
                "leave out from_end or to_end."
            )


class _Ends:
    """Ends of lines and take-offs on one vessel: their dofs (k, 3) and arms (k, 3) from its reference point [m]."""

    def __init__(self, found: Linearisation, vessel: Any):
        problem: Any = found.problem
        ends = []
        for k, piece in enumerate(problem.network.pieces):
            for i, end in enumerate(piece.ends):
                if _is_on(end, vessel):
                    ends.append(problem.lines.end_dofs[k][i])
        for device in problem.take_offs:
            pairs = zip(device.ends, device.holders, strict=True)
            ends += [np.arange(e.slice.start, e.slice.stop) for e, holder in pairs if _is_on(holder, vessel)]
        self.dofs = np.array(ends, dtype=int).reshape(-1, 3)
        shift = vessel.motion[0][1:4] if vessel.motion else np.zeros(3)
        self.arms = found.u[self.dofs] - (np.array(vessel.position) + shift)

    def moved(self, motion: int) -> NDArray[Any]:
        """Displacements (k, 3) of the ends for 1 m along an axis, or 1 rad about it."""
        e = np.eye(3)[motion % 3]
        return np.tile(e, (len(self.arms), 1)) if motion < 3 else np.cross(e, self.arms)

    def about(self, forces: NDArray[Any]) -> NDArray[Any]:
        """Forces and moments (6, n) of forces (3 k, n) at the ends."""
        at = forces.reshape(len(self.arms), 3, -1)
        return np.concatenate([at.sum(axis=0), np.cross(self.arms[:, :, None], at, axis=1).sum(axis=0)])


def _is_on(end: Any, vessel: Any) -> bool:
    return bool(end.held and (end.name or "").partition(".")[0] == vessel.name)


def _of_vessel(found: Linearisation, following: Callable[[NDArray[Any]], NDArray[Any]], vessel: Any) -> OnVessel:
    """following: of slopes (n, 6) of the residual, the unknowns that make up for them."""
    problem: Any = found.problem
    ends = _Ends(found, vessel)
    dofs = ends.dofs.ravel()
    h = MOVED * float(np.diff(problem.lines.cell_ends, axis=1).min())
    rows: Any = problem.system.rows_of_jacobian(dofs)()

    def residual(step: Any) -> NDArray[Any]:
        problem.system.u[:] = found.u
        problem.system.u[dofs] += step
        problem.system.publish()
        return np.array(problem.system.evaluate())

    slopes, direct = np.zeros((found.K.shape[0], 6)), np.zeros((len(dofs), 6))
    for motion in range(6):
        way = ends.moved(motion).ravel()
        step = h / max(np.abs(way).max(), 1e-9)  # all may be on the axis
        change = (residual(step * way) - residual(-step * way)) / (2 * step)
        slopes[:, motion], direct[:, motion] = free_rows(problem, change), change[dofs]
    forces = residual(0.0)[dofs]
    followers = following(slopes)
    stiffness = ends.about(rows @ followers + direct)
    for motion in range(3, 6):  # arms turn under the forces at rest
        turned = np.cross(ends.moved(motion), forces.reshape(-1, 3))
        stiffness[3:, motion] += turned.sum(axis=0)
    return OnVessel(vessel.name, -ends.about(forces[:, None])[:, 0], stiffness)


def _following(every: Condensed, K: Any, slopes: NDArray[Any], nothing: float) -> NDArray[Any]:
    """Unknowns (n, 6) that follow motions of which the residual has these slopes; buoys go where nothing pulls them."""
    inner = np.setdiff1d(np.arange(K.shape[0]), np.concatenate([[], *(body.places for body in every.bodies)]))
    followers = np.zeros_like(slopes)
    followers[inner] = -solved(K[np.ix_(inner, inner)], slopes[inner])
    if not every.bodies:
        return followers
    pulls = (slopes + K @ followers)[momenta_of(every.bodies)]
    arms = np.concatenate([body.arms for body in every.bodies])
    scaled = arms[:, None] * every.stiffness * arms
    moved = arms[:, None] * (np.linalg.pinv(scaled, nothing) @ (arms[:, None] * pulls))
    return np.asarray(followers - every.followers @ moved)
