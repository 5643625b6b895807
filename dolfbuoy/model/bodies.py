"""Bodies at joints (clumps, floats and sinkers) and their contact with the bed: each is a point that shares a global
index with the ends of the lines there."""

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ..elsewhere import MPI
from ..forms import joint as form
from ..forms import seabed
from ..forms.kinds import Expr
from ..scene import Scene
from ..scene.lines import Body, Sinker
from ..solver import compat
from ..solver.unknowns import Block
from . import effects
from .contact import ContactParameters, friction_of, parameters_of_body
from .effects import Effect, called_by
from .interface import Evolution
from .kinematics import on_points
from .masses import Masses
from .seabed import Bed


class Landing(Bed):
    """Contact of `Bodies` with the bed.

    In statics sinkers are fixed in place; in dynamics their own friction holds them up to its limit.
    """

    def __init__(self, bodies: "Bodies"):
        super().__init__(bodies, lambda: bodies.space)
        self._place, number, moves = bodies.dofs, bodies.constants.per_cell, bodies.dynamic
        self._sinkers = [k for k, body in enumerate(bodies.bodies) if isinstance(body, Sinker)]
        if self._sinkers:
            self._sinks: Any = number(lambda body: float(isinstance(body, Sinker)))
            self._own: Any = number(lambda body: body.friction if isinstance(body, Sinker) and moves else 0.0)
            self._home = [number(lambda body, i=i: getattr(body, "place", np.zeros(3))[i]) for i in range(3)]

    def parameters_of(self, section: Body) -> ContactParameters:
        return parameters_of_body(self.model.scene, section)

    @property
    def coefficient(self) -> Any:
        return self.friction * (1 - self._sinks) + self._own if self._sinkers else self.friction

    def coefficients(self) -> Any:
        found = np.full(len(self.model.bodies), super().coefficients())
        if self.model.dynamic:
            found[self._sinkers] = [friction_of(self.model.scene, self.model.bodies[k]) for k in self._sinkers]
        return found

    def forces(self) -> list[tuple[effects.Effect, Any]]:
        found = super().forces()
        if self._sinkers and not self.model.dynamic:
            at_home = self.contact()._replace(displacement=self.model.kinematics()[0] - ufl.as_vector(self._home))
            found.append((self.terms[0], seabed.holding(self._sinks, at_home)))
        return found

    def begin(self, u: np.ndarray) -> None:
        super().begin(u)
        for k in self._sinkers if self.held is not None else ():
            self.held.x.array[self._place[k]] = self.model.bodies[k].place

    def parameter_values(self) -> np.ndarray:
        """Contact parameters of every body."""
        return self._of_scene(lambda: np.array([self.parameters_of(body) for body in self.model.bodies]).T)

    def at(self, values: np.ndarray) -> np.ndarray:
        return values[self.model.dofs]

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        mesh = self.model.mesh
        space = compat.function_space(mesh, compat.element(mesh, "DG", 0, size))
        return space, size * (self.model.dofs[:, :1] // 3) + np.arange(size)

    def hold_body(self, name: str, place: np.ndarray) -> None:
        """Set the stick point of the friction of the body at a joint."""
        self.held.x.array[self.model.dofs[self.model.names.index(name)]] = place

    def pressure(self, name: str, u: np.ndarray) -> float:
        """Static force of the body at a joint on the bed [N]."""
        k = self.model.names.index(name)
        depth = -self.gap(self.at(u[self.model.part.slice])[k])
        return self.parameters_of(self.model.bodies[k]).stiffness * max(depth, 0.0)


class Bodies(Masses):
    """All bodies at free joints of a scene, on one rank: a mesh with a cell for each, whose position is the unknown.

    `names`: names of the joints, in the order of the cells.
    """

    where = "joint"

    def __init__(self, scene: Scene, dynamic: bool):
        self.names = list(scene.network.bodies)
        self.mesh = compat.interval_mesh(MPI.COMM_SELF, np.arange(len(self.names) + 1.0))
        self.space = compat.function_space(self.mesh, compat.element(self.mesh, "DG", 0, 3))
        self.state, self.part = fem.Function(self.space), None
        self.dofs = np.empty((len(self.names), 3), dtype=int)  #: of each body, in the part
        at_cells = 3 * compat.cell_dofs(self.space)[:, :1] + np.arange(3)
        which = np.floor(compat.cell_ends(self.mesh).mean(axis=1)).astype(int)
        self.dofs[which] = at_cells
        self._equip(scene, dynamic)
        if self.sea.kinematics is not None:
            self._sampled.append(self.sea.kinematics.add(on_points(self.mesh, self.state, at_cells)))
        self._count(lambda scene: list(scene.network.bodies.values()), which)
        number = self.constants.per_cell
        self.body = form.JointBody(number(lambda body: body.mass), number(lambda body: body.volume))
        self.bed = Landing(self) if scene.seabed else None
        self.memory |= self.bed.memory if self.bed else {}
        self.gravity = self.constants.constant(lambda scene, _: np.array([0.0, 0.0, -scene.gravity]))
        self._loads = self._called(self.where)
        if dynamic:
            self._move()

    @property
    def bodies(self) -> list:
        """Their sections, in the order of the names."""
        return self.constants.sections

    # -- forms ------------------------------------------------------------------------------------------------------

    def kinematics(self) -> tuple[Expr, Expr | None, Expr | None]:
        """(r, r_t, r_tt) as UFL; the last two are None in statics."""
        if not self.dynamic:
            return self.state, None, None
        v, a = self.gamma_v * self.state + self.history_v, self.gamma_a * self.state + self.history_a
        return self.state, v, a

    def water_forces(self) -> list[tuple[Effect, Expr]]:
        """[(effect, force [N] as UFL)] of the effects of the scene."""
        r, r_t, r_tt = self.kinematics()
        return self._forces_of_water(self.body, r, form.Point(r_t, r_tt))

    def wet_part(self) -> Expr | None:
        if not called_by(self.scene, "joint_wet"):
            return None
        r = self.kinematics()[0]
        return form.wet_part(self.body, self.water_at(r), r)

    def weight(self) -> list[Expr]:
        """`forms.joint.weight` [N]."""
        return form.weight(self.body, self.gravity, self.sea.density, self.wet_part())

    @property
    def dx(self) -> ufl.Measure:
        """Measure that counts an integrand once for each body."""
        return ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": 0})

    def residual(self, test: Expr) -> ufl.Form:
        """Inertia less weight and forces of the water; the lines contribute through the common index."""
        _, _, r_tt = self.kinematics()
        F = -sum(ufl.inner(force, test) * self.dx for force in self.weight())
        if r_tt is not None:
            F += self.body.mass * ufl.inner(r_tt, test) * self.dx
        for _, force in (*self.water_forces(), *(self.bed.forces() if self.bed else ())):
            F -= ufl.inner(force, test) * self.dx
        return F

    # -- time -------------------------------------------------------------------------------------------------------

    def evolutions(self) -> list[Evolution]:
        """Evolution of r, of second order in time; its error is controlled by the lines, hence infinite sizes."""
        return [Evolution(self.part, self.rates, False, [np.full(self.dofs.size, np.inf)] * 2)]

    def blocks(self, length: float, force: float) -> list[Block]:
        dofs = self.part.offset + self.dofs.ravel()
        mass = max(body.mass for body in self.bodies) * length
        return [Block("position of bodies at joints", dofs, length, force, mass, 2)]
