"""A case of a sweep, the plan of all cases, and the study runner, each alone: results kept, skipped, refused, written.

Source: made-up runs, recorders and clocks, and the same numbers by hand.
"""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from chains import CHAIN
from made_up import RECORD, SCENE

from dolfbuoy import InputError, load_scene
from dolfbuoy.accuracy.bars import RESOLVED, Bar
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.errors import NoResult, SolveError
from dolfbuoy.parallel import interruption
from dolfbuoy.parallel.cases import key
from dolfbuoy.results import checkpoint
from dolfbuoy.results.style import new_figure
from dolfbuoy.studies import hard_cases, one_case, peer, study, sweep
from dolfbuoy.studies.accuracy import convergence, inf_sup, report, work_precision
from dolfbuoy.studies.physics import effects, energy, hull
from dolfbuoy.studies.study import Table

CASE = {"base": "a scene", "changes": {"time.end": 3.0}}

# -- one case ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def loop(monkeypatch):
    """Runs of three steps of which as many fail; what their recorders and pools do is told."""
    told = SimpleNamespace(failed=0, does=[], steps=3, stops=None, unsound=None, begun=[])

    class Sim:
        def __init__(self, scene, comm, state, pool):
            assert pool is one_case.POOL
            assert comm.size == 1
            told.begun.append(state)
            self.t, self.control = 0.0, SimpleNamespace(failed=0)

        def run(self):
            for k in range(told.steps):
                self.t, self.control.failed = 0.12345 * (k + 1), told.failed
                if told.stops is not None:
                    told.stops(k)
                yield 0.1, k

    class Rec:
        def __init__(self, simulation, folder, point):
            told.does.append(("folder", folder and folder.name))

        def add(self, step, iterations):
            told.does.append((step, iterations))

        def save(self):
            told.does.append("saved")

        def finished(self, keep):
            told.does.append(("finished", keep))
            return xr.Dataset()

    ticks = iter(range(99))
    clock = SimpleNamespace(time=lambda: told.now, process_time=lambda: 2.5 * next(ticks))
    told.now = 100.0
    monkeypatch.setattr(one_case, "clock", clock)
    monkeypatch.setattr(one_case, "Simulation", Sim)
    monkeypatch.setattr(one_case, "_CaseRecorder", Rec)
    monkeypatch.setattr(one_case, "POOL", SimpleNamespace(clear=lambda: told.does.append("cleared")))
    monkeypatch.setattr(one_case.cautions, "refused", lambda record, scene: told.unsound)
    monkeypatch.setattr(interruption, "_received", False)
    return told


def test_a_case_that_runs_to_its_end(loop, tmp_path):
    """Every step is recorded; the loop alone counts; the folder stays where it is kept."""
    for keep in (False, True):
        place = tmp_path / str(keep)
        place.mkdir()
        (place / checkpoint.NAME).mkdir()
        found = one_case.run(SCENE, place, keep=keep)
        assert found.attrs == {"loop_seconds": 2.5}
        assert loop.does[-4:] == [(0.1, 0), (0.1, 1), (0.1, 2), ("finished", keep)]
        assert not place.exists()  # what was there is none of it
    assert loop.begun == [None, None]
    one_case._remove(None)


