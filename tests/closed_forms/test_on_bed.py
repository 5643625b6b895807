"""The closed-form catenary on a sea bed: flat and sloped, with friction, slack and lifted.

Source: tests/reference (mpmath, checked with MoorPy), mirror images, the equations of equilibrium by quadrature.
"""

import itertools
import math

import numpy as np
import pytest
from helpers import reference
from scipy.integrate import cumulative_trapezoid

from dolfbuoy.statics import catenary
from dolfbuoy.statics.on_bed import Bed, OnBed, between

CASES = {name: case for name, case in reference("bed_and_networks")["cases"].items() if name.startswith("bed_")}
START = np.array([1.3, -0.4, 2.2])
ALONG = np.array([0.28, -0.96, 0.0])
UP = np.array([0.0, 0.0, 1.0])


def bed_through(start, along, slope_deg=0.0, friction=0.0):
    slope = math.radians(slope_deg)
    normal = math.cos(slope) * UP - math.sin(slope) * along
    return Bed(normal, float(normal @ start), friction)


@pytest.mark.parametrize("name", CASES)
def test_against_the_references(name):
    case, values = CASES[name]["input"], CASES[name]["values"]
    L, bed = case["L"], bed_through(START, ALONG, case.get("slope_deg", 0.0), case["mu"])
    line = between(START, START + case["X"] * ALONG + case["Z"] * UP, L, case["w"], float(case["EA"]), bed)
    # the ends are world coordinates, to 1e-16 of their size
    top = line.force(L)
    found = {"H": np.hypot(*top[:2]), "length_on_bed": line.length_on_bed, "V_top": top[2]}
    found |= {"T_top": line.tension(L), "T_anchor": line.tension(0.0)}
    if values["regime"] == "partial":
        x, z = (line.last.start - START) @ ALONG, (line.last.start - START) @ UP
        found |= {"T_touchdown": line.lying.T_end, "x_touchdown": x, "z_touchdown": z}
        s = np.linspace(0.0, line.length_on_bed, 200_001)
        found["tensioned_length_on_bed"] = np.mean(line.tension(s) > 0) * line.length_on_bed
    assert isinstance(line, OnBed) == (values["regime"] != "lifted")
    for key, value in found.items():
        rel = 1e-5 if key == "tensioned_length_on_bed" else CASES[name]["tolerance"]
        assert value == pytest.approx(values[key], rel=rel, abs=1e-9), key
    assert {*values} - {*found} <= {"regime", "V_anchor", "T_touchdown"}


def test_a_line_that_sags_onto_the_bed_is_two_mirrored_lines():
    case = CASES["bed_chain100_frictionless"]["input"]
    X, Z, L, w, EA = (case[key] for key in ("X", "Z", "L", "w", "EA"))
    bed, foot = bed_through(START, ALONG), START + 40.0 * ALONG
    half = between(foot, foot + X * ALONG + Z * UP, L, w, EA, bed)
    whole = between(foot - X * ALONG + Z * UP, foot + X * ALONG + Z * UP, 2 * L, w, EA, bed)
    s = np.linspace(0.0, L, 57)
    assert whole.length_on_bed == pytest.approx(2 * half.length_on_bed, rel=1e-12)
    np.testing.assert_allclose(whole.position(L + s), half.position(s), atol=1e-10 * L)
    np.testing.assert_allclose(whole.tension(L + s), half.tension(s), rtol=1e-11)
    np.testing.assert_allclose(whole.tension(L - s), half.tension(s), rtol=1e-11)


# start and end: distance along the line, height above the bed
LINES = {
    "flat": ((0, 0), (50, 12), 55.0, 900.0, 1e6, 0.0, 0.3),
    "uphill": ((0, 0), (50, 12), 55.0, 900.0, math.inf, 8.0, 0.3),
    "downhill": ((0, 0), (50, 12), 55.5, 900.0, 1e5, -8.0, 0.05),
    "rope": ((0, 0), (50, 12), 42.0, 900.0, 1e4, 3.0, 0.1),
    "held at its bottom end": ((0, 0), (50, 12), 55.0, 900.0, math.inf, -30.0, 0.0),
    "sagging": ((0, 6), (50, 12), 60.0, 900.0, 1e6, 0.0, 0.0),
    "sagging on a slope": ((0, 6), (50, 12), 60.0, 900.0, 1e5, 12.0, 0.0),
    "sagging downhill": ((0, 9), (50, 12), 63.0, 900.0, 1e5, -12.0, 0.2),
    "sagging, pulled": ((0, 3), (50, 12), 60.0, 900.0, math.inf, 0.0, 0.6),
}


