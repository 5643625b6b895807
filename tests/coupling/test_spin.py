"""A body of revolution without moment about its axis does not begin to spin about it.

Source: pressure acts through the axis; Euler's equations conserve L_C . d of a body with equal transverse inertias.
"""

import numpy as np
import pytest
from alone import simulate

from dolfbuoy import load_scene
from dolfbuoy.model.rigid import mass_properties, rotation_of


def spins(scene):
    """Angular velocity about the axis at the recorded instants [rad/s]."""
    run = simulate(scene)
    axial = mass_properties(scene.buoy[0]).inertia[2]
    d = np.array([rotation_of(q)[:, 2] for q in run.buoy_orientation.values])
    return np.sum(run.angular_momentum.values * d, axis=1) / axial


@pytest.mark.parametrize("name", ["short", "long"])
@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2", "generalized-alpha"])
def test_shipped_buoys_do_not_spin(name, scheme):
    """Current, oblique waves, wind and a cable, without damping of the rotation, in long steps."""
    scene = load_scene(name, time__end=6.0, time__step=0.1, time__scheme=scheme, waves__ramp=1.0)
    assert scene.buoy[0].rotational_damping == 0.0
    assert np.abs(spins(scene)).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("name", ["short", "long"])
def test_shipped_buoys_do_not_spin_in_the_end(name):
    """As shipped, 120 s of backward Euler."""
    assert np.abs(spins(load_scene(name))).max() < 1e-8
