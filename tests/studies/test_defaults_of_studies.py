"""Studies called from Python without options, and the arguments made from their command lines.

Source: the defaults of the commands, by hand; nothing is computed.
"""

import inspect
from types import SimpleNamespace

import pytest
from made_up import SCENE

from dolfbuoy import InputError, load_scene
from dolfbuoy.scene.settings import Stepping
from dolfbuoy.studies import hard_cases
from dolfbuoy.studies.accuracy import advise, bent, convergence, inf_sup, report, work_precision
from dolfbuoy.studies.physics import effects, energy, hull

DRIVEN = load_scene("driven")
#: An error of two tables of bent lines.
TESTED = {"cantilever": "tip", "beam": "frequency"}


@pytest.fixture
def cases(monkeypatch):
    """Cases of each call of `evaluate_all`."""
    found = []
    for module in (convergence, inf_sup, effects, energy, hull, hard_cases, work_precision):
        monkeypatch.setattr(module, "evaluate_all", lambda evaluate, cases, *_: found.append(cases))
    return found


def test_cases_without_options(cases, tmp_path, monkeypatch):
    convergence.study(tmp_path)
    assert cases.pop() == convergence.cases((2, 3, 4), (2, 4, 8, 16, 32, 64))
    inf_sup.study(tmp_path)
    assert len(cases.pop()) == 3 * 18 * 5
    energy.study(tmp_path)
    assert len(cases.pop()) == 18
    hull.study(tmp_path, load_scene("free-buoy"), [4.0])
    assert {case["direction"] for case in cases[-1]} == {0.0}
    assert [case["part"] for case in cases.pop()] == ["hydrostatics", "response", "run"]
    asked = []
    monkeypatch.setattr(hard_cases, "cases", lambda *given: asked.append(given) or [])
    hard_cases.study(tmp_path)
    assert asked == [(None, False)]
    monkeypatch.setattr(effects, "compute", lambda *given: asked.append(given[1:]))
    effects.study(tmp_path, SCENE)
    assert asked[1:] == [(SCENE, 0.01)]


