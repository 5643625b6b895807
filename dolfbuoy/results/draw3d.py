"""Drawing in space: the same scale in all directions, arrows to a stated scale."""

import itertools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .style import Figure, FixedLocator, matplotlib

# isort: split
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import PathPatch3D


def equal_scale(axes: Any, box: NDArray[Any], elevation: float, azimuth: float) -> None:
    """Show the box (lower corner, upper corner) with one scale for x, y and z, seen from this direction [deg].

    Orthographic: near and far lengths are equal.  Axes have no tick labels where they meet.
    """
    span = box[1] - box[0]
    axes.set(xlim=box[:, 0], ylim=box[:, 1], zlim=box[:, 2])
    axes.set_proj_type("ortho")
    axes.set_box_aspect(
        tuple(span), zoom=min(0.92, 0.72 * np.linalg.norm(span) / span[:2].max())
    )  # a long box would not fit
    axes.view_init(elev=elevation, azim=azimuth)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.zaxis.set_rotate_label(False)
    axes.zaxis.label.set_rotation(90)
    share = span / np.linalg.norm(span) * math.sqrt(3)
    for i, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        axis.set_major_locator(FixedLocator(_ticks(box[0, i], box[1, i], span.max(), upright=i == 2)))
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
        # matplotlib offsets labels by a fraction of the *other* spans: make it the same length in any box
        nearer = float(np.clip(1 / np.delete(share, i).max(), 0.4, 2.2))
        axis.set_tick_params(pad=6 * nearer - (6 if i == 2 else 8))
        axis.labelpad = 16 * nearer - (14 if i == 2 else 17)


#: Margins of a panel: at a side with tick labels and without, below and above; its largest height, and its least beside
#: another one [inch].
NUMBERS, BARE, BELOW, ABOVE, HIGHEST, HIGH = 0.66, 0.1, 0.42, 0.3, 3.2, 2.3


def side_by_side(figure: Figure, above: float, below: float) -> None:
    """Place panels side by side, as large as fits and of equal height unless one is too wide.

    above, below: margins [inch]; the figure's height is set to fit.  A 3D panel has the extent of its box; a 2D one is
    square.
    """
    extents, width = [_extent(axes) for axes in figure.axes], figure.get_figwidth()
    spans = np.ptp(extents, axis=1)
    ratios, room = spans[:, 0] / spans[:, 1], width - len(extents) * (NUMBERS + BARE)
    widths = ratios * min(max(room / ratios.sum(), HIGH), HIGHEST)
    widths[ratios.argmax()] -= max(widths.sum() - room, 0.0)
    scales = widths / spans[:, 0]
    height = below + BELOW + (scales * spans[:, 1]).max() + ABOVE + above
    figure.set_figheight(height)
    left = gap = (room - widths.sum()) / (len(extents) + 1)
    for axes, (low, _), scale, wide in zip(figure.axes, extents, scales, widths, strict=True):
        on_right = axes.name == "3d" and math.cos(math.radians(axes.azim)) > 0  # z labels: x points to the viewer
        corner = np.array([left + (BARE if on_right else NUMBERS), below + BELOW]) - scale * low
        axes.set_position((*corner / [width, height], scale / width, scale / height))
        left += wide + NUMBERS + BARE + gap


def _extent(axes: Any) -> NDArray[Any]:
    """Lower left and upper right corners of the projected box of a panel, as fractions of the panel."""
    if axes.name != "3d":
        return np.array([[0.0, 0.0], [1.0, 1.0]])
    corners = np.array(list(itertools.product(axes.get_xlim(), axes.get_ylim(), axes.get_zlim())))
    x, y, _ = proj3d.proj_transform(*corners.T, axes.get_proj())
    seen = axes.transLimits.transform(np.column_stack([x, y]))
    return np.array([seen.min(axis=0), seen.max(axis=0)])


def _ticks(low: float, high: float, longest: float, upright: bool) -> Any:
    """Tick values: two to six on the longest axis, two on a short horizontal one.
    None at the lower end, nor, on a horizontal axis, near the upper one."""
    top = 0.0 if upright else 1 / 30
    first, last = low + min(longest / 30, 0.3 * (high - low)), high - min(longest * top, 0.3 * (high - low))
    found = []
    for parts in (6, 12 if upright else 18, 30):
        step = nice_scale(longest, parts)
        found.append(step * np.arange(math.ceil(first / step), math.floor(last / step) + 1))
    if len(found[0]) < 2 <= len(found[1]) and not upright:
        return found[1][[0, -1]]
    return next((ticks for ticks in found if len(ticks)), [(low + high) / 2])


def clear_azimuth(direction_deg: float) -> float:
    """Azimuth from which a vertical plane of this heading is best seen, with x to the right: one of four [deg]."""
    return max((-60.0, -120.0, -30.0, -150.0), key=lambda a: round(abs(math.sin(math.radians(a - direction_deg))), 6))


def sheet(patches: NDArray[Any], viewer: NDArray[Any], **look: Any) -> PathPatch3D:
    """Quadrilaterals (n, 4, 3) as one seamless surface of one colour, as seen by this viewer."""
    normal = np.cross(patches[:, 2] - patches[:, 0], patches[:, 3] - patches[:, 1])
    turned = np.where((normal @ viewer < 0)[:, None, None], patches[:, ::-1], patches)  # or overlaps would be holes
    corners = turned[:, [0, 1, 2, 3, 0]].reshape(-1, 3)
    Path = matplotlib.path.Path
    codes = np.tile([Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], len(patches))
    return PathPatch3D(Path(corners[:, :2], codes), zs=corners[:, 2], lw=0, **look)


def nice_scale(largest: float, length: float) -> float:
    """Quantity per unit length, a round number, at which `largest` has at most this length."""
    needed = largest / length
    power = 10.0 ** math.floor(math.log10(needed))
    return next(m * power for m in (1, 2, 5, 10) if m * power >= needed * (1 - 1e-12))
