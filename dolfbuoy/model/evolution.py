"""What a model tells time stepping about its unknowns."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..solver.unknowns import Part


@dataclass
class Evolution:
    """Unknowns whose rates stand in the forms.

    rates: of each time derivative, from the first on, the constant gamma and the Function history of
    rate = gamma x unknown + history.  lagged: which unknowns are themselves rates that the scheme makes (momenta), a
    mask or a bool.  sizes: typical size of the unknowns, and of every derivative but the last, for relative errors; inf
    for those that do not count.
    """

    part: Part
    rates: list[tuple[Any, Any]]
    lagged: np.ndarray | bool
    sizes: list[np.ndarray]

    @property
    def order(self) -> int:
        """In time."""
        return len(self.rates)

    @property
    def size(self) -> int:
        """Number of entries."""
        return self.part.size

    def values(self, u) -> np.ndarray:
        """The unknowns among all local unknowns, a view."""
        return u[self.part.slice]

    def reader(self, u, out):
        """What puts them into the array `out`: it and the view to be copied there, or a function; u stays in place."""
        return out, self.values(u)

    def hand_out(self, level, gamma, history):
        """Give the forms the rule of a derivative (0: the first)."""
        constant, function = self.rates[level]
        constant.value = gamma
        function.x.array[:] = history
