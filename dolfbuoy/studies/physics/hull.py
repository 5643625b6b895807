"""A hull afloat and in small waves: hydrostatics, natural periods and response, moored and free.

The response is that of the equations linearised about the equilibrium, `linear.seaway`, checked by runs in small waves
at a few periods, and by potential flow if its coefficients are given.
"""

import cmath
import hashlib
import math
from collections.abc import Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from ...elsewhere import MPI
from ...errors import InputError, SolveError
from ...linear import LARGEST_KR
from ...linear.periods import buoy_periods
from ...linear.potential_flow import read_capytaine
from ...linear.seaway import responses
from ...linear.spectrum import check_periods
from ...model.prescribed_ends import adrift_nowhere
from ...model.rigid import Floating, float_upright, mass_properties, shape_of
from ...parallel.cases import evaluate_all
from ...results.style import COLORS, PAGE, Figure, legend_below, new_figure
from ...results.tables import groups
from ...scene import Scene, load_scene, settings
from ...scene.buoy import Buoy
from ...scene.sections import Initial
from ...statics.equilibrium import solve_equilibrium
from ...statics.righting import righting_curve
from ..study import Row, Table, refuse_network
from .response_runs import measured

#: Motion -> unit of its amplitude in waves.
MOTIONS = {"surge": "m/m", "heave": "m/m", "pitch": "rad/m"}
#: Amplitude of the runs over the diameter of the hull: small enough for drag and slopes, large enough for Newton.
AMPLITUDE = 1e-3
#: Periods of the response [s]: dense enough for a curve.
PERIODS = np.concatenate([np.linspace(2.0, 8.0, 61), np.linspace(8.25, 14.0, 24), np.linspace(14.5, 20.0, 12)])
#: Heel angles of the righting levers [deg].
HEELS = np.arange(0.0, 180.5, 5.0)


def request(name: str | Scene, periods: str, direction: float | None, capytaine: Path | None) -> Row:
    """The scene, periods of the runs in time, and the waves' direction, by default the scene's."""
    scene = load_scene(name)
    refuse_network(scene)
    if not scene.buoy or scene.sea is None or not scene.gravity:
        raise InputError("Study hull is of a floating buoy: the scene needs [buoy], [sea] and gravity.")
    if direction is None:
        direction = scene.waves.direction_deg if scene.waves else 0.0
    if not math.isfinite(direction):
        raise InputError(f"--direction {direction:g}: must be a finite number.")
    runs = settings.parse_numbers("--runs", periods)
    check_periods("--runs", runs or [])
    if capytaine:
        flow, mass, free = read_capytaine(capytaine), mass_properties(_buoy(scene)), _floating(scene)
        if free is None or free.GM <= 0:
            raise InputError(f"{capytaine}: is of a free buoy, but this one does not float upright without its cable.")
        center, own = flow.rotation_height, mass.height - free.draft
        if center is not None and abs(center - own) > 1e-3 * (_buoy(scene).hull or [(0.0, 0.0)])[-1][0]:
            raise InputError(
                f"{capytaine}: pitch is counted about a point {center:.4g} m above still water (rotation_center); "
                f"it must be C of the free buoy, at {own:.4g} m."
            )
    return {"scene": scene, "runs": runs, "direction": direction, "capytaine": capytaine}


def _buoy(scene: Scene) -> Buoy:
    """The only buoy."""
    return next(iter(scene.network.buoys.values()))


def _floating(scene: Scene, pull: float = 0.0) -> Floating | None:
    """Upright hydrostatics under a pull; None if the buoy sinks."""
    shape, mass, sea = shape_of(_buoy(scene)), mass_properties(_buoy(scene)), scene.sea
    try:
        if sea is None:
            return None
        return float_upright(shape, mass, sea.density, scene.gravity, pull, _buoy(scene).mooring_height)
    except InputError:
        return None


def cases(scene: Scene, runs: Sequence[float] = (), direction: float = 0.0, capytaine: Path | None = None) -> list[Row]:
    """Cases of hydrostatics, response, and a run per period; moored if there is a cable, free if the buoy floats.

    capytaine: a potential-flow file, with which the free buoy is compared.
    """
    free = _floating(scene)
    ways = ["moored"] * (scene.cable is not None) + ["free"] * (free is not None)
    upright = [held for held in ways if held == "moored" or (free and free.GM > 0)]
    common = {"study": "hull", "scene": scene.to_dict(), "direction": direction}
    found: list[Row] = [{"part": "hydrostatics", "held": held} for held in ways]
    found += [{"part": "response", "held": held, "periods": PERIODS.tolist()} for held in upright]
    found += [{"part": "run", "held": held, "period": float(T)} for held in upright for T in runs]
    if capytaine:
        digest = hashlib.sha256(Path(capytaine).read_bytes()).hexdigest()
        found.append({"part": "flow", "held": "free", "file": str(capytaine), "digest": digest})
    return [common | case for case in found]


