"""Layout of lines: a mesh of disjoint intervals, its function spaces, and the places of the unknowns."""

import heapq
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import ufl
from dolfinx import fem

from ..elsewhere import MPI
from ..meshes import cable_nodes
from ..scene.cable import Cable
from ..scene.network import Network, Piece
from ..solver import compat
from .attachment import FIELDS

_NONE = np.zeros(0, dtype=int)


def laid_out(sections: list[Cable]) -> np.ndarray:
    """Start coordinates of consecutive pieces, separated by a tenth of the longest [m]."""
    lengths = np.array([c.length for c in sections])
    return np.concatenate([[0.0], np.cumsum(lengths + 0.1 * lengths.max())])[:-1]


class Pieces:
    """Pieces of line of a `network`, in one `Layout` or several.

    begins: start of each on its mesh [m]; slip: tolerance within which mesh coordinates are equal [m].  end_dofs: dofs
    of r at s = 0 and s = L of each, empty if on another rank.
    """

    network: Network
    begins: np.ndarray
    slip: float
    end_dofs: list[tuple[np.ndarray, np.ndarray]]

    @property
    def pieces(self) -> list[Piece]:
        """All pieces, in the order of their numbers."""
        return self.network.pieces

    @property
    def sections(self) -> list:
        """Their scene sections."""
        return [piece.section for piece in self.pieces]

    @property
    def section(self) -> Cable:
        """Section of the first piece."""
        return self.pieces[0].section

    @property
    def longest(self) -> float:
        """Length of the longest piece [m]."""
        return max(c.length for c in self.sections)

    def line_at(self, s: np.ndarray) -> np.ndarray:
        """Numbers of the pieces at mesh coordinates."""
        return np.searchsorted(self.begins, s + self.slip, side="right") - 1

    def held_ends(self) -> list[tuple[int, int, np.ndarray]]:
        """(piece, end, its dofs) of all ends with prescribed position."""
        ends = [(k, i) for k, piece in enumerate(self.pieces) for i, end in enumerate(piece.ends) if end.held]
        return [(k, i, self.end_dofs[k][i]) for k, i in ends]

    def top_dofs(self, line: int = 0) -> np.ndarray:
        """Dofs of r at s = L."""
        return self.end_dofs[line][1]

    @cached_property
    def turns(self) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
        """Elimination order: (turn of each piece, mask of those taken backwards, turn of each joint by name)."""
        return order_of_pieces(self.pieces)

    def elimination_order(self) -> tuple[np.ndarray, np.ndarray]:
        """(free owned dofs, keys of each): along one piece after the other, each tension after its positions.

        In this order the saddle-point matrix has a factorisation without pivoting.  All dofs of a joint come after its
        last piece but one, to limit fill-in, followed by the tensions that depend on them alone.
        """
        dofs, keys = self.elimination_keys()
        order = np.lexsort((dofs, *keys))
        return dofs[order], np.array(keys)[:, order]


