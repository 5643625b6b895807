"""Companions of a run: the scene with steps twice as long and half the elements, for the whole run or around events."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..model.airy import propagation, sea_of
from ..results.measured import window_start
from ..scene import Scene, load_scene
from ..scene.settings import fitting, period_of, ramp_of, space_of, stepping_of, with_settings
from .outputs import ANCHOR, series_after

if TYPE_CHECKING:
    import xarray as xr

#: If a run has more than this many periods after its ramp (with a single period, or in an irregular sea), its companion
#: covers only the beginning: the ramp and PERIODS, or in waves at least a TENTH of the rest.
MANY, MANY_OF_A_SEA, PERIODS, TENTH = 10, 20, 4, 0.1
#: Periods of a companion around an event: build-up of the sea from rest, decay of the transient, after the event.
GROWTH, FORGETTING, AFTER = 2, 5, 1
#: Largest fraction of a run that its companions cover.
SHARE = 0.5
#: Series whose extremes are events, in order of importance.
EVENTS = ("tension_top", ANCHOR, "cone_angle", "buoy_position_z")
#: Newton tolerance of a companion: changes forces by at most 1e-5 of their range, and saves a fifth of the iterations.
LOOSE = 1e-5
#: Order of the local time error of each scheme: tolerances scale with the step to this power.
LOCAL_ORDER = {"backward-euler": 2, "bdf2": 3, "generalized-alpha": 3}


class Event(NamedTuple):
    """A companion around an extreme starts from rest at `begin`, counts from `settled` and ends at `end` [s]."""

    begin: float
    settled: float
    end: float


def companion_of(scene: Scene) -> Scene:
    """The scene with twice the step (or the tolerance that doubles adaptive steps) and half the elements.

    Every piece of line keeps at least one element.  For long runs only the beginning: see `covered`.
    """
    return load_scene(_coarser(scene), **{"time.end": covered(scene), "accuracy": None})


def _coarser(scene: Scene) -> Scene:
    space, stepping = space_of(scene), stepping_of(scene)
    if space.mu:
        space = fitting(scene, replace(space, cells=max(1, space.cells // 2)))
    stepping = replace(stepping, step=2 * stepping.step, newton=max(stepping.newton, LOOSE))
    if stepping.tolerance is None:
        return with_settings(scene, space, stepping)
    tolerance = min(stepping.tolerance * 2 ** LOCAL_ORDER[stepping.scheme], 0.5)
    coarse = with_settings(scene, space, replace(stepping, tolerance=tolerance, largest=None))
    limits = {"time.min_step": scene.time.min_step, "time.max_step": scene.time.max_step}
    return load_scene(coarse, **{key: 2 * value for key, value in limits.items() if value is not None})


def covered(scene: Scene) -> float:
    """Time until which the companion runs [s]."""
    start, end, period = window_start(scene), scene.time.end, period_of(scene)
    many = MANY_OF_A_SEA if _is_a_sea(scene) else MANY
    if period is None or end - start <= many * period:
        return end
    return min(end, start + max(PERIODS * period, TENTH * (end - start) if scene.waves else 0.0))


def followed(scene: Scene) -> float:
    """Time until which the time-step error of a run with a companion is followed [s].

    In a long run, an instant that does not change if the run is extended, as following cannot start later.
    """
    start, end, period = window_start(scene), scene.time.end, period_of(scene)
    if period is None or covered(scene) >= end or start != ramp_of(scene):
        return end
    return min(end, start + PERIODS * period)


def _is_a_sea(scene: Scene) -> bool:
    return scene.waves is not None and scene.waves.irregular


def events_of(scene: Scene, record: "xr.Dataset") -> list[Event]:
    """Times around extremes of EVENTS after `covered`, as many as there is room for, most important first.

    Empty if the scene does not start from rest, or if more than the sea depends on time.
    """
    least, end = covered(scene), scene.time.end
    ends = [end for piece in scene.network.pieces for end in piece.ends if end.top is not None]
    parts = any(piece.section.fails_at for piece in scene.network.pieces)
    if least >= end or not _is_a_sea(scene) or parts or any(one.kind != "fixed" for one in ends):
        return []
    period, found, room = period_of(scene), [], SHARE * end - least
    series = series_after(record, window_start(scene))
    for name in EVENTS:
        for one in (one for (series_name, _), one in series.items() if series_name == name):
            instants = [one.t[one.x.argmax()], *([one.t[one.x.argmin()]] if name == EVENTS[-1] else [])]
            for t in (t for t in instants if t > least and not any(e.settled <= t <= e.end for e in found)):
                begin = max(math.floor((t - (GROWTH + FORGETTING) * period) / scene.time.step) * scene.time.step, 0.0)
                event = Event(begin, begin + (GROWTH + FORGETTING - 1) * period, min(t + AFTER * period, end))
                room -= event.end - event.begin
                if room >= 0:
                    found.append(event)
    return found


def companion_around(scene: Scene, event: Event) -> Scene:
    """The coarser scene started from rest at the beginning of an event, in the same sea; its times count from there."""
    waves, components = scene.waves, sea_of(scene)
    rows = components.as_rows()
    at_ground = np.array([propagation(scene, period, way).at_ground for _, period, way, _ in rows])
    rows[:, 3] = np.degrees(np.mod(components.phase - at_ground * event.begin, 2 * math.pi))
    keys = ("stretching", "period_seen_from", "kinematics")
    kept = {key: value for key in keys if (value := getattr(waves, key)) is not None}
    sea = kept | {"components": rows.tolist(), "ramp": GROWTH * period_of(scene)}
    changes = {"time.end": event.end - event.begin, "accuracy": None}
    return load_scene(_coarser(scene).to_dict() | {"waves": sea}, **changes)
