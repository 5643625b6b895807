"""Spectra of a run: how the variance of motion and tension is spread over frequencies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .after_ramp import spectra_of, window_of
from .drawing import figure_of, legend_above
from .series import unwrapped
from .style import COLORS, COLUMN, Figure, new_figure
from .tables import force_unit

if TYPE_CHECKING:
    import xarray as xr

    from ..scene.sections import Scene

_LINES = (("-", "blue"), ("--", "red"), ("-.", "green"))


@figure_of("buoy_position", part="buoy")
def motion_spectrum(record: xr.Dataset, scene: Scene) -> Figure:
    """Power spectral density of the position of C after the ramp, and of its turns if the record has them."""
    x = record.buoy_position.values
    panels = [("m", [(name, x[:, i]) for i, name in enumerate("xyz")])]
    turns = [(name, unwrapped(record, name)) for name in ("roll", "pitch", "yaw") if name in record]
    return _spectra(record, scene, "spectrum of the motion", panels + ([("°", turns)] if turns else []))


@figure_of("tension_top", "tension_anchor", part="cable")
def tension_spectrum(record: xr.Dataset, scene: Scene) -> Figure:
    """Power spectral density of the tension at both ends of the cable after the ramp."""
    unit, factor = force_unit(record.tension_top)
    ends = [("upper end", factor * record.tension_top.values), ("anchor", factor * record.tension_anchor.values)]
    return _spectra(record, scene, "spectrum of the tension", [(unit, ends)])


def _spectra(record: xr.Dataset, scene: Scene, what: str, panels: list[tuple[str, list[tuple[Any, ...]]]]) -> Figure:
    """A panel per (unit, series), its peak and the frequency of the drive marked."""
    figure = new_figure(COLUMN, 0.6 + 2.1 * len(panels))
    grid = figure.subplots(len(panels), squeeze=False)[:, 0]
    for axes, (unit, series) in zip(grid, panels, strict=True):
        _draw(axes, *spectra_of(record, scene, what, series))
        axes.set_ylabel(f"spectral density [{unit}²/Hz]")
    grid[-1].set_xlabel("frequency [Hz]")
    figure.align_ylabels(grid)
    return figure


def _draw(axes: Any, curves: list[tuple[Any, ...]], period: float | None) -> None:
    for (name, f, S), (line, color) in zip(curves, _LINES, strict=False):
        axes.plot(f, S, line, color=COLORS[color], label=name)
    _, f, S = max(curves, key=lambda curve: curve[2].max())
    peak, (end, *shown) = f[S.argmax()], window_of(curves, period)
    axes.plot(peak, S.max(), "o", color=COLORS["ink"], ms=4, mfc="none", ls="none", label=f"peak {peak:.3g} Hz")
    if period is not None:
        axes.axvline(1 / period, color="#888888", lw=0.8, ls=":", label=f"drive {1 / period:.3g} Hz")
    axes.set(yscale="log", ylim=shown, xlim=(0, end))
    legend_above(axes, len(curves))
