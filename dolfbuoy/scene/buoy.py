"""The section [buoy], and those of loads on a single buoy."""

import itertools
from collections.abc import Callable
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, WrapValidator, model_validator

from . import quantities as q
from .potential_flow import PotentialFlow, potential_flow_of
from .quantities import Missing, Wrong
from .section import Section, key
from .wave_files import rows_of

#: Effects included in potential-flow coefficients.
HAS_THEM = ("added_mass", "axial_added_mass", "rotational_added_mass", "wave_damping")


class BuoyStart(Section):
    """Pose and velocity of a buoy at t = 0."""

    buoy_position: q.Vector | None = key("initial position of C; absent: from the equilibrium", "m", default=None)
    buoy_orientation: q.Quaternion | None = key(
        "initial orientation as a quaternion, body to world; absent: from the equilibrium", "1", default=None
    )
    buoy_velocity: q.VelocityVector | None = key("initial velocity of C; absent: at rest", "m/s", default=None)
    buoy_angular_velocity: q.VelocityVector | None = key(
        "initial angular velocity in the world frame; absent: at rest", "rad/s", default=None
    )

    @model_validator(mode="after")
    def _turned(self) -> Self:
        if self.buoy_orientation is not None and sum(c * c for c in self.buoy_orientation) == 0:
            raise Wrong("buoy_orientation", self.buoy_orientation, "must not be the zero quaternion")
        return self


Turning = Annotated[list[q.Turning], *rows_of(3)]
ForceInTime = Annotated[list[q.ForceInTime], *rows_of(4)]


class Wind(Section):
    """Wind on the buoy, Eq. (2)."""

    speed_10m: q.Speed = key("wind speed 10 m above still water", "m/s")
    direction_deg: q.Angle = key("direction towards which the wind blows, counterclockwise from x", "deg", default=0.0)
    drag_coefficient: q.Coefficient = key("wind drag coefficient of the part above water", "1", default=1.0)
    area: q.Area = key("projected area exposed to the wind", "m^2")
    height: Annotated[float, Field(ge=0, le=1e5)] = key("height above the keel at which the wind force acts", "m")
    air_density: q.Density = key("air density", "kg/m^3", default=1.225)
    over_time: Turning | None = key(
        "factor of the speed and turn over time, [[t, factor, turn], ...], or a file", "s, 1, deg", default=None
    )
    gusts: Literal["npd", "kaimal"] | None = key(
        "spectrum of gusts in a run: NPD's (ISO 19901-1), of an hourly mean, or Kaimal's; absent: none", default=None
    )
    turbulence: Annotated[float, Field(gt=0, le=1)] | None = key(
        "standard deviation of Kaimal's gusts over the mean speed", "1", default=None
    )
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] | None = key(
        "seed of the gusts; absent: that of the waves", "1", default=None
    )
    ramp: q.Duration = key("ramp-up time of the gusts", "s", default=0.0)

    @model_validator(mode="after")
    def _blows(self) -> Self:
        if self.gusts is None:
            self.refuse(("turbulence", "seed", "ramp"), "goes with gusts")
        if (self.gusts == "kaimal") != (self.turbulence is not None):
            raise Missing("turbulence", "with gusts = 'kaimal', and with no others")
        return self


class ExternalForce(Section):
    """A force at a point of the axis (default: C)."""

    force: q.ForceVector = key("constant force vector", "N")
    height: q.Height | None = key("height above the keel at which it is applied; absent: at C", "m", default=None)
    over_time: ForceInTime | None = key(
        "force over time that is added, [[t, Fx, Fy, Fz], ...], or a file", "s, N", default=None
    )


class PointMass(Section):
    """A mass on the axis of the buoy."""

    mass: q.Mass = key("point mass", "kg")
    height: q.Height = key("height above the keel", "m")


#: Names of shapes by which coefficients may be given, and the word for radiation damping.
SHAPES, RADIATION = ("disc", "cylinder", "spar"), ("radiation",)


def _or_words(words: tuple[str, ...], schema: dict[str, Any]) -> tuple[Any, ...]:
    """Validators of a key that also accepts certain words; schema: of its other values."""

    def check(value: Any, handler: Callable[[Any], Any]) -> Any:
        if isinstance(value, str) and value not in words:
            raise ValueError(
                f"must be {'numbers' if schema['type'] == 'array' else 'a number'}, or {' | '.join(words)}"
            )
        return value if isinstance(value, str) else handler(value)

    both = WithJsonSchema({"anyOf": [schema, {"enum": list(words)}]})
    return WrapValidator(check), PlainSerializer(lambda value: value, return_type=Any), both


_number = {"type": "number", "minimum": 0.0, "maximum": 1e4}
Added = Annotated[q.AddedMass, *_or_words(SHAPES, _number | {"minimum": -1e4})]
ByShape = Annotated[q.Coefficient, *_or_words(SHAPES, _number)]
_dampings = {"type": "array", "items": _number | {"maximum": 1e12}}
WaveDamping = Annotated[list[q.Damping], *_or_words(RADIATION, _dampings)]


