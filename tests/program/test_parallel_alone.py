"""Support for several ranks and many cases, each part alone: claims, errors, progress, signals, termination.

Source: the same numbers and words by hand; made-up ranks, clocks and signals.
"""

import copy
import json
import math
import os
import signal
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.parallel import cases, interruption, pace, ranks


class Comm:
    """One of several ranks: what it would receive is given."""

    def __init__(self, rank=0, size=2, received=(), heard=()):
        self.rank, self.size, self.received, self.heard = rank, size, list(received), set(heard)
        self.sent, self.waited, self.aborted = [], 0, []

    def bcast(self, value, root=0):
        assert root == 0
        return self.received.pop(0) if self.rank else value

    def allreduce(self, value, op):
        return op(value)

    def allgather(self, value):
        value = copy.copy(value)  # it has been sent
        return [*self.received, value] if self.rank else [value, *self.received]

    def isend(self, value, rank, tag):
        self.sent.append((value, rank, tag))
        return SimpleNamespace(wait=lambda: setattr(self, "waited", self.waited + 1))

    def iprobe(self, rank, tag):
        return rank in self.heard

    def recv(self, source, tag):
        assert source in self.heard

    def Abort(self, code):
        self.aborted.append(code)


def world(monkeypatch, comm):
    monkeypatch.setattr(cases, "MPI", SimpleNamespace(COMM_WORLD=comm, COMM_SELF="self"))
    return comm


# -- cases -------------------------------------------------------------------------------------------------------------


def test_cases_that_others_have_claimed(tmp_path):
    """Are theirs; once a case has failed none is begun."""
    (tmp_path / "2").touch()
    share = cases._claimed([1, 2, 3, 4], tmp_path)
    assert [next(share), next(share)] == [1, 3]
    (tmp_path / "failed").touch()
    assert list(share) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1", "2", "3", "failed"]


def test_a_case_that_fails_stops_the_others(tmp_path):
    def evaluate(case):
        raise SolveError("on purpose")

    progress = SimpleNamespace(watching=lambda i: nullcontext(), done=lambda *_: pytest.fail("done"))
    with pytest.raises(SolveError, match="on purpose"):
        cases._evaluate_share(evaluate, [{}], [0], lambda *_: pytest.fail("kept"), tmp_path, progress)
    assert (tmp_path / "failed").is_file()


@pytest.mark.parametrize(
    ("own", "others", "size", "raised"),
    [
        (None, [None], 2, None),
        (InputError("own"), [None], 2, "InputError: own"),
        (None, [SolveError("other")], 2, "SolveError: other"),
        (InputError("own"), [SolveError("other")], 2, "InputError: own"),
        (InputError("own"), [], 1, "InputError: own"),
        (ValueError("odd"), [], 1, "ValueError: odd"),
        (ValueError("odd"), [None], 2, "RuntimeError: Traceback"),
    ],
)
def test_what_one_rank_raises_all_raise(own, others, size, raised):
    """The error of the first; of a fault where it is, with its place."""

    def work(one, two):
        assert (one, two) == (1, 2)
        if own is not None:
            raise own

    comm = Comm(0, size, others)
    if raised is None:
        cases._raise_together(comm, work, 1, 2)
        return
    with pytest.raises((InputError, SolveError, ValueError, RuntimeError)) as error:
        cases._raise_together(comm, work, 1, 2)
    assert f"{type(error.value).__name__}: {error.value}".startswith(raised)
    if raised.startswith("Runtime"):
        assert str(error.value).endswith("ValueError: odd\n")
    assert size > 1 or error.value is own


def test_two_ranks_share_their_cases(tmp_path, monkeypatch):
    """One of each structure by the first; then whoever comes; what is known, and comes twice, by nobody."""
    rows, seen = [{"a": a} for a in (0, 1, 2, 3, 1)], []

    def evaluate(case):
        seen.append(case["a"])
        return {"b": -case["a"]}

    world(monkeypatch, Comm(0, 1))
    cases.compute(evaluate, rows[3:4], tmp_path)
    prepared = cases._prepared(tmp_path, tmp_path / "cases", rows, None, print)
    assert prepared[:2] == ([0, 1, 2], {0: 0, 1: 0, 2: 0})
    (prepared[2] / "2").touch()  # by the other rank
    seen.clear()
    world(monkeypatch, Comm(1, 2, [prepared, None, None]))
    monkeypatch.setattr(Comm, "allgather", lambda self, value: [None, value])
    structure = lambda case: case["a"] % 2  # noqa: E731
    assert cases.evaluate_all(evaluate, rows, tmp_path, structure) is None
    assert seen == []  # two pioneers, and one that is taken
    (prepared[2] / "2").unlink()
    world(monkeypatch, Comm(1, 2, [prepared]))
    cases.compute(evaluate, rows, tmp_path, structure)
    assert seen == [2]
    assert (tmp_path / "cases" / "rank-1.jsonl").is_file()
    assert prepared[2].is_dir()  # it is of the first
    world(monkeypatch, Comm(0, 2))
    assert [row["b"] for row in cases.evaluate_all(evaluate, rows, tmp_path, structure)] == [0, -1, -2, -3, -1]
    assert seen == [2, 0, 1]
    assert [path.name for path in (tmp_path / "cases").iterdir() if path.is_dir()] == [prepared[2].name]


