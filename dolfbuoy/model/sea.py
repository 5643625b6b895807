"""The sea of a scene as UFL constants on one mesh, and its clock."""

import math

import numpy as np
from dolfinx import fem
from scipy.optimize import brentq

from ..forms import sea
from .numbers import Numbers


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
        self._mesh, self._numbers, self._current_numbers = mesh, Numbers(mesh, scene), []
        self.density = self._numbers.constant(lambda scene, _: scene.sea.density) if scene.sea else None
        self.wave = self._wave() if with_waves and scene.waves else None
        self.current = self._current() if scene.current else None

    @property
    def scene(self):
        """The scene whose numbers these are."""
        return self._numbers.scene

    def _wave(self):
        number = self._numbers.constant
        self._amplitude, self._time_phase = fem.Constant(self._mesh, 0.0), fem.Constant(self._mesh, 0.0)
        return sea.Wave(
            amplitude=self._amplitude,
            wavenumber=number(lambda scene, _: wavenumber(scene)),
            frequency=number(lambda scene, _: 2 * math.pi / scene.waves.period),
            time_phase=self._time_phase,
            cos_direction=number(lambda scene, _: float(heading(scene.waves.direction_deg)[0])),
            sin_direction=number(lambda scene, _: float(heading(scene.waves.direction_deg)[1])),
            depth=number(lambda scene, _: scene.sea.depth),
            stretching=self.scene.waves.stretching,
        )

    def _current(self):
        current, number = self.scene.current, self._numbers.constant
        if isinstance(current.profile, list):
            rows = range(len(current.profile))
            direction = number(lambda scene, _: heading(scene.current.direction_deg))
            z = number(lambda scene, _: np.array([z for z, _ in scene.current.profile]))
            speed = self._scalable(lambda scene: np.array([speed for _, speed in scene.current.profile]))
            return sea.tabulated_current(direction, [z[i] for i in rows], [speed[i] for i in rows])
        velocity = self._scalable(lambda scene: scene.current.speed * heading(scene.current.direction_deg))
        if current.profile == "uniform":
            return sea.uniform_current(velocity)
        depth, exponent = number(lambda scene, _: scene.sea.depth), number(lambda scene, _: scene.current.exponent)
        return sea.power_law_current(velocity, depth, exponent)

    def _scalable(self, get):
        """A Constant that carries the current's speed."""
        made = self._numbers.constant(lambda scene, _: get(scene))
        self._current_numbers.append((made, get))
        return made

    def scale_current(self, factor):
        """Scale the current (for continuation in statics)."""
        for constant, full in self._current_numbers:
            constant.value = factor * full(self.scene)

    def flow(self, x):
        """Undisturbed water at the UFL point x."""
        return sea.flow(x, self.wave, self.current)

    def set_time(self, t):
        """Advance the wave's phase and ramp."""
        if self.wave is not None:
            waves = self.scene.waves
            self._amplitude.value = waves.size * ramp(t, waves.ramp)
            self._time_phase.value = math.radians(waves.phase_deg) - 2 * math.pi / waves.period * t

    def change(self, scene):
        """Take the numbers of another scene of the same structure."""
        self._numbers.change(scene)
