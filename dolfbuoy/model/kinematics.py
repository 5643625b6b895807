"""Irregular waves at quadrature points: form coefficients that a hook in C fills (`forms.sea.Samples`).

The positions of the points depend on the unknowns.  Once per step, at the predicted state, all components are summed
there, with their spatial derivatives; the form extrapolates from there to the actual positions.  The error is of second
order in the error of the prediction.  With `waves.kinematics` = "exact" they are summed at every evaluation: residual
and Jacobian are then those of the waves themselves.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from dolfinx import fem

from ..forms.kinds import Expr
from ..forms.sea import LARGE, SMALL, Samples
from ..scene import Scene
from ..solver import compat
from ..solver.c_code import ALIGNED, address, aligned, core
from ..solver.system import System
from ..solver.unknowns import array_of
from .airy import AirySum

ON_LINE, ON_AXIS, ON_SURFACE = range(3)  #: location of points: on a line, on the axis of a hull, on the surface above C
PLAIN, MEAN, MOMENT = range(3)  #: weights of components over a disk
STRETCHINGS = "wheeler", "vertical", "none"


@dataclass(frozen=True)
class Points:
    """Points of a form on some cells, and the coefficient that receives the wave samples there.

    source: Function or array that holds positions, at its `places` (cells, nodes), on a line (cells, nodes, 3), with
    the interpolation matrix `shape` (points, nodes).  radius: place of the radius relative to the height.
    """

    kind: int
    coefficient: Any
    cells: np.ndarray
    shape: np.ndarray
    source: Any = None
    places: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), np.int32))
    radius: int = 0
    weight: int = PLAIN

    @property
    def size(self) -> int:
        """Number of values per point."""
        return self.coefficient.function_space.dofmap.bs


def on_line(mesh: Any, degree: int, source: fem.Function, nodes: tuple[np.ndarray, np.ndarray]) -> Points:
    """The quadrature points of a degree on all cells; nodes: dofs of `source` (cells, nodes, 3) and their mesh
    coordinates (cells, nodes)."""
    dofs, s = nodes
    found = fem.Function(compat.function_space(mesh, compat.quadrature_element(mesh, degree, SMALL)))
    at = compat.interval_quadrature(degree)[0]
    low, high = compat.cell_coordinates(mesh)[0, [0, 3]] if len(s) else (0.0, 1.0)  # first cell: all are alike
    shape = lagrange((s[0] - low) / (high - low), at) if len(s) else np.zeros((len(at), dofs.shape[1]))
    return Points(ON_LINE, found, np.arange(len(dofs)), shape, source, dofs)


def on_points(mesh: Any, source: fem.Function, dofs: np.ndarray) -> Points:
    """One point on each cell, whose position is an unknown; dofs: those of `source` (cells, 3)."""
    found = fem.Function(compat.function_space(mesh, compat.element(mesh, "DG", 0, SMALL)))
    return Points(ON_LINE, found, np.arange(len(dofs)), np.ones((1, 1)), source, dofs[:, None, :].astype(np.int32))


def on_axis(group: Any) -> Points:
    """The points of a `wet_hull.PointGroup`."""
    return on_cells(group.mesh, group.cells, group.coefficient, group.places, radius=1)


def on_cells(
    mesh: Any, cells: np.ndarray, source: Any = None, places: np.ndarray | None = None, radius: int = 0
) -> Points:
    """One point on each of some cells: on the axis, or without source on the surface above C."""
    found = fem.Function(compat.function_space(mesh, compat.element(mesh, "DG", 0, LARGE)))
    kind = ON_SURFACE if source is None else ON_AXIS
    places = np.zeros((len(cells), 1), np.int32) if places is None else places
    return Points(kind, found, np.asarray(cells), np.ones((1, 1)), source, places, radius)


def weighted(points: Points) -> list[Points]:
    """The same points three times: plain, and weighted over disks for means and for first moments."""
    space = points.coefficient.function_space
    return [points, *(replace(points, weight=weight, coefficient=fem.Function(space)) for weight in (MEAN, MOMENT))]


def lagrange(nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Values at x (rows) of the Lagrange polynomials of the nodes (columns)."""
    found = np.ones((len(x), len(nodes)))
    for a, here in enumerate(nodes):
        for b, there in enumerate(nodes):
            if a != b:
                found[:, a] *= (x - there) / (here - there)
    return found


