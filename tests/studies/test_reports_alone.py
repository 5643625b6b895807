"""Parts of the accuracy reports, each alone: pilots, orders, work and precision, figures, wording, thresholds.

Source: made-up rows and runs, and the same numbers by hand.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from dolfbuoy import InputError, load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.motion.schemes import make_scheme
from dolfbuoy.results.compare import Curve, Error
from dolfbuoy.results.measured import Run
from dolfbuoy.scene.settings import Space, Stepping
from dolfbuoy.studies.accuracy import advise, convergence, linear_answer, pilot, report, report_text, work_precision
from dolfbuoy.studies.accuracy.pilot import Pilot

DRIVEN = load_scene("driven")
ALPHA = "generalized-alpha"

# -- pilots ------------------------------------------------------------------------------------------------------------


def made(scene=DRIVEN, accuracy=0.01):
    return Pilot(scene, "tension_top", accuracy, lambda text: None)


def test_a_pilot_without_lines():
    """Has no elements to vary, whatever it moves."""
    own = Pilot(load_scene("free-buoy"), "cone_angle", 0.01, print)
    own.measure_space()
    assert (own.own_space, own.best, own.mesh) == (0.0, Space(), Space())
    assert own._spaces(0.1) == [(Space(), 0.0)]
    own.time_curves = {(ALPHA, False): Curve([(0.1, 0.004)])}
    assert own.predicted(Space(), Stepping(ALPHA, 0.1)) == pytest.approx(0.004)


def test_elements_that_are_exact_enough():
    own = made()
    own.space_curves = {(2, 1): Curve([(1 / 8, 0.04), (1 / 4, 0.16)])}
    assert [space.cells for space, _ in own._spaces(0.16)] == [5, 6, 7, 8, 9, 11, 12, 14]
    assert [space.cells for space, _ in own._spaces(0.02)] == [12, 14]


@pytest.mark.parametrize(
    ("accuracy", "error", "newton"),
    [(0.01, 0.0, 1e-4), (0.001, 0.0, 1e-5), (0.001, 1.1e-5, None), (0.001, 1e-5, 1e-5), (0.5, 0.0, 1e-4)],
)
def test_newtons_tolerance_of_a_pilot(accuracy, error, newton):
    """The loosest that is a hundredth of the accuracy, 1e-4 at most, and changes no more than that."""
    own, asked = made(accuracy=accuracy), []
    own.step = 0.1

    def run(space, stepping):
        asked.append(stepping.newton)
        return Run(np.arange(3.0), {}, 1.0, 1.0, 100, 300 if stepping.newton == 1e-9 else 100)

    own.run, own.difference = run, lambda one, truth: error
    own.measure_newton()
    if newton is None:
        assert (own.newton, own.of_newton, own.work_of_newton, own.rows) == (1e-9, 0.0, 1.0, [])
        assert asked[1:] == pytest.approx([1e-5, 1e-6, 1e-7, 1e-8])
        return
    assert (own.newton, own.of_newton, own.work_of_newton) == (pytest.approx(newton), error, 0.5)
    assert [row["error_in"] for row in own.rows] == ["Newton"]


def test_a_quantity_that_is_not_there_and_runs_that_fail_at_first():
    """Runs before the first that does not fail are left out; two that fail behind it end the search."""
    own, runs = made(), iter([None, None, "a", "b", "c"])
    own.run, own.difference = (lambda *_: next(runs)), lambda one, fine: {"a": 0.004, "b": 0.001}[one]
    chosen = [(k, k) for k in range(9)]
    points, last, error = own.refine(chosen, "in time", 2.0)
    assert [setting for setting, _ in points] == [(2, 2), (3, 3), (4, 4)]
    assert (last, error) == ("c", pytest.approx(0.001 / 3))
    assert points[0][1] == pytest.approx(0.004 + error)


def test_curves_of_a_pilot(monkeypatch):
    """Against the finest; of backward Euler the last two steps, of others as far as is needed; all are kept."""
    own, asked = made(), []

    def refine(chosen, what, highest):
        asked.append((what, highest, [s.step for _, s in chosen]))
        return [(setting, 0.01 / 4**k) for k, setting in enumerate(chosen[:4])], "truth", 1e-4

    def finer(chosen, truth, error, enough=None, dearest=None):
        asked.append((chosen[0][1].scheme, [s.tolerance or s.step for _, s in chosen], truth, error, enough, dearest))
        return [(setting, 0.02 / 4**k) for k, setting in enumerate(chosen)]

    monkeypatch.setattr(pilot, "_work", {"truth": 1000}.get)
    own.refine, own._finer, own._keep = refine, finer, lambda kind, points: asked.append((kind, len(points)))
    own.measure_time()
    h = own.first_step
    steps = [h / 2**k for k in range(9)]
    assert asked[0] == ("in time", 2, steps)
    assert asked[1] == ("bdf2", steps[:4], "truth", 1e-4, None, None)
    assert asked[2] == ("backward-euler", steps[2:4], "truth", 1e-4, 0.0, None)
    assert asked[3] == ("bdf2", [1e-2, 1e-3, 1e-4, 1e-5], "truth", 1e-4, None, 500.0)
    assert asked[4][0] == ALPHA
    assert asked[5:] == [("time", 4), ("time", 4), ("time", 2), ("time", 4), ("time", 4)]
    assert own.finest == steps[3]
    assert own.step == steps[0]  # 0.01 of twice 0.01
    asked.clear()
    monkeypatch.setattr(
        own,
        "refine",
        lambda chosen, *more: (
            asked.append((more, chosen))
            or ([(setting, 0.01 / 4**k) for k, setting in enumerate(chosen[:3])], "truth", 1e-4)
        ),
    )
    own.measure_space()
    (more, chosen), two, one, *kept = asked
    assert more == ("in space", 3)
    assert [(space.mu, space.cells) for space, _ in chosen] == [(3, 2 * 2**k) for k in range(7)]
    assert {stepping for _, stepping in chosen} == {Stepping(ALPHA, own.step)}
    assert own.best.cells == 8
    assert kept == [("space", 3), ("space", 4), ("space", 3)]
    assert set(own.space_curves) == {(3, 2), (2, 1), (1, 0)}
    assert own.space_curves[2, 1].x.tolist() == [1 / 24, 1 / 12, 1 / 6, 1 / 3]
    assert own.space_curves[1, 0].x.tolist() == [1 / 20, 1 / 10, 1 / 5]
    assert two[0] == one[0] == ALPHA


def test_other_ranks_have_the_scene_alone(monkeypatch):
    """Or what the first raises."""
    sent = []
    monkeypatch.setattr(advise, "advise", lambda *_: SimpleNamespace(scene="a scene"))
    first = SimpleNamespace(rank=0, bcast=lambda found: sent.append(found) or found)
    found = advise.advise_all(DRIVEN, "tension_top", 0.01, print, first)
    assert (found.scene, sent) == ("a scene", ["a scene"])
    monkeypatch.setattr(advise, "advise", lambda *_: pytest.fail("computed"))
    other = SimpleNamespace(rank=1, bcast=lambda found: "a scene")
    assert advise.advise_all(DRIVEN, "tension_top", 0.01, print, other) == "a scene"
    other.bcast = lambda found: InputError("no")
    with pytest.raises(InputError, match="no"):
        advise.advise_all(DRIVEN, "tension_top", 0.01, print, other)


# -- orders ------------------------------------------------------------------------------------------------------------


def rows_of(figure):
    """Errors that are exact powers, of all pairs of a figure, Neumann, on 4, 8 and 16 elements."""
    rows = []
    for case in convergence.cases((figure,), (4, 8, 16))[: 3 * 4 * len(convergence.FIGURES[figure][1])]:
        powers = convergence.theory(case)
        h = 1 / case["cells"]
        rows.append(
            case | {"h": h, "smallest_tension": 0.5} | {n: 0.1 * h**p / (1 + case["nu"]) for n, p in powers.items()}
        )
    return [row for curve in convergence.curves(rows) for row in convergence.add_orders(curve)]


@pytest.mark.parametrize(("figure", "panels"), [(2, 3), (3, 4), (4, 3)])
def test_figures_of_orders(figure, panels):
    """A panel of each error, of the elastic cable of each strain; a slope of each order; curves by their pairs."""
    rows = rows_of(figure)
    drawn = convergence.draw(figure, rows)
    assert len(drawn.axes) == panels
    titles = [axes.get_title() for axes in drawn.axes]
    if figure != 3:
        assert titles == ["error of r, L2", "error of r, H1", "error of T, L2"]
    for axes, name in zip(drawn.axes, ("r_L2", "r_H1", "T_L2") if figure != 3 else ("r_L2", "T_L2") * 2, strict=True):
        curves = [
            line for line in axes.lines if line.get_marker() in convergence.MARKERS and line.get_linestyle() == "-"
        ]
        strain = convergence.FIGURES[figure][1][0]
        expected = [[row[name] for row in curve] for curve in convergence.curves(rows) if curve[0]["strain"] == strain]
        if axes in drawn.axes[:2]:
            assert [line.get_ydata().tolist() for line in curves] == expected
        assert not [line for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())]
    pairs = [text.get_text() for text in drawn.axes[0].get_legend().get_texts()]
    assert pairs == (["P4-P0", "P4-P1", "P4-P2", "P4-P3"] if figure == 4 else ["P1-P0", "P2-P1", "P3-P2", "P4-P3"])
    slopes = [text.get_text() for text in drawn.axes[0].texts]
    assert sorted(slopes) == {2: ["$h^2$", "$h^3$", "$h^4$", "$h^5$"], 3: ["$h^1$", "$h^2$"]}.get(
        figure, sorted(slopes)
    )


def test_words_on_orders():
    """Of all pairs of one degree of the position, whatever it is; where orders differ by a tenth they do not agree."""
    said = convergence.in_words(rows_of(4))
    assert said[0].startswith("The orders on the finest meshes agree with theory: the largest difference is ")
    assert said[1:] == ["The tension's degree sets the order of r as well: nu + 2 in L2 and nu + 1 in H1, whatever mu."]
    rows = [row | {"order_r_L2": row["theory_r_L2"] - 0.0999} for row in rows_of(2)]
    assert "agree with" in convergence.in_words(rows)[0]
    rows[-1] |= {"order_r_L2": rows[-1]["theory_r_L2"] + 0.1001}
    assert convergence.in_words(rows) == [
        "The orders on the finest meshes DIFFER from theory: the largest difference is 0.1 (P4-P3, r, L2)."
    ]


@pytest.mark.parametrize(("strain", "end", "nu", "orders"), [
    ("exact", "Neumann", 2, (4, 3, 3)), ("exact", "Dirichlet", 2, (4, 3, 3)),
    ("element-average", "Neumann", 2, (2, 1, 3)), ("element-average", "Dirichlet", 2, (2, 1, 2)),
    ("element-average", "Dirichlet", 0, (2, 1, 1)),
])  # fmt: skip
def test_orders_in_theory(strain, end, nu, orders):
    assert tuple(convergence.theory({"strain": strain, "end": end, "nu": nu}).values()) == orders


def test_options_of_orders():
    assert [convergence.parse_figures(text) for text in ("3", "all")] == [(3,), (2, 3, 4)]
    assert convergence.parse_cells("1, 2,8") == (1, 2, 8)
    for text in ("0,2", "2,2", "x"):
        with pytest.raises(InputError, match="--cells"):
            convergence.parse_cells(text)


# -- work and precision ------------------------------------------------------------------------------------------------


BASE = {"pair": "P2-P1", "cells": 8, "scheme": "bdf2", "step": 0.1, "tolerance": None, "newton": 1e-9, "reason": None}


def test_sentences_about_settings():
    """Also where the scene's own are not among the cases, or fail; Newton's tolerance may be a hundredth."""
    row = BASE | {"own": False, "wall": 2.0, "error_tension_top": 4e-3, "max_error_tension_top": 4e-3}
    row |= {"bound_tension_top": 4e-3, "max_bound_tension_top": 4e-3, "resolved_tension_top": True}
    what = f"1 % in top tension: {work_precision.describe(row)}: 2 s"
    assert work_precision.sentence([row], "tension_top", 0.01) == f"{what}."
    failed = BASE | {"own": True, "reason": "no"}
    said = work_precision.sentence([row, failed], "tension_top", 0.01)
    assert said == f"{what}; the scene's own setting ({work_precision.describe(failed)}) fails."
    for newton, good in ((1e-4, True), (1.01e-4, False)):
        found = work_precision.cheapest([row | {"newton": newton}], "tension_top", 0.01)
        assert (found is not None) == good
    assert work_precision.cheapest([row], "tension_top", 4e-3) is row
    assert work_precision.cheapest([row | {"max_bound_tension_top": 0.02}], "tension_top", 0.01) is not None
    assert work_precision.cheapest([row | {"max_bound_tension_top": 0.02}], "tension_top", 0.01, largest=True) is None
    own = {"tension_top": Error(1e-5, 1e-5)}
    alone, shared = (work_precision.notes([row], own, BASE, *ranks) for ranks in ((), (2,)))
    assert shared == [*alone, "2 cases ran at once: their times share the machine, and are longer than alone."]
    assert work_precision.describe(BASE | {"cells": 0, "pair": "-"}) == "BDF2, dt 0.1 s"


def test_panels_of_three_quantities():
    """In two columns, of which the last panel is empty and shown none; labels below the last of each column."""
    names = ("tension_top", "tension_anchor", "cone_angle")
    row = BASE | {"own": True, "wall": 2.0}
    for name in names:
        row |= {f"bound_{name}": 4e-3, f"resolved_{name}": True}
    for count in (1, 2, 3):
        own = dict.fromkeys(names[:count], Error(1e-5, 1e-5))
        drawn = work_precision.draw([row], own)
        assert [axes.get_visible() for axes in drawn.axes] == [True] * count + [False] * (count == 3)
        labelled = [bool(axes.get_xlabel()) for axes in drawn.axes[:count]]
        assert labelled == {1: [True], 2: [True, True], 3: [False, True, True]}[count]
        assert drawn.get_size_inches()[1] == pytest.approx(2.6 * (2 if count == 3 else 1) + 0.8)


def test_the_reference_of_all_cases(tmp_path):
    """As many unknowns as the finest of them or more, a quarter of the least step; its check half as fine."""
    check, fine = work_precision.reference_cases(DRIVEN, [Space(1, 0, 10), Space(2, 1, 7)], [0.4, 0.2], tmp_path)
    assert (fine["pair"], fine["cells"], fine["step"], fine["scheme"]) == ("P3-P2", 8, 0.05, ALPHA)
    assert (check["pair"], check["cells"], check["step"]) == ("P3-P2", 4, 0.1)
    assert [case["file"].rpartition("/")[2].partition("-")[0] for case in (check, fine)] == ["check", "reference"]
    alone = work_precision.reference_cases(load_scene("free-buoy"), [Space()], [0.4], tmp_path)
    assert [(case["pair"], case["cells"], case["step"]) for case in alone] == [("-", 0, 0.2), ("-", 0, 0.1)]


def test_cases_come_once():
    own = (report.settings.space_of(DRIVEN), report.settings.stepping_of(DRIVEN))
    other = (Space(1, 0, 4), Stepping("bdf2", 0.1))
    found = work_precision.cases(DRIVEN, [other, own, other], {"file": "fine"}, 3)
    assert [(case["own"], case["cells"]) for case in found] == [(True, own[0].cells), (False, 4)]
    assert {(case["repeats"], case["reference"], case["study"]) for case in found} == {
        (3, "fine", "work-precision case")
    }
    once = {key: x for key, x in found[0].items() if key != "repeats"}
    assert work_precision.work(found[0]) == pytest.approx(3 * work_precision.work(once))
    assert work_precision.work(once) == work_precision.work(once | {"repeats": 1}) > 0


def test_a_linear_answer_needs_waves_and_water(monkeypatch):
    """And of what it knows something that varies; where it fails nothing is said."""
    t = np.arange(0.0, 8.0, 0.5)
    run = Run(t, {"tension_top": np.cos(t), "cone_angle": np.cos(t)}, 50.0)
    monkeypatch.setattr(linear_answer, "_deviation", lambda *_: 0.5)
    short = load_scene("short")
    kept = t >= 2.0
    off = abs(0.5 / np.std(np.cos(t[kept])) - 1)
    said = linear_answer.linear_answer(short, run, "tension_top", 2.0)
    assert f"{linear_answer.percent(off)} off; that run in time: 50 s." in said
    assert linear_answer.linear_answer(short, run, "cone_angle", 2.0) is None
    assert linear_answer.linear_answer(load_scene("short", waves=None), run, "tension_top", 2.0) is None
    assert linear_answer.linear_answer(DRIVEN, run, "tension_top", 2.0) is None
    still = Run(t, {"tension_top": np.ones(len(t))}, 50.0)
    assert linear_answer.linear_answer(short, still, "tension_top", 2.0) is None
    for raised in (SolveError, InputError):
        monkeypatch.setattr(linear_answer, "_deviation", lambda *_, raised=raised: (_ for _ in ()).throw(raised("no")))
        assert linear_answer.linear_answer(short, run, "tension_top", 2.0) is None
    monkeypatch.setattr(linear_answer, "_deviation", lambda *_: None)
    assert linear_answer.linear_answer(short, run, "tension_top", 2.0) is None


# -- the report --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("quick", "cells", "end", "plans"),
    [(False, (4, 8, 16, 32), 120.0, report.FULL), (True, (4, 8, 16), 12.0, report.QUICK)],
)
def test_what_a_whole_report_computes(quick, cells, end, plans, tmp_path, monkeypatch):
    """And a trial of it: elements of Fig. 2, the pendulum of the paper's run, plans of the scenes."""
    asked = []

    def static(study, folder, **how):
        asked.append(how)
        return SimpleNamespace(rows={})

    monkeypatch.setattr(report, "run_study", static)
    monkeypatch.setattr(report, "evaluate_all", lambda evaluate, cases, folder: asked.append((cases, folder.name)))
    monkeypatch.setattr(report, "examine", lambda name, plan, folder: asked.append((name, plan)))
    report.run(tmp_path / "new" / "folder", quick)
    how, (cases, name), *scenes = asked
    assert how == {"figures": (2,), "cells": cells}
    assert [(case["scheme"], case["step"], case["end"]) for case in cases] == [
        (scheme, 0.01, end) for scheme in ("backward-euler", "bdf2", ALPHA)
    ]
    assert (name, scenes) == ("pendulum", list(plans.items()))
    assert list((tmp_path / "new" / "folder").iterdir()) == []


