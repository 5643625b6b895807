"""Points where lines of MoorDyn end: on the ground, on vessels, on bodies, and on rods.

A fixed rod, or one on a body, gives two such points.  One that floats upright is a buoy.  All others are bars: a
straight inextensible element with the rod's mass, volume and coefficients, between two joints.
"""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .moordyn_body import HARDLY, BodyOf, NoBuoy, barred, buoy_of, ends_of, placed, turn_of, type_of
from .moordyn_text import Row, Tables

#: Words with which names of attachments begin.
FIXED, MOVED = ("fix", "anch"), ("coupled", "vessel", "ves", "cpld", "fair")
FREE, PINNED = ("free", "con", "point"), "pin"
#: EA of bars between points of one body [N].
STIFF = 1e8


class Places:
    """Ends of lines by key, and the sections that hold them.

    ends: key of a point or an end of a rod -> name used by a cable; at: (line, position [m], "fixed", "moved" or
    "free") of each; ways: direction of the rod, from A to B, at ends that it clamps.
    """

    def __init__(self, tables: Tables, rho: float, note: Callable[..., Any]):
        self.tables, self.rho, self.note = tables, rho, note
        self.types = {row["name"]: row for row in tables.of("rod types")}
        self.ends: dict[str, Any] = {}
        self.at: dict[str, tuple[int, list[float], str]] = {}
        self.ways: dict[str, list[float]] = {}
        self.joints: dict[str, dict[str, Any]] = {}
        self.vessels: dict[str, dict[str, Any]] = {}
        self.buoys: dict[str, BodyOf] = {}
        self.bars: dict[str, dict[str, Any]] = {}
        self.braces: list[dict[str, Any]] = []  #: bars between points of one body
        self.bodies = {row["id"]: row for row in tables.of("bodies")}
        self.used: set[str] = set()

    def read(self) -> None:
        """Read bodies, then rods."""
        rods, own = self.tables.of("rods"), dict[str, list[Row]]()
        for rod in rods:
            word = _attachment(rod)
            if word.startswith("body") and PINNED not in word:
                own.setdefault(_digits(word), []).append(rod)
        for number, body in self.bodies.items():
            self._body(number, body, own.get(number, []))
        for rod in rods:
            self._rod(rod)
        for number, buoy in self.buoys.items():
            for rod in buoy.bars:
                self._brace(number, rod)

    def put(self, key: str, line: int, place: NDArray[Any], kind: str, end: Any) -> None:
        """Record the position of an end, and the name that a cable uses for it."""
        self.at[key] = line, place.tolist(), kind
        self.ends[key] = end

    def on_vessel(self, key: str, line: int, name: str, place: NDArray[Any], point: str) -> None:
        """Add a fairlead of a vessel at the origin."""
        vessel = self.vessels.setdefault(name, {"name": name, "position": [0.0, 0.0, 0.0], "fairleads": {}})
        vessel["fairleads"][point] = place.tolist()
        self.put(key, line, place, "moved", f"{name}.{point}")

    def on_body(self, key: str, line: int, number: str, place: NDArray[Any], point: str) -> None:
        """Add a point of a body, at a position in its frame [m]."""
        if number not in self.bodies:
            raise InputError(f"line {line}: there is no body {number}.")
        position = placed(self.bodies[number], place)
        if number in self.buoys:
            self.put(key, line, position, "free", self.buoys[number].fairlead(point, place))
        elif (name := f"body{number}") in self.vessels:
            self.vessels[name]["fairleads"][point] = (self._own_turn(number) @ place + 0.0).tolist()
            self.put(key, line, position, "moved", f"{name}.{point}")
        else:
            self.put(key, line, position, "fixed", position.tolist())

    def _own_turn(self, number: str) -> NDArray[Any]:
        """R from the frame of a body to that of its counterpart: a buoy, a vessel with its heading, or the ground."""
        turns = number in self.bodies and number not in self.buoys
        heads = self.vessels.get(f"body{number}", {}).get("heading_deg")
        return turn_of(self.bodies[number]) if turns and not heads else np.eye(3)

    def hangs_on(self, key: str) -> Any:
        """The end of a cable at a point or an end of a rod, which is marked as used."""
        end = self.ends[key]
        self._use(end)
        return end

    def _use(self, end: Any) -> None:
        if isinstance(end, str):
            self.used |= {end, end.partition(".")[0]}

    def sections(self) -> dict[str, Any]:
        """Sections [[vessel]], [[joint]], [[buoy]] on which lines end, with the fairleads used."""
        for bar in self.cables():
            self._use(bar["from"])
            self._use(bar["to"])
        for section in [*self.vessels.values(), *(buoy.section for buoy in self.buoys.values())]:
            fairleads = section.get("fairleads", {})
            for name in [name for name in fairleads if f"{section['name']}.{name}" not in self.used]:
                del fairleads[name]
        joints = [joint for joint in self.joints.values() if joint["name"] in self.used]
        vessels = [vessel for name, vessel in self.vessels.items() if name in self.used]
        buoys = [buoy.section for buoy in self.buoys.values() if buoy.section["name"] in self.used]
        found = {"joint": joints, "vessel": vessels, "buoy": buoys}
        return {name: tables for name, tables in found.items() if tables}

    def cables(self) -> list[dict[str, Any]]:
        """Bars with an end in use, and those of bodies in use."""
        bars = [bar for bar in self.bars.values() if {f"{bar['name']}a", f"{bar['name']}b"} & self.used]
        return bars + [bar for bar in self.braces if bar["from"].partition(".")[0] in self.used]

    def _body(self, number: str, body: Row, rods: list[Row]) -> None:
        word, name = _attachment(body), f"body{number}"
        for rod in rods:
            type_of(rod, self.types)
        if word.startswith(FIXED):
            return
        why = f"{name} is moved by the program that calls MoorDyn: it is a vessel at rest here"
        if PINNED in word:
            why = f"{name} is hinged: its points are on a vessel at rest here, which does not turn"
        elif word.startswith("turbine"):
            why = f"{name} is on {word}: it is a vessel at rest here, as if {word} were at the origin"
        elif not word.startswith((*MOVED, *FREE)):
            raise InputError(f"line {body.line}: the attachment {body['attachment']!r} of a body is not known.")
        elif not word.startswith(MOVED):
            try:
                self.buoys[number] = buoy_of(name, body, rods, self.types, self.rho, self.note)
            except NoBuoy as reason:
                self.note(body.line, f"{name} {reason}: its rods are bars between points of it here")
                self.buoys[number] = barred(name, body, rods, self.types, self.rho, self.note)
            return
        place, yaw = [body.number(axis, 0.0) for axis in "xyz"], body.number("yaw", 0.0)
        upright = not (body.number("roll", 0.0) or body.number("pitch", 0.0))
        turned = {"heading_deg": yaw} if upright and yaw else {}
        self.vessels[name] = {"name": name, "position": place} | turned | {"fairleads": {}}
        self.note(body.line, why)

    def _rod(self, rod: Row) -> None:
        word, name = _attachment(rod), f"rod{rod.values.get('id', rod.line)}"
        ends = ends_of(rod)
        way = ends[1] - ends[0]
        keys = [f"{name}{end}" for end in "ab"]
        if np.linalg.norm(way) > 0 and PINNED not in word and not word.startswith("free"):
            turn = self._own_turn(_digits(word))
            self.ways |= dict.fromkeys(keys, (turn @ way / np.linalg.norm(way) + 0.0).tolist())
        if word.startswith("free") or PINNED in word:
            self._moving_rod(rod, word, name, ends)
            return
        for key, place in zip(keys, ends, strict=True):
            self._hold(key, rod, word, place)

    def _hold(self, key: str, rod: Row, word: str, place: NDArray[Any]) -> None:
        """Add an end of a rod that is attached to something."""
        if word.startswith("body"):
            self.on_body(key, rod.line, _digits(word), place, key)
        elif word.startswith((*MOVED, "turbine")):
            self.on_vessel(key, rod.line, "vessel" if word.startswith(MOVED) else word, place, key)
        elif word.startswith((*FIXED, PINNED)):
            self.put(key, rod.line, place, "fixed", place.tolist())
        else:
            raise InputError(f"line {rod.line}: the attachment {rod['attachment']!r} of a rod is not known.")

    def _moving_rod(self, rod: Row, word: str, name: str, ends: list[NDArray[Any]]) -> None:
        """Add a free rod, or one hinged at its end A."""
        kind, length = type_of(rod, self.types), float(np.linalg.norm(ends[1] - ends[0]))
        mass, d = kind.number("mass_density", 0.0), kind.number("diameter")
        if length == 0:
            self._joint(f"{name}a", rod, ends[0])
            self.put(f"{name}b", rod.line, ends[1], "free", f"{name}a")
        elif PINNED not in word and 0 < mass < self.rho * math.pi / 4 * d**2 and _stands(ends):
            floating = buoy_of(name, None, [rod], self.types, self.rho, self.note)
            self.buoys[name] = floating
            for end, place in zip("ab", ends, strict=True):
                self.put(f"{name}{end}", rod.line, place, "free", floating.fairlead(end, place))
        else:
            self._bar(rod, word, name, ends, length)

    def _bar(self, rod: Row, word: str, name: str, ends: list[NDArray[Any]], length: float) -> None:
        low = f"{name}a"
        if type_of(rod, self.types).number("mass_density", 0.0) <= 0:
            raise InputError(f"line {rod.line}: {name} moves and has no mass: Mass/m of its type must be above 0.")
        if PINNED in word:
            self._hold(low, rod, word, ends[0])
            if word.startswith("body"):  # in space: B is given relative to the body
                ends = [placed(self.bodies[_digits(word)], end) for end in ends]
        else:
            self._joint(low, rod, ends[0])
        self._joint(f"{name}b", rod, ends[1])
        bar = {"name": name, "from": self.ends[low], "to": self.ends[f"{name}b"], "length": length}
        self.bars[name] = bar | self._water(rod, length)
        self.note(rod.line, f"{name} is a bar here: a cable of one element that does not stretch")

    def _brace(self, number: str, rod: Row) -> None:
        """Add a rod of a body as a bar between two of its points, which keep it straight.
        If it pierces the surface at the start, a bar per segment, for its buoyancy there."""
        name, body, (a, b) = f"rod{rod.values.get('id', rod.line)}", self.buoys[number], ends_of(rod)
        wet = max(placed(self.bodies[number], end)[2] for end in (a, b)) < 0
        count = 1 if wet else max(1, round(rod.number("segments", 1.0)))
        points = [f"{name}a", *(f"{name}s{k}" for k in range(1, count)), f"{name}b"]
        ends = [body.fairlead(point, a + (b - a) * k / count) for k, point in enumerate(points)]
        length = float(np.linalg.norm(b - a))
        water = self._water(rod, length, body.own_mass) | {"axial_stiffness": STIFF}
        for k, (low, high) in enumerate(pairwise(ends), 1):
            own = name if count == 1 else f"{name}s{k}"
            self.braces.append({"name": own, "from": low, "to": high, "length": length / count} | water)

    def _water(self, rod: Row, length: float, share: float = 1.0) -> dict[str, Any]:
        """Mass (a fraction), volume and coefficients of a bar that represents a rod of this length."""
        kind = type_of(rod, self.types)
        d, mass = kind.number("diameter"), share * kind.number("mass_density", 0.0)
        mass = mass or HARDLY * (self.rho or 1.0) * math.pi / 4 * d**2  # a line has some
        found: dict[str, Any] = {"elements": 1, "line_density": mass, "diameter": d}
        found |= {"normal_drag": kind.number("Cd", 0.0), "added_mass": kind.number("Ca", 0.0)}
        # of both end faces, spread over the length
        along = {"tangential_drag": kind.number("CdEnd", 0.0) * math.pi * d / (2 * length)}
        along |= {"tangential_added_mass": kind.number("CaEnd", 0.0) * 2 / 3 * d / length}
        return found | {key: value for key, value in along.items() if value}

    def _joint(self, key: str, rod: Row, place: NDArray[Any]) -> None:
        self.joints[key] = {"name": key}
        self.put(key, rod.line, place, "free", key)


def _stands(ends: list[NDArray[Any]]) -> bool:
    """True if a rod is more upright than horizontal.
    The search for a buoy's equilibrium starts upright, and lines to both ends would keep a horizontal one so."""
    return bool(abs(ends[1][2] - ends[0][2]) > math.hypot(*(ends[1] - ends[0])[:2]))


def key_of(text: str) -> str | None:
    """The key of an end of a line from its name in a file: a point, or R1A, the end A of rod 1; None for others."""
    text = text.lower()
    if text.isdigit():
        return text
    number = _digits(text)
    rest = text.replace(number, "", 1) if number else ""
    return f"rod{number}{rest[-1]}" if rest in ("ra", "rb", "roda", "rodb") else None


def _attachment(row: Row) -> str:
    """Attachment of a body or rod as a word; a number may precede it, as in 1Coupled."""
    return row.values.get("attachment", "free").lower().lstrip("0123456789") or "free"


def _digits(text: str) -> str:
    return "".join(c for c in text if c.isdigit())
