"""Warnings about a doubtful run: short peaks, undamped pulses, capsized or submerged buoys, retried steps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import NoResult
from ..model.contact import height_of_bed
from ..model.rigid import shape_of
from .parts import names_of, parts_of

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene
    from ..scene.buoy import Buoy
    from ..scene.cable import Cable

#: Steps that a peak needs above half its height: a snap resolved by 6 was 6 % too low, by 3, 18 to 37 %.
STEPS_OF_A_PEAK = 6
#: Behaviour of an elastic line without damping: the end of a sentence that `check` and the summary begin.
PULSES = (
    "no damping: pulses from where it comes taut or lands run along it as long as the scheme and the elements let "
    "them, and the ends double them; see cable.damping."
)


def short_peaks(record: xr.Dataset, low: str, high: str) -> list[str]:
    """Warnings of peak tensions resolved by few steps, where smaller steps may find larger.  low, high: ends."""
    from .tables import force_unit  # with rich, which no run needs

    found = []
    for end, force in ((low, np.linalg.norm(record.anchor_force, axis=-1)), (high, record.tension_top.values)):
        steps = steps_of_peak(force)
        if steps < STEPS_OF_A_PEAK:
            unit, factor = force_unit(force)
            text = f"The largest tension at {end}, {factor * force.max():.4g} {unit} at "
            text += f"{float(record.time[force.argmax()]):.5g} s, rests on {steps} step{'s' if steps > 1 else ''}"
            found.append(f"{text}: a snap, of which smaller steps may show more.")
    return found


def steps_of_peak(force: ArrayLike) -> float:
    """Consecutive steps about the peak force above its mean with the median; inf if it hardly rises."""
    force = np.asarray(force)
    largest, usual = force.max(), np.median(force)
    if largest - usual <= 0.1 * largest:
        return math.inf
    below = np.flatnonzero(force <= (largest + usual) / 2) - force.argmax()
    before, after = below[below < 0], below[below > 0]
    if not len(before) or not len(after):
        return math.inf
    return int(after[0] - before[-1] - 1)


def undamped(record: xr.Dataset, scene: Scene, sections: list[Cable]) -> list[str]:
    """Warning of an elastic cable without damping that went slack or lay on the bed.

    sections: of its segments.  Slack is detected in the recorded frames only.
    """
    bare = np.array([c.axial_stiffness != math.inf and not c.damping for c in sections])
    slackens = bare & [c.slack == "tension-only" for c in sections]
    segment = record.segment_of_cell.values
    slack = (record.cable_tension.values[:, slackens[segment]] <= 0).any()
    states = ["went slack"] if slack else []
    if scene.seabed:
        position = record.cable_position.values
        ends = position[:, :: (position.shape[1] - 1) // len(segment)]
        below = ends[..., 2] <= height_of_bed(scene, ends)
        if (below[:, 1:] & below[:, :-1])[:, bare[segment]].any():  # both ends of an element on the bed
            states.append("lay on the sea bed")
    return [f"The cable {' and '.join(states)}, and has {PULSES}"] if states else []


#: Cone angles from which a buoy is said to lean and to capsize [deg].
LEAN, CAPSIZE = 45.0, 90.0
#: Fraction of its volume below which the emerged part of a buoy counts as none.
LEAST_FREEBOARD = 1e-6


def states_of(record: xr.Dataset, scene: Scene) -> list[str]:
    """Sentences about the buoys of a run or an equilibrium, with their names if there are several."""
    found = []
    for name, part in zip(names_of(record, "buoy"), parts_of(record, "buoy"), strict=True):
        found += part.named(_lean(part.record) + _under(part.record, scene, scene.network.buoys[name]))
    return found


def is_under(displaced: Any, scene: Scene, buoy: Buoy) -> Any:
    """True if a buoy that displaces this mass of water [kg] is under water."""
    sea: Any = scene.sea
    hull: Any = shape_of(buoy)
    return displaced >= (1 - LEAST_FREEBOARD) * sea.density * hull.volume()


def _lean(record: xr.Dataset) -> list[str]:
    angle = np.atleast_1d(record.cone_angle.values)
    worst, largest = int(angle.argmax()), angle.max()
    if largest < LEAN:
        return []
    if "time" not in record.dims:
        return [f"The buoy {'is capsized' if largest >= CAPSIZE else 'leans'} at rest: {largest:.3g} degrees."]
    t = record.time.values
    if largest < CAPSIZE:
        return [f"The buoy leaned by up to {largest:.3g} degrees, at t = {t[worst]:g} s."]
    first = t[np.argmax(angle >= CAPSIZE)]
    return [
        f"The buoy capsized: it leaned by more than {CAPSIZE:g} degrees from t = {first:g} s on, up to {largest:.3g}."
    ]


def _under(record: xr.Dataset, scene: Scene, buoy: Buoy) -> list[str]:
    if scene.sea is None or "displaced_mass" not in record:
        return []
    displaced = np.atleast_1d(record.displaced_mass.values)
    under = is_under(displaced, scene, buoy)
    if not under.any():
        return []
    if "time" not in record.dims:
        return ["The buoy is all under water at rest."]
    share, first = 100 * under.mean(), record.time.values[np.argmax(under)]
    return [f"The buoy was all under water in {share:.2g} % of the instants, first at t = {first:g} s."]


#: Fractions of cut steps above which a warning is given, and above which the run has no result.
OFTEN, MOST = 0.05, 0.5


def cut(record: xr.Dataset, scene: Scene) -> float:
    """Fraction of the steps of a run that had to be cut; with a tolerance, fraction that failed."""
    time: Any = scene.time
    steps, failed = record.sizes["time"] - 1, record.attrs.get("failed_steps", 0)
    if not failed or not steps or time.tolerance is not None:
        return float(min(failed / max(steps, 1), 1.0))
    step = time.step
    numbers = np.ceil(record.time.values[1:] / step - 1e-6)
    count = len(np.unique(numbers))  # a step may have been made smaller without having failed
    smaller = numbers[record.time_step.values[1:] < (1 - 1e-6) * step]
    return float(min(len(np.unique(smaller)), failed) / count)


def about_retries(record: xr.Dataset, scene: Scene) -> list[str]:
    """A sentence about retried steps, if there were any."""
    failed, share = record.attrs.get("failed_steps", 0), cut(record, scene)
    doubt = f", in {100 * share:.3g} % of the run: see whether its numbers stay with a smaller time.step"
    words = f"{failed} steps failed and were retried with smaller ones"
    return [f"{words}{doubt if share > OFTEN else ''}."] if failed else []


def refused(record: xr.Dataset, scene: Scene) -> NoResult | None:
    """Error to raise for a finished run most of whose steps were retried; None for a sound run."""
    if (share := cut(record, scene)) <= MOST:
        return None
    return NoResult(
        f"{100 * share:.3g} % of all steps failed and were retried with smaller ones: what is left is no result; take "
        "a smaller time.step or another time.scheme.",
        record,
    )
