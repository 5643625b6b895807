"""Reuse of problems for scenes that differ in numbers only."""

from typing import Any

from ..scene import Scene
from .problem import Problem
from .structure import structure_of


class Pool:
    """Factory of problems that reuses those of earlier scenes of the same structure.

    For one scene at a time.  Results are bit for bit those of a new problem.
    """

    #: Number of structures kept, dynamic and static ones together.
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
        """Destroy all problems, at the end or after an error that may have left one in an undefined state."""
        while self._kept:
            Problem.destroy(self._kept.popitem()[1])


class _Kept(Problem):
    """Problem that is kept after use; `change` restores it to the state of a new one."""

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
        """Do nothing; the pool destroys the problem."""
