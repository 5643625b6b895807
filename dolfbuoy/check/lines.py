"""Lines: weights, periods, steps, snaps, fatigue; at rest tensions, strength, heights and lengths on the bed."""

import math
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..elsewhere import MPI
from ..meshes import cable_nodes
from ..model.contact import has_friction, stick_length
from ..model.effects import called_by
from ..model.problem import Problem
from ..model.rigid import cross_section, weight_per_length
from ..model.surfacing import surfacing
from ..results.cautions import PULSES
from ..results.running import Utilisation, never_parted, stressed
from ..results.summary import UNSEEN
from ..results.tables import newtons
from ..scene import Scene
from ..scene.cable import Cable
from ..scene.fatigue import curve_of, curve_on
from ..scene.network import Network
from ..scene.stiffness import TensionTable
from ..solver import compat
from .bending import bent_at_rest

if TYPE_CHECKING:
    from .report import Report

#: A cable counts as slack below this fraction of the typical force of its scene.
LEAST_TENSION = 1e-4
#: Compression below this fraction of the typical force of its scene is rounding error.
ROUNDING = 1e-9
#: Fraction of its length by which a cable lighter than water may rise above its ends without warning.
RISE = 1e-3
#: Largest strain by Hooke's law without warning: more than any rope bears.
STRETCHED = 0.5
#: Keys that distinguish the materials of pieces of a cable.
MATERIAL = ("line_density", "diameter", "area", "axial_stiffness", "added_mass", "damping", "slack")
#: Steps per round trip of an elastic wave along a line that resolve the peak of a snap (12 gave 6 % less than 25, 6
#: gave 18 % less) without damping; with damping a run adapts its steps by itself.
STEPS_OF_A_WAVE = 10
#: Element length at the touchdown over the radius of curvature there, T/w, for 1 % in the top tension; of degree 1 and
#: higher (tests/verification/touchdown.py; at rest, degree 1 gave 1.4 % at 0.3, 0.8 % at 0.28 and below).
LONGEST_AT_TOUCHDOWN = 0.28, 0.45
#: Largest number of elements proposed for the touchdown.
MOST_ELEMENTS = 5000
#: Lines normally sink less than this into the bed [m].
DEEPEST_SAG = 0.01


class Line(NamedTuple):
    """A cable, or its consecutive pieces of one material, by number; name: "" if it is the only one."""

    name: str
    pieces: list[int]
    material: Cable
    length: float


def lines_of(network: Network) -> list[Line]:
    """The cables of a network, split into parts of one material."""

    def kind(k: int) -> tuple[int, str]:
        return network.pieces[k].cable, repr([getattr(network.pieces[k].section, key) for key in MATERIAL])

    found = []
    for (cable, _), group in groupby(range(len(network.pieces)), kind):
        pieces = list(group)
        length = sum(network.pieces[k].section.length for k in pieces)
        name = network.cables[cable] if len(pieces) == len(network.pieces_of(cable)) else network.name_of(pieces[0])
        found.append(Line(name, pieces, network.pieces[pieces[0]].section, length))
    return found if len(found) > 1 else [line._replace(name="") for line in found]


def of_lines(scene: Scene, network: Network, report: "Report") -> None:
    """Add weights, axial periods and limits of explicit steps to the Report of `check`."""
    for sentence in never_parted(scene):
        report.warn(True, sentence)
    bars = {cable for buoy in network.buoys for cable in network.bars_of(buoy)}
    for line in lines_of(network):
        if network.pieces[line.pieces[0]].cable in bars:  # a bar does not stretch
            continue
        c, about, where = line.material, report.about(line.name), "in water" if scene.sea else "in air"
        w, slowness = weight_per_length(scene, c), math.sqrt(c.line_density / c.axial_stiffness)
        about.add(f"cable weight {where} per metre", w, "N/m")
        about.add(f"cable weight {where}", w * line.length, "N")
        remark = "C = 1; for P1, smaller for higher degrees" if c.position_degree > 1 else "C = 1"
        sizes = [(s.length, s.elements, s.grading) for s in (network.pieces[k].section for k in line.pieces)]
        h = min(np.diff(cable_nodes(*size)).min() for size in sizes)
        limit, none = h / (2 * math.sqrt(3)) * slowness, "inextensible: no explicit step at all"
        about.add("explicit step limit of Eq. (24)", limit, "s", remark if slowness else none)
        if slowness:
            report.periods[f"{line.name or 'cable'}, first axial (fixed ends)"] = 2 * line.length * slowness
            _snaps(scene, c, line.length, about)


