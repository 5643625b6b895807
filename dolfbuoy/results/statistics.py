"""What is said of the series of a run: extremes, mean, deviation, and the period that is largest in it."""

import itertools
import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from .record import SERIES

#: What is said of every recorded quantity over the whole run.
STATISTICS = ("minimum", "maximum", "mean", "standard_deviation", "dominant_period")
#: Recorded, but about the solver.
EFFORT = ("time_step", "newton_iterations")
#: Angles that are recorded between -180 and 180 degrees; here a turn over 180 goes on.
TURNING = ("roll", "yaw")


def statistics(record: xr.Dataset) -> dict[str, dict[str, float]]:
    """STATISTICS of every series, by the labels of `columns_of`, in the units of the record.

    Mean and standard deviation are over time (trapezoidal rule), whatever the steps; see also `dominant_period`.
    """
    t, result = record.time.values, {}
    weights = weights_of(t)
    for label, x, noise in columns_of(record):
        mean = float(np.average(x, weights=weights))
        deviation = float(np.sqrt(np.average((x - mean) ** 2, weights=weights)))
        period = dominant_period(t, x, noise)
        values = (float(x.min()), float(x.max()), mean, deviation, period)
        result[label] = dict(zip(STATISTICS, values, strict=True))
    return result


def weights_of(t: np.ndarray) -> np.ndarray:
    """Of instants in a mean over time, by the trapezoidal rule."""
    return np.convolve(np.diff(t), [0.5, 0.5]) if len(t) > 1 else np.ones(1)


def columns_of(record: xr.Dataset) -> Iterator[tuple[str, np.ndarray, float]]:
    """Every scalar series of a record and every component of another: its label, its values, and what of them may be
    rounding noise.  Angles turn on over 180 degrees.

    Labels: "tension_top of port", "buoy_position_z of buoy"; of nothing but the name and a component "NAME_z".
    """
    for name, variable in record.data_vars.items():
        if variable.dims[:1] != ("time",) or name in EFFORT:
            continue
        columns = variable.values.reshape(variable.shape[0], -1)
        if name in TURNING:
            columns = np.unwrap(columns, period=360, axis=0)
        own = len(set(variable.dims) & set(OF))
        labels = itertools.product(*(record[dim].values.astype(str) for dim in variable.dims[1:]))
        for label, x in zip(labels, columns.T, strict=True):
            yield OF_PART.join(["_".join([name, *label[own:]]), *label[:own]]), x, 1e-9 * np.abs(columns).max()


#: Dimensions of a record that say what a series is of, and what stands before that in a label.
OF, OF_PART = ("cable", "buoy", "attachment", "segment", "joint"), " of "
#: Series of statistics that a record does not have: dimensions, unit, long name.
ADDED = {
    "fixed_point_elevation": ((), "m", "water surface at a fixed point"),
    "offset": (("buoy",), "m", "horizontal distance of C from the anchor"),
}


def _declared(label):
    """Dimensions, unit and long name of the series of a label."""
    name, known = label.partition(OF_PART)[0], SERIES | ADDED
    return known[max((one for one in known if name == one or name.startswith(f"{one}_")), key=len)]


def described(label: str) -> tuple[str, str]:
    """(unit, long name) of a column."""
    return _declared(label)[1:]


class Spread:
    """Columns by their labels as variables by their names, over the dimension of what they are of.

    names: of that by dimension, as they stand in the labels.
    """

    def __init__(self, labels):
        self.names = {}
        for label in labels:
            dimension, part = self.place(label)
            if dimension and part not in self.names.setdefault(dimension, []):
                self.names[dimension].append(part)

    @staticmethod
    def place(label: str) -> tuple[str | None, str]:
        """(dimension, name of what it is of); (None, "")."""
        dimension = next((d for d in _declared(label)[0] if d in OF), None)
        return dimension, label.partition(OF_PART)[2]

    def __call__(self, columns: dict[str, np.ndarray], *dims: str) -> dict[str, tuple]:
        """{name: (dimensions, array)} of columns with these dimensions; the new one is the second."""
        found = {}
        for label, column in columns.items():
            (dimension, part), name = self.place(label), label.partition(OF_PART)[0]
            if dimension is None:
                found[name] = dims, column
                continue
            names, (first, *others) = self.names[dimension], column.shape
            whole = np.full((first, len(names), *others), np.nan)
            found.setdefault(name, ((dims[0], dimension, *dims[1:]), whole))[1][:, names.index(part)] = column
        return found


def each_series(dataset: xr.Dataset, statistic: str) -> list[tuple[str, str, xr.Dataset]]:
    """(name with what it is of if there are several of that, name, what the dataset has of it) of all series of which
    there is this statistic, without the dimension of what they are of."""
    found = []
    for name in (str(v).removesuffix(f"_{statistic}") for v in dataset.data_vars if str(v).endswith(f"_{statistic}")):
        variable = dataset[f"{name}_{statistic}"]
        dimension = next((d for d in variable.dims if d in OF), None)
        for part in dataset[dimension].values.tolist() if dimension else [None]:
            label = f"{name}{OF_PART}{part}" if dimension and dataset.sizes[dimension] > 1 else name
            found.append((label, name, _of_part(dataset, name, dimension, part)))
    return found


def _of_part(dataset, name, dimension, part):
    """The variables of a series of one part, and of all lists of its peaks and ranges."""
    if dimension is None:
        return dataset
    found = dataset.sel({dimension: part})
    for kept in (f"{name}_peak", f"{name}_range"):
        if f"{kept}_{dimension}" in found:
            found = found.isel({f"{kept}_number": found[f"{kept}_{dimension}"].values == part})
    return found


def dominant_period(t, x, noise=0.0) -> float:
    """Period of the oscillation that is largest in the second half of the run [s]; nan if there is none.

    The largest peak of the Fourier amplitudes between one period in that half and two samples, then least squares for
    trend, cosine and sine at a free frequency: exact for a sinusoid on a trend, at any steps.  Amplitudes below `noise`
    (in the units of x) do not count.
    """
    late = t >= 0.5 * (t[0] + t[-1])
    t, x = t[late] - t[-1], x[late]
    if len(t) < 8 or np.ptp(x) <= 2 * noise:
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
    return 1 / frequency if np.hypot(fit[2], fit[3]) > noise else math.nan


def _fitted(known, t, window, phase):
    """Least squares of x for constant, trend, cosine and sine, and the change of frequency that would lower the rest.

    Rows of the triangular factor stand for those of all instants: the last of them for what the fit leaves over.
    """
    (one, trend, x), cos, sin = known, np.cos(phase), np.sin(phase)
    columns = np.array([one, trend, window * cos, window * sin, t * cos, t * sin, x])
    R = np.linalg.qr(columns.T, mode="r")
    fit = np.linalg.lstsq(R[:4, :4], R[:4, 6], rcond=None)[0]
    slope = 2 * np.pi * (fit[3] * R[4:, 4] - fit[2] * R[4:, 5])  # of the fit, by frequency
    return fit, slope @ R[4:, 6] / (slope @ slope)


def _peak(t, x):
    """Frequency of the largest Fourier amplitude, on a grid of an eighth of the resolution."""
    grid = np.linspace(t[0], t[-1], len(t))
    y, about = np.interp(grid, t, x - x.mean()), grid - grid.mean()
    y = (y - y.mean() - (about @ y) / (about @ about) * about) * np.hanning(len(y))
    amplitude = np.abs(np.fft.rfft(y, 8 * len(y)))
    amplitude[:8] = 0.0  # less than one period
    return np.argmax(amplitude) / (8 * len(y) * (grid[1] - grid[0]))
