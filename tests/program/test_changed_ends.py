"""Line ends moved by a run's callback.

Source: the prescribed position.
"""

import numpy as np
import pytest
from alone import simulate

from dolfbuoy import load_scene

TOPS = {
    "fixed": {"kind": "fixed"},
    "swings": {"kind": "prescribed", "amplitude": [0.0, 0.0, 0.1], "period": 1.0},
}


@pytest.mark.parametrize("kind", TOPS)
def test_an_end_goes_where_a_callback_puts_it(kind):
    """From the next step on."""
    cable = {"length": 10.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 6, "anchor": [0.0, 0.0, 0.0]}
    time = {"end": 1.0, "step": 0.02, "scheme": "backward-euler"}
    scene = load_scene({"cable": cable | {"top": TOPS[kind] | {"position": [6.0, 0.0, 5.0]}}, "time": time})
    moved = load_scene(scene, cable__top__position=[6.2, 0.0, 5.0])

    def progress(simulation, iterations):
        if abs(simulation.t - 0.5) < 1e-6:
            simulation.problem.change(moved)

    found = simulate(scene, progress=progress, time__output_every=0.02)
    x = found.cable_position.values[:, -1, 0]
    np.testing.assert_allclose(x[found.frame.values < 0.51], 6.0, rtol=1e-12)
    np.testing.assert_allclose(x[found.frame.values > 0.51], 6.2, rtol=1e-12)
