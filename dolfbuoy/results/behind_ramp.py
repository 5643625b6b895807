"""What of a run stands behind its ramp: rows, means over time, spectra; and a record's own scene."""

import numpy as np

from ..errors import InputError
from ..scene import kept_scene
from ..scene.settings import period_of, ramp_of
from .record import check_format
from .statistics import TURNING

#: Least number of instants, and of periods of the drive, of which there is a spectrum.
INSTANTS, PERIODS = 64, 4


class Missing(InputError):
    """A record, or a scene, without what a figure shows."""


class TooShort(InputError):
    """A record that ends before there is enough of it for a figure."""


def scene_of(record):
    """The scene of a record, which stands in its attributes.  Raises InputError if not, or for an old one."""
    if "scene" not in record.attrs:
        raise InputError("This record does not carry its scene: give the scene beside it.")
    check_format(record.attrs, "This record")
    return kept_scene(record.attrs["scene"])


def after_ramp(times: np.ndarray, scene, at_least: int, what: str) -> np.ndarray:
    """Rows of the times from the end of the scene's ramp on.  Raises TooShort, in whose name, if these are too few."""
    ramp = ramp_of(scene)
    rows = np.flatnonzero(times >= ramp * (1 - 1e-9))
    if len(rows) < at_least:
        behind = f"the ramp of {ramp:g} s" if ramp else "the start"
        raise TooShort(f"No {what}: it needs {at_least} instants after {behind}, the record has {len(rows)}.")
    return rows


def enough_for_a_spectrum(times: np.ndarray, scene, what: str) -> tuple[np.ndarray, float | None]:
    """Rows behind the ramp, and the period of the drive.  Raises TooShort, in whose name, if these are too few."""
    period, rows = period_of(scene), after_ramp(times, scene, INSTANTS, what)
    if period is not None and times[-1] - times[rows[0]] < PERIODS * period * (1 - 1e-9):
        raise TooShort(
            f"No {what}: it needs {PERIODS} periods after the ramp of {ramp_of(scene):g} s, "
            f"the record has {(times[-1] - times[rows[0]]) / period:.2g}."
        )
    return rows, period


def mean_over_time(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Of values (time, ...), by the trapezoidal rule."""
    return np.average((values[1:] + values[:-1]) / 2, axis=0, weights=np.diff(t))


def unwrapped(record, name: str) -> np.ndarray:
    """An angle of the record [degree]; where it turns on over 180 degrees, without the jump."""
    values = record[name].values
    return np.unwrap(values, period=360) if name in TURNING else values


def density(t: np.ndarray, x: np.ndarray, period: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """(frequencies [Hz], one-sided power spectral density [unit of x squared / Hz]) of a series, without its trend.

    Welch's method on equal steps, to which x is interpolated: Hann windows of half the series that overlap by half;
    with a period, of the largest whole number of it in that half, so that it falls on a frequency of the grid.
    """
    grid = np.linspace(t[0], t[-1], len(t))
    rate = (len(t) - 1) / (t[-1] - t[0])
    segment = len(t) // 2
    if period is not None:
        segment = max(round(np.floor(segment / rate / period) * period * rate), 8)
    return welch(np.interp(grid, t, x), rate, segment)


def welch(x: np.ndarray, rate: float, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and one-sided density of equally spaced values: Hann windows of `size` values that overlap by half.

    In each the line through its values is taken off.  What SciPy's `signal.welch` does, whose import takes longer than
    many a run.
    """
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(size) / size))
    begins = np.arange(0, len(x) - size + 1, size - size // 2)
    pieces = x[begins[:, None] + np.arange(size)]
    line = np.linspace(-1.0, 1.0, size)
    pieces = pieces - pieces.mean(axis=1, keepdims=True) - np.outer(pieces @ line / (line @ line), line)
    power = np.abs(np.fft.rfft(window * pieces)) ** 2 / (rate * (window @ window))
    power[:, 1 : (size + 1) // 2] *= 2
    return np.fft.rfftfreq(size, 1 / rate), power.mean(axis=0)
