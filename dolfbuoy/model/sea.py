"""The sea of a scene: as UFL constants on one mesh, updated over time, and as numbers at points."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import ufl

from ..forms import sea, wind
from ..forms.kinds import Expr
from ..scene import Scene
from ..scene.buoy import Wind
from ..solver import compat, vector_ops
from ..solver.c_code import address, core
from ..solver.system import System
from ..solver.unknowns import array_of
from .airy import AirySum, Propagation, components_of, current_speed, propagation, stream_wave
from .kinematics import Kinematics
from .numbers import Numbers
from .varying import direction_over_time, grid_of, range_of_tide, tide_of, varies, velocity_over_time, wind_over_time
from .varying import heading as heading


def main_propagation(scene: Scene) -> Propagation:
    """Propagation of the scene's regular wave, or of the main period of its irregular sea."""
    return propagation(scene, scene.waves.main_period, scene.waves.direction_deg)


def wavenumber(scene: Scene) -> float:
    """k of the scene's wave (irregular: of the main period): 2 pi / wavelength if given, else from dispersion."""
    return main_propagation(scene).wavenumber


def crest_height(scene: Scene) -> float:
    """Height of the crest of a scene's wave, significant height of its sea, 0 without waves [m]."""
    if scene.waves is None:
        return 0.0
    if scene.waves.theory == "stream":
        return stream_wave(scene).crest
    return 4 * math.sqrt(components_of(scene.waves).moment(0)) if scene.waves.irregular else scene.waves.size


def highest_water(scene: Scene) -> float:
    """Height of the crest of a scene's wave at its highest tide [m]."""
    return crest_height(scene) + range_of_tide(scene)[1]


def elevation_at(scene: Scene, t: float, points: np.ndarray) -> np.ndarray:
    """Height of the water surface of a scene [m] at points (..., 3)."""
    level = tide_of(scene)(t)
    return level + (AirySum.of(scene).elevation(t, points) if scene.waves else np.zeros(np.shape(points)[:-1]))


def velocity_at(scene: Scene, t: float, points: np.ndarray) -> np.ndarray:
    """Velocity (..., 3) of a scene's undisturbed water [m/s] at points (..., 3)."""
    points = np.asarray(points, dtype=float) - [0.0, 0.0, tide_of(scene)(t)]
    velocity = AirySum.of(scene).flow(t, points)[0] if scene.waves else np.zeros(points.shape)
    if scene.current and scene.current.grid:
        grid = grid_of(scene)
        stream = grid(t)
        velocity = velocity + np.stack([np.interp(points[..., 2], grid.z, stream[:, i]) for i in range(3)], axis=-1)
    elif scene.current:
        speed = current_speed(scene, points[..., 2], least=1e-3)
        velocity = velocity + speed[..., None] * direction_over_time(scene.current)(t)
    return velocity


def strongest(scene: Scene) -> np.ndarray:
    """Largest current velocity of a scene over the depth at t = 0, zero without a current [m/s]."""
    if scene.current is None or scene.sea is None:
        return np.zeros(3)
    heights = np.linspace(-scene.sea.depth, 0.0, 50)
    found = velocity_at(scene.model_copy(update={"waves": None}), 0.0, heights[:, None] * [0.0, 0.0, 1.0])
    return np.asarray(found[np.linalg.norm(found, axis=1).argmax()])


def wind_at(w: Wind, height: float, blows: tuple[float, np.ndarray] | None = None) -> np.ndarray:
    """Force of a section [wind] at a height above the water, Eq. (2) [N]; blows: of `wind_over_time`, default t = 0."""
    speed, direction = blows or wind_over_time(w, None)(0.0)
    size = wind.wind_force(ufl.as_ufl(float(height)), 1.0, speed, w.drag_coefficient, w.air_density, w.area)
    return size.evaluate(None, {}, (), {}) * direction  # a call would differentiate first: 30 ms


