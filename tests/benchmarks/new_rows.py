"""Three moorings with either program: a chain on the sea bed, three lines on a buoy, a sea of 100 components.

Both programs get the same scene, MoorDyn by `dolfbuoy export moordyn`.  They do not share all of it (damping of the
bed, the water plane of a hull, waves between the points of MoorDyn's table), so that each error is against the
program's own limit, and how far the two limits are apart is said.
"""

import math
import tempfile
import time as clock
from dataclasses import dataclass, replace
from pathlib import Path

import moordyn
import numpy as np

from dolfbuoy import solve_static
from dolfbuoy.errors import SolveError
from dolfbuoy.formats import moordyn_run
from dolfbuoy.formats.to_moordyn import Numerics, export, start_of
from dolfbuoy.model.lines import top_position
from dolfbuoy.results import measured as acc
from dolfbuoy.results.compare import Reference
from dolfbuoy.scene import load_scene

#: Steps of MoorDyn in a call while it is timed, so that Python does not count.
PER_CALL = 20
#: Elements of MoorDyn and of dolfbuoy (P2-P1), and steps of dolfbuoy to a period.
SEGMENTS = (10, 14, 20, 28, 40, 56, 80)
CELLS, STEPS = (3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128), (12, 16, 24, 32, 48, 64, 96, 128, 192)
#: Part of an accuracy that the elements may take.
IN_SPACE = 0.8
#: Steps of MoorDyn, over the length of a segment by the speed of sound in it, the largest first.
COURANT = (1.6, 1.3, 1.0, 0.8, 0.6, 0.45, 0.3)


@dataclass(frozen=True)
class Problem:
    """A scene; period: to which steps refer; start: from which on errors count [s]; scheme and finest of dolfbuoy.

    segments: of MoorDyn, tried until they do.
    """

    scene: object
    period: float
    start: float
    scheme: str
    cells: int = 64
    steps: int = 384
    segments: tuple = SEGMENTS


def chain() -> Problem:
    """The shipped chain with its top driven, without friction, which the programs understand differently."""
    changes = {"seabed.friction": 0.0, "time.end": 60.0}
    return Problem(
        load_scene("chain-on-bed", **changes), 10.0, 40.0, "bdf2", 160, segments=(20, 28, 40, 56, 80, 112, 160, 224)
    )


def three_lines() -> Problem:
    """A spar on the three ropes of `three-legs`, in its wave."""
    data = load_scene("three-legs").to_dict()
    hull = {"hull": [[0.0, 1.2], [6.0, 1.2]], "mass": 2500.0, "center_of_mass": 1.2, "inertia": [8000.0, 400.0]}
    hull |= {"added_mass": 0.0, "axial_added_mass": 0.64, "axial_drag": 1.1, "rotational_damping": 2000.0}
    places = {name: [0.6 * math.cos(a), 0.6 * math.sin(a), 0.5] for name, a in _ROUND.items()}
    data["buoy"] = {"normal_drag": 0.8, **hull, "fairleads": places}
    data["waves"] |= {"direction_deg": 0.0}
    return Problem(load_scene(data, **{"time.end": 60.0}), 5.0, 50.0, "generalized-alpha")


_ROUND = {"east": 0.0, "north": 2 * math.pi / 3, "south": -2 * math.pi / 3}


def irregular() -> Problem:
    """A light rope that is held under an irregular sea; frequencies in equal steps, as MoorDyn's."""
    data = load_scene("driven").to_dict()
    data["cable"] |= {
        "axial_stiffness": 2e6,
        "line_density": 14.0,
        "diameter": 0.1,
        "normal_drag": 1.2,
        "added_mass": 1.0,
    }
    data["cable"]["top"] = {"kind": "fixed", "position": [14.0, 0.0, -3.5]}
    data["waves"] = {"components": components(), "ramp": 10.0, "stretching": "wheeler"}
    return Problem(load_scene(data, **{"time.end": 60.0}), 5.0, 20.0, "generalized-alpha")


