"""Errors of top tensions: what is kept of a run, as what JSON can hold, its limit under refinement, and its error."""

import math

import numpy as np
from scipy.interpolate import CubicSpline

#: Points of a run that are kept.
POINTS = 400
#: What is asked for, in the extremes and over time; and what once was.
BOTH, RMS = ("rms", "extremes"), ("rms",)


def kept_of(t, tension, mooring) -> dict:
    """The last seconds of a run on equal steps, and extremes of every line, between samples by cubic splines.

    tension: (times,) or (times, lines) [N].
    """
    values = np.asarray(tension).reshape(len(t), -1)
    grid = np.linspace(mooring.until - mooring.window, min(mooring.until, t[-1]), 20 * POINTS + 1)
    fine = CubicSpline(t, values)(grid)
    return {"curve": fine[::20].tolist(), "max": fine.max(axis=0).tolist(), "min": fine.min(axis=0).tolist()}


def extrapolated(coarse: dict, middle: dict, fine: dict, highest: float = 4.0) -> dict:
    """Limit under refinement by two, Richardson with the observed order of each extreme, and its own uncertainty.

    The order is taken between 1 and `highest`.  `own`: what the extrapolation adds, relative to the range.
    """
    limit, added = {"curve": fine["curve"]}, []
    for key in ("max", "min"):
        limit[key] = [_limit(*numbers, highest) for numbers in zip(coarse[key], middle[key], fine[key], strict=True)]
        added += [abs(a - b) for a, b in zip(limit[key], fine[key], strict=True)]
    return limit | {"own": max(added) / size_of(limit)}


def _limit(coarse, middle, fine, highest):
    before, last = middle - coarse, fine - middle
    order = min(max(math.log2(abs(before / last)) if last and before else highest, 1.0), highest)
    return fine + last / (2**order - 1)


def size_of(reference: dict) -> float:
    """Range of the tension; of several lines the diagonal of the box of their ranges [N]."""
    return float(np.linalg.norm(np.subtract(reference["max"], reference["min"])))


def apart(one: dict, other: dict) -> float:
    """How far the extremes of two runs are apart, the worst line and side, relative to the range of the second."""
    return max(float(np.abs(np.subtract(one[key], other[key])).max()) for key in ("max", "min")) / size_of(other)


def parts_of(run: dict | None, reference: dict) -> dict[str, float]:
    """Errors of the top tensions over time (`rms`) and of their `extremes`, relative to the range; inf without a run.

    Of MoorDyn's two readings of a driven end ("force" is the other one) the better one counts.
    """
    if run is None or run.get("curve") is None:
        return dict.fromkeys(BOTH, math.inf)
    difference = np.subtract(run["curve"], reference["curve"])
    rms = float(np.sqrt((difference**2).sum(axis=1).mean()))
    own = {"rms": rms / size_of(reference), "extremes": apart(run, reference)}
    found = [own, parts_of(run["force"], reference)] if "force" in run else [own]
    return min(found, key=lambda parts: max(parts.values()))


def error_of(run: dict | None, reference: dict, measures=BOTH) -> float:
    """The larger of these parts: the rms keeps a run from passing because its error happens to vanish at extremes."""
    parts = parts_of(run, reference)
    return max(parts[name] for name in measures)
