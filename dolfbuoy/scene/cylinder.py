"""Added mass and radiation damping of an upright floating cylinder, by linear potential flow.

The water is split at r = a into the disk below the flat bottom, of height d, and the exterior, of depth h.  In each,
the potential of a motion of unit velocity is a sum of products that satisfy the conditions at bed, bottom and surface,

    r < a:  phi_p + sum C_n V_n(r) cos(n pi z/d),      r > a:  sum A_q R_q(r) Z_q(z),

times cos(m theta), m = 0 in heave and 1 in surge and pitch; z upwards from the bed.  Z_0 is the wave mode, the others
are evanescent.  Potential and radial velocity are continuous at r = a (Yeung, *Added mass and damping of a vertical
cylinder in finite-depth waters*, Applied Ocean Research 3, 1981).  The sums converge slowly because of the sharp edge:
the remainder is extrapolated from the contribution of the second half of the functions.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..roots import brentq

Array = NDArray[np.float64]
Motion = Literal["heave", "surge", "pitch"]

#: Number of functions of the height in the exterior.
TERMS = 160
#: Order of convergence of the sums in the number of functions.
ORDER = 5 / 3


class Cylinder(NamedTuple):
    """An upright cylinder in water of a depth that turns about a point `center` below (< 0) the surface [m]."""

    radius: float
    draft: float
    depth: float
    center: float = 0.0

    def radiation(self, motion: Motion, omega: float, gravity: float, terms: int = TERMS) -> tuple[float, float]:
        """(added mass, damping) at angular frequency omega, per water density: heave and surge [m^3, m^3/s], pitch
        [m^5, m^5/s]."""
        fine, coarse = (_Sums(self, motion, omega, gravity, count).inertia() for count in (terms, terms // 2))
        best = fine + (fine - coarse) / (2**ORDER - 1)
        return float(best.real), float(omega * best.imag)


def wave_numbers(omega: float, depth: float, gravity: float, count: int) -> tuple[float, Array]:
    """k, and `count` numbers m: omega^2 = g k tanh kh = -g m tan mh [1/m]."""
    nu = omega**2 / gravity
    k = brentq(lambda k: k * np.tanh(k * depth) - nu, 0.0, 2 * max(nu, (nu / depth) ** 0.5), xtol=1e-15)
    n = np.arange(1, count + 1)
    low, up = (n - 0.5) * np.pi / depth, n * np.pi / depth
    for _ in range(60):
        m = 0.5 * (low + up)
        early = m * np.tan(m * depth) < -nu
        low, up = np.where(early, m, low), np.where(early, up, m)
    return k, m


class _Sums:
    """The equations for the factors A, with `count` exterior functions besides the wave mode."""

    def __init__(self, body: Cylinder, motion: Motion, omega: float, gravity: float, count: int):
        self.a, self.h = body.radius, body.depth
        self.d = self.h - body.draft
        self.motion, self.center = motion, self.h + body.center
        self.m = 0 if motion == "heave" else 1
        self.k, self.q = wave_numbers(omega, self.h, gravity, count)
        self.n = np.arange(max(round(count * self.d / self.h), 8))
        self.lam = self.n * np.pi / self.d
        self.eps = np.where(self.n == 0, 1.0, 0.5)
        kh = self.k * self.h
        self.size = np.concatenate(
            [[0.5 + np.sinh(2 * kh) / (4 * kh)], 0.5 + np.sin(2 * self.q * self.h) / (4 * self.q * self.h)]
        )

    def _outside(self, wave: float, others: Array) -> Array:
        """Values for all Z from those for cosh kz and cos mz."""
        found: Array = np.concatenate([[wave], others]) / np.sqrt(self.size)
        return found

    def _moment(self, z: float, power: int, about: float = 0.0) -> Array:
        """Antiderivatives of (z - about)^power Z at z."""
        x, (s, c), (sh, ch) = z - about, self._trig(z), (np.sinh(self.k * z), np.cosh(self.k * z))
        k, q = self.k, self.q
        if power == 0:
            return self._outside(sh / k, s / q)
        if power == 1:
            return self._outside(x * sh / k - ch / k**2, x * s / q + c / q**2)
        wave = x**2 * sh / k - 2 * x * ch / k**2 + 2 * sh / k**3
        return self._outside(wave, x**2 * s / q + 2 * x * c / q**2 - 2 * s / q**3)

    def _trig(self, z: float) -> tuple[Array, Array]:
        return np.sin(self.q * z), np.cos(self.q * z)

    def _projections(self) -> Array:
        """E: means over 0 < z < d of cos(n pi z/d) Z_q."""
        d, lam, sign = self.d, self.lam[:, None], np.where(self.n % 2, -1.0, 1.0)
        wave = sign * self.k * np.sinh(self.k * d) / (d * (self.k**2 + self.lam**2))
        others = 0.5 * (np.sinc((self.q - lam) * d / np.pi) + np.sinc((self.q + lam) * d / np.pi))
        found: Array = np.column_stack([wave, others]) / np.sqrt(self.size)
        return found

    def _slopes(self) -> tuple[NDArray[np.complex128], Array]:
        """R'(a) and V'(a)."""
        from scipy.special import h1vp, hankel1, ive, kve

        m, ka, ma, la = self.m, self.k * self.a, self.q * self.a, self.lam[1:] * self.a
        out = -self.q * (kve(abs(m - 1), ma) + kve(m + 1, ma)) / (2 * kve(m, ma))
        inside = self.lam[1:] * (ive(abs(m - 1), la) + ive(m + 1, la)) / (2 * ive(m, la))
        return np.append(self.k * h1vp(m, ka) / hankel1(m, ka), out), np.append(m / self.a, inside)

    def _particular(self, E: Array) -> tuple[Array, Array]:
        """Means of phi_p cos(n pi z/d) at r = a, and integrals of its radial derivative times Z."""
        a, d, n = self.a, self.d, self.n
        means = np.where(n % 2, -1.0, 1.0) / (d * np.where(n, self.lam, 1.0) ** 2)
        if self.motion == "surge":
            return np.zeros(len(n)), np.zeros(E.shape[1])
        if self.motion == "heave":
            means[0] = (d**2 / 3 - a**2 / 2) / (2 * d)
            return means, -a / 2 * E[0]
        means[0] = (d**2 / 3 - a**2 / 4) / (2 * d)
        squares = self._moment(d, 2) - self._moment(0.0, 2)
        return -a * means, -(squares - 0.75 * a**2 * d * E[0]) / (2 * d)

    def _side(self) -> Array:
        """Integrals over the side of normal velocity times Z."""
        if self.motion == "heave":
            return np.zeros(len(self.size))
        about, power = (self.center, 1) if self.motion == "pitch" else (0.0, 0)
        return self._moment(self.h, power, about) - self._moment(self.d, power, about)

    def _bottom(self) -> tuple[float, Array]:
        """Integrals over the bottom of potential times velocity: for phi_p, and for V_n cos(n pi)."""
        from scipy.special import ive

        a, d, la, m = self.a, self.d, self.lam[1:] * self.a, self.m
        sign = np.where(self.n % 2, -1.0, 1.0)
        inside = a ** (m + 1) * ive(m + 1, la) / (self.lam[1:] * ive(m, la))
        if m == 0:
            return 2 * np.pi * (d**2 * a**2 / 2 - a**4 / 8) / (2 * d), 2 * np.pi * sign * np.append(a**2 / 2, inside)
        return np.pi * (d**2 * a**4 / 4 - a**6 / 24) / (2 * d), -np.pi * sign * np.append(a**3 / 4, inside)

    def inertia(self) -> complex:
        """Added mass + i damping/omega, per density."""
        E, (out, inside), side = self._projections(), self._slopes(), self._side()
        means, slopes = self._particular(E)
        weights = self.d * inside / self.eps
        left = np.diag(self.h * out) - (E.T * weights) @ E
        A = np.linalg.solve(left, slopes + side - E.T @ (weights * means))
        found = -np.pi * self.a * (side @ A) if self.m else 0.0
        if self.motion != "surge":
            of_particular, of_sum = self._bottom()
            found += of_particular + of_sum @ ((E @ A - means) / self.eps)
        return complex(found)
