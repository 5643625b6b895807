"""What is kept of one run for its statistics: numbers of every series, peaks and rainflow ranges of the main ones.

All that counts is behind the ramp.  A sample is a plain dict, so that a store of many cases can hold it:

    {"start": s, "duration": s, "series": {label: {NUMBERS}}, "peaks": {label: [values, counts]},
     "cycles": {label: [ranges, counts]}, "corners": {buoy: [[x, y], ...]}, of the convex hull of the track of C,
     "watch_circle": {buoy: radius about the anchor}, "parted": which lines have, where and when, if any have}
"""

import math

import numpy as np
import xarray as xr

from ..errors import InputError
from ..scene import Scene
from ..scene.settings import ramp_of
from .certainty import memory_of
from .cycles import binned, crossing_period, peaks, rainflow_cycles
from .elevation import elevation
from .offsets import corners
from .parts import names_of
from .statistics import ADDED, OF_PART, columns_of, weights_of

#: What is said of every series; `period` is the mean time between upward crossings of the mean (nan: none).
#: `memory` is that of `certainty`, of what an irregular sea moves (nan: no chance is in it).
NUMBERS = ("mean", "standard_deviation", "skewness", "minimum", "maximum", "period", "memory")
#: The elevation at a point that stays where it is, and the horizontal distance of C from the anchor, as series.
FIXED_POINT, OFFSET = ADDED
#: Series whose peaks are kept, and whose cycles wear a line; all of these beginnings.
PEAKED = ("tension", FIXED_POINT, "surface_elevation", "buoy_position_z", OFFSET, "cone_angle", "roll", "pitch")
CYCLED = ("tension",)


def sample_of(
    record: xr.Dataset, scene: Scene, start: float | None = None, point=None, bins: int | None = None
) -> dict:
    """The sample of a record.

    start: what comes before does not count [s]; by default the end of the ramp.  point: (x, y) of the fixed point [m];
    by default where the buoy begins, else the anchor.  bins: of peaks and ranges, see `cycles.binned`.
    Raises InputError if fewer than two instants are left.
    """
    start = ramp_of(scene) if start is None else start
    rows = record.time.values >= start - 1e-9 * max(abs(start), 1.0)
    if rows.sum() < 2:
        raise InputError(f"The run ends at t = {float(record.time[-1]):g} s: behind t = {start:g} s there is nothing.")
    late = record.isel(time=rows)
    t = late.time.values
    result = {"start": float(t[0]), "duration": float(t[-1] - t[0]), "series": {}, "peaks": {}, "cycles": {}}
    for label, x, noise in [*columns_of(late), *_added(record, late, scene, point)]:
        result["series"][label] = numbers = numbers_of(t, x, noise)
        if scene.waves is not None and scene.waves.spectrum is not None and numbers["standard_deviation"] > noise:
            numbers["memory"] = memory_of(t, x)
        if label.startswith(PEAKED):
            found = peaks(x, numbers["mean"], noise)
            result["peaks"][label] = _listed(found, np.ones(len(found)), bins)
        if label.startswith(CYCLED):
            result["cycles"][label] = _listed(*rainflow_cycles(x), bins)
    return result | _circles(late, scene) | {k: v for k, v in record.attrs.items() if k == "parted"}


def numbers_of(t: np.ndarray, x: np.ndarray, noise: float = 0.0) -> dict[str, float]:
    """NUMBERS of a series; its moments are over time (trapezoidal rule)."""
    weights = weights_of(t)
    mean = float(np.average(x, weights=weights))
    deviation = math.sqrt(np.average((x - mean) ** 2, weights=weights))
    skewness = float(np.average((x - mean) ** 3, weights=weights)) / deviation**3 if deviation > noise else math.nan
    period = crossing_period(t, x, mean, noise)
    numbers = mean, deviation, skewness, float(x.min()), float(x.max()), period, math.nan
    return dict(zip(NUMBERS, numbers, strict=True))


def _listed(values, counts, bins):
    return [found.tolist() for found in binned(values, counts, bins)]


def _added(record, late, scene, point):
    """Series that a record does not have."""
    if scene.waves:
        eta = elevation(scene, late.time.values, _point(record, scene) if point is None else point)
        yield FIXED_POINT, eta, 1e-9 * np.abs(eta).max()
    if _anchor(scene) is not None:
        for name, track in _tracks(late).items():
            yield f"{OFFSET}{OF_PART}{name}", _offset(track, scene), 1e-9 * np.abs(late.buoy_position.values).max()


def _tracks(record):
    """(x, y) of every buoy over time."""
    return {name: record.buoy_position.sel(buoy=name).values[:, :2] for name in names_of(record, "buoy")}


def _anchor(scene):
    """(x, y) of the anchor, if there is one line and it has one."""
    network = scene.network
    held = len(network.cables) == 1 and network.pieces[0].ends[0].kind == "fixed"
    return network.pieces[0].ends[0].top.position[:2] if held else None


def _offset(track, scene):
    return np.linalg.norm(track - np.array(_anchor(scene)), axis=-1)


def _point(record, scene):
    tracks = _tracks(record)
    return next(iter(tracks.values()))[0] if tracks else _anchor(scene) or (0.0, 0.0)


def _circles(record, scene):
    tracks = _tracks(record)
    found = {"corners": {name: corners(track).tolist() for name, track in tracks.items()}} if tracks else {}
    if _anchor(scene) is not None and tracks:
        found["watch_circle"] = {name: float(_offset(track, scene).max()) for name, track in tracks.items()}
    return found
