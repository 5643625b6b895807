"""Winches: pieces of line whose unstretched length is a function of time.

A piece, such as the part of a line next to a drum, is lengthened or shortened uniformly: its elements keep their
relative positions, and line paid out has the velocity of the line there.  The forms are unchanged: they are integrals
over elements, whose lengths on the mesh vary with time.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from dolfinx import fem

from ..forms import cable as form
from ..solver import compat
from . import Array
from .line_energy import elastic_energies

if TYPE_CHECKING:
    from .lines import Lines


def path_of(rows: Sequence[Any]) -> Any:
    """Length [m] over time through rows [t, length]: monotone piecewise cubic, at rest before the first and after the
    last row."""
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    t, length = np.array(rows).T
    slope = PchipInterpolator(t, length).derivative()(t)
    slope[[0, -1]] = 0.0
    path = CubicHermiteSpline(t, length, slope)
    return lambda time: path(np.clip(time, t[0], t[-1]))


class Winch:
    """The pieces of some Lines with varying length, on the owned cells of their mesh.

    driven: number of a piece -> its length [m] as a function of time, overriding the scene's rows.
    """

    #: Time interval for numerical differentiation of a rate [s].
    INSTANT = 1e-4

    def __init__(self, lines: "Lines"):
        self.lines = lines
        self.driven: dict[int, Callable[[float], float]] = {}
        self._given = compat.cell_coordinates(lines.mesh).copy()
        self._now = self._given.copy()
        self._rate: Any = None

    def follow(self, system: Any) -> None:
        """Provide the lengths to the forms of a System."""
        self._now = system.shared.coordinates(self.lines.mesh)

    def _paths(self) -> list[tuple[int, Any]]:
        rows = {k: c.winch for k, c in enumerate(self.lines.sections) if c.winch is not None and k not in self.driven}
        return [*self.driven.items(), *((k, path_of(one)) for k, one in rows.items())]

    def clock(self, time: Array) -> list[Callable[[], Any]]:
        """Functions that set the lengths of the pieces at time[0]."""
        lines, found = self.lines, []
        for number, path in self._paths():
            cells, begin = lines.cells_of[number], lines.begins[number]
            length = lines.sections[number].length

            def wind(cells: Array = cells, begin: float = begin, length: float = length, path: Any = path) -> None:
                share = float(np.ravel(path(time.item()))[0]) / length
                for vertex in (0, 3):
                    self._now[cells, vertex] = begin + share * (self._given[cells, vertex] - begin)

            found.append(wind)
        return found

    def length_of(self, number: int) -> float:
        """Unstretched length of this rank's elements of a piece [m]."""
        ends = self._now[self.lines.cells_of[number]]
        return float(np.sum(ends[:, 3] - ends[:, 0]))

    def publish(self, time: float) -> None:
        """Update the lengths of the mesh itself, and their rates at a time, for forms that no System evaluates."""
        compat.move_vertices(self.lines.mesh, self._now)
        if self._rate is None:
            return
        values, dofs = self._rate.x.array, compat.cell_dofs(self._rate.function_space)[:, 0]
        values[:] = 0.0
        for number, path in self._paths():
            ends = [float(np.ravel(path(time + side * self.INSTANT))[0]) for side in (-0.5, 0.0, 0.5)]
            values[dofs[self.lines.cells_of[number]]] = (ends[2] - ends[0]) / self.INSTANT / ends[1]

    def power(self) -> Any:
        """Power fed into the line by winches, per unstretched length [W/m], as UFL."""
        lines = self.lines
        if self._rate is None:
            self._rate = fem.Function(compat.function_space(lines.mesh, compat.element(lines.mesh, "DG", 0)))
        r, T, e, r_t, _ = lines.kinematics()
        content = 0.5 * lines.cable.line_density * ufl.inner(r_t, r_t)
        content += sum(elastic_energies(lines)) - ufl.inner(lines.weight()[0], r)
        return self._rate * (content - form.stretched(lines.cable, e, T))
