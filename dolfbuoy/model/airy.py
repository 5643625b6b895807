"""Wave components of a scene's sea, eta = sum A_n cos(k_n . x - w_n t + phi_n), and their Airy sum.

The sum, computed with arrays, is the reference for the C code of `kinematics` and is shown in pictures.
"""

import math
import operator
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from ..errors import InputError
from ..roots import brentq
from ..scene import Scene
from ..scene.stream import StreamWave, steady_wave
from ..scene.waves import COMPONENTS, ELEVATION, REGULAR, Waves
from . import Array, spectra

#: Lower limit of the band of a spectrum formula, in peak frequencies, and the fraction of m0 up to its upper limit.
LOWEST, HIGHEST = 0.5, 0.999


@dataclass(frozen=True)
class Components:
    """Arrays over the components: amplitudes [m], angular frequencies as in `waves.period` [rad/s], directions of
    travel [deg], phases [rad]."""

    amplitude: Array
    frequency: Array
    direction_deg: Array
    phase: Array

    def __post_init__(self):
        for array in vars(self).values():
            array.setflags(write=False)

    def as_rows(self) -> Array:
        """[amplitude [m], period [s], direction_deg, phase_deg] of each component."""
        return np.array([self.amplitude, 2 * math.pi / self.frequency, self.direction_deg, np.degrees(self.phase)]).T

    def moment(self, n: float) -> float:
        """sum w^n A^2/2 [m^2 (rad/s)^n]."""
        return float(np.sum(self.frequency**n * self.amplitude**2) / 2)


def spectrum_of(waves: Waves) -> spectra.Spectrum | None:
    """The spectrum of a section [waves], integrated over all directions; None if it has none."""
    if waves.spectrum == "pierson-moskowitz":
        return spectra.pierson_moskowitz(waves.significant_height, waves.peak_period)
    if waves.spectrum == "jonswap":
        return spectra.jonswap(waves.significant_height, waves.peak_period, waves.gamma)
    if isinstance(waves.spectrum, list):
        return spectra.tabulated(*np.array(waves.spectrum).T)
    if waves.spectrum is not None:
        angles, density = np.array(waves.spectrum.direction_deg), np.array(waves.spectrum.density)
        around = np.append(angles, angles[0] + 360.0)  # linear between the directions, closed to a circle
        whole = np.sum(0.5 * (density + np.roll(density, -1, axis=1)) * np.diff(around), axis=1)
        return spectra.tabulated(waves.spectrum.frequency, whole)
    return None


def band_of(waves: Waves, spectrum: spectra.Spectrum) -> tuple[float, float]:
    """Lowest and highest frequency [rad/s] of the components of a spectrum."""
    given = list(waves.band or [])
    low = given[0] if given else LOWEST if isinstance(waves.spectrum, str) else 0.0
    if len(given) == 2:
        return low * spectrum.peak, given[1] * spectrum.peak
    return low * spectrum.peak, float(spectrum.frequencies_at(np.array([HIGHEST * spectrum.moment(0)]))[0])


def components_of(waves: Waves) -> Components:
    """Components of a section [waves], without its `crest`; a regular wave is one component.

    Random numbers come from PCG64(seed), with separate streams for phases, directions and amplitudes.
    """
    return remembered(partial(_components_of, waves), waves)


def sea_of(scene: Scene) -> Components:
    """Components of a scene's waves, including a prescribed crest.

    The sea closest to the random one, weighted by the spectrum, with elevation `crest` and zero time derivative at its
    point and time (Taylor, Jonathan, Harland 1997); without a random sea, NewWave (Tromans et al. 1991).
    """
    if scene.waves.crest is None:
        return components_of(scene.waves)
    return remembered(partial(_with_crest, scene), scene.waves, scene.sea, scene.current, scene.gravity, "crest")


def _with_crest(scene):
    waves, sea = scene.waves, components_of(scene.waves)
    k, _, w = _runs(scene)
    x, y = waves.crest_position
    angle = np.radians(sea.direction_deg)
    there = k * (np.cos(angle) * x + np.sin(angle) * y) - w * waves.crest_time
    z = sea.amplitude * np.exp(1j * (sea.phase + there)) if waves.crest_sea == "random" else np.zeros(len(k), complex)
    # fractions of the variance: from the bins themselves, not the squares of random amplitudes
    part = components_of(waves.model_copy(update={"amplitudes": "fixed"})).amplitude ** 2
    part /= part.sum()
    z += part * (waves.crest - z.real.sum() - 1j * w * (w @ z.imag) / (part @ w**2))
    return Components(np.abs(z), sea.frequency, sea.direction_deg, np.mod(np.angle(z) - there, 2 * math.pi))


