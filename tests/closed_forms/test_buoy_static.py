"""Moored equilibria of the reference cylinders in a current and under an external force.

Source: equilibria of tests/reference (scipy/mpmath, two methods).
"""

import math

import numpy as np
import pytest
from alone import solve_static
from helpers import rates, reference, reference_buoy

from dolfbuoy.errors import InputError

CASES = reference("buoy_statics")["moored_equilibria"]


def moored(name, degrees, elements):
    """Scene of a case; the reference's origin is the anchor, here the water is at z = 0."""
    case, short = CASES[name], name.startswith("A")
    length, weight, depth = (22.0, 220.212800751986, 20.0) if short else (750.0, 40.68980075198597, 700.0)
    cable = {"length": length, "line_density": weight / 9.81 + 1025 * math.pi * 0.08**2 / 4, "diameter": 0.08}
    cable |= {"axial_stiffness": 2.3e8, "elements": elements, "position_degree": degrees[0]}
    cable |= {"tension_degree": degrees[1], "normal_drag": 0.8, "tangential_drag": 0.1}
    buoy = reference_buoy("buoyA_short" if short else "buoyB_long", normal_drag=0.8)
    scene = {"sea": {"depth": depth}, "cable": cable, "buoy": buoy}
    if case["U"]:
        scene["current"] = {"speed": case["U"]}
    if case["Fext"]:
        scene["external_force"] = {"force": [case["Fext"], 0.0, 0.0]}
    return scene


def errors(name, result):
    """Errors of mooring point and C [m], tilt [deg], and relative errors of tensions and displaced mass."""
    case, origin = CASES[name], np.array([0, 0, 20.0 if name.startswith("A") else 700.0])
    return {
        "keel": np.abs(result.mooring_point.values + origin - case["keel_pos"]).max(),
        "C": np.abs(result.buoy_position.values + origin - case["r_C"]).max(),
        "tilt": abs(float(result.cone_angle) - case["tilt_deg"]),
        "top": abs(float(result.tension_top) / case["T_top"] - 1),
        "anchor": abs(float(result.tension_anchor) / case["T_bottom"] - 1),
        "mass": abs(float(result.displaced_mass) / case["M_D"] - 1),
    }


@pytest.mark.parametrize("name", CASES)
def test_equilibrium_of_the_reference(name):
    """The reference's drag acts in B over the wet length, here on the wet diameter of every strip."""
    tolerances = {"keel": 5e-5, "C": 5e-5, "tilt": 2e-3, "top": 5e-7, "anchor": 1e-3, "mass": 3e-7}
    result = solve_static(moored(name, (3, 2), 64))
    for key, error in errors(name, result).items():
        assert error < tolerances[key], key
    force = np.array(CASES[name]["T_bnd"])
    np.testing.assert_allclose(result.end_tension, force, atol=1e-5 * np.linalg.norm(force))
    np.testing.assert_allclose(result.mooring_force, -result.end_tension, rtol=1e-14)
    assert int(result.newton_iterations) <= 8


@pytest.mark.parametrize("name", ["A_U1_F0_atC", "A_U1_F1000_atC"])
def test_mooring_point_converges_with_the_cable_mesh(name):
    """Order 2 in the number of elements with degrees (1, 0), against the same hull on a fine mesh."""
    fine = solve_static(moored(name, (3, 2), 64))
    sizes = [16, 32, 64]
    coarse = [solve_static(moored(name, (1, 0), n)) for n in sizes]
    distances = [np.linalg.norm((c.mooring_point - fine.mooring_point).values) for c in coarse]
    tensions = [abs(float(c.tension_top - fine.tension_top)) for c in coarse]
    np.testing.assert_allclose(rates(distances, sizes), 2, atol=0.3)
    np.testing.assert_allclose(rates(tensions, sizes), 2, atol=0.3)


def test_equilibrium_turns_with_the_loads():
    """With current and force rotated by 50 degrees about z, everything else rotates too."""
    scene = moored("A_U1_F1000_atC", (1, 0), 16)
    angle = math.radians(50)
    turned = moored("A_U1_F1000_atC", (1, 0), 16)
    turned["current"]["direction_deg"] = 50.0
    turned["external_force"]["force"] = [1000 * math.cos(angle), 1000 * math.sin(angle), 0.0]
    before, after = solve_static(scene), solve_static(turned)
    R = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    np.testing.assert_allclose(after.cable_position, before.cable_position.values @ R.T, atol=1e-8)
    np.testing.assert_allclose(after.mooring_force, R @ before.mooring_force.values, atol=1e-6)
    assert pytest.approx(float(before.cone_angle), abs=1e-8) == float(after.cone_angle)
    assert float(before.cone_angle) > 5
    np.testing.assert_allclose(before.cable_position[:, 1], 0, atol=1e-12)  # a planar scene stays planar


def test_free_buoy_floats_at_its_draft():
    """Without a cable: upright in still water, under any horizontal force."""
    b = reference("buoy_statics")["buoyB_long"]
    result = solve_static({"sea": {"depth": 60.0}, "buoy": reference_buoy("buoyB_long")})
    assert pytest.approx(b["M"], rel=1e-8) == float(result.displaced_mass)
    assert pytest.approx(b["zG_above_keel"] - b["draft"], abs=1e-3) == float(result.buoy_position[2])
    assert abs(float(result.cone_angle)) < 1e-8


@pytest.mark.parametrize("elements", [1, 4])
@pytest.mark.parametrize("EA", [100.0, float("inf")])
@pytest.mark.parametrize("sea", [False, True])
def test_weightless(sea, EA, elements):
    """Without gravity and loads a moored buoy's position is undetermined; under one force its cable is straight."""
    scene = {
        "gravity": 0.0,
        "cable": {"length": 2.0, "line_density": 1.0, "axial_stiffness": EA, "elements": elements},
        "buoy": {"mass": 1.0, "center_of_mass": 0.5, "inertia": [1.0, 1.0]},
    }
    if sea:
        wet = {"sea": {"depth": 5.0}, "cable": {"diameter": 0.05}, "buoy": {"hull": [[0.0, 1.0], [1.0, 1.0]]}}
        scene = {"sea": wet["sea"]} | {k: v | wet.get(k, {}) if isinstance(v, dict) else v for k, v in scene.items()}
    with pytest.raises(InputError, match=r"gravity = 0\.0: no load holds the moored buoy"):
        solve_static(scene)
    force = np.array([3.0, 0.0, 4.0])
    record = solve_static(scene, external_force__force=force.tolist())
    assert record.attrs["route"] == "newton"
    assert float(record.tension_top) == pytest.approx(5.0, rel=1e-9)
    anchor = [0.0, 0.0, -5.0 if sea else 0.0]
    assert np.allclose(record.mooring_point - anchor, 2.0 * (1 + 5.0 / EA) * force / 5, rtol=0, atol=1e-7)


def test_a_free_weightless_cable_that_nothing_pulls_at():
    scene = {"gravity": 0.0, "cable": {"length": 1.0, "line_density": 1.0, "elements": 2, "top": {"kind": "free"}}}
    with pytest.raises(InputError, match=r"cable\.top\.force = .*nothing pulls at this cable"):
        solve_static(scene)
