"""Limit cycles without the transient: the end state of a long run in a tenth of its periods; scenes without a cycle.

Source: runs of the same scene until nothing changes from period to period.
"""

from types import SimpleNamespace as Fake

import numpy as np
import pytest
from alone import periodic, simulate
from dynamics_helpers import running

from dolfbuoy import InputError, SolveError, load_scene
from dolfbuoy.motion import periodic as motion
from dolfbuoy.motion.periodic import Cycle, in_equal_steps
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.scene import settings

COARSE = {"cable.elements": 8, "time.step": 0.1}
#: Scene, its changes, periods of the run beside it.
SCENES = {
    "a buoy in waves": ("short", COARSE | {"time.scheme": "generalized-alpha"}, 40),
    "backward Euler": ("short", COARSE, 30),
    "a driven end, P2-P1": ("driven", {"cable.elements": 6, "time.step": 0.05, "time.scheme": "bdf2"}, 8),
    "three lines and a buoy": ("three-legs", {"time.step": 0.1, "time.scheme": "bdf2"}, 30),
}
#: Waves in which the buoy creeps to where they carry it for an hour [m], and periods until it is there to 1e-5.
SLOW = {"as the scene is": (1.5, 1600), "low, where leaps see the creep late": (0.6, 700)}
CREEPING = {"cable.elements": 100, "time.step": 0.12, "time.scheme": "generalized-alpha"}


def last_period(scene, periods):
    """Record of a run's last period, including its first instant."""
    scene = in_equal_steps(scene)
    period = settings.period_of(scene)
    record = simulate(scene, **{"time.end": periods * period, "time.output_every": period})
    return record.isel(time=slice(-1 - round(period / scene.time.step), None))


def farthest(one, other, names=("tension_top", "tension_anchor", "buoy_position", "mooring_point")):
    """Largest difference between two periods, relative to each quantity's range; for points, to the largest range."""
    found = []
    for name in (name for name in names if name in other):
        a, b = one[name].values, other[name].values
        found.append(np.abs(a - b).max() / np.ptp(b, axis=0).max())
    return max(found)


@pytest.mark.parametrize("case", SCENES.values(), ids=SCENES)
def test_cycle_is_that_of_a_long_run(case):
    name, changes, periods = case
    scene = load_scene(name, **changes)
    found = periodic(scene)
    assert found.attrs["cycle_error"] <= 1e-4
    assert found.attrs["cycle_periods"] < 20
    assert found.time.values[[0, -1]] == pytest.approx([0.0, settings.period_of(scene)], abs=1e-9)
    assert farthest(found, last_period(scene, periods)) < 1e-4
    ends = np.abs(found.tension_top.values[0] - found.tension_top.values[-1]).max()
    assert ends < 1e-4 * np.ptp(found.tension_top.values)


@pytest.mark.slow
@pytest.mark.parametrize(("amplitude", "periods"), SLOW.values(), ids=SLOW)
def test_creeping_mooring_takes_a_tenth_of_the_periods(amplitude, periods):
    scene = load_scene("long", **CREEPING | {"waves.amplitude": amplitude})
    found, end = periodic(scene), last_period(scene, periods)
    assert found.attrs["cycle_periods"] < periods / 10
    assert farthest(found, end) < 1e-4
    assert farthest(last_period(scene, 5 * found.attrs["cycle_periods"]), end) > 1e-4


def test_error_is_not_small_while_a_period_leads_as_far_away_as_before():
    """The remaining error is estimated exactly if every leap leaves a half, or a tenth."""
    for factor in (0.5, 0.1):
        assert Cycle.left(1 - factor, 10.0, factor) == pytest.approx(factor)
    assert Cycle.left(1e-4, 1e-3, 0.95) > 1e-3
    assert Cycle.left(1e-4, 1e-3, 1.2) > 1e-2
    assert Cycle.left(1e-4, 1e-4, 0.1) > 1e-3
    assert Cycle.left(1e-9, 1e-9, 1.0) < 1e-6


def test_leap_that_leads_away_is_taken_back(monkeypatch):
    """Only the count of its periods remains."""
    scene = in_equal_steps(load_scene("short", **COARSE))
    with running(scene) as simulation:
        cycle = Cycle(simulation)
        monkeypatch.setattr(motion, "WORSE", 1e-3)
        cycle.run(2)
        cycle.noted(2)
        before, t = cycle.state.values(), simulation.t
        turned = before.copy()
        turned[len(simulation.system.u) :] *= 1.01  # the line 1 % longer

        def leap(reach):
            cycle.state.put(turned)

        monkeypatch.setattr(cycle, "leap", leap)
        assert cycle.tried(1.0, 0) is None
        np.testing.assert_allclose(cycle.state.values(), before, rtol=1e-11, atol=1e-11)
        assert (simulation.t - t) % cycle.period == pytest.approx(0.0, abs=1e-9)
        assert len(cycle.after) == 2


def attempted(fails=False, missing=1.0):
    """(what came of a leap, what was done, the cycle after it): |F(x) - x| is 0.5 before it and `missing` after it."""
    done, sizes = [], iter([0.5, missing])
    cycle = Fake(simulation=Fake(t=7.0), before=["a"], after=["b"], missing=lambda: next(sizes))
    cycle.leap = lambda reach: (done.append(("leap", reach)), True)[1]
    cycle.state = Fake(put=lambda values: done.append(("put", values)))

    def run(count):
        done.append(("run", count))
        cycle.simulation.t += 5.0 * count
        if fails:
            raise SolveError("it diverged")

    def noted(count):
        done.append(("noted", count))
        cycle.before, cycle.after = ["c"], ["d"]
        return "seen"

    cycle.run, cycle.noted = run, noted
    return Cycle.tried(cycle, 0.25, 3), done, cycle


