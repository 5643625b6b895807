"""Errors found by pydantic in a scene, as a single sentence."""

from collections.abc import Iterable
from typing import Any, TypeVar

from pydantic import ValidationError

from ..errors import InputError
from .keys import list_keys
from .quantities import Missing, Wrong
from .section import Section, sections_in
from .sections import SEVERAL, Scene

#: Other values accepted by a key, if the message is only about its numbers.
_OR = {
    "cable.elements": "or a list of [length, number] of segments, or a mesh file",
    "cable.top.phase_deg": "or one of each component",
    "current.profile": "or a table [[z, speed], ...]",
    "waves.spectrum": "or a table [[f, S], ...] of numbers >= 0, or a file",
    "waves.components": "or a list of [amplitude, period, direction_deg, phase_deg], or a file",
}
S = TypeVar("S", bound=Section)

#: Message for an unknown key.
UNKNOWN = "unknown key"
_LONGEST = 200  # characters of a value


def made(section: type[S], **keys: Any) -> S:
    """A section of a scene from keys that are not in a file.  Raises InputError."""
    try:
        return section(**keys)
    except ValidationError as error:
        raise InputError(sentence(error)) from None


def sentence(error: ValidationError, data: dict[str, Any] | None = None) -> str:
    """The first error as a sentence with key, value and what is allowed; data: of the whole scene."""
    first = error.errors()[0]
    unknown = first["type"] == "extra_forbidden"
    last = len(first["loc"]) - 1  # an unknown key may look like a tag
    location = [str(part) for i, part in enumerate(first["loc"]) if (unknown and i == last) or not _is_type_tag(part)]
    location[1:2] = _name_of(location, data)
    key, message = ".".join(location) or "scene", first["msg"].replace(" after validation", "")
    if unknown:
        name = _short(".".join(location)) or repr("")
        return f"{name} = {shown(first['input'])}: {UNKNOWN}; allowed here are {', '.join(_fields(first['loc'][:-1]))}."
    if first["type"] == "missing":
        return f"{key}: must be given, {_meaning(location)}."
    if first["type"] == "value_error":
        cause = first["ctx"]["error"]
        if isinstance(cause, Wrong):
            return f"{'.'.join([*location, cause.key])} = {shown(cause.value)}: {cause.allowed}."
        if isinstance(cause, Missing):
            return f"{'.'.join([*location, cause.key])}: must be given, {cause.why}."
        value = "" if isinstance(first["input"], dict) else f" = {shown(first['input'])}"
        return f"{key}{value}: {message.removeprefix('Value error, ')}."
    if first["type"] == "model_type":
        return f"{key} = {shown(first['input'])}: must be a section, a table of keys."
    if key in _OR:
        message = f"{message} {_OR[key]}"
    return f"{key} = {shown(first['input'])}: {message[0].lower()}{message[1:]}."


def _name_of(location: list[str], data: dict[str, Any] | None) -> list[str]:
    """Replacement of the index of a table that may occur several times: none if it is the only one, or its name."""
    tables = (data or {}).get(location[0]) if location[:1] and location[0] in SEVERAL else None
    if len(location) < 2 or not location[1].isdigit() or location[0] not in SEVERAL:
        return location[1:2]
    if not isinstance(tables, list) or len(tables) == 1:
        return []
    table = tables[int(location[1])]
    name = table.get("name") if isinstance(table, dict) else None
    return [name] if isinstance(name, str) else location[1:2]


def shown(value: Any) -> str:
    """A value as text in a message, of limited length."""
    try:
        return _short(repr(value))
    except (RecursionError, ValueError):  # infinitely nested; a whole number of thousands of digits
        return f"({type(value).__name__})"


def _meaning(location: list[str]) -> str:
    """Description of a key; point_masses.0.mass is a key of the section in the list."""
    row = next((row for row in list_keys() if row.name == ".".join(p for p in location if not p.isdigit())), None)
    return f"{row.description} [{row.unit}]".removesuffix(" []").removesuffix(" [1]") if row else "a section"


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _is_type_tag(part: Any) -> bool:
    """True for the member of a union that pydantic tried, which is not a key of the file."""
    return isinstance(part, str) and (
        "[" in part or part.startswith("constrained") or part in ("int", "float", "bool", "str")
    )


def _fields(location: Iterable[Any]) -> list[str]:
    """Keys of the section at a location, which may contain the form that pydantic tried."""
    model: type[Section] = Scene
    for part in location:
        info = model.model_fields.get(part)
        model = next(iter(sections_in(info.annotation)), model) if info else model
    return sorted(model.model_fields)
