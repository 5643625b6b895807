"""What a time step does with arrays in C is what NumPy does, to the last bit.

Source: the same in NumPy.
"""

import math

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model import body_c, clock_c
from dolfbuoy.model.held import held, motion_of
from dolfbuoy.model.sea import amplitude, main_propagation, time_phase
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.solver.rows import Extrapolation, Sums, Work, copies, picked, smallest, together, traced

MOST = 9  #: rows in a sum, as many as one likes
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
    sums.work()()
    in_c, rows[:] = rows.copy(), before
    sums.in_python()
    np.testing.assert_array_equal(in_c, rows)
    assert size == 0 or np.all(rows[: len(counts)] != before[: len(counts)])


def test_copies_one_after_the_other():
    array = np.arange(5.0)
    copies([(array[3:], array[2:4]), (array[:1], array[4:])])()
    np.testing.assert_array_equal(array, [3, 1, 2, 2, 3])


@pytest.mark.parametrize("count", [1, 2, 3, MOST])
def test_extrapolation(count):
    """Exact for polynomials, and as in Python."""
    times, powers = np.sort(RANDOM.uniform(-1.0, 1.0, count)), np.arange(count)
    coefficients = RANDOM.standard_normal((count, 70))
    rows = np.array([t**powers @ coefficients for t in times])
    found = np.zeros(70)
    extrapolation = Extrapolation(times, rows, np.array([1.5]), found)
    extrapolation.work()
    np.testing.assert_allclose(found, 1.5**powers @ coefficients, rtol=0, atol=1e-8 * np.abs(found).max())
    weights = extrapolation.weights.copy()
    extrapolation.weigh()
    np.testing.assert_array_equal(extrapolation.weights, weights)


def test_together():
    """One after the other, whether all are C or not."""
    array = np.arange(4.0)
    first, second = copies([(array[1:2], array[:1])]), copies([(array[2:3], array[1:2])])
    together(first, second)()
    np.testing.assert_array_equal(array, [0, 0, 0, 3])
    assert not together(first, lambda: array.__setitem__(0, 7.0), first, together(second))()
    np.testing.assert_array_equal(array, [7, 7, 7, 3])
    assert together(lambda: True, first, lambda: array.__setitem__(3, 0.0))()
    assert array[3] == 0.0
    assert not together()()


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
    monkeypatch.setattr(Extrapolation, "in_c", False)
    monkeypatch.setattr(Sums, "in_python", lambda self: (used.append(True), in_python(self))[1])
    np.testing.assert_array_equal(in_c, states(scene))
    assert len(used) > 3 * len(in_c)


@pytest.mark.parametrize("duration", [0.0, 3.0, 1e9])
def test_what_is_given_as_a_function_of_time(duration):
    """A regular wave and an end that swings, before and after the end of their ramps."""
    waves = load_scene("short", waves__ramp=duration, waves__phase_deg=30)
    swing = {"amplitude": [0.2, -0.7, 1.5], "phase_deg": [20, 70, -40], "ramp": duration}
    prescribed = load_scene("driven", **{f"cable__top__{key}": value for key, value in swing.items()})
    motion, frequency = motion_of(prescribed.cables[0].top), main_propagation(waves).at_ground
    time, a, phase, u = np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(4)
    wave = clock_c.wave(time, waves.waves.size, duration, math.radians(waves.waves.phase_deg), frequency, (a, phase))
    bring = together(wave, *held([([3, 0, 2], motion)], time, u))
    assert isinstance(bring, Work)
    for t in (0.0, *RANDOM.uniform(0.0, 10.0, 20), *RANDOM.uniform(0.0, 1e3, 20)):
        time[0] = t
        bring()
        assert (a[0], phase[0]) == (amplitude(waves, t), time_phase(waves, t, frequency))
        np.testing.assert_array_equal(u[[3, 0, 2]], motion(t))


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


def test_numbers_picked_out():
    """Copies with either sign are found by their places, what comes from elsewhere stays as it is."""
    a, b = RANDOM.standard_normal(7), RANDOM.standard_normal(4)
    before = a.copy(), b.copy()

    def function():
        return np.concatenate([-a[2:4], b[::-1], [8.0, -0.5], a[:1]])

    out, entries = np.zeros(9), traced(function, [a, b])
    np.testing.assert_array_equal(a, before[0])
    np.testing.assert_array_equal(b, before[1])
    pick = picked(entries, out)
    for array in (a, b):
        array += 1.0
    pick()
    np.testing.assert_array_equal(out, function())
    with pytest.raises(ValueError, match="no copy"):
        traced(lambda: 2 * a, [a, b])


def test_smallest():
    values = np.array([3.0, -2.0, 5.0, -7.0])
    assert smallest(values, np.array([[0, 1], [2, 1]]), 0.0)() == -2.0
    assert smallest(values, np.array([0, 2]), 0.0)() == 0.0