@pytest.mark.parametrize(
    ("rank", "work", "shares"),
    [(0, lambda case: case["a"], {0: 2.0, 1: 1e-12}), (0, None, {0: 1.0, 1: 1.0}), (1, lambda case: case["a"], {})],
)
def test_work_is_known_to_the_first(rank, work, shares, tmp_path, monkeypatch):
    """At least a little of each case, so that what is left can be told by it."""
    told, rows = [], [{"a": 2.0}, {"a": 0.0}]

    def begun(*given):
        told.append(given)
        return nullcontext(SimpleNamespace(watching=lambda i: nullcontext(), done=lambda *_: None))

    monkeypatch.setattr(cases, "_Progress", begun)
    world(monkeypatch, Comm(0, 1))
    prepared = cases._prepared(tmp_path, tmp_path / "cases", rows, None, print)
    world(monkeypatch, Comm(rank, 2, [prepared] * rank))
    cases.compute(lambda case: {}, rows, tmp_path, work=work)
    assert told == [(shares, 2)]


def test_who_takes_part(monkeypatch):
    comm = world(monkeypatch, Comm())
    assert (cases.ranks_beside(None), cases.ranks_beside("an executor")) == (comm, "self")


def test_cases_are_computed_again_where_that_is_asked_for(tmp_path):
    """By what they have; of which the latest counts."""
    numbers = iter(range(9))
    rows = [{"a": 1}, {"a": 2}]
    for again in (None, lambda result: result["b"] == 1, lambda result: result["b"] == 2):
        cases.compute(lambda case: {"b": next(numbers)}, rows, tmp_path, again=again)
    assert [row["b"] for row in cases.rows_of(rows, tmp_path)] == [0, 3]
    (file,) = (tmp_path / "cases").glob("*.jsonl")
    entries = [json.loads(line.partition(" ")[2]) for line in file.read_text().splitlines()]
    assert [(entry["attempt"], entry["result"]["b"]) for entry in entries] == [(0, 0), (0, 1), (1, 2), (2, 3)]


def test_a_file_of_a_case():
    case = {"x": 1}
    assert cases.with_file(case, "there", "own") == {"x": 1, "file": f"there/cases/own-{cases.key(case)}.npz"}
    assert len(cases.key(case)) == 20
    assert cases.key({"a": 1, "b": 2}) == cases.key({"b": 2, "a": 1}) != cases.key({"a": 2, "b": 1})


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(1.0, "1 s"), (89.9, "90 s"), (90.0, "1.5 min"), (5400.0, "1.5 h"), (129600.0, "1.5 days"), (0.0, "0 s")],
)
def test_durations(seconds, text):
    assert cases.duration(seconds) == text


@pytest.fixture
def ticking(monkeypatch):
    """Clock of the cases, which stands still until it is set."""
    now = [0.0]
    monkeypatch.setattr(cases.clock, "monotonic", lambda: now[0])
    return now


@pytest.mark.parametrize(("first", "said"), [(5.0, True), (4.99, False)])
def test_when_the_time_of_all_cases_is_said(first, said, ticking, capsys):
    """From 20 s that are left on, once; on the way of two ranks half as much."""
    with cases._Progress(dict.fromkeys(range(5), 1.0)) as progress:
        ticking[0] = first
        progress.done(0)
        progress.done(1)
    shown = " ".join(capsys.readouterr().err.split())
    assert shown.count("The first of 5 cases took 5 s: about 20 s to go.") == said
    assert cases._Progress(dict.fromkeys(range(5), 1.0), 2)._left(0, 10.0) == 20.0
    assert cases._Progress({0: 1.0, 1: 3.0})._left(1, 12.0) == pytest.approx(4.0)


