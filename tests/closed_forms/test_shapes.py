"""Hull coefficients from its shape, and its wave radiation damping.

Source: another author's eigenfunction matching for Yeung's truncated cylinder, and Capytaine 3.0 (boundary elements,
800 and 1,600 panels, 1 % off); Haskind's relation; Lamb's thin disc.
"""

import math

import numpy as np
import pytest
from every_key import shows

from dolfbuoy import InputError, load_scene
from dolfbuoy.check import check
from dolfbuoy.linear.periods import buoy_periods
from dolfbuoy.scene import shapes
from dolfbuoy.scene.cylinder import Cylinder, wave_numbers
from dolfbuoy.scene.shapes import estimate

#: Radius 1 m, draft 0.8 m, depth 20 m: omega -> added mass [kg], damping [kg/s] of heave, exciting force [N/m].
YEUNG = {
    0.5: (2394.2, 82.9, 30372.7),
    1.5: (2175.4, 826.27, 21783.4),
    2.5: (1714.36, 1111.11, 11731.4),
    3.0: (1632.88, 866.26, 7880.0),
}
#: (radius, draft, depth, height of the point of rotation), omega: surge, heave and pitch for a density of 1, from the
#: last two of three meshes, whose error goes like the size of their panels.
CAPYTAINE = {
    ((1.5, 0.4, 15.0, 0.2), 2.0): ((1.0905, 0.3395), (6.2154, 5.480), (1.648, 0.1207)),
    ((1.0, 2.0, 20.0, -1.0), 1.9): ((5.836, 1.7007), (1.8253, 0.4500), (1.0329, 0.0706)),
}
DISC = {
    "sea": {"depth": 40.0},
    "buoy": {"hull": [[0.0, 3.0], [1.2, 3.0]], "mass": 3000.0, "center_of_mass": 0.6, "axial_drag": 0.2},
}


@pytest.mark.parametrize("omega", YEUNG)
def test_heave_is_that_of_other_sums(omega):
    """Numbers of 1e-4; what the sums leave is below 1e-3."""
    found = 1025 * np.array(Cylinder(1.0, 0.8, 20.0).radiation("heave", omega, 9.81))
    np.testing.assert_allclose(found, YEUNG[omega][:2], rtol=1e-3)


@pytest.mark.parametrize("omega", YEUNG)
def test_damping_is_what_haskind_has_of_the_exciting_force(omega):
    """B = k |F|^2/(4 rho g c_g), with the force of the other sums."""
    k, _ = wave_numbers(omega, 20.0, 9.81, 1)
    group = omega / (2 * k) * (1 + 2 * k * 20.0 / math.sinh(2 * k * 20.0))
    _, damping = Cylinder(1.0, 0.8, 20.0).radiation("heave", omega, 9.81)
    assert 1025 * damping == pytest.approx(k * YEUNG[omega][2] ** 2 / (4 * 1025 * 9.81 * group), rel=1e-3)


@pytest.mark.parametrize(("case", "omega"), CAPYTAINE)
def test_all_motions_are_those_of_boundary_elements(case, omega):
    for motion, found in zip(("surge", "heave", "pitch"), CAPYTAINE[case, omega], strict=True):
        np.testing.assert_allclose(Cylinder(*case).radiation(motion, omega, 9.81), found, rtol=0.025)


def test_what_a_long_cylinder_has_across_is_its_displaced_water():
    """C_A = 1 of two dimensions, less what the end lacks."""
    added, damping = Cylinder(1.0, 12.0, 60.0).radiation("surge", 0.1, 9.81, 320)
    assert 0.93 < added / (12.0 * math.pi) < 1.0
    assert damping < 1e-3 * added


@shows("buoy.added_mass", "buoy.axial_added_mass", "buoy.rotational_added_mass", "buoy.wave_damping")
def test_a_shape_stands_for_numbers():
    """A heave decay has the period and the damping of potential flow at its own frequency."""
    shaped = DISC["buoy"] | dict.fromkeys(("added_mass", "axial_added_mass", "rotational_added_mass"), "disc")
    scene = load_scene(DISC | {"buoy": shaped | {"wave_damping": "radiation"}})
    of, buoy = estimate(scene, scene.buoys[0]), scene.network.buoys["buoy"]
    stiffness, mass = 1025 * 9.81 * math.pi * 1.5**2, 3000.0
    draft = 3000.0 / 1025 / (math.pi * 1.5**2)
    added, damping = 1025 * np.array(Cylinder(1.5, draft, 15.0).radiation("heave", of.heave, 9.81))
    assert of.heave == pytest.approx(math.sqrt(stiffness / (mass + added)), rel=5e-3)
    assert buoy.wave_damping[0] == pytest.approx(damping, rel=1e-6)
    assert buoy.axial_added_mass * 1025 * 2 / 3 * math.pi * 1.5**3 == pytest.approx(added, rel=1e-6)
    modes = buoy_periods(load_scene(scene, buoy__axial_drag=0.0))
    assert modes["heave"].period == pytest.approx(2 * math.pi / of.heave, rel=5e-3)
    assert modes["heave"].damping_ratio == pytest.approx(damping / (2 * of.heave * (mass + added)), rel=5e-3)
    assert modes["pitch"].period == pytest.approx(2 * math.pi / of.pitch, rel=0.05)
    assert load_scene(scene.to_dict()) == scene