def _snaps(scene: Scene, material: Cable, length: float, report: "Report") -> None:
    """Add damping and the snap load of an elastic line to the Report of `check`.

    A line that moves along itself at speed v until it is taut pulls with Z v at a held end, Z = sqrt(EA rho0), and with
    half of that where it meets line at rest: exact without damping, until the elastic wave returns.
    """
    tau = material.damping / material.axial_stiffness
    report.add("cable internal damping", material.damping, "N s", f"c/EA = {tau:.4g} s" if tau else "none")
    if material.slack != "tension-only":
        return
    travel = 2 * length * math.sqrt(material.line_density / material.axial_stiffness)
    pull = math.sqrt(material.line_density * material.axial_stiffness)
    report.add("pull of a snap at a held end per m/s", pull, "N", f"without damping, for {travel:.3g} s at most")
    report.warn(scene.time and not material.damping, f"The cable has {PULSES}")
    time, longest = scene.time, f"{travel / STEPS_OF_A_WAVE:.2g}"
    if time and not tau and time.tolerance is None:
        report.warn(
            time.step > float(longest),
            f"Where the cable comes taut, steps of {time.step:g} s hide the peak: it needs {longest} s, or "
            "cable.damping, with which a run makes its steps smaller there.",
        )


def lines_at_rest(problem: Problem, report: "Report") -> None:
    """Add tensions, strength, grounded and hanging parts, and transverse periods to the Report; collective."""
    network, scene, several = problem.network, problem.scene, len(problem.network.cables) > 1
    abouts = [report.about(name if several else "") for name in network.cables]
    for cable, about in enumerate(abouts):
        _forces(problem, report, cable)
        _rising(problem, about, cable)
    if scene.sea:
        _above_water(problem, report)
    if network.bends:
        bent_at_rest(problem, report)
    names, use = stressed(network), Utilisation(problem)
    if names:
        use.note()
    for name, value in zip(names, use.values if names else (), strict=True):
        of = f" of {name}" if len(network.pieces) > 1 else ""
        report.add(f"equilibrium: largest tension over breaking load{of}", value)
        report.warn(value > 1, f"The equilibrium is above the breaking load of {name}.")
    smallest = problem.smallest_tension(of_rods=False)
    report.warn(  # a slack rope has no compression
        smallest < -ROUNDING * problem.typical_force,
        f"The equilibrium has compressed elements (smallest tension {newtons(smallest)}).",
    )
    if problem.lines.bed is not None:
        _on_bed(problem, report)
    elif scene.sea:
        for cable, about in enumerate(abouts):
            _hanging(problem, about, cable, scene.sea.depth)
    for line in [] if network.buoys else lines_of(network):
        _transverse(problem, report, line)


def _forces(problem: Problem, report: "Report", cable: int) -> None:
    """Add forces at the ends of a cable, and the weight added by marine growth."""
    network, name = problem.network, problem.network.cables[cable]
    pulls: Any = problem.anchor_force(cable=cable), problem.end_tension(cable=cable)
    (low, high), alone = network.ends_of(cable), len(network.cables) == 1
    high = "the top" if alone and network.pieces[-1].ends[1].kind == "buoy" else high
    of, to = ("", "") if alone else (f" of {name}", f" to {name}")
    report.add(f"equilibrium: tension{of} at {high}", float(np.linalg.norm(pulls[1])), "N")
    report.add(f"equilibrium: force{of} at {low}", float(np.linalg.norm(pulls[0])), "N")
    report.add(f"equilibrium: uplift{of} at {low}", 0.0 - pulls[0][2], "N", "the part that pulls it up")
    held = zip(pulls, (network.first_of(cable), network.last_of(cable)), strict=True)
    said = [_stretched(float(np.linalg.norm(pull)), network.pieces[k].section.axial_stiffness, of) for pull, k in held]
    report.warn(any(said), max(said, key=len))
    grown = [problem.lines.holder(k) for k in network.pieces_of(cable) if network.pieces[k].section.marine_growth]
    if grown and problem.scene.sea:
        found = [(lines.growth, lines.line_of_cell == k) for lines, k in grown]
        largest = [growth.factors[here].max(axis=0, initial=1.0) for growth, here in found]
        diameter, mass = np.max(problem.comm.allgather(np.max(largest, axis=0)), axis=0)
        remark = f"diameter times {diameter:.4g}, mass times {mass:.4g} at most"
        weight = problem.comm.allreduce(sum(float(growth.weights[here].sum()) for growth, here in found))
        report.add(f"marine growth adds in water{to}", weight, "N", remark)


def _stretched(pull: float, stiffness: float, of: str) -> str:
    """Warning if the pull at an end [N] is beyond the range of the axial stiffness, else ""; of: " of NAME"."""
    if isinstance(stiffness, TensionTable):
        last = stiffness.rows[-1][1]
        beyond, what = (
            pull > last,
            f"has {newtons(pull)}, beyond the {newtons(last)} of the last row of axial_stiffness",
        )
    else:
        stretch = 100 * pull / stiffness
        beyond, what = (
            pull > STRETCHED * stiffness,
            f"is stretched by {stretch:.3g} %: look at axial_stiffness and length",
        )
    return f"The equilibrium{of} {what}." if beyond else ""


