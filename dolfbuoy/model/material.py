"""Numbers of a line's material, from its section of a scene."""

import math


def cross_section(cable) -> float | None:
    """A0 [m^2] of a section [cable]; None without area and diameter."""
    if cable.area is not None:
        return cable.area
    return math.pi * cable.diameter**2 / 4 if cable.diameter else None


def weight_per_length(scene, cable) -> float:
    """Weight in water per unstretched length, w [N/m], of a section [cable]; negative for a cable that floats."""
    displaced = scene.sea.density * cross_section(cable) if scene.sea else 0.0
    return (cable.line_density - displaced) * scene.gravity
