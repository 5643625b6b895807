"""Sinkers on the bed that can be dragged or lifted during a run.

Source: a block on a plane by hand, which slides as soon as H > mu (W - V), then accelerates at (H - mu (W - V))/m.
"""

import tomllib

import numpy as np
import pytest
from dynamics_helpers import merged
from every_key import shows

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.results.summary import warnings

WEIGHT, FRICTION, DENSITY, GRAVITY = 1e4, 0.5, 2000.0, 9.81
#: Of the body: with its density rho, W = (1 - rho_w/rho) m g.
MASS = WEIGHT / GRAVITY / (1 - 1025 / DENSITY)
#: A rope that weighs next to nothing, pulled at its upper end by a constant force.
LINE = {"length": 15.0, "elements": 4, "diameter": 1e-3, "line_density": 1e-3, "axial_stiffness": 1e6, "damping": 1e4}
SCENE = {
    "sea": {"depth": 20.0},
    "seabed": {"friction": 0.3},
    "anchor": {"weight": WEIGHT, "friction": FRICTION, "density": DENSITY, "drags": True},
    "time": {"end": 1.0, "step": 0.01, "scheme": "bdf2"},
}
#: Displacement by which friction is mobilised: 1e-3 of the depth.
STICK = 0.02


def pulled(H, V, **changes):
    """Record of a sinker pulled sideways by H and up by V [N]."""
    line = LINE | {"top": {"kind": "free", "force": [0.6 * H, 0.8 * H, V]}}
    return dolfbuoy.simulate(load_scene(merged(SCENE | {"cable": line}, **changes)))


def scene_of(record):
    """The scene of a record."""
    return load_scene(tomllib.loads(record.attrs["scene"]))


def way(record):
    """Horizontal distance from the initial position over time [m]."""
    return np.hypot(*record.joint_position.values[:, 0, :2].T)


@shows("anchor.drags")
@pytest.mark.parametrize("V", [0.0, 4e3])
@pytest.mark.parametrize("part", [0.999, 1.001])
def test_a_sinker_slides_exactly_when_its_friction_is_less_than_the_pull(V, part):
    """0.1 % below the limit it stays at rest; above it, it accelerates."""
    H = part * FRICTION * (WEIGHT - V)
    record = pulled(H, V)
    x = way(record)
    assert x[0] == pytest.approx(STICK * H / (FRICTION * WEIGHT), rel=1e-4)
    assert (record.anchor_use.values[-1, 0] > 1) == (part > 1)
    if part < 1:
        np.testing.assert_allclose(x, x[0], rtol=1e-7)
    else:
        assert x[-1] - x[-2] > x[-3] - x[-4] > 0


@shows("anchor.density")
@pytest.mark.parametrize("density", [DENSITY, 7800.0])
def test_it_gains_speed_by_what_friction_leaves(density):
    """x = 1/2 a t^2, with the mass that weight and density give; a first step of a step scheme costs half a step."""
    V, H = 2e3, 6e3
    record = pulled(H, V, anchor__density=density)
    mass = WEIGHT / GRAVITY / (1 - 1025 / density)
    a, x, t = (H - FRICTION * (WEIGHT - V)) / mass, way(record), record.time.values
    np.testing.assert_allclose(np.polyfit(t[5:], x[5:], 2)[:2], [a / 2, 0.0], rtol=2e-3, atol=a * 0.01)
    assert record.anchor_moved.values[-1, 0] == pytest.approx(np.hypot(x[-1], 1e-3), rel=1e-3)
    scene = scene_of(record)
    (said,) = [sentence for sentence in warnings(record, scene) if "did not hold" in sentence]
    assert f"{record.anchor_moved.values[-1, 0]:.3g} m from its place" in said


def test_it_is_lifted_by_more_than_its_weight():
    record = pulled(10.0, 1.2 * WEIGHT)
    z, t = record.joint_position.values[:, 0, 2], record.time.values
    assert 2 * np.polyfit(t[5:], z[5:], 2)[0] == pytest.approx(0.2 * WEIGHT / MASS, rel=2e-3)


@pytest.mark.parametrize("start", [pytest.param("frictionless", marks=pytest.mark.slow), "pulled"])
def test_a_sinker_that_holds_is_an_anchor(start):
    """The chain's rest and its first steps are those of an anchor, but for the way on which friction is mobilised."""
    change = {"seabed.start": start, "time.end": 0.2}
    held, found = (dolfbuoy.simulate(load_scene("navigation-buoy", **change, anchor__drags=d)) for d in (False, True))
    np.testing.assert_allclose(found.tension_top, held.tension_top, rtol=1e-6)
    assert float(found.anchor_moved.max()) < 0.002
    assert "anchor_moved" not in held


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"seabed.friction": 0.0}, "seabed.friction = 0.0: must be above 0"),
        ({"seabed": None}, "seabed: must be given"),
        ({"anchor.density": 1000.0}, "anchor.density = 1000.0: must be above that of the water"),
        ({"cable.anchor": [0.0, 0.0, -19.0]}, "anchor.drags = True: needs a sinker on the bed"),
        (
            {"anchor.holding_capacity": 1e4, "anchor.weight": None, "anchor.friction": None},
            "anchor.drags = True: goes with a sinker",
        ),
    ],
)
def test_what_cannot_be_dragged(change, said):
    line = LINE | {"top": {"kind": "free", "force": [1e3, 0.0, 1e3]}}
    with pytest.raises(InputError) as error:
        load_scene(SCENE | {"cable": line}, **change)
    assert said in str(error.value)
