"""Cheapest settings for outputs: `advise --of` keeps its promise about maxima, at the cost of a few runs.

Source: much finer runs with another element pair and scheme; powers; given shares.
"""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from alone import simulate

from dolfbuoy import load_scene
from dolfbuoy.accuracy.companion import covered
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.accuracy.target import ENOUGH
from dolfbuoy.errors import InputError, NoResult, SolveError
from dolfbuoy.scene.settings import Space, Stepping, space_of, stepping_of, with_settings
from dolfbuoy.studies import one_case
from dolfbuoy.studies.accuracy import advise, cheapest
from dolfbuoy.studies.accuracy.cheapest import Choice, Pilot, Share


def values_of(scene):
    """Outputs of a run by name and part."""
    found = simulate(scene, accuracy={"estimate": "companion"})
    names = zip(found.output.values.tolist(), found.output_of.values.tolist(), strict=True)
    return dict(zip(names, found.bar_value.values, strict=True))


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """Advice for the largest tensions of a driven cable, and its folder."""
    scene, said = load_scene("driven", time__end=25.0), []
    found = cheapest.cheapest(scene, ["tension_top.max", "anchor.max"], 0.01, said.append)
    folder = tmp_path_factory.mktemp("advice")
    cheapest.report(found, folder)
    return scene, found, folder


def test_maxima_are_as_accurate_as_was_asked_for(driven):
    """Against BDF2 with P2-P1, an eighth of the step and four times the elements."""
    scene, found, _ = driven
    step, cells = stepping_of(found.scene).step, space_of(found.scene).cells
    truth = values_of(with_settings(scene, Space(2, 1, 4 * cells), Stepping("bdf2", step / 8)))
    own = values_of(found.scene)
    for name in ("tension_top.max", "anchor.max"):
        assert own[name, "cable"] == pytest.approx(truth[name, "cable"], rel=0.01), name
    assert found.scene.accuracy is None  # nothing more is paid for in its runs


def test_what_is_advised_is_what_was_run_with_bars(driven):
    scene, found, folder = driven
    assert found.found.worst <= ENOUGH
    assert (space_of(found.scene), stepping_of(found.scene)) == (found.choice.space, found.choice.stepping)
    assert found.scene.time.end == scene.time.end == float(found.found.record.time[-1])
    assert found.scene.solver.step_tolerance == 1e-4  # a hundredth of 1 %
    bar = found.found.bars[Output("tension_top", "max", "cable")]
    line = next(text for text in cheapest.sentences(found) if text.startswith("tension_top.max"))
    assert "kN" in line
    assert "+-" in line
    assert float(line.split()[1]) == pytest.approx(1e-3 * bar.value, rel=1e-3)
    assert bar.verdict == "resolved"
    rows = json.loads((folder / "advise.json").read_text())["rows"]
    assert rows[0]["remark"] == "advised"
    assert rows[0]["predicted_seconds"] == min(row["predicted_seconds"] for row in rows)


def test_the_figure_of_advice(driven):
    """Bars of the pilot's runs in percent over step and elements, and the largest of the advised run."""
    _, found, folder = driven
    assert (folder / "advise.png").stat().st_size > 10_000
    for axes, kind, key, x in zip(
        cheapest.draw(found).axes,
        ("time", "space"),
        ("step", "cells"),
        (found.choice.stepping.step, found.choice.space.cells),
        strict=True,
    ):
        *curves, advised, _ = axes.lines
        rows = [row for row in found.rows if row["error_in"] == kind and math.isfinite(row["share"])]
        expected = sorted((row[key], row["share"]) for row in rows)
        shown = sorted(point for line in curves for point in zip(*line.get_data(), strict=True))
        np.testing.assert_allclose(shown, expected)
        assert [float(value) for value in np.ravel(advised.get_data())] == pytest.approx([x, found.found.worst])


