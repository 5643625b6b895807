"""What `check` says of lines on a sea bed: what lies, where it leaves the bed, and what stands below it."""

import math

import numpy as np
from mpi4py import MPI

#: Length of the elements at the touchdown over T/w, the radius of the bend there, for 1 % in the top tension; of degree
#: 1, and of higher ones (`dolfbuoy study touchdown`).
LONGEST_AT_TOUCHDOWN = 0.3, 0.45


def on_the_bed(problem, report) -> None:
    """Add to the Report of `check` what lies of every piece of line of a solved static Problem with a bed."""
    network, bed = problem.lines.network, problem.lines.bed
    several = len(network.pieces) > 1
    for k, piece in enumerate(network.pieces):
        name = network.cables[piece.cable]
        if network.first_of(piece.cable) != network.last_of(piece.cable):
            name += f", segment {piece.number + 1}"
        found = bed.lying(problem.system.u, k)
        low = piece.ends[0]
        if several and not found.length:
            continue
        of = f" of {name}" if several else ""
        report.add(f"equilibrium: length on the sea bed{of}", found.length, "m")
        if found.length:
            if low.held:
                away = math.dist(found.touchdown, low.top.position)
                report.add(f"equilibrium: touchdown{of} from {network.ends_of(piece.cable)[0]}", away, "m")
            report.add(f"equilibrium: deepest sag{of} into the bed", found.sag, "m")
            _touchdown_elements(problem, report, k, found, f"{name}: " if several else "")
    _below(problem, report, several)


def _below(problem, report, several):
    """Held ends below the bed by more than lines sink."""
    bed, said = problem.lines.bed, set()
    for k, piece in enumerate(problem.lines.network.pieces):
        sag = bed.lying(problem.system.u, k).sag if not several else 0.0
        for end in (end for end in piece.ends if end.held):
            gap = float(bed.gap(np.array(end.top.position)))
            if gap < -sag - 1e-6 * piece.section.length - 0.01 * several and end.top.position not in said:
                said.add(end.top.position)
                what = f"The end at {list(end.top.position)}" if several else "The anchor"
                report.warnings.append(f"{what} is {-gap:.3g} m below the sea bed, which presses the cable up there.")


def _touchdown_elements(problem, report, piece, found, name):
    """The touchdown is a jump of curvature that no degree resolves: elements there must be short beside T/w."""
    lines = problem.lines
    radius = problem.tension_at(found.s, piece) / abs(lines.weight_of(piece))
    begins, ends = (lines.cell_ends - lines.begins[piece]).T
    here = (lines.line_of_cell == piece) & (begins <= found.s) & (found.s <= ends)
    h = problem.comm.allreduce(float((ends - begins)[here].max(initial=0.0)), op=MPI.MAX)
    most = LONGEST_AT_TOUCHDOWN[lines.section.position_degree > 1] * radius
    if not name:
        report.add("equilibrium: elements at the touchdown", h, "m", f"for 1 % in the top tension {most:.4g} m at most")
    if h > most:
        report.warnings.append(
            f"{name}The elements at the touchdown are {h:.3g} m long where the cable bends with a radius of "
            f"{radius:.3g} m: tensions may be more than 1 % wrong; take {most:.2g} m there."
        )