def _runs(scene):
    """Rows of wavenumbers and angular frequencies, in the water and at a fixed point, of the scene's components."""

    def made():
        sea = components_of(scene.waves)
        runs = [propagation(scene, *pair) for pair in zip(2 * math.pi / sea.frequency, sea.direction_deg, strict=True)]
        return np.array([(p.wavenumber, p.in_water, p.at_ground) for p in runs]).T

    return remembered(made, scene.waves, scene.sea, scene.current, scene.gravity, "runs")


#: Cache of (sections of a scene, which are immutable, result), most recently used last: a run needs the same ones
#: several times, and the waves of a response at many periods must not evict the memory function of its hull.
_KNOWN: deque[tuple[tuple, Any]] = deque(maxlen=32)


def remembered(make: Callable[[], Any], *sections: Any) -> Any:
    """Cached result of `make` for these very section objects."""
    for k, (known, kept) in enumerate(_KNOWN):
        if len(known) == len(sections) and all(map(operator.is_, known, sections)):
            found = kept
            del _KNOWN[k]
            break
    else:
        found = make()
    _KNOWN.append((sections, found))
    return found


def _components_of(waves):
    if waves.kind == REGULAR:
        numbers = waves.size, 2 * math.pi / waves.period, waves.direction_deg, math.radians(waves.phase_deg)
        return Components(*(np.array([x]) for x in numbers))
    if waves.kind == COMPONENTS:
        amplitude, period, direction, phase = np.array(waves.components).T
        return Components(amplitude, 2 * math.pi / period, direction + waves.direction_deg, np.radians(phase))
    if waves.kind == ELEVATION:
        amplitude, frequency, phase = spectra.of_record(*np.array(waves.elevation).T)
        return Components(amplitude, frequency, np.full(len(amplitude), waves.direction_deg), phase)
    return _of_spectrum(waves)


def _of_spectrum(waves):
    spectrum, count = spectrum_of(waves), waves.components
    band = band_of(waves, spectrum)
    if spectrum.moment(0, *band) <= 0:
        raise InputError(f"waves.band = {waves.band}: the spectrum must have energy in it.")
    energy, frequency = spectrum.bins(spectrum.band(*band, count))
    streams = np.random.SeedSequence(waves.seed).spawn(3)
    phases, directions, sizes = (np.random.Generator(np.random.PCG64(stream)) for stream in streams)
    amplitude = np.sqrt(2 * energy)
    if waves.amplitudes == "random":  # Rayleigh distribution
        amplitude = amplitude * np.sqrt(sizes.standard_exponential(count))
    turned = np.full(count, float(waves.direction_deg))
    if is_spread(waves):  # the distribution in as many equal parts, assigned at random
        turned += directions_at(waves, frequency, (directions.permutation(count) + 0.5) / count)
    return Components(amplitude, frequency, turned, phases.uniform(0.0, 2 * math.pi, count))


def is_spread(waves: Waves) -> bool:
    """True if the sea of a spectrum has several directions."""
    return waves.spreading is not None or not isinstance(waves.spectrum, str | list)


def directions_at(waves: Waves, frequency: Array, parts: Array) -> Array:
    """Quantiles of the directional distribution: angles from `direction_deg` [deg] at each frequency [rad/s]."""
    if waves.spreading is not None:
        return np.degrees(spectra.cos2s_angles(waves.spreading, parts))
    w, density = 2 * math.pi * np.array(waves.spectrum.frequency), np.array(waves.spectrum.density)
    rows = np.array([np.interp(frequency, w, column) for column in density.T]).T
    return spectra.tabulated_angles(np.array(waves.spectrum.direction_deg), rows, parts)


# -- dispersion, with or without a current ---------------------------------------------------------------------------


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


@dataclass(frozen=True)
class Propagation:
    """Wavenumber [1/m], intrinsic (in the water) and apparent (at a fixed point) angular frequency [rad/s]."""

    wavenumber: float
    in_water: float
    at_ground: float


def propagation(scene: Scene, period: float, direction_deg: float) -> Propagation:
    """Propagation of a wave of this period [s] in a scene, in the frame of its `waves.period_seen_from`.

    In a current U the intrinsic frequency sigma satisfies sigma^2 = g k tanh(kh), and the apparent one is
    omega = sigma + k . U.  Without the key they are equal.  Raises InputError if the current stops the waves.
    """
    frequency, seen = 2 * math.pi / period, scene.waves.period_seen_from if scene.current else None
    if scene.waves.theory == "stream":
        wave = stream_wave(scene)
        k, in_water = wave.wavenumber, wave.wavenumber * wave.speed
        shift = k * current_felt(scene, k, direction_deg) if seen == "water" else 0.0
        return Propagation(k, in_water, frequency if seen == "ground" else in_water + shift)
    if scene.waves.wavelength is not None:
        k = 2 * math.pi / scene.waves.wavelength
    elif seen == "ground":
        k = _wavenumber_seen_from_ground(scene, period, direction_deg)
    else:
        k = dispersion_wavenumber(period, scene.sea.depth, scene.gravity)
    if seen == "ground":
        return Propagation(k, frequency - k * current_felt(scene, k, direction_deg), frequency)
    shift = k * current_felt(scene, k, direction_deg) if seen == "water" else 0.0
    return Propagation(k, frequency, frequency + shift)


