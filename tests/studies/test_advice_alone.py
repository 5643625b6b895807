"""Advice on settings without any run: extent of pilots, predictions, the next choice, and messages.

Source: runs with made-up errors and times, and the same numbers by hand.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from dolfbuoy import load_scene
from dolfbuoy.accuracy.bars import RESOLVED, Bar
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.errors import SolveError
from dolfbuoy.results.compare import Curve
from dolfbuoy.results.measured import Run
from dolfbuoy.scene.settings import Space, Stepping, space_of, stepping_of, with_settings
from dolfbuoy.studies.accuracy import advise, cheapest, pilot
from dolfbuoy.studies.accuracy.pilot import Candidate, Pilot, moderate

DRIVEN = load_scene("driven")
ALPHA = "generalized-alpha"

# -- outputs: the cheapest settings ------------------------------------------------------------------------------------


@pytest.fixture
def refined(monkeypatch):
    """What a pilot finds of runs with these shares and seconds; a share of None fails."""

    def found(shares, dearest=math.inf, in_space=False, seconds=None):
        seconds = seconds or [1.0] * len(shares)
        told, compared = dict(zip(range(len(shares)), zip(shares, seconds, strict=True), strict=True)), []
        own = SimpleNamespace(scene=None, newton=1e-5, rows=[])
        own._note = lambda record, space, step, scheme: own.rows.append({"step": step})

        def tried(scene):
            number = scene.cells if in_space else round(math.log2(0.4 / scene.step))
            if told[number][0] is None:
                return SolveError(f"{number}")
            return xr.Dataset(attrs={"loop_seconds": told[number][1], "number": number})

        def judged(scene, record, coarse):
            compared.append((record.attrs["number"], str(getattr(coarse, "attrs", {}).get("number", coarse))))
            return SimpleNamespace(worst=told[record.attrs["number"]][0])

        monkeypatch.setattr(cheapest, "with_settings", lambda scene, *given: given[not in_space])
        monkeypatch.setattr(cheapest, "tried", tried)
        monkeypatch.setattr(cheapest, "judged", judged)
        ways = [(Space(2, 1, k * in_space), 0.1 if in_space else 0.4 / 2**k, "bdf2") for k in range(len(shares))]
        points, last = cheapest.Pilot._refined(own, ways, dearest)
        return list(points.values()), last, compared, list(points), own.rows

    return found


def test_how_far_a_pilot_goes(refined):
    """Until twice what is allowed is reached; or not much is gained twice; or it is dearer than another way."""
    points, last, compared, steps, rows = refined([9.0, 8.0, 2.0, 1.0], seconds=[1, 2, 3, 4])
    assert (points, last, steps) == ([math.inf, 8.0, 2.0], 3.0, [0.4, 0.2, 0.1])
    assert compared == [(1, "0"), (2, "1")]
    assert [(row["error_in"], row["share"]) for row in rows] == [("time", math.inf), ("time", 8.0), ("time", 2.0)]
    points, last, _, cells, rows = refined([9.0, 8.0, 1.9], in_space=True)
    assert (points, last, cells, rows[-1]["error_in"]) == ([math.inf, 8.0, 1.9], 1.0, [0.0, 1.0, 2.0], "space")
    assert refined([9, 8.0, 2.1, 0.1])[0][2:] == [2.1, 0.1]
    assert refined([9, 8.0, 7.0, 6.0, 0.1])[:2] == ([math.inf, 8.0, 7.0, 6.0], math.inf)
    assert refined([9, 10.0, 7.0, 6.0, 0.1])[0] == [math.inf, 10.0, 7.0, 6.0]  # 7 is no less than 0.7 of 10
    assert refined([9, 10.0, 6.9, 6.0, 0.1])[0] == [math.inf, 10.0, 6.9, 6.0, 0.1]
    assert refined([9, 10.0, 11.0, 6.9, 6.8, 0.1])[0] == [math.inf, 10.0, 11.0, 6.9, 6.8, 0.1]
    assert refined([9, *[math.inf] * 4, 0.1])[0] == [*[math.inf] * 5, 0.1]
    assert refined([9, 8.0, math.inf, math.inf, 0.1])[0][-1] == 0.1


def test_a_pilot_that_is_dearer_or_fails(refined):
    assert refined([9, 8.0, 0.1], dearest=0.9)[:2] == ([math.inf, 8.0], math.inf)
    assert refined([9, 8.0, 0.1], dearest=1.0)[1] == 1.0
    assert refined([9, math.inf, math.inf, 0.1], dearest=0.9)[1] == 1.0  # nothing is known before
    points, _, compared, _, _ = refined([None, 9.0, None, 8.0, 1.0])
    assert points == [9.0, 8.0, 1.0]
    assert compared == [(1, "0"), (3, "2"), (4, "3")]


def test_sizes_of_a_pilot():
    """A tenth of the period or of its run, or eight steps of the scene; Newton's tolerance by the accuracy."""
    period = DRIVEN.cables[0].top.period
    found = cheapest.Pilot(DRIVEN, 0.002)
    assert (found.first, found.newton) == (pytest.approx(period / 10), pytest.approx(2e-5))
    assert found.scene.time.end == pytest.approx(DRIVEN.cables[0].top.ramp + 4 * period)
    assert cheapest.Pilot(DRIVEN, 0.5).newton == 1e-4
    assert cheapest.Pilot(load_scene(DRIVEN, time__end=4.0), 0.01).first == pytest.approx(0.4)
    still = load_scene("hanging-chain", time__step=0.02, time__end=5.0)
    assert cheapest.Pilot(still, 0.01).first == pytest.approx(0.16)
    short = cheapest.Pilot(load_scene(still, time__end=1.0), 0.01)
    assert (short.scene.time.end, short.first) == (0.5, pytest.approx(0.05))


