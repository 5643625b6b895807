"""Current, wind and force that vary over time: numbers of gusts, and warnings of fast changes and early ends."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.varying import Grid, Gusts, range_of_tide, rate_of_tide, seed_of, turning
from ..scene import Scene
from ..scene.sections import Sea

if TYPE_CHECKING:
    from .report import Report

#: Acceleration of the water above which its inertia may matter [m/s^2].
FAST = 0.01
#: Fraction of the range of a tide by which it may overshoot its rows without warning.
BEYOND = 0.02
#: Tidal range, as a fraction of the depth, above which the change of depth may matter for waves.
DEEPER = 0.2


def of_weather(scene: Scene, report: "Report") -> None:
    """Add numbers and warnings on sections that vary over time to the Report of `check`."""
    sections: dict[str, Any] = {"sea": scene.sea, "current": scene.current}
    for name, buoy in scene.network.buoys.items():
        about = report.about(name if len(scene.network.buoys) > 1 else "")
        sections |= {f"{name}: wind": buoy.wind, f"{name}: external_force": buoy.external_force}
        if buoy.wind is not None and buoy.wind.gusts is not None:
            gusts = Gusts(buoy.wind, seed_of(scene, buoy.wind))
            about.add("standard deviation of the gusts", gusts.deviation, "m/s", f"at 10 m, by {buoy.wind.gusts}")
    sections |= {f"{vessel.name}: wind": vessel.wind for vessel in scene.vessel or []}
    for name, section in sections.items():
        for key in ("over_time", "grid", "tide"):
            rows = getattr(section, key, None)
            last = max((row[0] for row in rows or []), default=math.inf)
            if rows and scene.time is not None and last < scene.time.end:
                report.warn(len(rows) > 1, f"{name}.{key} ends at {last:g} s, before the run: its last row goes on.")
    if scene.sea is not None and scene.sea.tide is not None:
        _tide(scene, scene.sea, report)
    rate = _rate(scene.current) if scene.current is not None else 0.0
    report.warn(
        rate > FAST,
        f"The current changes by up to {rate:.2g} m/s in a second: the inertia of water that speeds up is not counted.",
    )


def _tide(scene: Scene, sea: Sea, report: "Report") -> None:
    """Add the range of a tide, with warnings if it is too fast or too large."""
    (low, high), heights = range_of_tide(scene), np.array(sea.tide)[:, 1]
    report.add("range of the tide", high - low, "m", f"from {low:.3g} to {high:.3g} m")
    beyond = high - low - float(np.ptp(heights))
    report.warn(
        beyond > BEYOND * (high - low),
        f"sea.tide goes {beyond:.2g} m beyond its rows, on the curve that joins them: more rows would hold it.",
    )
    rate = rate_of_tide(sea.tide or [])
    report.warn(rate > FAST, f"The tide changes by up to {rate:.2g} m/s: the water's own velocity is not counted.")
    report.warn(
        scene.waves is not None and high - low > DEEPER * sea.depth,
        f"sea.tide changes the depth by {high - low:.3g} m: waves keep the lengths of {sea.depth:g} m of water.",
    )


def _rate(current: Any) -> float:
    """Largest change of the current's velocity in a second [m/s]."""
    if current.grid:
        grid = Grid(current.grid)
        values = np.array([grid(t) for t in grid.times])
        return float((np.linalg.norm(np.diff(values, axis=0), axis=2).T / np.diff(grid.times)).max(initial=0.0))
    times = np.array([row[0] for row in current.over_time or []])
    factors = np.array([turning(current.over_time)(t) for t in times])
    fastest = current.speed if current.speed is not None else max(speed for _, speed in current.profile)
    return float((np.abs(np.diff(factors)) / np.diff(times)).max(initial=0.0) * fastest)
