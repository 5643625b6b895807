"""The closed-form catenary against values computed outside this project.

Source: tests/reference (scipy/mpmath, two methods); a spring by hand.
"""

import numpy as np
import pytest
from helpers import reference, under_end_force

from dolfbuoy.statics import catenary

CASES = reference("catenary")
BETWEEN = ["C1_fold_0.01_0.8", "C3_moderate_0.6_0.5", "E4_dirichlet_EA1e6", "P_short_EA2.3e8", "P_long_EA2.3e8"]
UNDER_FORCE = ["N1_neumann_inext", "E1_neumann_elastic50"]
START = np.array([1.3, -0.4, 2.2])
ALONG = np.array([0.28, -0.96, 0.0])


def world(x, z):
    return START + x * ALONG + z * np.array([0, 0, 1.0])


def check_table(shape, values, rel):
    """Position and tension along the cable; rounding of z relative to the length."""
    L, table = values["L"], values["table"]
    assert len(table) >= 5
    s = np.array([row["s"] for row in table])
    np.testing.assert_allclose(shape.position(s), [world(row["x"], row["z"]) for row in table], atol=rel * L)
    np.testing.assert_allclose(shape.tension(s), [row["T"] for row in table], rtol=rel)


@pytest.mark.parametrize("name", BETWEEN)
def test_between_two_points(name):
    values = CASES[name]
    L, w, EA, end = values["L"], values.get("w", values.get("w_sub")), float(values["EA"]), values["table"][-1]
    shape = catenary.between(START, world(end["x"], end["z"]), L, w, EA)
    # the chord is read from world coordinates, to 1e-16 of their size: the fold of C1 feels that in H
    rel = 1e-11 if name.startswith("C1") else 1e-12
    assert pytest.approx(values["H"], rel=rel) == shape.H
    assert pytest.approx(values["V0"], rel=rel) == shape.V0
    assert pytest.approx(values["VL"], rel=rel) == float(shape.vertical(L))
    check_table(shape, values, rel)


@pytest.mark.parametrize("name", UNDER_FORCE)
def test_under_an_end_force(name):
    values = CASES[name]
    force = values["H"] * ALONG + [0, 0, values["VL"]]
    shape = under_end_force(START, force, values["L"], values["w"], float(values["EA"]))
    assert pytest.approx(values["V0"], rel=1e-15) == shape.V0
    check_table(shape, values, 1e-14)


@pytest.mark.parametrize("name", [*BETWEEN, *UNDER_FORCE])
def test_end_force_and_end_point_are_inverse(name):
    values = CASES[name]
    L, w, EA = values["L"], values.get("w", values.get("w_sub")), float(values["EA"])
    force = values["H"] * ALONG + [0, 0, values["VL"]]
    end = under_end_force(START, force, L, w, EA).position(np.array([L]))[0]
    back = catenary.between(START, end, L, w, EA)
    assert pytest.approx(values["H"], rel=1e-10) == back.H
    assert pytest.approx(values["V0"], rel=1e-10) == back.V0


def test_vertical_elastic_cable():
    values = CASES["V1_vertical_elastic"]
    shape = under_end_force(START, [0, 0, values["V0"] + values["w"]], 1.0, values["w"], values["EA"])
    z = shape.position(np.array([0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0])) - START
    np.testing.assert_allclose(z, np.outer(values["z"], [0, 0, 1.0]), atol=1e-15)


def test_cable_that_floats():
    """Lighter than water: the mirror image, above the chord."""
    values = CASES["buoyant_0.6_0.5"]
    shape = catenary.between(START, world(0.6, 0.5), 1.0, -1.0, np.inf)
    assert pytest.approx(values["H"], rel=1e-12) == shape.H
    assert pytest.approx(values["V0"], rel=1e-12) == shape.V0
    for s in ("0.25", "0.5", "0.75", "1"):
        x, z = shape.plane(float(s))
        assert pytest.approx(values["x_of_s"][s], abs=1e-12) == float(x)
        assert pytest.approx(values["z_of_s"][s], abs=1e-12) == float(z)
        assert pytest.approx(values["T_of_s"][s], rel=1e-12) == float(shape.tension(float(s)))


@pytest.mark.parametrize("x", ["0.1", "0.01"])
def test_nearly_vertical_slack_cable(x):
    """22 m of the short cable over a chord of 20 m: a fold of millimetres and less."""
    values = CASES["near_vertical_L22_z20"][x]
    offset = float(x)
    shape = catenary.between(START, world(offset, 20.0), 22.0, 220.212800751986, np.inf)
    assert pytest.approx(values["H"], rel=1e-9) == shape.H
    assert pytest.approx(values["V0"], rel=1e-9) == shape.V0


@pytest.mark.parametrize(
    ("name", "end", "L", "w"),
    [
        ("short_12_16.5", (12.0, 16.5), 22.0, 220.212800752),
        ("long_245_700", (245.0, 700.0), 750.0, 40.6898007520),
    ],
)
def test_tensions_of_driven_cables(name, end, L, w):
    values = CASES["driven_shapes"][name]
    shape = catenary.between(START, world(*end), L, w, 2.3e8)
    assert pytest.approx(values["H"], rel=1e-10) == shape.H
    assert pytest.approx(values["V_top"], rel=1e-10) == float(shape.vertical(L))
    assert pytest.approx(values["T_top"], rel=1e-10) == float(shape.tension(L))
    assert pytest.approx(values["T_bottom"], rel=1e-10) == float(shape.tension(0.0))


def test_weightless_cable_is_a_straight_spring():
    shape = catenary.between(START, world(0.9, 1.2), 1.25, 0.0, 70.0)
    assert pytest.approx(70.0 * 0.2, rel=1e-14) == float(shape.tension(0.5))
    np.testing.assert_allclose(shape.position(np.array([1.25]))[0], world(0.9, 1.2), rtol=1e-14)


def test_inextensible_cable_that_is_too_short_is_refused():
    with pytest.raises(ValueError, match="cannot span"):
        catenary.between(START, world(0.9, 1.2), 1.49, 1.0, np.inf)
