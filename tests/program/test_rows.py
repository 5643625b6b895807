"""What a time step does with arrays in C is what NumPy does, to the last bit.

Source: the same in NumPy.
"""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model import body_c
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.solver.rows import MOST, Sums, copies

RANDOM = np.random.default_rng(17)
SHORT = merged(MOORED, cable__elements=5, waves__ramp=0.2, time={"end": 0.4, "step": 0.02})


@pytest.mark.parametrize("size", [0, 1, 63, 64, 65, 1000])
def test_sums(size):
    """Sums whose rows are earlier sums, or their own."""
    rows = RANDOM.standard_normal((MOST + 1, size))
    counts = [1, 2, 3, MOST, 2]
    described = [
        (rows[k], list(rows[k : k + count]) if k + count <= len(rows) else list(rows[:count]))
        for k, count in enumerate(counts)
    ]
    weights = RANDOM.standard_normal(sum(counts) + len(counts))
    weights[1] = 1.0  # a divisor
    sums, before = Sums(described, weights), rows.copy()
    sums()
    in_c, rows[:] = rows.copy(), before
    sums.in_python()
    np.testing.assert_array_equal(in_c, rows)
    assert size == 0 or np.all(rows[: len(counts)] != before[: len(counts)])


def test_copies_one_after_the_other():
    array = np.arange(5.0)
    copies([(array[3:], array[2:4]), (array[:1], array[4:])])()
    np.testing.assert_array_equal(array, [3, 1, 2, 2, 3])


def states(scene):
    """All that is kept after every step of a run."""
    simulation, found = Simulation(scene, MPI.COMM_SELF), []
    for _ in simulation.run():
        rows = [row for series in simulation.past.series for row in series.rows]
        found.append(np.concatenate([[simulation.t], simulation.system.u, *rows]))
    simulation.problem.destroy()
    return np.array(found)


@pytest.mark.parametrize("tolerance", [None, 1e-2])
@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2", "generalized-alpha"])
def test_same_run(scheme, tolerance, monkeypatch):
    scene = load_scene(SHORT, time__scheme=scheme, time__tolerance=tolerance)
    in_c = states(scene)
    used, in_python = [], Sums.in_python
    monkeypatch.setattr(Sums, "in_c", False)
    monkeypatch.setattr(Sums, "in_python", lambda self: (used.append(True), in_python(self)))
    np.testing.assert_array_equal(in_c, states(scene))
    assert len(used) > 3 * len(in_c)


def test_numbers_of_a_body():
    """L_C . d, and a quaternion that becomes a unit."""
    simulation = Simulation(load_scene(SHORT), MPI.COMM_SELF)
    buoy, u, out = simulation.problem.buoy, simulation.system.u, np.zeros(1)
    state, drift = u[buoy.part.slice], np.zeros(1)
    y = buoy.fields.of(state)
    read, make_unit = buoy.spin.reader(u, out), body_c.make_unit(y.orientation, drift)
    farthest = 0.0
    for size in (0.1, 1.0, 1e-7):
        state[:] = RANDOM.standard_normal(len(state))
        y.orientation[:] *= (1 + size) / np.linalg.norm(y.orientation)
        expected, length = y.orientation / np.linalg.norm(y.orientation), np.linalg.norm(y.orientation)
        read()
        np.testing.assert_array_equal(out, buoy.spin.values(u))
        make_unit()
        np.testing.assert_array_equal(y.orientation, expected)
        farthest = max(farthest, abs(length - 1))
        assert drift == farthest
    simulation.problem.destroy()
