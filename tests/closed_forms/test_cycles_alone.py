"""Parts of the limit-cycle and derivative algorithms, each alone: leaps, neighbouring runs, reuse of matrices, powers.

Source: the same numbers by hand; made-up leaps and increments with prescribed outcomes.
"""

from types import SimpleNamespace as Fake
from unittest.mock import Mock

import numpy as np
import pytest
import ufl
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.motion import periodic
from dolfbuoy.motion.corrected import Corrected
from dolfbuoy.motion.energy import Meter, _powers, _weight
from dolfbuoy.motion.periodic import Cycle, Found, State
from dolfbuoy.motion.tangent import Pair, Tangents

# -- cycles -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "last", "shrunk", "error"),
    [
        (0.4, 1.0, 0.2, 0.4 * 0.4),
        (0.4, 1.0, 0.5, 0.4 * 1.0),
        (0.05, 1.0, 0.01, 0.05 * 0.1),
        (0.5, 1.0, 0.2, 100.0),
        (0.4, 1.0, 1.0, 100.0),
        (3.0, 1.0, 0.2, 300.0),
    ],
)
def test_error_that_a_leap_leaves(change, last, shrunk, error):
    """From the decay of leaps or of states, the slower of the two; a hundred changes if neither decays."""
    assert Cycle.left(change, last, shrunk) == pytest.approx(error, rel=1e-12)


@pytest.mark.parametrize(("step", "steps"), [(0.3, 17), (0.5, 10), (5 / 49, 49), (5 / 49 * (1 - 1e-7), 50), (7.0, 1)])
def test_whole_steps_make_a_period(step, steps):
    """As few as possible, not longer than the scene's to rounding; nothing else changes."""
    scene = load_scene("short", time__step=step)
    equal = periodic.in_equal_steps(scene)
    assert equal.time.step == pytest.approx(5.0 / steps, rel=1e-12)
    assert load_scene(equal, time__step=step) == scene