def test_a_pilot_costs_some_runs(driven):
    """Steps times elements of all runs of the pilot: below twenty of the advised run."""
    scene, found, _ = driven
    whole = scene.time.end / found.choice.stepping.step * (found.choice.space.cells + 10)
    pilot = Pilot(scene, 0.01).scene.time.end
    assert sum(pilot / row["step"] * (row["cells"] + 10) for row in found.rows) < 20 * whole


def test_a_run_whose_steps_fail_again_and_again_is_given_up():
    """After as many failures as it may have; with one more allowed it goes on."""
    scene = with_settings(load_scene("driven"), Space(1, 0, 16), Stepping("generalized-alpha", 0.5, newton=1e-4))
    with pytest.raises(NoResult, match=r"^(\d+) steps failed until t = [\d.]+ s\.$") as few:
        one_case.run(scene, most=5)
    failed = int(str(few.value).split()[0])
    assert failed > 5
    with pytest.raises(NoResult) as more:
        one_case.run(scene, most=failed)
    assert int(str(more.value).split()[0]) > failed
    assert isinstance(cheapest.tried(scene), NoResult)


def test_shares_follow_powers():
    """4 at 0.2 and 1 at 0.1: order two, a quarter at 0.05; unknown ones are none; order two of a single one."""
    share = Share([(0.4, math.inf), (0.2, 4.0), (0.1, 1.0)], 2)
    assert share(0.05) == pytest.approx(0.25)
    assert share(0.4) == math.inf
    assert Share([(0.2, 4.0), (0.1, 0.1)], 2)(0.05) == pytest.approx(0.025)  # 5.3 is not believed
    assert Share([(0.2, 4.0)], 4)(0.1) == pytest.approx(1.0)
    assert Share([(0.2, 4.0)], 1)(0.1) == pytest.approx(2.0)


def test_settings_whose_bars_are_larger_than_predicted_are_not_given(monkeypatch):
    """Those of the same pair and scheme become as much stricter, others by the root; without any end: one sentence."""
    tried = []

    class Given:
        worst, output, sentences = 2.0, "tension_top.max", ()

    def verified(scene):
        tried.append((space_of(scene).pair, stepping_of(scene).scheme, stepping_of(scene).step))
        return Given()

    monkeypatch.setattr(cheapest, "_verified", verified)
    monkeypatch.setattr(cheapest, "_by_a_finer_run", lambda found: 0.1)
    monkeypatch.setattr(Pilot, "measure", lambda self: None)
    asked = []

    def candidates(self, worse, others):
        asked.append((dict(worse), others))
        return [Choice(Space(2, 1, 10), Stepping("bdf2", 0.1), 0.5, 1.0)]

    monkeypatch.setattr(Pilot, "candidates", candidates)
    with pytest.raises(SolveError, match=r"No settings of the pilot keep 1 % in tension_top.max.*known to 2 %"):
        cheapest.cheapest(load_scene("driven", time__end=15.0), ["tension_top.max"], 0.01, lambda text: None)
    assert len(tried) == cheapest.TRIES
    assert asked[0] == ({}, 1.0)
    assert asked[1] == ({("P2-P1", "bdf2"): pytest.approx(4.0)}, pytest.approx(2.0))


def test_bars_that_are_small_by_luck_are_found_out(monkeypatch):
    """A run whose bar is within what was asked for, and a finer run shows twice as much, is not given."""

    class Given:
        worst, output, sentences = 0.3, "tension_top.max", ()

    monkeypatch.setattr(cheapest, "_verified", lambda scene: Given())
    monkeypatch.setattr(cheapest, "_by_a_finer_run", lambda found: 2.0)
    monkeypatch.setattr(Pilot, "measure", lambda self: None)
    choice = Choice(Space(2, 1, 10), Stepping("bdf2", 0.1), 0.5, 1.0)
    monkeypatch.setattr(Pilot, "candidates", lambda self, worse, others: [choice])
    with pytest.raises(SolveError, match=r"by a run of half the step and twice the elements off by 2 %"):
        cheapest.cheapest(load_scene("driven", time__end=15.0), ["tension_top.max"], 0.01, lambda text: None)


