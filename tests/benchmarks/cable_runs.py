"""The driven cables of the comparison, their runs with either program, and the errors of these runs.

A run is a plain dict in and out, so that it is kept on disk and an interrupted benchmark goes on where it was.
"""

import math
from dataclasses import asdict

import moordyn_runs
import numpy as np
from moordyn_input import Numerics
from scipy.interpolate import CubicSpline

from dolfbuoy.errors import SolveError
from dolfbuoy.results import measured as acc
from dolfbuoy.scene import Scene, load_scene, settings
from dolfbuoy.studies.accuracy.advise import advise

#: The whole run whose cost is compared [s].
END = 120.0
#: Calls from Python are this many of MoorDyn's steps apart when it is timed.
PER_CALL = 20
#: Points of the last period that are kept of a run.
POINTS = 400

#: Top of the long cable, moved in the period of the scene's wave; position and amplitude keep all of the cable taut
#: (2 kN at least), where the two models are the same: MoorDyn has no compression.
LONG_TOP = {
    "kind": "prescribed",
    "position": [320.0, 0.0, -100.0],
    "amplitude": [0.0, 0.0, 1.0],
    "period": 6.0,
    "ramp": 12.0,
}
WITHOUT_BUOY = {"buoy": None, "waves": None, "current": None, "wind": None, "external_force": None}


def scene_of(cable: str, stiffness: float, end: float | None = None) -> Scene:
    """The short or the long cable in still water with its top moved, axial stiffness times `stiffness`."""
    if cable == "short":
        scene = load_scene("driven")
    else:
        scene = load_scene("long", **WITHOUT_BUOY, cable__top=LONG_TOP)
    changes = {"cable.axial_stiffness": stiffness * scene.cable.axial_stiffness, "time.end": end or END}
    return load_scene(scene, **changes)


def compared_until(scene: Scene) -> float:
    """End of the runs that errors are measured on: ramp and three periods; the last one counts [s]."""
    return settings.ramp_of(scene) + 3 * settings.period_of(scene)


# -- runs: dict -> dict ------------------------------------------------------------------------------------------------


def evaluate(case: dict) -> dict:
    """One run; `what` says which."""
    return {"dolfbuoy": _dolfbuoy, "advise": _advise, "moordyn": _moordyn, "time": _time}[case["what"]](case)


def _dolfbuoy(case):
    scene = settings.with_settings(_scene(case), settings.Space(*case["space"]), settings.Stepping(*case["stepping"]))
    try:
        found = acc.compute(scene, ["tension_top"])
    except SolveError:
        return {"curve": None}
    return kept_of(found, scene) | {"steps": found.steps, "iterations": found.iterations}


def _advise(case):
    """Settings that `dolfbuoy advise` gives for an accuracy of the whole run."""
    advice = advise(_scene(case), "tension_top", case["accuracy"], say=lambda text: None)
    return settings_of(advice.scene) | {"predicted": advice.choice.error}


def _moordyn(case):
    """Largest stable step, accuracy with one step per call, cost without Python between the steps."""
    scene = _scene(case)
    limit = moordyn_runs.largest_stable(scene, case["segments"], case["scheme"])
    if limit == 0:
        return {"step": None}
    start = Numerics(case["segments"], case["scheme"], moordyn_runs.MARGIN * limit)
    costs = moordyn_runs.run(scene, start, moordyn_runs.PROBE * start.step, PER_CALL)
    second = costs.cpu / (moordyn_runs.PROBE * start.step) if costs else math.inf
    result = {"step": start.step, "limit": limit / moordyn_runs.segment_step(scene, case["segments"])}
    result |= {"cpu_per_second": second}
    if second * scene.time.end > case.get("budget", math.inf):
        return result | {"curve": None}
    numerics, found = moordyn_runs.stable_run(scene, start, scene.time.end)
    if found is None:
        return {"step": None}
    readings = kept_of(found, scene) | {"force": kept_of(found, scene, "force")}
    return result | {"step": numerics.step} | readings


def _time(case):
    """Cost of a run, several times: {"cpu": [...], "wall": [...]} of the stepping loop, scaled to END."""
    scene, factor = _scene(case), END / case["end"]
    if "numerics" in case:
        numerics = Numerics(**case["numerics"])
        runs = [moordyn_runs.run(scene, numerics, case["end"], PER_CALL) for _ in range(case["repeats"])]
    else:
        scene = settings.with_settings(scene, settings.Space(*case["space"]), settings.Stepping(*case["stepping"]))
        runs = [acc.compute(scene, ["tension_top"]) for _ in range(case["repeats"])]
    good = [found for found in runs if found is not None]
    return {key: [factor * getattr(found, key) for found in good] for key in ("cpu", "wall")}


def _scene(case):
    return scene_of(case["cable"], case["stiffness"], case["end"])


