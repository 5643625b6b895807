"""Lines on the sea bed: contact at their quadrature points, and grounded length."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from dolfinx import fem

from ..scene.cable import Cable
from ..solver import compat
from ..solver.vector_ops import work
from .contact import ContactParameters, hardness, has_friction, parameters_of_line
from .seabed import Bed

if TYPE_CHECKING:
    from .lines import Lines


class GroundedLength(NamedTuple):
    """Grounded part of a line."""

    length: float  #: unstretched [m]
    s: float  #: arc length at which it leaves the bed towards s = L [m]; -inf if nothing lies
    touchdown: np.ndarray  #: that point [m]; nan if nothing lies
    sag: float  #: deepest penetration [m]
    first: float  #: arc length at which it leaves the bed towards s = 0 [m]; inf if nothing lies
    foot: np.ndarray  #: that point [m]; nan if nothing lies

    SIZE = 10  #: numbers

    @classmethod
    def of(cls, row: np.ndarray) -> "GroundedLength":
        """Grounded length from these numbers in a row, the layout of the core."""
        return cls(float(row[0]), float(row[1]), row[2:5], float(row[5]), float(row[6]), row[7:10])


class Points:
    """Quadrature points of a degree in the owned cells of lines; with_nodes: together with the nodes, in order.

    nodes: those of each cell.  s: mesh coordinates, shape (cells, points).  line: number of the line of each cell.
    presses: mask of the quadrature points, shape (points,).
    """

    def __init__(self, lines: "Lines", positions: fem.FunctionSpace, degree: int, with_nodes: bool = False):
        self.nodes = compat.cell_dofs(positions)
        ends = lines.node_s[self.nodes]  # the first two nodes of a cell are its ends
        first, size = ends[:, :1], ends[:, 1:2] - ends[:, :1]
        nodes, (xi, _) = (ends[0] - first[0]) / size[0], compat.interval_quadrature(degree)
        self.presses = np.ones(len(xi), bool)
        if with_nodes:
            xi = np.concatenate([nodes, xi])
            order = np.argsort(xi)
            xi, self.presses = xi[order], order >= len(nodes)
        self.s, self.line = first + xi * size, lines.line_of_cell
        power = np.arange(ends.shape[1])
        coefficients = np.linalg.inv(nodes[:, None] ** power)
        self._basis = xi[:, None] ** power @ coefficients
        self._slopes = power[1:] * xi[:, None] ** power[:-1] @ coefficients[1:]

    def of(self, values: np.ndarray) -> np.ndarray:
        """Values at the points of all cells, shape (cells, points, 3), from nodal values (n, 3)."""
        return self._basis @ values[self.nodes]

    def in_c(self, dofs: np.ndarray, slopes: bool = False) -> dict[str, Any]:
        """The points for the core; dofs: places of the nodal values, (cells, nodes, 3).  slopes: for derivatives on the
        reference cell instead of values."""
        cells, nodes, _ = dofs.shape
        return {
            "cells": cells,
            "points": len(self._basis),
            "nodes": nodes,
            "basis": self._slopes if slopes else self._basis,
            "dofs": np.ascontiguousarray(dofs, dtype=np.int32),
        }


class Seabed(Bed):
    """Contact of `Lines` with the bed at their quadrature points."""

    def __init__(self, lines: "Lines"):
        positions, degree = lines.positions, lines.dx.metadata()["quadrature_degree"]
        needs = has_friction(lines.scene, lines.dynamic) or lines.scene.seabed.depths is not None
        self.points = Points(lines, positions, degree) if needs else None

        def space():
            return compat.function_space(lines.mesh, compat.quadrature_element(lines.mesh, degree, 3))

        super().__init__(lines, space)
        if self.held is not None:
            self._place = 3 * compat.cell_dofs(self.held.function_space)[..., None] + np.arange(3)
        self.soundings = Points(lines, positions, degree, with_nodes=True)
        #: Cells of each line, ordered from its start.
        self._along = [cells[np.argsort(self.soundings.s[cells, 0])] for cells in lines.cells_of]

    def parameters_of(self, section: Cable) -> ContactParameters:
        scene = self.model.scene
        return parameters_of_line(scene, section, self._of_scene(self._of_lines)[0])

    def _of_lines(self):
        """(hardness of the bed, contact parameters of every cell)."""
        scene = self.model.scene
        hard = hardness(scene, [piece.section for piece in scene.network.pieces])
        values = np.array([parameters_of_line(scene, section, hard) for section in self.model.sections])
        return hard, values[self.model.line_of_cell].T[:, :, None]

    def parameter_values(self) -> np.ndarray:
        """Contact parameters of every cell, arrays (cells, 1)."""
        return self._of_scene(self._of_lines)[1]

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        lines, degree = self.model, self.model.dx.metadata()["quadrature_degree"]
        space = compat.function_space(lines.mesh, compat.quadrature_element(lines.mesh, degree, size))
        return space, size * compat.cell_dofs(space)[..., None] + np.arange(size)

    def at(self, values: np.ndarray) -> np.ndarray:
        return self.points.of(values[self.model.node_dofs])

    def when_accepted(self, u: np.ndarray) -> list[Callable]:
        if self.held is None or self.ground is not None:
            return super().when_accepted(u)
        model, names = self.model, ("stiffness", "damping", "sag", "stick")
        fields = {name: np.ravel(values) for name, values in zip(names, self.parameter_values(), strict=True)}
        if model.dynamic:
            fields |= {"gamma": model.gamma_v.value, "history": model.history_v.x.array}
        fields |= {
            "at": self.points.in_c(model.node_dofs[self.points.nodes]),
            "plane": self._plane(),
            "u": u[model.part.slice],
            "coefficient": self.friction.value,
            "holds": self.held.x.array,
            "places": self._place.astype(np.int32),
        }
        return [work("drag_along", "friction", fields)]

    def _plane(self):
        return {"normal": self.normal.value, "level": self.level.value}

    # -- numbers -------------------------------------------------------------------------------------------------------

    def grounded(self, u: np.ndarray, line: int = 0) -> GroundedLength:
        """Grounded length of a line, on every rank.

        The line is taken as grounded between two touching quadrature points of the same or neighbouring elements: any
        rise between them is an artefact of the element.  Elsewhere the gap is interpolated between soundings by a
        parabola, for lines of degree 1 linearly.
        """
        row = np.zeros(GroundedLength.SIZE)
        self.lying(u, row, line)()
        return GroundedLength.of(row)

    def lying(self, u: np.ndarray, out: np.ndarray, line: int) -> Callable[[], object]:
        """Function that writes the numbers of `GroundedLength` of a line to `out`."""
        if self.ground is not None or self.model.comm.size > 1:
            return lambda: self._sound(u, out, line)
        cells, at = self._along[line], self.soundings
        dofs = self.model.node_dofs[at.nodes[cells]]
        return self._judge(at.s[cells], line, out, {"u": u[self.model.part.slice], "dofs": dofs})

    def _judge(self, s, line, out, given):
        """Function of `lying`; s: (cells, points).  given: u and dofs, or gaps and places."""
        dofs = given.pop("dofs", np.zeros((len(s), self.soundings.nodes.shape[1], 3)))
        fields = {
            "at": self.soundings.in_c(dofs),
            "plane": self._plane(),
            "s": s,
            "presses": self.soundings.presses,
            "begin": float(self.model.begins[line]),
            "gaps": np.zeros(s.size),
            "places": np.zeros(3 * s.size),
            "bridged": np.zeros(s.size, bool),
        }
        return work("find_lying", "lying", fields | {"out": out} | given)

    def _sound(self, u, out, line):
        """The same on several ranks, and for an uneven bed."""
        cells, at = self._along[line], self.soundings
        places = at.of(u[self.model.part.slice][self.model.node_dofs])[cells]
        every = zip(*self.model.comm.allgather((at.s[cells], self.gap(places), places)), strict=True)
        s, gaps, places = (np.concatenate(part) for part in every)
        order = np.argsort(s[:, 0])
        self._judge(s[order], line, out, {"gaps": gaps[order], "places": places[order]})()
