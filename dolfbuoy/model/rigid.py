"""Masses and weights: of a line's material, and of a buoy, hull and point masses together."""

import math
from dataclasses import dataclass

import numpy as np

from ..meshes import HullShape
from ..scene import Scene
from ..scene.buoy import Buoy
from ..scene.cable import Cable


def cross_section(cable: Cable) -> float | None:
    """A0 [m^2] of a section [cable]; None without area and diameter."""
    if cable.area is not None:
        return cable.area
    return math.pi * cable.diameter**2 / 4 if cable.diameter else None


def weight_per_length(scene: Scene, cable: Cable) -> float:
    """Weight in water per unstretched length, w [N/m], of a section [cable]; negative for a cable that floats."""
    displaced = scene.sea.density * cross_section(cable) if scene.sea else 0.0
    return (cable.line_density - displaced) * scene.gravity


@dataclass(frozen=True)
class MassProperties:
    """mass [kg], height of C above the keel [m], principal moments about C in the body frame [kg m^2]."""

    mass: float
    height: float
    inertia: tuple[float, float, float]


def mass_properties(buoy: Buoy) -> MassProperties:
    """C of hull and point masses and the inertia about it, by the parallel-axis theorem.

    buoy: the scene's section, by default a uniform solid hull.
    """
    shape = shape_of(buoy)
    hull_height = buoy.center_of_mass if buoy.center_of_mass is not None else shape.centroid()
    if buoy.inertia is None:
        transverse, axial = (buoy.mass * i for i in shape.solid_inertia())
        moments = np.array([transverse, transverse, axial])
    elif len(buoy.inertia) == 2:
        moments = np.array([buoy.inertia[0], buoy.inertia[0], buoy.inertia[1]])
    else:
        moments = np.array(buoy.inertia)
    masses = [(buoy.mass, hull_height), *((p.mass, p.height) for p in buoy.point_masses)]
    total = sum(m for m, _ in masses)
    center = sum(m * h for m, h in masses) / total
    steiner = sum(m * (h - center) ** 2 for m, h in masses)
    moments = moments + np.array([steiner, steiner, 0.0])
    return MassProperties(total, center, tuple(float(i) for i in moments))


def shape_of(buoy: Buoy) -> HullShape | None:
    """Hull of the scene's section, if it has one."""
    return HullShape(tuple(buoy.hull)) if buoy.hull else None


def axis_offset(buoy: Buoy, height: float) -> np.ndarray:
    """Body vector from C to the axis point at `height` above the keel [m]; buoy: the scene's section."""
    return np.array([0.0, 0.0, height - mass_properties(buoy).height])


def mooring_offset(buoy: Buoy, fairlead: str | None = None) -> np.ndarray:
    """Body vector from C to a fairlead of a section [buoy], or to its mooring point on the axis [m]."""
    if fairlead is None:
        return axis_offset(buoy, buoy.mooring_height)
    return axis_offset(buoy, 0.0) + np.array(buoy.fairleads[fairlead])


def rotation_of(q4: np.ndarray) -> np.ndarray:
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
