"""The command line: what it prints, what it writes, and its exit codes.

Source: README's description of commands and exit codes.
"""

import signal
import subprocess
import sys
import time

import pytest
import typer
import xarray as xr

from dolfbuoy.commands import main as cli
from dolfbuoy.results.record import read

SHORT = ["--set", "time.end=0.03", "--no-plot"]


def test_list_names_the_shipped_scenes(call):
    code, out, _ = call("list")
    assert code == 0
    for name in ("short", "long", "jumper", "jumper-waves", "free-buoy", "hanging-chain", "driven", "storm"):
        assert name in out


def test_check_prints_derived_numbers_and_warnings(call):
    code, out, _ = call("check", "short", "--set", "waves.amplitude=3.5")
    assert code == 0
    for text in ("cable weight in water", "GM with the weight", "buoy, heave", "buoy, pitch", "cable out of plane 1"):
        assert text in out
    for text in ("dispersion mismatch", "D/lambda", "Keulegan-Carpenter", "Eq. (24)", "38.8 %", "breaking limit"):
        assert text in out


def test_static_writes_a_scene_that_reproduces_it(call, tmp_path):
    assert call("static", "short", "--out", tmp_path / "a")[0] == 0
    assert call("static", tmp_path / "a" / "static.toml", "--out", tmp_path / "b")[0] == 0
    first, second = (xr.load_dataset(tmp_path / d / "static.nc") for d in "ab")
    assert float(first.tension_top) > 5000
    xr.testing.assert_equal(first, second)


def test_run_and_plot(call, tmp_path):
    code, out, _ = call("run", "short", "--out", tmp_path, "--t-end", "0.02", "--no-plot")
    assert code == 0
    assert "tension at the top" in out
    assert read(tmp_path / "results.nc").time.values[-1] == pytest.approx(0.02)
    assert not (tmp_path / "figures").exists()
    code, out, _ = call("plot", tmp_path)
    assert code == 0
    assert "No spectrum of the motion" in out
    assert not (tmp_path / "paraview").exists()
    assert not (tmp_path / "figures" / "tension.svg").exists()
    assert call("plot", tmp_path, "--paraview", "--svg")[0] == 0
    assert (tmp_path / "figures" / "tension.svg").stat().st_size > 5000
    assert (tmp_path / "figures" / "tension.png").stat().st_size > 5000
    assert list((tmp_path / "paraview").glob("*.vtu"))


def test_run_without_files_for_paraview(call, tmp_path):
    code, out, _ = call("run", "driven", "--out", tmp_path, "--t-end", "0.02")
    assert code == 0
    assert f"files in {tmp_path / 'figures'}\n" in out
    assert (tmp_path / "figures" / "snapshot.png").is_file()
    assert not (tmp_path / "paraview").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "nowhere", *SHORT], ["nowhere", "short"]),
        (["run", "short", "--set", "cable.lenght=3"], ["cable.lenght", "length"]),
        (["run", "short", "--set", "cable.length=-3"], ["cable.length", "-3", "greater than 0"]),
        (["run", "short", "--set", "cable.length"], ["--set", "section.key=value"]),
        (["run", "short", "--set", "buoy.mass=1e6"], ["sinks", "buoy.mass"]),
        (["run", "short", "--set", "time.end=nan"], ["time.end", "finite"]),
        (["plot", "nowhere"], ["nowhere", "results.nc"]),
        (["sweep", "short"], ["--vary", "--table"]),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(call, arguments, words):
    code, _, err = call(*arguments)
    assert code == 2
    assert "Traceback" not in err
    assert err.strip().count("\n") == 0
    for word in words:
        assert word in err


def test_unknown_command_is_bad_usage(call):
    assert call("frobnicate")[0] == 2
    code, _, err = call("respons")
    assert (code, "Did you mean 'response'" in err) == (2, True)


@pytest.mark.parametrize(
    "command", ["list", "check", "static", "run", "plot", "doctor", "sweep", "advise", "new", "keys", "schema"]
)
def test_help_shows_an_example(call, command):
    code, out, _ = call(command, "--help")
    assert code == 0
    assert "Example: " in out.replace("\n", " ")


def test_help_shows_every_word(call, monkeypatch):
    """Units and defaults in brackets too, which rich would take for styles."""
    monkeypatch.setenv("COLUMNS", "250")
    group = typer.main.get_command(cli.app)
    commands = [([name], group.get_command(None, name)) for name in group.list_commands(None) if name != "study"]
    commands += [(["study", name], c) for name, c in group.get_command(None, "study").commands.items()]
    brackets = 0
    for words, command in commands:
        _, out, _ = call(*words, "--help")
        for parameter in command.params:
            text = (parameter.help or "").replace("\\[", "[")
            brackets += "[" in text
            assert text in " ".join(out.replace("│", " ").split()), f"{words}: {text}"
    assert brackets > 20


def test_failed_solve_is_exit_code_1_and_names_the_place(call, tmp_path):
    """A Newton method that may not iterate fails at every step size."""
    petsc = "solver.petsc={snes_max_it = 1, snes_linesearch_max_it = 1}"
    code, _, err = call(
        "run", "short", "--out", tmp_path, "--set", petsc, "--set", "solver.step_tolerance=1e-300", *SHORT
    )
    assert code == 1
    for word in ("t = ", "step ", "DIVERGED_MAX_IT", "residual in"):
        assert word in err


@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGINT, 130), pytest.param(signal.SIGTERM, 130, marks=pytest.mark.slow), (signal.SIGKILL, -9)],
)
def test_an_interrupted_run_leaves_its_record(tmp_path, number, code):
    options = ["--out", str(tmp_path), "--no-plot", "--set", "time.end=1e5"]  # which is not over before the signal
    process = subprocess.Popen(
        [sys.executable, "-m", "dolfbuoy.commands.entry", "run", "short", *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(
            signal.SIGINT, signal.SIG_DFL
        ),  # a background shell ignores it, and its children
    )
    deadline = time.monotonic() + 120
    while not (tmp_path / "results.nc").exists() or read(tmp_path / "results.nc").sizes["time"] < 2:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.2)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == code
    record = read(tmp_path / "results.nc")
    assert record.sizes["time"] >= 2
    for name, variable in record.variables.items():  # not to_array(): all as large as their product, gigabytes
        assert not variable.isnull().any(), name
    if code == 130:
        assert "Interrupted" in err


def test_doctor_fails_with_one_test_that_does(call, monkeypatch):
    from dolfbuoy.commands import doctor

    monkeypatch.setattr(doctor, "examine", lambda: [("forms", True, "compile"), ("MPI", False, "does not start")])
    code, out, _ = call("doctor")
    assert code == 1
    assert "ok     forms: compile" in out
    assert "FAILED MPI: does not start" in out


def test_doctor(call):
    code, out, _ = call("doctor")
    assert code == 0, out
    assert out.count("ok ") == 3
    assert "dolfinx" in out