def evaluate(case: Row) -> Row:
    """Rows of a case, of the scene "moored" or its buoy "free" in still water, or the reason of a failed solve."""
    scene = load_scene(case["scene"])
    if case["held"] == "free":
        free = {"cable": None, "joint": None, "seabed": None, "initial": Initial()}
        scene = adrift_nowhere(scene).model_copy(update=free)
    try:
        return PARTS[case["part"]](scene, case)
    except SolveError as error:
        return {"reason": str(error)}


def _hydrostatics(scene: Scene, _: Any) -> Row:
    """Righting levers and upright hydrostatics; moored, under the vertical pull of the cable at rest."""
    pull = 0.0
    if scene.cable:
        problem = solve_equilibrium(scene, MPI.COMM_SELF)
        T_O: Any = problem.end_tension()
        pull = float(T_O[2])
        problem.destroy()
    floating, mass = _floating(scene, pull), mass_properties(_buoy(scene))
    if floating is None:
        raise SolveError(f"the cable pulls at the buoy with {pull:.4g} N, under which it cannot float upright")
    levers = [row._asdict() for row in righting_curve(scene, HEELS, pull)]
    numbers = {"mass": mass.mass, "pull": pull, "KG": mass.height} | vars(floating) | _stability(levers)
    return {"rows": levers, "numbers": numbers}


def _response(scene: Scene, case: Row) -> Row:
    """Natural periods, and the response at every period."""
    natural, rows = buoy_periods(scene, direction_deg=case["direction"]), []
    for one in responses(scene, case["periods"], case["direction"]):
        amplitudes = {name: getattr(one.motions, name) for name in MOTIONS}
        rows.append({"period": one.period, "wavelength": 2 * math.pi / one.wavenumber})
        for name, X in (amplitudes | {"pitch_over_slope": one.pitch_over_slope}).items():
            phase = round(math.degrees(cmath.phase(X)), 3) + 0.0  # lag behind the elevation; no -0
            rows[-1] |= {name: abs(X), f"{name}_phase": phase if phase > -180 else 180.0}
    return {"natural": [{"motion": name, **mode._asdict()} for name, mode in natural.items()], "rows": rows}


def _run(scene: Scene, case: Row) -> Row:
    """Motions from a run in time."""
    shape: Any = shape_of(_buoy(scene))
    amplitude = AMPLITUDE * shape.max_diameter
    found = measured(scene, case["period"], case["direction"], amplitude)
    (own,) = responses(scene, [case["period"]], case["direction"])
    return {"rows": [_compared(found, own, "run")]}


def _flow(scene: Scene, case: Row) -> Row:
    """Motions from potential flow, with the mass and stiffness of the free buoy."""
    flow, mass = read_capytaine(case["file"]), mass_properties(_buoy(scene))
    free: Any = _floating(scene)
    stiffness = (0.0, free.heave_stiffness, mass.mass * scene.gravity * free.GM)
    found = flow.responses((mass.mass, mass.mass, mass.inertia[0]), stiffness)
    own = responses(scene, flow.periods, case["direction"])
    rows = [_compared(dict(zip(MOTIONS, X, strict=True)), o, "flow") for X, o in zip(found, own, strict=True)]
    return {"rows": sorted(rows, key=lambda row: row["period"]), "depth": flow.depth}


def _compared(other: Mapping[str, complex], own: Any, name: str) -> Row:
    """Other motions next to ours, and the difference of the complex amplitudes in percent of the former."""
    row = {"period": own.period}
    for motion in MOTIONS:
        X, linear = other[motion], getattr(own.motions, motion)
        row |= {f"{motion}_{name}": abs(X), f"{motion}_{name}_phase": math.degrees(cmath.phase(X))}
        row |= {motion: abs(linear), f"{motion}_difference": 100 * abs(X - linear) / abs(X) if X else None}
    return row | {f"pitch_over_slope_{name}": abs(other["pitch"]) / own.wavenumber}


def _stability(levers: list[Row]) -> Row:
    """Heel at which the lever first vanishes, largest lever below it, and its heel."""
    heel, lever = (np.array([point[key] for point in levers]) for key in ("heel_deg", "lever"))
    lost = next((k for k in range(2, len(heel)) if lever[k] <= 1e-9 < lever[k - 1]), None)
    vanishing = None
    if lost is not None:
        share = lever[lost - 1] / (lever[lost - 1] - lever[lost])
        vanishing = float(heel[lost - 1] + share * (heel[lost] - heel[lost - 1]))
    top = int(np.argmax(lever[:lost]))
    return {"vanishing": vanishing, "largest": float(lever[top]), "heel_of_largest": float(heel[top])}


