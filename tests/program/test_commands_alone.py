"""Parts of commands, each alone: exact wording, rarely shown output, the doctor.

Source: the same words by hand; made-up records and programs.
"""

import sys
from pathlib import Path
from types import SimpleNamespace

import click
import numpy as np
import pytest
import typer
import xarray as xr
from rich.color import ColorSystem

from dolfbuoy import api, load_scene
from dolfbuoy.commands import doctor, language, linear, main, run, shared, statistics, sweep
from dolfbuoy.commands.shared import Interrupted
from dolfbuoy.errors import SolveError
from dolfbuoy.parallel import interruption, ranks
from dolfbuoy.results import summary
from dolfbuoy.results.sample import LASTS
from dolfbuoy.scene.schema import as_text

# -- what is printed ---------------------------------------------------------------------------------------------------

LONG = "12 sentences [bold]are[/bold] one line each, however narrow the terminal may be, 1.5 of them"


@pytest.fixture
def narrow(monkeypatch):
    """A terminal of 20 columns with colours."""
    for console in (shared.out, shared.err):
        monkeypatch.setattr(console, "width", 20)
        monkeypatch.setattr(console, "_force_terminal", True)
        monkeypatch.setattr(console, "_color_system", ColorSystem.TRUECOLOR)
        monkeypatch.setattr(console, "no_color", False)


def test_sentences_are_shown_as_they_are(narrow, monkeypatch, capsys):
    """On one line that can be copied, with their brackets and without colours."""
    shared.say(LONG, "two")
    assert capsys.readouterr().out == f"{LONG}\ntwo\n"
    with pytest.raises(typer.Exit):
        main._print_version(True)
    assert capsys.readouterr().out == f"dolfbuoy {main.__version__}\n"
    main._print_version(False)
    language.schema()
    assert capsys.readouterr().out == as_text()
    monkeypatch.setattr(ranks, "end", lambda say, code: say())
    main._fail(LONG, 1)
    main._fail(f"{LONG}.", 1)
    assert capsys.readouterr().err == f"{LONG}.\n{LONG}.\n"
    shared.say_warnings([LONG])
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("\x1b[33mWarning:\x1b[0m ")
    assert click.unstyle(line) == f"Warning: {LONG}"
    monkeypatch.setattr(doctor, "examine", lambda: [("forms", True, LONG.replace("[", "("))])
    monkeypatch.setattr(doctor, "installed", lambda: SimpleNamespace(versions=dict, jit_cache=lambda: "there"))
    main.doctor()
    assert click.unstyle(capsys.readouterr().out).endswith(f"\nok     forms: {LONG.replace('[', '(')}\n")


def test_other_ranks_are_silent(monkeypatch, capsys):
    monkeypatch.setattr(shared, "rank", lambda: 1)
    shared.say("one")
    shared.say_warnings(["two"])
    assert capsys.readouterr().out == ""


def test_a_run_of_several_ranks_is_told_what_it_gains(narrow, monkeypatch, capsys, tmp_path):
    """Before it begins, on one line, on the stream of errors."""
    record = object()
    monkeypatch.setattr(api, "simulate", lambda **_: record)
    monkeypatch.setattr(summary, "sharing_note", lambda scene, size: f"{size} ranks: {LONG.replace('[', '(')}")
    monkeypatch.setattr("dolfbuoy.results.after_ramp.scene_of", lambda given: given)
    monkeypatch.setattr(run, "_print_summary", lambda *given: print(given[0] is record))
    shows = {name: lambda folder, name=name: print(name, folder) for name in ("figures", "page.html")}
    run._compute(load_scene("driven"), Path("there"), shows, {})
    out, err = capsys.readouterr()
    assert err.splitlines()[0] == f"1 ranks: {LONG.replace('[', '(')}"
    assert out.splitlines() == ["True", "figures there", "page.html there"]
    monkeypatch.setattr(run, "rank", lambda: 1)
    run._compute(load_scene("driven"), Path("there"), shows, {})
    assert capsys.readouterr().out == ""


def test_a_run_that_breaks_off_or_is_interrupted(monkeypatch, tmp_path):
    def fails(**_):
        raise SolveError("on purpose")

    monkeypatch.setattr(api, "simulate", fails)
    for received, kind in ((False, SolveError), (True, Interrupted)):
        monkeypatch.setattr(interruption, "_received", received)
        with pytest.raises(kind):
            run._compute(load_scene("driven"), tmp_path, {}, {})


def test_what_is_shown_of_a_run_that_is_there(monkeypatch, tmp_path, capsys):
    """What is missing; and what was wrong with it is said again."""
    (tmp_path / "figures").mkdir()
    shows = {name: lambda folder, name=name: print(name) for name in ("figures", "page.html")}
    monkeypatch.setattr("dolfbuoy.results.record.read", lambda path: path.name)
    monkeypatch.setattr(run, "_print_summary", lambda *given: print(given[0]))
    monkeypatch.setattr("dolfbuoy.results.cautions.refused", lambda record, scene: None)
    run._show_again(load_scene("driven"), tmp_path, shows)
    said = f"The run in {tmp_path} is complete already; --overwrite computes it again."
    assert capsys.readouterr().out.splitlines() == [said, "results.nc", "page.html"]
    monkeypatch.setattr("dolfbuoy.results.cautions.refused", lambda record, scene: SolveError("unsound"))
    with pytest.raises(SolveError, match="unsound"):
        run._show_again(load_scene("driven"), tmp_path, {})


