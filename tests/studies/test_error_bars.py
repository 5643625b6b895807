"""Error bars from a companion run against converged values; unknown errors are not given as known; accuracies reached.

Source: parabolas; series with given errors; converged values (an eighth of the step, a quarter of the element size).
"""

import copy
import math
from types import SimpleNamespace

import numpy as np
import pytest
from mpi_helpers import needs_mpirun, start, start_scenes

from dolfbuoy import InputError, load_scene, simulate
from dolfbuoy.accuracy import bars as error_bars
from dolfbuoy.accuracy import target
from dolfbuoy.accuracy.bars import NONE, RESOLVED, SUSPECT, Bar, bars_of
from dolfbuoy.accuracy.companion import companion_of, covered, followed
from dolfbuoy.accuracy.outputs import Output, numbers_of
from dolfbuoy.accuracy.target import ENOUGH, scale_of
from dolfbuoy.errors import NotAccurate, SolveError
from dolfbuoy.results.bars import number_with, rows_of
from dolfbuoy.results.record import read
from dolfbuoy.results.series import Series
from dolfbuoy.results.statistics import statistics
from dolfbuoy.scene.settings import Space, Stepping, space_of, with_settings
from dolfbuoy.studies import peer
from dolfbuoy.studies.sweep import plan, sweep

BARS = {"accuracy__estimate": "companion"}
NUMBERS = ("max", "min", "mean", "std")
#: Converged numbers of `short` from 20 to 50 s, known to 0.2 % of the range and better.
SHORT = {
    "tension_top": (11165.95, 3222.993, 6009.496, 1962.265),
    "tension_anchor": (9639.286, 488.8098, 2175.926, 2261.539),
    "anchor": (9633.296, 496.4092, 2175.644, 2258.436),
    "buoy_position_z": (1.285157, -1.864994, 0.1283068, 1.077836),
    "cone_angle": (23.71443, 4.143395, 11.92518, 5.438575),
}
#: The same of `storm` from 20 to 120 s.
STORM = {
    "tension_top": (11266.31, 1761.854, 5811.702, 1100.695),
    "tension_anchor": (9103.46, 746.1534, 1966.741, 979.6401),
    "anchor": (9093.237, 781.7239, 1975.258, 971.7827),
    "buoy_position_z": (1.407185, -1.890896, 0.04922813, 0.6220371),
    "cone_angle": (28.64458, 0.8457969, 15.14251, 5.17193),
}


