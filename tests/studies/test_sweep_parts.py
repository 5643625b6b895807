"""Sweeps in parts, as on a cluster: distribution of cases, kills and time limits, retries, and messages.

Source: the same sweep in one piece, bit for bit; the lines of the store, counted.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged

from dolfbuoy import InputError, load_scene
from dolfbuoy.parallel import interruption
from dolfbuoy.parallel.cases import compute, key, rows_of, store_in
from dolfbuoy.parallel.store import Store, Writer
from dolfbuoy.results.folder import claimed
from dolfbuoy.studies import one_case
from dolfbuoy.studies import sweep as sweeping
from dolfbuoy.studies.sweep import Part, collected, plan, run_part, status, sweep, warnings

ROD = {
    "cable": {"length": 3.0, "line_density": 2.0, "elements": 2, "top": {"kind": "free", "force": [1.0, 2.0, 0.0]}},
    "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.8, 0.0, -2.4]]},
    "time": {"end": 0.1, "step": 0.01},
}
VARY = ["cable.line_density=1,2,3,-1,4"]  # the fourth is refused
BUOY = merged(MOORED, cable__elements=4, waves={"amplitude": 0.3, "period": 4.0}, time={"end": 6.0, "step": 0.02})


def lines(folder):
    """Of all files of a store."""
    return [line for file in sorted(folder.rglob("*.jsonl")) for line in file.read_bytes().splitlines(keepends=True)]


# -- the store -------------------------------------------------------------------------------------------------------


def test_what_is_written_is_read(tmp_path):
    """Numbers to the last bit, of the latest attempt, of one program only."""
    writer = Writer(tmp_path / "a" / "x.jsonl", "p")
    writer.add("one", {"x": 0.1 + 0.2, "y": [np.pi, 1e-300]})
    writer.add("two", {"x": 1}, attempt=1)
    writer.close()
    other = Writer(tmp_path / "b.jsonl", "p")
    other.add("two", {"x": 0})
    other.close()
    stranger = Writer(tmp_path / "c.jsonl", "q")
    stranger.add("three", {})
    stranger.add("four", {})
    stranger.close()
    store = Store(tmp_path, "p")
    assert store.result("one") == {"x": 0.1 + 0.2, "y": [np.pi, 1e-300]}
    assert store.result("two") == {"x": 1}
    assert store.result("three") is None
    assert (store.foreign, store.damaged) == (2, [])
    assert [store.attempt(name) for name in ("one", "two", "three")] == [1, 2, 0]


def _written(file, results):
    """A file of so many results, and what it holds."""
    writer = Writer(file, "p")
    for k in range(results):
        writer.add(str(k), {"k": k})
    writer.close()
    return file, file.read_bytes()


def test_a_kill_at_any_byte_loses_at_most_the_last_line(tmp_path):
    """Cut anywhere, every whole line counts; the next writer goes on behind them."""
    file, whole = _written(tmp_path / "x.jsonl", 3)
    for size in range(len(whole)):
        file.write_bytes(whole[:size])
        store = Store(tmp_path, "p")
        assert len(store.entries) == whole[:size].count(b"\n")
        assert store.damaged == []
    file.write_bytes(whole[:-5])
    again = Writer(file, "p")
    again.add("2", {"k": 2})
    again.close()
    assert file.read_bytes() == whole


def test_every_wrong_bit_is_noticed(tmp_path):
    file, whole = _written(tmp_path / "x.jsonl", 2)
    for place in range(whole.index(b"\n")):
        for bit in (1, 128):
            file.write_bytes(whole[:place] + bytes([whole[place] ^ bit]) + whole[place + 1 :])
            store = Store(tmp_path, "p")
            assert store.result("1") == {"k": 1}
            assert "0" not in store.entries
            assert len(store.damaged) == 1


# -- parts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["3/2", "0/2", "1", "a/b", "1/2/3", "-1/2", "1/0", ""])
def test_a_part_is_i_of_n(text):
    with pytest.raises(InputError, match=r"must be i/n"):
        Part.parse(text)


def test_parts_are_the_whole(tmp_path):
    """Each case is in one part; what they compute is what one process computes, bit for bit."""
    whole = sweep(ROD, VARY, None, tmp_path / "whole")
    planned, folder = plan(ROD, VARY, None), tmp_path / "parts"
    for i in (3, 1, 2):
        run_part(planned, folder, Part(i, 3))
        assert len(lines(folder / "cases" / f"part-{i}-of-3")) == [2, 2, 1][i - 1]
    found = collected(planned, folder)
    xr.testing.assert_identical(*(one.assign_attrs(created="") for one in (found, whole)))
    with xr.open_dataset(folder / "sweep.nc") as written:
        xr.testing.assert_equal(written.load(), whole)


def test_a_part_goes_on_with_what_any_division_has_computed(tmp_path, monkeypatch):
    planned = plan(ROD, VARY, None)
    run_part(planned, tmp_path, Part(1, 2))
    run_part(planned, tmp_path, Part(2, 5))
    seen = []
    whole = sweeping.evaluate
    monkeypatch.setattr(sweeping, "evaluate", lambda case, **how: (seen.append(case["changes"]), whole(case, **how))[1])
    dataset = sweep(ROD, VARY, None, tmp_path)
    assert seen == [{"cable.line_density": -1}]
    assert list(dataset.status.values[:3]) == ["done"] * 3


def test_the_status_of_a_sweep(tmp_path, call):
    planned = plan(ROD, VARY, None)
    assert status(planned, tmp_path)["missing"] == 5
    run_part(planned, tmp_path, Part(2, 2))
    found = status(planned, tmp_path)
    assert [found[name] for name in ("cases", "done", "failed", "missing", "begun")] == [5, 1, 1, 3, 0]
    assert found["seconds"] > 0
    ((reason, number),) = found["reasons"].items()
    assert reason.startswith("InputError: cable.line_density = -1")
    assert number == 1
    load_scene(ROD).save(tmp_path / "rod.toml")
    arguments = ["sweep", tmp_path / "rod.toml", "--vary", VARY[0], "--out", tmp_path]
    code, out, _ = call(*arguments, "--status")
    assert code == 0
    for words in ("all", "run again with --retry failed", "h of one core", "cable.line_density = -1"):
        assert words in out
    code, out, _ = call(*arguments, "--collect")
    assert code == 0
    assert out.count("not computed") == 3
    assert xr.load_dataset(tmp_path / "sweep.nc").sizes["case"] == 5


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--status", "--collect"], "give one of them"),
        (["--collect", "--part", "1/2"], "leave out --part"),
        (["--part", "5/2"], "--part 5/2: must be i/n"),
        (["--collect"], "holds no results of a sweep"),
    ],
)
def test_what_does_not_go_together(options, words, tmp_path, call):
    load_scene(ROD).save(tmp_path / "rod.toml")
    code, _, err = call("sweep", tmp_path / "rod.toml", "--vary", VARY[0], "--out", tmp_path / "sw", *options)
    assert code == 2
    assert words in err
    assert not (tmp_path / "sw").exists()


def test_two_processes_do_not_run_one_part(tmp_path):
    """Nor one part and the whole, nor parts of two divisions; two parts of one may."""
    planned = plan(ROD, VARY, None)
    with claimed(tmp_path, shared=True), claimed(tmp_path / "cases" / "part-1-of-2"):
        for run in (
            lambda: run_part(planned, tmp_path, Part(1, 2)),
            lambda: run_part(planned, tmp_path, Part(1, 3)),
            lambda: sweep(ROD, VARY, None, tmp_path),
        ):
            with pytest.raises(InputError, match="in use by another run"):
                run()
        run_part(planned, tmp_path, Part(2, 2))
    assert len(lines(tmp_path)) == 2
    with claimed(tmp_path), pytest.raises(InputError, match="in use by another run"):
        run_part(planned, tmp_path, Part(1, 2))


def test_who_may_be_in_a_sweep_and_what_is_no_folder_of_it(tmp_path, monkeypatch):
    """Parts run beside each other and beside who collects; records are shared too; links are refused."""
    planned, ran = plan(ROD, VARY, None), []
    monkeypatch.setattr(sweeping, "compute", lambda *_, **__: ran.append(True))
    monkeypatch.setattr(sweeping, "_written", lambda *_: ran.append(True))
    (tmp_path / "cases").mkdir()
    with claimed(tmp_path, shared=True), claimed(tmp_path / "records", shared=True):
        run_part(planned, tmp_path, Part(1, 2), keep=True)
        collected(planned, tmp_path)
    for what, run in (
        ("records", lambda: run_part(planned, tmp_path, Part(1, 2), keep=True)),
        (".", lambda: collected(planned, tmp_path)),
    ):
        with claimed(tmp_path / what), pytest.raises(InputError, match="in use by another run"):
            run()
    assert len(ran) == 2
    for name in ("records", "cases/running", "cases/part-1-of-9", "cases/part-1-of-2", "cases"):
        if (tmp_path / name).is_dir():
            shutil.rmtree(tmp_path / name)
        (tmp_path / name).symlink_to(tmp_path)
        with pytest.raises(InputError, match="link"):
            run_part(planned, tmp_path, Part(1, 2))
        (tmp_path / name).unlink()
    assert len(ran) == 2


def test_what_will_not_run_is_said_before_the_first_case(tmp_path):
    """Of ten thousand cases, and of a part of them; warnings of the two ends of a key, too."""
    table, said = tmp_path / "cases.csv", []
    heights = [f"{0.1 + 1e-5 * k:.5f}" for k in range(9999)]
    table.write_text("waves.amplitude\n" + "\n".join([*heights[:5000], "-1", "9", *heights[5000:]]) + "\n")
    planned = plan(BUOY, [], table)
    begin = time.process_time()
    refused, steep = warnings(planned.base, planned.changes)
    assert time.process_time() - begin < 20.0  # a second, on a machine with nothing else to do
    assert refused.startswith(
        "1 of 10001 cases will not run, the first with waves.amplitude = -1: waves.amplitude = -1"
    )
    assert steep.startswith("1 of 52 cases examined, the first with waves.amplitude = 9: The wave (H/lambda")
    part, rods = Part(2, 2), plan(ROD, VARY, None)
    run_part(rods, tmp_path / "rods", part, say=lambda sentences: said.extend((s, lines(tmp_path)) for s in sentences))
    ((sentence, before),) = said
    assert sentence.startswith("1 of 2 cases will not run, the first with cable.line_density = -1")
    assert before == []


# -- failures ----------------------------------------------------------------------------------------------------------


def test_failed_cases_are_run_again_when_that_is_asked_for(tmp_path, monkeypatch):
    """A disk that was full for a while, say; what is done is left alone, and the last attempt counts."""
    whole = one_case.run

    def crash(scene, *options):
        if scene.network.pieces[0].section.line_density == 2:
            raise OSError("of the test")
        return whole(scene, *options)

    with monkeypatch.context() as patch:
        patch.setattr(one_case, "run", crash)
        first = sweep(ROD, VARY, None, tmp_path)
    assert [s.split(":")[0] for s in first.status.values] == ["done", "OSError", "done", "InputError", "done"]
    before = lines(tmp_path)
    again = sweep(ROD, VARY, None, tmp_path, retry=True)
    assert [s.split(":")[0] for s in again.status.values] == ["done", "done", "done", "InputError", "done"]
    assert lines(tmp_path)[: len(before)] == before
    assert len(lines(tmp_path)) == len(before) + 2
    assert np.isfinite(again.tension_anchor_mean.values[1])


# -- interruption -----------------------------------------------------------------------------------------------------


class Ticks:
    """A clock that a second goes by on whenever somebody looks."""

    now = 0.0
    monotonic = staticmethod(time.monotonic)
    process_time = staticmethod(time.process_time)

    def time(self):
        self.now += 1.0
        return self.now


def test_a_time_limit_leaves_a_checkpoint_and_the_next_call_goes_on(tmp_path, monkeypatch):
    """Stopped after 90 steps at a time; the result is that of the run in one go, bit for bit, and no step is twice."""
    vary = ["waves.amplitude=0.2,0.3"]
    whole = sweep(BUOY, vary, None, tmp_path / "whole")
    folder, begins, stops = tmp_path / "limited", [], 0
    built, ticks = one_case.Simulation, Ticks()

    def noted(*arguments, state=None, **options):
        begins.append(0.0 if state is None else state["t"])
        return built(*arguments, state=state, **options)

    monkeypatch.setattr(one_case, "Simulation", noted)
    for module in (one_case, sweeping):
        monkeypatch.setattr(module, "clock", ticks)
    found = None
    while found is None:
        try:
            found = sweep(BUOY, vary, None, folder, limit=90.0)
        except interruption.TimeUp:
            stops += 1
            assert len(list((folder / "cases" / "running").iterdir())) == 1
    assert stops == 6
    assert len(lines(folder)) == 2
    assert sum(begin == 0 for begin in begins) == 2
    steps = np.diff([*begins[: begins.index(0.0, 1)], 6.0]) / 0.02
    assert steps == pytest.approx([90, 90, 90, 30], abs=1e-6)
    assert not list((folder / "cases" / "running").iterdir())
    xr.testing.assert_identical(*(one.assign_attrs(created="") for one in (found, whole)))


COMMAND = "from dolfbuoy.commands.entry import main; main()"


def _sweep_process(folder, *options):
    command = [sys.executable, "-c", COMMAND, "sweep", str(folder / "buoy.toml"), "--out", str(folder), *options]
    return subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a background shell ignores it
    )


@pytest.mark.parametrize("number", [pytest.param(signal.SIGTERM, marks=pytest.mark.slow), signal.SIGKILL])
def test_a_case_that_is_stopped_goes_on(number, tmp_path):
    """With its checkpoint of that instant after SIGTERM, with the last one after a kill: bit for bit."""
    scene = merged(BUOY, time={"end": 1000.0, "step": 0.02})  # some seconds: the first checkpoint comes after one
    load_scene(scene).save(tmp_path / "buoy.toml")
    process = _sweep_process(tmp_path, "--vary", "waves.amplitude=0.3", "--part", "1/1")
    running, deadline = tmp_path / "cases" / "running", time.monotonic() + 200
    while not list(running.glob("*/checkpoint.npz")):
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    if number == signal.SIGTERM:
        assert process.returncode == 130
        assert "the same command goes on" in err
        assert "Traceback" not in err
    (case,) = running.iterdir()
    point = one_case.checkpoint.load(case, 1)
    assert 0 < point.t < 1000
    assert lines(tmp_path) == []
    planned = plan(tmp_path / "buoy.toml", ["waves.amplitude=0.3"], None)
    record = one_case.run(point.scene, case)
    assert not case.exists()
    np.testing.assert_array_equal(record.tension_top, one_case.run(point.scene).tension_top)
    assert planned.cases


def test_the_running_case_is_damaged(tmp_path):
    """It begins anew."""
    scene = load_scene(ROD)
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / "checkpoint.npz").write_bytes(b"garbage")
    record = one_case.run(scene, tmp_path / "case")
    np.testing.assert_array_equal(record.tension_top, one_case.run(scene).tension_top)


# -- elsewhere ---------------------------------------------------------------------------------------------------------


def test_an_executor_evaluates_and_one_process_writes(tmp_path):
    """Results in any order; an error of the executor about a case is its result."""
    cases = [{"i": i} for i in range(20)]

    def evaluate(case):
        time.sleep(0.001 * (case["i"] % 5))
        if case["i"] == 7:
            raise MemoryError("of the test")
        return {"status": "done", "square": case["i"] ** 2}

    with ThreadPoolExecutor(4) as executor:
        compute(evaluate, cases, tmp_path, executor=executor, failed=lambda error: {"status": type(error).__name__})
    rows = rows_of(cases, tmp_path)
    assert [row.get("square") for row in rows] == [i**2 if i != 7 else None for i in range(20)]
    assert rows[7]["status"] == "MemoryError"
    assert len(lines(tmp_path)) == 20
    assert store_in(tmp_path).result(key(cases[3])) == {"status": "done", "square": 9}
    with ThreadPoolExecutor(2) as executor, pytest.raises(MemoryError):
        compute(evaluate, cases, tmp_path / "raised", executor=executor)
