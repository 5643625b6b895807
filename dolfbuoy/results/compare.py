"""Errors of a run against a finer one.

The error of a quantity is the rms of its difference from the reference over the run, without the ramp at its start,
relative to the range (max - min) of the reference; of a vector the diagonal of the box of its ranges counts.  A run
here is anything with times `t` and `values`, name -> array.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene.quantities import number_of

#: A case is resolved when its error exceeds the reference's own by this factor.
RESOLVED = 3.0
#: Numbers that steps are rounded down to, times a power of ten.
NICE = (1, 1.25, 1.6, 2, 2.5, 3.2, 4, 5, 6.4, 8)


@dataclass
class Error:
    """rms: of the difference; maximum: of the largest value; both relative to the reference's range."""

    rms: float
    maximum: float


class Reference:
    """A fine run between its times (cubic splines).

    start: errors count from this time on.  whole: the run whose ranges errors are relative to, if it is another.
    """

    def __init__(self, run: Any, start: float, whole: Reference | None = None) -> None:
        from scipy.interpolate import CubicSpline  # 0.1 s of every start

        self.start, self.end, self.whole = start, run.t[-1], whole or self
        self.splines = {name: CubicSpline(run.t, values) for name, values in run.values.items()}
        inside = run.t >= start - 1e-9 * self.end
        self.inside = {name: _columns(values)[inside] for name, values in run.values.items()}

    def range_of(self, name: str) -> float:
        """max - min after the start; of a vector the diagonal of the box."""
        return float(np.linalg.norm(np.ptp(self.whole.inside[name], axis=0)))

    def error(self, run: Any, name: str) -> Error:
        """Error of a run at its own times.  A quantity that does not vary has errors inf, unless they are 0."""
        inside = (run.t >= self.start - 1e-9 * self.end) & (run.t <= self.end * (1 + 1e-9))
        t, values = np.minimum(run.t[inside], self.end), _columns(run.values[name])[inside]
        difference = values - _columns(self.splines[name](t))
        largest = np.abs(values.max(axis=0) - self.inside[name].max(axis=0)).max()
        size = self.range_of(name)
        return Error(_relative(_rms(t, np.linalg.norm(difference, axis=1)), size), _relative(largest, size))


def _columns(values: Any) -> NDArray[Any]:
    return np.asarray(values, dtype=float).reshape(len(values), -1)


def _rms(t: NDArray[Any], values: NDArray[Any]) -> float:
    """Root of the mean square over time (trapezoidal rule, exact for unequal steps)."""
    if len(t) < 2:
        raise InputError("The run is too short to compare: fewer than two of its times lie after the ramp.")
    squares = values**2
    return float(np.sqrt(np.sum(np.diff(t) * (squares[1:] + squares[:-1]) / 2) / (t[-1] - t[0])))


def _relative(value: float, size: float) -> float:
    return float(value / size) if size > 0 else (0.0 if value == 0 else float("inf"))


def own_error(changes: Sequence[float], highest: float = 2.0) -> float:
    """Richardson: error of the finest of runs that are each twice as fine as the one before.

    changes: errors of each but the last against its next.  The order is that of the last two changes, between 1 and
    `highest`; of a single change it is 2.
    """
    order = min(2.0, highest)
    if len(changes) > 1 and changes[-1] > 0:
        order = min(max(np.log2(changes[-2] / changes[-1]), 1.0), highest) if changes[-2] > 0 else 1.0
    return float(changes[-1] / (2**order - 1))


def resolved(error: float, reference_error: float) -> bool:
    """True if an error is that of the case and not of its reference."""
    return error >= RESOLVED * reference_error


def bound(error: float, reference_error: float) -> float:
    """Upper bound of an error: one that is not resolved may be as large as this."""
    return max(error, RESOLVED * reference_error)


class Curve:
    """Error over a size x (step, tolerance, 1/cells): powers between measurements, below them the last order.

    The error never falls as x grows: a bump counts for all larger x.  Beyond the largest x nothing is known.
    """

    def __init__(self, points: Iterable[tuple[float, float]]) -> None:
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

    def largest(self, error: float, sizes: Iterable[float]) -> float | None:
        """The largest of these sizes with at most this error."""
        return next((x for x in sorted(sizes, reverse=True) if self(x) <= error), None)


def nice_numbers(low: float, high: float) -> list[float]:
    """Rounded numbers between two positive ones."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    numbers = [float(f"{m}e{p}") for p in powers for m in NICE]
    return [x for x in numbers if low <= x <= high * (1 + 1e-9)]


def orders(rows: list[dict[str, Any]], error: str, size: str = "h") -> None:
    """Add the observed order between consecutive rows as `order_<error>` (None in the first)."""
    for before, row in zip([None, *rows], rows, strict=False):
        row[f"order_{error}"] = None
        if before and before[error] and row[error] and before[error] > 0 and row[error] > 0:
            row[f"order_{error}"] = math.log(before[error] / row[error]) / math.log(before[size] / row[size])


def reach(points: Iterable[tuple[float, float, float]], accuracy: float) -> dict[str, Any] | None:
    """Size and seconds at which a family has this error; points: (size, error, seconds), errors grow with the size.

    Powers between the measurements, and beyond the finest (`extrapolated`), where the work is inverse to the size; the
    coarsest as it is, if that is good enough (`at_most`).  None of fewer than two points, or where they have no order.
    """
    points = sorted(point for point in points if point[1])
    curve = Curve([point[:2] for point in points])
    if len(points) < 2 or curve.order < 0.3:
        return None
    sizes, seconds = np.log([p[0] for p in points]), np.log([p[2] for p in points])
    if accuracy >= curve.error[-1]:
        size, beyond = curve.x[-1], "at_most"
    elif accuracy < curve.error[0]:
        size, beyond = curve.x[0] * (accuracy / curve.error[0]) ** (1 / curve.order), "extrapolated"
    else:
        size, beyond = math.exp(np.interp(math.log(accuracy), np.log(curve.error), np.log(curve.x))), ""
    wall = math.exp(np.interp(math.log(size), sizes, seconds)) * max(1.0, curve.x[0] / size)
    return {"size": float(size), "seconds": wall, "note": beyond}


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices of (time, error) that no other point beats in both, from the fastest on."""
    front, best = [], float("inf")
    for i in sorted(range(len(points)), key=lambda i: tuple(points[i])):
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def percent(error: float) -> str:
    """An error in percent, with two digits."""
    return f"{100 * error:.2g} %"


def parse_accuracy(text: str, option: str = "--accuracy") -> float:
    """'1%', '1 %' or '0.01' -> 0.01; raises InputError that names the option."""
    number = text.strip()
    try:
        value = number_of(number.removesuffix("%")) / 100 if number.endswith("%") else number_of(number)
    except ValueError:
        value = float("nan")
    if not 1e-5 <= value <= 0.5:
        raise InputError(f"{option} {text}: must be from 0.001% to 50%, written as 1% or 0.01.")
    return value
