"""Parts of accuracy requests, each alone: outputs, companion runs and required accuracies, at and near their limits.

Source: made-up series, and the same numbers by hand; nothing is run.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made_up import RECORD, SCENE

from dolfbuoy import InputError, load_scene
from dolfbuoy.accuracy import companion, outputs, target
from dolfbuoy.accuracy.bars import NONE, RESOLVED, Bar
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.errors import SolveError
from dolfbuoy.results.series import Series
from dolfbuoy.scene.settings import Space, Stepping, space_of, stepping_of


def series(x, t):
    return Series("tension_top of line", np.asarray(t, float), np.asarray(x, float))


# -- outputs -----------------------------------------------------------------------------------------------------------


def test_the_vertex_of_three_steps():
    """At unequal ones that of their parabola; at an end, or of equal values, the value."""
    t = np.array([0.0, 1.0, 3.0, 4.0, 5.0])
    assert outputs._vertex(t, 7.0 - 0.5 * (t - 2.5) ** 2) == pytest.approx(7.0)
    assert outputs._vertex(t, t) == 5.0
    assert outputs._vertex(t, -t) == 0.0
    assert outputs._vertex(t, np.ones(5)) == 1.0
    assert outputs._vertex(t, np.array([0.0, 1.0, 3.0, 3.0, 3.0])) == pytest.approx(3 + 1 / 12)


def test_numbers_of_what_is_not_finite():
    """Those that are; no standard deviation."""
    found = outputs.numbers_of(series([1.0, 2.0, np.inf, 4.0, 3.0, 2.0, 1.0, 0.5, 1.0], range(9)))
    assert (found["max"], found["min"], found["mean"]) == (math.inf, 0.5, math.inf)
    assert math.isnan(found["std"])


def record(**values):
    """A record of one line and one buoy, of three instants at least."""
    parts = {"tension_top": "cable", "cone_angle": "buoy"}
    data = {name: (("time", parts[name]), np.asarray(x, float)[:, None]) for name, x in values.items()}
    count = len(next(iter(values.values())))
    return xr.Dataset(data, {"time": np.arange(count) * 1.0, "cable": ["line"], "buoy": ["buoy"]})


def test_series_between_two_instants():
    """Both of them with what rounding leaves; of three values at least, of which one is finite."""
    one = record(tension_top=np.arange(9.0), cone_angle=[np.inf] * 8 + [1.0])
    found = outputs.series_after(one, 2.0 + 1e-9, 6.0 - 1e-9)
    assert {key: x.t.tolist() for key, x in found.items()} == {("tension_top", "line"): [2.0, 3.0, 4.0, 5.0, 6.0]}
    assert ("cone_angle", "buoy") in outputs.series_after(one, 2.0)
    assert outputs.series_after(one, 2.0 + 1e-8, 6.0 - 1e-7)["tension_top", "line"].t.tolist() == [3.0, 4.0, 5.0]
    assert outputs.series_after(one, 1e-10)["tension_top", "line"].t.tolist() == list(range(9))
    assert outputs.series_after(one, 1e-8)["tension_top", "line"].t.tolist() == list(range(1, 9))
    assert ("tension_top", "line") in outputs.series_after(one, 6.0)
    assert outputs.series_after(one, 7.0) == {}


def test_units_and_names_of_outputs():
    assert [outputs.unit_of_series(name) for name in ("anchor", "tension_top", "offset", "cone_angle")] == [
        "N", "N", "m", "degree",
    ]  # fmt: skip
    assert str(Output("tension_top", "max", "line")) == "tension_top.max"
    found = outputs.outputs_of(RECORD, 20.0)
    assert {"lasting"} == {one.number for one in found if one.number not in outputs.NUMBERS}
    lasting = {one.series for one in found if one.number == "lasting"}
    assert "anchor" not in lasting
    assert "tension_top" in lasting
    top = RECORD.tension_top.values[200:, 0]
    assert top.min() < found[Output("tension_top", "lasting", "cable")] < top.max()
    assert found[Output("lean_at_start", "max", "buoy")] == 10.0


# -- companions --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("end", "covers", "follows"),
    [(60.0, 60.0, 60.0), (60.5, 30.0, 30.0), (210.0, 30.0, 30.0), (260.0, 35.0, 30.0), (1010.0, 110.0, 30.0)],
)
def test_how_much_a_companion_covers(end, covers, follows):
    """Waves of 5 s after a ramp of 10 s: of more than ten periods four, or a tenth of what is after the ramp."""
    scene = load_scene("short", time__end=end)
    assert companion.covered(scene) == pytest.approx(covers)
    assert companion.followed(scene) == pytest.approx(follows)


def test_without_waves_a_companion_covers_four_periods():
    """Of an end that is moved, however long it is; all where nothing has a period."""
    scene = load_scene("driven", time__end=1000.0)
    top = scene.cables[0].top
    assert companion.covered(scene) == pytest.approx(top.ramp + 4 * top.period)
    assert companion.covered(load_scene("hanging-chain", time__end=1000.0)) == 1000.0


@pytest.mark.parametrize(("scheme", "power"), [("backward-euler", 4), ("bdf2", 8), ("generalized-alpha", 8)])
def test_tolerances_with_which_steps_double(scheme, power):
    """By the order of the local error, 0.5 at most; all bounds of the steps, Newton's tolerance at least 1e-5."""
    scene = load_scene("short", time={"end": 20.0, "step": 0.02, "scheme": scheme, "tolerance": 1e-3, "min_step": 0.01})
    found = companion.companion_of(scene)
    assert (found.time.tolerance, found.time.min_step, found.time.max_step) == (power * 1e-3, 0.02, None)
    assert (found.time.step, found.solver.step_tolerance) == (0.04, 1e-5)
    loose = load_scene(scene, time__tolerance=0.2, time__max_step=0.3, time__min_step=None, solver__step_tolerance=1e-4)
    found = companion.companion_of(loose)
    assert (found.time.tolerance, found.time.max_step, found.time.min_step) == (0.5, 0.6, None)
    assert found.solver.step_tolerance == 1e-4
    few = load_scene("short", cable__elements=1)
    assert space_of(companion.companion_of(few)).cells == 1
    assert space_of(companion.companion_of(load_scene("free-buoy"))) == Space()


