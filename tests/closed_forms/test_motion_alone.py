"""Parts of a run, each alone: histories, retries, milestones, local errors, starts.

Source: the same numbers by hand; made-up steps with prescribed outcomes.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.motion import simulation, start
from dolfbuoy.motion.consistent import _at_start
from dolfbuoy.motion.history import Past
from dolfbuoy.motion.schemes import (
    BDF2,
    HELD,
    BackwardEuler,
    GeneralizedAlpha,
    Predictor,
    Series,
    make_scheme,
    same_step,
)
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.motion.start import _moves
from dolfbuoy.motion.stepping import AdaptiveControl, JumpControl, StepControl
from dolfbuoy.scene import Top
from dolfbuoy.statics.equilibrium import solve_equilibrium

INF = math.inf


# -- the past ---------------------------------------------------------------------------------------------------------


def test_steps_that_differ_by_rounding():
    assert [same_step(1.0, h) for h in (1.0, 1 + 0.9e-9, 1 - 0.9e-9, 1 + 1.1e-9, 1 - 1.1e-9)] == [True] * 3 + [
        False
    ] * 2


def test_a_series_forgets_all_but_the_present():
    """And keeps an auxiliary rate, with what goes with it."""
    for averaging in (False, True):
        series = Series(np.array([1.0]), np.array([2.0]))
        series.values, series.second, series.auxiliary = [[3.0], [1.0]], 5.0, 7.0
        series.previous_rate, series.step, series.steps_since_start, series.averaging = 9.0, 0.1, 4, averaging
        series.forget()
        assert (series.count, series.values[0][0], series.steps_since_start, series.auxiliary[0]) == (1, 3.0, 0, 7.0)
        found = series.previous_rate[0], series.second[0], series.step
        assert found == ((9.0, 5.0, 0.1) if averaging else (2.0, 0.0, None))


@pytest.mark.parametrize(("known", "left"), [(3, 3), (4, 2), (5, 3)])
def test_rates_of_positions_are_found_anew_where_the_step_shrinks(known, left):
    """From four positions on; else rates of the old step are carried over.  Of t^2 both are 2 t."""
    t = -0.05 * np.arange(known)
    positions, rates = Series(t[:1] ** 2, 2 * t[:1]), Series(-0.1 * np.arange(1), np.full(1, 2.0), True)
    positions.values, positions.step = t[:, None] ** 2, 0.05  # ready before
    rates.values, rates.previous_rate, rates.step = -0.2 * np.arange(3)[:, None], 2.0, 0.1
    BDF2().begin(0.05, rates, positions)
    assert (rates.count, rates.step) == (left, 0.05)
    np.testing.assert_allclose(np.ravel(rates.values), 2 * t[:left], atol=1e-12)


def test_second_derivatives_at_a_new_start_are_rates_of_rates():
    one, two = Series(np.zeros(3), np.zeros(3)), Series(np.zeros(2), np.array([4.0, 5.0]))
    one.values, two.values, one.steps_since_start = [np.zeros(3)] * 2, [np.zeros(2)] * 3, 5
    Past.forget(Fake(series=[one, two]))
    np.testing.assert_array_equal(one.second, [4.0, 5.0, 0.0])
    assert (one.count, two.count, one.steps_since_start) == (1, 1, 0)


@pytest.mark.parametrize(
    ("change", "good"),
    [
        ({}, True),
        ({"count": HELD}, True),
        ({"count": 0}, False),
        ({"count": HELD + 1}, False),
        ({"steps_since_start": -1}, False),
    ],
)
def test_states_of_series_that_can_be(change, good):
    series = Series(np.array([1.0]), np.array([2.0]))
    state = series.state() | change
    if good:
        series.restore(state)
        assert series.count == state["count"]
    else:
        with pytest.raises(ValueError, match="no number of past values"):
            series.restore(state)


def test_what_does_not_evolve_has_rates_of_backward_euler():
    past = Past([], np.zeros(0), BackwardEuler())
    past.begin()
    assert (past.order, past.prepare(0.25), past.largest_difference(1)) == (0, 4.0, 0.0)
    past.count_step()
    past.give_up()


def test_a_start_of_newton_from_few_solutions():
    """As many as are asked for, the newest first; taken up again in the same order."""
    predictor = Predictor(2)
    for t in (0.0, 1.0, 3.0):
        predictor.add(t, np.array([t**2]))
    assert (predictor.times.tolist(), predictor.values.tolist()) == ([3.0, 1.0], [[9.0], [1.0]])
    other = Predictor(2)
    other.add(7.0, np.zeros(1))
    other.restore({"times": [5.0, 4.0], "values": [[1.0], [2.0]]})
    assert (other.times.tolist(), other.values.tolist(), other.count) == ([5.0, 4.0], [[1.0], [2.0]], 2)
    assert (Predictor().points, make_scheme("generalized-alpha").alpha_f) == (3, 1 / 1.8)
    assert (GeneralizedAlpha().alpha_f, make_scheme("generalized-alpha", 0.0).alpha_f) == (1 / 1.8, 1.0)


def test_rates_and_values_at_the_start_from_three_steps():
    """Of y = 1 + 2 t + 3 t^2: rates and lagging values at h/2 and 3 h/2; lagging rates at the ends of steps."""
    h = 0.1
    centred = [(np.array([2 + 6 * t] * 2), np.array([1 + 2 * t] * 2)) for t in (0.5 * h, 1.5 * h, 2.5 * h)]
    at_ends = [(np.array([2 + 6 * t] * 2), value) for t, (_, value) in zip((h, 2 * h, 3 * h), centred, strict=True)]
    steps = [(np.where([False, True], b, a), v) for (a, v), (b, _) in zip(centred, at_ends, strict=True)]
    rate, value = _at_start(steps, np.array([False, True]), np.array([1.5, 1.5, 9.0]))
    np.testing.assert_allclose(rate, [2.0, 2.0], rtol=1e-14)
    np.testing.assert_allclose(value, [1.5, 1.0], rtol=1e-14)


# -- starts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "moves"),
    [
        ({"kind": "fixed"}, False),
        ({"velocity": [0.0, 0.0, 1e-3]}, True),
        ({"amplitude": [0.1, 0.0, 0.0], "period": 5.0}, True),
        ({"amplitude": [0.1, 0.0, 0.0], "period": 5.0, "ramp": 5.0}, False),
        ({"motion": [[0, 0, 0, 0], [1, 1, 0, 0], [2, 0, 0, 0]]}, False),
        ({"motion": [[0, 1, 0, 0], [2, 1, 0, 0]]}, False),
    ],
)
def test_ends_that_move_at_the_start(more, moves):
    """A ramp begins at rest, and so does what goes through rows."""
    top = Top(**{"kind": "prescribed", "position": [1.0, 2.0, 3.0]} | more)
    assert _moves(top, 10.0) is moves
    assert _moves(None, 10.0) is False


@pytest.mark.parametrize("check", ["check_feasible", "check_first_shape"])
def test_starts_that_cannot_be_are_refused_before_anything_is_made(check, monkeypatch):
    def refuses(scene):
        raise InputError("it cannot be")

    monkeypatch.setattr(start, check, refuses)
    with pytest.raises(InputError, match="it cannot be"):
        start.initial_state(load_scene("hanging-chain"), MPI.COMM_SELF, None)


# -- steps ------------------------------------------------------------------------------------------------------------


def advanced(*ends, control=None, target=1.0):
    """(steps that count, steps that were tried) of a simulation whose steps end as they are told to."""
    tried, left = [], iter(ends)
    run = Fake(t=0.0, control=control or StepControl(0.5), scene=Fake(time=Fake(step=0.5)), iterations=10)
    run.past, run._why = Fake(forget=lambda: tried.append("forgotten")), lambda: " because"

    def step(h, judge):
        end = next(left, 3)
        tried.append(h)
        if end is None:
            raise SolveError("it diverged")
        if end == "restart":
            run.control.restart = True
            return None
        run.t += h
        return end

    run.step = step
    return list(Simulation.advance(run, target)), tried, run


def test_steps_that_fail_are_halved_until_they_cannot_be():
    """The past is forgotten where the control says so; only what counts is told, with its iterations."""
    counted, tried, run = advanced(2, None, 4)
    assert (counted, tried, run.iterations) == ([(0.5, 2), (0.25, 4), (0.25, 3)], [0.5, 0.5, 0.25, 0.25], 19)
    counted, tried, run = advanced("restart", 4)
    assert (counted, tried) == ([(0.5, 4), (0.5, 3)], [0.5, "forgotten", 0.5, 0.5])
    assert not run.control.restart
    assert advanced(target=0.9e-9 * 0.5)[1] == []
    with pytest.raises(SolveError) as raised:
        advanced(2, *[None] * 3, control=StepControl(0.5, 0.2))
    said = "At t = 0.5 s, step 0.25 s: it diverged (smallest step 0.2 s) because."
    assert str(raised.value) == said


@pytest.mark.parametrize(
    ("name", "radius", "cable", "said"),
    [
        ("generalized-alpha", 0.8, True, True),
        ("generalized-alpha", 0.0, True, False),
        ("generalized-alpha", 0.8, None, False),
        ("bdf2", 0.8, True, False),
    ],
)
def test_why_steps_of_generalized_alpha_fail(name, radius, cable, said):
    found = Simulation._why(Fake(scheme=Fake(name=name), scene=Fake(time=Fake(spectral_radius=radius), cable=cable)))
    assert found.startswith(f"; generalized-alpha with time.spectral_radius = {radius:g} keeps jumps") == said
    assert bool(found) == said


@pytest.mark.parametrize(
    ("time", "targets"),
    [
        ({"tolerance": None, "step": 0.4, "end": 1.0}, [0.4, 0.8, 1.0]),
        ({"tolerance": None, "step": 0.1, "end": 0.3}, [0.1, 0.2, 0.3]),
        ({"tolerance": 1e-3, "output_every": 0.5, "end": 1.2}, [0.5, 1.0, 1.2]),
        ({"tolerance": 1e-3, "output_every": None, "end": 400.0}, [2.0 * k for k in range(1, 201)]),
        ({"tolerance": 1e-3, "output_every": None, "end": 0.0}, []),
    ],
)
def test_milestones_of_a_run(time, targets, monkeypatch):
    """Multiples of the step, or of output_every, or two hundred; whoever watches is told how many."""
    asked, told = [], []
    monkeypatch.setattr(simulation.pace, "watch", Fake(reached=lambda k, count: told.append((k, count))))
    run = Fake(scene=Fake(time=Fake(**time)), advance=lambda target: asked.append(target) or [target])
    assert list(Simulation.run(run)) == asked
    np.testing.assert_allclose(asked, targets, rtol=1e-12)
    assert told == [(k, len(targets)) for k in range(1, len(targets) + 1)]


@pytest.mark.parametrize(("order", "constant", "allowed"), [(1, 0.5, 4e-4**2), (2, 2 / 9, 4e-4**1.5)])
def test_local_errors_over_what_is_allowed(order, constant, allowed):
    """C/(1 + C) of what the extrapolated past differs by, over (tolerance/2.5)^((p + 1)/p)."""
    run = Fake(scene=Fake(time=Fake(tolerance=1e-3)), scheme=Fake(order=order, error_constant=constant))
    run.comm, run._find_rates, run.past = (
        MPI.COMM_SELF,
        lambda: None,
        Fake(largest_difference=lambda order: 3e-6 * order),
    )
    expected = 3e-6 * order * constant / (1 + constant) / allowed
    assert Simulation._local_error(run) == pytest.approx(expected, rel=1e-12)
    run.past = Fake(largest_difference=lambda order: None)
    assert Simulation._local_error(run) is None
    run.scene.time.tolerance = None
    assert Simulation._local_error(run) is None


def test_quaternions_drift_as_far_as_that_of_any_buoy():
    memory = [{"quaternion_drift": np.array([x])} for x in (1e-9, 5e-9, 2e-9)]
    assert Simulation.quaternion_drift.fget(Fake(memory=[{}, *memory])) == 5e-9
    assert Simulation.quaternion_drift.fget(Fake(memory=[{}])) == 0.0


@pytest.mark.parametrize(
    ("time", "ropes", "kind", "smallest", "largest"),
    [
        ({"tolerance": None}, None, StepControl, 0.1 / 4096, 0.1),
        ({"tolerance": None}, [1], JumpControl, 0.1 / 4096, 0.1),
        ({"tolerance": 1e-3}, [1], AdaptiveControl, 1e-5, 3.0),
        ({"tolerance": 1e-3, "min_step": 1e-3, "max_step": 0.7}, None, AdaptiveControl, 1e-3, 0.7),
    ],
)
def test_controls_of_steps(time, ropes, kind, smallest, largest):
    given = {"step": 0.1, "end": 30.0, "min_step": None, "max_step": None} | time
    found = Simulation._make_control(Fake(scene=Fake(time=Fake(**given)), ropes=ropes, scheme=Fake(order=2)))
    assert (type(found), found.step, found.restart) == (kind, 0.1, False)
    assert (found.accepted, found.rejected, found.failed, found.restarts) == (0, 0, 0, 0)
    assert (found.smallest, found.largest) == (pytest.approx(smallest), pytest.approx(largest))


def test_a_run_that_goes_on_looks_for_no_equilibrium(monkeypatch):
    """Nor is it at rest, whatever it began from; another scene's state is refused."""
    scene = load_scene("driven", **{"cable.elements": 4, "time.step": 0.1})
    run = Simulation(scene, MPI.COMM_SELF)
    assert (run.at_rest, run.end_tension.shape) == (True, (1, 3))
    run.step(0.1)
    monkeypatch.setattr(simulation, "initial_state", None)
    again = Simulation(scene, MPI.COMM_SELF, state=run.state())
    assert (again.at_rest, again.t) == (False, 0.1)
    np.testing.assert_array_equal(again.system.u, run.system.u)
    for one in (run, again):
        one.problem.destroy()


