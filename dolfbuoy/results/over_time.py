"""Figures of a run over time, as in Sect. 5 of the paper: tensions, heave, angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..scene.settings import period_of
from .after_ramp import spectra_of, window_of
from .quantities import ERROR, QUANTITIES
from .quantity import Quantity
from .series import unwrapped
from .style import COLORS, COLUMN, FIGURES, Figure, at_least, draws, figure_of, legend_above, new_figure
from .tables import force_unit, unit_of

if TYPE_CHECKING:
    import xarray as xr

    from ..scene.sections import Scene

#: Runs longer than this many periods get an enlarged view of their end.
MANY_PERIODS = 6


@figure_of("tension_top", "tension_anchor", part="cable")
def tension(record: xr.Dataset, scene: Scene) -> Figure:
    """Figs. 6 (right) and 9 (left): tension at both ends of the cable."""
    unit, factor = force_unit([record.tension_top, record.tension_anchor])
    errors = [_error(record, name, factor) for name in ("tension_top", "tension_anchor")]
    curves = [
        (factor * record.tension_top.values, "-", COLORS["blue"], "upper end", errors[0]),
        (factor * record.tension_anchor.values, "--", COLORS["red"], "anchor", errors[1]),
    ]
    return _over_time(record, scene, [(f"tension [{unit}]", curves)])


@figure_of("buoy_position", part="buoy")
def heave(record: xr.Dataset, scene: Scene) -> Figure:
    """Figs. 7 and 9 (right): height of C and of the water above it, and their difference."""
    z = record.buoy_position.values[:, 2]
    error = _error(record, "buoy_position", (0.0, 0.0, 1.0))
    curves: list[Any] = [(z, "-", COLORS["blue"], r"$r_{C,z}$, centre of mass", error)]
    if "surface_elevation" not in record:
        return _over_time(record, scene, [("height [m]", curves)])
    water = record.surface_elevation.values
    curves.append((water, "--", COLORS["red"], r"$z_w$, water surface"))
    difference = [(z - water, "-", COLORS["blue"], None)]
    return _over_time(record, scene, [("height [m]", curves), (r"$r_{C,z} - z_w$ [m]", difference)])


def of_quantity(quantity: Quantity) -> Any:
    """The figure of a scalar quantity of a cable or buoy."""

    def draw(record: xr.Dataset, scene: Scene) -> Figure:
        values = record[quantity.name].values
        unit, factor = unit_of(values, quantity.unit.replace("degree", "°"))
        label = f"{quantity.name.replace('_', ' ')} [{unit}]"
        curve = factor * values, "-", COLORS["blue"], None, _error(record, quantity.name, factor)
        return _over_time(record, scene, [(label, [curve])])

    draw.__name__, draw.__doc__ = quantity.name, f"Over time: {quantity.long_name}."
    return draws(quantity.name, part=quantity.kind)(draw)


#: Figs. 8 (left) and 10 (right): angle between the vertical and the axis of the buoy.
cone_angle = FIGURES["cone_angle"] = of_quantity(QUANTITIES["cone_angle"])


@figure_of("roll", "pitch", "yaw", part="buoy")
def roll_pitch_yaw(record: xr.Dataset, scene: Scene) -> Figure:
    """Roll, pitch and yaw of the buoy, each in its own panel."""
    panels = [
        (f"{name} [°]", [(unwrapped(record, name), "-", COLORS[color], None, _error(record, name))])
        for name, color in (("roll", "blue"), ("pitch", "red"), ("yaw", "green"))
    ]
    return _over_time(record, scene, panels, height=1.2, enlarge=False)


def _error(record: xr.Dataset, name: str, factor: Any = 1.0) -> Any:
    """Time-step error over time, times a factor, or the sum over components times factors; None if unknown."""
    if name + ERROR not in record:
        return None
    values = record[name + ERROR].values
    return factor * values if np.ndim(factor) == 0 else values @ np.array(factor)


def _over_time(
    record: xr.Dataset, scene: Scene, panels: list[tuple[str, list[Any]]], height: float = 1.65, enlarge: bool = True
) -> Figure:
    """One panel per (label, curves) on a common time axis; the end of the first is enlarged if there are many periods.

    curves: (values, line, color, label), optionally with the time-step error, drawn as a band on one side.
    """
    t, period = record.time.values, period_of(scene)
    many = enlarge and period is not None and t[-1] - t[0] > MANY_PERIODS * period
    panels = panels + panels[:1] if many else panels
    figure = new_figure(COLUMN, 0.5 + height * len(panels))
    rows = figure.subplots(len(panels), squeeze=False)[:, 0]
    for i, (axes, (label, curves)) in enumerate(zip(rows, panels, strict=True)):
        begin = t[-1] - 3 * period if period is not None and many and i == len(panels) - 1 else t[0]
        window = t >= begin
        for values, line, color, name, *errors in curves:
            for error in (error for error in errors if error is not None):
                axes.fill_between(t[window], values[window], (values - error)[window], color=color, alpha=0.3, lw=0)
            axes.plot(t[window], values[window], line, color=color, label=name, marker="." if len(t) < 3 else "")
        axes.set_ylabel(label)
        axes.margins(x=0.01)
        at_least(axes)
    if many:
        rows[-1].set_title("last three periods", loc="left")
    if len(panels[0][1]) > 1:
        legend_above(rows[0], 2)
    rows[-1].set_xlabel("time [s]")
    figure.align_ylabels(rows)
    return figure


_LINES = (("-", "blue"), ("--", "red"), ("-.", "green"))


@figure_of("buoy_position", part="buoy")
def motion_spectrum(record: xr.Dataset, scene: Scene) -> Figure:
    """Power spectral density of the position of C after the ramp, and of roll, pitch and yaw if recorded."""
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
    """A panel per (unit, series), with its peak and the excitation frequency marked."""
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
