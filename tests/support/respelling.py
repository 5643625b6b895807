"""A scene as the dict of its file, in the other spelling of its tables."""

import tomllib
from pathlib import Path

import dolfbuoy.scenes

#: Keys that are tables or lists of tables.
TABLES = ("cable", "buoy")


def spelled(name) -> dict:
    """A shipped scene as its file spells it."""
    return tomllib.loads((Path(dolfbuoy.scenes.__path__[0]) / f"{name}.toml").read_text())


def respelled(scene: dict) -> dict:
    """The scene with [[cable]] and [[buoy]] for [cable] and [buoy], and the other way where there is one of a kind."""
    return scene | {key: _other(scene[key]) for key in TABLES if key in scene}


def _other(value):
    if isinstance(value, dict):
        return [value]
    return value[0] if len(value) == 1 else value
