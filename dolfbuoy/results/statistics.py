"""What is said of the series of a run: extremes, mean, deviation, and the period that is largest in it."""

import itertools
import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from .record import LABELS, SERIES

#: What is said of every recorded quantity over the whole run.
STATISTICS = ("minimum", "maximum", "mean", "standard_deviation", "dominant_period")
#: Recorded, but about the solver.
EFFORT = ("time_step", "newton_iterations")
#: Angles that are recorded between -180 and 180 degrees; here a turn over 180 goes on.
TURNING = ("roll", "yaw")


def statistics(record: xr.Dataset) -> dict[str, dict[str, float]]:
    """STATISTICS of every scalar series and every component of a vector series, in the units of the record.

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
    """Every scalar series of a record and every component of another: its label (name, or name_label such as
    buoy_position_z), its values, and what of them may be rounding noise.  Angles turn on over 180 degrees."""
    for name, variable in record.data_vars.items():
        if variable.dims[:1] != ("time",) or name in EFFORT:
            continue
        columns = variable.values.reshape(variable.shape[0], -1)
        if name in TURNING:
            columns = np.unwrap(columns, period=360, axis=0)
        dims = [d for d in variable.dims[1:] if d in LABELS or record.sizes[d] > 1]
        labels = itertools.product(*(record[dim].values.astype(str) for dim in dims))
        for label, x in zip(labels, columns.T, strict=True):
            yield "_".join([name, *label]), x, 1e-9 * np.abs(columns).max()


def described(label: str) -> tuple[str, str]:
    """(unit, long name) of a column."""
    name = max((name for name in SERIES if label == name or label.startswith(f"{name}_")), key=len)
    return SERIES[name][1:]


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
