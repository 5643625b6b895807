"""Grounded length of cables, and where they leave the bed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.grounding import GroundedLength
from ..solver.vector_ops import work

if TYPE_CHECKING:
    from ..model.problem import Problem
    from .bending import Bending


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
