"""A mooring in MoorDyn's input as a scene.

What has another meaning there, and how it is carried over:

- tangential drag refers to the surface pi d l there and to the diameter d l here: tangential_drag = pi CdAx (pi Cdt);
- a line carries no compression there: slack = "tension-only", except where it has a bending stiffness EI;
- BA < 0 is a share of the critical damping of a segment's shortest axial vibration: it belongs to the mesh;
- internal damping is in N s, but in Pa s where a file calls it cIntDamp: damping = cIntDamp pi d^2/4;
- a negative length is a multiple of the distance between the ends;
- every input has a sea bed of its stiffness kBot at the depth WtrDpth, and no other start than an equilibrium;
- a coupled point or body is moved by the program that calls MoorDyn: here it is held where it stands.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..scene.quantities import number_of
from .moordyn_body import BodyOf, buoy_of, is_free, placed
from .moordyn_text import Row, Tables, canonical, is_number, parse
from .moordyn_world import world
from .names import Names, Note

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: What the columns of version 1 are called, in the order of its files.
FIRST_VERSION = ("Can", "Cat", "Cdn", "Cdt")
#: Sections whose rows have numbers.
NUMBERED = ("points", "lines", "bodies", "rods")
#: Columns that may be missing, and what counts in their places.
WANTED = {
    "line types": dict.fromkeys(("BA", "Cd", "Ca", "CdAx"), 0),
    "rod types": dict.fromkeys(("mass_density", "Cd", "Ca", "CdEnd", "CaEnd"), 0),
    "bodies": dict.fromkeys(("mass", "CG", "I"), 0),
    "points": dict.fromkeys(("mass", "volume", "CdA", "Ca"), 0),
    "lines": {"segments": 20},
}


def scene_of(text: str, title: str = "") -> tuple[dict[str, Any], list[Note]]:
    """The scene of an input file, as its sections and keys, and what could not be carried over, line by line.

    Raises InputError for a file that is none, or a row that cannot be read.
    """
    return _Reader(parse(text), title).scene()


class _Reader:
    def __init__(self, tables: Tables, title: str):
        self.tables, self.title, self.notes = tables, title, list[Note]()
        self.places: dict[str, tuple[Row, str, list[float]]] = {}
        self.ends: dict[str, Any] = {}
        self.joints: dict[str, dict[str, Any]] = {}
        self.buoys: dict[str, BodyOf] = {}
        self.used: set[str] = set()
        self.names = Names("type", lambda text: self.note(None, f"line types: {text}"))

    def scene(self) -> tuple[Any, list[Note]]:
        self._headers()
        self._check_names()
        materials = {row["name"]: self._material(row) for row in self.tables.of("line types")}
        self._rods()
        for row in self.tables.of("points"):
            self._point(row)
        cables = [self._cable(row, materials) for row in self.tables.of("lines")]
        self._left_out()
        used = {row["type"] for row in self.tables.of("lines")}
        places = [(row.line, at[2], kind) for row, kind, at in self.places.values()]
        scene: dict[str, Any] = {"title": self.title} if self.title else {}
        scene |= world(self.tables, places, self.note)
        scene["material"] = {self.names.of(name): keys for name, keys in materials.items() if name in used}
        scene["cable"] = cables
        if joints := [joint for joint in self.joints.values() if joint["name"] in self.used]:
            scene["joint"] = joints
        scene |= {"buoy": [buoy.section for buoy in self.buoys.values()]} if self.buoys else {}
        scene["time"] = {"end": 60.0, "step": 0.05, "scheme": "bdf2"}
        self.note(None, "the file says nothing about the length of a run: time.end and time.step are a proposal")
        return scene, sorted(self.notes, key=lambda note: note.line or 0)

    def note(self, line: int | None, text: str) -> None:
        self.notes.append(Note(text, line))

    # -- what the columns are ------------------------------------------------------------------------------------------

    def _headers(self) -> None:
        """Columns of version 1, which version 2 of MoorDyn would read by their places, and wrongly."""
        line, columns = self.tables.columns.get("line types", (0, []))
        if [column for column in columns if column in FIRST_VERSION]:
            self.note(
                line,
                "the columns Can Cat Cdn Cdt are those of MoorDyn 1 and were read by name; MoorDyn 2 reads columns "
                "by their places, and would take them for EI or Cd, Ca, CdAx, CaAx",
            )

    def _check_names(self) -> None:
        """Refuse a name that is given twice; note columns that are missing, which count as 0."""
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
                if name not in names:
                    self.note(line, f"{section.upper()} has no column {name}: {wanted[name]} is taken")

    def _left_out(self) -> None:
        """Columns and sections that are not known, each once by its name."""
        for section in ("line types", "rod types", "bodies", "rods", "points", "lines"):
            line, columns = self.tables.columns.get(section, (0, []))
            for column in columns:
                values = [row.other.get(column, "-") for row in self.tables.of(section)]
                if given := sorted({value for value in values if not _is_nothing(value)}):
                    what = f"the column {column} of {section.upper()} is not carried over"
                    self.note(line, f"{what}: {', '.join(given[:5])}")
        for number, heading in self.tables.unknown:
            self.note(number, f"the section {heading!r} is not known and was left out")
        for name in ("failure", "control", "external loads"):
            if rows := self.tables.of(name):
                self.note(rows[0].line, f"the section {name.upper()} is not carried over")
        for point, joint in self.joints.items():
            if joint["name"] not in self.used:
                self.note(self.places[point][0].line, f"point {point} holds no line and was left out")

    # -- lines --------------------------------------------------------------------------------------------------------

    def _material(self, row: Row) -> dict[str, float]:
        found = {"line_density": row.number("mass_density"), "diameter": row.number("diameter")}
        static, *more = row["EA"].split("|")
        if not is_number(static):
            raise InputError(
                f"line {row.line}: EA is the file {row['EA']}, which is not read: give a number in its place."
            )
        found["axial_stiffness"] = number_of(static)
        found |= {"normal_drag": row.number("Cd", 0.0), "added_mass": row.number("Ca", 0.0)}
        found["tangential_drag"] = math.pi * row.number("CdAx", 0.0)
        if more:
            # two springs in series, each with a damper: of both none acts next to the static stiffness
            self.note(
                row.line,
                f"EA = {row['EA']} with BA = {row.values.get('BA', '0')} is viscoelastic: of these the static "
                "stiffness, the first of EA, is taken, and damping = 0; for motions in waves put the dynamic one in "
                "its place",
            )
        else:
            self._damping(row, found)
        if not _is_nothing(EI := row.values.get("EI", "0")):
            if is_number(EI):
                found["bending_stiffness"] = number_of(EI)
                self.note(row.line, f"EI = {EI} N m^2: such lines carry compression, and their ends are pinned")
            else:
                self.note(row.line, f"EI = {EI} is no single number, and is not read: bending_stiffness = 0")
        if row.number("CaAx", 0.0):
            self.note(row.line, f"CaAx = {row['CaAx']}: there is no added mass along a line here")
        return found

    def _damping(self, row: Row, found: dict[str, float]) -> None:
        text = row.values.get("BA", "0")
        if not is_number(text):
            self.note(row.line, f"BA = {text} is no single number, and is not read: damping = 0")
        elif number_of(text) > 0:
            found["damping"] = number_of(text) * self._area_of_damping(row)
        elif number_of(text) < 0:
            self.note(
                row.line,
                f"BA = {text} is a share of critical damping of a segment: numerical, for explicit steps; damping = 0",
            )

    def _area_of_damping(self, row: Row) -> float:
        """Area [m^2] by which a damping in Pa s, as early files call cIntDamp, is one in N s; else 1."""
        columns = [column.lower() for column in self.tables.columns["line types"][1]]
        if "cintdamp" not in columns:
            return 1.0
        place, units = columns.index("cintdamp"), self.tables.units.get("line types", [])
        if place < len(units) and "pa" not in units[place].lower():
            return 1.0
        self.note(row.line, f"cIntDamp = {row['BA']} Pa s: damping is it times pi Diam^2/4")
        return math.pi * row.number("diameter") ** 2 / 4

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
        return found | ({} if materials[material].get("bending_stiffness") else {"slack": "tension-only"})

    def _length(self, row: Row) -> float:
        length = row.number("length")
        if length >= 0:
            return length
        ends = [self.places[row[end]][2] for end in "AB"]
        found = -length * math.dist(*ends)
        self.note(row.line, f"UnstrLen = {length:g} is that multiple of the distance between the ends: {found:g} m")
        return found

    def _end(self, row: Row, column: str) -> Any:
        place = row[column]
        if not place.isdigit():
            raise InputError(f"line {row.line}: an end on {place!r} is not carried over: lines end on points here.")
        if place not in self.places:
            raise InputError(f"line {row.line}: there is no point {place}.")
        name = self.ends[place]
        self.used |= {name} if isinstance(name, str) else set()
        return name

    # -- points -------------------------------------------------------------------------------------------------------

    def _point(self, row: Row) -> None:
        kind, name = row["attachment"].lower(), row["id"]
        place = np.array([row.number(axis) for axis in "xyz"])
        if kind.startswith(("fix", "anch")):
            self._put(row, "fixed", place, place.tolist())
        elif kind.startswith("turbine"):
            raise InputError(f"line {row.line}: point {name} is on {kind}, and where that stands is not in this file.")
        elif kind.startswith("body") and kind[-1].isdigit():
            self._on_body(row, name, kind, place)
        elif kind.startswith(("coupled", "vessel", "ves", "cpld", "fair")):
            why = f"point {name} is moved by the program that calls MoorDyn: it is held where it stands here"
            self._hold(row, place, why)
        elif kind.startswith(("free", "con", "point")):
            self._free(row, place)
        else:
            raise InputError(f"line {row.line}: the attachment {row['attachment']!r} of a point is not known.")

    def _put(self, row: Row, kind: str, place: NDArray[Any], end: list[float] | str) -> None:
        """Remember where a point stands, and what a cable that ends on it names."""
        self.places[row["id"]] = row, kind, place.tolist()
        self.ends[row["id"]] = end

    def _hold(self, row: Row, place: NDArray[Any], why: str) -> None:
        name = f"point{row['id']}"
        self.joints[row["id"]] = {"name": name, "position": place.tolist()}
        self._put(row, "moved", place, name)
        self.note(row.line, why)

    def _free(self, row: Row, place: NDArray[Any]) -> None:
        joint: dict[str, Any] = {"name": f"point{row['id']}"}
        for key, column in (("mass", "mass"), ("volume", "volume"), ("drag_area", "CdA"), ("added_mass", "Ca")):
            if value := row.number(column, 0.0):
                joint[key] = value
        if any(not _is_nothing(row.values.get(column, "0")) for column in ("fx", "fy", "fz")):
            self.note(row.line, f"the constant force on point {row['id']} is not carried over")
        self.joints[row["id"]] = joint
        self._put(row, "free", place, joint["name"])

    def _on_body(self, row: Row, name: str, kind: str, place: NDArray[Any]) -> None:
        number = "".join(c for c in kind if c.isdigit())
        body = next((b for b in self.tables.of("bodies") if b["id"] == number), None)
        if body is None:
            raise InputError(f"line {row.line}: there is no body {number}.")
        position = placed(body, place)
        if number not in self.buoys:
            self._hold(row, position, f"point {name} on body {number} is held where it stands")
            return
        self._put(row, "free", position, self.buoys[number].fairlead(name, place))
        if own := [column for column in ("mass", "volume", "CdA") if row.number(column, 0.0)]:
            self.note(row.line, f"{', '.join(own)} of point {name} on body {number} is not carried over")

    def _rods(self) -> None:
        """Free bodies with an upright rod become buoys; all others cannot."""
        types = {row["name"]: row for row in self.tables.of("rod types")}
        rods = self.tables.of("rods")
        for body in self.tables.of("bodies"):
            number = body["id"]
            own = [rod for rod in rods if rod.values.get("attachment", "").lower() == f"body{number}"]
            if is_free(body) and (found := buoy_of(body, own, types, self.note)):
                self.buoys[number] = found
                rods = [rod for rod in rods if rod not in own]
        for rod in rods:
            self.note(rod.line, f"rod {rod.values.get('id', '')} is not carried over")


def _is_nothing(text: str) -> bool:
    return text in ("-", "#") or (is_number(text) and number_of(text) == 0)
