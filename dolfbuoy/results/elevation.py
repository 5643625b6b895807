"""The water surface of a scene at a fixed point, over time."""

import numpy as np

from ..model.airy import AirySum


def elevation(scene, times: np.ndarray, point) -> np.ndarray:
    """Elevation [m] of a scene's waves, ramp included, at (x, y) [m] at these times [s]."""
    return AirySum.of(scene).over_time(np.asarray(times), point)
