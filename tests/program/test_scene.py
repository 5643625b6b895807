"""Admissible scenes, and the code compiled for them.

Source: a list of valid and invalid input; coefficients counted in the compiled forms.
"""

import copy
import math

import numpy as np
import pytest
import ufl
from alone import simulate, solve_static
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError
from dolfbuoy.meshes import cable_nodes, write_line
from dolfbuoy.model.attachment import Attachment
from dolfbuoy.model.buoy import Buoy
from dolfbuoy.model.feasible import check_feasible
from dolfbuoy.model.lines import Lines
from dolfbuoy.model.problem import Problem
from dolfbuoy.scene import build_scene, merged, varied
from dolfbuoy.solver.unknowns import Part

BASE = {
    "sea": {"depth": 20.0},
    "cable": {"length": 22.0, "line_density": 27.6, "diameter": 0.08, "axial_stiffness": 2.3e8},
    "buoy": {"hull": [[0, 2.4], [1.2, 2.4]], "mass": 400.0, "center_of_mass": 0.5},
    "waves": {"amplitude": 1.0, "period": 5.0},
    "time": {"end": 1.0, "step": 0.1},
}
HELD = {"kind": "fixed", "position": [3.0, 0.0, -0.5]}


def changed(changes):
    """BASE with values under dotted keys replaced, or removed by None."""
    return merged(BASE, **changes)


def refusal(scene):
    with pytest.raises(InputError) as caught:
        check_feasible(load_scene(scene))
    return str(caught.value)


def test_base_is_accepted():
    check_feasible(load_scene(BASE))
    assert load_scene(load_scene(BASE).to_dict()) == load_scene(BASE)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        # unknown keys: the key and the keys that exist
        ({"cable.lenght": 3.0}, ["cable.lenght", "length", "line_density"]),
        ({"tittle": "x"}, ["tittle", "title"]),
        ({"buoy.hul": []}, ["buoy.hul", "hull"]),
        ({"solver.tolerance": 1.0}, ["solver.tolerance", "step_tolerance"]),
        ({"buoy.point_masses": [{"mass": 3.0, "height": 1.0, "name": "top"}]}, ["buoy.point_masses", "name", "height"]),
        # wrong types
        ({"cable.length": "long"}, ["cable.length", "'long'", "number"]),
        ({"cable.length": True}, ["cable.length", "True", "number"]),
        ({"cable.elements": 2.5}, ["cable.elements", "2.5", "integer"]),
        ({"cable.anchor": [0.0, 0.0]}, ["cable.anchor", "[0.0, 0.0]", "3"]),
        ({"cable": 3}, ["cable", "3", "section"]),
        ({"buoy.hull": [[0, 2.4], [1.2]]}, ["buoy.hull", "[1.2]", "2"]),
        ({"buoy.inertia": "big"}, ["buoy.inertia", "'big'", "list"]),
        ({"gravity": None, "title": 5}, ["title", "5", "string"]),
        # out of range
        ({"cable.length": -1.0}, ["cable.length", "-1.0", "greater than 0"]),
        ({"cable.elements": 0}, ["cable.elements", "0", "greater than 0"]),
        ({"sea.density": -4.0}, ["sea.density", "-4.0", "greater than 0"]),
        ({"time.step": 0.0}, ["time.step", "0.0", "greater than 0"]),
        ({"gravity": -1.0}, ["gravity", "-1.0", "greater than or equal to 0"]),
        ({"cable.normal_drag": -0.1}, ["cable.normal_drag", "-0.1", "greater than or equal to 0"]),
        (
            {"buoy.point_masses": [{"mass": -3.0, "height": 1.0}]},
            ["buoy.point_masses", "mass", "-3.0", "greater than 0"],
        ),
        ({"buoy.hull": [[0, -1.0], [1, 2.0]]}, ["buoy", "hull", "-1.0", "negative"]),
        ({"buoy.inertia": [1.0]}, ["buoy", "inertia", "[1.0]", "[Ixx, Iyy, Izz]"]),
        ({"cable.elements": [[10.0, 5], [11.0, 5]]}, ["cable", "elements", "21.0", "22.0"]),
        # not a number, not finite
        ({"cable.length": math.nan}, ["cable.length", "nan", "finite"]),
        ({"cable.length": math.inf}, ["cable.length", "inf", "finite"]),
        ({"cable.axial_stiffness": math.nan}, ["cable.axial_stiffness", "nan", "greater than 0"]),
        ({"buoy.mass": math.nan}, ["buoy.mass", "nan", "finite"]),
        ({"buoy.hull": [[0, math.nan], [1, 2.0]]}, ["buoy.hull", "nan", "finite"]),
        # not one of
        ({"time.scheme": "rk4"}, ["time.scheme", "'rk4'", "backward-euler"]),
        ({"cable.strain": "mean"}, ["cable.strain", "'mean'", "element-average"]),
        ({"current": {"speed": 1.0, "profile": "linear"}}, ["current.profile", "'linear'", "uniform", "power"]),
        # together
        (
            {"cable.position_degree": 2, "cable.tension_degree": 2},
            ["tension_degree = 2", "position_degree = 2", "lower"],
        ),
        ({"waves.height": 2.0}, ["waves", "amplitude", "height"]),
        ({"waves.amplitude": None}, ["waves", "amplitude", "height"]),
        ({"buoy.mass": None}, ["buoy.mass"]),
        ({"current": {"direction_deg": 3.0}}, ["current", "speed"]),
        ({"cable.diameter": None}, ["cable.diameter", "sea"]),
        ({"buoy": None, "cable.top": {"kind": "fixed"}}, ["cable.top", "'fixed'", "position"]),
        # a section that needs another
        ({"sea": None}, ["[waves]", "[sea]"]),
        ({"sea": None, "waves": None, "current": {"speed": 1.0}}, ["[current]", "[sea]"]),
        (
            {"buoy": None, "cable.top": HELD, "wind": {"speed_10m": 3.0, "area": 1.0, "height": 1.0}},
            ["[wind]", "[buoy]"],
        ),
        ({"buoy": None, "cable.top": HELD, "external_force": {"force": [1.0, 0, 0]}}, ["[external_force]", "[buoy]"]),
        ({"buoy": None}, ["cable.top: must be given", "[buoy]"]),
        ({"cable.top": HELD}, ["cable.top.kind", "[buoy]"]),
        ({"buoy": None, "cable": None}, ["cable: must be given", "buoy"]),
        # impossible physics
        ({"buoy.mass": 9000.0}, ["sinks", "buoy.mass", "9471.4", "5564.39"]),
        ({"buoy.added_mass": -2.0}, ["buoy.added_mass", "-2.0", "not positive"]),
        ({"cable.added_mass": -9.0}, ["cable.added_mass", "-9.0", "not positive"]),
        (
            {"buoy": None, "cable.top": HELD, "cable.axial_stiffness": math.inf, "cable.length": 19.0},
            ["cable.length", "19.0", "too short", "19.7"],
        ),
    ],
    ids=lambda value: ",".join(f"{k}={v}" for k, v in value.items()) if isinstance(value, dict) else "",
)
def test_bad_scene_is_refused_in_one_sentence(changes, named):
    message = refusal(changed(changes))
    for part in named:
        assert part in message, message
    assert "\n" not in message
    assert message.endswith(".")
    assert not message.endswith("..")
    assert "instance of" not in message  # no Python in a message to a user