def test_a_swing_of_the_pendulum(monkeypatch):
    """Angle and rate of its end, as amplitude over that of its start; theory to the number of steps."""
    left, phase, omega = 0.75, 0.4, 2 * math.pi / report.PERIOD
    angle, rate = (report.SWING * left * x for x in (math.cos(phase), -omega * math.sin(phase)))
    r, gone = 3.0, []
    place = np.array([r * math.sin(angle), 0.0, -r * math.cos(angle)])
    velocity = r * rate * np.array([math.cos(angle), 0.0, math.sin(angle)])
    lines = SimpleNamespace(top_dofs=lambda: np.arange(3))
    made_up = SimpleNamespace(run=lambda: iter(()), system=SimpleNamespace(u=place), line_velocity=velocity)
    made_up.problem = SimpleNamespace(lines=lines, destroy=lambda: gone.append(True))
    monkeypatch.setattr(report, "Simulation", lambda scene, comm: made_up)
    found = report.evaluate_pendulum({"scheme": "backward-euler", "step": 0.05, "end": 1.99})
    assert found["remaining"] == pytest.approx(left)
    exact = abs(make_scheme("backward-euler").amplification(omega, 0.05))
    assert exact == pytest.approx(1 / math.hypot(1, omega * 0.05))
    assert found["theory"] == pytest.approx(exact**40)
    assert gone == [True]


