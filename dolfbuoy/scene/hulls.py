"""Masses and upright hydrostatics of a buoy, hull and point masses together."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..meshes import HullShape
from ..roots import brentq
from .buoy import Buoy


@dataclass(frozen=True)
class MassProperties:
    """mass [kg], height of C above the keel [m], principal moments about C in the body frame [kg m^2]."""

    mass: float
    height: float
    inertia: tuple[float, float, float]


def mass_properties(buoy: Buoy) -> MassProperties:
    """Mass and C of hull and point masses, and the inertia about C by the parallel-axis theorem.

    buoy: the scene's section, by default a uniform solid hull.
    """
    shape: Any = shape_of(buoy)  # without one the buoy gives center_of_mass and inertia
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
    return MassProperties(total, center, (float(moments[0]), float(moments[1]), float(moments[2])))


def shape_of(buoy: Buoy) -> HullShape | None:
    """Hull of the buoy's section, or None."""
    return HullShape(tuple(buoy.hull)) if buoy.hull else None


@dataclass(frozen=True)
class Floating:
    """Upright floating state under a vertical pull at the mooring point.

    draft, KB, BM, GM [m]; displaced mass [kg]; heave stiffness [N/m]; pitch stiffness about the keel point [N m].
    """

    draft: float
    displaced_mass: float
    KB: float
    BM: float
    GM: float
    heave_stiffness: float


def float_upright(
    shape: HullShape,
    mass_properties: MassProperties,
    density: float,
    gravity: float,
    pull: float = 0.0,
    pull_height: float = 0.0,
) -> Floating:
    """Upright equilibrium with a vertical downward `pull` [N] at `pull_height` above the keel.

    GM is the restoring lever of all loads: (buoyancy at the metacentre - weight at C - pull at its point) per weight.
    Raises InputError if the buoy sinks.
    """
    M, zG = mass_properties.mass, mass_properties.height
    load = M + (pull / gravity if gravity else 0.0)
    if load > density * shape.volume():
        raise InputError(
            f"The buoy sinks: buoy.mass and point_masses with the pull of the cable make {load:.6g} kg, but buoy.hull "
            f"displaces at most {density * shape.volume():.6g} kg."
        )
    draft = brentq(lambda d: density * shape.volume(d) - load, 0.0, shape.height, xtol=1e-14 * shape.height)
    KB = shape.centroid(draft) if draft > 0 else 0.0
    radius = shape.waterplane_radius(draft)
    displaced = density * shape.volume(draft)
    BM = math.pi * radius**4 / 4 / shape.volume(draft) if draft > 0 else math.inf
    restoring = displaced * (KB + BM) - M * zG - (load - M) * pull_height
    return Floating(draft, displaced, KB, BM, restoring / M, density * gravity * math.pi * radius**2)