def test_check_names_numbers_range_and_source():
    deep = {"hull": [[0.0, 1.0], [12.0, 1.0]], "mass": 7000.0, "center_of_mass": 2.0}
    report = check(load_scene({"sea": {"depth": 60.0}, "buoy": deep | {"added_mass": "disc"}}))
    (row,) = [row for row in report.numbers if row[0] == "added_mass of a disc"]
    assert 0.9 < row[1] < 1.0
    assert "Yeung" in row[3]
    assert any("radii is not that of a disc" in said for said in report.warnings)
    report = check(load_scene({"sea": {"depth": 60.0}, "buoy": deep | {"added_mass": "spar"}}))
    assert not any("by this shape" in said for said in report.warnings)
    tail = DISC["buoy"] | {"hull": [[0.0, 0.3], [2.0, 0.3], [2.0, 3.0], [3.0, 3.0]], "wave_damping": "radiation"}
    assert any("no cylinder" in said for said in check(load_scene(DISC | {"buoy": tail})).warnings)


SEA = {"spectrum": "jonswap", "significant_height": 0.2, "components": 20}


@pytest.mark.parametrize(
    ("waves", "matters"),
    [
        ({"amplitude": 0.05, "period": 2.1}, True),
        ({"amplitude": 0.05, "period": 3.2}, False),
        ({"amplitude": 0.05, "period": 9.0}, False),
        (SEA | {"peak_period": 3.2}, True),  # its tail has waves of 2.1 s
        (SEA | {"peak_period": 9.0}, True),  # 8 % of its variance, were the ratio 0.1
        (SEA | {"peak_period": 14.0}, False),
    ],
)
def test_check_warns_where_the_damping_of_waves_is_missed(waves, matters):
    scene = load_scene(DISC | {"waves": waves})
    said = [one for one in check(scene).warnings if "wave_damping = 'radiation' has them" in one]
    assert bool(said) == matters
    assert not any("has them" in one for one in check(load_scene(scene, buoy__wave_damping="radiation")).warnings)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"buoy.added_mass": "disk"}, "buoy.added_mass = 'disk': must be a number, or disc | cylinder | spar"),
        ({"buoy.wave_damping": "waves"}, "buoy.wave_damping = 'waves': must be numbers, or radiation"),
        ({"buoy.wave_damping": [1.0]}, "must be two numbers"),
        ({"buoy.mass": 2e4, "buoy.added_mass": "disc"}, "buoy.added_mass = 'disc': is of a hull that floats"),
        ({"sea": None, "buoy.added_mass": "disc"}, "sea: must be given"),
    ],
)
def test_what_is_no_shape(change, said):
    with pytest.raises(InputError) as error:
        load_scene(DISC, **change)
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("depth", "center", "water", "stands"),
    [(100.0, 0.5, 20.0, True), (15.0, 0.5, 15.0, True), (2.03, 0.5, 2.04, True), (100.0, 3.0, 20.0, False)],
)
def test_the_cylinder_that_an_estimate_is_of(monkeypatch, depth, center, water, stands):
    """Cut at ten radii or drafts, and a fiftieth of the draft below its bottom; frequencies of what swings so."""
    radiated = {"surge": (2.0, 0.2), "heave": (3.0, 0.3), "pitch": (4.0, 0.4)}
    monkeypatch.setattr(shapes, "_radiation", lambda cylinder, motion, *_: radiated[motion])
    hull = {"hull": [[0.0, 2.0], [4.0, 2.0]], "mass": 2000 * math.pi, "center_of_mass": center, "inertia": [9e3, 5e3]}
    scene = load_scene(
        {"gravity": 10.0, "sea": {"depth": depth, "density": 1000.0}, "buoy": hull | {"inertia": [9e3, 5e3]}}
    )
    found = shapes.estimate(scene, scene.buoys[0])
    assert found.cylinder == pytest.approx((1.0, 2.0, water, center - 2.0), rel=1e-9)
    assert found.draft == pytest.approx(2.0, rel=1e-9)
    heave = math.sqrt(10 * math.pi / (2 * math.pi + 3))
    GM = 1.0 + math.pi / 4 / (2 * math.pi) - center
    assert (GM > 0) == stands
    pitch = math.sqrt(2 * math.pi * 10 * GM / (9 + 4)) if stands else heave
    assert (found.heave, found.pitch) == pytest.approx((heave, pitch), rel=1e-9)
    assert (found.of_surge, *found.of_heave, *found.of_pitch) == pytest.approx((2e3, 3e3, 300, 4e3, 400), rel=1e-9)
