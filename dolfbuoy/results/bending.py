"""Lines at an instant: bending moments, the sharpest bend, how far allowed curvatures are used, and grounded length."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..elsewhere import MPI
from ..model.grounding import GroundedLength
from ..model.moments import Moments
from ..parallel.ranks import allreduce
from ..solver.vector_ops import together, work

if TYPE_CHECKING:
    from ..model.problem import Problem


class Bending:
    """Bending of the cables of a Problem.

    values (cable, 3), as of the last `note`: moments at s = 0 and s = L [N m], largest curvature [1/m].  utilisation
    (cable,): largest product of a curvature and the `minimum_bend_radius` there, 0 without one; limited: whether any
    line has one.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, network = problem, problem.network
        lines: Any = problem.lines
        self.values, self.utilisation = np.zeros((len(network.cables), 3)), np.zeros(len(network.cables))
        sections = [piece.section for piece in network.pieces]
        stiffness = np.array([c.bending_stiffness or np.inf for c in sections])
        radius = np.array([c.minimum_bend_radius or 0.0 for c in sections])
        self.limited = bool(radius.any())
        owned = slice(lines.owned_nodes)
        #: 1/EI in the nodes of this rank, 0 where a line does not bend.
        self.per_moment, self._radius = (1 / stiffness)[lines.line_of_node[owned]], radius[lines.line_of_node[owned]]
        cable = np.array([piece.cable for piece in network.pieces])[lines.line_of_node[owned]]
        #: This rank's nodes cable by cable, the cables that it has nodes of, and where these begin.
        self._by_cable = np.argsort(cable, kind="stable")
        self._cables, self._begins = np.unique(cable[self._by_cable], return_index=True)
        s = lines.node_s[owned]
        order = np.lexsort((s, lines.line_of_node[owned]))
        self.moments = Moments(problem)
        self._measure = together(*self.moments.works)
        self._ends = []  #: (cable, column, node) of the ends that this rank owns
        for cable in range(len(network.cables)):
            for column, (k, end) in enumerate(((network.first_of(cable), 0), (network.last_of(cable), 1))):
                mine = order[lines.line_of_node[owned][order] == k]
                if lines.owns_end(k, end) and len(mine):
                    self._ends.append((cable, column, mine[-end]))

    def _sizes(self) -> NDArray[Any]:
        """Moments in the nodes of this rank [N m]."""
        self._measure()
        found = np.zeros(len(self.moments.bent))
        found[self.moments.bent] = self.moments.sizes
        return found

    def curvatures(self) -> NDArray[Any]:
        """Curvature in the nodes of this rank [1/m]."""
        return np.asarray(self._sizes() * self.per_moment)

    def moment_at(self, piece: int, s: float) -> float:
        """|m| at an arc length of a piece [N m], on every rank; collective."""
        lines: Any = self.problem.lines
        group, number = lines.holder(piece)
        if group.moment_dofs is None:
            return 0.0
        s, size = s + group.begins[number], 0.0
        ends = group.cell_ends[group.cells_of[number]]
        for low, high in ends[(ends[:, 0] <= s) & (s <= ends[:, 1])][:1]:
            rim = 1e-9 * (high - low)
            within = (low - rim < group.node_s) & (group.node_s < high + rim) & (group.line_of_node == number)
            own = group.node_s[within].tolist()
            basis = [math.prod((s - b) / (a - b) for b in own if b != a) for a in own]
            m = self.problem.system.u[group.part.slice][group.moment_dofs[within]]
            size = float(np.linalg.norm(np.array(basis) @ m))
        return float(allreduce(self.problem.comm, size, MPI.MAX))

    def note(self) -> None:
        """Take the present unknowns; collective."""
        moments, found = self._sizes(), np.zeros((len(self.values), 4))
        curvature = moments * self.per_moment
        if len(self._cables):
            both = np.column_stack([curvature, curvature * self._radius])[self._by_cable]
            found[self._cables, 2:] = np.maximum.reduceat(both, self._begins, axis=0)
        for cable, column, node in self._ends:
            found[cable, column] = moments[node]
        if self.problem.comm.size > 1:
            self.problem.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        self.values[:], self.utilisation[:] = found[:, :3], found[:, 3]


class Grounded:
    """Grounded parts of the cables of a Problem, as of the last call of its `notes`.

    rows: length on the bed and the point where the uppermost piece there leaves it, (cable, 4) [m].  moments: bending
    moments there (cable,) [N m].
    """

    def __init__(self, problem: Problem, bending: Bending | None) -> None:
        network, self._problem, self._bending = problem.network, problem, bending
        cables = range(len(network.cables))
        self.rows, self.moments = np.zeros((len(cables), 4)), np.zeros(len(cables))
        self._pieces = np.zeros((len(network.pieces), GroundedLength.SIZE))
        self._firsts = np.array([*map(network.first_of, cables), len(network.pieces)], np.int32)
        self._last = np.zeros(len(cables), np.int32)  # piece of each that leaves the bed there

    def notes(self) -> Iterator[Callable[[], object]]:
        """Functions that bring it up to date, in order."""
        lines: Any = self._problem.lines
        for piece, row in enumerate(self._pieces):
            group, number = lines.holder(piece)
            yield group.bed.lying(self._problem.system.u, row, number)
        fields = {"pieces": self._pieces, "firsts": self._firsts, "cables": len(self.rows)}
        yield work("sum_lying", "lying_cables", fields | {"rows": self.rows, "last": self._last})
        if self._bending is not None:
            yield self._note_moments

    def _note_moments(self) -> None:
        bending: Any = self._bending
        for cable, piece in enumerate(self._last):
            length, s = self._pieces[piece, :2]
            self.moments[cable] = bending.moment_at(int(piece), s) if length > 0 else 0.0
