"""A run on a full disk: one message, and all results computed so far are kept.

Source: resource limits of a process, and a small disk that is full.
"""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged

import dolfbuoy
from dolfbuoy.results import checkpoint
from dolfbuoy.results.record import read


def assert_ended_well(done, folder, reason):
    """One sentence, and the start of the true record."""
    assert done.returncode == 1
    sentence = done.stderr.strip().splitlines()[-1]
    assert sentence.startswith("Error: cannot read or write ")
    assert "results.nc" in sentence or "checkpoint.npz" in sentence
    assert sentence.endswith(f"{reason}.")
    assert "Traceback" not in done.stderr
    assert not list(folder.glob(".*.part"))
    record = read(folder / "results.nc")
    assert record.sizes["time"] > 10
    for name in record.variables:
        assert np.all(record[name].values == record[name].values), name
    assert checkpoint.load(folder, 1).rows["time"] <= record.sizes["time"]
    return record


FULL = merged(MOORED, cable__elements=6, waves__ramp=0.2, time={"end": 1e5, "step": 0.02, "output_every": 0.02})


SHORT_OF_SPACE = """
import itertools, resource, sys
from types import SimpleNamespace
from mpi4py import MPI  # has files of its own
from dolfbuoy.results import recorder
from dolfbuoy.commands import main as cli

ticks = itertools.count()
recorder.clock = SimpleNamespace(monotonic=lambda: float(next(ticks)))
recorder.Recorder.pause, recorder.Recorder.share = 50.0, 1e9
limit = int(sys.argv.pop(1))
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
cli.main()
"""


def run_short_of_space(folder, limit=-1):
    """A finished run that writes every 50 steps."""
    dolfbuoy.simulate(FULL, time__end=0.0)  # its forms are compiled without that limit
    folder.parent.mkdir(exist_ok=True)
    scene = folder.parent / "input.toml"
    dolfbuoy.load_scene(FULL).save(scene)
    arguments = [str(limit), "run", scene, "--out", folder, "--no-plot"]
    return subprocess.run(
        [sys.executable, "-c", SHORT_OF_SPACE, *arguments], capture_output=True, text=True, timeout=300
    )


def test_file_too_large(tmp_path):
    """The system refuses to let any file grow beyond 800 kB."""
    record = assert_ended_well(run_short_of_space(tmp_path / "run", 800_000), tmp_path / "run", "File too large")
    resumed = dolfbuoy.simulate(resume=tmp_path / "run", time__end=record.time.values[-1] + 0.1)
    assert np.array_equal(resumed.end_tension.values[: len(record.time)], record.end_tension.values)
    assert np.diff(resumed.time.values) == pytest.approx(0.02, abs=1e-9)


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 1.2 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if (
        shutil.which("mount") is None
        or subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1200k", "tmpfs", folder], capture_output=True).returncode
    ):
        pytest.skip("mounting a file system needs privileges")
    yield folder
    subprocess.run(["umount", folder], check=True)


@pytest.mark.slow
def test_disk_full(small_disk):
    assert_ended_well(run_short_of_space(small_disk), small_disk, "No space left on device")
