"""Geometry: the cable's interval, the hull's axis, and mesh files through meshio."""

from .cable import cable_nodes, number_of_cells
from .files import read_nodes, write_line
from .hull import HullShape

__all__ = ["HullShape", "cable_nodes", "number_of_cells", "read_nodes", "write_line"]