def built(name):
    start, end, L, w, EA, slope_deg, friction = LINES[name]
    bed = bed_through(START, ALONG, slope_deg, friction)
    k = math.tan(math.radians(slope_deg))
    ends = [START + x * ALONG + (k * x + gap) * UP for x, gap in (start, end)]
    return between(*ends, L, w, EA, bed), bed, ends, L, w, EA


@pytest.mark.parametrize("name", LINES)
def test_equations_of_equilibrium(name):
    """r' = (1 + T/EA) t, ends where they should be, the force balance of each part, nothing below the bed."""
    line, bed, ends, L, w, EA = built(name)
    assert isinstance(line, OnBed)
    assert 0.02 * L < line.length_on_bed < 0.95 * L
    a, b = line.first_length, line.first_length + line.length_on_bed
    # from `zero` on there is tension on the bed
    zero = float(np.clip(b - line.lying.T_end / line.lying.fall, a, b)) if line.lying.fall > 0 else a
    kinks = sorted({0.0, a, zero, b, L})
    for s0, s1 in itertools.pairwise(kinks):
        s = np.linspace(s0, s1, 4001)[1:-1]
        n, T = line.force(s), line.tension(s)
        slope = bed.rise(ALONG)
        tangent = np.where((T > 0)[:, None], n / np.maximum(T, 1e-300)[:, None], line.lying.along)
        way = cumulative_trapezoid((1 + T / EA)[:, None] * tangent, x=s, axis=0, initial=0.0)
        np.testing.assert_allclose(line.position(s) - line.position(s[:1]), way, atol=1e-7 * L)
        change = np.gradient(n, s, axis=0, edge_order=2)
        hanging = s1 <= a or s0 >= b
        assert np.all([bed.height_above(r) > -1e-10 * L for r in line.position(s)])
        if hanging:
            np.testing.assert_allclose(change, np.broadcast_to(w * UP, change.shape), atol=1e-6 * w)
        else:
            fall = w * (slope + bed.friction) / math.hypot(1, slope) * (T[len(T) // 2] > 0)
            np.testing.assert_allclose(change @ line.lying.along, fall, atol=1e-6 * w)
    np.testing.assert_allclose(line.position(np.array([0.0, L])), ends, atol=1e-11 * L)
    for border in (a, b):  # no jump of force or place
        around = border + np.array([-1e-9, 1e-9]) * L
        np.testing.assert_allclose(*line.position(around), atol=1e-8 * L)
        if border > 0:
            np.testing.assert_allclose(*line.force(around), atol=1e-6 * w * L)


def test_slack_lines_hang_straight_down_and_fill_the_room():
    bed, w, EA = bed_through(START, ALONG), 900.0, 1e4
    ends = START + 6 * UP, START + 50 * ALONG + 12 * UP
    line = between(*ends, 80.0, w, EA, bed)
    gaps = np.array([6.0, 12.0])
    lengths = (-1 + np.sqrt(1 + 2 * gaps * w / EA)) * EA / w  # of a + w a^2/(2 EA) = gap
    assert line.last.H == 0
    np.testing.assert_allclose([line.first_length, line.last_length], lengths, rtol=1e-13)
    np.testing.assert_allclose(line.tension(np.array([0.0, 30.0, 80.0])), [w * lengths[0], 0.0, w * lengths[1]])
    np.testing.assert_allclose(line.position(np.array([0.0, 80.0])), ends, atol=1e-12)
    middle = line.position(np.array([80.0 + lengths[0] - lengths[1]]) / 2)[0]
    np.testing.assert_allclose(middle, START + 25 * ALONG, atol=1e-12)


def test_above_one_point_and_along_the_bed():
    bed, w = bed_through(START, ALONG), 900.0
    fold = between(START, START + 5 * UP, 9.0, w, math.inf, bed)
    assert (fold.last.H, fold.length_on_bed) == (0.0, 4.0)
    np.testing.assert_allclose(fold.position(np.array([0.0, 2.0, 4.0, 9.0]))[:3], np.tile(START, (3, 1)), atol=1e-12)
    taut = between(START, START + 9.9 * ALONG, 9.0, w, 1e5, bed)
    assert taut.tension(3.0) == pytest.approx(1e5 * 0.1, rel=1e-12)
    assert taut.length_on_bed == 9.0


def test_without_contact_it_is_the_free_catenary():
    bed, end = bed_through(START, ALONG, friction=0.5), START + 30 * ALONG + 40 * UP
    for w, L in ((-900.0, 60.0), (900.0, 51.0), (0.0, 49.0)):
        line, free = between(START, end, L, w, 1e6, bed), catenary.between(START, end, L, w, 1e6)
        assert (line.H, line.V0, line.length_on_bed) == (free.H, free.V0, 0.0)
    with pytest.raises(ValueError, match="cannot span 50"):
        between(START, end, 49.0, 900.0, math.inf, bed)
