"""How well runs of an irregular sea tell what they are made for, against their length and their number.

The variance of a Gaussian process over a time T scatters by sqrt(memory/T) of itself, memory = 2 pi int S^2 dw/m0^2
(Bendat and Piersol, Random Data).  The largest of its crests has Gumbel's distribution.
"""

import math

import numpy as np

from .extremes import LEAST, Gumbel

#: Length of time whose largest value is said [s].
HOURS = 3.0
#: Deviations of a Gaussian number on both sides that hold it with the probability COVERED of `extremes`.
_WIDE = 1.96


def memory_of(t: np.ndarray, x: np.ndarray) -> float:
    """Of a series [s]; nan for a constant.

    A periodogram scatters by as much as its mean: half the sum of its squares stands for int S^2 dw.
    """
    grid = np.linspace(t[0], t[-1], len(t))
    power = np.abs(np.fft.rfft(np.interp(grid, t, x - x.mean()))) ** 2
    return float((t[-1] - t[0]) * np.sum(power**2) / np.sum(power) ** 2 / 2) if power.any() else math.nan


def deviation_known(memory: float, time: float) -> float:
    """Part by which a standard deviation over a time [s] may be off."""
    return _WIDE * 0.5 * math.sqrt(memory / time)


def largest_crest(period: float) -> Gumbel:
    """The largest crest of HOURS over the standard deviation, of so many as a period of upward crossings [s] makes."""
    steepness = math.sqrt(2 * math.log(max(HOURS * 3600 / period, 2.0)))
    return Gumbel(steepness, 1 / steepness, 0)


def part_known(largest: Gumbel, runs: int, times: float = 1.0, base: float = 0.0) -> float:
    """Half the interval of the most probable value of so many times the length of a run, as a part of it above a base.

    The bound of maximum likelihood for many runs (its information matrix) with four runs less, for what
    `Gumbel.interval` is wider with few: within 4 % of it from ten runs on.
    """
    rise = math.log(times)
    variance = 1.1087 + 0.6079 * rise**2 + 2 * 0.2570 * rise
    return _WIDE * largest.scale * math.sqrt(variance / (runs - 4)) / abs(largest.most_probable(times) - base)


def runs_needed(largest: Gumbel, part: float, times: float = 1.0, base: float = 0.0) -> int:
    """How many runs tell it to a part of itself, and at least LEAST."""
    return max(LEAST, math.ceil(4 + (part_known(largest, 5, times, base) / part) ** 2))