PARTS = {"hydrostatics": _hydrostatics, "response": _response, "run": _run, "flow": _flow}
NATURAL_TITLE = "\nNatural periods about the equilibrium, of the modes with most of their energy in a motion"
RUNS_TITLE = "\nRuns in time (BDF2, small waves), and how far the linear response is from them, as complex numbers"
RESONANCE = (
    "Near a natural period with little damping a run is not steady by then, and its drag, which the linear response "
    "lacks in still water, counts."
)
#: Key -> quantity and unit of the hydrostatic numbers.
NUMBERS = {
    "mass": ("mass", "kg"),
    "pull": ("vertical pull of the cable at rest", "N"),
    "displaced_mass": ("displaced mass", "kg"),
    "draft": ("draft", "m"),
    "KG": ("KG", "m"),
    "KB": ("KB", "m"),
    "BM": ("BM", "m"),
    "GM": ("GM, lever per heel and weight of the buoy", "m"),
    "heave_stiffness": ("heave stiffness", "N/m"),
    "largest": ("largest righting lever", "m"),
    "heel_of_largest": ("at the heel", "deg"),
    "vanishing": ("lever vanishes at", "deg"),
}
NATURAL = {"held": "", "motion": "motion", "period": "period [s]", "damping_ratio": "damping ratio"}
NATURAL |= {"share": "share of the energy"}


def _columns(first: dict[str, str], ending: str, second: str, heading: str) -> dict[str, str]:
    """Key -> heading of a table with two columns for each motion."""
    pairs = [{f"{name}{ending}": f"{name} [{unit}]", f"{name}{second}": heading} for name, unit in MOTIONS.items()]
    return first | {key: heading for pair in pairs for key, heading in pair.items()}


PERIOD = {"period": "T [s]"}
RUNS = _columns({"held": ""} | PERIOD, "_run", "_difference", "off [%]")
FLOW = _columns(PERIOD, "_flow", "_difference", "strips off [%]")
RESPONSE = _columns({"held": ""} | PERIOD | {"wavelength": "wavelength [m]"}, "", "_phase", "phase [deg]")
RESPONSE |= {"pitch_over_slope": "pitch/slope", "pitch_over_slope_phase": "phase [deg]"}


def study(
    folder: Path, scene: Scene, runs: list[float], direction: float = 0.0, capytaine: Path | None = None
) -> list[Table]:
    """Tables of hydrostatics, levers, natural periods, response, runs, and potential flow if given."""
    found = evaluate_all(evaluate, cases(scene, runs, direction, capytaine), folder, itemgetter("part", "held"))
    if found is None:
        return []
    failed = [f"{case['part']}, {case['held']}: {case['reason']}" for case in found if "reason" in case]
    parts = {part: [c for c in found if c["part"] == part and "reason" not in c] for part in PARTS}
    levers, linear, checked, flows = (
        [{"held": case["held"], **row} for case in parts[part] for row in case["rows"]] for part in PARTS
    )
    natural = [{"held": case["held"], **mode} for case in parts["response"] for mode in case["natural"]]
    numbers = {case["held"]: case["numbers"] for case in parts["hydrostatics"]}
    at_rest = [
        {"quantity": quantity, "unit": unit} | {held: found[key] for held, found in numbers.items()}
        for key, (quantity, unit) in NUMBERS.items()
    ]
    heads = {"quantity": "", "unit": ""} | {held: held for held in numbers}
    stability = draw_levers(levers, {held: found["GM"] for held, found in numbers.items()})
    hull: Any = shape_of(_buoy(scene))
    shortest = 2 * math.pi / math.sqrt(LARGEST_KR * scene.gravity / (hull.max_diameter / 2))  # in deep water
    title = "The hull upright, moored under the vertical pull of its cable; {folder}\n"
    tables = [
        Table("hull", at_rest, title, heads, failed),
        Table("hull-righting", levers, figure=stability),
        Table("hull-periods", natural, NATURAL_TITLE, NATURAL, _unheld(scene)),
        Table("hull-response", linear, figure=draw_responses(linear, checked, flows, shortest)),
        Table("", [row for row in linear if row["period"] == int(row["period"])], columns=RESPONSE),
    ]
    tables[-1].title = f"\nResponse to small waves towards {direction:g} degrees, per metre of amplitude"
    tables[-1].notes = [
        f"Below {shortest:.2g} s k R is above {LARGEST_KR:g}: strips are 20 to 100 % off there.",
        "Phases: by which the motion of C comes after the elevation above its place at rest; pitch turns the top along "
        "the waves; pitch/slope is -1 where the hull follows the water.",
        "No wave is radiated but by buoy.wave_damping, and drag is linear about the mean current: in still water peaks "
        "have no bound.",
    ]
    if checked:
        tables.append(Table("hull-runs", checked, RUNS_TITLE, RUNS, [RESONANCE]))
    for case in parts["flow"]:
        here = scene.sea.depth if scene.sea else math.inf
        depths = f"depth {case['depth']:g} m, here {here:g} m"
        title = f"\nPotential flow ({depths}) and the free buoy, as complex numbers"
        tables.append(Table("hull-potential-flow", flows, title, FLOW))
    return tables


