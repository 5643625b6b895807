"""A mooring in MoorDyn's input as a scene.

What has another meaning there, and how it is carried over:

- tangential drag refers to the surface pi d l there and to the diameter d l here: tangential_drag = pi CdAx (pi Cdt);
- a line carries no compression there: slack = "tension-only";
- BA < 0 is a share of the critical damping of a segment's shortest axial vibration: it belongs to the mesh;
- every input has a sea bed of its stiffness kBot at the depth WtrDpth, and no other start than an equilibrium;
- a coupled point or body is moved by the program that calls MoorDyn: here it is held where it stands.
"""

import math

import numpy as np

from ..errors import InputError
from ..scene.quantities import number_of
from .moordyn_body import buoy_of, is_free, placed
from .moordyn_text import Row, Tables, canonical, is_number, parse
from .notes import Note

#: What the columns of version 1 are called, in the order of its files.
FIRST_VERSION = ("Can", "Cat", "Cdn", "Cdt")
#: Options that are carried over, or say how MoorDyn computes and nothing about the mooring.
CARRIED = (
    "g",
    "gravity",
    "rho",
    "rhow",
    "wtrdnsty",
    "wtrdpth",
    "wtrdepth",
    "depth",
    "kbot",
    "kb",
    "frictioncoefficient",
    "mu_kt",
)
NUMERICAL = (
    "dtm",
    "tscheme",
    "writelog",
    "dtout",
    "tmaxic",
    "dtic",
    "cdscaleic",
    "threshic",
    "icgendynamic",
    "writeunits",
)
NUMERICAL += (
    "disableoutput",
    "disableouttime",
    "echo",
    "cfl",
    "version",
    "icdfac",
    "icdt",
    "ictmax",
    "icthresh",
    "mc",
    "cv",
)


def scene_of(text: str, title: str = "") -> tuple[dict, list[Note]]:
    """The scene of an input file, as its sections and keys, and what could not be carried over, line by line.

    Raises InputError for a file that is none, or a row that cannot be read.
    """
    return _Reader(parse(text), title).scene()


