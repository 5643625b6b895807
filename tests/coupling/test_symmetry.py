"""No preferred horizontal direction: a scene rotated about z gives the same motion, rotated.

Source: the rotated run, and its mirror plane.
"""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged, quaternion_product, simulate_evenly

SCENE = merged(
    MOORED,
    cable__elements=6,
    current__direction_deg=20.0,
    waves__direction_deg=-40.0,
    waves__ramp=0.5,
    wind={"speed_10m": 15.0, "direction_deg": 10.0, "area": 3.0, "height": 2.5},
    external_force={"force": [700.0, -400.0, 150.0], "height": 2.2},
    time={"end": 0.6, "step": 0.02, "output_every": 0.02},
)


def turned(scene, degrees):
    """The scene with every direction rotated about z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = scene["external_force"]["force"]
    result = merged(scene, external_force__force=[c * x - s * y, s * x + c * y, z])
    for section in ("current", "waves", "wind"):
        result[section]["direction_deg"] = scene[section]["direction_deg"] + degrees
    return result


@pytest.fixture(scope="module")
def straight():
    return simulate_evenly(SCENE)


@pytest.mark.parametrize("degrees", [30, 90])
def test_turned_scene(straight, degrees):
    run = simulate_evenly(turned(SCENE, degrees))
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for name in ("buoy_position", "cable_position", "mooring_point", "mooring_force", "end_tension", "linear_momentum"):
        size = np.abs(straight[name].values).max()
        assert run[name].values == pytest.approx(straight[name].values @ R.T, abs=1e-8 * size), name
    spin = np.abs(straight.angular_momentum.values).max()
    assert run.angular_momentum.values == pytest.approx(straight.angular_momentum.values @ R.T, abs=1e-7 * spin)
    for name in ("tension_top", "tension_anchor", "displaced_mass", "cone_angle", "surface_elevation"):
        assert run[name].values == pytest.approx(straight[name].values, rel=1e-8, abs=1e-8), name
    half = np.radians(degrees) / 2
    turn, back = np.array([np.cos(half), 0, 0, np.sin(half)]), np.array([np.cos(half), 0, 0, -np.sin(half)])
    for q, q_straight in zip(run.buoy_orientation.values, straight.buoy_orientation.values, strict=True):
        expected = quaternion_product(quaternion_product(turn, q_straight), back)
        assert q * np.sign(q @ expected) == pytest.approx(expected, abs=1e-9)


def test_the_scene_is_not_symmetric(straight):
    """The tests above do not hold trivially, by zeros."""
    move = straight.buoy_position.values - straight.buoy_position.values[0]
    assert np.all(np.abs(move).max(axis=0) > 1e-3)
    assert np.abs(straight.angular_momentum.values).max(axis=0).min() > 0.1


def test_planar_scene_stays_planar():
    scene = merged(
        SCENE,
        current__direction_deg=0.0,
        waves__direction_deg=180.0,
        wind__direction_deg=0.0,
        external_force__force=[700.0, 0.0, 150.0],
    )
    run = simulate_evenly(scene)
    assert np.abs(run.buoy_position.values[:, 0] - run.buoy_position.values[0, 0]).max() > 0.01
    for name in ("buoy_position", "cable_position", "mooring_point"):
        assert np.abs(run[name].sel(xyz="y")).max() < 1e-11, name
    assert np.abs(run.mooring_force.sel(xyz="y")).max() < 1e-8 * np.abs(run.mooring_force).max()
    assert np.abs(run.linear_momentum.sel(xyz="y")).max() < 1e-9 * np.abs(run.linear_momentum).max()
    spin = run.angular_momentum
    assert max(np.abs(spin.sel(xyz="x")).max(), np.abs(spin.sel(xyz="z")).max()) < 1e-9 * np.abs(spin).max()
    assert np.abs(run.buoy_orientation.values[:, [1, 3]]).max() < 1e-11