@pytest.mark.parametrize(("seconds", "said"), [(5.0, True), (4.99, False)])
def test_the_first_steps_tell_the_time_of_all_cases(seconds, said, capsys):
    with cases._Progress({0: 1.0, 1: 3.0}) as progress:
        progress._expect(0, seconds)
    assert ("2 cases: about 20 s, by the first steps." in " ".join(capsys.readouterr().err.split())) == said


@pytest.mark.parametrize(("work", "workers", "said"), [(10.0, 1, True), (9.99, 1, False), (20.0, 2, True)])
def test_workers_tell_the_time_of_all_cases(work, workers, said, capsys):
    with cases._Progress({0: work, 1: work}) as progress:
        progress.sent(workers)
    shown = " ".join(capsys.readouterr().err.split())
    at_once = ", 2 at once" if workers > 1 else ""
    assert (f"2 cases{at_once}: about 20 s, by their steps, elements and waves." in shown) == said
    with cases._Progress({0: 30.0}) as progress:  # more of them than there are cases
        progress.sent(8)
    assert "1 cases, 8 at once: about 30 s" in " ".join(capsys.readouterr().err.split())


def test_who_is_watched(monkeypatch):
    """The first of several, while nobody is silent."""
    watched = []
    monkeypatch.setattr(pace, "watched", lambda told: watched.append(told) or nullcontext())
    for work, done, count in (({0: 1.0}, False, 0), ({0: 1.0, 1: 1.0}, False, 1), ({0: 1.0, 1: 1.0}, True, 0)):
        watched.clear()
        with cases._Progress(work) as progress:
            if done:
                progress.done(0)
            progress.watching(1)
        assert len(watched) == count
    world(monkeypatch, Comm(1, 2))
    with cases._Progress({0: 1.0, 1: 1.0}) as progress:
        progress.watching(0)
        progress.done(0)
    assert (len(watched), progress._done) == (0, set())


def test_cases_of_other_ranks_are_counted_now_and_then(tmp_path, monkeypatch, ticking):
    for name in ("3", "failed"):
        (tmp_path / name).touch()
    world(monkeypatch, Comm(0, 2))
    ticking[0] = 1.0
    with cases._Progress({0: 1.0, 1: 2.0, 2: 4.0, 3: 8.0}, 2) as progress:
        ticking[0] = 1.5
        progress.done(0, tmp_path)
        assert progress._bar.tasks[0].completed == 9.0
        (tmp_path / "2").touch()
        ticking[0] = 2.0
        progress.done(1, tmp_path)
        assert progress._bar.tasks[0].completed == 11.0
        ticking[0] = 2.01
        progress.done(1, tmp_path)
        assert progress._bar.tasks[0].completed == 15.0
        assert progress._bar.tasks[0].total == 15.0


# -- pace --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("steps", "step", "whole"),
    [(100, 0.25, 3.0 + 99 * 0.25), (1000, 1 / 64, 3.0 + 999 / 64), (20, 0.1, 3.0 + 19 * 0.1), (3, 0.1, 3.2)],
)
def test_the_pace_of_a_run(steps, step, whole, monkeypatch):
    """After half a second or a tenth of the steps behind the first, which is no measure."""
    now, told = [0.0], []
    monkeypatch.setattr(pace.clock, "monotonic", lambda: now[0])
    with pace.watched(told.append):
        now[0] = 3.0
        pace.watch.reached(1, steps)
        for k in range(2, steps + 1):
            now[0] += step
            pace.watch.reached(k, steps)
            if pace.watch is None:
                break
    assert told == [pytest.approx(whole)]
    assert k == 1 + min(math.ceil(0.5 / step - 1e-9), math.ceil(0.1 * steps - 1e-9))
    assert pace.watch is None


# -- signals -----------------------------------------------------------------------------------------------------------


def test_signals(monkeypatch):
    """Both are noted and raised; while one is held the first is noted alone, and the second raised."""
    handlers = {}
    monkeypatch.setattr(interruption.signal, "signal", handlers.__setitem__)
    monkeypatch.setattr(interruption, "_received", True)
    interruption.listen()
    assert handlers == dict.fromkeys((signal.SIGINT, signal.SIGTERM), interruption._interrupt)
    assert not interruption.received()
    interruption.check()
    with interruption.held():
        interruption._interrupt(signal.SIGINT, None)
        assert interruption.received()
        with pytest.raises(KeyboardInterrupt):
            interruption._interrupt(signal.SIGINT, None)
    with pytest.raises(KeyboardInterrupt):
        interruption.check()
    interruption.listen()
    with pytest.raises(KeyboardInterrupt):
        interruption._interrupt(signal.SIGTERM, None)
    assert interruption.received()
    interruption.ignore()
    assert handlers == dict.fromkeys((signal.SIGINT, signal.SIGTERM), signal.SIG_IGN)