@pytest.mark.parametrize("suffix", ["vtu", "vtk", "xdmf"])
def test_elements_from_a_mesh_file(tmp_path, suffix):
    """They are those of the file, also in what the scene is saved as."""
    path, nodes = tmp_path / f"cable.{suffix}", np.array([0.0, 1.0, 3.0, 10.5, 22.0])
    write_line(path, np.column_stack([nodes, 0 * nodes, 0 * nodes]))
    cable = load_scene(changed({"cable.elements": str(path)})).network.pieces[0].section
    np.testing.assert_allclose(cable_nodes(cable.length, cable.elements), nodes, rtol=1e-12)
    assert str(path) not in str(cable)


def test_bad_mesh_files_are_refused_in_one_sentence(tmp_path):
    elsewhere, points = tmp_path / "elsewhere.vtu", np.zeros((3, 3))
    points[:, 0] = [1.0, 2.0, 23.0]
    write_line(elsewhere, points)
    (tmp_path / "broken.vtu").write_text("no mesh")
    for name, words in {"none.vtu": "not found", "broken.vtu": "cannot read", "elsewhere.vtu": "not at 0"}.items():
        message = refusal(changed({"cable.elements": str(tmp_path / name)}))
        assert message.startswith("cable.elements = "), message
        assert words in message, message
        assert "\n" not in message


def test_missing_file():
    message = refusal("no/such/scene.toml")
    assert "no/such/scene.toml" in message
    assert "short" in message  # a shipped one
    assert "\n" not in message


@pytest.mark.parametrize("content", [b"[sea]\ndepth = = 3\n", b"\xff\xfe\x00", b"[sea\n"])
def test_file_that_is_not_toml(tmp_path, content):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    message = refusal(path)
    assert "bad.toml" in message
    assert "TOML" in message
    assert "\n" not in message


