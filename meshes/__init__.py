"""Geometry: the cable's interval, the hull's axis, and mesh files through meshio."""

from .cable import cable_nodes
from .files import read_nodes, write_line
from .hull import HullShape

__all__ = ["HullShape", "cable_nodes", "read_nodes", "write_line"]
