"""Files and progress messages of a sweep, from made-up results.

Source: counts, means and dates by hand.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr
from chains import CHAIN

from dolfbuoy import InputError, load_scene
from dolfbuoy.parallel.cases import key
from dolfbuoy.studies import sweep

NONE = {"statistics": {}, "sample": None}


@pytest.fixture
def results(monkeypatch):
    """Results by the names of their cases, in place of a store."""
    known = {}
    store = Fake(entries=known, damaged=["a sentence"], foreign=4, results=lambda names: [known.get(n) for n in names])
    monkeypatch.setattr(sweep, "store_in", lambda folder: store)
    return known


def test_progress_of_a_sweep(results, tmp_path):
    """Of all cases, or of those of a part; seconds are of what is done."""
    plan = sweep.plan(CHAIN, ["cable.length=9,10,11,12,13"], None)
    names = [key(case) for case in plan.cases]
    found = sweep.status(plan, tmp_path)
    assert (found["cases"], found["missing"], found["begun"]) == (5, 5, 0)
    assert math.isnan(found["seconds"])
    for name, status, seconds in ((0, "done", 3.0), (1, "it failed", 50.0), (2, "done", 6.0), (3, "it failed", 1.0)):
        results[names[name]] = {"status": status, "seconds": seconds}
    for name in ("x", "y"):
        (tmp_path / "cases" / "running" / name).mkdir(parents=True)
    (tmp_path / "cases" / "running" / "file").touch()
    assert sweep.status(plan, tmp_path) == {
        "cases": 5,
        "done": 2,
        "failed": 2,
        "missing": 1,
        "begun": 2,
        "seconds": 4.5,
        "reasons": {"it failed": 2},
        "damaged": ["a sentence"],
        "foreign": 4,
    }
    found = sweep.status(plan, tmp_path, sweep.Part(2, 2))
    assert [found[name] for name in ("cases", "done", "failed", "missing")] == [2, 0, 2, 0]


def test_what_a_sweep_writes(results, tmp_path, monkeypatch):
    """Cases without a result too; the date of the last one, how it was made, and what of the steps was cut."""
    told = []
    monkeypatch.setattr(
        sweep, "collect", lambda rows: told.append(rows) or xr.Dataset({"a": ("case", [1.0, 2.0, 3.0])})
    )
    monkeypatch.setattr(sweep, "enlist", lambda folder, files, kind: told.append(([f.name for f in files], kind)))
    monkeypatch.setattr(sweep, "draw", lambda dataset: "figure")
    monkeypatch.setattr(sweep, "style", Fake(save=lambda *given: told.append(given)))
    monkeypatch.setattr(sweep, "write_pages", lambda *given: told.append(given))
    monkeypatch.setattr(sweep.compat, "versions", lambda: {"numpy": "9"})
    plan = sweep.plan(CHAIN | {"title": "chains"}, ["cable.length=9,10,11"], None, source="chain --set a=\x1b1")
    names = [key(case) for case in plan.cases]
    sample = {"criteria": ["met"], "series": {}}
    results[names[2]] = {"status": "done", "statistics": {"x": 1}, "sample": sample, "cut": 0.25, "created": "2026-02"}
    results[names[0]] = {"status": "it failed", "created": "2026-03"} | NONE
    made = sweep._written(plan, tmp_path)
    enlisted, rows, *others = told
    assert [row.pop("changes") for row in rows] == [{"cable.length": x} for x in (9, 10, 11)]
    assert rows == [
        {"base": plan.cases[0]["base"], "status": status, "statistics": numbers, "criteria": criteria}
        for status, numbers, criteria in (("it failed", {}, []), ("not computed", {}, []), ("done", {"x": 1}, ["met"]))
    ]
    assert enlisted == (["sweep.nc", "sweep.png", "sweep.svg", "sweep.html"], "sweep")
    assert others == [("figure", tmp_path / "sweep"), (tmp_path, "sweep.nc")]
    assert made.cut_steps.values.tolist() == [0.0, 0.0, 0.25]
    assert made.cut_steps.attrs["units"] == "1"
    expected = {"title": "chains", "scene": plan.base.to_toml(), "created": "2026-03", "version_numpy": "9"}
    assert {name: made.attrs[name] for name in expected} == expected
    assert made.attrs["source"].startswith("chain --set a=")
    assert "\x1b" not in made.attrs["source"]
    assert made.attrs["computed_by"] == f"dolfbuoy {sweep.__version__}"
    with xr.open_dataset(tmp_path / "sweep.nc") as kept:
        np.testing.assert_array_equal(kept.a, made.a)


def test_a_folder_without_cases_is_not_collected(tmp_path):
    plan = sweep.plan(CHAIN, ["cable.length=9"], None)
    with pytest.raises(InputError, match="holds no results of a sweep: it has no folder cases"):
        sweep.collected(plan, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["0/3", "4/3", "1/0", "1/3/5", "-1/3", "1.0/3", "1/1234567890", "a/b"])
def test_parts_that_there_are_not(text):
    with pytest.raises(InputError, match=f"--part {text}: must be i/n, part i of n, with i from 1 to n"):
        sweep.Part.parse(text)


def test_a_wavelength_that_stays():
    """While the period varies, unless it is varied with it, or all of the waves are."""
    free = load_scene("short", **{"waves.wavelength": None})
    held = load_scene("short", **{"waves.wavelength": 40.0})
    for scene in (free, held):
        sweep.check_wavelength(scene, [{"waves.height": 1.0}])
        sweep.check_wavelength(scene, [{"waves.period": 5.0, "waves.wavelength": 39.0}])
        sweep.check_wavelength(scene, [{"waves.period": 5.0}, {"waves": None}])
    sweep.check_wavelength(free, [{"waves.period": 5.0}])
    with pytest.raises(InputError, match=r"waves.wavelength = 40.0: would stay while waves.period varies"):
        sweep.check_wavelength(held, [{"waves.height": 1.0}, {"waves.period": 5.0}])
