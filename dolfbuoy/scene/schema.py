"""The scene language for editors: a JSON Schema (draft 2020-12) from the models in `sections`, and commented scenes.
A commented scene has its own keys, and all others as comments, each with its meaning.

A scene names the schema in its first line, `#:schema schema.json`, where editors with TOML support look for it.
It does not cover constraints between keys, which `dolfbuoy check` tests.
"""

import json
import math
from pathlib import Path
from typing import Any

from .keys import Key, list_keys
from .lines import Line
from .network import OWN
from .petsc_options import ALLOWED, Number
from .reading import FILES
from .section import Section, holds_several, sections_in
from .sections import SEVERAL, Scene

#: The file among the shipped scenes.
FILE = Path(__file__).parents[1] / "scenes" / "schema.json"


def schema() -> dict[str, Any]:
    """Schema of a scene; each key with its description, unit, default and range."""
    found: dict[str, Any] = _tidy(Scene.model_json_schema())
    sections = found["$defs"]
    for key in sorted(FILES - {"library"}):  # or a file
        *path, name = key.split(".")
        model: type[Section] = Scene
        for part in path:
            model = sections_in(model.model_fields[part].annotation)[0]
        rule = sections[model.__name__]["properties"][name]
        if "anyOf" not in rule:
            bounds = ("type", "items", "maxItems", "minItems", "$ref")
            rule["anyOf"] = [{word: rule.pop(word) for word in bounds if word in rule}]
        if {"type": "string"} not in rule["anyOf"]:
            rule["anyOf"].append({"type": "string"})
    petsc = sections["Solver"]["properties"]["petsc"]
    petsc |= {
        "additionalProperties": False,
        "properties": {name: _option(allowed) for name, allowed in ALLOWED.items()},
    }
    for name, info in Line.resolved.model_fields.items():
        if name in sections["Line"]["properties"] and not (info.is_required() or _needless("default", info.default)):
            sections["Line"]["properties"][name]["default"] = info.default
    for name in SEVERAL:
        rule = found["properties"][name]
        found["properties"][name] = {"if": {"type": "array"}, "then": rule, "else": rule["items"]}
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Scene of dolfbuoy"}
    return head | found


def as_text() -> str:
    """The schema as the text of its file."""
    return json.dumps(schema(), indent=1, sort_keys=True, allow_nan=False) + "\n"


def _option(allowed: Number | tuple[str, ...] | str) -> dict[str, Any]:
    if isinstance(allowed, str):  # SWITCH
        return {"type": "boolean"}
    if isinstance(allowed, tuple):
        return {"enum": list(allowed)}
    return {"type": "integer" if allowed.whole else "number", "minimum": allowed.low, "maximum": allowed.high}


def _tidy(node: Any) -> Any:
    """Remove null, which TOML lacks, and inf, which JSON lacks; add units to descriptions."""
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    result = {name: _tidy(value) for name, value in node.items() if not _needless(name, value)}
    if "unit" in result and not isinstance(result["unit"], dict):
        unit = result.pop("unit")
        result["description"] += "" if unit == "1" else f" [{unit}]"
    choices = [choice for choice in result.get("anyOf", []) if choice != {"type": "null"}]
    if len(choices) == 1:
        del result["anyOf"]
        result = choices[0] | result
    elif choices:
        result["anyOf"] = choices
    return result


def _needless(name: str, value: Any) -> bool:
    """Items to remove: pydantic's titles from names, and defaults that are not TOML values, or whole sections."""
    if name == "title":
        return isinstance(value, str)
    bad = value is None or isinstance(value, dict) or (isinstance(value, float) and not math.isfinite(value))
    return name == "default" and bad


_COLUMN = 40  # column of comments


def commented(scene: Scene, schema: str) -> str:
    """TOML text of the same scene; schema: path of the language's schema for editors."""
    rows = {row.name: row for row in list_keys()}
    head = [
        f"#:schema {schema}",
        "# SI units; degrees only where the key says so.  World frame: z up, z = 0 at still water.  A section that is",
        "# missing is an effect that is off.  Behind a # stands what is not used: keys at their default, or with none.",
    ]
    lines = _section(Scene, scene.model_dump(exclude_unset=True), rows, "")
    return "\n".join(head + lines) + "\n"


def _section(model: type[Section], given: dict[str, Any] | None, rows: dict[str, Key], prefix: str) -> list[str]:
    """Lines of the keys of a section, then of the sections in it; given: None if the scene does not have it."""
    lines, later = [], []
    for name, info in model.model_fields.items():
        forms, row = sections_in(info.annotation), rows.get(prefix + name)
        value = given.get(name) if given else None
        if prefix + name in SEVERAL and value and len(value) == 1:
            value = value[0]
        if row:
            lines += _key(name, row, value)
            inner = (found for full, found in rows.items() if full.startswith(f"{row.name}."))
            lines += [f"#     {part.name.removeprefix(row.name)[1:]}: {_meaning(part)}" for part in inner]
        elif isinstance(value, list):
            for item in value:
                later += ["", f"[[{prefix}{name}]]", *_given(item, rows, f"{prefix}{name}.")]
        elif value and holds_several(info.annotation):
            for own, item in value.items():
                later += ["", f"[{prefix}{name}.{own}]", *_given(item, rows, f"{prefix}{name}.NAME.")]
        elif prefix == "buoy." and name in OWN and value is None:
            later += ["", f"# [buoy.{name}]  # the section [{name}] of one of several buoys"]
        else:
            later += _table(f"{prefix}{name}", info.annotation, forms[0], value, rows)
    return lines + later


def _table(
    name: str, annotation: Any, model: type[Section], value: dict[str, Any] | None, rows: dict[str, Key]
) -> list[str]:
    """Lines of a section, as a comment if the scene does not have it."""
    inside = f"{name}.NAME." if holds_several(annotation) else f"{name}."
    heading = (
        f"[[{name}]]" if holds_several(annotation, list) and name not in SEVERAL else f"[{inside.removesuffix('.')}]"
    )
    more = f"; several: [[{name}]]" if name in SEVERAL else ""
    sign = "" if value is not None else "# "
    lines = ["", f"{sign}{heading}  # {(model.__doc__ or '').splitlines()[0].removesuffix('.')}{more}"]
    return lines + _section(model, value, rows, inside)


def _given(item: dict[str, Any], rows: dict[str, Key], prefix: str) -> list[str]:
    """Lines of a table of a list: the keys given, with their meanings."""
    return [line for name, value in item.items() for line in _key(name, rows.get(prefix + name), value)]


def _key(name: str, row: Key | None, value: Any) -> list[str]:
    """Lines of a key with its value, or without one as a comment with its default."""
    if row is None:  # a table of its own, with no meaning beyond that of its keys
        return [f"{name} = {in_toml(value)}"]
    if value is None:
        start = f"# {name} = {'' if row.default == 'required' else row.default}".rstrip()
        return [f"{start:<{_COLUMN}}  # {_meaning(row)}"]
    start = f"{name} = {in_toml(value)}"
    return [f"{start:<{_COLUMN}}  # {_meaning(row)}"] if len(start) <= _COLUMN else [f"# {_meaning(row)}", start]


def _meaning(row: Key) -> str:
    unit = f" [{row.unit}]" if row.unit not in ("", "1") else ""
    words = f": {row.range}" if '"' in row.range else ""
    return f"{row.description}{unit}{words}"


def in_toml(value: Any) -> str:
    """A value on one line; tables as inline tables."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {in_toml(item)}" for name, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(in_toml, value))}]"
    return repr(value)
