"""A scene in words: differences from its defaults.

Source: the values of the scene, by hand.
"""

from dolfbuoy import load_scene
from dolfbuoy.page.run_page import inputs
from dolfbuoy.scene.inputs import inputs_of

SCENE = {
    "title": "two",
    "sea": {"depth": 20.0, "density": 1025.0},
    "material": {"rope": {"line_density": 5.0, "axial_stiffness": 123456.0, "diameter": 0.05}},
    "cable": [
        {"name": "a", "from": [0.0, 0.0, -20.0], "to": "clump", "length": 12.0, "elements": 4, "material": "rope"},
        {"name": "b", "from": "clump", "to": [9.0, 0.0, -2.0], "length": 14.0, "elements": 4, "material": "rope"},
    ],
    "joint": [{"name": "clump", "mass": 70.0}],
    "seabed": {"start": "pulled", "friction": 0.7},
    "time": {"end": 1.0, "step": 0.1},
}


def test_values_stand_with_their_section_meaning_and_unit():
    found = {(row.section, row.meaning): (row.value, row.unit) for row in inputs_of(load_scene(SCENE))}
    assert found["sea", "water depth"] == ("20", "m")
    assert ("sea", "water density") not in found  # the default
    assert found["cable.a", "unstretched length"] == ("12", "m")
    assert found["cable.b", "unstretched length"] == ("14", "m")
    assert found["material.rope", "axial stiffness EA"] == ("123,456", "N")
    assert found["joint", "mass"] == ("70", "kg")
    assert ("7", "kg") not in found.values()
    assert {value for (section, _), (value, unit) in found.items() if section == "seabed"} == {"0.7", "pulled"}


def test_long_lists_are_counted():
    rows = [[0.1 * k, 0.0, 0.0, 0.01 * k] for k in range(20)]
    top = {"kind": "prescribed", "position": [1.0, 0.0, 9.0], "motion": rows}
    cable = {"length": 10.0, "line_density": 2.0, "axial_stiffness": 1e4, "elements": 4, "top": top}
    found = [row for row in inputs_of(load_scene({"cable": cable})) if row.section == "cable.top"]
    assert "20 rows" in [row.value for row in found]
    assert "[1, 0, 9]" in [row.value for row in found]


def test_the_page_escapes_them():
    text = inputs(load_scene(SCENE), "<b>waves</b>")
    assert "&lt;b&gt;waves" in text
    assert '<th scope="row">cable.a</th><td>unstretched length</td><td>12</td><td>m</td>' in text
