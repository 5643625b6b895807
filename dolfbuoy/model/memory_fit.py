"""State-space model of radiation memory: F(t) = -int K(t - s) v(s) ds with K(t) = sum_k out_k into_k exp(rate_k t).

K(t) = 2/pi int B(w) cos(w t) dw.  The eigensystem realisation algorithm (Juang and Pappa 1985) obtains the states from
a singular value decomposition of its Hankel matrix.  Their rates and outputs are then fitted to K(iw) with K(0) = 0: no
force at constant speed.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import Array

#: Acceptable error of K(iw), relative to the largest K, and the highest order tried.
ENOUGH, HIGHEST = 0.01, 14
#: Tolerated negative damping of the fit relative to the largest damping, by default and for a prescribed order.
GIVEN_BACK, AT_MOST = 1e-3, 0.01
#: Multiple of `ENOUGH` above which the rates of an order are not polished.
PROMISING = 6.0
#: Sampling of K: largest number of instants, instants per shortest period, and length in periods of largest damping.
MOST, PER_PERIOD, PERIODS = 201, 3.0, 12.0
#: Least relative damping used to scale a motion: a motion that hardly radiates has only rounding errors.
LEAST = 1e-2
#: Rounds of correction of negative damping, and the weight of an equation that corrects it.
ROUNDS, FIRM = 12, 100.0
#: Largest number of evaluations for polishing the rates.
POLISHING = 15
#: Multiple of the highest frequency up to which the tail of B is continued.
TAIL = 4.0


@dataclass(frozen=True)
class States:
    """Modes: rate (n,) [1/s], into (n, m), out (m, n), complex; of each conjugate pair only the upper one, doubled.

    order: number of real states.  error: largest error of K(iw) relative to the largest K.  given_back: most negative
    damping over the largest.  inconsistent: relative distance of K(iw) from B + i w (A - A_inf) of the file.
    """

    rate: Array
    into: Array
    out: Array
    order: int
    error: float
    given_back: float
    inconsistent: float

    def at(self, omega: Array | complex) -> Array:
        """K(iw) (..., m, m); omega may be complex."""
        return np.asarray(
            np.einsum("ik,...kj->...ij", self.out, 0.5 * _responses(self.rate, self.into, omega))
            + (
                np.einsum(
                    "ik,...kj->...ij", self.out.conj(), 0.5 * _responses(self.rate.conj(), self.into.conj(), omega)
                )
            )
        )


def _responses(rate: Array, into: Array, omega: Array | complex) -> Array:
    """into/(iw - rate) (..., n, m)."""
    return np.asarray(into / (1j * np.asarray(omega)[..., None] - rate)[..., None])


class Kernel:
    """Memory kernel corresponding to a damping over frequency.

    omega: increasing (n,).  B: damping, A: added mass less that at infinite frequency, (n, m, m).  All are scaled so
    that the largest damping of each motion is 1 (`scale`, (m,): their square roots).
    """

    def __init__(self, omega: Array, B: Array, A: Array) -> None:
        from scipy.interpolate import CubicSpline

        largest = np.diagonal(B, axis1=1, axis2=2).max(axis=0)
        self.scale = np.sqrt(np.maximum(largest, LEAST * largest.max()))
        self.omega, pair = omega, np.outer(self.scale, self.scale)
        self.B, self.A = _positive(B / pair), A / pair
        trace = np.trace(self.B, axis1=1, axis2=2)
        self.peak = omega[int(trace.argmax())]
        last = slice(-max(3, len(omega) // 10), None)
        slope = np.polyfit(np.log(omega[last]), np.log(np.maximum(trace[last], 1e-12)), 1)[0]
        self.fall = max(2.0, -float(slope))  #: B ~ w^-fall beyond the highest frequency
        zero = np.zeros(self.B.shape[1:])
        ends: Any = ((1, zero), "not-a-knot")
        self._spline = CubicSpline(np.append(0.0, omega), np.concatenate([zero[None], self.B]), bc_type=ends)

    def damping(self, omega: Array) -> Array:
        """B at frequencies >= 0, (..., m, m)."""
        top = self.omega[-1]
        inside, beyond = np.minimum(omega, top), (top / np.maximum(omega, top)) ** self.fall
        return np.asarray(self._spline(inside) * beyond[..., None, None])

    def over_time(self, t: Array) -> Array:
        """K(t) (times, m, m)."""
        top = TAIL * self.omega[-1]
        w = np.linspace(0.0, top, max(2000, int(8 * top * t[-1] / (2 * np.pi))))
        B = self.damping(w) * (2 / np.pi * w[1])
        B[[0, -1]] *= 0.5
        found = np.zeros((len(t), *B.shape[1:]))
        for part in np.array_split(np.arange(len(w)), max(1, len(w) * len(t) // 2_000_000)):
            found += np.tensordot(np.cos(np.outer(t, w[part])), B[part], axes=1)
        return found

    def transformed(self, omega: Array) -> Array:
        """K(iw) = int K exp(-i w t) dt at frequencies, with real part B."""
        step = 0.1 * np.pi / max(self.omega[-1], omega[-1])
        t = np.arange(0.0, PERIODS * 2 * np.pi / self.peak, step)
        K = self.over_time(t)
        sines = np.tensordot(np.sin(np.outer(omega, t)), step * K, axes=1)
        sines += step**2 / 12 * omega[:, None, None] * K[0]  # Euler and Maclaurin
        return np.asarray(self.damping(omega) - 1j * sines)


def _positive(B: Array) -> Array:
    """The nearest positive semidefinite symmetric matrices."""
    values, vectors = np.linalg.eigh(B)
    return np.asarray(vectors * np.maximum(values, 0.0)[:, None, :] @ vectors.swapaxes(1, 2))


def fitted(omega: Array, B: Array, A: Array, order: int | None = None) -> States:
    """States for a damping B and an added mass A less that at infinite frequency, (n, m, m) over omega (n,).

    order: number of real states; None: the lowest with an error of at most `ENOUGH` that is passive, or else the best
    of all.  Raises ValueError if no states are stable.
    """
    kernel = Kernel(omega, B, A)
    sampled, target = _sampled(kernel), kernel.transformed(omega)
    found: list[States] = []
    for n in range(2, HIGHEST + 1) if order is None else [order]:
        found += _fit(kernel, sampled, target, n, order is None)
        good = [one for one in found if one.error <= ENOUGH and one.given_back <= GIVEN_BACK]
        if good and order is None:
            return good[-1]
    if not found:
        raise ValueError("no stable states were found for the damping")
    return min(found, key=lambda one: (one.given_back > AT_MOST, one.error))


def _sampled(kernel: Kernel) -> tuple[Array, float]:
    """K at equal time steps, and the step [s]."""
    step = 2 * np.pi / kernel.omega[-1] / PER_PERIOD
    count = min(int(PERIODS * 2 * np.pi / kernel.peak / step) | 1, MOST)
    return kernel.over_time(step * np.arange(count)), step


def _fit(kernel: Kernel, sampled: tuple[Array, float], target: Array, order: int, passive: bool) -> list[States]:
    """States of an order, as realised, and with polished rates if promising; empty if unstable."""
    rate, into = _realised(*sampled, order)
    if np.any(rate.real >= 0):
        return []
    once = rate.imag >= -1e-9 * np.abs(rate)
    rate, into = rate[once], into[once]
    real = np.abs(rate.imag) <= 1e-9 * np.abs(rate)
    rate[real], into[real] = rate[real].real, into[real].real
    first = _judged(kernel, target, order, rate, into, passive)
    if passive and first.error > PROMISING * ENOUGH:
        return [first]
    polished = _polished(kernel, target, rate, into)
    return [first, *(_judged(kernel, target, order, polished, into, own) for own in {passive, True})]


def _judged(kernel: Kernel, target: Array, order: int, rate: Array, into: Array, passive: bool) -> States:
    out = _outputs(kernel.omega, target, rate, into, passive)
    found, largest = States(rate, into, out, order, 0.0, 0.0, 0.0), np.abs(target).max()
    wide = found.at(np.linspace(0.0, 3 * kernel.omega[-1], 1500))
    damping = np.linalg.eigvalsh((wide + wide.conj().swapaxes(-1, -2)) / 2)
    file = kernel.B + 1j * kernel.omega[:, None, None] * kernel.A
    errors = (np.abs(x - target).max() / largest for x in (found.at(kernel.omega), file))
    error, inconsistent = (float(x) for x in errors)
    given_back = max(0.0, -float(damping.min()))
    return States(rate, into * kernel.scale, out * kernel.scale[:, None], order, error, given_back, inconsistent)


def _polished(kernel: Kernel, target: Array, rate: Array, into: Array) -> Array:
    """Rates that minimise the error of K(iw) with optimal outputs (variable projection)."""
    from scipy.optimize import least_squares

    turns = rate.imag > 0

    def rates(x: Array) -> Array:
        found = -np.exp(x[: len(rate)]) + 0j
        found[turns] += 1j * np.exp(x[len(rate) :])
        return np.asarray(found)

    def left(x: Array) -> Array:
        out = _outputs(kernel.omega, target, rates(x), into)
        apart = States(rates(x), into, out, 0, 0.0, 0.0, 0.0).at(kernel.omega) - target
        return np.concatenate([apart.real.ravel(), apart.imag.ravel()])

    start = np.log(np.concatenate([-rate.real, rate.imag[turns]]))
    return rates(least_squares(left, start, max_nfev=POLISHING, ftol=1e-3, xtol=1e-3).x)


def _realised(K: Array, step: float, order: int) -> tuple[Array, Array]:
    """Rates and inputs of the modes, from the Hankel matrix of K at equal time steps."""
    half, m = (len(K) - 1) // 2, K.shape[1]
    places = np.arange(half)[:, None] + np.arange(half)
    now, then = (K[places + k].transpose(0, 2, 1, 3).reshape(half * m, half * m) for k in (0, 1))
    U, s, V = np.linalg.svd(now)
    root = np.sqrt(s[:order])
    turn = (U[:, :order] / root).T @ then @ (V[:order].T / root)
    factors, modes = np.linalg.eig(turn)
    return np.log(factors.astype(complex)) / step, np.linalg.solve(modes, (root[:, None] * V[:order])[:, :m])


def _basis(rate: Array, into: Array, omega: Array) -> Array:
    """K(iw) (frequencies, unknowns, m) for unit real and, for complex modes, imaginary parts of a row of outputs."""
    up, down = _responses(rate, into, omega), _responses(rate.conj(), into.conj(), omega)
    return np.concatenate([(up + down) / 2, (1j * (up - down) / 2)[:, rate.imag != 0]], axis=1)


def _outputs(omega: Array, target: Array, rate: Array, into: Array, passive: bool = False) -> Array:
    """Outputs of the modes by least squares of K(iw) with K(0) = 0; real for real modes.

    passive: require non-negative damping.
    """
    m, basis = into.shape[1], _basis(rate, into, np.append(0.0, omega))
    rows = basis.transpose(0, 2, 1).reshape(-1, basis.shape[1])
    sides = np.concatenate([np.zeros((1, m, m)), target]).transpose(0, 2, 1).reshape(-1, m)
    weights = np.ones(len(rows))
    weights[:m] = 1e4  # holds K(0) = 0 to rounding
    rows, sides = (np.concatenate([x.real, x.imag]) for x in (rows * weights[:, None], sides * weights[:, None]))
    x = np.linalg.lstsq(rows, sides, rcond=None)[0].T
    if passive:
        x = _passive(x, rows, sides, _basis(rate, into, np.linspace(0.0, 3 * omega[-1], 1000)))
    n, turns = len(rate), rate.imag != 0
    out = x[:, :n].astype(complex)
    out[:, turns] += 1j * x[:, n:]
    return np.asarray(out)


def _passive(x: Array, rows: Array, sides: Array, shown: Array) -> Array:
    """Least-squares solution x (m, q) of rows x = sides, with further equations v . K v = 0 where the damping of
    K = x . shown (frequencies, q, m) has a negative minimum, in the direction v."""
    m = len(x)
    whole, right = np.kron(np.eye(m), rows), sides.T.ravel()
    for _ in range(ROUNDS):
        K = np.einsum("iq,wqj->wij", x, shown)
        values, vectors = np.linalg.eigh((K + K.conj().swapaxes(1, 2)) / 2)
        least = values[:, 0]
        low = (least < np.roll(least, 1)) & (least <= np.roll(least, -1)) & (least < -1e-6)
        if not low.any():
            break
        v = vectors[low][:, :, 0]
        more = np.einsum("wi,wqj,wj->wiq", v.conj(), shown[low], v).real.reshape(len(v), -1)
        whole, right = np.concatenate([whole, FIRM * more]), np.append(right, np.zeros(len(v)))
        x = np.linalg.lstsq(whole, right, rcond=None)[0].reshape(m, -1)
    return np.asarray(x)
