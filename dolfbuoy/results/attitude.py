"""Lengths of vectors, and angles of orientations."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray


def length(vectors: NDArray[Any]) -> NDArray[Any]:
    """Lengths of vectors (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def cone_angle(q4: NDArray[Any]) -> NDArray[Any]:
    """Angle between the vertical and the axis R(q4) e3 [deg] for q4 (..., 4), accurate near 0 and 180."""
    a, b, c, d = np.moveaxis(np.asarray(q4), -1, 0)
    across = 2 * np.hypot(b * d + a * c, c * d - a * b)
    return np.asarray(np.degrees(np.arctan2(across, a * a - b * b - c * c + d * d)))


#: Half the distance of the pitch from 90 degrees [rad] below which roll and yaw cannot be told apart.
LOCKED = 1e-8


def roll_pitch_yaw(q4: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Roll, pitch and yaw [deg] of orientations (..., 4): rotations about e1, e2, e3 of the body, yaw first.

    R = R_z(yaw) R_y(pitch) R_x(roll); -180 < roll, yaw <= 180 and -90 <= pitch <= 90.  At a pitch of 90 or -90 only the
    difference or sum of yaw and roll is defined; the roll is then 0.  Computed from the sum and difference of the half
    angles, which q_4 gives directly, so that no digits are lost near those pitches.
    """
    a, b, c, d = np.moveaxis(np.asarray(q4), -1, 0)
    sum_size, difference_size = np.hypot(a - c, d + b), np.hypot(a + c, d - b)
    half_sum, half_difference = np.arctan2(d + b, a - c), np.arctan2(d - b, a + c)
    pitch = math.pi / 2 - 2 * np.arctan2(sum_size, difference_size)
    no_sum = sum_size <= LOCKED * difference_size
    no_difference = ~no_sum & (difference_size <= LOCKED * sum_size)
    half_sum, half_difference = (
        np.where(no_sum, half_difference, half_sum),
        np.where(no_difference, half_sum, half_difference),
    )
    roll, yaw = _one_turn(half_sum - half_difference), _one_turn(half_sum + half_difference)
    return roll, np.degrees(pitch), yaw


def _one_turn(angle: NDArray[Any]) -> NDArray[Any]:
    """Angles [rad] in degrees, -180 < x <= 180."""
    x = np.degrees(angle)
    x = x - 360 * np.round(x / 360)
    return np.where(x == -180, 180.0, x)
