"""Bodies at joints that lie on the sea bed: contact and friction as of lines (`seabed`), of each body as a whole."""

import numpy as np
import ufl
from dolfinx import fem

from ..forms import seabed as form
from . import effects
from .seabed import Grip, contact, grip_of_body, plane, rubs


class Landing:
    """Contact of `Bodies` with the bed.

    number, per_body: make UFL numbers, of the scene and of each body.  `held`: r_a of each body, a Function like their
    places; None without friction, and in statics unless lines are taken as pulled.
    """

    def __init__(self, bodies, number, per_body):
        self.bodies, scene = bodies, bodies.scene
        self.normal, self.level = (number(lambda scene, _, i=i: plane(scene)[i]) for i in (0, 1))
        self.grip = Grip(*(per_body(lambda body, name=name: self._grip_of(body)[name]) for name in Grip._fields))
        self.friction = number(lambda scene, _: scene.seabed.friction if bodies.dynamic else 0.0)
        self.held = fem.Function(bodies.space) if rubs(scene, bodies.dynamic) else None
        self.memory = {} if self.held is None else {"bed_holds": self.held.x.array}
        terms = effects.called_by(scene, "bed")
        self.terms = terms if self.held is not None else [e for e in terms if e.bed is not form.friction]

    def _grip_of(self, body):
        return grip_of_body(self.bodies.scene, body.mass, body.volume)._asdict()

    def contact(self) -> form.Contact:
        """Of the bodies, as UFL."""
        r, r_t, _ = self.bodies.kinematics()
        return contact(self.normal, self.level, self.grip, r, r_t, self.held)

    def forces(self):
        """[(effect, force [N] as UFL)]."""
        at = self.contact()
        return [(effect, effect.bed(self.friction, at)) for effect in self.terms]

    def powers(self):
        """[(account, energy [J] or power [W])] for balances."""
        at, (_, r_t, _) = self.contact(), self.bodies.kinematics()
        power = {form.support: form.damping_power(at)}
        if self.held is not None:
            power[form.friction] = ufl.inner(form.friction(self.friction, at), r_t)
        return [("elastic", form.spring_energy(at)), *((effect.account, power[effect.bed]) for effect in self.terms)]

    # -- memory --------------------------------------------------------------------------------------------------------

    def hold(self, name, place):
        """Let friction hold the body at a joint on to a place."""
        self.held.x.array[self.bodies.dofs[self.bodies.names.index(name)]] = place

    def rub(self):
        """Let friction act in statics too."""
        self.friction.value = self.bodies.scene.seabed.friction

    def pressure(self, name, u):
        """What the body at a joint presses on the bed with at rest [N]."""
        k = self.bodies.names.index(name)
        r = u[self.bodies.part.slice][self.bodies.dofs[k]]
        return self._grip_of(self.bodies.bodies[k])["stiffness"] * max(self.level.value - r @ self.normal.value, 0.0)

    def begin(self, u):
        """Friction holds on where the bodies are."""
        if self.held is not None:
            self.held.x.array[:] = u[self.bodies.part.slice]

    def accept(self, u):
        """A step was taken: where friction pulls more than it can, it slides after the body."""
        if self.held is None:
            return
        bodies, n, mu = self.bodies, self.normal.value, float(self.friction.value)
        u = u[bodies.part.slice]
        r, speed = u[bodies.dofs], 0.0
        if bodies.dynamic:
            speed = (bodies.gamma_v.value * u + bodies.history_v.x.array)[bodies.dofs] @ n
        k, c, sag, stick = np.array([list(self._grip_of(body).values()) for body in bodies.bodies]).T
        below = np.maximum(self.level.value - r @ n, 0.0)
        p = np.maximum(k * below - c * np.minimum(below / sag, 1.0) * speed, 0.0)
        slide = r - self.held.x.array[bodies.dofs]
        slide -= (slide @ n)[:, None] * n
        pull = np.maximum(stick * np.linalg.norm(slide, axis=1), 1e-300)
        self.held.x.array[bodies.dofs] = r - slide * np.minimum(1.0, mu * p / pull)[:, None]
