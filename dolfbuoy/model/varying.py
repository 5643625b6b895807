"""Current, wind and external force varying over time: by the rows of a table, and gusts of a wind spectrum.

Between two rows velocities are interpolated linearly, as vectors: a reversing tidal current passes through zero.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene.buoy import ExternalForce, Wind
from ..scene.sections import Current, Scene
from . import Array
from .airy import ramp, remembered
from .splines import along_rows, spline

#: Frequency range of gusts [Hz]: that of the NPD spectrum.
LOWEST, HIGHEST = 1 / 600, 0.5
#: Number of gust components, one in each of as many bins of equal frequency ratio.
COMPONENTS = 200
#: Reference height of the wind spectra [m].
HEIGHT = 10.0


def heading(direction_deg: float) -> Array:
    """Horizontal unit vector, degrees from x towards y; exact at multiples of 90."""
    quarter, rest = divmod(direction_deg, 90)
    c, s = (math.cos(math.radians(rest)), math.sin(math.radians(rest))) if rest else (1.0, 0.0)
    for _ in range(int(quarter) % 4):
        c, s = -s, c
    return np.array([c, s, 0.0])


def turning(rows: Sequence[Any] | None) -> Callable[[float], complex]:
    """Rows [t, factor, turn_deg] -> factor e^{i turn} over time; 1 without rows."""
    if not rows:
        return lambda t: 1.0 + 0.0j
    table = np.asarray(rows)
    values = table[:, 1] * np.exp(1j * np.radians(table[:, 2]))
    return lambda t: complex(np.interp(t, table[:, 0], values))


def turned(vector: Array, by: complex) -> Array:
    """A horizontal vector times a factor e^{i turn}."""
    if by == 1:
        return vector
    x = complex(vector[0], vector[1]) * by
    return np.array([x.real, x.imag, 0.0])


class Grid:
    """A current given by rows [t, z, u, v]: increasing z, and the velocities there over time."""

    def __init__(self, rows: Sequence[Any]):
        table = np.asarray(rows)
        self.times, self.z = np.unique(table[:, 0]), np.unique(table[:, 1])
        order = np.lexsort((table[:, 1], table[:, 0]))
        self._values = table[order, 2:].reshape(len(self.times), len(self.z), 2)

    def __call__(self, t: float) -> Array:
        """Velocities (len(z), 3) at a time [m/s]."""
        k = int(np.clip(np.searchsorted(self.times, t) - 1, 0, max(len(self.times) - 2, 0)))
        found = np.zeros((len(self.z), 3))
        if len(self.times) == 1:
            found[:, :2] = self._values[0]
            return found
        share = np.clip((t - self.times[k]) / (self.times[k + 1] - self.times[k]), 0.0, 1.0)
        found[:, :2] = (1 - share) * self._values[k] + share * self._values[k + 1]
        return found


def varies(section: Any) -> bool:
    """True if a section of current, wind or force depends on time."""
    return any(getattr(section, name, None) is not None for name in ("over_time", "grid", "gusts"))


def force_over_time(section: ExternalForce) -> Callable[[float], Array]:
    """Force of a section [external_force] over time [N]."""
    steady = np.array(section.force)
    if section.over_time is None:
        return lambda t: steady
    table = np.asarray(section.over_time)
    return lambda t: steady + [np.interp(t, table[:, 0], table[:, i]) for i in (1, 2, 3)]


# -- wind --------------------------------------------------------------------------------------------------------------


def npd_spectrum(f: Array, speed: float) -> Array:
    """Spectrum [m^2/s] at 10 m for an hourly mean speed there (NPD; ISO 19901-1, A.7.4)."""
    n = 0.468
    scaled = 172.0 * f * (speed / 10) ** -0.75
    return np.asarray(320.0 * (speed / 10) ** 2 / (1 + scaled**n) ** (5 / (3 * n)))


def kaimal_spectrum(f: Array, speed: float, turbulence: float) -> Array:
    """Kaimal spectrum [m^2/s] at 10 m (IEC 61400-1, B.2), with the length scale 8.1 times 0.7 of the height."""
    time = 8.1 * 0.7 * HEIGHT / speed
    return np.asarray((turbulence * speed) ** 2 * 4 * time / (1 + 6 * f * time) ** (5 / 3))


def spectrum_of(wind: Wind) -> Callable[[Array], Array]:
    """Spectrum of the gusts of a section [wind], f [Hz] -> [m^2/s]."""
    if wind.gusts == "kaimal":
        return lambda f: kaimal_spectrum(f, wind.speed_10m, wind.turbulence or 0.0)
    return lambda f: npd_spectrum(f, wind.speed_10m)


class Gusts:
    """Deviation of the wind speed at 10 m [m/s]: a sum of components with random frequencies and phases."""

    def __init__(self, wind: Wind, seed: int):
        edges = np.geomspace(LOWEST, HIGHEST, COMPONENTS + 1)
        draws = np.random.default_rng([seed, 1]).random((2, COMPONENTS))
        f = edges[:-1] * (edges[1:] / edges[:-1]) ** draws[0]
        self.frequency, self.phase = 2 * np.pi * f, 2 * np.pi * draws[1]
        self.amplitude = np.sqrt(2 * spectrum_of(wind)(f) * np.diff(edges)) if wind.speed_10m else np.zeros(COMPONENTS)
        self._ramp = wind.ramp

    @property
    def deviation(self) -> float:
        """Standard deviation [m/s]."""
        return float(np.sqrt(np.sum(self.amplitude**2) / 2))

    def __call__(self, t: float) -> float:
        return float(ramp(t, self._ramp) * (self.amplitude @ np.cos(self.frequency * t + self.phase)))


def wind_over_time(wind: Wind, seed: int | None) -> Callable[[float], tuple[float, Array]]:
    """(speed at 10 m [m/s], direction) over time; seed: that of the gusts, None: no gusts."""
    turn, towards = turning(wind.over_time), heading(wind.direction_deg)
    gusts = Gusts(wind, seed) if wind.gusts is not None and seed is not None else None

    def at(t: float) -> tuple[float, Array]:
        by = turn(t)
        size = abs(by)
        speed = wind.speed_10m * size + (gusts(t) if gusts is not None else 0.0)
        return max(speed, 0.0), turned(towards, by / size) if size else towards

    return at


def seed_of(scene: Any, wind: Wind) -> int:
    """Seed of the gusts: its own, else that of the waves."""
    if wind.seed is not None:
        return int(wind.seed)
    return int(scene.waves.seed) if scene.waves is not None else 0


# -- water -------------------------------------------------------------------------------------------------------------


def tide_of(scene: Scene) -> Callable[[float], float]:
    """Tide level relative to t = 0 over time [m], from the rows of a tide; 0 without one.

    Raises InputError for a tide that leaves no water.
    """
    if scene.sea is None or scene.sea.tide is None:
        return lambda t: 0.0
    return remembered(partial(_tide, scene.sea.tide, scene.sea.depth), scene.sea)


def _tide(rows: Sequence[Any], depth: float) -> Callable[[float], float]:
    level = along_rows(rows, 0.0)
    start = float(level(0.0)[0])
    if (fall := -_range(rows)[0]) >= depth:
        raise InputError(
            f"sea.tide falls by {fall:g} m from t = 0 on: it must fall by less than sea.depth, {depth:g} m."
        )
    return lambda t: float(level(t)[0]) - start


def range_of_tide(scene: Scene) -> tuple[float, float]:
    """Lowest and highest tide level of a scene relative to t = 0, 0 included [m]."""
    return _range(scene.sea.tide) if scene.sea and scene.sea.tide else (0.0, 0.0)


def _range(rows: Sequence[Any]) -> tuple[float, float]:
    """Extremes of the spline through rows [t, z], possibly between rows, relative to its value at t = 0."""
    table = np.asarray(rows)
    path, times = spline(table), table[:, 0]
    heights = _extremes(path, times) - path(np.clip(0.0, times[0], times[-1]))
    return min(0.0, float(heights.min())), max(0.0, float(heights.max()))


def rate_of_tide(rows: Sequence[Any]) -> float:
    """Largest rate of the spline through rows [t, z], possibly between rows [m/s]."""
    table = np.asarray(rows)
    return float(np.abs(_extremes(spline(table).derivative(), table[:, 0])).max())


def _extremes(path: Any, times: Array) -> Array:
    """Values of a piecewise polynomial at its knots and its stationary points."""
    turns = path.derivative().roots(extrapolate=False)[0]  # not finite where it is constant
    found: Array = path(np.concatenate([times, turns[np.isfinite(turns)]]))
    return found


# -- current -----------------------------------------------------------------------------------------------------------


def direction_over_time(current: Current) -> Callable[[float], Array]:
    """Direction of a current times its speed factor, over time."""
    turn, towards = turning(current.over_time), heading(current.direction_deg)
    return lambda t: turned(towards, turn(t))


def velocity_over_time(current: Current) -> Callable[[float], Array]:
    """Velocity of a current at the surface over time [m/s]."""
    speed, direction = current.speed, direction_over_time(current)
    return lambda t: speed * direction(t)


def grid_of(scene: Scene) -> Grid:
    """The current of a scene over depth and time."""
    return remembered(partial(Grid, scene.current.grid), scene.current, "grid")
