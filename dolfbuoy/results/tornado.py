"""Tornado figure: by how much results change for one per cent of each number, the largest at the top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .style import COLORS, PAGE, STYLE, Figure, matplotlib, new_figure

#: Bars in a panel, and panels at most.
BARS, PANELS = 15, 3


def tornado(names: Sequence[str], columns: Mapping[str, NDArray[Any]]) -> Figure:
    """Bars of elasticities, per cent for one per cent, a panel for each of the first columns.

    names: of the numbers.  columns: elasticities (numbers,) by the names of results.
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
