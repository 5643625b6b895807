"""Picture of the whole system at an instant: lines, joints, hulls, bed, water and its velocity, forces, masses."""

from __future__ import annotations

import itertools
import math
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.sea import crest_height, heading, wavenumber
from .devices import DECK, SIDES
from .draw3d import clear_azimuth, equal_scale, nice_scale, sheet, side_by_side
from .frame import Frames
from .style import COLORS, COLUMN, PAGE, Circle, Figure, Line2D, Patch, figure_of, matplotlib, new_figure
from .tables import force_unit

# isort: split
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.sections import Scene
    from .frame import Frame, Mark

#: Colours of lines, in turn; if there are more lines than colours, the legend does not name them.
LINES = [COLORS["ink"], COLORS["red"], COLORS["green"], COLORS["blue"], COLORS["purple"]]
#: Several lines are also drawn from above if their width exceeds this fraction of their length.
WIDE = 0.02
#: Elevation of the viewer above the horizon [deg].
ELEVATION = 14


@figure_of()
def snapshot(record: xr.Dataset, scene: Scene, time: float | None = None) -> Figure:
    """Figs. 8 (right) and 11: the system at the frame nearest to `time` (default: the last).
    As a whole, and around the buoy with the forces on it; several lines also from above.  All directions have the same
    scale; above each panel is an arrow of known speed, in the legend the scale of forces."""
    now = Frames(record, scene).at(time)
    boxes = [box for box in (_whole(now), _detail(now)) if box is not None]
    from_above = len(now.run.spans) > 1 and np.ptp(now.x[:, :2], axis=0).min() > WIDE * np.ptp(now.x, axis=0).max()
    width, legend = PAGE if len(boxes) == 2 or from_above else COLUMN, dict[Any, Any]()
    figure = new_figure(width, 4.2, constrained=False)
    for box in boxes:
        axes = figure.add_axes((0, 0, 1, 1), projection="3d", computed_zorder=False)
        axes.patch.set_visible(False)
        equal_scale(axes, box, elevation=ELEVATION, azimuth=clear_azimuth(now.direction_deg))
        _draw(axes, now, box, legend)
        finer = None if box is boxes[-1] else boxes[-1]
        _draw_forces(axes, now, box, legend, finer)
    if from_above:
        _draw_plan(figure.add_axes((0, 0, 1, 1)), now)
    _lay_out(figure, scene.title, now.time, list(legend.values()))
    return figure


def _lay_out(figure: Figure, title: str, time: float, entries: list[Any]) -> None:
    """Arrange title, panels and legend from top to bottom, and set the figure's height to fit."""
    columns = _columns([entry.get_label() for entry in entries], figure.get_figwidth())
    words = [title, f"t\xa0=\xa0{time:.4g}\xa0s"] if title else [f"t\xa0=\xa0{time:.4g}\xa0s"]
    lines = textwrap.wrap(", ".join(words), int(15 * figure.get_figwidth()))
    above, below = 0.12 + 0.15 * len(lines), 0.08 + 0.17 * math.ceil(len(entries) / columns)
    side_by_side(figure, above, below)
    figure.text(0.5, 1 - 0.08 / figure.get_figheight(), "\n".join(lines), ha="center", va="top", fontsize=9)
    figure.legend(handles=entries, loc="lower center", ncol=columns, borderaxespad=0.2)


def _whole(now: Frame) -> NDArray[Any] | None:
    """Box (2, 3) of lower and upper corners around everything; None for a single buoy without a line."""
    if now.alone and not len(now.x):
        return None
    points = now.points
    low, high = points.min(axis=0), points.max(axis=0)
    span = (high - low).max()
    low[2] -= 0.04 * span
    high[2] += 0.06 * span
    if now.scene.sea:
        crest, bed = crest_height(now.scene), now.bed
        if bed > low[2] - 0.25 * span:
            low[2] = min(bed, low[2])
        if crest > low[2] and high[2] + 0.25 * span > 0:
            high[2] = max(high[2], 1.2 * crest, 0.03 * span)
    half = np.maximum((high - low) / 2 + [0.08 * span, 0.08 * span, 0], 0.22 * span)
    middle = (high + low) / 2
    return np.array([middle - half, middle + half])


