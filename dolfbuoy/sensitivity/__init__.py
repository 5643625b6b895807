"""Derivatives of results by the numbers of a scene, and what follows from them."""

from .calibration import calibrate
from .derivatives import sensitivities
from .uncertainty import uncertainty

__all__ = ["calibrate", "sensitivities", "uncertainty"]
