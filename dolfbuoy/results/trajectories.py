"""Figures in space and along the cable: paths of the buoy, shapes of the cable, and tension and curvature along it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.contact import height_of_bed
from ..model.sea import heading
from ..scene.settings import period_of
from .after_ramp import Missing, TooShort, after_ramp
from .draw3d import equal_scale
from .frame import pieces_of, whole_at
from .running import envelope_of
from .series import mean_over_time
from .style import COLORS, COLUMN, Figure, LineCollection, at_least, figure_of, legend_above, new_figure
from .tables import force_unit

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.sections import Scene

#: A motion is drawn as planar if its width is below this fraction of its length.
PLANAR = 0.02
#: Approximate number of frames whose shapes are shown.
SHAPES = 13


@figure_of("buoy_position", part="buoy")
def trajectory(record: xr.Dataset, scene: Scene) -> Figure:
    """Figs. 6 and 10 (left): path of C from above and from the side.

    A motion in one vertical plane x-z or y-z is shown from the side and over time.
    """
    t, x = record.time.values, record.buoy_position.values
    last = _last_period(record, scene)
    wide = widest(x)
    planar = _is_planar(x)
    heights = [panel_height(x[:, [wide, 2]]), 1.3] if planar else [panel_height(x[:, p]) for p in ([0, 1], [wide, 2])]
    figure = new_figure(COLUMN, sum(heights) + 1.1)
    top, bottom = figure.subplots(2, 1, gridspec_kw={"height_ratios": heights})
    if planar:
        _draw_path(top, x[:, [wide, 2]], last)
        label_axes(top, "xy"[wide], "z")
        bottom.plot(t, x[:, wide], color=COLORS["blue"], marker="." if len(t) < 3 else "")
        bottom.set(xlabel="time [s]", ylabel=f"{'xy'[wide]} [m]")
        at_least(bottom)
    else:
        for axes, (i, j) in ((top, (0, 1)), (bottom, (wide, 2))):
            _draw_path(axes, x[:, [i, j]], last)
            label_axes(axes, "xyz"[i], "xyz"[j])
    legend_above(top, 4)
    return figure


@figure_of("buoy_position", part="buoy")
def track(record: xr.Dataset, scene: Scene) -> Figure:
    """Horizontal track of C after the ramp, its mean, and the directions of waves, current, wind and external force."""
    t = record.time.values
    rows = after_ramp(t, scene, 2, "track of the buoy")
    x, directions = record.buoy_position.values[rows, :2], pushes(scene, record.buoy.item())
    figure = new_figure(COLUMN, min(panel_height(x, 2.3), 2.6) + 1.1)
    ratios = (3.2, 1) if directions else (1,)
    axes, *compass = figure.subplots(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
    _draw_path(axes, x, None)
    axes.plot(*mean_over_time(t[rows], x), "+", color=COLORS["red"], ms=9, mew=1.5, ls="none", label="mean", zorder=5)
    label_axes(axes, "x", "y")
    legend_above(axes, 4)
    for panel in compass:
        _draw_compass(panel, directions)
    return figure


def pushes(scene: Scene, name: str | None) -> dict[str, NDArray[Any]]:
    """Horizontal directions (2,) of waves and current, and of wind and external force on the named buoy, if any."""
    buoy = scene.network.buoys.get(name or "")
    named = {"waves": scene.waves, "current": scene.current, "wind": buoy and buoy.wind}
    known = {name: section for name, section in named.items() if section and not getattr(section, "grid", None)}
    found = {name: heading(section.direction_deg)[:2] for name, section in known.items()}
    force = np.array(buoy.external_force.force[:2] if buoy and buoy.external_force else (0.0, 0.0))
    return found | ({"force": force / np.linalg.norm(force)} if force.any() else {})


def _draw_compass(axes: Any, directions: dict[str, NDArray[Any]]) -> None:
    """Draw directions as arrows whose lengths have no meaning."""
    for k, (name, direction) in enumerate(directions.items()):
        color = COLORS[("blue", "green", "orange", "red")[k]]
        axes.quiver(0, 0, *((1 - 0.2 * k) * direction), color=color, angles="xy", scale_units="xy", scale=1, width=0.04)
        axes.plot([], [], color=color, lw=2, label=name)
    axes.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1))
    axes.set_title("directions", fontsize=7.5)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=0)


@figure_of("buoy_position", part="buoy")
def orbit(record: xr.Dataset, scene: Scene) -> Figure:
    """Fig. 10 (left): path of C in the last period of the waves."""
    if scene.waves is None:
        raise Missing("figures.orbit needs waves, which this scene does not have.")
    last = _last_period(record, scene)
    if last is None:
        raise TooShort(f"No orbit: it needs one period of the waves, {scene.waves.main_period:g} s.")
    x = record.buoy_position.values[last]
    if _is_planar(x):
        figure = new_figure(COLUMN, 3.0)
        axes = figure.subplots()
        _draw_path(axes, x[:, [widest(x), 2]], None)
        label_axes(axes, "xy"[widest(x)], "z")
        legend_above(axes, 2)
        return figure
    return _orbit_3d(x)


def _orbit_3d(x: NDArray[Any]) -> Figure:
    middle, half = (x.max(axis=0) + x.min(axis=0)) / 2, (x.max(axis=0) - x.min(axis=0)) / 2
    half = 1.12 * np.maximum(half, 0.35 * half.max())
    box = np.array([middle - half, middle + half])
    figure = new_figure(COLUMN, 3.1, constrained=False)
    axes = figure.add_axes((0, 0.08, 1, 0.92), projection="3d", computed_zorder=False)
    for i, wall in ((0, box[0, 0]), (1, box[1, 1]), (2, box[0, 2])):
        shadow = x.copy()
        shadow[:, i] = wall
        axes.plot(*shadow.T, color="#b0b0b0", lw=0.8)
    axes.plot(*x.T, color=COLORS["blue"], lw=1.4)
    axes.plot(*x[:1].T, "o", color=COLORS["ink"], mfc="none", ms=7, ls="none", label="start of the period")
    axes.plot(*x[-1:].T, "o", color=COLORS["ink"], ms=4.5, ls="none", label="end")
    axes.plot([], [], color="#b0b0b0", lw=0.8, label="projections")
    equal_scale(axes, box, elevation=22, azimuth=-60)
    figure.legend(loc="lower center", ncol=3)
    return figure


def _last_period(record: xr.Dataset, scene: Scene) -> NDArray[Any] | None:
    """Rows of the last period, or None if there is none or the run is shorter."""
    t, period = record.time.values, period_of(scene)
    if period is None or t[-1] - t[0] < period or len(t) < 3:
        return None
    return np.flatnonzero(t >= t[-1] - period * (1 + 1e-9))


def _is_planar(x: NDArray[Any]) -> Any:
    extent = np.ptp(x[:, :2], axis=0)
    return extent.min() <= PLANAR * extent.max() + 1e-6


def widest(x: NDArray[Any]) -> int:
    """Horizontal direction in which points (..., 3) extend most: 0 for x, 1 for y."""
    extent = np.ptp(x.reshape(-1, 3)[:, :2], axis=0)
    return int(extent[1] > extent[0])


def _draw_path(axes: Any, x: NDArray[Any], last: NDArray[Any] | None) -> None:
    """Draw a path in a plane with its start and end, and the rows `last` highlighted."""
    axes.plot(*x.T, color=COLORS["blue"], lw=0.8)
    if last is not None and len(last) < len(x):
        axes.plot(*x[last].T, color=COLORS["red"], lw=1.4, label="last period")
    axes.plot(*x[0], "o", color=COLORS["ink"], mfc="none", ms=7, label="start", ls="none", zorder=4)
    axes.plot(*x[-1], "o", color=COLORS["ink"], ms=4.5, label="end", ls="none", zorder=4)
    equal_axes(axes, x)


def equal_axes(axes: Any, x: NDArray[Any]) -> None:
    """Set equal scales: the panel keeps its shape and shows a little more than the points (n, 2)."""
    middle, half = (x.max(axis=0) + x.min(axis=0)) / 2, (x.max(axis=0) - x.min(axis=0)) / 2
    half = np.maximum(1.08 * half, max(0.05 * half.max(), 5e-3))
    axes.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
    axes.set_aspect("equal", adjustable="datalim")


def panel_height(x: NDArray[Any], panel_width: float = 2.9) -> float:
    """Height of a panel of this width that suits the points (n, 2) [inch]."""
    width, height = np.ptp(x, axis=0)
    return float(np.clip(1.05 * panel_width * height / width, 1.0, 3.2)) if width > 0 else 2.4


def label_axes(axes: Any, horizontal: str, vertical: str) -> None:
    """Label the axes with two coordinates in metres."""
    axes.set(xlabel=f"{horizontal} [m]", ylabel=f"{vertical} [m]")


@figure_of("cable_position", part="cable")
def shapes(record: xr.Dataset, scene: Scene) -> Figure:
    """Shapes of the cable from the side, coloured by time: over the last period, or over the run; water and bed."""
    frames, period, first = record.frame.values, period_of(scene), 0
    if period is not None and frames[-1] - frames[0] > period:
        first = int(np.searchsorted(frames, frames[-1] - period * (1 + 1e-9)))
    chosen = np.unique(np.linspace(first, len(frames) - 1, SHAPES).round().astype(int))
    t, x = frames[chosen], record.cable_position.values[chosen]
    wide = widest(x)
    curves = x[:, :, [wide, 2]]
    low, high = curves.min(axis=(0, 1)), curves.max(axis=(0, 1))
    room, middle = 0.35 * (high - low).max(), (low[0] + high[0]) / 2
    levels = (0.0, -scene.sea.depth) if scene.sea is not None else ()  # of still water and bed, shown if near
    near = [[[middle, z]] for z in levels if low[1] - room <= z <= high[1] + room]
    seen = np.concatenate([curves.reshape(-1, 2), *near])
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
    if scene.sea is not None:
        ends = np.array([x.reshape(-1, 3).mean(axis=0)] * 2)
        low, high = x[..., wide].min(), x[..., wide].max()
        ends[:, wide] = 2 * low - high, 2 * high - low
        if _draw_levels(axes, seen, ends[:, wide], height_of_bed(scene, ends)):
            legend_above(axes, 2)
    if len(t) > 1:
        figure.colorbar(lines, ax=axes, label="time [s]", shrink=0.9, aspect=25)
    return figure


def _draw_levels(axes: Any, seen: NDArray[Any], ends: NDArray[Any], heights: NDArray[Any]) -> bool:
    """Draw still water and bed below the curves, with the ground shaded; True if either is visible."""
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


@figure_of("cable_tension", "cable_tension_maximum", "s_cell", part="cable")
def envelope(record: xr.Dataset, scene: Scene) -> Figure:
    """Least and largest tension along the cable over all steps after the ramp, and mean over frames, per element."""
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


#: Variables of the largest curvature over all steps, the preferred one first.
_LARGEST = "curvature_maximum_after_ramp", "curvature_maximum"


@figure_of("curvature", "s", part="cable")
def curvature(record: xr.Dataset, scene: Scene) -> Figure:
    """Largest curvature along the cable over all steps after the ramp, its mean over frames, and the allowed one."""
    frames, s = record.frame.values, record.s.values
    rows = after_ramp(frames, scene, 2, "curvature along the cable")
    values = record.curvature.values[rows]
    largest = next((record[name].values for name in _LARGEST if name in record), values.max(axis=0))
    if not largest.any():
        raise Missing("It does not bend.")
    # otherwise a power of ten would stand above the axis for a small curvature
    unit, factor = ("1/m", 1.0) if largest.max() > 1e-2 else ("1/km", 1e3)
    values, largest = factor * values, factor * largest
    figure = new_figure(COLUMN, 2.6)
    axes = figure.subplots()
    axes.fill_between(s, values.min(axis=0), largest, color=COLORS["sky"], alpha=0.25, lw=0)
    axes.plot(s, largest, "--", color=COLORS["red"], label="largest")
    axes.plot(s, mean_over_time(frames[rows], values), "-", color=COLORS["ink"], label="mean")
    begin, number = 0.0, int(np.atleast_1d(record.cable_of_node.values)[0])
    for section in scene.network.sections_of(number):
        if section.minimum_bend_radius is not None:
            allowed = [factor / section.minimum_bend_radius] * 2
            label = "allowed" if "allowed" not in axes.get_legend_handles_labels()[1] else None
            axes.plot([begin, begin + section.length], allowed, color=COLORS["blue"], lw=1, label=label)
        begin += section.length
    span = f"all steps and {len(rows)} instants, from {frames[rows][0]:.4g} to {frames[rows][-1]:.4g} s"
    axes.set(xlabel=f"arc length from the anchor, s [m]\n({span})", ylabel=f"curvature [{unit}]")
    axes.margins(x=0.01)
    legend_above(axes, 3)
    return figure
