"""Mass properties of the buoy: hull and point masses together."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MassProperties:
    """mass [kg], height of C above the keel [m], principal moments about C in the body frame [kg m^2]."""

    mass: float
    height: float
    inertia: tuple[float, float, float]


def mass_properties(buoy, shape=None) -> MassProperties:
    """C of hull and point masses and the inertia about it, by the parallel-axis theorem.

    buoy: the scene's section.  shape: meshes.HullShape, the source of defaults (uniform solid hull).
    """
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
