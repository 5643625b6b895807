"""Ends of lines whose positions are given as functions of time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..scene import Scene
from ..scene.cable import EndDirection, Top
from ..scene.sections import Initial
from ..scene.vessel import Riding, RidingDirection
from ..solver.vector_ops import copies, work
from . import Array
from .airy import ramp
from .splines import along_rows, spline


def motion_of(top: Top) -> Callable[[float], list[float]]:
    """r_bnd(t) [m] of a scene's section cable.top, fixed or prescribed."""
    position = list(map(float, top.position))
    if isinstance(top, Riding):
        from .riding import rider_of  # imported only if there are vessels

        rider, fairlead = rider_of(top), top.own
        return lambda t: rider.place(fairlead, t)
    if top.kind != "prescribed":
        return lambda t: position
    if top.motion:
        path = along_rows(top.motion, top.ramp)
        return lambda t: position + path(t)
    if top.velocity:
        return lambda t: [r + _towed(t, top.ramp) * v for r, v in zip(position, top.velocity, strict=True)]
    phases = top.phase_deg if isinstance(top.phase_deg, tuple) else (top.phase_deg,) * 3
    return Swing(position, list(map(float, top.amplitude)), list(map(math.radians, phases)), top.period, top.ramp)


@dataclass(frozen=True)
class Swing:
    """Harmonic motion about a position [m]: amplitude [m] and phase [rad] of each coordinate, period and ramp [s]."""

    position: list[float]
    amplitude: list[float]
    phase: list[float]
    period: float
    ramp: float

    def __call__(self, t):
        """Position at a time."""
        angle, size = 2 * math.pi * t / self.period, ramp(t, self.ramp)
        axes = zip(self.position, self.phase, self.amplitude, strict=True)
        return [place + size * math.sin(angle + phase) * amplitude for place, phase, amplitude in axes]


#: Half the time interval for numerical differentiation of a direction [s].
INSTANT = 1e-4


def direction_of(clamp: EndDirection, beta: float = 0.0) -> Callable[[float], Array] | None:
    """Unit direction of an end plus beta [s] times its rate, as a function of time; None if the direction is
    constant."""
    path: Callable[[float], Any]
    if isinstance(clamp, RidingDirection):
        from .riding import rider_of

        rider, own = rider_of(clamp), clamp.own
        path = lambda t: rider.direction(own, t)  # noqa: E731
    elif clamp.motion is None:
        return None
    else:
        path = along_rows(clamp.motion, clamp.ramp)

    def direction(t: float) -> Array:
        way = path(t)
        return np.asarray(way) / np.linalg.norm(way)

    def damped(t: float) -> Array:
        before, after = max(t - INSTANT, 0.0), t + INSTANT
        return direction(t) + beta * (direction(after) - direction(before)) / (after - before)

    return damped if beta else direction


def adrift_nowhere(scene: Scene) -> Scene:
    """The scene without the loads that would set an unmoored buoy adrift: current, wind and external force."""
    absent = dict.fromkeys(("wind", "external_force"))
    buoys = [buoy.model_copy(update=absent) for buoy in scene.buoys]
    return scene.model_copy(update=absent | {"current": None, "buoy": buoys})


def from_rest(scene: Scene) -> Scene:
    """The scene without any given initial state, global or of a buoy: it starts from equilibrium."""
    if any(buoy.initial for buoy in scene.buoys):
        scene = scene.model_copy(update={"buoy": [b.model_copy(update={"initial": None}) for b in scene.buoys]})
    return scene.model_copy(update={"initial": Initial()})


def _towed(t, duration):
    """Distance over final speed of a tow whose speed follows `ramp` [s]: the integral of the ramp."""
    if t >= duration:
        return t - duration / 2
    return t / 2 - duration / (2 * math.pi) * math.sin(math.pi * t / duration)


def overshoot(rows: Sequence) -> float:
    """Largest overshoot of the spline through rows [t, x, y, z] beyond the range of the data, as a fraction of the
    largest range of x, y and z."""
    rows = np.asarray(rows)
    way, path = rows[:, 1:], spline(rows)
    turns = path.derivative().roots(extrapolate=False)
    beyond = 0.0
    for k, times in enumerate(turns):
        values = path(times[np.isfinite(times)])[:, k]
        low, high = way[:, k].min(), way[:, k].max()
        beyond = max(beyond, low - values.min(initial=low), values.max(initial=high) - high)
    largest = np.ptp(way, axis=0).max()
    return float(beyond / largest) if largest else 0.0


def held(ends: list[tuple[Array, Any]], time: Array, u: Array) -> list[Callable]:
    """Functions that write the positions at time[0] of all prescribed ends to the local unknowns u; both arrays stay
    at their memory addresses.

    ends: [(three dofs, motion), ...]; a motion is a function of time, or a position [m].
    """
    places = np.zeros((len(ends), 3))
    dofs = np.array([dofs for dofs, _ in ends], dtype=int).ravel()
    moved: list[Callable] = []
    for place, (_, motion) in zip(places, ends, strict=True):
        if isinstance(motion, Swing):
            moved.append(work("advance_swing", "swing", {"t": time, **asdict(motion), "out": place}))
        elif callable(motion):
            moved.append(_moving(place, motion, time.item))
        else:
            place[:] = motion
    return [*moved, copies([(u[dof:][:1], x) for dof, x in zip(dofs, places.reshape(-1, 1), strict=True)])]


def _moving(place: Array, motion: Callable[[float], Any], now: Callable[[], float]) -> Callable[[], None]:
    def move() -> None:
        place[:] = motion(now())

    return move
