"""`check` of an irregular sea: height, periods, cut-off, repeat period, short components, current.

Source: moments in tests/reference/sea.json; dispersion in deep water and the Doppler shift by hand.
"""

import math

import numpy as np
import pytest
from helpers import reference
from scipy.optimize import brentq

from dolfbuoy import load_scene
from dolfbuoy.check import derived

G, HULL = 9.81, {"hull": [[0, 2], [2, 2]], "mass": 500.0}
JONSWAP = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 6.0, "band": [0.5, 5.0]}
EXPECTED = next(c["expected"] for c in reference("sea")["cases"] if c["id"] == "sea/jonswap_2.0_6_3.3")


def said_of(waves, **sections):
    """{name: (value, remark)} of a floating disc in deep water."""
    scene = load_scene({"sea": {"depth": 500.0}, "buoy": HULL, "waves": waves} | sections)
    return {name: (value, remark) for name, value, _, remark in derived(scene).numbers}


def test_heights_and_periods():
    found, band = said_of(JONSWAP), EXPECTED["cut_0.5_to_5_wp"]
    assert found["significant wave height Hs"][0] == pytest.approx(band["Hs"], rel=1e-8)
    assert found["peak period Tp"][0] == 6.0
    assert found["mean period Tz = 2 pi sqrt(m0/m2)"][0] == pytest.approx(band["T_m02"], rel=1e-8)
    steepness = 2 * math.pi * band["Hs"] / (G * band["T_m02"] ** 2)
    assert found["significant steepness 2 pi Hs/(g Tz^2)"][0] == pytest.approx(steepness, rel=1e-8)


def test_ursell_number():
    """Of a long low wave in shallow water, as long as Airy's within what its height adds."""
    height, depth, period = 0.05, 2.0, 6.0
    found = said_of({"height": height, "period": period}, sea={"depth": depth})
    length = brentq(lambda x: G * period**2 / (2 * math.pi) * math.tanh(2 * math.pi * depth / x) - x, 1.0, 100.0)
    value, _ = found["Ursell number H lambda^2/d^3"]
    assert value == pytest.approx(height * length**2 / depth**3, rel=5e-3)


@pytest.mark.parametrize("n", [0, 2])
def test_what_is_cut_off(n):
    value, remark = said_of(JONSWAP)[f"cut off of m{n}"]
    full, kept = (EXPECTED[which][f"m{n}"] for which in ("full", "cut_0.5_to_5_wp"))
    assert value == pytest.approx(100 * (1 - kept / full), rel=1e-6)
    assert remark.startswith("outside 1.2 ... 12 s")


def test_when_the_sea_repeats():
    """Bins of equal energy never; a record after its length, one step after its last instant."""
    assert said_of(JONSWAP)["the sea repeats after"][0] == math.inf
    t = 0.5 * np.arange(240)
    found = said_of({"elevation": np.column_stack([t, np.cos(1.1 * t)]).tolist()})
    assert found["the sea repeats after"][0] == pytest.approx(120.0, rel=1e-12)
    assert "peak period Tp" not in found


def test_short_components():
    """k D = 2 of a hull of 2 m is omega^2 = g: a period of 2.006 s in deep water."""
    border = 2 * math.pi / math.sqrt(G)
    components = [[0.1, factor * border, 0.0, 0.0] for factor in (0.5, 0.99, 1.01, 3.0)]
    value, remark = said_of({"components": components})["components with k D > 2"]
    assert value == 2
    assert remark.startswith("of 4,")


@pytest.mark.parametrize("direction", [0.0, 150.0])
def test_who_sees_the_period(direction):
    """omega = sigma + k U: one message says in which frame the period is given, and its value in the other."""
    waves = {"amplitude": 0.5, "period": 5.0, "direction_deg": direction}
    shift = (2 * math.pi / 5) * 0.9 / G * math.cos(math.radians(direction))  # k U/sigma in deep water
    for seen, words in (
        (None, "not counted: 5 s is seen from the water and the ground; see waves.period_seen_from"),
        ("water", f"5 s is seen from the water, {5 / (1 + shift):.4g} s from the ground"),
    ):
        given = waves if seen is None else waves | {"period_seen_from": seen}
        value, remark = said_of(given, current={"speed": 0.9})["shift of omega by the current"]
        assert value == pytest.approx(100 * shift, rel=1e-6)
        assert remark == words
    value, remark = said_of(waves | {"period_seen_from": "ground"}, current={"speed": 0.9})[
        "shift of omega by the current"
    ]
    sigma = (2 * math.pi / 5) / (1 + value / 100)
    assert value == pytest.approx(100 * sigma * 0.9 / G * math.cos(math.radians(direction)), rel=1e-6)
    assert remark == f"5 s is seen from the ground, {2 * math.pi / sigma:.4g} s from the water"
