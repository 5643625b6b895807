"""Input files of MoorDyn as tables: sections, rows by column name, options.

Source: MoorDyn's manual, "Input Files", versions 1 and 2.  Columns are found by name, not by position, because the two
versions order them differently.  Anything before the first section is free text; !, # and % begin a comment.
"""

import re
from dataclasses import dataclass, field

from ..errors import InputError
from ..scene.quantities import number_of

COMMENT = "!#%"
#: Sections by words in their headings, both versions; the first match counts.
SECTIONS = {
    "line types": ("LINE TYPES", "LINE DICTIONARY"),
    "rod types": ("ROD TYPES", "ROD DICTIONARY"),
    "bodies": ("BODIES", "BODY LIST", "BODY PROPERTIES"),
    "rods": ("RODS", "ROD LIST", "ROD PROPERTIES"),
    "points": ("POINTS", "POINT LIST", "POINT PROPERTIES", "CONNECTION PROPERTIES", "CONNECTIONS", "NODE PROPERTIES"),
    "lines": ("LINES", "LINE LIST", "LINE PROPERTIES"),
    "failure": ("FAILURE",),
    "control": ("CONTROL",),
    "external loads": ("EXTERNAL LOADS",),
    "options": ("OPTIONS",),
    "outputs": ("OUTPUT",),
}
#: Columns by their names in files, in lower case.
COLUMNS = {
    "name": ("typename", "name", "linetype", "rodtype"),
    "id": (
        *("id", "#", "num", "line", "lineid", "line#", "node", "node#", "connection", "point", "pointid"),
        *("body", "bodyid", "rod", "rodid", "failureid", "failure"),
    ),
    "diameter": ("diam", "diameter", "dia"),
    "mass_density": ("mass/m", "massden", "massdeninair", "mass/length", "massdens"),
    "EA": ("ea",),
    "BA": ("ba/-zeta", "ba", "cintdamp", "ba/-damp", "bazeta"),
    "EI": ("ei",),
    "Cd": ("cd", "cdn"),
    "Ca": ("ca", "can"),
    "CdAx": ("cdax", "cdt"),
    "CaAx": ("caax", "cat"),
    "CdEnd": ("cdend",),
    "CaEnd": ("caend",),
    "attachment": ("attachment", "type", "att", "type/bodyid"),
    "x": ("x", "x0"),
    "y": ("y", "y0"),
    "z": ("z", "z0"),
    "mass": ("mass", "m"),
    "volume": ("volume", "vol", "v"),
    "fx": ("fx",),
    "fy": ("fy",),
    "fz": ("fz",),
    "CdA": ("cda", "cda*"),
    "point_Ca": ("ca*",),
    "type": ("linetype", "rodtype"),
    "A": ("attacha", "attachanch", "nodeanch", "nodea", "anchnode", "enda"),
    "B": ("attachb", "attachfair", "nodefair", "nodeb", "fairnode", "endb"),
    "length": ("unstrlen", "length", "unstrlength"),
    "segments": ("numsegs", "numseg", "numnodes"),
    "roll": ("r0",),
    "pitch": ("p0",),
    "yaw": ("y0",),
    "CG": ("cg*", "cg"),
    "I": ("i*", "i"),
    **{f"{axis}cg": (f"{axis}cg",) for axis in "xyz"},
    **{f"I{axis}": (f"i{axis}", f"i{axis}{axis}") for axis in "xyz"},
    **{f"{axis}{end}": (f"{axis}{end}",) for axis in "xyz" for end in "ab"},
    "outputs": ("outputs", "lineoutputs", "rodoutputs", "flags/outputs", "flags", "out", "lineout"),
}
#: Names with different meanings in different sections.
_IN = {
    "line types": {"linetype": "name"},
    "rod types": {"rodtype": "name", "cdt": "CdEnd", "cat": "CaEnd"},
    "bodies": {"y0": "y"},
    "lines": {"linetype": "type"},
    "rods": {"rodtype": "type", "type": "type"},
    "failure": {
        **{"point": "point", "node": "point", "line(s)": "lines", "lines": "lines", "line": "lines"},
        **{"failtime": "time", "failten": "tension", "failtension": "tension"},
    },
    "external loads": {"object": "object", "fext": "force", "blin": "linear", "bquad": "quadratic", "csys": "frame"},
}
#: Columns of MoorDyn 2 by position, whatever their names in the file.
PLACES = {
    "line types": ["TypeName", "Diam", "Mass/m", "EA", "BA/-zeta", "EI", "Cd", "Ca", "CdAx", "CaAx", "Cl", "dF", "cF"],
    "rod types": ["TypeName", "Diam", "Mass/m", "Cd", "Ca", "CdEnd", "CaEnd"],
}


