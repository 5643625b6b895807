"""Problems that serve one scene after the other, where these differ in numbers only."""

from typing import Any

from ..scene import Scene
from .problem import Problem
from .structure import structure_of


class Pool:
    """Makes problems as the class Problem does, and hands out again those of an earlier scene of the same structure.

    Only for one scene at a time.  What comes out is bit for bit what a problem of its own would give.
    """

    #: Structures that are kept, dynamic and static ones together.
    most = 8

    def __init__(self) -> None:
        self._kept: dict[object, _Kept] = {}

    def problem(self, scene: Scene, dynamic: bool, comm: Any) -> Problem:
        """A Problem of the scene; its `destroy` does nothing, see `clear`."""
        what = (structure_of(scene), dynamic)
        found = self._kept.pop(what, None)
        if found is None:
            while len(self._kept) >= self.most:
                Problem.destroy(self._kept.pop(next(iter(self._kept))))
            found = _Kept(scene, dynamic, comm)
        else:
            found.change(scene)
        self._kept[what] = found  # the latest is the last
        return found

    def clear(self) -> None:
        """Destroy them all, because of an error that may have left one of them in any state, or at the end."""
        while self._kept:
            Problem.destroy(self._kept.popitem()[1])


class _Kept(Problem):
    """Stays when its user is done with it; another scene finds it as if it were new."""

    def __init__(self, scene: Scene, dynamic: bool, comm: Any):
        super().__init__(scene, dynamic, comm)
        self._first = self.system.u.copy()

    def change(self, scene: Scene) -> None:
        super().change(scene)
        self.newton.choose_solver(self.newton.direct)  # MUMPS takes its pivots from the first matrix
        self.newton.fallbacks = 0
        self.system.u[:] = self._first
        for model in self.models:
            for values in model.memory.values():
                values[:] = 0.0

    def destroy(self) -> None:
        """It is the pool that destroys it."""
