"""Parts of error bars, each alone, at and near their limits.

Source: made-up series, and the same numbers by hand; nothing is run.
"""

import math

import numpy as np
import pytest
import xarray as xr
from made_up import RECORD, SCENE

from dolfbuoy import load_scene
from dolfbuoy.accuracy import bars
from dolfbuoy.accuracy.bars import NONE, RESOLVED, SUSPECT
from dolfbuoy.results.series import Series

T = np.linspace(0.0, 8.0, 9)


def series(x, noise=0.0, t=T, label="tension_top of line"):
    return Series(label, np.asarray(t, float), np.asarray(x, float), noise)


LOWEST = {"cable__position_degree": 1, "cable__tension_degree": 0}

# -- bars --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bar", "size", "reason", "lost", "noise", "verdict"),
    [
        (0.25, 1.0, None, False, 0.0, RESOLVED),
        (0.2501, 1.0, None, False, 0.0, NONE),
        (0.25, 1.0, None, True, 0.0, SUSPECT),
        (0.1, 1.0, "It fails.", False, 0.0, NONE),
        (math.nan, 1.0, None, False, 0.0, NONE),
        (5.0, 1.0, None, False, 0.5, RESOLVED),
        (5.01, 1.0, None, False, 0.5, NONE),
        (0.0, 0.0, None, False, 0.0, RESOLVED),
    ],
)
def test_what_a_bar_is_worth(bar, size, reason, lost, noise, verdict):
    """A quarter of the range at most, or ten times what may be rounding."""
    assert bars._verdict(bar, size, reason, lost, noise) == verdict


@pytest.mark.parametrize(
    ("own", "other", "said"),
    [
        ({}, {"failed_steps": 0}, None),
        ({"failed_steps": 1}, {}, "Steps of the run failed"),
        ({"failed_steps": 0}, {"failed_steps": 1}, "Steps of a run with twice the step and half the elements failed"),
    ],
)
def test_steps_that_were_cut(own, other, said):
    found = bars._cut(xr.Dataset(attrs=own), xr.Dataset(attrs=other))
    assert found is None if said is None else found.startswith(said)


def test_what_alternates_is_found():
    """Of (-1)^k a: fourth differences are 16 a; a cubic has none."""
    t = np.arange(12.0)
    sign = (-1.0) ** np.arange(12)
    assert bars.alternating(series(0.3 * sign + t**3, t=t)) == pytest.approx(0.3, rel=1e-12)
    assert bars.alternating(series(t**4, t=t)) == pytest.approx(24 / 16)


@pytest.mark.parametrize(
    ("name", "count", "size", "noise", "rings"),
    [
        ("tension_top", 8, 1.0, 0.0, True),
        ("tension_top", 7, 1.0, 0.0, False),
        ("cone_angle", 8, 1.0, 0.0, False),
        ("anchor", 8, 1.0, 0.0, True),
        ("tension_top", 8, 1.0, 0.009, True),
        ("tension_top", 8, 1.0, 0.01, False),
    ],
)
def test_forces_that_ring(name, count, size, noise, rings):
    """Of eight values at least, and by more than rounding."""
    one = series(size * (np.arange(count) % 2), noise, np.arange(count), f"{name} of line")
    said = bars._rings({(name, "line"): one})
    assert (said is not None) == rings
    if rings:
        assert said == (
            f"{name} of line jumps to and fro from step to step, by 50 % of its range: the steps are too long."
        )


def test_forces_that_ring_a_little(monkeypatch):
    """What is exactly as much as it may be is none."""
    one = series(np.arange(8) % 2, t=np.arange(8))
    for limit, rings in ((0.5, False), (0.4999, True)):
        monkeypatch.setattr(bars, "RINGING", limit)
        assert (bars._rings({("tension_top", "line"): one}) is not None) == rings


def test_errors_of_numbers_from_two_runs():
    """Their differences over a factor; what a window has stands for all of it, in proportion to its range."""
    whole, fine, coarse = series(2 * T), series(T), series(T + 0.8 * (T > 3.5) + 0.1)
    errors, rms, lost = bars._compared(whole, fine, coarse, 3.0)
    off = coarse.x - fine.x
    assert rms == pytest.approx(2 * math.sqrt(np.mean(off**2)))
    assert errors["max"] == pytest.approx(2 * 0.9 / 3)
    assert errors["min"] == pytest.approx(2 * 0.1 / 3)
    assert errors["mean"] == pytest.approx(2 * (coarse.mean - fine.mean) / 3)
    assert errors["std"] == pytest.approx(2 * (coarse.standard_deviation - fine.standard_deviation) / 3)
    assert not lost
    alone, rms_alone, _ = bars._compared(whole, fine, coarse, 3.0, whole=True)
    assert alone["max"] == pytest.approx(0.3)
    assert rms_alone == pytest.approx(rms / 2)
    still = series(np.ones(9))
    assert bars._compared(whole, still, series(np.full(9, 1.5)), 3.0)[1] == pytest.approx(0.5)
    for pair in ((fine, series(np.where(T > 7, np.nan, T))), (series(np.where(T > 7, np.inf, T)), coarse)):
        errors, rms, lost = bars._compared(whole, *pair, 3.0)
        assert all(math.isnan(x) for x in errors.values())
        assert (set(errors), math.isnan(rms), lost) == ({"max", "min", "mean", "std"}, True, False)


