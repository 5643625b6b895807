"""Line failure: an element that no longer carries tension.

In the parted element the strain equation is replaced by T = 0.  Its mass, weight and drag remain, each node's share
moving with the node; nothing else changes in the problem, neither unknowns nor ties.
"""

from typing import TYPE_CHECKING

import numpy as np
from dolfinx import fem

from ..elsewhere import MPI
from ..forms.kinds import Expr
from ..parallel.ranks import allreduce
from ..solver import compat

if TYPE_CHECKING:
    from .lines import Lines


class Parting:
    """Parted elements of `Lines`, and the criteria for others to part.

    memory: 0 for each intact element, 1 for a parted one, and the time of parting [s], as of the last accepted
    step.
    """

    def __init__(self, lines: "Lines"):
        self.lines = lines
        self.parted = fem.Function(compat.function_space(lines.mesh, compat.element(lines.mesh, "DG", 0)))
        self.memory = {"parted_elements": self.parted.x.array, "parted_at": np.zeros_like(self.parted.x.array)}
        self._dofs = compat.cell_dofs(self.parted.function_space)[: len(lines.line_of_cell), 0]
        self._weight = lines.constants.constant(lambda *_: lines.longest * max(c.line_density for c in lines.sections))

    @property
    def of_elements(self) -> np.ndarray:
        """Times at which this rank's elements parted [s], in their order; nan for intact ones."""
        return np.where(self.parted.x.array > 0, self.memory["parted_at"], np.nan)[self._dofs]

    def strain_equation(self, equation: Expr, T: Expr, q: Expr) -> Expr:
        """The strain equation for intact elements, and T = 0, scaled to a strain, for parted ones."""
        return (1 - self.parted) * equation + self.parted * (T / self._weight) * q

    def accept(self, u: np.ndarray, t: float) -> bool:
        """Part the lines that reached their time or tension in an accepted step; True if any has parted."""
        rules = {}  # by cable: a rule common to all its segments applies once
        for k, piece in enumerate(self.lines.pieces):
            if piece.section.fails_at is not None:
                rules.setdefault((piece.cable, piece.section.fails_at), []).append(k)
        found = [self._part(pieces, rule, u, t) for (_, rule), pieces in rules.items()]
        if not any(found):
            return False
        self.parted.x.scatter_forward()
        return True

    def _part(self, pieces, rule, u, t):
        """Part one element of consecutive pieces, once only."""
        mine = np.isin(self.lines.line_of_cell, pieces)
        parted = self.parted.x.array[self._dofs[mine]].max(initial=0.0)
        if allreduce(self.lines.comm, float(parted), MPI.MAX):
            return False
        weakest = self._at(pieces, rule.at) if rule.tension is None else self._above(rule.tension, u, mine)
        if rule.tension is None and t < rule.time * (1 - 1e-12):
            return False
        self.parted.x.array[self._dofs[weakest]], self.memory["parted_at"][self._dofs[weakest]] = 1.0, t
        return allreduce(self.lines.comm, bool(weakest.any()), MPI.LOR)

    def _at(self, pieces, at):
        """Mask of the element at an arc length along the pieces; None: at the upper end."""
        ends = np.cumsum([self.lines.sections[k].length for k in pieces])
        s, slip = ends[-1] if at is None else min(at, ends[-1]), 1e-9 * ends[-1]
        number = int(np.searchsorted(ends, s - slip))
        line = pieces[number]
        mine, begin = self.lines.line_of_cell == line, self.lines.begins[line]
        s += begin - (ends[number - 1] if number else 0.0)
        low, high = self.lines.cell_ends[: len(mine)].T
        return mine & (low < max(s, begin + 2 * slip) - slip) & (s - slip <= high)

    def _above(self, tension, u, mine):
        """Mask of the element with the largest tension, if that is above `tension`."""
        u = u[self.lines.part.slice]
        T = np.where(mine, u[self.lines.T_dofs[: len(mine)]].max(axis=1), -np.inf)
        largest = allreduce(self.lines.comm, float(T.max(initial=-np.inf)), MPI.MAX)
        return mine & (largest == T) & (largest > tension)