# -- ranks -------------------------------------------------------------------------------------------------------------


def test_one_of_several(monkeypatch):
    for comm, several, rank in ((None, False, 0), (Comm(0, 1), False, 0), (Comm(1, 2), True, 1)):
        monkeypatch.setattr(ranks, "_world", lambda comm=comm: comm)
        assert (ranks.several(), ranks.rank()) == (several, rank)
    assert ranks.bcast(Comm(1, 2, ["theirs"]), "own") == "theirs"
    assert ranks.bcast(Comm(0, 1), "own") == "own"
    assert [ranks.allreduce(Comm(0, size), 3, lambda x: 2 * x) for size in (1, 2)] == [3, 6]


@pytest.mark.parametrize(("rank", "silent"), [(0, False), (1, True)])
def test_who_speaks(rank, silent, monkeypatch):
    """The first alone; what others print goes nowhere."""
    streams = SimpleNamespace(stdout="out", stderr="err")
    monkeypatch.setattr(ranks, "sys", streams)
    monkeypatch.setattr(ranks, "_world", lambda: Comm(rank, 2))
    ranks.only_first_speaks()
    if not silent:
        assert (streams.stdout, streams.stderr) == ("out", "err")
        return
    assert streams.stdout is streams.stderr
    with streams.stdout as nowhere:
        assert (nowhere.name, nowhere.mode) == (os.devnull, "w")


@pytest.mark.parametrize(
    ("comm", "together", "said", "aborted", "ignored"),
    [
        (None, None, ["said"], [], False),
        (Comm(0, 1), True, ["said", "flushed"], [], False),
        (Comm(0, 2), True, ["said", "flushed"], [], True),
        (Comm(1, 2), True, [], [], True),
        (Comm(0, 2), False, ["said", "flushed"], [5], True),
        (Comm(1, 2), False, ["said", "flushed"], [5], True),
    ],
)
def test_an_error_ends_all_ranks(comm, together, said, aborted, ignored, monkeypatch):
    """Where all fail the first speaks; where others wait, who failed speaks, and ends them."""
    told, handlers = [], {}
    if comm is not None:
        comm.aborted.clear()
    first = SimpleNamespace(flush=lambda: told.append("flushed"))
    own = first if comm is None or comm.rank == 0 else SimpleNamespace(flush=lambda: told.append("wrong"))
    streams = SimpleNamespace(stderr=own, __stderr__=first, exit=lambda code: told.append(code))
    monkeypatch.setattr(ranks, "_world", lambda: comm)
    monkeypatch.setattr(ranks, "_all_ended", lambda given: together)
    monkeypatch.setattr(ranks.signal, "signal", handlers.__setitem__)

    def left(code):
        raise SystemExit(code)

    streams.exit = left
    monkeypatch.setattr(ranks, "sys", streams)
    with pytest.raises(SystemExit) as stop:
        ranks.end(lambda: told.append("said"), 5)
    assert (stop.value.code, told) == (5, said)
    assert comm is None or comm.aborted == aborted
    assert handlers == (dict.fromkeys((signal.SIGINT, signal.SIGTERM), signal.SIG_IGN) if ignored else {})


@pytest.mark.parametrize(
    ("rank", "heard", "ended", "seconds"),
    [(0, {1, 2}, True, 0.0), (0, {1}, False, 1.0), (2, {0}, False, 2.0), (40, set(), False, 11.0)],
)
def test_ranks_wait_for_each_other(rank, heard, ended, seconds, monkeypatch):
    """A second, half a second more each, at most ten; the lowest loses patience first."""
    now = [100.0]
    made = SimpleNamespace(monotonic=lambda: now[0], sleep=lambda s: now.__setitem__(0, now[0] + s))
    monkeypatch.setattr(ranks, "time", made)
    comm = Comm(rank, max(3, rank + 1), heard=heard)
    assert ranks._all_ended(comm) is ended
    others = [k for k in range(comm.size) if k != rank]
    assert comm.sent == [(None, k, ranks._TAG) for k in others]
    assert comm.waited == (len(others) if ended else 0)
    assert now[0] - 100.0 == pytest.approx(max(seconds, 0.01), abs=0.011)