PROBLEMS = {
    "chain on the bed, driven": chain,
    "three lines on a buoy": three_lines,
    "irregular sea, 100 components": irregular,
}
#: MoorDyn's components are a exp(-i phase).
SIGN = -1
#: Of the irregular sea: lowest frequency, and step [rad/s]; significant height [m]; peak frequency [rad/s].
LOWEST, APART, HEIGHT, PEAK = 0.5, 0.02, 3.0, 1.0


def components():
    """[[amplitude, period, direction, phase], ...] of Bretschneider's spectrum, phases by chance."""
    w = LOWEST + APART * np.arange(100)
    density = 5 / 16 * HEIGHT**2 * PEAK**4 / w**5 * np.exp(-1.25 * (PEAK / w) ** 4)
    phases = np.random.Generator(np.random.PCG64(1)).uniform(0, 360, 100)
    rows = zip(np.sqrt(2 * density * APART), 2 * math.pi / w, phases, strict=True)
    return [[float(a), float(T), 0.0, float(p)] for a, T, p in rows]


# -- MoorDyn -----------------------------------------------------------------------------------------------------------


def lumped_input(problem, segments, courant):
    """An Export with so many segments to a line."""
    scene = load_scene(problem.scene, **_elements(problem.scene, segments, (1, 0)))
    lines = scene.cable if isinstance(scene.cable, list) else [scene.cable]
    if scene.is_network:
        rope = scene.to_dict()["material"]["rope"]
        length, density, stiffness = lines[0].length, rope["line_density"], rope["axial_stiffness"]
    else:
        length, density, stiffness = scene.cable.length, scene.cable.line_density, scene.cable.axial_stiffness
    step = courant * length / segments * math.sqrt(density / stiffness)
    start = start_of(solve_static(load_scene(problem.scene))) if scene.buoy else None
    found = export(
        scene if scene.waves is None or not scene.waves.irregular else _calm(scene), start, Numerics("RK2", step)
    )
    return _with_sea(found, scene) if scene.waves and scene.waves.irregular else found


def _elements(scene, cells, pair):
    """Changes that give every line so many elements."""
    size = {"elements": cells, "position_degree": pair[0], "tension_degree": pair[1]}
    if scene.is_network:
        return {"cable": [line | size for line in scene.to_dict()["cable"]]}
    return {"cable": size}


def _calm(scene):
    return load_scene(scene, waves=None)


def _with_sea(found, scene):
    """The components as a spectrum, and a table as fine as the shortest of them asks for."""
    highest, last = LOWEST + 99 * APART, 12.0  # the table's steps in time: pi/(last highest)
    count = round(last * highest / APART)
    parts = {round(2 * math.pi / T / APART): a * np.exp(SIGN * 1j * math.radians(p)) for a, T, _, p in components()}
    rows = [(i * APART, np.real(parts.get(i, 0)), np.imag(parts.get(i, 0)), 0.0) for i in range(count + 1)]
    wave = 2 * math.pi * 9.81 / highest**2
    x, z = np.arange(-1.0, 15.0 + wave / 24, wave / 24), -np.arange(0.0, scene.sea.depth + wave / 24, wave / 24)[::-1]
    lists = ["1\n" + " ".join(f"{value:.6f}" for value in values) for values in (x, (-1e4, 1e4), z)]
    files = {
        "wave_frequencies.txt": "".join(" ".join(f"{value:.14g}" for value in row) + "\n" for row in rows),
        "water_grid.txt": "waves\nx, y, z\nkind of list, values\n" + "\n".join(lists) + "\n",
    }
    name, text = next(iter(found.files.items()))
    text = text.replace("--- OPTIONS ---\n", "--- OPTIONS ---\n2 WaveKin\n").replace(
        f"{10 * scene.sea.depth:g} WtrDpth", f"{scene.sea.depth:g} WtrDpth"
    )
    return replace(found, files={name: text} | files)


