"""Networks of finite elements at rest: bridle, float, clump, lazy wave, three lines.

Source: closed forms and shooting (reference/bed_and_networks.json).
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from alone import solve_static

from dolfbuoy import load_scene
from dolfbuoy.model.rigid import weight_per_length
from dolfbuoy.statics.catenary import between

CASES = json.loads((Path(__file__).parents[1] / "reference" / "bed_and_networks.json").read_text())["cases"]
DENSITY, G = 1025.0, 9.81


def line(w, EA, diameter=0.1):
    """Keys of a line of the weight w in water [N/m]."""
    dry = w / G + DENSITY * math.pi * diameter**2 / 4
    return {"line_density": dry, "diameter": diameter, "axial_stiffness": float(EA)}


def test_bridle():
    """Three lines and a weight where they meet, to the reference's 1e-8 at P3-P2 with 12 elements a line."""
    case = CASES["y_bridle_still"]
    given, values = case["input"], case["values"]
    parts = {name: given[name] for name in ("main", "leg1", "leg2")}
    ends = {"main": (given["anchor"], "Y"), "leg1": ("Y", given["fairlead1"]), "leg2": ("Y", given["fairlead2"])}
    shared = {"elements": 12, "position_degree": 3, "tension_degree": 2}
    cables = [
        {"name": name, "from": ends[name][0], "to": ends[name][1], "length": float(part["L"]), **shared}
        | line(part["w"], part["EA"])
        for name, part in parts.items()
    ]
    cables = [{key: [float(x) for x in v] if isinstance(v, list) else v for key, v in c.items()} for c in cables]
    joint = {"name": "Y", "mass": given["joint_net_weight"] / G}
    found = solve_static({"sea": {"depth": 100.0}, "cable": cables, "joint": [joint]})
    np.testing.assert_allclose(found.joint_position.values[0], values["joint"], atol=1e-8 * 100)
    wanted = [values["main"]["T_joint"], values["leg1"]["T_top"], values["leg2"]["T_top"]]
    np.testing.assert_allclose(found.tension_top, wanted, rtol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(found.anchor_force[0]), values["main"]["T_anchor"], rtol=1e-8)
    assert found.attrs["route"] == "newton"


def chain(name, elements, **changes):
    """A scene of a line of segments from the bed, as a case of the references describes it; z = 0 at the surface."""
    given = CASES[name]["input"]
    bodies, segments = given["bodies"] or {}, []
    for k, segment in enumerate(given["segments"]):
        segments.append({key: float(value) for key, value in segment.items() if key != "weight_in_water"})
        segments[-1]["elements"] = elements
        if str(k) in bodies:
            segments[-1]["body"] = {key: value for key, value in bodies[str(k)].items() if key != "at"}
    down = np.array([0.0, 0.0, given["depth"]])
    ends = {"from": (np.array(given["anchor"]) - down).tolist(), "to": (np.array(given["top"]) - down).tolist()}
    speed = given["current"][0]
    current = {"current": {"speed": abs(speed), "direction_deg": 0.0 if speed > 0 else 180.0}} if speed else {}
    cable = {**ends, "position_degree": 2, "tension_degree": 1, "segments": segments}
    return {"sea": {"depth": given["depth"]}, "cable": cable, **current, **changes}


def test_float():
    """A float between wire and chain, to 1e-8 at P2-P1 with 48 elements."""
    found, exact = solve_static(chain("s_float_still", 48)), CASES["s_float_still"]["exact"]
    assert float(found.tension_top) == pytest.approx(float(exact["T_top"]), rel=1e-8)
    x, z = (float(number) for number in exact["joints"][0][:2])
    np.testing.assert_allclose(found.joint_position.values[0], [x, 0.0, z - 100.0], atol=1e-6)


@pytest.mark.parametrize("name", ["cwc_clump_still", "cwc_clump_countercurrent", "lazy_wave_current"])
@pytest.mark.parametrize(("elements", "allowed", "bed"), [(48, 5e-4, {}), (96, 5e-5, {"stiffness": 1e7})])
def test_line_of_segments_partly_on_the_bed(name, elements, allowed, bed):
    """Clump and buoyant segment, with and without current: on the default bed, and on one about as hard as theirs."""
    found = solve_static(chain(name, elements, seabed=bed))
    values = CASES[name]["values"]
    assert float(found.tension_top) == pytest.approx(values["T_top"], rel=allowed)
    assert float(np.linalg.norm(found.anchor_force)) == pytest.approx(values["T_anchor"], rel=allowed)
    depth = CASES[name]["input"]["depth"]
    for place, joint in zip(found.joint_position.values, values["joints"], strict=True):
        np.testing.assert_allclose(place, np.array(joint["position"]) - [0.0, 0.0, depth], atol=1e-3 * depth)


@pytest.mark.parametrize("offset", [(5.0, 0.0), (0.0, 5.0)])
def test_three_lines_on_the_bed(offset):
    """What they pull a point with that is moved aside, to 1e-3 with the default bed."""
    case = CASES["three_lines_fixed_point"]
    given = case["input"]
    cables = [
        {
            "name": name,
            "from": [520.0 * math.cos(angle), 520.0 * math.sin(angle), -100.0],
            "to": [*offset, 0.0],
            "length": float(given["L"]),
            "elements": [[300.0, 30], [260.0, 130]],
        }
        | line(given["w"], given["EA"])
        for name, angle in (("a", 0.0), ("b", 2 * math.pi / 3), ("c", 4 * math.pi / 3))
    ]
    found = solve_static({"sea": {"depth": 100.0}, "seabed": {}, "cable": cables})
    wanted = next(o for o in case["values"]["offsets"] if tuple(map(float, o["offset"])) == offset)
    np.testing.assert_allclose(found.tension_top, wanted["line_tensions"], rtol=1e-3)
    size = np.linalg.norm(wanted["restoring_force"])
    np.testing.assert_allclose(-found.end_tension.sum("cable"), wanted["restoring_force"], atol=2e-3 * size)
    assert found.length_on_bed.values.min() > 300.0


@pytest.mark.parametrize(("name", "count"), [("three-legs", 3), ("two-buoys", 5)])
def test_lines_of_a_shipped_scene_are_catenaries(name, count):
    """In still water, between the places of their ends; what pulls the ends is the closed form's, to 1e-3."""
    finer = {f"cable.{cable.name}.elements": 60 for cable in load_scene(name).cables}
    scene = load_scene(name, current=None, waves=None, **finer)
    found = solve_static(scene)
    assert found.sizes["cable"] == count
    for k, piece in enumerate(scene.network.pieces):
        c, nodes = piece.section, found.cable_position.values[found.cable_of_node.values == k]
        shape = between(nodes[0], nodes[-1], c.length, weight_per_length(scene, c), c.axial_stiffness)
        size = shape.tension(np.array([c.length]))[0]
        np.testing.assert_allclose(found.end_tension[k], shape.force(np.array([c.length]))[0], atol=1e-3 * size)
        np.testing.assert_allclose(found.anchor_force[k], -shape.force(np.array([0.0]))[0], atol=1e-3 * size)
        assert size > 100.0


def test_lazy_wave_is_that_of_the_references():
    """The shipped scene is the case that the others are checked against, to 2e-3 of its top tension at P1-P0."""
    found, values = solve_static("lazy-wave"), CASES["lazy_wave_current"]["values"]
    assert float(found.tension_top) == pytest.approx(values["T_top"], rel=2e-3)
    assert float(found.length_on_bed) == pytest.approx(values["length_on_bed"], rel=1e-2)
