"""The hull of a buoy in water: its strips and faces on the cells of one mesh, and the loads on them."""

import numpy as np
import ufl
from dolfinx import fem

from ..forms import hull, sea
from ..solver import compat
from ..solver.real import real_space
from .hull_points import LENGTH, RADIUS, TAPER, ZETA, HullPoints

STRIP, FACE = 1, 2  #: tags of cells
SUBMERGED = 7  #: numbers of `WetHull.submerged`


class WetHull:
    """Strips at the points of `HullPoints` and faces, each a cell of `mesh`, which has cells of the length 1.

    terms: [(effect, its constants)] of what the scene calls for.  water: the SeaState on the mesh.  center: Constant,
    the height of C above the keel.
    """

    def __init__(self, mesh, scene, shape, water, center, terms):
        self.mesh, self.water, self.center, self.terms = mesh, water, center, terms
        pieces, faces = _parts(scene, shape)
        strips, end = 2 * len(pieces), 2 * len(pieces) + len(faces)
        tags = compat.cell_tags(mesh, {STRIP: (0, strips), FACE: (strips, end)})
        cells = np.flatnonzero(tags.values == STRIP)
        self.averaged = scene.buoy.disk_averages and water.wave is not None
        degree = scene.solver.hull_quadrature_degree
        self.points = HullPoints(mesh, pieces, cells, degree, self.averaged)
        self.tapered, self._alive = shape.tapered, []
        self.face = self._faces(faces, strips)
        dx = ufl.Measure("dx", domain=mesh, subdomain_data=tags)
        self.dx = dx(STRIP, metadata={"quadrature_degree": degree})
        self.d_faces = dx(FACE, metadata={"quadrature_degree": 0})

    @staticmethod
    def cells(scene, shape) -> int:
        """How many cells the mesh must have."""
        pieces, faces = _parts(scene, shape)
        return 2 * len(pieces) + len(faces)

    def _faces(self, faces, first):
        """(height, inner radius, outer radius) on the cells of the faces."""
        space = compat.function_space(self.mesh, compat.element(self.mesh, "DG", 0, 3))
        function = fem.Function(space)
        numbers = function.x.array.reshape(-1, 3)
        numbers[:] = [0.0, 0.0, 1.0]
        order = np.argsort(compat.cell_ends(self.mesh)[:, 0])
        numbers[compat.cell_dofs(space)[order[first : first + len(faces)], 0]] = faces
        return function

    # -- points that follow the water -------------------------------------------------------------------------------

    def follow(self, system, state, fields):
        """Before every evaluation of a System the points go where its state wants them.  state: the Function."""
        u = fields.of(system.numbers_of(state))
        read = system.numbers_of
        out, count = read(self.points.coefficient), system.counts.of(self.mesh, self.points.cells)
        module, context = self._following(u, read, out, count)
        self._alive.append(context)
        cast, lib = module.ffi.cast, module.lib
        system.hooks.add(int(cast("uintptr_t", module.ffi.addressof(lib, "follow"))), int(cast("uintptr_t", context)))

    def place_points(self, state, fields):
        """Write the points for the present values of Functions and Constants into the coefficient."""
        array = self.points.coefficient.x.array
        module, context = self._following(fields.of(state), _values, array, np.zeros(1, dtype=np.int32))
        module.lib.follow(context, module.ffi.NULL)

    def _following(self, u, read, out, count):
        wave = None
        if self.water.wave is not None:
            w = self.water.wave
            wave = [read(x) for x in (w.amplitude, w.wavenumber, w.time_phase, w.cos_direction, w.sin_direction)]
        return self.points.following(u.position, u.orientation, read(self.center), wave, out, count)

    # -- forms --------------------------------------------------------------------------------------------------------

    def _strip(self, state, zeta, radius, least_tilt=hull.LEAST_TILT):
        d = hull.axis(state.quaternion)
        lever = (zeta - self.center) * d
        flow = self.water.flow(state.position + lever)
        if self.averaged:
            flow = sea.averaged_over_disk(flow, self.water.wave.wavenumber * radius)
        area, moment = hull.wet_section(radius, d, state.position + lever, flow, least_tilt)
        return hull.Strip(lever, d, radius, flow, area, moment, state.motion)

    def strip(self, state):
        """The strip at a point; state: what `Buoy.kinematics` says."""
        point = self.points.coefficient
        return self._strip(state, point[ZETA], point[RADIUS])

    def face_strip(self, state):
        """The disk of a face."""
        return self._strip(state, self.face[0], self.face[2], hull.FACE_TILT)

    def densities(self, strip):
        """[(effect, force per wet area and metre of axis, couple likewise or None)]."""
        found = []
        for effect, c in self.terms:
            force = effect.strip and effect.strip(c, self.water.density, strip)
            couple = effect.couple and effect.couple(c, self.water.density, strip)
            if force is not None:
                found.append((effect, force, couple))
        return found

    def on_faces(self, strip, face):
        """[(effect, force, torque about C)] on a face, what is absent None."""
        found = [(e, *e.face(c, self.water.density, strip, face)) for e, c in self.terms if e.face]
        return [(effect, F, torque) for effect, F, torque in found if F is not None or torque is not None]

    def loads(self, state):
        """[(effect, force [N], torque about C [N m], measure, velocity of the water)], one or two for each effect."""
        strip, length, found = self.strip(state), self.points.coefficient[LENGTH], []
        for effect, density, couple in self.densities(strip):
            force, torque = hull.strip_load(strip, density, couple)
            found.append((effect, length * force, length * torque, self.dx, strip.flow.velocity))
        if self.tapered:
            for effect, force, torque in self.on_faces(strip, hull.cone(strip, self.points.coefficient[TAPER])):
                found.append((effect, *(x and length * x for x in (force, torque)), self.dx, strip.flow.velocity))
        strip = self.face_strip(state)
        for effect, force, torque in self.on_faces(strip, hull.ring(strip, self.face[1])):
            found.append((effect, force, torque, self.d_faces, strip.flow.velocity))
        return found

    def form(self, state, test_force, test_torque):
        """The loads in the momentum balances, all effects together: common factors are computed once."""
        strip, length = self.strip(state), self.points.coefficient[LENGTH]
        densities = self.densities(strip)
        couple = add([couple for _, _, couple in densities])
        force, torque = hull.strip_load(strip, add([density for _, density, _ in densities]), couple)
        if self.tapered:
            cones = self.on_faces(strip, hull.cone(strip, self.points.coefficient[TAPER]))
            force, torque = add([force, *(f for _, f, _ in cones)]), add([torque, *(t for _, _, t in cones)])
        F = -length * (ufl.inner(force, test_force) + ufl.inner(torque, test_torque)) * self.dx
        strip = self.face_strip(state)
        rings = self.on_faces(strip, hull.ring(strip, self.face[1]))
        for test, terms in ((test_force, [f for _, f, _ in rings]), (test_torque, [t for _, _, t in rings])):
            total = add(terms)
            if total is not None:
                F -= ufl.inner(total, test) * self.d_faces
        return F

    def submerged(self, state):
        """Linear form of [M_D, rho_w integral of position (3), H_sub, integral of wet diameter]."""
        test = ufl.TestFunction(real_space(self.mesh, SUBMERGED))
        strip, length = self.strip(state), self.points.coefficient[LENGTH]
        where = strip.area * (state.position + strip.lever) + strip.moment
        numbers = [self.water.density * strip.area, *(self.water.density * where[i] for i in range(3))]
        numbers += [strip.wet, 2 * strip.radius * strip.wet]
        return length * sum(number * test[k] for k, number in enumerate(numbers)) * self.dx


def _parts(scene, shape):
    return shape.pieces(scene.solver.hull_cells), shape.faces()


def _values(thing):
    return np.reshape(thing.value, -1) if isinstance(thing, fem.Constant) else thing.x.array


def add(terms):
    """Sum of the UFL expressions that are not None; None if there are none."""
    present = [term for term in terms if term is not None]
    return sum(present[1:], present[0]) if present else None
