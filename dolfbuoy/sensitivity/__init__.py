"""Derivatives of results by the numbers of a scene, and what follows from them."""

from .calibration import calibrate
from .derivatives import sensitivities
from .design import design
from .uncertainty import uncertainty

__all__ = ["calibrate", "design", "sensitivities", "uncertainty"]
