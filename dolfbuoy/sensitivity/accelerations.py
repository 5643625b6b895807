"""Accelerations of a point of a buoy, from its position and orientation in a record, with their derivatives."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..results.series import OF_PART

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene

Array = NDArray[Any]
#: Step of the central differences of R(q) x, which is quadratic in q, so that only rounding errors remain.
NEAR = 1e-3


def accelerations(
    record: "xr.Dataset", arms: dict[str, Array], slopes: dict[str, Array] | None = None
) -> Iterator[tuple[str, Array, Array]]:
    """(label, accelerations, their derivatives by the parameters) of a point of every buoy, along the fixed axes.

    arms: buoy -> position of the point from the centre of mass, in the buoy's axes (3,) [m].  slopes: their derivatives
    (parameter, 3), for a record with `d_buoy_position` and `d_buoy_orientation`; None: no derivatives.  Gravity is not
    included [m/s^2].
    """
    t = record.time.values
    for name, arm in arms.items():
        of = {"buoy": list(record.buoy.values.astype(str)).index(name)}
        x, q = (record[key].isel(of).values for key in ("buoy_position", "buoy_orientation"))
        found, rates = _second(t, x + _turned(q, arm)), np.zeros((0, len(t), 3))
        if slopes is not None:
            dx, dq = (record[f"d_{key}"].isel(of).values for key in ("buoy_position", "buoy_orientation"))
            turning = (_turned(q + NEAR * dq, arm) - _turned(q - NEAR * dq, arm)) / (2 * NEAR)
            moved = np.array([_turned(q, slope) for slope in slopes[name]])
            rates = np.array([_second(t, one) for one in dx + turning + moved])
        for k, axis in enumerate("xyz"):
            label = f"acceleration_{axis}" + (f"{OF_PART}{name}" if len(arms) > 1 else "")
            yield label, found[:, k], rates[:, :, k]


def arms_of(scene: "Scene", point: Any) -> dict[str, Array]:
    """Position of a point of each buoy from its centre of mass [m]; point: with its height above the keel."""
    return {name: np.array(point, dtype=float) - (0, 0, b.center_of_mass) for name, b in scene.network.buoys.items()}


def _turned(q: Array, arm: Array) -> Array:
    """R(q) arm for quaternions (..., 4) near unit length; the columns of R have length |q|^2."""
    scalar, vector = q[..., :1], q[..., 1:]
    return np.asarray(
        (scalar**2 - (vector**2).sum(axis=-1, keepdims=True)) * arm
        + 2 * (vector @ arm)[..., None] * vector
        + 2 * scalar * np.cross(vector, arm)
    )


def _second(t: Array, x: Array) -> Array:
    """Second derivatives of rows by central differences, extrapolated at both ends."""
    h = np.diff(t)[:, None]
    rates = np.diff(x, axis=0) / h
    inner = 2 * np.diff(rates, axis=0) / (h[1:] + h[:-1])
    return np.concatenate([2 * inner[:1] - inner[1:2], inner, 2 * inner[-1:] - inner[-2:-1]])
