"""A hull afloat and in small waves: hydrostatics, natural periods and response, moored and free.

The response is that of the equations linearised about the equilibrium, `linear.response`.  Runs in time in small waves
check it at a few periods; potential flow stands beside it where its coefficients are given.
"""

import cmath
import hashlib
import math
from operator import itemgetter
from pathlib import Path

import numpy as np

from ...elsewhere import MPI
from ...errors import InputError, SolveError
from ...linear import LARGEST_KR
from ...linear.linearisation import linearise
from ...linear.periods import natural_periods
from ...linear.potential_flow import read_capytaine
from ...linear.response import check_periods, response, responses, small_waves
from ...model.feasible import shape_and_mass
from ...model.prescribed_ends import adrift_nowhere
from ...model.rigid import float_upright
from ...parallel.cases import evaluate_all
from ...scene import Scene, load_scene, settings
from ...scene.sections import Initial
from ...statics.equilibrium import solve_equilibrium
from ...statics.righting import righting_curve
from ..study import Table, refuse_network
from . import hull_figures as figures
from .response_runs import measured

#: Motion -> unit of its amplitude in waves.
MOTIONS = {"surge": "m/m", "heave": "m/m", "pitch": "rad/m"}
#: Amplitude of the runs over the diameter of the hull: small enough for drag and slopes, large enough for Newton.
AMPLITUDE = 1e-3
#: Periods of the response [s]: dense enough for a curve.
PERIODS = np.concatenate([np.linspace(2.0, 8.0, 61), np.linspace(8.25, 14.0, 24), np.linspace(14.5, 20.0, 12)])
#: Heels of the righting levers [deg].
HEELS = np.arange(0.0, 180.5, 5.0)


def request(scene: str, runs: str, direction: float | None, capytaine: Path | None) -> dict:
    """The scene, periods of the runs in time, and the waves' direction, by default the scene's."""
    scene = load_scene(scene)
    refuse_network(scene)
    if not scene.buoy or scene.sea is None or not scene.gravity:
        raise InputError("Study hull looks at a floating buoy: the scene needs [buoy], [sea] and gravity.")
    if direction is None:
        direction = scene.waves.direction_deg if scene.waves else 0.0
    if not math.isfinite(direction):
        raise InputError(f"--direction {direction:g}: must be a finite number.")
    runs = settings.parse_numbers("--runs", runs)
    check_periods("--runs", runs)
    if capytaine:
        _check_flow(scene, capytaine)
    return {"scene": scene, "runs": runs, "direction": direction, "capytaine": capytaine}


def _buoy(scene):
    """The only one."""
    return next(iter(scene.network.buoys.values()))


def _check_flow(scene, path):
    """Refuse potential flow of another body, or beside a buoy that does not float."""
    flow, (_, mass), free = read_capytaine(path), shape_and_mass(_buoy(scene)), _floating(scene)
    if free is None or free.GM <= 0:
        raise InputError(f"{path}: stands beside a free buoy, but this one does not float upright without its cable.")
    center = mass.height - free.draft
    if flow.rotation_height is not None and abs(flow.rotation_height - center) > 1e-3 * _buoy(scene).hull[-1][0]:
        raise InputError(
            f"{path}: pitch is counted about a point {flow.rotation_height:.4g} m above still water (rotation_center); "
            f"it must be C of the free buoy, at {center:.4g} m."
        )


def _floating(scene, pull=0.0):
    """Upright hydrostatics under a pull; None if the buoy sinks."""
    shape, mass = shape_and_mass(_buoy(scene))
    try:
        return float_upright(shape, mass, scene.sea.density, scene.gravity, pull, _buoy(scene).mooring_height)
    except InputError:
        return None


def held_as(scene: Scene, held: str) -> Scene:
    """The scene "moored" as it is, or its buoy "free" in still water."""
    free = {"cable": None, "joint": None, "seabed": None, "initial": Initial()}
    return scene if held == "moored" else adrift_nowhere(scene).model_copy(update=free)


# -- cases -------------------------------------------------------------------------------------------------------------


def cases(scene: Scene, runs=(), direction: float = 0.0, capytaine: Path | None = None) -> list[dict]:
    """Hydrostatics, response, and a run for every period; moored if there is a cable, free if the buoy can be.

    capytaine: a file of potential flow, which stands beside the free buoy.
    """
    free = _floating(scene)
    ways = ["moored"] * (scene.cable is not None) + ["free"] * (free is not None)
    upright = [held for held in ways if held == "moored" or free.GM > 0]
    common = {"study": "hull", "scene": scene.to_dict(), "direction": direction}
    found = [{"part": "hydrostatics", "held": held} for held in ways]
    found += [{"part": "response", "held": held, "periods": PERIODS.tolist()} for held in upright]
    found += [{"part": "run", "held": held, "period": float(T)} for held in upright for T in runs]
    if capytaine:
        digest = hashlib.sha256(Path(capytaine).read_bytes()).hexdigest()
        found.append({"part": "flow", "held": "free", "file": str(capytaine), "digest": digest})
    return [common | case for case in found]


