"""Steady waves of finite height by a Fourier series of the stream function (Rienecker and Fenton 1981).

In the frame of the crests, with mean depth d and theta = k x,

    psi = -c (z + d) + sum B_j sinh(jk(z + d))/cosh(jkd) cos(j theta)

so that the bed is a streamline; on the surface psi = -Q and (u^2 + w^2)/2 + g eta = R hold at N + 1 points of half a
wave.  B_j, eta, k, c, Q and R follow from Newton's method, with the height raised in steps.  The mean velocity of the
water below the troughs is that of the current (Stokes' first definition); c is the wave's speed through this water.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]

#: Fraction of the breaking height, 0.142 tanh(kd) times the length (Miche 1944), up to which the series is used.
STEEPEST = 0.9
#: Largest last harmonic as a fraction of the height; the crest is then accurate to a third of it.
RESOLVED = 1e-3


@dataclass(frozen=True)
class StreamWave:
    """A steady wave: k [1/m], speed in the water [m/s], for harmonics 1 to N the amplitude of the elevation [m] and
    the coefficient B_j of the potential [m^2/s], Q [m^2/s] and R [m^2/s^2]; heights of crest and trough [m]."""

    wavenumber: float
    speed: float
    elevation: Array
    potential: Array
    discharge: float
    bernoulli: float
    crest: float
    trough: float


def breaking_height(k: float, depth: float) -> float:
    """Height [m] at which a wave of this wavenumber breaks (Miche 1944)."""
    return 0.142 * math.tanh(k * depth) * 2 * math.pi / k


def steady_wave(
    height: float, omega: float | None, depth: float, gravity: float, current: float, order: int, k: float
) -> StreamWave:
    """The wave of a height [m] whose crests pass a fixed point with the angular frequency omega [rad/s].

    current: mean speed of the water along the wave [m/s]; k: wavenumber of linear theory as a start [1/m], or without
    omega that of the wave.  Raises InputError above 0.9 of the breaking height, and if `order` is too low.
    """
    length, speed = 1 / k, math.sqrt(gravity / k)  # units: linear waves have k = 1, g = 1
    given = None if omega is None else omega * length / speed
    series = _Series(order, depth / length, given, current / speed)
    wanted = height / length
    count = max(2, math.ceil(10 * height / breaking_height(k, depth)))
    found, before = series.linear(wanted / count), None
    for n in range(1, count + 1):
        start = found if before is None else 2 * found - before
        before = None if n == 1 else found
        solution = series.newton(wanted * n / count, start)
        highest = STEEPEST * breaking_height((found if solution is None else solution)[-4] / length, depth)
        if height > highest and (solution is None or height * n / count > highest):
            raise InputError(
                f"waves.height = {height:g} m: must be at most {highest:.3g} m with theory = 'stream', {STEEPEST} of "
                f"the height at which a wave of {_size(omega, k)} breaks in {depth:g} m of water."
            )
        if solution is None:
            raise InputError(
                f"waves.order = {order}: no wave of {height:g} m is found with so many harmonics; 12 to 20 serve in "
                "deep water, up to 64 are needed by long steep waves in shallow water."
            )
        found = solution
    eta, B, (k_found, c, q, R) = found[: order + 1], found[order + 1 : -4], found[-4:]
    harmonics = 2 / order * (series.cosines[:, 1:].T * series.trapezoid) @ eta
    harmonics[-1] /= 2
    if abs(harmonics[-1]) > RESOLVED * wanted:
        last = abs(harmonics[-1]) / wanted
        raise InputError(
            f"waves.order = {order}: too low for this wave; the last harmonic has {last:.2g} of its height, "
            f"{RESOLVED:g} is allowed."
        )
    return StreamWave(
        float(k_found / length),
        float(c * speed),
        harmonics * length,
        B * length * speed,
        float((q + c * depth / length) * length * speed),
        float(R * speed**2),
        float(eta[0] * length),
        float(eta[-1] * length),
    )


def _size(omega: float | None, k: float) -> str:
    return f"{2 * math.pi / k:.4g} m" if omega is None else f"{2 * math.pi / omega:.4g} s"


class _Series:
    """Equations of a wave in units of linear theory; unknown (eta_0 ... eta_N, B_1 ... B_N, k, c, Q - c d, R)."""

    def __init__(self, order: int, depth: float, omega: float | None, current: float):
        self.order, self.depth, self.omega, self.current = order, depth, omega, current
        angles = np.pi / order * np.outer(np.arange(order + 1), np.arange(order + 1))  # (points, harmonics from 0)
        self.cosines, self.sines = np.cos(angles), np.sin(angles)
        self.trapezoid = np.ones(order + 1)
        self.trapezoid[[0, -1]] = 0.5
        self.j = np.arange(1, order + 1)

    def linear(self, height: float) -> Array:
        """Unknowns of linear theory."""
        found = np.zeros(2 * self.order + 5)
        c = math.sqrt(math.tanh(self.depth)) if self.omega is None else self.omega - self.current
        found[: self.order + 1] = height / 2 * self.cosines[:, 1]
        found[self.order + 1] = height / 2 * c / math.tanh(self.depth)
        found[-4:] = 1.0, c, 0.0, c**2 / 2
        return found

    def newton(self, height: float, start: Array) -> Array | None:
        """Unknowns for a height; None if not converged."""
        x = start.copy()
        with np.errstate(all="ignore"):
            for _ in range(20):
                residual, jacobian = self.equations(height, x)
                if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
                    return None
                try:
                    change = np.linalg.solve(jacobian, residual)
                except np.linalg.LinAlgError:
                    return None
                x -= change
                shape = np.delete(change, slice(self.order + 1, -4))  # high B_j are lost in rounding, without effect
                if np.max(np.abs(shape)) < 1e-9 * max(1.0, abs(x[-3])):  # twice as many digits are already correct
                    falls = np.all(np.diff(x[: self.order + 1]) < 0)  # monotonic from crest to trough
                    return x if falls and x[-4] > 0 and x[-3] > 0 else None
        return None

    def equations(self, height: float, x: Array) -> tuple[Array, Array]:
        """Residual and its derivative by the unknowns."""
        n, j, d = self.order + 1, self.j, self.depth
        eta, B, (k, c, q, R) = x[:n], x[n:-4], x[-4:]
        cosine, sine = self.cosines[:, 1:], self.sines[:, 1:]
        up = np.exp(np.outer(eta, j * k))
        bottom = np.exp(-2 * j * k * d)
        S, C = ((up + sign * bottom / up) / (1 + bottom) for sign in (-1, 1))
        far = j * d * 4 * bottom / (1 + bottom) ** 2  # contribution of the depth to derivatives by k
        z = np.outer(eta, j)
        S_k, C_k = z * C + far * (up + 1 / up) / 2, z * S + far * (up - 1 / up) / 2
        jk = j * k
        u = -c + cosine * C @ (jk * B)
        w = sine * S @ (jk * B)
        passing = k - 1 if self.omega is None else k * (c + self.current) - self.omega
        residual = np.concatenate(
            [
                -c * eta + cosine * S @ B + q,
                0.5 * (u**2 + w**2) + eta - R,
                [eta[0] - eta[-1] - height, self.trapezoid @ eta / self.order, passing],
            ]
        )
        J, at = np.zeros((len(x), len(x))), np.arange(n)
        J[at, at] = u
        J[:n, n:-4] = cosine * S
        J[:n, -4], J[:n, -3], J[:n, -2] = cosine * S_k @ B, -eta, 1.0
        J[n + at, at] = u * (cosine * S @ (jk**2 * B)) + w * (sine * C @ (jk**2 * B)) + 1
        J[n : 2 * n, n:-4] = jk * (u[:, None] * cosine * C + w[:, None] * sine * S)
        J[n : 2 * n, -4] = u * (cosine * (C + k * C_k) @ (j * B)) + w * (sine * (S + k * S_k) @ (j * B))
        J[n : 2 * n, -3], J[n : 2 * n, -1] = -u, -1.0
        J[-3, 0], J[-3, n - 1] = 1.0, -1.0
        J[-2, :n] = self.trapezoid / self.order
        J[-1, -4], J[-1, -3] = (1, 0) if self.omega is None else (c + self.current, k)
        return residual, J
