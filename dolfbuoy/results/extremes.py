"""Largest values: Gumbel's distribution from maxima of independent runs, and its confidence interval.

P(largest of a run <= x) = exp(-exp(-(x - u)/b)), u the most probable value, b the scale; over c times as long u rises
by b ln(c).  Maximum likelihood.  (u' - u)/b' of a sample does not depend on u and b, so that its distribution, and with
it the interval, is found once for each number of runs from samples of u = 0, b = 1: no asymptotics, also for ten runs.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError

#: Runs below which there is no distribution of their maxima, and the probability that the interval covers.
LEAST, COVERED = 10, 0.95
#: Samples that the interval is found from: their own scatter moves its bounds by about 1 % of its width.
_SAMPLES, _SEED = 10_000, 1


@dataclass(frozen=True)
class Gumbel:
    """location u and scale b [unit of the maxima], found from `runs` maxima."""

    location: float
    scale: float
    runs: int

    def most_probable(self, times: float = 1.0) -> float:
        """The most probable largest value of a time so many times as long as a run."""
        return self.location + self.scale * math.log(times)

    def interval(self, times: float = 1.0) -> tuple[float, float]:
        """Bounds that hold it with the probability COVERED."""
        found = self.most_probable(times)
        low, high = np.quantile(_pivots(self.runs, float(times)), [(1 - COVERED) / 2, (1 + COVERED) / 2])
        return found - self.scale * float(high), found - self.scale * float(low)

    def below(self, x: np.ndarray, times: float = 1.0) -> np.ndarray:
        """Probability that the largest value is x at most."""
        return np.exp(-times * np.exp(-(np.asarray(x) - self.location) / self.scale))


def fit_gumbel(maxima) -> Gumbel:
    """Gumbel's distribution of these maxima by maximum likelihood.

    Raises InputError if they are fewer than LEAST, or all the same.
    """
    maxima = np.asarray(maxima, dtype=float)
    if len(maxima) < LEAST:
        raise InputError(f"an extreme needs {LEAST} seeds at least, and here are {len(maxima)}")
    if np.ptp(maxima) <= 1e-6 * np.abs(maxima).max():
        raise InputError("the largest values are all the same: without chance there is no distribution of them")
    (location,), (scale,) = _likeliest(maxima[None])
    return Gumbel(float(location), float(scale), len(maxima))


def _likeliest(samples):
    """u and b of each row: b is the root of mean(x) - b - sum(x e^(-x/b)) / sum(e^(-x/b)), which falls with b."""
    lowest = samples.min(axis=1)
    x = samples - lowest[:, None]
    mean = x.mean(axis=1)
    low, high = np.zeros(len(x)), mean  # where the function is positive, and not positive
    for _ in range(60):
        b = 0.5 * (low + high)
        weights = np.exp(-x / b[:, None])
        excess = mean - b - (x * weights).sum(axis=1) / weights.sum(axis=1)
        low, high = np.where(excess > 0, b, low), np.where(excess > 0, high, b)
    return lowest - b * np.log(np.exp(-x / b[:, None]).mean(axis=1)), b


@functools.cache
def _pivots(runs, times):
    """(estimate - truth) / estimated scale of the most probable value, of many samples of so many maxima."""
    samples = np.random.default_rng(_SEED).gumbel(size=(_SAMPLES, runs))
    location, scale = _likeliest(samples)
    rise = math.log(times)
    return (location + scale * rise - rise) / scale