def _detail(now: Frame) -> NDArray[Any] | None:
    """Box around the buoy; None without a buoy, or with several lines or buoys."""
    if not now.alone or not now.buoys:
        return None
    (buoy,) = now.buoys
    middle = (buoy.at(max(buoy.heights)) + buoy.at(min(buoy.heights))) / 2
    half = buoy.size * np.array([1.05, 1.05, 0.95])
    return np.array([middle - half, middle + half])


def _draw(axes: Any, now: Frame, box: NDArray[Any], legend: dict[str | tuple[str, str], Any]) -> None:
    """Draw everything but forces, from back to front, each with a legend entry."""
    if now.scene.sea:
        _draw_bed(axes, now, box, legend)
        _draw_velocity(axes, now, box, legend)
    _draw_lines(axes, now, box, legend)
    _draw_marks(axes, now, box, legend)
    _draw_devices(axes, now, box, legend)
    _draw_surfaces(axes, now, box, legend)
    for buoy in now.buoys:
        if buoy.mast is not None:
            axes.plot(*buoy.mast.T, color=COLORS["ink"], lw=0.8, zorder=5)
        if buoy.masses:
            size = 4.5 if (box[1] - box[0]).max() < 6 * buoy.size else 2.0
            axes.plot(*np.array(buoy.masses).T, "o", color="black", ms=size, ls="none", zorder=6)
            legend["masses"] = Line2D([], [], color="black", marker="o", ms=4, ls="none", label="point mass")


#: Colours of forces by name.
FORCES = {"external force": COLORS["red"], "wind force": COLORS["green"], "mooring force": COLORS["purple"]}


def _draw_forces(
    axes: Any, now: Frame, box: NDArray[Any], legend: dict[str | tuple[str, str], Any], finer: Any = None
) -> None:
    """Draw external forces on the buoys and, if there is only one, the mooring force to its own scale.

    finer: box of a finer panel, which shows all forces but those on vessels outside it.
    """
    pulls = now.arrows("pulls") if finer is None else []
    for arrows in (now.arrows("outside", box, finer), pulls if len(pulls) == 1 else []):
        largest = max((float(np.linalg.norm(force)) for _, _, force in arrows), default=0.0)
        for name, point, force in (arrow for arrow in arrows if arrow[2].any()):
            scale = nice_scale(largest, 0.3 * (box[1] - box[0]).min())  # the largest is about a quarter of the box
            axes.quiver(*point, *force / scale, color=FORCES[name], lw=1.6, arrow_length_ratio=0.3, zorder=6)
            name, color = name if finer is None else f"{name} on a vessel", FORCES[name]
            legend[name] = _arrow(color, _label_of(name, force, scale, box))


def _draw_bed(axes: Any, now: Frame, box: NDArray[Any], legend: dict[str | tuple[str, str], Any]) -> None:
    (x0, y0, _), (x1, y1, _) = box
    plan = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    corners = now.on_bed(plan)
    if corners[:, 2].max() < box[0, 2] + 1e-9 * now.bed:
        return
    seen = [np.maximum(corners, [-np.inf, -np.inf, box[0, 2]])]
    axes.add_collection3d(Poly3DCollection(seen, facecolor=COLORS["sand"], alpha=0.35, lw=0, zorder=1))
    legend["bed"] = Patch(color=COLORS["sand"], alpha=0.35, label="sea bed")


def _colored(now: Frame) -> list[tuple[str, list[NDArray[Any]], str]]:
    """(name, pieces, colour) of the lines."""
    return [(*line, color) for line, color in zip(now.lines, itertools.cycle(LINES), strict=False)]


def _draw_lines(axes: Any, now: Frame, box: NDArray[Any], legend: dict[Any, Any]) -> None:
    """Draw the lines, named if not too many, dotted where the box cuts them off; highlight parts below the bed."""
    named, tension = len(now.run.spans) <= len(LINES), _tension(now)
    for name, pieces, color in _colored(now):
        label = f"{name}{tension}" if named else "cables"
        legend["line", name if named else ""] = Line2D([], [], color=color, lw=1.2, label=label)
        for nodes in pieces:
            x = _inside(nodes, box)
            cut = 0 if np.array_equal(x[:1], nodes[:1]) else len(x) // 2
            axes.plot(*x[cut:].T, color=color, lw=1.2, zorder=3)
            axes.plot(*x[: cut + 1].T, ":", color=color, lw=1.2, zorder=3)
            if now.depth_below_bed > 0:
                _draw_below_bed(axes, now, x, legend)


