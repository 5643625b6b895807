"""The section [[vessel]]: a rigid body with prescribed motion, and the ends of lines on it."""

import math
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BeforeValidator, Field, PrivateAttr, model_validator

from . import quantities as q
from .buoy import Wind
from .cable import FASTEST, MOST_ROWS, EndDirection, Top, rising
from .quantities import Wrong
from .section import Section, key
from .wave_files import columns_of, motions_of

_number = Annotated[float, Field(ge=-1e9, le=1e9)]
_Row = Annotated[
    tuple[_number, _number, _number, _number, _number, _number, _number], BeforeValidator(q.finite_numbers(7))
]
Motions = Annotated[
    list[_Row],
    Field(min_length=2, max_length=MOST_ROWS),
    AfterValidator(rising("must hold rows of growing time")),
    BeforeValidator(motions_of),
]
Box = Annotated[tuple[_number, _number, _number, _number], BeforeValidator(q.finite_numbers(4))]
_Operator = Annotated[tuple[_number, ...], BeforeValidator(q.finite_numbers(14))]
Operators = Annotated[
    list[_Operator],
    Field(min_length=1, max_length=MOST_ROWS),
    BeforeValidator(columns_of(14, "a table, or the name of a file")),
]
#: Rotation of a vessel between rows above which interpolated points are no longer accurate [deg].
WIDEST = 90.0


class WindOnVessel(Wind):
    """Wind on a vessel, Eq. (2); it moves nothing."""

    height: q.Height = key("height above the reference point, in its own frame, at which the force acts", "m")


