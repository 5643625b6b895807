"""The section [buoy], and those of what acts on a buoy alone."""

import itertools
from typing import Annotated

from pydantic import Field, model_validator

from .initial import BuoyStart
from .quantities import (
    AddedMass,
    Angle,
    Area,
    Coefficient,
    Damping,
    Density,
    ForceVector,
    Height,
    Inertia,
    Mass,
    Missing,
    Name,
    Rows,
    Speed,
    Vector,
    Wrong,
)
from .section import Section, key


class Wind(Section):
    """Wind on the buoy, Eq. (2)."""

    speed_10m: Speed = key("speed 10 m above the water", "m/s")
    direction_deg: Angle = key("direction towards which the wind blows, from x towards y", "deg", default=0.0)
    drag_coefficient: Coefficient = key("drag coefficient of the part above the water", "1", default=1.0)
    area: Area = key("area that the wind meets", "m^2")
    height: Annotated[float, Field(ge=0, le=1e5)] = key("height above the keel at which the force acts", "m")
    air_density: Density = key("density of the air", "kg/m^3", default=1.225)


class ExternalForce(Section):
    """A constant force at a point of the axis (default: C)."""

    force: ForceVector = key("constant force", "N")
    height: Height | None = key("height above the keel at which it acts; absent: at C", "m", default=None)


class PointMass(Section):
    """A mass on the axis of the buoy."""

    mass: Mass = key("mass of the point", "kg")
    height: Height = key("height of the point above the keel", "m")


def _check_inertia(inertia):
    if len(inertia) not in (2, 3):
        raise Wrong("inertia", inertia, "must be [transverse, axial] or [Ixx, Iyy, Izz]")
    moments = [inertia[0], *inertia] if len(inertia) == 2 else inertia
    *others, largest = sorted(moments)
    if largest > sum(others) * (1 + 1e-9):
        raise Wrong(
            "inertia",
            inertia,
            f"is of no body: about each axis at most the sum of the others, A + B >= C, of the moments {moments}",
        )


class Buoy(Section):
    """A rigid body of revolution; heights are measured along the axis from the keel."""

    hull: Rows | None = key("[[height, diameter], ...] from the keel up; the sea needs it", "m", default=None)
    mass: Mass = key("mass without the point masses", "kg")
    center_of_mass: Height | None = key("height of that mass; absent: centroid of the hull", "m", default=None)
    inertia: list[Inertia] | None = key(
        "[transverse, axial] or [Ixx, Iyy, Izz] about that centre; absent: of the uniform solid", "kg m^2", default=None
    )
    point_masses: list[PointMass] = key("masses on the axis, added to the hull's", default=[])
    mooring_height: Height = key("height above the keel at which the cable is attached", "m", default=0.0)
    fairleads: dict[Name, Vector] | None = key(
        "{NAME = [x, y, z], ...}: points of the body, from the keel, for cables", "m", default=None
    )
    added_mass: AddedMass = key("C_A = C_M - 1 of the displaced mass, across the axis", "1", default=0.0)
    normal_drag: Coefficient = key("drag coefficient across the axis", "1", default=0.0)
    axial_added_mass: Coefficient = key(
        "along the axis, of wet end discs, steps and cones, a disc being half a sphere of water", "1", default=0.0
    )
    axial_drag: Coefficient = key("drag coefficient along the axis, on the area of these", "1", default=0.0)
    rotational_added_mass: Coefficient = key(
        "of the same faces about a diameter, 8/45 rho R^5 for one face of a disc", "1", default=0.0
    )
    wave_damping: list[Damping] | None = key(
        "[heave, pitch]: linear damping by radiated waves, relative to the water", "N s/m, N m s", default=None
    )
    disk_averages: bool = key("waves averaged over the disks of the hull, for waves that are short", default=False)
    rotational_damping: Damping = key("linear damping of the rotation about the axis", "N m s", default=0.0)
    name: Name | None = key("name of the buoy; several need one each", default=None)
    wind: Wind | None = None
    external_force: ExternalForce | None = None
    initial: BuoyStart | None = None

    @model_validator(mode="after")
    def _consistent(self):
        if self.fairleads == {}:
            raise Wrong("fairleads", {}, "must name a point or more, or be left out")
        if self.hull is not None:
            heights, diameters = [h for h, _ in self.hull], [d for _, d in self.hull]
            if len(heights) < 2 or any(b < a for a, b in itertools.pairwise(heights)) or heights[-1] <= heights[0]:
                raise Wrong("hull", self.hull, "must hold two heights or more, from the keel up")
            solid = (b - a > 1e-9 * heights[-1] and c + d > 0 for (a, c), (b, d) in itertools.pairwise(self.hull))
            if min(diameters) < 0 or not any(solid):
                raise Wrong("hull", self.hull, "diameters must not be negative, nor zero all along")
            if abs(heights[0]) > 1e-12:
                raise Wrong("hull", self.hull, "must start at height 0, the keel")
        if self.inertia is not None:
            _check_inertia(self.inertia)
        if self.wave_damping is not None and len(self.wave_damping) != 2:
            raise Wrong("wave_damping", self.wave_damping, "must be two numbers, [heave, pitch]")
        if self.hull is None and (self.inertia is None or self.center_of_mass is None):
            name = "inertia" if self.inertia is None else "center_of_mass"
            raise Missing(name, "a buoy without hull needs inertia and center_of_mass")
        return self