def test_file_and_overrides(tmp_path):
    path = tmp_path / "scene.toml"
    load_scene(BASE).save(path)
    scene = load_scene(path, cable__length=21.5, time={"end": 7.0})
    assert (scene.network.pieces[0].section.length, scene.time.end, scene.time.step) == (21.5, 7.0, 0.1)
    message = refusal_of_override(path, cable__length="x")
    assert "cable.length = 'x'" in message


def test_merged_changes_a_copy():
    base = {"time": {"end": 1.0, "step": 0.1}, "cable": {"top": {"kind": "free"}}}
    changes = {"time": {"end": 7.0, "step": None}, "cable.top.force": [1.0, 0.0, 0.0], "waves__ramp": 2.0}
    found = merged(base, **changes)
    assert found["time"] == {"end": 7.0}
    assert found["cable"] == {"top": {"kind": "free", "force": [1.0, 0.0, 0.0]}}
    assert found["waves"] == {"ramp": 2.0}
    found["cable"]["top"]["kind"] = found["cable"]["top"]["force"][0] = None
    assert merged(base) == base == {"time": {"end": 1.0, "step": 0.1}, "cable": {"top": {"kind": "free"}}}
    assert changes["cable.top.force"] == [1.0, 0.0, 0.0]
    assert merged(base, cable=None) == {"time": base["time"]}
    with pytest.raises(InputError, match=r"^time\.end = 1\.0: is not a section with a key first\.$"):
        merged(base, time__end__first=3)


def refusal_of_override(path, **overrides):
    with pytest.raises(InputError) as caught:
        load_scene(path, **overrides)
    return str(caught.value)


def test_inextensible_cable_exactly_as_long_as_its_chord_is_refused_by_statics():
    top = {"kind": "fixed", "position": [0.0, 12.0, -4.0]}  # 20 m from the anchor
    scene = changed({"buoy": None, "cable.top": top, "cable.axial_stiffness": math.inf, "cable.length": 20.0})
    with pytest.raises(InputError, match=r"cable\.length = 20\.0.*taut"):
        solve_static(scene)


# -- absent effects are absent -----------------------------------------------------------------------------------------

TAUT = {
    "sea": {"depth": 20.0},
    "cable": {"length": 19.0, "line_density": 5.5, "diameter": 0.05, "axial_stiffness": 2e4, "elements": 4}
    | {"normal_drag": 0.8, "tangential_drag": 0.1, "added_mass": 0.9},
    "buoy": {"hull": [[0, 1.6], [1.1, 1.6]], "mass": 500.0, "center_of_mass": 0.4, "normal_drag": 0.7}
    | {"added_mass": 0.6, "axial_drag": 1.1, "axial_added_mass": 0.5},
    "initial": {"buoy_velocity": [0.4, -0.3, 0.2]},
    "time": {"end": 0.3, "step": 0.1},
    "solver": {"hull_cells": 8, "step_tolerance": 1e-11},
}
NOTHING = {
    "waves": {"amplitude": 0.0, "period": 4.0, "direction_deg": 30.0},
    "current": {"speed": 0.0, "direction_deg": 70.0},
    "wind": {"speed_10m": 0.0, "direction_deg": 20.0, "area": 1.3, "height": 1.6},
    "external_force": {"force": [0.0, 0.0, 0.0], "height": 1.2},
}


def residuals(scene, dynamic):
    """Signatures of the UFL residuals and their number of constants; nothing is compiled."""
    scene = load_scene(scene)
    lines, buoy = Lines(MPI.COMM_SELF, scene, dynamic), Buoy(scene, "buoy", dynamic)
    attachment = Attachment(lines, 0, 1, 0, buoy, buoy.offset)
    attachment.number(0)
    buoy.part = Part("buoy", buoy.state, 6)
    test = ufl.TestFunction(lines.space)
    forms = [lines.residual(test) + attachment.end_force(ufl.split(test)[0])]
    forms += [form for _, form in buoy.residuals([attachment])]
    return [form.signature() for form in forms], [len(form.constants()) for form in forms]


def size(scene, dynamic):
    """Number of unknowns and of compiled forms."""
    problem = Problem(load_scene(scene), dynamic)
    result = problem.system.unknowns, len(problem.system.residuals) + len(problem.system.jacobians)
    problem.destroy()
    return result


