"""Extremes of the lines over all steps of a run, including those between frames, and utilisation of breaking loads.

Also numbers of lines at an instant: bending moments, largest curvature and its utilisation, and grounded length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..elsewhere import MPI
from ..errors import InputError
from ..model.grounding import GroundedLength
from ..model.moments import Moments
from ..parallel.ranks import allreduce
from ..scene.network import Network
from ..scene.settings import ramp_of
from ..solver.vector_ops import smallest, together, widening, work
from .after_ramp import AFTER, after_ramp
from .series import mean_over_time

if TYPE_CHECKING:
    import xarray as xr

    from ..model.problem import Problem
    from ..scene import Scene
    from .observe import Observer


class Bending:
    """Bending of the cables of a Problem.

    values (cable, 3), at the last `note`: moments at s = 0 and s = L [N m], largest curvature [1/m].  utilisation
    (cable,): largest product of curvature and local `minimum_bend_radius`, 0 without one; limited: True if any line has
    one.
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
        #: 1/EI at the nodes of this rank, 0 for lines without bending stiffness.
        self.per_moment, self._radius = (1 / stiffness)[lines.line_of_node[owned]], radius[lines.line_of_node[owned]]
        cable = np.array([piece.cable for piece in network.pieces])[lines.line_of_node[owned]]
        #: This rank's nodes sorted by cable, the cables that have any, and their first indices.
        self._by_cable = np.argsort(cable, kind="stable")
        self._cables, self._begins = np.unique(cable[self._by_cable], return_index=True)
        s = lines.node_s[owned]
        order = np.lexsort((s, lines.line_of_node[owned]))
        self.moments = Moments(problem)
        self._measure = together(*self.moments.works)
        self._ends = []  #: (cable, column, node) of the ends owned by this rank
        for cable in range(len(network.cables)):
            for column, (k, end) in enumerate(((network.first_of(cable), 0), (network.last_of(cable), 1))):
                mine = order[lines.line_of_node[owned][order] == k]
                if lines.owns_end(k, end) and len(mine):
                    self._ends.append((cable, column, mine[-end]))

    def _sizes(self) -> NDArray[Any]:
        """Bending moments at the nodes of this rank [N m]."""
        self._measure()
        found = np.zeros(len(self.moments.bent))
        found[self.moments.bent] = self.moments.sizes
        return found

    def curvatures(self) -> NDArray[Any]:
        """Curvature at the nodes of this rank [1/m]."""
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
        """Update from the present unknowns; collective."""
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
    """Grounded parts of the cables of a Problem, at the last call of its `notes`.

    rows: length on the bed, and touchdown point of the uppermost grounded piece, (cable, 4) [m].  moments: bending
    moments there (cable,) [N m].
    """

    def __init__(self, problem: Problem, bending: Bending | None) -> None:
        network, self._problem, self._bending = problem.network, problem, bending
        cables = range(len(network.cables))
        self.rows, self.moments = np.zeros((len(cables), 4)), np.zeros(len(cables))
        self._pieces = np.zeros((len(network.pieces), GroundedLength.SIZE))
        self._firsts = np.array([*map(network.first_of, cables), len(network.pieces)], np.int32)
        self._last = np.zeros(len(cables), np.int32)  # piece of each with the touchdown point

    def notes(self) -> Iterator[Callable[[], object]]:
        """Functions that update it, in order."""
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