RESTS = {"cable.top.amplitude": None, "cable.top.period": None}
REGULAR = {"amplitude": 0.5, "period": 5.0}
WIND = {"speed_10m": 9.0, "area": 1.0, "height": 3.0}
NOT_ONE = "needs one period that drives all, of regular waves or of an end that is moved"
STEADY = "is one of steady current, wind and force, which change over time here"
BY_ENDS = "is none of an end that is towed or follows a record"
ROWS = [[0.0, 12.0, 0.0, -3.5], [99.0, 12.0, 1.0, -3.5]]
TIDES = [[0.0, 1.0, 0.0], [99.0, 0.5, 0.0]]
PUSHED = [[0.0, 1.0, 0.0, 0.0], [99.0, 2.0, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("name", "more", "found"),
    [
        ("driven", {}, 5.0),
        ("driven", {"waves": REGULAR}, 5.0),
        ("driven", {"waves": REGULAR | {"period": 6.0}}, NOT_ONE),
        ("driven", RESTS | {"waves": REGULAR, "cable.top.velocity": [0.1, 0.0, 0.0]}, BY_ENDS),
        ("driven", RESTS | {"waves": REGULAR, "cable.top.motion": ROWS, "cable.top.ramp": None}, BY_ENDS),
        ("driven", {"waves": REGULAR | {"period_seen_from": "water"}}, 5.0),  # which rests
        ("short", {"buoy.wind": WIND}, 5.0),
        ("short", {"current.over_time": TIDES}, STEADY),
        ("short", {"buoy.wind": WIND | {"over_time": TIDES}}, STEADY),
        ("short", {"buoy.external_force": {"force": [1.0, 0.0, 0.0], "over_time": PUSHED}}, STEADY),
        ("short-bed", {"seabed.friction": 0.0}, 5.0),
        ("short-bed", {"seabed.friction": 0.1}, "is not looked for on a bed with friction, which remembers how it was"),
    ],
)
def test_the_period_of_a_cycle(name, more, found):
    scene = load_scene(name, **more)
    if isinstance(found, float):
        assert periodic.period_of_cycle(scene) == found
        return
    with pytest.raises(InputError, match=f"^A limit cycle {found}"):
        periodic.period_of_cycle(scene)


def cycled(*leaps, accuracy=1e-3, most=40):
    """(what was found, reaches and periods of rest before each leap); leaps: (seen, |F(x) - x|, whole) or None."""
    tried, left, state = [], iter(leaps), {"missing": 1.0}
    cycle = Fake(periods=0, period=5.0, state=Fake(length=50.0), before=list(range(9)), after=list(range(9)))
    cycle.simulation, cycle.left = Fake(scene=None), Cycle.left
    cycle.state.difference = lambda one, other: abs(one - other)
    cycle.missing = lambda: state["missing"]

    def run(count):
        cycle.periods += count

    def attempt(reach, relax):
        tried.append((reach, relax))
        cycle.periods += 2 + relax
        end = next(left)
        if end is None:
            return None
        state["missing"] = end[1]
        return end[0], end[2]

    cycle.run, cycle.noted, cycle.tried = run, lambda count: run(count) or 10.0, attempt
    return Cycle.find(cycle, accuracy, most), tried, cycle


def test_leaps_until_the_error_is_small(monkeypatch):
    """At most a hundredth of the line, a quarter where one led away and twice from leap to leap; periods of rest
    before them once one has not halved what is missing."""
    monkeypatch.setattr(periodic.settings, "ramp_of", lambda scene: 12.0)
    found, tried, cycle = cycled((9.0, 0.4, True), (9.1, 0.1, True), (9.1001, 1e-3, True))
    change = 1e-4
    assert found == Found(3 + 2 + 6, pytest.approx(change * 0.1))
    assert tried == [(0.5, 0)] * 3
    found, tried, cycle = cycled(None, (9.0, 0.6, False), (9.01, 0.1, True), (9.0101, 1e-2, True))
    assert tried == [(0.5, 0), (0.125, 2), (0.25, 2), (0.5, 2)]
    assert (found.periods, found.error) == (3 + 2 + 2 + 4 * 3, pytest.approx(1e-4 * 0.1111111, rel=1e-6))
    assert (cycle.before, cycle.after) == ([5, 6, 7, 8], [5, 6, 7, 8])
    with pytest.raises(SolveError, match=r"^No limit cycle was found within 9 periods of 5 s; there may be none\.$"):
        cycled(*[(k, 0.9, True) for k in range(9)], most=9)


def test_leaps_go_where_differences_lead():
    """To the fixed point of F(x) = x/2 + 1 in one leap; limited in length if it is too far."""
    ends = []
    state = Fake(weighed=lambda change: change, put=ends.append, moved=lambda change: np.abs(change).max())
    cycle = Fake(state=state, before=[np.array([0.0]), np.array([1.0])], after=[np.array([1.0]), np.array([1.5])])
    assert Cycle.leap(cycle, 0.6)
    assert not Cycle.leap(cycle, 0.1)
    np.testing.assert_allclose(np.ravel(ends), [2.0, 1.6], rtol=1e-12)
    assert Cycle.missing(cycle) == 0.5


def test_a_line_is_bent_by_its_chords():
    """From its first node, with given lengths and directions; an object at its end follows."""
    nodes = [[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [3.0, 2.0, 3.0]]
    rows = np.array([*np.ravel(nodes), 3.0, 2.0, 4.0, 0.5, 9.0])  # three nodes, place and turn of a buoy, a number
    series, u = Fake(values=[rows, rows + 1.0], rows=[rows]), np.zeros(9 + 4 + 6 + 2)
    line, buoy, more = (Fake(slice=slice(a, b), size=b - a) for a, b in ((0, 9), (9, 13), (19, 21)))
    evolutions = [Fake(size=9, part=line), Fake(size=4, part=buoy), Fake(size=1, part=more)]
    past = Fake(series=[series], evolutions=evolutions, places=[slice(0, 9), slice(9, 13), slice(13, 14)])
    past.place_of = lambda part: slice(9, 13)
    problem = Fake(buoys={"buoy": Fake(part=buoy)}, attachments=[Fake(slice=slice(13, 19))])
    state = Fake(simulation=Fake(past=past, problem=problem, system=Fake(u=u)), _positions=np.array(nodes))
    state._nodes, before = np.arange(9).reshape(3, 3), [row.copy() for row in series.values]
    State._bend(state, np.array([0.0, 6.0, 8.0, 2.0, 0.0, 0.0, 5.0, 1.5]))  # directions of any length, then lengths
    change = np.array([0, 0, 0, -1, 3, 4, -0.5, 3, 4, -0.5, 3, 4, 0, 0])  # to (1, 5, 7) and (2.5, 5, 7)
    for row, old in zip(series.values, before, strict=True):
        np.testing.assert_allclose(row - old, change, atol=1e-14)
    np.testing.assert_allclose(u, [*change[:13], -0.5, 3, 4, 0, 0, 0, 0, 0], atol=1e-14)


def test_differences_relative_to_ranges():
    """Each force relative to its own range, points to the largest."""
    one = np.array([[1.0, 5.0, 0.0, 0.0], [2.0, 5.0, 1.0, 0.1]])
    other = np.array([[1.0, 5.0, 0.0, 0.0], [3.0, 5.0, 1.0, 0.3]])
    assert State.difference(Fake(_forces=2), one, other) == 0.5
    other[1, 0], other[1, 3] = 2.1, 0.4
    assert State.difference(Fake(_forces=2), one, other) == pytest.approx(0.3)


# -- derivatives ------------------------------------------------------------------------------------------------------


def paired(size, near=1e-3, surely=False, distance=1.0, at_rest=True):
    """(distances at which there are simulations, those that were destroyed, the pair) where u moves by `size` x."""
    made, gone = [], []

    def at(scene, x):
        return x

    def simulated(x):
        made.append(x)
        system = Fake(u=np.array([5.0 + size * x, 99.0 * x]), unknown_scales=np.array([2.0]))
        system.add_residuals = Fake(in_c=lambda: None)
        return Fake(system=system, problem=Fake(destroy=lambda: gone.append(x)), past=None, memory=[], x=x)

    run = Fake(scene=None, memory=[], comm=MPI.COMM_SELF, at_rest=at_rest, system=Fake(u=np.array([5.0, 0.0])))
    run.system.numbering = Fake(visible=np.array([0]))
    pair = Pair(run, Fake(distance=distance, near=near, surely=surely, scene_at=at), simulated)
    return made, gone, (pair.near.x, "run" if pair.other is run else pair.other.x, pair.apart)


@pytest.mark.parametrize(
    ("given", "made", "gone", "found"),
    [
        ({"size": 4.0, "near": 0.0}, [1.0, -1.0], [], (1.0, -1.0, 2.0)),
        ({"size": 4.0, "near": 1e-6}, [1e-6], [], (1e-6, "run", 1e-6)),  # 2e-6/(4/2)
        ({"size": 4.0, "near": 1e-4}, [1e-4, 1e-6], [1e-4], (1e-6, "run", 1e-6)),
        ({"size": 4.0, "near": 1.9e-6}, [1.9e-6], [], (1.9e-6, "run", 1.9e-6)),
        ({"size": 4.0, "near": 2.1e-6}, [2.1e-6, 1e-6], [2.1e-6], (1e-6, "run", 1e-6)),
        ({"size": 4.0, "near": 0.4e-6}, [0.4e-6, 1e-6], [0.4e-6], (1e-6, "run", 1e-6)),
        ({"size": 4.0, "near": 1e-4, "surely": True}, [1e-4], [], (1e-4, "run", 1e-4)),
        ({"size": 0.021, "near": 1.0, "distance": 1e-4}, [1.0, 1e-4], [1.0], (1e-4, "run", 1e-4)),
        ({"size": 0.019, "near": 1.0}, [1.0, 1.0, -1.0], [1.0], (1.0, -1.0, 2.0)),
        ({"size": 4.0, "near": 1e-6, "at_rest": False}, [1e-6, 1.0, -1.0], [1e-6], (1.0, -1.0, 2.0)),
    ],
)
def test_where_neighbours_of_a_start_are(given, made, gone, found):
    """Where unknowns change by 2e-6 of their sizes; to both sides where they hardly change, or nothing is at rest."""
    seen = paired(**given)
    assert [pytest.approx(x) for x in seen[0]] == made
    assert seen[1] == gone
    assert [pytest.approx(x) if x != "run" else x for x in seen[2]] == list(found)


@pytest.mark.parametrize(("at_rest", "made"), [(True, []), (False, [-1e-3, 1e-3])])
def test_derivatives_at_the_start(at_rest, made):
    """Differences of neighbours over their distance: of unknowns, of what is past and of memory; far ones of what
    moves, which are given back."""
    gone = []

    def at(x):
        memory = [{"a": np.array([[5.0 * x]])}, {"b": np.array([7.0, 1 - x])}]
        past = Fake(state=lambda: {"0": {"rows": [[3 * x], [1.0]]}, "1": {"rows": [[x, 2 * x]]}})
        system, problem = Fake(u=np.array([1 + 2 * x, -x])), Fake(destroy=lambda: gone.append(x))
        return Fake(memory=memory, past=past, system=system, problem=problem)

    pair = Fake(run=Fake(at_rest=at_rest), _at=at, other=at(0.25), near=at(0.75), apart=0.5)
    pair.memory = [np.zeros(1), np.zeros(2)]
    rates, (first, second) = Pair.start(pair)
    np.testing.assert_allclose(rates, [2.0, -1.0], rtol=1e-12)
    np.testing.assert_allclose(first, [[3.0], [0.0]], atol=1e-12)
    np.testing.assert_allclose(second, [[1.0, 2.0]], rtol=1e-12)
    np.testing.assert_allclose(np.concatenate(pair.memory), [5.0, 0.0, -1.0], atol=1e-12)
    assert gone == made


def test_whose_matrix_serves_derivatives():
    """The run's, made in this step with the same elements slack, unless it took too long of late."""
    law = Fake(slack=np.array([True, False]), slack_before=np.array([True, False]))
    one = Fake(run=Fake(system=Fake(law=law), comm=MPI.COMM_SELF), _made=3, _pause=0)
    one._lender = Fake(numbers=Fake(jacobians_total=4))
    assert (Tangents._may_borrow(one), one._made, one._pause) == (True, 4, -1)
    assert Tangents._may_borrow(one) is False  # none was made since
    law.slack_before[1], one._lender.numbers.jacobians_total = True, 5
    assert Tangents._may_borrow(one) is False
    one.run.system.law, one._lender.numbers.jacobians_total, one._pause = None, 6, 2
    assert Tangents._may_borrow(one) is False
    one._lender.numbers.jacobians_total = 7
    assert Tangents._may_borrow(one) is True


@pytest.mark.parametrize(("taken", "missed", "found", "pause"), [(18, 0, True, 0), (19, 0, True, 4), (1, 1, False, 4)])
def test_a_borrowed_matrix_may_take_a_few_increments_more(taken, missed, found, pause):
    """Sixteen above one for each number."""
    numbers = Fake(taken=77, missed=77)

    def step():
        assert (numbers.taken, numbers.missed) == (0, 0)
        numbers.taken, numbers.missed = taken, missed

    solver = Mock(numbers=numbers)  # which is a key
    one = Fake(_step={solver: step}, pairs=[0, 0], _pause=0)
    assert (Tangents._found(one, solver), one._pause) == (found, pause)


@pytest.mark.parametrize(
    ("may", "ends", "done", "fault"),
    [
        (True, [True], ["lender"], ""),
        (True, [False, True], ["lender", "matrix", "own"], ""),
        (False, [True], ["matrix", "own"], ""),
        (False, [False, True], ["matrix", "own", "mumps", "renewed", "own"], ""),
        (False, [False, False], ["matrix", "own", "mumps", "renewed", "own"], "At t = 0.75 s: increments of the"),
    ],
)
def test_what_is_tried_for_derivatives_of_a_step(may, ends, done, fault):
    """The run's matrix, one of their own, and pivots; forgotten where the run has forgotten; nothing after a fault."""
    tried, left = [], iter(ends)
    one = Fake(fault="", _gamma=8.0, _made_for="made", pairs=[], _predictor=Fake(count=1), _time=np.zeros(1))
    operations = Fake(step=0.125)
    series = [Fake(steps_since_start=3)]
    one.run = Fake(past=Fake(series=series, operations=operations), problem=Fake(time=np.array([0.75])))
    one.past = Fake(series=[Fake(steps_since_start=3)], operations=1, prepare=lambda step: 1 / step)
    one.past.forget = lambda: tried.append("forgotten")
    one._make_functions = lambda: tried.append("made")
    one._may_borrow, one._set_up_matrix = lambda: may, lambda: tried.append("matrix")
    one._lender, one.solver = "lender", Fake(choose_solver=tried.append)
    one._found = lambda solver: (tried.append(solver if isinstance(solver, str) else "own"), next(left))[1]
    one._renew = lambda: tried.append("renewed")
    Tangents.follow(one)
    assert tried == ["made", *done]
    assert one.fault.startswith(fault)
    assert bool(one.fault) == bool(fault)
    assert one._time[0] == 0.75
    tried.clear()
    left, series[0].steps_since_start = iter([True]), 2
    Tangents.follow(one)
    assert tried == ([] if fault else ["forgotten", *(["lender"] if may else ["matrix", "own"])])


# -- powers and second trajectories -----------------------------------------------------------------------------------


def test_powers_of_drag_are_those_of_what_moves_and_of_the_water():
    """Of other forces f . v; a weight has an energy, a buoyancy that ends at the surface a power."""
    number = lambda x: float(x(()))  # noqa: E731
    f, v, u = (ufl.as_vector(row) for row in ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [1.0, 1.0, 1.0]))
    assert [(a, number(p), m) for a, p, m in _powers("drag", f, v, u, "dx")] == [
        ("drag", 26.0, "dx"),
        ("stream", 6.0, "dx"),
    ]
    assert [(a, number(p), m) for a, p, m in _powers("drag", f, v, None, "dx")] == [("drag", 32.0, "dx")]
    assert [(a, number(p), m) for a, p, m in _powers("inertia", f, v, u, "dx")] == [("inertia", 32.0, "dx")]
    found = [(a, number(p), m) for a, p, m in _weight([f, 2 * f], u, v, "dx")]
    assert found == [("gravity", -6.0, "dx"), ("buoyancy", 64.0, "dx")]


def metered():
    """A Meter without its sums of forms but one, of a buoy that moves and one that is moved, a line, a body and a
    take-off, all of made-up numbers."""
    told = []

    def of(row):
        return Fake(position=row[:3], orientation=row[3:7], momentum=row[7:10], angular_momentum=row[10:])

    def part(first, end, **more):
        return Fake(part=Fake(slice=slice(first, end)), **more)

    def moving(first, end, gamma, history):
        return part(first, end, gamma_v=Fake(value=gamma), history_v=Fake(x=Fake(array=np.array(history))))

    fields = Fake(of=of)
    free = part(0, 13, fields=fields, motion=None, mass=Fake(mass=2.0, inertia=(1.0, 2.0, 4.0)))
    moved = part(13, 26, fields=fields, motion="given", mass=Fake(mass=1.0, inertia=(1.0, 1.0, 1.0)))
    line, body = moving(26, 28, 2.0, [0.5, 0.0]), moving(28, 30, 1.0, [0.0, 3.0])
    line.publish_lengths = told.append
    quarter = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]  # about z
    u = [0, 0, 3, *quarter, 2, 4, 6, 2, 3, 8, *[0, 0, -1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 2], *[1, 2], *[1, 0]]
    loads = [*[0] * 7, 1, 0, 2, 0, 1, 1, *[9] * 13, *[1, 1], *[0, 2]]
    residual = [*[9] * 13, *[0] * 7, 5, 0, 0, 0, 0, 3, *[9] * 4]
    rows = {"u": u, "loads": loads, "last_residual": residual}
    system = Fake(size=30, **{name: np.array(row, dtype=float) for name, row in rows.items()})
    device = Fake(velocities=lambda u: np.array([[9.0] * 3, [1.0] * 3]))
    device.reactions = lambda residual: [(1, np.array([1.0, 2.0, 3.0]))]
    problem = Fake(system=system, buoys={"a": free, "b": moved}, lines=Fake(groups=[line]), bodies=body)
    problem.take_offs, problem.models = [device], [Fake(publish_points=lambda: told.append("points"))]

    def add(b):
        b += [3.0, 5.0]

    form = Fake(prepare=lambda: told.append("prepared"), add_to_vector=add)
    meter = Fake(simulation=Fake(problem=problem, t=0.75, scene=Fake(gravity=10.0)), _work_at_ends=lambda problem: 7.0)
    meter._forms = [(["drag", "kinetic"], Fake(size=2), form)] * 2
    return meter, told