class Kinematics:
    """An irregular sea for the forms on one mesh: its components in C, and the points at which they are summed."""

    def __init__(self, scene: Scene, level: fem.Constant | None = None):
        self.sets: list[Points] = []
        self._alive, self._following, self._level = [], [], level
        self.waves, self._stale = core().ffi.new("waves *"), np.ones(1, dtype=np.int32)  #: waves: in C
        self.change(scene)

    def change(self, scene: Scene) -> None:
        """Take the components of another scene."""
        self.exact, self._airy = scene.waves.kinematics == "exact", AirySum.of(scene)
        airy, n = self._airy, len(self._airy.wavenumber)
        padded = -(-n // ALIGNED) * ALIGNED
        self._arrays = {name: aligned(padded) for name in _ARRAYS}
        k = airy.wavenumber
        values = {
            "k": k,
            "kx": k * airy.cosine,
            "ky": k * airy.sine,
            "amplitude": airy.amplitude,
            "potential": airy.motion * airy.in_water / (k * -np.expm1(-2 * k * airy.depth)),
            "sigma": airy.in_water,
            "bottom": np.exp(-2 * k * airy.depth),
            "ones": np.ones(n),
        }
        for name, array in values.items():
            self._arrays[name][:n] = array
        for name, array in self._arrays.items():
            setattr(self.waves, name, address(array))
        self.waves.count, self.waves.padded, self.waves.radius = n, padded, -1.0
        self.waves.steep, self.waves.highest = airy.steep, float(np.abs(airy.amplitude).sum())
        self.waves.depth, self.waves.stretching = airy.depth, STRETCHINGS.index(airy.stretching)
        if self._level is not None:
            self.waves.level = address(array_of(self._level))
        for context in self._following:
            context.exact = self.exact
        self.set_time(0.0)

    def set_time(self, t: float) -> None:
        """Set the phases and ramp to a time and mark earlier sums as stale."""
        self._arrays["phase"][: self.waves.count] = self._airy.time_phase(t)
        self.waves.ramp = self._airy.grown(t)
        self.waves.serial += 1
        self._stale[0] = 1

    @property
    def phases(self) -> np.ndarray:
        """phase - omega t of the components at that time [rad], padded to whole SIMD vectors."""
        return self._arrays["phase"]

    def add(self, points: Points) -> Points:
        """Add points of this mesh."""
        self.sets.append(points)
        return points

    def samples(self, points: Points, depth: Expr) -> Samples:
        """The samples that a form reads at the points."""
        return Samples(points.coefficient, depth, self._airy.stretching, self._airy.steep)

    def follow(self, system: System, body: tuple | None = None) -> None:
        """Sum the components at the points of a System before each of its evaluations.

        body: arrays that hold r_C, q_4 and the height of C, and the length of its hull.
        """
        read = [points for points in self.sets if system.numbers_of(points.coefficient) is not None]
        counts = lambda p: system.shared.count(p.coefficient.function_space.mesh, p.cells)  # noqa: E731
        context = self._context(read, system.numbers_of, counts, body)
        self._following.append(context)
        system.filled_by_hook(*(points.coefficient for points in read))
        system.hooks.add("sample", context)

    def into_functions(self, read: Callable, body: tuple | None = None) -> Callable:
        """Function that sums for the present values of Functions and Constants and writes the coefficients."""
        context = self._context(self.sets, read, lambda p: np.array([len(p.cells)], dtype=np.int32), body)
        stale = np.ones(1, dtype=np.int32)  # its own flag: the samples of a System stay stale
        context.exact, context.stale = True, address(stale)
        self._alive.append(stale)
        return partial(core().lib.sample, context, core().ffi.NULL)

    def of_hull(self, body: tuple) -> Any:
        """Context of the sea for `hull_points` in C."""
        context = self._context([], None, None, body)
        self._following.append(context)
        return context

    def _context(self, sets, read, count, body):
        context, described = core().ffi.new("kinematics *"), core().ffi.new("points[]", max(1, len(sets)))
        context.waves, context.exact, context.stale = self.waves, self.exact, address(self._stale)
        kept = [described, self._arrays, body]
        for points, one in zip(sets, described, strict=False):
            kept.append(_describe(one, points, read, count(points)))
        context.count, context.sets = len(sets), described
        if body is not None:
            *arrays, length = body
            context.position, context.quaternion, context.center = map(address, arrays)
            context.moved = 0.05 * length
        self._alive.append((context, kept))
        return context


_ARRAYS = (
    *("k", "kx", "ky", "phase", "amplitude", "potential", "sigma", "bottom"),
    *("mean", "moment", "ones", "c", "s", "cosh", "sinh"),
)


def _describe(one, points, read, count):
    """Fill in the C description of points; returns the arrays it points to."""
    bs, nodes = points.size, points.places.shape[1]
    to = bs * compat.cell_dofs(points.coefficient.function_space)[points.cells]
    ints = [np.ascontiguousarray(a, dtype=np.int32) for a in (points.places, to)]
    shape, out = np.ascontiguousarray(points.shape, dtype=np.float64), read(points.coefficient)
    heights = np.zeros(max(1, len(points.cells) * nodes))
    kept = [count, *ints, shape, out, heights]
    one.kind, one.weight, one.size, one.radius = points.kind, points.weight, bs, points.radius
    one.cells, one.points, one.nodes = address(count), len(shape), nodes
    one.places, one.to, one.shape, one.out = address(ints[0]), address(ints[1]), address(shape), address(out)
    if points.source is not None:
        source = points.source if isinstance(points.source, np.ndarray) else read(points.source)
        one.source = address(source)
        kept.append(source)
    if points.kind == ON_AXIS:
        one.heights = address(heights)
    return kept
