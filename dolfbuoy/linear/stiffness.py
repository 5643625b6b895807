"""Restoring matrices of buoys about C: restoring forces of lines and hull for a small displacement from equilibrium.

In the rows of the momenta, K of the linearised equations is minus the derivative of the forces and torques about C.
All other unknowns follow the buoys' poses: S = K_bb - K_bi K_ii^-1 K_ib.

A taut inextensible line prevents motion of its buoy along it: K_ii is singular, and S infinite in that direction.
If it is given a very small compliance, S is limited by this in those directions, which identifies them, and unchanged
across them.

For a vessel it is the same, with buoys following: prescribed ends are not unknowns, so their columns of K are central
differences of the residual, with an error of second order in a motion with small strains; the rest is condensed as
for buoys.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix

from ..errors import InputError, SolveError
from ..scene import Scene
from .layout import Body, inextensible_tensions
from .linearisation import Equilibrated, Linearisation, free_rows, without_rates

#: Two axial stiffnesses to replace an infinite one, in typical forces of the scene; least factor (ideally ten) by which
#: rigid directions become stiffer; and the least stiffness of a rigid direction relative to that of a line.
STIFF, STIFFER, LEAST = (1e8, 1e9), 3.0, 1e-3
#: Condition of a scaled matrix above which it counts as singular: 5 of 16 digits would be left.
SINGULAR = 1e11


@dataclass
class Condensed:
    """Six motions of every buoy (columns, body by body), and the static response of all unknowns.

    stiffness (6 b, 6 b): forces and torques about C that hold them, N/m, N, N m by pairs of rows and columns.
    followers (unknowns, 6 b): all unknowns, with zero momenta of the buoys.
    """

    bodies: list[Body]
    stiffness: NDArray[Any]
    followers: NDArray[Any]


@dataclass
class Restoring:
    """Stiffness of the lines (mooring) and of all else (hull), (6 b, 6 b).  rigid: for each body orthonormal columns
    (6, k), with rotations at the radius of gyration, along which inextensible lines prevent motion; the matrices are
    meaningless in these directions.
    """

    bodies: list[Body]
    mooring: NDArray[Any]
    hull: NDArray[Any]
    rigid: list[NDArray[Any]]


def restoring(found: Linearisation) -> Restoring:
    """Stiffness of all buoys together; collective.  Raises SolveError if the lines have no stiffness of their own."""
    rigid = [np.zeros((6, 0)) for _ in found.bodies]
    if len(inextensible_tensions(found.problem)[0]):
        force = found.problem.typical_force
        soft, hard = (condensed(found, compliance(found, EA)) for EA in STIFF)
        moorings = [mooring_stiffness(found, every) for every in (soft, hard)]
        lines: Any = found.problem.lines
        least = LEAST * STIFF[1] * force / lines.longest
        for i, body in enumerate(found.bodies):
            before, after = (m[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] for m in moorings)
            (at_soft, _), (at_hard, vectors) = (np.linalg.eigh(body.scaled(block)) for block in (before, after))
            # stiffness grows as the compliance is reduced, and exceeds rounding
            rigid[i] = vectors[:, (at_hard > STIFFER * at_soft) & (at_hard > least)]
    if any(directions.shape[1] for directions in rigid):
        every, mooring = hard, moorings[1]
    else:
        every = condensed(found)
        mooring = mooring_stiffness(found, every)
    return Restoring(every.bodies, mooring, every.stiffness - mooring, rigid)


def compliance(found: Linearisation, EA: float) -> Any:
    """Matrix to be added to K that gives inextensible lines an axial stiffness EA, in typical forces of the scene."""
    places, sizes = inextensible_tensions(found.problem)
    shape = 2 * (found.K.shape[1],)
    return csr_matrix((-(sizes / (EA * found.problem.typical_force)), (places, places)), shape)


def condensed(found: Linearisation, more: Any = None) -> Condensed:
    """Condensed stiffness of all buoys together; the same on all ranks.  more: a matrix to be added to K.

    Raises SolveError if the lines have no stiffness of their own.
    """
    K, bodies = csc_matrix(found.whole[0] if more is None else found.whole[0] + more), found.bodies
    n, columns = K.shape[0], 6 * len(bodies)
    followers = np.zeros((n, columns))
    for i, body in enumerate(bodies):
        pose = body.poses()
        pose[[*range(3, 6), *range(10, 13)]] = 0.0  # at rest
        followers[body.places, 6 * i : 6 * i + 6] = pose
    inner = np.setdiff1d(np.arange(n), np.concatenate([body.places for body in bodies]) if bodies else [])
    if len(inner) and columns:
        followers[inner] = -solved(K[np.ix_(inner, inner)], K[inner] @ followers)
    return Condensed(bodies, K[momenta_of(bodies)] @ followers, followers)


def momenta_of(bodies: list[Body]) -> NDArray[Any]:
    """Rows (6 b,) of the momenta of bodies."""
    rows = [row for body in bodies for row in (*body.at.momentum, *body.at.angular_momentum)]
    return np.array(rows, dtype=int)


def solved(A: Any, b: NDArray[Any]) -> Any:
    """A^-1 b.  Raises SolveError if A is singular."""
    try:
        solve = Equilibrated(A)
        condition, x = solve.condition(), solve(b)
    except RuntimeError:
        condition, x = np.inf, b
    if not (condition < SINGULAR and np.isfinite(x).all()):
        raise SolveError(
            "the lines are slack or kinked, or hang in a fold that may turn about the vertical: held at their ends they"
            " have no stiffness of their own"
        )
    return x


def mooring_stiffness(found: Linearisation, every: Condensed) -> NDArray[Any]:
    """Stiffness (6 b, 6 b) due to the lines, from changes of their forces and of their levers about C."""
    total = np.zeros_like(every.stiffness)
    for hold in found.holds:
        i = 6 * [body.name for body in every.bodies].index(hold.body)
        change, turned = every.followers[hold.force_places], np.zeros((3, total.shape[1]))
        turned[:, i + 3 : i + 6] = np.column_stack([np.cross(e, hold.lever) for e in np.eye(3)])
        total[i : i + 3] -= change
        total[i + 3 : i + 6] -= np.cross(turned, hold.force, axis=0) + np.cross(hold.lever, change, axisb=0, axisc=0)
    return total


#: Displacement of an end for a finite difference, relative to the shortest element.
MOVED = 1e-5
#: Stiffness of buoys, relative to their largest, below which it is zero: for free rotation or drift.  BESIDE_RIGID: if
#: the largest is that of an inextensible line.
NOTHING, BESIDE_RIGID = 1e-9, 1e-12


class OnVessel(NamedTuple):
    """Name of a vessel; pull (6,): force [N] and moment [N m] of its lines about its reference point in equilibrium;
    stiffness (6, 6): forces and moments that hold a displacement or rotation, in world axes."""

    name: str
    pull: NDArray[Any]
    stiffness: NDArray[Any]


def on_vessels(found: Linearisation) -> list[OnVessel]:
    """Matrices of all vessels, for each with the others held; on one rank only.

    Raises SolveError if a line has no stiffness of its own.
    """
    without_rates(found.problem)
    try:
        K, buoys, nothing = csc_matrix(found.K), condensed(found), NOTHING
    except SolveError:
        # a taut inextensible line between fixed ends; if there is a buoy, which follows, its compliance does not matter
        more = compliance(found, STIFF[0])
        K, buoys, nothing = csc_matrix(found.K + more), condensed(found, more), BESIDE_RIGID
    return [
        _of_vessel(found, lambda slopes: _following(buoys, K, slopes, nothing), vessel)
        for vessel in found.problem.scene.vessel or []
    ]


def refuse_directions(scene: Scene) -> None:
    """Raise InputError for a vessel with a clamped line."""
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
        """Resultant forces and moments (6, n) of forces (3 k, n) at the ends."""
        at = forces.reshape(len(self.arms), 3, -1)
        return np.concatenate([at.sum(axis=0), np.cross(self.arms[:, :, None], at, axis=1).sum(axis=0)])


def _is_on(end: Any, vessel: Any) -> bool:
    return bool(end.held and (end.name or "").partition(".")[0] == vessel.name)


def _of_vessel(found: Linearisation, following: Callable[[NDArray[Any]], NDArray[Any]], vessel: Any) -> OnVessel:
    """Matrices of one vessel; following: derivatives (n, 6) of the residual -> response of the unknowns."""
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
    for motion in range(3, 6):  # rotation of the arms under the static forces
        turned = np.cross(ends.moved(motion), forces.reshape(-1, 3))
        stiffness[3:, motion] += turned.sum(axis=0)
    return OnVessel(vessel.name, -ends.about(forces[:, None])[:, 0], stiffness)


def _following(every: Condensed, K: Any, slopes: NDArray[Any], nothing: float) -> NDArray[Any]:
    """Response (n, 6) of the unknowns to motions with these derivatives of the residual; buoys move to equilibrium."""
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
