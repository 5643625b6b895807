"""The report: cost of an accuracy for a family of cases, conclusions, the damped pendulum, and a small run.

Source: the damped pendulum in closed form, made-up tables.
"""

import json
import math
from dataclasses import replace

import pytest

from dolfbuoy.commands.main import app
from dolfbuoy.results import compare
from dolfbuoy.scene import settings
from dolfbuoy.scene.settings import Space
from dolfbuoy.studies.accuracy import report as study
from dolfbuoy.studies.accuracy import report_text as text


def family(order, constant, sizes=(0.1, 0.05, 0.025), work=0.2):
    """(size, error, seconds) of an exact power."""
    return [(h, constant * h**order, work / h) for h in sizes]


def test_what_an_accuracy_needs():
    """Powers are met exactly, between the measurements and beyond; where the coarsest is good enough it is taken."""
    points = family(2, 4.0)
    between, beyond = compare.reach(points, 0.01), compare.reach(points, 0.0001)
    assert (between["size"], between["seconds"]) == pytest.approx((0.05, 4.0))
    assert (beyond["size"], beyond["seconds"]) == pytest.approx((0.005, 40.0))
    assert (between["note"], beyond["note"]) == ("", "extrapolated")
    assert compare.reach(points, 0.5) == {"size": 0.1, "seconds": pytest.approx(2.0), "note": "at_most"}
    assert compare.reach(points[:1], 0.01) is None
    assert compare.reach(family(0, 0.1), 0.01) is None  # no order: nothing is promised


def judged(name, euler, second, period=5.0):
    """A scene with exact orders; seconds of the schemes in proportion to these factors."""
    points = {"backward-euler": family(1, 1.0, work=euler), "bdf2": family(2, 4.0, work=2 * second)}
    points["generalized-alpha"] = family(2, 1.0, work=second)
    rows = [
        {"pair": "P1-P0", "cells": 4, "scheme": scheme, "step": h, "tolerance": None, "own": False, "reason": None}
        | {"wall": seconds, "scheme_error_tension_top": error}
        for scheme, found in points.items()
        for h, error, seconds in found
    ]
    own = next(row for row in rows if (row["scheme"], row["step"]) == ("backward-euler", 0.05))
    rows = [row | {"own": row is own} for row in rows]
    scene = {"name": name, "rows": rows, "period": period, "adaptive": [], "pairs": []}
    return scene | {"schemes": text.schemes(rows, period)}


def test_schemes_and_the_default_follow_from_the_data():
    scene = judged("one", euler=0.2, second=0.2)
    by_name = {line["scheme"]: line for line in scene["schemes"]}
    assert [by_name[s]["order"] for s in settings.SCHEMES] == pytest.approx([1, 2, 2])
    assert by_name["backward-euler"]["at_paper_step"] == pytest.approx(0.05)
    assert by_name["backward-euler"]["0.001"]["seconds"] == pytest.approx(200.0)
    found = by_name["generalized-alpha"]["0.01"]
    assert (found["size"], found["seconds"], found["per_period"]) == pytest.approx((0.1, 2.0, 50.0))
    found = text.default_scheme({"scenes": [scene, judged("two", 0.2, 0.2, period=10.0)]})
    assert found["scheme"] == "generalized-alpha"
    assert found["per_period"] == 100
    assert found["ratios"] == pytest.approx([10, 10])


def test_no_default_without_evidence():
    """Where backward Euler is the cheapest, or another one is by less than a factor of two."""
    for euler in (0.01, 0.035):
        facts = {"scenes": [judged("one", 0.2, 0.2), judged("two", euler, 0.2)]}
        assert text.default_scheme(facts) is None
        assert any("stays as it is" in sentence for sentence in text.recommendations(facts))


@pytest.mark.parametrize(("scheme", "left"), [("backward-euler", 0.3899), ("bdf2", 0.9981), ("generalized-alpha", 1.0)])
def test_a_pendulum_is_damped_as_theory_says(scheme, left):
    """A rigid rod of 5 s after 24 s at dt = 0.05 s, whose exponent 2 pi^2 dt t/P^2 is that of the paper's run."""
    found = study.evaluate_pendulum({"scheme": scheme, "step": 0.05, "end": 24.0})
    assert found["remaining"] == pytest.approx(found["theory"], abs=2e-3)
    assert found["theory"] == pytest.approx(left, abs=5e-3)
    if scheme == "backward-euler":
        assert found["remaining"] == pytest.approx(math.exp(-2 * math.pi**2 * 0.05 * 24 / 25), abs=5e-3)


TINY = replace(
    study.QUICK["short"],
    end=1.0,
    reference=(Space(3, 2, 4), 0.05),
    mesh_step=0.05,
    euler=(0.2, 0.1),
    second=(0.2, 0.1),
    spaces={(1, 0): (5, 10)},
    space_step=0.1,
    mixed={},
    whole=(1.0, 0.1),
)


@pytest.mark.slow
def test_a_small_report(tmp_path, monkeypatch, capsys):
    """All files, numbers of the tables from the rows, and a second call that computes nothing."""
    monkeypatch.setattr(study, "QUICK", {"short": TINY})
    pendulum = [{"study": "pendulum", "scheme": s, "step": 0.1, "end": 2.0} for s in settings.SCHEMES]
    monkeypatch.setattr(study, "pendulum_cases", lambda quick: pendulum)
    study.run(tmp_path, quick=True)
    said = (tmp_path / "report.md").read_text()
    assert said in capsys.readouterr().out
    assert "not worth quoting" in said
    for name in ("work-precision-short", "schemes"):
        assert f"({name}.png)" in said
        assert all((tmp_path / f"{name}.{suffix}").stat().st_size > 500 for suffix in ("png", "svg", "json", "csv"))
    facts = json.loads((tmp_path / "report.json").read_text())
    (scene,) = facts["scenes"]
    own = [row for row in scene["rows"] if row["own"]]
    assert len(own) == 1
    assert f"{compare.percent(own[0]['bound_tension_top'])} in" in scene["sentences"][0]
    euler = {r["step"]: r["scheme_error_tension_top"] for r in scene["rows"] if r["scheme"] == "backward-euler"}
    assert euler[0.2] > euler[0.1] > euler[0.01] > 0
    assert scene["schemes"][0]["at_paper_step"] == pytest.approx(euler[0.01])
    for name in ("evaluate", "evaluate_reference"):
        monkeypatch.setattr(study.wp, name, None)
    monkeypatch.setattr(study, "evaluate_pendulum", None)
    study.run(tmp_path, quick=True)
    assert (tmp_path / "report.md").read_text() == said


def test_the_command_is_there():
    names = {command.name or command.callback.__name__ for command in app.registered_commands}
    assert "report" in names


def test_plans_name_what_they_compare():
    """Every plan refines: the truth of the schemes is finer than all steps compared with it."""
    for plan in (*study.FULL.values(), *study.QUICK.values()):
        assert plan.mesh_step < min(plan.second)
        assert plan.reference[1] <= min(plan.mixed_steps)
        assert plan.repeats == (3 if plan in study.FULL.values() else 1)
