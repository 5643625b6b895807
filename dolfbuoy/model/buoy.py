"""A buoy of a scene: 13 numbers for its motion (7 for its pose in statics), on its hull's axis."""

from typing import NamedTuple

import numpy as np
import ufl
from dolfinx import fem

from ..forms import buoy as body
from ..forms import hull
from ..forms.rotation import rotation_matrix
from ..solver import compat
from ..solver.fields import Fields
from ..solver.real import real_space
from ..solver.unknowns import Block
from . import effects
from .evolution import Evolution
from .numbers import Numbers
from .rigid import axis_offset, mass_properties, rotation_of, shape_of
from .sea import SeaState

KEEL, TOP = 1, 2  # tags of the ends of the axis
#: Length over which a strip of an upright hull passes from wet to dry, in axis cells: four cells' points resolve it.
SOFTENING_CELLS = 2.0

#: State in motion, (r_C, p, q_4, L_C), and at rest; in statics |q_4| = 1 and the torques are the rows of the latter.
MOTION = Fields(position=3, momentum=3, orientation=4, angular_momentum=3)
REST = Fields(position=3, orientation=4)
REST_ROWS = Fields(force=3, norm=1, torque=3)


class Load(NamedTuple):
    """A load on the buoy: force [N] and torque about C [N m] as UFL, integrated over `measure`.

    account: of its power in the energy balance; None: weight and lines, which have accounts elsewhere.  water: velocity
    of the water that causes a drag, or None.
    """

    account: str | None
    force: object
    torque: object
    measure: object
    water: object = None


