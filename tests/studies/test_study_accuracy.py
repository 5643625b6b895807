"""Error measure, reference check and Pareto front of `study work-precision`; the accuracy promised by `advise`.

Source: errors of functions that splines represent exactly, powers, the record of the same run.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from alone import simulate

from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.results import compare
from dolfbuoy.results import measured as acc
from dolfbuoy.results.compare import Reference
from dolfbuoy.results.measured import Run
from dolfbuoy.scene import load_scene, settings
from dolfbuoy.scene.settings import Space, Stepping
from dolfbuoy.studies.accuracy import advise as advice
from dolfbuoy.studies.accuracy import pilot as pilots
from dolfbuoy.studies.accuracy import work_precision as study
from dolfbuoy.studies.study import run

CABLE = {
    "length": 11.0,
    "line_density": 9.0,
    "diameter": 0.06,
    "axial_stiffness": 4e7,
    "elements": 8,
    "added_mass": 0.4,
    "normal_drag": 0.9,
    "tangential_drag": 0.05,
    "top": {
        "kind": "prescribed",
        "position": [6.0, 0.0, -1.8],
        "amplitude": [0.3, 0.1, 0.4],
        "period": 4.0,
        "ramp": 2.0,
    },
}
DRIVEN = {"sea": {"depth": 10.0}, "cable": CABLE, "time": {"end": 8.0, "step": 0.02}}


def moored(amplitude, period):
    """A wide buoy on a cable in waves."""
    cable = {key: value for key, value in CABLE.items() if key != "top"}
    cable |= {"length": 22.0, "line_density": 27.6, "diameter": 0.08, "axial_stiffness": 2.3e8, "elements": 20}
    masses = [{"mass": 150.0, "height": 2.0}, {"mass": 150.0, "height": 3.0}]
    buoy = {"hull": [[0.0, 2.4], [1.2, 2.4]], "mass": 400.0, "center_of_mass": 0.5, "inertia": [192.0, 288.0]}
    drag = {"added_mass": 0.3, "normal_drag": 0.8, "axial_drag": 1.0, "rotational_damping": 100.0}
    return {
        "sea": {"depth": 20.0},
        "cable": cable,
        "buoy": buoy | drag | {"point_masses": masses},
        "current": {"speed": 0.5},
        "external_force": {"force": [500.0, 0.0, 0.0]},
        "waves": {"amplitude": amplitude, "period": period, "ramp": period},
        "time": {"end": 4 * period, "step": 0.01},
    }


def run_of(t, **values):
    return Run(np.asarray(t, float), {name: np.asarray(v, float) for name, v in values.items()})


# -- measure of the error ----------------------------------------------------------------------------------------------


def test_error_of_cubics_is_exact():
    """A spline is exact for cubics: the difference 0.3 alone is found at times that are not the reference's."""
    t, own = np.linspace(0, 4, 41), np.array([0.0, 0.37, 1.0, 1.9, 2.23, 3.1, 4.0])
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.7, 0.4])
    reference = Reference(run_of(t, a=cubic(t)), start=1.0)
    error = reference.error(run_of(own, a=cubic(own) + 0.3), "a")
    size = np.ptp(cubic(t[t >= 1]))
    assert error.rms == pytest.approx(0.3 / size, rel=1e-11)
    assert error.maximum == pytest.approx(0.3 / size, rel=1e-11)


def test_error_weighs_unequal_steps_by_time():
    """|d| = 1 on [0, 3], 0 on [4, 10], linear between: 3 + 1/2 of the square (trapezoids) over 10."""
    reference = Reference(run_of(np.arange(11), a=np.arange(11)), start=0.0)
    own = np.concatenate([np.linspace(0, 3, 31), [4.0, 10.0]])
    off = np.where(own <= 3, -1.0, 0.0)
    error = reference.error(run_of(own, a=own + off), "a")
    assert error.rms == pytest.approx(math.sqrt(3.5 / 10) / 10, rel=1e-12)
    assert error.maximum == pytest.approx(0.0, abs=1e-12)


