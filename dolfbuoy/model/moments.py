"""Bending moments at the nodes of lines."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..solver import compat
from ..solver.vector_ops import Work, lengths, work
from .grounding import Points

if TYPE_CHECKING:
    from .lines import Lines
    from .problem import Problem


class Moments:
    """Bending moments at this rank's nodes of the lines of a Problem with bending stiffness.

    bent: mask of these among all nodes.  sizes: |t x m| at them [N m], as of the last call of the `works`.  At the
    vertices between cells m converges with order mu + 1 only, because it is continuous where its part along a rotated t
    should not be, and t x m with order 2 mu, with the direction given there by the equation for m on one of their
    cells; up to degree 2, |m| is as good.
    """

    def __init__(self, problem: "Problem") -> None:
        lines: Any = problem.lines
        u = problem.system.u
        places = np.asarray(lines.moments(np.arange(1.0, len(u) + 1))[: lines.owned_nodes] - 1, dtype=int)
        self.bent = places[:, 0] >= 0
        self.sizes = np.zeros(self.bent.sum())
        self.works = [lengths(u, places[self.bent], self.sizes)]
        number, first = np.cumsum(self.bent) - 1, 0
        for group in lines.groups:
            if group.moment_dofs is not None and group.section.position_degree > 2 and _is_plain(group):
                self.works.append(_in_vertices(group, u, number[first : first + group.owned_nodes], self.sizes))
            first += group.owned_nodes


def _is_plain(lines: "Lines") -> bool:
    """True if the equation for m contains only m and t."""
    return lines.bending_damping is None and lines.winch is None


def _in_vertices(lines: "Lines", u: np.ndarray, number: np.ndarray, sizes: np.ndarray) -> Work:
    """Correction of the sizes at the vertices between cells; number: index of each node in the sizes."""
    degree = lines.dx.metadata()["quadrature_degree"]
    points, (_, weights) = Points(lines, lines.positions, degree), compat.interval_quadrature(degree)
    ends = np.concatenate([n[[0, -1]] for n in lines.nodes])
    vertices = points.nodes[:, 1::-1].T.ravel()  # both ends of a cell, one shared with another
    inner = (vertices < lines.owned_nodes) & (np.abs(lines.node_s[vertices][:, None] - ends) > lines.slip).all(axis=1)
    found, first = np.unique(vertices[inner], return_index=True)
    end, cell = np.divmod(np.flatnonzero(inner)[first], len(points.nodes))
    EI = np.array([c.bending_stiffness for c in lines.sections])[lines.line_of_cell[cell]]
    return work(
        "size_moments",
        "vertices",
        {
            "m": points.in_c(lines.moment_dofs[points.nodes[cell]]),
            "slope": points.in_c(lines.node_dofs[points.nodes[cell]], slopes=True),
            "u": u[lines.part.slice],
            "weights": weights,
            "size_per_EI": np.diff(lines.cell_ends[cell]).ravel() / EI,
            "vertex": (1 - end).astype(np.int32),
            "row": number[found].astype(np.int32),
            "sizes": sizes,
        },
    )
