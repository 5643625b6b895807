"""The sea of a scene as UFL constants on one mesh, and its clock."""

import math

import numpy as np
from dolfinx import fem
from scipy.optimize import brentq

from ..forms import sea


def dispersion_wavenumber(period: float, depth: float, gravity: float) -> float:
    """k [1/m] with omega^2 = g k tanh(k h)."""
    deep = (2 * math.pi / period) ** 2 / gravity  # kh tanh(kh) = deep h: k is between deep and deep / tanh(deep h)
    if deep * depth > 30:
        return deep
    return brentq(
        lambda k: gravity * k * math.tanh(k * depth) - deep * gravity,
        deep,
        deep / math.tanh(deep * depth) * (1 + 1e-12),
        xtol=1e-16,
        rtol=1e-15,
    )


def wavenumber(scene) -> float:
    """k of the scene's wave: 2 pi / wavelength if that is given, else from dispersion."""
    if scene.waves.wavelength is not None:
        return 2 * math.pi / scene.waves.wavelength
    return dispersion_wavenumber(scene.waves.period, scene.sea.depth, scene.gravity)


def ramp(t: float, duration: float) -> float:
    """Smooth start: (1 - cos(pi t/duration))/2, then 1."""
    return 0.5 * (1 - math.cos(math.pi * t / duration)) if t < duration else 1.0


def heading(direction_deg: float) -> np.ndarray:
    """Horizontal unit vector, degrees from x towards y; exact at multiples of 90."""
    quarter, rest = divmod(direction_deg, 90)
    c, s = (math.cos(math.radians(rest)), math.sin(math.radians(rest))) if rest else (1.0, 0.0)
    for _ in range(int(quarter) % 4):
        c, s = -s, c
    return np.array([c, s, 0.0])


class SeaState:
    """Wave and current of `scene` on `mesh`; what is absent is None and never reaches a form."""

    def __init__(self, mesh, scene, with_waves=True):
        self._mesh, self._scene = mesh, scene
        self.density = fem.Constant(mesh, scene.sea.density) if scene.sea else None
        self.wave = self._wave() if with_waves and scene.waves else None
        self.scene_current = None  # the Constant that carries the current's speed, and its full value
        self.current = self._current() if scene.current else None

    def _wave(self):
        waves, mesh = self._scene.waves, self._mesh
        c, s, _ = heading(waves.direction_deg)
        self._amplitude, self._time_phase = fem.Constant(mesh, 0.0), fem.Constant(mesh, 0.0)
        values = (wavenumber(self._scene), 2 * math.pi / waves.period)
        k, frequency = (fem.Constant(mesh, v) for v in values)
        direction = (fem.Constant(mesh, float(c)), fem.Constant(mesh, float(s)))
        depth = fem.Constant(mesh, self._scene.sea.depth)
        return sea.Wave(self._amplitude, k, frequency, self._time_phase, *direction, depth, waves.stretching)

    def _current(self):
        current, mesh = self._scene.current, self._mesh
        direction = heading(current.direction_deg)
        if isinstance(current.profile, list):
            z, speed = (fem.Constant(mesh, np.array(column)) for column in zip(*current.profile, strict=True))
            self.scene_current = (speed, speed.value.copy())
            z, speed = ([c[i] for i in range(len(current.profile))] for c in (z, speed))
            return sea.tabulated_current(fem.Constant(mesh, direction), z, speed)
        velocity = fem.Constant(mesh, current.speed * direction)
        self.scene_current = (velocity, velocity.value.copy())
        if current.profile == "uniform":
            return sea.uniform_current(velocity)
        depth, exponent = fem.Constant(mesh, self._scene.sea.depth), fem.Constant(mesh, current.exponent)
        return sea.power_law_current(velocity, depth, exponent)

    def scale_current(self, factor):
        """Scale the current (for continuation in statics)."""
        if self.scene_current is not None:
            constant, full = self.scene_current
            constant.value = factor * full

    def flow(self, x):
        """Undisturbed water at the UFL point x."""
        return sea.flow(x, self.wave, self.current)

    def set_time(self, t):
        """Advance the wave's phase and ramp."""
        if self.wave is not None:
            waves = self._scene.waves
            self._amplitude.value = waves.size * ramp(t, waves.ramp)
            self._time_phase.value = math.radians(waves.phase_deg) - 2 * math.pi / waves.period * t
