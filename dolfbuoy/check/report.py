"""What a naval engineer looks at before a run: derived numbers of a scene, and where its model leaves its range."""

import math
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI

from ..model.effects import names as effects_of
from ..model.feasible import check_feasible, drowned, hanging_weight, pull_upright, shape_and_mass, spare_buoyancy
from ..model.first_shape import check_first_shape
from ..model.held import overshoot
from ..model.hydrostatics import float_upright
from ..model.material import cross_section, weight_per_length
from ..results.utilisation import Utilisation, stressed
from ..scene.network import is_network, network_of, single, with_buoy, with_line
from ..statics.equilibrium import solve_equilibrium
from .bed import on_the_bed
from .waves import in_waves

#: A cable with less tension than this part of the forces of its scene is taken for slack.
LEAST_TENSION = 1e-4
#: Part of its range by which a motion along rows may go beyond them without a word.
OVERSHOOT = 0.01


@dataclass
class Report:
    """effects: what is compiled.  numbers: (name, value, unit, remark).  periods: name -> s.  warnings: sentences."""

    effects: list[str]
    numbers: list[tuple[str, float, str, str]] = field(default_factory=list)
    periods: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def add(self, name, value, unit="", remark=""):
        self.numbers.append((name, float(value), unit, remark))


def check(scene, comm=MPI.COMM_WORLD) -> Report:
    """Derived numbers and warnings; solves for the equilibrium if the scene starts from it, collectively.

    Raises InputError for an impossible scene, SolveError if the equilibrium is not found.
    """
    check_feasible(scene)
    check_first_shape(scene)
    report = derived(scene)
    if scene.initial.kind == "equilibrium" and (single(scene).cable or scene.sea):
        (_network_at_rest if is_network(scene) else _equilibrium)(scene, report, comm)
    return report


def derived(scene) -> Report:
    """Numbers and warnings that need no equilibrium.  Raises InputError for a buoy that sinks."""
    report = Report(effects_of(scene))
    _motions(scene, report)
    if is_network(scene):
        return _network(scene, report)
    if single(scene).cable:
        _cable(scene, report)
    if single(scene).buoy and scene.sea and scene.gravity:
        _buoy(scene, report)
    if scene.waves:
        in_waves(scene, report)
    return report


def _motions(scene, report):
    """Ends that are moved along rows, whose spline swings beyond them."""
    network = network_of(scene)
    ends = {end.name or network.ends_of(p.cable)[k]: end for p in network.pieces for k, end in enumerate(p.ends)}
    for name, end in ends.items():
        if end.top is None or not end.top.motion:
            continue
        beyond = overshoot(end.top.motion)
        if beyond > OVERSHOOT:
            report.warnings.append(
                f"The motion of {name} goes {100 * beyond:.2g} % of its range beyond its rows, which a cubic spline "
                "joins: give more rows where it turns."
            )


def _network(scene, report):
    """Each segment of a cable and each buoy as if it were alone, the waves, and where materials come from."""
    network = network_of(scene)
    alone = {network.name_of(k): with_line(scene, piece.section) for k, piece in enumerate(network.pieces)}
    alone |= {name: with_buoy(scene, name) for name in network.buoys}
    for name, one in alone.items():
        own = derived(one.model_copy(update={"waves": None}))
        report.numbers += [(f"{name}: {what}", *number) for what, *number in own.numbers]
        report.warnings += [f"{name}: {sentence}" for sentence in own.warnings]
    for name, material in (scene.material or {}).items():
        if material.source is not None:
            report.add(f"breaking load of {name}", material.breaking_load or math.nan, "N", material.source)
    if scene.waves:
        in_waves(scene.model_copy(update={"cable": None, "buoy": None, "joint": None}), report)
    return report


