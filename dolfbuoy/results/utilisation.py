"""How near lines come to breaking: the largest tension of a segment over the breaking load of its material."""

import numpy as np
from mpi4py import MPI

from ..scene.network import Network


def stressed(network: Network) -> dict[str, int]:
    """Name -> number of every piece that has a breaking load."""
    pieces = enumerate(network.pieces)
    return {network.name_of(k): k for k, piece in pieces if piece.section.breaking_load is not None}


class Utilisation:
    """Of the pieces of a Problem that have a breaking load; `values` as of the last `note`, on rank 0."""

    def __init__(self, problem):
        self.problem, numbers = problem, list(stressed(problem.network).values())
        lines, self.values = problem.lines, np.zeros(len(numbers))
        self._loads = np.array([problem.network.pieces[k].section.breaking_load for k in numbers])
        cells = [np.flatnonzero(lines.line_of_cell == k) for k in numbers]
        self._mine = np.flatnonzero([len(found) for found in cells])  # some may be on other ranks
        dofs = [lines.T_dofs[cells[i]].ravel() for i in self._mine]
        self._dofs = np.concatenate([np.zeros(0, dtype=int), *dofs])
        self._firsts = np.cumsum([0, *map(len, dofs)])[:-1]

    def note(self):
        """Collective."""
        found = np.full(len(self.values), -np.inf)
        if len(self._mine):
            found[self._mine] = np.maximum.reduceat(self.problem.system.u[self._dofs], self._firsts)
        found /= self._loads
        if self.problem.comm.size > 1:
            self.problem.comm.Reduce(found.copy(), found, op=MPI.MAX)
        self.values[:] = found


def rows_of(record) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of the record of one cable: the largest of each segment."""
    what = "largest tension over breaking load"
    return [(f"{what}, {name}" if name else what, f"{x:.4g}", "") for name, x in _largest(record)]


def warnings_of(record, parts: bool) -> list[str]:
    """A sentence about a cable that would have broken; parts: whether the scene lets it (`fails_at`)."""
    above = [f"{x:.3g} times" + (f" ({name})" if name else "") for name, x in _largest(record) if x > 1]
    if not above:
        return []
    kept = "" if parts else "; here it does not part, see cable.fails_at"
    return [f"The tension of the cable is above its breaking load: {', '.join(above)}{kept}."]


def _largest(record):
    """[(segment of the cable in words, empty if it is the whole, largest T/breaking load), ...]."""
    if "utilisation" not in record:
        return []
    found = record.utilisation
    if "segment" not in found.dims:
        return [("", float(found.max()))]
    numbers = [name.partition(".")[2] for name in found.segment.values]
    most = found.transpose("segment", ...).values.reshape(len(numbers), -1).max(axis=1)
    return [(number and f"segment {number}", float(x)) for number, x in zip(numbers, most, strict=True)]