def stream_wave(scene: Scene) -> StreamWave:
    """The steady wave of a scene with theory = "stream", in the depth-weighted current of linear theory.

    Raises InputError near breaking.
    """
    return remembered(partial(_stream_wave, scene), scene.waves, scene.sea, scene.current, scene.gravity, "stream")


def _stream_wave(scene):
    waves = scene.waves
    linear = scene.model_copy(update={"waves": waves.model_copy(update={"theory": "airy"})})
    k = propagation(linear, waves.period, waves.direction_deg).wavenumber
    seen = waves.period_seen_from if scene.current else None
    current = current_felt(scene, k, waves.direction_deg) if seen == "ground" else 0.0
    omega = 2 * math.pi / waves.period
    return steady_wave(waves.height, omega, scene.sea.depth, scene.gravity, current, waves.order, k)


def _wavenumber_seen_from_ground(scene, period, direction_deg):
    """Wavenumber of the longest wave with this apparent period."""
    depth, g = scene.sea.depth, scene.gravity

    def excess(k):
        in_water = math.sqrt(g * k * math.tanh(k * depth))
        return in_water + k * current_felt(scene, k, direction_deg) - 2 * math.pi / period

    k = 1e-3 * dispersion_wavenumber(period, depth, g)
    while excess(1.05 * k) < 0:
        k *= 1.05
        if k > 1e6:
            raise InputError(f"waves.period_seen_from = 'ground': no wave of {period:.3g} s runs against this current.")
    return brentq(excess, k, 1.05 * k, xtol=1e-300, rtol=1e-14)


def current_felt(scene: Scene, k: float, direction_deg: float) -> float:
    """Effective speed of the current along a wave, weighted over the depth [m/s].

    U = 2k/sinh(2kh) int u(z) cosh(2k(z + h)) dz, which for a uniform current is its speed (Kirby and Chen 1989).
    """
    current, h = scene.current, scene.sea.depth
    along = math.cos(math.radians(current.direction_deg - direction_deg))
    if current.profile == "uniform":
        return current.speed * along

    from scipy.integrate import quad  # 0.1 s of every start

    def weighted(z):
        return float(current_speed(scene, z)) * (math.exp(2 * k * z) + math.exp(-2 * k * (z + 2 * h)))

    deepest = -min(h, 20 / k)
    mean = quad(weighted, deepest, 0.0, epsabs=0, epsrel=1e-9, limit=200)[0]
    return along * mean * 2 * k / -math.expm1(-4 * k * h)


def current_speed(scene: Scene, z: Array | float, least: float = 0.0) -> Array:
    """Speed of the current at heights z [m/s]; least: lower limit of 1 + z/h in a power law, as in `forms.sea`."""
    current = scene.current
    if isinstance(current.profile, list):
        return np.interp(z, *np.array(current.profile).T)
    power = 0.0 if current.profile == "uniform" else current.exponent
    return current.speed * np.clip(1 + np.asarray(z) / scene.sea.depth, least, 1.0) ** power


