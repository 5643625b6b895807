"""Mesh files through meshio, imported only when needed because that takes 0.03 s."""

import numpy as np


def write_line(path, points, point_data=None, cell_data=None):
    """Write a polyline of points (n, 3) as line cells; the format follows the file's suffix."""
    import meshio

    points = np.asarray(points, dtype=float)
    cells = np.column_stack([np.arange(len(points) - 1), np.arange(1, len(points))])
    meshio.Mesh(points, [("line", cells)], point_data=point_data, cell_data=cell_data).write(path)


def read_nodes(path):
    """Arc lengths of the nodes of a line mesh file (its x coordinate), sorted.

    Raises ValueError if meshio cannot read the file, or it has no line cells or does not start at 0.
    """
    import meshio

    try:
        mesh = meshio.read(path)
        lines = [mesh.points[block.data, 0].ravel() for block in mesh.cells if block.type == "line"]
    except (Exception, SystemExit) as error:  # meshio may raise anything, even SystemExit, on a bad file
        raise ValueError(f"meshio cannot read {path} ({str(error).rstrip('.') or type(error).__name__})") from None
    if not lines:
        raise ValueError(f"{path} has no line cells")
    nodes = np.unique(np.concatenate(lines))
    if abs(nodes[0]) > 1e-12 * max(1.0, nodes[-1]):
        raise ValueError(f"the nodes of {path} start at {nodes[0]}, not at 0")
    return nodes
