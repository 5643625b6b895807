"""What a naval engineer looks at before a run: derived numbers of a scene, and where its model leaves its range."""

import math
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI

from .check_bed import on_the_bed
from .linear import LARGEST_KR
from .model.airy import AirySum
from .model.components import band_of, components_of, current_felt, dispersion_wavenumber, spectrum_of
from .model.effects import names as effects_of
from .model.feasible import check_feasible, hanging_weight, pull_upright, shape_and_mass, spare_buoyancy
from .model.first_shape import check_first_shape
from .model.hydrostatics import float_upright
from .model.material import cross_section, weight_per_length
from .model.sea import crest_height, main_propagation, wavenumber
from .model.sea_statistics import components_needed, largest_crest, scatter_of_m0, seeds_needed
from .results.utilisation import Utilisation, stressed
from .scene.network import network_of, with_buoy, with_line
from .scene.waves import Waves
from .statics.equilibrium import solve_equilibrium

#: A cable with less tension than this part of the forces of its scene is taken for slack.
LEAST_TENSION = 1e-4

#: What extremes are counted over [s].
THREE_HOURS = 10800.0

#: k D of a component from which on a hull of diameter D does more to it than strips know.
SHORTEST_KD = 2


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
    if scene.initial.kind == "equilibrium" and (scene.cable or scene.sea):
        (_network_at_rest if scene.is_network else _equilibrium)(scene, report, comm)
    return report


def derived(scene) -> Report:
    """Numbers and warnings that need no equilibrium.  Raises InputError for a buoy that sinks."""
    report = Report(effects_of(scene))
    if scene.is_network:
        return _network(scene, report)
    if scene.cable:
        _cable(scene, report)
    if scene.buoy and scene.sea and scene.gravity:
        _buoy(scene, report)
    if scene.waves:
        _sea(scene, report)
        _waves(_main_wave(scene), report)
    return report


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
        empty = scene.model_copy(update={"cable": None, "buoy": None, "joint": None})
        _sea(empty, report)
        _waves(_main_wave(empty), report)
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
            which = f" of {name}" if problem.scene.is_network else ""
            report.add(f"equilibrium: largest tension over breaking load{which}", value)
            if value > 1:
                report.warnings.append(f"The equilibrium is above the breaking load of {name}.")


def _cable(scene, report):
    c = scene.cable
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
    shape, mass = shape_and_mass(scene)
    rho_w, g = scene.sea.density, scene.gravity
    report.add("buoy mass with point masses", mass.mass, "kg")
    report.add("centre of mass C above keel", mass.height, "m")
    free = float_upright(shape, mass, rho_w, g)
    report.add("draft, free", free.draft, "m")
    report.add("GM, free", free.GM, "m")
    GM = _moored(scene, report) if scene.cable else free.GM
    if GM <= 0:
        report.warnings.append(f"GM = {GM:.3g} m is not positive: the upright buoy is unstable and heels over.")


def _drowned(scene):
    """Whether the cable is too short for any of the buoy to be above the water."""
    return scene.cable is not None and pull_upright(scene) >= spare_buoyancy(scene) * (1 - 1e-9)


def _moored(scene, report):
    """Upright above the anchor, where the cable hangs from the buoy or holds it down; returns GM."""
    shape, mass = shape_and_mass(scene)
    pull, spare = pull_upright(scene), spare_buoyancy(scene)
    how = "with the weight of the cable" if pull <= hanging_weight(scene) else "on its taut cable"
    lever = "restoring lever per weight of the buoy"
    if _drowned(scene):
        arm = scene.sea.density * shape.volume() * (shape.centroid() - scene.buoy.mooring_height)
        GM = arm / mass.mass - (mass.height - scene.buoy.mooring_height)
        report.add("the cable holds the buoy under water: pull", spare, "N", "all of its spare buoyancy")
        report.add("GM under water", GM, "m", lever)
        return GM
    moored = float_upright(shape, mass, scene.sea.density, scene.gravity, pull, scene.buoy.mooring_height)
    report.add(f"draft {how}", moored.draft, "m")
    report.add(f"GM {how}", moored.GM, "m", lever)
    return moored.GM