STORM = load_scene("storm", time={"end": 400.0, "step": 0.1, "scheme": "bdf2"})


def test_events_and_the_room_for_them():
    """Each begins at a step, seven periods before; of two within each other one; half of the run for all together."""
    t = np.arange(0.0, 400.05, 0.1)

    def of(**at):
        parts = {"tension_top": "cable", "cone_angle": "buoy"}
        data = {
            name: (("time", parts[name]), sum(9e3 * np.exp(-((t - x) ** 2)) for x in places)[:, None])
            for name, places in at.items()
        }
        return companion.events_of(STORM, xr.Dataset(data, {"time": t, "cable": ["line"], "buoy": ["buoy"]}))

    assert of(tension_top=[300.03]) == [pytest.approx((258.0, 294.0, 306.0))]
    (late,) = of(tension_top=[399.0])
    assert late == pytest.approx((357.0, 393.0, 400.0))
    (early,) = of(tension_top=[59.0])
    assert early == pytest.approx((17.0, 53.0, 65.0))
    assert len(of(tension_top=[300.0], cone_angle=[305.9])) == 1
    top, lean, z = (np.exp(-((t - at) ** 2)) for at in (300.0, 200.0, 100.0))
    data = {"tension_top": (("time", "cable"), top[:, None]), "cone_angle": (("time", "buoy"), lean[:, None])}
    data["buoy_position"] = ("time", "buoy", "xyz"), np.stack([0 * t, 0 * t, z], axis=-1)[:, None]
    many = xr.Dataset(data, {"time": t, "cable": ["line"], "buoy": ["buoy"], "xyz": list("xyz")})
    assert [event.end for event in companion.events_of(STORM, many)] == pytest.approx([306.0, 206.0])
    assert len(of(tension_top=[300.0], cone_angle=[306.3])) == 2
    assert len(of(tension_top=[300.0], cone_angle=[293.7])) == 2
    assert [event.end for event in of(cone_angle=[200.0], tension_top=[300.0])] == pytest.approx([306.0, 206.0])


def test_of_a_position_both_extremes_are_events():
    t = np.arange(0.0, 400.05, 0.1)
    z = np.exp(-((t - 150.0) ** 2)) - np.exp(-((t - 300.0) ** 2))
    position = np.stack([0 * t, 0 * t, z], axis=-1)[:, None]
    found = xr.Dataset(
        {"buoy_position": (("time", "buoy", "xyz"), position)}, {"time": t, "buoy": ["buoy"], "xyz": list("xyz")}
    )
    assert [event.end for event in companion.events_of(STORM, found)] == pytest.approx([156.0, 306.0])