@pytest.mark.parametrize(("missing", "good"), [(0.1, True), (5.0, True), (5.01, False)])
def test_what_is_tried_of_a_leap(missing, good):
    """Periods of rest, then two whose ends count; the leap is undone if the residual is then ten times larger."""
    found, done, cycle = attempted(missing=missing)
    assert found == (("seen", True) if good else None)
    assert done == [("leap", 0.25), ("run", 3), ("noted", 2)] + [("put", "b")] * (not good)
    assert (cycle.before, cycle.after) == ((["c"], ["d"]) if good else (["a"], ["b"]))


def test_a_leap_that_cannot_be_solved_is_taken_back():
    """Including the clock."""
    found, done, cycle = attempted(fails=True)
    assert (found, cycle.simulation.t, cycle.before, cycle.after) == (None, 7.0, ["a"], ["b"])
    assert done == [("leap", 0.25), ("run", 3), ("put", "b")]


def test_periods_that_are_run_and_noted():
    """Steps end at parts of a period, what is seen is that of the last one; the last twenty ends are remembered."""
    ends, values = [], iter(range(100))
    cycle = Fake(simulation=Fake(t=10.0), period=6.0, steps=3, periods=4, before=[], after=[])
    cycle.state = Fake(seen=lambda: [cycle.simulation.t], values=lambda: next(values))

    def advance(target):
        ends.append(target)
        cycle.simulation.t = target
        yield 2.0, 1

    cycle.simulation.advance, cycle.run = advance, lambda count: Cycle.run(cycle, count)
    np.testing.assert_allclose(Cycle.run(cycle, 2), [[18.0], [20.0], [22.0]])
    assert ends == [12.0, 14.0, 16.0, 18.0, 20.0, 22.0]
    np.testing.assert_allclose(Cycle.noted(cycle, 22)[-1], [22.0 + 22 * 6.0])
    assert cycle.periods == 4 + 2 + 22
    assert (cycle.before, cycle.after) == (list(range(4, 44, 2)), list(range(5, 45, 2)))


def test_state_of_a_driven_line():
    """Its numbers, then directions and lengths of chords; what counts of them; the same again where it is put."""
    simulation = Simulation(load_scene("driven", **{"cable.elements": 4, "time.step": 0.1}))
    for _ in range(3):
        simulation.step(0.1)
    state, u = motion.State(simulation), simulation.system.u.copy()
    assert state.length == 22.0
    x, nodes = state.values(), u[simulation.problem.lines.node_dofs]
    nodes = nodes[np.argsort(nodes[:, 2])]  # from the anchor up
    directions, lengths = x[-32:-8].reshape(8, 3), x[-8:]
    np.testing.assert_allclose(directions * lengths[:, None], np.diff(nodes, axis=0), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(x[: len(u)], u)
    changed, place = x.copy(), len(u) + state._nodes[3, 1]
    changed[place] += 0.25
    changed[: len(u)] += 9.0  # unknowns follow what evolves
    assert state.moved(changed - x) == pytest.approx(0.25)
    weighed = state.weighed(changed - x)
    assert weighed.max() == pytest.approx(0.25 / 22.0)
    assert np.count_nonzero(weighed) == 1
    assert len(weighed) == 2 * 9 * 3  # positions and velocities of nodes, no tension
    t, bent = simulation.t, changed.copy()
    bent[-8:] *= 1.5
    state.put(bent)
    assert np.abs(state.values() - x).max() > 0.1
    state.put(x)
    np.testing.assert_allclose(state.values(), x, rtol=1e-11, atol=1e-11)
    assert (simulation.t, simulation.predictor.times.tolist()) == (t, [t])
    np.testing.assert_array_equal(simulation.predictor.values, [simulation.system.u])
    part = simulation.problem.lines.part
    np.testing.assert_array_equal(simulation.problem.lines.w.x.array[: part.size], simulation.system.u[part.slice])
    simulation.problem.destroy()


def test_state_of_a_line_in_pieces():
    """Nodes of two pieces at one place have no chord: a warning, and no number, of those before."""
    simulation = Simulation(load_scene("lazy-wave", time__scheme="bdf2", time__tolerance=None))
    assert np.isfinite(motion.State(simulation).values()).all()


def test_no_cycle_within_so_many_periods():
    with pytest.raises(SolveError, match="within 5 periods of 5 s"):
        periodic("short", most=5, **COARSE)


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("storm", {}, "not of an irregular sea"),
        ("hanging-chain", {}, "one period that drives all"),
        ("free-buoy", {}, "needs a line"),
        ("chain-on-bed", {}, "friction"),
        ("short", {"time.tolerance": 1e-3}, "equal steps"),
        ("short", {"time": None}, "time: must be given"),
        ("short", {"waves.period_seen_from": "water"}, "the ground sees"),
    ],
)
def test_what_has_no_cycle_is_refused(name, changes, said):
    with pytest.raises(InputError, match=said):
        periodic(name, **changes)
