"""Bending lines at rest: length over which a clamped end is felt, moment there, and largest curvature."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..meshes import cable_nodes
from ..model.attachment import CLAMPED
from ..model.problem import Problem
from ..parallel.ranks import bcast
from ..results.running import Bending

if TYPE_CHECKING:
    from .report import Report

#: Longest element at a clamp, in bending lengths, for 1 % of the moment there; for degrees 1, 2 and higher.
LONGEST_AT_CLAMP = 0.5, 1.0, 2.0
#: Length of a piece, in bending lengths, beyond which the other end has no influence at a clamp.
FAR = 5


def direction_there(problem: Problem, piece: int, end: int) -> NDArray[Any]:
    """Clamped direction of an end in the world frame, on every rank; on a buoy R(q_4) t_0."""
    holder = problem.network.pieces[piece].ends[end]
    if holder.kind != "buoy":
        return np.array(holder.clamp.unit) if holder.clamp else np.zeros(3)
    attachment = next(a for a in problem.attachments if (a.piece, a.end) == (piece, end))
    there = attachment.clamp if attachment.buoy else None
    mine = None if there is None else CLAMPED.of(problem.system.u[there.slice]).direction
    found: NDArray[Any] = bcast(problem.comm, mine, attachment.rank)
    return found


def bent_at_rest(problem: Problem, report: "Report") -> None:
    """Add bending lengths, moments and curvatures of bending lines to the Report of `check`; collective."""
    network, bending = problem.network, Bending(problem)
    bending.note()
    for k, piece in enumerate(network.pieces):
        c = piece.section
        if not c.bending_stiffness:
            continue
        sizes = np.diff(cable_nodes(c.length, c.elements, c.grading))
        for i, end in enumerate(piece.ends):
            if end.clamp is None:
                continue
            force = problem.end_force(k, i)
            T, side = float(np.linalg.norm(force)), ("lower", "upper")[i]
            if 1e-9 * problem.typical_force >= T:
                continue
            about = report.about(network.name_of(k) if len(network.pieces) > 1 else "")
            felt, h = math.sqrt(c.bending_stiffness / T), float(sizes[-i])
            about.add("bending length sqrt(EI/T)", felt, "m", f"at the {side} end, whose element has {h:.3g} m")
            longest = LONGEST_AT_CLAMP[min(c.position_degree, 3) - 1] * felt
            about.warn(
                h > longest,
                f"The element at the {side} end ({h:.3g} m) is too long for the bending length {felt:.3g} m: "
                f"the moment there is right to 1 % with elements of {longest:.2g} m, by a grading or a short segment.",
            )
            if end.clamp.rotational_stiffness is None and c.length > FAR * felt:
                cosine = (2 * i - 1) * float(force @ direction_there(problem, k, i)) / T
                angle = math.acos(min(max(cosine, -1.0), 1.0))
                moment = 2 * math.sqrt(c.bending_stiffness * T) * math.sin(angle / 2)
                remark = (
                    f"of a taut line at {math.degrees(angle):.3g} deg; computed {bending.values[piece.cable, i]:.4g}"
                )
                about.add(f"moment at the {side} end", moment, "N m", remark)
    stiffest = max(piece.section.bending_stiffness for piece in network.pieces)
    outside = "not in the model: torsion, so no loops, and contact of a line with itself"
    report.add("largest bending stiffness EI", stiffest, "N m^2", outside)
    for name, use in zip(network.cables, bending.utilisation, strict=True):
        if use > 0:
            about = report.about(name if len(network.cables) > 1 else "")
            about.add("equilibrium: curvature times minimum_bend_radius", use)
            about.warn(use > 1, "The equilibrium is bent more sharply than minimum_bend_radius allows.")
