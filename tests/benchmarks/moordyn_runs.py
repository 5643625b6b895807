"""Running MoorDyn: a driven cable or a moored buoy in time, and the largest step at which it is stable."""

import math
import tempfile
import time as clock
from dataclasses import replace
from pathlib import Path

import moordyn
import moordyn_input
import numpy as np
from moordyn_input import Numerics

from dolfbuoy.formats.moordyn_run import silent
from dolfbuoy.model.lines import top_position
from dolfbuoy.results.measured import Run
from dolfbuoy.scene import Scene

#: Share of the largest stable step that is used.
MARGIN = 0.95
#: Steps within which an instability shows: its growth at 5 % above the limit is at least a factor in some ten steps.
PROBE = 6000


def run(scene: Scene, numerics: Numerics, end: float, per_call: int = 1) -> Run | None:
    """Top tension over time; None if the run diverges.  `wall` and `cpu` are those of the stepping loop.

    "tension_top" is extrapolated linearly from the last two nodes below the end, which is of second order in the
    segment's length; "force", of a driven end, is what MoorDyn says that holds it, without the inertia of the half
    segment there: of first order.  (Its fairlead tension misses more, the weight of the half segment.)

    per_call: steps of MoorDyn in a call from Python.  Within a call it moves the driven end at constant speed, which
    costs it accuracy unless it is 1; a larger number serves to time it without Python between its steps.
    """
    calls = math.ceil(end / (numerics.step * per_call) - 1e-9)
    t = np.arange(calls + 1) * numerics.step * per_call
    positions, velocities = _motion(scene, t)
    with tempfile.TemporaryDirectory() as folder, silent():
        system = moordyn.Create(str(moordyn_input.write(Path(folder), scene, numerics)))
        try:
            moordyn.SetVerbosity(system, moordyn.LEVEL_NONE)
            moordyn.Init(system, positions[0], [0.0] * len(positions[0]))
            line, top = moordyn.GetLine(system, 1), scene.cable.top
            near, far = numerics.segments - 1, numerics.segments - 2
            forces, tensions, interval = [], [], numerics.step * per_call
            wall, cpu = clock.perf_counter(), clock.process_time()
            for i in range(calls):
                force = moordyn.Step(system, positions[i], velocities[i], float(t[i]), interval)
                tensions.append(
                    2 * math.hypot(*moordyn.GetLineNodeTen(line, near)) - math.hypot(*moordyn.GetLineNodeTen(line, far))
                )
                if top:
                    forces.append(math.hypot(*force))
            wall, cpu = clock.perf_counter() - wall, clock.process_time() - cpu
        except RuntimeError:
            return None  # "MoorDyn reported an error": NaN
        finally:
            moordyn.Close(system)
    values = np.array(tensions)
    if not np.isfinite(values).all():
        return None
    readings = {"tension_top": values} | ({"force": np.array(forces)} if top else {})
    return Run(t[1:], readings, wall, cpu, calls * per_call)


def _motion(scene, t):
    """Positions of the driven end, and the speeds that lead from each to the next; empty without one."""
    if scene.cable.top is None:
        return [[]] * len(t), [[]] * len(t)
    x = np.array([top_position(scene.cable.top, s) for s in t])
    return x.tolist(), (np.diff(x, axis=0) / np.diff(t)[:, None]).tolist()


def segment_step(scene: Scene, segments: int) -> float:
    """2/omega of the shortest axial vibration of a segment [s]: the scale of every explicit limit."""
    c = scene.cable
    return c.length / segments * math.sqrt(c.line_density / c.axial_stiffness)


def largest_stable(scene: Scene, segments: int, scheme: str, seconds: float = 0.0) -> float:
    """Largest stable step [s] within 4 %, by doubling and bisection from `segment_step`; 0 if none is found.

    Stable: the tension stays finite and within 100 times its median for PROBE steps, or `seconds`.
    """
    step, stable, unstable = 0.5 * segment_step(scene, segments), 0.0, math.inf
    for _ in range(16):
        if _is_stable(scene, Numerics(segments, scheme, step), seconds):
            stable = step
        else:
            unstable = step
        if unstable / max(stable, 1e-300) < 1.04:
            break
        step = 2 * step if math.isinf(unstable) else step / 2 if stable == 0 else math.sqrt(stable * unstable)
    return stable


def _is_stable(scene, numerics, seconds):
    found = run(scene, numerics, max(PROBE * numerics.step, seconds))
    return found is not None and _is_bounded(found)


def _is_bounded(found):
    tension = found.values.get("force", found.values["tension_top"])
    return bool(tension.max() < 100 * np.median(tension))


def stable_run(scene: Scene, numerics: Numerics, end: float, tries: int = 4) -> tuple[Numerics, Run | None]:
    """A run to `end`; where it diverges after all, with a step a tenth smaller."""
    for _ in range(tries):
        found = run(scene, numerics, end)
        if found is not None and _is_bounded(found):
            return numerics, found
        numerics = replace(numerics, step=0.9 * numerics.step)
    return numerics, None