def test_a_table_of_many_sets(monkeypatch, capsys, tmp_path):
    """Twenty of them, and how many there are more."""
    for name in ("_numbers", "_sea", "_fatigue", "_extremes", "_certainty"):
        monkeypatch.setattr(statistics, name, lambda *_, name=name: (name, ["a"], [["b"]]))
    monkeypatch.setattr(statistics, "_circles", lambda mine: iter([("circles", ["a"], [])]))
    monkeypatch.setattr("dolfbuoy.results.series.each_series", lambda *_: [])
    monkeypatch.setattr(statistics, "print_table", lambda title, *_: print(title))
    data = {"set_of_run": ("run", np.arange(22)), "x": ("set", np.zeros(22))}
    labels = {"run": [f"run {k}" for k in range(22)], "set": np.arange(22)}
    found = xr.Dataset(data, labels, {"notes": "one\n\ntwo"})
    found = found.assign(duration=("run", np.ones(22)), start=("run", np.ones(22)))
    monkeypatch.setattr(statistics, "_title", lambda mine, *_: f"{mine.run.values.tolist()} {int(mine.set)}")
    statistics.show(found, tmp_path)
    lines = capsys.readouterr().out.splitlines()
    assert lines[:5] == ["_numbers", "_sea", "_fatigue", "_extremes", "_certainty"]
    assert lines[-3:] == ["... and 2 sets more", "one", "two"]
    assert len(lines) == 20 * 5 + 3
    few = found.isel(set=slice(20), run=slice(20))
    statistics.show(few, tmp_path)
    assert "more" not in capsys.readouterr().out


@pytest.mark.parametrize(("mean", "shown"), [(7.1e-9, "7.1e-09"), (6.9e-9, "0")])
def test_numbers_and_fatigue_of_two_runs(mean, shown):
    """Means, least and largest of both; a mean that is rounding is none; sums of damage in all the time."""
    numbers = {"standard_deviation": [1.0, 3.0], "minimum": [-4.0, -2.0], "maximum": [5.0, 7.0], "skewness": [0.1, 0.3]}
    numbers |= {"period": [4.0, 6.0], LASTS: [2.5, 3.5], "equivalent_load": [1.0, 3.0], "damage": [1e-6, 3e-6]}
    data = {f"way_x_{name}": ("run", values) for name, values in numbers.items()}
    data |= {"way_x_mean": ("run", [mean - 1e-9, mean + 1e-9], {"units": "m"}), "duration": ("run", [100.0, 300.0])}
    series = [("way_x of a", "way_x", xr.Dataset(data))]
    assert statistics._numbers(series, "")[2] == [["way x of a", "m", shown, "2", "0.20", "-4", "7", "3.5", "5", ""]]
    title, heads, rows = statistics._fatigue(series, {"exponent": 2.0, "frequency_Hz": 0.5})
    assert title == "\nFatigue, m = 2, equivalent load at 0.5 Hz"
    assert heads == ["series", "equivalent load", "Miner sum per year", "life [years]"]
    assert rows == [["way x of a", "2.236 m", "0.3156", "3.169"]]  # (1 + 9)/2 is 5; 4e-6 in 400 s


def test_sides_without_any_offset_are_left_out(monkeypatch, tmp_path):
    rows = []
    monkeypatch.setattr(shared, "print_table", lambda title, columns, found: rows.extend(found))
    two = ("direction", "force")
    data = {"tension_top": ((*two, "cable"), 10.0 * np.arange(1, 7).reshape(3, 2, 1))}
    data["found"] = two, np.array([[True, True], [False, False], [False, True]])
    labels = {"direction": [0.0, 90.0, 180.0], "force": [1.0, 2.0], "cable": ["a"]}
    found = xr.Dataset(data, labels)
    monkeypatch.setattr("dolfbuoy.results.linear_record.each_buoy", lambda found: [])
    linear._show_offsets(found, "force", tmp_path)
    assert rows == [["0", "2", "20"], ["180", "2", "60"]]


def test_offsets_are_told_where_that_of_any_buoy_is_largest(monkeypatch, tmp_path):
    rows, heads = [], []
    monkeypatch.setattr(
        shared, "print_table", lambda title, columns, found: (rows.extend(found), heads.extend(columns))
    )
    two, moved = ("direction", "force"), [[[1.0, 5.0, np.nan]], [[7.0, 2.0, np.nan]]]
    data = {"tension_top": ((*two, "cable"), [[[1000.0], [3e4], [2e3]]]), "found": (two, [[True, True, False]])}
    data |= {"offset_along": (("buoy", *two), moved)}
    found = xr.Dataset(data, {"direction": [30.0], "force": [10.0, 20.0, 30.0], "cable": ["a"], "buoy": ["x", "y"]})
    linear._show_offsets(found, "force", tmp_path)
    assert heads == ["direction [deg]", "at force", "offset of x [m]", "offset of y [m]", "tension at the top [kN]"]
    assert rows == [["30", "10", "1", "7", "30"]]