def kept_of(run: acc.Run, scene: Scene, name: str = "tension_top") -> dict:
    """The last period on POINTS equal steps, and its extremes, between samples by cubic splines."""
    t, values = run.t, run.values[name]
    thin = max(1, int(settings.period_of(scene) / (t[1] - t[0]) / 20000))
    spline = CubicSpline(t[::thin], values[::thin])
    grid = np.linspace(scene.time.end - settings.period_of(scene), t[::thin][-1], 20 * POINTS + 1)
    fine = spline(grid)
    extremes = {"max": float(fine.max()), "min": float(fine.min())}
    return {"curve": fine[::20].tolist(), **extremes, "cpu": run.cpu, "wall": run.wall}


def spread(time: dict) -> dict:
    """Of repeated runs: median of CPU and of wall seconds, and half the range of CPU seconds."""
    cpu = np.array(time["cpu"])
    return {"cpu": float(np.median(cpu)), "spread": float(np.ptp(cpu) / 2), "wall": float(np.median(time["wall"]))}


def settings_of(scene: Scene) -> dict:
    """A scene's elements and steps, as the keys of a case."""
    space, stepping = settings.space_of(scene), settings.stepping_of(scene)
    return {"space": list(asdict(space).values()), "stepping": list(asdict(stepping).values())}


def larger_step(settings: dict) -> dict | None:
    """A quarter larger step; of an adaptive run half as much again of its tolerance.  None where that is too much."""
    scheme, step, tolerance, *more = settings["stepping"]
    if tolerance and 1.5 * tolerance >= 1:
        return None
    stepping = [scheme, step, 1.5 * tolerance] if tolerance else [scheme, 1.25 * step, None]
    return settings | {"stepping": [*stepping, *more]}


def fewer_elements(settings: dict) -> dict | None:
    """A quarter fewer elements; None below two."""
    mu, nu, cells = settings["space"]
    return settings | {"space": [mu, nu, round(0.75 * cells)]} if cells > 2 else None


def advised(ask, accuracy: float, error_of_settings) -> tuple[dict, float]:
    """(settings that `dolfbuoy advise` gives for an accuracy, stricter where these miss it, and their error)."""
    target = accuracy
    for _ in range(5):
        advice = ask("advise", end=END, accuracy=round(target, 7))
        settings = {key: advice[key] for key in ("space", "stepping")}
        error = error_of_settings(settings)
        if error <= accuracy:
            break
        target *= min(0.8, max(0.4, 0.8 * accuracy / error))
    return settings, error


def coarsened(settings: dict, error: float, accuracy: float, error_of_settings) -> tuple[dict, float]:
    """Larger steps and fewer elements in turn, as long as the accuracy holds: as MoorDyn's fewest segments.

    `advise` takes no step above a fiftieth of the period.
    """
    tried = True
    while tried:
        tried = False
        for change in (larger_step, fewer_elements):
            candidate = change(settings)
            found = error_of_settings(candidate) if candidate else math.inf
            if found <= accuracy:
                settings, error, tried = candidate, found, True
    return settings, error


def settings_text(row: dict) -> str:
    """'P2-P1, 6 elements, BDF2, dt 0.05 s'."""
    return f"{settings.Space(*row['space'])}{settings.Stepping(*row['stepping'])}"


# -- errors ------------------------------------------------------------------------------------------------------------


def extrapolated(coarse: dict, middle: dict, fine: dict, highest: float = 4.0) -> dict:
    """Limit under refinement by two, Richardson with the observed order of each extreme, and its own uncertainty.

    The order is taken between 1 and `highest`.  `own`: what the extrapolation adds, relative to the range.
    """
    limit, added = {}, []
    for key in ("max", "min"):
        before, last = middle[key] - coarse[key], fine[key] - middle[key]
        order = min(max(math.log2(abs(before / last)) if last and before else highest, 1.0), highest)
        limit[key] = fine[key] + last / (2**order - 1)
        added.append(abs(limit[key] - fine[key]))
    limit["curve"] = fine["curve"]
    return limit | {"own": max(added) / (limit["max"] - limit["min"])}


def error_of(run: dict, reference: dict) -> float:
    """Error of the extremes of the top tension, relative to its range; as large as the rms of the whole period.

    The rms keeps a run from passing because its error happens to vanish at the two extremes.  Of MoorDyn's two
    readings the better one counts.
    """
    if run.get("curve") is None:
        return math.inf
    if "force" in run:
        other = {key: value for key, value in run.items() if key != "force"}
        return min(error_of(other, reference), error_of(run["force"], reference))
    size = reference["max"] - reference["min"]
    extremes = max(abs(run[key] - reference[key]) for key in ("max", "min"))
    difference = np.array(run["curve"]) - np.array(reference["curve"])
    return float(max(extremes, np.sqrt(np.mean(difference**2))) / size)