def test_error_of_a_vector_and_before_the_start():
    """Ranges 3 and 4 give the diagonal 5; what happens before the start does not count."""
    t = np.linspace(0, 10, 101)
    line = np.stack([3 * (t - 2) / 8, 4 * (t - 2) / 8, 0 * t], axis=1)
    reference = Reference(run_of(t, r=line), start=2.0)
    assert reference.range_of("r") == pytest.approx(5.0, rel=1e-12)
    wrong = line + np.where(t < 1.95, 100.0, 0.0)[:, None] + [0.0, 0.0, 0.5]
    error = reference.error(run_of(t, r=wrong), "r")
    assert (error.rms, error.maximum) == pytest.approx((0.1, 0.1), rel=1e-10)


def test_a_run_holds_what_a_record_holds():
    """Every quantity at every step, of a scene in which all of them differ."""
    scene = load_scene(moored(0.8, 5.0), **{"time.end": 0.1, "cable.elements": 6, "waves.ramp": 0.1})
    run, record = acc.compute(scene, list(acc.QUANTITIES)), simulate(scene)
    np.testing.assert_allclose(run.t, record.time)
    for name, values in run.values.items():
        np.testing.assert_allclose(np.squeeze(values), record[name].squeeze(), rtol=1e-9, atol=1e-9, err_msg=name)
    assert (run.steps, run.iterations) == (10, int(record.newton_iterations.sum()))
    assert run.unknowns == record.attrs["unknowns"]


def test_advice_tells_what_was_predicted_and_what_was_measured():
    """In words, with the setting of the scene itself."""
    pilot = SimpleNamespace(
        whole=load_scene("driven"), quantity="tension_top", accuracy=0.01, predicted=lambda *_: 0.03
    )
    choice = pilots.Candidate(Space(2, 1, 10), Stepping("bdf2", 0.1), 0.004, 12.0)
    first, second, *_, own = advice.sentences(advice.Advice(pilot.whole, choice, 0.006, [choice], pilot, []))
    assert first.startswith("1 % in ")
    assert "about 12 s for the run until t = 60 s." in first
    assert second == "Predicted 0.4 %, measured 0.6 % in the pilot."
    assert own.endswith(": 3 % predicted.")


def test_error_of_a_constant_is_infinite_unless_it_is_zero():
    t = np.linspace(0, 1, 11)
    reference = Reference(run_of(t, a=np.full(11, 2.0)), start=0.0)
    assert reference.error(run_of(t, a=np.full(11, 2.5)), "a").rms == math.inf


def test_richardson_is_exact_for_powers():
    """Errors 1, 1/4, 1/16 relative to the truth: changes 3/4 and 3/16, own error of the last 1/16."""
    assert compare.own_error([3 / 4, 3 / 16]) == pytest.approx(1 / 16)
    assert compare.own_error([3 / 16]) == pytest.approx(1 / 16)
    assert compare.own_error([1 / 2, 1 / 4]) == pytest.approx(1 / 4)
    assert compare.own_error([1 / 2], highest=1.0) == pytest.approx(1 / 2)  # of a scheme of first order
    assert compare.own_error([3 / 4, 3 / 16], highest=1.0) == pytest.approx(3 / 16)
    assert compare.own_error([1.0, 1.0]) == pytest.approx(1.0)  # no order: nothing is gained


def test_unresolved_cases_are_marked():
    """Below three times the reference's own error that bound stands for the error, also in the sentence."""
    own = {"tension_top": compare.Error(1e-3, 2e-3)}
    base = {"pair": "P2-P1", "cells": 8, "scheme": "bdf2", "step": 0.1, "tolerance": None, "newton": 1e-9}
    base |= {"own": False, "reason": None}
    rows = [
        base | {"wall": 1.0, "error_tension_top": 1e-2, "max_error_tension_top": 1e-2},
        base | {"wall": 2.0, "step": 0.05, "error_tension_top": 1e-4, "max_error_tension_top": 1e-4},
        base | {"wall": 3.0, "step": 0.02, "error_tension_top": 1e-6, "max_error_tension_top": 1e-6},
        base | {"step": 0.5, "reason": "no convergence"},
    ]
    study.mark(rows, own)
    assert [row["resolved_tension_top"] for row in rows] == [True, False, False, None]
    assert [row["bound_tension_top"] for row in rows[:3]] == pytest.approx([1e-2, 3e-3, 3e-3])
    assert [row["wall"] for row in study.front(rows, "tension_top")] == [1.0, 2.0]
    assert "BDF2, dt 0.05 s: 2 s" in study.sentence(rows, "tension_top", 0.005)
    assert "none of the cases" in study.sentence(rows, "tension_top", 0.001)
    said = " ".join(study.notes(rows, own, base))
    assert "of theirs): 2 of 4 cases" in said
    assert "no convergence" in said
    assert study.front_rows(rows, own)[1]["error"] == "< 0.3 %"


