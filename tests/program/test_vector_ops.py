"""Array operations of a time step in C agree with NumPy to the last bit.

Source: the same operations in NumPy.
"""

import math

import in_numpy
import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model.airy import ramp
from dolfbuoy.model.prescribed_ends import held, motion_of
from dolfbuoy.model.sea import main_propagation
from dolfbuoy.motion import history, schemes
from dolfbuoy.motion.schemes import Series
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.solver.c_code import core
from dolfbuoy.solver.vector_ops import Work, copies, extrapolation, picked, smallest, together, traced, widening, work

MOST = 9  #: rows in a sum, as many as one likes
RANDOM = np.random.default_rng(17)
SHORT = merged(MOORED, cable__elements=5, waves__ramp=0.2, time={"end": 0.4, "step": 0.02})


class Made:
    """A Past of two levels of random numbers, of which some have no rate of a rate."""

    evolutions = ()

    def __init__(self, size, scheme):
        first, fewer = Series(np.zeros(size), np.zeros(size)), np.zeros(size - size // 3)
        self.scheme, self.series = scheme, [first, Series(fewer, fewer, new=first.new_rate[: len(fewer)])]
        for series in self.series:
            for row in series.rows:
                row[:] = RANDOM.standard_normal(len(row))

    def reading(self):
        return ()

    def rules_of_forms(self, gammas):
        return []

    @property
    def rows(self):
        return np.concatenate([row for series in self.series for row in series.rows])


@pytest.mark.parametrize("size", [0, 1, 63, 64, 65, 1000])
@pytest.mark.parametrize("name", ["backward-euler", "bdf2", "generalized-alpha"])
def test_series(size, name):
    """Histories, rates and what is past, to the last bit; every row changes that a step changes."""
    made = Made(size, schemes.make_scheme(name))
    operations, before = history.Operations(made), made.rows
    gamma = operations.choose(0.037)
    functions = [operations.begin[0], *operations.find_rates, *operations.accept]
    for function in functions:
        function()
    in_c, gammas = made.rows, operations.gammas.copy()
    kept = iter(np.split(before, np.cumsum([len(row) for series in made.series for row in series.rows])))
    for series in made.series:
        for row in series.rows:
            row[:] = next(kept)
    operations.gammas[:] = 0
    for function in (in_numpy.make_histories, in_numpy.find_rates, in_numpy.advance):
        function(operations)
    np.testing.assert_array_equal(in_c, made.rows)
    np.testing.assert_array_equal(gammas, [gamma, gamma**2])
    assert size == 0 or np.mean(in_c != before) > 0.3


def test_places_of_rows():
    """Those of Python are those of C."""
    for name in ("HELD", "RATE", "PREVIOUS_RATE", "SECOND", "AUXILIARY", "NEW", "NEW_RATE", "HISTORY", "CHANGE"):
        assert getattr(schemes, name) == getattr(core().lib, name)


@pytest.mark.parametrize("size", [0, 1, 7, 1000])
def test_ranges_of_what_values_have_been(size):
    values, least, largest = np.zeros(size), np.full(size, np.inf), np.full(size, -np.inf)
    widen, seen = widening(values, least, largest), RANDOM.standard_normal((5, size))
    for values[:] in seen:
        widen()
    np.testing.assert_array_equal([least, largest], [seen.min(axis=0), seen.max(axis=0)])


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
    found, again, t = np.zeros(70), np.zeros(70), np.array([1.5])
    extrapolation(times, rows, t, found)()
    np.testing.assert_allclose(found, 1.5**powers @ coefficients, rtol=0, atol=1e-8 * np.abs(found).max())
    in_numpy.extrapolation(times, rows, t, again)()
    np.testing.assert_array_equal(found, again)


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
    used, advance = [], in_numpy.advance
    monkeypatch.setattr(history, "Work", in_numpy.work)
    monkeypatch.setattr(schemes, "extrapolation", in_numpy.extrapolation)
    monkeypatch.setattr(in_numpy, "advance", lambda operations: (used.append(True), advance(operations))[1])
    np.testing.assert_array_equal(in_c, states(scene))
    assert len(used) == len(in_c)


@pytest.mark.parametrize("duration", [0.0, 3.0, 1e9])
def test_what_is_given_as_a_function_of_time(duration):
    """A regular wave and an end that swings, before and after the end of their ramps."""
    waves = load_scene("short", waves__ramp=duration, waves__phase_deg=30)
    swing = {"amplitude": [0.2, -0.7, 1.5], "phase_deg": [20, 70, -40], "ramp": duration}
    prescribed = load_scene("driven", **{f"cable__top__{key}": value for key, value in swing.items()})
    motion, frequency = motion_of(prescribed.cables[0].top), main_propagation(waves).at_ground
    time, a, phase, u = np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(4)
    numbers = {"size": waves.waves.size, "ramp": duration, "phase": math.radians(waves.waves.phase_deg)}
    numbers |= {"t": time, "frequency": frequency, "amplitude": a, "time_phase": phase}
    wave = work("advance_wave", "wave", numbers)
    bring = together(wave, *held([([3, 0, 2], motion)], time, u))
    assert isinstance(bring, Work)
    for t in (0.0, *RANDOM.uniform(0.0, 10.0, 20), *RANDOM.uniform(0.0, 1e3, 20)):
        time[0] = t
        bring()
        expected = waves.waves.size * ramp(t, duration), math.radians(waves.waves.phase_deg) - frequency * t
        assert (a[0], phase[0]) == expected
        np.testing.assert_array_equal(u[[3, 0, 2]], motion(t))


def test_numbers_of_a_body():
    """L_C . d, and a quaternion that becomes a unit."""
    simulation = Simulation(load_scene(SHORT), MPI.COMM_SELF)
    buoy, u, out = simulation.problem.buoy, simulation.system.u, np.zeros(1)
    state, drift = u[buoy.part.slice], np.zeros(1)
    y = buoy.fields.of(state)
    read = buoy.spin.reader(u, out)
    make_unit = work("make_unit", "unit", {"quaternion": y.orientation, "drift": drift})
    farthest = 0.0
    for size in (0.1, 1.0, 1e-7):
        state[:] = RANDOM.standard_normal(len(state))
        y.orientation[:] *= (1 + size) / np.linalg.norm(y.orientation)
        expected, length = y.orientation / np.linalg.norm(y.orientation), np.linalg.norm(y.orientation)
        read()
        a, b, c, d = y.orientation.tolist()
        along = 2 * (b * d + a * c), 2 * (c * d - a * b), a * a - b * b - c * c + d * d
        spin = sum(x * part for x, part in zip(along, y.angular_momentum.tolist(), strict=True))
        assert out == buoy.spin.values(u) == spin / (a * a + b * b + c * c + d * d)
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
    values, out = np.array([3.0, -2.0, 5.0, -7.0]), np.zeros(3)
    smallest(values, [np.array([[0, 1], [2, 1]]), np.array([0, 2]), np.array([], int)], 4.0, out)()
    np.testing.assert_array_equal(out, [-2.0, 3.0, 4.0])


def test_what_lies_of_cables():
    """Lengths of pieces add up; a cable leaves the bed where the last of its pieces that lie does."""
    pieces, rows, last = np.full((5, 10), np.nan), np.zeros((2, 4)), np.zeros(2, np.int32)
    pieces[:, 0], pieces[1, 2:5] = [3.0, 0.5, 0.0, 0.0, 0.0], [7.0, 8.0, 9.0]
    fields = {"pieces": pieces, "firsts": np.array([0, 3, 5], np.int32), "cables": 2, "rows": rows, "last": last}
    work("sum_lying", "lying_cables", fields)()
    np.testing.assert_array_equal(rows, [[3.5, 7.0, 8.0, 9.0], [0.0, np.nan, np.nan, np.nan]])
    assert last[0] == 1
