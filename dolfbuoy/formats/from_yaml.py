"""A mooring in the YAML of MoorPy and RAFT as a scene.

    mooring:
        water_depth: 200
        points:     [{name, type: fixed | vessel | free, location: [x, y, z], mass, volume}, ...]
        lines:      [{name, endA, endB, type, length}, ...]
        line_types: [{name, diameter, mass_density, stiffness, breaking_load, transverse_drag, ...}, ...]

A design of RAFT also has a site, with water_depth, rho_water and g.

The tangential drag refers to the surface pi d l there and to d l here; lines carry no compression, except with an EI,
which MoorPy itself ignores; there is always a bed, without a stiffness of its own.
"""

import math
from collections.abc import Iterator
from typing import Any

from ..errors import InputError, missing
from ..scene.quantities import number_of
from .names import Names, Note

#: Keys of a line type, their names here, and the conversion factors.
LINE_TYPE = {
    "mass_density": ("line_density", 1.0),
    "diameter": ("diameter", 1.0),
    "stiffness": ("axial_stiffness", 1.0),
    "transverse_drag": ("normal_drag", 1.0),
    "transverse_added_mass": ("added_mass", 1.0),
    "tangential_drag": ("tangential_drag", math.pi),
    "tangential_added_mass": ("tangential_added_mass", 1.0),
    "breaking_load": ("breaking_load", 1.0),
    "EI": ("bending_stiffness", 1.0),
}
#: Keys of a line type for which 0 means none.
NOTHING = "breaking_load", "tangential_added_mass", "EI"
#: Other keys that are read.
POINT = ("name", "type", "location", "mass", "volume", "CdA", "Ca", "vessel")
LINE = ("name", "endA", "endB", "type", "length")
BODY = {"mass": "mass", "volume": "volume", "CdA": "drag_area", "Ca": "added_mass"}
SITE, WORDS = ("water_depth", "rho_water", "g"), ("type", "name", "comments")
ELEMENTS = 20
#: The vessel of fairleads that do not name one.
VESSEL = "vessel"