def test_newton_is_a_hundred_times_as_exact_as_what_is_promised():
    """The faster case of two, with a looser tolerance, counts where this is at most a hundredth of the accuracy."""
    base = {"pair": "-", "cells": 0, "scheme": "bdf2", "step": 0.1, "tolerance": None, "own": False, "reason": None}
    rows = [base | {"wall": wall, "newton": newton} for wall, newton in ((2.0, 1e-9), (1.0, 1e-4))]
    rows = study.mark([row | {"error_tension_top": 9e-4} for row in rows], {"tension_top": compare.Error(1e-6, 1e-6)})
    assert "Newton 0.0001: 1 s" in study.sentence(rows, "tension_top", 0.01)
    assert "BDF2, dt 0.1 s: 2 s" in study.sentence(rows, "tension_top", 0.001)


def test_the_maximum_is_asked_for_too():
    """Where the maximum of the cheapest settings is off, dearer ones are the cheapest; or the same, or none."""
    base = {"pair": "-", "cells": 0, "scheme": "bdf2", "tolerance": None, "newton": 1e-9, "own": False, "reason": None}
    rows = [
        base | {"wall": wall, "step": step, "error_tension_top": rms, "max_error_tension_top": largest}
        for wall, step, rms, largest in ((1.0, 0.2, 9e-3, 4e-2), (2.0, 0.1, 2e-3, 8e-3), (3.0, 0.05, 5e-4, 1e-6))
    ]
    study.mark(rows, {"tension_top": compare.Error(1e-7, 1e-7)})
    text = study.sentence_of_maximum(rows, "tension_top", 0.01)
    assert text == (
        "1 % in largest top tension too: the cheapest settings change, to BDF2, dt 0.1 s: 2 s; with those for the rms "
        "it is off by 4 %."
    )
    assert [row["wall"] for row in study.front(rows, "tension_top", largest=True)] == [1.0, 2.0, 3.0]
    last = study.sentence_of_maximum(rows, "tension_top", 0.001)  # 5e-4 of the rms, though the maximum is exact
    assert last == "0.1 % in largest top tension too: the same settings, off by 0.0001 %."
    assert study.bound_of(rows[2], "tension_top", largest=True) == 5e-4
    assert "none of the cases" in study.sentence_of_maximum(rows, "tension_top", 1e-5)
    quantities = [row["quantity"] for row in study.front_rows(rows, ["tension_top"])]
    assert quantities == ["top tension"] * 3 + ["largest top tension"] * 3


def test_pareto_front():
    points = [(3, 1.0), (1, 5.0), (2, 6.0), (2, 2.0), (4, 1.0), (5, 0.5), (1, 7.0)]
    assert compare.pareto(points) == [1, 3, 0, 5]
    assert compare.pareto([]) == []


# -- settings ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("text", "value"), [("1%", 0.01), ("1 %", 0.01), (" 0.01 ", 0.01), ("0.5%", 0.005)])
def test_accuracy_is_understood(text, value):
    assert compare.parse_accuracy(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["", "%", "one", "0", "-1%", "60%", "1", "nan", "inf %", "1e-9"])
def test_accuracy_is_refused(text):
    with pytest.raises(InputError, match="--accuracy"):
        compare.parse_accuracy(text)


