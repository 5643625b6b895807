"""Common base of lines and bodies at joints: masses in water and on a sea bed, of second order in time."""

from typing import Any

import numpy as np
from dolfinx import fem

from ..forms.kinds import Expr
from ..forms.sea import Flow
from ..scene import Scene
from ..solver import compat
from . import effects
from .interface import Model
from .numbers import Numbers
from .sea import SeaState


class Masses(Model):
    """Lines, or bodies at joints, on their own `mesh` with unknowns in a `space`.

    where: name of the term of an Effect that applies to them.
    """

    where: str
    mesh: Any
    space: Any

    def _equip(self, scene, dynamic: bool) -> None:
        self.scene, self.dynamic, self.bed = scene, dynamic, None
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic)
        self.memory, self._sampled = {}, []

    def _count(self, sections, which) -> None:
        """Create the constants; sections: scene -> its sections; which: section number of each owned cell."""
        self.constants = Numbers(self.mesh, self.scene, sections, which)

    def _move(self) -> None:
        """Create the constants and Functions of the rates."""
        self.gamma_v, self.gamma_a = (compat.constant(self.mesh, 0.0) for _ in range(2))
        self.history_v, self.history_a = fem.Function(self.space), fem.Function(self.space)

    @property
    def rates(self) -> list[tuple[Any, Any]]:
        """(gamma, history) of velocity and acceleration."""
        return [(self.gamma_v, self.history_v), (self.gamma_a, self.history_a)]

    def _called(self, where: str) -> list[tuple[effects.Effect, Any]]:
        """[(effect, coefficient)] of the effects with such a term in any of the sections."""
        return [(e, self.constants.of(e)) for e in effects.called_by(self.scene, where, self.constants.sections)]

    def change(self, scene: Scene) -> None:
        self.scene = scene
        self.constants.change(scene)
        self.sea.change(scene)

    def water_at(self, r: Expr) -> Flow:
        """Undisturbed water at their position r."""
        return self.sea.flow(r, *self._sampled)

    def _forces_of_water(self, matter, r, point) -> list[tuple[effects.Effect, Any]]:
        """[(effect, force as UFL)] of the effects of the scene; matter: material of the line or body, for the terms."""
        flow, rho_w, wet = self.water_at(r), self.sea.density, self.wet_part()
        found = [(e, getattr(e, self.where)(c, matter, rho_w, flow, point)) for e, c in self._loads]
        return [(effect, force if wet is None else wet * force) for effect, force in found if force is not None]

    def follow_water(self, system: Any) -> None:
        super().follow_water(system)
        if self.bed is not None:
            self.bed.follow(system)

    def publish_points(self) -> None:
        super().publish_points()
        if self.bed is not None:
            self.bed.publish()

    def begin(self, u: np.ndarray) -> None:
        if self.bed is not None:
            self.bed.begin(u)

    def when_accepted(self, time: np.ndarray, u: np.ndarray) -> list:
        return self.bed.when_accepted(u) if self.bed is not None else []