@dataclass(frozen=True)
class Row:
    """A row of a table: its line in the file, values by canonical column name, and values of `other` columns."""

    line: int
    values: dict[str, str]
    other: dict[str, str] = field(default_factory=dict)

    def number(self, column: str, default: float | None = None) -> float:
        """A number of the row.  Raises InputError if it is missing or bad."""
        text = self.values.get(column)
        if text is None and default is not None:
            return default
        try:
            return number_of(text or "")
        except ValueError:
            what = f"is {text!r}, which is no number" if text is not None else "is missing"
            raise InputError(f"line {self.line}: {column} {what}.") from None

    def __getitem__(self, column: str) -> str:
        if column not in self.values:
            raise InputError(f"line {self.line}: {column} is missing.")
        return self.values[column]


@dataclass
class Tables:
    """The sections of a file; options: line and value by name in lower case; unknown: other sections.
    columns: of each section, as named in the file, with units if given; unknown: lines and headings."""

    rows: dict[str, list[Row]] = field(default_factory=dict)
    options: dict[str, tuple[int, str]] = field(default_factory=dict)
    columns: dict[str, tuple[int, list[str]]] = field(default_factory=dict)
    units: dict[str, list[str]] = field(default_factory=dict)
    unknown: list[tuple[int, str]] = field(default_factory=list)

    def of(self, section: str) -> list[Row]:
        """Rows of a section; empty if it is missing."""
        return self.rows.get(section, [])

    def option(self, *names: str) -> tuple[int, str] | None:
        """Line and value of an option by one of its names."""
        return next((self.options[name.lower()] for name in names if name.lower() in self.options), None)


def parse(text: str, by_place: bool = False) -> Tables:
    """The tables of an input file; by_place: take columns of types as those of MoorDyn 2, whatever their names.

    Raises InputError for a file without mooring lines, or with a bad row.
    """
    tables, section = Tables(), None
    for number, line in enumerate(re.split("\r\n|\r|\n", text), 1):
        if "---" in line:
            section = _begun(tables, number, line)
        elif section is None or section == "outputs" or not line.strip() or line.lstrip()[0] in COMMENT:
            continue
        elif section == "options":
            _option(tables, number, line)
        elif section not in tables.columns:
            if not re.match(r"\s*\d+\s+(n[a-z]+\s*$|[a-z]+\s+-\s)", line, re.IGNORECASE):  # number of rows
                if by_place and section in PLACES:
                    line = " ".join([*PLACES[section], *line.split()[len(PLACES[section]) :]][: len(line.split())])
                tables.columns[section] = number, line.split()
                _check_header(section, number, line)
        elif section not in tables.units and section not in tables.rows and not any(map(is_number, line.split())):
            tables.units[section] = line.split()
            _check_units(tables, section, number)
        else:
            _row(tables, section, number, re.split(f"[{COMMENT}]", line)[0])
    if not tables.of("lines"):
        raise InputError("there is no section LINES with at least one line: this is no input file of MoorDyn.")
    return tables


def _begun(tables: Tables, number: int, line: str) -> str | None:
    """The section that a heading begins; None for an unknown one, or for a title."""
    heading = " ".join(re.sub(r"[^A-Z ]", " ", line.upper()).split())
    first = not tables.columns
    for name, words in SECTIONS.items():
        if any(heading.startswith(word) if first else word in heading for word in words):
            return name
    if heading and not first and "NEED THIS LINE" not in heading:
        tables.unknown.append((number, line.strip("- \t")))
    return None


