"""What `check` says of lines: weights, periods and steps, and how they hang at rest."""

import math
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ..elsewhere import MPI
from ..meshes import cable_nodes
from ..model.effects import called_by
from ..model.rigid import cross_section, weight_per_length
from ..model.surfacing import surfacing
from ..results.summary import UNSEEN
from ..results.utilisation import Utilisation, never_parted, stressed
from ..scene.cable import Cable
from ..solver import compat
from .bed import on_the_bed
from .snaps import of_snaps

#: A cable with less tension than this part of the forces of its scene is taken for slack.
LEAST_TENSION = 1e-4
#: Compression below this part of the forces of its scene is rounding.
ROUNDING = 1e-9
#: Part of its length by which a cable lighter than water may rise above its ends without a word.
RISE = 1e-3
#: Keys by which pieces of a cable differ.
MATERIAL = ("line_density", "diameter", "area", "axial_stiffness", "added_mass", "damping", "slack")


class Line(NamedTuple):
    """A cable, or pieces of it that are of one material, by their numbers; name: "" if there is no other."""

    name: str
    pieces: list[int]
    material: Cable
    length: float


def lines_of(network) -> list[Line]:
    """The cables of a network; of several materials their parts."""

    def kind(k):
        return network.pieces[k].cable, repr([getattr(network.pieces[k].section, key) for key in MATERIAL])

    found = []
    for (cable, _), group in groupby(range(len(network.pieces)), kind):
        pieces = list(group)
        length = sum(network.pieces[k].section.length for k in pieces)
        name = network.cables[cable] if len(pieces) == len(network.pieces_of(cable)) else network.name_of(pieces[0])
        found.append(Line(name, pieces, network.pieces[pieces[0]].section, length))
    return found if len(found) > 1 else [line._replace(name="") for line in found]


def of_lines(scene, network, report) -> None:
    """Add weights, axial periods and limits of explicit steps to the Report of `check`."""
    for sentence in never_parted(scene):
        report.warn(sentence)
    for line in lines_of(network):
        c, said, where = line.material, report.about(line.name), "in water" if scene.sea else "in air"
        w, slowness = weight_per_length(scene, c), math.sqrt(c.line_density / c.axial_stiffness)
        said.add(f"cable weight {where} per metre", w, "N/m")
        said.add(f"cable weight {where}", w * line.length, "N")
        remark = "C = 1; for P1, smaller for higher degrees" if c.position_degree > 1 else "C = 1"
        if slowness:
            report.periods[f"{line.name or 'cable'}, first axial (fixed ends)"] = 2 * line.length * slowness
        sizes = [(s.length, s.elements, s.grading) for s in (network.pieces[k].section for k in line.pieces)]
        h = min(np.diff(cable_nodes(*size)).min() for size in sizes)
        limit, none = h / (2 * math.sqrt(3)) * slowness, "inextensible: no explicit step at all"
        said.add("explicit step limit of Eq. (24)", limit, "s", remark if slowness else none)
        if slowness:
            of_snaps(scene, c, line.length, said)


def lines_at_rest(problem, report) -> None:
    """Add tensions, strength, what lies and what hangs, and transverse periods to the Report of `check`; collective."""
    network = problem.network
    for cable in range(len(network.cables)):
        _forces(problem, report, cable)
        _rising(problem, report.about(network.cables[cable] if len(network.cables) > 1 else ""), cable)
    if problem.scene.sea:
        _above_water(problem, report)
    _strength(problem, report)
    smallest = problem.smallest_tension()
    if smallest < -ROUNDING * problem.typical_force:  # a slack rope has none
        report.warn(f"The equilibrium has compressed elements (smallest tension {smallest:.4g} N).")
    if problem.lines.bed is not None:
        on_the_bed(problem, report)
    elif problem.scene.sea:
        for cable, name in enumerate(network.cables):
            _hanging(problem, report.about(name if len(network.cables) > 1 else ""), cable)
    for line in [] if network.buoys else lines_of(network):
        _transverse(problem, report, line)


def _forces(problem, report, cable):
    """At the ends of a cable, and what marine growth adds to its weight."""
    network, held, name = problem.network, problem.anchor_force(cable=cable), problem.network.cables[cable]
    (low, high), alone = network.ends_of(cable), len(network.cables) == 1
    high = "the top" if alone and network.pieces[-1].ends[1].kind == "buoy" else high
    of, to = ("", "") if alone else (f" of {name}", f" to {name}")
    report.add(f"equilibrium: tension{of} at {high}", np.linalg.norm(problem.end_tension(cable=cable)), "N")
    report.add(f"equilibrium: force{of} at {low}", np.linalg.norm(held), "N")
    report.add(f"equilibrium: uplift{of} at {low}", -held[2], "N", "the part that pulls it up")
    grown = [problem.lines.holder(k) for k in network.pieces_of(cable) if network.pieces[k].section.marine_growth]
    if grown and problem.scene.sea:
        found = [(lines.growth, lines.line_of_cell == k) for lines, k in grown]
        largest = [growth.factors[here].max(axis=0, initial=1.0) for growth, here in found]
        diameter, mass = np.max(problem.comm.allgather(np.max(largest, axis=0)), axis=0)
        remark = f"diameter times {diameter:.4g}, mass times {mass:.4g} at most"
        weight = problem.comm.allreduce(sum(float(growth.weights[here].sum()) for growth, here in found))
        report.add(f"marine growth adds in water{to}", weight, "N", remark)


