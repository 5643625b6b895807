"""How far a run is from a finer one.

The error of a quantity is the rms of its difference from the reference over the run, without the ramp at its start,
relative to the range (max - min) of the reference; of a vector the diagonal of the box of its ranges counts.  A run
here is anything with times `t` and `values`, name -> array.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ..errors import InputError

#: A case is resolved when its error exceeds the reference's own by this factor.
RESOLVED = 3.0


@dataclass
class Error:
    """rms: of the difference; maximum: of the largest value; both relative to the reference's range."""

    rms: float
    maximum: float


class Reference:
    """A fine run between its times (cubic splines).

    start: errors count from this time on.  whole: the run whose ranges errors are relative to, if it is another.
    """

    def __init__(self, run, start: float, whole: "Reference | None" = None):
        self.start, self.end, self.whole = start, run.t[-1], whole or self
        self.splines = {name: CubicSpline(run.t, values) for name, values in run.values.items()}
        inside = run.t >= start - 1e-9 * self.end
        self.inside = {name: _columns(values)[inside] for name, values in run.values.items()}

    def range_of(self, name: str) -> float:
        """max - min after the start; of a vector the diagonal of the box."""
        return float(np.linalg.norm(np.ptp(self.whole.inside[name], axis=0)))

    def error(self, run, name: str) -> Error:
        """Of a run at its own times.  A quantity that does not vary has errors inf, unless they are 0."""
        inside = (run.t >= self.start - 1e-9 * self.end) & (run.t <= self.end * (1 + 1e-9))
        t, values = np.minimum(run.t[inside], self.end), _columns(run.values[name])[inside]
        difference = values - _columns(self.splines[name](t))
        largest = np.abs(values.max(axis=0) - self.inside[name].max(axis=0)).max()
        size = self.range_of(name)
        return Error(_relative(_rms(t, np.linalg.norm(difference, axis=1)), size), _relative(largest, size))


def _columns(values):
    return np.asarray(values, dtype=float).reshape(len(values), -1)


def _rms(t, values):
    """Root of the mean square over time (trapezoidal rule, exact for unequal steps)."""
    if len(t) < 2:
        raise InputError("The run is too short to compare: fewer than two of its times lie after the ramp.")
    squares = values**2
    return float(np.sqrt(np.sum(np.diff(t) * (squares[1:] + squares[:-1]) / 2) / (t[-1] - t[0])))


def _relative(value, size):
    return float(value / size) if size > 0 else (0.0 if value == 0 else float("inf"))


def own_error(changes, highest: float = 2.0) -> float:
    """Richardson: error of the finest of runs that are each twice as fine as the one before.

    changes: errors of each but the last against its next.  The order is that of the last two changes, between 1 and
    `highest`; of a single change it is 2.
    """
    order = min(2.0, highest)
    if len(changes) > 1 and changes[-1] > 0:
        order = min(max(np.log2(changes[-2] / changes[-1]), 1.0), highest) if changes[-2] > 0 else 1.0
    return float(changes[-1] / (2**order - 1))


def resolved(error: float, reference_error: float) -> bool:
    """Whether an error is one of the case and not of its reference."""
    return error >= RESOLVED * reference_error


def bound(error: float, reference_error: float) -> float:
    """What the comparison proves: an error that is not resolved may be as large as this."""
    return max(error, RESOLVED * reference_error)


class Curve:
    """Error over a size x (step, tolerance, 1/cells): powers between measurements, below them the last order.

    The error never falls as x grows: a bump counts for all larger x.  Beyond the largest x nothing is known.
    """

    def __init__(self, points):
        points = sorted((x, e) for x, e in points if e > 0)
        self.x = np.array([x for x, _ in points])
        self.error = np.maximum.accumulate([e for _, e in points]) if points else np.array([])

    @property
    def order(self) -> float:
        """Observed between the two smallest sizes, at most 4."""
        if len(self.x) < 2:
            return 0.0
        return min(math.log(self.error[1] / self.error[0]) / math.log(self.x[1] / self.x[0]), 4.0)

    def __call__(self, x: float) -> float:
        if len(self.x) == 0 or x > self.x[-1] * (1 + 1e-9):
            return math.inf
        if x < self.x[0]:
            return float(self.error[0] * (x / self.x[0]) ** self.order)
        return float(np.exp(np.interp(math.log(x), np.log(self.x), np.log(self.error))))

    def largest(self, error: float, sizes) -> float | None:
        """The largest of these sizes with at most this error."""
        return next((x for x in sorted(sizes, reverse=True) if self(x) <= error), None)


def pareto(points) -> list[int]:
    """Indices of (time, error) that no other point beats in both, from the fastest on."""
    front, best = [], float("inf")
    for i in sorted(range(len(points)), key=lambda i: tuple(points[i])):
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def percent(error: float) -> str:
    """An error as one would say it."""
    return f"{100 * error:.2g} %"
