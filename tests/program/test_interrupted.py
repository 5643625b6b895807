"""Ctrl-C at any moment ends with one message, and runs reported as resumable resume.

Source: exit codes and messages promised in README; the resumed run.
"""

import signal
import subprocess
import sys

import pytest
from chains import CHAIN, OTHER

import dolfbuoy
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.parallel import interruption
from dolfbuoy.results.record import read

#: Interrupts itself when the module argv[1] is about to be imported.
AT_IMPORT = """
import os, signal, sys
from dolfbuoy.commands import entry

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == module:
            sys.meta_path.remove(finder)
            os.kill(os.getpid(), signal.SIGINT)

module, finder = sys.argv.pop(1), Finder()
sys.meta_path.insert(0, finder)
entry.main()
"""


@pytest.mark.parametrize("module", ["typer", "mpi4py.MPI", "numpy", "dolfinx", "dolfbuoy.motion.simulation"])
def test_interrupted_at_start_up(files, module):
    arguments = [module, "run", "chain.toml", "--out", "out", "--no-plot"]
    done = subprocess.run([sys.executable, "-c", AT_IMPORT, *arguments], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.strip().startswith("Interrupted")
    assert done.stderr.strip().count("\n") == 0
    assert "resume" not in done.stderr


@pytest.mark.parametrize("old", [None, CHAIN, OTHER], ids=["no old run", "of the same scene", "of another scene"])
@pytest.mark.parametrize("where", ["__init__", "advance"])
def test_a_promise_that_is_kept(call, files, monkeypatch, where, old):
    """--resume is spoken of when there is a checkpoint of this very scene, and then it works."""
    if old is not None:
        dolfbuoy.simulate(old, out="out")

    def interrupted(*_, **__):
        interruption._interrupt(signal.SIGINT, None)

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, where, interrupted)
        code, _, err = call("run", "chain.toml", "--out", "out", "--no-plot", "--overwrite")
    assert code == 130
    assert "Traceback" not in err
    promised = where == "advance" or old is CHAIN
    assert ("dolfbuoy run --resume out" in err) == promised, err
    assert ("before the first step" in err) == (not promised)
    if promised:
        assert call("run", "--resume", "out", "--no-plot")[0] == 0
        assert read("out/results.nc").sizes["time"] == 6


@pytest.mark.parametrize("arguments", [["check", "short"], ["static", "short"], ["list"], ["plot", "out"]])
def test_other_commands_end_with_a_word(call, files, monkeypatch, arguments):
    dolfbuoy.simulate(CHAIN, out="out")

    def interrupted(*_, **__):
        interruption._interrupt(signal.SIGINT, None)

    for place in ("dolfbuoy.scene.load_scene", "dolfbuoy.scene.shipped_scenes", "dolfbuoy.results.figures.draw_all"):
        monkeypatch.setattr(place, interrupted)
    assert call(*arguments)[::2] == (130, "Interrupted.\n")
