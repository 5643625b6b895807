"""The scene language for editors: a JSON Schema (draft 2020-12) made from the models in `sections`.

A scene names it in its first line, `#:schema schema.json`, where editors with TOML support look for it.  What several
keys must be together is not in it; `dolfbuoy check` refuses what does not fit.
"""

import json
import math
from pathlib import Path
from typing import Any

from .lines import Line
from .petsc_options import ALLOWED, Number
from .reading import FILES
from .section import Section, sections_in
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
    """The schema as text of its file."""
    return json.dumps(schema(), indent=1, sort_keys=True, allow_nan=False) + "\n"


def _option(allowed: Number | tuple[str, ...] | str) -> dict[str, Any]:
    if isinstance(allowed, str):  # SWITCH
        return {"type": "boolean"}
    if isinstance(allowed, tuple):
        return {"enum": list(allowed)}
    return {"type": "integer" if allowed.whole else "number", "minimum": allowed.low, "maximum": allowed.high}


def _tidy(node: Any) -> Any:
    """Without what TOML does not have (null) and JSON does not have (inf); units in the descriptions."""
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
    """Titles that pydantic makes of names; defaults that are no value of TOML, or a whole section."""
    if name == "title":
        return isinstance(value, str)
    bad = value is None or isinstance(value, dict) or (isinstance(value, float) and not math.isfinite(value))
    return name == "default" and bad
