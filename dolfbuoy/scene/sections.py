"""What a scene calls for: typed, bounded sections.

A section that is missing is an effect that is off.  SI units; degrees only where the key says so.
"""

import itertools
import math
from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from .petsc_options import checked

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]


def _numbers(count):
    """Validator: a list of `count` finite numbers, kept as a tuple."""

    def check(value):
        good = isinstance(value, list | tuple) and len(value) == count
        if not good or not all(
            isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in value
        ):
            raise ValueError(f"must be {count} finite numbers")
        return tuple(float(v) for v in value)

    return BeforeValidator(check)


Vector = Annotated[tuple[float, float, float], _numbers(3)]
Quaternion = Annotated[tuple[float, float, float, float], _numbers(4)]
Pair = Annotated[tuple[float, float], _numbers(2)]


class Section(BaseModel):
    """A table of the scene file."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class Sea(Section):
    """Water.  Without it the scene is dry: no hydrostatics, no Morison forces, no waves, no current."""

    depth: Positive
    density: Positive = 1025.0


class Top(Section):
    """Upper end of a cable without a buoy."""

    kind: Literal["fixed", "prescribed", "free"]
    position: Vector | None = None
    force: Vector = (0.0, 0.0, 0.0)
    amplitude: Vector | None = None
    period: Positive | None = None
    phase_deg: float = 0.0
    ramp: NonNegative = 0.0

    @model_validator(mode="after")
    def _complete(self):
        if self.kind != "free" and self.position is None:
            raise ValueError(f"kind '{self.kind}' needs a position")
        if self.kind == "prescribed" and (self.amplitude is None or self.period is None):
            raise ValueError("kind 'prescribed' needs amplitude and period")
        if self.kind != "prescribed" and (self.amplitude is not None or self.period is not None or self.ramp):
            raise ValueError("amplitude, period and ramp go with kind 'prescribed' only")
        if self.kind != "free" and self.force != (0.0, 0.0, 0.0):
            raise ValueError("force goes with kind 'free' only")
        return self


def _from_mesh_file(value):
    """The name of a line mesh: the lengths of its elements, so that a scene is complete without the file."""
    if not isinstance(value, str):
        return value
    from ..meshes import read_nodes

    nodes = read_nodes(value)
    return [[float(b - a), 1] for a, b in itertools.pairwise(nodes)]


class Cable(Section):
    """The cable and its finite elements."""

    length: Positive
    line_density: Positive
    diameter: Positive | None = None
    axial_stiffness: Annotated[float, Field(gt=0, allow_inf_nan=True)] = math.inf
    elements: Annotated[Annotated[int, Field(gt=0)] | list[Pair], BeforeValidator(_from_mesh_file)] = 20
    grading: Positive = 1.0
    position_degree: Annotated[int, Field(ge=1, le=8)] = 1
    tension_degree: Annotated[int, Field(ge=0, le=7)] = 0
    added_mass: float = 0.0
    normal_drag: NonNegative = 0.0
    tangential_drag: NonNegative = 0.0
    tangential_froude_krylov: bool = True
    anchor: Vector | None = None
    strain: Literal["exact", "element-average"] = "exact"
    strain_form: Literal["paper", "energy"] = "paper"
    slack: Literal["compressive", "tension-only"] = "compressive"
    damping: NonNegative = 0.0
    top: Top | None = None

    @model_validator(mode="after")
    def _consistent(self):
        if math.isnan(self.axial_stiffness):
            raise ValueError("axial_stiffness must be a positive number or inf")
        if self.damping and math.isinf(self.axial_stiffness):
            raise ValueError(
                f"damping = {self.damping} N s needs a finite axial_stiffness: an inextensible cable has no strain"
            )
        if self.tension_degree >= self.position_degree:
            raise ValueError(
                f"tension_degree = {self.tension_degree} must be lower than position_degree = {self.position_degree} "
                "(Eq. (13): other pairs are unstable)"
            )
        if isinstance(self.elements, list):
            lengths, counts = zip(*self.elements, strict=True) if self.elements else ((), ())
            if not lengths or min(lengths) <= 0 or min(counts) < 1 or any(n != int(n) for n in counts):
                raise ValueError("elements as a list must hold [length, number of elements] of each segment")
            if abs(sum(lengths) - self.length) > 1e-9 * self.length:
                raise ValueError(
                    f"the segments of elements add up to {sum(lengths)} m, not to length = {self.length} m"
                )
        return self


class PointMass(Section):
    """A mass on the axis of the buoy."""

    mass: Positive
    height: float


class Buoy(Section):
    """A rigid body of revolution; heights are measured along the axis from the keel."""

    hull: list[Pair] | None = None
    mass: Positive
    center_of_mass: float | None = None
    inertia: list[Positive] | None = None
    point_masses: list[PointMass] = []
    mooring_height: float = 0.0
    added_mass: float = 0.0
    normal_drag: NonNegative = 0.0
    axial_added_mass: NonNegative = 0.0
    axial_drag: NonNegative = 0.0
    rotational_damping: NonNegative = 0.0

    @model_validator(mode="after")
    def _consistent(self):
        if self.hull is not None:
            heights, diameters = [h for h, _ in self.hull], [d for _, d in self.hull]
            if len(heights) < 2 or any(b < a for a, b in itertools.pairwise(heights)) or heights[-1] <= heights[0]:
                raise ValueError(f"hull heights {heights} must be two or more, from the keel up")
            if min(diameters) < 0 or max(diameters) == 0:
                raise ValueError(f"hull diameters {diameters} must not be negative, nor all zero")
            if abs(heights[0]) > 1e-12:
                raise ValueError(f"hull must start at height 0, the keel, not at {heights[0]}")
        if self.inertia is not None and len(self.inertia) not in (2, 3):
            raise ValueError(f"inertia = {self.inertia} must be [transverse, axial] or [Ixx, Iyy, Izz]")
        if self.hull is None and (self.inertia is None or self.center_of_mass is None):
            raise ValueError("a buoy without hull needs inertia and center_of_mass")
        return self


class Waves(Section):
    """A regular Airy wave: give amplitude or height."""

    amplitude: NonNegative | None = None
    height: NonNegative | None = None
    period: Positive
    wavelength: Positive | None = None
    direction_deg: float = 0.0
    phase_deg: float = 0.0
    ramp: NonNegative = 0.0
    stretching: Literal["wheeler", "vertical", "none"] = "wheeler"

    @model_validator(mode="after")
    def _one_size(self):
        if (self.amplitude is None) == (self.height is None):
            both = "both are given" if self.amplitude is not None else "neither is given"
            raise ValueError(f"give either amplitude or height ({both})")
        return self

    @property
    def size(self) -> float:
        """Amplitude [m]."""
        return self.amplitude if self.amplitude is not None else self.height / 2


class Current(Section):
    """A steady current; in a table the speeds stand in place of `speed`."""

    speed: NonNegative | None = None
    direction_deg: float = 0.0
    profile: Literal["uniform", "power"] | list[Pair] = "uniform"
    exponent: Annotated[float, Field(gt=0, le=1)] = 1 / 7

    @model_validator(mode="after")
    def _consistent(self):
        if isinstance(self.profile, list):
            z = [p[0] for p in self.profile]
            if len(z) < 2 or any(b <= a for a, b in itertools.pairwise(z)):
                raise ValueError("profile must be [[z, speed], ...] with at least two rows and z increasing")
            if self.speed is not None:
                raise ValueError("speed does not go with a table: the speeds stand in profile")
        elif self.speed is None:
            raise ValueError("speed is missing")
        return self


class Wind(Section):
    """Wind on the buoy, Eq. (2)."""

    speed_10m: NonNegative
    direction_deg: float = 0.0
    drag_coefficient: NonNegative = 1.0
    area: Positive
    height: float
    air_density: Positive = 1.225


class ExternalForce(Section):
    """A constant force at a point of the axis (default: C)."""

    force: Vector
    height: float | None = None


class Initial(Section):
    """How a run starts."""

    kind: Literal["equilibrium", "straight", "polyline"] = "equilibrium"
    points: list[Vector] | None = None
    buoy_position: Vector | None = None
    buoy_orientation: Quaternion | None = None
    buoy_velocity: Vector | None = None
    buoy_angular_velocity: Vector | None = None

    @model_validator(mode="after")
    def _consistent(self):
        if (self.kind == "polyline") != (self.points is not None):
            raise ValueError("points go with kind 'polyline', and it needs them")
        if self.points is not None and len(self.points) < 2:
            raise ValueError("points must hold at least two points")
        if self.buoy_orientation is not None and sum(c * c for c in self.buoy_orientation) == 0:
            raise ValueError("buoy_orientation must not be the zero quaternion")
        return self


class Time(Section):
    """Time integration."""

    end: NonNegative
    step: Positive
    scheme: Literal["backward-euler", "bdf2", "generalized-alpha"] = "backward-euler"
    spectral_radius: Annotated[float, Field(ge=0, lt=1)] = 0.8
    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = None
    min_step: Positive | None = None
    max_step: Positive | None = None
    output_every: Positive | None = None


class Solver(Section):
    """Nonlinear solver; `petsc` holds options of PETSc's SNES (`petsc_options`), for example {snes_monitor = true}."""

    petsc: Annotated[dict[str, bool | int | float | str], AfterValidator(checked)] = {}
    step_tolerance: Annotated[float, Field(gt=0, lt=1)] = 1e-9
    quadrature_degree: Annotated[int, Field(ge=1, le=30)] | None = None
    keep_jacobian: bool = True  # runs: a matrix serves as long as Newton converges fast with it
    hull_cells: Annotated[int, Field(ge=1, le=1000)] = 48
    hull_quadrature_degree: Annotated[int, Field(ge=1, le=30)] = 9


