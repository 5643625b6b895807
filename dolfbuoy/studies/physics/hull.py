"""How a hull floats and rides small waves: hydrostatics, natural periods and response, moored and free.

The response is that of the equations linearised about the equilibrium, `linear.response`.  Runs in time in small waves
check it at a few periods; potential flow stands beside it where its coefficients are given.
"""

import cmath
import math
from pathlib import Path

import numpy as np
from mpi4py import MPI

from ...errors import InputError, SolveError
from ...linear import LARGEST_KR
from ...linear.linearisation import linearise
from ...linear.periods import natural_periods
from ...linear.potential_flow import read_capytaine
from ...linear.response import check_periods, response, small_waves
from ...model.feasible import shape_and_mass
from ...model.held import adrift_nowhere
from ...model.hydrostatics import float_upright
from ...scene import Scene, load_scene, settings
from ...scene.sections import Initial
from ...statics.equilibrium import solve_equilibrium
from ...statics.righting import righting_curve
from ..declaration import declared
from ..study import Table, refuse_network
from . import hull_figures as figures
from .hull_runs import measured_motions

WORDS = declared(__file__)
#: What decides which forms are compiled.
STRUCTURE = ("part", "held")

MOTIONS = ("surge", "heave", "pitch")
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
    flow = _potential_flow(scene, capytaine) if capytaine else None
    return {"scene": scene, "runs": runs, "direction": direction, "flow": flow}


def _buoy(scene):
    """The only one."""
    return next(iter(scene.network.buoys.values()))


def _potential_flow(scene, path):
    flow, (_, mass), free = read_capytaine(path), shape_and_mass(_buoy(scene)), _floating(scene)
    if free is None or free.GM <= 0:
        raise InputError(f"{path}: stands beside a free buoy, but this one does not float upright without its cable.")
    center = mass.height - free.draft
    if flow.rotation_height is not None and abs(flow.rotation_height - center) > 1e-3 * _buoy(scene).hull[-1][0]:
        raise InputError(
            f"{path}: pitch is counted about a point {flow.rotation_height:.4g} m above still water (rotation_center); "
            f"it must be C of the free buoy, at {center:.4g} m."
        )
    return flow


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


def cases(scene: Scene, runs=(), direction=0.0, flow=None) -> list[dict]:
    """Hydrostatics, response, and a run for every period; moored if there is a cable, free if the buoy can be."""
    free = _floating(scene)
    ways = ["moored"] * (scene.cable is not None) + ["free"] * (free is not None)
    upright = [held for held in ways if held == "moored" or free.GM > 0]
    periods = sorted({round(float(T), 9) for T in (*PERIODS, *runs, *(flow.periods if flow else ()))})
    common = {"study": "hull", "scene": scene.to_dict(), "direction": direction}
    found = [{"part": "hydrostatics", "held": held} for held in ways]
    found += [{"part": "response", "held": held, "periods": periods} for held in upright]
    found += [{"part": "run", "held": held, "period": round(float(T), 9)} for held in upright for T in runs]
    return [common | case for case in found]


def evaluate(case: dict) -> dict:
    """What the case's part finds; a reason if its solve fails."""
    part = {"hydrostatics": _hydrostatics, "response": _response, "run": _run}[case["part"]]
    try:
        return part(held_as(load_scene(case["scene"]), case["held"]), case)
    except SolveError as error:
        return {"reason": str(error)}


def _hydrostatics(scene, _):
    """Upright numbers and righting levers, moored under the vertical pull of the cable at rest."""
    pull = 0.0
    if scene.cable:
        problem = solve_equilibrium(scene, MPI.COMM_SELF)
        pull = float(problem.end_tension()[2])
        problem.destroy()
    floating, (_, mass) = _floating(scene, pull), shape_and_mass(_buoy(scene))
    if floating is None:
        raise SolveError(f"the cable pulls at the buoy with {pull:.4g} N, under which it cannot float upright")
    curve = righting_curve(scene, HEELS, pull)
    return {
        "mass": mass.mass,
        "pull": pull,
        "KG": mass.height,
        **vars(floating),
        "curve": [row._asdict() for row in curve],
    }


def _response(scene, case):
    """Natural periods, and the response at every period."""
    found = linearise(scene, MPI.COMM_SELF, small_waves(scene, case["periods"][0]))
    try:
        natural = natural_periods(found, case["direction"])
        rows = [_response_row(response(found, period, case["direction"])) for period in case["periods"]]
    finally:
        found.destroy()
    return {"natural": {name: mode._asdict() for name, mode in natural.items()}, "rows": rows}


def _response_row(found):
    row = {"period": found.period, "wavelength": 2 * math.pi / found.wavenumber}
    for name in MOTIONS:
        row |= _polar(name, getattr(found.motions, name))
    return row | _polar("pitch_over_slope", found.pitch_over_slope)


def _run(scene, case):
    """Motions by a run in time."""
    found = measured_motions(scene, case["period"], case["direction"])
    return {key: value for name in MOTIONS for key, value in _polar(name, getattr(found, name)).items()}


def _polar(name, X):
    """Amplitude, and the phase [deg, -180 < phase <= 180] by which the motion comes after the elevation."""
    phase = round(math.degrees(cmath.phase(X)), 3) + 0.0  # no -0
    return {name: abs(X), f"{name}_phase": phase if phase > -180 else 180.0}


def _number(row, name):
    """The complex number of two columns."""
    return cmath.rect(row[name], math.radians(row[f"{name}_phase"]))


# -- tables ------------------------------------------------------------------------------------------------------------