class Layout(Pieces):
    """Mesh, space and numbering of the pieces of a network (`scene.network`); the unknown is w = (r, T), followed by
    the mean of T and, for lines with bending stiffness, the moment m.

    Piece k starts at `begins[k]` on the mesh.  All share the element pair, the strain form and whether they have
    bending stiffness, and are ordered so that each tension follows the positions it constrains.
    """

    def __init__(self, comm: MPI.Comm, network: Network, averaged: bool, bends: bool, begins: np.ndarray | None = None):
        self.comm, self.network = comm, network
        self._lay_out(laid_out(self.sections) if begins is None else begins)
        self.space = compat.function_space(self.mesh, self._element(averaged, bends))
        self.w, self.part = fem.Function(self.space), None
        self._numbering(averaged, bends)

    def _lay_out(self, begins):
        nodes = [cable_nodes(c.length, c.elements, c.grading) for c in self.sections]
        lengths, self.begins = [c.length for c in self.sections], begins
        self.nodes = [begin + n for begin, n in zip(self.begins, nodes, strict=True)]
        self.smallest_cell = min(np.diff(n).min() for n in nodes)
        self.mesh = compat.interval_mesh(self.comm, *self.nodes)
        self.slip = 1e-9 * max(*lengths, begins[-1] + lengths[-1] if begins[-1] else 0.0)

    def _element(self, averaged, bends):
        c = self.section
        elements = [
            compat.element(self.mesh, "P", c.position_degree, 3),
            compat.element(self.mesh, "DG", c.tension_degree),
        ]
        if averaged:
            elements.append(compat.element(self.mesh, "DG", 0))
        if bends:
            elements.append(elements[0])
        return compat.mixed_element(elements)

    def _numbering(self, averaged, bends):
        """Find the places of the dofs of w on the mesh: nodes of r, cells of T."""
        V, r_dofs = compat.collapse(self.space, 0)
        self.positions = V  #: the space of r
        Q, T_dofs = compat.collapse(self.space, 1)
        self.node_s = V.tabulate_dof_coordinates()[:, 0].copy()
        self.node_dofs = np.asarray(r_dofs).reshape(-1, 3)
        self.owned_nodes = V.dofmap.index_map.size_local
        self.cell_ends = compat.cell_ends(self.mesh)
        cells = compat.cell_dofs(Q)
        self.T_dofs, self.T_s = np.asarray(T_dofs)[cells], Q.tabulate_dof_coordinates()[cells, 0]
        self.mean_dofs = None
        if averaged:
            Q0, mean_dofs = compat.collapse(self.space, 2)
            self.mean_dofs = np.asarray(mean_dofs)[compat.cell_dofs(Q0)[:, 0]]
        self.moment_dofs = self._moment_dofs() if bends else None
        self.line_of_node = self.line_at(self.node_s)
        self.line_of_cell = self.line_at(self.cell_ends.mean(axis=1))
        ends = np.array([(n[0], n[-1]) for n in self.nodes])
        nodes = self._found(self.node_s, ends)
        self.end_dofs = [tuple(self.node_dofs[k] if k >= 0 else _NONE for k in pair) for pair in nodes]
        #: Owned cells at both ends of each piece, -1 if on another rank.
        self.end_cells = np.column_stack([self._found(self.cell_ends[:, end], ends[:, end]) for end in (0, 1)])
        #: Nodes and owned cells of each piece.
        self.nodes_of, self.cells_of = (_grouped(lines, len(ends)) for lines in (self.line_of_node, self.line_of_cell))
        self._at_anchor, self._averaging = self._weights(lambda k: float(k == 0)), self._weights(lambda k: 1 / (k + 1))

    def _moment_dofs(self):
        """Dofs of m at the nodes of r."""
        M, dofs = compat.collapse(self.space, self.space.num_sub_spaces - 1)
        found, s = np.asarray(dofs).reshape(-1, 3), M.tabulate_dof_coordinates()[:, 0]
        nodes = np.empty_like(found)
        nodes[np.argsort(self.node_s)] = found[np.argsort(s)]
        return nodes

    def end_moments(self, piece: int, end: int) -> np.ndarray:
        """Dofs of m at an end of a piece; empty if on another rank, or without bending stiffness."""
        if self.moment_dofs is None or not len(self.end_dofs[piece][end]):
            return _NONE
        return self.moment_dofs[np.flatnonzero(self.node_dofs[:, 0] == self.end_dofs[piece][end][0])[0]]

    @cached_property
    def pinned_moments(self) -> np.ndarray:
        """Dofs of m at all pinned ends, where m = 0."""
        found = [_NONE]
        for k, piece in enumerate(self.pieces):
            for i, end in enumerate(piece.ends):
                if end.clamp is None and not (end.kind == "joint" and end.name in self.network.welds):
                    found.append(self.end_moments(k, i))
        return np.concatenate(found)

    @cached_property
    def at_ends(self) -> fem.FunctionSpace:
        """Space of the unknowns of an `Attachment`, common to all."""
        return compat.real_space(self.mesh, FIELDS.size)

    def _found(self, values, wanted):
        """Indices of the wanted ones among distinct mesh coordinates; -1: not found."""
        order = np.argsort(values)
        after = np.searchsorted(values[order], wanted - self.slip)
        place = order[np.minimum(after, len(values) - 1)]
        return np.where(np.abs(values[place] - wanted) <= self.slip, place, -1)

    def _weights(self, moment):
        """Weights of the T dofs of a cell for a functional with value moment(k) on xi^k, 0 <= xi <= 1.

        All cells number their dofs in the same way, as affine images of one reference cell.
        """
        ends = self.cell_ends[0]
        xi = (self.T_s[0] - ends[0]) / (ends[1] - ends[0])
        degree = np.arange(len(xi))
        return np.linalg.solve(xi[None, :] ** degree[:, None], [moment(k) for k in degree])

    # -- ends ---------------------------------------------------------------------------------------------------------

    def end_measure(self, piece: int, end: int) -> ufl.Measure:
        """`ds` of an end of a piece: a separate measure, so that the forms of all ends are the same."""
        tags = compat.end_tags(self.mesh, self.nodes[piece][-end])
        return ufl.Measure("ds", domain=self.mesh, subdomain_data=tags)(1)

    def owns_end(self, piece: int, end: int) -> bool:
        """True if this rank owns the cell at an end and hence evaluates the loads there."""
        return bool(self.end_cells[piece, end] >= 0)

    @property
    def owned(self) -> np.ndarray:
        """Mask of the unknowns owned by this rank."""
        return np.arange(len(self.w.x.array)) < self.space.dofmap.index_map.size_local

    def places(self) -> np.ndarray:
        """Mesh coordinates of the nodes, in the order of their dofs [m]."""
        return self.node_s

    def force_dofs(self) -> np.ndarray:
        found = (self.T_dofs, self.mean_dofs, self.moment_dofs)
        return np.concatenate([dofs.ravel() for dofs in found if dofs is not None])

    # -- elimination --------------------------------------------------------------------------------------------------

    def elimination_keys(self) -> tuple[np.ndarray, tuple]:
        """Free owned dofs, and (kind, place, stage) of each, by which `elimination_order` sorts, the last one first."""
        n, size = self.space.dofmap.index_map.size_local, len(self.w.x.array)
        stage, place, kind = np.zeros(size), np.zeros(size), np.ones(size)
        turn, backwards, joints = self.turns
        far = np.where(
            backwards[self.line_of_cell],
            self._from_top(self.cell_ends[:, 0], self.line_of_cell),
            self.cell_ends[:, 1] - self.begins[self.line_of_cell],
        )
        here = self.node_s - self.begins[self.line_of_node]
        here = np.where(backwards[self.line_of_node], self._from_top(self.node_s, self.line_of_node), here)
        stage[self.node_dofs], place[self.node_dofs] = turn[self.line_of_node][:, None], here[:, None]
        kind[self.node_dofs] = 0
        if self.moment_dofs is not None:  # before the positions of its node, which get stiffness from it
            stage[self.moment_dofs], place[self.moment_dofs] = turn[self.line_of_node][:, None], here[:, None]
            kind[self.moment_dofs] = -1
        behind = self.T_dofs if self.mean_dofs is None else np.column_stack([self.T_dofs, self.mean_dofs])
        stage[behind], place[behind] = turn[self.line_of_cell][:, None], far[:, None]
        if self.mean_dofs is not None:
            kind[self.mean_dofs] = 2
        for name, ends in self.network.meetings().items():
            for k, i in ends:
                for dofs in (self.end_dofs[k][i], self.end_moments(k, i)):
                    stage[dofs], place[dofs] = joints[name], 0.0
                if i != backwards[k] and joints[name] > turn[k]:  # its last tension has to wait for the joint
                    last = behind[self.end_cells[k, i]] if self.owns_end(k, i) else _NONE
                    stage[last], place[last] = joints[name], 0.0
        given = [self.pinned_moments, *(dofs for _, _, dofs in self.held_ends())]
        dofs = np.setdiff1d(np.arange(n), np.concatenate(given))
        return dofs, (kind[dofs], place[dofs], stage[dofs])

    def _from_top(self, s, lines):
        lengths = np.array([c.length for c in self.sections])
        return (self.begins + lengths)[lines] - s

    # -- numbers ------------------------------------------------------------------------------------------------------

    def set_shape(self, u: np.ndarray, position: Callable, tension: Callable, line: int = 0) -> None:
        """Interpolate position(s) -> (n, 3) and tension(s) -> (n,) of a piece into the local unknowns u."""
        u, nodes, cells = u[self.part.slice], self.nodes_of[line], self.cells_of[line]
        u[self.node_dofs[nodes]] = position(self.node_s[nodes] - self.begins[line])
        u[self.T_dofs[cells]] = tension(self.T_s[cells] - self.begins[line])
        if self.mean_dofs is not None:
            u[self.mean_dofs] = u[self.T_dofs] @ self._averaging
        if self.moment_dofs is not None:
            u[self.moment_dofs[nodes]] = 0.0

    def set_moment(self, u: np.ndarray, moment: Callable, line: int) -> None:
        """Interpolate m(s) -> (n, 3) of a piece with bending stiffness into the local unknowns u."""
        nodes = self.nodes_of[line]
        u[self.part.slice][self.moment_dofs[nodes]] = moment(self.node_s[nodes] - self.begins[line])

    def mean_tension(self, u: np.ndarray) -> np.ndarray:
        """Average of T on each owned cell [N]."""
        return u[self.part.slice][self.T_dofs] @ self._averaging

    def moments(self, u: np.ndarray) -> np.ndarray:
        """m at the nodes (n, 3) [N m], 0 without bending stiffness."""
        if self.moment_dofs is None:
            return np.zeros((len(self.node_s), 3))
        return u[self.part.slice][self.moment_dofs]

    def anchor_tension(self, u: np.ndarray, line: int) -> float:
        """T_h(0) of a piece [N], on the rank that owns its first cell; nan elsewhere."""
        if not self.owns_end(line, 0):
            return np.nan
        return float(self._at_anchor @ u[self.part.slice][self.T_dofs[self.end_cells[line, 0]]])


