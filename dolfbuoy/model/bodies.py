"""Bodies at joints: clumps and floats, each a point that one global index ties to the ends of the lines there."""

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from ..forms import joint as form
from ..solver import compat
from ..solver.unknowns import Block
from . import effects
from .evolution import Evolution
from .kinematics import on_points
from .landing import Landing
from .numbers import Numbers, Properties
from .sea import SeaState


class Bodies:
    """All bodies at free joints of a scene, on one rank: a mesh with a cell for each, whose place is its unknown.

    `names`: of the joints, in the order of the cells.
    """

    def __init__(self, scene, dynamic):
        self.scene, self.dynamic = scene, dynamic
        self.names = list(scene.network.bodies)
        self.mesh = compat.interval_mesh(MPI.COMM_SELF, np.arange(len(self.names) + 1.0))
        self.space = compat.function_space(self.mesh, compat.element(self.mesh, "DG", 0, 3))
        self.state, self.part = fem.Function(self.space), None
        self.dofs = np.empty((len(self.names), 3), dtype=int)  #: of each body, in the part
        cells = compat.cell_dofs(self.space)[:, 0]
        which = np.floor(compat.cell_ends(self.mesh).mean(axis=1)).astype(int)
        self.dofs[which] = 3 * cells[:, None] + np.arange(3)
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic)
        self._sampled = []
        if self.sea.kinematics is not None:
            self._sampled = [
                self.sea.kinematics.add(on_points(self.mesh, self.state, 3 * cells[:, None] + np.arange(3)))
            ]
        self.memory: dict[str, np.ndarray] = {}
        self._numbers = Numbers(self.mesh, scene, lambda scene: _bodies_of(scene)[0])
        self._properties = Properties(self._numbers, _bodies_of, which)
        number = self._properties.of
        self.body = form.JointBody(number(lambda body: body.mass), number(lambda body: body.volume))
        self.bed = Landing(self, self._numbers.constant, number) if scene.seabed else None
        self.memory |= self.bed.memory if self.bed else {}
        self.gravity = self._numbers.constant(lambda scene, _: np.array([0.0, 0.0, -scene.gravity]))
        self._loads = [(effect, self._coefficient(effect)) for effect in self._called()]
        if dynamic:
            self.gamma_v, self.gamma_a = (fem.Constant(self.mesh, 0.0) for _ in range(2))
            self.history_v, self.history_a = fem.Function(self.space), fem.Function(self.space)

    def _called(self):
        found = [e for e in effects.EFFECTS if e.joint and self.scene.sea]
        return [effect for effect in found if any(effect.called(self.scene, body) for body in self.bodies)]

    def _coefficient(self, effect):
        if effect.numbers is None:
            return None
        return self._properties.of(lambda body: effect.given(self.scene, body)[""])

    def change(self, scene):
        """Take the numbers of another scene of the same structure."""
        self.scene = scene
        self._numbers.change(scene)
        self._properties.change()
        self.sea.change(scene)

    # -- forms ------------------------------------------------------------------------------------------------------

    def kinematics(self):
        """(r, r_t, r_tt) as UFL; the last two are None in statics."""
        if not self.dynamic:
            return self.state, None, None
        v, a = self.gamma_v * self.state + self.history_v, self.gamma_a * self.state + self.history_a
        return self.state, v, a

    def water_forces(self):
        """[(effect, force [N] as UFL)] of what the scene calls for."""
        r, r_t, r_tt = self.kinematics()
        flow, point = self.water_at(r), form.Point(r_t, r_tt)
        found = [(e, e.joint(c, self.body, self.sea.density, flow, point)) for e, c in self._loads]
        return [(effect, force) for effect, force in found if force is not None]

    def water_at(self, r):
        """Undisturbed water at the bodies."""
        return self.sea.flow(r, *self._sampled)

    def follow_water(self, system):
        """An irregular sea follows the unknowns of a System."""
        self.sea.follow(system)

    def publish_points(self):
        """Put an irregular sea where the unknowns' Function says: for forms that no System evaluates."""
        self.sea.publish()

    @property
    def dx(self):
        """Measure by which an integrand counts once for each body."""
        return ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": 0})

    def residual(self, test):
        """Inertia less weight and forces of the water; the lines' rows are added by the common index."""
        _, _, r_tt = self.kinematics()
        F = -ufl.inner(form.weight_in_water(self.body, self.gravity, self.sea.density), test) * self.dx
        if r_tt is not None:
            F += self.body.mass * ufl.inner(r_tt, test) * self.dx
        for _, force in (*self.water_forces(), *(self.bed.forces() if self.bed else ())):
            F -= ufl.inner(force, test) * self.dx
        return F

    # -- time -------------------------------------------------------------------------------------------------------

    def evolutions(self) -> list[Evolution]:
        """r is of second order; its size counts where the lines are."""
        rates = [(self.gamma_v, self.history_v), (self.gamma_a, self.history_a)]
        return [Evolution(self.part, rates, False, [np.full(self.dofs.size, np.inf)] * 2)]

    def clock(self, time, u):
        """Functions that bring the sea to time[0]."""
        return self.sea.clock(time)

    @property
    def bodies(self):
        """Their sections, in the order of the names."""
        return _bodies_of(self.scene)

    def begin(self, u):
        """Memory as at the start of a run."""
        if self.bed is not None:
            self.bed.begin(u)

    def when_accepted(self, time, u):
        """Functions that are called when a step was taken."""
        return [lambda: self.bed.accept(u)] if self.bed is not None else []

    def hold(self, u, h):
        """In statics on a sea bed the lines alone are held."""

    def let_go(self):
        """They were not held."""

    # -- numbers ----------------------------------------------------------------------------------------------------

    def places(self):
        """They belong to no place."""
        return np.zeros(0)

    def force_dofs(self):
        """Local unknowns that are forces: none."""
        return np.zeros(0, dtype=int)

    def blocks(self, length, force):
        """Block of the positions; typical length [m] and force [N] of the lines."""
        dofs = self.part.offset + self.dofs.ravel()
        mass = max(body.mass for body in _bodies_of(self.scene)) * length
        return [Block("position of bodies at joints", dofs, length, force, mass, 2)]


def _bodies_of(scene):
    return list(scene.network.bodies.values())
