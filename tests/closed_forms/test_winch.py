"""Winches: lines whose unstretched length is a function of time.

Source: Newton's second law for a lifted mass; catenaries of the final length; conservation of energy; the scene's own
table, passed as a caller's function.
"""

import math

import numpy as np
import pytest
from alone import simulate
from every_key import shows

from dolfbuoy import InputError, Session, load_scene, solve_static
from dolfbuoy.model.winch import path_of
from dolfbuoy.studies.physics import energy

MASS, G = 50.0, 9.81
ROWS = [[0.5, 10.0], [1.5, 9.4], [2.5, 9.0], [3.5, 9.3]]
#: A mass on a line that hardly weighs anything, from the ceiling.
LIFTED = {
    "gravity": G,
    "joint": [{"name": "load", "mass": MASS}],
    "cable": {
        "length": 10.0,
        "elements": 2,
        "line_density": 1e-6,
        "from": "load",
        "to": [0.0, 0.0, 0.0],
        "winch": ROWS,
    },
    "time": {"end": 4.0, "step": 0.01, "scheme": "bdf2"},
}


@shows("cable.winch")
def test_a_load_that_is_lifted():
    """It is where the inextensible line lets it be, and the tension is m (g - L_tt)."""
    run, path = simulate(LIFTED), path_of(ROWS)
    t = run.time.values
    z = run.joint_position.sel(joint="load", xyz="z").values
    np.testing.assert_allclose(z, -path(t), rtol=1e-8)
    h = 0.01  # BDF2's own second difference of the places, which the tension of its equations has
    rate = (3 * path(t[2:]) - 4 * path(t[1:-1]) + path(t[:-2])) / (2 * h)
    expected = MASS * (G - (3 * rate[2:] - 4 * rate[1:-1] + rate[:-2]) / (2 * h))
    np.testing.assert_allclose(run.tension_top.values.ravel()[4:], expected, rtol=1e-4)
    assert np.ptp(expected) > 0.2 * MASS * G


def test_length_between_rows():
    """Even where the rows are, at rest at both ends, never beyond the rows."""
    path = path_of([[0.0, 1.0], [1.0, 2.0], [2.0, 3.0], [3.0, 4.0], [4.0, 4.0], [5.0, 2.0]])
    assert (path(1.6) - path(1.4)) / 0.2 == pytest.approx(1.0, rel=1e-9)
    assert path(np.array([-1.0, 0.0, 1.0, 3.0, 5.0, 9.0])) == pytest.approx([1.0, 1.0, 2.0, 4.0, 2.0, 2.0])
    fine = path(np.linspace(0, 5, 501))
    assert fine.max() <= 4.0
    assert (np.diff(fine)[:300] >= 0).all()
    assert [path(0.001) - 1.0, path(4.999) - 2.0] == pytest.approx([0.0, 0.0], abs=1e-5)


WATER = {
    "sea": {"depth": 30.0},
    "cable": {
        **{"length": 36.0, "elements": 6, "line_density": 3.0, "diameter": 0.04, "axial_stiffness": 1e6},
        **{"normal_drag": 1.5, "tangential_drag": 0.5, "from": [0.0, 0.0, -28.0], "to": [20.0, 0.0, -2.0]},
    },
    "time": {"end": 30.0, "step": 0.05, "scheme": "backward-euler"},
}


def wound(length, keys=("cable__winch",)):
    return load_scene(WATER, **{key: [[0.0, 36.0], [10.0, length]] for key in keys})


@pytest.mark.parametrize("length", [33.0, 37.0])
def test_rest_after_winding(length):
    """Wound in or paid out, the line comes to hang as one of that length from the start."""
    run = simulate(wound(length))
    rest = solve_static(load_scene(WATER, cable__length=length))
    for name in ("tension_top", "tension_anchor"):
        assert float(run[name][-1]) == pytest.approx(float(rest[name][0]), rel=1e-3)
    np.testing.assert_allclose(run.cable_position.values[-1], rest.cable_position.values, atol=5e-3)


@shows("cable.segments.winch")
def test_a_segment_that_is_wound():
    """The other one keeps its length."""
    half = {key: WATER["cable"][key] for key in ("line_density", "diameter", "axial_stiffness", "normal_drag")}
    low, high = half | {"length": 20.0, "elements": 3}, half | {"length": 16.0, "elements": 3}
    line = {"from": WATER["cable"]["from"], "to": WATER["cable"]["to"]}
    scene = WATER | {"cable": line | {"segments": [low, high | {"winch": [[0.0, 16.0], [10.0, 13.0]]}]}}
    run = simulate(scene)
    rest = solve_static(WATER | {"cable": line | {"segments": [low, high | {"length": 13.0}]}})
    assert float(run.tension_top[-1]) == pytest.approx(float(rest.tension_top[0]), rel=1e-3)


def test_energy():
    """What the winch feeds in is in the balance, which closes with the order of the scheme."""
    scene = load_scene(WATER, cable__winch=[[0.0, 36.0], [1.6, 35.0], [2.4, 35.5]], cable__axial_stiffness=2e4)
    case = {"scene": scene, "t_end": 3.2, "scheme": "generalized-alpha"}
    rows = [energy.evaluate(case | {"step": step}) for step in (0.04, 0.02)]
    assert abs(rows[1]["winch"]) > 100 * abs(rows[1]["defect"])
    assert math.log2(rows[0]["defect"] / rows[1]["defect"]) == pytest.approx(2, abs=0.15)


def test_a_caller_winds_as_the_scene():
    """The same function of time, bit for bit; and lengths step by step nearly so."""
    time = {"end": 1.0, "step": 0.05, "scheme": "bdf2"}
    path = path_of([[0.0, 36.0], [0.8, 35.0]])
    expected = simulate(load_scene(WATER, cable__winch=[[0.0, 36.0], [0.8, 35.0]], time=time)).tension_top.values
    with Session(WATER, driven=["cable.winch"], time=time) as s:
        s.drive("cable.winch", path)
        found = [float(s.values()["tension_top"][0])]
        for _ in range(20):
            s.step()
            found.append(float(s.values()["tension_top"][0]))
    np.testing.assert_array_equal(found, expected.ravel())
    with Session(WATER, driven="cable.winch", time=time) as s:
        for k in range(1, 21):
            s.drive("cable.winch", float(path(0.05 * k)))
            s.step()
            assert float(s.values()["tension_top"][0]) == pytest.approx(found[k], rel=1e-8)
        with pytest.raises(InputError, match=r"must be a length > 0 of cable.winch"):
            s.drive("cable.winch", -1.0)


BAD = [
    ([[0.0, 30.0], [1.0, 33.0]], "must begin at t = 0 or later, with length = 36.0 m"),
    ([[0.0, 36.0], [1e-3, 33.0]], "must not be faster than 1000 m/s"),
    ([[0.0, 36.0], [0.0, 33.0]], "must hold rows of growing time"),
]


@pytest.mark.parametrize(("rows", "sentence"), BAD)
def test_a_winch_that_cannot_be(rows, sentence):
    with pytest.raises(InputError, match="winch") as error:
        load_scene(WATER, cable__winch=rows)
    assert sentence in str(error.value)
