"""Spectra of a run: how the variance of motion and tension is spread over frequencies."""

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch

from ..scene.settings import period_of, ramp_of
from .drawing import TooShort, after_ramp, figure_of, legend_above, unwrapped
from .style import COLORS, COLUMN, new_figure
from .tables import force_unit

#: Least number of instants, and of periods of the drive, of which there is a spectrum.
INSTANTS, PERIODS = 64, 4
#: Decades that are shown below the peak.
DECADES = 6
#: What a panel reaches up to at least [unit of the quantity squared / Hz]: rounding of a constant does not fill it.
NOISE = 1e-12
_LINES = (("-", "blue"), ("--", "red"), ("-.", "green"))


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
    return welch(np.interp(grid, t, x), fs=rate, window="hann", nperseg=segment, detrend="linear")


@figure_of("buoy_position")
def motion_spectrum(record, scene=None) -> Figure:
    """Power spectral density of the position of C after the ramp, and of its turns if the record has them."""
    x = record.buoy_position.values
    panels = [("m", [(name, x[:, i]) for i, name in enumerate("xyz")])]
    turns = [(name, unwrapped(record, name)) for name in ("roll", "pitch", "yaw") if name in record]
    return _spectra(record, scene, "spectrum of the motion", panels + ([("°", turns)] if turns else []))


@figure_of("tension_top", "tension_anchor")
def tension_spectrum(record, scene=None) -> Figure:
    """Power spectral density of the tension at both ends of the cable after the ramp."""
    unit, factor = force_unit(record.tension_top)
    ends = [("upper end", factor * record.tension_top.values), ("anchor", factor * record.tension_anchor.values)]
    return _spectra(record, scene, "spectrum of the tension", [(unit, ends)])


def _spectra(record, scene, what, panels):
    """A panel per (unit, series), its peak and the frequency of the drive marked."""
    t, period = record.time.values, period_of(scene)
    rows = after_ramp(t, scene, INSTANTS, what)
    if period is not None and t[-1] - t[rows[0]] < PERIODS * period * (1 - 1e-9):
        raise TooShort(
            f"No {what}: it needs {PERIODS} periods after the ramp of {ramp_of(scene):g} s, "
            f"the record has {(t[-1] - t[rows[0]]) / period:.2g}."
        )
    figure = new_figure(COLUMN, 0.6 + 2.1 * len(panels))
    grid = figure.subplots(len(panels), squeeze=False)[:, 0]
    for axes, (unit, series) in zip(grid, panels, strict=True):
        _draw(axes, [(name, *density(t[rows], values[rows], period)) for name, values in series], period)
        axes.set_ylabel(f"spectral density [{unit}²/Hz]")
    grid[-1].set_xlabel("frequency [Hz]")
    figure.align_ylabels(grid)
    return figure


def _draw(axes, curves, period):
    for (name, f, S), (line, color) in zip(curves, _LINES, strict=False):
        axes.plot(f, S, line, color=COLORS[color], label=name)
    _, f, S = max(curves, key=lambda curve: curve[2].max())
    peak, highest = f[S.argmax()], max(S.max(), NOISE)
    axes.plot(peak, S.max(), "o", color=COLORS["ink"], ms=4, mfc="none", ls="none", label=f"peak {peak:.3g} Hz")
    floor = highest / 10 ** (DECADES - 1)
    end = f[floor <= S].max(initial=2 * peak)
    if period is not None:
        axes.axvline(1 / period, color="#888888", lw=0.8, ls=":", label=f"drive {1 / period:.3g} Hz")
        end = max(end, 4 / period)
    axes.set(yscale="log", ylim=(highest / 10**DECADES, 4 * highest), xlim=(0, max(end, 4 * f[1])))
    legend_above(axes, len(curves))
