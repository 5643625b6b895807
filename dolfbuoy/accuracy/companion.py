"""The companion of a run: the same scene with steps twice as long and half as many elements."""

from dataclasses import replace

from ..results.measured import window_start
from ..scene import Scene, load_scene
from ..scene.settings import fitting, period_of, ramp_of, space_of, stepping_of, with_settings

#: A run of more periods than MANY after its ramp has a companion of the ramp and PERIODS, or a SHARE of the rest.
MANY, PERIODS, SHARE = 10, 4, 0.1
#: Order in time of the local error of each scheme: tolerances grow with its steps to this power.
LOCAL_ORDER = {"backward-euler": 2, "bdf2": 3, "generalized-alpha": 3}


def companion_of(scene: Scene) -> Scene:
    """The scene with twice the step, of adaptive ones the tolerance that doubles them, and half the elements.

    Every piece of line keeps at least one element.  Of long runs the beginning alone: see `covered`.
    """
    space, stepping = space_of(scene), stepping_of(scene)
    if space.mu:
        space = fitting(scene, replace(space, cells=max(1, space.cells // 2)))
    stepping = replace(stepping, step=2 * stepping.step)
    if stepping.tolerance is not None:
        tolerance = min(stepping.tolerance * 2 ** LOCAL_ORDER[stepping.scheme], 0.5)
        stepping = replace(stepping, tolerance=tolerance, largest=None)
    coarse = with_settings(scene, space, stepping)
    changes = {"time.end": covered(scene), "accuracy": None}
    if stepping.tolerance is not None:
        limits = {"time.min_step": scene.time.min_step, "time.max_step": scene.time.max_step}
        changes |= {key: 2 * value for key, value in limits.items() if value is not None}
    return load_scene(coarse, **changes)


def covered(scene: Scene) -> float:
    """Until when the companion runs [s]."""
    start, end, period = window_start(scene), scene.time.end, period_of(scene)
    if period is None or end - start <= MANY * period:
        return end
    rest = end - ramp_of(scene)
    return min(end, ramp_of(scene) + max(PERIODS * period, SHARE * rest if scene.waves else 0.0))
