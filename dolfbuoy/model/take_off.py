"""A power take-off between two points, on its own mesh with their positions as unknowns.

An end at a free joint has the global index of the joint, like a body there.  An end on a buoy is an attachment: six
unknowns shared by both meshes.  A fixed end is not an unknown, and its row is the reaction.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ..elsewhere import MPI
from ..forms import take_off as form
from ..forms.kinds import Expr
from ..scene import Scene
from ..scene.network import End
from ..solver import compat
from ..solver.unknowns import Block, Part
from . import Array, effects
from .attachment import FIELDS, Attachment
from .buoy import Buoy
from .interface import Evolution, Model
from .numbers import Numbers
from .prescribed_ends import held, motion_of
from .sea import SeaState


class OnBuoy(Attachment):
    """An end on a buoy: (r_O, T_O) as at a line's end, with T_O the force of the take-off on the buoy."""

    def __init__(self, mesh: Any, buoy: Buoy, fairlead: str | None):
        self.buoy, self.rank, self.clamp = buoy, 0, None
        self.offset = buoy.offset_of(fairlead) if fairlead else buoy.offset
        self._on_line = fem.Function(compat.real_space(mesh, FIELDS.size))
        self._on_body = fem.Function(compat.real_space(buoy.mesh, FIELDS.size))
        self.line_part = self.body_part = None

    place: Any = property(lambda self: FIELDS.split(self._on_line).point)
    values = property(lambda self: self._on_line)

    def equation(self, force: Expr) -> Expr:
        """Equation for T_O, the force of the take-off on the buoy."""
        test = FIELDS.split(self.line_part.test).force
        return ufl.inner(FIELDS.split(self._on_line).force - force, test)


class AtPoint:
    """An end at a joint, or a fixed one: three numbers, its position."""

    buoy = None

    def __init__(self, mesh: Any):
        self._place = fem.Function(compat.real_space(mesh, 3))
        self.line_part: Any = None

    place: Any = property(lambda self: ufl.as_vector([self._place[i] for i in range(3)]))
    values = property(lambda self: self._place)
    slice = property(lambda self: self.line_part.slice)

    def number(self, offset: int) -> list[Part]:
        """Take the unknowns `offset` ... `offset` + 3."""
        self.line_part = Part("take-off", self._place, offset)
        return [self.line_part]

    def equation(self, force: Expr) -> Expr:
        """The force of the take-off there, added to others; at a fixed end the residual is the reaction."""
        return -ufl.inner(force, ufl.as_vector([self.line_part.test[i] for i in range(3)]))


