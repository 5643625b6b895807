"""Figures along the cable: its shapes, and the range of the tension in it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.seabed import height_of_bed
from ..scene.settings import period_of
from .drawing import figure_of, legend_above
from .frame import pieces_of, whole_at
from .running import envelope_of
from .style import COLORS, COLUMN, Figure, LineCollection, new_figure
from .tables import force_unit
from .trajectories import equal_axes, label_axes, panel_height, widest

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.sections import Scene


@figure_of("cable_position", part="cable")
def shapes(record: xr.Dataset, scene: Scene) -> Figure:
    """Shapes of the cable from the side, coloured by time: over the last period, or over the run; water and bed."""
    chosen = _chosen_frames(record.frame.values, period_of(scene))
    t, x = record.frame.values[chosen], record.cable_position.values[chosen]
    wide = widest(x)
    curves = x[:, :, [wide, 2]]
    seen = np.concatenate([curves.reshape(-1, 2), *_levels(scene, curves)])
    figure = new_figure(COLUMN, 0.75 + panel_height(seen, 2.3))
    axes = figure.subplots()
    pieces = [pieces_of(curve, whole_at(record, time)) for curve, time in zip(curves, t, strict=True)]
    parts, at = itertools.chain.from_iterable(pieces), np.repeat(t, [len(each) for each in pieces])
    lines = LineCollection(list(parts), array=at, cmap="viridis", lw=1.0)
    lines.set_clim(t[0], t[-1] if t[-1] > t[0] else t[0] + 1.0)
    axes.add_collection(lines)
    axes.plot(*curves[0, 0], "s", color=COLORS["ink"], ms=4)
    equal_axes(axes, seen)
    label_axes(axes, "xy"[wide], "z")
    if scene.sea is not None and _draw_levels(axes, seen, *_bed_below(scene, x, wide)):
        legend_above(axes, 2)
    if len(t) > 1:
        figure.colorbar(lines, ax=axes, label="time [s]", shrink=0.9, aspect=25)
    return figure


def _levels(scene: Scene, curves: NDArray[Any]) -> list[list[list[float]]]:
    """Heights of still water and bed, as points of the picture, where they are near enough to the cable to be shown."""
    if scene.sea is None:
        return []
    low, high = curves.min(axis=(0, 1)), curves.max(axis=(0, 1))
    room, x = 0.35 * (high - low).max(), (low[0] + high[0]) / 2
    return [[[x, z]] for z in (0.0, -scene.sea.depth) if low[1] - room <= z <= high[1] + room]


def _bed_below(scene: Scene, x: NDArray[Any], wide: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Ends (2,) and heights (2,) of the bed in the picture of the positions x, wide of what they take up."""
    ends = np.array([x.reshape(-1, 3).mean(axis=0)] * 2)
    low, high = x[..., wide].min(), x[..., wide].max()
    ends[:, wide] = 2 * low - high, 2 * high - low
    return ends[:, wide], height_of_bed(scene, ends)


def _draw_levels(axes: Any, seen: NDArray[Any], ends: NDArray[Any], heights: NDArray[Any]) -> bool:
    """Still water and bed below the curves, with the ground shaded; True if any is in the picture."""
    low, high = seen[:, 1].min(), seen[:, 1].max()
    if high >= 0:
        axes.axhline(0, color=COLORS["sky"], lw=1.2, zorder=1, label="still water")
    if low <= heights.max():
        style = {"color": COLORS["sand"], "zorder": 1}
        if np.ptp(heights):
            axes.plot(ends, heights, lw=1.2, label="sea bed", **style)
            axes.fill_between(ends, heights, heights.min() - (high - low), color=COLORS["sand"], alpha=0.35, lw=0)
        else:
            axes.axhline(heights[0], lw=1.2, label="sea bed", **style)
            axes.axhspan(2 * heights[0] - high, heights[0], color=COLORS["sand"], alpha=0.35, lw=0, zorder=0.5)
    return bool(high >= 0 or low <= heights.max())


def _chosen_frames(frames: NDArray[Any], period: float | None, count: int = 13) -> Any:
    """Numbers of about `count` frames, evenly over the last period if there is one, else over the run."""
    first = 0
    if period is not None and frames[-1] - frames[0] > period:
        first = int(np.searchsorted(frames, frames[-1] - period * (1 + 1e-9)))
    return np.unique(np.linspace(first, len(frames) - 1, count).round().astype(int))


@figure_of("cable_tension", "cable_tension_maximum", "s_cell", part="cable")
def envelope(record: xr.Dataset, scene: Scene) -> Figure:
    """Least and largest tension along the cable in all steps after the ramp, and the mean of frames, per element."""
    s, found = record.s_cell.values, envelope_of(record, scene)
    unit, factor = force_unit([found.least, found.largest])
    low, mean, high = factor * found.least, factor * found.mean, factor * found.largest
    figure = new_figure(COLUMN, 2.6)
    axes = figure.subplots()
    mark = "." if len(s) <= 30 else ""
    axes.fill_between(s, low, high, color=COLORS["sky"], alpha=0.25, lw=0)
    axes.plot(s, high, "--", color=COLORS["red"], marker=mark, label="largest")
    axes.plot(s, mean, "-", color=COLORS["ink"], marker=mark, label="mean")
    axes.plot(s, low, ":", color=COLORS["blue"], marker=mark, label="least")
    if low.min() < 0:
        axes.axhline(0, color="#888888", lw=0.7)
    span = f"all steps from {found.begin:.4g} to {found.end:.4g} s, mean of {found.frames} instants"
    axes.set(xlabel=f"arc length from the anchor, s [m]\n({span})", ylabel=f"tension [{unit}]")
    axes.margins(x=0.01)
    legend_above(axes, 3)
    return figure
