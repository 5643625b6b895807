"""Figure of offset curves: offset and top tension over the load, and where C goes, from above."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .offset_record import top_tension
from .response_record import each_buoy
from .style import COLORS, PAGE, STYLE, Figure, Line2D, legend_below, matplotlib, new_figure
from .tables import force_unit

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

#: Lines of several buoys.
STYLES = ("-", "--", ":", "-.")
#: How states that are no good are marked.
MARKS = {"slack": ("x", "line slack"), "under": ("v", "buoy under water")}


def offset_curves(dataset: xr.Dataset, anchors: Iterable[tuple[float, ...]] = ()) -> Figure:
    """Offset along the load and top tension over its size, and the watch circles; slack and drowned states are marked.

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
        legend_below(figure, 0.25, len(handles), handles)
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
    """Some of the directions, the buoys if there are several, and the marks that there are."""
    shown = range(0, len(directions), -(-len(directions) // 4))
    found = [Line2D([], [], color=colours[i], marker=".", label=f"towards {directions[i]:g}°") for i in shown]
    if dataset.sizes.get("buoy", 0) > 1:
        named = zip(dataset.buoy.values.tolist(), itertools.cycle(STYLES))
        found += [Line2D([], [], color=COLORS["ink"], ls=style, label=name) for name, style in named]
    for name, (mark, words) in MARKS.items():
        if dataset[name].values.any():
            found.append(Line2D([], [], color=COLORS["red"], marker=mark, ls="none", label=words))
    return found