def test_settings_that_are_predicted_to_do(monkeypatch):
    """The largest steps that leave room for the elements; a scheme of which nothing is known is left out."""
    found = cheapest.Pilot(DRIVEN, 0.01)
    coarse, fine = Space(2, 1, 8), Space(2, 1, 16)
    monkeypatch.setattr(cheapest, "meshes", lambda *given: [(coarse, 0.6), (fine, 0.1), (Space(1, 0, 9), 0.7)])
    found.in_time = {
        "generalized-alpha": cheapest.Share([], 2),
        "bdf2": cheapest.Share([(0.4, 1.6), (0.2, 0.4)], 2),
    }
    monkeypatch.setattr(found, "seconds", lambda space, scheme, step: space.cells / step)
    chosen = found.candidates({}, 1.0)
    (best,) = chosen  # 0.1 + 0.4 <= 0.9 * 0.7; with the coarser elements the step would have to be 0.05
    assert (best.space, best.stepping) == (fine, Stepping("bdf2", 0.2, newton=found.newton))
    assert (best.share, best.seconds) == (pytest.approx(0.5), pytest.approx(80.0))
    (worse,) = found.candidates({("P2-P1", "bdf2"): 2.0}, 9.0)
    assert (worse.space, worse.stepping.step) == (fine, 0.125)
    assert worse.share == pytest.approx(2.0 * (0.1 + 0.4 * (worse.stepping.step / 0.2) ** 2))
    assert found.candidates({}, 6.4) == []
    assert str(best) == f"{fine}{best.stepping}"


@pytest.mark.parametrize(("low", "high", "rate"), [(1.0, 3.0, 4.0), (3.0, 1.0, 2.0), (1.0, 9.0, 13.0)])
def test_seconds_of_other_elements(low, high, rate):
    """On a straight line over the elements, which never falls; in steps as they were counted."""
    found = cheapest.Pilot(load_scene(DRIVEN, time__end=60.0), 0.01)
    found._work = {"bdf2": {0.1: 3.0, 0.2: 5.0}}
    found._rates = {(2, 1): {10: low, 20: high}}
    assert found.seconds(Space(2, 1, 25), "bdf2", 0.15) == pytest.approx(60 / 0.15 * 4.0 * rate)
    found._rates = {(2, 1): {10: 1.0, 20: 9.0}}
    assert found.seconds(Space(2, 1, 8), "bdf2", 0.1) == pytest.approx(600 * 3.0 * 0.5)


