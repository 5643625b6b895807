"""Extremes: Gumbel distribution of independent runs, its confidence interval, and crests of a Gaussian sea.

P(largest of a run <= x) = exp(-exp(-(x - u)/b)), with u the most probable value and b the scale; over c times the
duration u rises by b ln(c).  Maximum likelihood fit.  The distribution of (u' - u)/b' of a sample does not depend on u
and b: simulated once for each number of runs with u = 0, b = 1, it gives the interval without asymptotics, even for ten
runs.  Crests of a sea are independent Rayleigh variables (Cartwright and Longuet-Higgins 1956, narrow band).
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..model.spectra import Spectrum

#: Duration whose largest value is stated, in hours and in seconds.
HOURS = 3.0
DURATION = 3600 * HOURS
#: Least number of runs for a distribution of their maxima, and the probability covered by an interval.
LEAST, COVERED = 10, 0.95
#: Half-width of that interval of a Gaussian variable, in standard deviations.
_WIDE = 1.96
#: Simulated samples for the interval, and their seed; their scatter moves its bounds by about 1 % of its width.
_SAMPLES, _SEED = 10_000, 1


@dataclass(frozen=True)
class Gumbel:
    """Location u and scale b [unit of the maxima], fitted to `runs` maxima; 0: from theory."""

    location: float
    scale: float
    runs: int = 0

    @property
    def mean(self) -> float:
        return self.location + np.euler_gamma * self.scale

    @property
    def standard_deviation(self) -> float:
        return math.pi / math.sqrt(6) * self.scale

    def most_probable(self, times: float = 1.0) -> float:
        """The most probable largest value over `times` the duration of a run."""
        return self.location + self.scale * math.log(times)

    def interval(self, times: float = 1.0) -> tuple[float, float]:
        """Confidence interval of the most probable value, with probability COVERED."""
        found = self.most_probable(times)
        low, high = np.quantile(_pivots(self.runs, float(times)), [(1 - COVERED) / 2, (1 + COVERED) / 2])
        return found - self.scale * float(high), found - self.scale * float(low)

    def above(self, x: ArrayLike, times: float = 1.0) -> Any:
        """Probability that the largest value is above x."""
        return -np.expm1(-times * np.exp(-(np.asarray(x) - self.location) / self.scale))

    def uncertainty(self, runs: int, times: float = 1.0, base: float = 0.0) -> float:
        """Half-width of the interval of the most probable value from `runs` runs, relative to its height above a base.

        The asymptotic maximum-likelihood variance (from the information matrix) with four runs fewer, as `interval` is
        wider for few runs: within 4 % of it from ten runs on.
        """
        rise = math.log(times)
        variance = 1.1087 + 0.6079 * rise**2 + 2 * 0.2570 * rise
        return _WIDE * self.scale * math.sqrt(variance / (runs - 4)) / abs(self.most_probable(times) - base)

    def runs_needed(self, part: float, times: float = 1.0, base: float = 0.0) -> int:
        """Number of runs, at least LEAST, for which `uncertainty` is at most `part`."""
        return max(LEAST, math.ceil(4 + (self.uncertainty(5, times, base) / part) ** 2))


def fit_gumbel(maxima: Sequence[float]) -> Gumbel:
    """Gumbel distribution of these maxima by maximum likelihood.

    Raises InputError if there are fewer than LEAST, or if all are equal.
    """
    values = np.asarray(maxima, dtype=float)
    if len(values) < LEAST:
        raise InputError(f"an extreme needs {LEAST} seeds at least, and here are {len(values)}")
    if np.ptp(values) <= 1e-6 * np.abs(values).max():
        raise InputError("the largest values are all the same: without chance there is no distribution of them")
    (location,), (scale,) = _likeliest(values[None])
    return Gumbel(float(location), float(scale), len(values))


def _likeliest(samples: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """u and b of each row: b is the root of mean(x) - b - sum(x e^(-x/b)) / sum(e^(-x/b)), which falls with b.

    Handles all rows at once, as `_pivots` needs; scipy.stats.gumbel_r.fit takes one sample at a time.
    """
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
def _pivots(runs: int, times: float) -> NDArray[Any]:
    """(estimate - truth) / estimated scale of the most probable value, for many samples of `runs` maxima."""
    samples = np.random.default_rng(_SEED).gumbel(size=(_SAMPLES, runs))
    location, scale = _likeliest(samples)
    rise = math.log(times)
    return np.asarray((location + scale * rise - rise) / scale)


def largest_crest(crests: float) -> Gumbel:
    """Gumbel distribution of the largest of N Rayleigh crests, relative to the standard deviation of the elevation.

    Mean and standard deviation are exact, integrated from 1 - (1 - exp(-x^2/2))^N.
    """
    x = np.linspace(0.0, 12.0, 24001)
    above = 1 - (1 - np.exp(-(x**2) / 2)) ** crests
    step = x[1] - x[0]
    mean = float(np.sum(above) - 0.5) * step
    scale = math.sqrt(6) / math.pi * math.sqrt(2 * float(np.sum(x * above)) * step - mean**2)
    return Gumbel(mean - np.euler_gamma * scale, scale)


def crests_of(period: float) -> float:
    """Number of crests in DURATION at this mean period [s], at least two."""
    return max(DURATION / period, 2.0)


def memory_of(spectrum: Spectrum) -> float:
    """2 pi int S^2 dw/m0^2 [s]; see `series.Series.memory`."""
    square = type(spectrum)(lambda w: spectrum.density(w) ** 2, spectrum.knots, spectrum.peak).moment(0)
    return 2 * math.pi * square / spectrum.moment(0) ** 2


def deviation_uncertainty(memory: float, time: float) -> float:
    """Relative half-width of the interval of a standard deviation over a time [s] (Bendat and Piersol, Random Data)."""
    return _WIDE * 0.5 * math.sqrt(memory / time)


def components_needed(crests: float, part: float) -> int:
    """Number of components of equal energy and fixed amplitude with which the largest crest is low by at most `part`.

    The envelope of N phasors exceeds its Rayleigh distribution exp(-q), q = r^2/2, by the factor 1 - (q^2/2 - q)/(2N)
    (Pearson's first term); at q = ln(crests) that lowers the crest by (q/2 - 1)/(4N) of itself.
    """
    return max(1, math.ceil((math.log(crests) / 2 - 1) / (4 * part)))
