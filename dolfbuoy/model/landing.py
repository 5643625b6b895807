"""Bodies at joints on the sea bed, of each as a whole; sinkers among them."""

from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from dolfinx import fem

from ..forms import seabed as form
from ..scene.lines import Body, Sinker
from ..solver import compat
from . import effects
from .contact import ContactParameters, friction_of, parameters_of_body
from .seabed import Bed

if TYPE_CHECKING:
    from .bodies import Bodies


class Landing(Bed):
    """Contact of `Bodies` with the bed.

    At rest sinkers are held at their places; in motion friction of their own holds them there, as long as it can.
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
            found.append((self.terms[0], form.holding(self._sinks, at_home)))
        return found

    def begin(self, u: np.ndarray) -> None:
        super().begin(u)
        for k in self._sinkers if self.held is not None else ():
            self.held.x.array[self._place[k]] = self.model.bodies[k].place

    def parameter_values(self) -> np.ndarray:
        """Numbers of the contact of every body."""
        return self._of_scene(lambda: np.array([self.parameters_of(body) for body in self.model.bodies]).T)

    def at(self, values: np.ndarray) -> np.ndarray:
        return values[self.model.dofs]

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        mesh = self.model.mesh
        space = compat.function_space(mesh, compat.element(mesh, "DG", 0, size))
        return space, size * (self.model.dofs[:, :1] // 3) + np.arange(size)

    def hold_body(self, name: str, place: np.ndarray) -> None:
        """Let friction hold the body at a joint on to a place."""
        self.held.x.array[self.model.dofs[self.model.names.index(name)]] = place

    def pressure(self, name: str, u: np.ndarray) -> float:
        """Force of the body at a joint on the bed at rest [N]."""
        k = self.model.names.index(name)
        depth = -self.gap(self.at(u[self.model.part.slice])[k])
        return self.parameters_of(self.model.bodies[k]).stiffness * max(depth, 0.0)