def test_what_a_finer_run_is(monkeypatch):
    """Half the step and twice the elements, as long as the companion; it is held against the run itself."""
    scene = cheapest.requested(load_scene("driven", time__end=200.0), ["tension_top.max"], 0.01)
    scene = with_settings(scene, Space(2, 1, 8), Stepping("bdf2", 0.05, newton=1e-5))
    asked = []
    monkeypatch.setattr(cheapest, "tried", lambda scene: asked.append(scene) or "fine")
    monkeypatch.setattr(cheapest, "judged", lambda *given: asked.append(given[1:]) or SimpleNamespace(worst=0.1))
    assert cheapest._by_a_finer_run(SimpleNamespace(scene=scene, record="own")) == pytest.approx(0.4)
    fine, given = asked
    assert (space_of(fine), stepping_of(fine)) == (Space(2, 1, 16), Stepping("bdf2", 0.025, newton=1e-5))
    assert fine.time.end == cheapest.covered(scene) < 200.0
    assert given == ("fine", "own")
    monkeypatch.setattr(cheapest, "tried", lambda scene: SolveError("no"))
    assert cheapest._by_a_finer_run(SimpleNamespace(scene=scene, record="own")) == math.inf


def test_a_run_with_its_bars(monkeypatch):
    """And those around its extremes that do not fail; a fifth of its steps may."""
    asked = []
    records = {"own": "record", "one": "around one", "two": SolveError("no"), "coarse": "companion"}
    monkeypatch.setattr(cheapest, "tried", records.get)
    monkeypatch.setattr(cheapest, "events_of", lambda scene, record: ["one", "two"])
    monkeypatch.setattr(cheapest, "companion_around", lambda scene, event: event)
    monkeypatch.setattr(cheapest, "companion_of", lambda scene: "coarse")
    monkeypatch.setattr(cheapest, "judged", lambda *given, **more: asked.append((given, more)))
    cheapest._verified("own")
    assert asked == [(("own", "record", "companion"), {"events": {"one": "around one"}})]
    assert str(cheapest._verified("two")) == "no"
    assert len(asked) == 1
    monkeypatch.undo()
    monkeypatch.setattr(cheapest, "run", lambda scene, most: asked.append((scene.accuracy, most)))
    cheapest.tried(load_scene("driven", time__end=10.0, time__step=0.1, accuracy={"estimate": "companion"}))
    assert asked[-1] == (None, pytest.approx(20.0))


def test_nothing_is_tried_where_nothing_is_left(monkeypatch):
    """And an empty list is asked for once."""
    asked = []
    monkeypatch.setattr(cheapest.Pilot, "measure", lambda self: None)
    monkeypatch.setattr(cheapest.Pilot, "candidates", lambda self, worse, others: asked.append(others) or [])
    with pytest.raises(SolveError, match=r"^No settings of the pilot keep 1 % in tension_top\.max\.$"):
        cheapest.cheapest(DRIVEN, ["tension_top.max"], 0.01, asked.append)
    end = cheapest.Pilot(DRIVEN, 0.01).scene.time.end
    assert asked == [f"Pilot until t = {end:g} s of 60 s.", 1.0]


def test_advice_in_words():
    """Outputs with their bars in units of their size, of several lines each by its name."""
    scene = cheapest.requested(load_scene("driven", time__end=200.0), ["tension_top.max"], 0.01)
    known = {}
    for part, value, bar in (("one", 12345.0, 67.8), ("two", 8000.0, 4.0)):
        known |= {Output("tension_top", n, part): Bar(value, bar, RESOLVED) for n in ("max", "min", "mean", "std")}
    choice = cheapest.Choice(Space(2, 1, 8), Stepping("bdf2", 0.05), 0.4, 3.0)
    record = SimpleNamespace(attrs={"loop_seconds": 12.3})
    found = SimpleNamespace(bars=known, scene=scene, record=record)
    until = cheapest.covered(scene)
    said = cheapest.sentences(cheapest.Verified(scene, 0.01, choice, found, [choice], [], ["It was hard."]))
    assert said == [
        f"1 % in tension_top.max: {choice}: 12 s for the run until t = 200 s.",
        "It was hard.",
        "tension_top.max of one: 12.345 +- 0.068 kN, 0.55 %.",
        "tension_top.max of two: 8.0000 +- 0.0040 kN, 0.05 %.",
        f"Bars are those of this run and one with twice the step and half the elements until t = {until:g} s.",
    ]
    found.scene = load_scene(scene, time__end=20.0)
    said = cheapest.sentences(cheapest.Verified(scene, 0.01, choice, found, [choice], [], []))
    assert said[-1].endswith("half the elements.")