def _rising(problem, report, cable):
    """A cable that is lighter than water as a whole, and how far it stands above its ends."""
    network, lines, scene = problem.network, problem.lines, problem.scene
    sections = [network.pieces[k].section for k in network.pieces_of(cable)]
    weight, length = sum(weight_per_length(scene, c) * c.length for c in sections), sum(c.length for c in sections)
    if not scene.sea or weight >= 0:
        return
    mine = np.isin(lines.line_of_node, network.pieces_of(cable))
    ends = lines.end_dofs[network.first_of(cable)][0][2:], lines.end_dofs[network.last_of(cable)][1][2:]
    heights = [problem.system.u[dofs] for dofs in (lines.node_dofs[mine, 2], np.concatenate(ends))]
    highest, end = (problem.comm.allreduce(z.max(initial=-math.inf), op=MPI.MAX) for z in heights)
    rise = highest - end
    if rise > RISE * length:
        report.warn(f"The cable is lighter than water, by {-weight:.4g} N: it floats up, {rise:.3g} m above its ends.")


def _above_water(problem, report):
    """What of each cable is out of the water, or may get there."""
    network, may, above = problem.network, surfacing(problem.scene), np.zeros(len(problem.network.cables))
    for lines in problem.lines.groups:
        ends = compat.cell_dofs(lines.positions)[:, :2]  # the ends of a cell are its first nodes
        z = problem.system.u[lines.part.slice][lines.node_dofs[ends]][..., 2]
        low, high = z.min(axis=1), z.max(axis=1)
        share = np.clip(high / np.maximum(high - low, 1e-300), 0.0, 1.0)
        cables = np.array([piece.cable for piece in lines.pieces])[lines.line_of_cell]
        np.add.at(above, cables, share * np.diff(lines.cell_ends, axis=1)[:, 0])
    above, ends = problem.comm.allreduce(above), bool(called_by(problem.scene, "line_wet"))
    for cable, name in enumerate(network.cables):
        length, of = above[cable], f" of {name}" if len(network.cables) > 1 else ""
        if ends and (name in may or length > 0):
            report.add(
                f"equilibrium: length above the water{of}", length, "m", "dry there, in waves above their surface"
            )
        elif length > RISE * sum(network.pieces[k].section.length for k in network.pieces_of(cable)):
            report.warn(f"{length:.4g} m{of or ' of the cable'} are above the water, {UNSEEN}")


def _strength(problem, report):
    """How near lines are to breaking."""
    if names := stressed(problem.network):
        use, several = Utilisation(problem), len(problem.network.pieces) > 1
        use.note()
        for name, value in zip(names, use.values, strict=True):
            report.add(f"equilibrium: largest tension over breaking load{f' of {name}' if several else ''}", value)
            if value > 1:
                report.warn(f"The equilibrium is above the breaking load of {name}.")


def _hanging(problem, report, cable):
    """Where a cable hangs below a bed that does not carry it, or would without load."""
    network, lines, depth = problem.network, problem.lines, problem.scene.sea.depth
    pieces, z = [network.pieces[k] for k in network.pieces_of(cable)], problem.system.u[lines.node_dofs[:, 2]]
    length = sum(piece.section.length for piece in pieces)
    mine = np.isin(lines.line_of_node, network.pieces_of(cable))
    below = problem.comm.allreduce(-depth - z[mine].min(initial=math.inf), op=MPI.MAX)
    ends = [pieces[0].ends[0], pieces[-1].ends[1]]
    held, buoys = [end for end in ends if end.held], [end.name for end in ends if end.kind == "buoy"]
    on_buoys = [end.name for piece in network.pieces for end in piece.ends if end.kind == "buoy"]
    slack = length - abs(held[0].top.position[2]) if held and buoys and on_buoys.count(buoys[0]) == 1 else 0.0
    if below > 1e-6 * length:
        report.warn(f"At rest the cable hangs up to {below:.3g} m below the sea bed: there is no [seabed] to carry it.")
    elif slack > 0:
        beyond = f"{slack:.3g} m longer than the water is deep"
        report.warn(f"The cable is {beyond}: without load it hangs below its anchor.")


def _transverse(problem, report, line):
    """Transverse modes of a taut line, T_n = 2/n int sqrt(m/T) ds, with the equilibrium's tension."""
    c, scene, comm, least, travel = line.material, problem.scene, problem.comm, math.inf, 0.0
    added = scene.sea.density * cross_section(c) * c.added_mass if scene.sea else 0.0
    for lines, k in map(problem.lines.holder, line.pieces):
        u, swings = problem.system.u, lines.line_of_cell == k
        if lines.bed is not None:  # what lies does not swing
            swings &= lines.cell_ends[:, 0] >= lines.begins[k] + lines.grounded(u, k).s
        T, h = lines.mean_tension(u)[swings], np.diff(lines.cell_ends[swings], axis=1)[:, 0]
        thicker, heavier = lines.growth.factors[swings].T if lines.growth is not None else np.ones((2, len(T)))
        least = min(least, T.min(initial=math.inf))
        mass = heavier * c.line_density + thicker**2 * added
        travel += float(np.sum(h * np.sqrt(mass / T.clip(min=1e-300))))
    travel, least = comm.allreduce(travel), comm.allreduce(least, op=MPI.MIN)
    taut = travel and least > LEAST_TENSION * problem.typical_force  # a slack one has no such modes
    for n in (1, 2) if taut else ():
        report.periods[f"{line.name or 'cable'}, transverse {n} (taut, fixed ends)"] = 2 * travel / n
