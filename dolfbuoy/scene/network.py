"""Topology of a scene: pieces of line between ends, joints and buoys, resolved from its tables.

A scene with one [cable] and at most one [buoy] is a network too: one piece from its anchor to its top.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from .buoy import Buoy
from .cable import Cable, EndDirection, Top
from .lines import Body, Line
from .quantities import Missing, Wrong
from .segments import sections_of
from .shapes import by_shape

if TYPE_CHECKING:
    from .sections import Scene
    from .take_off import TakeOff

#: Sections of a single buoy: in its table, or at top level of a scene with only one.
OWN = ("wind", "external_force", "initial")


@dataclass(frozen=True)
class End:
    """Attachment of an end of a piece of line; clamp: its direction, None if pinned.

    kind: "fixed", "prescribed", "free" (`top`: where, or the force on it), "joint" (a free one, or a sinker that may be
    dragged) or "buoy" (at the named fairlead, None: on its axis).  name: of the joint, held or free, of the buoy, or
    VESSEL.FAIRLEAD.
    """

    kind: str
    top: Top | None = None
    name: str | None = None
    fairlead: str | None = None
    clamp: EndDirection | None = None

    @property
    def held(self) -> bool:
        """True if its position is given."""
        return self.kind in ("fixed", "prescribed")

    @property
    def is_on_sinker(self) -> bool:
        """True for the end of a line on a sinker that may drag; `top` is then its position at rest."""
        return self.kind == "joint" and self.top is not None

    @property
    def position(self) -> tuple[float, float, float] | None:
        """Given position, or mean position of a motion [m]."""
        return self.top.position if self.top is not None else None


@dataclass(frozen=True)
class Piece:
    """A piece of one material: an interval of its own.  cable, number: which cable, and which of its segments."""

    cable: int
    number: int
    section: Cable
    ends: tuple[End, End]

    @property
    def is_bar(self) -> bool:
        """True for an element between two points of a buoy, which keep it straight."""
        low, high = self.ends
        of_one = low.kind == high.kind == "buoy" and low.name == high.name
        return of_one and self.section.elements == self.section.position_degree == 1


@dataclass(frozen=True)
class Device:
    """A power take-off between two ends, each held, at a free joint or on a buoy."""

    section: "TakeOff"
    ends: tuple[End, End]


@dataclass(frozen=True)
class Network:
    """Pieces, cable after cable and each from its lower end on; names of cables, joints (with what holds them, None:
    free) and buoys, each of these with its own wind, external force and start; bodies of free joints by their names.
    """

    pieces: tuple[Piece, ...] = ()
    cables: tuple[str, ...] = ()
    joints: dict[str, Top | None] = field(default_factory=dict)
    bodies: dict[str, Body] = field(default_factory=dict)
    buoys: dict[str, Buoy] = field(default_factory=dict)
    #: Joints through which bending lines continue without a kink.
    welds: frozenset[str] = frozenset()
    #: Power take-offs by name.
    take_offs: dict[str, Device] = field(default_factory=dict)

    @cached_property
    def bends(self) -> bool:
        """True if any line has a bending stiffness."""
        return any(piece.section.bending_stiffness for piece in self.pieces)

    @cached_property
    def winches(self) -> dict[str, int]:
        """Name -> number of pieces whose unstretched length changes over time."""
        return {self.name_of(k): k for k, piece in enumerate(self.pieces) if piece.section.winch is not None}

    @cached_property
    def _spans(self) -> list[range]:
        """Numbers of the pieces of each cable."""
        found = [range(0)] * len(self.cables)
        for k, piece in enumerate(self.pieces):
            found[piece.cable] = range(k - piece.number, k + 1)
        return found

    def name_of(self, piece: int) -> str:
        """Name of the cable of a piece, CABLE.NUMBER if it has several."""
        cable = self.pieces[piece].cable
        name = self.cables[cable]
        return name if len(self._spans[cable]) == 1 else f"{name}.{self.pieces[piece].number}"

    def pieces_of(self, cable: int) -> range:
        """Numbers of the pieces of a cable."""
        return self._spans[cable]

    def sections_of(self, cable: int) -> list[Cable]:
        """Sections of the pieces of a cable, from its lower end on."""
        return [self.pieces[k].section for k in self._spans[cable]]

    def last_of(self, cable: int) -> int:
        """Number of the last piece of a cable."""
        return self._spans[cable][-1]

    def first_of(self, cable: int) -> int:
        """Number of the first piece of a cable."""
        return self._spans[cable][0]

    def ends_of(self, cable: int) -> tuple[str, str]:
        """Names of the ends of a cable in sentences, `from` and `to`: those of their attachments, if named."""
        low, high = self.pieces[self.first_of(cable)].ends[0], self.pieces[self.last_of(cable)].ends[1]
        return _called(low) or "the anchor", _called(high) or "the top"

    def meetings(self) -> dict[str, list[tuple[int, int]]]:
        """Name of a free joint -> [(piece, end)] of all pieces that meet there."""
        found: dict[str, list[tuple[int, int]]] = {}
        for k, piece in enumerate(self.pieces):
            for i, end in enumerate(piece.ends):
                if end.kind == "joint" and end.name is not None:
                    found.setdefault(end.name, []).append((k, i))
        return found

    def parts(self) -> dict[str | int, set[str | int]]:
        """Number of a cable, or name of a joint or buoy -> all that are connected with it."""
        found: dict[str | int, set[str | int]] = {name: {name} for name in [*self.joints, *self.buoys]}
        for piece in self.pieces:
            _join(found, {piece.cable, *(end.name for end in piece.ends if end.name is not None)})
        for device in self.take_offs.values():
            _join(found, {end.name for end in device.ends if end.name is not None})
        return found

    def key_of(self, cable: int) -> str:
        """Key of the table of a cable: "cable" for the only one, else "cable.NAME"."""
        return _key_of("cable", self.cables, self.cables[cable])

    def bars_of(self, buoy: str) -> list[int]:
        """Cables that are bars between two points of a buoy and move with it."""
        return [piece.cable for piece in self.pieces if piece.is_bar and piece.ends[0].name == buoy]

    def key_of_buoy(self, name: str) -> str:
        """Key of the table of a buoy: "buoy" for the only one, else "buoy.NAME"."""
        return _key_of("buoy", self.buoys, name)


def _join(found: dict[str | int, set[str | int]], names: set[str | int]) -> None:
    """Merge the groups of parts connected with these names."""
    joined = set().union(names, *(found.get(name, set()) for name in names))
    found |= dict.fromkeys(joined, joined)


def _key_of(section: str, names: Collection[str], name: str) -> str:
    return section if len(names) == 1 else f"{section}.{name}"


def _called(end: End) -> str:
    return ".".join(filter(None, (end.name, end.fairlead)))


def _fixed(position: tuple[float, float, float]) -> End:
    return End("fixed", Top(kind="fixed", position=position))


def named(sections: Sequence[Any], what: str) -> dict[str, Any]:
    """Sections by name; `what` for a single one without.  Raises Missing, or Wrong for a name given twice."""
    found = {}
    for section in sections:
        name = getattr(section, "name", None) or (what if len(sections) == 1 else None)
        if name is None:
            raise Missing(f"{what}.name", f"each [[{what}]] of several needs one")
        if name in found:
            raise Wrong(f"{what}.name", name, "is given twice")
        found[name] = section
    return found


def resolved(scene: "Scene") -> Network:
    """The network that the tables of a scene describe.  Raises Wrong or Missing."""
    return _Resolver(scene).network()


class _Resolver:
    """Reads the sections of a network."""

    def __init__(self, scene: "Scene"):
        self.scene = scene
        self.cables = named(scene.cables, "cable")
        self.buoys = named(scene.buoys, "buoy")
        joints = named(scene.joint or [], "joint")
        for name in joints:
            if name in self.buoys or name == "buoy":
                raise Wrong("joint.name", name, "is the name of a buoy")
        self.vessels = named(scene.vessel or [], "vessel")
        for name in self.vessels:
            if name in self.buoys or name in joints or name == "buoy":
                raise Wrong("vessel.name", name, "is the name of a buoy or a joint")
        self.joints = {name: joint.held for name, joint in joints.items()}
        self.bodies = {name: joint for name, joint in joints.items() if any(_numbers(joint))}
        self.welds = {name for name, joint in joints.items() if joint.weld}
        self.used: set[str] = set()

    def network(self) -> Network:
        pieces: list[Piece] = []
        for number, (name, line) in enumerate(self.cables.items()):
            key = self._key(name)
            sections = sections_of(line, self.scene.material or {}, key)
            place = getattr(line, "from")
            anchor = line.anchor or (0.0, 0.0, -self.scene.sea.depth if self.scene.sea else 0.0)
            low = _fixed(anchor) if place is None else self._end(place, f"{key}.from")
            low = replace(low, clamp=self._clamp(place, line.from_end, f"{key}.from_end"))
            high = replace(self._high(name, line), clamp=self._clamp(line.to, line.to_end, f"{key}.to_end"))
            pieces += self._chain(number, name, line, sections, (low, high))
        take_offs = {name: self._device(name, one) for name, one in named(self.scene.take_offs, "take_off").items()}
        for key, name in [*(("joint", name) for name in self.joints), *(("vessel", name) for name in self.vessels)]:
            if name not in self.used:
                raise Wrong(
                    f"{key}.name", name, "holds no cable: name it in from or to of a [[cable]], or leave it out"
                )
        # each buoy has its own wind, external force and start; a single one takes those of the scene
        buoys, alone, start = {}, len(self.buoys) == 1, type(self.scene.initial).model_construct()
        for name, buoy in self.buoys.items():
            own = {key: getattr(buoy, key) or (getattr(self.scene, key) if alone else None) for key in OWN}
            buoy = buoy.model_copy(update=own | {"initial": own["initial"] or start})
            buoys[name] = by_shape(self.scene, buoy, _key_of("buoy", self.buoys, name))
        welds = frozenset(self.welds)
        return Network(tuple(pieces), tuple(self.cables), self.joints, self.bodies, buoys, welds, take_offs)

    def _device(self, name: str, section: "TakeOff") -> Device:
        """A take-off with its ends; its own joint does not count as holding a cable."""
        key, used = "take_off" if len(self.scene.take_offs) == 1 else f"take_off.{name}", self.used.copy()
        ends = self._end(getattr(section, "from"), f"{key}.from"), self._end(section.to, f"{key}.to")
        self.used = used | {end.name.partition(".")[0] for end in ends if end.name and end.name not in self.joints}
        low, high = ends
        if low == high or (low.held and high.held):
            raise Wrong(
                f"{key}.to", section.to, "must be another place than from, and one of the two must be free to move"
            )
        return Device(section, ends)

    def _clamp(self, place: Any, given: EndDirection | None, key: str) -> EndDirection | None:
        """Clamped direction of an end at an attachment."""
        name = place.partition(".")[0] if isinstance(place, str) else ""
        if given is not None and given.motion is not None and (name in self.vessels or name in {"buoy", *self.buoys}):
            raise Wrong(f"{key}.motion", "[...]", f"does not go with {name}, which turns the end: give a direction")
        return self.vessels[name].clamp(given, self.scene) if name in self.vessels else given

    def _key(self, cable: str) -> str:
        return _key_of("cable", self.cables, cable)

    def _chain(self, number: int, name: str, line: Line, sections: list[Cable], ends: tuple[End, End]) -> list[Piece]:
        """Pieces of a cable, with a free joint between neighbours."""
        bodies = [segment.body for segment in line.segments or []]
        if bodies and bodies[-1] is not None:
            place = f"{self._key(name)}.segments.{len(bodies) - 1}.body"
            allowed = "goes with the upper end of a segment that another one follows: at the end of a cable a [[joint]]"
            raise Wrong(place, "[...]", f"{allowed} holds it")
        between = [f"{name}.{k}" for k in range(1, len(sections))]
        bends = [section.bending_stiffness > 0 for section in sections]
        self.welds |= {joint for joint, *both in zip(between, bends, bends[1:], strict=False) if all(both)}
        for joint, body in zip(between, bodies, strict=False):
            self.joints[joint] = None
            self.used.add(joint)
            if body is not None and any(_numbers(body)):
                self.bodies[joint] = body
        places = [ends[0], *(End("joint", name=joint) for joint in between), ends[1]]
        return [Piece(number, k, section, (places[k], places[k + 1])) for k, section in enumerate(sections)]

    def _high(self, name: str, line: Line) -> End:
        key = self._key(name)
        if line.to is not None:
            return self._end(line.to, f"{key}.to")
        if line.top is None and len(self.buoys) != 1:
            raise Missing(f"{key}.top", "or to, or one [buoy]: something must hold the upper end of the cable")
        if line.top is None:
            return End("buoy", name=next(iter(self.buoys)))
        if self.buoys and len(self.cables) == 1 and not isinstance(getattr(line, "from"), str):
            raise Wrong(f"{key}.top.kind", line.top.kind, "does not go with [buoy], which holds that end")
        return End(line.top.kind, line.top)

    def _end(self, place: Any, key: str) -> End:
        if not isinstance(place, str):
            return _fixed(place)
        if place in self.joints:
            self.used.add(place)
            held = self.joints[place]
            return End(held.kind, held, place) if held else End("joint", name=place)
        buoy, _, fairlead = place.partition(".")
        if buoy in self.vessels:
            points = self.vessels[buoy].fairleads
            if fairlead not in points:
                raise Wrong(key, place, f"must be one of the fairleads of {buoy}: {', '.join(points)}")
            self.used.add(buoy)
            held = self.vessels[buoy].held(fairlead, self.scene)
            return End(held.kind, held, place)
        if buoy == "buoy" and len(self.buoys) == 1:
            buoy = next(iter(self.buoys))
        if buoy not in self.buoys:
            names = ", ".join([*self.joints, *self.buoys, *self.vessels]) or "there is none"
            raise Wrong(key, place, f"must be [x, y, z] or one of the joints, buoys and vessels: {names}")
        fairleads = self.buoys[buoy].fairleads or {}
        if fairlead and fairlead not in fairleads:
            raise Wrong(key, place, f"must be one of the fairleads of {buoy}: {', '.join(fairleads) or 'it has none'}")
        return End("buoy", name=buoy, fairlead=fairlead or None)


def _numbers(body: Body) -> list[float]:
    return [getattr(body, name) for name in Body.model_fields]


def attached_ends(network: Network) -> list[tuple[int, int]]:
    """(piece, end: 0 at s = 0, 1 at s = L) of all ends on buoys, buoy by buoy."""
    found: dict[str | None, list[tuple[int, int]]] = {name: [] for name in network.buoys}
    for k, piece in enumerate(network.pieces):
        for i in (1, 0):
            if piece.ends[i].kind == "buoy":
                found[piece.ends[i].name].append((k, i))
    return [end for ends in found.values() for end in ends]
