"""Numbers of a scene as constants of forms, which can be changed without compiling anything again."""

from types import SimpleNamespace

import numpy as np
from dolfinx import fem

from ..solver import compat


class Numbers:
    """Constants on one mesh, each with the function of the scene that it comes from.

    section: of the scene, that these numbers belong to, as a function of the scene.
    """

    def __init__(self, mesh, scene, section=lambda scene: None):
        self.mesh, self.scene, self._section, self._given = mesh, scene, section, []

    def constant(self, get):
        """fem.Constant with the value get(scene, section)."""
        made = fem.Constant(self.mesh, get(self.scene, self._section(self.scene)))
        self._given.append((made, get))
        return made

    def of(self, effect):
        """Constants of an effect (`effects.Effect`): one, several by name, or None if it has no numbers."""
        if effect.numbers is None:
            return None
        values = effect.given(self.scene, self._section(self.scene))
        made = {name: None if value is None else self._of(effect, name) for name, value in values.items()}
        return made[""] if "" in made else SimpleNamespace(**made)

    def _of(self, effect, name):
        return self.constant(lambda scene, section: effect.given(scene, section)[name])

    def change(self, scene):
        """Take the numbers of another scene of the same structure."""
        self.scene = scene
        for made, get in self._given:
            made.value = get(scene, self._section(scene))


class Properties:
    """Numbers of several sections as UFL: a Constant where all have the same, else a number on each cell of a mesh.

    numbers: of the mesh, for the constants.  sections: of the scene, as a function of the scene.  which: of each owned
    cell, the number of its section.
    """

    def __init__(self, numbers, sections, which):
        self.numbers, self._sections, self._which, self._per_cell = numbers, sections, which, []

    def of(self, get):
        """UFL number of get(section)."""
        values = self._values(get)
        if len(set(values)) == 1:
            return self.numbers.constant(lambda scene, _: get(self._sections(scene)[0]))
        mesh = self.numbers.mesh
        made = fem.Function(compat.function_space(mesh, compat.element(mesh, "DG", 0)))
        self._per_cell.append((made, get))
        self._fill(made, values)
        return made

    def _values(self, get):
        return [get(section) for section in self._sections(self.numbers.scene)]

    def _fill(self, made, values):
        made.x.array[compat.cell_dofs(made.function_space)[:, 0]] = np.array(values)[self._which]
        compat.scatter_forward(made)

    def change(self):
        """Take the numbers of the scene that `numbers` has by now."""
        for made, get in self._per_cell:
            self._fill(made, self._values(get))