def evaluate(case: dict) -> dict:
    """The rows that the case's part finds; a reason if its solve fails."""
    part = {"hydrostatics": _hydrostatics, "response": _response, "run": _run, "flow": _flow}[case["part"]]
    try:
        return part(held_as(load_scene(case["scene"]), case["held"]), case)
    except SolveError as error:
        return {"reason": str(error)}


def _hydrostatics(scene, _):
    """Righting levers, and upright numbers; moored under the vertical pull of the cable at rest."""
    pull = 0.0
    if scene.cable:
        problem = solve_equilibrium(scene, MPI.COMM_SELF)
        pull = float(problem.end_tension()[2])
        problem.destroy()
    floating, (_, mass) = _floating(scene, pull), shape_and_mass(_buoy(scene))
    if floating is None:
        raise SolveError(f"the cable pulls at the buoy with {pull:.4g} N, under which it cannot float upright")
    levers = [row._asdict() for row in righting_curve(scene, HEELS, pull)]
    numbers = {"mass": mass.mass, "pull": pull, "KG": mass.height} | vars(floating) | _stability(levers)
    return {"rows": levers, "numbers": numbers}


def _response(scene, case):
    """Natural periods, and the response at every period."""
    found = linearise(scene, MPI.COMM_SELF, small_waves(scene, case["periods"][0]))
    try:
        natural = natural_periods(found, case["direction"])
        rows = [_response_row(response(found, period, case["direction"])) for period in case["periods"]]
    finally:
        found.destroy()
    return {"natural": [{"motion": name, **mode._asdict()} for name, mode in natural.items()], "rows": rows}


def _response_row(found):
    row = {"period": found.period, "wavelength": 2 * math.pi / found.wavenumber}
    for name in MOTIONS:
        row |= _polar(name, getattr(found.motions, name))
    return row | _polar("pitch_over_slope", found.pitch_over_slope)


def _run(scene, case):
    """Motions by a run in time."""
    amplitude = AMPLITUDE * shape_and_mass(_buoy(scene))[0].max_diameter
    found = measured(scene, case["period"], case["direction"], amplitude)
    (own,) = responses(scene, [case["period"]], case["direction"])
    return {"rows": [_compared(found, own, "run")]}


def _flow(scene, case):
    """Motions by potential flow, with the mass and stiffness of the free buoy."""
    flow, (_, mass), free = read_capytaine(case["file"]), shape_and_mass(_buoy(scene)), _floating(scene)
    stiffness = (0.0, free.heave_stiffness, mass.mass * scene.gravity * free.GM)
    found = flow.responses((mass.mass, mass.mass, mass.inertia[0]), stiffness)
    own = responses(scene, flow.periods, case["direction"])
    rows = [_compared(dict(zip(MOTIONS, X, strict=True)), o, "flow") for X, o in zip(found, own, strict=True)]
    return {"rows": sorted(rows, key=lambda row: row["period"]), "depth": flow.depth}


def _polar(name, X):
    """Amplitude, and the phase [deg, -180 < phase <= 180] by which the motion comes after the elevation."""
    phase = round(math.degrees(cmath.phase(X)), 3) + 0.0  # no -0
    return {name: abs(X), f"{name}_phase": phase if phase > -180 else 180.0}


def _compared(other, own, name):
    """Another's motions with our own, and the difference as complex numbers in percent of the other's."""
    row = {"period": own.period}
    for motion in MOTIONS:
        X, linear = other[motion], getattr(own.motions, motion)
        row |= {f"{motion}_{name}": abs(X), f"{motion}_{name}_phase": math.degrees(cmath.phase(X))}
        row |= {motion: abs(linear), f"{motion}_difference": 100 * abs(X - linear) / abs(X) if X else None}
    return row | {f"pitch_over_slope_{name}": abs(other["pitch"]) / own.wavenumber}


def _stability(levers):
    """The heel at which the lever first vanishes, the largest lever up to there, and its heel."""
    heel, lever = (np.array([point[key] for point in levers]) for key in ("heel_deg", "lever"))
    lost = next((k for k in range(2, len(heel)) if lever[k] <= 1e-9 < lever[k - 1]), None)
    vanishing = None
    if lost is not None:
        share = lever[lost - 1] / (lever[lost - 1] - lever[lost])
        vanishing = float(heel[lost - 1] + share * (heel[lost] - heel[lost - 1]))
    top = int(np.argmax(lever[:lost]))
    return {"vanishing": vanishing, "largest": float(lever[top]), "heel_of_largest": float(heel[top])}


# -- tables ------------------------------------------------------------------------------------------------------------

