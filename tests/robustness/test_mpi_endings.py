"""Termination of several ranks: one message, no process left, a readable record; and their start with an empty cache.

Source: exit codes, messages and remaining processes.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mpi_helpers import command, environment, needs_mpirun, start

from dolfbuoy import load_scene
from dolfbuoy.results.record import read
from dolfbuoy.solver import compat

pytestmark = [pytest.mark.mpi, needs_mpirun]

ROD = {
    "cable": {"length": 3.0, "line_density": 2.0, "elements": 4, "top": {"kind": "free", "force": [1.0, 2.0, 0.0]}},
    "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.8, 0.0, -2.4]]},
    "time": {"end": 0.1, "step": 0.01},
}

#: The command line on every rank, with a fault: where sys.argv[1] says so, adding the sixth row raises it.
SCRIPT = """
import os, sys
from mpi4py import MPI
from dolfbuoy.results import recorder
from dolfbuoy.commands import main as cli
from dolfbuoy.errors import InputError, SolveError

rank, fault = MPI.COMM_WORLD.rank, sys.argv.pop(1)
open(f"pid-{rank}", "w").write(str(os.getpid()))
whole, calls = recorder.Recorder.add, []

def add(self, *values):
    calls.append(values)
    if len(calls) == 6 and (rank == 1 or fault.endswith("everywhere")):
        if fault.startswith("input"):
            raise InputError("of the test.")
        if fault.startswith("solve"):
            raise SolveError("of the test.")
        if fault.startswith("crash"):
            raise ZeroDivisionError("of the test")
    return whole(self, *values)

recorder.Recorder.add = add
cli.main()
"""


@pytest.fixture
def folder(tmp_path):
    """With the script and the scene of a rod."""
    (tmp_path / "command.py").write_text(SCRIPT)
    load_scene(ROD).save(tmp_path / "rod.toml")
    return tmp_path


def nobody_left(folder):
    """Whether every rank that said its process id has ended; they get a moment for it."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        if not any(alive(int(path.read_text())) for path in folder.glob("pid-*")):
            return True
        time.sleep(0.1)
    return False


def alive(pid):
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False


@pytest.mark.parametrize(
    ("fault", "code", "message"),
    [
        pytest.param("input on one rank", 2, "Error: of the test.", marks=pytest.mark.slow),
        pytest.param("solve everywhere", 1, "The solve failed. of the test.", marks=pytest.mark.slow),
        ("crash on one rank", 1, "Error on rank 1"),
    ],
)
def test_an_error_ends_all_ranks_with_one_message(folder, fault, code, message):
    arguments = ["command.py", fault, "run", "rod.toml", "--out", "out", "--no-plot"]
    done = start(2, arguments, folder, timeout=120)
    assert done.returncode == code, done.stderr
    assert done.stderr.count(message) == 1, done.stderr
    assert done.stderr.count("Traceback") == fault.startswith("crash")
    assert nobody_left(folder)
    record = read(folder / "out" / "results.nc")
    assert record.sizes["time"] >= 1
    assert np.isfinite(record.tension_top).all()


def test_only_rank_0_speaks(folder):
    done = start(2, ["command.py", "none", "run", "rod.toml", "--out", "out", "--no-plot"], folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("force at the anchor") == 1
    assert done.stderr.count("Traceback") == 0
    assert read(folder / "out" / "results.nc").sizes["time"] == 11
    done = start(2, ["command.py", "none", "run", "--frobnicate"], folder)
    assert done.returncode == 2
    assert done.stderr.count("--frobnicate") == 1


@pytest.mark.parametrize("how", [pytest.param("Ctrl-C", marks=pytest.mark.slow), "rank 1 is killed"])
def test_a_broken_off_run_leaves_a_readable_record(folder, how):
    arguments = ["command.py", "none", "run", "rod.toml", "--t-end", "1000", "--out", "out", "--no-plot"]
    process = subprocess.Popen(
        command(2, arguments),
        cwd=folder,
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a background shell ignores it
    )
    path, deadline = folder / "out" / "results.nc", time.monotonic() + 120
    while not path.exists() or read(path).sizes["time"] < 3:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.2)
    if how == "Ctrl-C":
        process.send_signal(signal.SIGINT)
    else:
        os.kill(int((folder / "pid-1").read_text()), signal.SIGKILL)
    _, err = process.communicate(timeout=60)
    assert process.returncode != 0
    assert "Traceback" not in err
    assert err.count("Interrupted") <= 1
    assert nobody_left(folder)
    record = read(path)
    assert record.sizes["time"] >= 3
    assert np.isfinite(record.tension_top).all()
    assert np.isfinite(record.cable_position).all()


@pytest.mark.slow
def test_a_cold_start_of_several_processes(folder):
    """Two ranks and two processes beside them compile the same forms at once: every form once, the same results."""
    forms = folder / "cache" / compat.jit_cache().name
    more = {"XDG_CACHE_HOME": folder / "cache"}

    def run(out, ranks=None):
        arguments = ["-m", "dolfbuoy.commands.main", "run", "rod.toml", "--out", out, "--no-plot"]
        line = command(ranks, arguments) if ranks else [sys.executable, *arguments]
        return subprocess.Popen(line, cwd=folder, env=environment(**more), stderr=subprocess.PIPE, text=True)

    processes = [run("two", 2), run("one"), run("another")]
    errors = [process.communicate(timeout=300)[1] for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0], errors
    compiled = {path.name for path in forms.glob("*.c")}
    assert len(compiled) >= 4
    assert {path.name.removesuffix(".cached") for path in forms.glob("*.cached")} == compiled
    one, another, two = (read(folder / name / "results.nc") for name in ("one", "another", "two"))
    np.testing.assert_array_equal(one.cable_position, another.cable_position)
    np.testing.assert_allclose(two.cable_position, one.cable_position, rtol=0, atol=1e-8)

    for path in forms.glob("*.cached"):  # as if all had been killed while compiling
        path.unlink()
        break
    begin = time.monotonic()
    process = run("again", 2)
    errors = process.communicate(timeout=300)[1]
    assert process.returncode == 0, errors
    assert time.monotonic() - begin < 120  # FFCx itself would wait for the dead as long as for the living
    assert {path.name for path in forms.glob("*.c")} == compiled  # the names of the forms are the same at every start
    assert {path.name.removesuffix(".cached") for path in forms.glob("*.cached")} == compiled


#: Rank 1 compiles a form of its own while rank 0 waits for it in one that all ranks compile together.
TOGETHER_AND_ALONE = """
import time
import ufl
from mpi4py import MPI
from dolfbuoy.solver import compat

def mass(comm, factor):
    mesh = compat.interval_mesh(comm, [0.0, 1.0, 2.0, 3.0])
    space = compat.function_space(mesh, compat.element(mesh, "P", 1))
    return factor * ufl.TrialFunction(space) * ufl.TestFunction(space) * ufl.dx

together, alone = mass(MPI.COMM_WORLD, 2), mass(MPI.COMM_SELF, 3)
if MPI.COMM_WORLD.rank == 1:
    time.sleep(2)
    compat.compile_form(alone)
compat.compile_form(together)
print("compiled")
"""


def test_no_rank_waits_for_a_compiler_that_waits_for_it(folder):
    (folder / "compile.py").write_text(TOGETHER_AND_ALONE)
    done = start(2, ["compile.py"], folder, timeout=120, XDG_CACHE_HOME=folder / "cache")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("compiled") == 2
