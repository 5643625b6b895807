"""A mooring in MoorDyn's input as a scene.

Differences in meaning, and how they are translated:

- tangential drag refers to the surface pi d l there and to the diameter d l here: tangential_drag = pi CdAx (pi Cdt);
- a line carries no compression there: slack = "tension-only", except where it has a bending stiffness EI;
- BA < 0 is a fraction of the critical damping of a segment's highest axial mode: it depends on the mesh;
- internal damping is in N s, but in Pa s if a file calls it cIntDamp: damping = cIntDamp pi d^2/4;
- a negative length is a multiple of the distance between the ends;
- every input has a sea bed of stiffness kBot at the depth WtrDpth, and starts from an equilibrium;
- a coupled point or body is moved by the program that calls MoorDyn: here it is on a vessel, at rest until it has a
  motion.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene.quantities import number_of
from . import moordyn_events
from .moordyn_files import DEPTH, density_of, world
from .moordyn_rods import FIXED, FREE, MOVED, Places, key_of
from .moordyn_text import Row, Tables, canonical, is_nothing, is_number, parse
from .names import Names, Note

#: Names of the columns of version 1, in their order in files.
FIRST_VERSION = ("Can", "Cat", "Cdn", "Cdt")
#: Sections with numbered rows.
NUMBERED = ("points", "lines", "bodies", "rods")
#: Columns that may be missing, and their replacements.
WANTED = {
    "line types": dict.fromkeys(("BA", "Cd", "Ca", "CdAx"), 0),
    "rod types": dict.fromkeys(("mass_density", "Cd", "Ca", "CdEnd", "CaEnd"), 0),
    "bodies": dict.fromkeys(("mass", "CG", "I"), 0),
    "points": dict.fromkeys(("mass", "volume", "CdA", "Ca"), 0),
    "lines": {"segments": 20},
}
#: Columns of bodies in early files, each instead of one above.
IN_PLACE_OF = {"CG": "zcg", "I": "Iz"}


def scene_of(
    text: str, title: str = "", by_place: bool = False, depth: float | None = None, folder: Path | None = None
) -> tuple[dict[str, Any], list[Note]]:
    """The scene of an input file, as its sections and keys, and notes on parts not translated, line by line.

    by_place: take columns of types as those of MoorDyn 2 by position, whatever their names in the file.
    depth: of the water [m], if the file does not give it.  folder: of the file, where its options may name other files.
    Raises InputError for another kind of file, or a row that cannot be read.
    """
    tables = parse(text, by_place)
    if depth is not None and tables.option(*DEPTH) is None:
        tables.options[DEPTH[0].lower()] = 0, str(depth)
    return _Reader(tables, title, by_place, folder).scene()


class _Reader:
    def __init__(self, tables: Tables, title: str, by_place: bool, folder: Path | None):
        self.tables, self.title, self.by_place, self.folder = tables, title, by_place, folder
        self.notes = list[Note]()
        self.places = Places(tables, density_of(tables), self.note)
        self.names = Names("type", lambda text: self.note(None, f"line types: {text}"))

    def scene(self) -> tuple[Any, list[Note]]:
        self._check_columns()
        materials = {row["name"]: material_of(row, self.tables, self.note) for row in self.tables.of("line types")}
        self.places.read()
        kind_of = self._kinds(self.tables.of("points"))
        for row in self.tables.of("points"):
            self._point(row, kind_of(row))
        cables = {row.values.get("id", str(row.line)): self._cable(row, materials) for row in self.tables.of("lines")}
        moordyn_events.failures(self.tables, cables, self.note)
        moordyn_events.external_loads(self.tables, self.places, self.note)
        sections = self.places.sections()
        self._left_out()
        used = {row["type"] for row in self.tables.of("lines")}
        heights = [(line, place[2], kind) for line, place, kind in self.places.at.values()]
        scene: dict[str, Any] = {"title": self.title} if self.title else {}
        scene |= world(self.tables, heights, self.note, self.folder)
        scene["material"] = {self.names.of(name): keys for name, keys in materials.items() if name in used}
        scene["cable"] = [*cables.values(), *self.places.cables()]
        scene |= sections
        scene["time"] = {"end": 60.0, "step": 0.05, "scheme": "bdf2"}
        self.note(None, "the file says nothing about the length of a run: time.end and time.step are a proposal")
        return scene, sorted(self.notes, key=lambda note: note.line or 0)

    def note(self, line: int | None, text: str) -> None:
        self.notes.append(Note(text, line))

    def _check_columns(self) -> None:
        """Raise InputError for a name given twice; note missing columns, which count as 0.
        Also note columns of version 1, which version 2 of MoorDyn would misread by position."""
        line, columns = self.tables.columns.get("line types", (0, []))
        if set(columns) & set(FIRST_VERSION):
            self.note(
                line,
                "the columns Can Cat Cdn Cdt are those of MoorDyn 1 and were read by name; MoorDyn 2 reads columns "
                "by their places, and would take them for EI or Cd, Ca, CdAx, CaAx: so does --columns place",
            )
        elif self.by_place:
            self.note(line, "columns of types were read by their places, as MoorDyn 2 does")
        for section, column in (("line types", "name"), ("rod types", "name"), *((s, "id") for s in NUMBERED)):
            seen = set()
            for row in self.tables.of(section):
                if (name := row.values.get(column)) in seen:
                    raise InputError(f"line {row.line}: {name} of {section.upper()} is given twice.")
                seen |= {name} - {None}
        for section, wanted in WANTED.items():
            line, columns = self.tables.columns.get(section, (0, []))
            names = {canonical(section, column) for column in columns}
            for name in wanted if columns else ():
                if name not in names and IN_PLACE_OF.get(name, name) not in names:
                    self.note(line, f"{section.upper()} has no column {name}: {wanted[name]} is taken")

    def _left_out(self) -> None:
        """Note unknown columns and sections, each once by name."""
        for section in ("line types", "rod types", "bodies", "rods", "points", "lines"):
            line, columns = self.tables.columns.get(section, (0, []))
            for column in columns:
                values = [row.other.get(column, "-") for row in self.tables.of(section)]
                if given := sorted({value for value in values if not is_nothing(value)}):
                    what = f"the column {column} of {section.upper()} is not carried over"
                    self.note(line, f"{what}: {', '.join(given[:5])}")
        for number, heading in self.tables.unknown:
            self.note(number, f"the section {heading!r} is not known and was left out")
        if rows := self.tables.of("control"):
            self.note(rows[0].line, "the section CONTROL is not carried over")
        for key, joint in self.places.joints.items():
            if joint["name"] not in self.places.used and key.isdigit():
                self.note(self.places.at[key][0], f"point {key} holds no line and was left out")
        for rod in self.tables.of("rods"):
            name = f"rod{rod.values.get('id', rod.line)}"
            if name not in self.places.used and not {f"{name}a", f"{name}b"} & self.places.used:
                moves = name in self.places.bars or name in self.places.buoys
                if moves:
                    self.note(rod.line, f"{name} holds no line and was left out")

    def _cable(self, row: Row, materials: dict[str, dict[str, float]]) -> dict[str, Any]:
        material = row["type"]
        if material not in materials:
            raise InputError(
                f"line {row.line}: LineType {material!r} is none of the LINE TYPES: {', '.join(materials)}."
            )
        found: dict[str, Any] = {"name": f"line{row.values.get('id', row.line)}", "material": self.names.of(material)}
        found |= {"from": self._end(row, "A"), "to": self._end(row, "B")}
        if row["A"] == row["B"]:
            raise InputError(f"line {row.line}: both ends are on point {row['A']}: must be two.")
        segments = row.number("segments", 20.0)
        if segments < 1 or segments != round(segments):
            raise InputError(f"line {row.line}: NumSegs is {row['segments']}: must be a whole number from 1 on.")
        found |= {"length": self._length(row), "elements": round(segments)}
        if materials[material].get("bending_stiffness"):
            return found | self._clamps(row, found)
        return found | {"slack": "tension-only"}

    def _clamps(self, row: Row, cable: dict[str, Any]) -> dict[str, Any]:
        """Directions of a bending line at rods that hold it."""
        found, ways = {}, self.places.ways
        for column, key, end in (("A", "from_end", cable["from"]), ("B", "to_end", cable["to"])):
            if (rod := key_of(row[column]) or "") not in ways:
                continue
            way = np.array(ways[rod])
            out = rod.endswith("b") == (column == "A")  # away from the rod at B, into it at A
            direction = way if out else -way
            buoy = next((b for b in self.places.buoys.values() if str(end).startswith(f"{b.section['name']}.")), None)
            if buoy is not None:
                direction = direction @ buoy.axes
            found[key] = {"direction": (direction + 0.0).tolist()}
        return found

    def _length(self, row: Row) -> float:
        length = row.number("length")
        if length >= 0:
            return length
        ends = [self.places.at[key_of(row[end]) or ""][1] for end in "AB"]
        found = -length * math.dist(*ends)
        self.note(row.line, f"UnstrLen = {length:g} is that multiple of the distance between the ends: {found:g} m")
        return found

    def _end(self, row: Row, column: str) -> Any:
        key = key_of(row[column])
        if key is None:
            raise InputError(
                f"line {row.line}: an end on {row[column]!r} is not known: must be a point, or an end of a rod as R1A."
            )
        if key not in self.places.ends:
            raise InputError(f"line {row.line}: there is no {'point' if key.isdigit() else 'end'} {row[column]}.")
        return self.places.hangs_on(key)

    def _point(self, row: Row, kind: str) -> None:
        name, places = row["id"], self.places
        place = np.array([row.number(axis) for axis in "xyz"])
        if kind.startswith(FIXED):
            places.put(name, row.line, place, "fixed", place.tolist())
        elif kind.startswith("body") and kind[-1].isdigit():
            self._on_body(row, "".join(c for c in kind if c.isdigit()), place)
        elif kind.startswith("turbine"):
            places.on_vessel(name, row.line, kind, place, f"point{name}")
            self.note(row.line, f"point {name} is on {kind}, a vessel at the origin here: give it its position")
        elif kind.startswith(MOVED):
            places.on_vessel(name, row.line, "vessel", place, f"point{name}")
            self.note(
                row.line,
                f"point {name} is moved by the program that calls MoorDyn: it is on a vessel here, at rest until it "
                "has a motion",
            )
        elif kind.startswith(FREE):
            joint: dict[str, Any] = {"name": f"point{name}"}
            for key, column in (("mass", "mass"), ("volume", "volume"), ("drag_area", "CdA"), ("added_mass", "Ca")):
                if value := row.number(column, 0.0):
                    joint[key] = value
            if any(not is_nothing(row.values.get(column, "0")) for column in ("fx", "fy", "fz")):
                self.note(row.line, f"the constant force on point {name} is not carried over")
            places.joints[name] = joint
            places.put(name, row.line, place, "free", joint["name"])
        else:
            raise InputError(f"line {row.line}: the attachment {row['attachment']!r} of a point is not known.")

    def _kinds(self, rows: list[Row]) -> Callable[[Row], str]:
        """Attachment of a point as a word, also if a file has numbers: 1, 0, -1 are fixed, free and coupled.
        But 0, 1, 2 are fixed, coupled and free if there is a 2, or if a point with a 0 is lowest."""
        low = min((row.number("z") for row in rows), default=0.0)
        numbers = [row for row in rows if row["attachment"] in ("-1", "0", "1", "2")]
        early = any(
            row["attachment"] == "2" or (row["attachment"] == "0" and row.number("z") == low) for row in numbers
        )
        known = dict(zip(("0", "1", "2"), ("fixed", "coupled", "free"), strict=True))
        known = known if early else {"1": "fixed", "0": "free", "-1": "coupled"}
        if numbers:
            said = ", ".join(f"{number} is {word}" for number, word in known.items())
            self.note(numbers[0].line, f"attachments are numbers: {said}")

        def kind(row: Row) -> str:
            word = row["attachment"].lower()
            return known.get(word) or word.lstrip("0123456789") or word

        return kind

    def _on_body(self, row: Row, number: str, place: Any) -> None:
        name = row["id"]
        self.places.on_body(name, row.line, number, place, f"point{name}")
        own = [column for column in ("mass", "volume", "CdA") if row.number(column, 0.0)]
        if own and number in self.places.buoys:
            self.note(row.line, f"{', '.join(own)} of point {name} on body {number} is not carried over")


def material_of(row: Row, tables: Tables, note: Callable[..., Any]) -> dict[str, float]:
    """The keys of a [material]; note(line, text): for omissions.

    Raises InputError for a stiffness given in another file.
    """
    found = {"line_density": row.number("mass_density"), "diameter": row.number("diameter")}
    static, *more = row["EA"].split("|")
    if not is_number(static):
        what = "is a Syrope model" if "syrope" in row["EA"].lower() else f"is the file {row['EA']}"
        raise InputError(f"line {row.line}: EA {what}, which is not read: give a number in its place.")
    found["axial_stiffness"] = number_of(static)
    found |= {"normal_drag": row.number("Cd", 0.0), "added_mass": row.number("Ca", 0.0)}
    found["tangential_drag"] = math.pi * row.number("CdAx", 0.0)
    if along := row.number("CaAx", 0.0):
        found["tangential_added_mass"] = along
    if more:
        # two springs in series, each with a damper: neither damper acts in parallel with the static stiffness
        note(
            row.line,
            f"EA = {row['EA']} with BA = {row.values.get('BA', '0')} is viscoelastic: of these the static "
            "stiffness, the first of EA, is taken, and damping = 0; for motions in waves put the dynamic one in "
            "its place",
        )
    else:
        _damping(row, found, tables, note)
    if not is_nothing(EI := row.values.get("EI", "0")):
        if is_number(EI):
            found["bending_stiffness"] = number_of(EI)
            note(row.line, f"EI = {EI} N m^2: such lines carry compression, and their ends on points are pinned")
        else:
            note(row.line, f"EI = {EI} is no single number, and is not read: bending_stiffness = 0")
    return found


def _damping(row: Row, found: dict[str, float], tables: Tables, note: Callable[..., Any]) -> None:
    text = row.values.get("BA", "0")
    if not is_number(text):
        note(row.line, f"BA = {text} is no single number, and is not read: damping = 0")
    elif number_of(text) > 0:
        columns, units = tables.columns["line types"][1], tables.units.get("line types", [])
        names = [column.lower() for column in columns]
        place = names.index("cintdamp") if "cintdamp" in names else None
        found["damping"] = number_of(text)
        if place is not None and not (place < len(units) and "pa" not in units[place].lower()):
            note(row.line, f"cIntDamp = {row['BA']} Pa s: damping is it times pi Diam^2/4")
            found["damping"] *= math.pi * row.number("diameter") ** 2 / 4
    elif number_of(text) < 0:
        note(
            row.line,
            f"BA = {text} is a share of critical damping of a segment: numerical, for explicit steps; damping = 0",
        )
