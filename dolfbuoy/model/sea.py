"""The sea of a scene: as UFL constants on one mesh with its clock, and in numbers at points."""

import math

import numpy as np
import ufl
from dolfinx import fem

from ..forms import sea, wind
from ..solver.compat import point_in_space
from ..solver.unknowns import array_of
from . import clock_c
from .airy import AirySum, ramp
from .components import Propagation, components_of, propagation
from .evaluate import at_points, value
from .kinematics import Kinematics
from .numbers import Numbers


def main_propagation(scene) -> Propagation:
    """Of the scene's regular wave, or of the main period of its sea."""
    return propagation(scene, scene.waves.main_period, scene.waves.direction_deg)


def wavenumber(scene) -> float:
    """k of the scene's wave: 2 pi / wavelength if that is given, else from dispersion; of the main period of a sea."""
    return main_propagation(scene).wavenumber


def heading(direction_deg: float) -> np.ndarray:
    """Horizontal unit vector, degrees from x towards y; exact at multiples of 90."""
    quarter, rest = divmod(direction_deg, 90)
    c, s = (math.cos(math.radians(rest)), math.sin(math.radians(rest))) if rest else (1.0, 0.0)
    for _ in range(int(quarter) % 4):
        c, s = -s, c
    return np.array([c, s, 0.0])


def amplitude(scene, t) -> float:
    """Amplitude of the scene's wave at time t, ramp included [m]."""
    return scene.waves.size * ramp(t, scene.waves.ramp)


def time_phase(scene, t, frequency) -> float:
    """phase - omega t of the scene's wave [rad] with the frequency that a fixed point sees [rad/s]."""
    return math.radians(scene.waves.phase_deg) - frequency * t


def _wave(scene, number, amplitude, time_phase):
    """The scene's wave for forms.sea; number(get): a scalar of UFL, or a float, with the value get(scene)."""
    return sea.Wave(
        amplitude=amplitude,
        wavenumber=number(wavenumber),
        frequency=number(lambda scene: main_propagation(scene).in_water),
        time_phase=time_phase,
        cos_direction=number(lambda scene: float(heading(scene.waves.direction_deg)[0])),
        sin_direction=number(lambda scene: float(heading(scene.waves.direction_deg)[1])),
        depth=number(lambda scene: scene.sea.depth),
        stretching=scene.waves.stretching,
    )


def _current(scene, number, speed):
    """The scene's current for forms.sea; speed(get): a number or vector that continuation may scale."""
    profile = scene.current.profile
    if isinstance(profile, list):
        rows = range(len(profile))
        direction = number(lambda scene: heading(scene.current.direction_deg))
        z = number(lambda scene: np.array([z for z, _ in scene.current.profile]))
        speeds = speed(lambda scene: np.array([speed for _, speed in scene.current.profile]))
        return sea.tabulated_current(direction, [z[i] for i in rows], [speeds[i] for i in rows])
    velocity = speed(lambda scene: scene.current.speed * heading(scene.current.direction_deg))
    if profile == "uniform":
        return sea.uniform_current(velocity)
    return sea.power_law_current(
        velocity, number(lambda scene: scene.sea.depth), number(lambda scene: scene.current.exponent)
    )


def crest_height(scene) -> float:
    """Amplitude of a scene's wave, significant height of its sea, 0 without waves [m]."""
    if scene.waves is None:
        return 0.0
    return 4 * math.sqrt(components_of(scene.waves).moment(0)) if scene.waves.irregular else scene.waves.size


def elevation_at(scene, t, points) -> np.ndarray:
    """Elevation of a scene's water in numbers [m] at points (..., 3)."""
    if scene.waves and scene.waves.irregular:
        return AirySum.of(scene).elevation(t, points)
    return _at_points(_flow(scene, t).elevation, points, ())


def velocity_at(scene, t, points) -> np.ndarray:
    """Velocity (..., 3) of a scene's undisturbed water in numbers [m/s] at points (..., 3)."""
    stream = _at_points(_flow(scene, t).velocity, points, (3,))
    return stream + AirySum.of(scene).flow(t, points)[0] if scene.waves and scene.waves.irregular else stream


def _at_points(expression, points, shape):
    return np.zeros(np.shape(points)[:-1] + shape) if expression is None else at_points(expression, points)


