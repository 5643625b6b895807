"""Time schemes: the rate of a quantity at t_(n+1), affine in its unknown value there.

    y_t = gamma y + history

Velocity and acceleration of the cable follow from the same rule applied twice, v = gamma r + h_r and
a = gamma v + h_v = gamma^2 r + gamma h_r + h_v, so that v is eliminated and one compiled form serves every scheme.
Constraints hold at t_(n+1).  The problem is a differential-algebraic system of index 3: its tension involves second
derivatives, so starts and changes of step need care.
"""

from math import comb
from operator import index
from typing import ClassVar, NamedTuple

import numpy as np

from ..solver.vector_ops import copies, extrapolation

#: Rows of a Series: values at t_n, t_(n-1) ..., newest first; the rate at t_n, and at t_(n-1); the second derivative at
#: the start; an auxiliary rate; value and rate at t_(n+1); the history of its rate; work space.
HELD = 5
RATE, PREVIOUS_RATE, SECOND, AUXILIARY, NEW, NEW_RATE, HISTORY, CHANGE = range(HELD, HELD + 8)
KEPT = NEW  # rows kept from step to step


class Sum(NamedTuple):
    """A linear combination of rows of a Series: the sum of weight x row, over a divisor."""

    terms: tuple[tuple[float, int], ...]
    over: float = 1.0


class _Row:
    """Attribute of a Series that is one of its rows; assignment copies."""

    def __init__(self, place):
        self._place = place

    def __get__(self, series, owner=None):
        return series.rows[self._place]

    def __set__(self, series, value):
        series.rows[self._place][:] = value


class Series:
    """Past values of one array-valued quantity at equal steps, newest first.

    lagged: mask (or bool) of the components that are themselves rates computed by the scheme (velocities, momenta).
    Their values contain the scheme's error, which depends on the step; `resample` converts them to another step.
    new: array for the value at t_(n+1), if not a row of its own.  The rows have fixed addresses.
    """

    rate, previous_rate = _Row(RATE), _Row(PREVIOUS_RATE)
    second = _Row(SECOND)  # of y at the start, if known
    auxiliary = _Row(AUXILIARY)
    new, new_rate, history = _Row(NEW), _Row(NEW_RATE), _Row(HISTORY)

    def __init__(self, value, rate, lagged=False, new=None):
        self.rows = list(np.zeros((CHANGE + 1, len(value))))
        if new is not None:
            self.rows[NEW] = new
        self.values, self.rate, self.previous_rate, self.lagged = [value], rate, rate, lagged
        self.averaging, self.step = False, None  # averaging: there is an auxiliary rate
        self.steps_since_start = 0

    @property
    def values(self):
        """Views of the available values."""
        return self.rows[: self.count]

    @values.setter
    def values(self, values):
        self.count = len(values)
        for row, value in zip(self.rows, np.array(values), strict=False):
            row[:] = value

    def count_step(self, keep):
        """Count a step taken."""
        self.steps_since_start += 1
        if self.count < keep:
            self.count += 1

    def state(self):
        """Data kept from step to step; the rows are views."""
        known = {name: getattr(self, name) for name in ("count", "averaging", "step", "steps_since_start")}
        return known | {"rows": self.rows[:KEPT]}

    def restore(self, state):
        """Restore that state."""
        for row, value in zip(self.rows, state["rows"], strict=False):
            row[:] = value
        self.count, self.averaging, self.step = index(state["count"]), bool(state["averaging"]), state.get("step")
        self.steps_since_start = index(state["steps_since_start"])
        if not 1 <= self.count <= HELD or self.steps_since_start < 0:
            raise ValueError("no number of past values")

    def forget(self):
        """Drop the past values and restart from the present value and rate.

        An auxiliary rate is kept: a restart would have it less accurately, and generalized-alpha would ring.
        """
        self.values, self.steps_since_start = self.values[:1], 0
        if not self.averaging:
            self.previous_rate, self.second, self.step = self.rate, 0.0, None

    def extrapolated(self, order):
        """Value extrapolated by one step with a polynomial of this order; None if the past is too short."""
        if self.steps_since_start < order or len(self.values) <= order:
            return None
        weights = [(-1) ** j * comb(order + 1, j + 1) for j in range(order + 1)]
        return sum(w * y for w, y in zip(weights, self.values, strict=False))

    def extrapolated_past(self, step, count):
        """Extend the past to `count` values before the start from value, rate and second derivative there."""
        for t in (-j * step for j in range(len(self.values), count)):
            self.values = [*self.values, self.values[0] + t * self.rate + 0.5 * t**2 * self.second]

    def resample(self, step, order, lag):
        """Interpolate the values to another step with the polynomial through them; a longer step leaves fewer.

        Values of lagged components are y - lag step^order y^(order) for a smooth y; this term is converted too.
        Otherwise a change from h0 to h1 causes an error of (h0 + h1)/(2 h1) in the next tension of backward Euler.
        """
        h0, h1, m = self.step, step, len(self.values)
        change = lag * (h0**order - h1**order)
        if m <= order:  # too few values for the derivative: use the rate
            shift = change * self.rate if order == 1 else 0.0
            shift = np.where(self.lagged, shift, 0.0)
            self.values = [y - j * (h1 - h0) * self.rate + shift for j, y in enumerate(self.values)]
            return
        nodes, low, high = -np.arange(m, dtype=float), *self._limits(order)
        coefficients = np.linalg.solve(np.vander(nodes, increasing=True), np.array(self.values))
        powers = np.arange(m)
        factor = np.array([np.prod(np.arange(p - order + 1, p + 1)) if p >= order else 0.0 for p in powers])
        values = []
        for x in (x for x in nodes * h1 / h0 if x >= nodes[-1] - 1e-9):  # never beyond the oldest value
            value = x**powers @ coefficients
            derivative = np.clip((factor * x ** np.maximum(powers - order, 0)) @ coefficients, low, high) / h0**order
            values.append(value + np.where(self.lagged, change * derivative, 0.0))
        self.values = values
        if m > 1:
            self.second = (self.rate - self.previous_rate) / h0  # to extend a past that has become too short

    def _limits(self, order):
        """Bounds of h^order y^(order): if the past is not smooth, as after an impact, twice the differences of that
        order, or 0 if these have different signs.

        With noise a polynomial's derivative is 25 times as large, and the velocities to which it is added would grow
        with every change of step.
        """
        found = (-1) ** order * np.diff(np.array(self.values), order, axis=0)
        low, high = found.min(axis=0), found.max(axis=0)
        rough = np.abs(np.diff(found, len(found) - 1, axis=0)[0]) > 0.5 * np.maximum(-low, high)
        if len(found) == 1:
            rough[:] = False
        bounds = np.where(high < 0, 2 * low, 0.0), np.where(low > 0, 2 * high, 0.0)
        return np.where(rough, bounds[0], -np.inf), np.where(rough, bounds[1], np.inf)


