"""The table of the scene language agrees with the models.

Source: the declared sections of scenes.
"""

import re
import tomllib

import pytest

from dolfbuoy.errors import InputError
from dolfbuoy.scene import Scene, build_scene, list_keys, load_scene, shipped_scenes
from dolfbuoy.scene.keys import is_key

KEYS = list_keys()
UNITS = {
    "Pa",
    "1",
    "N",
    "N m s",
    "N s",
    "N s/m",
    "N s^2/m^2",
    "N m^2",
    "N m/rad",
    "deg",
    "kg",
    "N/m",
    "kg m",
    "kg m^2",
    "kg/m",
    "kg/m^3",
    "Pa/m",
    "m",
    "m/s",
    "m/s^2",
    "Hz",
    "m^2/Hz",
    "m^2/Hz/deg",
    "m^2",
    "m^3",
    "rad/s",
    "s",
}


@pytest.mark.parametrize("key", KEYS, ids=lambda key: key.name)
def test_every_key_is_described(key):
    assert 3 < len(key.description) < 100
    assert "\n" not in key.description
    assert bool(key.unit) == ("number" in key.range)
    assert set(key.unit.split(", ")) - {""} <= UNITS
    assert (key.unit == "deg") == key.name.endswith("_deg")


#: Tables whose keys are names that the scene gives: as one value, and of sections.
BY_NAME = ("solver.petsc", "buoy.fairleads", "vessel.fairleads", "initial.points", "uncertain", "design.vary")
NAMED = "material"
#: Sections that may be a list of tables.
SECTIONS = ("cable", "buoy", "joint", "vessel", "anchor", "take_off")


def leaves(tree, prefix=""):
    """Dotted names and values of a scene's dict; tables in a list are those of the key."""
    for name, value in tree.items():
        if prefix + name == NAMED:
            value = {"NAME": next(iter(value.values()))}
        if isinstance(value, list) and value and isinstance(value[0], dict):
            for table in value:
                yield from leaves(table, f"{prefix}{name}.")
            if prefix + name in SECTIONS:
                continue
        if isinstance(value, dict) and prefix + name not in BY_NAME:
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def test_no_key_of_the_shipped_scenes_is_left_out():
    used = {name for path in shipped_scenes().values() for name, _ in leaves(load_scene(path).to_dict())}
    assert len(used) > 50
    assert used <= {key.name for key in KEYS}


def test_every_section_is_described():
    sections = {key.name.split(".")[0] for key in KEYS if "." in key.name}
    definitions = Scene.model_json_schema()["$defs"]
    more = ("Top", "FailsAt", "PointMass", "Spectrum", "Segment", "Body", "BuoyStart", "EndDirection")
    more += ("PotentialFlow", "Depths", "WindOnVessel")  # in others
    assert len(definitions) == len(sections) + len(more)
    assert set(more) - {"Spectrum"} <= set(definitions)
    assert all(10 < len(section["description"]) < 130 for section in definitions.values())


#: Scenes that between them have every section and no key that may be left out.
HELD = {
    "sea": {"depth": 20.0},
    "cable": {"length": 22.0, "line_density": 27.6, "diameter": 0.08, "top": {"kind": "free"}},
    "waves": {"amplitude": 1.0, "period": 5.0},
    "current": {"speed": 1.0},
    "seabed": {},
    "time": {"end": 1.0, "step": 0.1},
    "accuracy": {},
    "design": {},
    "criteria": {"largest_anchor_force": 1e4},
    "anchor": {"holding_capacity": 1e4},
    "fatigue": {"curve": "1e15 N^3"},
}
FLOATING = {
    "buoy": {"mass": 400.0, "inertia": [100.0, 120.0], "center_of_mass": 0.5},
    "wind": {"speed_10m": 3.0, "area": 1.0, "height": 1.0},
    "external_force": {"force": [1.0, 0.0, 0.0]},
}


UP = {"direction": [0.0, 0.0, 1.0]}
WIND = {"wind": FLOATING["wind"]}
NETWORK = {
    "material": {"rope": {"line_density": 2.0, "bending_stiffness": 1.0}},
    "joint": [{"name": "Y"}],
    "vessel": [{"name": "ship", "position": [9.0, 0.0, 0.0], "fairleads": {"bow": [1.0, 0.0, 0.0]}, **WIND}],
    "cable": [
        {"name": "d", "material": "rope", "from": "Y", "to": "ship.bow", "length": 1.0},
        {
            "name": "a",
            "material": "rope",
            "to": "Y",
            "from_end": UP,
            "segments": [{"length": 1.0, "body": {}}, {"length": 1.0}],
        },
        {"name": "b", "material": "rope", "from": "Y", "to": "left", "length": 1.0, "to_end": UP},
        {"name": "c", "material": "rope", "from": "Y", "to": "right", "length": 1.0},
    ],
    "buoy": [
        {**FLOATING["buoy"], **{k: v for k, v in FLOATING.items() if k != "buoy"}, "name": name, "initial": {}}
        for name in ("left", "right")
    ],
    "take_off": {"from": "left", "to": "right"},
}


def test_defaults_are_those_of_scenes_that_leave_keys_out():
    found = {name: value for scene in (HELD, FLOATING, NETWORK) for name, value in leaves(load_scene(scene).to_dict())}
    stated = {key.name: tomllib.loads(f"v = {key.default}")["v"] for key in KEYS if key.default not in ("", "required")}
    assert len(stated) > 40
    for name, value in stated.items():
        assert found[name] == (pytest.approx(value, rel=1e-5) if isinstance(value, float) else value), name


#: Of tables in lists or by name, whose messages have a number or a name more; of ends and coefficients, which need
#: a direction, or the rest of their table, too.
LISTED = (
    "buoy.point_masses.",
    "buoy.potential_flow.",
    "cable.segments.",
    "cable.from_end.",
    "cable.to_end.",
    "joint.",
    "vessel.",
    "take_off.",
    "material.",
    "buoy.wind.",
    "buoy.external_force.",
)
BOUNDED = [
    key for key in KEYS if re.fullmatch(r"(whole )?number [<>].*", key.range) and not key.name.startswith(LISTED)
]


@pytest.mark.parametrize("key", BOUNDED, ids=lambda key: key.name)
def test_ranges_end_where_the_models_refuse(key):
    scene = load_scene("driven" if key.name.startswith("cable.top") else "short").to_dict()
    for sign, bound in re.findall(r"([<>]=?) ([\d.e+-]+)", key.range.partition(" or ")[0]):
        beyond = {">": 0.0, "<": 0.0, ">=": -1e-9, "<=": 1e-9}[sign]
        outside = float(bound) + beyond * max(1.0, abs(float(bound)))
        if key.range.startswith("whole"):
            outside = int(float(bound)) + round(1e9 * beyond)
        with pytest.raises(InputError) as caught:
            build_scene(scene, {key.name: outside})
        assert str(caught.value).startswith(f"{key.name} = {outside}"), caught.value


def test_what_is_a_key():
    """Names of materials, fairleads and cables are the user's; what lists hold is known by its number."""
    good = "cable.length", "material.mine.diameter", "cable.segments.3.elements", "vessel.0.fairleads.bow", "waves"
    bad = "cable.lenght", "cable.segments.3.elemnts", "cable.7", "fairleads.bow", "buoy.point_masses.5.masses"
    assert all(is_key(name.split(".")) for name in good)
    assert not any(is_key(name.split(".")) for name in bad)