def read_yaml(text: str) -> Any:
    """The values of a YAML file, read without code and aliases.  Raises InputError for a bad file."""
    try:
        import yaml
    except ImportError as error:
        raise InputError(missing(error) or "PyYAML is not installed: pip install pyyaml") from None

    class Plain(yaml.SafeLoader):  # type: ignore[misc]  # yaml has no types
        """A loader without aliases, by which a small file could grow without bounds."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.events.AliasEvent):
                raise InputError(f"line {self.peek_event().start_mark.line + 1}: aliases (*name) are not read.")
            return super().compose_node(parent, index)

    try:
        return yaml.load(text, Loader=Plain)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}: " if mark else ""
        why = getattr(error, "problem", None) or getattr(error, "reason", None) or error
        raise InputError(f"{place}this is no YAML: {why}.") from None
    except RecursionError:
        raise InputError("this YAML is nested too deeply.") from None


def scene_of(text: str, title: str = "", depth: float | None = None) -> tuple[dict[str, Any], list[Note]]:
    """The scene of a mooring in YAML, as its sections and keys, and notes on parts that could not be translated.

    depth: of the water [m] where the file does not give it.

    Raises InputError for a file without points, lines and line types, or a value that cannot be read.
    """
    data = read_yaml(text)
    mooring = data.get("mooring", data) if isinstance(data, dict) else None
    if isinstance(mooring, dict) and mooring.get("file"):
        raise InputError(f"mooring.file = {mooring['file']!r}: the mooring is in that file: import it as moordyn.")
    if not isinstance(mooring, dict) or not all(
        isinstance(mooring.get(name), list) and mooring[name] for name in ("points", "lines", "line_types")
    ):
        raise InputError(
            "there is no mooring with points, lines and line_types: this is no file of MoorPy or RAFT; those of WISDEM "
            "(nodes) and FAModel (mooring_line_configs) are others: import wisdem, famodel; text files that MoorPy "
            "reads too are MoorDyn's: import moordyn."
        )
    return scene_of_mooring(mooring, data if mooring is not data else {}, title, depth)


def scene_of_mooring(
    mooring: dict[str, Any],
    design: dict[str, Any],
    title: str = "",
    depth: float | None = None,
    vessels: dict[str, dict[str, Any]] | None = None,
) -> tuple[dict[str, Any], list[Note]]:
    """The scene of points, lines and line types; points on one of several `vessels` name it as their vessel.

    design: may have a site.  Raises InputError.
    """
    return _Reader(mooring, design, title, depth, vessels).scene()


class _Reader:
    def __init__(
        self,
        mooring: dict[str, Any],
        design: dict[str, Any],
        title: str,
        depth: float | None,
        vessels: dict[str, dict[str, Any]] | None,
    ):
        self.mooring, self.title, self.depth, self.notes = mooring, title, depth, list[Note]()
        self.vessels: dict[str, dict[str, Any]] = vessels or {}
        site = design.get("site")
        self.design, self.site = design, site if isinstance(site, dict) else {}
        self.types = Names("type", lambda text: self.note(f"line_types: {text}"))
        self.parts = Names("part", lambda text: self.note(f"points and lines: {text}"))

    def scene(self) -> tuple[Any, list[Note]]:
        for section in ("points", "lines", "line_types"):
            names = [str(row.get("name")) for row in self._rows(section)]
            if twice := {name for name in names if names.count(name) > 1}:
                raise InputError(f"{section}: {min(twice)!r} is given twice.")
        materials = {text_of(row, "name", "line_types"): self._material(row) for row in self._rows("line_types")}
        places, joints = self._points()
        cables = [self._cable(row, materials, places) for row in self._rows("lines")]
        used = {text_of(row, "type", "lines") for row in self._rows("lines")}
        self._left_out()
        scene: dict[str, Any] = {"title": self.title} if self.title else {}
        scene |= self._world(places)
        scene["material"] = {self.types.of(name): keys for name, keys in materials.items() if name in used}
        scene["cable"] = cables
        named = {end for cable in cables for end in (cable["from"], cable["to"]) if isinstance(end, str)}
        if kept := [joint for joint in joints if joint["name"] in named]:
            scene["joint"] = kept
        if vessels := [self._used(vessel, named) for vessel in self.vessels.values()]:
            scene["vessel"] = [vessel for vessel in vessels if vessel["fairleads"]]
            self.note("vessels rest until they have a motion, or raos")
        return scene | {"time": {"end": 60.0, "step": 0.05, "scheme": "bdf2"}}, self.notes

    @staticmethod
    def _used(vessel: dict[str, Any], named: set[str]) -> dict[str, Any]:
        """A vessel with only those fairleads at which lines end."""
        used = {own: at for own, at in vessel.get("fairleads", {}).items() if f"{vessel['name']}.{own}" in named}
        return vessel | {"fairleads": used}

    def note(self, text: str) -> None:
        self.notes.append(Note(text))

    def _left_out(self) -> None:
        """Note unknown keys, each once by name."""
        if left := [key for key in self.design if key not in ("mooring", "site", *WORDS)]:
            self.note(f"of this design only mooring is carried over, and not {', '.join(map(str, left))}")
        if left := [key for key in self.site if key not in SITE]:
            self.note(f"of site only {', '.join(SITE)} are carried over, and not {', '.join(map(str, left))}")
        for name in self.mooring:
            if name not in (*SITE, "rho", "water_density", "points", "lines", "line_types", *WORDS):
                self.note(f"{name} is not carried over")
        for section, known in (("points", POINT), ("lines", LINE)):
            for key in dict.fromkeys(key for row in self._rows(section) for key in row if key not in known):
                self.note(f"{section}: {key} is not carried over")
        self.note("the file says nothing about the length of a run: time.end and time.step are a proposal")

    def _rows(self, name: str) -> Iterator[dict[str, Any]]:
        for row in self.mooring[name]:
            if not isinstance(row, dict):
                raise InputError(f"{name}: {row!r} is no table of keys.")
            yield row

    def _world(self, places: dict[str, tuple[Any, list[float], str]]) -> dict[str, Any]:
        gravity = self._given("g")
        density = self._given("rho", "water_density", "rho_water")
        found: dict[str, Any] = {} if gravity is None else {"gravity": gravity}
        if density == 0:
            self.note("the density of the water is 0: there is none here, and no bed, which belongs to a sea")
            return found
        found["sea"] = {"depth": self._depth(places)} | ({} if density is None else {"density": density})
        if gravity == 0:
            self.note("g is 0: there is no bed here, since nothing would lie on it")
            return found
        return found | {"seabed": {}}

    def _given(self, *names: Any) -> float | None:
        """A number of the mooring, or of the site of a design; None if neither gives it."""
        for where, section in (("mooring", self.mooring), ("site", self.site)):
            for name in names:
                if section.get(name) is not None:
                    return number(section[name], f"{where}.{name}")
        return None

    def _depth(self, places: dict[str, tuple[Any, list[float], str]]) -> float:
        depth = self.depth if (given := self._given("water_depth")) is None else given
        heights = {name: place[2] for name, (_, place, kind) in places.items() if kind != "free"}
        if depth is None:
            low = min(place[2] for _, place, _ in places.values())
            if low >= 0 or (low, "fixed") not in [(place[2], kind) for _, place, kind in places.values()]:
                raise InputError("there is no water_depth, and no fixed point is the deepest: give it.")
            self.note(f"there is no water_depth: the deepest fixed point sets it, {-low:g} m")
            return -low
        for name, z in heights.items():
            if z < -depth * (1 + 1e-9):
                raise InputError(f"points, {name}: z = {z:g} is below the bed, which water_depth puts at -{depth:g} m.")
        return depth

    def _material(self, row: dict[str, float | str]) -> dict[str, float]:
        name = text_of(row, "name", "line_types")
        found = {}
        for key, (own, factor) in LINE_TYPE.items():
            value = row.get(key)
            if value is None and key in ("mass_density", "diameter", "stiffness"):
                raise InputError(f"line_types, {name}: {key} is missing.")
            size = None if value is None else number(value, f"line_types, {name}: {key}")
            if size is not None and size < 0 and key == "EI":
                raise InputError(f"line_types, {name}: EI is {size:g}: must be 0 or greater.")
            if size is not None and (size > 0 or key not in NOTHING):
                found[own] = factor * size
        if "bending_stiffness" in found:
            self.note(f"line_types, {name}: with EI lines carry compression, and their ends are pinned")
        for key, value in row.items():
            if key not in LINE_TYPE and key not in ("name", "cost") and value:
                self.note(f"line_types, {name}: {key} = {value} is not carried over")
        return found

    def _points(self) -> tuple[dict[str, tuple[Any, list[float], str]], list[dict[str, Any]]]:
        """End, position and kind ("fixed", "moved" or "free") of each point by name, and the joints."""
        places: dict[str, tuple[Any, list[float], str]] = {}
        joints: list[dict[str, Any]] = []
        for row in self._rows("points"):
            name, kind = text_of(row, "name", "points"), text_of(row, "type", "points").lower()
            place = row.get("location")
            if not isinstance(place, list) or len(place) != 3:
                raise InputError(f"points, {name}: location must be [x, y, z].")
            place = [number(value, f"points, {name}: location") for value in place]
            if "anch" in kind or "fix" in kind:
                places[name] = place, place, "fixed"
                continue
            own = self.parts.of(name)
            if any(word in kind for word in ("ves", "fair", "coupled", "body")):
                places[name] = self._on_vessel(row, own, place), self._in_space(row, place), "moved"
                continue
            if "con" in kind or "free" in kind:
                body = {own: number(row[key], f"points, {name}: {key}") for key, own in BODY.items() if row.get(key)}
                joints.append({"name": own} | body)
            else:
                raise InputError(f"points, {name}: the type {row['type']!r} is not known: fixed, vessel or free.")
            places[name] = own, place, "free"
        return places, joints

    def _on_vessel(self, row: dict[str, Any], own: str, place: list[float]) -> str:
        """The end of a cable at a fairlead; place: from the vessel's reference point [m]."""
        name = str(row.get("vessel", VESSEL))
        vessel = self.vessels.setdefault(name, {"name": name, "position": [0.0, 0.0, 0.0]})
        vessel.setdefault("fairleads", {})[own] = place
        return f"{name}.{own}"

    def _in_space(self, row: dict[str, Any], place: list[float]) -> list[float]:
        vessel = self.vessels[str(row.get("vessel", VESSEL))]
        return [a + b for a, b in zip(vessel["position"], place, strict=True)]

    def _cable(
        self,
        row: dict[str, Any],
        materials: dict[str, dict[str, float]],
        places: dict[str, tuple[Any, list[float], str]],
    ) -> dict[str, Any]:
        name, material = text_of(row, "name", "lines"), text_of(row, "type", "lines")
        if material not in materials:
            raise InputError(f"lines, {name}: type {material!r} is none of the line_types: {', '.join(materials)}.")
        ends = [text_of(row, key, f"lines, {name}") for key in ("endA", "endB")]
        for key, end in zip(("endA", "endB"), ends, strict=True):
            if end not in places:
                raise InputError(f"lines, {name}: {key} = {end!r} is none of the points: {', '.join(places)}.")
        if ends[0] == ends[1]:
            raise InputError(f"lines, {name}: endA and endB are both {ends[0]!r}: must be two points.")
        found: dict[str, Any] = {"name": self.parts.of(name), "material": self.types.of(material)}
        found |= {"from": places[ends[0]][0], "to": places[ends[1]][0]}
        found["length"] = number(row.get("length"), f"lines, {name}: length")
        found["elements"] = ELEMENTS
        return found if "bending_stiffness" in materials[material] else found | {"slack": "tension-only"}


def text_of(row: dict[str, Any], key: str, place: str) -> str:
    """A value of a table as text.  Raises InputError if it is missing."""
    value = row.get(key)
    if value is None:
        raise InputError(f"{place}: {key} is missing.")
    return str(value)


def number(value: Any, place: str) -> float:
    """A finite number.  Raises InputError for anything else."""
    try:
        found = number_of(value) if isinstance(value, str) else math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if not math.isfinite(found):
        raise InputError(f"{place} is {value!r}, which is no number.")
    return found
