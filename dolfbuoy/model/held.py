"""Ends of lines whose positions are given as functions of time."""

import math
from collections.abc import Callable

import numpy as np

from .sea import ramp


def motion_of(top) -> Callable[[float], tuple[float, float, float]]:
    """r_bnd(t) [m] of a scene's section cable.top, fixed or prescribed."""
    position = tuple(map(float, top.position))
    if top.kind != "prescribed":
        return lambda t: position
    (x, y, z), (a, b, c) = position, map(float, top.amplitude)
    phase, period, duration = math.radians(top.phase_deg), top.period, top.ramp

    def motion(t):
        size = ramp(t, duration) * math.sin(2 * math.pi * t / period + phase)
        return x + size * a, y + size * b, z + size * c

    return motion


class HeldEnds:
    """Puts the positions of all ends that are held into the unknowns, in one go.

    ends: [(three dofs, motion), ...]; a motion is a function of time, or a position [m].
    """

    def __init__(self, ends):
        self._dofs = np.concatenate([np.zeros(0, int), *(dofs for dofs, _ in ends)])
        self._positions, self._moved = np.zeros(len(self._dofs)), []
        for k, (_, motion) in enumerate(ends):
            place = slice(3 * k, 3 * k + 3)
            if callable(motion):
                self._moved.append((place, motion))
            else:
                self._positions[place] = motion

    def put(self, u, t):
        """At time t, into the local unknowns u."""
        for place, motion in self._moved:
            self._positions[place] = motion(t)
        u[self._dofs] = self._positions
