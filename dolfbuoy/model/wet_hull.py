"""The hull of a buoy in water: its strips and faces on the cells of one mesh, and the loads on them.

Quadrature along the axis follows the water plane.  The wet section is smooth along the axis except at the stations of
the hull and at the two heights between which the surface cuts the disks, where the wet area varies with the power 3/2
of the distance.  The intervals between stations are therefore split there, dry pieces are left out, and on pieces cut
by the surface the angle theta, c = -cos(theta), is the variable of integration: Gauss points then converge as fast as
elsewhere, at any tilt, including upright.

Points are recomputed before every evaluation of residual and Jacobian, and kept fixed in differentiation: the integral
depends on their position only through the quadrature error.  This is done in C, as a hook of the System.
"""

import itertools
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem

from ..forms import hull, sea
from ..forms.buoy import Body
from ..forms.kinds import Expr
from ..forms.rotation import axis
from ..meshes import HullShape
from ..scene.buoy import Buoy
from ..scene.sections import Solver
from ..solver import compat
from ..solver.c_code import address, core
from ..solver.system import System
from ..solver.unknowns import Fields, array_of
from .kinematics import on_axis, on_cells, weighted
from .sea import SeaState

WET, CUT, FACE = 1, 2, 3  #: tags of cells
ZETA, RADIUS, LENGTH, TAPER = range(4)  #: values per point: height on the axis, R, weight [m], |R'|
SUBMERGED = 7  #: numbers of `WetHull.submerged`


class PointGroup:
    """Points, each on a mesh cell of unit length: on each piece of the axis those of the Gauss rule of `degree`.

    coefficient: a Function of four numbers, ZETA, RADIUS, LENGTH and TAPER.  An integral over the axis is that of
    LENGTH over the `cells`, with one point each.  (For FFCx one cell with many points would be equivalent, but several
    cells are evaluated at a time, see `solver.simd`.)
    """

    def __init__(self, mesh, cells, degree):
        self.mesh, self.cells = mesh, np.array(cells, dtype=np.int32)
        space = compat.function_space(mesh, compat.element(mesh, "DG", 0, 4))
        self.coefficient = fem.Function(space)
        self.at, self.weights = map(np.ascontiguousarray, compat.interval_quadrature(degree))
        self.places = np.ascontiguousarray(4 * compat.cell_dofs(space)[self.cells], dtype=np.int32)

    def describe(self, group, out, count):
        """Fill in the C description; out: array for the coefficient, count: array (1,) for the number of points."""
        group.points, group.at, group.weights = len(self.at), address(self.at), address(self.weights)
        group.capacity, group.places = len(self.cells), address(self.places)
        group.out, group.count = address(out), address(count)


class HullPoints(NamedTuple):
    """The points of a hull: on fully wet disks, and on disks cut by the surface."""

    wet: PointGroup
    cut: PointGroup


