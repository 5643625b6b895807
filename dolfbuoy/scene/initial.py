"""The section [initial]."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .quantities import Name, Quaternion, Vector, VelocityVector, Wrong
from .section import Section, key

Corners = Annotated[list[Vector], Field(max_length=40_000)]


class BuoyStart(Section):
    """Pose and velocity of a buoy at t = 0."""

    buoy_position: Vector | None = key("initial position of C; absent: from the equilibrium", "m", default=None)
    buoy_orientation: Quaternion | None = key(
        "initial orientation as a quaternion, body to world; absent: from the equilibrium", "1", default=None
    )
    buoy_velocity: VelocityVector | None = key("initial velocity of C; absent: at rest", "m/s", default=None)
    buoy_angular_velocity: VelocityVector | None = key(
        "initial angular velocity in the world frame; absent: at rest", "rad/s", default=None
    )

    @model_validator(mode="after")
    def _turned(self):
        if self.buoy_orientation is not None and sum(c * c for c in self.buoy_orientation) == 0:
            raise Wrong("buoy_orientation", self.buoy_orientation, "must not be the zero quaternion")
        return self


class Initial(BuoyStart):
    """How a run starts."""

    kind: Literal["equilibrium", "straight", "polyline"] = key("initial shape of the cables", default="equilibrium")
    points: Corners | dict[Name, Corners] | None = key(
        "vertices of the initial shape, or of a first guess, from the anchor up; for several cables by name",
        "m",
        default=None,
    )

    @model_validator(mode="after")
    def _consistent(self):
        if self.kind == "polyline" and self.points is None:
            raise Wrong("kind", self.kind, "needs points")
        if self.kind == "straight" and self.points is not None:
            raise Wrong("points", self.points, "goes with kind 'polyline' or 'equilibrium' only")
        for points in self.points.values() if isinstance(self.points, dict) else [self.points]:
            if points is not None and len(points) < 2:
                raise Wrong("points", points, "must be at least two points")
        return self
