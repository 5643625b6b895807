"""Weights of lines, points and rotations of buoys; masses and hydrostatics of buoys are in `scene.hulls`."""

import math

import numpy as np

from ..scene import Scene
from ..scene.buoy import Buoy
from ..scene.cable import Cable
from ..scene.hulls import Floating as Floating
from ..scene.hulls import MassProperties as MassProperties
from ..scene.hulls import float_upright as float_upright
from ..scene.hulls import mass_properties as mass_properties
from ..scene.hulls import shape_of as shape_of
from . import Array


def cross_section(cable: Cable) -> float | None:
    """A0 [m^2] of a section [cable]; None without area and diameter."""
    if cable.area is not None:
        return cable.area
    return math.pi * cable.diameter**2 / 4 if cable.diameter else None


def weight_per_length(scene: Scene, cable: Cable) -> float:
    """Weight in water per unstretched length, w [N/m], of a section [cable]; negative for a cable that floats."""
    displaced = scene.sea.density * (cross_section(cable) or 0.0) if scene.sea else 0.0
    return (cable.line_density - displaced) * scene.gravity


def axis_offset(buoy: Buoy, height: float) -> Array:
    """Body vector from C to the axis point at `height` above the keel [m]; buoy: the scene's section."""
    return np.array([0.0, 0.0, height - mass_properties(buoy).height])


def mooring_offset(buoy: Buoy, fairlead: str | None = None) -> Array:
    """Body vector from C to a fairlead of a section [buoy], or to its mooring point on the axis [m]."""
    if fairlead is None or buoy.fairleads is None:
        return axis_offset(buoy, buoy.mooring_height)
    return np.add(axis_offset(buoy, 0.0), buoy.fairleads[fairlead])


def rotation_of(q4: Array) -> Array:
    """Rotation matrix of a quaternion (q0, q)."""
    x, y, z, w = map(float, [*q4[1:], q4[0]])
    x, y, z, w = np.array([x, y, z, w]) / math.sqrt(x * x + y * y + z * z + w * w)
    return np.array(
        [
            [x * x - y * y - z * z + w * w, 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), -x * x - y * y + z * z + w * w],
        ]
    )