def _network_at_rest(scene, report, comm):
    """Forces on the ends of every cable."""
    problem, network = solve_equilibrium(scene, comm), network_of(scene)
    for k, name in enumerate(network.cables):
        held, (low, high) = problem.anchor_force(cable=k), network.ends_of(k)
        report.add(f"equilibrium: tension of {name} at {high}", np.linalg.norm(problem.end_tension(cable=k)), "N")
        report.add(f"equilibrium: force of {name} at {low}", np.linalg.norm(held), "N")
        report.add(f"equilibrium: uplift of {name} at {low}", -held[2], "N", "the part that pulls it up")
        _grown(problem, report, k, f" to {name}")
    _strength(problem, report)
    if problem.lines.bed is not None:
        on_the_bed(problem, report)
    smallest = problem.smallest_tension()
    if smallest <= 0:
        report.warnings.append(f"The equilibrium has compressed elements (smallest tension {smallest:.4g} N).")
    _moored_periods(scene, problem, report)
    problem.destroy()


def _grown(problem, report, cable=0, which=""):
    """What marine growth adds to the weight of a cable."""
    lines, growth = problem.lines, problem.lines.growth
    if growth is None:
        return
    pieces = [k for k, piece in enumerate(lines.pieces) if piece.cable == cable and piece.section.marine_growth]
    if pieces:
        here = np.isin(lines.line_of_cell, pieces)
        diameter, mass = np.max(problem.comm.allgather(growth.factors[here].max(axis=0, initial=1.0)), axis=0)
        remark = f"diameter times {diameter:.4g}, mass times {mass:.4g} at most"
        weight = problem.comm.allreduce(float(growth.weights[here].sum()))
        report.add(f"marine growth adds in water{which}", weight, "N", remark)


def _strength(problem, report):
    """How near lines are to breaking."""
    if names := stressed(problem.network):
        use = Utilisation(problem)
        use.note()
        for name, value in zip(names, use.values, strict=True):
            which = f" of {name}" if is_network(problem.scene) else ""
            report.add(f"equilibrium: largest tension over breaking load{which}", value)
            if value > 1:
                report.warnings.append(f"The equilibrium is above the breaking load of {name}.")


def _cable(scene, report):
    c = single(scene).cable
    w = weight_per_length(scene, c)
    where = "in water" if scene.sea else "in air"
    report.add(f"cable weight {where} per metre", w, "N/m")
    report.add(f"cable weight {where}", w * c.length, "N")
    if w < 0:
        report.warnings.append("The cable is lighter than water: it floats up.")
    if math.isfinite(c.axial_stiffness):
        report.periods["cable, first axial (fixed ends)"] = 2 * c.length * math.sqrt(c.line_density / c.axial_stiffness)
        h = c.length / c.elements if isinstance(c.elements, int) else min(a / n for a, n in c.elements)
        bound = h / (2 * math.sqrt(3)) * math.sqrt(c.line_density / c.axial_stiffness)
        remark = "C = 1; for P1, smaller for higher degrees" if c.position_degree > 1 else "C = 1"
        report.add("explicit step limit of Eq. (24)", bound, "s", remark)
    else:
        report.add("explicit step limit of Eq. (24)", 0.0, "s", "inextensible: no explicit step at all")


def _buoy(scene, report):
    shape, mass = shape_and_mass(single(scene).buoy)
    rho_w, g = scene.sea.density, scene.gravity
    report.add("buoy mass with point masses", mass.mass, "kg")
    report.add("centre of mass C above keel", mass.height, "m")
    free = float_upright(shape, mass, rho_w, g)
    report.add("draft, free", free.draft, "m")
    report.add("GM, free", free.GM, "m")
    GM = _moored(scene, report) if single(scene).cable else free.GM
    if GM <= 0:
        report.warnings.append(f"GM = {GM:.3g} m is not positive: the upright buoy is unstable and heels over.")


def _moored(scene, report):
    """Upright above the anchor, where the cable hangs from the buoy or holds it down; returns GM."""
    shape, mass = shape_and_mass(single(scene).buoy)
    pull, spare = pull_upright(scene, next(iter(scene.network.buoys))), spare_buoyancy(scene, single(scene).buoy)
    how = (
        "with the weight of the cable"
        if pull <= hanging_weight(scene, next(iter(scene.network.buoys)))
        else "on its taut cable"
    )
    lever = "restoring lever per weight of the buoy"
    if drowned(scene, next(iter(scene.network.buoys))):
        arm = scene.sea.density * shape.volume() * (shape.centroid() - single(scene).buoy.mooring_height)
        GM = arm / mass.mass - (mass.height - single(scene).buoy.mooring_height)
        report.add("the cable holds the buoy under water: pull", spare, "N", "all of its spare buoyancy")
        report.add("GM under water", GM, "m", lever)
        return GM
    moored = float_upright(shape, mass, scene.sea.density, scene.gravity, pull, single(scene).buoy.mooring_height)
    report.add(f"draft {how}", moored.draft, "m")
    report.add(f"GM {how}", moored.GM, "m", lever)
    return moored.GM


