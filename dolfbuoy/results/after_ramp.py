"""Rows and spectra of a run after its ramp, and the scene of a record."""

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

#: Least number of instants, and of excitation periods, for which a spectrum is computed.
INSTANTS, PERIODS = 64, 4
#: Decades shown below the peak of a spectrum, and the least density that counts as a peak [unit of the series squared /
#: Hz], so that the rounding errors of a constant do not fill a panel.
DECADES, NOISE = 6, 1e-12
#: Fraction of the ramp from which an instant counts as after it, so that the end of the ramp counts despite rounding.
AFTER = 1 - 1e-9


#: Name, frequencies [Hz], densities.
Curve = tuple[str, NDArray[Any], NDArray[Any]]


class Missing(InputError):
    """Error for a record or scene that lacks the data of a figure."""


class TooShort(InputError):
    """Error for a record that is too short for a figure."""


def scene_of(record: xr.Dataset) -> Scene:
    """The scene in the attributes of a record.  Raises InputError if it is missing or has an old format."""
    if "scene" not in record.attrs:
        raise InputError("This record does not carry its scene: give the scene too.")
    check_format(record.attrs, "This record")
    return kept_scene(record.attrs["scene"])


def after_ramp(times: NDArray[Any], scene: Scene, at_least: int, what: str) -> NDArray[Any]:
    """Rows of the times after the ramp.  Raises TooShort, naming `what` needs them, if there are too few."""
    ramp = ramp_of(scene)
    rows = np.flatnonzero(times >= ramp * AFTER)
    if len(rows) < at_least:
        begin = f"the ramp of {ramp:g} s" if ramp else "the start"
        raise TooShort(f"No {what}: it needs {at_least} instants after {begin}, the record has {len(rows)}.")
    return rows


def spectra_of(
    record: xr.Dataset, scene: Scene, what: str, series: Iterable[tuple[str, NDArray[Any]]]
) -> tuple[list[Curve], float | None]:
    """Spectra [(name, frequencies [Hz], densities), ...] after the ramp, and the excitation period.  Raises TooShort.
    series: (name, values over the whole run)."""
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
    """Largest frequency [Hz], least and largest density of the plot of the curves of `spectra_of`.

    Extends to where the highest curve vanishes, and at least to the fourth harmonic of the excitation.
    """
    _, f, S = max(curves, key=lambda curve: curve[2].max())
    highest = max(float(S.max()), NOISE)
    end = f[highest / 10 ** (DECADES - 1) <= S].max(initial=2 * f[S.argmax()])
    return max(end, 4 / period if period else 0.0, 4 * f[1]), highest / 10**DECADES, 4 * highest


def density(t: NDArray[Any], x: NDArray[Any], period: float | None = None) -> tuple[NDArray[Any], NDArray[Any]]:
    """Frequencies [Hz] and one-sided power spectral density [unit of x squared / Hz] of a detrended series.

    Welch's method, with x interpolated to equal steps: Hann windows of half the series, overlapping by half; with a
    period, of the largest whole number of periods in that half, to put the period on a grid frequency.
    """
    grid = np.linspace(t[0], t[-1], len(t))
    rate = (len(t) - 1) / (t[-1] - t[0])
    segment = len(t) // 2
    if period is not None:
        segment = max(round(np.floor(segment / rate / period) * period * rate), 8)
    return welch(np.interp(grid, t, x), rate, segment)


def welch(x: NDArray[Any], rate: float, size: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Frequencies and one-sided density of equally spaced values, as from scipy.signal.welch(detrend="linear").

    Not imported from scipy.signal, as loading that takes a tenth of the time of a run of `driven`.
    """
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(size) / size))
    pieces = np.lib.stride_tricks.sliding_window_view(x, size)[:: size - size // 2]
    line = np.linspace(-1.0, 1.0, size)
    pieces = pieces - pieces.mean(axis=1, keepdims=True) - np.outer(pieces @ line / (line @ line), line)
    power = np.abs(np.fft.rfft(window * pieces)) ** 2 / (rate * (window @ window))
    power[:, 1 : (size + 1) // 2] *= 2
    return np.fft.rfftfreq(size, 1 / rate), power.mean(axis=0)