# -- a quantity: pilot and prediction ----------------------------------------------------------------------------------


def made(scene=DRIVEN, accuracy=0.01):
    return Pilot(scene, "tension_top", accuracy, lambda text: None)


def run_of(steps=100, iterations=300, rejected=0, cpu=2.0, wall=3.0):
    return Run(np.arange(3.0), {}, wall, cpu, steps, iterations, rejected)


def test_first_steps_of_a_pilot():
    """A fiftieth of the period, a 25th for 3 % and more; of the run a fiftieth at most, a 200th without a period."""
    period = DRIVEN.cables[0].top.period
    assert [made(accuracy=x).first_step for x in (0.01, 0.03, 0.031)] == pytest.approx(
        [period / k for k in (50, 50, 25)]
    )
    still = Pilot(load_scene("hanging-chain", time__end=8.0), "tension_anchor", 0.01, print)
    assert (still.scene.time.end, still.first_step) == (4.0, pytest.approx(0.02))
    assert made(load_scene(DRIVEN, time__end=3.0), 0.05).first_step == pytest.approx(0.06)


def test_work_of_a_run():
    """Iterations and one residual more of each step, of rejected ones too."""
    assert [pilot._work(run_of(100, 300, k)) for k in (0, 10)] == [400, 440]


def test_the_mesh_on_which_schemes_are_compared():
    """Half the unknowns of each line in P2-P1, between 4 and 20 elements."""
    for mu, cells, expected in ((1, 20, 10), (2, 20, 20), (1, 4, 4), (3, 40, 20), (2, 13, 13)):
        scene = with_settings(DRIVEN, Space(mu, mu - 1, cells), Stepping("bdf2", 0.1))
        assert moderate(scene) == Space(2, 1, expected)
    assert moderate(load_scene("free-buoy")) == Space()


def test_meshes_that_are_predicted():
    """From the coarsest that was measured to `finer` times the finest, by a ratio, each once."""
    curve = Curve([(1 / 8, 0.04), (1 / 4, 0.16)])
    found = pilot.meshes(DRIVEN, {(2, 1): curve, (1, 0): Curve([])}, 2, 1.5)
    assert [space.cells for space, _ in found] == [4, 6, 9, 14]
    assert [error for _, error in found] == pytest.approx([0.64 / 4, 2.56 / 36, 2.56 / 81, 2.56 / 196])


def test_finer_and_finer_runs():
    """Until half of the accuracy, or dear; those that fail are left out."""
    own, errors = made(), iter([0.04, 0.0053, 0.0049, 0.001])
    runs = {1: run_of(), 2: None, 3: run_of(), 4: run_of(iterations=301), 5: run_of()}
    own.run, own.difference = lambda k, _: runs[k], lambda run, truth: next(errors)
    points = own._finer([(k, k) for k in range(1, 6)], None, 1e-4)
    assert [k for (k, _), _ in points] == [1, 3, 4]
    assert [error for _, error in points] == pytest.approx([0.0401, 0.0054, 0.005])
    errors = iter([0.04, 0.02, 0.01])
    assert len(own._finer([(k, k) for k in (3, 4, 5)], None, 0.0, dearest=400.0)) == 2
    errors = iter([0.04, 0.02, 0.01])
    assert len(own._finer([(k, k) for k in (3, 5, 1)], None, 0.0, dearest=400.0)) == 3


def test_seconds_of_a_unit_of_work():
    """Of several numbers of elements on a line that never falls, and no less than half of the least."""
    own, step = made(), Stepping(ALPHA, 0.1)
    own.runs = {(Space(2, 1, 10), step): run_of(cpu=4.0), (Space(1, 0, 10), step): run_of(cpu=99.0)}
    own.runs[Space(2, 1, 7), step] = None
    assert own.second_per_work(Space(2, 1, 33)) == pytest.approx(0.01)
    own.runs[Space(2, 1, 10), Stepping("bdf2", 0.1)] = run_of(steps=300, iterations=900, cpu=8.0)
    assert own.second_per_work(Space(2, 1, 33)) == pytest.approx(12 / 1600)
    own.runs[Space(2, 1, 20), step] = run_of(cpu=5.0)
    for cells, expected in ((10, 0.0075), (20, 0.0125), (30, 0.0175), (0, 0.00375)):
        assert own.second_per_work(Space(2, 1, cells)) == pytest.approx(expected)
    own.runs[Space(2, 1, 20), step] = run_of(cpu=2.0)
    assert own.second_per_work(Space(2, 1, 40)) == pytest.approx(0.0075)


