"""Reading moorings of other programs, and writing the result as a scene file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import tomli_w

from ..errors import InputError, printable
from ..scene import load_scene
from ..scene.reading import MOST_BYTES
from . import from_famodel, from_map, from_moordyn, from_wisdem, from_yaml
from .names import Note

#: Readers of the kinds of files.
READERS: dict[str, Callable[..., tuple[dict[str, Any], list[Note]]]] = {
    "moordyn": from_moordyn.scene_of,
    "moorpy": from_yaml.scene_of,
    "raft": from_yaml.scene_of,
    "map": from_map.scene_of,
    "wisdem": from_wisdem.scene_of,
    "famodel": from_famodel.scene_of,
}


def read(kind: str, path: Path, columns: str = "name", depth: float | None = None) -> tuple[dict[str, Any], list[Note]]:
    """The scene of a mooring in a file, as its sections and keys, and notes on parts that could not be translated.

    kind: one of READERS.  columns: "name", or "place" for MoorDyn 2's columns by position, whatever their names.
    depth: of the water [m], if the file does not give it.

    Raises InputError for a file that cannot be read, or that is not a valid scene.
    """
    if kind not in READERS:
        raise InputError(f"FORMAT = {kind!r}: must be {' or '.join(READERS)}.")
    if columns not in ("name", "place") or (columns == "place" and kind != "moordyn"):
        raise InputError(f"--columns = {columns!r}: must be name, or place with moordyn.")
    try:
        if Path(path).is_fifo():  # nobody may ever write to it
            raise InputError(f"{path}: must be a file, and is a pipe.")
        with Path(path).open("rb") as file:
            raw = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    if len(raw) > MOST_BYTES:
        raise InputError(f"{path}: must hold at most {MOST_BYTES // 1_000_000} MB.")
    text = raw.decode("utf-8", errors="replace")
    title = "".join(c for c in Path(path).stem if c.isprintable())[:200]
    try:
        own = {"by_place": columns == "place", "folder": Path(path).parent} if kind == "moordyn" else {}
        scene, notes = READERS[kind](text, title, depth=depth, **own)
        load_scene(scene)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return scene, notes


def as_toml(scene: dict[str, Any], notes: list[Note], source: str) -> str:
    """Text of a scene file, with notes on parts not translated at its top."""
    lines = [f"Carried over from {source}.", *map(str, notes)]
    return "".join(f"# {printable(text)}\n" for text in lines) + "\n" + tomli_w.dumps(scene)
