"""Study step-cost: its parts add up, its counts equal those of the run, and refusals.

Source: counts from the run itself.
"""

import json
from types import SimpleNamespace

import pytest
from dynamics_helpers import MOORED, merged
from verification import step_cost

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.studies.study import run

SCENE = merged(MOORED, cable__elements=4, time={"end": 2.0, "step": 0.01})


@pytest.fixture(scope="module")
def rows():
    """The row with new Jacobians and the one with kept ones."""
    scene = load_scene(SCENE)
    return [step_cost.measure(scene, 60, keep, count=10) for keep in (False, True)]


def test_parts_add_up(rows):
    """The parts are a step, none that a clock has seen is less than nothing; Newton's method is less than a step."""
    clocked = set(step_cost.PARTS) - {"SNES and Python"}  # that is what a run took beyond its twin, noise of both in it
    for row in rows:
        assert row["total"] == pytest.approx(sum(row[name] for name in step_cost.PARTS))
        assert row["milliseconds per step"] == pytest.approx(1e-3 * row["total"] * row["iterations"])
        assert min(row[name] for name in clocked) > 0
        assert 0 < row["floor"] < row["total"]
        assert 0 < row["ratio"] < row["ratio of a step"]


def test_floor_calls_what_the_run_called(monkeypatch):
    """As often, the Jacobians spread over the iterations."""
    called = []
    loops = SimpleNamespace(add_residuals=lambda: called.append("R"), add_jacobians=lambda: called.append("J"))
    monkeypatch.setattr(
        step_cost, "direct_solver", lambda newton: (lambda: called.append("F"), lambda: called.append("S"))
    )
    step_cost.back_to_back(SimpleNamespace(system=loops))(6, 8, 2)
    assert "".join(called) == "SRSRJFSRRSRSRJFSRR"


def test_counts(rows):
    """Every iteration has its residual, and every solve one before the first; new Jacobians: one in every iteration."""
    new, kept = rows
    assert new["jacobians"] == new["iterations"]
    assert kept["jacobians"] < 0.7 * kept["iterations"]
    for row in rows:
        assert row["steps"] == 60
        assert row["residuals"] >= row["iterations"] + 1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"time": None}, "time: must be given"),
        ({"time__end": 0.5}, "at least 100 equal steps"),
        ({"time__tolerance": 1e-3}, "equal steps"),
    ],
)
def test_what_it_refuses(change, said, tmp_path):
    """Scenes without steps of one size to measure."""
    file = tmp_path / "scene.toml"
    load_scene(SCENE, **change).save(file)
    with pytest.raises(InputError, match=said):
        run(step_cost.study, tmp_path, scene=file, steps=60)


def test_command(tmp_path, capsys):
    """It prints the table and saves rows and figure."""
    file = tmp_path / "scene.toml"
    load_scene(SCENE).save(file)
    step_cost.main(str(file), steps=500, out=tmp_path / "out")
    assert "times its floor" in capsys.readouterr().out
    saved = json.loads((tmp_path / "out" / "step_cost_scene.json").read_text())
    assert [row["jacobian"] for row in saved["rows"]] == ["new", "kept"]
