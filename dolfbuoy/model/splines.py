"""Motions given by the rows of a table."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from . import Array
from .airy import ramp


def along_rows(rows: Sequence, duration: float) -> Callable[[float], Array]:
    """The columns of rows [t, x, ...] over time by a cubic spline, at rest before the first and after the last row;
    duration: that of the ramp from the values at t = 0 [s]."""
    table = np.asarray(rows)
    path, ends = spline(table), table[[0, -1], 0]
    start = path(np.clip(0.0, *ends))
    return lambda t: start + ramp(t, duration) * (path(np.clip(t, *ends)) - start)


def spline(rows: Array) -> Any:
    """The cubic spline through rows [t, x, ...] that is at rest at its ends."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(rows[:, 0], rows[:, 1:], bc_type="clamped")
