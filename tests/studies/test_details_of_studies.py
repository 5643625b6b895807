"""Details of studies, cases and messages that occur in few runs: marks, ticks, words, zeros, folders.

Source: made-up rows, records and streams, and the same numbers and words by hand.
"""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from dolfbuoy.accuracy import bars, target
from dolfbuoy.commands import sensitivity, statistics
from dolfbuoy.errors import InputError
from dolfbuoy.parallel import cases, interruption
from dolfbuoy.results.compare import Error
from dolfbuoy.results.recorder import Recorder
from dolfbuoy.results.series import Series
from dolfbuoy.studies import hard_cases, one_case
from dolfbuoy.studies.accuracy import advise, cheapest, inf_sup, report_text, work_precision
from dolfbuoy.studies.physics import effects, energy

# -- figures -----------------------------------------------------------------------------------------------------------

CASE = {"pair": "P2-P1", "cells": 8, "scheme": "bdf2", "step": 0.1, "tolerance": None, "newton": 1e-9, "reason": None}


def of_precision():
    rows = [
        CASE | {"own": k == 0, "wall": 2.0 + k, "bound_tension_top": 4e-3, "resolved_tension_top": k == 0}
        for k in range(2)
    ]
    drawn = work_precision.draw(rows, {"tension_top": Error(1e-3, 1e-3)})
    marks = [line for line in drawn.axes[0].lines if line.get_marker() == "o"]
    assert [(line.get_xdata().tolist(), line.get_alpha()) for line in marks] == [([2.0], 0.9), ([3.0], 0.3)]
    return drawn


def of_energy():
    return energy.draw([{"scheme": "bdf2", "step": 0.1 / k, "relative": 0.1 / k, "drag": 1.0} for k in (1, 2)])


def of_schemes():
    row = CASE | {"own": True, "wall": 2.0, report_text.ERROR_IN_TIME: 0.01}
    return report_text.draw([{"name": "short", "rows": [row]}])


def of_outputs():
    """With the legend below the panel."""
    row = {"error_in": "time", "share": 0.5, "scheme": "bdf2", "step": 0.1}
    choice = SimpleNamespace(stepping=SimpleNamespace(step=0.1), space=SimpleNamespace(cells=8))
    return cheapest.draw(SimpleNamespace(accuracy=0.01, found=SimpleNamespace(worst=0.5), choice=choice, rows=[row]))


def check_below(axes):
    """The legend hangs from a place a little below the axis."""
    place = axes.get_legend().get_bbox_to_anchor().transformed(axes.transAxes.inverted())
    assert (place.x0, place.y0) == pytest.approx((0.5, -0.18))


def of_advice():
    row = {"error_in": "time", "steps": 10, "error_percent": 1.0}
    axes = Figure().subplots()
    advise._lines(axes, SimpleNamespace(rows=[row], accuracy=0.01), "time", lambda row: "BDF2 adaptive")
    check_below(axes)
    assert [line.get_linestyle() for line in axes.lines] == ["--", ":"]
    axes = Figure().subplots()
    advise._lines(axes, SimpleNamespace(rows=[], accuracy=0.01), "time", lambda row: "")
    assert axes.get_legend() is None
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    return axes.figure


@pytest.mark.parametrize("drawn", [of_precision, of_energy, of_schemes, of_outputs, of_advice])
def test_ticks_are_numbers_without_powers(drawn):
    for axes in drawn().axes:
        for axis in (axes.xaxis, axes.yaxis):
            formatter = axis.get_major_formatter()
            assert isinstance(formatter, FuncFormatter)
            assert formatter(0.2, 0) == "0.2"


def test_changes_have_more_room_than_costs():
    row = {"effect": "waves", "mode": "without", "reason": None, "step_time": 3e-3, "base_step_time": 2.5e-3}
    left, right = effects.draw([row | {"change_tension_top": 0.5}], ["tension_top"], 0.01).axes
    assert left.get_subplotspec().get_gridspec().get_width_ratios() == (1.7, 1)
    assert (left.get_xscale(), right.get_xscale()) == ("log", "linear")


# -- words -------------------------------------------------------------------------------------------------------------


