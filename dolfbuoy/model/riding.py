"""Vessels that respond to the scene's waves by their response amplitude operators, in addition to a given motion."""

import math
from functools import partial

import numpy as np

from ..scene import Scene
from ..scene.vessel import OnVessel, Vessel, turned
from . import Array
from .airy import AirySum, ramp, remembered
from .splines import along_rows
from .varying import tide_of

#: Largest deviation of the height of an end from its mean in an irregular sea, in standard deviations.
FARTHEST = 4.0


class Rider:
    """Six motions of a vessel in a scene's waves over time, common to all its ends.

    The elevation at its reference point at rest is the sum of a cos(theta - omega t); the response of an operator X
    leads it by the phase of X: a |X| cos(omega t - theta + phase).
    """

    def __init__(self, vessel: Vessel, scene: Scene):
        self.vessel, self._ramp, self._frequency, self._parts = vessel, 0.0, np.zeros(0), np.zeros((6, 0))
        if scene.waves is not None:  # absent in statics and for small motions
            sea, (x, y, _) = AirySum.of(scene), vessel.position
            theta = sea.phase + sea.wavenumber * (sea.cosine * x + sea.sine * y)
            towards = np.degrees(np.arctan2(sea.sine, sea.cosine)) - vessel.heading_deg
            operators = _at(vessel, 2 * math.pi / sea.at_ground, towards)
            self._ramp, self._frequency = sea.ramp, sea.at_ground
            self._parts = operators * sea.amplitude * np.exp(-1j * theta)
        self._latest: tuple[float | None, Array] = (None, np.zeros(6))
        self._tide = tide_of(scene)
        self._given = along_rows(vessel.motion, vessel.ramp) if vessel.motion else lambda t: np.zeros(6)

    def motions(self, t: float) -> Array:
        """Surge, sway, heave [m] along its axes at rest and roll, pitch, yaw [deg] due to the waves, ramp included."""
        if self._latest[0] != t:
            found = (self._parts @ np.exp(1j * self._frequency * t)).real
            self._latest = t, ramp(t, self._ramp) * found
        return self._latest[1]

    def direction(self, own: tuple[float, float, float], t: float) -> list[float]:
        """A vector of the vessel's frame in the world frame."""
        (*_, roll, pitch, yaw), shift = self.motions(t), self._given(t)
        return turned(own, roll + shift[3], pitch + shift[4], self.vessel.heading_deg + yaw + shift[5])

    def place(self, fairlead: str, t: float) -> list[float]:
        """Position of a fairlead [m]."""
        vessel, along, shift = self.vessel, self.motions(t)[:3], self._given(t)
        arm = self.direction(vessel.fairleads[fairlead], t)
        shift = shift[:3] + [0.0, 0.0, self._tide(t)]
        moved = turned((float(along[0]), float(along[1]), float(along[2])), 0.0, 0.0, vessel.heading_deg)
        return [float(sum(part)) for part in zip(vessel.position, shift, moved, arm, strict=True)]

    def rise(self, fairlead: str) -> float:
        """Approximate largest height of a fairlead above its position at rest in waves [m]."""
        x, y, _ = self.vessel.fairleads[fairlead]
        parts = np.abs(self._parts[2]) + np.radians(abs(y) * np.abs(self._parts[3]) + abs(x) * np.abs(self._parts[4]))
        return float(min(parts.sum(), FARTHEST * math.sqrt(np.sum(parts**2) / 2)))


def rider_of(top: OnVessel) -> Rider:
    """The Rider of an end's vessel, shared by all its ends."""
    scene, vessel = top.scene, top.vessel
    return remembered(partial(Rider, vessel, scene), vessel, scene.waves, scene.sea, scene.current, scene.gravity)


def _at(vessel, periods, towards):
    """Complex operators (6, components): linear between the periods and directions of the table, constant beyond its
    periods, and independent of direction if it has only one."""
    rows = np.array(vessel.raos)
    known, angles = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    values = rows[:, 2::2] * np.exp(1j * np.radians(rows[:, 3::2]))
    grid = values[np.lexsort((rows[:, 0], rows[:, 1]))].reshape(len(angles), len(known), 6)
    of_angles = np.array([[_between(periods, known, one) for one in table.T] for table in grid])  # angle, 6, components
    if len(angles) == 1:
        return of_angles[0]
    around = np.concatenate([angles, angles[:1] + 360.0])
    closed = np.concatenate([of_angles, of_angles[:1]])
    beta = angles[0] + np.mod(towards - angles[0], 360.0)
    below = np.clip(np.searchsorted(around, beta, side="right") - 1, 0, len(angles) - 1)
    part = (beta - around[below]) / (around[below + 1] - around[below])
    each = np.arange(len(beta))
    return ((1 - part) * closed[below, :, each].T) + part * closed[below + 1, :, each].T


def _between(x, known, values):
    return np.interp(x, known, values.real) + 1j * np.interp(x, known, values.imag)
