"""The section [cable.top], and a piece of line with values for all keys."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from . import quantities as q
from .fatigue import CurveText, SteelArea
from .mesh_file import element_lengths
from .quantities import Missing, Wrong
from .section import Section, key
from .stiffness import AxialStiffness
from .wave_files import columns_of

MOST_ROWS = 100_000


def rising(allowed: str) -> Callable[[list[Any]], list[Any]]:
    """Validator of a table: its first column increases."""

    def check(rows: list[Any]) -> list[Any]:
        if not q.is_rising([row[0] for row in rows]):
            raise ValueError(allowed)
        return rows

    return check


_coordinate = Annotated[float, Field(ge=-1e9, le=1e9)]
_Row = Annotated[tuple[_coordinate, _coordinate, _coordinate, _coordinate], BeforeValidator(q.finite_numbers(4))]
Motion = Annotated[
    list[_Row],
    Field(min_length=2, max_length=MOST_ROWS),
    AfterValidator(rising("must hold rows of growing time")),
    BeforeValidator(columns_of(4, "a table, or the name of a file")),
]


class Top(Section):
    """Upper end of a cable without a buoy."""

    kind: Literal["fixed", "prescribed", "free"] = key("boundary condition of the upper end")
    position: q.Vector | None = key("position of the end, or mean position of its motion", "m", default=None)
    force: q.ForceVector = key("force applied to a free end", "N", default=(0.0, 0.0, 0.0))
    amplitude: q.Vector | None = key(
        "amplitude of the motion, position + amplitude sin(2 pi t/period + phase_deg)", "m", default=None
    )
    period: q.Period | None = key("period of the motion", "s", default=None)
    phase_deg: q.Angle | q.Angles = key(
        "phase of the motion at t = 0, one number or one per component", "deg", default=0.0
    )
    ramp: q.Duration = key("ramp-up time of the motion (of the speed of a tow)", "s", default=0.0)
    velocity: q.VelocityVector | None = key("constant velocity of the end (tow)", "m/s", default=None)
    motion: Motion | None = key(
        "time history, rows [t, x, y, z] relative to position (cubic splines), or a file of them", "s, m", default=None
    )

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.kind != "free" and self.position is None:
            raise Wrong("kind", self.kind, "needs a position")
        if self.kind == "prescribed":
            self.check_motion()
        if self.kind != "prescribed":
            self.refuse((*MOTION, "ramp"), "goes with kind 'prescribed' only")
        if self.kind != "free":
            self.refuse(["force"], "goes with kind 'free' only")
        return self

    def check_motion(self) -> None:
        """Raise Wrong or Missing unless exactly one of the three kinds of motion is given."""
        given = [name for name in ("amplitude", "velocity", "motion") if getattr(self, name) is not None]
        if len(given) > 1:
            raise Wrong(given[1], getattr(self, given[1]), f"does not go with {given[0]}: give one of them")
        if (self.period is None) != (self.amplitude is None):
            raise Missing("amplitude" if self.amplitude is None else "period", "a motion needs both")
        if not given:
            raise Wrong("kind", self.kind, "needs amplitude and period, a velocity or a motion")
        if self.amplitude and self.period and math.tau * math.hypot(*self.amplitude) > FASTEST * self.period:
            raise Wrong("period", self.period, f"must be longer: the motion must not be faster than {FASTEST:g} m/s")
        if any(math.dist(a[1:], b[1:]) > FASTEST * (b[0] - a[0]) for a, b in pairwise(self.motion or [])):
            raise Wrong("motion", "[...]", f"must not be faster than {FASTEST:g} m/s")


#: Cosine of the largest rotation of a direction between rows.
WIDEST_TURN = 0.17


class EndDirection(Section):
    """Direction of a line at one of its ends; without it the end is pinned."""

    direction: q.Vector | None = key(
        "direction of the line there, from s = 0 on; at a buoy or vessel in its own frame", "1", default=None
    )
    motion: Motion | None = key(
        "time history of the direction, rows [t, x, y, z] (cubic splines), or a file of them", "s, 1", default=None
    )
    ramp: q.Duration = key("ramp-up time of the turning", "s", default=0.0)
    rotational_stiffness: Annotated[float, Field(gt=0, le=1e15)] | None = key(
        "stiffness of a spring that turns the end into direction; absent: it is held", "N m/rad", default=None
    )

    @model_validator(mode="after")
    def _given(self) -> Self:
        if self.direction is None and self.motion is None:
            raise Missing("direction", "direction of the line there, from s = 0 on, or a motion of it")
        if self.direction is not None and self.motion is not None:
            raise Wrong("motion", "[...]", "does not go with direction: give one of them")
        if self.direction is not None and not math.hypot(*self.direction) > 1e-9:
            raise Wrong("direction", list(self.direction), "must not be zero")
        if self.motion is None:
            self.refuse(["ramp"], "goes with a motion")
        for (_, *a), (_, *b) in pairwise(self.motion or []):
            along = sum(x * y for x, y in zip(a, b, strict=True))
            if not along > WIDEST_TURN * math.hypot(*a) * math.hypot(*b):
                raise Wrong("motion", "[...]", "must hold directions that turn by less than 80 degrees from row to row")
        return self

    @property
    def unit(self) -> tuple[float, ...]:
        """Unit direction; for a motion, the first one."""
        direction = self.direction or (self.motion or [])[0][1:]
        size = math.hypot(*direction)
        return tuple(x / size for x in direction)


#: Speed that no end of a cable reaches [m/s].
FASTEST = 1e3
#: Keys that give the motion of an end, only one at a time.
MOTION = ("amplitude", "period", "velocity", "motion")


BreakingLoad = Annotated[float, Field(gt=0, le=1e10)]


class FailsAt(Section):
    """When the cable parts: at a time, or where its tension is largest once that is reached."""

    time: q.Duration | None = key("time of failure", "s", default=None)
    tension: BreakingLoad | None = key("tension at which the cable parts", "N", default=None)
    at: Annotated[float, Field(ge=0, le=1e5)] | None = key(
        "arc length of the break at that time; absent: the upper end", "m", default=None
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.time is None) == (self.tension is None):
            raise Missing("time", "or tension, and not both")
        if self.at is not None and self.time is None:
            raise Wrong("at", self.at, "goes with a time only: at a tension it parts where that is largest")
        return self


_factor = Annotated[float, Field(ge=1, le=100)]
_Grown = Annotated[tuple[q.Height, _factor, _factor], BeforeValidator(q.finite_numbers(3))]
MarineGrowth = Annotated[
    list[_Grown],
    Field(min_length=1, max_length=100),
    AfterValidator(rising("must hold rows [z, factor of the diameter, factor of the mass] with z increasing")),
]

MOST_ELEMENTS = 10_000_000
MOST_SEGMENTS = 100_000  # listed one by one, as those of a mesh file are in the complete scene of a run
Elements = Annotated[Annotated[int, Field(gt=0, le=MOST_ELEMENTS)] | list[q.Share], BeforeValidator(element_lengths)]


_Wound = Annotated[tuple[q.Duration, q.Length], BeforeValidator(q.finite_numbers(2))]
Lengths = Annotated[
    list[_Wound],
    Field(min_length=2, max_length=MOST_ROWS),
    AfterValidator(rising("must hold rows of growing time")),
    BeforeValidator(columns_of(2, "a table, or the name of a file")),
]


class Cable(Section):
    """A piece of line and its finite elements: the keys of [cable], of its segment and of its material together."""

    length: q.Length = key("unstretched length", "m")
    line_density: q.Mass = key("mass per unstretched length", "kg/m")
    diameter: q.Length | None = key(
        "drag diameter, also used for the displaced volume if area is absent; required with [sea]", "m", default=None
    )
    area: q.Area | None = key(
        "cross-sectional area of the displaced volume; absent: pi diameter^2/4", "m^2", default=None
    )
    axial_stiffness: AxialStiffness = key(
        "axial stiffness EA; inf: inextensible; or a table [[strain, tension], ...]", "N", default=math.inf
    )
    elements: Elements = key(
        "number of elements, [[length, number], ...] from the anchor, or a mesh file", "m, 1", default=20
    )
    grading: Annotated[float, Field(ge=1e-6, le=1e6)] = key(
        "ratio of the last element's length to the first's", "1", default=1.0
    )
    position_degree: Annotated[int, Field(ge=1, le=8)] = key("polynomial degree mu of the position", "1", default=1)
    tension_degree: Annotated[int, Field(ge=0, le=7)] = key("polynomial degree nu < mu of the tension", "1", default=0)
    added_mass: q.AddedMass = key("transverse added-mass coefficient C_A = C_M - 1", "1", default=0.0)
    normal_drag: q.Coefficient = key("transverse drag coefficient", "1", default=0.0)
    tangential_drag: q.Coefficient = key("longitudinal drag coefficient", "1", default=0.0)
    tangential_added_mass: q.Coefficient = key(
        "longitudinal added-mass coefficient, on the displaced mass", "1", default=0.0
    )
    tangential_froude_krylov: bool = key("include the tangential Froude-Krylov force of the waves", default=True)
    marine_growth: MarineGrowth | None = key(
        "marine growth, rows [z, factor on diameter, factor on line_density], by depth at the start",
        "m, 1",
        default=None,
    )
    strain: Literal["exact", "element-average"] = key(
        "pointwise strain, or its mean over each element", default="exact"
    )
    strain_form: Literal["paper", "energy"] = key(
        "strain equation as in the paper, or derived from an energy", default="paper"
    )
    slack: Literal["compressive", "tension-only"] = key(
        "whether the line carries compression, or goes slack without it", default="compressive"
    )
    breaking_load: BreakingLoad | None = key(
        "minimum breaking load (MBL); enables the utilisation output T/MBL", "N", default=None
    )
    steel_area: SteelArea | None = key(
        "cross-section of the steel, of a chain pi d^2/2 of its bar d; for stresses in fatigue", "m^2", default=None
    )
    fatigue_curve: CurveText | None = key(
        "fatigue curve by name, 'API studless', or its constant with a unit, '6e10 MPa^3'", default=None
    )
    damping: q.Damping = key(
        "internal (Kelvin-Voigt) damping c in T = EA e + c de/dt; finite EA only", "N s", default=0.0
    )
    bending_stiffness: Annotated[float, Field(ge=0, le=1e15)] = key(
        "bending stiffness EI; 0: a cable without bending", "N m^2", default=0.0
    )
    bending_damping: q.Damping = key(
        "time beta of the material's damping, m = EI (t' + beta dt'/dt), in motion", "s", default=0.0
    )
    minimum_bend_radius: Annotated[float, Field(gt=0, le=1e5)] | None = key(
        "smallest radius that the line may be bent to; enables the utilisation of bending", "m", default=None
    )
    winch: Lengths | None = key(
        "unstretched length over time, rows [t, length], or a file of them; at first it is length",
        "s, m",
        default=None,
    )
    fails_at: FailsAt | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_winch()
        if self.bending_stiffness and self.slack == "tension-only":
            raise Wrong("slack", self.slack, "does not go with bending_stiffness: a line that bends can be pushed")
        if self.bending_stiffness and self.fails_at is not None:
            raise Wrong("bending_stiffness", self.bending_stiffness, "does not go with fails_at")
        if self.minimum_bend_radius is not None and not self.bending_stiffness:
            raise Wrong("minimum_bend_radius", self.minimum_bend_radius, "goes with bending_stiffness only")
        if self.bending_damping and not self.bending_stiffness:
            raise Wrong("bending_damping", self.bending_damping, "goes with bending_stiffness only")
        if self.damping and math.isinf(self.axial_stiffness):
            raise Wrong("damping", self.damping, "needs a finite axial_stiffness: an inextensible cable has no strain")
        if self.tension_degree >= self.position_degree:
            allowed = (
                f"must be lower than position_degree = {self.position_degree} (Eq. (13): other pairs are unstable)"
            )
            raise Wrong("tension_degree", self.tension_degree, allowed)
        if isinstance(self.elements, list):
            lengths, counts = zip(*self.elements, strict=True) if self.elements else ((), ())
            if not lengths or any(n != int(n) for n in counts):
                raise Wrong("elements", self.elements, "must hold [length, number of elements] of each segment")
            if len(counts) > MOST_SEGMENTS:
                raise Wrong("elements", self.elements, f"must list {MOST_SEGMENTS} segments at most")
            if sum(counts) > MOST_ELEMENTS:
                raise Wrong("elements", self.elements, f"must be {MOST_ELEMENTS} in all at most")
            if abs(sum(lengths) - self.length) > 1e-9 * self.length:
                allowed = f"its segments must add up to length = {self.length} m, not to {sum(lengths)} m"
                raise Wrong("elements", self.elements, allowed)
        return self

    def _check_winch(self) -> None:
        """Raise Wrong unless the winch starts with the length at t = 0, and is not too fast."""
        if self.winch is None:
            return
        if self.winch[0][0] < 0 or abs(self.winch[0][1] - self.length) > 1e-9 * self.length:
            raise Wrong("winch", "[...]", f"must begin at t = 0 or later, with length = {self.length} m")
        if any(abs(b - a) > FASTEST * (u - t) for (t, a), (u, b) in pairwise(self.winch)):
            raise Wrong("winch", "[...]", f"must not be faster than {FASTEST:g} m/s")
        if self.fails_at is not None:
            raise Wrong("winch", "[...]", "does not go with fails_at")
