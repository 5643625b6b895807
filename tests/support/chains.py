"""Two small scenes, one a variation of the other."""

from dynamics_helpers import merged

CHAIN = {
    "cable": {"length": 2.0, "line_density": 0.5, "elements": 2, "top": {"kind": "free"}},
    "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.6, 0.0, -1.2]]},
    "time": {"end": 0.1, "step": 0.02},
}
OTHER = merged(CHAIN, cable__line_density=0.7)
