"""Geometry: the cable's interval, the hull's axis, and mesh files through meshio."""

from .cable import cable_nodes, number_of_cells
from .files import line_mesh, read_nodes, write_line
from .hull import HullShape

__all__ = ["HullShape", "cable_nodes", "line_mesh", "number_of_cells", "read_nodes", "write_line"]
