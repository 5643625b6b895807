"""The water surface of a scene at a fixed point, over time."""

import math

import numpy as np

from ..model import sea


def elevation(scene, times: np.ndarray, point) -> np.ndarray:
    """Elevation [m] of a scene's waves, ramp included, at (x, y) [m] at these times [s]."""
    along = float(np.dot(sea.heading(scene.waves.direction_deg)[:2], point))
    phase = (
        sea.wavenumber(scene) * along + math.radians(scene.waves.phase_deg) - 2 * math.pi / scene.waves.period * times
    )
    return scene.waves.size * np.array([sea.ramp(t, scene.waves.ramp) for t in times]) * np.cos(phase)
