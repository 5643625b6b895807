"""Waves for the linear response: small regular ones and their forces, an irregular sea by frequency and direction."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..model.airy import Components, band_of, components_of, directions_at, is_spread, spectrum_of
from ..scene.sections import Scene
from ..scene.sentences import made
from ..scene.waves import Waves
from .linearisation import Linearisation, free_rows, without_rates

#: Number of frequencies; number of directions for each, which differ from frequency to frequency.
BINS, DIRECTIONS = 160, 4
#: Largest number of components that are treated individually.
MOST = 500
#: Golden ratio conjugate: any number of its multiples, modulo 1, are evenly distributed.
GOLDEN = (np.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class Bins:
    """Bins of a sea; omega (n,): increasing frequencies as in `waves.period`, width (n,) [rad/s]; for each wave, (k,):
    number of its frequency, direction [deg], energy S dw [m^2]."""

    omega: NDArray[Any]
    width: NDArray[Any]
    number: NDArray[Any]
    direction_deg: NDArray[Any]
    energy: NDArray[Any]

    def pairs(self) -> Any:
        """(omega, direction [deg]) of each wave."""
        return zip(self.omega[self.number], self.direction_deg, strict=True)

    def density(self, values: Any = 1.0) -> NDArray[Any]:
        """Spectral density (..., n) of quantities with energies `values` (..., k) per m^2 of the waves."""
        sums = np.zeros((*np.shape(values)[:-1], len(self.omega)))
        places: Any = (..., self.number)
        np.add.at(sums, places, values * self.energy)
        return np.asarray(sums / self.width)


def irregular_waves(
    scene: Scene, sea: tuple[Any, ...] | None = None, direction_deg: float | None = None
) -> Waves | None:
    """The irregular sea requested: (significant height [m], peak period [s], gamma, spreading exponent s or None),
    else the scene's, or None.

    Raises InputError for invalid numbers.
    """
    if sea is None:
        return scene.waves if scene.waves and scene.waves.irregular else None
    given: tuple[Any, ...] = (*sea, *(3.3, None)[len(sea) - 2 :])
    height, period, gamma, spreading = given
    if not (height > 0 and period > 0 and gamma >= 1 and (spreading is None or spreading > 0)):
        raise InputError(
            f"sea = {tuple(sea)}: must be a height and a period above 0, gamma from 1, and a spreading above 0."
        )
    direction = direction_deg if direction_deg is not None else scene.waves.direction_deg if scene.waves else 0.0
    requested = {"spectrum": "jonswap", "significant_height": height, "peak_period": period, "gamma": gamma}
    waves: Waves = made(Waves, direction_deg=direction, spreading=spreading, **requested)
    return waves


def bins_of(waves: Waves) -> Bins:
    """Bins of a spectrum, with a few directions of equal energy per frequency; or of given components."""
    spectrum = spectrum_of(waves)
    if spectrum is None:
        return _of_components(components_of(waves), waves.direction_deg)
    low, high = band_of(waves, spectrum)
    edges = np.geomspace(max(low, spectrum.knots[0], 1e-3 * high), high, BINS + 1)
    energies, omega = spectrum.bins(edges)
    kept = energies > 0
    omega, energies, width = omega[kept], energies[kept], np.diff(edges)[kept]
    if not is_spread(waves):
        return Bins(omega, width, np.arange(len(omega)), np.full(len(omega), waves.direction_deg), energies)
    number = np.tile(np.arange(len(omega)), DIRECTIONS)
    parts = (number * GOLDEN % 1 + np.repeat(np.arange(DIRECTIONS), len(omega))) / DIRECTIONS
    turned = waves.direction_deg + directions_at(waves, omega[number], parts)
    return Bins(omega, width, number, turned, energies[number] / DIRECTIONS)


def _of_components(sea: Components, main_deg: float) -> Bins:
    """Bins of components: individually, or if there are many, grouped by frequency and then by direction."""
    energy = sea.amplitude**2 / 2
    if len(energy) <= MOST:
        omega, number = np.unique(sea.frequency, return_inverse=True)
        width = np.gradient(omega) if len(omega) > 1 else np.full(1, np.nan)
        return Bins(omega, width, number, sea.direction_deg, energy)
    edges = np.geomspace(sea.frequency.min(), 1.0001 * sea.frequency.max(), BINS + 1)
    number, turned = np.digitize(sea.frequency, edges) - 1, (sea.direction_deg - main_deg + 180) % 360 - 180
    order = np.lexsort((turned, number))
    energy, frequency, turned, number = (values[order] for values in (energy, sea.frequency, turned, number))
    total = np.bincount(number, energy, BINS)
    below = np.cumsum(energy) - energy / 2 - (np.cumsum(total) - total)[number]  # in its bin, up to its own middle
    group = DIRECTIONS * number + np.clip(DIRECTIONS * below / total[number], 0, DIRECTIONS - 1).astype(int)
    kept, group = np.unique(group, return_inverse=True)
    energies, turns = (np.bincount(group, energy * x) for x in (1.0, turned))
    filled, number = np.unique(kept // DIRECTIONS, return_inverse=True)
    omega = np.bincount(np.digitize(frequency, edges) - 1, energy * frequency, BINS)[filled] / total[filled]
    return Bins(omega, np.diff(edges)[filled], number, main_deg + turns / energies, energies)


#: Amplitude [m] of waves used for linear forces: relative effects of drag and rounding are below 1e-5.
SMALL = 1e-5
#: Range of wave periods that may be requested [s].
SHORTEST, LONGEST = 0.01, 10_000.0


def check_periods(name: str, periods: NDArray[Any] | list[float]) -> None:
    """Refuse invalid wave periods.  Raises InputError, which begins with `name`."""
    for period in periods:
        if not SHORTEST <= period <= LONGEST:
            raise InputError(f"{name} {period:g}: must be from {SHORTEST:g} to {LONGEST:g} s.")


def small_waves(scene: Scene, period: float, direction_deg: float = 0.0, amplitude: float = 0.0) -> Waves:
    """A regular section [waves]; its stretching, irrelevant in small waves, is that of the scene, to use the same
    forms, and so is the frame of its period."""
    same = {name: getattr(scene.waves, name) for name in ("stretching", "period_seen_from")} if scene.waves else {}
    waves: Waves = made(Waves, amplitude=amplitude, period=period, direction_deg=direction_deg, **same)
    return waves


def force(found: Linearisation, time_phase: float) -> NDArray[Any]:
    """Residual of the free unknowns in a small wave at a phase (phase - omega t), over its amplitude [physical / m].

    Minus its rows of the buoy's momenta are the loads of an undisturbed wave on the buoy at rest.
    """
    return free_rows(found.problem, slope(found, time_phase))


def slope(found: Linearisation, time_phase: float) -> NDArray[Any]:
    """`force`, for all local unknowns."""
    system: Any = found.problem.system
    without_rates(found.problem)
    system.u[:] = found.u
    system.publish()
    sides = []
    for amplitude in (SMALL, -SMALL):
        for model in found.problem.models:
            model.sea.set_wave(amplitude, time_phase)
        sides.append(system.evaluate().copy())
    return np.asarray((sides[0] - sides[1]) / (2 * SMALL))
