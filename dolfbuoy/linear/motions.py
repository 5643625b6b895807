"""The six motions of a buoy: surge, sway, heave, roll, pitch, yaw."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.sea import heading


class Motions(NamedTuple):
    """Motions of C along a direction, across it (to the left) and up [m], and turns about these three axes [rad].

    pitch > 0 turns the top along the direction.  Small; complex where they are amplitudes.
    """

    surge: complex
    sway: complex
    heave: complex
    roll: complex
    pitch: complex
    yaw: complex


def axes_along(direction_deg: float) -> NDArray[Any]:
    """Rows: unit vectors along a direction, to its left, and up."""
    ahead = heading(direction_deg)
    return np.array([ahead, np.cross([0.0, 0.0, 1.0], ahead), [0.0, 0.0, 1.0]])


def turn(q4: NDArray[Any], change: NDArray[Any]) -> NDArray[Any]:
    """Rotation vector (world frame) of a small change of the unit quaternion q4, which may be complex."""
    w, v = change[0], np.asarray(change[1:])
    return np.asarray(2 * (q4[0] * v - w * q4[1:] - np.cross(v, q4[1:])))