def test_what_a_meter_reads():
    """m v and I omega of a buoy that is turned by 90 degrees about z make v = (1, 2, 3) and omega = (1, 3, 2)."""
    meter, told = metered()
    found = Meter.read(meter)
    assert told == ["points", 0.75, "prepared", "prepared"]
    assert found.pop("kinetic") == pytest.approx(0.5 * (28 + 27) + 0.5 * (1 + 4) + 2 * 5.0)
    assert found.pop("gravity") == pytest.approx(2 * 10 * 3 - 1 * 10 * 1)
    assert found.pop("loads") == pytest.approx(-(1 + 6 + 3 + 2) - (2.5 + 4) - 2 * 3)
    assert found.pop("top") == pytest.approx((5 * 1 + 3 * 2) + 7 + 6)
    assert found.pop("drag") == 6.0
    assert {"elastic", "stream", "inertia", "winch"} <= set(found)
    assert set(found.values()) == {0.0}


def test_a_meter_without_loads_lines_and_bodies():
    meter, told = metered()
    problem = meter.simulation.problem
    problem.lines = problem.bodies = None
    del problem.system.loads
    found = Meter.read(meter)
    assert told == ["points", "prepared", "prepared"]
    assert (found["loads"], found["top"]) == (0.0, pytest.approx(11 + 6))


