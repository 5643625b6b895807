"""Scalar series of a record, and their statistics: moments, periods, peaks, rainflow ranges.

Labels: "tension_top of port", "buoy_position_z of buoy"; the name alone for a series that belongs to no part.  Peaks
are the highest values between two up-crossings of the mean.  Rainflow counting follows ASTM E1049-85 (package
`rainflow`).  Peaks and ranges are returned as two arrays, values and counts: a half cycle counts 0.5.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .labelled import unit_and_name
from .quantities import QUANTITIES, declared

if TYPE_CHECKING:
    import xarray as xr

    from .labelled import Variable

#: Time for which a level must be exceeded to count as lasting [s].
LASTING = 1.0
#: Dimensions of a record over its parts, and the text before the name of a part in a label.
OF = ("cable", "buoy", "attachment", "anchor", "segment", "joint", "place", "take_off", "winch", "vessel")
OF_PART = " of "
#: Units of statistics that do not have the unit of their series.
UNITS = {
    "skewness": "1",
    "period": "s",
    "dominant_period": "s",
    "memory": "s",
    "m0": "m2",
    "damage": "1",
    "life": "year",
}
#: Words for statistics whose names are not words.
WORDS = {
    "m0": "variance m0",
    "Hs": "significant height 4 sqrt(m0)",
    "equivalent_load": "damage-equivalent range",
    "damage": "Miner sum of the run",
    "life": "years until the Miner sum is 1, were it so for ever",
    "lasting_maximum": f"exceeded for {LASTING:g} s",
}


@dataclass(frozen=True, eq=False)
class Series:
    """Values x at instants t [s]; noise: amplitude that may be rounding error [unit of x].

    Moments are over time (trapezoidal rule), for any step sizes.  Undefined statistics are nan.
    """

    label: str
    t: NDArray[Any]
    x: NDArray[Any]
    noise: float = 0.0

    def numbers(self, names: Iterable[str]) -> dict[str, float]:
        """The properties of these names."""
        return {name: getattr(self, name) for name in names}

    @cached_property
    def mean(self) -> float:
        return self._average(self.x)

    @cached_property
    def standard_deviation(self) -> float:
        """Standard deviation; 0 for a constant with rounding errors."""
        found = math.sqrt(self._average((self.x - self.mean) ** 2))
        return 0.0 if found <= 4 * np.finfo(float).eps * abs(self.x).max() else found

    @property
    def skewness(self) -> float:
        """Third central moment over the cube of the standard deviation."""
        deviation = self.standard_deviation
        return self._average((self.x - self.mean) ** 3) / deviation**3 if deviation > self.noise else math.nan

    @property
    def minimum(self) -> float:
        return float(self.x.min())

    @property
    def maximum(self) -> float:
        return float(self.x.max())

    @property
    def lasting_maximum(self) -> float:
        """Highest level exceeded for LASTING seconds without interruption; nan for a shorter series.

        Linear between instants; bisected down to rounding, so that derivatives can be taken by finite differences.
        """
        if self.t[-1] - self.t[0] < LASTING:
            return math.nan
        low, high = self.minimum, self.maximum
        for _ in range(48):
            middle = (low + high) / 2
            low, high = (middle, high) if self._longest_above(middle) >= LASTING else (low, middle)
        return low

    def _longest_above(self, level: float) -> float:
        """Longest time above a level without interruption [s]."""
        t, above = self.t, self.x - level
        turns = np.flatnonzero(np.diff(above >= 0))
        instants = t[turns] - above[turns] * (t[turns + 1] - t[turns]) / (above[turns + 1] - above[turns])
        edges = np.concatenate([t[:1] if above[0] >= 0 else [], instants, t[-1:] if above[-1] >= 0 else []])
        return float(np.max(edges[1::2] - edges[::2], initial=0.0))

    @property
    def period(self) -> float:
        """Mean time between up-crossings of the mean [s]."""
        t, x, rows = self.t, self.x, self._up_crossings
        if len(rows) < 2:
            return math.nan
        i = rows[[0, -1]]
        first, last = t[i] + (self.mean - x[i]) / (x[i + 1] - x[i]) * (t[i + 1] - t[i])
        return float((last - first) / (len(rows) - 1))

    @property
    def dominant_period(self) -> float:
        """Period of the largest oscillation in the second half of the run [s].

        The largest Fourier amplitude between one period in that half and two samples, refined by least squares for
        trend, cosine and sine at a free frequency: exact for a sinusoid on a trend, at any steps.  Amplitudes below the
        noise do not count.
        """
        late = self.t >= 0.5 * (self.t[0] + self.t[-1])
        t, x = self.t[late] - self.t[-1], self.x[late]
        if len(t) < 8 or np.ptp(x) <= 2 * self.noise:
            return math.nan
        window, frequency = np.sin(np.pi * (t - t[0]) / (t[-1] - t[0])) ** 2, _peak(t, x)
        known = np.column_stack([np.ones_like(t), t / -t[0], x]).T * window
        for _ in range(50):
            fit, change = _fitted(known, t * window, window, 2 * np.pi * frequency * t)
            frequency += float(np.clip(change, -0.2 / -t[0], 0.2 / -t[0]))
            if not 0.5 / -t[0] < frequency < 0.5 * (len(t) - 1) / -t[0]:
                return math.nan
            if abs(change) <= 1e-13 * frequency:
                break
        return 1 / frequency if np.hypot(fit[2], fit[3]) > self.noise else math.nan

    @property
    def memory(self) -> float:
        """2 pi int S^2 dw/m0^2 [s]: the variance of a Gaussian process over T has a relative scatter of sqrt(memory/T).

        A periodogram scatters by as much as its mean, so that half the sum of its squares estimates int S^2 dw.
        """
        grid = np.linspace(self.t[0], self.t[-1], len(self.t))
        power = np.abs(np.fft.rfft(np.interp(grid, self.t, self.x - self.x.mean()))) ** 2
        if self.standard_deviation <= self.noise or not power.any():
            return math.nan
        return float((grid[-1] - grid[0]) * np.sum(power**2) / np.sum(power) ** 2 / 2)

    def peaks(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """(highest values between neighbouring upward crossings of the mean, ones), in order."""
        rows = self._up_crossings
        found = np.maximum.reduceat(self.x, rows + 1)[:-1] if len(rows) > 1 else np.zeros(0)
        return found, np.ones(len(found))

    def ranges(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """(rainflow ranges in increasing order, their cycle counts); the residue counts as half cycles."""
        try:
            from rainflow import count_cycles  # the only place that needs it
        except ImportError:
            raise InputError(
                "rainflow is not installed, which counts cycles: pip install rainflow, or this tree anew."
            ) from None
        found = np.array(count_cycles(self.x), dtype=float).reshape(-1, 2)
        found = found[found[:, 0] > 0]
        return found[:, 0], found[:, 1]

    def _average(self, values: NDArray[Any]) -> float:
        return float(mean_over_time(self.t, values))

    @cached_property
    def _up_crossings(self) -> NDArray[Any]:
        """Last rows below the mean before rows on or above it; none in noise."""
        if len(self.x) < 2 or np.ptp(self.x) <= 2 * self.noise:
            return np.zeros(0, dtype=int)
        above = self.x >= self.mean
        return np.flatnonzero(~above[:-1] & above[1:])


def mean_over_time(t: NDArray[Any], values: NDArray[Any]) -> NDArray[Any]:
    """Mean of values (time, ...), by the trapezoidal rule."""
    weights = np.convolve(np.diff(t), [0.5, 0.5]) if len(t) > 1 else np.ones(1)
    return np.asarray(np.average(values, axis=0, weights=weights))


def unwrapped(record: xr.Dataset, name: str) -> NDArray[Any]:
    """Values of a variable over time; an angle [degree] is unwrapped at 180."""
    values = record[name].values
    return np.unwrap(values, period=360, axis=0) if name in QUANTITIES and QUANTITIES[name].turning else values


def series_of(record: xr.Dataset) -> Iterator[Series]:
    """All scalar series of a record, and all components of the others.  Angles are unwrapped at 180 degrees."""
    for name, variable in record.data_vars.items():
        if variable.dims[:1] != ("time",) or (name in QUANTITIES and QUANTITIES[name].effort):
            continue
        columns = unwrapped(record, name).reshape(variable.shape[0], -1)
        own = len(set(variable.dims) & set(OF))
        labels = itertools.product(*(record[dim].values.astype(str) for dim in variable.dims[1:]))
        for parts, x in zip(labels, columns.T, strict=True):
            label = OF_PART.join(["_".join([str(name), *parts[own:]]), *parts[:own]])
            yield Series(label, record.time.values, x, 1e-9 * np.abs(columns).max())


def begun(record: xr.Dataset) -> Iterator[Series]:
    """Quantities read at the beginning of a run as series, with the same value at both ends of the time."""
    for name, variable in record.data_vars.items():
        if name in QUANTITIES and QUANTITIES[name].over == "" and QUANTITIES[name].read:
            parts = record[QUANTITIES[name].kind].values.astype(str)
            for part, x in zip(parts, variable.values, strict=True):
                yield Series(f"{name}{OF_PART}{part}", record.time.values[[0, -1]], np.full(2, x), abs(x))


def _fitted(
    known: NDArray[Any], t: NDArray[Any], window: NDArray[Any], phase: NDArray[Any]
) -> tuple[NDArray[Any], float]:
    """Least-squares fit of x by constant, trend, cosine and sine, and the change of frequency that lowers the residual.

    The triangular factor of a QR decomposition replaces the rows of all instants; its last rows hold the residual.
    """
    (one, trend, x), cos, sin = known, np.cos(phase), np.sin(phase)
    columns = np.array([one, trend, window * cos, window * sin, t * cos, t * sin, x])
    R: Any = np.linalg.qr(columns.T, mode="r")
    fit = np.linalg.lstsq(R[:4, :4], R[:4, 6], rcond=None)[0]
    slope = 2 * np.pi * (fit[3] * R[4:, 4] - fit[2] * R[4:, 5])  # derivative of the fit by frequency
    return fit, slope @ R[4:, 6] / (slope @ slope)


def _peak(t: NDArray[Any], x: NDArray[Any]) -> float:
    """Frequency of the largest Fourier amplitude, on a grid of an eighth of the resolution."""
    grid = np.linspace(t[0], t[-1], len(t))
    y, about = np.interp(grid, t, x - x.mean()), grid - grid.mean()
    y = (y - y.mean() - (about @ y) / (about @ about) * about) * np.hanning(len(y))
    amplitude = np.abs(np.fft.rfft(y, 8 * len(y)))
    amplitude[:8] = 0.0  # less than one period
    return float(np.argmax(amplitude) / (8 * len(y) * (grid[1] - grid[0])))


class Place(NamedTuple):
    """Components of a label: name of the series, dimension and name of its part (None and "" without one)."""

    name: str
    dimension: str | None
    part: str


def place_of(label: str) -> Place:
    """The Place of a label."""
    name, _, part = label.partition(OF_PART)
    return Place(name, next((d for d in declared(name).dims if d in OF), None), part)


def spoken(label: str) -> str:
    """A label in words; for a tension at a place, the place."""
    return label.removeprefix(f"place_tension{OF_PART}").replace("_", " ")


def described(label: str) -> tuple[str, str]:
    """(unit, long name) of a series."""
    quantity = declared(label.partition(OF_PART)[0])
    return quantity.unit, quantity.long_name


class Columns:
    """Converts numbers by label to variables by name over the dimension of their parts.

    names: {dimension: names of its parts, in the order of the labels}.
    """

    def __init__(self, labels: Iterable[str]) -> None:
        self.labels = list(dict.fromkeys(labels))
        self.names: dict[str, list[str]] = {}
        for _, dimension, part in map(place_of, self.labels):
            if dimension and part not in self.names.setdefault(dimension, []):
                self.names[dimension].append(part)

    def variables(
        self, columns: Mapping[str, Any], ending: str, words: str, dims: tuple[str, ...], unit: str | None = None
    ) -> dict[str, Variable]:
        """{name_ending: (dimensions, array, attributes)}, the part's dimension second; unit: if not the series' own."""
        found = {}
        for label, column in columns.items():
            (name, dimension, part), column = place_of(label), np.asarray(column, dtype=float)
            own, text = described(name)
            attributes = unit_and_name(own if unit is None else unit, f"{words}: {text}")
            if dimension is None:
                found[f"{name}_{ending}"] = dims, column, attributes
                continue
            names, (first, *others) = self.names[dimension], column.shape
            whole = (dims[0], dimension, *dims[1:]), np.full((first, len(names), *others), np.nan), attributes
            found.setdefault(f"{name}_{ending}", whole)[1][:, names.index(part)] = column
        return found

    def table(
        self, rows: list[dict[str, dict[str, float]]], numbers: Iterable[str], dim: str, complete: bool = True
    ) -> dict[str, Variable]:
        """<series>_<number> over `dim` from rows {label: {number: value}}; nan where a row has none.
        complete: if False, variables that no row has are left out."""
        data: dict[str, Variable] = {}
        for number in numbers:
            columns = {label: [row.get(label, {}).get(number) for row in rows] for label in self.labels}
            found = {k: column for k, column in columns.items() if complete or any(x is not None for x in column)}
            words = WORDS.get(number, number.replace("_", " "))
            data |= self.variables(found, number, words, (dim,), UNITS.get(number))
        return data


def each_series(
    dataset: xr.Dataset, statistic: str, chosen: Iterable[str] | None = None
) -> list[tuple[str, str, xr.Dataset]]:
    """(label, name, its part of the dataset) of all series with this statistic, or of those chosen, in their order.
    The label includes the part if there are several; the dataset is without the dimension of the part."""
    found, ending = [], f"_{statistic}"
    names = [str(v).removesuffix(ending) for v in dataset.data_vars if str(v).endswith(ending)]
    for name in names if chosen is None else [name for name in chosen if name in names]:
        variable = dataset[f"{name}_{statistic}"]
        dimension = next((d for d in variable.dims if d in OF), None)
        for part in dataset[dimension].values.tolist() if dimension else [None]:
            label = f"{name}{OF_PART}{part}" if dimension and dataset.sizes[dimension] > 1 else name
            one = dataset.sel({dimension: part}) if dimension else dataset
            for kept in (f"{name}_peak", f"{name}_range"):
                if f"{kept}_{dimension}" in one:
                    one = one.isel({f"{kept}_number": one[f"{kept}_{dimension}"].values == part})
            found.append((label, name, one))
    return found
