"""The sections [cable] with its segments, [material.NAME] and [[joint]]."""

from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, Self, cast

from pydantic import BeforeValidator, Field, create_model, model_validator

from .cable import MOTION, Cable, EndDirection, Top
from .quantities import Coefficient, DragArea, Height, Name, Title, Vector, Volume, Wrong, finite_numbers
from .section import Section, key, unit_of


def _place(value: Any) -> Any:
    if isinstance(value, str):
        return value
    try:
        return finite_numbers(3)(value)
    except ValueError:
        raise ValueError("must be [x, y, z] or the name of a joint, a buoy, BUOY.FAIRLEAD or VESSEL.FAIRLEAD") from None


Place = Annotated[str | tuple[Height, Height, Height], BeforeValidator(_place)]

#: Keys of a cable shared by its segments, and keys of its length.
SHARED = ("position_degree", "tension_degree", "strain", "strain_form", "slack")
SIZE = ("length", "elements", "grading", "winch")
#: Keys of the material of a piece of line.
PHYSICAL = tuple(name for name in Cable.model_fields if name not in (*SHARED, *SIZE))


def _absent(model: type[Section], names: Iterable[str]) -> dict[str, Any]:
    """Keys of a section as optional fields for create_model."""
    found = {}
    for name in names:
        info = model.model_fields[name]
        annotation = Annotated[info.annotation, *info.metadata] if info.metadata else info.annotation
        found[name] = cast(Any, annotation) | None, key(info.description or "", unit_of(info) or None, default=None)
    return found


class Body(Section):
    """A clump or a float."""

    mass: Annotated[float, Field(ge=0, le=1e9)] = key("mass", "kg", default=0.0)
    volume: Volume = key("displaced volume", "m^3", default=0.0)
    drag_area: DragArea = key("drag area C_D A", "m^2", default=0.0)
    added_mass: Coefficient = key("added-mass coefficient C_A, on the displaced mass", "1", default=0.0)
    # last: the name hides that of the type
    float: str | None = key("name of a float of the library; supplies the keys that are absent here", default=None)


class Sinker(Body):
    """A body on the bed that holds a line, with a friction of its own; in statics it stays at its place [m]."""

    friction: float
    place: Vector


#: Base tables with the keys of Cable, and of Top for a joint.
_Material: Any = create_model("_Material", __base__=Section, **_absent(Cable, PHYSICAL))


class Material(_Material):  # type: ignore[misc]  # pydantic makes its base
    """Material of a piece of line."""

    source: Title | None = key("source of the values", default=None)
    catalogue: Title | None = key("name of the library material whose values these are", default=None)


class _Piece(Section):
    material: str | None = key(
        "name of a [material.NAME] or of a library material; supplies the keys that are absent here", default=None
    )


_Segment: Any = create_model(
    "_Segment", __base__=_Piece, **_absent(Cable, (*SIZE, *PHYSICAL)), body=(Body | None, None)
)


class Segment(_Segment):  # type: ignore[misc]  # pydantic makes its base
    """A piece of a cable, of one material."""


_from = (
    Place | None,
    key("lower end (s = 0): [x, y, z] or a name as in `to`; absent: the anchor", "m", None),
)
_From: Any = create_model("_From", __base__=_Piece, **(_absent(Cable, Cable.model_fields) | {"from": _from}))


class Line(_From):  # type: ignore[misc]  # pydantic makes its base
    """A cable: what it is made of, its finite elements, and what it hangs together with."""

    resolved: ClassVar = Cable  #: its defaults hold where a key is absent
    anchor: Vector | None = key("anchor position (s = 0); absent: [0, 0, -depth]", "m", default=None)
    top: Top | None = None
    name: Name | None = key("name of the cable; required if there are several", default=None)
    to: Place | None = key(
        "upper end (s = length): [x, y, z], a joint, 'buoy', or 'NAME.FAIRLEAD' of a buoy or vessel", "m", default=None
    )
    from_end: EndDirection | None = None
    to_end: EndDirection | None = None
    segments: list[Segment] | None = key("segments from the lower end up, instead of length", default=None)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name, other in (("from", "anchor"), ("to", "top")):
            if getattr(self, name) is not None and getattr(self, other) is not None:
                raise Wrong(name, getattr(self, name), f"does not go with {other}: give one of them")
        if self.segments is None:
            return self
        if not self.segments:
            raise Wrong("segments", [], "must hold at least one segment")
        self.refuse(SIZE, "does not go with segments, which have their own")
        return self


_Joint: Any = create_model(
    "_Joint",
    __base__=Body,
    name=(Name, key("name of the joint")),
    **_absent(Top, [name for name in Top.model_fields if name not in ("kind", "force")]),
)


class Joint(_Joint):  # type: ignore[misc]  # pydantic makes its base
    """A point where cables meet: free, with a body if it has mass or volume; held where it has a position."""

    weld: bool = key("whether the two lines that meet here go on without a kink; both bend", default=False)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.position is None:
            self.refuse((*MOTION, "phase_deg", "ramp"), "goes with a position, the middle of the motion")
            return self
        self.refuse((*Body.model_fields, "weld"), "goes with a free joint only, and this one has a position")
        if self.held is not None and self.held.kind == "prescribed":
            self.held.check_motion()
        return self

    @property
    def held(self) -> Top | None:
        """Boundary condition of a joint with a position; None if it is free."""
        if self.position is None:
            return None
        given = {name: value for name in Top.model_fields if (value := getattr(self, name, None)) is not None}
        return Top(kind="prescribed" if any(name in given for name in MOTION) else "fixed", **given)
