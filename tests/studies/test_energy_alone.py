"""Parts of the energy study: its scenes, its balance, and the release of its problems.

Source: made-up powers, and the same sums by hand; nothing is run.
"""

import math
from types import SimpleNamespace

import pytest

from dolfbuoy import load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.studies.physics import energy

GONE = []


def problem():
    return SimpleNamespace(destroy=lambda: GONE.append(True))


@pytest.mark.parametrize("fails", [False, True])
def test_a_balance(fails, monkeypatch):
    def balance(simulation, steps, name):
        if fails:
            raise SolveError("no")
        return {"steps": steps, "name": name}

    GONE.clear()
    scenes = []
    made = SimpleNamespace(problem=problem(), run=lambda: "its steps")
    monkeypatch.setattr(energy, "Simulation", lambda scene, comm: scenes.append(scene) or made)
    monkeypatch.setattr(energy, "balance", balance)
    case = {"scene": "driven", "t_end": 3.0, "step": 0.05, "scheme": "bdf2"}
    if fails:
        with pytest.raises(SolveError):
            energy.evaluate(case)
    else:
        assert energy.evaluate(case) == {"steps": "its steps", "name": "driven"}
    assert GONE == [True]
    assert (scenes[0].time.end, scenes[0].time.step, scenes[0].time.scheme) == (3.0, 0.05, "bdf2")


def test_a_balance_by_hand(monkeypatch):
    """Powers by the trapezoid over unequal steps; the drag drains whatever its sign, else kinetic energy swings."""
    t = [0.0, 1.0, 3.0]
    powers = {"kinetic": [0.0, 4.0, 1.0], "elastic": [1.0, 2.0, 5.0], "gravity": [3.0, 3.0, 2.0]}
    powers |= {"drag": [0.0, -2.0, 1.0], "top": [0.0, 6.0, 2.0]}
    for drag in (True, False):
        rows = [{name: x[k] * (drag or name != "drag") for name, x in powers.items()} for k in range(3)]
        left = iter(rows)
        monkeypatch.setattr(
            energy, "Meter", lambda simulation, left=left: SimpleNamespace(read=lambda: dict(next(left)))
        )
        now = SimpleNamespace(t=0.0)

        def steps(now=now):
            for instant in t[1:]:
                now.t = instant
                yield

        found = energy.balance(now, steps(), "made up")
        work = {"drag": (-1.0 - 1.0) * drag, "top": 3.0 + 8.0}
        stored = {"kinetic": 1.0, "elastic": 4.0, "gravity": -1.0}
        defect = 4.0 - sum(work.values())
        over = 1.0 + 3.0 if drag else 4.0 + 3.0
        assert found == pytest.approx({**work, **stored, "defect": defect, "relative": abs(defect) / over})


def test_scenes_whose_balance_is_exact():
    """One tension for each element of what stretches; no memory of fast motions where lines go slack."""
    found = energy.load("driven", 3.0, 0.05, "generalized-alpha")
    (piece,) = found.network.pieces
    assert (piece.section.position_degree, piece.section.tension_degree) == (1, 0)
    assert (found.time.end, found.time.step, found.time.scheme, found.time.spectral_radius) == (
        3.0,
        0.05,
        "generalized-alpha",
        load_scene("driven", time__scheme="generalized-alpha").time.spectral_radius,
    )
    slack = energy.load("driven-slack", 3.0, 0.05, "generalized-alpha")
    assert slack.time.spectral_radius == 0.0
    assert energy.load("driven-slack", 3.0, 0.05, "bdf2").time.scheme == "bdf2"
    rigid = load_scene("driven", cable__axial_stiffness=math.inf).to_dict()
    degrees = load_scene("driven").cables[0]
    kept = energy.load(rigid, 3.0, 0.05, "bdf2").cables[0]
    assert (kept.position_degree, kept.tension_degree) == (degrees.position_degree, degrees.tension_degree)


def test_runs_of_the_balance():
    found = energy.cases()
    assert {(row["scene"], row["t_end"]) for row in found} == {("driven", 60.0), ("short", 40.0)}
    assert len(found) == 2 * 3 * 3
    assert [(row["t_end"], row["step"]) for row in energy.cases("short", 5.0, [0.1])] == [(5.0, 0.1)] * 3
    assert energy._steps({"t_end": 60.0, "step": 0.04}) == 1500.0


def test_one_slack_line_of_several_forbids_memory():
    legs = load_scene("three-legs").to_dict()
    slack = load_scene(legs, **{"cable.east.slack": "tension-only"}).to_dict()
    assert energy.load(slack, 3.0, 0.05, "generalized-alpha").time.spectral_radius == 0.0
    assert energy.load(legs, 3.0, 0.05, "generalized-alpha").time.spectral_radius > 0.0