class _Reader:
    def __init__(self, tables: Tables, title):
        self.tables, self.title, self.notes = tables, title, []
        self.places, self.joints, self.buoys = {}, [], {}

    def scene(self):
        self._headers()
        self._check_names()
        materials = {row["name"]: self._material(row) for row in self.tables.of("line types")}
        self._rods()
        for row in self.tables.of("points"):
            self._point(row)
        cables = [self._cable(row, materials) for row in self.tables.of("lines")]
        for number, heading in self.tables.unknown:
            self.note(number, f"the section {heading!r} is not known and was left out")
        for name in ("failure", "control", "external loads"):
            for row in self.tables.of(name):
                self.note(row.line, f"the section {name.upper()} is not carried over")
        used = {cable["material"] for cable in cables}
        scene = {"title": self.title} if self.title else {}
        scene |= self._world()
        scene["material"] = {name: keys for name, keys in materials.items() if name in used}
        scene["cable"] = cables
        scene |= {"joint": self.joints} if self.joints else {}
        scene |= {"buoy": [buoy.section for buoy in self.buoys.values()]} if self.buoys else {}
        scene["time"] = {"end": 60.0, "step": 0.05, "scheme": "bdf2"}
        self.note(None, "the file says nothing about the length of a run: time.end and time.step are a proposal")
        return scene, sorted(self.notes, key=lambda note: note.line or 0)

    def note(self, line, text):
        self.notes.append(Note(text, line))

    def _check_names(self):
        """Each name once; a column that is missing counts as 0, and is said to."""
        for section, column in (("line types", "name"), ("points", "id"), ("lines", "id"), ("bodies", "id")):
            seen = set()
            for row in self.tables.of(section):
                if (name := row.values.get(column)) in seen:
                    raise InputError(f"line {row.line}: {name} of {section.upper()} is given twice.")
                seen |= {name} - {None}
        for section, wanted in (("line types", ("BA", "Cd", "Ca", "CdAx")), ("points", ("mass", "volume"))):
            line, columns = self.tables.columns.get(section, (0, []))
            names = {canonical(section, column) for column in columns}
            for name in wanted if columns else ():
                if name not in names:
                    self.note(line, f"{section.upper()} has no column {name}: 0 is taken")

    # -- the world ----------------------------------------------------------------------------------------------------

    def _headers(self):
        """Columns of version 1, which version 2 of MoorDyn would read by their places, and wrongly."""
        line, columns = self.tables.columns.get("line types", (0, []))
        if [column for column in columns if column in FIRST_VERSION]:
            self.note(
                line,
                "the columns Can Cat Cdn Cdt are those of MoorDyn 1 and were read by name; MoorDyn 2 reads columns "
                "by their places, and would take them for EI or Cd, Ca, CdAx, CaAx",
            )

    def _world(self):
        option = self.tables.option
        found = {}
        if gravity := self._number("g", "gravity"):
            found["gravity"] = gravity
        depth = option("WtrDpth", "WtrDepth", "depth")
        sea = {"depth": self._number("WtrDpth", "WtrDepth", "depth", may_be_file=True) or self._deepest()}
        if depth is None or not is_number(depth[1]):
            line = depth[0] if depth else None
            self.note(line, f"no single depth is given: the deepest fixed point sets it, {sea['depth']:g} m")
        if density := self._number("rho", "rhoW", "WtrDnsty"):
            sea["density"] = density
        found["sea"] = sea
        bed = {}
        line, kbot = option("kBot", "kb") or (None, "3e6")
        if not is_number(kbot):
            raise InputError(f"line {line}: kBot is {kbot!r}, which is no number.")
        if float(kbot) > 0:
            bed["stiffness"] = float(kbot)
        if friction := self._number("FrictionCoefficient", "mu_kT"):
            bed["friction"] = friction
        if bed:
            found["seabed"] = bed
        self._other_options()
        return found

    def _number(self, *names, may_be_file=False):
        line, text = self.tables.option(*names) or (None, None)
        if text is None or (may_be_file and not is_number(text)):
            return None
        if not is_number(text):
            raise InputError(f"line {line}: {names[0]} is {text!r}, which is no number.")
        return number_of(text)

    def _deepest(self):
        heights = [place[2] for kind, place in self.places.values() if kind == "fixed"]
        return max(1.0, -min(heights, default=-100.0))

    def _other_options(self):
        for name, (line, value) in self.tables.options.items():
            if name in ("cbot", "cb"):
                self.note(line, f"cBot = {value}: damping of the bed is seabed.damping_ratio here, left at its default")
            elif name == "wavekin" and value not in ("0", "0.0"):
                self.note(
                    line, f"WaveKin = {value}: waves are in files of their own and are not carried over; add [waves]"
                )
            elif name == "currents" and value not in ("0", "0.0"):
                self.note(
                    line, f"Currents = {value}: they are in files of their own and are not carried over; add [current]"
                )
            elif name not in (*CARRIED, *NUMERICAL, "wavekin", "currents"):
                self.note(line, f"the option {name} = {value} is not carried over")

    # -- lines --------------------------------------------------------------------------------------------------------

    def _material(self, row: Row):
        found = {"line_density": row.number("mass_density"), "diameter": row.number("diameter")}
        stiffness = row["EA"].split("|")
        if len(stiffness) > 1:
            self.note(row.line, f"EA = {row['EA']} is viscoelastic: the first value is taken, as the static one")
        if not is_number(stiffness[0]):
            raise InputError(
                f"line {row.line}: EA is the file {row['EA']}, which is not read: give a number in its place."
            )
        found["axial_stiffness"] = float(stiffness[0])
        found |= {"normal_drag": row.number("Cd", 0.0), "added_mass": row.number("Ca", 0.0)}
        found["tangential_drag"] = math.pi * row.number("CdAx", 0.0)
        self._damping(row, found)
        if row.number("EI", 0.0):
            self.note(row.line, f"EI = {row['EI']} N m^2: lines have no bending stiffness here")
        if row.number("CaAx", 0.0):
            self.note(row.line, f"CaAx = {row['CaAx']}: there is no added mass along a line here")
        return found

    def _damping(self, row, found):
        text = row.values.get("BA", "0").split("|")[0]
        if not is_number(text):
            self.note(row.line, f"BA = {text} is a file, which is not read: damping = 0")
        elif float(text) > 0:
            found["damping"] = float(text)
        elif float(text) < 0:
            self.note(
                row.line,
                f"BA = {text} is a share of critical damping of a segment: numerical, for explicit steps; damping = 0",
            )

    def _cable(self, row, materials):
        material = row["type"]
        if material not in materials:
            raise InputError(
                f"line {row.line}: LineType {material!r} is none of the LINE TYPES: {', '.join(materials)}."
            )
        found = {"name": f"line{row.values.get('id', row.line)}", "material": material}
        found |= {"from": self._end(row, "A"), "to": self._end(row, "B")}
        found |= {"length": row.number("length"), "elements": max(1, round(row.number("segments", 20.0)))}
        return found | {"slack": "tension-only"}

    def _end(self, row, column):
        place = row[column]
        if not place.isdigit():
            raise InputError(f"line {row.line}: an end on {place!r} is not carried over: lines end on points here.")
        if place not in self.places:
            raise InputError(f"line {row.line}: there is no point {place}.")
        kind, where = self.places[place]
        return list(where) if kind == "fixed" else where

    # -- points -------------------------------------------------------------------------------------------------------

    def _point(self, row):
        kind, name = row["attachment"].lower(), row.values.get("id", "")
        place = np.array([row.number(axis) for axis in "xyz"])
        if kind.startswith(("fix", "anch")):
            self.places[name] = "fixed", tuple(place.tolist())
        elif kind.startswith(("body", "turbine")) and kind[-1].isdigit():
            self._on_body(row, name, kind, place)
        elif kind.startswith(("coupled", "vessel", "ves", "cpld", "fair")):
            self.joints.append({"name": f"point{name}", "position": place.tolist()})
            self.places[name] = "joint", f"point{name}"
            self.note(
                row.line, f"point {name} is moved by the program that calls MoorDyn: it is held where it stands here"
            )
        elif kind.startswith(("free", "con", "point")):
            self._free(row, name)
        else:
            raise InputError(f"line {row.line}: the attachment {row['attachment']!r} of a point is not known.")

    def _free(self, row, name):
        joint = {"name": f"point{name}"}
        for key, column in (("mass", "mass"), ("volume", "volume"), ("drag_area", "CdA"), ("added_mass", "Ca")):
            if value := row.number(column, 0.0):
                joint[key] = value
        if any(row.number(column, 0.0) for column in ("fx", "fy", "fz")):
            self.note(row.line, f"the constant force on point {name} is not carried over")
        self.joints.append(joint)
        self.places[name] = "joint", joint["name"]

    def _on_body(self, row, name, kind, place):
        number = "".join(c for c in kind if c.isdigit())
        if number in self.buoys:
            self.places[name] = "joint", self.buoys[number].fairlead(name, place)
            return
        body = next((b for b in self.tables.of("bodies") if b.values.get("id") == number), None)
        if body is None:
            raise InputError(f"line {row.line}: there is no body {number}.")
        position = placed(body, place)
        self.joints.append({"name": f"point{name}", "position": position.tolist()})
        self.places[name] = "joint", f"point{name}"
        self.note(row.line, f"point {name} on body {number} is held where it stands")

    def _rods(self):
        """Free bodies with an upright rod become buoys; all others cannot."""
        types = {row["name"]: row for row in self.tables.of("rod types")}
        rods = self.tables.of("rods")
        for body in self.tables.of("bodies"):
            number = body.values.get("id", "1")
            own = [rod for rod in rods if rod.values.get("attachment", "").lower() == f"body{number}"]
            if is_free(body) and (found := buoy_of(body, own, types, self.note)):
                self.buoys[number] = found
                rods = [rod for rod in rods if rod not in own]
        for rod in rods:
            self.note(rod.line, f"rod {rod.values.get('id', '')} is not carried over")