def _equilibrium(scene, report, comm):
    problem = solve_equilibrium(scene, comm)
    u = problem.system.u
    if problem.lines:
        T_bnd, held = problem.end_tension(), problem.anchor_force()
        report.add("equilibrium: tension at the top", np.linalg.norm(T_bnd), "N")
        report.add("equilibrium: force at the anchor", np.linalg.norm(held), "N")
        report.add("equilibrium: uplift at the anchor", -held[2], "N", "the part that pulls it up")
        _grown(problem, report)
        _strength(problem, report)
        _shape_warnings(scene, problem, report)
        if not single(scene).buoy:
            _cable_periods(scene, problem, report)
    if problem.buoy and problem.lines:
        x, y, z = problem.buoy.fields.of(u[problem.buoy.part.slice]).position
        offset = math.hypot(x - single(scene).anchor[0], y - single(scene).anchor[1])
        report.add("equilibrium: offset of C from the anchor", offset, "m")
        report.add("equilibrium: C above still water", z, "m")
    _moored_periods(scene, problem, report)
    tolerance = scene.solver.step_tolerance
    for block in (block for block in problem.system.blocks if block.unit):
        size = tolerance * block.unknown_size(1.0, tolerance)
        report.add(f"tolerance of {block.name}", size, block.unit)
    problem.destroy()


def _moored_periods(scene, problem, report):
    """Of the modes of what floats and of its lines."""
    if scene.buoys and scene.sea and scene.gravity:
        from ..linear.periods import moored_periods  # and scipy, for which no run should wait

        report.periods |= moored_periods(scene, problem if problem.comm.size == 1 else None)


def _shape_warnings(scene, problem, report):
    u, cable = problem.system.u, problem.lines
    smallest = problem.smallest_tension()
    if smallest <= 0:
        report.warnings.append(f"The equilibrium has compressed elements (smallest tension {smallest:.4g} N).")
    if scene.seabed:
        on_the_bed(problem, report)
    elif scene.sea:
        lowest = u[cable.node_dofs][:, 2].min() + scene.sea.depth
        if lowest < -1e-6 * single(scene).cable.length:
            report.warnings.append(
                f"At rest the cable hangs up to {-lowest:.3g} m below the sea bed: there is no [seabed] to carry it."
            )
        slack = single(scene).cable.length - math.dist(
            single(scene).anchor, (single(scene).anchor[0], single(scene).anchor[1], 0.0)
        )
        if single(scene).buoy and slack > 0 and lowest >= -1e-6 * single(scene).cable.length:
            report.warnings.append(
                f"The cable is {slack:.3g} m longer than the water is deep: without load it hangs below its anchor."
            )


def _cable_periods(scene, problem, report):
    """Transverse modes of a taut cable, T_n = 2/n int sqrt(m/T) ds, with the equilibrium's tension."""
    c, cable = single(scene).cable, problem.lines
    added = scene.sea.density * cross_section(c) * c.added_mass if scene.sea else 0.0
    T, h = cable.mean_tension(problem.system.u), np.diff(cable.cell_ends, axis=1)[:, 0]
    mass = np.full(len(T), c.line_density + added)
    if cable.growth is not None:
        thicker, heavier = cable.growth.factors.T
        mass = heavier * c.line_density + thicker**2 * added
    if cable.bed is not None:  # what lies does not swing
        hangs = cable.cell_ends[:, 0] >= cable.bed.lying(problem.system.u).s
        T, h, mass = T[hangs], h[hangs], mass[hangs]
    if T.min() <= LEAST_TENSION * problem.typical_force:  # slack, it has no such modes
        return
    travel = float(np.sum(h * np.sqrt(mass / T)))
    for n in (1, 2):
        report.periods[f"cable, transverse {n} (taut, fixed ends)"] = 2 * travel / n
