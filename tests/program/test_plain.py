"""The fast path gives the same trajectories as a plain implementation.

Source: a plain implementation with block assembly and UMFPACK (tests/support/plain.py).
"""

import numpy as np
import pytest
from mpi4py import MPI
from plain import simulation

from dolfbuoy import load_scene
from dolfbuoy.motion.simulation import Simulation

STEPS = 25


def trajectory(made):
    rows = []
    for _ in zip(range(STEPS), made.run(), strict=False):
        rows.append(np.concatenate([made.system.u, made.end_tension.ravel()]))
    sizes = np.abs(rows).max(axis=0)
    made.problem.destroy()
    return np.array(rows), np.maximum(sizes, 1e-3 * sizes.max())


@pytest.mark.parametrize(("scheme", "step"), [("backward-euler", 0.01), ("bdf2", 0.05), ("generalized-alpha", 0.05)])
@pytest.mark.parametrize(("name", "cells"), [("short", 20), ("driven", 10)])
def test_same_trajectory_as_the_plain_implementation(name, cells, scheme, step):
    overrides = {"cable.elements": cells, "time.scheme": scheme, "time.step": step}
    scene = load_scene(name, **overrides)
    fast, sizes = trajectory(Simulation(scene, MPI.COMM_SELF))
    plain, _ = trajectory(simulation(scene))
    assert np.ptp(fast[:, -1]) > 0
    assert np.abs((fast - plain) / sizes).max() < 1e-9