# -- the sum -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class AirySum:
    """Components by rising wavenumber: arrays of amplitude [m], k [1/m], angular frequency in the water and at a fixed
    point [rad/s], cosine and sine of the direction, phase [rad]; depth [m], and the ramp's duration [s].

    motion: amplitudes [m] of linear waves with the same particle velocities; equal to `amplitude` unless the components
    are harmonics of a steep wave.  steep: harmonics with total acceleration.  repeats: period at a fixed point [s].
    """

    amplitude: Array
    wavenumber: Array
    in_water: Array
    at_ground: Array
    cosine: Array
    sine: Array
    phase: Array
    depth: float
    stretching: str
    ramp: float
    motion: Array
    steep: bool = False
    repeats: float = math.inf
    _latest: list = field(default_factory=lambda: [None, None], repr=False, compare=False)  #: (time, phases)

    @classmethod
    def of(cls, scene: Scene) -> "AirySum":
        """Sum of a scene's waves, regular or irregular."""
        return remembered(partial(cls._of, scene), scene.waves, scene.sea, scene.current, scene.gravity)

    @classmethod
    def _of(cls, scene):
        if scene.waves.theory == "stream":
            runs = propagation(scene, scene.waves.period, scene.waves.direction_deg)
            return cls._of_harmonics(scene.waves, stream_wave(scene), runs, scene.sea.depth)
        c = sea_of(scene)
        (k, in_water, at_ground), angles = _runs(scene), np.radians(c.direction_deg)
        order = np.argsort(k, kind="stable")
        arrays = (c.amplitude, k, in_water, at_ground, np.cos(angles), np.sin(angles), c.phase)
        waves = scene.waves
        return cls(*(a[order] for a in arrays), scene.sea.depth, waves.stretching, waves.ramp, c.amplitude[order])

    @classmethod
    def _of_harmonics(cls, waves, wave, runs, depth):
        j = np.arange(1, len(wave.elevation) + 1)
        k, in_water, angle = j * runs.wavenumber, j * runs.in_water, math.radians(waves.direction_deg)
        arrays = [wave.elevation, k, in_water, j * runs.at_ground]
        arrays += [
            np.full(len(j), math.cos(angle)),
            np.full(len(j), math.sin(angle)),
            j * math.radians(waves.phase_deg),
        ]
        motion = k * wave.potential * np.tanh(k * depth) / in_water
        repeats = abs(2 * math.pi / runs.at_ground)
        return cls(*arrays, depth, "none", waves.ramp, motion, True, repeats)

    def grown(self, t: float) -> float:
        """Value of the ramp at a time."""
        return ramp(t, self.ramp)

    def elevation(self, t: float, points: Array) -> Array:
        """eta [m] at points (..., 2 or 3)."""
        return np.cos(self._phases(t, points)) @ self.amplitude * self.grown(t)

    def over_time(self, times: Array, point: Array) -> Array:
        """eta [m] at these times, at one point (2 or 3,) or one for each time (n, 2 or 3)."""
        x, y = np.moveaxis(np.broadcast_to(point, (len(times), np.shape(point)[-1]))[:, :2, None], 1, 0)
        heights = []
        for part in np.array_split(np.arange(len(times)), max(1, len(times) * len(self.phase) // 1_000_000)):
            there = self.phase + self.wavenumber * (self.cosine * x[part] + self.sine * y[part])
            passed = np.fmod(times[part], self.repeats)
            heights.append(np.cos(there - np.outer(passed, self.at_ground)) @ self.amplitude)
        return np.concatenate(heights) * np.array([self.grown(t) for t in times])

    def flow(self, t: float, points: Array) -> tuple[Array, Array]:
        """Velocity [m/s] and local acceleration [m/s^2] (total in a steep wave), (..., 3), at points (..., 3)."""
        points = np.asarray(points)
        theta, k, h = self._phases(t, points), self.wavenumber, self.depth
        z = self.stretched(points[..., 2], self.elevation(t, points))[..., None]
        down, up = np.exp(k * z), np.exp(-k * (z + 2 * h))
        bottom = -np.expm1(-2 * k * h)
        rate = self.grown(t) * self.motion * self.in_water / bottom
        along, upwards = rate * (down + up), rate * (down - up)
        velocity = self._vector(along * np.cos(theta), upwards * np.sin(theta))
        w = self.in_water
        acceleration = self._vector(w * along * np.sin(theta), -w * upwards * np.cos(theta))
        if self.steep:
            x = self._vector(-k * along * np.sin(theta), k * upwards * np.cos(theta))  # d/ds along the wave
            z = self._vector(k * upwards * np.cos(theta), k * along * np.sin(theta))
            forwards = velocity[..., 0] * self.cosine[0] + velocity[..., 1] * self.sine[0]
            acceleration += forwards[..., None] * x + velocity[..., 2:] * z
        return velocity, acceleration

    def stretched(self, z: Array, eta: Array) -> Array:
        """Height at which linear theory is evaluated, given the total elevation, as `forms.sea.stretched`."""
        if self.stretching == "wheeler":
            return np.minimum(self.depth * (z - eta) / (self.depth + eta), 0.0)
        return np.minimum(z, 0.0) if self.stretching == "vertical" else z

    def time_phase(self, t: float) -> Array:
        """phase - omega t of every component [rad], between 0 and 2 pi."""
        if self._latest[0] != t:
            turned = np.mod(self.at_ground * math.fmod(t, self.repeats), 2 * math.pi)
            self._latest[:] = t, np.mod(self.phase - turned, 2 * math.pi)
        return self._latest[1]

    def _phases(self, t, points):
        x, y = np.moveaxis(np.asarray(points)[..., :2, None], -2, 0)
        return self.wavenumber * (self.cosine * x + self.sine * y) + self.time_phase(t)

    def _vector(self, along, up):
        return np.stack([(along * self.cosine).sum(-1), (along * self.sine).sum(-1), up.sum(-1)], axis=-1)


def ramp(t: float, duration: float) -> float:
    """Smooth start: (1 - cos(pi t/duration))/2, then 1."""
    return 0.5 * (1 - math.cos(math.pi * t / duration)) if t < duration else 1.0
