"""Figures and ParaView files of natural modes: every shape from the side and from ahead, and moving."""

from functools import partial
from pathlib import Path

import numpy as np

from ..model.rigid import mass_properties, rotation_of, shape_of
from ..model.sea import heading
from ..writing import made
from .folder import enlist
from .mode_record import KINDS, enlargement
from .paraview import cable_meshes, file_of, hull_meshes, write_series
from .parts import parts_of
from .record import FIXED
from .style import COLORS, PAGE, STYLE, Figure, files_of, legend_below, matplotlib, new_figure, save

#: How the phases rest, 0, 180 and 90 degrees are drawn.
PHASE_STYLES = {
    "at rest": {"color": "#999999", "lw": 0.8},
    "at its largest": {"color": COLORS["blue"], "lw": 0.9},
    "half a period later": {"color": COLORS["blue"], "lw": 0.9, "ls": "--"},
    "a quarter before": {"color": COLORS["orange"], "lw": 0.7},
}
#: Instants of an animated period.
PHASES = 16


def mode_shape(dataset, number: int, scene, direction_deg=0.0) -> Figure:
    """Shape of mode `number` (from 1) over the rest position: at its largest, half a period later, and in between.

    Left in the vertical plane of a direction [deg], right across it; displacements are enlarged as the title says.
    """
    mode = dataset.isel(mode=number - 1)
    factor = enlargement(dataset, mode)
    poses = [_Pose(dataset, mode, scene, factor * z) for z in (0, 1, -1, 1j)]
    views = [heading(direction_deg), np.cross([0.0, 0.0, 1.0], heading(direction_deg))]
    boxes = _boxes([np.concatenate([curve for pose in poses for curve in pose.curves(view)]) for view in views])
    widths = [float(np.ptp(box[0])) for box in boxes]
    height = min(max((PAGE - 1.2) * float(np.ptp(boxes[0][1])) / sum(widths), 1.6), 4.5)
    with matplotlib.rc_context(STYLE):
        figure = new_figure(PAGE, height + 1.1)
        panels = figure.subplots(1, 2, sharey=True, width_ratios=widths)
        for axes, view, box, name in zip(panels, views, boxes, ("ahead", "aside"), strict=True):
            for pose, (label, style) in zip(poses, PHASE_STYLES.items(), strict=True):
                pose.draw(axes, view, label, **style)
            if scene.sea is not None and box[1][1] > 0:
                axes.axhline(0, color=COLORS["sky"], lw=1.0, zorder=0.5)
            axes.set(xlim=box[0], ylim=box[1], xlabel=f"{name} [m]", aspect="equal")
            axes.locator_params(axis="x", nbins=5)
        panels[0].set_ylabel("z [m]")
        legend_below(figure, 0.25, 4, panels[0].get_legend_handles_labels()[0])
        figure.suptitle(
            f"{number}: {mode.name.item()}, {_said(mode)}; {factor:.3g} times the shape of modes.nc", size=8
        )
    return figure


def _boxes(seen):
    """((left, right), (low, high)) of both views, with the same heights and some room; none is very narrow."""
    points = np.concatenate(seen)
    low, high = points[:, 1].min(), points[:, 1].max()
    least = max(0.3 * (high - low), max(np.ptp(view[:, 0]) for view in seen) / 4)
    boxes, room = [], 0.05 * max(high - low, least)
    for view in seen:
        middle, half = (view[:, 0].min() + view[:, 0].max()) / 2, max(np.ptp(view[:, 0]), least) / 2 + room
        boxes.append(((middle - half, middle + half), (low - room, high + room)))
    return boxes


def _said(mode):
    if mode.kind.item() == "oscillates":
        return f"period {mode.period.item():.4g} s, damping ratio {mode.damping_ratio.item():.3g}"
    return KINDS[mode.kind.item()]


class _Pose:
    """What is seen of a mode at one phase: rest + Re(z x)."""

    def __init__(self, dataset, mode, scene, z):
        def moved(name):
            real, imaginary = mode[name].values
            return z.real * real - z.imag * imaginary

        self.nodes, self.hulls = None, []
        if "cable_position" in mode:
            positions = dataset.rest_cable_position.values + moved("cable_position")
            self.nodes = np.split(positions, np.flatnonzero(np.diff(dataset.cable_of_node.values)) + 1)
        if "buoy_position" in mode:
            centers = dataset.rest_buoy_position.values + moved("buoy_position")
            turns = dataset.rest_buoy_orientation.values, moved("buoy_rotation")
            for buoy, center, q4, turn in zip(scene.network.buoys.values(), centers, *turns, strict=True):
                self.hulls.append(_outline(buoy, center, rotation_vector(turn) @ rotation_of(q4)))

    def curves(self, view):
        """Lines and outlines as they are seen along a horizontal direction, (n, 2) each."""
        lines = [np.column_stack([nodes @ view, nodes[:, 2]]) for nodes in self.nodes or []]
        return lines + [outline(view) for outline in self.hulls]

    def draw(self, axes, view, label, **style):
        for curve in self.curves(view):
            axes.plot(*curve.T, label=label, **style)
            label = None