class WetHull:
    """Strips, each at a point of `HullPoints`, and faces, each on a cell of `mesh`, whose cells have the length 1.

    buoy, solver: scene sections.  terms: [(effect, its constants)] of the effects of the scene.  water: the SeaState on
    the mesh.  center: Constant, the height of C above the keel.
    """

    def __init__(
        self,
        mesh: Any,
        buoy: Buoy,
        solver: Solver,
        shape: HullShape,
        water: SeaState,
        center: fem.Constant,
        terms: list,
    ):
        self.mesh, self.water, self.center, self.terms = mesh, water, center, terms
        pieces, faces = _parts(solver, shape)
        degrees = _degrees(solver)
        ends = np.cumsum([0, *(len(pieces) * _points(degree) for degree in degrees), len(faces)])
        tags = compat.cell_tags(mesh, dict(zip((WET, CUT, FACE), itertools.pairwise(ends), strict=True)))
        of_tag = ((np.flatnonzero(tags.values == tag), degree) for tag, degree in zip((WET, CUT), degrees, strict=True))
        self.points = HullPoints(*(PointGroup(mesh, *group) for group in of_tag))
        self.averaged = buoy.disk_averages and water.has_waves
        self._frusta = np.array(pieces, dtype=np.float64)  #: [(height, height, radius, radius)]
        self.height, self.tapered, self._alive, self._to_coefficients = shape.height, shape.tapered, [], None
        self.face = self._faces(faces, ends[2])
        self._sampled = self._waves_at_points(np.flatnonzero(tags.values == FACE)) if water.kinematics else {}
        dx = ufl.Measure("dx", domain=mesh, subdomain_data=tags, metadata={"quadrature_degree": 0})
        self._dx, self._d_faces = {WET: dx(WET), CUT: dx(CUT)}, dx(FACE)

    @staticmethod
    def cells(solver: Solver, shape: HullShape) -> int:
        """Number of cells that the mesh must have."""
        pieces, faces = _parts(solver, shape)
        return len(pieces) * sum(map(_points, _degrees(solver))) + len(faces)

    def _faces(self, faces, first):
        """(height, inner radius, outer radius) on the cells of the faces."""
        space = compat.function_space(self.mesh, compat.element(self.mesh, "DG", 0, 3))
        function = fem.Function(space)
        numbers = function.x.array.reshape(-1, 3)
        numbers[:] = [0.0, 0.0, 1.0]
        order = np.argsort(compat.cell_ends(self.mesh)[:, 0])
        places = compat.cell_dofs(space)[order[first : first + len(faces)], 0]
        numbers[places] = np.reshape(faces, (-1, 3))  # a spindle has none
        return function

    def _waves_at_points(self, faces):
        """Tag -> points where an irregular sea is sampled."""
        places = 3 * compat.cell_dofs(self.face.function_space)[faces]
        found = {WET: on_axis(self.points.wet), CUT: on_axis(self.points.cut)}
        found[FACE] = on_cells(self.mesh, faces, self.face, places, radius=2)
        found = {tag: weighted(points) if self.averaged else [points] for tag, points in found.items()}
        for points in (points for several in found.values() for points in several):
            self.water.kinematics.add(points)
        return found

    # -- points that follow the water -------------------------------------------------------------------------------

    def follow(self, system: System, state: fem.Function, fields: Fields) -> None:
        """Update the points before every evaluation of a System; state: the Function."""
        count = lambda group: system.shared.count(group.mesh, group.cells)  # noqa: E731
        context, body = self._following(state, fields, system.numbers_of, count)
        self._alive.append(context)
        system.hooks.add("follow", context)
        if self.water.kinematics:
            self.water.kinematics.follow(system, body)

    def place_points(self, state: fem.Function, fields: Fields) -> None:
        """Write the points for the present values of Functions and Constants into the coefficients."""
        if self._to_coefficients is None:  # created once: records need this at every instant
            counts = {id(group): np.zeros(1, dtype=np.int32) for group in self.points}
            context, body = self._following(state, fields, array_of, lambda group: counts[id(group)])
            self._alive.append(counts)
            self._to_coefficients = [partial(core().lib.follow, context, core().ffi.NULL)]
            if self.water.kinematics:
                self._to_coefficients.append(self.water.kinematics.into_functions(array_of, body))
        for write in self._to_coefficients:
            write()

    def _following(self, state, fields, read, count):
        """(C description of the points following a state, arrays of the body and its height for the sea).

        read: Function or Constant -> the array of its values, which must live as long as the description.  count:
        PointGroup -> an array for the number of its points in use.
        """
        u, context = fields.of(read(state)), core().ffi.new("hull_points *")
        body = u.position, u.orientation, read(self.center), self.height
        context.frusta, context.frustum = len(self._frusta), address(self._frusta)
        for group, described in zip(self.points, (context.wet, context.cut), strict=True):
            group.describe(described, read(group.coefficient), count(group))
        context.position, context.quaternion, context.center = map(address, body[:3])
        for name in ("amplitude", "wavenumber", "time_phase", "cos_direction", "sin_direction"):
            if self.water.wave is not None:
                setattr(context, name, address(read(getattr(self.water.wave, name))))
        if self.water.kinematics:
            context.sea = self.water.kinematics.of_hull(body)
        if self.water.level is not None:
            context.level = address(read(self.water.level))
        context.averaged, context.least_tilt = self.averaged, hull.LEAST_TILT
        return context, body

    # -- forms --------------------------------------------------------------------------------------------------------

    def _strip(self, state, zeta, radius, section, tag):
        """Strip with section(radius, d, x, flow), the wet area and its first moment."""
        d = axis(state.quaternion)
        lever = (zeta - self.center) * d
        flow = self.water.flow(state.position + lever, *self._sampled.get(tag, ()))
        if self.averaged and not self._sampled:
            flow = sea.averaged_over_disk(flow, self.water.wave.wavenumber * radius)
        return hull.Strip(lever, d, radius, flow, *section(radius, d, state.position + lever, flow), state.motion)

    def strips(self, state: Body) -> list[tuple]:
        """[(strip at a point, |R'| there, weight of the point [m], measure)]; state: from `Buoy.kinematics`."""
        section = partial(hull.wet_section, least_tilt=hull.LEAST_TILT)
        groups = (self.points.wet, hull.full_section, WET), (self.points.cut, section, CUT)
        return [
            (self._strip(state, p[ZETA], p[RADIUS], section, tag), p[TAPER], p[LENGTH], self._dx[tag])
            for p, section, tag in ((group.coefficient, section, tag) for group, section, tag in groups)
        ]

    def face_strip(self, state: Body) -> hull.Strip:
        """The disk of a face."""
        section = partial(hull.wet_section, least_tilt=hull.FACE_TILT)
        return self._strip(state, self.face[0], self.face[2], section, FACE)

    def densities(self, strip: hull.Strip) -> list[tuple]:
        """[(effect, force per wet area and metre of axis, couple per the same or None)]."""
        found = []
        for effect, c in self.terms:
            force = effect.strip and effect.strip(c, self.water.density, strip)
            couple = effect.couple and effect.couple(c, self.water.density, strip)
            if force is not None:
                found.append((effect, force, couple))
        return found

    def on_faces(self, strip: hull.Strip, face: hull.Face) -> list[tuple]:
        """[(effect, force, torque about C)] on a face, None where absent."""
        found = [(e, *e.face(c, self.water.density, strip, face)) for e, c in self.terms if e.face]
        return [(effect, F, torque) for effect, F, torque in found if F is not None or torque is not None]

    def loads(self, state: Body) -> list[tuple]:
        """[(effect, force [N], torque about C [N m], measure, velocity of the water)], one or more for each effect."""
        found = []
        for strip, taper, length, dx in self.strips(state):
            terms = [(effect, *hull.strip_load(strip, *load)) for effect, *load in self.densities(strip)]
            terms += self.on_faces(strip, hull.cone(strip, taper)) if self.tapered else []
            for effect, *load in terms:
                found.append((effect, *(x if x is None else length * x for x in load), dx, strip.flow.velocity))
        strip = self.face_strip(state)
        for effect, *load in self.on_faces(strip, hull.ring(strip, self.face[1])):
            found.append((effect, *load, self._d_faces, strip.flow.velocity))
        return found

    def forms(self, state: Body, test_force: Expr, test_torque: Expr) -> list[ufl.Form]:
        """The loads in the momentum balances, all effects combined so that common factors are computed once."""
        tests, found = (test_force, test_torque), []
        for strip, taper, length, dx in self.strips(state):
            densities = self.densities(strip)
            load = hull.strip_load(strip, *(add(part) for part in list(zip(*densities, strict=True))[1:]))
            cones = self.on_faces(strip, hull.cone(strip, taper)) if self.tapered else []
            found.append(-(length * _tested([load, *(part for _, *part in cones)], tests)) * dx)
        strip = self.face_strip(state)
        rings = self.on_faces(strip, hull.ring(strip, self.face[1]))
        return [*found, -_tested([load for _, *load in rings], tests) * self._d_faces] if rings else found

    def submerged(self, state: Body) -> ufl.Form:
        """Linear form of [M_D, rho_w integral of position (3), H_sub, integral of wet diameter]."""
        test, found = ufl.TestFunction(compat.real_space(self.mesh, SUBMERGED)), []
        for strip, _, length, dx in self.strips(state):
            where = strip.area * (state.position + strip.lever) + strip.moment
            numbers = [self.water.density * strip.area, *(self.water.density * where[i] for i in range(3))]
            numbers += [strip.wet, 2 * strip.radius * strip.wet]
            found.append(length * sum(number * test[k] for k, number in enumerate(numbers)) * dx)
        return add_forms(found)


def _degrees(solver):
    """Degrees of the Gauss rules on wet pieces and on pieces cut by the surface.

    A third of the points suffices on wet pieces: three are exact for moments of R^2, quadratic between stations.
    """
    degree = solver.hull_quadrature_degree
    return 2 * max(3, (degree + 1) // 6) - 1, degree


def _points(degree):
    return degree // 2 + 1


def _parts(solver, shape):
    return shape.pieces(solver.hull_cells), shape.faces()


def _tested(loads, tests):
    """Sum of (force, torque), either possibly None, times the test functions of the balances."""
    totals = (add(parts) for parts in zip(*loads, strict=True))
    return add([None if total is None else ufl.inner(total, test) for total, test in zip(totals, tests, strict=True)])


def add_forms(forms: list[ufl.Form]) -> ufl.Form:
    """Sum of forms without intermediate sums, each of which UFL would process."""
    return ufl.Form([integral for form in forms for integral in form.integrals()])


def add(terms: list) -> Expr | None:
    """Sum of the UFL expressions that are not None; None if there are none."""
    present = [term for term in terms if term is not None]
    return sum(present[1:], present[0]) if present else None