# -- accuracies --------------------------------------------------------------------------------------------------------


def test_scales_of_an_accuracy():
    """Forces by their value, of the smallest at least a fifth of the largest; others by the range; never zero."""

    def scale(name, number, value, least, largest):
        numbers = {"max": largest, "min": least, "mean": value, "std": value}
        known = {Output(name, n, "a"): Bar(x, 0.1, RESOLVED) for n, x in numbers.items()}
        return target.scale_of(Output(name, number, "a"), known)

    assert scale("tension_top", "mean", -30.0, -40.0, 60.0) == 30.0
    assert scale("tension_top", "min", 0.0, 1.0, -60.0) == pytest.approx(12.0)
    assert scale("tension_top", "min", 0.0, 50.0, 60.0) == 50.0
    assert scale("tension_top", "max", 0.0, 1.0, 60.0) == 60.0
    assert scale("cone_angle", "mean", 5.0, 2.0, 9.0) == 7.0
    assert scale("cone_angle", "mean", 5.0, 5.0, 5.0) == 1e-300
    assert scale("anchor", "mean", 0.0, 0.0, 0.0) == 1e-300


@pytest.mark.parametrize(
    ("worst", "ratio"),
    [(math.inf, 2.0), (0.7, 1.4), (0.857, 1.4), (0.91, math.sqrt(1.6 * 1.3)), (2.8, math.sqrt(6.4)), (9.0, 3.0)],
)
def test_how_much_finer_the_next_run_is(worst, ratio):
    """By the root of 1.6 times what is too much, of 0.7; between 1.4 and 3."""
    assert target._refinement(SimpleNamespace(worst=worst)) == pytest.approx(ratio)


def test_the_first_run_and_finer_ones():
    """A fortieth of the period or of the run, at least eight elements of each line; Newton's tolerance by what is
    asked for, not tighter than the scene's."""
    scene = load_scene("driven", cable__elements=6, accuracy={"target": 0.05}, solver__step_tolerance=1e-3)
    period = scene.cables[0].top.period
    found = target.first(scene)
    assert (space_of(found), found.time.scheme) == (Space(1, 0, 8), "bdf2")
    assert found.time.step == pytest.approx(period / 40)
    assert found.solver.step_tolerance == 1e-4
    assert target.first(load_scene(scene, accuracy__target=1e-3)).solver.step_tolerance == pytest.approx(1e-5)
    for own, taken in ((1e-6, 1e-6), (1e-12, 1e-9)):
        assert target.first(load_scene(scene, solver__step_tolerance=own)).solver.step_tolerance == taken
    assert target.first(load_scene(scene, time__end=4.0)).time.step == pytest.approx(0.1)
    free = load_scene("hanging-chain", accuracy={"target": 0.05})
    assert target.first(free).time.step == free.time.step
    legs = load_scene(
        "three-legs", accuracy={"target": 0.05}, **{f"cable.{name}.elements": 4 for name in ("east", "north", "south")}
    )
    assert space_of(target.first(legs)) == Space(1, 0, 24)
    finer = target._finer(found, 1.5)
    assert (space_of(finer).cells, stepping_of(finer)) == (
        12,
        Stepping("bdf2", found.time.step / 1.5, newton=found.solver.step_tolerance),
    )


