"""Numbers of a scene as constants of forms, which can be changed without compiling anything again."""

from types import SimpleNamespace

from dolfinx import fem


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
