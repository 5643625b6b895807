"""Figures of a run, as in Sect. 5 of the paper: PNG and SVG that one would print."""

from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from ..scene.settings import period_of
from .folder import enlist
from .paraview import read_run
from .snapshot import equal_scale, snapshot
from .style import COLORS, COLUMN, STYLE, files_of, new_figure, save

#: A run of more periods than this gets an enlarged end in the figures over time.
MANY_PERIODS = 6
#: A motion is drawn as planar if its width is below this share of its length.
PLANAR = 0.02


def draw_all(folder: str | Path) -> list[Path]:
    """Draw every figure that the run in `folder` has data for; returns the files in folder/figures/.

    Raises InputError if the folder holds no run.
    """
    record, scene = read_run(folder)
    target, written = Path(folder) / "figures", []
    for name, draw in FIGURES.items():
        figure = draw(record, scene)
        if figure is not None:
            enlist(folder, files_of(target / name))
            target.mkdir(exist_ok=True)
            written += save(figure, target / name)
    return written


# -- quantities over time ----------------------------------------------------------------------------------------------


@matplotlib.rc_context(STYLE)
def tension(record, scene) -> Figure | None:
    """Figs. 6 (right) and 9 (left): tension at both ends of the cable; None without a cable."""
    if "tension_top" not in record:
        return None
    curves = [
        (record.tension_top.values / 1e3, "-", COLORS["blue"], r"$|\mathbf{T}_{bnd}|$, upper end"),
        (record.tension_anchor.values / 1e3, "--", COLORS["red"], r"$T_h(0)$, anchor"),
    ]
    return _over_time(record, scene, [("tension [kN]", curves)])


@matplotlib.rc_context(STYLE)
def heave(record, scene) -> Figure | None:
    """Figs. 7 and 9 (right): height of C and of the water above it, and their difference; None without a buoy."""
    if "buoy_position" not in record:
        return None
    z = record.buoy_position.values[:, 2]
    curves = [(z, "-", COLORS["blue"], r"$r_{C,z}$, centre of mass")]
    if "surface_elevation" not in record:
        return _over_time(record, scene, [("height [m]", curves)])
    water = record.surface_elevation.values
    curves.append((water, "--", COLORS["red"], r"$z_w$, water surface"))
    difference = [(z - water, "-", COLORS["blue"], None)]
    return _over_time(record, scene, [("height [m]", curves), (r"$r_{C,z} - z_w$ [m]", difference)])


@matplotlib.rc_context(STYLE)
def cone_angle(record, scene) -> Figure | None:
    """Figs. 8 (left) and 10 (right): angle between the vertical and the axis of the buoy; None without a buoy."""
    if "cone_angle" not in record:
        return None
    return _over_time(record, scene, [("cone angle [°]", [(record.cone_angle.values, "-", COLORS["blue"], None)])])


def _over_time(record, scene, panels):
    """One panel per (label, curves) over the same time; the end of the first one enlarged if there are many periods."""
    t, period = record.time.values, period_of(scene)
    many = period is not None and t[-1] - t[0] > MANY_PERIODS * period
    panels = panels + panels[:1] if many else panels
    figure = new_figure(COLUMN, 0.5 + 1.65 * len(panels))
    rows = figure.subplots(len(panels), squeeze=False)[:, 0]
    for i, (axes, (label, curves)) in enumerate(zip(rows, panels, strict=True)):
        window = t >= t[-1] - 3 * period if many and i == len(panels) - 1 else np.ones(len(t), dtype=bool)
        for values, line, color, name in curves:
            axes.plot(t[window], values[window], line, color=color, label=name, marker="." if len(t) < 3 else "")
        axes.set_ylabel(label)
        axes.margins(x=0.01)
        _at_least(axes, 1e-3)
    if many:
        rows[-1].set_title("last three periods", loc="left")
    if len(panels[0][1]) > 1:
        rows[0].legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=2, borderaxespad=0.1)
    rows[-1].set_xlabel("time [s]")
    figure.align_ylabels(rows)
    return figure