def test_zeros_of_pairs_are_counted_on_the_finest_mesh():
    rows = [
        {"state": "catenary", "mu": 1, "nu": 2, "h": 1 / n, "elements": n}
        | {f"{name}_{end}": x for end in ("dir", "free") for name, x in (("beta", 0.0), ("reduced", 0.0))}
        | {f"n_zero_{end}": 3 * n for end in ("dir", "free")}
        | {f"continuous_{end}": 1.0 for end in ("dir", "free")}
        for n in (4, 8, 16)
    ]
    rows[1]["n_zero_dir"] = 99
    (line,) = inf_sup.summary(rows)
    assert line["verdict"] == "unstable, 3 zero(s)/cell"
    assert (line["n_zero_dir"], line["pair"]) == (48, "P1-P2")


@pytest.mark.parametrize(
    ("only", "slow", "names"), [(None, False, ["a"]), (None, True, ["a", "b"]), ("b", False, ["b"])]
)
def test_expensive_cases(only, slow, names, monkeypatch):
    """Are those whose mark says why; they are run where they are asked for or named."""

    def item(name, *reason):
        marks = [SimpleNamespace(args=reason)]
        one = SimpleNamespace(name=f"test_{name}", iter_markers=lambda _: marks, function=item, nodeid=name)
        return SimpleNamespace(**vars(one), path=hard_cases.Path("test_hard_x.py"))

    monkeypatch.setattr(hard_cases, "_pytest", lambda *_: ([item("a"), item("b", "dear")], []))
    assert [case["name"] for case in hard_cases.cases(only, slow)] == list(names)


@pytest.mark.parametrize(
    ("yearly", "factor", "life", "texts"),
    [(0.0, 2.0, math.nan, ["-", "-"]), (0.5, 2.0, math.nan, ["2", "1"]), (0.5, 1.0, 8.0, ["8"])],
)
def test_lives(yearly, factor, life, texts):
    """Where nothing is damaged there is none."""
    assert statistics._lives(yearly, factor, life) == texts


def test_how_well_extremes_are_known(monkeypatch):
    """In three hours of the length of the runs; runs for a twentieth above the mean."""
    asked = []

    class Gumbel:
        def __init__(self, *given):
            asked.append(given)

        def runs_needed(self, *given):
            asked.append(given)
            return 12

        def uncertainty(self, *given):
            asked.append(given)
            return 0.034

    monkeypatch.setattr("dolfbuoy.results.extremes.Gumbel", Gumbel)
    data = {"top_memory": ("run", [3.0, 5.0]), "top_mean": ("run", [10.0, 20.0]), "duration": ("run", [500.0, 700.0])}
    data |= {"seconds": ("run", [30.0, 60.0]), "top_gumbel_scale": 2.0, "top_gumbel_location": 7.0}
    mine = xr.Dataset(data, {"run": ["a", "b"]}, {"hours": 3.0})
    (row,) = statistics._certainty([("top of a_b", "top", mine)])[2]
    assert asked == [(7.0, 2.0, 2), (0.05, 18.0, 15.0), (2, 18.0, 15.0)]
    assert row[0] == "top of a b"
    assert row[2:] == ["+- 3.4 %", "12", "9 min"]


@pytest.mark.parametrize(("size", "shown"), [(1.1e-6, True), (0.9e-6, False)])
def test_motions_that_are_none(size, shown):
    data = np.array([[[[[size, 0.0]]]]])[0]
    dims = ("buoy", "motion", "period", "part")
    variables = {"rao": (dims, data), "d_rao": (("parameter", *dims), data[None])}
    labels = {"buoy": ["a"], "motion": ["sway"], "period": [5.0], "part": ["real", "imaginary"]}
    found = xr.Dataset(variables | {"parameter_value": ("parameter", [40.0])}, labels)
    assert bool(sensitivity._of_response(found, False)) == shown


def test_elasticities_of_what_is_zero():
    """Are none, or without bound; a vector counts as a whole."""
    found = xr.Dataset({"parameter_value": ("parameter", [2.0, 0.0, math.nan])})
    relative = sensitivity._relative(found, np.array([1.0, 0.0, 3.0]), np.array(0.0))
    np.testing.assert_array_equal(relative, [math.inf, math.nan, math.inf])
    np.testing.assert_array_equal(sensitivity._relative(found, np.array([1.0, 4.0, 3.0]), 0.5), [4.0, 0.0, 6.0])


def test_the_first_force_that_rings_is_told():
    """Behind series that are none, and behind forces that do not."""
    t = np.arange(8.0)
    found = {
        (name, "a"): Series(f"{name} of a", t, np.asarray(x, float))
        for name, x in (("cone_angle", t % 2), ("tension_top", t), ("tension_anchor", t % 2))
    }
    assert bars._rings(found).startswith("tension_anchor of a jumps")


