"""The sea bed under lines and bodies at joints: contact forces, memory of friction, uneven beds."""

from collections.abc import Callable
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ..forms import seabed as form
from ..scene.bathymetry import ORDERS
from . import effects
from .contact import ContactParameters, has_friction, height_of_bed, plane
from .masses import Masses


class Bed:
    """Contact of `masses.Masses` with the bed, at contact points defined by each subclass.

    `held`: r_a, the stick points of friction, a Function; None without friction, and in statics unless
    `seabed.start = "pulled"`.
    """

    def __init__(self, model: "Masses", space: Callable):
        self.model, scene, numbers = model, model.scene, model.constants
        self._known = None
        self.normal, self.level = (numbers.constant(lambda scene, _, i=i: plane(scene)[i]) for i in (0, 1))
        parts = (lambda section, i=i: self.parameters_of(section)[i] for i in range(len(ContactParameters._fields)))
        self.parameters = ContactParameters(*map(numbers.per_cell, parts))
        self.friction: Any = numbers.constant(lambda scene, _: scene.seabed.friction if model.dynamic else 0.0)
        rubs = has_friction(scene, model.dynamic)
        self.held = fem.Function(space()) if rubs else None
        self.memory = {"bed_holds": self.held.x.array} if rubs else {}
        self.ground = Terrain(self) if scene.seabed.depths is not None else None
        terms = effects.called_by(scene, "bed")
        self.terms = terms if rubs else [e for e in terms if e.bed is not form.friction]

    def parameters_of(self, section: Any) -> ContactParameters:
        """Contact parameters of a line or a body, in the present scene."""
        raise NotImplementedError

    def at(self, values: np.ndarray) -> np.ndarray:
        """Values at the contact points, (..., 3), from an array like the model's unknowns."""
        raise NotImplementedError

    def _of_scene(self, find):
        """Result of `find`, evaluated once per scene."""
        if self._known is None or self._known[0] is not self.model.scene:
            self._known = self.model.scene, find()
        return self._known[1]

    @property
    def coefficient(self) -> Any:
        """Friction coefficient as UFL."""
        return self.friction

    def coefficients(self) -> Any:
        """Friction coefficients at the contact points, as numbers."""
        return float(self.friction.value)

    # -- forms ---------------------------------------------------------------------------------------------------------

    def contact(self) -> form.Contact:
        """Contact at these points, per metre of a line and for a body as a whole."""
        x, *_, x_t, _ = self.model.kinematics()
        slide = None if self.held is None else x - self.held
        normal, gap = self.normal, None
        if self.ground is not None:
            normal, gap = self.ground.near().normal_and_gap(x)
        speed = None if x_t is None else ufl.dot(normal, x_t)
        gap = form.gap(self.normal, self.level, x) if gap is None else gap
        return form.Contact(normal, gap, *self.parameters[:3], speed, self.parameters.stick, slide)

    def forces(self) -> list[tuple[effects.Effect, Any]]:
        """[(effect, force as UFL)], per unstretched metre of a line [N/m], of a body [N]."""
        at = self.contact()
        return [(effect, effect.bed(self.coefficient, at)) for effect in self.terms]

    def powers(self) -> list[tuple[str, Any]]:
        """[(account, energy or power as UFL)] of these forces, for balances."""
        at, (_, *_, x_t, _) = self.contact(), self.model.kinematics()
        power = {form.support: form.damping_power(at)}
        if self.held is not None:
            power[form.friction] = ufl.inner(form.friction(self.coefficient, at), x_t)
        return [("elastic", form.spring_energy(at)), *((effect.account, power[effect.bed]) for effect in self.terms)]

    # -- memory --------------------------------------------------------------------------------------------------------

    @property
    def holds(self) -> np.ndarray:
        """Stick points of friction."""
        return self.held.x.array[self._place]

    def hold(self, places: np.ndarray) -> None:
        """Set the stick points."""
        self.held.x.array[self._place] = places

    def begin(self, u: np.ndarray) -> None:
        """Set the stick points to the present positions, so that friction has no force yet."""
        if self.held is not None:
            self.hold(self.at(u[self.model.part.slice]))

    def when_accepted(self, u: np.ndarray) -> list[Callable]:
        """Functions called after an accepted step."""
        return [] if self.held is None else [lambda: self.accept(u)]

    def accept(self, u: np.ndarray) -> None:
        """After an accepted step: let the stick points slide where friction exceeds its limit."""
        model, mu, speed = self.model, self.coefficients(), 0.0
        r = self.at(u[model.part.slice])
        n = self.normals(r)
        if model.dynamic:
            speed = _dot(model.gamma_v.value * r + self.at(model.history_v.x.array), n)
        k, c, sag, stick = self.parameter_values()
        below = np.maximum(-self.gap(r), 0.0)
        p = np.maximum(k * below - c * np.minimum(below / sag, 1.0) * speed, 0.0)
        slide = r - self.holds
        slide -= _dot(slide, n)[..., None] * n
        pull = stick * np.sqrt((slide * slide).sum(axis=-1))
        share = np.minimum(1.0, mu * p / np.maximum(pull, 1e-300))
        self.hold(r - share[..., None] * slide)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Distance of points (..., 3) from the bed [m]."""
        if self.ground is not None:
            return (x[..., 2] - height_of_bed(self.model.scene, x)) * self.normals(x)[..., 2]
        return x @ self.normal.value - self.level.value

    def normals(self, x: np.ndarray) -> np.ndarray:
        """Upward normal of the bed (3,); for an uneven bed the normals under points (..., 3)."""
        return self.normal.value if self.ground is None else self.ground.normals(x)

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        """Space of `size` numbers per contact point, and the dofs of each point, (..., size)."""
        raise NotImplementedError

    def follow(self, system: Any) -> None:
        """Provide an uneven bed to the forms of a System."""
        if self.ground is not None:
            self.ground.follow(system)

    def publish(self) -> None:
        """The same for forms that no System evaluates."""
        if self.ground is not None:
            self.ground.fill(self.ground.coefficient.x.array, self.ground.unknowns())


class Terrain:
    """An uneven bed for the forms of a Bed: height and derivatives at its points, updated before every evaluation."""

    SIZE = 2 + len(ORDERS)  #: x, y, and the height with its derivatives

    def __init__(self, bed: Bed):
        self.bed = bed
        space, self._place = bed.blocks(self.SIZE)
        self.coefficient = fem.Function(space)

    def near(self) -> form.Ground:
        """The bed near the contact points, as UFL."""
        c = [self.coefficient[i] for i in range(self.SIZE)]
        return form.Ground(c[0], c[1], c[2], (c[3], c[4]), (c[5], c[6], c[7]))

    def unknowns(self) -> np.ndarray:
        """The model's unknowns, from its Function."""
        return np.asarray(self.bed.model.part.function.x.array)

    def fill(self, values: np.ndarray, u: np.ndarray) -> None:
        """Write the numbers for the model's unknowns u to the values of the coefficient."""
        r = self.bed.at(u)
        depths = self.bed.model.scene.seabed.depths
        values[self._place] = np.concatenate([r[..., :2], depths.derivatives(r[..., 0], r[..., 1])], axis=-1)

    def follow(self, system: Any) -> None:
        """Fill before every evaluation of a System."""
        values, place = system.numbers_of(self.coefficient), self.bed.model.part.slice
        if values is not None:
            system.filled_by_hook(self.coefficient)
            system.hooks.add(lambda _: self.fill(values, system.u[place]))

    def normals(self, x: np.ndarray) -> np.ndarray:
        """Upward normals (..., 3) under points."""
        slopes = self.bed.model.scene.seabed.depths.derivatives(x[..., 0], x[..., 1])
        up = np.stack([-slopes[..., 1], -slopes[..., 2], np.ones(x.shape[:-1])], axis=-1)
        return up / np.linalg.norm(up, axis=-1, keepdims=True)


def _dot(vectors, n):
    """Components of vectors (..., 3) along one normal (3,), or along one for each."""
    return vectors @ n if n.ndim == 1 else (vectors * n).sum(axis=-1)