def test_a_finer_run_of_a_long_one_is_compared_where_it_is():
    """Its beginning, not the rest of the run: 13 periods of `driven`, of which the finer run has four."""
    scene = with_settings(
        cheapest.requested(load_scene("driven", time__end=76.0), ["tension_top.max"], 0.01),
        Space(2, 1, 8),
        Stepping("bdf2", 0.05),
    )
    found = cheapest._verified(scene)
    assert covered(scene) == 30.0
    assert 0.02 < cheapest._by_a_finer_run(found) < 4 * found.worst


@pytest.mark.parametrize(
    ("scheme", "slack", "times"),
    [("bdf2", "compressive", 4.0), ("backward-euler", "compressive", 2.5), ("bdf2", "tension-only", 2.5)],
)
def test_what_a_finer_run_leaves_of_an_error(scheme, slack, times, monkeypatch):
    """A quarter of one of second order; of first order, or where lines go slack, more."""
    scene = load_scene("driven", time__end=15.0, time__scheme=scheme, cable__slack=slack)
    monkeypatch.setattr(cheapest, "tried", lambda scene: None)
    monkeypatch.setattr(cheapest, "judged", lambda *arguments: SimpleNamespace(worst=0.1))
    found = SimpleNamespace(scene=cheapest.requested(scene, ["tension_top.max"], 0.01), record=None)
    assert cheapest._by_a_finer_run(found) == pytest.approx(times * 0.1)


def test_seconds_that_a_pilot_predicts():
    """Newton's iterations and one more in every step, at what one of these takes with so many elements."""
    pilot = Pilot(cheapest.requested(load_scene("driven", time__end=60.0), ["tension_top.max"], 0.01), 0.01)
    for step, steps, iterations, seconds in ((0.2, 50, 50, 9.0), (0.1, 100, 300, 8.0)):
        newton = xr.DataArray([0.0] + [iterations / steps] * steps, dims="time")
        record = xr.Dataset({"newton_iterations": newton}, attrs={"loop_seconds": seconds})
        pilot._note(record, Space(2, 1, 10), step, "bdf2")
    one = 8.0 / 400  # of the latest run with these elements
    for step, work in ((0.2, 2.0), (0.15, 3.0), (0.1, 4.0)):
        assert pilot.seconds(Space(2, 1, 10), "bdf2", step) == pytest.approx(60.0 / step * work * one)


def test_outputs_that_are_not_there_are_refused_before_anything_runs():
    scene = load_scene("driven")
    for name in ("cone_angle.max", "tension_top.most", "beauty.max", "tension_top"):
        with pytest.raises(InputError, match="must be an output of this scene"):
            cheapest.requested(scene, [name], 0.01)


def test_advice_for_outputs_on_every_rank_is_the_scene(monkeypatch):
    """What rank 0 raises, all raise."""

    class Comm:
        rank = 0

        def bcast(self, what):
            return what

    monkeypatch.setattr(advise, "cheapest", lambda *arguments: (_ for _ in ()).throw(SolveError("none")))
    with pytest.raises(SolveError, match="none"):
        advise.advise_all(load_scene("driven"), "", 0.01, print, Comm(), ["tension_top.max"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["short", "three-legs", "chain-on-bed"])
def test_maxima_of_shipped_scenes(name):
    """Against BDF2 with P2-P1, a quarter of the step and three times the elements: twice the bars at most."""
    scene = load_scene(name)
    found = cheapest.cheapest(scene, [], 0.01, lambda text: None)
    step, cells = stepping_of(found.scene).step, space_of(found.scene).cells
    truth = values_of(with_settings(scene, Space(2, 1, 3 * cells), Stepping("bdf2", step / 4)))
    own = values_of(found.scene)
    wanted = [key for key in own if key[0] in ("tension_top.max", "anchor.max")]
    assert wanted
    for key in wanted:
        assert own[key] == pytest.approx(truth[key], rel=0.01), key
