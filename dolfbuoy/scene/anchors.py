"""Anchors: ends of lines that stay where they are, what holds them there, and sinkers that may be dragged off."""

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from . import quantities as q
from .lines import Sinker
from .network import End, Network
from .quantities import Missing, Wrong
from .section import Section, key

if TYPE_CHECKING:
    from .sections import Scene

Strength = Annotated[float, Field(gt=0, le=1e10)]
#: A place is on the bed if it is no farther from it than this part of the depth.
ON_BED = 1e-4


class Anchor(Section):
    """An anchor or sinker; one without `at` serves all anchors of the scene."""

    at: q.Title | None = key("CABLE.from, CABLE.to or the held joint; absent: every anchor", default=None)
    weight: Strength | None = key("weight of a sinker in water", "N", default=None)
    friction: Annotated[float, Field(gt=0, le=10)] | None = key(
        "friction coefficient of the sinker on the bed", "1", default=None
    )
    holding_capacity: Strength | None = key("horizontal force that an embedded anchor holds", "N", default=None)
    drags: bool = key("in a run a body on the bed, which drags or lifts if it is pulled so hard", default=False)
    density: q.Density = key("density of a sinker that drags, from which its mass follows", "kg/m^3", default=2400.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.weight is None) == (self.holding_capacity is None):
            raise Missing("weight", "with friction, or else holding_capacity")
        if (self.weight is None) != (self.friction is None):
            raise Missing("friction", "with weight, and not without it")
        if self.drags and self.weight is None:
            raise Wrong("drags", True, "goes with a sinker: give weight and friction")
        return self


def anchors_of(network: Network) -> dict[str, list[tuple[int, int]]]:
    """Name of an anchor -> [(cable, its end there: 0 at s = 0, 1 at s = L), ...].

    Anchors are fixed ends; if both ends of a line are fixed, not the upper one.  Those at a fixed joint form one anchor
    with its name, others are called CABLE.from and CABLE.to.
    """
    found: dict[str, list[tuple[int, int]]] = {}
    for cable, name in enumerate(network.cables):
        ends = ends_of(network, cable)
        for i, (end, other) in enumerate((ends, ends[::-1])):
            if stays(end) and (not stays(other) or _height(end) <= _height(other)):
                found.setdefault(end.name or f"{name}.{('from', 'to')[i]}", []).append((cable, i))
    return found


def ends_of(network: Network, cable: int) -> tuple[End, End]:
    """Lower and upper end of a cable."""
    return network.pieces[network.first_of(cable)].ends[0], network.pieces[network.last_of(cable)].ends[1]


def stays(end: End) -> bool:
    """True for an end that is fixed, or held by a sinker."""
    return end.kind == "fixed" or end.is_on_sinker


def _height(end: End) -> float:
    return end.position[2] if end.position else 0.0


def given_anchors(scene: "Scene") -> dict[str, Anchor]:
    """Section of each anchor by name; empty without any.  Raises Wrong or Missing."""
    return _given(scene.anchor or [], scene.network)


def _given(anchors: list[Anchor], network: Network) -> dict[str, Anchor]:
    known, found = list(anchors_of(network)), dict[str, Anchor]()
    if anchors and not known:
        raise Wrong("anchor", "[...]", "is of ends of lines that stay where they are, and there is none")
    for anchor in anchors:
        names = known if anchor.at is None else [anchor.at]
        for name in names:
            if name not in known:
                raise Wrong("anchor.at", name, f"must be one of the anchors: {', '.join(known)}")
            if name in found:
                raise Wrong("anchor.at", name, "is given twice")
            found[name] = anchor
    if found and len(found) < len(known):
        missing = ", ".join(name for name in known if name not in found)
        raise Missing("anchor", f"one for each end that stays where it is, for {missing} too")
    return found


def with_sinkers(scene: "Scene", network: Network) -> Network:
    """The network with sinkers that may drag as bodies at joints.  Raises Wrong or Missing."""
    dragged = {name: one for name, one in _given(scene.anchor or [], network).items() if one.drags}
    if not dragged:
        return network
    pieces, bodies, all_ends = list(network.pieces), dict(network.bodies), anchors_of(network)
    for name, anchor in dragged.items():
        for cable, i in all_ends[name]:
            k = network.last_of(cable) if i else network.first_of(cable)
            ends = list(pieces[k].ends)
            ends[i] = replace(ends[i], kind="joint", name=name)
            pieces[k] = replace(pieces[k], ends=(ends[0], ends[1]))
            bodies[name] = _sinker(scene, name, anchor, ends[i])
    joints = network.joints | dict.fromkeys(dragged)
    return replace(network, pieces=tuple(pieces), joints=joints, bodies=bodies)


def _sinker(scene: "Scene", name: str, anchor: Anchor, end: End) -> Sinker:
    """The body of a sinker at the position of an end.  Raises Wrong or Missing."""
    if scene.sea is None or scene.seabed is None:
        raise Missing("seabed", "a sinker that drags lies on it")
    if scene.seabed.friction == 0:
        raise Wrong("seabed.friction", 0.0, "must be above 0 where a sinker drags, which has its own")
    if scene.gravity == 0 or anchor.density <= scene.sea.density:
        raise Wrong("anchor.density", anchor.density, f"must be above that of the water, {scene.sea.density:g} kg/m^3")
    x, y, z = end.position or (0.0, 0.0, 0.0)
    bed = scene.seabed.slope[0] * x + scene.seabed.slope[1] * y - scene.sea.depth
    bed = bed if scene.seabed.depths is None else float(scene.seabed.depths.height(x, y))
    if abs(z - bed) > ON_BED * scene.sea.depth:
        raise Wrong(
            "anchor.drags", True, f"needs a sinker on the bed, and {name} is at z = {z:g} m, the bed at {bed:g}"
        )
    volume = (anchor.weight or 0.0) / scene.gravity / (anchor.density - scene.sea.density)
    return Sinker(mass=anchor.density * volume, volume=volume, friction=anchor.friction or 0.0, place=(x, y, bed))
