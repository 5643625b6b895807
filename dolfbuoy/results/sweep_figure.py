"""Figures of the cases of a sweep, of elasticities, and of a calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..scene.variants import SEED
from . import style
from .quantities import shown_in
from .series import described, each_series
from .style import COLORS, PAGE, STYLE, Figure, legend_below, matplotlib, new_figure
from .tables import unit_of

if TYPE_CHECKING:
    import xarray as xr

MOST_PANELS = 10
#: Above this many cases, means and ends of ranges are drawn as points instead of bars.
MOST_BARS = 200


@matplotlib.rc_context(style.STYLE)  # type: ignore[untyped-decorator]  # matplotlib has no types
def draw(dataset: xr.Dataset) -> Figure:
    """Mean and range of the main quantities, over the first varied key or case by case.
    Over the key, with a colour per combination of the others, if it is a number but no seed and these are few."""
    series = each_series(dataset, "mean", shown_in("sweep figure"))[:MOST_PANELS]
    series = [one for one in series if np.isfinite(one[2][f"{one[1]}_mean"].values).any()]
    figure = style.new_figure(style.PAGE, 1.9 * max(len(series), 1) + 0.8)
    axes = np.atleast_1d(figure.subplots(max(len(series), 1), 1, sharex=True))
    label, groups = _groups(dataset)
    width = 0.015 * max(np.ptp(np.concatenate([x for _, x, _ in groups])), 1e-12)
    for axis, (text, name, one) in zip(axes, series, strict=False):
        unit, factor = unit_of(one[f"{name}_maximum"].values, one[f"{name}_mean"].attrs["units"])
        mean, low, high = (factor * one[f"{name}_{s}"] for s in ("mean", "minimum", "maximum"))
        for k, (group, x, cases) in enumerate(groups):
            good = np.isfinite(mean.values[cases])
            cases = cases[good]
            place = x[good] + width * (k - (len(groups) - 1) / 2)
            middle, ends = mean.values[cases], (low.values[cases], high.values[cases])
            if dataset.sizes["case"] > MOST_BARS:  # rasterised: size and time do not grow with the number of cases
                (drawn,) = axis.plot(place, middle, ".", markersize=3, rasterized=True, label=group, zorder=3)
                for end in ends:
                    axis.plot(place, end, ".", color=drawn.get_color(), alpha=0.4, markersize=1, rasterized=True)
            else:
                reach = np.maximum([middle - ends[0], ends[1] - middle], 0.0)  # the mean may be rounded
                axis.errorbar(place, middle, reach, fmt="o", markersize=3.5, capsize=2.5, label=group)
        axis.set_ylabel(f"{text.replace('_', ' ')} [{unit.replace('degree', '°')}]")
    axes[-1].set_xlabel(label)
    if series and len(groups) > 1:
        axes[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    title = dataset.attrs.get("title", "")
    figure.suptitle(f"{title}\nmean and range over the run".strip(), fontsize=9)
    return figure


def _groups(dataset: xr.Dataset) -> tuple[str, list[tuple[str, NDArray[Any], NDArray[Any]]]]:
    """Label of the abscissa, and (label, abscissa, cases) of each group of points."""
    keys = dataset.attrs["varied"].split(", ")
    first, *others = (dataset[key.replace(".", "_")].values for key in keys)
    labels = [
        ", ".join(f"{k.rpartition('.')[2]} = {v[i]}" for k, v in zip(keys[1:], others, strict=True))
        for i in range(len(first))
    ]
    different = list(dict.fromkeys(labels))
    points = set(zip(labels, first.tolist(), strict=True))
    crowded = len(different) > 9 or max(map(len, different)) > 40
    if keys[0] == SEED or first.dtype.kind not in "if" or crowded or len(points) < len(first):
        return "case", [("", np.arange(len(first)), np.arange(len(first)))]
    members = [np.flatnonzero([label == group for label in labels]) for group in different]
    return keys[0], [(group, first[m], m) for group, m in zip(different, members, strict=True)]


#: Most bars in a panel, and most panels.
BARS, PANELS = 15, 3


def tornado(names: Sequence[str], columns: Mapping[str, NDArray[Any]]) -> Figure:
    """Bars of elasticities, percentage change per one per cent, with a panel for each of the first columns.

    names: of the parameters.  columns: elasticities (parameters,) by the names of results.
    """
    with matplotlib.rc_context(STYLE):
        shown = list(columns.items())[:PANELS]
        count = min(BARS, len(names))
        figure = new_figure(PAGE, 0.9 + 0.19 * count)
        axes = figure.subplots(1, max(1, len(shown)), squeeze=False)[0]
        for ax, (title, values) in zip(axes, shown, strict=False):
            values = np.nan_to_num(np.asarray(values, dtype=float))
            order = np.argsort(-np.abs(values), kind="stable")[:count][::-1]
            colours = [COLORS["red"] if values[k] > 0 else COLORS["blue"] for k in order]
            ax.barh(np.arange(len(order)), values[order], color=colours, height=0.7)
            ax.set_yticks(np.arange(len(order)), [str(names[k]) for k in order], fontsize=6)
            ax.axvline(0, color=COLORS["ink"], linewidth=0.6)
            ax.grid(visible=False, axis="y")
            ax.set(title=title, xlabel="% for 1 %")
    return figure


SHOWN = 4  #: largest number of series


def residuals(dataset: xr.Dataset) -> Figure:
    """A column for each series: measured and computed above, computed - measured below."""
    with matplotlib.rc_context(STYLE):
        labels = list(dict.fromkeys(dataset.series.values.astype(str)))[:SHOWN]
        figure = new_figure(PAGE, 3.4)
        axes = figure.subplots(2, len(labels), squeeze=False, sharex=True, height_ratios=(2, 1))
        for (above, below), label in zip(axes.T, labels, strict=True):
            one = dataset.isel(sample=dataset.series.values.astype(str) == label)
            above.plot(one.time, one.measured, ".", ms=2, color=COLORS["ink"], label="measured")
            above.plot(one.time, one.computed, color=COLORS["blue"], label="computed")
            above.set(title=label, ylabel=f"[{described(label)[0]}]")
            below.plot(one.time, one.computed - one.measured, color=COLORS["red"], linewidth=0.7)
            below.axhline(0, color=COLORS["ink"], linewidth=0.5)
            below.set(xlabel="time [s]", ylabel="difference")
        legend_below(figure, 0.25, 2, axes[0, 0].get_lines())
    return figure