def _sea(scene, report):
    """What the components of an irregular sea add up to, and what a current makes of the periods."""
    waves = scene.waves
    if waves.irregular:
        found = components_of(waves)
        m0, m2 = found.moment(0), found.moment(2)
        Tz = 2 * math.pi * math.sqrt(m0 / m2)
        report.add("significant wave height Hs", 4 * math.sqrt(m0), "m", f"of {len(found.amplitude)} components")
        if waves.elevation is None:
            report.add("peak period Tp", waves.main_period, "s", "of the highest component or the spectrum's peak")
        report.add("mean period Tz = 2 pi sqrt(m0/m2)", Tz, "s", f"shortest {2 * math.pi / max(found.frequency):.3g} s")
        _cut(scene, report)
        if scene.gravity:
            steepness = 2 * math.pi * 4 * math.sqrt(m0) / (scene.gravity * Tz**2)
            report.add("significant steepness 2 pi Hs/(g Tz^2)", steepness, "", "seas stay below 0.1")
        _repetition(waves, report)
        _statistics(scene, Tz, report)
        _short_components(scene, found, report)
    if scene.current:
        _shift(scene, report)


def _cut(scene, report):
    """What the band leaves out of a spectrum."""
    spectrum = spectrum_of(scene.waves)
    if spectrum is None:
        return
    band = band_of(scene.waves, spectrum)
    for n in (0, 2):
        cut = 1 - spectrum.moment(n, *band) / spectrum.moment(n)
        remark = f"outside {2 * math.pi / band[1]:.3g} ... {2 * math.pi / max(band[0], 1e-9):.3g} s"
        if n == 2 and isinstance(scene.waves.spectrum, str):  # its tail carries m4 = inf
            remark += "; most of it in ripples"
        report.add(f"cut off of m{n}", 100 * cut, "%", remark)


def _repetition(waves, report):
    if waves.elevation is not None:
        times = [t for t, _ in waves.elevation]
        length = (times[-1] - times[0]) * len(times) / (len(times) - 1)
        report.add("the sea repeats after", length, "s", "the length of the record")
    elif waves.spectrum is not None:
        report.add("the sea repeats after", math.inf, "s", "bins of equal energy have no common period")


def _statistics(scene, Tz, report):
    """How many components and seeds extremes of this sea need, and what one run tells of its height."""
    crests = max(THREE_HOURS / Tz, 2.0)
    mean, deviation = largest_crest(crests)
    height, scatter = mean * crest_height(scene) / 4, 100 * deviation / mean
    report.add("largest crest in 3 h", height, "m", f"+- {scatter:.2g} % from seed to seed")
    if scene.waves.spectrum is not None:
        needed, seeds = components_needed(crests, 0.01), seeds_needed(crests, 0.03)
        report.add("components for 1 % of that crest", needed, "", f"3 % of it need {seeds} seeds of 3 h")
        if scene.time and scene.time.end:
            scatter = scatter_of_m0(spectrum_of(scene.waves), scene.time.end)
            report.add("scatter of Hs in one run", 50 * scatter, "%", "of a Gaussian sea; with fixed amplitudes less")


def _short_components(scene, found, report):
    """Components for which Morison's equation and strips are not meant."""
    if scene.buoy is None or scene.buoy.hull is None:
        return
    diameter = shape_and_mass(scene)[0].max_diameter
    k = AirySum.of(scene).wavenumber
    count = int(np.sum(k * diameter > SHORTEST_KD))
    report.add(f"components with k D > {SHORTEST_KD}", count, "", f"of {len(k)}, shorter than {math.pi:.3g} diameters")


def _shift(scene, report):
    """One sentence on who sees the periods."""
    seen, period = scene.waves.period_seen_from, scene.waves.main_period
    found = main_propagation(scene)
    shift = found.wavenumber * current_felt(scene, found.wavenumber, scene.waves.direction_deg)
    who = {
        None: f"not counted: {period:.4g} s is seen from the water and the ground; see waves.period_seen_from",
        "water": f"{period:.4g} s is seen from the water, {2 * math.pi / abs(found.at_ground):.4g} s from the ground",
        "ground": f"{period:.4g} s is seen from the ground, {2 * math.pi / abs(found.in_water):.4g} s from the water",
    }[seen]
    report.add("shift of omega by the current", 100 * shift / found.in_water, "%", who)


def _main_wave(scene):
    """The scene, its irregular sea as a regular wave of Hs and the main period."""
    waves = scene.waves
    if not waves.irregular:
        return scene
    kept = {name: getattr(waves, name) for name in ("direction_deg", "period_seen_from")}
    return scene.model_copy(update={"waves": Waves(height=crest_height(scene), period=waves.main_period, **kept)})