class Extremes:
    """Least and largest values of all unknowns of the lines of a Problem, over all noted instants.

    kept: (during the ramp, after it) x (least, largest) x unknowns of this rank, followed by the nodal moments of lines
    that bend; +-inf while there is none.
    The tension of an element is taken at its nodes of T, which include both ends, or is constant if of degree 0.
    """

    def __init__(self, problem: Problem) -> None:
        self._lines = problem.lines
        part: Any = problem.lines.part if problem.lines else None
        unknowns = problem.system.u[part.slice if part else slice(0)]
        self._ramp = ramp_of(problem.scene) * AFTER
        bending, n = Bending(problem) if problem.network.bends else None, len(unknowns)
        self._bent = bending.moments.bent if bending else np.zeros(0, bool)
        sizes = bending.moments.sizes if bending else np.zeros(0)
        self._per_moment = bending.per_moment if bending else np.zeros(0)
        self.kept = np.empty((2, 2, n + len(sizes)))
        self.kept[:, 0], self.kept[:, 1] = np.inf, -np.inf
        measure = bending.moments.works if bending else []
        self._until, self._after = (
            together(widening(unknowns, *rows[:, :n]), *measure, widening(sizes, *rows[:, n:])) for rows in self.kept
        )

    def note(self, t: float) -> None:
        """Update from the present unknowns, at time t."""
        (self._after if t >= self._ramp else self._until)()

    def restore(self, kept: ArrayLike) -> None:
        """Restore extremes from a checkpoint.  Raises InputError if they do not match the unknowns."""
        kept = np.asarray(kept)
        if kept.shape != self.kept.shape or kept.dtype != self.kept.dtype:
            raise InputError("The extremes in the checkpoint are not of this scene: the run can only begin anew.")
        self.kept[:] = kept

    def values(self, observer: Observer) -> dict[str, NDArray[Any]]:
        """Extremes along the lines by their names in a record, on rank 0; collective.

        Those after the ramp are included if there is a ramp and it is over.
        """
        lines = self._lines
        if lines is None:
            return {}
        places = lines.node_dofs[: lines.owned_nodes]
        whole = self.kept[:, 0].min(axis=0), self.kept[:, 1].max(axis=0)
        cells = {
            f"cable_tension_{name}{ending}": getattr(rows[lines.T_dofs], fold)(axis=1)
            for ending, of_span in (("", whole), ("_after_ramp", self.kept[1]))
            for (name, fold), rows in zip((("minimum", "min"), ("maximum", "max")), of_span, strict=True)
        }
        loads = np.array([piece.section.breaking_load or np.nan for piece in lines.pieces])
        if np.isfinite(loads).any():
            cells["cable_utilisation_maximum"] = cells["cable_tension_maximum"] / loads[lines.line_of_cell]
        nodes = {"cable_position_minimum": whole[0][places], "cable_position_maximum": whole[1][places]}
        if len(self._bent):
            for ending, of_span in (("", whole), ("_after_ramp", self.kept[1])):
                nodes[f"curvature_maximum{ending}"] = largest = np.zeros(len(self._bent))
                largest[self._bent] = of_span[1][-self._bent.sum() :]
                largest *= self._per_moment
        found = observer.along(nodes, cells)
        return {
            name: values
            for name, values in found.items()
            if not name.endswith("_after_ramp") or (self._ramp > 0 and np.isfinite(values).all())
        }


class Envelope(NamedTuple):
    """Tension of each element of a cable after the ramp [N]: extremes over all steps, mean over recorded frames."""

    least: NDArray[Any]
    mean: NDArray[Any]
    largest: NDArray[Any]
    begin: float
    end: float
    frames: int


def envelope_of(record: xr.Dataset, scene: Scene) -> Envelope:
    """Envelope of the record of one cable.  Raises TooShort if there are fewer than two frames after the ramp."""
    frames = record.frame.values
    rows = after_ramp(frames, scene, 2, "envelope of the tension")
    mean = mean_over_time(frames[rows], record.cable_tension.values[rows])
    least, largest = (
        record.get(f"cable_tension_{name}_after_ramp", record[f"cable_tension_{name}"]).values
        for name in ("minimum", "maximum")
    )
    begin = record.time.values[after_ramp(record.time.values, scene, 1, "envelope of the tension")[0]]
    return Envelope(least, mean, largest, float(begin), float(frames[-1]), len(rows))


class Smallest:
    """Smallest tension of each cable of a Problem, over the nodes of T as in Extremes [N].

    values (cable,): at the last `note`, on rank 0; infinite for a cable without elements.
    """

    def __init__(self, problem: Problem) -> None:
        lines: Any = problem.lines
        self._comm, self.values = problem.comm, np.zeros(len(problem.network.cables))
        cable = np.array([piece.cable for piece in problem.network.pieces])[lines.line_of_cell]
        own = [lines.T_dofs[cable == k] for k in range(len(self.values))]
        self._find = smallest(problem.system.u, own, math.inf, self.values)

    @property
    def note(self) -> Callable[[], object]:
        """Function that updates the values; collective."""
        return self._find if self._comm.size == 1 else self._of_all_ranks

    def _of_all_ranks(self) -> None:
        self._find()
        self._comm.Reduce(self.values.copy(), self.values, op=MPI.MIN)


def minimum(record: xr.Dataset, name: str) -> NDArray[Any]:
    """Least `cable_tension` or `cable_position` over all steps of a run; for an equilibrium, the value itself."""
    kept = f"{name}_minimum"
    return record[kept].values if kept in record else record[name].min("frame").values


def maximum(record: xr.Dataset, name: str) -> NDArray[Any]:
    """Largest value, as `minimum`."""
    kept = f"{name}_maximum"
    return record[kept].values if kept in record else record[name].max("frame").values


def stressed(network: Network) -> dict[str, int]:
    """Name -> number of every piece with a breaking load."""
    pieces = enumerate(network.pieces)
    return {network.name_of(k): k for k, piece in pieces if piece.section.breaking_load is not None}


