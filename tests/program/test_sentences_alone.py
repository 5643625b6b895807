"""Sentences and numbers of summaries, statistics and criteria, each alone at its threshold.

Source: limits, folds, sets of runs and probabilities by hand.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made_up import PERIOD, RECORD, SCENE
from matplotlib.figure import Figure

from dolfbuoy import InputError, load_scene
from dolfbuoy.results import cautions, criteria, linear_record, running, statistics, statistics_figures, summary
from dolfbuoy.results.criteria import Verdict
from dolfbuoy.results.sample import Fatigue
from dolfbuoy.results.statistics import Run
from dolfbuoy.results.sweep_figure import residuals

LENGTH = 22.0  # of the line of the made-up record


def without(value, change):
    """The record with another number, and the sentences about it that there were not before."""
    said = summary.warnings(RECORD, SCENE)
    return [one for one in summary.warnings(RECORD.assign({value: change(RECORD[value])}), SCENE) if one not in said]


@pytest.mark.parametrize(("below", "said"), [(0.9, False), (1.1, True)])
def test_a_line_below_the_bed(below, said):
    """By more than a millionth of its length."""
    lowest = float(RECORD.cable_position_minimum[:, 2].min())
    shift = -20.0 - below * 1e-6 * LENGTH - lowest
    found = without("cable_position_minimum", lambda x: x + np.array([0.0, 0.0, shift]))
    assert found == ["The cable dipped up to 2.42e-05 m below the sea bed: there is no [seabed] to carry it."] * said


@pytest.mark.parametrize(("above", "said"), [(0.9, False), (1.1, True)])
def test_a_line_above_the_water(monkeypatch, above, said):
    """By more than a hundredth of its length over the highest crest, where its equations have no surface."""
    monkeypatch.setattr(summary, "highest_water", lambda scene: 3.0)
    monkeypatch.setattr(summary, "called_by", lambda scene, where: [])
    highest = float(RECORD.cable_position_maximum[:, 2].max())
    found = without("cable_position_maximum", lambda x: x + np.array([0.0, 0.0, 3.0 + 0.01 * above * LENGTH - highest]))
    assert found == [f"The cable rose up to 0.242 m above the water, {summary.UNSEEN}"] * said
    monkeypatch.setattr(summary, "called_by", lambda scene, where: [where])
    assert without("cable_position_maximum", lambda x: x + 99.0) == []


@pytest.mark.parametrize(("pushed", "said"), [(0.9e-6, False), (1.1e-6, True)])
def test_a_line_that_is_pushed(pushed, said):
    """By more than a millionth of its largest tension."""
    largest = float(RECORD.cable_tension_maximum.max())
    least = np.full(6, 50.0)
    least[[1, 3]] = -pushed * largest
    found = without("cable_tension_minimum", lambda x: x * 0 + least)
    assert [one.partition(" (")[0] for one in found] == ["The cable was compressed at times"] * said
    assert all("2 of the elements 2 to 4 (s = 3.667 ... 14.67 m)" in one for one in found)


@pytest.mark.parametrize(
    ("angle", "short", "bad"),
    [(89.0, 0.51, []), (91.0, 0.51, [0, 1]), (0.0, 0.49, [1]), (0.0, 0.5, [])],
)
def test_a_fold_that_is_not_resolved(angle, short, bad):
    """Neighbours that turn by more than 90 degrees, or ends of an element nearer than half its length."""
    way = np.array([math.cos(math.radians(angle)), 0.0, math.sin(math.radians(angle))])
    x = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0] + short * way, [1.0, 0, 0] + (short + 1) * way])
    data = {"cable_position": (("frame", "node", "xyz"), np.stack([x, x + 1.0])), "time": ("time", [0.0])}
    record = xr.Dataset(data | {"cell": ("cell", np.arange(3))}, {"s": ("node", np.arange(4.0))})
    found = summary._unresolved_fold(record, SimpleNamespace(position_degree=1))
    where = {(): "", (0, 1): "elements 1 to 2 (s = 0 ... 2 m)", (1,): "element 2 (s = 1 ... 2 m)"}[tuple(bad)]
    said = f"A fold of the cable is not resolved in 2 of 2 frames: {where}; use smaller ones there."
    assert found == ([said] if bad else [])


def test_the_shortest_lives_of_a_run(monkeypatch):
    """A dozen, the shortest first, and over their safety factor."""
    lives = {f"tension_top of c{k}": 10.0 + (k + 6) * 7 % 15 for k in range(15)}
    for factor, over, value in ((1.0, "", "10"), (2.5, ", over safety factor 2.5", "10, 4")):
        monkeypatch.setattr(summary, "lives_of", lambda record, scene, factor=factor: (lives, factor, 1234.56))
        rows = summary.life_rows(RECORD, SCENE)
        assert rows[0] == (f"life of tension top of c9, from 1235 s{over}", value, "years")
        assert [row[1].partition(",")[0] for row in rows] == [f"{life}" for life in range(10, 22)]


def test_the_mean_power_of_whole_periods():
    """After the ramp; of less than a period all that there is, and within the ramp nothing."""
    ramp = SCENE.waves.ramp
    t = np.arange(0.0, ramp + 2 * PERIOD + 0.3, 0.1)
    power = np.where(t < t[-1] - 2 * PERIOD - 1e-6, 9e9, 2000.0 + 500 * np.sin(2 * np.pi * (t - t[-1]) / PERIOD))
    record = xr.Dataset({"absorbed_power": ("time", power)}, {"time": t})
    assert summary._mean_power(record, SCENE)[1:] == ("2000", "W")
    short = record.sel(time=slice(0, ramp + 0.41))
    assert summary._mean_power(short.assign(absorbed_power=0 * short.time + 7.0), SCENE)[1] == "7"
    assert summary._mean_power(record.sel(time=slice(0, ramp - 0.05)), SCENE)[1] == "nan"
    exact = xr.Dataset({"absorbed_power": ("time", [9.0, 1.0, 3.0])}, {"time": ramp + np.array([-PERIOD, 0.0, PERIOD])})
    assert summary._mean_power(exact, SCENE)[1] == "2"


@pytest.mark.parametrize(("use", "said"), [(1.0, False), (1.001, True)])
def test_a_line_above_its_breaking_load(use, said):
    values = np.array([[0.5, 0.2], [use, 0.3]])
    record = xr.Dataset({"utilisation": (("time", "segment"), values)}, {"segment": ["c.0", "c.1"]})
    for parts, more in ((False, "; here it does not part, see cable.fails_at"), (True, "")):
        found = running.warnings_of(record, parts)
        assert found == [f"The tension of the cable is above its breaking load: 1 times (segment 0){more}."] * said
    whole = record.isel(segment=[0]).assign_coords(segment=["c"])
    assert running.rows_of(whole) == [("largest tension over breaking load", f"{use:.4g}", "")]
    assert running.warnings_of(xr.Dataset(), False) == []
    loaded = RECORD.assign(utilisation=(("time", "segment"), np.full((RECORD.sizes["time"], 1), use)))
    told = " ".join(summary.warnings(loaded.assign_coords(segment=["cable"]), SCENE))
    assert ("breaking load: 1 times; here it does not part, see cable.fails_at." in told) == said


@pytest.mark.parametrize(("time", "said"), [(1.0, False), (1.01, True), (None, False)])
def test_a_line_that_never_parts(time, said):
    rule = {"time": time, "at": 4.5} if time else {"tension": 5.0}
    line = {"length": 9.0, "line_density": 1.0, "axial_stiffness": 1e5, "elements": 2, "top": {"kind": "free"}}
    scene = load_scene({"cable": line | {"fails_at": rule}, "time": {"end": 1.0, "step": 0.1}})
    found = running.never_parted(scene)
    assert len(found) == said
    assert all(one.startswith("cable.fails_at.time = 1.01: is after the end of the run at 1 s") for one in found)


# -- criteria ----------------------------------------------------------------------------------------------------------


def test_what_governs_of_a_criterion():
    """The least that is left of its limit; of limits that are 0 the largest that is missing."""
    every = [Verdict("a", "x", 8.0, 10.0, "m"), Verdict("a", "y", 9.0, 10.0, "m"), Verdict("a", "z", 9.0, 10.0, "m")]
    every += [Verdict("b", part, value, 0.0, "N") for part, value in (("x", 1.0), ("y", 3.0), ("z", 2.0))]
    assert [(one.criterion, one.part) for one in criteria.governing(every)] == [("a", "y"), ("b", "y")]
    at, beyond = (Verdict("c", "", value, 10.0, "m") for value in (10.0, 10.1))
    least = Verdict("c", "", 3.0, 4.0, "m", False)
    assert [one.met for one in (at, beyond, least)] == [True, False, False]
    assert (least.margin, least.use, Verdict("c", "", -1.0, -2.0, "m").use) == (-1.0, -0.25, -0.5)
    assert (Verdict("c", "", 1.0, 0.0, "m").use, Verdict("c", "", -1.0, 0.0, "m").use) == (-math.inf, math.inf)
    assert [Verdict("c", "", 9.0, 10.0, "m", True, bar).says for bar in (1.0, 1.1, math.nan)] == [
        "met, 10 % left", "met, 10 % left, within its error bar", "met, 10 % left",
    ]  # fmt: skip
    assert Verdict("c", "p", 1200.0, 0.0, "N", True, 50.0, "k").row() == (
        "c", "p, k", "1.2 +- 0.05", "<= 0", "kN", "not met, 1.2 kN missing",
    )  # fmt: skip


@pytest.mark.parametrize(("share", "value"), [(0.9e-4, 0.0), (1.1e-4, None), (-0.5, None)])
def test_uplift_that_is_none(share, value):
    """Below a ten thousandth of the largest tension."""
    largest = float(RECORD.tension_top.max())
    record = RECORD.assign(anchor_uplift=0 * RECORD.anchor_uplift + share * largest)
    (found,) = criteria.verdicts(record, load_scene(SCENE, criteria={"no_uplift": True}))
    assert found.value == pytest.approx(share * largest if value is None else value)


# -- statistics --------------------------------------------------------------------------------------------------------


def a_run(name, duration=600.0, part="line", **sample):
    """A run with one series of which only the largest value counts."""
    series = {f"tension_top of {part}": {"maximum": 5.0 + len(name)}}
    return Run(name, {"duration": duration, "series": series, "peaks": {}, "cycles": {}} | sample, "set")


@pytest.mark.parametrize(("more", "said"), [(5e-4, ""), (7e-4, "not equally long")])
def test_runs_of_one_distribution(more, said):
    """As long as each other, to a millionth, and all with the series."""
    every = [a_run("x" * k, 600.0 + more * (k == 3)) for k in range(12)]
    if said:
        with pytest.raises(InputError, match=said):
            statistics.gumbels(every, "tension_top of line")
        return
    found, length = statistics.gumbels(every, "tension_top of line")
    assert (found.runs, length) == (12, 600.0)
    with pytest.raises(InputError, match="not all runs have it"):
        statistics.gumbels([*every, a_run("y", part="other")], "tension_top of line")


def test_sentences_of_statistics():
    """Lines that parted in one run, in some; up to three series of a curve by name."""
    gone = a_run("b", parted="line at t = 3 s")
    mix = "; numbers mix what was before and after, unless --from is later than that."
    assert statistics._parted([a_run("a")]) == []
    assert statistics._parted([gone]) == [f"Lines parted, b: line at t = 3 s{mix}"]
    assert statistics._parted([a_run("a"), gone, gone]) == [f"Lines parted, in 2 of 3 runs, b: line at t = 3 s{mix}"]
    assert statistics.curves_in_words({"K": list("abcab"), "M": list("abcd")}) == [
        "Fatigue by K: a, b, c.", "Fatigue by M: 4 series, a first.",
    ]  # fmt: skip


def test_how_often_peaks_are_exceeded():
    values, share = statistics.exceedance(np.array([3.0, 9.0, 5.0]), np.array([1.0, 1.0, 2.0]))
    assert (values.tolist(), share.tolist()) == ([9.0, 5.0, 3.0], [1 / 5, 3 / 5, 4 / 5])
    assert len(statistics.exceedance(np.zeros(0), np.zeros(0))[1]) == 0


def test_lives_are_of_the_damage_of_a_set():
    """Of runs all of which have it, where something corrodes."""
    worn = {"fatigue": {"corrosion_rate": 1e-4}}
    runs = [a_run("a", 100.0, **worn), a_run("b", 300.0), a_run("c", 50.0)]
    rows = [{"x": {"damage": 1e-6}, "y": {"damage": 1e-6}}, {"x": {"damage": 3e-6}, "y": {}}, {"x": {"damage": 1.0}}]
    statistics._age(runs, [0, 0, 1], rows, Fatigue())
    life = 400.0 / 4e-6 / 31557600.0
    assert [row["x"].get("life") for row in rows] == [pytest.approx(life), pytest.approx(life), None]
    assert "life" not in rows[0]["y"]


def test_seven_sets_are_drawn():
    for count, drawn in ((3, 3), (7, 7), (8, 7)):
        assert list(statistics_figures._sets(SimpleNamespace(sizes={"set": count}))) == list(range(drawn))


# -- others ------------------------------------------------------------------------------------------------------------


def test_a_response_that_is_not_linear():
    """Three standard deviations above the mean, or amplitudes in waves of the height; not as much as it."""
    parts = np.stack([np.array([[[3.0, 6.0, 6.1]]]), np.array([[[4.0, 8.0, 8.0]]])], axis=-1)
    data = {
        "tension_mean": (("cable", "tension"), [[20.0]]),
        "tension_std": (("cable", "tension"), [[20.0 / 3]]),
        "rao_drag_tension": (("cable", "tension", "period", "part"), parts),
    }
    labels = {"cable": ["c"], "tension": ["tension_top"], "period": [4.0, 5.0, 6.0]}
    found = xr.Dataset(data, labels, {"height_m": 4.0})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(linear_record, "TENSIONS", ("tension_top",))
        (said,) = linear_record.warnings(found.assign(tension_std=found.tension_std * (1 - 1e-9)))
        assert "in waves of 4 m the amplitude is more than the mean at 6 s:" in said
        slack = found.assign(tension_std=found.tension_std * 1.001, tension_mean=found.tension_mean - 1e-3)
        sea, high = linear_record.warnings(slack)
        assert "three standard deviations, 20.02 N, are more than the mean, 20 N" in sea
        assert "at 5 to 6 s" in high


@pytest.mark.parametrize(("part", "under"), [(1.1e-6, False), (0.9e-6, True)])
def test_a_buoy_is_under_water_to_a_millionth_of_its_volume(part, under):
    scene = load_scene(SCENE, buoy__hull=[[0.0, 2.0], [3.0, 2.0]])
    volume = 3.0 * math.pi
    assert cautions.is_under((1 - part) * scene.sea.density * volume, scene, scene.network.buoys["buoy"]) == under


def test_residuals_of_more_series_than_fit():
    """Four columns; the differences half as high, and room for the legend."""
    data = {"time": np.arange(5.0), "measured": np.arange(5.0), "computed": np.ones(5)}
    names = [f"tension_top of c{k}" for k in range(5)]
    data["series"] = np.array(names, dtype=object)
    made = xr.Dataset({name: ("sample", values) for name, values in data.items()})
    figure = residuals(made)
    assert isinstance(figure, Figure)
    assert [axes.get_title() for axes in figure.axes] == [*names[:4], "", "", "", ""]
    assert figure.axes[0].get_gridspec().get_height_ratios() == (2, 1)
    assert figure.axes[0].get_shared_x_axes().joined(figure.axes[0], figure.axes[4])
    assert figure.get_layout_engine().get()["rect"][1] == pytest.approx(0.25 / 3.4)
    assert [(line.get_markersize(), line.get_linewidth()) for line in figure.axes[0].lines] == [(2, 1.0), (6, 1.0)]
    assert [line.get_linewidth() for line in figure.axes[4].lines] == [0.7, 0.5]
