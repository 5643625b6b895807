"""MoorDyn on a mooring, by `dolfbuoy export moordyn`: its runs, and the largest step at which it is stable."""

import math
from collections import ChainMap
from dataclasses import dataclass, replace

import numpy as np
from errors import kept_of
from moorings import APART, LOWEST, Mooring, components

from dolfbuoy.formats import moordyn_run
from dolfbuoy.formats.to_moordyn import Export, Numerics, export, start_of
from dolfbuoy.scene import load_scene
from dolfbuoy.scene.settings import everywhere

#: Share of the largest stable step that is used.
MARGIN = 0.95
#: Steps within which an instability shows: its growth at 5 % above the limit is at least a factor in some ten steps.
PROBE = 6000
#: A run has diverged where a tension is so many times that at rest: what rings without bound saturates in the end.
BOUND = 100.0
#: Steps of MoorDyn in a call while it is timed, so that Python does not count: with a driven end, which moves at
#: constant speed within a call; else as many as when errors are measured, for waves are taken once per call.
PER_CALL = 20
#: Points of MoorDyn's table of the irregular sea to its shortest wave, and to its shortest period.
PER_WAVE = 24


@dataclass(frozen=True)
class Settings:
    """Integrator, segments of a line, step [s]."""

    scheme: str
    segments: int
    step: float

    def __str__(self):
        return f"{self.scheme}, {self.segments} segments, dt {self.step:.2g} s"


def exported(mooring: Mooring, chosen: Settings, end: float) -> Export:
    """MoorDyn's input, with waves until end [s]; from equilibrium, of a driven cable from MoorDyn's own."""
    size = {"elements": chosen.segments, "position_degree": 1, "tension_degree": 0}
    scene, start = mooring.lasting(end), None
    changes = (everywhere(scene, f"cable.{key}", value) for key, value in size.items())
    scene = load_scene(scene, **dict(ChainMap(*changes)))
    if scene.buoy:
        start = start_of(mooring.rest)
    numerics = Numerics(chosen.scheme, chosen.step)
    if scene.waves and scene.waves.irregular:
        return _with_sea(export(load_scene(scene, waves=None), start, numerics), scene)
    return export(scene, start, numerics)


def _with_sea(found, scene):
    """The irregular sea as a spectrum, and a table as fine as the shortest of its waves asks for.

    MoorDyn's components are a exp(-i phase); the highest frequency of the spectrum sets the steps in time.
    """
    highest, last = LOWEST + 99 * APART, PER_WAVE / 2
    count = round(last * highest / APART)
    parts = {round(2 * math.pi / T / APART): a * np.exp(-1j * math.radians(p)) for a, T, _, p in components()}
    rows = [(i * APART, np.real(parts.get(i, 0)), np.imag(parts.get(i, 0)), 0.0) for i in range(count + 1)]
    step = 2 * math.pi * scene.gravity / highest**2 / PER_WAVE
    x, z = np.arange(-1.0, 15.0 + step, step), -np.arange(0.0, scene.sea.depth + step, step)[::-1]
    lists = ["1\n" + " ".join(f"{value:.6f}" for value in values) for values in (x, (-1e4, 1e4), z)]
    files = {
        "wave_frequencies.txt": "".join(" ".join(f"{value:.14g}" for value in row) + "\n" for row in rows),
        "water_grid.txt": "waves\nx, y, z\nkind of list, values\n" + "\n".join(lists) + "\n",
    }
    text = found.files["lines.txt"].replace("--- OPTIONS ---\n", "--- OPTIONS ---\n2 WaveKin\n")
    text = text.replace(f"{10 * scene.sea.depth:g} WtrDpth", f"{scene.sea.depth:g} WtrDpth")
    return replace(found, files={"lines.txt": text} | files)


def seconds_of(mooring: Mooring, chosen: Settings, end: float) -> float:
    """CPU seconds of MoorDyn's steps alone until end [s]; nan if it diverges."""
    given = exported(mooring, chosen, end)
    found = moordyn_run.run(given, end, most=50, per_call=PER_CALL if given.driven else None)
    return found.seconds if found else math.nan


def segment_step(mooring: Mooring, segments: int) -> float:
    """2/omega of the shortest axial vibration of a segment [s], the least of all lines: scale of explicit limits."""
    sections = [piece.section for piece in mooring.scene.network.pieces]
    return min(c.length / segments * math.sqrt(c.line_density / float(c.axial_stiffness)) for c in sections)


def largest_stable(mooring: Mooring, segments: int, scheme: str) -> float:
    """Largest stable step [s] within 4 %, by doubling and bisection from `segment_step`; 0 if none is found.

    It is looked for without an irregular sea, whose table takes seconds to make.
    """
    if mooring.scene.waves and mooring.scene.waves.irregular:
        mooring = replace(mooring, scene=load_scene(mooring.scene, waves=None))
    step, stable, unstable = 0.5 * segment_step(mooring, segments), 0.0, math.inf
    for _ in range(16):
        if _bounded(mooring, Settings(scheme, segments, step), PROBE * step):
            stable = step
        else:
            unstable = step
        if unstable / max(stable, 1e-300) < 1.04:
            break
        step = 2 * step if math.isinf(unstable) else step / 2 if stable == 0 else math.sqrt(stable * unstable)
    return stable


def _bounded(mooring, chosen, end):
    """The run, if it stays bounded, else None."""
    found = moordyn_run.run(exported(mooring, chosen, end), end)
    if found is None:
        return None
    return found if np.abs(found.tension).max() < BOUND * float(np.max(mooring.rest.tension_top)) else None


def best_run(mooring: Mooring, segments: int, scheme: str, budget: float | None = None) -> dict:
    """A run at 0.95 of the largest stable step; where it diverges after all, with a step a tenth smaller.

    {"step": None without a stable step, "seconds" of END scaled from a short run, "curve": None where the run
    would take longer than the budget [s]} and what `errors.kept_of` keeps.
    """
    chosen = Settings(scheme, segments, MARGIN * largest_stable(mooring, segments, scheme))
    for _ in range(4 if chosen.step else 0):
        short = min(mooring.until, PROBE * chosen.step)
        rate = seconds_of(mooring, chosen, short) / short
        result = {"step": chosen.step, "rate": rate}
        if budget and rate * mooring.until > budget:
            return result | {"curve": None}
        found = _bounded(mooring, chosen, mooring.until)
        if found is not None:
            return result | _readings(found, mooring)
        chosen = replace(chosen, step=0.9 * chosen.step)
    return {"step": None, "curve": None}


def _readings(found, mooring):
    """Tension of the last two nodes, extrapolated to the end: of second order in the segment; and of a driven end the
    force that holds it, without the inertia of the half segment there: of first order."""
    readings = kept_of(found.t, found.tension[:, :, 1], mooring)
    if found.force.shape[1]:
        readings["force"] = kept_of(found.t, np.linalg.norm(found.force, axis=1), mooring)
    return readings