@pytest.mark.parametrize(
    ("apart", "noise", "lost"), [(0.29, 0.0, False), (0.31, 0.0, True), (0.31, 0.00309, True), (0.31, 0.00311, False)]
)
def test_a_companion_that_goes_another_way(apart, noise, lost):
    """By 0.3 of the standard deviation, and by more than a hundred times what may be rounding."""
    fine = series(T)
    off = apart * fine.standard_deviation
    own = series(T, noise * fine.standard_deviation)
    assert bars._compared(own, fine, series(T + off), 3.0)[2] is lost


def test_errors_of_the_steps():
    """Of numbers with and without them, in proportion to the range; nan where the steps cannot be followed."""
    own, alongside, corrected = series(3 * T), series(T), series(T - 0.2)
    errors, rms = bars._of_steps(own, alongside, corrected)
    assert errors == pytest.approx({"max": 0.6, "min": 0.6, "mean": 0.6, "std": 0.0}, abs=1e-12)
    assert rms == pytest.approx(0.6)
    assert bars._of_steps(own, series(np.ones(9)), series(np.zeros(9)))[1] == pytest.approx(1.0)
    gone = series(np.where(T > 7, np.nan, T))
    for pair in ((None, corrected), (alongside, None), (alongside, gone)):
        errors, rms = bars._of_steps(own, *pair)
        assert math.isnan(rms)
        assert all(math.isnan(x) for x in errors.values())


@pytest.mark.parametrize(("known", "left"), [(9, False), (8, False), (7, True)])
def test_where_the_steps_are_left(known, left):
    """The last step alone may be missing."""
    gone = series(np.where(np.arange(9) < known, T, np.nan))
    assert bars._left(gone, series(T)) is left
    assert not bars._left(gone, None)
    assert not bars._left(gone, series(np.where(T > 7, np.inf, T)))


def test_when_extremes_are():
    one = series([0, 1, 5, 1, 0, -7, 1, 2, 3])
    assert [bars._instant(one, number) for number in ("max", "min", "mean", "std")] == [2.0, 5.0, -math.inf, -math.inf]


def test_what_newton_and_chance_leave():
    """A quarter of the tolerance and the range, up to 1e-4; of a sea, of what varies by more than rounding."""
    one = series(100 * np.sin(T), noise=1e-9)
    scene = load_scene("short", solver__step_tolerance=1e-4)
    assert bars._newton(scene, one) == pytest.approx(0.25 * 1e-4 * np.ptp(one.x))
    assert math.isnan(bars._newton(load_scene("short", solver__step_tolerance=1.01e-4), one))
    storm = load_scene("storm")
    t = np.linspace(0.0, 400.0, 4001)
    rng = np.random.default_rng(3)
    x = 7.0 + sum(np.cos(w * t + p) for w, p in zip(rng.uniform(0.1, 2, 40), rng.uniform(0, 6.3, 40), strict=True))
    assert bars._chance(load_scene("short"), series(x, t=t)) == {}
    still = load_scene("storm", waves=None)
    assert bars._chance(still, series(x, t=t)) == {}
    deviation = series(x, t=t).standard_deviation
    assert bars._chance(storm, series(x, deviation / 101, t)) != {}
    assert bars._chance(storm, series(x, deviation / 99, t)) == {}


@pytest.mark.parametrize(
    ("name", "more", "smooth", "of_elements"),
    [
        ("driven", LOWEST, True, True),
        ("driven", {}, True, False),
        ("driven-slack", LOWEST, False, True),
        ("chain-on-bed", LOWEST, False, True),
        ("free-buoy", {}, True, False),
    ],
)
def test_of_which_order_a_scene_is(name, more, smooth, of_elements):
    scene = load_scene(name, **more)
    assert bars.is_smooth(scene) is smooth
    assert bars._of_elements(scene) is of_elements


@pytest.mark.parametrize(("of_steps", "verdict"), [(2.99, RESOLVED), (3.01, SUSPECT)])
def test_steps_that_contradict_a_companion(of_steps, verdict, monkeypatch):
    """An error of the steps three times what the companion shows of it; bars are the larger of both."""
    scene = load_scene(SCENE, time__scheme="bdf2")
    numbers = dict.fromkeys(bars.FLOOR, 0.0)
    monkeypatch.setattr(bars, "_compared", lambda *_: (numbers, 30.0, False))
    monkeypatch.setattr(bars, "_of_steps", lambda *_: (dict.fromkeys(bars.FLOOR, -12.5), 10.0 * of_steps))
    found, sentences = bars.bars_of(RECORD.assign_attrs(failed_steps=0), scene, RECORD.assign_attrs(failed_steps=0))
    top = {number: found[bars.Output("tension_top", number, "cable")] for number in bars.FLOOR}
    assert {one.verdict for one in top.values()} == {verdict}
    assert {number: one.bar for number, one in top.items()} == {"max": 12.5, "min": 12.5, "mean": 12.5, "std": 12.5}
    assert {(one.time, one.space) for one in top.values()} == {(12.5, 12.5)}
    monkeypatch.setattr(bars, "_of_steps", lambda *_: (dict.fromkeys(bars.FLOOR, 1.0), 1.0))
    found, _ = bars.bars_of(RECORD.assign_attrs(failed_steps=0), scene, RECORD.assign_attrs(failed_steps=0))
    least = {number: found[bars.Output("tension_top", number, "cable")].bar for number in bars.FLOOR}
    assert least == {"max": 10.0, "min": 10.0, "mean": 2.5, "std": 2.5}
    assert sentences == []