def _draw_below_bed(axes: Any, now: Frame, x: NDArray[Any], legend: dict[str | tuple[str, str], Any]) -> None:
    """Draw the part of a line below the bed in red, with a curtain from the bed down to it."""
    bed = now.bed
    x = _crossing(x, bed)
    under = x[:, 2] <= bed
    foot = np.column_stack([x[:, :2], np.full(len(x), bed)])
    pieces = under[:-1] & under[1:]
    curtain = np.stack([x[:-1], x[1:], foot[1:], foot[:-1]], axis=1)[pieces]
    if len(curtain):
        axes.add_collection3d(Poly3DCollection(curtain, facecolor=COLORS["red"], alpha=0.35, lw=0, zorder=2.5))
        axes.plot(*np.where(under[:, None], x, np.nan).T, color=COLORS["red"], lw=1.6, zorder=3.5)
        label = f"cable, up to {now.depth_below_bed:.2g} m below the bed"
        legend["below"] = Line2D([], [], color=COLORS["red"], lw=1.6, label=label)


#: Symbol, size, colour and words of held ends, joints, clumps, floats and winches.
JOINTS = {
    "fixed": ("s", 3.5, COLORS["ink"], "held end"),
    "prescribed": ("s", 3.5, COLORS["ink"], "held end"),
    "joint": (".", 4.0, COLORS["ink"], "joint"),
    "clump": ("D", 4.0, COLORS["ink"], "clump"),
    "float": ("o", 5.0, COLORS["orange"], "float"),
    "winch": ("P", 5.0, COLORS["red"], "winch"),
}


def _draw_marks(axes: Any, now: Frame, box: NDArray[Any], legend: dict[Any, Any]) -> None:
    """Draw joints and held ends; in the sea, fixed ends are called anchors."""
    for mark, place in _marked(now):
        if ((place > box[0] - 1e-9) & (place < box[1] + 1e-9)).all():
            symbol, size, color, words = JOINTS[mark.kind]
            zorder = 6 if mark.kind == "winch" else 3.5  # it stands on its buoy
            axes.plot(*place[:, None], symbol, color=color, ms=size, ls="none", zorder=zorder)
            words = "anchor" if now.scene.sea and mark.kind == "fixed" else words
            legend[words] = Line2D([], [], color=color, marker=symbol, ms=size, ls="none", label=words)


def _marked(now: Frame) -> list[tuple[Mark, NDArray[Any]]]:
    """(mark, position) of all marks with a symbol; a free end has none."""
    return [(mark, now.x[mark.node]) for mark in now.run.marks if mark.kind in JOINTS]


def _draw_devices(axes: Any, now: Frame, box: NDArray[Any], legend: dict[Any, Any]) -> None:
    """Draw take-offs, thick in the middle."""
    for device in now.run.devices:
        ends = _inside(device.at(now), box)
        if len(ends):
            axes.plot(*ends.T, color=COLORS["green"], lw=1.0, zorder=3.4)
            body = ends[0] + np.outer([0.35, 0.65], ends[-1] - ends[0])
            axes.plot(*body.T, color=COLORS["green"], lw=3.5, zorder=3.4, solid_capstyle="butt")
            legend["take-off"] = Line2D([], [], color=COLORS["green"], lw=3.5, label="take-off")


def _draw_plan(axes: Any, now: Frame) -> None:
    """Draw the plan view: lines, named if the legend does not name them, joints, hulls."""
    for name, pieces, color in _colored(now):
        for nodes in pieces:
            axes.plot(*nodes[:, :2].T, color=color, lw=1.2)
        if len(now.run.spans) > len(LINES) and pieces:
            place, look = pieces[0][len(pieces[0]) // 4, :2], {"fontsize": 6, "color": color}
            axes.annotate(name, place, (3, 3), textcoords="offset points", **look)
    for mark, place in _marked(now):
        symbol, size, color, _ = JOINTS[mark.kind]
        axes.plot(*place[:2], symbol, color=color, ms=size)
    for shell in now.run.shells:
        axes.fill(*shell.at(now.time)[DECK, :2].T, color=COLORS["sand"], zorder=2.5)
    for hull in now.hulls:
        axes.add_patch(Circle(hull.r_C[:2], hull.outline[:, 1].max(), color=COLORS["orange"], zorder=3))
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)


