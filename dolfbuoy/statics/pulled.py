"""Lines that were laid slack on a sea bed and pulled at their tops: friction along all that has moved.

What the tension at the touchdown T_0 cannot pull on lies as it was laid; up to there the line has slid towards its top,

    T(s) = max(T_0 - w (sin(alpha) + mu cos(alpha)) (s_0 - s), 0),

so that r_a stands behind it by more than the way on which friction builds up.  A form with limit friction everywhere
would be wrong where the tension dies.
"""

import numpy as np

from ..errors import SolveError
from ..model.material import weight_per_length
from ..model.seabed import stick_length
from .on_bed import Lying

#: Of the stick length: how far r_a stands behind what slides, beyond what the elements' errors could take back.
BEHIND = 3.0
ROUNDS, SETTLED = 30, 1e-7


def pull(problem) -> None:
    """From the equilibrium without friction at hand to that of pulled lines.  Raises SolveError."""
    lines, bed, system = problem.lines, problem.lines.bed, problem.system
    bed.begin(system.u)
    tensions = np.zeros(len(lines.lines))
    for _ in range(ROUNDS):
        before = tensions
        tensions = np.array([_hold_back(problem, k) for k in range(len(lines.lines))])
        bed.rub(True)
        problem.iterations += problem.newton.solve()
        if np.abs(tensions - before).max() <= SETTLED * problem.typical_force:
            bed.accept(system.u)
            return
    raise SolveError(f"the friction of the pulled line was not found in {ROUNDS} rounds")


def _hold_back(problem, line):
    """Put r_a of a line behind it; returns the tension at its touchdown [N], 0 if its start does not lie."""
    lines, bed, u = problem.lines, problem.lines.bed, problem.system.u
    found = bed.lying(u, line)
    start = np.array(lines.lines[line].anchor(lines.scene))
    if not found.length or bed.gap(start) > found.sag:
        return 0.0
    T = problem.tension_at(found.s, line)
    chord = found.touchdown - start
    along = chord / np.linalg.norm(chord)
    scene, section = lines.scene, lines.sections[line]
    fall = weight_per_length(scene, section) * (along[2] + scene.seabed.friction * bed.normal.value[2])
    lying = Lying(start, along, found.s, section.axial_stiffness, T, fall)
    nodes = np.flatnonzero((lines.line_of_node == line) & (lines.node_s - lines.begins[line] <= found.s))
    s = lines.node_s[nodes] - lines.begins[line]
    slides = lying.tension(s) > 0
    held = bed.held.x.array.reshape(-1, 3)
    held[nodes] = lying.position(s) - np.multiply.outer(BEHIND * stick_length(scene) * slides, along)
    return T
