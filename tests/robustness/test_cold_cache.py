"""Parallel compilation: other cores help with missing forms, and waiting is always announced.

Source: process counts, files and clocks of this machine.
"""

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial

import pytest

from dolfbuoy.solver import jit


@pytest.fixture
def three_cores(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 2})


def compiled(folder, name):
    with jit.alone(folder, name):
        if not (folder / name).exists():
            (folder / name).write_text(str(os.getpid()))
            time.sleep(0.05)


def test_other_cores_take_steps_from_the_end(tmp_path, three_cores):
    names = [f"form{k}" for k in range(12)]
    steps = [partial(compiled, tmp_path, name) for name in names]
    with jit.helped(steps):
        for step in steps:
            step()
    by = [int((tmp_path / name).read_text()) for name in names]
    assert by[0] == os.getpid() != by[-1]
    assert len(set(by)) == 3
    assert jit._team.helpers == []
    for helper in set(by) - {os.getpid()}:
        with pytest.raises(ProcessLookupError):
            os.kill(helper, 0)


def test_nobody_is_called_where_nothing_is_missing(monkeypatch):
    monkeypatch.setattr(os, "fork", None)
    with jit.helped([print, print]):
        pass


def test_helpers_end_with_the_block_that_fails(tmp_path, three_cores):
    def fails():
        with jit.helped([partial(time.sleep, 30)] * 3):
            compiled(tmp_path, "form")
            time.sleep(0.2)
            raise ZeroDivisionError

    begin = time.monotonic()
    with pytest.raises(ZeroDivisionError):
        fails()
    assert time.monotonic() - begin < 10
    assert jit._team.helpers == []


def test_what_a_helper_raises_is_left_to_the_block(tmp_path, three_cores):
    def fails():
        raise OSError("no space")

    with jit.helped([partial(compiled, tmp_path, "last"), fails]):
        compiled(tmp_path, "first")
    assert (tmp_path / "last").exists()  # the step after the one that failed


HOLDS = """
import sys, time
from pathlib import Path
from dolfbuoy.solver import jit
with jit.alone(Path(sys.argv[1]), "form"):
    print("holds", flush=True)
    time.sleep(float(sys.argv[2]))
"""


@pytest.mark.parametrize("stopped", [False, True])
def test_waiting_for_another_process_is_said(tmp_path, caplog, monkeypatch, stopped):
    monkeypatch.setattr(jit, "SECONDS_OF_SILENCE", 0.1)
    with subprocess.Popen([sys.executable, "-c", HOLDS, tmp_path, "0.6"], stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"holds\n"
        if stopped:
            other.send_signal(signal.SIGSTOP)
            threading.Timer(1.0, other.send_signal, [signal.SIGCONT]).start()
        with caplog.at_level(logging.WARNING, "dolfbuoy"), jit.alone(tmp_path, "another"):
            assert caplog.messages == []  # each form has a lock of its own
        with caplog.at_level(logging.WARNING, "dolfbuoy"), jit.alone(tmp_path, "form") as locked:
            assert locked
        words = ", which is stopped and" if stopped else ", which"
        assert caplog.messages == [f"Waiting for process {other.pid}{words} compiles form."]


def test_compilation_is_a_notice_and_what_the_compiler_says_is_not(tmp_path, caplog):
    with caplog.at_level(jit.NOTICE, "dolfbuoy"), jit.quiet_compiler(), jit.helped([print]):
        logging.getLogger("dolfbuoy").info("gcc -c")
        compiled(tmp_path, "form")
    assert caplog.messages == ["Compiling what this combination of effects needs, once on this machine."]