class Utilisation:
    """Utilisation of the pieces of a Problem with a breaking load; `values` at the last `note`, on rank 0.

    The largest tension of a piece is that at its nodes of T, which include both ends of every element.  Tensions of
    degree 0 hold at the middle of elements, and miss half an element's weight at the end of a piece.  They are
    extrapolated linearly to the ends from the last two elements; for a piece of a single element, half its weight is
    added at both ends.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, numbers = problem, list(stressed(problem.network).values())
        lines: Any = problem.lines
        self.values = np.zeros(len(numbers))
        self._loads = np.array([problem.network.pieces[k].section.breaking_load for k in numbers])
        cells = [np.flatnonzero(lines.line_of_cell == k) for k in numbers]
        self._mine = np.flatnonzero([len(found) for found in cells])  # others may be on other ranks
        dofs = [lines.T_dofs[cells[i]].ravel() for i in self._mine]
        self._dofs = np.concatenate([np.zeros(0, dtype=int), *dofs])
        self._firsts = np.cumsum([0, *map(len, dofs)])[:-1]
        self._ends = None
        if any(problem.network.pieces[k].section.tension_degree == 0 for k in numbers):
            self._ends = _Ends(problem, numbers, cells)

    def note(self) -> None:
        """Update from the present unknowns; collective."""
        u, comm, found = self.problem.system.u, self.problem.comm, np.full(len(self.values), -np.inf)
        if len(self._mine):
            found[self._mine] = np.maximum.reduceat(u[self._dofs], self._firsts)
        if comm.size > 1:
            comm.Reduce(found.copy(), found, op=MPI.MAX)
        if self._ends is not None:
            found = np.maximum(found, self._ends.largest(u))
        self.values[:] = found / self._loads


class _Ends:
    """Tensions of degree 0 at both ends of pieces, from the two nearest elements; -inf for other pieces."""

    def __init__(self, problem: Problem, numbers: list[int], cells: list[NDArray[Any]]) -> None:
        self.comm = problem.comm
        lines: Any = problem.lines
        self._size, self._weight, entries = 2 * len(numbers), np.zeros(2 * len(numbers)), []
        for i, (k, mine) in enumerate(zip(numbers, cells, strict=True)):
            if problem.network.pieces[k].section.tension_degree:
                self._weight[2 * i : 2 * i + 2] = -np.inf
                continue
            middles, sizes = lines.cell_ends[mine].mean(axis=1), np.diff(lines.cell_ends[mine], axis=1)[:, 0]
            order = np.argsort(middles)  # (middle, length) -> dof of T of the two elements nearest to either end
            nearest = (*order[:2], *order[-2:])
            own = {(float(middles[c]), float(sizes[c])): lines.T_dofs[mine[c], 0] for c in nearest}
            every = sorted({place for places in self.comm.allgather(list(own)) for place in places})
            for end, ((s, size), (other, _)) in enumerate((every[:2] * 2)[:2] for every in (every, every[::-1])):
                beyond = size / 2 / abs(other - s) if other != s else 0.0
                self._weight[2 * i + end] = abs(lines.weight_of(k)) * size / 2 if other == s else 0.0
                shares = {s: 1 + beyond} | ({other: -beyond} if beyond else {})
                entries += [(2 * i + end, dof, shares[at]) for (at, _), dof in own.items() if at in shares]
        row, dof, self._factor = np.array(entries, dtype=float).reshape(-1, 3).T
        self._row, self._dof = row.astype(int), dof.astype(int)

    def largest(self, u: NDArray[Any]) -> NDArray[Any]:
        """Larger tension of the two ends of each piece [N]; collective, on rank 0."""
        found = np.bincount(self._row, u[self._dof] * self._factor, self._size)
        if self.comm.size > 1:
            self.comm.Reduce(found.copy(), found)
        return np.asarray((found + self._weight).reshape(-1, 2).max(axis=1))


def rows_of(record: xr.Dataset) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of the largest utilisation of each segment in the record of one cable."""
    what = "largest tension over breaking load"
    return [(f"{what}, {name}" if name else what, f"{x:.4g}", "") for name, x in _largest(record)]


def warnings_of(record: xr.Dataset, parts: bool) -> list[str]:
    """A warning about a cable above its breaking load; parts: True if the scene lets it part (`fails_at`)."""
    above = [f"{x:.3g} times" + (f" ({name})" if name else "") for name, x in _largest(record) if x > 1]
    if not above:
        return []
    kept = "" if parts else "; here it does not part, see cable.fails_at"
    return [f"The tension of the cable is above its breaking load: {', '.join(above)}{kept}."]


def never_parted(scene: Scene) -> list[str]:
    """A warning about each cable set to part at a time after the end of the run."""
    network, end = scene.network, scene.time.end if scene.time else math.inf
    rules = [(piece.cable, piece.section.fails_at) for piece in network.pieces if piece.section.fails_at]
    late = {(cable, rule.time) for cable, rule in rules if rule.time is not None and rule.time > end}
    return [
        f"{network.key_of(cable)}.fails_at.time = {time:g}: is after the end of the run at {end:g} s, so that nothing "
        "parts; give an earlier time or a later time.end."
        for cable, time in sorted(late)
    ]


def _largest(record: xr.Dataset) -> list[tuple[str, float]]:
    """[(segment in words, empty for the whole cable; largest T/breaking load), ...]."""
    if "utilisation" not in record:
        return []
    named = [(name.item().partition(".")[2], record.utilisation.sel(segment=name)) for name in record.segment]
    return [(number and f"segment {number}", float(values.max())) for number, values in named]