def test_a_start_that_moves_leaves_nothing_of_its_tiny_steps():
    """But the forces that it was taken for: places, time and memory are those of t = 0, and so is what forms read."""
    changes = {"buoy.initial.buoy_angular_velocity": [0.3, 0.2, 0.5], "waves.ramp": 0.0}
    scene = load_scene("short", **{"cable.elements": 8, "time.step": 0.1} | changes)
    begun = Simulation(scene)
    problem, u = begun.problem, begun.system.u
    buoy, lines = problem.buoys["buoy"], problem.lines
    assert not begun.at_rest
    assert (begun.t, problem.time[0], begun.quaternion_drift) == (0.0, 0.0, 0.0)
    assert (begun.predictor.times.tolist(), begun.predictor.points, begun.iterations) == ([0.0], 3, 0)
    np.testing.assert_array_equal(begun.predictor.values, [u])
    np.testing.assert_array_equal(lines.w.x.array[: lines.part.size], u[lines.part.slice])
    rest = solve_equilibrium(scene)
    still, moving = (one.fields.of(v[one.part.slice]) for one, v in ((rest.buoys["buoy"], rest.system.u), (buoy, u)))
    np.testing.assert_array_equal(moving.position, still.position)
    assert begun.scheme.name == scene.time.scheme
    np.testing.assert_array_equal(u[lines.node_dofs], rest.system.u[rest.lines.node_dofs])
    for one in (rest, problem):
        one.destroy()


def test_a_problem_that_is_used_again_begins_anew():
    """At t = 0, with ends and forms where they are then, whatever it was left with."""
    scene = load_scene("driven", **{"cable.elements": 4, "time.step": 0.1, "cable.top.ramp": 0.3})
    first = Simulation(scene, MPI.COMM_SELF)
    begun, problem = first.system.u.copy(), first.problem
    for _ in range(4):
        first.step(0.1)
    assert np.abs(first.system.u - begun).max() > 0.1
    again = Simulation(scene, MPI.COMM_SELF, problem=problem)
    assert (again.problem is problem, again.t, problem.time[0], again.at_rest) == (True, 0.0, 0.0, True)
    np.testing.assert_array_equal(again.system.u, begun)
    lines = problem.lines
    np.testing.assert_array_equal(lines.w.x.array[: lines.part.size], begun[lines.part.slice])
    assert lines.part.size == len(begun)
    problem.destroy()