class Buoy:
    """Axis mesh, Real space and forms of a buoy."""

    def __init__(self, scene, dynamic):
        self.scene, self.section, self.dynamic = scene, scene.buoy, dynamic
        self.fields = MOTION if dynamic else REST
        self.shape = shape_of(self.section)
        self.mass = mass_properties(self.section, self.shape)
        nodes = self.shape.nodes(scene.solver.hull_cells) if self.shape else np.array([0.0, 1.0])
        self.mesh = compat.interval_mesh(compat.MPI.COMM_SELF, nodes)
        self.state, self.part = fem.Function(real_space(self.mesh, self.fields.size)), None
        self.memory = {"quaternion_drift": np.zeros(1)}  #: what accepted steps leave behind besides unknowns
        if dynamic:
            self.gamma, self.history = fem.Constant(self.mesh, 0.0), fem.Function(self.state.function_space)
        else:
            self.relaxation = fem.Constant(self.mesh, 0.0)
            self.reference = fem.Function(self.state.function_space)
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic)
        degree = scene.solver.hull_quadrature_degree
        self.dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": degree})
        self.ds = ufl.Measure("ds", domain=self.mesh, subdomain_data=compat.end_tags(self.mesh, nodes[0], nodes[-1]))
        self._constants(nodes)

    def _constants(self, nodes):
        self._numbers = Numbers(self.mesh, self.scene, lambda scene: scene.buoy)
        number = self._numbers.constant
        self.one = fem.Constant(self.mesh, 1.0)
        self.M = number(lambda scene, b: mass_properties(b, shape_of(b)).mass)
        self.center = number(lambda scene, b: mass_properties(b, shape_of(b)).height)
        self.inertia = number(lambda scene, b: np.array(mass_properties(b, shape_of(b)).inertia))
        self.gravity = number(lambda scene, _: np.array([0.0, 0.0, -scene.gravity]))
        #: Body vector from C to the mooring point.
        self.offset = number(lambda scene, b: axis_offset(b, b.mooring_height))
        self._coefficients = {}
        for where in ("strip", "end", "body"):
            called = effects.called_by(self.scene, where) if where == "body" or self.scene.sea else []
            self._coefficients[where] = [(effect, self._numbers.of(effect)) for effect in called]
        if self.scene.sea:
            softening = fem.Constant(self.mesh, SOFTENING_CELLS * np.diff(nodes).max())
            self.hull = hull.Hull(self._radius(), softening)

    def _radius(self):
        space = compat.function_space(self.mesh, compat.element(self.mesh, "DG", 1))
        R, cells, ends = fem.Function(space), compat.cell_dofs(space), compat.cell_ends(self.mesh)
        zeta = space.tabulate_dof_coordinates()[cells, 0]
        R.x.array[cells] = self.shape.radius(zeta, ends.mean(axis=1)[:, None])
        return R

    def change(self, scene):
        """Take the numbers of another scene of the same structure."""
        self.scene, self.section = scene, scene.buoy
        self.mass = mass_properties(self.section, self.shape)
        self._numbers.change(scene)
        self.sea.change(scene)

    # -- forms ------------------------------------------------------------------------------------------------------

    def rates(self):
        """Time derivatives of the state by name, affine in the unknown."""
        return MOTION.split(self.gamma * self.state + self.history)

    def kinematics(self) -> body.Body:
        """Where it is and how it moves; no motion in statics."""
        y, motion = self.fields.split(self.state), None
        if self.dynamic:
            rates, R = self.rates(), rotation_matrix(y.orientation)
            motion = hull.body_motion(
                R, self.M, self.inertia, y.momentum, rates.momentum, y.angular_momentum, rates.angular_momentum
            )
        return body.Body(y.position, y.orientation, self.sea.flow, motion)

    def strip(self, state):
        """The strip of the hull at the axis coordinate; state: what `kinematics` says."""
        zeta = ufl.SpatialCoordinate(self.mesh)[0]
        d = hull.axis(state.quaternion)
        lever = (zeta - self.center) * d
        flow = self.sea.flow(state.position + lever)
        area, moment = hull.wet_section(
            self.hull.radius, self.hull.softening, d, state.position + lever, flow.elevation
        )
        return hull.Strip(lever, d, flow, area, moment, state.motion)

    def point_loads(self, state, attachments=()) -> list[Load]:
        """Weight, lines, and every effect that acts at a point of the body."""
        keel = self.ds(KEEL)
        loads = [Load(None, self.M * self.gravity, None, keel)]
        loads += [Load(e.account, *e.body(c, state), keel) for e, c in self._coefficients["body"]]
        loads += [Load(None, *attachment.load(state), keel) for attachment in attachments]
        return [load for load in loads if load.force is not None or load.torque is not None]

    def strip_densities(self, strip):
        """[(effect, force per wet area and metre of axis)] of what the scene calls for."""
        found = [(e, e.strip(c, self.hull, self.sea.density, strip)) for e, c in self._coefficients["strip"]]
        return [(effect, density) for effect, density in found if density is not None]

    def end_forces(self, strip):
        """[(effect, force on a wet end disc)] of what the scene calls for."""
        found = [(e, e.end(c, self.hull, self.sea.density, strip)) for e, c in self._coefficients["end"]]
        return [(effect, force) for effect, force in found if force is not None]

    def water_loads(self, state) -> list[Load]:
        """Loads of the water, one for each effect: for balances.  The residual takes them together."""
        if self.scene.sea is None:
            return []
        strip = self.strip(state)
        loads = [
            Load(effect.account, *hull.strip_load(strip, density), self.dx, strip.flow.velocity)
            for effect, density in self.strip_densities(strip)
        ]
        for effect, force in self.end_forces(strip):
            loads.append(Load(effect.account, force, ufl.cross(strip.lever, force), self.ds, strip.flow.velocity))
        return loads

    def residuals(self, attachments=()):
        """Eqs. (8), (9), (10) as [(part, form), ...]; in statics the equilibrium of the same loads."""
        state, point, one = self.kinematics(), self.ds(KEEL), self.one
        loads = self.point_loads(state, attachments)
        force, torque = _sum(load.force for load in loads), _sum(load.torque for load in loads)
        if self.dynamic:
            F, test_force, test_torque = self._momentum_balance(state, force, torque)
        else:
            F, test_force, test_torque = self._equilibrium(state, force, torque, attachments)
        F = one * F * point
        if self.scene.sea is not None:
            F += self._hull_loads(state, test_force, test_torque)
        links = [(a.body_part, one * a.link(state) * point) for a in attachments]
        return [(self.part, F), *links]

    def _momentum_balance(self, state, force, torque):
        """Eq. (8) with the loads at points, and the tests of force and torque."""
        y, rates, test = MOTION.split(self.state), self.rates(), MOTION.split(self.part.test)
        F = body.translation(rates.position, y.momentum, self.M, test.position)
        F += body.linear_momentum(rates.momentum, force, test.momentum)
        F += body.orientation(rates.orientation, y.orientation, y.angular_momentum, self.inertia, test.orientation)
        F += body.angular_momentum(rates.angular_momentum, torque, test.angular_momentum)
        return F, test.momentum, test.angular_momentum

    def _equilibrium(self, state, force, torque, attachments):
        """Balance of the loads at points, and the tests of force and torque."""
        test, reference = REST_ROWS.split(self.part.test), REST.split(self.reference)
        moment, length = self._sizes()[1:3]
        inertia = fem.Constant(self.mesh, max(self.mass.inertia))
        gauge = fem.Constant(self.mesh, moment * length)
        tests = test.force, test.norm[0], test.torque
        pose = reference.position, reference.orientation
        F = body.equilibrium(
            state.position, state.quaternion, force, torque, pose, self.M, inertia, self.relaxation, gauge, tests
        )
        if not attachments:
            F += body.held_horizontally(state.position, reference.position, gauge, test.force)
        return F, test.force, test.torque

    def _hull_loads(self, state, test_force, test_torque):
        strip = self.strip(state)
        force, torque = hull.strip_load(strip, _sum(density for _, density in self.strip_densities(strip)))
        F = -(ufl.inner(force, test_force) + ufl.inner(torque, test_torque)) * self.dx
        ends = [force for _, force in self.end_forces(strip)]
        if ends:
            F -= self.one * ufl.inner(_sum(ends), test_force) * self.ds
        return F

    def wet_hull_form(self):
        """Linear form of [M_D, rho_w integral of position (3), H_sub, integral of wet diameter, elevation above C]."""
        test = ufl.TestFunction(real_space(self.mesh, 7))
        state = self.kinematics()
        strip = self.strip(state)
        wet = strip.area / (ufl.pi * self.hull.radius**2)
        where = strip.area * (state.position + strip.lever) + strip.moment
        rho_w = self.sea.density
        form = rho_w * (strip.area * test[0] + sum(where[i] * test[1 + i] for i in range(3))) * self.dx
        form += (wet * test[4] + 2 * self.hull.radius * wet * test[5]) * self.dx
        eta = self.sea.flow(state.position).elevation
        return form if eta is None else form + self.one * eta * test[6] * self.ds(KEEL)

    def axis_points(self, vertices):
        """Quadrature points of the hull: axis coordinates and weights [m], arrays (cells, points of a cell).

        vertices: of the mesh, as `System.coordinates` has them; who moves those moves the points.
        """
        xi, weights = compat.interval_quadrature(self.scene.solver.hull_quadrature_degree)
        low, high = vertices[:, :1], vertices[:, 3:4]
        return low + (high - low) * xi, np.abs(high - low) * weights

    # -- time -------------------------------------------------------------------------------------------------------

    def evolutions(self) -> list[Evolution]:
        """The state is of first order; its momenta are rates that the scheme makes."""
        lagged = MOTION.mask("momentum", "angular_momentum")
        return [Evolution(self.part, [(self.gamma, self.history)], lagged, [self.state_sizes])]

    def set_time(self, t):
        """Advance the sea."""
        self.sea.set_time(t)

    def accept(self, u):
        """A step was taken: the quaternion is made a unit again, and how far it was from one is remembered."""
        q4 = MOTION.of(u[self.part.slice]).orientation
        length = np.linalg.norm(q4)
        drift = self.memory["quaternion_drift"]
        drift[:] = max(drift[0], abs(length - 1))
        q4 /= length

    # -- numbers ----------------------------------------------------------------------------------------------------

    def moving_state(self, position, orientation, velocity, angular_velocity) -> np.ndarray:
        """State of a body at C = position [m] with a unit quaternion, velocity [m/s] and omega (world frame) [1/s]."""
        R, inertia = rotation_of(orientation), np.array(self.mass.inertia)
        return MOTION.filled(
            position=position,
            momentum=self.mass.mass * velocity,
            orientation=orientation,
            angular_momentum=R @ (inertia * (R.T @ angular_velocity)),
        )

    def places(self):
        """A state belongs to no place."""
        return np.zeros(0)

    def force_dofs(self):
        """Local unknowns that are forces: none."""
        return np.zeros(0, dtype=int)

    def _sizes(self):
        """Typical length [m], force [N], moment arm [m] and speed [m/s]."""
        g = max(self.scene.gravity, 1.0)
        length = self.shape.height if self.shape else 1.0
        return length, self.mass.mass * g, length, np.sqrt(g * length)

    @property
    def state_sizes(self):
        """Typical sizes of the 13 numbers (r_C, p, q_4, L_C), for relative errors."""
        length, _, _, speed = self._sizes()
        spin = max(self.mass.inertia) * speed / length
        return MOTION.filled(position=length, momentum=self.mass.mass * speed, orientation=1.0, angular_momentum=spin)

    def reach_and_force(self, line_length=0.0, force=0.0):
        """Typical length [m] and force [N] of the buoy on a line; `force`: that of the line."""
        length, weight, _, _ = self._sizes()
        return max(length, line_length), max(weight, force)

    def blocks(self, line_length=0.0, force=0.0):
        """Blocks of the 13 (or 7) numbers."""
        _, _, arm, speed = self._sizes()
        reach, force = self.reach_and_force(line_length, force)
        place = np.arange(self.part.slice.start, self.part.slice.stop)
        if not self.dynamic:
            at = REST_ROWS.of(place)
            return [
                Block("buoy position r_C", at.force, reach, force, unit="m"),
                Block("buoy orientation q_4", at.norm, 1.0, 1.0),
                Block("buoy torque balance", at.torque, 1.0, force * arm),
            ]
        at, spin, momentum = MOTION.of(place), max(self.mass.inertia) * speed / self._sizes()[0], self.mass.mass * speed
        return [
            Block("buoy position r_C", at.position, reach, 0.0, reach, unit="m"),
            Block("buoy momentum p", at.momentum, momentum, force, momentum, unit="N s"),
            Block("buoy orientation q_4", at.orientation, 1.0, 0.0, 1.0),
            Block("buoy angular momentum L_C", at.angular_momentum, spin, force * arm, spin, unit="N m s"),
        ]


def _sum(terms):
    """Sum of UFL vectors, without those that are None."""
    present = [term for term in terms if term is not None]
    return sum(present[1:], present[0]) if present else ufl.zero(3)
