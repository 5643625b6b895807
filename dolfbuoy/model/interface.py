"""Interface of a model to a Problem and to time stepping: unknowns with rates, state of accepted steps."""

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
    """Unknowns whose time derivatives appear in the forms.

    rates: for each time derivative, from the first on, the constant gamma and the Function history of
    rate = gamma x unknown + history.  lagged: which unknowns are themselves rates computed by the scheme (momenta), a
    mask or a bool.  sizes: typical size of the unknowns and of every derivative except the last, for relative errors;
    inf for those that are not controlled.
    """

    part: Part
    rates: list[tuple[Any, Any]]
    lagged: Array | bool
    sizes: list[Array]

    @property
    def order(self) -> int:
        """Order in time."""
        return len(self.rates)

    @property
    def size(self) -> int:
        return self.part.size

    def values(self, u: Array) -> Array:
        """The unknowns among all local unknowns, a view."""
        return u[self.part.slice]

    def reader(self, u: Array, out: Array) -> Any:
        """(`out`, the view to be copied to it), or a function that writes them to `out`; the memory of u is fixed."""
        return out, self.values(u)

    def handed(self, u: Array) -> list[Any]:
        """Functions called after a step has passed its rules to the forms."""
        return []

    def hand_out(self, level: int, gamma: float, history: Array | float) -> None:
        """Pass the rule of a derivative (0: the first) to the forms."""
        constant, function = self.rates[level]
        constant.value = gamma
        function.x.array[:] = history


class Model(Protocol):
    """Lines, bodies at joints, or a buoy; u: all local unknowns of the Problem, of which those of `part` are its own.

    memory: state of accepted steps other than unknowns.  relaxation and reference: constant and Function of the inertia
    in the damped motion of statics, or None.  The methods here are defaults.
    """

    scene: "Scene"
    dynamic: bool
    part: Part
    sea: "SeaState"
    memory: dict[str, Array]
    relaxation: Any = None
    reference: Any = None

    def change(self, scene: "Scene") -> None:
        """Take the values of another scene of the same structure."""

    def evolutions(self) -> list[Evolution]:
        """Its unknowns with time derivatives, in order."""
        ...

    def blocks(self, length: float, force: float) -> list[Any]:
        """Blocks of its unknowns; typical length [m] and force [N] of the lines."""
        ...

    def places(self) -> Array:
        """Coordinates of its unknowns, which identify a numbering; empty if they have none."""
        return np.zeros(0)

    def force_dofs(self) -> Array:
        """Local unknowns that are forces."""
        return np.zeros(0, dtype=int)

    # -- time

    def clock(self, time: Array, u: Array) -> list[Callable[[], Any]]:
        """Functions that update everything prescribed over time, also in u, to time[0]."""
        return self.sea.clock(time)

    def begin(self, u: Array) -> None:
        """Reset the memory to the start of a run."""

    def when_accepted(self, time: Array, u: Array) -> list[Callable[[], Any]]:
        """Functions called after an accepted step to time[0]; they return whether the equations have changed."""
        return []

    # -- water

    def follow_water(self, system: "System") -> None:
        """Evaluate the water at points that follow the unknowns of a System."""
        self.sea.follow(system)

    def publish_points(self) -> None:
        """Update these points from the Function of the unknowns, for forms that no System evaluates."""
        self.sea.publish()

    # -- relaxation, in statics

    def hold(self, u: Array, h: float) -> None:
        """Set the inertia of a step of h [s] from rest at the positions in u."""
        if self.relaxation is not None:
            self.reference.x.array[:], self.relaxation.value = u[self.part.slice], h**-2

    def let_go(self) -> None:
        """Remove the inertia."""
        if self.relaxation is not None:
            self.relaxation.value = 0.0