def _unheld(scene: Scene) -> list[str]:
    """Sentence on why a moored buoy is not analysed without its cable."""
    free = _floating(scene)
    if scene.cable is None or (free is not None and free.GM > 0):
        return []
    if free is None:
        return ["This buoy is not analysed without its cable: it sinks."]
    return [f"This buoy is not analysed in waves without its cable: it does not float upright (GM {free.GM:.3g} m)."]


COLOR = {"moored": COLORS["blue"], "free": COLORS["red"]}
PANELS = {"surge": "surge [m/m]", "heave": "heave [m/m]", "pitch_over_slope": "pitch / slope of the wave"}


def draw_responses(linear: list[Row], runs: list[Row], flow: list[Row], shortest: float) -> Figure:
    """Amplitudes and phases of surge, heave and pitch; runs and flow: rows marked next to the curves.

    shortest: period below which waves are too short for strips.
    """
    figure = new_figure(PAGE, 4.2)
    panels = figure.subplots(2, 3, sharex=True)
    for (name, title), (top, below) in zip(PANELS.items(), panels.T, strict=True):
        phase = name.split("_")[0]  # motion; its phase is in the panel below
        for held, rows in groups(linear, "held").items():
            period, phases = ([row[key] for row in rows] for key in ("period", f"{phase}_phase"))
            top.plot(period, [row[name] for row in rows], color=COLOR[held], label=held)
            broken = np.abs(np.diff(phases, prepend=phases[0])) > 170  # at an undamped peak, or wrapped
            below.plot(period, np.where(broken, np.nan, phases), color=COLOR[held])
            _mark(top, below, name, phase, [row for row in runs if row["held"] == held], "run", COLOR[held])
        _mark(top, below, name, phase, flow, "flow", COLORS["ink"])
        values = [row[name] for row in linear if row["period"] >= shortest] or [row[name] for row in linear]
        if values:  # at most three times the median: undamped peaks are unbounded
            top.set_ylim(0, 1.08 * min(max(values), 3 * float(np.median(values))))
        top.set_title(title)
        below.set(xlabel="period [s]", ylim=(-190, 190), yticks=range(-180, 181, 90))
        for axes in (top, below):
            axes.axvspan(0, shortest, color=COLORS["sand"], alpha=0.25, lw=0)
            axes.set(xlim=(2, 20.5), xticks=[2, 5, 10, 15, 20])
    panels[0, 0].set_ylabel("amplitude")
    panels[1, 0].set_ylabel("phase after the crest [deg]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    one_each = dict(zip(labels, handles, strict=True))
    legend_below(figure, 0.3, 5, sorted(one_each.values(), key=lambda line: line.get_marker() != "None"))
    return figure


def _mark(top: Any, below: Any, name: str, phase: str, rows: list[Row], source: str, color: str) -> None:
    """Mark points of runs or potential flow, if any."""
    if not rows:
        return
    marker, label = {"run": ("o", "runs in time"), "flow": ("+", "potential flow, free")}[source]
    style = {"ls": "", "marker": marker, "color": color, "mfc": "none", "ms": 5, "label": label}
    period = [row["period"] for row in rows]
    top.plot(period, [row[f"{name}_{source}"] for row in rows], **style)
    below.plot(period, [row[f"{phase}_{source}_phase"] for row in rows], **style)


def draw_levers(levers: list[Row], GM: dict[str, float]) -> Figure:
    """Righting levers over the heel, with the slope GM at 0; GM: held -> value."""
    figure = new_figure(PAGE / 2, 2.6)
    axes = figure.subplots()
    for held, rows in groups(levers, "held").items():
        heel, lever = ([row[key] for row in rows] for key in ("heel_deg", "lever"))
        axes.plot(heel, lever, color=COLOR[held], label=held)
        axes.plot([0, 20], [0, GM[held] * math.radians(20)], ":", color=COLOR[held], lw=0.8)
    axes.axhline(0, color=COLORS["ink"], lw=0.6)
    axes.set(xlabel="heel [deg]", ylabel="righting lever GZ [m]", xlim=(0, 180), xticks=range(0, 181, 30))
    if levers:
        axes.legend()
    return figure
