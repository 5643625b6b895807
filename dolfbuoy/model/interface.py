"""Interface of a model to a Problem and to time stepping: unknowns with rates, memory of accepted steps."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..solver.unknowns import Part
from . import Array

if TYPE_CHECKING:
    from ..scene import Scene
    from ..solver.system import System
    from .sea import SeaState


@dataclass
class Evolution:
    """Unknowns whose rates stand in the forms.

    rates: of each time derivative, from the first on, the constant gamma and the Function history of
    rate = gamma x unknown + history.  lagged: which unknowns are themselves rates that the scheme makes (momenta), a
    mask or a bool.  sizes: typical size of the unknowns, and of every derivative but the last, for relative errors; inf
    for those that do not count.
    """

    part: Part
    rates: list[tuple[Any, Any]]
    lagged: Array | bool
    sizes: list[Array]

    @property
    def order(self) -> int:
        """In time."""
        return len(self.rates)

    @property
    def size(self) -> int:
        return self.part.size

    def values(self, u: Array) -> Array:
        """The unknowns among all local unknowns, a view."""
        return u[self.part.slice]

    def reader(self, u: Array, out: Array) -> Any:
        """(`out`, the view to be copied there), or a function that puts them into `out`; u stays in place."""
        return out, self.values(u)

    def handed(self, u: Array) -> list[Any]:
        """Functions that are called when a step has handed its rules to the forms."""
        return []

    def hand_out(self, level: int, gamma: float, history: Array | float) -> None:
        """Give the forms the rule of a derivative (0: the first)."""
        constant, function = self.rates[level]
        constant.value = gamma
        function.x.array[:] = history


class Model(Protocol):
    """Lines, bodies at joints, or a buoy; u: all local unknowns of the Problem, of which those of `part` are its own.

    memory: what accepted steps leave behind besides unknowns.  relaxation and reference: constant and Function of the
    inertia that holds it in the damped motion of statics, None without.  What is written here is that of a model
    without anything of its own.
    """

    scene: "Scene"
    dynamic: bool
    part: Part
    sea: "SeaState"
    memory: dict[str, Array]
    relaxation: Any = None
    reference: Any = None

    def change(self, scene: "Scene") -> None:
        """Take the numbers of another scene of the same structure."""

    def evolutions(self) -> list[Evolution]:
        """Its unknowns in time, in their order."""
        ...

    def blocks(self, length: float, force: float) -> list[Any]:
        """Blocks of its unknowns; typical length [m] and force [N] of the lines."""
        ...

    def places(self) -> Array:
        """Places of its unknowns, by which a numbering is recognised; empty if they belong to no place."""
        return np.zeros(0)

    def force_dofs(self) -> Array:
        """Local unknowns that are forces."""
        return np.zeros(0, dtype=int)

    # -- time

    def clock(self, time: Array, u: Array) -> list[Callable[[], Any]]:
        """Functions that bring what is given as a function of time, in u too, to time[0]."""
        return self.sea.clock(time)

    def begin(self, u: Array) -> None:
        """Memory as at the start of a run."""

    def when_accepted(self, time: Array, u: Array) -> list[Callable[[], Any]]:
        """Functions that are called when a step to time[0] was taken; they say whether the equations are others now."""
        return []

    # -- water

    def follow_water(self, system: "System") -> None:
        """Let the points where the water is looked at follow the unknowns of a System."""
        self.sea.follow(system)

    def publish_points(self) -> None:
        """Put these points where the unknowns' Function says: for forms that no System evaluates."""
        self.sea.publish()

    # -- relaxation, in statics

    def hold(self, u: Array, h: float) -> None:
        """Inertia of a step of h [s] from rest in the positions of u."""
        if self.relaxation is not None:
            self.reference.x.array[:], self.relaxation.value = u[self.part.slice], h**-2

    def let_go(self) -> None:
        """No inertia."""
        if self.relaxation is not None:
            self.relaxation.value = 0.0
