"""Derivatives of results by the parameters of a scene, and their uses."""

from .calibration import calibrate
from .derivatives import sensitivities
from .design import design
from .uncertainty import uncertainty

__all__ = ["calibrate", "design", "sensitivities", "uncertainty"]