@pytest.mark.parametrize(
    ("sides", "said"), [(2, []), (3, ["At 2 N the watch circle has a radius of 4.321 m about (1.234, 0)."])]
)
def test_two_sides_make_no_circle(sides, said, monkeypatch, tmp_path):
    sentences, two = [], ("direction", "force")
    monkeypatch.setattr(shared, "print_table", lambda *_: None)
    monkeypatch.setattr(shared, "say", sentences.append)
    monkeypatch.setattr("dolfbuoy.results.linear_record.each_buoy", lambda found: [("", found)])
    data = {name: ((*two, "cable"), np.ones((sides, 2, 1))) for name in ("tension_top",)}
    data |= {"found": (two, np.ones((sides, 2), dtype=bool)), "offset_along": (two, np.ones((sides, 2)))}
    data |= {"watch_radius": ("force", [3.0, 4.321]), "watch_centre": (("force", "xy"), [[0.0, 0.0], [1.234, -4e-11]])}
    labels = {"direction": np.arange(sides) * 90.0, "force": [1.0, 2.0], "cable": ["a"]}
    linear._show_offsets(xr.Dataset(data, labels), "force", tmp_path)
    assert sentences == said


def test_a_scene_without_time_makes_no_folder(call, tmp_path, monkeypatch):
    load_scene("driven", time=None).save(tmp_path / "still.toml")
    monkeypatch.chdir(tmp_path)
    code, _, err = call("run", "still.toml")
    assert (code, "time: must be given" in err) == (2, True)
    assert [path.name for path in tmp_path.iterdir()] == ["still.toml"]


# -- the doctor --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("user", "root"), [(0, ["--allow-run-as-root"]), (1000, [])])
def test_how_the_doctor_starts_two_ranks(user, root, monkeypatch):
    """Without what another mpirun has left but what root may do; lines of two ranks may mix."""
    asked, printed = [], iter(["2\n2\n", "22\n", "2\n1\n", ""])

    def started(command, **how):
        asked.append((command, how))
        return SimpleNamespace(stdout=next(printed), stderr="")

    monkeypatch.setattr(doctor.shutil, "which", lambda name: f"/bin/{name}")
    monkeypatch.setattr(doctor.subprocess, "run", started)
    monkeypatch.setattr(doctor.os, "geteuid", lambda: user)
    left = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "PATH": "there"}
    monkeypatch.setattr(doctor.os, "environ", left | {"OMPI_MCA_x": "1", "PMIX_RANK": "0", "PMI_RANK": "0"})
    assert [doctor._mpi(), doctor._mpi()] == ["two ranks answered"] * 2
    with pytest.raises(RuntimeError, match=r"^1$"):
        doctor._mpi()
    code = "from mpi4py import MPI; print(MPI.COMM_WORLD.allreduce(1))"
    command = ["/bin/mpirun", *root, "--oversubscribe", "-n", "2", sys.executable, "-c", code]
    how = {"capture_output": True, "text": True, "timeout": 120, "env": left, "check": False}
    assert asked[0] == (command, how)


def test_a_doctor_is_exact_to_a_percent(monkeypatch):
    exact = 0.7984082610988972
    for factor, good in ((1.0099, True), (0.9901, True), (1.0101, False), (0.9899, False)):
        found = SimpleNamespace(tension_top=factor * exact, newton_iterations=4)
        monkeypatch.setattr(api, "solve_static", lambda scene, comm, found=found: found)
        if good:
            assert doctor._solve() == "a catenary in 4 iterations"
            continue
        with pytest.raises(RuntimeError, match="the top tension of a catenary is off by 1 %"):
            doctor._solve()


def test_an_interrupted_sweep_says_what_is_left(monkeypatch, tmp_path):
    """And so does one whose time is up; another error is one."""
    study = SimpleNamespace(plan=lambda *_: None, Part=None)
    for error, received, words in (
        (interruption.TimeUp(), False, "Stopped at the time limit; the same command goes on."),
        (ValueError("odd"), True, "Interrupted; the same command goes on."),
        (ValueError("odd"), False, "odd"),
    ):

        def fails(*_, error=error, **__):
            raise error

        study.sweep = fails
        monkeypatch.setattr(interruption, "_received", received)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("dolfbuoy.studies.sweep.plan", study.plan)
            patch.setattr("dolfbuoy.studies.sweep.sweep", fails)
            with pytest.raises(ValueError if words == "odd" else Interrupted, match=f"^{words}$"):
                sweep.sweep("driven", folder=tmp_path)
