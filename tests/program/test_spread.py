"""Many cases over ranks, and one scene over ranks: distribution of work, messages, and errors that end all ranks.

Source: a serial loop over the same cases.
"""

import json
import os
import subprocess
import sys

import pytest
from mpi_helpers import start

from dolfbuoy import load_scene
from dolfbuoy.results.summary import SHARING_SLOWER_TO, sharing_note

SCRIPT = """
import json, sys, time
from pathlib import Path
from mpi4py import MPI
from dolfbuoy.errors import InputError
from dolfbuoy.parallel.cases import evaluate_all

def evaluate(case):
    time.sleep(0.05)
    if case["i"] == int(sys.argv[2]):
        raise InputError("case %d is bad" % case["i"])
    return {"rank": MPI.COMM_WORLD.rank}

try:
    cases = [{"i": i} for i in range(12)]
    rows = evaluate_all(evaluate, cases, Path(sys.argv[1]), structure=lambda case: case["i"] % 2)
    if rows is not None:
        print(json.dumps(rows))
except InputError as error:
    with open(f"rank{MPI.COMM_WORLD.rank}.txt", "w") as file:  # mpirun mixes what ranks print at the same time
        file.write(str(error))
"""


def spread(tmp_path, bad, ranks=2):
    """Lines that the script prints under mpirun."""
    (tmp_path / "script.py").write_text(SCRIPT)
    done = start(ranks, ["script.py", tmp_path / "out", bad], tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


@pytest.mark.mpi
def test_every_rank_works_and_rows_keep_their_order(tmp_path):
    (line,) = spread(tmp_path, bad=-1)
    rows = json.loads(line)
    assert [row["i"] for row in rows] == list(range(12))
    assert {row["rank"] for row in rows} == {0, 1}  # the first rank is not only a clerk
    assert rows[0]["rank"] == rows[1]["rank"] == 0  # one case of each structure first, by one rank


@pytest.mark.mpi
def test_error_of_one_rank_is_that_of_all_and_finished_cases_are_kept(tmp_path):
    assert spread(tmp_path, bad=7) == []
    assert [(tmp_path / f"rank{k}.txt").read_text() for k in (0, 1)] == ["case 7 is bad"] * 2
    kept = sum(file.read_bytes().count(b"\n") for file in (tmp_path / "out" / "cases").glob("*.jsonl"))
    assert 2 <= kept < 12
    assert not list((tmp_path / "out" / "cases").glob("claims-*"))
    assert len(json.loads(spread(tmp_path, bad=-1)[0])) == 12


def test_note_about_ranks_that_do_not_pay():
    scene = load_scene("short")
    assert sharing_note(scene, 1) is None
    assert "20" in sharing_note(scene, 2)
    assert sharing_note(load_scene("free-buoy"), 2)
    large = [[11.0, SHARING_SLOWER_TO], [11.0, 5]]
    assert sharing_note(load_scene(scene, cable__elements=large), 2) is None


TELL = """
import os, sys
from importlib.abc import MetaPathFinder

def settings():
    return sorted(name for name in os.environ if name.startswith("OMPI_MCA"))

class Watch(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == "mpi4py.MPI":
            self.found = settings()

watch = Watch()
sys.meta_path.insert(0, watch)
import dolfbuoy
before = settings()
if "PMIX_RANK" not in os.environ:
    import dolfbuoy.api
    assert "mpi4py.MPI" in sys.modules
print(before, getattr(watch, "found", []), settings())
"""
SETTINGS = ["OMPI_MCA_btl", "OMPI_MCA_ess_singleton_isolated", "OMPI_MCA_pml"]


@pytest.mark.parametrize(
    ("own", "before", "during", "after"),
    [
        ({}, [], SETTINGS, []),
        ({"OMPI_MCA_pml": "^ucx"}, ["OMPI_MCA_pml"], SETTINGS, ["OMPI_MCA_pml"]),
        ({"PMIX_RANK": "0"}, [], [], []),
    ],
    ids=["alone", "with a setting of its own", "one of several"],
)
def test_what_open_mpi_is_told_of_a_process_alone(own, before, during, after):
    """It is told while it starts; nothing of it is left for what the process starts, nor said in the user's place."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("OMPI_MCA", "PMI"))}
    command = [sys.executable, "-c", TELL]
    done = subprocess.run(command, env=environment | own, capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == f"{before} {during} {after}", done.stderr
