"""Figures of the statistics of runs: exceedance of peaks, rainflow ranges, extremes, and tracks of the buoy."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .extremes import Gumbel
from .offsets import corners
from .quantities import shown_in
from .series import each_series
from .style import (
    COLORS,
    PAGE,
    PALETTE,
    STYLE,
    Circle,
    Figure,
    legend_above,
    legend_below,
    matplotlib,
    new_figure,
    save,
)
from .tables import unit_of

#: Most sets drawn, as colours must tell them apart; further ones are left out.
MOST_SETS = len(PALETTE)


def draw_all(statistics: xr.Dataset, folder: Path) -> list[Path]:
    """Draw every figure with data, as folder/NAME.png and .svg; returns the files."""
    written = []
    for name, draw in FIGURES.items():
        with matplotlib.rc_context(STYLE):
            figure = draw(statistics)
            if figure is not None:
                written += save(figure, Path(folder) / name)
    return written


def _sets(statistics: xr.Dataset) -> Any:
    return range(min(statistics.sizes["set"], MOST_SETS))


def _panels(statistics: xr.Dataset, needs: str) -> tuple[Figure, list[tuple[Any, str, str, float, xr.Dataset]]]:
    """(figure, [(axes, name, axis label, factor to its unit, its part of the dataset)]) of all series shown.
    needs: ending of a variable that a series must have; (None, []) if none has it."""
    series = each_series(statistics, "maximum", shown_in("statistics figure"))
    series = [
        (label, name, one) for label, name, one in series if f"{name}{needs}" in one and one[f"{name}{needs}"].size
    ]
    if not series:
        return None, []
    rows = (len(series) + 1) // 2
    figure = new_figure(PAGE, 0.4 + 2.4 * rows)
    grid = figure.subplots(rows, 2, squeeze=False).ravel()
    for spare in grid[len(series) :]:
        spare.remove()
    panels = []
    for axes, (label, name, one) in zip(grid, series, strict=False):
        largest = one[f"{name}_maximum"]
        unit, factor = unit_of(largest.values, largest.attrs["units"])
        panels.append((axes, name, f"{label.replace('_', ' ')} [{unit}]", factor, one))
    return figure, panels


def exceedance(statistics: xr.Dataset) -> Figure:
    """Exceedance probability of peaks, and the Rayleigh distribution of a narrow-band Gaussian process."""
    figure, panels = _panels(statistics, "_peak")
    for axes, name, text, factor, statistics in panels:
        for k in _sets(statistics):
            mine = statistics[f"{name}_peak_set"].values == k
            peaks, share = statistics[f"{name}_peak"].values[mine], statistics[f"{name}_peak_exceedance"].values[mine]
            label = f"set {k}" if statistics.sizes["set"] > 1 else "peaks"
            axes.plot(factor * peaks, share, ".", ms=3, color=PALETTE[k], label=label)
            mine = statistics.set_of_run.values == k
            mean = statistics[f"{name}_mean"].values[mine].mean()
            deviation = np.sqrt((statistics[f"{name}_standard_deviation"].values[mine] ** 2).mean())
            share = np.geomspace(1.0, 0.5 * share.min(initial=1.0), 100)
            look = {"lw": 0.8, "color": COLORS["ink"], "alpha": 0.6}
            look |= {} if k else {"label": "Rayleigh, narrow band"}
            axes.plot(factor * (mean + deviation * np.sqrt(-2 * np.log(share))), share, "-", **look)
        axes.set(yscale="log", xlabel=text, ylabel="share of higher peaks")
    return _with_legend(figure, panels)


def _with_legend(figure: Figure, panels: list[tuple[Any, str, str, float, xr.Dataset]]) -> Figure:
    """The figure with the legend of its first panel below, if any."""
    if panels:
        axes, *_, statistics = panels[0]
        handles = axes.get_legend_handles_labels()[0]
        legend_below(figure, 0.3, 2 * min(statistics.sizes["set"], 3), handles)
    return figure


def cycles(statistics: xr.Dataset) -> Figure:
    """Rainflow ranges: number of cycles per hour that are as large or larger."""
    figure, panels = _panels(statistics, "_range")
    for axes, name, text, factor, statistics in panels:
        for k in _sets(statistics):
            mine = statistics[f"{name}_range_set"].values == k
            order = np.argsort(statistics[f"{name}_range"].values[mine])[::-1]
            ranges = statistics[f"{name}_range"].values[mine][order]
            hours = statistics.duration.values[statistics.set_of_run.values == k].sum() / 3600
            number = np.cumsum(statistics[f"{name}_range_count"].values[mine][order]) / hours
            axes.step(factor * ranges, number, where="post", color=PALETTE[k], label=f"set {k}")
        axes.set(yscale="log", xlabel=f"range of {text}", ylabel="cycles per hour, as large or larger")
        if statistics.sizes["set"] > 1 and axes.lines:
            axes.legend()
    return figure


def extremes(statistics: xr.Dataset) -> Figure:
    """Largest values of the runs on Gumbel paper, the fitted line, and the most probable value of 3 h."""
    figure, panels = _panels(statistics, "_most_probable")
    for axes, name, text, factor, statistics in panels:
        for k in _sets(statistics):
            _gumbel_paper(axes, statistics, name, k, factor)
        axes.set(xlabel=f"largest {text}", ylabel="-ln(-ln P)")
    return _with_legend(figure, panels)


def _gumbel_paper(axes: Any, statistics: xr.Dataset, name: str, k: int, factor: float) -> None:
    maxima = np.sort(statistics[f"{name}_maximum"].values[statistics.set_of_run.values == k])
    location, scale = (float(statistics[f"{name}_gumbel_{part}"][k]) for part in ("location", "scale"))
    found = Gumbel(location, scale, len(maxima))
    if not np.isfinite(found.location):
        return
    reduced = -np.log(-np.log(np.arange(1, len(maxima) + 1) / (len(maxima) + 1)))
    axes.plot(factor * maxima, reduced, "o", ms=3, color=PALETTE[k], label=f"{len(maxima)} runs")
    estimate, low, high = statistics[f"{name}_most_probable"].values[k]
    rise = (estimate - found.location) / found.scale  # ln(3 h / length of a run): ordinate of the most probable value
    ends = np.array([reduced[0], max(reduced[-1], rise)])
    axes.plot(factor * (found.location + found.scale * ends), ends, "-", lw=0.8, color=PALETTE[k])
    reach = factor * np.array([[estimate - low], [high - estimate]])
    look = {"fmt": "s", "ms": 4, "mfc": "none", "capsize": 3, "color": PALETTE[k]}
    axes.errorbar(factor * estimate, rise, xerr=reach, label="most probable of 3 h, 95 %", **look)


def circle(statistics: xr.Dataset) -> Figure | None:
    """Positions of C from above: convex hulls of its tracks, and the smallest circle of each set."""
    if not statistics.sizes.get("corner"):
        return None
    figure = new_figure(PAGE / 2, PAGE / 2)
    axes = figure.subplots()
    for k in _sets(statistics):
        mine = statistics.corner_set.values == k
        points = np.column_stack([statistics[f"corner_{axis}"].values[mine] for axis in "xy"])
        for buoy in np.unique(statistics.corner_buoy.values[mine]):
            hull = corners(points[statistics.corner_buoy.values[mine] == buoy])
            axes.fill(*hull.T, facecolor="none", ec=PALETTE[k], lw=0.8, ls="--", label=f"around the track of {buoy}")
        circles = (statistics[f"circle_{part}"].values[k] for part in ("x", "y", "radius"))
        for x, y, radius in zip(*circles, strict=True):
            axes.add_patch(Circle((x, y), radius, fill=False, lw=0.8, ec=PALETTE[k], label=f"radius {radius:.3g} m"))
            axes.plot(x, y, "+", color=PALETTE[k], ms=5)
    axes.set(xlabel="x of C [m]", ylabel="y of C [m]", aspect="equal")
    axes.autoscale_view()
    legend_above(axes, 2)
    return figure


#: Functions that draw the figures, by file name; they return None if there is nothing to draw.
FIGURES: dict[str, Callable[..., Any]] = {draw.__name__: draw for draw in (exceedance, cycles, extremes, circle)}
