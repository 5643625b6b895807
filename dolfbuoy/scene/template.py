"""A scene as a commented file: the keys that it gives, and all others as comments, each with what it means."""

import json

from .keys import Key, list_keys
from .section import Section, section_in
from .sections import Scene

_COLUMN = 40  # where comments begin


def commented(scene: Scene, schema: str) -> str:
    """TOML text that reads as the same scene; schema: where editors find that of the language."""
    rows = {row.name: row for row in list_keys()}
    head = [
        f"#:schema {schema}",
        "# SI units; degrees only where the key says so.  World frame: z up, z = 0 at still water.  A section that is",
        "# missing is an effect that is off.  Behind a # stands what is not used: keys at their default, or with none.",
    ]
    lines = _section(Scene, scene.model_dump(exclude_unset=True), rows, "")
    return "\n".join(head + lines) + "\n"


def _section(model: type[Section], given: dict | None, rows: dict[str, Key], prefix: str) -> list[str]:
    """Lines of the keys of a section, then of the sections in it; given: None if the scene does not have it."""
    lines, later = [], []
    for name, info in model.model_fields.items():
        inner, row = section_in(info.annotation), rows.get(prefix + name)
        value = given.get(name) if given else None
        if row:
            lines += _key(name, row, value)
            if inner:
                lines += [f"#     {part}: {_meaning(rows[f'{row.name}.{part}'])}" for part in inner.model_fields]
        else:
            sign = "" if value is not None else "# "
            later += ["", f"{sign}[{prefix}{name}]  # {inner.__doc__.splitlines()[0]}"]
            later += _section(inner, value, rows, f"{prefix}{name}.")
    return lines + later


def _key(name, row, value):
    """Lines of a key with its value, or without one as a comment with its default."""
    if value is None:
        start = f"# {name} = {'' if row.default == 'required' else row.default}".rstrip()
        return [f"{start:<{_COLUMN}}  # {_meaning(row)}"]
    start = f"{name} = {in_toml(value)}"
    return [f"{start:<{_COLUMN}}  # {_meaning(row)}"] if len(start) <= _COLUMN else [f"# {_meaning(row)}", start]


def _meaning(row):
    unit = f" [{row.unit}]" if row.unit not in ("", "1") else ""
    words = f": {row.range}" if '"' in row.range else ""
    return f"{row.description}{unit}{words}"


def in_toml(value) -> str:
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