class TakeOff(Model):
    """One take-off of a scene, on the first rank; `ends`: its first and second end."""

    def __init__(self, scene: Scene, name: str, dynamic: bool, buoys: Mapping[str, Buoy]):
        self.scene, self.name, self.dynamic, self.memory = scene, name, dynamic, {}
        self.mesh = compat.interval_mesh(MPI.COMM_SELF, np.arange(2.0))
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic and bool(scene.waves and not scene.waves.summed))
        self._numbers = Numbers(self.mesh, scene, lambda scene: [scene.network.take_offs[name].section])
        self.ends = [self._end(end, buoys) for end in scene.network.take_offs[name].ends]
        self._terms = [
            (effect, self._numbers.of(effect))
            for effect in effects.called_by(scene, "take_off", self._numbers.sections)
        ]
        self.dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": 0})
        self.one = compat.constant(self.mesh, 1.0)
        self.numbers = np.zeros(3)  #: length [m], tension [N] and absorbed power [W] from `note`
        #: End (0 or 1) -> its position [m] as a function of time, overriding the scene's; and the time all stopped.
        self.driven: dict[int, Callable[[float], Array]] = {}
        self.stopped: Array | None = None
        if dynamic:
            self.gamma = compat.constant(self.mesh, 0.0)
            self._histories = [fem.Function(end.values.function_space) for end in self.ends]

    def _end(self, end: End, buoys: Mapping[str, Buoy]) -> Any:
        return OnBuoy(self.mesh, buoys[str(end.name)], end.fairlead) if end.kind == "buoy" else AtPoint(self.mesh)

    @property
    def section(self) -> Any:
        """Its scene section."""
        return self._numbers.sections[0]

    @property
    def holders(self) -> tuple[End, End]:
        """Holders of its ends."""
        return self.scene.network.take_offs[self.name].ends

    def number(self, offset: int) -> list[Part]:
        """Take the unknowns from `offset` on; returns the parts, including those on the meshes of buoys."""
        parts: list[Part] = []
        for end in self.ends:
            parts += end.number(offset)
            offset = end.slice.stop
        return parts

    @property
    def slice(self) -> slice:
        """Place among the local unknowns."""
        return slice(self.ends[0].slice.start, self.ends[1].slice.stop)

    def change(self, scene: Scene) -> None:
        self.scene, self.stopped = scene, None
        self._numbers.change(scene)
        self.sea.change(scene)

    # -- forms ------------------------------------------------------------------------------------------------------

    def stretch(self) -> form.Stretch:
        """`forms.take_off.Stretch`, without a rate in statics."""
        places = [end.place for end in self.ends]
        if not self.dynamic:
            return form.stretch(*places)
        rates = [
            self.gamma * place + ufl.as_vector([history[i] for i in range(3)])
            for place, history in zip(places, self._histories, strict=True)
        ]
        return form.stretch(*places, *rates)

    def tensions(self, stretch: form.Stretch) -> list[tuple[effects.Effect, Expr]]:
        """[(effect, tension [N] as UFL)] of the effects of the scene."""
        found = [(effect, effect.take_off(c, stretch)) for effect, c in self._terms]
        return [(effect, tension) for effect, tension in found if tension is not None]

    def energies(self) -> list[tuple[str, Expr, ufl.Measure]]:
        """[(account, energy or power, measure)], for balances."""
        stretch = self.stretch()
        found = [("elastic", self.one * e.take_off_energy(c, stretch)) for e, c in self._terms if e.take_off_energy]
        found += [
            (effect.account, -self.one * tension * stretch.rate)
            for effect, tension in self.tensions(stretch)
            if not effect.take_off_energy
        ]
        return [(account, value, self.dx) for account, value in found]

    def residuals(self) -> list[tuple[Part, ufl.Form]]:
        """Equations of its ends, [(part, form), ...]."""
        stretch = self.stretch()
        tensions = [tension for _, tension in self.tensions(stretch)]
        force = sum(tensions[1:], tensions[0]) * stretch.direction if tensions else 0 * stretch.direction
        return [
            (end.line_part, self.one * end.equation(sign * force) * self.dx)
            for end, sign in zip(self.ends, (1, -1), strict=True)
        ]

    def on(self, buoy: Buoy) -> list[OnBuoy]:
        """Its ends on a buoy."""
        return [end for end in self.ends if end.buoy is buoy]

    # -- unknowns -----------------------------------------------------------------------------------------------------

    def free(self) -> Array:
        """Its unknowns not shared with joints: those of ends on buoys."""
        places = [np.arange(end.slice.start, end.slice.stop) for end in self.ends if end.buoy]
        return np.concatenate([np.zeros(0, int), *places])

    def at_joint(self, name: str) -> list[Array]:
        """Unknowns (3,) of its ends at a free joint."""
        pairs = zip(self.ends, self.holders, strict=True)
        return [np.arange(e.slice.start, e.slice.stop) for e, h in pairs if h.kind == "joint" and h.name == name]

    def evolutions(self) -> list[Evolution]:
        """Evolutions of the positions of its ends; errors are controlled by lines and buoys, hence infinite sizes."""
        return [
            Evolution(end.line_part, [(self.gamma, history)], False, [np.full(end.line_part.size, np.inf)])
            for end, history in zip(self.ends, self._histories, strict=True)
        ]

    def blocks(self, length: float, force: float) -> list[Block]:
        return []  # the buoy has those of its attachments

    def force_dofs(self) -> Array:
        return np.concatenate([np.zeros(0, int), *(end.dofs().force for end in self.ends if end.buoy)])

    # -- time ---------------------------------------------------------------------------------------------------------

    def clock(self, time: Array, u: Array) -> list[Callable[[], Any]]:
        """Functions that update the fixed or moved ends to time[0]."""
        ends = []
        for number, (end, holder) in enumerate(zip(self.ends, self.holders, strict=True)):
            if holder.held and holder.top is not None:
                own = motion_of(holder.top) if holder.kind == "prescribed" else holder.top.position
                dofs = np.arange(end.slice.start, end.slice.stop)
                ends.append((dofs, self.driven.get(number, own)))
        return held(ends, time if self.stopped is None else self.stopped, u) if ends else []

    def stop(self, time: Array) -> None:
        """Stop moving ends at their positions at this time."""
        self.stopped = time

    def follow_water(self, system: Any) -> None:
        """Do nothing: there is no water here."""

    def publish_points(self) -> None:
        """Do nothing: there is no water here."""

    # -- numbers ------------------------------------------------------------------------------------------------------

    def velocities(self, u: Array) -> list[Array]:
        """Velocities of its ends [m/s] from local unknowns, after a step."""
        if not self.dynamic:
            return [np.zeros(3)] * 2
        pairs = zip(self.ends, self._histories, strict=True)
        return [self.gamma.value * u[end.slice][:3] + history.x.array[:3] for end, history in pairs]

    def note(self, u: Array) -> None:
        """Compute length, tension and absorbed power from the local unknowns u."""
        first, second = (u[end.slice][:3] for end in self.ends)
        way, (v, w) = second - first, self.velocities(u)
        length = float(np.sqrt(way @ way + form.NOTHING))
        rate, s = float(way @ (w - v)) / length, self.section
        absorbed = s.damping * rate + s.quadratic_damping * abs(rate) * rate
        absorbed += s.friction * rate / np.hypot(rate, s.friction_speed)
        self.numbers[:] = length, s.at_rest(length)[0] + absorbed, absorbed * rate

    def reactions(self, residual: Array) -> list[tuple[int, Array]]:
        """[(end, reaction [N])] of the fixed ends, from a local residual."""
        pairs = enumerate(zip(self.ends, self.holders, strict=True))
        return [(number, residual[end.slice]) for number, (end, holder) in pairs if holder.held]