def test_seconds_of_the_whole_run():
    """Work by powers between what was measured; beyond it inverse to the step, or to the root of a tolerance."""
    own = made()
    part, whole = own.scene.time.end, own.whole.time.end
    for step, steps in ((0.1, 100), (0.2, 50)):
        own.runs[own.mesh, Stepping(ALPHA, step)] = run_of(steps, 3 * steps, cpu=steps / 50, wall=steps / 25)
        own.runs[own.mesh, Stepping(ALPHA, 0.1, step)] = run_of(steps, 3 * steps, cpu=steps / 50, wall=steps / 25)
    own.runs[own.mesh, Stepping(ALPHA, 0.05, newton=1e-5)] = None
    own.work_of_newton, own.second_per_work = 0.5, lambda space: 0.01
    one = whole / part * 0.5 * 0.01 * 2.0  # the clock went twice as far as the processor
    assert own.seconds(own.mesh, ALPHA, False, 0.1) == pytest.approx(400 * one)
    assert own.seconds(own.mesh, ALPHA, False, math.sqrt(0.02)) == pytest.approx(400 / math.sqrt(2) * one)
    assert own.seconds(own.mesh, ALPHA, False, 0.05) == pytest.approx(800 * one)
    assert own.seconds(own.mesh, ALPHA, True, 0.1 / 8) == pytest.approx(800 * one)
    for run in own.runs.values():
        if run:
            run.wall = run.cpu / 2
    assert own.seconds(own.mesh, ALPHA, False, 0.1) == pytest.approx(200 * one)


def test_what_a_pilot_predicts():
    """The sum of all errors; nothing of what it has no curve of; the cheapest of each kind, coarser ones first."""
    own = made()
    own.of_newton, own.newton, own.finest = 0.001, 1e-6, 0.02
    own.time_curves = {(ALPHA, False): Curve([(0.1, 0.004), (0.2, 0.016)]), ("bdf2", False): Curve([])}
    own.time_curves["bdf2", True] = Curve([(1e-4, 0.003), (1e-3, 0.03)])
    own.space_curves = {(2, 1): Curve([(1 / 10, 0.002), (1 / 5, 0.008)])}
    assert own.predicted(Space(2, 1, 10), Stepping(ALPHA, 0.1)) == pytest.approx(0.007)
    assert own.predicted(Space(2, 1, 10), Stepping("bdf2", 0.1, 1e-4)) == pytest.approx(0.006)
    assert own.predicted(Space(1, 0, 10), Stepping(ALPHA, 0.1)) == math.inf
    own._spaces = lambda target: (
        [(Space(2, 1, 10), 0.002), (Space(2, 1, 20), 0.0005)] if 0.0060 < target < 0.0062 else []
    )
    own.seconds = lambda space, scheme, adaptive, x: space.cells / (100 * x if adaptive else x)
    first, second = own.candidates(0.0071)
    assert (first.space, first.stepping) == (Space(2, 1, 10), Stepping(ALPHA, 0.1, newton=1e-6))
    assert (first.error, first.seconds, first.extrapolated) == (pytest.approx(0.007), pytest.approx(100.0), False)
    assert second.stepping == Stepping("bdf2", 0.02, 1.25e-4, own.largest, 1e-6)
    own._spaces = lambda target: [(Space(2, 1, 10), 0.002)]
    (fine, *_) = own.candidates(0.0041)
    assert (fine.stepping.step, fine.extrapolated) == (0.05, True)


