"""Studies on two ranks: the same files as on one, apart from times, and nothing is computed twice.

Source: the same study on one rank.
"""

import json
import os

import dynamics_helpers
import pytest
from dynamics_helpers import MOORED, merged
from mpi_helpers import needs_mpirun, start
from test_sweep_parts import lines

from dolfbuoy import load_scene
from dolfbuoy.studies.accuracy import inf_sup, work_precision
from dolfbuoy.studies.physics import effects
from dolfbuoy.studies.study import run

pytestmark = [
    pytest.mark.slow,  # many forms
    pytest.mark.mpi,
    needs_mpirun,
]

WET = merged(MOORED, cable__elements=3, waves__ramp=0.1, time={"end": 0.3, "step": 0.02})
WET = merged(WET, external_force=None, buoy__normal_drag=0.0, cable__normal_drag=0.0, cable__tangential_drag=0.0)
DRY = {
    "cable": {"length": 1.0, "line_density": 1.0, "elements": 4, "top": {"kind": "free"}},
    "initial": {"kind": "polyline", "points": [[0, 0, 0], [0.6, 0.0, -0.8]]},
    "time": {"end": 0.2, "step": 0.01},
}
GRID = {"pairs": [(1, 0), (2, 1)], "cells": [2, 4], "schemes": ["bdf2"], "steps": [0.02], "tolerances": []}


def inf_sup_few(folder):
    whole = inf_sup.cases
    inf_sup.cases = lambda: whole(("catenary", "straight"), [(1, 0), (1, 1), (2, 1)], (4, 8))
    try:
        run(inf_sup.study, folder)
    finally:
        inf_sup.cases = whole


#: Study -> (run(folder), files whose rows must agree).
STUDIES = {
    "inf-sup": (inf_sup_few, ["inf-sup", "inf-sup-summary"]),
    "effects": (lambda folder: run(effects.study, folder, scene=load_scene(WET)), ["effects"]),
    "work-precision": (
        lambda folder: run(work_precision.study, folder, scene=load_scene(DRY), repeats=1, **GRID),
        ["work-precision"],
    ),
}
#: What differs from run to run.
TIMES = {"wall", "cpu", "step_time", "base_step_time", "time_ratio"}


def rows(folder, name):
    """Rows of a study's table, without times."""
    table = json.loads((folder / f"{name}.json").read_text())["rows"]
    assert table
    return [{key: value for key, value in row.items() if key not in TIMES} for row in table]


def key_of(line):
    return json.loads(line.partition(b" ")[2])["key"]


@pytest.fixture(scope="module")
def by_two(tmp_path_factory):
    """Folder in which two ranks ran all studies, each in a folder of its name."""
    folder = tmp_path_factory.mktemp("two")
    program = "import test_study_ranks as t\nfor name, (run, _) in t.STUDIES.items(): run(name)"
    path = os.pathsep.join([os.path.dirname(__file__), os.path.dirname(dynamics_helpers.__file__)])
    done = start(2, ["-c", program], folder, timeout=900, PYTHONPATH=path)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


@pytest.mark.parametrize("study", STUDIES)
def test_rows_do_not_depend_on_the_ranks(study, by_two, tmp_path, monkeypatch):
    run, names = STUDIES[study]
    monkeypatch.chdir(tmp_path)
    run(study)
    for name in names:
        assert rows(tmp_path / study, name) == rows(by_two / study, name)


@pytest.mark.parametrize("study", STUDIES)
def test_what_two_ranks_computed_is_not_computed_again(study, by_two, monkeypatch):
    """One rank goes on from the files of two: only what was deleted is evaluated, and the table is the same."""
    run, names = STUDIES[study]
    monkeypatch.chdir(by_two)
    before = {name: rows(by_two / study, name) for name in names}
    store = by_two / study / "cases"
    written = set(lines(store))
    run(study)
    assert set(lines(store)) == written
    file = max(store.glob("*.jsonl"))
    *left, last = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(left))
    run(study)
    assert written - {last} <= set(lines(store))
    (again,) = set(lines(store)) - (written - {last})
    assert key_of(again) == key_of(last)
    assert {name: rows(by_two / study, name) for name in names} == before