@pytest.mark.parametrize(("ratio", "word"), [(1.06, "dearer"), (1.05, "as dear"), (0.95, "as dear"), (0.94, "cheaper")])
def test_adaptive_steps_beside_fixed_ones(ratio, word):
    row = {"ratio": ratio, "tolerance": 1e-3, "error": 0.0123, "seconds": 12.34, "fixed_seconds": 0.0567}
    facts = {"scenes": [{"name": "short", "schemes": [], "pairs": [], "adaptive": [row]}]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_text, "default_scheme", lambda facts: None)
        said = report_text.recommendations(facts)
    assert said == [
        "No scheme is the cheapest in both scenes by a factor of two: the default stays as it is.",
        "`short`: adaptive BDF2 with tolerance 0.001 has 1.2 % in 12 s, a fixed step of the same error takes 0.057 s: "
        f"{word}.",
    ]


def test_the_cheapest_scheme_by_a_factor_of_two():
    def scene(name, seconds, euler=9.0):
        lines = [{"scheme": name, "name": name, "0.01": {"seconds": seconds, "size": 0.1, "per_period": 49.1}}]
        slow = euler and {"seconds": euler, "size": 0.01, "per_period": 500.0}
        return {"schemes": [*lines, {"scheme": "backward-euler", "name": "Euler", "0.01": slow}]}

    two = [scene("bdf2", 3.0), scene("bdf2", 4.5)]
    found = report_text.default_scheme({"scenes": two})
    assert found == {"scheme": "bdf2", "name": "bdf2", "per_period": 50, "ratios": [3.0, 2.0]}
    assert report_text.default_scheme({"scenes": [two[0], scene("bdf2", 4.51)]}) is None
    assert report_text.default_scheme({"scenes": [two[0], scene(ALPHA, 3.0)]}) is None
    assert report_text.default_scheme({"scenes": [scene("bdf2", 3.0, None)]})["ratios"] == [math.inf]
    none = {"schemes": [{"scheme": "bdf2", "name": "bdf2", "0.01": None}]}
    assert report_text.default_scheme({"scenes": [two[0], none]}) is None