def test_what_is_advised_next():
    """After a failure safer settings, by what was missed, between 0.3 and 0.8; each is refused once."""
    targets, asked = [], []
    errors = {"truth": None, "a": 0.02, "b": 0.012, "c": 0.5, "d": 0.004}
    choices = [Candidate(name, "", 0.006, 1.0) for name in "abcd"]
    own = SimpleNamespace(
        best="truth", finest=0.01, own_time=1e-3, own_space=0.0, accuracy=0.01, quantity="tension_top"
    )
    own.scene = own.whole = DRIVEN
    own.start, own.say = 0.0, asked.append
    own.run = lambda space, stepping: None if space == "x" else space
    own.difference = lambda run, truth: errors[run]
    own.candidates = lambda target: targets.append(target) or choices
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dolfbuoy.studies.accuracy.linear_answer.linear_answer", lambda *_: "linear: so.")
        patch.setattr(advise.settings, "with_settings", lambda *given: given[1])
        found = advise.verified(own, 4)
        assert (found.scene, found.choice, found.measured) == ("d", choices[3], 0.004)
        assert targets == pytest.approx([0.007, 0.007 * 0.3, 0.007 * 0.3 * 0.4, 0.007 * 0.3 * 0.4 * 0.3])
        assert found.notes[1] == "For screening, the linear: so."
        assert len(found.notes) == 5
        assert [one.space for one in found.candidates] == ["d"]
        with pytest.raises(SolveError, match=r"^No settings of the pilot keep 1 % in top tension\.$"):
            advise.verified(own, 3)
        targets.clear()
        errors["d"] = 0.009001
        with pytest.raises(SolveError):
            advise.verified(own, 9)
        assert len(targets) == 5
        own.own_time, errors["a"] = 0.006, 0.005
        targets.clear()
        with pytest.raises(SolveError):
            advise.verified(own, 2)
        assert targets == pytest.approx([0.007, 0.0056])
        own.own_time, errors["a"] = 0.0, 0.01
        assert advise.verified(own, 1).measured == 0.01
        own.candidates = lambda target: [Candidate("x", "", 0.006, 1.0)]
        asked.clear()
        with pytest.raises(SolveError):
            advise.verified(own, 1)
        assert asked == ["x does not keep the promise: it fails; the next safer settings are taken."]
        own.run = lambda space, stepping: None
        with pytest.raises(SolveError, match="would be verified against fails"):
            advise.verified(own, 1)


def test_rows_of_advice():
    """The cheapest of each pair and of each way to step; extrapolations are marked."""
    kinds = [("bdf2", None), ("bdf2", None), ("bdf2", 1e-3), (ALPHA, None)]
    found = [
        Candidate(Space(mu, mu - 1, 10 + k), Stepping(scheme, 0.1, tolerance), 0.004, 2.0 + k, extrapolated=True)
        for k, (mu, (scheme, tolerance)) in enumerate(zip((2, 2, 2, 3), kinds, strict=True))
    ]
    found.append(Candidate(Space(3, 2, 20), Stepping("bdf2", 0.1, 1e-3), 0.004, 9.0))
    rows = advise.table_rows(SimpleNamespace(candidates=found))
    assert [(row["cells"], row["step"], row["tolerance"], row["remark"]) for row in rows] == [
        (10, 0.1, None, "advised"),
        (12, None, 1e-3, "extrap."),
        (13, 0.1, None, "extrap."),
    ]
    assert (rows[0]["predicted_percent"], rows[0]["predicted_seconds"]) == (pytest.approx(0.4), 2.0)


def test_what_is_said_of_seas_and_of_what_has_no_period():
    choice = Candidate(Space(2, 1, 10), Stepping("bdf2", 0.1), 0.004, 12.0)
    own = SimpleNamespace(quantity="tension_top", accuracy=0.01, predicted=lambda *_: math.inf)
    for name, ending in (
        ("storm", "see `dolfbuoy statistics`."),
        ("hanging-chain", "errors of phase may grow after the end of the pilot."),
        ("short", "s."),
    ):
        own.whole = load_scene(name)
        said = advise.sentences(advise.Advice(own.whole, choice, 0.006, [choice], own, []))
        assert said[-1].endswith(ending)
        assert len(said) == {"storm": 5, "hanging-chain": 4, "short": 3}[name]
    own.whole = with_settings(own.whole, choice.space, choice.stepping)
    assert len(advise.sentences(advise.Advice(own.whole, choice, 0.006, [choice], own, []))) == 2
