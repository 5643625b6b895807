"""Wave spectra, and their discretisation into N components.

S is one-sided, per angular frequency [m^2 s/rad]; m_n = int w^n S dw and Hs = 4 sqrt(m0).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from . import Array

#: Gauss rule on every panel between knots.
_AT, _WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Spectrum:
    """Spectrum; density: angular frequency [rad/s] -> S, smooth between knots, zero beyond them; peak: w_p [rad/s]."""

    density: Callable[[Array], Array]
    knots: Array
    peak: float

    def moment(self, n: float, low: float = 0.0, high: float = math.inf) -> float:
        """int w^n S dw between two frequencies [m^2 (rad/s)^n]."""
        edges = np.unique(np.clip(self.knots, low, high))
        return float(np.sum(self._integrals(edges[:-1], edges[1:], n)))

    def _integrals(self, a: Array, b: Array, n: float = 0) -> Array:
        w = a[:, None] + 0.5 * (b - a)[:, None] * (1 + _AT)
        return np.asarray(0.5 * (b - a) * (w**n * self.density(w) @ _WEIGHTS))

    def below(self, w: Array, n: float = 0) -> Array:
        """int w^n S dw from the lowest frequency up to each of w."""
        w = np.clip(w, self.knots[0], self.knots[-1])
        up_to = np.concatenate([[0.0], np.cumsum(self._integrals(self.knots[:-1], self.knots[1:], n))])
        panel = np.clip(np.searchsorted(self.knots, w, side="right") - 1, 0, len(self.knots) - 2)
        return up_to[panel] + self._integrals(self.knots[panel], w, n)

    def frequencies_at(self, energies: Array) -> Array:
        """Frequencies below which m0 reaches these values [m^2], by bisection and Newton."""
        up_to = self.below(self.knots)
        panel = np.clip(np.searchsorted(up_to, energies, side="left") - 1, 0, len(self.knots) - 2)
        low, high = self.knots[panel].copy(), self.knots[panel + 1].copy()
        w = 0.5 * (low + high)
        for _ in range(60):
            excess: Array = up_to[panel] + self._integrals(self.knots[panel], w) - energies
            if np.all(np.abs(excess) <= 1e-16 * up_to[-1]):
                break
            low, high = np.where(excess < 0, w, low), np.where(excess < 0, high, w)
            with np.errstate(divide="ignore", invalid="ignore"):
                newton = w - excess / self.density(w)
            w = np.where((newton > low) & (newton < high), newton, 0.5 * (low + high))
        return np.asarray(w)

    def band(self, low: float, high: float, parts: int) -> Array:
        """Edges of bins of equal energy between two frequencies [rad/s]."""
        ends = self.below(np.array([low, high]))
        inner = self.frequencies_at(np.linspace(ends[0], ends[1], parts + 1)[1:-1])
        return np.concatenate([[max(low, self.knots[0])], inner, [min(high, self.knots[-1])]])

    def bins(self, edges: Array) -> tuple[Array, Array]:
        """Energy m0 [m^2] of the bins between edges, and the frequency that preserves the m2 of each [rad/s]."""
        energy, second = np.diff(self.below(edges)), np.diff(self.below(edges, 2))
        return energy, np.sqrt(second / energy)


def pierson_moskowitz(significant_height: float, peak_period: float) -> Spectrum:
    """Bretschneider form, 5/16 Hs^2 w_p^4 w^-5 exp(-5/4 (w_p/w)^4)."""
    peak = 2 * math.pi / peak_period
    scale = 5 / 16 * significant_height**2 * peak**4
    return Spectrum(lambda w: scale * _shape(w, peak), _knots(peak), peak)


def jonswap(significant_height: float, peak_period: float, gamma: float = 3.3) -> Spectrum:
    """c w^-5 exp(-5/4 (w_p/w)^4) gamma^exp(-(w - w_p)^2/(2 sigma^2 w_p^2)), sigma 0.07 below the peak and 0.09 above.

    Hasselmann et al. (1973); c by quadrature, so that m0 = Hs^2/16.
    """
    peak = 2 * math.pi / peak_period

    def shape(w: Array) -> Array:
        sigma = np.where(w <= peak, 0.07, 0.09)
        return np.asarray(_shape(w, peak) * gamma ** np.exp(-((w / peak - 1) ** 2) / (2 * sigma**2)))

    scale = significant_height**2 / 16 / Spectrum(shape, _knots(peak), peak).moment(0)
    return Spectrum(lambda w: scale * shape(w), _knots(peak), peak)


def _shape(w: Array, peak: float) -> Array:
    w = np.maximum(w, 0.1 * peak)  # negligible below
    return np.asarray(w**-5.0 * np.exp(-1.25 * (peak / w) ** 4))


def _knots(peak: float) -> Array:
    """Knots from negligible density, over the peak with its kink, to a negligible remainder of m2."""
    return np.asarray(peak * np.concatenate([np.linspace(0.2, 2.0, 37), np.geomspace(2.0, 1e6, 100)[1:]]))


def tabulated(frequency: ArrayLike, density: ArrayLike) -> Spectrum:
    """Spectrum linear between the rows of a table: increasing frequencies [Hz] and S [m^2/Hz]."""
    knots, values = 2 * math.pi * np.asarray(frequency), np.asarray(density) / (2 * math.pi)
    return Spectrum(lambda w: np.interp(w, knots, values), knots, float(knots[np.argmax(values)]))


# -- directions ------------------------------------------------------------------------------------------------------


def cos2s_angles(s: float, parts: Array) -> Array:
    """Quantiles of cos^2s(theta/2): angles [rad] from the mean direction."""
    from scipy.special import betaincinv  # 0.1 s of every start

    half = np.arcsin(np.sqrt(betaincinv(0.5, s + 0.5, np.abs(2 * parts - 1))))
    return 2 * np.copysign(half, parts - 0.5)


def tabulated_angles(angles: Array, densities: Array, parts: Array) -> Array:
    """Quantiles of densities on the circle: the angle for one fraction in each row of `densities`.

    angles: increasing, within 360 degrees.  densities (rows, angles): linear between them, periodic.
    """
    around = np.append(angles, angles[0] + 360.0)
    found = []
    for row, part in zip(densities, parts, strict=True):
        row = np.append(row, row[0])
        table = Spectrum(partial(np.interp, xp=around, fp=row), around, 0.0)
        found.append(table.frequencies_at(np.array([part * table.moment(0, -math.inf)]))[0])
    return np.array(found)


# -- records -----------------------------------------------------------------------------------------------------------


def of_record(times: Array, elevation: Array, part: float = 0.999, taper: float = 0.05) -> tuple[Array, Array, Array]:
    """Amplitudes [m], angular frequencies [rad/s] and phases [rad] of a record of the elevation, at equal steps [s].

    The sum a cos(phase - w t) of the largest bins of its Fourier transform that together hold a fraction `part` of the
    variance, after removing the mean, with a cosine taper over `taper` of the length, half of that at each end.  It
    repeats after that length.
    """
    n, step = len(times), (times[-1] - times[0]) / (len(times) - 1)
    X = np.fft.rfft((elevation - np.mean(elevation)) * _tapered(n, taper))[1 : (n + 1) // 2]
    w = 2 * math.pi * np.arange(1, len(X) + 1) / (n * step)
    size = np.abs(X)
    order = np.argsort(-size, kind="stable")
    count = np.searchsorted(np.cumsum(size[order] ** 2), part * np.sum(size**2)) + 1
    kept = np.sort(order[:count])
    return 2 * size[kept] / n, w[kept], np.mod(w[kept] * times[0] - np.angle(X[kept]), 2 * math.pi)


def _tapered(n: int, part: float) -> Array:
    """Taper: 1, with half a cosine over half of `part` at each end."""
    from_end = (np.minimum(np.arange(n), np.arange(n)[::-1]) + 0.5) / max(0.5 * part * n, 0.5)
    return np.asarray(0.5 * (1 - np.cos(math.pi * np.minimum(from_end, 1.0))))
