"""Lines that were laid slack on a sea bed and pulled at their tops: friction along all that has moved.

What the tension T_0 at the touchdown s_0 can pull on has slid towards the top, the rest lies as it was laid:

    T(s) = max(T_0 - w (sin(alpha) + mu cos(alpha)) (s_0 - s), 0).

There friction holds on a stick length behind the places where the line was laid, so that its limit is reached, and is
left as soon as the line would come back.  A form with limit friction everywhere is wrong where the tension dies.
"""

import numpy as np

from ..errors import SolveError
from ..model.material import weight_per_length
from ..model.seabed import stick_length
from .relaxation import relax

ROUNDS, SETTLED = 30, 1e-7


def pull(problem) -> None:
    """From the equilibrium without friction at hand to that of pulled lines.  Raises SolveError."""
    lines, bed, system = problem.lines, problem.lines.bed, problem.system
    bed.begin(system.u)
    bed.rub(True)
    tensions = np.zeros(len(lines.lines))
    for _ in range(ROUNDS):
        before = tensions
        tensions = np.array([_hold_behind(problem, line) for line in range(len(lines.lines))])
        if np.abs(tensions - before).max() <= SETTLED * problem.typical_force:
            bed.accept(system.u)
            return
        relax(problem)
    raise SolveError(f"the friction of the pulled line at rest on the sea bed was not found in {ROUNDS} rounds")


def _hold_behind(problem, line):
    """Put r_a of a line where it was laid, or behind; returns T_0 [N], 0 if its start does not lie."""
    lines, bed, scene = problem.lines, problem.lines.bed, problem.scene
    found = bed.lying(problem.system.u, line)
    start = np.array(lines.lines[line].anchor(scene))
    if not found.length or bed.gap(start) > found.sag:
        return 0.0
    T = problem.tension_at(found.s, line)
    along = (found.touchdown - start) / np.linalg.norm(found.touchdown - start)
    rise = along[2] + scene.seabed.friction * bed.normal.value[2]
    fall = weight_per_length(scene, lines.sections[line]) * rise
    still = found.s - T / fall if fall > 0 else -np.inf
    at = lines.node_s - lines.begins[line]
    nodes = np.flatnonzero((lines.line_of_node == line) & (at <= found.s))
    s = at[nodes]
    slides = np.clip((s - still) / bed.spacing[nodes] + 0.5, 0.0, 1.0)  # the part of what a node stands for
    held = bed.held.x.array.reshape(-1, 3)
    held[nodes] = start + np.multiply.outer(s - stick_length(scene) * slides, along)
    return T