def _waves(scene, report):
    w, h, g = scene.waves, scene.sea.depth, scene.gravity
    k, omega = wavenumber(scene), 2 * math.pi / w.period
    wavelength = 2 * math.pi / k
    report.periods["wave"] = w.period
    report.add("wavelength", wavelength, "m", "given" if w.wavelength else "from the dispersion relation")
    if w.wavelength and g:
        exact = 2 * math.pi / dispersion_wavenumber(w.period, h, g)
        mismatch = wavelength / exact - 1
        remark = f"the period gives {exact:.4g} m; omega^2/(g k tanh kh) = {omega**2 / (g * k * math.tanh(k * h)):.5g}"
        report.add("dispersion mismatch of wavelength", 100 * mismatch, "%", remark)
        if abs(mismatch) > 0.1:
            report.warnings.append(f"The wavelength differs from the dispersion relation's by {100 * mismatch:.1f} %.")
    breaking = 0.142 * math.tanh(k * h)
    steepness = 2 * w.size / wavelength
    report.add("wave steepness H/lambda", steepness, "", f"breaking at {breaking:.4g} (Miche)")
    if steepness > breaking:
        report.warnings.append(f"The wave (H/lambda = {steepness:.3g}) is beyond the breaking limit {breaking:.3g}.")
    if scene.buoy:
        diameter = shape_and_mass(scene)[0].max_diameter
        ratio = diameter / wavelength
        report.add("diffraction parameter D/lambda", ratio, "", "Morison's equation holds below 0.2")
        if ratio >= 0.2:
            report.warnings.append(f"D/lambda = {ratio:.3g} is not below 0.2: diffraction is not negligible.")
        _strips(scene, report, k * diameter / 2)
        _keulegan_carpenter(report, "buoy", scene, k, diameter)
    if scene.cable:
        _keulegan_carpenter(report, "cable", scene, k, scene.cable.diameter)


def _strips(scene, report, k_R):
    """Where strips leave their range: short waves, and no waves of the buoy's own."""
    report.add("k R of the hull", k_R, "", "strips are good to 3 % of the motion below 0.4")
    if k_R > LARGEST_KR:
        report.warnings.append(f"k R = {k_R:.3g} is above {LARGEST_KR}: strips of the hull may be 20 to 100 % wrong.")
    if not scene.gravity or _drowned(scene):
        return
    damping = _heave_damping(scene)
    given = " and wave_damping" if scene.buoy.wave_damping else ""
    remark = f"of axial_drag{given}, for heave as high as this wave; the hull radiates no waves"
    report.add("heave damping ratio", damping, "", remark)


def _heave_damping(scene):
    """Damping ratio that drag gives to a heave of the wave's amplitude and period, linearised to the same work."""
    shape, mass = shape_and_mass(scene)
    b, rho_w, omega = scene.buoy, scene.sea.density, 2 * math.pi / scene.waves.period
    floating = float_upright(shape, mass, rho_w, scene.gravity, pull_upright(scene))
    area, spheres, _ = shape.projected(floating.draft)
    linear = 8 / (3 * math.pi) * 0.5 * rho_w * b.axial_drag * area * omega * scene.waves.size
    linear += b.wave_damping[0] if b.wave_damping else 0.0
    inertia = mass.mass + b.axial_added_mass * rho_w * spheres
    return linear / (2 * math.sqrt(floating.heave_stiffness * inertia)) if floating.heave_stiffness else math.inf


def _keulegan_carpenter(report, name, scene, k, diameter):
    speed = 2 * math.pi / scene.waves.period * scene.waves.size / math.tanh(k * scene.sea.depth)
    report.add(f"Keulegan-Carpenter number of the {name}", speed * scene.waves.period / diameter, "", "at the surface")


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
        if not scene.buoy:
            _cable_periods(scene, problem, report)
    if problem.buoy and problem.lines:
        x, y, z = problem.buoy.fields.of(u[problem.buoy.part.slice]).position
        offset = math.hypot(x - scene.anchor[0], y - scene.anchor[1])
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
        from .linear.periods import moored_periods  # and scipy, for which no run should wait

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
        if lowest < -1e-6 * scene.cable.length:
            report.warnings.append(
                f"At rest the cable hangs up to {-lowest:.3g} m below the sea bed: there is no [seabed] to carry it."
            )
        slack = scene.cable.length - math.dist(scene.anchor, (scene.anchor[0], scene.anchor[1], 0.0))
        if scene.buoy and slack > 0 and lowest >= -1e-6 * scene.cable.length:
            report.warnings.append(
                f"The cable is {slack:.3g} m longer than the water is deep: without load it hangs below its anchor."
            )


def _cable_periods(scene, problem, report):
    """Transverse modes of a taut cable, T_n = 2/n int sqrt(m/T) ds, with the equilibrium's tension."""
    c, cable = scene.cable, problem.lines
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