@pytest.mark.parametrize(
    ("section", "changes"),  # the residuals of cable, buoy and rigid link that know of the section
    [
        ("waves", [True, True, False]),
        ("current", [True, True, False]),
        ("wind", [False, True, False]),
        ("external_force", [False, True, False]),
    ],
)
@pytest.mark.parametrize("dynamic", [False, True])
def test_section_adds_terms_to_the_forms(section, changes, dynamic):
    """Even at zero strength a section is in the form; without it nothing of it is, constants included."""
    without, constants = residuals(TAUT, dynamic)
    with_it, more = residuals(TAUT | {section: NOTHING[section]}, dynamic)
    if section == "waves" and not dynamic:
        changes = [False] * 3  # statics knows no waves
    assert [a != b for a, b in zip(without, with_it, strict=True)] == changes
    assert [a < b for a, b in zip(constants, more, strict=True)] == changes


@pytest.mark.parametrize(
    ("section", "key", "which"),
    [
        ("cable", "normal_drag", 0),
        ("cable", "tangential_drag", 0),
        ("cable", "added_mass", 0),
        ("cable", "tangential_added_mass", 0),
        ("buoy", "normal_drag", 1),
        ("buoy", "added_mass", 1),
        ("buoy", "axial_drag", 1),
        ("buoy", "axial_added_mass", 1),
        ("buoy", "rotational_damping", 1),
    ],
)
def test_coefficient_that_is_zero_leaves_the_form(section, key, which):
    given, zero, absent = (copy.deepcopy(TAUT) for _ in range(3))
    given[section][key], zero[section][key] = 0.37, 0.0
    absent[section].pop(key, None)
    assert residuals(absent, True) == residuals(zero, True)
    assert residuals(absent, True)[1][which] == residuals(given, True)[1][which] - 1


def test_inextensible_cable_has_no_stiffness_in_its_form():
    inextensible = copy.deepcopy(TAUT)
    del inextensible["cable"]["axial_stiffness"]
    assert residuals(inextensible, True)[1][0] == residuals(TAUT, True)[1][0] - 1


def test_buoy_and_cable_add_their_unknowns():
    """Cable: 3 (4 + 1) - 3 positions and 4 tensions; mooring: 6; buoy: 13, at rest 7."""
    no_buoy, no_cable = copy.deepcopy(TAUT), copy.deepcopy(TAUT)
    del no_buoy["buoy"], no_buoy["initial"], no_cable["cable"]
    no_buoy["cable"]["top"] = {"kind": "fixed", "position": [1.0, 0.5, -0.4]}
    for dynamic, pose in ((False, 7), (True, 13)):
        (both, forms), (cable, forms_of_cable), (buoy, forms_of_buoy) = (
            size(scene, dynamic) for scene in (TAUT, no_buoy, no_cable)
        )
        assert both == 12 + 4 + 6 + pose
        assert cable == 9 + 4  # both ends held
        assert buoy == pose
        assert (forms_of_cable, forms_of_buoy) == (2, 2)  # a residual and its derivative
        assert forms > 4


def test_effects_of_zero_strength_change_nothing_at_rest():
    plain_result = solve_static(TAUT)
    for section, values in NOTHING.items():
        result = solve_static(TAUT | {section: values})
        for name in ("cable_position", "buoy_position", "mooring_force"):
            difference = np.abs(result[name] - plain_result[name]).max()
            assert difference < 1e-9 * np.abs(plain_result[name]).max(), f"{section} {name}"


@pytest.mark.slow
def test_effects_of_zero_strength_change_nothing_in_motion():
    plain_result = simulate(TAUT)
    assert np.abs(plain_result.buoy_position[-1] - plain_result.buoy_position[0]).max() > 0.05
    for section, values in NOTHING.items():
        result = simulate(TAUT | {section: values})
        for name in ("cable_position", "buoy_position", "angular_momentum", "mooring_force"):
            difference = np.abs(result[name] - plain_result[name]).max()
            assert difference < 1e-9 * np.abs(plain_result[name]).max(), f"{section} {name}"


@pytest.mark.parametrize("name", ["short", "storm", "three-legs", "chain-on-bed"])
def test_variants_are_what_reading_all_of_the_scene_gives(name):
    """Sections that do not change are not read again: the same scene, or the same sentence."""
    base, changes = load_scene(name), [{"gravity": 9.0}, {"waves": None}, {"waves.ramp": 3.0, "time": {"end": 5.0}}]
    changes += [{"time__end": 3.0}, {"cable.length": -3}, {"cable.0.length": 5.0}, {"wavs.x": 1}, {"gravity.x": 1}]
    for change in changes:
        found = []
        for make in (lambda: varied(base, change), lambda: build_scene(base.to_dict(), change)):  # noqa: B023
            try:
                found.append(make())
            except InputError as error:
                found.append(str(error))
        assert found[0] == found[1]
