"""A scene, as the dict of its file, in the other spelling of its tables."""

import tomllib
from pathlib import Path

import dolfbuoy.scenes
from dolfbuoy.scene.reading import with_files

#: Keys that are tables or lists of tables.
TABLES = ("cable", "buoy")


def spelled(name) -> dict:
    """A shipped scene as spelled in its file, with the folder of its data files."""
    folder = Path(dolfbuoy.scenes.__path__[0])
    return with_files(tomllib.loads((folder / f"{name}.toml").read_text()), folder)


def respelled(scene: dict) -> dict:
    """The scene with [[cable]] and [[buoy]] for [cable] and [buoy], and vice versa if there is only one of each."""
    return scene | {key: _other(scene[key]) for key in TABLES if key in scene}


def _other(value):
    if isinstance(value, dict):
        return [value]
    return value[0] if len(value) == 1 else value