def _at_least(axes, span):
    """Keep rounding noise of a constant from filling the panel."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim((low + high) / 2 - span / 2, (low + high) / 2 + span / 2)


# -- paths -------------------------------------------------------------------------------------------------------------


@matplotlib.rc_context(STYLE)
def trajectory(record, scene) -> Figure | None:
    """Figs. 6 and 10 (left): path of C from above and from the side; None without a buoy.

    A motion in one vertical plane x-z or y-z is shown from the side and over time.
    """
    if "buoy_position" not in record:
        return None
    t, x = record.time.values, record.buoy_position.values
    last = _last_period(record, scene)
    wide = _widest(x)
    planar = _is_planar(x)
    heights = [_panel_height(x[:, [wide, 2]]), 1.3] if planar else [_panel_height(x[:, p]) for p in ([0, 1], [wide, 2])]
    figure = new_figure(COLUMN, sum(heights) + 1.1)
    top, bottom = figure.subplots(2, 1, gridspec_kw={"height_ratios": heights})
    if planar:
        _draw_path(top, x[:, [wide, 2]], last)
        _label(top, "xy"[wide], "z")
        bottom.plot(t, x[:, wide], color=COLORS["blue"], marker="." if len(t) < 3 else "")
        bottom.set(xlabel="time [s]", ylabel=f"{'xy'[wide]} [m]")
        _at_least(bottom, 1e-3)
    else:
        for axes, (i, j) in ((top, (0, 1)), (bottom, (wide, 2))):
            _draw_path(axes, x[:, [i, j]], last)
            _label(axes, "xyz"[i], "xyz"[j])
    top.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=4, borderaxespad=0.1, columnspacing=1.2)
    return figure


@matplotlib.rc_context(STYLE)
def orbit(record, scene) -> Figure | None:
    """Fig. 10 (left): path of C in the last wave period; None without waves or a period of them."""
    if "buoy_position" not in record or scene.waves is None:
        return None
    last = _last_period(record, scene)
    if last is None:
        return None
    x = record.buoy_position.values[last]
    if _is_planar(x):
        figure = new_figure(COLUMN, 3.0)
        axes = figure.subplots()
        _draw_path(axes, x[:, [_widest(x), 2]], None)
        _label(axes, "xy"[_widest(x)], "z")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=2, borderaxespad=0.1)
        return figure
    return _orbit_3d(x)


def _orbit_3d(x):
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


def _last_period(record, scene):
    """Rows of the last period, or None if there is none or the run is shorter."""
    t, period = record.time.values, period_of(scene)
    if period is None or t[-1] - t[0] < period or len(t) < 3:
        return None
    return np.flatnonzero(t >= t[-1] - period * (1 + 1e-9))


def _is_planar(x):
    extent = np.ptp(x[:, :2], axis=0)
    return extent.min() <= PLANAR * extent.max() + 1e-6


def _widest(x):
    """0 for x, 1 for y: the horizontal direction of the greater extent."""
    extent = np.ptp(x.reshape(-1, 3)[:, :2], axis=0)
    return int(extent[1] > extent[0])


def _draw_path(axes, x, last):
    """A path in a plane with its start and end, the rows `last` set off."""
    axes.plot(*x.T, color=COLORS["blue"], lw=0.8)
    if last is not None and len(last) < len(x):
        axes.plot(*x[last].T, color=COLORS["red"], lw=1.4, label="last period")
    axes.plot(*x[0], "o", color=COLORS["ink"], mfc="none", ms=7, label="start", ls="none", zorder=4)
    axes.plot(*x[-1], "o", color=COLORS["ink"], ms=4.5, label="end", ls="none", zorder=4)
    _equal(axes, x)


def _equal(axes, x):
    """Equal scale: the panel keeps its shape and shows a little more than the path."""
    middle, half = (x.max(axis=0) + x.min(axis=0)) / 2, (x.max(axis=0) - x.min(axis=0)) / 2
    half = np.maximum(1.08 * half, max(0.05 * half.max(), 5e-3))
    axes.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
    axes.set_aspect("equal", adjustable="datalim")


def _panel_height(x, panel_width=2.9):
    """Height of a panel of that width [inch] that suits the path."""
    width, height = np.ptp(x, axis=0)
    return float(np.clip(1.05 * panel_width * height / width, 1.0, 3.2)) if width > 0 else 2.4


def _label(axes, horizontal, vertical):
    axes.set(xlabel=f"{horizontal} [m]", ylabel=f"{vertical} [m]")


@matplotlib.rc_context(STYLE)
def shapes(record, scene) -> Figure | None:
    """Shapes of the cable from the side, coloured by time: over the last period, or over the run; None without."""
    if "cable_position" not in record:
        return None
    chosen = _chosen_frames(record.frame.values, period_of(scene))
    t, x = record.frame.values[chosen], record.cable_position.values[chosen]
    wide = _widest(x)
    curves = x[:, :, [wide, 2]]
    figure = new_figure(COLUMN, 0.5 + _panel_height(curves.reshape(-1, 2), 2.3))
    axes = figure.subplots()
    lines = LineCollection(curves, array=t, cmap="viridis", lw=1.0)
    lines.set_clim(t[0], t[-1] if t[-1] > t[0] else t[0] + 1.0)
    axes.add_collection(lines)
    axes.plot(*curves[0, 0], "s", color=COLORS["ink"], ms=4)
    _equal(axes, curves.reshape(-1, 2))
    _label(axes, "xy"[wide], "z")
    if len(t) > 1:
        figure.colorbar(lines, ax=axes, label="time [s]", shrink=0.9, aspect=25)
    return figure


def _chosen_frames(frames, period, count=13):
    """Numbers of about `count` frames, evenly over the last period if there is one, else over the run."""
    first = 0
    if period is not None and frames[-1] - frames[0] > period:
        first = int(np.searchsorted(frames, frames[-1] - period * (1 + 1e-9)))
    return np.unique(np.linspace(first, len(frames) - 1, count).round().astype(int))


#: Name of the files: what draws them, from (record, scene); None if the run has nothing to show.
FIGURES: dict[str, Callable] = {
    "trajectory": trajectory,
    "orbit": orbit,
    "tension": tension,
    "heave": heave,
    "cone_angle": cone_angle,
    "shapes": shapes,
    "snapshot": snapshot,
}
