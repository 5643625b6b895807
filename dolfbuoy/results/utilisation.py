"""Utilisation of lines: the largest tension of a segment over the breaking load of its material."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..elsewhere import MPI
from ..scene.network import Network

if TYPE_CHECKING:
    import xarray as xr

    from ..model.problem import Problem
    from ..scene import Scene


def stressed(network: Network) -> dict[str, int]:
    """Name -> number of every piece that has a breaking load."""
    pieces = enumerate(network.pieces)
    return {network.name_of(k): k for k, piece in pieces if piece.section.breaking_load is not None}


class Utilisation:
    """Utilisation of the pieces of a Problem that have a breaking load; `values` as of the last `note`, on rank 0.

    The largest tension of a piece is that of the nodes of T, both ends of every element among them.  Tensions of degree
    0 are those of the middles of elements: at the ends of a piece, where most of it hangs, half an element's weight is
    missing there.  So at an end the tension goes on as from the middle of the last element but one to that of the last;
    at both ends of a piece that is one element, half its weight is added.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, numbers = problem, list(stressed(problem.network).values())
        lines: Any = problem.lines
        self.values = np.zeros(len(numbers))
        self._loads = np.array([problem.network.pieces[k].section.breaking_load for k in numbers])
        cells = [np.flatnonzero(lines.line_of_cell == k) for k in numbers]
        self._mine = np.flatnonzero([len(found) for found in cells])  # some may be on other ranks
        dofs = [lines.T_dofs[cells[i]].ravel() for i in self._mine]
        self._dofs = np.concatenate([np.zeros(0, dtype=int), *dofs])
        self._firsts = np.cumsum([0, *map(len, dofs)])[:-1]
        self._ends = None
        if any(problem.network.pieces[k].section.tension_degree == 0 for k in numbers):
            self._ends = _Ends(problem, numbers, cells)

    def note(self) -> None:
        """Collective."""
        u, comm, found = self.problem.system.u, self.problem.comm, np.full(len(self.values), -np.inf)
        if len(self._mine):
            found[self._mine] = np.maximum.reduceat(u[self._dofs], self._firsts)
        if comm.size > 1:
            comm.Reduce(found.copy(), found, op=MPI.MAX)
        if self._ends is not None:
            found = np.maximum(found, self._ends.largest(u))
        self.values[:] = found / self._loads


class _Ends:
    """Tensions of degree 0 at both ends of pieces, from the two elements that are next to each; -inf of others."""

    def __init__(self, problem: Problem, numbers: list[int], cells: list[NDArray[Any]]) -> None:
        self.comm = problem.comm
        lines: Any = problem.lines
        self._size, self._weight, entries = 2 * len(numbers), np.zeros(2 * len(numbers)), []
        for i, (k, mine) in enumerate(zip(numbers, cells, strict=True)):
            if problem.network.pieces[k].section.tension_degree:
                self._weight[2 * i : 2 * i + 2] = -np.inf
                continue
            own = _outermost(lines, mine)
            every = sorted({place for places in self.comm.allgather(list(own)) for place in places})
            for end, ((s, size), (other, _)) in enumerate((every[:2] * 2)[:2] for every in (every, every[::-1])):
                beyond = size / 2 / abs(other - s) if other != s else 0.0
                self._weight[2 * i + end] = abs(lines.weight_of(k)) * size / 2 if other == s else 0.0
                shares = {s: 1 + beyond} | ({other: -beyond} if beyond else {})
                entries += [(2 * i + end, dof, shares[at]) for (at, _), dof in own.items() if at in shares]
        row, dof, self._factor = np.array(entries, dtype=float).reshape(-1, 3).T
        self._row, self._dof = row.astype(int), dof.astype(int)

    def largest(self, u: NDArray[Any]) -> NDArray[Any]:
        """Tension at both ends of each piece [N]; collective, on rank 0."""
        found = np.bincount(self._row, u[self._dof] * self._factor, self._size)
        if self.comm.size > 1:
            self.comm.Reduce(found.copy(), found)
        return np.asarray((found + self._weight).reshape(-1, 2).max(axis=1))


def _outermost(lines: Any, cells: NDArray[Any]) -> dict[tuple[float, float], int]:
    """(middle, length) -> dof of T of the two elements that are nearest to either end, of these."""
    middles, sizes = lines.cell_ends[cells].mean(axis=1), np.diff(lines.cell_ends[cells], axis=1)[:, 0]
    order = np.argsort(middles)
    return {(float(middles[c]), float(sizes[c])): lines.T_dofs[cells[c], 0] for c in (*order[:2], *order[-2:])}


def rows_of(record: xr.Dataset) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of the record of one cable: the largest of each segment."""
    what = "largest tension over breaking load"
    return [(f"{what}, {name}" if name else what, f"{x:.4g}", "") for name, x in _largest(record)]


def warnings_of(record: xr.Dataset, parts: bool) -> list[str]:
    """A sentence about a cable that would have broken; parts: whether the scene lets it (`fails_at`)."""
    above = [f"{x:.3g} times" + (f" ({name})" if name else "") for name, x in _largest(record) if x > 1]
    if not above:
        return []
    kept = "" if parts else "; here it does not part, see cable.fails_at"
    return [f"The tension of the cable is above its breaking load: {', '.join(above)}{kept}."]


def never_parted(scene: Scene) -> list[str]:
    """A sentence about each cable that parts at a time only, and that after the end of the run."""
    network, end = scene.network, scene.time.end if scene.time else math.inf
    rules = [(piece.cable, piece.section.fails_at) for piece in network.pieces if piece.section.fails_at]
    late = {(cable, rule.time) for cable, rule in rules if rule.time is not None and rule.time > end}
    return [
        f"{network.key_of(cable)}.fails_at.time = {time:g}: is after the end of the run at {end:g} s, so that nothing "
        "parts; give an earlier time or a later time.end."
        for cable, time in sorted(late)
    ]


def _largest(record: xr.Dataset) -> list[tuple[str, float]]:
    """[(segment of the cable in words, empty if it is the whole, largest T/breaking load), ...]."""
    if "utilisation" not in record:
        return []
    named = [(name.item().partition(".")[2], record.utilisation.sel(segment=name)) for name in record.segment]
    return [(number and f"segment {number}", float(values.max())) for number, values in named]