PARTS = ("hydrostatics", "response", "run", "flow")
NATURAL_TITLE = "\nNatural periods about the equilibrium, of the modes with most of their energy in a motion"
RUNS_TITLE = "\nRuns in time (BDF2, small waves), and how far the linear response is from them, as complex numbers"
RESONANCE = (
    "Near a natural period with little damping a run is not steady by then, and its drag, which the linear response "
    "lacks in still water, counts."
)
#: Key -> quantity and unit of the numbers of hydrostatics.
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


def _columns(first, ending, second, heading):
    """Key -> heading of a table with two columns for each motion."""
    pairs = [{f"{name}{ending}": f"{name} [{unit}]", f"{name}{second}": heading} for name, unit in MOTIONS.items()]
    return first | {key: said for pair in pairs for key, said in pair.items()}


PERIOD = {"period": "T [s]"}
RUNS = _columns({"held": ""} | PERIOD, "_run", "_difference", "off [%]")
FLOW = _columns(PERIOD, "_flow", "_difference", "strips off [%]")
RESPONSE = _columns({"held": ""} | PERIOD | {"wavelength": "wavelength [m]"}, "", "_phase", "phase [deg]")
RESPONSE |= {"pitch_over_slope": "pitch/slope", "pitch_over_slope_phase": "phase [deg]"}


def study(
    folder: Path, scene: Scene, runs: list[float], direction: float = 0.0, capytaine: Path | None = None
) -> list[Table]:
    """Hydrostatics, levers, natural periods, response, runs, and potential flow where it is given."""
    found = evaluate_all(evaluate, cases(scene, runs, direction, capytaine), folder, itemgetter("part", "held"))
    if found is None:
        return []
    failed = [f"{case['part']}, {case['held']}: {case['reason']}" for case in found if "reason" in case]
    parts = {part: [c for c in found if c["part"] == part and "reason" not in c] for part in PARTS}
    levers, linear, checked, beside = (
        [{"held": case["held"], **row} for case in parts[part] for row in case["rows"]] for part in PARTS
    )
    natural = [{"held": case["held"], **mode} for case in parts["response"] for mode in case["natural"]]
    tables = [
        *_still(parts["hydrostatics"], levers, failed),
        Table("hull-periods", natural, NATURAL_TITLE, NATURAL, _unheld(scene)),
        Table("hull-response", linear, figure=figures.draw_responses(linear, checked, beside, _shortest(scene))),
        Table("", [row for row in linear if row["period"] == int(row["period"])], columns=RESPONSE),
    ]
    tables[-1].title = f"\nResponse to small waves towards {direction:g} degrees, per metre of amplitude"
    tables[-1].notes = _warnings(scene)
    if checked:
        tables.append(Table("hull-runs", checked, RUNS_TITLE, RUNS, [RESONANCE]))
    for case in parts["flow"]:
        depths = f"depth {case['depth']:g} m, here {scene.sea.depth:g} m"
        title = f"\nPotential flow ({depths}) beside the free buoy, as complex numbers"
        tables.append(Table("hull-potential-flow", beside, title, FLOW))
    return tables


def _still(at_rest: list[dict], levers: list[dict], failed: list[str]) -> list[Table]:
    """A row for every number of hydrostatics, and the righting levers."""
    numbers = {case["held"]: case["numbers"] for case in at_rest}
    rows = [
        {"quantity": quantity, "unit": unit} | {held: found[key] for held, found in numbers.items()}
        for key, (quantity, unit) in NUMBERS.items()
    ]
    columns = {"quantity": "", "unit": ""} | {held: held for held in numbers}
    figure = figures.draw_levers(levers, {held: found["GM"] for held, found in numbers.items()})
    title = "The hull upright, moored under the vertical pull of its cable; {folder}\n"
    return [Table("hull", rows, title, columns, failed), Table("hull-righting", levers, figure=figure)]


def _shortest(scene):
    """Period below which k R is more than LARGEST_KR, in deep water [s]."""
    radius = shape_and_mass(_buoy(scene))[0].max_diameter / 2
    return 2 * math.pi / math.sqrt(LARGEST_KR * scene.gravity / radius)


def _warnings(scene):
    return [
        f"Below {_shortest(scene):.2g} s k R is above {LARGEST_KR:g}: strips are 20 to 100 % off there.",
        "Phases: by which the motion of C comes after the elevation above its place at rest; pitch turns the top along "
        "the waves; pitch/slope is -1 where the hull follows the water.",
        "No wave is radiated but by buoy.wave_damping, and drag is linear about the mean current: in still water peaks "
        "have no bound.",
    ]


def _unheld(scene):
    """Why a buoy that has a cable is not looked at without it."""
    free = _floating(scene)
    if scene.cable is None or (free is not None and free.GM > 0):
        return []
    if free is None:
        return ["Without its cable this buoy is not looked at: it sinks."]
    return [f"Without its cable this buoy is not looked at in waves: it does not float upright (GM {free.GM:.3g} m)."]
