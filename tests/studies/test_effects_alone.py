"""Parts of the studies of effects and of energy, and of the comparison with MoorDyn, each alone.

Source: costs, powers and records that are made up, and the same numbers by hand; no run is made.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_up import RECORD, SCENE

from dolfbuoy import InputError, load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.model.rigid import mass_properties
from dolfbuoy.studies import peer
from dolfbuoy.studies.physics import effects, energy

FREE = load_scene("free-buoy")

# -- effects -----------------------------------------------------------------------------------------------------------


def test_steps_of_two_scenes_are_timed_in_turn(monkeypatch):
    """Neither is always the first; medians; both are given back, also where one cannot be made."""
    taken, gone = [], []

    class Sim:
        def __init__(self, scene, comm):
            if scene == "bad":
                raise SolveError("no")
            self.name = scene
            system = SimpleNamespace(unknowns=10 * len(scene), residuals=[1] * len(scene), jacobians=[1])
            self.problem = SimpleNamespace(
                system=system, destroy=lambda: gone.append(scene), residuals=lambda: [(0, scene), (1, scene)]
            )

        def run(self):
            for k in range(3 if self.name == "ab" else 99):
                taken.append(self.name)
                now[0] += (1.0 + k) * len(self.name)
                yield k

    now = [0.0]
    monkeypatch.setattr(effects, "Simulation", Sim)
    monkeypatch.setattr(effects, "operations", lambda form: 7 * len(form))
    monkeypatch.setattr(effects, "clock", SimpleNamespace(process_time=lambda: now[0]))
    monkeypatch.setattr(effects, "TIMED", 5)
    found = effects.side_by_side("ab", "c")
    assert taken == ["ab", "c", "c", "ab", "ab", "c", "c", "c"]
    assert (found["base_step_time"], found["step_time"], found["time_ratio"]) == (4.0, 3.0, 0.75)
    assert (found["base_unknowns"], found["unknowns"]) == (20, 10)
    assert (found["base_operations"], found["operations"], found["base_forms"], found["forms"]) == (28, 14, 3, 2)
    assert gone == ["ab", "c"]
    with pytest.raises(SolveError):
        effects.side_by_side("ab", "bad")
    assert gone == ["ab", "c", "ab"]


def test_components_that_are_in_vain(monkeypatch, tmp_path):
    """Costs of a sea of as few as its crests need, and what is said of it; none where the scene has no more."""
    asked, costs = [], {"time_ratio": 0.5}
    monkeypatch.setattr(effects, "side_by_side", lambda *both: asked.extend(x.waves.components for x in both) or costs)
    storm = load_scene("storm")
    case = {"scene": storm.to_dict(), "components": 12}
    assert effects.evaluate(case) == costs
    assert asked == [storm.waves.components, 12]
    for needed, count in ((storm.waves.components - 1, 1), (storm.waves.components, 0), (0, 0)):
        seen = []
        monkeypatch.setattr(effects, "evaluate_all", lambda evaluate, cases, *_, seen=seen: seen.append(cases) or [])
        monkeypatch.setattr(effects.sea, "components_for", lambda scene, threshold, needed=needed: needed)
        monkeypatch.setattr(effects, "judge", lambda *_: (["waves"], ["one"]))
        assert effects.compute(tmp_path, storm, 0.01) == []
        assert (len(seen), [one["components"] for one in seen[-1]]) == (3, [needed] * count)
        monkeypatch.setattr(effects, "judge", lambda *_: ([], ["one", "two"]))
        effects.compute(tmp_path, storm, 0.01)
        (together,) = seen[-2]
        assert (together["mode"], together["choice"], together["base"]) == (
            "together",
            {"left_out": ["one", "two"]},
            "full",
        )


# -- energy ------------------------------------------------------------------------------------------------------------


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


# -- beside MoorDyn ----------------------------------------------------------------------------------------------------


def test_motions_beside_moordyn():
    """Of the keel, which turns about C; of each line its ends."""
    found = peer._ours(RECORD.assign(end_tension=(("time", "cable", "xyz"), RECORD.anchor_force.values * 2)), SCENE)
    force = np.linalg.norm(RECORD.anchor_force.values[:, 0], axis=1)
    np.testing.assert_allclose(found["cable: tension_top"], 2 * force)
    np.testing.assert_allclose(found["cable: tension_anchor"], force)
    name, buoy = next(iter(SCENE.network.buoys.items()))
    q = RECORD.buoy_orientation.values[7, 0]
    height = mass_properties(buoy).height
    lean = np.array([2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]), 1 - 2 * (q[1] ** 2 + q[2] ** 2)])
    keel = RECORD.buoy_position.values[7, 0] - height * lean
    np.testing.assert_allclose([found[f"{name}: keel {axis}"][7] for axis in "xyz"], keel)
    assert len(peer._ours(RECORD.drop_vars("buoy_position").assign(end_tension=RECORD.anchor_force), SCENE)) == 2
    series = SimpleNamespace(tension=np.arange(12.0).reshape(2, 3, 2), body=np.arange(6.0).reshape(2, 1, 3))
    theirs = peer._named(series, SCENE)
    assert [theirs[f"{name}: keel {axis}"].tolist() for axis in "xyz"] == [[0, 3], [1, 4], [2, 5]]
    assert (theirs["cable: tension_top"].tolist(), theirs["cable: tension_anchor"].tolist()) == ([1, 7], [0, 6])


def test_moordyn_is_tried_with_half_the_step(monkeypatch):
    """Four times; then it is said to diverge."""
    asked = []
    monkeypatch.setattr(peer, "moordyn_module", lambda: None)
    monkeypatch.setattr(peer, "simulate", lambda scene, **_: asked.append(scene.time.end) or RECORD)
    monkeypatch.setattr(peer, "start_of", lambda record: record.time.item())
    monkeypatch.setattr(
        peer,
        "export",
        lambda scene, start, how: (
            asked.append((start, how.step, how.segments)) or SimpleNamespace(step=how.step or 0.008)
        ),
    )
    monkeypatch.setattr(peer, "run", lambda written, end: asked.append(end))
    with pytest.raises(SolveError, match=r"^MoorDyn diverges, with steps of 0\.001 s too\.$"):
        peer.compare(SCENE, 9.0)
    assert asked == [9.0, (0.0, None, 1), 9.0, (0.0, 0.004, 1), 9.0, (0.0, 0.002, 1), 9.0, (0.0, 0.001, 1), 9.0]
    with pytest.raises(InputError, match="needs a scene with a cable"):
        peer.compare(FREE)


def test_the_start_beside_moordyn(monkeypatch):
    """At rest, of a scene that has no time too."""
    asked = []
    monkeypatch.setattr(peer, "simulate", lambda scene, **how: asked.append(how) or RECORD)
    monkeypatch.setattr(peer, "start_of", lambda record: float(record.time))
    assert [peer.beginning(scene) for scene in (SCENE, load_scene(SCENE, time=None))] == [0.0, 0.0]
    assert asked == [{"time.end": 0.0}, {"time.end": 0.0, "time.step": 1.0}]


def test_curves_beside_moordyn(monkeypatch, tmp_path):
    """Twelve at most, none of anchors; a unit above and below what is constant; of MoorDyn the second half."""
    t = np.linspace(0.0, 10.0, 11)
    names = ["a: tension_top", "a: tension_anchor", *(f"b{k}: keel x" for k in range(13))]
    ours = {name: np.full(11, 5000.0 if "tension" in name else 2.0) for name in names}
    theirs = ours | {"b0: keel x": np.where(t < 5.0, 99.0, 4.0)}
    kept = []
    monkeypatch.setattr(peer, "save", lambda figure, path: kept.append((figure, path)))
    found = peer.Comparison([{"quantity": name} for name in names], [], (t, ours), (t, theirs))
    peer.draw(found, tmp_path)
    ((figure, path),) = kept
    assert (path, len(figure.axes)) == (tmp_path / "comparison", 12)
    assert figure.axes[0].get_ylim() == (4.0, 6.0)
    assert figure.axes[1].get_ylim() == pytest.approx((1.88, 4.12))
    assert [axes.get_ylabel().splitlines()[-1] for axes in figure.axes[:2]] == ["[kN]", "[m]"]
    assert [line.get_linestyle() for line in figure.axes[1].lines] == ["-", "--"]
    assert figure.get_size_inches()[1] == pytest.approx(1.2 + 12 * 1.1)
