"""Radiation and diffraction of a buoy in the time domain, from coefficients of `potential_flow` (`forms.radiation`).

The memory is eliminated in each step.  With the scheme's z_t = gamma z + h in z_t = rate z + into . v,

    z = (into . v - h)/(gamma - rate),    F = -Re(out z) = force - damping v

which is affine in the unknowns and adds none.  z has a history like every evolving quantity, so it is included in
retried and adaptive steps, checkpoints and the companions of a run.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..solver import compat
from ..solver.c_code import address, core
from ..solver.system import System
from ..solver.unknowns import array_of
from ..solver.vector_ops import Work, work
from . import Array
from .airy import AirySum
from .drift import of_components, transfer
from .interface import Evolution
from .potential_flow import diffraction_at, modes_of_five, states_of
from .rigid import shape_of

if TYPE_CHECKING:
    from .buoy import Buoy


class Memory(Evolution):
    """Memory of the waves radiated by a buoy, without unknowns: in a step it reduces to constants of the forms.

    c: constants `damping` (5, 5) and `force` (5).  The states are the real and imaginary parts of each mode.
    """

    def __init__(self, buoy: "Buoy", c: Any) -> None:
        self.buoy, self.c = buoy, c
        self._modes = {name: np.zeros((0, 2)) for name in ("rate", "into", "out")}
        self.change()
        self._states = np.zeros(2 * len(self._modes["rate"]))
        gamma, history = compat.constant(buoy.mesh, 0.0), compat.constant(buoy.mesh, np.zeros(self.size))
        super().__init__(buoy.part, [(gamma, history)], False, [np.full(self.size, np.inf)])

    def change(self) -> None:
        """Take the numbers of the buoy's scene."""
        rate, into, out = modes_of_five(
            *states_of(self.buoy.scene, self.buoy.section), shape_of(self.buoy.section).height
        )
        for name, values in (("rate", rate), ("into", into), ("out", out)):
            pairs = np.stack([values.real, values.imag], axis=-1)
            if self._modes[name].shape != pairs.shape:
                self._modes[name] = np.zeros(pairs.shape)
            self._modes[name][:] = pairs

    @property
    def size(self) -> int:
        return len(self._states)

    def values(self, u: Array) -> Array:
        """Initial states: zero, as after a long time at rest."""
        return np.zeros(self.size)

    def _work(self, name: str, u: Array, out: Array) -> Work:
        (gamma, history), y = self.rates[0], self.buoy.fields.of(u[self.part.slice])
        state = {"momentum": y.momentum, "quaternion": y.orientation, "angular_momentum": y.angular_momentum}
        numbers = {"mass": array_of(self.buoy.M), "inertia": array_of(self.buoy.inertia)}
        rule = {"gamma": array_of(gamma), "history": array_of(history), **self._modes, "states": out}
        rest = {"damping": array_of(self.c.damping), "force": array_of(self.c.force)}
        return work(name, "memory", {"modes": self.size // 2, **rule, **state, **numbers, **rest}, self)

    def reader(self, u: Array, out: Array) -> Work:
        return self._work("recall", u, out)

    def handed(self, u: Array) -> list[Work]:
        return [self._work("eliminate", u, self._states)]

    def hand_out(self, level: int, gamma: float, history: Array | float) -> None:
        """Set the memory to zero: linear equations have their own."""
        for constant in (self.c.damping, self.c.force):
            array_of(constant)[:] = 0.0


class OfComponents:
    """A force of the wave components at the position of a buoy, computed in C: in a sea once per step, with its slope,
    at the predicted state; in a regular wave, or with `waves.kinematics` = "exact", before every evaluation.

    c: constants `force` (n) of the forms, and, if it varies within a step, `slope` (n, 2) and `place` (2).
    """

    hook: str  #: function in C

    def __init__(self, buoy: "Buoy", c: Any) -> None:
        self.buoy, self.c, self._contexts, self._kept = buoy, c, [], []
        self._publish: Callable[[], Any] | None = None
        self.change()

    def transfer(self, waves: AirySum, amplitude: Array) -> Array:
        """Coefficients of each component for the C code; amplitude (n, 1): that of a sea [m], 1 in a regular wave."""
        raise NotImplementedError

    def change(self) -> None:
        """Take the components of the buoy's scene."""
        sea, waves = self.buoy.sea, AirySum.of(self.buoy.scene)
        amplitude = waves.amplitude[:, None] if sea.kinematics else np.ones((len(waves.amplitude), 1))
        k = (waves.wavenumber * waves.cosine, waves.wavenumber * waves.sine)
        self._kept = [np.ascontiguousarray(x) for x in (*k, self.transfer(waves, amplitude))]
        self._kept += [sea.phases]
        for context, once in self._contexts:
            self._fill(context, once)

    def _fill(self, context: Any, once: bool) -> None:
        (kx, ky, transfer, phases), sea = self._kept, self.buoy.sea.kinematics
        once = once and sea is not None and not sea.exact
        context.serial = core().ffi.addressof(sea.waves, "serial") if once else core().ffi.NULL
        context.count, context.kx, context.ky = len(kx), address(kx), address(ky)
        context.transfer, context.phase, context.scale = address(transfer), address(phases), self.buoy.sea.scale

    def _context(self, read: Callable[[Any], Array], once: bool = False) -> Any:
        context = core().ffi.new("diffraction *")
        position = self.buoy.fields.of(read(self.buoy.state)).position
        context.position = address(position)
        for name, constant in vars(self.c).items():
            setattr(context, name, address(read(constant)))
        self._contexts.append((context, once))
        self._fill(context, once)
        return context

    def follow(self, system: System) -> None:
        """Sum the components at the position given by the unknowns of a System before each of its evaluations."""
        system.filled_by_hook(*vars(self.c).values())
        system.hooks.add(self.hook, self._context(system.numbers_of, once=True))

    def publish(self) -> None:
        """Update the constants from the Function of the unknowns, for forms that no System evaluates."""
        if self._publish is None:
            self._publish = partial(getattr(core().lib, self.hook), self._context(array_of), core().ffi.NULL)
        self._publish()


class Diffraction(OfComponents):
    """Diffraction forces, conjugate to the five velocities."""

    hook = "diffract"

    def transfer(self, waves: AirySum, amplitude: Array) -> Array:
        c, s = waves.cosine, waves.sine
        of_wave = diffraction_at(self.buoy.scene, self.buoy.section, waves.in_water, waves.wavenumber)
        surge, lean, heave = of_wave.T
        force = amplitude * np.column_stack([surge * c, surge * s, heave, lean * c, lean * s])
        return np.stack([force.real, force.imag], axis=-1)


class SlowDrift(OfComponents):
    """Horizontal mean drift force, slowly varying in a sea, by Newman's approximation (`drift`).

    numbers: the total force (3) [N] as of the last call of the function from `noting`; the force in the forms is
    without the strips' share.
    """

    hook = "drift"

    def __init__(self, buoy: "Buoy", c: Any) -> None:
        self.numbers, self._whole, self._noting = np.zeros(3), np.zeros(0), list[Work]()
        super().__init__(buoy, c)

    def noting(self, u: Array) -> Work:
        """Function that computes the total force at the position of C in the local unknowns u."""
        position = self.buoy.fields.of(u[self.buoy.part.slice]).position
        found = work("find_drift", "diffraction", {"position": position, "force": self.numbers}, self)
        self._noting.append(found)
        self._give(found.context)
        return found

    def _give(self, context: Any) -> None:
        self._fill(context, once=False)
        context.transfer = address(self._whole)

    def change(self) -> None:
        super().change()
        for one in self._noting:
            self._give(one.context)

    def transfer(self, waves: AirySum, amplitude: Array) -> Array:
        drift, ways = of_components(self.buoy.scene, self.buoy.section), (waves.cosine, waves.sine)
        whole = amplitude * np.column_stack([np.ones_like(drift.whole), *(drift.whole * way for way in ways)])
        self._whole = np.stack([whole, np.zeros_like(whole)], axis=-1)
        pairs = transfer(drift, *ways)
        pairs = amplitude[:, :, None] * pairs
        return np.stack([pairs.real, pairs.imag], axis=-1)