class Buoy(Section):
    """A rigid body of revolution; heights are measured along the axis from the keel."""

    hull: q.Rows | None = key(
        "hull profile [[height, diameter], ...] from the keel up; required with [sea]", "m", default=None
    )
    mass: q.Mass = key("mass excluding the point masses", "kg")
    center_of_mass: q.Height | None = key(
        "height of its centre of mass above the keel; absent: centroid of the hull", "m", default=None
    )
    inertia: list[q.Inertia] | None = key(
        "moments of inertia [transverse, axial] or [Ixx, Iyy, Izz] about it; absent: uniform solid hull",
        "kg m^2",
        default=None,
    )
    point_masses: list[PointMass] = key("point masses on the axis, in addition to mass", default=[])
    mooring_height: q.Height = key("height of the mooring point above the keel", "m", default=0.0)
    fairleads: dict[q.Name, q.Vector] | None = key(
        "named attachment points {NAME = [x, y, z], ...} in the body frame, from the keel", "m", default=None
    )
    added_mass: Added = key("transverse added-mass coefficient C_A = C_M - 1, on the displaced mass", "1", default=0.0)
    normal_drag: q.Coefficient = key("transverse drag coefficient", "1", default=0.0)
    axial_added_mass: ByShape = key(
        "axial added-mass coefficient of faces; 1: half a sphere of water per face",
        "1",
        default=0.0,
    )
    axial_drag: q.Coefficient = key("axial drag coefficient, on the projected area of these faces", "1", default=0.0)
    rotational_added_mass: ByShape = key(
        "rotational added-mass coefficient of faces; 1: 8/45 rho R^5 per disc face",
        "1",
        default=0.0,
    )
    wave_damping: WaveDamping | None = key(
        "radiation damping [heave, pitch], on the velocity relative to the water",
        "N s/m, N m s",
        default=None,
    )
    disk_averages: bool = key("average the wave kinematics over the hull's cross-sections (short waves)", default=False)
    potential_flow: Annotated[PotentialFlow, BeforeValidator(potential_flow_of)] | None = key(
        "radiation and diffraction by potential flow: Capytaine's netCDF file, or its table", default=None
    )
    memory_order: Annotated[int, Field(ge=2, le=20)] | None = key(
        "states of the radiation memory of heave, and of a vertical plane; absent: by its error", "1", default=None
    )
    drift: Literal["newman"] | None = key(
        "mean drift of waves, in a sea by Newman's approximation; absent: what strips have of it",
        default=None,
    )
    rotational_damping: q.Damping = key("linear damping of spin about the axis", "N m s", default=0.0)
    name: q.Name | None = key("name of the buoy; required if there are several", default=None)
    wind: Wind | None = None
    external_force: ExternalForce | None = None
    initial: BuoyStart | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.fairleads == {}:
            raise Wrong("fairleads", {}, "must name a point or more, or be left out")
        if self.hull is not None:
            heights, diameters = [h for h, _ in self.hull], [d for _, d in self.hull]
            if len(heights) < 2 or any(b < a for a, b in itertools.pairwise(heights)) or heights[-1] <= heights[0]:
                raise Wrong("hull", self.hull, "must hold two heights or more, from the keel up")
            solid = (b - a > 1e-9 * heights[-1] and c + d > 0 for (a, c), (b, d) in itertools.pairwise(self.hull))
            if min(diameters) < 0 or not any(solid):
                raise Wrong("hull", self.hull, "diameters must not be negative, nor zero all along")
            if any(0 < d < 1e-20 for d in diameters):
                raise Wrong("hull", self.hull, "diameters must be 0, or at least 1e-20")
            if abs(heights[0]) > 1e-12:
                raise Wrong("hull", self.hull, "must start at height 0, the keel")
        if self.inertia is not None:
            if len(self.inertia) not in (2, 3):
                raise Wrong("inertia", self.inertia, "must be [transverse, axial] or [Ixx, Iyy, Izz]")
            moments = [self.inertia[0], *self.inertia][-3:]
            *others, largest = sorted(moments)
            if largest > sum(others) * (1 + 1e-9):
                allowed = "is of no body: about each axis at most the sum of the others, A + B >= C, of the moments"
                raise Wrong("inertia", self.inertia, f"{allowed} {moments}")
        named = any(isinstance(value, str) for value in (self.added_mass, self.axial_added_mass, self.wave_damping))
        if self.hull is None and (named or isinstance(self.rotational_added_mass, str)):
            raise Missing("hull", "coefficients by a shape are of a hull")
        if self.wave_damping is not None and not isinstance(self.wave_damping, str) and len(self.wave_damping) != 2:
            raise Wrong("wave_damping", self.wave_damping, "must be two numbers, [heave, pitch]")
        if self.potential_flow is not None:
            self.refuse(HAS_THEM, "goes without potential_flow, which has it: it would count twice")
        else:
            self.refuse(["memory_order", "drift"], "goes with potential_flow only")
        if self.drift is not None and self.potential_flow is not None and self.potential_flow.mean_drift is None:
            allowed = "needs potential_flow.mean_drift, which the file of `dolfbuoy potential` has"
            raise Wrong("drift", self.drift, allowed)
        if self.hull is None and (self.inertia is None or self.center_of_mass is None):
            name = "inertia" if self.inertia is None else "center_of_mass"
            raise Missing(name, "a buoy without hull needs inertia and center_of_mass")
        return self
