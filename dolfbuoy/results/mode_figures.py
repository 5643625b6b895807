"""Figures and ParaView files of natural modes: shapes in two vertical planes, and animations."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.sea import heading
from .frame import Frames
from .mode_record import KINDS, enlargement, moving
from .paraview import meshes_of, write_series
from .style import COLORS, PAGE, STYLE, Figure, keep, legend_below, matplotlib, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.sections import Scene
    from .frame import Frame

#: Line styles of the rest position and of the phases 0, 180 and 90 degrees.
PHASE_STYLES = {
    "at rest": {"color": "#999999", "lw": 0.8},
    "at its largest": {"color": COLORS["blue"], "lw": 0.9},
    "half a period later": {"color": COLORS["blue"], "lw": 0.9, "ls": "--"},
    "a quarter before": {"color": COLORS["orange"], "lw": 0.7},
}
#: Number of instants in an animated period.
PHASES = 16


def mode_shape(dataset: xr.Dataset, number: int, scene: Scene, direction_deg: float = 0.0) -> Figure:
    """Shape of mode `number` (from 1) and the rest position: at its largest, half a period later, and in between.

    Left: the vertical plane along a direction [deg]; right: across it.  The title gives the enlargement.
    """
    mode, phases = dataset.isel(mode=number - 1), np.array([0, 1, -1, 1j])
    frames = Frames(moving(dataset, number, np.arange(4.0), phases), scene)
    poses = [frames.at(time) for time in frames.times]
    views = [heading(direction_deg), np.cross([0.0, 0.0, 1.0], heading(direction_deg))]
    boxes = _boxes([np.concatenate([curve for pose in poses for curve in _curves(pose, view)]) for view in views])
    widths = [float(np.ptp(box[0])) for box in boxes]
    height = min(max((PAGE - 1.2) * float(np.ptp(boxes[0][1])) / sum(widths), 1.6), 4.5)
    with matplotlib.rc_context(STYLE):
        figure = new_figure(PAGE, height + 1.1)
        panels = figure.subplots(1, 2, sharey=True, width_ratios=widths)
        for axes, view, box, name in zip(panels, views, boxes, ("ahead", "aside"), strict=True):
            for pose, (label, style) in zip(poses, PHASE_STYLES.items(), strict=True):
                for k, curve in enumerate(_curves(pose, view)):
                    axes.plot(*curve.T, label=None if k else label, **style)
            if scene.sea is not None and box[1][1] > 0:
                axes.axhline(0, color=COLORS["sky"], lw=1.0, zorder=0.5)
            axes.set(xlim=box[0], ylim=box[1], xlabel=f"{name} [m]", aspect="equal")
            axes.locator_params(axis="x", nbins=5)
        panels[0].set_ylabel("z [m]")
        legend_below(figure, 0.25, 4, panels[0].get_legend_handles_labels()[0])
        period, ratio = mode.period.item(), mode.damping_ratio.item()
        text = KINDS[mode.kind.item()] or f"period {period:.4g} s, damping ratio {ratio:.3g}"
        enlarged = f"{enlargement(dataset, mode):.3g} times the shape of modes.nc"
        figure.suptitle(f"{number}: {mode.name.item()}, {text}; {enlarged}", size=8)
    return figure


def _boxes(seen: list[NDArray[Any]]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """((left, right), (low, high)) of both views: equal heights, some margin, and not too narrow."""
    points = np.concatenate(seen)
    low, high = points[:, 1].min(), points[:, 1].max()
    least = max(0.3 * (high - low), max(np.ptp(view[:, 0]) for view in seen) / 4)
    boxes, room = [], 0.05 * max(high - low, least)
    for view in seen:
        middle, half = (view[:, 0].min() + view[:, 0].max()) / 2, max(np.ptp(view[:, 0]), least) / 2 + room
        boxes.append(((middle - half, middle + half), (low - room, high + room)))
    return boxes


def _curves(frame: Frame, view: NDArray[Any]) -> list[NDArray[Any]]:
    """Lines and silhouettes of a frame in the vertical plane along a horizontal direction, (n, 2) each."""
    lines = [np.column_stack([x @ view, x[:, 2]]) for _, pieces in frame.lines for x in pieces]
    return lines + [buoy.silhouette(view) for buoy in frame.buoys]


def draw_modes(
    folder: Path,
    dataset: xr.Dataset,
    scene: Scene,
    paraview: bool = True,
    direction_deg: float = 0.0,
    svg: bool = True,
) -> list[Path]:
    """Figure of each mode in folder/figures and an animated period in folder/paraview; returns the files.

    Meshes of cables and hulls over one period, or over 1 s for a mode without a period.
    """
    folder, written = Path(folder), []
    for number in dataset.mode.values.tolist():
        written += keep(mode_shape(dataset, number, scene, direction_deg), folder, f"mode_{number:02d}", "modes", svg)
        if not paraview:
            continue
        period, turns = dataset.period.values[number - 1], np.arange(PHASES) / PHASES
        times = (period if np.isfinite(period) else 1.0) * turns
        frames = Frames(moving(dataset, number, times, np.exp(2j * np.pi * turns)), scene)
        known = meshes_of(frames)
        meshes = {f"mode_{number:02d}_{name}": known[name] for name in ("cable", "hull") if name in known}
        written += write_series(folder, "modes", [frames.at(time) for time in times], meshes)
    return written