class SeaState:
    """Wave and current of `scene` on `mesh`; absent ones are None and never enter a form.

    lesser: minimum that forms the corners of the current profile, see `forms.sea.at_most`.
    """

    def __init__(self, mesh: Any, scene: Scene, with_waves: bool = True, lesser: sea.Lesser = sea.min_value):
        self._mesh, self._numbers, self._speeds, self._moving = mesh, Numbers(mesh, scene), [], []
        self.kinematics = self._publish = None  #: of waves that are summed
        self.density = self._number(lambda scene: scene.sea.density) if scene.sea else None
        #: Height of still water over time; None: 0
        self.level = compat.constant(mesh, 0.0) if scene.sea and scene.sea.tide else None
        self.wave = self.current = None
        if with_waves and scene.waves and scene.waves.summed:
            self.kinematics = Kinematics(scene, self.level)
            self._depth = self._number(lambda scene: scene.sea.depth)
        elif with_waves and scene.waves:
            self._amplitude, self._time_phase = compat.constant(mesh, 0.0), compat.constant(mesh, 0.0)
            self._numbers_of_wave = array_of(self._amplitude), array_of(self._time_phase)
            self.wave = self._wave()
        if scene.current:
            self.current = self._current(lesser)

    @property
    def scene(self) -> Scene:
        """The present scene."""
        return self._numbers.scene

    def _wave(self):
        """The scene's regular wave, whose amplitude and phase are updated over time."""
        number = self._number
        return sea.Wave(
            amplitude=self._amplitude,
            wavenumber=number(wavenumber),
            frequency=number(lambda scene: main_propagation(scene).in_water),
            time_phase=self._time_phase,
            cos_direction=number(lambda scene: float(heading(scene.waves.direction_deg)[0])),
            sin_direction=number(lambda scene: float(heading(scene.waves.direction_deg)[1])),
            depth=number(lambda scene: scene.sea.depth),
            stretching=self.scene.waves.stretching,
        )

    def _current(self, lesser):
        profile, number, speed = self.scene.current.profile, self._number, self._speed
        if self.scene.current.grid:
            z = number(lambda scene: grid_of(scene).z)
            heights = range(len(grid_of(self.scene).z))
            streams = [speed(lambda scene, i=i: grid_of(scene)(0.0)[i]) for i in heights]
            self._moving.append((streams, grid_of))
            return sea.tabulated_current(1.0, [z[i] for i in heights], streams, lesser)
        if isinstance(profile, list):
            direction = number(lambda scene: direction_over_time(scene.current)(0.0))
            self._moving.append(([direction], lambda scene: direction_over_time(scene.current)))
            z = number(lambda scene: np.array([z for z, _ in scene.current.profile]))
            speeds = speed(lambda scene: np.array([speed for _, speed in scene.current.profile]))
            rows = range(len(profile))
            return sea.tabulated_current(direction, [z[i] for i in rows], [speeds[i] for i in rows], lesser)
        velocity = speed(lambda scene: velocity_over_time(scene.current)(0.0))
        self._moving.append(([velocity], lambda scene: velocity_over_time(scene.current)))
        if profile == "uniform":
            return sea.uniform_current(velocity)
        depth, exponent = number(lambda scene: scene.sea.depth), number(lambda scene: scene.current.exponent)
        return sea.power_law_current(velocity, depth, exponent, lesser)

    def _number(self, get):
        return self._numbers.constant(lambda scene, _: get(scene))

    def _speed(self, get):
        """A Constant for the current speed at t = 0."""
        self._speeds.append((self._number(get), get))
        return self._speeds[-1][0]

    def scale_current(self, factor: float) -> None:
        """Scale the current at t = 0 (for continuation in statics)."""
        for constant, full in self._speeds:
            constant.value = factor * full(self.scene)

    def _stream(self, time: np.ndarray) -> list[Callable]:
        """Functions that update a varying current to time[0]."""
        if self.scene.current is None or not varies(self.scene.current):
            return []
        moving = [([array_of(constant) for constant in several], get(self.scene)) for several, get in self._moving]

        def flow() -> None:
            for arrays, get in moving:
                for array, values in zip(arrays, np.reshape(get(time.item()), (len(arrays), -1)), strict=True):
                    array[:] = values

        return [flow]

    def _tide(self, time: np.ndarray) -> list[Callable]:
        """Function that updates the tide level to time[0]."""
        if self.level is None:
            return []
        level, tide = array_of(self.level), tide_of(self.scene)
        return [lambda: level.__setitem__(0, tide(time.item()))]

    @property
    def has_waves(self) -> bool:
        """True if there are waves, regular or irregular."""
        return self.wave is not None or self.kinematics is not None

    def flow(self, x: Expr, *at) -> sea.Flow:
        """Undisturbed water at the UFL point x.

        at: `kinematics.Points` near it, required for a sum of waves; three `weighted` ones for averages over disks.
        """
        if self.level is not None:
            x = x - ufl.as_vector([0.0, 0.0, self.level])
        return self._at_level_0(x, *at)._replace(level=self.level)

    def _at_level_0(self, x, *at):
        if self.kinematics is None:
            return sea.flow(x, self.wave, self.current)
        samples = [self.kinematics.samples(points, self._depth) for points in at]
        waves = sea.sampled_average(samples, x) if len(samples) > 1 else sea.sampled_flow(samples[0], x)
        return sea.with_current(waves, x, self.current)

    def follow(self, system: System) -> None:
        """Sum waves at points that follow the unknowns of a System."""
        if self.kinematics is not None:
            self.kinematics.follow(system)

    def publish(self) -> None:
        """Sum waves at the points given by the Function of the unknowns, for forms that no System evaluates."""
        if self.kinematics is not None:
            self._publish = self._publish or self.kinematics.into_functions(array_of)
            self._publish()

    def clock(self, time: np.ndarray) -> list[Callable]:
        """Functions that update waves, current and tide to time[0], for the present scene."""
        stream = [*self._tide(time), *self._stream(time)]
        if self.kinematics is not None:
            return [*stream, lambda: self.kinematics.set_time(time.item())]
        if self.wave is None:
            return stream
        waves = self.scene.waves
        amplitude, time_phase = self._numbers_of_wave
        numbers = {"size": waves.size, "ramp": waves.ramp, "phase": math.radians(waves.phase_deg)}
        numbers |= {"frequency": main_propagation(self.scene).at_ground, "amplitude": amplitude}
        return [*stream, vector_ops.work("advance_wave", "wave", {"t": time, **numbers, "time_phase": time_phase})]

    @property
    def phases(self) -> np.ndarray:
        """Present phase - omega t of the components [rad], in order of increasing wavenumber."""
        return self._numbers_of_wave[1] if self.kinematics is None else self.kinematics.phases

    @property
    def scale(self) -> Any:
        """For C: present factor of the components, the amplitude of a regular wave or the ramp of a sum."""
        if self.kinematics is None:
            return address(self._numbers_of_wave[0])
        return core().ffi.addressof(self.kinematics.waves, "ramp")

    def set_wave(self, amplitude: float, time_phase: float) -> None:
        """Set amplitude a [m] and phase - omega t [rad] of the wave."""
        a, phase = self._numbers_of_wave
        a[0], phase[0] = amplitude, time_phase

    def change(self, scene: Scene) -> None:
        """Take the numbers of another scene of the same structure."""
        self._numbers.change(scene)
        if self.kinematics is not None:
            self.kinematics.change(scene)