def tables(rows: list[dict], scene: Scene, runs=(), direction=0.0, flow=None) -> list[Table]:
    """Hydrostatics, levers, natural periods, response, runs, and potential flow where it is given."""
    failed = [WORDS.say("failed", **row) for row in rows if "reason" in row]
    at_rest, waves, in_time = (
        [row for row in rows if row["part"] == part and "reason" not in row]
        for part in ("hydrostatics", "response", "run")
    )
    linear = {row["held"]: {found["period"]: {"held": row["held"], **found} for found in row["rows"]} for row in waves}
    checked = [_beside(row, linear[row["held"]]) for row in in_time if row["held"] in linear]
    beside = _potential_rows(scene, flow, linear["free"]) if flow and "free" in linear else []
    found = _still_tables(at_rest, failed) + _wave_tables(scene, linear, waves, checked, beside, direction)
    if checked:
        found.append(Table("hull-runs", checked, WORDS.say("runs"), WORDS.columns["runs"], [WORDS.say("resonance")]))
    if beside:
        words = WORDS.say("flow", depth=flow.depth, own=scene.sea.depth)
        found.append(Table("hull-potential-flow", beside, words, WORDS.columns["flow"]))
    return found


def _still_tables(at_rest, failed):
    levers = [{"held": row["held"], **lever} for row in at_rest for lever in row["curve"]]
    figure = figures.draw_levers(levers, {row["held"]: row["GM"] for row in at_rest})
    columns = WORDS.columns["hydrostatics"] | {row["held"]: row["held"] for row in at_rest}
    return [
        Table("hull", _numbers(at_rest), WORDS.say("title"), columns, failed),
        Table("hull-righting", levers, figure=figure),
    ]


def _wave_tables(scene, linear, waves, checked, beside, direction):
    """Natural periods; the response at all periods in the file, at whole seconds in the table."""
    natural = [{"held": row["held"], "motion": n, **mode} for row in waves for n, mode in row["natural"].items()]
    rows = [row for found in linear.values() for row in found.values()]
    figure = figures.draw_responses(rows, checked, beside, _shortest(scene))
    shown = [row for row in rows if row["period"] == int(row["period"])]
    return [
        Table("hull-periods", natural, WORDS.say("periods"), WORDS.columns["periods"], _unheld(scene, linear)),
        Table("hull-response", rows, figure=figure),
        Table("", shown, WORDS.say("responses", direction=direction), WORDS.columns["response"], _warnings(scene)),
    ]


def _numbers(at_rest):
    """A row for every number of hydrostatics."""
    values = {row["held"]: row | _stability(row["curve"]) for row in at_rest}
    return [
        {"quantity": title, "unit": unit} | {held: row[key] for held, row in values.items()}
        for key, (title, unit) in WORDS.data["numbers"].items()
    ]


def _stability(curve):
    """The heel at which the lever first vanishes, the largest lever up to there, and its heel."""
    heel, lever = (np.array([point[key] for point in curve]) for key in ("heel_deg", "lever"))
    lost = next((k for k in range(2, len(heel)) if lever[k] <= 1e-9 < lever[k - 1]), None)
    vanishing = None
    if lost is not None:
        share = lever[lost - 1] / (lever[lost - 1] - lever[lost])
        vanishing = float(heel[lost - 1] + share * (heel[lost] - heel[lost - 1]))
    top = int(np.argmax(lever[:lost]))
    return {"vanishing": vanishing, "largest": float(lever[top]), "heel_of_largest": float(heel[top])}


def _beside(row, linear):
    """A run's row with the linear response; linear: by period."""
    return {"held": row["held"], "period": row["period"], **_compared(row, linear[row["period"]], "run")}


def _compared(row, own, name):
    """Another's motions with our own, and the difference as complex numbers in percent of the other's."""
    found = {}
    for motion in MOTIONS:
        other, linear = _number(row, motion), _number(own, motion)
        found |= {f"{motion}_{name}": abs(other), f"{motion}_{name}_phase": math.degrees(cmath.phase(other))}
        found |= {
            motion: abs(linear),
            f"{motion}_difference": 100 * abs(other - linear) / abs(other) if other else None,
        }
    return found | {f"pitch_over_slope_{name}": row["pitch"] * own["wavelength"] / (2 * math.pi)}


def _potential_rows(scene, flow, linear):
    """Potential flow with the free body's mass and stiffness beside our own response; linear: by period."""
    (_, mass), free = shape_and_mass(_buoy(scene)), _floating(scene)
    weight = mass.mass * scene.gravity
    found = flow.responses((mass.mass, mass.mass, mass.inertia[0]), (0.0, free.heave_stiffness, weight * free.GM))
    rows = []
    for period, X in sorted(zip(flow.periods, found, strict=True), key=lambda pair: pair[0]):
        polar = {key: value for name, x in zip(MOTIONS, X, strict=True) for key, value in _polar(name, x).items()}
        rows.append({"period": period, **_compared(polar, linear[round(period, 9)], "flow")})
    return rows


def _shortest(scene):
    """Period below which k R is more than LARGEST_KR, in deep water [s]."""
    radius = shape_and_mass(_buoy(scene))[0].max_diameter / 2
    return 2 * math.pi / math.sqrt(LARGEST_KR * scene.gravity / radius)


def _warnings(scene):
    return [WORDS.say("short_waves", period=_shortest(scene), kR=LARGEST_KR), WORDS.say("phases"), WORDS.say("damping")]


def _unheld(scene, linear):
    """Why a buoy that has a cable is not looked at without it."""
    if scene.cable is None or "free" in linear:
        return []
    free = _floating(scene)
    return [WORDS.say("sinks")] if free is None else [WORDS.say("capsizes", GM=free.GM)]