def lumped(problem, segments, courant=None):
    """(Run of MoorDyn, Export): at the largest of the steps with which it stays bounded."""
    for number in (courant,) if courant else COURANT:
        given = lumped_input(problem, segments, number)
        found = moordyn_run.run(given, problem.scene.time.end)
        if found is not None and found.tension.max() < 100 * np.median(found.tension):
            return acc.Run(found.t, {"tension_top": found.tension[:, :, 1]}), given
    return None, None


def lumped_seconds(given, end):
    """CPU seconds of MoorDyn's steps alone."""
    interval = given.step * PER_CALL
    t = np.arange(math.ceil(end / interval) + 1) * interval
    places = np.array([np.concatenate([top_position(top, at) for top in given.driven] or [[]]) for at in t])
    speeds = (np.diff(places, axis=0) / interval).tolist()
    with tempfile.TemporaryDirectory() as folder, moordyn_run._silent():
        for name, text in given.files.items():
            (Path(folder) / name).write_text(text)
        system = moordyn.Create(str(Path(folder) / next(iter(given.files))))
        moordyn.SetVerbosity(system, moordyn.LEVEL_NONE)
        moordyn.Init(system, places[0].tolist(), [0.0] * places.shape[1])
        begin = clock.process_time()
        for place, speed, at in zip(places.tolist(), speeds, t.tolist(), strict=False):
            moordyn.Step(system, place, speed, at, interval)
        seconds = clock.process_time() - begin
        moordyn.Close(system)
    return seconds


# -- dolfbuoy ----------------------------------------------------------------------------------------------------------


def settled(problem, cells, steps, newton=1e-9):
    """The scene with P2-P1 and these settings."""
    time = {"scheme": problem.scheme, "step": problem.period / steps}
    return load_scene(
        problem.scene, **_elements(problem.scene, cells, (2, 1)), time=time, solver={"step_tolerance": newton}
    )


def ours(problem, *chosen):
    """Run of dolfbuoy; None if it fails."""
    try:
        return acc.compute(settled(problem, *chosen), ["tension_top"])
    except SolveError:
        return None


# -- errors and settings -----------------------------------------------------------------------------------------------


def error(run, fine, problem):
    """Of the tensions, rms or that of the maximum, whichever is larger; relative to the range."""
    if run is None:
        return math.inf
    found = Reference(fine, problem.start).error(run, "tension_top")
    return max(found.rms, found.maximum)


def apart(one, other, problem):
    """How far the extremes of two limits are apart, relative to the range."""
    inside = [
        np.asarray(r.values["tension_top"])[r.t >= problem.start].reshape(-1, 3 if problem.scene.is_network else 1)
        for r in (one, other)
    ]
    ends = [np.array([v.max(axis=0), v.min(axis=0)]) for v in inside]
    return float(np.abs(ends[0] - ends[1]).max() / np.ptp(inside[0], axis=0).max())


def cheapest_lumped(problem, accuracies, most):
    """[(segments, Export, error), ...] per accuracy, and the limit."""
    fine, _ = lumped(problem, 2 * most[-1])
    runs = {n: lumped(problem, n) for n in most}
    errors = {n: error(run, fine, problem) for n, (run, _) in runs.items()}
    found = [next(((n, runs[n][1], errors[n]) for n in most if errors[n] <= accuracy), None) for accuracy in accuracies]
    return found, fine


def cheapest_own(problem, accuracies, cells=CELLS, steps=STEPS, finest=None):
    """[((cells, steps, newton), error), ...] per accuracy, and the limit: first the elements, then the steps."""
    most, count = finest or (problem.cells, problem.steps)
    fine, found = ours(problem, most, count), []
    for accuracy in accuracies:
        tries = ((n, count // 2, accuracy / 100) for n in cells)
        n = next((t[0] for t in tries if error(ours(problem, *t), fine, problem) <= IN_SPACE * accuracy), None)
        tries = ((n, k, accuracy / 100) for k in steps) if n else ()
        errors = ((t, error(ours(problem, *t), fine, problem)) for t in tries)
        found.append(next(((t, e) for t, e in errors if e <= accuracy), None))
    return found, fine