def _draw_velocity(axes: Any, now: Frame, box: NDArray[Any], legend: dict[Any, Any]) -> None:
    """Draw velocity arrows in the vertical plane through the buoy or the box centre, and one of known speed above."""
    causes = [name for name in ("waves", "current") if getattr(now.scene, name)]
    if not causes:
        return
    points, spacing = _plane(now, box)
    velocity = now.flow(points)
    speed = np.linalg.norm(velocity, axis=1)
    if not len(speed) or speed.max() == 0:
        return
    scale, seen = nice_scale(speed.max(), 1.2 * spacing), speed > 0.02 * speed.max()
    arrows = velocity[seen] / scale
    axes.quiver(*points[seen].T, *arrows.T, color=COLORS["blue"], lw=0.6, arrow_length_ratio=0.35, zorder=2)
    _draw_key(axes, box, heading(now.direction_deg), 1 / nice_scale(1 / speed.max(), 1.0), scale)
    legend["flow"] = _arrow(COLORS["blue"], f"water velocity, {' and '.join(causes)}")


def _draw_key(axes: Any, box: NDArray[Any], along: NDArray[Any], speed: float, scale: float) -> None:
    """Draw an arrow of this speed in the direction of the water's motion, above the back wall."""
    span, arrow = np.ptp(box, axis=0).max(), along * speed / scale
    middle = np.array([box[:, 0].mean(), box[1, 1], box[1, 2] + 0.06 * span])
    axes.quiver(*middle - arrow / 2, *arrow, color=COLORS["blue"], lw=0.9, arrow_length_ratio=0.35)
    middle[2] += 0.02 * span + 0.1 * np.linalg.norm(arrow)
    x, y, _ = proj3d.proj_transform(*middle, axes.get_proj())
    look = {"color": COLORS["blue"], "ha": "center", "va": "bottom", "fontsize": 7}
    axes.text2D(x, y, f"{speed:.3g} m/s", transform=axes.transData, **look)


def _plane(now: Frame, box: NDArray[Any]) -> tuple[NDArray[Any], float]:
    """Points under water in the plane of the waves through the buoy, and their spacing."""
    middle = (box[0] + box[1]) / 2
    through, along = now.buoys[0].r_C if now.alone and now.buoys else middle, heading(now.direction_deg)
    across = np.array([-along[1], along[0], 0.0])
    base = middle * [1, 1, 0] + across * ((through - middle) @ across)
    half = (box[1] - box[0])[:2] / 2
    reach = 0.9 * (half / np.maximum(np.abs(along[:2]), 1e-9)).min()
    spacing = 2 * reach / 7
    x = base + np.linspace(-reach, reach, 8)[:, None] * along
    top = np.minimum(now.elevation(x), box[1, 2])
    floor = max(box[0, 2], now.bed)
    rows = max(3, round((top.max() - floor) / (1.1 * spacing)))
    fraction = (np.arange(rows) + 0.3) / rows
    z = top[:, None] - fraction * (top - floor)[:, None]
    points = np.concatenate([np.repeat(x[:, None, :2], rows, axis=1), z[..., None]], axis=-1).reshape(-1, 3)
    return points[(points[:, 2] > floor) & ~now.in_hull(points)], spacing


def _draw_surfaces(axes: Any, now: Frame, box: NDArray[Any], legend: dict[str | tuple[str, str], Any]) -> None:
    """Draw the water behind the hulls, the hulls and vessels, and the water in front."""
    if now.scene.sea and box[0, 2] < now.elevation(box[0]) < box[1, 2]:
        x, (e, a) = _water_patches(now, box), np.radians([ELEVATION, clear_azimuth(now.direction_deg)])
        viewer = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        middle = x.mean(axis=1)
        before = np.all([~now.in_hull(middle), *((middle - h.r_C) @ viewer > 0 for h in now.hulls)], axis=0)
        for part, zorder in ((x[~before], 3.8), (x[before], 4.2)):
            if len(part):
                axes.add_artist(sheet(part, viewer, facecolor=COLORS["sky"], alpha=0.4, zorder=zorder))
        legend["water"] = Patch(color=COLORS["sky"], alpha=0.4, lw=0, label="water surface")
        _draw_still_water(axes, now, box, legend)
    bodies = [("buoy", "orange", points[quads]) for points, quads in (h.surface(40, h.size / 14) for h in now.hulls)]
    corners = [shell.at(now.time) for shell in now.run.shells]
    bodies += [("vessel", "sand", x[SIDES]) for x in corners if np.all((x >= box[0]) & (x <= box[1]))]
    for name, color, x in bodies:
        colors = _shaded(x, COLORS[color])
        axes.add_collection3d(Poly3DCollection(x, facecolors=colors, edgecolors=colors, linewidths=0.25, zorder=4))
        legend[name] = Patch(color=COLORS[color], label=name)


