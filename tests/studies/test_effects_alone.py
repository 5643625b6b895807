"""Parts of the study of effects and the comparison with MoorDyn, each alone.

Source: made-up costs, rows and records, and the same numbers by hand; nothing is run.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from made_up import RECORD, SCENE

from dolfbuoy import InputError, load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.model.rigid import mass_properties
from dolfbuoy.studies import peer
from dolfbuoy.studies.physics import effects

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


def test_what_is_said_of_a_sea(monkeypatch, tmp_path):
    """How many components are enough, and what a step takes with them."""
    storm = load_scene("storm")
    monkeypatch.setattr(effects, "compute", lambda *_: [{"mode": "components", "components": 12, "time_ratio": 0.4567}])
    monkeypatch.setattr(effects, "notes", lambda *_: ["first"])
    monkeypatch.setattr(effects, "questions", lambda *_: [effects.Table("", [], "one"), effects.Table("", [], "two")])
    monkeypatch.setattr(effects, "draw", lambda *_: None)
    whole, first, last = effects.study(tmp_path, storm, 0.02)
    assert (whole.name, first.title) == (
        "effects",
        f"Effects of the scene until t = {storm.time.end:g} s; {{folder}}\none",
    )
    assert last.notes[0] == "first"
    assert last.notes[1] == effects.sea.of_components(storm, 0.02) + "  With 12 a step takes 46 % of its time."
    assert last.notes[2] == effects.sea.of_statistics(storm)


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