def _option(tables: Tables, number: int, line: str) -> None:
    parts = line.split()
    if len(parts) < 2 or is_number(parts[1]):
        raise InputError(f"line {number}: {line.strip()!r} is no option: a value and then its name.")
    value, name = parts[0].strip("\"'"), parts[1].lower()
    before = tables.options.get(name, (0, value))[1]
    same = before == value or (is_number(before) and is_number(value) and number_of(before) == number_of(value))
    if not same:
        raise InputError(f"line {number}: the option {parts[1]} is given twice, {before} and {value}.")
    if value.lower() != "default":
        tables.options[name] = number, value


#: Columns without which a section cannot be read.
NEEDED = {
    "line types": ("name", "diameter", "mass_density", "EA"),
    "rod types": ("name", "diameter"),
    "bodies": ("id",),
    "rods": ("type", "attachment", *(f"{axis}{end}" for end in "ab" for axis in "xyz")),
    "points": ("id", "attachment", "x", "y", "z"),
    "lines": ("type", "A", "B", "length"),
}
#: Units that MoorDyn does not support, as it takes all numbers in m, kg, s and N; kN occurs only in columns that are
#: not translated.
FOREIGN = {"ft", "feet", "in", "lb", "lbs", "lbf", "kip", "kips", "slug", "slugs"}
FOREIGN |= {"mm", "cm", "km", "kn", "mn", "gn", "t", "te", "ton", "tonne", "g"}


def _check_header(section: str, number: int, line: str) -> None:
    if section not in NEEDED:
        return
    names = [canonical(section, column) for column in line.split()]
    absent = [name for name in NEEDED[section] if name not in names]
    if absent:
        raise InputError(
            f"line {number}: {line.strip()!r} must name the columns of {section.upper()}, and has no {absent[0]}."
        )
    known = [name for name in (_bodies(names) if section == "bodies" else names) if name]
    if twice := {name for name in known if known.count(name) > 1}:
        raise InputError(f"line {number}: two columns of {section.upper()} mean {min(twice)}: {line.strip()!r}.")


def _check_units(tables: Tables, section: str, number: int) -> None:
    for column, unit in zip(tables.columns[section][1], tables.units[section], strict=False):
        found = FOREIGN & set(re.split(r"[^a-z]+", unit.lower()))
        if found and canonical(section, column) not in ("fx", "fy", "fz"):
            raise InputError(
                f"line {number}: the unit {unit} of {column} is none of MoorDyn's, which are m, kg, s and N."
            )


def canonical(section: str, column: str) -> str | None:
    """The canonical name of a column; None for an unknown one."""
    name = column.lower()
    own = _IN.get(section, {})
    if name in own:
        return own[name]
    return next((key for key, names in COLUMNS.items() if name in names), None)


def _row(tables: Tables, section: str, number: int, line: str) -> None:
    _, columns = tables.columns[section]
    names = [canonical(section, column) for column in columns]
    if section == "bodies":  # two columns are called y0: the second is a yaw
        names = _bodies(names)
    parts = line.split()
    least = len(names)
    while least and names[least - 1] in (None, "outputs"):
        least -= 1
    if section in NEEDED and (len(parts) < least or any(map(is_number, parts[len(names) :]))):
        raise InputError(f"line {number}: there are {len(parts)} values in {len(names)} columns, {' '.join(columns)}.")
    pairs = list(zip(names, columns, parts, strict=False))
    values = {name: part for name, _, part in pairs if name is not None}
    other = {column: part for name, column, part in pairs if name is None}
    if section == "bodies" and (both := re.fullmatch(r"(\d+)([A-Za-z]\w*)", values.get("id", ""))):  # e.g. 1Coupled
        values = {"attachment": both[2]} | values | {"id": both[1]}
    tables.rows.setdefault(section, []).append(Row(number, values, other))


def is_number(text: str) -> bool:
    """True if a text is a finite number."""
    try:
        number_of(text)
    except ValueError:
        return False
    return True


def _bodies(names: list[str | None]) -> list[str | None]:
    seen = names.index("y") + 1 if "y" in names else len(names)
    return names[:seen] + ["yaw" if name == "y" else name for name in names[seen:]]


def is_nothing(text: str) -> bool:
    """True for a number that is 0, and for markers of a missing value."""
    return text in ("-", "#") or (is_number(text) and number_of(text) == 0)
