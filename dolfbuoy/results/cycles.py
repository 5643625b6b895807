"""Cycles in a series: crossings, peaks, rainflow ranges, and what they do to a line.

Peaks are the highest values between two upward crossings of the mean.  Rainflow counting after ASTM E1049-85, by the
package `rainflow`.  Ranges and peaks come as two arrays, values and how often each counts: a half cycle counts 0.5.
"""

import math

import numpy as np

from ..errors import InputError

#: Seconds of a year of 365.25 days.
YEAR = 31557600.0


def up_crossings(x: np.ndarray, level: float, noise: float = 0.0) -> np.ndarray:
    """Rows of x, each the last one below the level before one on or above it; none in what varies less than `noise`."""
    if len(x) < 2 or np.ptp(x) <= 2 * noise:
        return np.zeros(0, dtype=int)
    above = x >= level
    return np.flatnonzero(~above[:-1] & above[1:])


def crossing_period(t: np.ndarray, x: np.ndarray, level: float, noise: float = 0.0) -> float:
    """Mean time between two upward crossings of the level [unit of t]; nan if there are not two."""
    rows = up_crossings(x, level, noise)
    if len(rows) < 2:
        return math.nan
    i = rows[[0, -1]]
    first, last = t[i] + (level - x[i]) / (x[i + 1] - x[i]) * (t[i + 1] - t[i])
    return float((last - first) / (len(rows) - 1))


def peaks(x: np.ndarray, level: float, noise: float = 0.0) -> np.ndarray:
    """The highest value between each two neighbouring upward crossings of the level, in order."""
    rows = up_crossings(x, level, noise)
    return np.maximum.reduceat(x, rows + 1)[:-1] if len(rows) > 1 else np.zeros(0)


def exceedance(values: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(values, falling, and the probability that a peak is as high or higher): i/(N + 1) for the i-th of N."""
    order = np.argsort(values)[::-1]
    above = np.cumsum(counts[order])
    return values[order], above / (above[-1] + 1) if len(above) else above


def rainflow_cycles(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(ranges of a series in rising order, how many cycles each counts); what is left over counts half."""
    try:
        from rainflow import count_cycles  # the only place that needs it
    except ImportError:
        raise InputError(
            "rainflow is not installed, which counts cycles: pip install rainflow, or this tree anew."
        ) from None
    found = np.array(count_cycles(x), dtype=float).reshape(-1, 2)
    found = found[found[:, 0] > 0]
    return found[:, 0], found[:, 1]


def binned(values: np.ndarray, counts: np.ndarray, bins: int | None) -> tuple[np.ndarray, np.ndarray]:
    """The same in so many bins of equal width at most, each with its mean value and its count; None: as they are.

    A sum of value^m then misses a part of about m (m - 1) / (24 bins^2) of what the largest values bring.
    """
    if bins is None or len(values) <= bins:
        return values, counts
    place = np.floor((values - values.min()) / np.ptp(values) * bins).clip(max=bins - 1).astype(int)
    total = np.bincount(place, counts, bins)
    kept = total > 0
    return np.bincount(place, counts * values, bins)[kept] / total[kept], total[kept]


def equivalent_load(ranges: np.ndarray, counts: np.ndarray, exponent: float, cycles: float) -> float:
    """The constant range that does in so many cycles what these ranges do, (sum n S^m / N)^(1/m) [unit of ranges]."""
    largest = ranges.max(initial=0.0)
    if largest == 0:
        return 0.0
    return float(largest * (np.sum(counts * (ranges / largest) ** exponent) / cycles) ** (1 / exponent))


def miner_sum(ranges: np.ndarray, counts: np.ndarray, exponent: float, constant: float) -> float:
    """Palmgren-Miner: sum n/N with N = K S^-m cycles to failure; K in (unit of ranges)^m."""
    return float(np.sum(counts * ranges**exponent) / constant)
