"""A line at rest on a sea bed: flat, sloped, soft, with friction, slack, lifted.

Source: closed forms and matched boundary layers in tests/reference (mpmath, DOP853, checked with MoorPy).
"""

import functools
import math

import numpy as np
import pytest
from alone import solve_static
from helpers import reference

import dolfbuoy
from dolfbuoy import load_scene
from dolfbuoy.results.summary import static_warnings
from dolfbuoy.statics.equilibrium import solve_equilibrium

CASES = reference("bed_and_networks")["cases"]
PAIRS = [(1, 0), (2, 1), (3, 2)]
LAWS = ["compressive", "tension-only"]
DIAMETER = 0.1


def scene(name, pair, elements, sag=1e-3, **changes):
    """A case as its `scene_hint` says: the top at the water line, and a bed on which the line sinks by `sag`."""
    case = CASES[name]["input"]
    w, area = case["w"], math.pi * DIAMETER**2 / 4
    cable = {"length": float(case["L"]), "line_density": w / 9.81 + 1025 * area, "diameter": DIAMETER}
    cable |= {"axial_stiffness": float(case["EA"]), "elements": elements}
    cable |= {"position_degree": pair[0], "tension_degree": pair[1]}
    cable |= {"top": {"kind": "fixed", "position": [float(case["X"]), 0.0, 0.0]}}
    slope = math.tan(math.radians(case.get("slope_deg", 0.0)))
    bed = {"friction": case["mu"], "slope": [slope, 0.0], "stiffness": case.get("K_per_length", w / sag) / DIAMETER}
    return load_scene({"sea": {"depth": float(case["Z"])}, "cable": cable, "seabed": bed}, **changes)


def anchor_tension(found, pair):
    """T(0): a tension of degree 0 is that of the middle of an element, through two of which goes a line."""
    tension = found.cable_tension.values.ravel()
    return 1.5 * tension[0] - 0.5 * tension[1] if pair == (1, 0) else float(found.tension_anchor)


#: Frictionless, with one answer.
TAUT = [name for name, c in CASES.items() if name.startswith("bed_") and not c["input"]["mu"] and name != "bed_slack"]
WITHIN = {20: 1e-2, 80: 1e-3}


@pytest.mark.parametrize("slack", LAWS)
@pytest.mark.parametrize("pair", PAIRS, ids=str)
@pytest.mark.parametrize("name", TAUT)
def test_without_friction(name, pair, slack):
    case, values = CASES[name]["input"], CASES[name]["values"]
    for elements, within in WITHIN.items():
        whole = dolfbuoy.solve_static(scene(name, pair, elements, cable__slack=slack))
        found = whole.squeeze()
        assert float(found.tension_top) == pytest.approx(values["T_top"], rel=within)
        assert anchor_tension(found, pair) == pytest.approx(values["T_anchor"], rel=within)
        assert np.linalg.norm(found.anchor_force) == pytest.approx(values["T_anchor"], rel=within)
        assert static_warnings(whole, scene(name, pair, elements)) == []
        if values["regime"] == "lifted":
            assert np.isnan(found.touchdown.values[0])
            assert float(found.length_on_bed) == 0
            continue
        # half an element, and the bend of the line into a bed that is not rigid
        near = 0.5 * case["L"] / elements + math.sqrt(1e-3 * values["H"] / case["w"])
        assert float(found.touchdown[0]) == pytest.approx(values["x_touchdown"], abs=near)
        assert float(found.length_on_bed) == pytest.approx(values["length_on_bed"], abs=near)


@pytest.mark.parametrize("slack", LAWS)
@pytest.mark.parametrize("pair", PAIRS, ids=str)
@pytest.mark.parametrize("name", ["bed_chain100_mu0.5", "bed_soft_mu0.6"])
def test_pulled_with_friction(name, pair, slack):
    """Coulomb's state after a monotone pull: the tension of the anchor too, where it does not come through as well."""
    values = CASES[name]["values"]
    for elements, within in WITHIN.items():
        changes = {"seabed": {"start": "pulled", "stick_length": 5e-3}, "cable__slack": slack}
        found = solve_static(scene(name, pair, elements, **changes))
        assert float(found.tension_top) == pytest.approx(values["T_top"], rel=within)
        assert anchor_tension(found, pair) == pytest.approx(values["T_anchor"], abs=within * values["T_top"])
        frictionless = solve_static(scene(name, pair, elements, cable__slack=slack))
        assert float(frictionless.tension_anchor) > values["T_anchor"] + 0.05 * values["T_top"]


