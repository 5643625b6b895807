"""Figures of offset curves and of the linear response."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .labelled import complex_of
from .linear_record import each_buoy, each_tension
from .offset_record import top_tension
from .style import COLORS, PAGE, PALETTE, STYLE, Figure, Line2D, legend_below, matplotlib, new_figure
from .tables import force_unit

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

#: Line styles of several buoys.
STYLES = ("-", "--", ":", "-.")
#: Most directions named in a legend.
MOST_NAMED = 12
#: Marks of invalid states.
MARKS = {"slack": ("x", "line slack"), "under": ("v", "buoy under water")}


def offset_curves(dataset: xr.Dataset, anchors: Iterable[tuple[float, ...]] = ()) -> Figure:
    """Offset along the load, top tension, and watch circles; states with a slack line or submerged buoy are marked.

    anchors: (x, y) of marks in the plan view [m].
    """
    load = dataset.slack.dims[1]
    sizes, directions = dataset[load].values, dataset.direction.values
    unit, factor = force_unit(sizes) if load == "force" else ("m/s", 1.0)
    title = f"{'force' if load == 'force' else 'current at the surface'} [{unit}]"
    with matplotlib.rc_context(STYLE):
        figure = new_figure(PAGE, 3.1)
        left, middle, right = figure.subplots(1, 3)
        colours = matplotlib.colormaps["plasma"](np.linspace(0, 0.9, len(directions)))
        top = top_tension(dataset).values
        tension, scale = force_unit(top)
        for i, colour in enumerate(colours):
            one = dataset.isel(direction=i)
            for (_, part), style in zip(each_buoy(one), itertools.cycle(STYLES)):
                _curve(left, factor * sizes, part.offset_along.values, one, colour, style)
            _curve(middle, factor * sizes, scale * top[i], one, colour)
        left.set(xlabel=title, ylabel="offset of C along the load [m]")
        middle.set(xlabel=title, ylabel=f"tension at the upper end [{tension}]")
        for _, part in each_buoy(dataset):
            _plan(right, part, sizes, directions, colours)
        for anchor in anchors:
            right.plot(*anchor, "s", color=COLORS["ink"], ms=4)
        right.set(xlabel="x [m]", ylabel="y [m]")
        right.set_aspect("equal", adjustable="datalim")
        handles = _legend(dataset, directions, colours)
        legend_below(figure, 0.16 * -(-len(handles) // 6) + 0.09, min(len(handles), 6), handles)
    return figure


def _curve(
    axes: Any, x: NDArray[Any], y: NDArray[Any], one: xr.Dataset, colour: NDArray[Any], style: str = "-"
) -> None:
    axes.plot(x, y, ".", ls=style, color=colour, ms=3)
    for name, (mark, _) in MARKS.items():
        bad = one[name].values.astype(bool)
        axes.plot(x[bad], y[bad], mark, color=COLORS["red"], ms=5, ls="none")


def _plan(axes: Any, dataset: xr.Dataset, sizes: NDArray[Any], directions: NDArray[Any], colours: NDArray[Any]) -> None:
    x, y = (dataset.buoy_position.sel(xyz=name).values for name in "xy")
    whole = len(directions) > 2 and np.ptp(np.diff([*directions, directions[0] + 360])) < 1e-6
    for j in range(len(sizes)):
        ring = [*range(len(directions)), *([0] if whole else [])]
        axes.plot(x[ring, j], y[ring, j], color="#bbbbbb", lw=0.6)
    for i, colour in enumerate(colours):
        axes.plot(x[i], y[i], ".-", color=colour, ms=3)


def _legend(dataset: xr.Dataset, directions: NDArray[Any], colours: NDArray[Any]) -> list[Any]:
    """Handles of the directions (some of many), of the buoys if there are several, and of the marks that occur."""
    shown = range(0, len(directions), -(-len(directions) // MOST_NAMED))
    found = [Line2D([], [], color=colours[i], marker=".", label=f"towards {directions[i]:g}°") for i in shown]
    if dataset.sizes.get("buoy", 0) > 1:
        named = zip(dataset.buoy.values.tolist(), itertools.cycle(STYLES))
        found += [Line2D([], [], color=COLORS["ink"], ls=style, label=name) for name, style in named]
    for name, (mark, words) in MARKS.items():
        if dataset[name].values.any():
            found.append(Line2D([], [], color=COLORS["red"], marker=mark, ls="none", label=words))
    return found


#: Up to this many curves are named in one row above a panel; more, in small columns.
FEW = 3
#: Panels of motions: title, motions, factor, unit.
PANELS = (
    ("translation", ("surge", "sway", "heave"), 1.0, "m/m"),
    ("rotation", ("roll", "pitch"), 180 / np.pi, "deg/m"),
)


def amplitudes(dataset: xr.Dataset, runs: list[dict[str, complex]] | tuple[Any, ...] = ()) -> Figure:
    """Amplitude per metre over the period: solid in small waves, dashed in waves of the given height, marks from runs.

    runs: dicts with "period", and the amplitudes per metre by name.
    """
    with matplotlib.rc_context(STYLE):
        panels, tensions = [panel for panel in PANELS if "rao" in dataset], each_tension(dataset)
        figure = new_figure(PAGE, 2.9)
        axes = figure.subplots(1, len(panels) + bool(tensions), squeeze=False)[0]
        for ax, (title, names, factor, unit) in zip(axes, panels, strict=False):
            for (name, of_buoy, one), colour in zip(_of_buoys(dataset, names), itertools.cycle(PALETTE)):
                _curves(ax, one, "rao", {"motion": name}, factor, colour, runs, f"{name}{of_buoy}")
            ax.set(xlabel="period [s]", ylabel=f"{title} [{unit}]")
            _name(ax)
        if tensions:
            unit, factor = force_unit(np.abs(dataset.rao_tension.values))
            for (name, one), colour in zip(tensions, itertools.cycle(PALETTE[3:] + PALETTE[:3])):
                _curves(axes[-1], one, "rao", {}, factor, colour, runs, name, "_tension")
            axes[-1].set(xlabel="period [s]", ylabel=f"tension [{unit}/m]")
            _name(axes[-1])
        styles = [Line2D([], [], color=COLORS["ink"], label="small waves")]
        if "height_m" in dataset.attrs:
            words = f"height {dataset.attrs['height_m']:g} m, drag linearised"
            styles.append(Line2D([], [], color=COLORS["ink"], ls="--", label=words))
        if runs:
            styles.append(Line2D([], [], color=COLORS["ink"], marker="o", mfc="none", ls="none", label="runs in time"))
        legend_below(figure, 0.25, 3, styles)
    return figure


def _name(axes: Any) -> None:
    handles, names = axes.get_legend_handles_labels()
    labels = [name.replace("_", " ").replace("tension ", "") for name in names]
    small = {} if len(labels) <= FEW else {"fontsize": 6, "handlelength": 1.2}
    where = {"loc": "lower left", "bbox_to_anchor": (0, 1), "borderaxespad": 0.1, "columnspacing": 1.0}
    axes.legend(handles, labels, ncols=3 if len(labels) <= FEW else 2, **where, **small)


def _of_buoys(dataset: xr.Dataset, names: tuple[Any, ...]) -> list[tuple[str, str, xr.Dataset]]:
    """(motion, " of BUOY", its part of the dataset) of all buoys."""
    return [(name, of_buoy, one) for of_buoy, one in each_buoy(dataset) for name in names]


def _curves(
    axes: Any,
    dataset: xr.Dataset,
    name: str,
    pick: dict[str, str],
    factor: float,
    colour: str,
    runs: list[dict[str, complex]] | tuple[Any, ...],
    label: str,
    ending: str = "",
) -> None:
    T = dataset.period.values
    axes.plot(T, factor * np.abs(complex_of(dataset[f"{name}{ending}"].sel(pick))), color=colour, label=label)
    if f"{name}_drag{ending}" in dataset:
        axes.plot(T, factor * np.abs(complex_of(dataset[f"{name}_drag{ending}"].sel(pick))), "--", color=colour)
    found = [(run["period"], factor * abs(run[label])) for run in runs if label in run]
    if found:
        axes.plot(*np.transpose(found), "o", color=colour, ms=3.5, mfc="none")


def spectra(dataset: xr.Dataset) -> Figure:
    """Spectra of the elevation, motions and tensions in an irregular sea, each to its own scale."""
    f = dataset.omega.values / (2 * np.pi)
    with matplotlib.rc_context(STYLE):
        figure = new_figure(PAGE, 2.6)
        axes = figure.subplots(1, 3)
        axes[0].plot(f, 2 * np.pi * dataset.spectrum.values, color=COLORS["ink"], label="elevation")
        if "motion_spectrum" in dataset:
            for ax, (_, names, factor, _) in zip(axes, PANELS, strict=False):
                for (name, of_buoy, one), colour in zip(_of_buoys(dataset, names), itertools.cycle(PALETTE)):
                    values = 2 * np.pi * factor**2 * one.motion_spectrum.sel(motion=name)
                    ax.plot(f, values, color=colour, label=f"{name}{of_buoy}")
        for (name, one), colour in zip(each_tension(dataset), itertools.cycle(PALETTE[3:] + PALETTE[:3])):
            axes[2].plot(f, 2e-6 * np.pi * one.tension_spectrum, color=colour, label=name.replace("_", " "))
        for ax, unit in zip(axes, ("m²/Hz", "deg²/Hz", "kN²/Hz"), strict=True):
            ax.set(xlabel="frequency [Hz]", ylabel=f"spectral density [{unit}]", ylim=(0, None))
            if ax.lines:
                _name(ax)
    return figure
