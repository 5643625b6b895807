"""The scene language: typed, bounded sections, with reading and writing."""

from .cable import Top
from .keys import Key, list_keys
from .reading import build_scene, kept_scene, load_scene, merged, parse_assignment, shipped_scenes, varied
from .sections import Scene

__all__ = [
    "Key",
    "Scene",
    "Top",
    "build_scene",
    "kept_scene",
    "list_keys",
    "load_scene",
    "merged",
    "parse_assignment",
    "shipped_scenes",
    "varied",
]