def _rising(problem: Problem, report: "Report", cable: int) -> None:
    """Warn if a cable that is lighter than water as a whole rises above its ends."""
    network, lines, scene = problem.network, problem.lines, problem.scene
    sections = network.sections_of(cable)
    weight, length = sum(weight_per_length(scene, c) * c.length for c in sections), sum(c.length for c in sections)
    if not scene.sea or weight >= 0:
        return
    mine = np.isin(lines.line_of_node, network.pieces_of(cable))
    ends = lines.end_dofs[network.first_of(cable)][0][2:], lines.end_dofs[network.last_of(cable)][1][2:]
    heights = [problem.system.u[dofs] for dofs in (lines.node_dofs[mine, 2], np.concatenate(ends))]
    highest, end = (problem.comm.allreduce(z.max(initial=-math.inf), op=MPI.MAX) for z in heights)
    report.warn(
        highest - end > RISE * length,
        f"The cable is lighter than water, by {-weight:.4g} N: it floats up, {highest - end:.3g} m above its ends.",
    )


def _above_water(problem: Problem, report: "Report") -> None:
    """Add the length of each cable above the water, or warn of it."""
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
        else:
            least = RISE * sum(c.length for c in network.sections_of(cable))
            report.warn(length > least, f"{length:.4g} m{of or ' of the cable'} are above the water, {UNSEEN}")


def _hanging(problem: Problem, report: "Report", cable: int, depth: float) -> None:
    """Warn if a cable hangs below a bed that does not support it, or would do so without load."""
    network, lines = problem.network, problem.lines
    pieces, z = [network.pieces[k] for k in network.pieces_of(cable)], problem.system.u[lines.node_dofs[:, 2]]
    length = sum(piece.section.length for piece in pieces)
    mine = np.isin(lines.line_of_node, network.pieces_of(cable))
    below = problem.comm.allreduce(-depth - z[mine].min(initial=math.inf), op=MPI.MAX)
    ends = [pieces[0].ends[0], pieces[-1].ends[1]]
    tops: list[Any] = [end.top for end in ends if end.held]
    buoys = [end.name for end in ends if end.kind == "buoy"]
    on_buoys = [end.name for piece in network.pieces for end in piece.ends if end.kind == "buoy"]
    slack = length - abs(tops[0].position[2]) if tops and buoys and on_buoys.count(buoys[0]) == 1 else 0.0
    hangs, sinks = below > 1e-6 * length, any(lines.weight_of(k) > 0 for k in network.pieces_of(cable))
    report.warn(
        hangs, f"At rest the cable hangs up to {below:.3g} m below the sea bed: there is no [seabed] to carry it."
    )
    report.warn(
        slack > 0 and sinks and not hangs,
        f"The cable is {slack:.3g} m longer than the water is deep: without load it hangs below its anchor.",
    )


def _transverse(problem: Problem, report: "Report", line: Line) -> None:
    """Add the periods of transverse modes of a taut line, T_n = 2/n int sqrt(m/T) ds, with the equilibrium tension."""
    c, scene, comm, least, travel = line.material, problem.scene, problem.comm, math.inf, 0.0
    added = scene.sea.density * (cross_section(c) or 0.0) * c.added_mass if scene.sea else 0.0
    for lines, k in map(problem.lines.holder, line.pieces):
        u, swings = problem.system.u, lines.line_of_cell == k
        if lines.bed is not None:  # grounded parts do not swing
            swings &= lines.cell_ends[:, 0] >= lines.begins[k] + lines.grounded(u, k).s
        T, h = lines.mean_tension(u)[swings], np.diff(lines.cell_ends[swings], axis=1)[:, 0]
        thicker, heavier = lines.growth.factors[swings].T if lines.growth is not None else np.ones((2, len(T)))
        least = min(least, T.min(initial=math.inf))
        mass = heavier * c.line_density + thicker**2 * added
        travel += float(np.sum(h * np.sqrt(mass / T.clip(min=1e-300))))
    travel, least = comm.allreduce(travel), comm.allreduce(least, op=MPI.MIN)
    taut = travel and least > LEAST_TENSION * problem.typical_force  # a slack line has no such modes
    for n in (1, 2) if taut else ():
        report.periods[f"{line.name or 'cable'}, transverse {n} (taut, fixed ends)"] = 2 * travel / n