@pytest.mark.parametrize(
    ("t", "step", "steps", "follows"),
    [
        (0.5, 0.1, 3, True),
        (1.04, 0.1, 3, True),
        (1.06, 0.1, 3, False),
        (0.5, 0.1 * (1 + 1e-8), 3, False),
        (0.5, 9.0, 0, True),
    ],
)
def test_a_second_trajectory_follows_equal_steps_until_its_end(t, step, steps, follows):
    one = Fake(follows=True, steps=steps, step=0.1, until=1.0, _made_for=None, _time=np.zeros(1), _accept=lambda: None)
    one.simulation = Fake(t=t, scheme=Fake(order=1), newton=Fake(numbers=Fake(improved=True)))
    one.past = Fake(prepare=lambda step: None, operations=None, count_step=lambda: None)
    one._difference = Fake(count=1, counted=lambda: None)
    one._make_functions = one._begin = lambda: None
    assert Corrected.follow(one, step) is follows
    assert (one.steps, one.step) == ((steps + 1, step) if follows else (steps, 0.1))
    if follows:
        left = []
        one.simulation.newton.numbers.improved, one.leave = False, lambda: left.append("left")
        assert Corrected.follow(one, step) is False
        assert (left, one.follows, one.steps) == (["left"], False, steps + 1)
