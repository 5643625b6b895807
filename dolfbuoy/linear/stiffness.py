"""Restoring matrices of buoys about C: what lines and hull answer to a small displacement of a buoy at rest.

K of the linearised equations has in the rows of the momenta minus the forces and torques about C.  All other unknowns
follow the buoys' poses: S = K_bb - K_bi K_ii^-1 K_ib.

An inextensible line that is taut lets its buoy not move along it: K_ii is singular, and S infinite in that direction.
With a very small compliance in its place S is as large as that makes it, which shows those directions; across them it
is what it is without.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix

from ..errors import SolveError
from .layout import Body, inextensible_tensions
from .linearisation import Equilibrated, Linearisation

#: Axial stiffness in the place of an infinite one, in typical forces of the scene; twice, and by how much directions
#: that are rigid become stiffer, of what could be ten times.  Part of that of a line below which nothing is rigid.
STIFF, STIFFER, LEAST = (1e8, 1e9), 3.0, 1e-3
#: Condition of a scaled matrix from which on it is singular but for rounding: of 16 digits 5 would be left.
SINGULAR = 1e11


@dataclass
class Condensed:
    """Six motions of every buoy (columns, body after body), and what follows them at rest.

    stiffness (6 b, 6 b): forces and torques about C that hold them, N/m, N, N m by pairs of rows and columns.
    followers (unknowns, 6 b): all unknowns, the buoys' momenta zero.
    """

    bodies: list[Body]
    stiffness: NDArray[Any]
    followers: NDArray[Any]


@dataclass
class Restoring:
    """mooring, hull (6 b, 6 b): stiffness of the lines, and of all else.  rigid: of each body orthonormal columns
    (6, k), turns at the radius of gyration, along which inextensible lines let it not move; what the matrices have
    there is only as large as rounding lets it be, and means nothing.
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
            # as much larger as the compliance was smaller, and above rounding
            rigid[i] = vectors[:, (at_hard > STIFFER * at_soft) & (at_hard > least)]
    if any(directions.shape[1] for directions in rigid):
        every, mooring = hard, moorings[1]
    else:
        every = condensed(found)
        mooring = mooring_stiffness(found, every)
    return Restoring(every.bodies, mooring, every.stiffness - mooring, rigid)


def compliance(found: Linearisation, EA: float) -> Any:
    """Matrix to be added to K, by which inextensible lines have an axial stiffness, in typical forces of the scene."""
    places, sizes = inextensible_tensions(found.problem)
    shape = 2 * (found.K.shape[1],)
    return csr_matrix((-(sizes / (EA * found.problem.typical_force)), (places, places)), shape)


def condensed(found: Linearisation, more: Any = None) -> Condensed:
    """Condensed stiffness of all buoys together; the same on all ranks.  more: a matrix that is added to K.

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
    """(6 b, 6 b): the part of the stiffness that lines have, by their forces and by the levers these have about C."""
    total = np.zeros_like(every.stiffness)
    for hold in found.holds:
        i = 6 * [body.name for body in every.bodies].index(hold.body)
        change, turned = every.followers[hold.force_places], np.zeros((3, total.shape[1]))
        turned[:, i + 3 : i + 6] = np.column_stack([np.cross(e, hold.lever) for e in np.eye(3)])
        total[i : i + 3] -= change
        total[i + 3 : i + 6] -= np.cross(turned, hold.force, axis=0) + np.cross(hold.lever, change, axisb=0, axisc=0)
    return total