def test_other_bad_options_are_refused():
    with pytest.raises(InputError, match="cone_angle: this scene has tension_top, tension_anchor"):
        acc.check_quantity(load_scene(DRIVEN), "cone_angle")
    for text in ("2", "1-1", "2-1-0", "a-b"):
        with pytest.raises(InputError, match="--pairs"):
            study.parse_pairs(text)
    assert study.parse_pairs("1-0,P2-P1") == [(1, 0), (2, 1)]
    with pytest.raises(InputError, match="--cells"):
        settings.parse_numbers("--cells", "4,-1", int)
    with pytest.raises(InputError, match="--schemes"):
        study.request(DRIVEN, None, None, None, "bdf2,euler", None, None, "1e-9", 1)
    for text in ("none", "1e-9,2", "x"):
        with pytest.raises(InputError, match="--newton"):
            study.request(DRIVEN, None, None, None, None, None, None, text, 1)


def test_settings_reach_the_scene():
    scene = load_scene(DRIVEN, cable={"elements": [[5.0, 4], [6.0, 8]]})
    changed = settings.with_settings(scene, Space(3, 2, 6), Stepping("bdf2", 0.05, 1e-3))
    assert settings.space_of(changed) == Space(3, 2, 6)
    assert changed.network.pieces[0].section.elements == [(5.0, 2), (6.0, 4)]
    assert settings.stepping_of(changed) == Stepping("bdf2", 0.05, 1e-3)
    loose = settings.with_settings(changed, Space(3, 2, 6), Stepping("bdf2", 0.05, newton=1e-5))
    assert (loose.solver.step_tolerance, settings.stepping_of(loose).newton) == (1e-5, 1e-5)
    found = study.steppings(["backward-euler", "bdf2"], [0.1, 0.05], [1e-3], 0.4, [1e-9, 1e-5])
    assert found[:3] == [Stepping("backward-euler", 0.1), Stepping("backward-euler", 0.05), Stepping("bdf2", 0.1)]
    assert found[4:6] == [Stepping("bdf2", 0.05, 1e-3, 0.4), Stepping("backward-euler", 0.1, newton=1e-5)]
    assert len(found) == 10
    assert settings.with_settings(changed, settings.space_of(changed), Stepping("bdf2", 0.05)).time.tolerance is None
    adaptive = Stepping("bdf2", 0.05, 1e-3, settings.largest_step(scene))
    bounded = settings.with_settings(settings.shortened(scene, 4.0), Space(3, 2, 6), adaptive)
    assert (bounded.time.end, bounded.time.max_step) == (4.0, scene.time.end / 10)  # that of the whole run
    assert settings.stepping_of(bounded) == adaptive
    assert settings.shortened(bounded, 2.0).time.max_step == scene.time.end / 10
    assert settings.with_settings(bounded, Space(1, 0, 6), Stepping("bdf2", 0.05)).time.max_step is None
    assert settings.shortened(scene, periods=1).time.end == 6.0  # ramp 2 s, period 4 s
    assert settings.shortened(scene).time.end == 8.0  # it is over before two periods
    for ramp, start in ((2.0, 2.0), (6.3, 6.3), (6.5, 0.8), (0.0, 0.8)):  # 0.8 of 8 s at most, else a tenth
        assert acc.window_start(load_scene(scene, cable__top__ramp=ramp)) == pytest.approx(start)


def test_settings_that_a_study_takes_by_itself():
    """A quarter, a half and all of the elements; parts of the period, or multiples of the step."""
    scene = load_scene(DRIVEN)
    found = settings.spaces(scene)
    assert [(s.mu, s.nu, s.cells) for s in found] == [(p, p - 1, n) for p in (1, 2, 3) for n in (2, 4, 8)]
    assert settings.spaces(scene, [(4, 2)], [3]) == [Space(4, 2, 3)]
    assert study.default_steps(scene) == pytest.approx([0.008, 0.016, 0.04, 0.08])
    held = {"kind": "fixed", "position": [6.0, 0.0, -1.8]}
    still = load_scene(DRIVEN | {"cable": CABLE | {"top": held}})
    assert study.default_steps(still) == pytest.approx([0.02, 0.04, 0.1, 0.2])
    uneven = load_scene(DRIVEN, cable={"elements": [[1.0, 1], [10.0, 15]]})
    assert settings.with_settings(uneven, Space(1, 0, 4), Stepping("bdf2", 0.05)).network.pieces[
        0
    ].section.elements == [
        (1.0, 1),
        (10.0, 4),
    ]


