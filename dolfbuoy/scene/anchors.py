"""Anchors: ends of lines that stay where they are, and what holds them there."""

from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from . import quantities as q
from .network import End, Network
from .quantities import Missing, Wrong
from .section import Section, key

if TYPE_CHECKING:
    from .sections import Scene

Strength = Annotated[float, Field(gt=0, le=1e10)]


class Anchor(Section):
    """An anchor or sinker that must not move; one without `at` serves all anchors of the scene."""

    at: q.Title | None = key("CABLE.from, CABLE.to or the held joint; absent: every anchor", default=None)
    weight: Strength | None = key("weight of a sinker in water", "N", default=None)
    friction: Annotated[float, Field(gt=0, le=10)] | None = key(
        "friction coefficient of the sinker on the bed", "1", default=None
    )
    holding_capacity: Strength | None = key("horizontal force that an embedded anchor holds", "N", default=None)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.weight is None) == (self.holding_capacity is None):
            raise Missing("weight", "with friction, or else holding_capacity")
        if (self.weight is None) != (self.friction is None):
            raise Missing("friction", "with weight, and not without it")
        return self


def anchors_of(network: Network) -> dict[str, list[tuple[int, int]]]:
    """Name of an anchor -> [(cable, its end there: 0 at s = 0, 1 at s = L), ...].

    Ends that stay where they are, not above the other end if that does so too: those at a fixed joint are one anchor of
    its name, the others CABLE.from and CABLE.to.
    """
    found: dict[str, list[tuple[int, int]]] = {}
    for cable, name in enumerate(network.cables):
        ends = ends_of(network, cable)
        for i, (end, other) in enumerate((ends, ends[::-1])):
            if end.kind == "fixed" and (other.kind != "fixed" or _height(end) <= _height(other)):
                found.setdefault(end.name or f"{name}.{('from', 'to')[i]}", []).append((cable, i))
    return found


def ends_of(network: Network, cable: int) -> tuple[End, End]:
    """Lower and upper end of a cable."""
    return network.pieces[network.first_of(cable)].ends[0], network.pieces[network.last_of(cable)].ends[1]


def _height(end: End) -> float:
    return end.position[2] if end.position else 0.0


def given_anchors(scene: "Scene") -> dict[str, Anchor]:
    """Section of each anchor, by its name; empty without any.  Raises Wrong or Missing."""
    known, found = list(anchors_of(scene.network)), dict[str, Anchor]()
    for anchor in scene.anchor or []:
        names = known if anchor.at is None else [anchor.at]
        for name in names:
            if name not in known:
                raise Wrong("anchor.at", name, f"must be one of the anchors: {', '.join(known) or 'there is none'}")
            if name in found:
                raise Wrong("anchor.at", name, "is given twice")
            found[name] = anchor
    if found and len(found) < len(known):
        missing = ", ".join(name for name in known if name not in found)
        raise Missing("anchor", f"one for each end that stays where it is, for {missing} too")
    return found