def test_the_catalogue_is_the_programs_own(tmp_path, monkeypatch):
    """It is written anew, but not over a file of the user's; what is inner to it is left out."""
    row = {
        "study": "hard-cases",
        "test": "t",
        "tests": "d",
        "name": "a",
        "asked": "x",
        "must_show": "y",
        "happened": "z",
    }
    rows = [row | {"passed": True, "verdict": "pass"}, row | {"passed": False, "verdict": "FAIL"}]
    monkeypatch.setattr(hard_cases, "evaluate_all", lambda *_: rows)
    monkeypatch.setattr(hard_cases, "cases", lambda *_: [])
    for _ in range(2):
        (table,) = hard_cases.study(tmp_path)
    assert (table.notes, table.passed) == (["1 of 2 cases pass."], False)
    assert list(table.rows[0]) == ["name", "asked", "must_show", "happened", "passed", "verdict"]
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "hard-cases.md").write_text("mine")
    with pytest.raises(InputError, match=r"hard-cases\.md would be replaced"):
        hard_cases.study(tmp_path / "new")
    rows.pop()
    assert hard_cases.study(tmp_path)[0].passed


# -- ranks and cases ---------------------------------------------------------------------------------------------------


def test_records_stay_on_their_ranks(monkeypatch):
    """The first tells the others what it found, without its record."""

    @dataclass
    class Found:
        record: object
        worst: float

    sent = []
    comm = SimpleNamespace(rank=0, size=2, bcast=lambda value, root: sent.append(value) or value)
    monkeypatch.setattr(target, "judged", lambda *_: Found("large", 0.5))
    assert target._judged_by_first(comm, None, "own", None, 2.0) == Found("own", 0.5)
    assert sent == [Found(None, 0.5)]
    other = SimpleNamespace(rank=1, size=2, bcast=lambda value, root: Found(None, 0.25))
    assert target._judged_by_first(other, None, "its", None, 2.0) == Found("its", 0.25)
    other.bcast = lambda value, root: InputError("no")
    with pytest.raises(InputError, match="no"):
        target._judged_by_first(other, None, "its", None, 2.0)


def test_a_bar_of_cases_is_shown_while_they_run():
    with cases._Progress({0: 1.0, 1: 1.0}) as progress:
        assert progress._bar.live.is_started
    assert not progress._bar.live.is_started


def test_an_interrupted_executor(tmp_path, monkeypatch):
    """What it has evaluated is kept, and nothing more is waited for."""
    monkeypatch.setattr(interruption, "_received", True)
    with ThreadPoolExecutor(1) as executor, pytest.raises(KeyboardInterrupt):
        cases.compute(lambda case: {"b": 1}, [{"a": 1}, {"a": 2}], tmp_path, executor=executor)
    assert len(cases.store_in(tmp_path).entries) == 1


def test_a_recorder_of_a_case(tmp_path, monkeypatch):
    """Begins its folder when it has something to write, once; without one it writes nothing."""
    told = []
    monkeypatch.setattr(
        one_case.folders, "begin", lambda folder, kind, scene: told.append((folder.is_dir(), kind, scene))
    )
    monkeypatch.setattr(Recorder, "save", lambda self: told.append("saved"))
    monkeypatch.setattr(one_case, "read", lambda path: path.name)
    own = object.__new__(one_case._CaseRecorder)
    own.folder, own.simulation, own._somewhere = tmp_path / "a" / "b", SimpleNamespace(scene="scene"), True
    own.save()
    own.save()
    assert told == [(True, "run", "scene"), "saved", "saved"]
    own.close = lambda: told.append("closed")
    own.record = SimpleNamespace(counts={"time": 0})
    own._extremes, own.observer = SimpleNamespace(values=lambda observer: "extremes"), None
    own.series = lambda: told.append(own.record.extremes) or "series"
    assert own.finished(False) == "series"
    assert told[3:] == ["extremes"]
    assert own.finished(True) == "results.nc"
    own.record.counts["time"] = 3
    assert own.finished(False) == "results.nc"
    assert told[4:] == ["saved", "closed", "closed"]
    own._somewhere, own._next_save = False, 0.0
    own.save()
    assert (own._next_save, len(told)) == (math.inf, 7)
