"""Lines that were laid slack on a sea bed and pulled at their tops: friction along all that has moved.

What the tension T_0 at the touchdown s_0 can pull on has slid towards the top, the rest lies as it was laid:

    T(s) = max(T_0 - w (sin(alpha) + mu cos(alpha)) (s_0 - s), 0).

There friction holds on a stick length behind the places where the line was laid, so that its limit is reached, and is
left as soon as the line would come back.  A form with limit friction everywhere is wrong where the tension dies.
"""

import numpy as np

from ..model.seabed import stick_length
from .relaxation import relax

ROUNDS = 3  # friction on the bed changes T_0 by less than a hundredth, and that its reach


def pull(problem) -> None:
    """From the equilibrium without friction at hand to that of pulled lines.  Raises SolveError."""
    bed = problem.lines.bed
    bed.rub(True)
    for _ in range(ROUNDS):
        bed.hold(_behind(problem))
        relax(problem)
    bed.accept(problem.system.u)


def _behind(problem):
    """Places (cells, points, 3) where lines were laid that lie from a held start on, or behind; else where they are."""
    lines, bed, scene = problem.lines, problem.lines.bed, problem.scene
    places = bed.points.of(problem.system.u[lines.node_dofs])
    for k, piece in enumerate(lines.pieces):
        held, found = piece.ends[0].top, bed.lying(problem.system.u, k)
        if held is None or not found.length or bed.gap(np.array(held.position)) > found.sag:
            continue
        start = np.array(held.position)
        along = (found.touchdown - start) / np.linalg.norm(found.touchdown - start)
        rise = along[2] + scene.seabed.friction * bed.normal.value[2]
        fall = lines.weight_of(k) * rise
        still = found.s - problem.tension_at(found.s, k) / fall if fall > 0 else -np.inf
        s = bed.points.s - lines.begins[k]
        laid = start + np.multiply.outer(s - stick_length(scene) * (s > still), along)
        lies = (s <= found.s) & (bed.points.line == k)[:, None]
        places = np.where(lies[..., None], laid, places)
    return places
