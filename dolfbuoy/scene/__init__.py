"""What a scene calls for: typed, bounded sections, and how they are read and written."""

from .reading import build_scene, load_scene, parse_assignment, shipped_scenes
from .sections import Scene, Top

__all__ = ["Scene", "Top", "build_scene", "load_scene", "parse_assignment", "shipped_scenes"]
