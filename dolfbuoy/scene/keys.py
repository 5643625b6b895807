"""The scene language as a table: every key with its unit, default, range and meaning, from the models in `sections`."""

import functools
from typing import Any, NamedTuple

from ..errors import InputError
from .petsc_options import ALLOWED
from .section import Section, holds_several, sections_in, unit_of
from .sections import SEVERAL, Scene


class Key(NamedTuple):
    """A key of a scene, as text."""

    name: str  #: with its sections, "cable.top.period"
    unit: str  #: "1": dimensionless; empty: no number
    default: str  #: as in TOML, "required", or empty: absent
    range: str
    description: str


def list_keys(model: type[Section] = Scene, prefix: str = "") -> list[Key]:
    """All keys of a section and of the sections in it, in the order of the file."""
    schema = functools.cache(lambda of: of.model_json_schema()["properties"])
    rows = []
    for key, (owner, name) in _fields(model, prefix).items():
        info = owner.model_fields[name]
        if info.description:
            stands = getattr(owner, "resolved", owner).model_fields.get(name, info)  # its default holds
            default = "required" if stands.is_required() else _toml(stands.default)
            rows.append(Key(key, unit_of(info), default, _range(schema(owner)[name]), info.description))
    return rows


def _fields(model: type[Section], prefix: str = "") -> dict[str, tuple[type[Section], str]]:
    """Name of each key and section -> its parent section, and its name there."""
    found = {}
    for name, info in model.model_fields.items():
        found[prefix + name] = model, name
        inside = f"{prefix}{name}.NAME." if holds_several(info.annotation) else f"{prefix}{name}."
        for inner in sections_in(info.annotation):
            found |= {key: there for key, there in _fields(inner, inside).items() if key not in found}
    return found


def keys_of(section: str | None = None) -> list[Key]:
    """Keys of a section, by dotted name, including subsections; all keys without a section.  Raises InputError."""
    rows = list_keys()
    if section is None:
        return rows
    found = [row for row in rows if row.name == section or row.name.startswith(f"{section}.")]
    if not found:
        names = dict.fromkeys(row.name.rpartition(".")[0] for row in rows if "." in row.name)
        raise InputError(f"SECTION = {section!r}: must be a section ({', '.join(names)}) or a key of a scene.")
    return found


@functools.cache
def _takers() -> frozenset[str]:
    options = {
        f"solver.petsc.{name}" for name, words in ALLOWED.items() if isinstance(words, tuple) and "none" in words
    }
    return frozenset({row.name for row in list_keys() if '"none"' in row.range} | options)


def takes_none(key: str) -> bool:
    """True if the word none is a valid value of the key."""
    return key in _takers()


#: Tables that may occur in a list, and tables with names chosen in the scene.
_LISTS = frozenset({*SEVERAL, "joint", "vessel", "cable.segments", "buoy.point_masses"})
_NAMED = frozenset({"material", "uncertain", "design.vary", "solver.petsc", "initial.points"})


@functools.cache
def _known() -> frozenset[str]:
    names = (name.replace(".NAME", "").split(".") for name in _fields(Scene))
    return frozenset(".".join(parts[: n + 1]) for parts in names for n in range(len(parts)))


def is_key(names: list[str]) -> bool:
    """True if these are the parts of a key or section, possibly with names or numbers of tables."""
    here = ""
    for k, name in enumerate(names):
        deeper = f"{here}.{name}" if here else name
        if deeper in _known():
            here = deeper
        elif not (here in _NAMED or here.endswith(".fairleads") or (here in _LISTS and k + 1 < len(names))):
            return False
    return True


_BOUNDS = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}


def _toml(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list | tuple):
        return f"[{', '.join(_toml(v) for v in value)}]"
    return f"{value:g}" if isinstance(value, int | float) else "{}"


def _range(schema: dict[str, Any]) -> str:
    """Range allowed by a JSON schema, in words."""
    if "anyOf" in schema:
        return " or ".join(_range(choice) for choice in schema["anyOf"] if choice.get("type") != "null")
    if "enum" in schema:
        return " | ".join(f'"{word}"' for word in schema["enum"])
    if "prefixItems" in schema:
        items = [_range(item) for item in schema["prefixItems"]]
        one = items[0].removeprefix("number ")
        return f"{len(items)} numbers {one}" if len(set(items)) == 1 else f"[{', '.join(items)}]"
    if isinstance(schema.get("additionalProperties"), dict) and "$ref" not in schema["additionalProperties"]:
        return f"table of {_range(schema['additionalProperties'])}"
    kind = schema.get("type", "table")
    if kind == "array":
        return f"list of {_range(schema['items'])}"
    words = {"boolean": "true | false", "string": "text", "integer": "whole number", "object": "table"}
    bounds = ", ".join(f"{sign} {schema[name]:g}" for name, sign in _BOUNDS.items() if name in schema)
    return f"{words.get(kind, kind)} {bounds}".strip()