def numbers(t, x):
    return numbers_of(Series("x", np.array(t), np.array(x)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_extremes_lie_between_steps(sign):
    """A parabola at unequal steps has its own vertex; a straight line its ends."""
    t = np.array([0.0, 0.3, 0.9, 1.2, 2.0])
    largest, smallest = ("max", "min") if sign > 0 else ("min", "max")
    found = numbers(t, sign * (3.0 - 2.0 * (t - 0.7) ** 2))
    assert found[largest] == pytest.approx(sign * 3.0, abs=1e-14)
    assert found[smallest] == pytest.approx(sign * (3.0 - 2.0 * 1.3**2), abs=1e-14)
    straight = numbers(t, sign * t)
    assert (straight[largest], straight[smallest]) == (sign * 2.0, 0.0)
    assert straight["mean"] == pytest.approx(sign, abs=1e-15)


@pytest.fixture(scope="module")
def driven():
    """(scene, record) of a cable whose end is moved for a second after the ramp."""
    scene = load_scene("driven", time__end=12.0, time__step=0.05, time__scheme="bdf2")
    return scene, simulate(scene)


def other(record, change, **attributes):
    """The record of a companion whose tension at the top is changed by a function of time."""
    top = record.tension_top + change(record.time)
    return record.assign(tension_top=top.transpose(*record.tension_top.dims)).assign_attrs(attributes)


def bars_with(driven, change, **attributes):
    scene, record = driven
    found, sentences = bars_of(record, scene, other(record, change, **attributes))
    return {number: found[Output("tension_top", number, "cable")] for number in NUMBERS}, found, sentences


def test_bars_are_a_third_of_the_difference(driven):
    """Steps and elements twice as large are four times as far off; a shift changes no standard deviation."""
    found, everything, sentences = bars_with(driven, lambda t: 3.0 + 0 * t)
    for number, bar in (("max", 1.0), ("min", 1.0), ("mean", 1.0), ("std", 0.25)):
        assert found[number].bar == pytest.approx(bar, rel=1e-9)
        assert found[number].verdict == RESOLVED
    assert everything[Output("anchor", "max", "cable")].bar == 0
    assert sentences == []
    ratio, _ = bars_of(driven[1], driven[0], other(driven[1], lambda t: 3.0 + 0 * t), ratio=1.5)
    assert ratio[Output("tension_top", "max", "cable")].bar == pytest.approx(3.0 / 1.25)
    first = load_scene(driven[0], time__scheme="backward-euler")
    found, _ = bars_of(driven[1], first, other(driven[1], lambda t: 3.0 + 0 * t))
    assert found[Output("tension_top", "max", "cable")].bar == pytest.approx(2.0)


def test_element_at_the_anchor_is_of_first_order(driven):
    scene, record = driven
    constant, linear = (
        with_settings(scene, Space(*pair, space_of(scene).cells), Stepping("bdf2", 0.05)) for pair in ((1, 0), (2, 1))
    )
    shifted = record.assign(tension_anchor=record.tension_anchor + 3.0)
    assert bars_of(record, constant, shifted)[0][Output("tension_anchor", "mean", "cable")].bar == pytest.approx(2.0)
    assert bars_of(record, linear, shifted)[0][Output("tension_anchor", "mean", "cable")].bar == pytest.approx(1.0)


def test_what_is_not_known(driven):
    """A companion that fails, steps that were cut, ringing, a bar of a quarter of the range; and other phases."""
    scene, record = driven
    size = float(np.ptp(record.tension_top.values))
    found, sentences = bars_of(record, scene, SolveError("no step"))
    assert {bar.verdict for bar in found.values()} == {NONE}
    assert all(math.isnan(bar.bar) for bar in found.values())
    assert "no step" in sentences[0]
    _, found, sentences = bars_with(driven, lambda t: 0 * t, failed_steps=1)
    assert {bar.verdict for bar in found.values()} == {NONE}
    assert "half the elements failed" in sentences[0]
    found, everything, _ = bars_with(driven, lambda t: 0.8 * size + 0 * t)
    assert found["max"].verdict == NONE
    assert everything[Output("anchor", "max", "cable")].verdict == RESOLVED
    found, everything, sentences = bars_with(driven, lambda t: 0.2 * size * np.sin(5 * t))
    assert found["max"].verdict == SUSPECT
    assert everything[Output("anchor", "max", "cable")].verdict == RESOLVED
    assert "tension_top of cable" in sentences[0]


def test_ringing_from_step_to_step(driven):
    """An alternating part of 2 % of the range; its own size is found."""
    scene, record = driven
    sign = (-1.0) ** np.arange(record.sizes["time"])
    part = Series("x", record.time.values, 0.3 * sign + np.sin(0.1 * record.time.values))
    assert error_bars.alternating(part) == pytest.approx(0.3, rel=1e-3)
    top = record.tension_top + 0.01 * float(np.ptp(record.tension_top.values)) * sign[:, None]
    found, sentences = bars_of(record.assign(tension_top=top), scene, record)
    assert {bar.verdict for bar in found.values()} == {NONE}
    assert "from step to step" in sentences[0]


def test_companion():
    """Twice the step, half the elements of each segment; a tolerance for which steps double; a part of long runs."""
    scene = load_scene("wave-rider", time__step=0.02, time__scheme="bdf2", time__tolerance=None)
    coarse = companion_of(scene)
    assert coarse.time.step == 0.04
    pairs = zip(scene.network.pieces, coarse.network.pieces, strict=True)
    assert all(after.section.elements == max(1, round(piece.section.elements / 2)) for piece, after in pairs)
    adaptive = load_scene("short", time__scheme="bdf2", time__tolerance=1e-3, time__max_step=0.1)
    assert companion_of(adaptive).time.tolerance == pytest.approx(8e-3)
    assert companion_of(adaptive).time.max_step == pytest.approx(0.2)
    assert covered(load_scene("short", time__end=60.0)) == 60.0  # waves of 5 s after a ramp of 10 s
    assert covered(load_scene("short", time__end=61.0)) == pytest.approx(30.0)
    assert covered(load_scene("short", time__end=1010.0)) == pytest.approx(110.0)


SETTINGS = {
    "short": [("backward-euler", 0.01, (1, 0), 20), ("bdf2", 0.05, (1, 0), 20), ("bdf2", 0.1, (1, 0), 9)],
    "storm": [("bdf2", 0.05, (1, 0), 10), ("generalized-alpha", 0.05, (2, 1), 5)],
}  # fmt: skip


def test_bars_cover_the_error(monkeypatch):
    """Nine in ten numbers that are resolved within two bars of the converged one; bars not ten times as large."""
    monkeypatch.setattr(error_bars, "window_start", lambda scene: 20.0)
    ratios = []
    for name, truth, end in (("short", SHORT, 50.0), ("storm", STORM, 120.0)):
        for scheme, step, pair, cells in SETTINGS[name]:
            scene = with_settings(load_scene(name, time__end=end), Space(*pair, cells), Stepping(scheme, step))
            found, _ = bars_of(simulate(scene), scene, simulate(companion_of(scene)))
            for series, values in truth.items():
                for number, value in zip(NUMBERS, values, strict=True):
                    (bar,) = (bar for output, bar in found.items() if output[:2] == (series, number))
                    if bar.verdict == RESOLVED and abs(bar.value - value) > 0.002 * abs(values[0] - values[1]):
                        ratios.append(bar.bar / abs(bar.value - value))
    ratios = np.array(ratios)
    print(len(ratios), np.median(ratios), (ratios < 0.5).mean(), ((ratios >= 0.5) & (ratios <= 3)).mean())
    assert len(ratios) > 30
    assert (ratios < 0.5).mean() <= 0.1
    assert ((ratios >= 0.5) & (ratios <= 3)).mean() >= 0.75


def test_generalized_alpha_that_rings_is_not_trusted():
    """At a fiftieth of the period its largest tension is 4 % of the range too high."""
    scene = load_scene("short", time__end=50.0)
    scene = with_settings(scene, Space(1, 0, 10), Stepping("generalized-alpha", 0.1, newton=1e-7))
    found = simulate(scene, **BARS)
    assert set(found.bar_verdict.values) == {NONE}
    assert "steps are too long" in found.bar_says
    assert all(row.bar == "" for row in rows_of(found))


def test_nothing_is_paid_for_nothing():
    """Without [accuracy], or with "none", there is one run and no bar; with it the run itself is the same to a bit."""
    plain, bars = (simulate("driven", time__end=2.0, **more) for more in ({}, BARS))
    assert "output" not in plain.dims
    assert "output" not in simulate("driven", time__end=2.0, accuracy__estimate="none").dims
    for name in plain.data_vars:
        np.testing.assert_array_equal(plain[name], bars[name])


def test_bars_of_a_run_that_was_stopped(tmp_path):
    """On disk as they are returned, and those of the longer run once it is lengthened."""
    whole = simulate("driven", tmp_path / "whole", time__end=6.0, **BARS)
    simulate("driven", tmp_path / "part", time__end=3.0, **BARS)
    longer = simulate(resume=tmp_path / "part", time__end=6.0)
    for record in (longer, read(tmp_path / "whole" / "results.nc"), read(tmp_path / "part" / "results.nc")):
        for name in ("bar_value", "bar", "bar_newton", "bar_statistics", "bar_verdict", "output_of"):
            np.testing.assert_array_equal(record[name].values, whole[name].values)
        assert record.output.values.tolist() == whole.output.values.tolist()
        assert record.attrs["bar_says"] == whole.attrs["bar_says"]


@pytest.mark.mpi
@needs_mpirun
def test_bars_on_two_ranks(tmp_path):
    scene = load_scene("driven", time__end=2.0, **BARS).to_dict()
    done = start_scenes(2, {"two": scene}, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    one, two = simulate(scene), read(tmp_path / "two" / "results.nc")
    np.testing.assert_allclose(two.bar, one.bar, rtol=1e-4, atol=1e-6)


def test_errors_of_the_steps_of_a_long_run_are_those_of_its_beginning(tmp_path):
    """Four periods of more than ten, which a companion covers too; the same bits where the run was made longer."""
    scene = load_scene("driven", time={"end": 66.0, "step": 0.1, "scheme": "bdf2"}, accuracy={"estimate": "both"})
    assert followed(scene) == covered(scene) == 30.0
    assert followed(load_scene(scene, time__end=55.0)) == 55.0
    whole = simulate(scene, tmp_path / "whole")
    known = np.isfinite(whole.tension_top_error.values.ravel())
    assert known[whole.time <= 30.01].all()
    assert not known[whole.time > 30.11].any()
    resolved = whole.bar_verdict.values == RESOLVED
    assert resolved.sum() > 8
    assert np.isfinite(whole.bar_time.values[resolved]).all()
    simulate(load_scene(scene, time__end=63.0), tmp_path / "part")
    longer = simulate(resume=tmp_path / "part", time__end=66.0)
    for name in ("bar", "bar_time", "bar_verdict"):
        np.testing.assert_array_equal(longer[name].values, whole[name].values)
    alone = simulate(scene, accuracy={"estimate": "time"}, time__end=62.0)  # without a companion all of it
    assert np.isfinite(alone.tension_top_error.values).all()


def test_runs_that_agree_and_are_both_wrong_are_not_resolved():
    """A chain that falls and whips: backward Euler and its companion miss the blow (150 to 240 N, finer)."""
    chain = load_scene("hanging-chain", initial__points=[[0.0, 0.0, 0.0], [1.9, 0.0, 0.6244997998398389]])
    coarse = with_settings(chain, Space(2, 1, 10), Stepping("backward-euler", 0.004))
    found = simulate(coarse, time__end=3.0, accuracy__estimate="both")
    row = found.output.values.tolist().index("tension_anchor.max")
    assert float(found.bar_value[row] + 3 * found.bar[row]) < 150.0
    assert RESOLVED not in found.bar_verdict.values
    assert "cannot be followed to the end" in found.attrs["bar_says"]


def test_scatter_over_seeds():
    """What one run says of the mean and standard deviation of a sea is how those of a hundred differ."""
    rng, t = np.random.default_rng(1), np.arange(0.0, 600.0, 0.5)
    means, deviations, said = [], [], []
    omega = np.linspace(0.004, 1.6, 400)
    spectrum = np.exp(-((omega - 0.8) ** 2) / 0.02) + 0.3
    sea = load_scene("storm")
    for _ in range(100):
        amplitude = np.sqrt(spectrum) * rng.rayleigh(size=400)
        x = (amplitude * np.cos(omega * t[:, None] + rng.uniform(0, 2 * np.pi, 400))).sum(axis=1) + 5.0
        series = Series("x", t, x)
        means.append(series.mean), deviations.append(series.standard_deviation)
        said.append(error_bars._chance(sea, series))
    assert np.mean([one["std"] for one in said]) == pytest.approx(np.std(deviations), rel=0.3)
    assert np.std(means) / 2 < np.mean([one["mean"] for one in said]) < 2 * np.std(means)


# -- accuracies ------------------------------------------------------------------------------------------------------


def test_an_accuracy_is_reached():
    """1 % of the largest tension and anchor force of `driven`, against a run of four times the steps and elements."""
    found = simulate("driven", time__end=15.0, accuracy__target=0.01)
    scene = load_scene("driven", time__end=15.0)
    fine = with_settings(scene, Space(1, 0, 4 * found.sizes["cell"]), Stepping("bdf2", float(found.time_step[-1]) / 4))
    truth = simulate(fine, **BARS)
    for output in ("tension_top.max", "anchor.max"):
        row, true = (one.isel(output=one.output.values.tolist().index(output)) for one in (found, truth))
        assert abs(row.bar_value / true.bar_value - 1) < 0.01
        assert float(row.bar) <= ENOUGH * 0.01 * float(row.bar_value)


def test_an_accuracy_that_was_reached_is_read(tmp_path):
    """The same command again; of another accuracy it is another scene."""
    scene = load_scene("driven", time__end=6.0, accuracy={"target": 0.05})
    first, steps = simulate(scene, tmp_path), []
    again = simulate(scene, tmp_path, progress=lambda *_: steps.append(1))
    assert steps == []
    np.testing.assert_array_equal(again.tension_top, first.tension_top)
    with pytest.raises(InputError, match="another scene"):
        simulate(load_scene(scene, accuracy={"target": 0.04}), tmp_path)


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_an_accuracy_on_two_ranks(tmp_path):
    """The same settings and bars as on one; one that is not reached ends on both, with code 4 and one sentence."""
    scene = load_scene("driven", time__end=6.0, accuracy={"target": 0.05})
    done = start_scenes(2, {"two": scene.to_dict()}, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    one, two = simulate(scene), read(tmp_path / "two" / "results.nc")
    assert two.sizes == one.sizes
    np.testing.assert_allclose(two.bar, one.bar, rtol=1e-3, atol=1e-6)
    line = [
        "-m",
        "dolfbuoy.commands.main",
        "run",
        "driven",
        "--t-end",
        3,
        "--accuracy",
        "0.01%",
        "--set",
        "accuracy.rounds=1",
    ]
    missed = start(2, [*line, "--no-plot", "--out", "missed"], tmp_path)
    assert missed.returncode == 4, missed.stderr[-2000:]
    assert missed.stderr.count("0.01 % was not reached") == 1
    assert read(tmp_path / "missed" / "results.nc").sizes["output"] > 0


def test_an_accuracy_that_is_not_reached(tmp_path):
    with pytest.raises(NotAccurate, match=r"0.01 % was not reached: \S+ of cable is known to \d") as error:
        simulate("driven", tmp_path, time__end=3.0, accuracy__target=1e-4, accuracy__rounds=1)
    assert error.value.record.sizes["output"] == read(tmp_path / "results.nc").sizes["output"] > 0


def test_outputs_that_a_scene_does_not_have():
    with pytest.raises(InputError, match=r"accuracy.of cone_angle.max: must be an output of this scene"):
        simulate("driven", time__end=1.0, accuracy__target=0.1, accuracy__of=["cone_angle.max"])
    with pytest.raises(InputError, match=r"accuracy.rounds.*goes with a target only"):
        load_scene("driven", accuracy__rounds=2)
    with pytest.raises(InputError, match=r"accuracy.estimate.*does not go with a target"):
        load_scene("driven", accuracy__estimate="none", accuracy__target=0.1)


def test_an_accuracy_is_that_of_the_worst_output(monkeypatch):
    """Shares of what is allowed; an output without a bar is not accurate at all."""
    scene, one, other, last = SimpleNamespace(accuracy=SimpleNamespace(target=0.1)), "one", "other", "last"
    bars = {one: Bar(10.0, 0.5, "resolved"), other: Bar(10.0, 0.8, "resolved"), last: Bar(10.0, 0.2, "resolved")}
    monkeypatch.setattr(target, "bars_of", lambda *_: (bars, []))
    monkeypatch.setattr(target, "wanted_of", lambda *_: list(bars))
    monkeypatch.setattr(target, "scale_of", lambda output, _: bars[output].value)
    found = target.judged(scene, None, None)
    assert (found.worst, found.output) == (pytest.approx(0.8), other)
    bars[last] = Bar(10.0, 0.2, NONE)
    assert target.judged(scene, None, None).worst == math.inf


def test_what_an_accuracy_is_relative_to(driven):
    """Tensions: their value, smallest ones at least a fifth of the largest; angles and positions: the range."""
    _, bars, _ = bars_with(driven, lambda t: 0 * t)
    top = {number: bars[Output("tension_top", number, "cable")].value for number in NUMBERS}
    assert scale_of(Output("tension_top", "max", "cable"), bars) == top["max"]
    assert scale_of(Output("tension_top", "std", "cable"), bars) == top["std"]
    low = copy.copy(bars)
    low[Output("tension_top", "min", "cable")] = low[Output("tension_top", "min", "cable")]._replace(value=1.0)
    assert scale_of(Output("tension_top", "min", "cable"), low) == pytest.approx(0.2 * top["max"])
    lean = {"max": 12.0, "min": 10.0, "mean": 11.0, "std": 0.7}
    angle = {Output("cone_angle", number, "buoy"): Bar(value, 0.0, "resolved") for number, value in lean.items()}
    assert {scale_of(output, angle) for output in angle} == {2.0}


# -- of sweeps and of another program --------------------------------------------------------------------------------


def test_cases_of_a_sweep_have_bars(tmp_path):
    """Those of the run alone; without [accuracy] there are none; settings are not looked for."""
    scene = load_scene("driven", time__end=3.0)
    one = simulate(scene, **BARS)
    for more, there in ((BARS, True), ({}, False)):
        found = sweep(load_scene(scene, **more), ["cable.normal_drag=0.8"], None, tmp_path / str(there))
        assert ("tension_top_maximum_bar" in found) == there
        if there:
            for output, name in (("tension_top.max", "maximum"), ("tension_top.std", "standard_deviation")):
                bar = one.bar.values[one.output.values.tolist().index(output)]
                assert found[f"tension_top_{name}_bar"].item() == pytest.approx(float(bar), rel=1e-6)
                assert found[f"tension_top_{name}_bar"].units == "N"
    with pytest.raises(InputError, match=r"accuracy\.target"):
        plan(load_scene(scene, accuracy__target=0.1), ["cable.normal_drag=0.8"], None)


def test_utilisation_has_bars():
    """That of the largest tension over the breaking load, to what elements and ends differ by; with a name."""
    time = {"end": 8.0, "step": 0.05, "scheme": "bdf2"}
    run = simulate("short", cable__elements=10, cable__breaking_load=5e4, time=time, **BARS)
    bars = dict(zip(run.output.values.tolist(), run.bar.values.tolist(), strict=True))
    assert bars["utilisation.max"] * 5e4 == pytest.approx(bars["tension_top.max"], rel=0.3)
    (row,) = [row for row in rows_of(run) if row.output == "utilisation.max"]
    assert (row.name, row.unit, row.verdict) == ("largest utilisation", "1", RESOLVED)


def test_statistics_have_the_bars_of_their_runs():
    """Those of the record, nan where nothing is known; none if statistics begin at another time than they."""
    run = simulate("driven", time={"end": 14.0, "step": 0.05, "scheme": "bdf2"}, **BARS)
    bars = dict(zip(run.output.values.tolist(), run.bar.values.tolist(), strict=True))
    found = statistics([run, run.drop_vars([n for n in run.variables if n.startswith(("bar", "output"))])])
    for number, name in (("max", "maximum"), ("min", "minimum"), ("mean", "mean"), ("std", "standard_deviation")):
        column = found[f"tension_top_{name}_bar"]
        assert column.attrs["units"] == "N"
        np.testing.assert_array_equal(column.sel(cable="cable"), [bars[f"tension_top.{number}"], math.nan])
    assert "tension_top_maximum_bar" not in statistics(run, start=11.0)
    unknown = run.assign(bar_verdict=("output", ["none"] * run.sizes["output"]))
    assert np.isnan(statistics(unknown).tension_top_maximum_bar).all()


def test_a_difference_is_held_against_the_bar():
    t = np.linspace(0.0, 1.0, 11)
    for shift, bar, said in ((1.0, 2.0, "no"), (3.0, 2.0, "yes"), (3.0, None, None)):
        row = peer._row("top", "N", (t, {"top": t}), (t, {"top": t + shift}), 0.0, bar)
        assert (row["bar"], row["beyond"]) == (bar, said)


# -- shown -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "bar", "texts"),
    [
        (12.1134, 0.0521, ("12.113", "0.052")),
        (12113.4, 52.1, ("12113", "52")),
        (12113.4, 521.0, ("12113", "521")),
        (0.01234, math.nan, ("0.01234", "")),
        (1.5, 0.0, ("1.5", "0")),
    ],
)
def test_digits(value, bar, texts):
    assert number_with(value, bar) == texts