class Scene(Section):
    """A complete scene."""

    title: str = ""
    gravity: NonNegative = 9.81
    sea: Sea | None = None
    cable: Cable | None = None
    buoy: Buoy | None = None
    waves: Waves | None = None
    current: Current | None = None
    wind: Wind | None = None
    external_force: ExternalForce | None = None
    initial: Initial = Initial()
    time: Time | None = None
    solver: Solver = Solver()

    @model_validator(mode="after")
    def _sections(self):
        def need(section, other, why):
            if getattr(self, section) is not None and getattr(self, other) is None:
                raise ValueError(f"[{section}] needs [{other}]: {why}")

        if self.cable is None and self.buoy is None:
            raise ValueError("the scene has neither [cable] nor [buoy]: nothing would move")
        need("waves", "sea", "there is no water")
        need("current", "sea", "there is no water")
        if self.waves is not None and self.gravity == 0 and self.waves.wavelength is None:
            raise ValueError("waves.wavelength is missing: without gravity no dispersion relation gives it")
        need("wind", "buoy", "it acts on the buoy only")
        need("external_force", "buoy", "it acts on the buoy only")
        if self.cable is not None:
            if (self.cable.top is None) == (self.buoy is None):
                raise ValueError("[cable.top] and [buoy] exclude each other, and a cable needs one of them")
            if self.sea is not None and self.cable.diameter is None:
                raise ValueError("cable.diameter is missing: the sea needs it")
            self._check_slack()
            if self.initial.kind == "straight" and self.buoy is None and self.cable.top.position is None:
                raise ValueError("initial.kind 'straight' needs cable.top.position, the end of the straight line")
        if self.sea is not None and self.buoy is not None and self.buoy.hull is None:
            raise ValueError("buoy.hull is missing: the sea needs it")
        return self

    def _check_slack(self):
        """Generalized-alpha keeps an acceleration in mind, which an impact makes worthless: it feeds on every snap."""
        time = self.time
        if self.cable.slack == "compressive" or time is None or time.scheme != "generalized-alpha":
            return
        if time.spectral_radius > 0:
            raise ValueError(
                f"cable.slack = 'tension-only' with generalized-alpha needs time.spectral_radius = 0, not "
                f"{time.spectral_radius}: others gain energy whenever the cable snaps taut"
            )

    @property
    def anchor(self) -> tuple[float, float, float]:
        """Position of s = 0."""
        if self.cable.anchor is not None:
            return self.cable.anchor
        return (0.0, 0.0, -self.sea.depth if self.sea else 0.0)

    def to_dict(self) -> dict:
        """Every value that differs from "absent", defaults included: what reproduces this scene."""
        return _without_none(self.model_dump())

    def save(self, path: str | Path) -> None:
        """Write the complete scene as TOML."""
        Path(path).write_text(tomli_w.dumps(self.to_dict()))


def _without_none(value):
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [_without_none(v) for v in value]
    return value
