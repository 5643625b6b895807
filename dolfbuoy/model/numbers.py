"""Numbers of a scene as constants of forms, which can be changed without recompilation."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from dolfinx import fem

from ..scene import Scene
from ..solver import compat
from . import Array


class Numbers:
    """Constants on one mesh, each with the function that computes it from the scene.

    sections: scene -> sections that these numbers belong to.  which: section number of each owned cell, if there are
    several sections.
    """

    def __init__(
        self,
        mesh: Any,
        scene: Scene,
        sections: Callable[[Any], Sequence[Any]] = lambda scene: [None],
        which: Array | None = None,
    ):
        self.mesh, self.scene, self._sections, self._which = mesh, scene, sections, which
        self.sections = sections(scene)
        self._given: list[tuple[Any, Callable[..., Any]]] = []
        self._per_cell: list[tuple[Any, Callable[..., Any]]] = []

    def constant(self, get: Callable[..., Any]) -> fem.Constant:
        """fem.Constant with the value get(scene, section) for the first section."""
        made = compat.constant(self.mesh, get(self.scene, self.sections[0]))
        self._given.append((made, get))
        return made

    def per_cell(self, get: Callable[..., Any]) -> "fem.Constant | fem.Function":
        """Value of get(section) as UFL: a Constant if the same for all sections, else a value per cell."""
        if len({get(section) for section in self.sections}) == 1:
            return self.constant(lambda _, section: get(section))
        made = fem.Function(compat.function_space(self.mesh, compat.element(self.mesh, "DG", 0)))
        self._per_cell.append((made, get))
        self._fill(made, get)
        return made

    def of(self, effect: Any) -> Any:
        """Numbers of an effect (`effects.Effect`) as UFL: one, several by name, or None if it has none."""
        if effect.numbers is None:
            return None
        if self._which is not None:
            return self.per_cell(lambda section: effect.given(self.scene, section)[""])
        values = effect.given(self.scene, self.sections[0])
        made = {
            name: None if value is None else self.constant(lambda *of, name=name: effect.given(*of)[name])
            for name, value in values.items()
        }
        return made[""] if "" in made else SimpleNamespace(**made)

    def _fill(self, made: fem.Function, get: Callable[..., Any]) -> None:
        values = np.array([get(section) for section in self.sections])
        made.x.array[compat.cell_dofs(made.function_space)[:, 0]] = values[self._which]
        made.x.scatter_forward()

    def change(self, scene: Scene) -> None:
        """Take the values of another scene of the same structure."""
        self.scene, self.sections = scene, self._sections(scene)
        for made, get in self._given:
            made.value = get(scene, self.sections[0])
        for made, get in self._per_cell:
            self._fill(made, get)
