"""Closed form of a uniform elastic cable hanging under its own weight: initial guess for Newton, reference in tests.

In the vertical plane through its ends, with w [N/m] the weight per unstretched length, H the horizontal and
V = V0 + w s the vertical part of the tension (Irvine, *Cable Structures*, 1981):

    x(s) = H s/EA + H/w (asinh(V/H) - asinh(V0/H)),   z(s) = (V0 s + w s^2/2)/EA + (|(H,V)| - |(H,V0)|)/w.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..roots import brentq

Array = NDArray[Any]  #: of numbers


@dataclass(frozen=True)
class Catenary:
    """Solution from `start` along the horizontal unit vector `along`; all methods take arrays of s."""

    start: Array
    along: Array
    w: float
    EA: float
    H: float
    V0: float

    length_on_bed = 0.0  # hangs free; see on_bed

    def vertical(self, s: ArrayLike) -> Array:
        """V(s) [N]."""
        return self.V0 + self.w * np.asarray(s, float)

    def tension(self, s: ArrayLike) -> Any:
        """T(s) [N]."""
        return np.hypot(self.H, self.vertical(s))

    def force(self, s: ArrayLike) -> Any:
        """Tension as a vector along the line, shape (n, 3) [N]."""
        return self.H * self.along + np.multiply.outer(self.vertical(s), [0.0, 0.0, 1.0])

    def plane(self, s: ArrayLike) -> tuple[Any, Any]:
        """(x, z) in the plane, from the start [m]."""
        s = np.asarray(s, float)
        H, V0, V, w, EA = self.H, self.V0, self.vertical(s), self.w, self.EA
        if w == 0:
            T = np.hypot(H, V0)
            stretch = 1 + T / EA
            return s * stretch * (H / T if T else 1.0), s * stretch * (V0 / T if T else 0.0)
        x = H * s / EA + (H / w * (np.arcsinh(V / H) - np.arcsinh(V0 / H)) if H > 0 else 0.0)
        return x, (V0 * s + w * s**2 / 2) / EA + (np.hypot(H, V) - np.hypot(H, V0)) / w

    def position(self, s: ArrayLike) -> Any:
        """r(s), shape (n, 3) [m]."""
        x, z = self.plane(s)
        return self.start + np.multiply.outer(x, self.along) + np.multiply.outer(z, [0.0, 0.0, 1.0])


def between(start: ArrayLike, end: ArrayLike, L: float, w: float, EA: float) -> Catenary:
    """Cable between two points.

    If the ends are one above the other, a horizontal distance of L/10^4 is assumed, so that a fold has a radius.
    Raises ValueError for an inextensible cable shorter than the distance.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    chord = end - start
    dx, dz = float(np.hypot(chord[0], chord[1])), float(chord[2])
    along = np.array([chord[0] / dx, chord[1] / dx, 0.0]) if dx > 0 else np.array([1.0, 0.0, 0.0])
    distance = float(np.hypot(dx, dz))
    if np.isinf(EA) and distance >= L:
        raise ValueError(f"an inextensible cable of {L} m cannot span {distance} m")
    if w == 0:
        T = EA * max(distance / L - 1, 0.0) if np.isfinite(EA) else 0.0
        return Catenary(start, along, w, EA, T * dx / distance, T * dz / distance)
    dx = max(dx, 1e-4 * L)
    sign = np.sign(w)
    H, V0 = _solve(dx, sign * dz, L, abs(w), EA)
    return Catenary(start, along, w, EA, H, sign * V0)


def _solve(dx: float, dz: float, L: float, w: float, EA: float) -> tuple[float, float]:
    """(H, V0) of the cable with w > 0 and an end at (dx, dz), dx > 0."""
    if np.isinf(EA):
        return _solve_inextensible(dx, dz, L, w)

    def V0_of(H: float) -> float:
        def height(V0: float) -> float:
            V = V0 + w * L
            return float((V0 * L + w * L**2 / 2) / EA + (np.hypot(H, V) - np.hypot(H, V0)) / w - dz)

        span = 2 * w * L + H
        while height(-span) > 0 or height(span) < 0:
            span *= 4
        return brentq(height, -span, span, xtol=1e-14 * span, rtol=1e-15)

    def excess(log_H: float) -> float:
        H = np.exp(log_H)
        V0 = V0_of(H)
        return float(H * L / EA + H / w * (np.arcsinh((V0 + w * L) / H) - np.arcsinh(V0 / H)) - dx)

    low = high = np.log(w * L)
    while excess(low) > 0:
        low -= 2
    while excess(high) < 0:
        high += 2
    H = float(np.exp(brentq(excess, low, high, xtol=1e-15, rtol=1e-15))) if high > low else float(np.exp(low))
    return H, V0_of(H)


def _solve_inextensible(dx: float, dz: float, L: float, w: float) -> tuple[float, float]:
    """With u = w dx/(2 H): sinh(u)/u = sqrt(L^2 - dz^2)/dx, and asinh(V/H) = atanh(dz/L) -+ u at the ends."""
    ratio = np.sqrt((L - dz) * (L + dz)) / dx
    if ratio <= 1 + 1e-14:
        u = 1e-7
    else:
        target = np.log(ratio)
        u = brentq(
            lambda u: u + np.log(-np.expm1(-2 * u) / (2 * u)) - target, 1e-9, 2 * target + 10, xtol=1e-15, rtol=1e-15
        )
    H = w * dx / (2 * u)
    return H, H * np.sinh(np.arctanh(dz / L) - u)
