"""Marine growth: its factors on diameter and mass of each element of the lines, depending on its depth.

A section [cable] has a table [[z, factor of the diameter, factor of the mass], ...], linear between its rows and
constant beyond them.  Growth is a property of the line, not of the water: each element takes the mean of the table
between the heights of its ends at the start of a run and keeps it.  In statics these heights are those of the
equilibrium being computed (`statics.growth`).
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from dolfinx import fem

from ..solver import compat
from .rigid import cross_section, weight_per_length

if TYPE_CHECKING:
    from .lines import Lines


class Growth:
    """Factors of each element of `Lines` as UFL, `diameter` and `mass`.  The area grows as the diameter squared.

    memory: the factors, which are part of the state of a run.
    """

    def __init__(self, lines: "Lines"):
        self.lines = lines
        space = compat.function_space(lines.mesh, compat.element(lines.mesh, "DG", 0))
        self.diameter, self.mass = fem.Function(space), fem.Function(space)
        self.memory = {"growth_diameter": self.diameter.x.array, "growth_mass": self.mass.x.array}
        self._dofs = compat.cell_dofs(space)[:, 0]
        nodes = compat.cell_dofs(lines.positions)[:, :2]  # the ends of a cell are its first nodes
        self._heights = lines.node_dofs[nodes][..., 2]

    @property
    def factors(self) -> np.ndarray:
        """(diameter, mass) of each owned element, shape (cells, 2)."""
        return np.column_stack([self.diameter.x.array[self._dofs], self.mass.x.array[self._dofs]])

    @factors.setter
    def factors(self, values: np.ndarray) -> None:
        for function, column in zip((self.diameter, self.mass), np.asarray(values).T, strict=True):
            function.x.array[self._dofs] = column
            function.x.scatter_forward()

    def at(self, u: np.ndarray) -> np.ndarray:
        """Factors for the positions in the local unknowns u."""
        return self._between(*np.sort(u[self.lines.part.slice][self._heights]).T)

    def of_the_water(self) -> np.ndarray:
        """Means over the water depth: a guess before any position is known."""
        none = np.zeros(len(self._dofs))
        return self._between(none - self.lines.scene.sea.depth, none)

    def _between(self, low, high):
        found = np.ones((len(low), 2))
        for line, section in enumerate(self.lines.sections):
            if section.marine_growth is not None:
                mine = self.lines.line_of_cell == line
                found[mine] = mean_factors(section.marine_growth, low[mine], high[mine])
        return found

    def begin(self, u: np.ndarray) -> None:
        """Set the factors from the initial positions of a run."""
        self.factors = self.at(u)

    @property
    def weights(self) -> np.ndarray:
        """Submerged weight of the growth on each owned element [N]."""
        scene, sections = self.lines.scene, self.lines.sections
        diameter, mass = self.factors.T
        rho_w, of_cell = scene.sea.density, self.lines.line_of_cell
        density = np.array([c.line_density for c in sections])[of_cell]
        area = np.array([cross_section(c) for c in sections])[of_cell]
        added = density * (mass - 1) - rho_w * area * (diameter**2 - 1)
        return scene.gravity * added * np.diff(self.lines.cell_ends)[:, 0]

    def weight_per_length(self, line: int) -> float:
        """Mean submerged weight of a line with its growth [N/m], on every rank."""
        section, mine = self.lines.sections[line], self.lines.line_of_cell == line
        added = self.lines.comm.allreduce(float(self.weights[mine].sum()))
        return weight_per_length(self.lines.scene, section) + added / section.length


def mean_factors(table: Sequence, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Means of the columns of a table [[z, ...], ...] over heights from `low` to `high`, arrays; shape (n, columns)."""
    z, *columns = np.array(table).T
    points = np.sort(np.column_stack([low, high, np.clip(z, low[:, None], high[:, None])]))
    steps, size = np.diff(points), (high - low)[:, None]
    shares = np.divide(steps, size, out=np.full_like(steps, 1 / steps.shape[1]), where=size > 0)
    means = []
    for values in (np.interp(points, z, column) for column in columns):
        means.append((shares * (values[:, 1:] + values[:, :-1]) / 2).sum(axis=1))
    return np.column_stack(means)