def test_runs_until_one_is_accurate_enough(monkeypatch):
    """Each the companion of the next, by how much it is finer; a failed one of none; the last where none is."""
    scene = load_scene("driven", accuracy={"target": 0.05, "rounds": 3})
    asked, ran = [], []
    monkeypatch.setattr(target, "companion_of", lambda chosen: "coarse")
    monkeypatch.setattr(target, "first", lambda chosen: 1.0)
    monkeypatch.setattr(target, "_finer", lambda chosen, ratio: chosen * ratio)

    def reach(records, *worst, rounds=3):
        shares, runs = iter(worst), iter(records)
        asked.clear(), ran.clear()

        def run(chosen, last):
            ran.append((chosen, last))
            record = next(runs)
            if record is None:
                raise SolveError("on purpose")
            return record

        def judged(comm, chosen, record, companion, ratio):
            asked.append((record, str(companion), ratio))
            return SimpleNamespace(worst=next(shares), record=record)

        monkeypatch.setattr(target, "_judged_by_first", judged)
        return target.reach(load_scene(scene, accuracy__rounds=rounds), run).record

    assert reach("abc", 0.7) == "b"
    assert (ran, asked) == ([("coarse", False), (1.0, True)], [("b", "a", 2.0)])
    assert reach("abcd", 2.8, 0.71, 0.3) == "d"
    root = math.sqrt(1.6 * 4)
    assert asked == [("b", "a", 2.0), ("c", "b", pytest.approx(root)), ("d", "c", pytest.approx(1.4))]
    assert reach(["a", "b", None, "d"], 9.0, 9.0) == "d"
    assert asked == [("b", "a", 2.0), ("d", "on purpose", 2.0)]
    assert [x for x, _ in ran] == ["coarse", 1.0, 3.0, 6.0]
    with pytest.raises(SolveError, match="on purpose"):
        reach([None, None], rounds=1)
    ran.clear()
    with pytest.raises(InputError, match="must be an output of this scene"):
        target.reach(load_scene(scene, accuracy__of=["beauty.max"]), lambda *given: ran.append(given))
    assert ran == []


@pytest.mark.parametrize(
    ("worst", "part", "said"),
    [
        (2.5, "a", "1 % was not reached: tension_top.max of a is known to 2.5 %."),
        (2.5, "", "1 % was not reached: tension_top.max is known to 2.5 %."),
        (math.inf, "a", "1 % was not reached: the error of tension_top.max of a is not known. It rings."),
    ],
)
def test_what_was_not_reached(worst, part, said):
    known = {Output("tension_top", number, part): Bar(1000.0, 25.0, NONE) for number in outputs.NUMBERS}
    found = SimpleNamespace(worst=worst, output=Output("tension_top", "max", part), bars=known, sentences=["It rings."])
    found.scene = SimpleNamespace(accuracy=SimpleNamespace(target=0.01))
    assert target.sentence_of(found) == said


def test_outputs_that_are_wanted():
    """Those of the scene, or as many of the usual ones as there are; of all parts."""
    known = {
        Output(name, number, part): Bar(1.0, 0.1, RESOLVED)
        for name, part in (("tension_top", "a"), ("tension_top", "b"), ("offset", "buoy"), ("cone_angle", "buoy"))
        for number in ("max", "min")
    }
    scene = SimpleNamespace(accuracy=SimpleNamespace(of=None))
    assert [str(one) for one in target.wanted_of(scene, known)] == ["tension_top.max"] * 2 + ["cone_angle.max"]
    scene.accuracy.of = ["offset.min"]
    assert target.wanted_of(scene, known) == [Output("offset", "min", "buoy")]
    scene.accuracy.of = ["anchor.max"]
    names = "tension_top.max, tension_top.min, offset.max, offset.min, cone_angle.max, cone_angle.min"
    with pytest.raises(InputError, match=rf"^accuracy.of anchor.max: this scene has {names}\.$"):
        target.wanted_of(scene, known)


def test_names_of_outputs_that_are_refused():
    """With those that there are and are near; what lasts only where no bars are asked for."""
    for name, every, good in (
        ("tension_top.max", False, True),
        ("anchor.std", False, True),
        ("buoy_position_z.min", False, True),
        ("tension_top.lasting", False, False),
        ("tension_top.lasting", True, True),
        ("anchor.lasting", True, False),
        ("lean_at_start.max", True, True),
        ("lean_at_start.max", False, False),
        ("newton_iterations.max", True, False),
    ):
        if good:
            target.check_outputs(SCENE, [name], "--of", every)
            continue
        with pytest.raises(InputError, match=rf"^--of {name}: must be an output of this scene"):
            target.check_outputs(SCENE, [name], "--of", every)
    with pytest.raises(InputError, match="anchor"):
        target.check_outputs(load_scene("free-buoy"), ["anchor.max"], "--of")
    with pytest.raises(InputError) as error:
        target.check_outputs(SCENE, ["tension_tip.max"], "--of")
    near = str(error.value).partition("near it are ")[2].partition(";")[0].split(", ")
    assert len(near) == 3
    assert near[0] == "tension_top"
    assert str(error.value).endswith("numbers are max, min, mean, std.")
    with pytest.raises(InputError, match="numbers are max, min, mean, std, lasting"):
        target.check_outputs(SCENE, ["tension_top.most"], "--of", True)