def _grouped(numbers, count):
    """Indices of 0, of 1, ..., of `count` - 1 in an array."""
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.searchsorted(numbers[order], np.arange(1, count)))


def order_of_pieces(pieces: Sequence[Piece]) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """(turn of each piece, whether it goes from s = L to s = 0, {joint: turn}); a joint comes after the piece of its
    turn.

    If possible, a piece begins at an end without unknowns or at an eliminated joint: it then fills in only ahead.
    A joint is eliminated when at most one of its pieces is left.
    """
    joints, found, at_joint = {}, {}, {}
    for k, piece in enumerate(pieces):
        for end in piece.ends:
            if end.kind == "joint":
                at_joint.setdefault(end.name, []).append(k)
    waiting = {name: len(there) for name, there in at_joint.items()}
    best = [(*_best_end(piece, joints), k) for k, piece in enumerate(pieces)]  # may hold a piece twice, at a lower cost
    heapq.heapify(best)
    while best:
        _, backwards, k = heapq.heappop(best)
        if k in found:
            continue
        turn = len(found)
        found[k] = turn, bool(backwards)
        for end in pieces[k].ends:
            if end.kind == "joint":
                waiting[end.name] -= 1
                if waiting[end.name] <= 1 and end.name not in joints:
                    joints[end.name] = turn + 0.5
                    for left in set(at_joint[end.name]) - found.keys():
                        heapq.heappush(best, (*_best_end(pieces[left], joints), left))
    turns, backwards = zip(*(found[k] for k in range(len(pieces))), strict=True)
    return np.array(turns), np.array(backwards), joints


def _best_end(piece, joints):
    """(cost of beginning there, the end: 0 or 1): 2 at a joint not yet eliminated, 1 at a buoy, else 0."""
    waits = [end.kind == "joint" and end.name not in joints for end in piece.ends]
    return min((2 if waits[i] else int(end.kind == "buoy"), i) for i, end in enumerate(piece.ends))
