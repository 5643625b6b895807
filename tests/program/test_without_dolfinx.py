"""Installed by pip on a system without dolfinx: each command works, or reports what is missing.

Source: packages hidden one by one; exit codes and messages.
"""

import json
import subprocess
import sys

import pytest

from dolfbuoy.errors import OF_THE_SYSTEM

#: Hides packages, then runs command lines in one process: [exit code, standard output, standard error] of each.
SCRIPT = """
import contextlib, io, json, sys
for name in json.loads(sys.argv[1]):
    sys.modules[name] = None  # an import of it fails as if it were not there
from dolfbuoy.commands.main import main
import dolfbuoy

def call(arguments):
    sys.argv = ["dolfbuoy", *arguments]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        try:
            main()
            code = 0
        except SystemExit as stop:
            code = stop.code or 0
    return [code, out.getvalue(), err.getvalue()]

def import_error():
    try:
        dolfbuoy.simulate
    except ImportError as error:
        return str(error)

ends = [call(arguments) for arguments in json.loads(sys.argv[2])]
title = dolfbuoy.load_scene("short").title
print(json.dumps([ends, title, import_error()]))
"""
WORK = (["list"], ["--version"], ["--help"], ["study", "--help"], ["keys", "cable"], ["schema"], ["new", "mine"])
NEED = (
    ["check", "short"],
    ["static", "short"],
    ["run", "short"],
    ["sweep", "short", "--vary", "gravity=1,2"],
    ["advise", "short"],
    ["study", "accuracy"],
    ["study", "inf-sup"],
)
BAD = (["check", "nowhere"], ["check", "short", "--set", "gravity=-1"])


def without(packages, folder):
    arguments = [json.dumps(packages), json.dumps([*WORK, *NEED, *BAD, ["doctor"]])]
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *arguments], cwd=folder, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    "packages", [["dolfinx"], ["petsc4py"], ["mpi4py"], list(OF_THE_SYSTEM)], ids=lambda packages: " ".join(packages)
)
def test_each_command_works_or_says_what_is_missing(tmp_path, packages):
    ends, title, import_error = without(packages, tmp_path)
    worked, needed, bad, doctor = ends[:7], ends[7:14], ends[14:16], ends[16]
    assert title.startswith("Tethered buoy")
    assert (tmp_path / "mine.toml").is_file()
    for code, out, err in worked:
        assert (code, err) == (0, "")
        assert out
    for code, _, err in needed:
        assert code == 2
        assert err.startswith("Error: ")
        assert any(f"{name} is not installed" in err for name in packages)
        assert err.count("\n") == 1
    assert import_error in err
    assert [code for code, *_ in bad] == [2, 2]
    assert "is not installed" not in bad[0][2] + bad[1][2]  # what is wrong with the scene comes first
    assert doctor[0] == 2
    assert ", ".join(packages) in doctor[2]
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("package", "line"), [("ufl", "check short"), ("basix", "check short"), ("ffcx", "check short"), ("h5py", "doctor")]
)
def test_what_dolfinx_itself_needs(package, line):
    """In one command: half of dolfinx is imported then, and a second attempt would find it."""
    script = f"import sys; sys.modules[{package!r}] = None; from dolfbuoy.commands.entry import main; main()"
    done = subprocess.run([sys.executable, "-c", script, *line.split()], capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert package in done.stderr
    assert "not installed" in done.stderr
    assert done.stderr.count("\n") == 1