def test_a_case_whose_folder_is_kept(loop, tmp_path, monkeypatch):
    monkeypatch.setattr(one_case._CaseRecorder, "finished", lambda self, keep: (tmp_path / "a").mkdir() or xr.Dataset())
    one_case.run(SCENE, tmp_path / "a", keep=True)
    assert (tmp_path / "a").is_dir()
    (tmp_path / "a").rmdir()
    one_case.run(SCENE, tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_a_case_goes_on_from_its_checkpoint(loop, tmp_path, monkeypatch):
    """Of one rank, in its folder; one that cannot be read is none."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / checkpoint.NAME).touch()
    asked = []
    point = SimpleNamespace(scene="its scene", states=["first", "second"])
    monkeypatch.setattr(one_case.checkpoint, "load", lambda folder, ranks: asked.append((folder.name, ranks)) or point)
    monkeypatch.setattr(one_case.folders, "go_on", lambda folder, scene: asked.append((folder.name, scene)))
    one_case.run(SCENE, tmp_path / "a", keep=True)
    assert asked == [("a", 1), ("a", "its scene")]
    assert loop.begun == ["first"]
    assert (tmp_path / "a").is_dir()

    def refuses(folder, scene):
        raise InputError("edited")

    monkeypatch.setattr(one_case.folders, "go_on", refuses)
    one_case.run(SCENE, tmp_path / "a", keep=True)
    assert loop.begun == ["first", None]
    assert not (tmp_path / "a").exists()


def test_a_case_that_fails_too_often(loop, tmp_path):
    """More often than it may; its problem is as good as new, its folder goes."""
    (tmp_path / "a").mkdir()
    loop.failed = 2
    one_case.run(SCENE, most=2.0)
    with pytest.raises(NoResult, match=r"^2 steps failed until t = 0\.123 s\.$"):
        one_case.run(SCENE, tmp_path / "a", most=1.9)
    assert "cleared" not in loop.does
    assert not (tmp_path / "a").exists()
    loop.unsound = NoResult("unsound")
    with pytest.raises(NoResult, match="unsound"):
        one_case.run(SCENE)


@pytest.mark.parametrize(
    ("how", "kind", "does", "stays"),
    [
        ("breaks", ValueError, ["cleared"], False),
        ("interrupted", KeyboardInterrupt, ["saved", "cleared"], True),
        ("late", interruption.TimeUp, ["saved"], True),
    ],
)
def test_a_case_that_is_left(how, kind, does, stays, loop, tmp_path, monkeypatch):
    """After a step, with a checkpoint if it is to go on; another error leaves nothing that is used again."""

    def stops(k):
        if k == 1 and how == "breaks":
            raise ValueError("odd")
        if k == 1:
            loop.now += how == "late"
            monkeypatch.setattr(interruption, "_received", how == "interrupted")

    def begins(self, *_):
        (tmp_path / "a").mkdir()

    monkeypatch.setattr(one_case._CaseRecorder, "__init__", begins)
    loop.stops = stops
    with pytest.raises(kind) as error:
        one_case.run(SCENE, tmp_path / "a", deadline=100.5)
    assert type(error.value) is kind
    assert [one for one in loop.does if isinstance(one, str)] == does
    assert (tmp_path / "a").exists() is stays
    assert loop.does.count((0.1, 1)) == (how != "breaks")


def test_no_case_begins_after_the_deadline(loop):
    one_case.run(SCENE, deadline=100.0)
    assert len(loop.begun) == 1
    with pytest.raises(interruption.TimeUp):
        one_case.run(SCENE, deadline=99.9)
    assert len(loop.begun) == 1


def test_what_is_kept_of_a_case(monkeypatch, tmp_path):
    """Numbers over the whole run, a sample after the ramp, bars where they are asked for, how much was cut."""
    asked = []

    def run(scene, folder, deadline, keep=False):
        asked.append((scene.time.end, folder and folder.name, deadline, keep))
        return RECORD.assign_attrs(failed_steps=0)

    bars = {Output("tension_top", "max", "cable"): Bar(1.0, 0.25, RESOLVED)}
    monkeypatch.setattr(one_case, "run", run)
    monkeypatch.setattr(one_case, "clock", SimpleNamespace(monotonic=iter((10.0, 13.5)).__next__))
    monkeypatch.setattr(one_case, "now", lambda: "today")
    monkeypatch.setattr(one_case.cautions, "cut", lambda record, scene: 0.125)
    monkeypatch.setattr(one_case, "lives", lambda sample: {"tension_top of cable": 33.0, "new": 4.0})
    whole = one_case.sample_of
    monkeypatch.setattr(one_case, "sample_of", lambda *given, bins: asked.append(bins) or whole(*given, bins=bins))
    monkeypatch.setattr(one_case, "bars_of", lambda record, scene, other: (bars, [str(type(other).__name__)]))
    base = load_scene(SCENE, accuracy={"estimate": "companion"})
    found = one_case.evaluate(CASE, base, str(tmp_path), 77.0)
    assert asked == [(3.0, key(CASE), 77.0, False), 64, (3.0, None, 77.0, False)]
    top = RECORD.tension_top.values
    numbers = found["statistics"]["tension_top of cable"]
    assert (numbers["maximum"], numbers["life"]) == (pytest.approx(top.max()), 33.0)
    assert numbers["maximum_bar"] == 0.25
    assert found["statistics"]["new"] == {"life": 4.0}
    assert found["sample"]["series"]["tension_top of cable"]["maximum"] == pytest.approx(top.max())
    kept = {name: found[name] for name in ("status", "cut", "changes", "base", "seconds", "created")}
    assert kept == CASE | {"status": "done", "cut": 0.125, "seconds": 3.5, "created": "today"}
    monkeypatch.setattr(one_case, "clock", SimpleNamespace(monotonic=iter((0.0, 1.0)).__next__))
    plain = one_case.evaluate(CASE, load_scene(SCENE, accuracy={"estimate": "none"}), None)
    assert asked[3:] == [(3.0, None, math.inf, False), 64]
    assert "maximum_bar" not in plain["statistics"]["tension_top of cable"]


def test_a_case_that_fails_is_a_result(monkeypatch, tmp_path):
    """With its reason; interruptions are none."""

    def run(*_):
        raise SolveError("it sank.")

    monkeypatch.setattr(one_case, "run", run)
    found = one_case.evaluate(CASE, SCENE)
    assert (found["status"], found["statistics"], found["sample"]) == ("SolveError: it sank.", {}, None)
    assert {name: found[name] for name in CASE} == CASE


def test_a_case_is_put_in_its_place(monkeypatch, tmp_path):
    """All of its folder, once it is finished, with its page and a remark."""
    told, folder = [], tmp_path / "running" / "x"
    folder.mkdir(parents=True)
    (folder / "results.nc").write_text("new")
    (tmp_path / "records" / "x").mkdir(parents=True)
    (tmp_path / "records" / "x" / "results.nc").write_text("old")
    monkeypatch.setattr(one_case.folders, "finish", lambda *given: told.append(("finish", *given)))
    monkeypatch.setattr(one_case.folders, "remark", lambda *given, **more: told.append(("remark", *given, more)))
    monkeypatch.setattr(one_case, "write_pages", lambda *given: told.append(("pages", *given)))
    one_case._keep(folder, tmp_path / "records" / "x", {"time.end": 3.0})
    assert told == [
        ("finish", folder, "run"),
        ("remark", folder, "run", {"case": "time.end = 3.0"}),
        ("pages", folder, "results.nc"),
    ]
    assert (tmp_path / "records" / "x" / "results.nc").read_text() == "new"
    assert not folder.exists()


# -- sweeps ------------------------------------------------------------------------------------------------------------


def test_what_a_sweep_computes_with(monkeypatch, tmp_path):
    """Its own folder, a deadline by the clock, records where they are kept, and what is run once more."""
    asked = []
    monkeypatch.setattr(sweep, "compute", lambda how, cases, folder, **options: asked.append((how, cases, options)))
    monkeypatch.setattr(sweep, "clock", SimpleNamespace(time=lambda: 1000.0))
    plan = sweep.plan(CHAIN, ["cable.length=9,10,11"], None)
    results = [{"status": "failed"}, {"status": "done"} | plan.cases[0], {"status": "done"} | plan.cases[1]]
    place = tmp_path / sweep._record_of(tmp_path, plan.cases[1])
    assert place == tmp_path
    (tmp_path / "records" / key(plan.cases[1])).mkdir(parents=True)
    (tmp_path / "records" / key(plan.cases[1]) / "page.html").touch()
    again = {}
    for retry, keep, limit in ((False, False, None), (True, False, None), (False, True, 30.0), (True, True, 30.0)):
        sweep._compute(plan, sweep.Part(2, 3), tmp_path, print, retry=retry, keep=keep, limit=limit)
        how, cases, options = asked[-1]
        assert cases == plan.cases[1::3]
        given = {"running": str(tmp_path / "cases" / "running"), "keep": str(tmp_path / "records") if keep else None}
        assert how.keywords == {"base": plan.base, "deadline": math.inf if limit is None else 1030.0} | given
        assert (options["part"], options["failed"], options["executor"]) == ("part-2-of-3", one_case.failed, None)
        assert options["say"] is print
        again[retry, keep] = options["again"] and [options["again"](one) for one in results]
        assert options["work"](plan.cases[0]) > 0
    assert again == {
        (False, False): None,
        (True, False): [True, False, False],
        (False, True): [False, True, False],
        (True, True): [True, True, False],
    }
    sweep._compute(plan, None, tmp_path, print)
    how, cases, options = asked[-1]
    assert (cases, options["part"], options["again"], how.keywords["keep"]) == (plan.cases, "", None, None)


def test_cases_that_are_looked_at(monkeypatch):
    """Evenly spaced, and those with the smallest and the largest of each number."""
    assert len(sweep._looked_at([{"b": "word"}] * 5000)) == 50
    monkeypatch.setattr(sweep, "LOOKED_AT", 4)
    numbers = [5, 1, 7, 2, 9, 3, 8, 0, 4, 6, 5, 5]
    changes = [{"a": x, "b": "word"} | ({"c": -x} if x == 2 else {}) for x in numbers]
    assert sweep._looked_at(changes) == {0, 3, 6, 9} | {7, 4} | {3}
    assert sweep._looked_at(changes[:3]) == {0, 1, 2}
    assert sweep._looked_at([{"b": "word"}] * 9) == {0, 2, 4, 6, 8}
    assert sweep._looked_at([{"b": "word"}] * 3) == {0, 1, 2}


def test_a_sweep_that_kept_no_records_looks_for_none(monkeypatch, tmp_path):
    """It may have a hundred thousand cases."""
    plan, written = sweep.plan(CHAIN, ["cable.length=9,10"], None), []
    monkeypatch.setattr(sweep, "_record_of", lambda folder, case: written.append(case) or "records/x")
    for name in ("draw", "write_pages"):
        monkeypatch.setattr(sweep, name, lambda *_: None)
    monkeypatch.setattr(sweep, "style", SimpleNamespace(save=lambda *_: None))
    assert "record" not in sweep._written(plan, tmp_path)
    assert not written
    (tmp_path / "records").mkdir()
    assert sweep._written(plan, tmp_path).record.values.tolist() == ["records/x"] * 2
    assert written == plan.cases


def test_the_plan_of_a_sweep():
    """Parts of it, its base by a digest of its own."""
    plan = sweep.plan(CHAIN, ["cable.length=9,10,11"], None, source="chain --set a=1")
    assert (plan.source, [case["changes"]["cable.length"] for case in plan.cases]) == ("chain --set a=1", [9, 10, 11])
    assert {len(case["base"]) for case in plan.cases} == {20}
    assert str(sweep.Part.parse(" 2/3 ")) == "part 2 of 3"
    assert sweep.Part.parse("3/3").of_all([1, 2, 3, 4, 5, 6]) == [3, 6]
    assert plan.share(None) == plan.cases


# -- studies -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "of",
    [
        lambda folder: convergence.study(folder, (2,), (2,)),
        inf_sup.study,
        lambda folder: effects.study(folder, SCENE),
        energy.study,
        lambda folder: hull.study(folder, load_scene("free-buoy"), []),
        hard_cases.study,
        lambda folder: work_precision.study(folder, SCENE, newton=[1e-9]),
    ],
)
def test_other_ranks_have_no_tables(of, tmp_path, monkeypatch):
    """The rows are those of the first."""
    for module in (convergence, inf_sup, effects, energy, hull, hard_cases, work_precision):
        monkeypatch.setattr(module, "evaluate_all", lambda *_: None)
    monkeypatch.setattr(hard_cases, "cases", lambda *_: [])
    monkeypatch.setattr(effects, "MPI", SimpleNamespace(COMM_WORLD=SimpleNamespace(bcast=lambda _: [])))
    assert of(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_an_examination_has_no_facts_on_other_ranks(tmp_path, monkeypatch):
    monkeypatch.setattr(report, "evaluate_all", lambda *_: None)
    assert report.examine("short", report.QUICK["short"], tmp_path) is None
    assert study.run(lambda folder: [], tmp_path) == study.Outcome({}, True)


def test_a_study_has_a_folder_of_its_name(tmp_path, monkeypatch, capsys):
    """Below results, neither of which may be a link; the one that is given may."""
    monkeypatch.chdir(tmp_path)

    def made(folder, number):
        figure = new_figure(3, 2)
        figure.subplots()
        return [Table("a", [{"x": number}], "Title; {folder}", {"x": "X"}, ["said"], figure)]

    assert study.run_command("made-up", made, None, number=3)
    folder = Path("results/study-made-up")
    assert sorted(path.name for path in folder.iterdir() if path.name[0] != ".") == [
        "a.csv", "a.json", "a.png", "a.svg", "tables.md",
    ]  # fmt: skip
    found = json.loads((folder / "a.json").read_text())
    assert found == {"title": "Title; {folder}", "rows": [{"x": 3}], "notes": ["said"]}
    assert (folder / "tables.md").read_text().splitlines() == ["## Title", "", "| X |", "|---|", "| 3 |", "", "said"]
    assert "Title;results/study-made-up" in "".join(capsys.readouterr().out.split())  # however it is wrapped
    for place in ("results/study-other", "results"):
        if place == "results":
            Path(place).rename("old")
        Path(place).symlink_to(tmp_path)
        with pytest.raises(InputError, match="link"):
            study.run_command("other", made, None, number=3)
    assert study.run_command("other", made, Path("results"), number=3)


def test_files_of_a_table(tmp_path, monkeypatch):
    """In a folder that is made, with a page of those that have one."""
    pages = []
    monkeypatch.setattr(study, "write_pages", lambda *given: pages.append(given))
    monkeypatch.setattr(study, "PAGES", {"paged.json": None})
    for name in ("paged", "plain"):
        study.save(tmp_path / "one" / "two", Table(name, [{"a": 'x,"y"'}]))
    assert pages == [(tmp_path / "one" / "two", "paged.json")]
    assert (tmp_path / "one" / "two" / "plain.csv").read_bytes() == b'a\r\n"x,""y"""\r\n'


# -- beside MoorDyn ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("size", "of", "scale"), [(0.9e-3, "value", 1.0009), (1.1e-3, "range", 1.1e-3)])
def test_what_a_difference_is_relative_to(size, of, scale):
    """The range, or of what hardly varies the value."""
    t = np.linspace(0.0, 10.0, 101)
    own = 1.0 + size * (t > 7.0)
    row = peer._row("x", "N", (t, {"x": own}), (t, {"x": own + 1e-5}), 5.0, None)
    assert (row["of"], row["relative"]) == (of, pytest.approx(1e-5 / scale, rel=1e-6))
    zero = peer._row("x", "N", (t, {"x": 0 * t}), (t, {"x": 0 * t}), 5.0, 0.0)
    assert math.isnan(zero["relative"])
    assert (zero["beyond"], zero["bar"]) == ("no", 0.0)
