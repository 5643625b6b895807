"""The part of a run after its ramp: rows, spectra; and the scene of a record."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import Scene, kept_scene
from ..scene.settings import period_of, ramp_of
from .record import check_format

if TYPE_CHECKING:
    import xarray as xr

#: Least number of instants, and of periods of the drive, of which there is a spectrum.
INSTANTS, PERIODS = 64, 4
#: Decades below the peak in which a spectrum is shown, and the least density that counts as a peak [unit of the series
#: squared / Hz]: rounding of a constant does not fill a panel.
DECADES, NOISE = 6, 1e-12
#: Fraction of the ramp's time from which on an instant is after it: its end is, as it is rounded.
AFTER = 1 - 1e-9


#: Name, frequencies [Hz], densities.
Curve = tuple[str, NDArray[Any], NDArray[Any]]


class Missing(InputError):
    """A record, or a scene, without what a figure shows."""


class TooShort(InputError):
    """A record that ends before there is enough of it for a figure."""


def scene_of(record: xr.Dataset) -> Scene:
    """The scene in the attributes of a record.  Raises InputError without one, or for an old one."""
    if "scene" not in record.attrs:
        raise InputError("This record does not carry its scene: give the scene too.")
    check_format(record.attrs, "This record")
    return kept_scene(record.attrs["scene"])


def after_ramp(times: NDArray[Any], scene: Scene, at_least: int, what: str) -> NDArray[Any]:
    """Rows of the times from the end of the ramp on.  Raises TooShort, with `what` needs them, if they are too few."""
    ramp = ramp_of(scene)
    rows = np.flatnonzero(times >= ramp * AFTER)
    if len(rows) < at_least:
        begin = f"the ramp of {ramp:g} s" if ramp else "the start"
        raise TooShort(f"No {what}: it needs {at_least} instants after {begin}, the record has {len(rows)}.")
    return rows


def spectra_of(
    record: xr.Dataset, scene: Scene, what: str, series: Iterable[tuple[str, NDArray[Any]]]
) -> tuple[list[Curve], float | None]:
    """[(name, frequencies [Hz], densities), ...] of (name, values over the whole run) after the ramp, and the period of
    the drive.  Raises TooShort."""
    period, times = period_of(scene), record.time.values
    rows = after_ramp(times, scene, INSTANTS, what)
    t = times[rows]
    if period is not None and t[-1] - t[0] < PERIODS * period * (1 - 1e-9):
        raise TooShort(
            f"No {what}: it needs {PERIODS} periods after the ramp of {ramp_of(scene):g} s, "
            f"the record has {(t[-1] - t[0]) / period:.3g}."
        )
    return [(name, *density(t, values[rows], period)) for name, values in series], period


def window_of(curves: list[Curve], period: float | None) -> tuple[float, float, float]:
    """Largest frequency [Hz], least and largest density in which curves of `spectra_of` are shown.

    Up to where the highest of them vanishes, and to the fourth harmonic of the drive.
    """
    _, f, S = max(curves, key=lambda curve: curve[2].max())
    highest = max(float(S.max()), NOISE)
    end = f[highest / 10 ** (DECADES - 1) <= S].max(initial=2 * f[S.argmax()])
    return max(end, 4 / period if period else 0.0, 4 * f[1]), highest / 10**DECADES, 4 * highest


def density(t: NDArray[Any], x: NDArray[Any], period: float | None = None) -> tuple[NDArray[Any], NDArray[Any]]:
    """Frequencies [Hz] and one-sided power spectral density [unit of x squared / Hz] of a series, without its trend.

    Welch's method on equal steps, to which x is interpolated: Hann windows of half the series that overlap by half;
    with a period, of the largest whole number of it in that half, so that it falls on a frequency of the grid.
    """
    grid = np.linspace(t[0], t[-1], len(t))
    rate = (len(t) - 1) / (t[-1] - t[0])
    segment = len(t) // 2
    if period is not None:
        segment = max(round(np.floor(segment / rate / period) * period * rate), 8)
    return welch(np.interp(grid, t, x), rate, segment)


def welch(x: NDArray[Any], rate: float, size: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Frequencies and one-sided density of equally spaced values, as scipy.signal.welch(detrend="linear") has them.

    Loading scipy.signal takes a tenth of what a run of `driven` takes.
    """
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(size) / size))
    pieces = np.lib.stride_tricks.sliding_window_view(x, size)[:: size - size // 2]
    line = np.linspace(-1.0, 1.0, size)
    pieces = pieces - pieces.mean(axis=1, keepdims=True) - np.outer(pieces @ line / (line @ line), line)
    power = np.abs(np.fft.rfft(window * pieces)) ** 2 / (rate * (window @ window))
    power[:, 1 : (size + 1) // 2] *= 2
    return np.fft.rfftfreq(size, 1 / rate), power.mean(axis=0)