def _draw_still_water(axes: Any, now: Frame, box: NDArray[Any], legend: dict[str | tuple[str, str], Any]) -> None:
    """Draw the still water level as a line on the back walls."""
    if now.scene.waves and box[0, 2] < 0 < box[1, 2]:
        (x0, y0, _), (x1, y1, _) = box
        left, right = (x0, x1) if math.cos(math.radians(clear_azimuth(now.direction_deg))) > 0 else (x1, x0)
        style = {"ls": "--", "color": COLORS["blue"], "lw": 0.7}
        axes.plot([left, left, right], [y0, y1, y1], [0, 0, 0], zorder=0.5, **style)
        legend["still water"] = Line2D([], [], label="still water", **style)


def _water_patches(now: Frame, box: NDArray[Any]) -> Any:
    """Quadrilaterals (n, 4, 3) of the water surface in the box."""
    span = (box[1] - box[0])[:2].max()
    length = 2 * math.pi / wavenumber(now.scene) if now.scene.waves else np.inf
    n = int(np.clip(10 * span / length, 28, 60))
    x, y = np.meshgrid(*(np.linspace(box[0, i], box[1, i], n + 1) for i in (0, 1)), indexing="ij")
    grid = np.stack([x, y, np.zeros_like(x)], axis=-1)
    grid[..., 2] = now.elevation(grid)
    return np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)


def _shaded(patches: NDArray[Any], color: str) -> NDArray[Any]:
    """Colours of the patches, shaded by light from above and one side."""
    normal = np.cross(patches[:, 2] - patches[:, 0], patches[:, 3] - patches[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    light = 0.72 + 0.28 * np.abs(normal @ np.array([0.36, -0.48, 0.8]))
    rgba = np.tile(matplotlib.colors.to_rgba(color), (len(patches), 1))
    rgba[:, :3] *= light[:, None]
    return rgba


def _inside(x: NDArray[Any], box: NDArray[Any]) -> Any:
    """The part of a polyline inside the box, finely subdivided."""
    if ((x >= box[0]) & (x <= box[1])).all():
        return x
    s = np.linspace(0, len(x) - 1, 200 * (len(x) - 1) + 1)
    fine = np.stack([np.interp(s, np.arange(len(x)), c) for c in x.T], axis=-1)
    return fine[((fine >= box[0]) & (fine <= box[1])).all(axis=1)]


def _crossing(x: NDArray[Any], z: float) -> NDArray[Any]:
    """A polyline with a node added wherever it crosses a height."""
    above = x[:, 2] > z
    passed = np.flatnonzero(above[:-1] != above[1:])
    a, b = x[passed], x[passed + 1]
    between = a + (b - a) * ((z - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None]
    between[:, 2] = z
    return np.insert(x, passed + 1, between, axis=0)


def _tension(now: Frame) -> str:
    """Text of the least and largest element tensions, if there is only one cable."""
    if len(now.run.spans) != 1:
        return ""
    unit, factor = force_unit(now.tension)
    least, largest = (f"{factor * T:.3g}" for T in (now.tension.min(), now.tension.max()))
    return f", tension {least} {unit}" if least == largest else f", tension {least} to {largest} {unit}"


def _label_of(name: str, force: NDArray[Any], scale: float, box: NDArray[Any]) -> str:
    """Name, size and scale of a force."""
    size = float(np.linalg.norm(force))
    unit, factor = force_unit(size)
    if size / scale < 0.015 * (box[1] - box[0]).max():
        return f"{name}, {factor * size:.3g} {unit}, too short to see"
    return f"{name}, {factor * size:.3g} {unit} ({factor * scale:.3g} {unit} per m)"


def _columns(labels: list[str], width: float) -> int:
    """Number of columns of a legend of this width [inch], at most three; letters are about 1/18 inch wide."""
    for columns in (3, 2):
        longest = [max(map(len, part), default=0) for part in np.array_split(labels, columns)]
        if sum(longest) + 8 * columns <= 18 * width:
            return columns
    return 1


def _arrow(color: str, label: str) -> Any:
    return Line2D([], [], color=color, marker=r"$\rightarrow$", ms=9, ls="none", label=label)
