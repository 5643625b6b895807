"""What `check` says of lines on a sea bed: what lies, where it leaves the bed, and what stands below it."""

import math

import numpy as np

from ..elsewhere import MPI
from ..model.seabed import has_friction, stick_length
from .snaps import undamped

#: Length of the elements at the touchdown over T/w, the radius of the bend there, for 1 % in the top tension; of degree
#: 1, and of higher ones (tests/verification/touchdown.py).
LONGEST_AT_TOUCHDOWN = 0.3, 0.45
#: Lines sink less than this into the bed [m].
DEEPEST_SAG = 0.01


def on_the_bed(problem, report) -> None:
    """Add to the Report of `check` what lies of every piece of line of a solved static Problem with a bed."""
    network, lines, below = problem.network, problem.lines, {}
    several = len(network.pieces) > 1
    for k, piece in enumerate(network.pieces):
        found, of = lines.grounded(problem.system.u, k), f" of {network.name_of(k)}" if several else ""
        if found.length or not several:
            report.add(f"equilibrium: length on the sea bed{of}", found.length, "m")
        if found.length:
            if piece.ends[0].held:
                away = math.dist(found.touchdown, piece.ends[0].top.position)
                report.add(f"equilibrium: touchdown{of} from {network.ends_of(piece.cable)[0]}", away, "m")
            report.add(f"equilibrium: deepest sag{of} into the bed", found.sag, "m")
            _friction_to_come(problem, report, k, found, of)
            about = report.about(network.name_of(k) if several else "")
            _touchdown_elements(problem, about, k, found)
            if piece.section.slack != "tension-only":
                undamped(problem.scene, piece.section, about)
        below |= {end.top.position: -float(lines.bed.gap(np.array(end.top.position))) for end in piece.ends if end.held}
    for position, depth in below.items():
        if depth > DEEPEST_SAG:
            what = f"The end at {list(position)}" if several else "The anchor"
            report.warn(f"{what} is {depth:.3g} m below the sea bed, which presses the cable up there.")


def _friction_to_come(problem, report, piece, found, of):
    """What friction could carry and does not at rest: it needs a slip."""
    scene = problem.scene
    if (
        not scene.seabed.friction
        or has_friction(scene, dynamic=False)
        or not problem.network.pieces[piece].ends[0].held
    ):
        return
    most = scene.seabed.friction * abs(problem.lines.weight_of(piece)) * found.length
    could = min(most, max(problem.tension_at(found.s, piece), 0.0))
    slip = f"once it has slipped by {stick_length(scene):.3g} m; seabed.start = 'pulled' has it at rest"
    report.add(f"equilibrium: tension that friction could carry{of}", could, "N", slip)


def _touchdown_elements(problem, report, piece, found):
    """The touchdown is a jump of curvature that no degree resolves: elements there must be short beside T/w."""
    lines = problem.lines
    radius = problem.tension_at(found.s, piece) / abs(lines.weight_of(piece))
    begins, ends = (lines.cell_ends - lines.begins[piece]).T
    here = (lines.line_of_cell == piece) & (begins <= found.s) & (found.s <= ends)
    h = problem.comm.allreduce(float((ends - begins)[here].max(initial=0.0)), op=MPI.MAX)
    degree = problem.network.pieces[piece].section.position_degree
    most = LONGEST_AT_TOUCHDOWN[degree > 1] * radius
    if not report.prefix:
        report.add("equilibrium: elements at the touchdown", h, "m", f"for 1 % in the top tension {most:.4g} m at most")
    if h > most:
        report.warn(
            f"The elements at the touchdown are {h:.3g} m long where the cable bends with a radius of "
            f"{radius:.3g} m: tensions may be more than 1 % wrong; take {most:.2g} m there."
        )
