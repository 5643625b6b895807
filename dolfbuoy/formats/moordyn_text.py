"""Input files of MoorDyn as tables: sections, rows by the names of their columns, options.

Source: MoorDyn's manual, "Model Structure and Input File", versions 1 and 2.  Columns are found by their names and not
by their places, because the two versions order them differently.
"""

import re
from dataclasses import dataclass, field

from ..errors import InputError
from ..scene.quantities import number_of

#: Sections by words in their headings, both versions; the first that fits counts.
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
#: Columns by what files call them, in lower case.
COLUMNS = {
    "name": ("typename", "name", "linetype", "rodtype"),
    "id": ("id", "line", "node", "lineid", "node#", "#", "num", "line#", "connection", "point", "body", "rod", "rodid"),
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
    "attachment": ("attachment", "type", "att"),
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
    "A": ("attacha", "nodeanch", "nodea", "anchnode"),
    "B": ("attachb", "nodefair", "nodeb", "fairnode"),
    "length": ("unstrlen", "length", "unstrlength"),
    "segments": ("numsegs", "numseg"),
    "roll": ("r0",),
    "pitch": ("p0",),
    "yaw": ("y0",),
    "CG": ("cg*", "cg"),
    "I": ("i*", "i"),
    **{f"{axis}{end}": (f"{axis}{end}",) for axis in "xyz" for end in "ab"},
    "outputs": ("outputs", "lineoutputs", "rodoutputs", "flags/outputs", "flags", "out", "lineout"),
}
#: Names that mean one thing in one section and another in another.
_IN = {
    "line types": {"linetype": "name"},
    "rod types": {"rodtype": "name"},
    "bodies": {"y0": "y"},
    "lines": {"linetype": "type"},
    "rods": {"rodtype": "type", "type": "type"},
}


@dataclass(frozen=True)
class Row:
    """A row of a table: its line in the file, its values by canonical names of columns."""

    line: int
    values: dict[str, str]

    def number(self, column: str, default: float | None = None) -> float:
        """A number of the row.  Raises InputError for none."""
        text = self.values.get(column)
        if text is None and default is not None:
            return default
        try:
            return number_of(text)
        except (AttributeError, ValueError):
            what = f"is {text!r}, which is no number" if text is not None else "is missing"
            raise InputError(f"line {self.line}: {column} {what}.") from None

    def __getitem__(self, column):
        if column not in self.values:
            raise InputError(f"line {self.line}: {column} is missing.")
        return self.values[column]


@dataclass
class Tables:
    """The sections of a file; options: line and value by their names in lower case; columns: those of each section as
    the file names them; unknown: lines and headings of sections that are not known."""

    rows: dict[str, list[Row]] = field(default_factory=dict)
    options: dict[str, tuple[int, str]] = field(default_factory=dict)
    columns: dict[str, tuple[int, list[str]]] = field(default_factory=dict)
    unknown: list[tuple[int, str]] = field(default_factory=list)

    def of(self, section: str) -> list[Row]:
        """Rows of a section, none if it is not there."""
        return self.rows.get(section, [])

    def option(self, *names: str) -> tuple[int, str] | None:
        """Line and value of an option by one of its names."""
        return next((self.options[name.lower()] for name in names if name.lower() in self.options), None)


def parse(text: str) -> Tables:
    """The tables of an input file.  Raises InputError for a file that has no lines of a mooring, or a bad row."""
    tables, section, skip = Tables(), None, 0
    for number, line in enumerate(text.replace("\r", "").split("\n"), 1):
        if line.count("---"):
            section, skip = _section(line), 0
            if section is None and re.search("[A-Za-z]", line) and "need this line" not in line.lower():
                tables.unknown.append((number, line.strip("- \t")))
        elif not line.strip() or line.lstrip().startswith("#") or section is None:
            continue
        elif section == "options":
            _option(tables, number, line)
        elif section == "outputs":
            continue
        elif section not in tables.columns:
            tables.columns[section], skip = (number, line.split()), 1
            _check_header(section, number, line)
        elif skip:
            skip = 0  # the units
            if line.lstrip().startswith("("):
                _check_units(number, line)
            else:
                _row(tables, section, number, line)
        else:
            _row(tables, section, number, line)
    if not tables.of("lines"):
        raise InputError("there is no section LINES with at least one line: this is no input file of MoorDyn.")
    return tables


def _section(line):
    heading = re.sub(r"[^A-Z ]", " ", line.upper())
    heading = " ".join(heading.split())
    return next((name for name, words in SECTIONS.items() if any(word in heading for word in words)), None)


def _option(tables, number, line):
    parts = line.split()
    if len(parts) < 2:
        raise InputError(f"line {number}: {line.strip()!r} is no option: a value and a name.")
    tables.options[parts[1].lower()] = (number, parts[0].strip('"'))


#: Columns without which a section cannot be read.
NEEDED = {
    "line types": ("name", "diameter", "mass_density", "EA"),
    "points": ("id", "attachment", "x", "y", "z"),
    "lines": ("type", "A", "B", "length"),
}
#: In which no file of MoorDyn is, which takes all numbers for m, kg, s and N.
IMPERIAL = {"ft", "feet", "in", "lb", "lbs", "lbf", "kip", "kips", "slug", "slugs"}


def _check_header(section, number, line):
    names = [canonical(section, column) for column in line.split()]
    absent = [name for name in NEEDED.get(section, ()) if name not in names]
    if absent:
        raise InputError(
            f"line {number}: {line.strip()!r} must name the columns of {section.upper()}, and has no {absent[0]}."
        )


def _check_units(number, line):
    found = IMPERIAL & set(re.split(r"[^a-z]+", line.lower()))
    if found:
        raise InputError(f"line {number}: the unit ({min(found)}) is none of MoorDyn, which has m, kg, s and N.")


def canonical(section: str, column: str) -> str | None:
    """The canonical name of a column, None for one that is not known."""
    name = column.lower()
    own = _IN.get(section, {})
    if name in own:
        return own[name]
    return next((key for key, names in COLUMNS.items() if name in names), None)


def _row(tables, section, number, line):
    _, columns = tables.columns[section]
    names = [canonical(section, column) for column in columns]
    if section == "bodies":  # two columns are called y0: the second is a yaw
        names = _bodies(names)
    parts = line.split()
    least = len(names)
    while least and names[least - 1] in (None, "outputs"):
        least -= 1
    if len(parts) < least or any(is_number(part) for part in parts[len(names) :]):
        raise InputError(f"line {number}: there are {len(parts)} values in {len(names)} columns, {' '.join(columns)}.")
    values = {name: part for name, part in zip(names, parts, strict=False) if name is not None}
    tables.rows.setdefault(section, []).append(Row(number, values))


def is_number(text: str) -> bool:
    """Whether it is a finite number."""
    try:
        number_of(text)
    except ValueError:
        return False
    return True


def _bodies(names):
    seen = names.index("y") + 1 if "y" in names else len(names)
    return names[:seen] + ["yaw" if name == "y" else name for name in names[seen:]]