def test_curve_follows_powers_and_is_safe():
    curve = compare.Curve([(0.1, 0.04), (0.2, 0.16), (0.4, 0.1)])  # the last is a bump the wrong way
    assert curve.order == pytest.approx(2.0)
    assert curve(math.sqrt(0.02)) == pytest.approx(0.08)
    assert curve(0.05) == pytest.approx(0.01)
    assert curve(0.4) == pytest.approx(0.16)
    assert curve(0.5) == math.inf
    sizes = compare.nice_numbers(0.01, 0.4)
    assert curve.largest(0.041, sizes) == 0.1
    assert {0.01, 0.064, 0.4} <= set(sizes)


# -- real runs ---------------------------------------------------------------------------------------------------------


def true_error(scene, quantity):
    """Error over the whole run against a much finer one of another pair and scheme than the pilot's reference."""
    start = acc.window_start(scene)
    run = acc.compute(scene, [quantity])
    smallest = min(scene.time.step, (scene.time.end - start) / run.steps)
    fine = acc.compute(settings.with_settings(scene, Space(2, 1, 30), Stepping("bdf2", smallest / 6)), [quantity])
    return Reference(fine, start).error(run, quantity).rms


def test_study_of_a_small_scene(tmp_path, capsys):
    """Few cases; all files; a case that cannot be solved is a row with its reason."""
    scene = settings.shortened(load_scene(DRIVEN), 4.0)
    options = {"pairs": [(1, 0), (2, 1)], "cells": [4], "steps": [0.1], "tolerances": [1e-3], "repeats": 1}
    run(study.study, tmp_path, scene=scene, schemes=["bdf2"], newton=[1e-9, 1e-5], **options)
    assert "its own error" in capsys.readouterr().out
    assert all((tmp_path / f"work-precision.{suffix}").is_file() for suffix in ("json", "csv", "png", "svg"))
    time = {"scheme": "bdf2", "step": 0.4, "min_step": 0.4, "tolerance": 1e-9}  # cannot be met
    case = {"scene": load_scene(DRIVEN, time=time).to_dict(), "repeats": 1, "reference": "unused"}
    assert "times the tolerance" in study.evaluate(case)["reason"]


def test_advice_keeps_its_promise():
    """2 % in the top tension of a driven cable, against an independent finer run."""
    said = []
    found = advice.advise(load_scene(DRIVEN), "tension_top", 0.02, said.append)
    assert found.measured <= 0.02
    assert true_error(found.scene, "tension_top") <= 0.02
    assert settings.stepping_of(found.scene) == found.choice.stepping
    assert settings.NEWTON < found.scene.solver.step_tolerance <= 2e-4  # a hundredth of what was asked
    assert 0 < found.pilot.of_newton <= 2e-4
    assert found.pilot.work_of_newton < 0.9
    assert found.candidates[0].seconds == min(c.seconds for c in found.candidates)
    assert any("Errors in space" in text for text in said)
    assert "2 % in top tension: " in advice.sentences(found)[0]


def test_advice_that_fails_is_not_given():
    """The promise is measured: where every run differs from the reference by more, nothing is promised."""
    pilot = pilots.Pilot(load_scene(DRIVEN), "tension_top", 0.01, lambda text: None)
    t, candidate = np.linspace(0, 8, 81), pilots.Candidate(Space(2, 1, 4), Stepping("bdf2", 0.1), 0.005, 1.0)
    pilot.run = lambda space, stepping: run_of(t, tension_top=np.sin(t) * (1.0 if space.mu == 3 else 1.1))
    pilot.candidates = lambda target: [candidate]
    pilot.best, pilot.finest, pilot.own_time, pilot.own_space = Space(3, 2, 8), 0.01, 1e-4, 1e-4
    with pytest.raises(SolveError, match="No settings"):
        advice.verified(pilot, 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("amplitude", "period", "quantity", "accuracy"),
    [(0.6, 5.0, "tension_top", 0.01), (0.3, 4.0, "tension_anchor", 0.02), (0.9, 6.5, "buoy_position", 0.005)],
)
def test_advice_for_a_moored_buoy_keeps_its_promise(amplitude, period, quantity, accuracy):
    found = advice.advise(load_scene(moored(amplitude, period)), quantity, accuracy, lambda text: None)
    assert true_error(found.scene, quantity) <= accuracy
