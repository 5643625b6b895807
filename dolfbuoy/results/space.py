"""Drawing in space: one scale for all directions, arrows to a stated scale."""

import math

import numpy as np
from matplotlib.ticker import FixedLocator


def equal_scale(axes, box: np.ndarray, elevation: float, azimuth: float) -> None:
    """Show the box (lower corner, upper corner) with one scale for x, y and z, seen from that direction [deg].

    Lengths are the same in front and behind.  The ends of an axis, where it meets the next one, have no number.
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
        axis.set_major_locator(FixedLocator(_ticks(*box[:, i], span.max(), top=0.0 if i == 2 else 1 / 30)))
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
        # matplotlib puts labels off an axis by a part of the *other* spans: make it the same length in any box
        nearer = float(np.clip(1 / np.delete(share, i).max(), 0.4, 2.2))
        axis.set_tick_params(pad=6 * nearer - (6 if i == 2 else 8))
        axis.labelpad = 16 * nearer - (14 if i == 2 else 17)


def _ticks(low, high, longest, top):
    """Round numbers on an axis, two to six on the longest one; not at its lower end, nor within `top` of the upper."""
    first, last = low + min(longest / 30, 0.3 * (high - low)), high - min(longest * top, 0.3 * (high - low))
    for parts in (6, 12, 30):
        step = nice_scale(longest, parts)
        ticks = step * np.arange(math.ceil(first / step), math.floor(last / step) + 1)
        if len(ticks):
            return ticks
    return [(low + high) / 2]


def clear_azimuth(direction_deg: float) -> float:
    """From where a vertical plane of that heading is best seen, with x to the right: one of four azimuths [deg]."""
    return max((-60.0, -120.0, -30.0, -150.0), key=lambda a: round(abs(math.sin(math.radians(a - direction_deg))), 6))


def nice_scale(largest: float, length: float) -> float:
    """Quantity per unit of length, a round number, at which `largest` is at most this long."""
    needed = largest / length
    power = 10.0 ** math.floor(math.log10(needed))
    return next(m * power for m in (1, 2, 5, 10) if m * power >= needed * (1 - 1e-12))
