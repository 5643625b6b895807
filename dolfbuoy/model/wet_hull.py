"""The hull of a buoy in water: its strips and faces on the cells of one mesh, and the loads on them."""

import itertools
from functools import partial
from typing import Any

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
from ..solver.c_code import core
from ..solver.fields import Fields
from ..solver.real import real_space
from ..solver.system import System
from ..solver.unknowns import array_of
from .hull_points import LENGTH, RADIUS, TAPER, ZETA, HullPoints, PointGroup
from .kinematics import on_axis, on_cells, weighted
from .sea import SeaState

WET, CUT, FACE = 1, 2, 3  #: tags of cells
SUBMERGED = 7  #: numbers of `WetHull.submerged`


class WetHull:
    """Strips, each at a point of `HullPoints`, and faces, each on a cell of `mesh`, whose cells have the length 1.

    buoy, solver: sections of the scene.  terms: [(effect, its constants)] of what the scene calls for.  water: the
    SeaState on the mesh.  center: Constant, the height of C above the keel.
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
        wet, cut = (PointGroup(mesh, *group) for group in of_tag)
        self.averaged = buoy.disk_averages and water.has_waves
        self.points = HullPoints(pieces, wet, cut, self.averaged)
        self.height, self.tapered, self._alive, self._to_coefficients = shape.height, shape.tapered, [], None
        self.face = self._faces(faces, ends[2])
        self._sampled = self._waves_at_points(wet, cut, np.flatnonzero(tags.values == FACE)) if water.kinematics else {}
        dx = ufl.Measure("dx", domain=mesh, subdomain_data=tags, metadata={"quadrature_degree": 0})
        self._dx, self._d_faces = {WET: dx(WET), CUT: dx(CUT)}, dx(FACE)

    @staticmethod
    def cells(solver: Solver, shape: HullShape) -> int:
        """How many cells the mesh must have."""
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

    def _waves_at_points(self, wet, cut, faces):
        """Tag -> where an irregular sea is wanted."""
        places = 3 * compat.cell_dofs(self.face.function_space)[faces]
        found = {WET: on_axis(wet), CUT: on_axis(cut), FACE: on_cells(self.mesh, faces, self.face, places, radius=2)}
        found = {tag: weighted(points) if self.averaged else [points] for tag, points in found.items()}
        for points in (points for several in found.values() for points in several):
            self.water.kinematics.add(points)
        return found

    # -- points that follow the water -------------------------------------------------------------------------------

    def follow(self, system: System, state: fem.Function, fields: Fields) -> None:
        """Before every evaluation of a System the points go where its state wants them.  state: the Function."""
        read = system.numbers_of
        context = self._following(fields.of(read(state)), read, lambda g: system.counts.of(g.mesh, g.cells))
        self._alive.append(context)
        system.hooks.add("follow", context)
        if self.water.kinematics:
            self.water.kinematics.follow(system, self._body(fields.of(read(state)), read))

    def _body(self, u, read):
        """What an irregular sea has to know of the body: arrays, and the height of the hull."""
        return u.position, u.orientation, read(self.center), self.height

    def place_points(self, state: fem.Function, fields: Fields) -> None:
        """Write the points for the present values of Functions and Constants into the coefficients."""
        if self._to_coefficients is None:  # made once: records ask for this at every instant
            counts = {id(g): np.zeros(1, dtype=np.int32) for g in (self.points.wet, self.points.cut)}
            context = self._following(fields.of(array_of(state)), array_of, lambda g: counts[id(g)])
            self._alive.append(counts)
            self._to_coefficients = [partial(core().lib.follow, context, core().ffi.NULL)]
            if self.water.kinematics:
                body = self._body(fields.of(array_of(state)), array_of)
                self._to_coefficients.append(self.water.kinematics.into_functions(array_of, body))
        for write in self._to_coefficients:
            write()

    def _following(self, u, read, count):
        wave = self.water.wave
        if wave is not None:
            numbers = wave.amplitude, wave.wavenumber, wave.time_phase, wave.cos_direction, wave.sin_direction
            wave = [read(number) for number in numbers]
        out = lambda group: read(group.coefficient)  # noqa: E731
        sea = self.water.kinematics and self.water.kinematics.of_hull(self._body(u, read))
        return self.points.following(u.position, u.orientation, read(self.center), wave, out, count, sea)

    # -- forms --------------------------------------------------------------------------------------------------------

    def _strip(self, state, zeta, radius, section, tag):
        """section(radius, d, x, flow): area and first moment of what is wet."""
        d = axis(state.quaternion)
        lever = (zeta - self.center) * d
        flow = self.water.flow(state.position + lever, *self._sampled.get(tag, ()))
        if self.averaged and not self._sampled:
            flow = sea.averaged_over_disk(flow, self.water.wave.wavenumber * radius)
        return hull.Strip(lever, d, radius, flow, *section(radius, d, state.position + lever, flow), state.motion)

    def strips(self, state: Body) -> list[tuple]:
        """[(strip at a point, |R'| there, weight of the point [m], measure)]; state: what `Buoy.kinematics` says."""
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
        """[(effect, force per wet area and metre of axis, couple likewise or None)]."""
        found = []
        for effect, c in self.terms:
            force = effect.strip and effect.strip(c, self.water.density, strip)
            couple = effect.couple and effect.couple(c, self.water.density, strip)
            if force is not None:
                found.append((effect, force, couple))
        return found

    def on_faces(self, strip: hull.Strip, face: hull.Face) -> list[tuple]:
        """[(effect, force, torque about C)] on a face, what is absent None."""
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
        """The loads in the momentum balances, all effects together: common factors are computed once."""
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
        test, found = ufl.TestFunction(real_space(self.mesh, SUBMERGED)), []
        for strip, _, length, dx in self.strips(state):
            where = strip.area * (state.position + strip.lever) + strip.moment
            numbers = [self.water.density * strip.area, *(self.water.density * where[i] for i in range(3))]
            numbers += [strip.wet, 2 * strip.radius * strip.wet]
            found.append(length * sum(number * test[k] for k, number in enumerate(numbers)) * dx)
        return add_forms(found)


def _degrees(solver):
    """Of Gauss's rules on pieces that are wet, and on those that are cut.

    A third of the points where nothing is cut: three do for moments of R^2, which is quadratic between stations.
    """
    degree = solver.hull_quadrature_degree
    return 2 * max(3, (degree + 1) // 6) - 1, degree


def _points(degree):
    return degree // 2 + 1


def _parts(solver, shape):
    return shape.pieces(solver.hull_cells), shape.faces()


def _tested(loads, tests):
    """Sum of (force, torque), each or none, with the tests of the balances."""
    totals = (add(parts) for parts in zip(*loads, strict=True))
    return add([None if total is None else ufl.inner(total, test) for total, test in zip(totals, tests, strict=True)])


def add_forms(forms: list[ufl.Form]) -> ufl.Form:
    """Their sum, without the sums on the way: UFL looks through each of these."""
    return ufl.Form([integral for form in forms for integral in form.integrals()])


def add(terms: list) -> Expr | None:
    """Sum of the UFL expressions that are not None; None if there are none."""
    present = [term for term in terms if term is not None]
    return sum(present[1:], present[0]) if present else None
