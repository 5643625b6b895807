"""Mesh files through meshio."""

import meshio
import numpy as np


def write_line(path, points, point_data=None, cell_data=None):
    """Write a polyline of points (n, 3) as line cells; the format follows the file's suffix."""
    points = np.asarray(points, dtype=float)
    cells = np.column_stack([np.arange(len(points) - 1), np.arange(1, len(points))])
    mesh = meshio.Mesh(points, [("line", cells)], point_data=point_data, cell_data=cell_data)
    mesh.write(path)


def read_nodes(path):
    """Arc lengths of the nodes of a line mesh file (its x coordinate), sorted.

    Raises ValueError if meshio cannot read the file, if it has no line cells or does not start at 0.
    """
    try:
        mesh = meshio.read(path)
    except (meshio.ReadError, OSError, ValueError, KeyError, IndexError, SystemExit) as error:  # it exits at a bad file
        raise ValueError(f"meshio cannot read {path} ({str(error).rstrip('.') or type(error).__name__})") from None
    lines = [block.data for block in mesh.cells if block.type == "line"]
    if not lines:
        raise ValueError(f"{path} has no line cells")
    nodes = np.unique(mesh.points[np.unique(np.concatenate(lines)), 0])
    if abs(nodes[0]) > 1e-12 * max(1.0, nodes[-1]):
        raise ValueError(f"the nodes of {path} start at {nodes[0]}, not at 0")
    return nodes
