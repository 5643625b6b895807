"""Bins of an irregular sea for the linear response."""

import numpy as np

from ..errors import InputError
from ..model.components import band_of, components_of, spectrum_of
from ..scene.waves import Waves

BINS = 160


def irregular_waves(scene, sea=None, direction_deg=None) -> Waves | None:
    """The irregular sea that is asked for: (significant height [m], peak period [s], gamma), else the scene's, or None.

    Raises InputError for numbers that are no sea.
    """
    if sea is None:
        return scene.waves if scene.waves and scene.waves.irregular else None
    height, period, gamma = (*sea, 3.3)[:3]
    if not (height > 0 and period > 0 and gamma >= 1):
        raise InputError(f"sea = {tuple(sea)}: must be a height and a period above 0, and gamma from 1.")
    direction = direction_deg if direction_deg is not None else scene.waves.direction_deg if scene.waves else 0.0
    asked = {"spectrum": "jonswap", "significant_height": height, "peak_period": period, "gamma": gamma}
    return Waves(direction_deg=direction, **asked)


def bins_of(waves: Waves) -> tuple[np.ndarray, np.ndarray]:
    """Rising angular frequencies [rad/s] and S dw [m^2] of each, of all directions together."""
    spectrum = spectrum_of(waves)
    if spectrum is None:
        sea = components_of(waves)
        order = np.argsort(sea.frequency)
        return sea.frequency[order], sea.amplitude[order] ** 2 / 2
    low, high = band_of(waves, spectrum)
    energies, omega = spectrum.bins(np.geomspace(max(low, spectrum.knots[0], 1e-3 * high), high, BINS + 1))
    kept = energies > 0
    return omega[kept], energies[kept]
