"""A mooring in the input of MAP++ as a scene.

Its tables are read as those of MoorDyn 1, except for these differences:

- # before a value marks an initial guess of MAP++, not a comment; # alone is an unknown;
- the water belongs to the program that calls MAP++: `depth` as a height means its bed;
- CB is the bed friction of a line that is laid slack and then pulled: seabed.start = "pulled";
- -999.9 means no value;
- `repeat` in the solver's options copies the mooring, rotated about z [deg]; options may have lines of their own.
"""

import copy
import math
import re
from dataclasses import replace
from typing import Any

from ..errors import InputError
from ..scene.quantities import number_of
from . import from_moordyn
from .moordyn_text import is_number, parse
from .names import Note

#: Marker of a missing value.
NONE = -999.9


def scene_of(text: str, title: str = "", depth: float | None = None) -> tuple[dict[str, Any], list[Note]]:
    """The scene of a MAP++ input file, as its sections and keys, and notes on parts that could not be translated.

    depth: of the water [m]; absent: that of the deepest fixed node.  Raises InputError.
    """
    lines, options = _split(text)
    notes, angles = _guesses(lines), list[float]()
    for number, words in options:
        if words[0] == " ":  # which makes it a comment
            if words[1].lower() == "repeat":
                notes.append(
                    Note("repeat stands behind a blank, and is no option so: the mooring is made once", number)
                )
        elif words[0].lower() == "repeat" and all(map(is_number, words[1:])):
            angles += [number_of(word) for word in words[1:]]
        elif words[0].lower() not in ("option", "(-)"):
            notes.append(Note(f"the option {' '.join(words)} is not carried over", number))
    plain = "\n".join(_plain(line, number, depth) for number, line in enumerate(lines, 1))
    try:
        friction, said = _friction(plain)
        scene, more = from_moordyn.scene_of(plain, title, depth=depth)
    except InputError as error:
        raise InputError(str(error).replace("MoorDyn", "MAP++")) from None
    left = "the columns Can", "the column CB", "LINES has no"
    more = [replace(n, text=n.text.replace("MoorDyn", "MAP++")) for n in more if not n.text.startswith(left)]
    if "seabed" in scene:
        scene["seabed"] = {"friction": friction, "start": "pulled"} if friction else {}
    _repeat(scene, angles)
    return scene, [*notes, *said, *more]


def _split(text: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Lines with the solver's options blanked, and the words of the options, with the blank before the first one."""
    lines, options, inside = re.split("\r\n|\r|\n", text), list[tuple[int, list[str]]](), False
    for k, line in enumerate(lines):
        if "---" in line:
            inside = "SOLVER" in line.upper()
        elif inside:
            if words := line.split("!")[0].split():
                options.append((k + 1, [" ", *words] if line.startswith(" ") else words))
            lines[k] = ""
    return lines, options


def _guesses(lines: list[str]) -> list[Note]:
    """Notes on lengths that MAP++ solves for."""
    found, inside = list[Note](), False
    for number, line in enumerate(lines, 1):
        words = line.split()
        if "---" in line:
            inside = "LINE PROP" in line.upper()
        elif inside and len(words) > 2 and words[2].startswith("#"):
            what = f"UnstrLen {words[2]} is the guess of a length that MAP++ finds: here it is the length"
            found.append(Note(what, number))
    return found


def _plain(line: str, number: int, depth: float | None) -> str:
    """A line in MoorDyn's form."""
    if "---" in line:
        return line
    words = [_word(word, number, depth) for word in line.split("!")[0].split()]
    if "node" in map(str.lower, words[:1]):
        words = ["V" if word == "B" else word for word in words]
    return " ".join(words)


def _word(word: str, number: int, depth: float | None) -> str:
    word = word.removeprefix("#") or "0"
    if word.lower() == "depth":
        if depth is None:
            raise InputError(f"line {number}: depth is that of the program that calls MAP++: give --depth METRES.")
        return f"{-depth:.14g}"
    return "0" if is_number(word) and number_of(word) == NONE else word


def _friction(text: str) -> tuple[float, list[Note]]:
    """Friction of the bed: the largest of all types, with notes on the others."""
    rows = [(row.line, row.other["CB"]) for row in parse(text).of("line types") if "CB" in row.other]
    values = [number_of(value) if is_number(value) else 0.0 for _, value in rows]
    largest = max(values, default=0.0)
    if len(set(values)) > 1:
        said = f"CB differs among line types, and here it does not: the largest, {largest:g}, is taken"
        return largest, [Note(said, rows[0][0])]
    return largest, []


def _repeat(scene: dict[str, Any], angles: list[float]) -> None:
    """Add copies of the mooring, rotated about z by each angle [deg]."""
    cables, joints = scene["cable"], scene.get("joint", [])
    vessels, own = scene.get("vessel", []), {joint["name"] for joint in joints}
    given = [(vessel, dict(vessel["fairleads"])) for vessel in vessels]
    made = copy.deepcopy((cables, joints))
    for k, angle in enumerate(angles, 2):
        for cable in copy.deepcopy(made[0]):
            cable["name"] += f"_{k}"
            for key in ("from", "to"):
                if isinstance(cable[key], list):
                    cable[key] = _turned(cable[key], angle)
                elif cable[key] in own or "." in cable[key]:
                    cable[key] += f"_{k}"
            cables.append(cable)
        joints += [joint | {"name": f"{joint['name']}_{k}"} for joint in made[1]]
        for vessel, fairleads in given:
            vessel["fairleads"] |= {f"{name}_{k}": _turned(at, angle) for name, at in fairleads.items()}


def _turned(place: list[float], angle: float) -> list[float]:
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return [c * place[0] - s * place[1], s * place[0] + c * place[1], place[2]]