def same_step(h0, h1) -> bool:
    """True if two steps differ only by the rounding of t."""
    return abs(h1 - h0) <= 1e-9 * h1


class Scheme:
    """A rule for rates.

    order: of accuracy; keep: past values held; lag: leading error of a rate, y_t - lag h^order y^(order+1);
    error_constant: local error relative to h^(order+1) y^(order+1).
    """

    name: str
    order: int
    keep: int
    lag: float
    error_constant: float
    #: All schemes by their names in a scene, listed in scene/sections.py.
    known: ClassVar[dict[str, type["Scheme"]]] = {}

    def __init_subclass__(cls):
        Scheme.known[cls.name] = cls

    def __init__(self, spectral_radius: float = 0.8):
        """Initialise; spectral_radius: amplification of the fastest motions, for schemes where it is a parameter."""

    def symbol(self):
        """Polynomials (N, D) in x = 1/zeta, coefficients from x^0 on: y_t = N(x)/(dt D(x)) y for y ~ zeta^n."""
        raise NotImplementedError

    def amplification(self, omega, step):
        """Growth factor per step of the free motion x_tt = -omega^2 x: the root zeta nearest to exp(i omega step)."""
        N, D = (np.array(c, dtype=complex) for c in self.symbol())
        size = max(len(N), len(D))
        equation = np.pad(N, (0, size - len(N))) - 1j * omega * step * np.pad(D, (0, size - len(D)))
        roots = np.roots(equation)  # coefficients from x^0 on are those of zeta^(size-1) downwards
        return roots[np.argmin(abs(roots - np.exp(1j * omega * step)))]

    def begin(self, step, series, base=None):
        """Prepare the series for a step of this size; base: the series it is the rate of, already prepared."""
        if series.step is not None and not same_step(series.step, step):
            series.resample(step, self.order, self.lag)
        series.step = step

    def formula(self, step):
        """(gamma, history as a Sum) of the rate for a step."""
        raise NotImplementedError

    def updates(self, step):
        """[(row, Sum), ...]: further rows updated by an accepted step."""
        return []


class BackwardEuler(Scheme):
    """y_t = (y - y_n)/dt: order 1, L-stable, the scheme of the paper, Eq. (30)."""

    name, order, keep, lag, error_constant = "backward-euler", 1, 3, 0.5, 0.5

    def formula(self, step):
        return 1 / step, Sum(((-1, 0),), over=step)

    def symbol(self):
        return [1, -1], [1]


