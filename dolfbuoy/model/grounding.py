"""Lines on the sea bed: contact at the points of their quadrature, and the length that lies."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from dolfinx import fem

from ..scene.cable import Cable
from ..solver import compat
from .contact import ContactParameters, hardness, has_friction, parameters_of_line
from .seabed import Bed

if TYPE_CHECKING:
    from .lines import Lines


class GroundedLength(NamedTuple):
    """Grounded part of a line."""

    length: float  #: unstretched [m]
    s: float  #: arc length at which it leaves the bed towards s = L [m]; -inf if nothing lies
    touchdown: np.ndarray  #: that point [m]; nan if nothing lies
    sag: float  #: deepest penetration [m]
    first: float = np.inf  #: arc length at which it leaves the bed towards s = 0 [m]; inf if nothing lies
    foot: np.ndarray = np.full(3, np.nan)  #: that point [m]; nan if nothing lies


class Points:
    """Points of the owned cells of lines: those of the quadrature of a degree; with_nodes: and their nodes, in order.

    nodes: of each cell.  s: mesh coordinates, shape (cells, points).  line: number of the line of each cell.  presses:
    mask of the points of the quadrature, shape (points,).
    """

    def __init__(self, lines: "Lines", positions: fem.FunctionSpace, degree: int, with_nodes: bool = False):
        self.nodes = compat.cell_dofs(positions)
        ends = lines.node_s[self.nodes]  # the first two nodes of a cell are its ends
        first, size = ends[:, :1], ends[:, 1:2] - ends[:, :1]
        nodes, (xi, _) = (ends[0] - first[0]) / size[0], compat.interval_quadrature(degree)
        self.presses = np.ones(len(xi), bool)
        if with_nodes:
            xi = np.concatenate([nodes, xi])
            order = np.argsort(xi)
            xi, self.presses = xi[order], order >= len(nodes)
        self.s, self.line = first + xi * size, lines.line_of_cell
        power = np.arange(ends.shape[1])
        self._basis = xi[:, None] ** power @ np.linalg.inv(nodes[:, None] ** power)

    def of(self, values: np.ndarray, nodes: np.ndarray | None = None) -> np.ndarray:
        """Values at the points of all cells, or those with these nodes, shape (cells, points, 3), of values (n, 3)."""
        return self._basis @ values[self.nodes if nodes is None else nodes]

    def scalars(self, values: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Values at the points of the cells with these nodes, shape (cells, points), of values (n,)."""
        return values[nodes] @ self._basis.T


class Seabed(Bed):
    """Contact of `Lines` with the bed, at the points of their quadrature."""

    def __init__(self, lines: "Lines"):
        positions, degree = lines.positions, lines.dx.metadata()["quadrature_degree"]
        needs = has_friction(lines.scene, lines.dynamic) or lines.scene.seabed.depths is not None
        self.points = Points(lines, positions, degree) if needs else None

        def space():
            return compat.function_space(lines.mesh, compat.quadrature_element(lines.mesh, degree, 3))

        super().__init__(lines, space)
        if self.held is not None:
            self._place = 3 * compat.cell_dofs(self.held.function_space)[..., None] + np.arange(3)
        self.soundings = Points(lines, positions, degree, with_nodes=True)
        #: Nodes of each line, which of these its own cells have, from its start on, and where their soundings are.
        self._along, at = [], self.soundings
        for nodes, cells in zip(lines.nodes_of, lines.cells_of, strict=True):
            cells = cells[np.argsort(at.s[cells, 0])]
            self._along.append((nodes, np.searchsorted(nodes, at.nodes[cells]), at.s[cells]))

    def parameters_of(self, section: Cable) -> ContactParameters:
        scene = self.model.scene
        return parameters_of_line(scene, section, self._of_scene(self._of_lines)[0])

    def _of_lines(self):
        """(hardness of the bed, numbers of the contact in every cell)."""
        scene = self.model.scene
        hard = hardness(scene, [piece.section for piece in scene.network.pieces])
        values = np.array([parameters_of_line(scene, section, hard) for section in self.model.sections])
        return hard, values[self.model.line_of_cell].T[:, :, None]

    def parameter_values(self) -> np.ndarray:
        """Numbers of the contact in every cell, arrays (cells, 1)."""
        return self._of_scene(self._of_lines)[1]

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        lines, degree = self.model, self.model.dx.metadata()["quadrature_degree"]
        space = compat.function_space(lines.mesh, compat.quadrature_element(lines.mesh, degree, size))
        return space, size * compat.cell_dofs(space)[..., None] + np.arange(size)

    def at(self, values: np.ndarray) -> np.ndarray:
        return self.points.of(values[self.model.node_dofs])

    # -- numbers -------------------------------------------------------------------------------------------------------

    def grounded(self, u: np.ndarray, line: int = 0) -> GroundedLength:
        """Grounded length of a line, on every rank.

        All lies between two points of the quadrature that touch the bed, if they are of one element or of neighbours:
        what rises there is the element's wave, not the line.  Elsewhere the gap is linear from sounding to sounding.
        """
        s, g, position = self._sound(u, line)
        bridged = _bridged((g < 0) & self.soundings.presses)
        s, g = s.ravel(), g.ravel()
        lower, upper = np.minimum(g[:-1], g[1:]), np.maximum(g[:-1], g[1:])
        below = np.maximum(-lower, 0.0) / np.maximum(upper - lower, 1e-300)  # part on which a linear gap is negative
        share = np.where(bridged | (upper <= 0), 1.0, below)
        length, sag, lies = float(share @ np.diff(s)), max(-float(g.min()), 0.0), np.flatnonzero(share)
        if not len(lies):
            return GroundedLength(length, -np.inf, np.full(3, np.nan), sag)
        low, high = lies[0], lies[-1]

        def point(k, x):
            place = (1 - x) * position(k) + x * position(k + 1)
            return float((1 - x) * s[k] + x * s[k + 1] - self.model.begins[line]), place

        first, foot = point(low, 0.0 if bridged[low] or g[low] < 0 else 1 - share[low])
        last, touchdown = point(high, 1.0 if bridged[high] or g[high] >= 0 else share[high])
        return GroundedLength(length, last, touchdown, sag, first, foot)

    def _sound(self, u, line):
        """(s, gap, k -> position of the k-th) at the soundings of a whole line, s and gap of shape (cells, points)."""
        (nodes, of_cells, s), at = self._along[line], self.soundings
        r = u[self.model.part.slice][self.model.node_dofs[nodes]]
        g = at.scalars(self.gap(r), of_cells)
        if self.model.comm.size == 1:
            return s, g, lambda k: at.of(r, of_cells[k // s.shape[1]])[k % s.shape[1]]
        every = zip(*self.model.comm.allgather((s, g, at.of(r, of_cells))), strict=True)
        s, g, places = (np.concatenate(part) for part in every)
        order = np.argsort(s[:, 0])
        places = places[order].reshape(-1, 3)
        return s[order], g[order], lambda k: places[k]


def _bridged(touches):
    """Mask of the intervals between the points (cells, points) that have a touching point near on both sides."""
    at, change = np.flatnonzero(touches), np.zeros(touches.size, int)
    near = np.diff(at // touches.shape[1]) <= 1
    change[at[:-1][near]] += 1
    change[at[1:][near]] -= 1
    return np.cumsum(change)[:-1] > 0
