"""Runs in time compared with the linear response: amplitudes in regular waves, deviations in an irregular sea."""

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...api import simulate
from ...elsewhere import MPI
from ...errors import SolveError
from ...linear.moving import Motions, axes_along, turn
from ...linear.seaway import Seaway
from ...linear.spectrum import small_waves
from ...model.prescribed_ends import from_rest, motion_of
from ...model.sea import heading, wavenumber
from ...scene import Scene
from ...scene.cable import MOTION, Top
from ...scene.sections import Time
from ...scene.waves import Waves
from ...statics.catenary import Array
from ..study import Row

#: Numbers of periods for the ramp, for settling, and for evaluation; steps per period.
GROWING, SETTLING, FITTED, STEPS = 6, 6, 4, 200
#: In an irregular sea: peak periods for ramp and settling, and for evaluation.
BEFORE, SEEN = 20, 180

#: Fraction of the largest of its kind below which a value is not compared.
LEAST = 0.02
KINDS = {"surge": "motion", "sway": "motion", "heave": "motion", "roll": "turn", "pitch": "turn"}


def measured(scene: Scene, period: float, direction_deg: float, amplitude: float) -> dict[str, complex]:
    """Name -> complex amplitude per metre, as in `linear.seaway`, of a run from rest with BDF2; and "seconds".

    Ends moved by the scene are held still.  "unsettled": relative change that amplitudes still undergo.  Raises
    SolveError if a step fails.
    """
    began = time.monotonic()
    waves = small_waves(scene, period, direction_deg, amplitude).model_copy(update={"ramp": GROWING * period})
    end = (GROWING + SETTLING + FITTED) * period
    run = _run(scene, waves, end, period)
    times, values, place = _history(run, direction_deg)
    crest = amplitude * np.exp(1j * wavenumber(run) * float(heading(direction_deg) @ place))

    def fitted(start: float, stop: float) -> dict[str, complex]:
        """Harmonics per crest height between these numbers of periods before the end."""
        rows = (times > end - (start + 1e-6) * period) & (times < end - (stop - 1e-6) * period)
        columns = np.array([column[rows] for column in values.values()]).T
        return dict(zip(values, harmonics(times[rows], columns, 2 * math.pi / period) / crest, strict=True))

    halves = fitted(FITTED, FITTED / 2), fitted(FITTED / 2, 0)
    unsettled = max((abs(change) / 100 for change in compared(*halves).values()), default=0.0)
    return fitted(FITTED, 0) | {"seconds": time.monotonic() - began, "unsettled": unsettled}


def measured_in_sea(scene: Scene, waves: Waves) -> tuple[dict[str, float], dict[str, float]]:
    """Standard deviations by name, and "seconds": of the linear response, and of a run with BDF2 over "time" [s].

    Both with the same components, drag linearised for them, over the same time: no random error in their difference.
    waves: a section [waves] of an irregular sea.  Raises SolveError if a step fails.
    """
    period = waves.main_period
    began = time.monotonic()
    waves = waves.model_copy(update={"ramp": BEFORE / 2 * period})
    times, values, _ = _history(_run(scene, waves, (BEFORE + SEEN) * period, period), waves.direction_deg)
    seconds = time.monotonic() - began
    kept = times > BEFORE * period
    run = {name: float(np.std(column[kept])) for name, column in values.items()}
    began = time.monotonic()
    seaway = Seaway(scene.model_copy(update={"waves": waves}), waves.direction_deg)
    try:
        linear = seaway.over_time(waves, times[kept])
    finally:
        seaway.destroy()
    own = {name: float(np.std(column)) for name, column in linear.items()}
    return own | {"seconds": time.monotonic() - began}, run | {"seconds": seconds, "time": SEEN * period}


def _run(scene: Scene, waves: Waves, end: float, period: float) -> Scene:
    stepping = Time(end=end, step=period / STEPS, scheme="bdf2", output_every=end)
    return from_rest(held_still(scene)).model_copy(update={"waves": waves, "time": stepping})


def _history(scene: Scene, direction_deg: float) -> tuple[Array, dict[str, Array], Array]:
    """(times, name -> values as in `linear.seaway`, reference position at rest) of a run.
    The position is that of C of the first buoy or, without buoys, of the first top."""
    record = simulate(scene, comm=MPI.COMM_SELF)
    if record.attrs["failed_steps"]:
        raise SolveError("steps failed: these waves are too rough for regular steps")
    found: dict[str, Array] = {}
    buoys: Any = record.get("buoy", [])
    cables: Any = record.get("cable", [])
    for name in buoys:
        one, ending = record.sel(buoy=name), f" of {name.item()}" if len(buoys) > 1 else ""
        moved, q = one.buoy_position.values - one.buoy_position.values[0], one.buoy_orientation.values
        turns = np.array([turn(q[0], change) for change in q - q[0]])
        columns = np.hstack([moved, turns]).reshape(len(q), 2, 3) @ axes_along(direction_deg).T
        found |= {f"{n}{ending}": column for n, column in zip(Motions._fields, columns.reshape(-1, 6).T, strict=True)}
    for name in cables:
        ending = f"_{name.item()}" if len(cables) > 1 else ""
        found |= {f"{n}{ending}": record[n].sel(cable=name).values for n in ("tension_top", "tension_anchor")}
    if len(buoys):
        place = record.buoy_position.values[0, 0]
    else:
        nodes = np.flatnonzero(record.cable_of_node.values == record.cable_of_node.values[0])
        place = record.cable_position.values[0, nodes[-1]]
    return record.time.values, found, place


def harmonics(times: Array, values: Array, omega: float) -> Any:
    """X of Re[X exp(-i omega t)] in every column of values (times, n), by least squares, with a parabola in time."""
    phase, slow = omega * times, (times - times.mean()) / np.ptp(times)
    basis = np.column_stack([np.cos(phase), np.sin(phase), np.ones_like(slow), slow, slow**2])
    cosine, sine = np.linalg.lstsq(basis, values, rcond=None)[0][:2]
    return cosine + 1j * sine


def compared(own: Mapping[str, complex], run: Mapping[str, complex]) -> dict[str, float]:
    """Difference of the linear amplitudes from those of a run [%], for all that are not small among their kind.

    Without yaw, in which most buoys are unrestrained.
    """
    found = {}
    for kind in ("motion", "turn", "tension"):
        names = [n for n in run if n in own and KINDS.get(n.split()[0], n.partition("_")[0]) == kind]
        sizes = {name: abs(run[name]) for name in names}
        for name in (n for n in sizes if sizes[n] > LEAST * max(sizes.values())):
            found[name] = 100 * (abs(own[name]) / sizes[name] - 1)
    return found


def held_still(scene: Scene) -> Scene:
    """The scene with all moved ends held at their positions at t = 0."""

    def still(section: Any, end: Any, changes: Callable[[Any], Row]) -> Any:
        moved = end is not None and end.kind == "prescribed"
        return section.model_copy(update=changes(tuple(motion_of(end)(0.0)))) if moved else section

    rest = dict.fromkeys((*MOTION, "phase_deg", "ramp"))
    cables = scene.cable and [
        still(c, c.top, lambda place: {"top": Top(kind="fixed", position=place)}) for c in scene.cable
    ]
    joints = scene.joint and [still(j, j.held, lambda place: rest | {"position": place}) for j in scene.joint]
    return scene.model_copy(update={"cable": cables, "joint": joints})
