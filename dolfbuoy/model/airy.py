"""A sum of Airy waves in numbers: elevation, velocity and acceleration at points, with arrays.

The oracle of the C code of `kinematics`, and what pictures show.
"""

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from ..scene import Scene
from .components import components_of, propagation


@dataclass(frozen=True)
class AirySum:
    """Components by rising wavenumber: arrays of amplitude [m], k [1/m], angular frequency in the water and at a fixed
    point [rad/s], cosine and sine of the direction, phase [rad]; depth [m], and the ramp's duration [s]."""

    amplitude: np.ndarray
    wavenumber: np.ndarray
    in_water: np.ndarray
    at_ground: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray
    phase: np.ndarray
    depth: float
    stretching: str
    ramp: float
    _latest: list = field(default_factory=lambda: [None, None], repr=False, compare=False)  #: a time, and phases then

    @classmethod
    def of(cls, scene: Scene) -> "AirySum":
        """Sum of a scene's waves, irregular or not; the latest are remembered: every part of a scene needs it."""
        sections = scene.waves, scene.sea, scene.current
        for gravity, known, found in _KNOWN:
            if gravity == scene.gravity and all(a is b for a, b in zip(known, sections, strict=True)):
                return found
        _KNOWN.append((scene.gravity, sections, cls._of(scene)))
        return _KNOWN[-1][-1]

    @classmethod
    def _of(cls, scene):
        c = components_of(scene.waves)
        periods, angles = 2 * math.pi / c.frequency, np.radians(c.direction_deg)
        waves = [propagation(scene, *pair) for pair in zip(periods, c.direction_deg, strict=True)]
        k, in_water, at_ground = (np.array([getattr(p, n) for p in waves]) for n in _OF_PROPAGATION)
        order = np.argsort(k, kind="stable")
        arrays = (c.amplitude, k, in_water, at_ground, np.cos(angles), np.sin(angles), c.phase)
        return cls(*(a[order] for a in arrays), scene.sea.depth, scene.waves.stretching, scene.waves.ramp)

    def grown(self, t: float) -> float:
        """The ramp at a time."""
        return ramp(t, self.ramp)

    def elevation(self, t: float, points: np.ndarray) -> np.ndarray:
        """eta [m] at points (..., 2 or 3)."""
        return np.cos(self._phases(t, points)) @ self.amplitude * self.grown(t)

    def over_time(self, times: np.ndarray, point: np.ndarray) -> np.ndarray:
        """eta [m] at these times, at one point (2 or 3,) or at one for each time (n, 2 or 3)."""
        x, y = np.moveaxis(np.broadcast_to(point, (len(times), np.shape(point)[-1]))[:, :2, None], 1, 0)
        heights = []
        for part in np.array_split(np.arange(len(times)), max(1, len(times) * len(self.phase) // 1_000_000)):
            there = self.phase + self.wavenumber * (self.cosine * x[part] + self.sine * y[part])
            heights.append(np.cos(there - np.outer(times[part], self.at_ground)) @ self.amplitude)
        return np.concatenate(heights) * np.array([self.grown(t) for t in times])

    def flow(self, t: float, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Velocity [m/s] and local acceleration [m/s^2], each (..., 3), at points (..., 3)."""
        points = np.asarray(points, dtype=float)
        theta, k, h = self._phases(t, points), self.wavenumber, self.depth
        z = self.stretched(points[..., 2], self.elevation(t, points))[..., None]
        down, up = np.exp(k * z), np.exp(-k * (z + 2 * h))
        bottom = -np.expm1(-2 * k * h)
        rate = self.grown(t) * self.amplitude * self.in_water / bottom
        along, upwards = rate * (down + up), rate * (down - up)
        velocity = self._vector(along * np.cos(theta), upwards * np.sin(theta))
        w = self.in_water
        return velocity, self._vector(w * along * np.sin(theta), -w * upwards * np.cos(theta))

    def stretched(self, z: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Height at which linear theory is read, with the total elevation, as `forms.sea.stretched`."""
        if self.stretching == "wheeler":
            return np.minimum(self.depth * (z - eta) / (self.depth + eta), 0.0)
        return np.minimum(z, 0.0) if self.stretching == "vertical" else z

    def time_phase(self, t: float) -> np.ndarray:
        """phase - omega t of every component [rad], between 0 and 2 pi."""
        if self._latest[0] != t:
            self._latest[:] = t, np.mod(self.phase - np.mod(self.at_ground * t, 2 * math.pi), 2 * math.pi)
        return self._latest[1]

    def _phases(self, t, points):
        x, y = np.moveaxis(np.asarray(points, dtype=float)[..., :2, None], -2, 0)
        return self.wavenumber * (self.cosine * x + self.sine * y) + self.time_phase(t)

    def _vector(self, along, up):
        return np.stack([(along * self.cosine).sum(-1), (along * self.sine).sum(-1), up.sum(-1)], axis=-1)


#: (gravity, sections, which do not change, their sum).
_KNOWN: deque = deque(maxlen=4)
_OF_PROPAGATION = "wavenumber", "in_water", "at_ground"


def ramp(t: float, duration: float) -> float:
    """Smooth start: (1 - cos(pi t/duration))/2, then 1."""
    return 0.5 * (1 - math.cos(math.pi * t / duration)) if t < duration else 1.0