class Vessel(Section):
    """A rigid body that moves as it is told; lines end at its fairleads, and no force moves it."""

    name: q.Name = key("name of the vessel")
    position: q.Vector = key("position of its reference point at rest", "m")
    heading_deg: q.Angle = key("angle from the x axis to its own, counterclockwise", "deg", default=0.0)
    fairleads: dict[q.Name, q.Vector] = key(
        "points {NAME = [x, y, z], ...} where lines end, in its own frame, from the reference point", "m"
    )
    hull: Box | None = key(
        "box in pictures, [length, breadth, height of keel, of deck] about its reference point", "m", default=None
    )
    wind: WindOnVessel | None = None
    motion: Motions | None = key(
        "rows [t, x, y, z, roll, pitch, yaw] about rest (splines), or a file of them; absent: it rests",
        "s, m, deg",
        default=None,
    )
    ramp: q.Duration = key("ramp-up time of the motion", "s", default=0.0)
    raos: Operators | None = key(
        "rows [period, direction, size, phase of surge ... yaw per metre of wave], or a file; see coupling",
        "s, m, deg",
        default=None,
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not self.fairleads:
            raise Wrong("fairleads", {}, "must name a point or more")
        if self.hull is not None and not (min(self.hull[:2]) > 0 and self.hull[3] > self.hull[2]):
            allowed = "must be [length, breadth, keel, deck], the first two above 0 and the deck over the keel"
            raise Wrong("hull", list(self.hull), allowed)
        if self.motion is None:
            self.refuse(["ramp"], "goes with a motion")
        for before, after in pairwise(self.motion or []):
            if any(abs(b - a) > WIDEST for a, b in zip(before[4:], after[4:], strict=True)):
                raise Wrong("motion", "[...]", f"must not turn by more than {WIDEST:g} degrees from row to row")
        self._check_operators()
        for name in self.fairleads:
            path = self.held(name).motion or []
            if any(math.dist(a[1:], b[1:]) > FASTEST * (b[0] - a[0]) for a, b in pairwise(path)):
                raise Wrong("motion", "[...]", f"must not be faster than {FASTEST:g} m/s")
        return self

    def _check_operators(self) -> None:
        """Raise Wrong unless each combination of periods and directions has exactly one row."""
        pairs = [row[:2] for row in self.raos or []]
        periods, angles = {period for period, _ in pairs}, {angle for _, angle in pairs}
        if any(period <= 0 for period in periods) or any(not -360 <= angle <= 360 for angle in angles):
            raise Wrong("raos", "[...]", "must have positive periods, and directions from -360 to 360 degrees")
        if len({angle % 360 for angle in angles}) < len(angles) or len(set(pairs)) < len(pairs):
            raise Wrong("raos", "[...]", "must have each period and direction once")
        if len(pairs) != len(periods) * len(angles):
            raise Wrong("raos", "[...]", "must have a row for every period in every direction")

    def held(self, fairlead: str, scene: Any = None) -> Top:
        """Boundary condition of an end of a line at a fairlead; scene: with the waves, if it has operators."""
        point = self.fairleads[fairlead]
        rest = turned(point, 0.0, 0.0, self.heading_deg)
        x, y, z = (a + b for a, b in zip(self.position, rest, strict=True))
        position = x, y, z
        if self.raos is not None and scene is not None:
            return Riding(kind="prescribed", position=position).on(self, fairlead, scene)
        if self.motion is None:
            return Top(kind="fixed", position=position)
        rows = []
        for t, *shift, roll, pitch, yaw in self.motion:
            arm = turned(point, roll, pitch, self.heading_deg + yaw)
            rows.append((t, *(s + a - r for s, a, r in zip(shift, arm, rest, strict=True))))
        known: dict[str, Any] = {"kind": "prescribed", "position": position, "motion": rows, "ramp": self.ramp}
        return Top.model_construct(**known)

    def clamp(self, given: EndDirection | None, scene: Any = None) -> EndDirection | None:
        """Direction of an end of a line fixed to the vessel, in the world frame; scene: as in `held`."""
        if given is None or given.direction is None:
            return given
        x, y, z = turned(given.direction, 0.0, 0.0, self.heading_deg)
        if self.raos is not None and scene is not None:
            spring = given.rotational_stiffness
            return RidingDirection(direction=(x, y, z), rotational_stiffness=spring).on(self, given.direction, scene)
        if self.motion is None:
            return given.model_copy(update={"direction": (x, y, z)})
        rows = [(row[0], *turned(given.direction, row[4], row[5], self.heading_deg + row[6])) for row in self.motion]
        return given.model_copy(update={"direction": None, "motion": rows, "ramp": self.ramp})


class OnVessel(Section):
    """Part of a vessel that rides the waves of a scene; own: the name of a fairlead, or a direction in its frame."""

    _vessel: Any = PrivateAttr(default=None)
    _own: Any = PrivateAttr(default=None)
    _scene: Any = PrivateAttr(default=None)

    def on(self, vessel: Vessel, own: Any, scene: Any) -> Self:
        """This part, on a vessel in the waves of a scene."""
        self._vessel, self._own, self._scene = vessel, own, scene
        return self

    @property
    def vessel(self) -> Vessel:
        """The vessel."""
        found: Vessel = self._vessel
        return found

    @property
    def own(self) -> Any:
        """Its fairlead or direction."""
        return self._own

    @property
    def scene(self) -> Any:
        """The scene whose waves the vessel rides."""
        return self._scene


class Riding(OnVessel, Top):
    """An end of a line at a fairlead of a vessel that rides the waves of a scene."""

    def check_motion(self) -> None:
        """It moves with its vessel."""


class RidingDirection(OnVessel, EndDirection):
    """The direction of an end that a vessel turns in the waves of a scene."""


def turned(point: tuple[float, float, float], roll: float, pitch: float, yaw: float) -> list[float]:
    """A vector rotated by roll, pitch and yaw [deg], in this order about the world axes."""
    found = list(point)
    for axis, angle in enumerate((roll, pitch, yaw)):
        c, s, i, j = math.cos(math.radians(angle)), math.sin(math.radians(angle)), (axis + 1) % 3, (axis + 2) % 3
        found[i], found[j] = c * found[i] - s * found[j], s * found[i] + c * found[j]
    return found