def test_work_and_precision_without_options(cases, tmp_path, monkeypatch):
    """All pairs, schemes and steps, fixed ones, three times each."""
    work_precision.study(tmp_path, DRIVEN)
    references, chosen = cases
    assert [case["study"] for case in references] == ["work-precision reference"] * 2
    assert {case["repeats"] for case in chosen} == {3}
    assert {case["tolerance"] for case in chosen} == {None}
    assert {case["newton"] for case in chosen} == {1e-9}
    cells = DRIVEN.cables[0].elements
    pairs = {(case["pair"], case["cells"]) for case in chosen}
    assert pairs == {(f"P{mu}-P{mu - 1}", n) for mu in (1, 2, 3) for n in (cells // 4, cells // 2, cells)}
    assert len({(case["scheme"], case["step"]) for case in chosen[1:]}) == 12
    monkeypatch.setattr(work_precision.acc, "quantities_of", lambda scene: [])
    with pytest.raises(InputError, match="has none of the quantities"):
        work_precision.study(tmp_path, DRIVEN)


def test_steppings_without_options():
    assert work_precision.steppings(["bdf2"], [0.1, 0.2], [1e-3]) == [
        Stepping("bdf2", 0.1),
        Stepping("bdf2", 0.2),
        Stepping("bdf2", 0.1, 1e-3),
    ]
    assert work_precision.steppings(["backward-euler"], [0.1], [1e-3]) == [Stepping("backward-euler", 0.1)]


def test_advice_is_tried_three_times(monkeypatch):
    """After errors in time, in space and of Newton's method are known, each with a sentence."""
    told, done = [], []

    class Pilot:
        def __init__(self, scene, quantity, accuracy, say):
            self.scene, self.start = load_scene(DRIVEN, time__end=7.0), 2.5
            self.mesh, self.step, self.newton, self.of_newton = advise.settings.Space(2, 1, 8), 0.1234567, 1e-5, 2e-4
            self.work_of_newton = 0.456
            curve = SimpleNamespace(order=1.987, x=[1, 2])
            self.time_curves = {("bdf2", False): curve, ("bdf2", True): SimpleNamespace(order=0.0, x=[1])}
            self.space_curves = {(2, 1): curve}

        def __getattr__(self, name):
            return lambda: done.append(name)

    monkeypatch.setattr(advise, "Pilot", Pilot)
    monkeypatch.setattr(advise, "verified", lambda pilot, tries: tries)
    assert advise.advise(DRIVEN, "tension_top", 0.01, told.append) == 3
    assert done == ["measure_time", "measure_space", "measure_newton"]
    assert told == [
        "Pilot until t = 7 s of 60 s; errors count from 2.5 s.",
        "Errors in time: P2-P1, 8 elements, BDF2 order 2.",
        "Errors in space: dt 0.1235 s, P2-P1 order 2.",
        "Newton's tolerance 1e-05: error 0.02 %, 0.46 of the work with 1e-09.",
    ]
    with pytest.raises(InputError, match="cone_angle"):
        advise.advise(DRIVEN, "cone_angle", 0.01, told.append)


def test_sizes_of_bent_lines():
    """Every pair on every number of elements, by each of the three problems; no orders of what is rounding."""
    asked = []

    def error(name, keys):
        def evaluate(mu, cells):
            asked.append((name, mu, cells))
            return {"h": 1 / cells} | dict.fromkeys(keys, 3e-8 / cells ** (2 * mu))

        return evaluate

    tables = {name: (error(name, keys), title, keys) for name, (_, title, keys) in bent.TABLES.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bent, "TABLES", tables)
        found = {table.name: table for table in bent.study(None, (4, 8))}
    assert asked == [(name, mu, n) for name in ("cantilever", "clamped", "beam") for mu in (1, 2, 3, 4) for n in (4, 8)]
    orders = {name: [row[f"order_{key}"] for row in found[name].rows] for name, key in TESTED.items()}
    assert orders["cantilever"] == [None, pytest.approx(2.0), None, pytest.approx(4.0), *[None] * 4]
    assert orders["beam"] == [None, pytest.approx(2.0), *[None] * 6]
    assert found["clamped"].title.endswith("order 2 mu is expected")


def test_a_report_without_options():
    assert inspect.signature(report.run).parameters["quick"].default is False
    assert inspect.signature(bent.study).parameters["cells"].default == (4, 8, 16, 32, 64)


def test_what_can_be_left_out_and_what_goes_with_it():
    """Cases of effects: each left out of the whole, each alone beside the barest scene, with the files of both."""
    bases = [{"base": "full", "file": "a"}, {"base": "barest", "file": "b"}]
    names = effects.effects_of(SCENE)
    found = effects.cases(SCENE, bases)
    assert [(case["mode"], case["effect"], case["base"]) for case in found] == [
        *(("without", name, "full") for name in names),
        *(("alone", name, "barest") for name in names),
    ]
    assert found[0]["choice"] == {"left_out": [names[0]]}
    assert found[-1]["choice"] == {"only": [names[-1]]}
    assert all(case["files"] == {"full": "a", "barest": "b"} and case["study"] == "effects" for case in found)
    assert effects.BASES == {"full": {}, "barest": {"only": []}}
    assert effects.effects_of(effects.variant(SCENE, only=[])) == []
    assert effects.variant(SCENE) == SCENE


def test_a_case_of_effects(monkeypatch, tmp_path):
    """Changes against its base, in units of the whole; a base that does not run, a scene that is none: the reason."""
    errors = SimpleNamespace(rms=0.1, maximum=0.2)
    asked = []

    class Reference:
        def __init__(self, run, start, whole=None):
            self.start = start
            asked.append((run, start, whole))

        def error(self, run, name):
            return errors

    run = SimpleNamespace(save=lambda file: asked.append(file))
    monkeypatch.setattr(effects.compare, "Reference", Reference)
    monkeypatch.setattr(effects.acc.Run, "kept", lambda file: f"run in {file}")
    monkeypatch.setattr(effects.acc, "compute", lambda scene, names: asked.append(scene) or run)
    monkeypatch.setattr(effects, "side_by_side", lambda base, changed: {"pair": (base, changed)})
    for name in ("full", "barest"):
        (tmp_path / name).touch()
    files = {name: str(tmp_path / name) for name in ("full", "barest")}
    base = effects._case(SCENE, {}, "base", "full", {}, "full") | {"file": "kept"}
    assert effects.evaluate(base) == {"reason": None}
    assert asked == [SCENE, "kept"]
    names = effects.acc.quantities_of(SCENE)
    changes = {f"{kind}change_{name}": x for kind, x in (("", 0.1), ("max_", 0.2)) for name in names}
    start = effects.acc.window_start(SCENE)
    for mode, choice, kind in (("without", {"left_out": ["waves"]}, "full"), ("alone", {"only": ["waves"]}, "barest")):
        asked.clear()
        found = effects.evaluate(effects._case(SCENE, files, mode, "waves", choice, kind))
        changed = effects.variant(SCENE, **choice)
        whole = SCENE if kind == "full" else effects.variant(SCENE, only=[])
        assert found == {"reason": None, "pair": (whole, changed)} | changes
        assert asked[0] == changed
        assert asked[1] == (f"run in {files['full']}", start, None)
        if kind == "barest":
            assert (asked[2][:2], asked[2][2].start) == ((f"run in {files['barest']}", start), start)
    (tmp_path / "full").unlink()
    found = effects.evaluate(effects._case(SCENE, files, "without", "waves", {"left_out": ["waves"]}, "full"))
    assert found == {"reason": "the full scene, to compare with, does not run"}
