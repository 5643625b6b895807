"""The section [take_off]: a power take-off, a spring or a damper between two points."""

from typing import Annotated, Any, Self

from pydantic import Field, create_model, model_validator

from . import quantities as q
from .lines import Place
from .quantities import Missing, Wrong
from .section import Section, key

Rate = Annotated[float, Field(ge=0, le=1e12)]  # N/m, N s/m, N s^2/m^2
_Speed = Annotated[float, Field(ge=1e-9, le=1e3)]
_Reach = Annotated[float, Field(ge=0, le=1e5)]

_places: Any = {
    "from": (Place, key("first end: [x, y, z], a joint, 'buoy', or 'NAME.FAIRLEAD' of a buoy or vessel", "m")),
    "to": (Place, key("second end, as `from`; tension draws the two together", "m")),
}
_name: Any = q.Name | None, key("name of the take-off; required if there are several", default=None)
_Ends: Any = create_model("_Ends", __base__=Section, name=_name, **_places)


class TakeOff(_Ends):  # type: ignore[misc]  # pydantic makes its base
    """A device between two points whose tension is the sum of its parts; it has no mass."""

    pretension: q.Force = key("tension whatever the length", "N", default=0.0)
    stiffness: Rate = key("stiffness of a spring", "N/m", default=0.0)
    length: _Reach | None = key("length at which the spring has no tension of its own", "m", default=None)
    damping: Rate = key("linear damping: tension per speed of elongation", "N s/m", default=0.0)
    quadratic_damping: Rate = key("quadratic damping: tension per square of that speed", "N s^2/m^2", default=0.0)
    friction: Rate = key("Coulomb friction: tension whatever the speed", "N", default=0.0)
    friction_speed: _Speed = key("speed at which 0.7 of the friction is there", "m/s", default=0.01)
    shortest: _Reach | None = key("length below which an end stop pushes", "m", default=None)
    longest: q.Length | None = key("length above which an end stop pulls", "m", default=None)
    stop_stiffness: Rate = key("stiffness of the end stops", "N/m", default=0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.stiffness and self.length is None:
            raise Missing("length", "the spring needs it")
        if not self.stiffness and self.length is not None:
            raise Wrong("length", self.length, "goes with a stiffness")
        ends = self.shortest is not None or self.longest is not None
        if ends and not self.stop_stiffness:
            raise Missing("stop_stiffness", "the end stops need it")
        if self.stop_stiffness and not ends:
            raise Missing("longest", "or shortest: where the end stops are")
        if self.shortest is not None and self.longest is not None and self.shortest >= self.longest:
            raise Wrong("shortest", self.shortest, f"must be below longest = {self.longest:g}")
        return self

    @property
    def holds(self) -> bool:
        """True if it carries a tension at rest."""
        return bool(self.stiffness or self.pretension)

    def at_rest(self, length: float) -> tuple[float, float]:
        """Tension [N] and stiffness [N/m] at rest at a length [m]."""
        T, k = self.pretension + self.stiffness * (length - (self.length or 0.0)), self.stiffness
        if self.longest is not None and length > self.longest:
            T, k = T + self.stop_stiffness * (length - self.longest), k + self.stop_stiffness
        if self.shortest is not None and length < self.shortest:
            T, k = T - self.stop_stiffness * (self.shortest - length), k + self.stop_stiffness
        return T, k
