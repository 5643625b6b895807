"""Figure of a calibration: measured and computed series, and their difference."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .series import described
from .style import COLORS, PAGE, STYLE, Figure, legend_below, matplotlib, new_figure

if TYPE_CHECKING:
    import xarray as xr

SHOWN = 4  #: series at most


def residuals(dataset: xr.Dataset) -> Figure:
    """A column for each series: above what was measured and computed, below computed - measured."""
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