class BDF2(Scheme):
    """y_t = (3 y - 4 y_n + y_(n-1))/(2 dt): order 2, L-stable."""

    name, order, keep, lag, error_constant = "bdf2", 2, 5, 1 / 3, 2 / 9

    def begin(self, step, series, base=None):
        series.extrapolated_past(step, 2)
        shrinks = series.step is not None and step < series.step and not same_step(series.step, step)
        if shrinks and base is not None and len(base.values) >= 4:
            # Rates recomputed from the resampled positions.  Interpolated old rates would differ from these after a
            # kink by an amount independent of the step.
            r, series.step = [value[: len(series.rate)] for value in base.values], step
            series.values = [(1.5 * a - 2 * b + 0.5 * c) / step for a, b, c in zip(r, r[1:], r[2:], strict=False)]
            return
        super().begin(step, series)
        series.extrapolated_past(step, 2)

    def formula(self, step):
        return 1.5 / step, Sum(((-2, 0), (0.5, 1)), over=step)

    def symbol(self):
        return [1.5, -2, 0.5], [1]


class GeneralizedAlpha(Scheme):
    """Generalized-alpha of first order [Jansen, Whiting, Hulbert 2000], with all equations at t_(n+1).

    An auxiliary rate b carries the averages, so that y_t itself satisfies the equations at t_(n+1) [Arnold, Bruels
    2007]:

        alpha_m b_(n+1) + (1 - alpha_m) b_n = alpha_f y_t,(n+1) + (1 - alpha_f) y_t,n
        y_(n+1) = y_n + dt ((1 - gamma) b_n + gamma b_(n+1)),   gamma = 1/2 + alpha_m - alpha_f.

    `spectral_radius` is the amplification of the fastest motions: 1 keeps them, 0 removes them in a step.  b stands for
    y_t at t_n + (alpha_f - alpha_m) dt.
    """

    name, order, keep, lag, error_constant = "generalized-alpha", 2, 3, 0.0, 1 / 6

    def __init__(self, spectral_radius=0.8):
        self.alpha_m = 0.5 * (3 - spectral_radius) / (1 + spectral_radius)
        self.alpha_f = 1 / (1 + spectral_radius)
        self.gamma = 0.5 + self.alpha_m - self.alpha_f

    def begin(self, step, series, base=None):
        ahead = self.alpha_f - self.alpha_m
        if not series.averaging:
            series.auxiliary, series.averaging = series.rate + ahead * step * series.second, True
        elif not same_step(series.step, step):
            series.resample(step, self.order, self.lag)
            second = (series.rate - series.previous_rate) / series.step
            series.auxiliary = series.auxiliary + ahead * (step - series.step) * second
        series.step = step

    def formula(self, step):
        am, af, g = self.alpha_m, self.alpha_f, self.gamma
        slope = am / (af * g * step)
        return slope, Sum((((1 - am / g) / af, AUXILIARY), (1 - 1 / af, RATE), (-slope, 0)))

    def updates(self, step):
        g = self.gamma
        change, auxiliary = ((1, NEW), (-1, 0)), ((1 / (g * step), CHANGE), (1 - 1 / g, AUXILIARY))
        return [(CHANGE, Sum(change)), (AUXILIARY, Sum(auxiliary))]

    def symbol(self):
        am, af, g = self.alpha_m, self.alpha_f, self.gamma
        return np.convolve([1, -1], [am, 1 - am]), np.convolve([g, 1 - g], [af, 1 - af])


class Predictor:
    """Initial guess for Newton: the polynomial through the last `points` solutions, extrapolated."""

    def __init__(self, points=3):
        self.points, self.count, self._rows = points, 0, None

    @property
    def times(self):
        """Times of the solutions, newest first."""
        return self._times[: self.count]

    @property
    def values(self):
        """Solutions at these times, views."""
        return self._rows[: self.count]

    def add(self, t, value):
        """Add a solution."""
        if self._rows is None:
            times, rows = self._times, self._rows = np.zeros(self.points), np.zeros((self.points, len(value)))
            self._older = [(times[1:], times[:-1]), (rows[1:].ravel(), rows[:-1].ravel())]
        copies(self._older)()
        self._times[0], self._rows[0] = t, value
        self.counted()

    def functions(self, time, u):
        """Two functions for the next step: one writes the value extrapolated to time[0] to u, the other takes u at
        time[0] as the newest solution, after which `counted` must be called."""
        ahead = extrapolation(self.times, self.values, time, u)
        return ahead, copies([*self._older, (self._times[:1], time), (self._rows[0], u)])

    def counted(self):
        """Count the solution just added."""
        self.count = min(self.count + 1, self.points)

    def state(self):
        """State for `restore`; nothing is copied."""
        return {"times": self.times, "values": self.values}

    def restore(self, state):
        """Restore that state."""
        self.count = 0
        for t, value in reversed(list(zip(state["times"], state["values"], strict=True))):
            self.add(t, value)


def make_scheme(name, spectral_radius=0.8):
    """Scheme by the name that a scene gives it."""
    return Scheme.known[name](spectral_radius)