def _flow(scene, t):
    """The water of forms.sea at `compat.point_in_space`, without irregular waves."""

    def number(get):
        found = get(scene)
        return ufl.as_vector(found.tolist()) if isinstance(found, np.ndarray) else found

    wave = None
    if scene.waves and not scene.waves.irregular:
        phase = time_phase(scene, t, main_propagation(scene).at_ground)
        wave = _wave(scene, number, amplitude(scene, t), phase)
    return sea.flow(point_in_space(), wave, _current(scene, number, number) if scene.current else None)


def wind_at(w, height) -> np.ndarray:
    """Force of a section [wind] at a height over the water [m], Eq. (2) [N]."""
    size = wind.wind_force(ufl.as_ufl(float(height)), 1.0, w.speed_10m, w.drag_coefficient, w.air_density, w.area)
    return value(size) * heading(w.direction_deg)


class SeaState:
    """Wave and current of `scene` on `mesh`; what is absent is None and never reaches a form."""

    def __init__(self, mesh, scene, with_waves=True):
        self._mesh, self._numbers, self._speeds = mesh, Numbers(mesh, scene), []
        self.kinematics = self._publish = None  #: of an irregular sea
        self.density = self._number(lambda scene: scene.sea.density) if scene.sea else None
        self.wave = self.current = None
        if with_waves and scene.waves and scene.waves.irregular:
            self.kinematics = Kinematics(scene)
            self._depth = self._number(lambda scene: scene.sea.depth)
        elif with_waves and scene.waves:
            self._amplitude, self._time_phase = fem.Constant(mesh, 0.0), fem.Constant(mesh, 0.0)
            self._numbers_of_wave = array_of(self._amplitude), array_of(self._time_phase)
            self.wave = _wave(scene, self._number, self._amplitude, self._time_phase)
        if scene.current:
            self.current = _current(scene, self._number, self._speed)

    @property
    def scene(self):
        """The scene whose numbers these are."""
        return self._numbers.scene

    def _number(self, get):
        return self._numbers.constant(lambda scene, _: get(scene))

    def _speed(self, get):
        """A Constant that carries the current's speed."""
        self._speeds.append((self._number(get), get))
        return self._speeds[-1][0]

    def scale_current(self, factor):
        """Scale the current (for continuation in statics)."""
        for constant, full in self._speeds:
            constant.value = factor * full(self.scene)

    @property
    def has_waves(self):
        """Whether there are any, regular or not."""
        return self.wave is not None or self.kinematics is not None

    def flow(self, x, *at):
        """Undisturbed water at the UFL point x.

        at: `kinematics.Points` near it, which an irregular sea needs; three, `weighted`, for averages over disks.
        """
        if self.kinematics is None:
            return sea.flow(x, self.wave, self.current)
        samples = [self.kinematics.samples(points, self._depth) for points in at]
        waves = sea.sampled_average(samples, x) if len(samples) > 1 else sea.sampled_flow(samples[0], x)
        return sea.with_current(waves, x, self.current)

    def follow(self, system):
        """An irregular sea follows the unknowns of a System."""
        if self.kinematics is not None:
            self.kinematics.follow(system)

    def publish(self):
        """Put an irregular sea where the unknowns' Function says: for forms that no System evaluates."""
        if self.kinematics is not None:
            self._publish = self._publish or self.kinematics.into_functions(array_of)
            self._publish()

    def clock(self, time):
        """Functions that bring the waves' phases and ramp to time[0], with the numbers of the scene at hand."""
        if self.kinematics is not None:
            return [lambda: self.kinematics.set_time(time.item())]
        if self.wave is None:
            return []
        waves = self.scene.waves
        numbers = waves.size, waves.ramp, math.radians(waves.phase_deg), main_propagation(self.scene).at_ground
        return [clock_c.wave(time, *numbers, self._numbers_of_wave)]

    def set_wave(self, amplitude, time_phase):
        """Amplitude a [m] and phase - omega t [rad] of the wave."""
        a, phase = self._numbers_of_wave
        a[0], phase[0] = amplitude, time_phase

    def change(self, scene):
        """Take the numbers of another scene of the same structure."""
        self._numbers.change(scene)
        if self.kinematics is not None:
            self.kinematics.change(scene)
