"""Reading and checking a scene from a name, a file or a dict.

An unknown key, a wrong type or a value out of range is an `InputError` of one sentence that names the key, the value
and what is allowed.
"""

import contextlib
import copy
import json
import os
import re
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import InputError
from .keys import is_key, takes_none
from .library import expanded
from .mesh_file import Named
from .sections import SEVERAL, Scene
from .sentences import sentence, shown


def shipped_scenes() -> dict[str, Path]:
    """Name -> file of the scenes shipped with dolfbuoy."""
    return {file.stem: file for file in sorted((Path(__file__).parents[1] / "scenes").glob("*.toml"))}


def recommended(name: str) -> dict[str, Any]:
    """Recommended scheme and step for scenes like this shipped one, as overrides; empty for other scenes."""
    if name not in shipped_scenes():
        return {}
    steps = json.loads((Path(__file__).parents[1] / "scenes" / "steps.json").read_text())  # first_steps.py made it
    return {f"time__{key}": value for key, value in steps.get(name, {}).items()}


def load_scene(scene: str | Path | dict[str, Any] | Scene, **overrides: Any) -> Scene:
    """Read and check a scene: a shipped name, a path, a dict of sections, or a Scene.

    Overrides: nested dicts (`time={"end": 5}`), or keys with dots or double underscores (`time__end=5`).
    Raises InputError with one sentence.
    """
    return build_scene(_read(scene), overrides)


def build_scene(data: dict[str, Any], overrides: dict[str, Any] | None = None) -> Scene:
    """Scene from a dict of sections and overrides; raises InputError."""
    return _validated(expanded(merged(data, **(overrides or {})), parse))


def kept_scene(text: str) -> Scene:
    """The scene in a record or a checkpoint: complete, so that it names no file.  Raises InputError."""
    try:
        return build_scene(with_files(parse(text), Path(os.devnull)))  # below which there is none
    except (TypeError, ValueError) as error:
        raise InputError(f"its scene cannot be read: {str(error).rstrip('.')}.") from None


def varied(scene: Scene, changes: dict[str, Any]) -> Scene:
    """As `build_scene(scene.to_dict(), changes)`, but unchanged sections are not read again.

    Long tables in them cost nothing, and ten thousand variants are checked in a second.
    """
    touched = {key.replace("__", ".").partition(".")[0] for key in changes}
    kept = {name: getattr(scene, name) for name in type(scene).model_fields if name not in touched}
    return _validated(expanded(kept | merged(scene.to_dict(touched), **changes), parse))


def _validated(data: dict[str, Any]) -> Scene:
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        raise InputError(sentence(error, data)) from None


def merged(data: dict[str, Any], /, **changes: Any) -> dict[str, Any]:
    """A deep copy of a dict of sections (or of a section's keys) with changes.

    A key with dots or double underscores addresses sections (`time__end=5`); a dict is merged into the existing section
    (`time={"end": 5}`), None removes.  Raises InputError if a key leads into something other than a section, or if a
    key to be removed is neither present nor a key of a scene.
    """
    result = {name: _alone(value) if name in SEVERAL else value for name, value in copy.deepcopy(data).items()}
    for key, value in changes.items():
        names = names_in(key, result)
        before, result = result, _merge(result, names, copy.deepcopy(value))
        if value is None and result == before and not is_key(names):
            raise InputError(f"{'.'.join(names)}: is no key of a scene that could be taken away.")
    return result


def names_in(key: str, data: dict[str, Any]) -> list[str]:
    """The names in a dotted key, without the name or index of an only cable or buoy."""
    names = key.replace("__", ".").split(".")
    table = data.get(names[0]) if names[0] in SEVERAL else None
    if isinstance(table, dict) and len(names) > 2 and names[1] in (table.get("name", names[0]), "0"):
        del names[1]
    return names


def _alone(value: Any) -> Any:
    """The table in a list of one."""
    return value[0] if _is_list_of_tables(value) and len(value) == 1 else value


NO_SECTION = "is not a section"
NO_TABLE = "there is none of this name, but"


def _merge(data: dict[str, Any], keys: list[str], value: Any, above: tuple[str, ...] = ()) -> dict[str, Any]:
    """`data`, found under the keys `above`, with `value` set under the nested `keys`."""
    head, rest = keys[0], keys[1:]
    old = data.get(head)
    if rest and isinstance(old, list) and _is_list_of_tables(old):
        return {**data, head: _merge_into_list(old, rest, value, (*above, head))}
    if rest:
        if old is not None and not isinstance(old, dict):
            raise InputError(f"{'.'.join([*above, head])} = {shown(old)}: {NO_SECTION} with a key {'.'.join(rest)}.")
        value = _merge(old or {}, rest, value, (*above, head))
    elif isinstance(value, dict) and isinstance(old, dict):
        inner = old
        for key, item in value.items():
            inner = _merge(inner, [key], item, (*above, head))
        value = inner
    result = {k: v for k, v in data.items() if k != head}
    return result if value is None else {**result, head: value}


