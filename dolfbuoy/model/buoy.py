"""A buoy of a scene: 13 unknowns for its motion (7 for its pose in statics), on the axis of its hull."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem

from ..forms import buoy as body
from ..forms import hull
from ..forms.kinds import Expr
from ..forms.rotation import rotation_matrix
from ..forms.sea import Flow, at_most
from ..scene import Scene
from ..solver import compat
from ..solver.system import System
from ..solver.unknowns import Block, Fields, Part, array_of
from ..solver.vector_ops import Work, work
from . import effects
from .attachment import Attachment
from .interface import Evolution, Model
from .kinematics import on_cells
from .numbers import Numbers
from .radiation import Diffraction, Memory, OfComponents, SlowDrift
from .rigid import mass_properties, mooring_offset, rotation_of, shape_of
from .sea import SeaState
from .varying import force_over_time, seed_of, varies, wind_over_time
from .wet_hull import SUBMERGED, WetHull, add, add_forms

#: State in motion, (r_C, p, q_4, L_C), and at rest; in statics |q_4| = 1 and the torques are the rows of the latter.
MOTION = Fields(position=3, momentum=3, orientation=4, angular_momentum=3)
REST = Fields(position=3, orientation=4)
REST_ROWS = Fields(force=3, norm=1, torque=3)


class Load(NamedTuple):
    """A load on the buoy: force [N] and torque about C [N m] as UFL, integrated over `measure`.

    account: that of its power in the energy balance; None: weight and lines, accounted for elsewhere.  water: velocity
    of the water that causes a drag, or None.
    """

    account: str | None
    force: object
    torque: object
    measure: object
    water: object = None


class Spin(Evolution):
    """L_C . d of a buoy: not an unknown, but with its own rate, gamma x value + history."""

    def __init__(self, buoy: "Buoy"):
        self.gamma, self.history, self.followed = (compat.constant(buoy.mesh, 0.0) for _ in range(3))
        super().__init__(buoy.part, [(self.gamma, self.history)], True, [np.array([np.inf])])

    def values(self, u: np.ndarray) -> np.ndarray:
        out = np.empty(1)
        self.reader(u, out)()
        return out

    @property
    def size(self) -> int:
        return 1

    def reader(self, u: np.ndarray, out: np.ndarray) -> Work:
        y = MOTION.of(u[self.part.slice])
        return work(
            "spin", "spinning", {"quaternion": y.orientation, "angular_momentum": y.angular_momentum, "out": out}
        )

    def hand_out(self, level: int, gamma: float, history: np.ndarray) -> None:
        self.gamma.value, self.history.value = gamma, np.asarray(history).item()
        self.followed.value = 1.0

    def correction(self, y: tuple, L_C_t: Expr, inertia: Expr) -> Expr:
        """`forms.buoy.spin_correction`, active once a scheme has set its rule."""
        q4, L_C = y.orientation, y.angular_momentum
        rate = self.gamma * body.spin(q4, L_C) + self.history
        return self.followed * body.spin_correction(q4, L_C, L_C_t, rate, inertia)


class Buoy(Model):
    """Axis mesh, Real space and forms of a buoy."""

    def __init__(self, scene: Scene, name: str, dynamic: bool):
        self.scene, self.name, self.section, self.dynamic = scene, name, scene.network.buoys[name], dynamic
        self.fields = MOTION if dynamic else REST
        self.shape = shape_of(self.section)
        self.mass = mass_properties(self.section)
        wet = scene.sea is not None
        cells = WetHull.cells(scene.solver, self.shape) if wet else 1  # global equations need one cell
        nodes = np.arange(cells + 1.0)
        self.mesh = compat.interval_mesh(compat.MPI.COMM_SELF, nodes)
        self.state, self.part = fem.Function(compat.real_space(self.mesh, self.fields.size)), None
        self.memory = {"quaternion_drift": np.zeros(1)}  #: state of accepted steps other than unknowns
        #: t -> arguments of `moving_state`, or None: unchanged; no function if the buoy moves freely.
        self.motion: Callable[[float], tuple[np.ndarray, ...] | None] | None = None
        if dynamic:
            self.gamma, self.history = compat.constant(self.mesh, 0.0), fem.Function(self.state.function_space)
            self.spin = None  #: L_C . d, followed if a torque may act on the buoy
        else:
            self.relaxation, self.gauge = compat.constant(self.mesh, 0.0), None
            self.reference = fem.Function(self.state.function_space)
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic, lesser=at_most)
        self._above, self._beside = [], {}
        if self.sea.kinematics is not None:
            self._waves_at_points(np.flatnonzero(compat.cell_ends(self.mesh)[:, 0] == nodes[0]))
        ends = ufl.Measure("ds", domain=self.mesh, subdomain_data=compat.end_tags(self.mesh, nodes[0]))
        self.at_once = ends(1)  #: measure of the global equations
        self._numbers = Numbers(self.mesh, scene, lambda scene: [scene.network.buoys[self.name]])
        number = self._numbers.constant
        self.one = compat.constant(self.mesh, 1.0)
        self.M = number(lambda scene, b: self.mass.mass)
        self.center = number(lambda scene, b: self.mass.height)
        self.inertia = number(lambda scene, b: np.array(self.mass.inertia))
        self.gravity = number(lambda scene, _: np.array([0.0, 0.0, -scene.gravity]))
        #: Body vector from C to the mooring point.
        self.offset = self.offset_of(None)
        self._body_terms = self._called("body")
        own = {effect.name: c for effect, c in self._body_terms} if dynamic else {}
        #: Memory of the radiated waves, and forces of the incident ones, if the scene gives coefficients.
        self.memory_of_waves = Memory(self, own[effects.MEMORY]) if effects.MEMORY in own else None
        kinds: dict[str, type[OfComponents]] = {effects.DIFFRACTION: Diffraction, effects.DRIFT: SlowDrift}
        self.of_components = [kind(self, own[name]) for name, kind in kinds.items() if name in own]
        self.slow_drift = next((one for one in self.of_components if isinstance(one, SlowDrift)), None)
        terms = [pair for where in ("strip", "face") for pair in self._called(where)]
        water = self.shape, self.sea, self.center, terms
        self.hull = WetHull(self.mesh, self.section, scene.solver, *water) if wet else None

    def _waves_at_points(self, first):
        """Add points off the hull where an irregular sea is sampled; first: the cell of the measure `at_once`."""
        self._above.append(self.sea.kinematics.add(on_cells(self.mesh, first)))
        for effect in (e for e in effects.called_by(self.scene, "body", [self.section]) if e.looks_at):
            height = np.array([effect.looks_at(self.section)])
            points = on_cells(self.mesh, first, height, np.zeros((1, 1), np.int32))
            self._beside[effect.name] = self.sea.kinematics.add(points)

    def _seen_by(self, effect, state):
        """The body with the water at the point where an effect evaluates it."""
        points = self._beside.get(effect.name)
        return state if points is None else state._replace(flow=lambda x: self.sea.flow(x, points))

    def _called(self, where):
        """[(effect, its constants)] of the effects of the scene."""
        return [(effect, self._numbers.of(effect)) for effect in effects.called_by(self.scene, where, [self.section])]

    def constant(self, get: Callable[..., Any]) -> fem.Constant:
        """Constant on its mesh with the value get(scene, its section)."""
        return self._numbers.constant(get)

    def offset_of(self, fairlead: str | None) -> fem.Constant:
        """Constant: body vector from C to a fairlead; None: to the mooring point."""
        return self.constant(lambda scene, b: mooring_offset(b, fairlead))

    def change(self, scene: Scene) -> None:
        self.scene, self.section = scene, scene.network.buoys[self.name]
        self.mass = mass_properties(self.section)
        self._numbers.change(scene)
        for effect in (e for e in effects.EFFECTS if e.name in self._beside):
            self._beside[effect.name].source[:] = effect.looks_at(self.section)
        self.sea.change(scene)
        for part in (self.memory_of_waves, *self.of_components):
            if part is not None:
                part.change()

    # -- forms ------------------------------------------------------------------------------------------------------

    def rates(self) -> tuple:
        """Time derivatives of the state by name, affine in the unknown."""
        return MOTION.split(self.gamma * self.state + self.history)

    def kinematics(self) -> body.Body:
        """Pose and motion; no motion in statics."""
        y, motion = self.fields.split(self.state), None
        if self.dynamic:
            rates, R = self.rates(), rotation_matrix(y.orientation)
            motion = hull.body_motion(
                R, self.M, self.inertia, y.momentum, rates.momentum, y.angular_momentum, rates.angular_momentum
            )
        return body.Body(y.position, y.orientation, self.water_above, motion)

    def water_above(self, x: Expr) -> Flow:
        """Undisturbed water at C, or near the surface above it."""
        return self.sea.flow(x, *self._above)

    def point_loads(self, state: body.Body, attachments: Sequence[Attachment] = ()) -> list[Load]:
        """Weight, lines, and every effect that acts at a point of the body."""
        loads = [Load(None, self.M * self.gravity, None, self.at_once)]
        loads += [Load(e.account, *e.body(c, self._seen_by(e, state)), self.at_once) for e, c in self._body_terms]
        loads += [Load(None, *attachment.load(state), self.at_once) for attachment in attachments]
        return [load for load in loads if load.force is not None or load.torque is not None]

    def water_loads(self, state: body.Body) -> list[Load]:
        """Loads of the water, one or two for each effect, for balances; in the residual they are combined."""
        found = self.hull.loads(state) if self.hull else []
        return [Load(effect.account, *load) for effect, *load in found]

    def residuals(
        self, lines: Sequence[Attachment] = (), take_offs: Sequence[Attachment] = ()
    ) -> list[tuple[Part, ufl.Form]]:
        """Eqs. (8), (9), (10) as [(part, form), ...]; in statics the equilibrium of the same loads.

        The loads of several lines are separate forms with the same code, so that only one is compiled.
        """
        attachments = (*lines, *take_offs)
        state, point, one = self.kinematics(), self.at_once, self.one
        loads = self.point_loads(state, attachments if len(attachments) == 1 else ())
        force, torque = (add([getattr(load, name) for load in loads]) for name in ("force", "torque"))
        if self.dynamic:
            F, test_force, test_torque = self._momentum_balance(state, force, torque, attachments)
        else:
            F, test_force, test_torque = self._equilibrium(state, force, torque, lines)
        loads_of_water = self.hull.forms(state, test_force, test_torque) if self.hull is not None else []
        found = [(self.part, add_forms([one * F * point, *loads_of_water]))]
        for attachment in attachments if len(attachments) > 1 else ():
            pull, moment = attachment.load(state)
            G = ufl.inner(pull, test_force) + ufl.inner(moment, test_torque)
            found.append((self.part, -one * G * point))
        clamps = [attachment.clamp for attachment in attachments if attachment.clamp]
        return found + [(a.body_part, one * a.link(state) * point) for a in (*attachments, *clamps)]

    def _momentum_balance(self, state, force, torque, attachments):
        """Eq. (8) with the point loads, and the test functions of force and torque."""
        y, rates, test = MOTION.split(self.state), self.rates(), MOTION.split(self.part.test)
        F = body.translation(rates.position, y.momentum, self.M, test.position)
        F += body.linear_momentum(rates.momentum, force, test.momentum)
        F += body.orientation(rates.orientation, y.orientation, y.angular_momentum, self.inertia, test.orientation)
        F += body.angular_momentum(rates.angular_momentum, _or_zero(torque), test.angular_momentum)
        if torque is not None or self.hull is not None or attachments:  # else L_C is constant, to the last digit
            self.spin = self.spin or Spin(self)
            F += ufl.inner(self.spin.correction(y, rates.angular_momentum, self.inertia), test.angular_momentum)
        return F, test.momentum, test.angular_momentum

    def _equilibrium(self, state, force, torque, attachments):
        """Balance of the point loads, and the test functions of force and torque."""
        test, reference = REST_ROWS.split(self.part.test), REST.split(self.reference)
        inertia = self._numbers.constant(lambda *_: max(self.mass.inertia))
        gauge = self.gauge = self._numbers.constant(lambda *_: np.prod(self._sizes()[1:3]))
        loads, tests = (force, _or_zero(torque)), (test.force, test.norm[0], test.torque)
        numbers = (reference.position, reference.orientation), self.M, inertia, self.relaxation, gauge
        F = body.equilibrium(state.position, state.quaternion, *loads, *numbers, tests)
        if not attachments:
            F += body.held_horizontally(state.position, reference.position, gauge, test.force)
        return F, test.force, test.torque

    def wet_hull_form(self) -> ufl.Form:
        """Linear form of `WetHull.submerged` and, last, the elevation above C."""
        state = self.kinematics()
        form, eta = self.hull.submerged(state), self.water_above(state.position).surface
        test = form.arguments()[0]
        return form if eta is None else form + self.one * eta * test[SUBMERGED - 1] * self.at_once

    def follow_water(self, system: System) -> None:
        if self.hull is not None:
            self.hull.follow(system, self.state, self.fields)
        for force in self.of_components:
            force.follow(system)

    def publish_points(self) -> None:
        if self.hull is not None:
            self.hull.place_points(self.state, self.fields)
        for force in self.of_components:
            force.publish()

    # -- time -------------------------------------------------------------------------------------------------------

    def evolutions(self) -> list[Evolution]:
        """The state, of first order in time, whose momenta are rates computed by the scheme, and any further ones."""
        lagged = MOTION.mask("momentum", "angular_momentum")
        found = [Evolution(self.part, [(self.gamma, self.history)], lagged, [self.state_sizes])]
        if self.memory_of_waves is not None:
            self.memory_of_waves.part = self.part
        return [*found, *(one for one in (self.spin, self.memory_of_waves) if one is not None)]

    def clock(self, time: np.ndarray, u: np.ndarray) -> list:
        found, motion, state = [*super().clock(time, u), *self._weather(time)], self.motion, u[self.part.slice]
        if motion is None:
            return found

        def move() -> None:
            if (place := motion(time.item())) is not None:
                state[:] = self.moving_state(*place)

        return [*found, move]

    def _weather(self, time):
        """Functions that update varying wind and external force to time[0]; gusts act in dynamics only."""
        found, constants = [], {effect.key: c for effect, c in self._body_terms}
        wind, force = self.section.wind, self.section.external_force
        if wind is not None and varies(wind):
            c, seed = constants["wind"], seed_of(self.scene, wind) if self.dynamic else None
            speed, direction, blows = array_of(c.speed), array_of(c.direction), wind_over_time(wind, seed)

            def blow() -> None:
                speed[0], direction[:] = blows(time.item())

            found.append(blow)
        if force is not None and varies(force):
            value, pulls = array_of(constants["external_force"].force), force_over_time(force)
            found.append(lambda: value.__setitem__(slice(None), pulls(time.item())))
        return found

    def begin(self, u: np.ndarray) -> None:
        self.memory["quaternion_drift"][:] = 0.0

    def when_accepted(self, time: np.ndarray, u: np.ndarray) -> list:
        """Functions called after an accepted step: normalise the quaternion and record its deviation from unit
        length."""
        orientation = MOTION.of(u[self.part.slice]).orientation
        return [work("make_unit", "unit", {"quaternion": orientation, "drift": self.memory["quaternion_drift"]})]

    # -- numbers ----------------------------------------------------------------------------------------------------

    def moving_state(
        self, position: np.ndarray, orientation: np.ndarray, velocity: np.ndarray, angular_velocity: np.ndarray
    ) -> np.ndarray:
        """State of a body at C = position [m] with a unit quaternion, velocity [m/s] and omega (world frame) [1/s]."""
        R, inertia = rotation_of(orientation), np.array(self.mass.inertia)
        return MOTION.filled(
            position=position,
            momentum=self.mass.mass * velocity,
            orientation=orientation,
            angular_momentum=R @ (inertia * (R.T @ angular_velocity)),
        )

    def _sizes(self):
        """Typical length [m], force [N], moment arm [m] and speed [m/s]."""
        g = max(self.scene.gravity, 1.0)
        length = self.shape.height if self.shape else 1.0
        return length, self.mass.mass * g, length, np.sqrt(g * length)

    @property
    def state_sizes(self) -> np.ndarray:
        """Typical sizes of the 13 numbers (r_C, p, q_4, L_C), for relative errors."""
        length, _, _, speed = self._sizes()
        spin = max(self.mass.inertia) * speed / length
        return MOTION.filled(position=length, momentum=self.mass.mass * speed, orientation=1.0, angular_momentum=spin)

    def reach_and_force(self, line_length: float, force: float) -> tuple[float, float]:
        """Typical length [m] and force [N] of the buoy on a line; `force`: that of the line."""
        length, weight, _, _ = self._sizes()
        return max(length, line_length), max(weight, force)

    def blocks(self, line_length: float, force: float) -> list[Block]:
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


def _or_zero(torque):
    return ufl.zero(3) if torque is None else torque
