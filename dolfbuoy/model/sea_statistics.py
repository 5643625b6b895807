"""What a Gaussian sea does in a given time: its largest crest, its scatter, and what a sum of N components misses.

Crests are those of independent Rayleigh distributions, as many as the mean period Tz says (Cartwright and
Longuet-Higgins 1956, narrow band).
"""

import math

import numpy as np


def largest_crest(crests: float) -> tuple[float, float]:
    """Mean and standard deviation of the largest of some crests, over the standard deviation of the elevation."""
    x = np.linspace(0.0, 12.0, 24001)
    above = 1 - (1 - np.exp(-(x**2) / 2)) ** crests
    step = x[1] - x[0]
    mean = float(np.sum(above) - 0.5) * step
    return mean, math.sqrt(2 * float(np.sum(x * above)) * step - mean**2)


def scatter_of_m0(spectrum, duration: float) -> float:
    """Standard deviation over mean of the variance of a Gaussian elevation over a duration [s].

    sqrt(2 pi int S^2 dw/(T m0^2)).
    """
    square = type(spectrum)(lambda w: spectrum.density(w) ** 2, spectrum.knots, spectrum.peak).moment(0)
    return math.sqrt(2 * math.pi * square / duration) / spectrum.moment(0)


def components_needed(crests: float, part: float) -> int:
    """Components of equal energy and fixed amplitude whose largest of some crests is low by a part at most.

    The envelope of N phasors exceeds its Rayleigh distribution exp(-q), q = r^2/2, by the factor 1 - (q^2/2 - q)/(2N)
    (Pearson's first term); at q = ln(crests) that lowers the crest by (q/2 - 1)/(4N) of itself.
    """
    return max(1, math.ceil((math.log(crests) / 2 - 1) / (4 * part)))


def seeds_needed(crests: float, part: float) -> int:
    """Runs of which the mean of the largest crests has a standard deviation of a part of itself."""
    mean, deviation = largest_crest(crests)
    return max(1, math.ceil((deviation / mean / part) ** 2))