def _is_list_of_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def _merge_into_list(tables: list[Any], keys: list[str], value: Any, above: tuple[str, ...]) -> list[Any]:
    """The tables with `value` under keys[1:] of the one with name keys[0] (or index from 0, if unnamed)."""
    names = [str(table.get("name", number)) for number, table in enumerate(tables)]
    if keys[0] not in names:
        raise InputError(f"{'.'.join([*above, keys[0]])}: {NO_TABLE} {', '.join(names)}.")
    place, (_, *rest) = names.index(keys[0]), keys
    if not rest and not isinstance(value, dict):
        raise InputError(f"{'.'.join([*above, keys[0]])} = {shown(value)}: must be a table of keys.")
    changed = tables[place]
    for inner, item in [(rest, value)] if rest else [([name], item) for name, item in value.items()]:
        changed = _merge(changed, inner, item, (*above, keys[0]))
    return [*tables[:place], changed, *tables[place + 1 :]]


def parse_assignment(text: str) -> tuple[str, Any]:
    """`section.key=value` of the command line, the value in TOML (a bare word is a string).

    Nothing, or the bare word none, is None: the key is removed, unless none is one of its words (waves.stretching).
    Raises InputError.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not all(key.split(".")):
        raise InputError(f"--set {text}: must have the form section.key=value.")
    if not text.strip().isprintable():
        raise InputError(f"--set {text}: must be on one line, without control characters.")
    if key.count(".") >= DEEPEST:
        raise InputError(f"--set {key[:50]}...: must have {DEEPEST} names in its key at most.")
    if not value or (value == "none" and not takes_none(key)):
        return key, None
    try:
        return key, parse(f"value = {value}")["value"]
    except ValueError:
        return key, value


DEEPEST = 30  # lists and tables within each other
MOST_BYTES = 10_000_000  # of a scene file: more than `quantities` allows, and some seconds of tomllib
#: A dotted key of more names than allowed, as tomllib's time is quadratic in them; scans each character once.
_NAME = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![\w\\-])(?:{_NAME}\.[ \t]*+){{{DEEPEST}}}")


def parse(text: str) -> dict[str, Any]:
    """Parse TOML; raises ValueError for errors of tomllib, and beforehand for input that would take it too long."""
    deep = ValueError(f"lists or tables are nested more than {DEEPEST} deep")
    if _DEEP_KEY.search(text):
        raise deep
    try:
        found = tomllib.loads(text)
    except RecursionError:
        raise deep from None
    level = [found]
    for _ in range(DEEPEST):
        level = [item for node in level for item in (node.values() if isinstance(node, dict) else node)]
        level = [item for item in level if isinstance(item, dict | list)]
    if level:
        raise deep
    return found


def _read(scene: str | Path | dict[str, Any] | Scene) -> dict[str, Any]:
    if isinstance(scene, Scene):
        return scene.to_dict()
    if isinstance(scene, dict):
        return scene
    shipped, path = shipped_scenes(), Path(scene)
    if str(scene) in shipped:
        path = shipped[str(scene)]
    try:
        if not path.is_file():
            with contextlib.suppress(FileNotFoundError, NotADirectoryError):
                path.stat()  # raises other errors, which is_file ignores from Python 3.14 on
            raise InputError(f"SCENE = '{scene}': is neither a file nor a shipped scene ({', '.join(shipped)}).")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise InputError(f"Scene file {path} must have {MOST_BYTES:,} bytes at most: points belong in a mesh file.")
        found: dict[str, Any] = with_files(parse(content.decode("utf-8-sig")), path.parent)
        return found
    except OSError as error:
        raise InputError(f"Scene file {path} cannot be read: {error.strerror}.") from None
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"Scene file {path} is not valid TOML: {str(error).rstrip('.')}.") from None


#: Keys whose values may name a file.
FILES = frozenset(
    {
        "cable.elements",
        "cable.segments.elements",
        "buoy.potential_flow",
        "cable.segments.winch",
        "cable.winch",
        "cable.top.motion",
        "joint.motion",
        "sea.tide",
        "seabed.depths",
        "vessel.motion",
        "vessel.raos",
        "vessel.wind.over_time",
        "library",
        "current.over_time",
        "current.grid",
        "wind.over_time",
        "buoy.wind.over_time",
        "external_force.over_time",
        "buoy.external_force.over_time",
    }
    | {"waves.spectrum", "waves.components", "waves.elevation"}
)


def with_files(data: Any, folder: Path, key: str = "") -> Any:
    """The contents of a scene file with names of files marked with the scene's folder, also in lists of tables."""
    if isinstance(data, dict):
        return {name: with_files(value, folder, f"{key}.{name}" if key else name) for name, value in data.items()}
    if isinstance(data, list):
        return [with_files(item, folder, key) for item in data]
    return Named(folder, data) if isinstance(data, str) and key in FILES else data
