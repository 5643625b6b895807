"""Upright hydrostatics of a hull in closed form: starts of solves, and the numbers that `check` prints."""

import math
from dataclasses import dataclass

from ..errors import InputError
from ..meshes import HullShape
from ..roots import brentq
from .rigid import MassProperties


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

    GM is the restoring lever of the whole load: (buoyancy at the metacentre - weight at C - pull at its point) per
    weight.  Raises InputError when the buoy sinks.
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