def rotation_vector(turn) -> np.ndarray:
    """Rotation matrix of a rotation vector [rad]."""
    angle = np.linalg.norm(turn)
    half = turn / angle * np.sin(angle / 2) if angle else np.zeros(3)
    return rotation_of([np.cos(angle / 2), *half])


def _outline(buoy, center, R):
    """view -> the silhouette of a buoy's hull, or its axis if it has none; buoy: its section."""
    shape = shape_of(buoy)
    height = mass_properties(buoy, shape).height
    stations = np.array(buoy.hull) if shape else np.array([[buoy.mooring_height, 0.0], [height, 0.0]])
    axis = R[:, 2]

    def seen(view):
        aside = view - (view @ axis) * axis
        aside /= np.linalg.norm(aside) or 1.0
        middle = center + (stations[:, :1] - height) * axis
        sides = [middle + sign * stations[:, 1:] / 2 * aside for sign in (1, -1)]
        points = np.concatenate([sides[0], sides[1][::-1], sides[0][:1]])
        return np.column_stack([points @ view, points[:, 2]])

    return seen


def draw_modes(folder, dataset, scene, paraview=True, direction_deg=0.0) -> list[Path]:
    """Figure of each mode in folder/figures, and an animated period in folder/paraview; returns the files."""
    folder, written = Path(folder), []
    for number in dataset.mode.values.tolist():
        name = folder / "figures" / f"mode_{number:02d}"
        made(folder, "figures")
        enlist(folder, files_of(name), "modes")
        written += save(mode_shape(dataset, number, scene, direction_deg), name)
        if paraview:
            written += _animate(folder, dataset, number, scene)
    return written


def _animate(folder, dataset, number, scene):
    """A period of the mode as meshes of cables and hulls, over a time of one period, or of 1 s for what has none."""
    mode, written = dataset.isel(mode=number - 1), []
    period = mode.period.item() if np.isfinite(mode.period.item()) else 1.0
    record, announce = (
        _as_a_run(dataset, mode, enlargement(dataset, mode), period),
        partial(enlist, folder, kind="modes"),
    )
    moving = {file_of("cable", part.label): cable_meshes(part.record) for part in parts_of(record, "cable")}
    buoys = scene.network.buoys.values()
    for part, buoy in zip(parts_of(record, "buoy"), buoys, strict=True):
        moving[file_of("hull", part.label)] = hull_meshes(part.record, buoy)
    for name, of_instant in moving.items():
        if of_instant is not None:
            meshes = [of_instant(i, t) for i, t in enumerate(record.time.values)]
            target = folder / "paraview" / f"mode_{number:02d}_{name}"
            written += write_series(target, record.time.values, meshes, announce)
    return written


def _as_a_run(dataset, mode, factor, period):
    """A record of a run in which the system does nothing but this."""
    import xarray as xr

    times = period * np.arange(PHASES) / PHASES
    z = factor * np.exp(2j * np.pi * np.arange(PHASES) / PHASES)

    def moved(name):
        real, imaginary = mode[name].values
        shape = (-1, *[1] * real.ndim)
        return z.real.reshape(shape) * real - z.imag.reshape(shape) * imaginary

    data = {"time": ("time", times)} | {n: dataset[n] for n in (*FIXED, "cable", "buoy") if n in dataset}
    if "cable_position" in mode:
        data["frame"] = ("frame", times)
        data["cable_position"] = (
            ("frame", "node", "xyz"),
            dataset.rest_cable_position.values + moved("cable_position"),
        )
        data["cable_tension"] = (("frame", "cell"), moved("cable_tension"))
    if "buoy_position" in mode:
        turns = moved("buoy_rotation")
        at_rest = np.broadcast_to(dataset.rest_buoy_orientation.values, (*turns.shape[:-1], 4)).reshape(-1, 4)
        turned = [_turned(q4, turn) for q4, turn in zip(at_rest, turns.reshape(-1, 3), strict=True)]
        data["buoy_position"] = (
            ("time", "buoy", "xyz"),
            dataset.rest_buoy_position.values + moved("buoy_position"),
        )
        data["buoy_orientation"] = (("time", "buoy", "quaternion"), np.reshape(turned, (*turns.shape[:-1], 4)))
    return xr.Dataset(data)


def _turned(q4, turn):
    """A unit quaternion after a rotation vector in the world frame."""
    angle = np.linalg.norm(turn)
    w, v = np.cos(angle / 2), (np.sin(angle / 2) / angle if angle else 0.0) * turn
    return np.concatenate([[w * q4[0] - v @ q4[1:]], w * q4[1:] + q4[0] * v + np.cross(v, q4[1:])])