def _on_bed(problem: Problem, report: "Report") -> None:
    """Add the grounded part of every piece of line of a solved static Problem to the Report of `check`."""
    scene, network, lines = problem.scene, problem.network, problem.lines
    several, friction = len(network.pieces) > 1, scene.seabed.friction if scene.seabed else 0.0
    below: dict[Any, float] = {}
    for k, piece in enumerate(network.pieces):
        lies, held = lines.grounded(problem.system.u, k), piece.ends[0].held
        places: list[Any] = [end.top and end.top.position for end in piece.ends]
        of, about = (f" of {network.name_of(k)}", report.about(network.name_of(k))) if several else ("", report)
        ends = zip(places, piece.ends, strict=True)
        below |= {place: -float(lines.bed.gap(np.array(place))) for place, end in ends if end.held}
        if lies.length or not several:
            report.add(f"equilibrium: length on the sea bed{of}", lies.length, "m")
        if not lies.length:
            continue
        T = problem.tension_at(lies.s, k)
        if held:
            away = math.dist(lies.touchdown, places[0])
            report.add(f"equilibrium: touchdown{of} from {network.ends_of(piece.cable)[0]}", away, "m")
        report.add(f"equilibrium: deepest sag{of} into the bed", lies.sag, "m")
        if held and friction and not has_friction(scene, dynamic=False):
            most = friction * abs(lines.weight_of(k)) * lies.length
            slip = f"once it has slipped by {stick_length(scene):.3g} m; seabed.start = 'pulled' has it at rest"
            name = f"equilibrium: tension that friction could carry{of}"
            report.add(name, min(most, max(T, 0.0)), "N", slip)
        c, w = piece.section, abs(lines.weight_of(k))
        _touchdown_elements(problem, about, k, lies.s, max(T / w, 2 * np.cbrt((c.bending_stiffness or 0.0) / w)))
        undamped = scene.time and not c.damping and np.isfinite(c.axial_stiffness)
        about.warn(undamped and c.slack != "tension-only", f"The cable has {PULSES}")
    for position, depth in below.items():
        what = f"The end at {list(position)}" if several else "The anchor"
        report.warn(
            depth > DEEPEST_SAG, f"{what} is {depth:.3g} m below the sea bed, which presses the cable up there."
        )


def _touchdown_elements(problem: Problem, report: "Report", piece: int, s: float, radius: float) -> None:
    """Warn of long elements at the touchdown, where the curvature jumps, which no polynomial degree resolves.
    They must be short against T/w or, if the line bends, (EI/w)^1/3, over which its stiffness smooths the jump.
    """
    lines = problem.lines
    begins, ends = (lines.cell_ends - lines.begins[piece]).T
    here = (lines.line_of_cell == piece) & (begins <= s) & (s <= ends)
    h = problem.comm.allreduce(float((ends - begins)[here].max(initial=0.0)), op=MPI.MAX)
    section: Any = problem.network.pieces[piece].section
    if section.elements == section.position_degree == 1 and np.isinf(section.axial_stiffness):
        return  # a bar, which does not bend
    most = LONGEST_AT_TOUCHDOWN[section.position_degree > 1] * radius
    if section.length > MOST_ELEMENTS * most:
        report.warn(
            True,
            "The cable falls on the bed without a pull along it, in a fold finer than any elements: its tensions are "
            f"right to the weight of an element there, which is {h:.3g} m long.",
        )
        return
    if not report.prefix:
        report.add("equilibrium: elements at the touchdown", h, "m", f"for 1 % in the top tension {most:.4g} m at most")
    report.warn(
        h > most,
        f"The elements at the touchdown are {h:.3g} m long where the cable bends with a radius of "
        f"{radius:.3g} m: tensions may be more than 1 % wrong; take {most:.2g} m there, of equal length "
        f"elements = {math.ceil(section.length / most)}.",
    )


def of_fatigue(scene: Scene, report: "Report") -> None:
    """Add the reference of every fatigue curve to the Report of `check`, with a warning if it is likely too high."""
    network, fatigue = scene.network, scene.fatigue
    corrosion = fatigue.corrosion if fatigue else 0.0
    seen: list[tuple[str, float]] = []
    unmeasured: list[str] = []
    for k, piece in enumerate(network.pieces):
        section = piece.section
        for text in dict.fromkeys(curve_on(section, fatigue, linked) for linked in (False, True)):
            if text is None:
                continue
            curve = curve_of(text)
            reference = curve.reference(section.breaking_load, section.steel_area, corrosion)
            if (text, reference) not in seen:
                seen.append((text, reference))
                unit = "N/MPa" if curve.unit == "MPa" else "N"
                report.add(f"R = 1 of the fatigue curve '{text}'", reference, unit, network.name_of(k))
            if curve.of_grade_orq and section.steel_area is None:
                unmeasured.append(network.name_of(k))
    report.warn(
        unmeasured,
        f"Fatigue of {', '.join(dict.fromkeys(unmeasured))}: API refers ranges of chain to the breaking load of grade "
        "ORQ of the same bar, which steel_area would give; with its own one, lives of better grades are too long (R4: "
        "twice).",
    )