@pytest.mark.parametrize(("pair", "elements"), [((1, 0), 160), ((2, 1), 80), ((3, 2), 80)], ids=str)
@pytest.mark.parametrize("name", ["winkler_sag1m", "winkler_sag0.01m"])
def test_soft_bed(name, pair, elements):
    """1e-4 with 80 elements; straight ones are 1.2e-4 and 2.4e-4 off then, and take 160.

    Their own chords are what is wrong: contact at the nodes gives 6e-4 on the harder bed, and integrated exactly 3e-4.
    """
    values = CASES[name]["values"]
    found = solve_static(scene(name, pair, elements))
    assert float(found.tension_top) == pytest.approx(values["T_top"], rel=1e-4)
    assert np.linalg.norm(found.anchor_force) == pytest.approx(values["T_anchor"], rel=1e-4)
    assert float(found.length_on_bed) == pytest.approx(values["length_in_contact"], abs=1.0)
    lowest = found.cable_position[:, 2].min().item() + 100.0
    assert lowest == pytest.approx(values["z_min"], rel=0.05 if pair[0] > 1 else 0.1)


@pytest.mark.parametrize(("pair", "within"), [((1, 0), 5e-2), ((2, 1), 1.5e-2), ((3, 2), 1.5e-2)], ids=str)
def test_slack(pair, within):
    """H = 0: Newton alone fails, relaxation finds what hangs, to half an element; within to the digits of its 5e-2.

    Of 40 straight elements seven hang, and half the weight of the eighth, whose foot the bed carries: 7.5 for 7.14 of
    14 m, 5.009e-2, however the contact is integrated.
    """
    case, values = CASES["bed_slack"]["input"], CASES["bed_slack"]["values"]
    given = scene("bed_slack", pair, 40, sag=0.01, cable__slack="tension-only")
    found = solve_static(given)
    assert found.attrs["route"] in ("large steps", "relaxation")
    if pair == (1, 0):
        assert float(found.tension_top) == pytest.approx(7.5 * 14.0 * case["w"], rel=1e-6)
    assert round(abs(float(found.tension_top) / values["T_top"] - 1), 3) <= within
    assert float(found.length_on_bed) == pytest.approx(values["length_on_bed"], abs=14.0)
    assert abs(float(found.end_tension[0])) < 1e-6 * values["T_top"]
    assert float(found.tension_anchor) < 1e-6 * values["T_top"]
    assert float(found.cable_tension.min()) >= -1e-12  # 0 to rounding


def test_a_two_sided_law_says_what_a_slack_line_does_to_it():
    """It ends in a state with compressed elements, and says so."""
    given = scene("bed_slack", (2, 1), 40, sag=0.01)
    assert any("compressed" in sentence for sentence in static_warnings(dolfbuoy.solve_static(given), given))


def test_default_bed():
    """The sag rule: 1e-4 of the depth, 1 cm at most, costs about 1.2 sag/depth of the top tension."""
    name = "bed_chain100_frictionless"
    given = scene(name, (3, 2), 160).to_dict()
    given["seabed"].pop("stiffness")
    problem = solve_equilibrium(load_scene(given))
    found = problem.lines.bed.grounded(problem.system.u)
    assert found.sag == pytest.approx(0.01, rel=0.05)
    error = np.linalg.norm(problem.end_tension()) / CASES[name]["values"]["T_top"] - 1
    assert 0.5 < error / (1.2 * 0.01 / 100) < 2
    problem.destroy()


@functools.cache
def turned(angle):
    """(tension at the top, position of the nodes turned back) of a line that runs in another direction."""
    c, s = math.cos(angle), math.sin(angle)
    slope, x = 0.05, 500.0
    given = scene("bed_chain100_frictionless", (2, 1), 24, seabed={"slope": [c * slope, s * slope]})
    found = solve_static(given, cable__top__position=[c * x, s * x, 0.0])
    R = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return float(found.tension_top), found.cable_position.values @ R.T


@pytest.mark.parametrize("angle", [0.7, 2.0, 4.4])
def test_directions_are_alike(angle):
    tension, position = turned(angle)
    assert tension == pytest.approx(turned(0.0)[0], rel=1e-8)
    np.testing.assert_allclose(position, turned(0.0)[1], atol=1e-5)
    assert np.ptp(position[:, 2]) > 50
