"""Errors of a run relative to a finer one.

The error of a quantity is the rms difference from the reference over the run after its ramp, relative to the
reference's range, max - min; for a vector, to the diagonal of the box of its ranges.  A run here is any object with
times `t` and `values`, name -> array.
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

#: An error is resolved when it exceeds that of the reference by this factor.
RESOLVED = 3.0
#: Step sizes are rounded down to these numbers times a power of ten.
NICE = (1, 1.25, 1.6, 2, 2.5, 3.2, 4, 5, 6.4, 8)


@dataclass
class Error:
    """Errors relative to the reference's range: rms of the difference, and error of the largest value."""

    rms: float
    maximum: float


class Reference:
    """A fine run, interpolated in time by cubic splines.

    start: time from which errors count.  whole: the run to whose ranges errors are relative, if a different one.
    """

    def __init__(self, run: Any, start: float, whole: Reference | None = None) -> None:
        from scipy.interpolate import CubicSpline  # 0.1 s of every start

        self.start, self.end, self.whole = start, run.t[-1], whole or self
        self.splines = {name: CubicSpline(run.t, values) for name, values in run.values.items()}
        inside = run.t >= start - 1e-9 * self.end
        self.inside = {name: _columns(values)[inside] for name, values in run.values.items()}

    def range_of(self, name: str) -> float:
        """max - min after the start; for a vector, the diagonal of the box."""
        return float(np.linalg.norm(np.ptp(self.whole.inside[name], axis=0)))

    def error(self, run: Any, name: str) -> Error:
        """Error of a run at its own times; inf for a quantity that does not vary, unless it is 0."""
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
    """Richardson estimate of the error of the finest of a series of runs, each twice as fine as the one before.

    changes: errors of each run relative to the next.  The order is that of the last two changes, limited to between 1
    and `highest`; for a single change it is 2.
    """
    order = min(2.0, highest)
    if len(changes) > 1 and changes[-1] > 0:
        order = min(max(np.log2(changes[-2] / changes[-1]), 1.0), highest) if changes[-2] > 0 else 1.0
    return float(changes[-1] / (2**order - 1))


def resolved(error: float, reference_error: float) -> bool:
    """True if an error is that of the run, not of its reference."""
    return error >= RESOLVED * reference_error


def bound(error: float, reference_error: float) -> float:
    """Upper bound of an error that may not be resolved."""
    return max(error, RESOLVED * reference_error)


class Curve:
    """Error over a size x (step, tolerance, 1/cells): power laws between measurements, the last order below them.

    The error never falls as x grows: a bump counts for all larger x.  Unknown (inf) beyond the largest x.
    """

    def __init__(self, points: Iterable[tuple[float, float]]) -> None:
        points = sorted((x, e) for x, e in points if e > 0)
        self.x = np.array([x for x, _ in points])
        self.error = np.maximum.accumulate([e for _, e in points]) if points else np.array([])

    @property
    def order(self) -> float:
        """Order observed between the two smallest sizes, at most 4."""
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
        """The largest of these sizes with at most this error, or None."""
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
    """Size and seconds at which a family of runs has this error; points: (size, error, seconds).

    Power laws between the measurements and below the finest (`extrapolated`), where the work is inverse to the size;
    the coarsest itself if accurate enough (`at_most`).  None for fewer than two points, or where no order is observed.
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
    """Indices of (time, error) pairs that no other beats in both, fastest first."""
    front, best = [], float("inf")
    for i in sorted(range(len(points)), key=lambda i: tuple(points[i])):
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def percent(error: float) -> str:
    """An error in percent, to two digits."""
    return f"{100 * error:.2g} %"


def parse_accuracy(text: str, option: str = "--accuracy") -> float:
    """'1%', '1 %' or '0.01' -> 0.01; raises InputError naming the option."""
    number = text.strip()
    try:
        value = number_of(number.removesuffix("%")) / 100 if number.endswith("%") else number_of(number)
    except ValueError:
        value = float("nan")
    if not 1e-5 <= value <= 0.5:
        raise InputError(f"{option} {text}: must be from 0.001% to 50%, written as 1% or 0.01.")
    return value
