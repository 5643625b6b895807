"""Errors against size, orders, rounded numbers, accuracies and crests, each alone at its limits.

Source: powers, triangles and the Rayleigh distribution by hand.
"""

import math

import numpy as np
import pytest
from made_up import SCENE

from dolfbuoy import InputError, load_scene
from dolfbuoy.results import compare, extremes, measured


def test_sizes_beyond_what_was_measured():
    """Nothing is known beyond the largest, powers below the smallest, of the order four at most."""
    assert compare.Curve([])(1.0) == math.inf
    curve = compare.Curve([(2.0, 32.0), (1.0, 1.0), (4.0, 16.0)])
    assert (curve.order, curve(0.5), curve(4.0), curve(4.0 * (1 + 2e-9))) == (
        4.0,
        1 / 16,
        pytest.approx(32.0),
        math.inf,
    )
    assert curve(math.sqrt(2)) == pytest.approx(math.sqrt(32))
    assert curve.largest(1.0, [0.5, 1.0, 2.0]) == 1.0
    assert compare.nice_numbers(0.9, 20.0) == [1, 1.25, 1.6, 2, 2.5, 3.2, 4, 5, 6.4, 8, 10, 12.5, 16, 20]
    assert compare.nice_numbers(0.3, 1.0) == [0.32, 0.4, 0.5, 0.64, 0.8, 1.0]
    assert [compare._relative(*pair) for pair in ((3.0, 2.0), (0.0, 0.0), (1e-9, 0.0))] == [1.5, 0.0, math.inf]
    assert [compare._columns(np.zeros(shape)).shape for shape in ((3,), (3, 2), (3, 2, 4))] == [(3, 1), (3, 2), (3, 8)]
    assert compare.own_error([8.0, 4.0]) == pytest.approx(4.0)  # first order
    assert compare.own_error([64.0, 4.0]) == pytest.approx(4 / 3)  # at most second
    assert compare.own_error([64.0, 4.0], 4.0) == pytest.approx(4 / 15)
    assert (compare.own_error([3.0]), compare.own_error([0.0, 3.0])) == (1.0, 3.0)
    assert [compare.resolved(e, 1.0) for e in (3.0, 2.99)] == [True, False]
    assert (compare.bound(2.0, 1.0), compare.bound(4.0, 1.0)) == (3.0, 4.0)
    assert [compare.parse_accuracy(text) for text in ("0.001%", " 50 %", "0.5", "1e-5")] == [1e-5, 0.5, 0.5, 1e-5]
    for text in ("0.00099%", "50.1%", "0.51", "a", "nan"):
        with pytest.raises(InputError, match="must be from"):
            compare.parse_accuracy(text)
    with pytest.raises(InputError, match="too short to compare"):
        compare._rms(np.zeros(1), np.zeros(1))
    assert compare._rms(np.array([0.0, 1.0, 4.0]), np.array([0.0, 2.0, 4.0])) == pytest.approx(math.sqrt(8.0))


def test_rows_of_sizes_have_their_orders():
    rows = [{"h": h, "e": e} for h, e in ((1.0, 8.0), (0.5, 2.0), (0.25, 0.0), (0.125, 1.0))]
    compare.orders(rows, "e")
    assert [row["order_e"] for row in rows] == [None, 2.0, None, None]
    assert compare.pareto([(2.0, 1.0), (1.0, 5.0), (1.0, 4.0), (3.0, 1.0), (4.0, 0.5)]) == [2, 0, 4]


def test_crests_of_three_hours():
    assert [extremes.crests_of(T) for T in (5.0, 5400.0, 9000.0)] == [2160.0, 2.0, 2.0]
    rayleigh = extremes.largest_crest(1)
    assert rayleigh.mean == pytest.approx(math.sqrt(math.pi / 2), rel=1e-7)
    assert rayleigh.standard_deviation == pytest.approx(math.sqrt(2 - math.pi / 2), rel=1e-7)
    assert extremes.deviation_uncertainty(8.0, 2.0) == pytest.approx(1.96)
    assert [extremes.components_needed(math.exp(q), 0.01) for q in (2.0, 9.96, 10.04)] == [1, 100, 101]


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({}, ["tension_top", "tension_anchor", "buoy_position", "cone_angle"]),
        ({"buoy": None, "wind": None, "external_force": None, "cable.top": {"kind": "free"}}, ["tension_anchor"]),
        ({"cable": None}, ["buoy_position", "cone_angle"]),
    ],
)
def test_what_is_compared(changes, names):
    """No tension at tops that are free."""
    scene = load_scene(SCENE, **changes)
    assert measured.quantities_of(scene) == names
    measured.check_quantity(scene, names[-1])
    with pytest.raises(InputError, match=f"--quantity pitch: this scene has {', '.join(names)}"):
        measured.check_quantity(scene, "pitch")
