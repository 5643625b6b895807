"""Other programs' files with absent keys, limiting values or variant spellings, each part alone.

Source: MoorDyn's manual, "Input Files", the ontology of FAModel and WISDEM's manual for the meaning of files;
rotations, spectra and frames by hand.
"""

import math
import re
import sys
from types import SimpleNamespace as Fake

import pytest
from test_formats_numbers import LINES, MOORING
from test_formats_others import FAMODEL, MAP, WISDEM

from dolfbuoy.errors import InputError
from dolfbuoy.formats import (
    from_famodel,
    from_map,
    from_moordyn,
    from_wisdem,
    from_yaml,
    moordyn_text,
)
from dolfbuoy.formats.moordyn_text import Tables


def said_of(reader, text, **how):
    """The scene, and the sentences."""
    scene, notes = reader.scene_of(text, **how)
    return scene, [str(note) for note in notes]


# -- FAModel -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("which", "found"),
    [
        ({"platformID": 1}, (41.0, -16.0)),
        ({"platformID": 2}, (43.5, -17.0)),
        ({"platformID": 3}, (41.0, -16.0)),
        ({"platformID": 0}, (41.0, -16.0)),
        ({"platformID": -1}, (41.0, -16.0)),
        ({"platformID": "2"}, (41.0, -16.0)),
        ({}, (41.0, -16.0)),
    ],
)
def test_fairleads_of_platforms(which, found):
    """Counted from 1 on, the first one's of any other number; heights are below the water with either sign."""
    platforms = [{"rFair": 41, "zFair": -16}, {"rFair": 43.5, "zFair": 17}]
    for data in ({"platforms": platforms}, {"platforms": platforms, "platform": {"rFair": 1, "zFair": 1}}):
        assert from_famodel._Reader._fairlead(Fake(data=data), which, {}) == found
    only = Fake(data={"platform": platforms[1]})
    assert from_famodel._Reader._fairlead(only, which, {}) == (43.5, -17.0)
    assert from_famodel._Reader._fairlead(only, which, {"fairlead_radius": 9}) == (9.0, -17.0)
    assert from_famodel._Reader._fairlead(only, which, {"fairlead_depth": 8}) == (43.5, -8.0)
    with pytest.raises(InputError, match=r"fairlead_radius \(or rFair\) is None"):
        from_famodel._Reader._fairlead(Fake(data={}), which, {})


def test_names_of_platforms():
    names = ("f2", "2", "a b", "-x", "a-b_c", "")
    words = ["f2", "platform2", "a_b", "platform-x", "a-b_c", "platform"]
    assert [from_famodel._word(name) for name in names] == words


def test_the_middle_of_a_symmetric_line():
    """A section that ends the half is doubled, a connector stands there once."""
    a, b, c = {"type": "a", "length": 3.0}, {"connectorType": "b"}, {"type": "c", "length": 5}
    assert from_famodel._mirrored([a, b, c]) == [a, b, {"type": "c", "length": 10.0}, b, a]
    assert from_famodel._mirrored([a, c, b]) == [a, c, b, c, a]
    assert from_famodel._mirrored([a]) == [{"type": "a", "length": 6.0}]


def test_connectors_between_sections_are_one_joint():
    notes, connectors = [], {"x": {"m": 3.0, "v": 0.5}, "y": {"m": 4.0, "CdA": 2.0, "v": 0}}
    reader = Fake(connectors=connectors, notes=notes)
    found = from_famodel._Reader._body(reader, [{"connectorType": kind} for kind in ("x", "y", "x", "z")])
    assert found == {"mass": 10.0, "volume": 1.0, "CdA": 2.0}
    assert [str(note) for note in notes] == ["the connector z is none of mooring_connector_types, and weighs nothing"]


@pytest.mark.parametrize(
    "changes",
    [
        [("end A, end B", "endA, endB")],
        [("ms1, 10.0, 20.0, 90]", "ms1, 10.0, 20.0, 90.0]"), ("1, 0, 1610.0", "1, '0', 1610.0")],
        [("1, 0, 1610.0", "1, null, 1610.0")],
        [("1610.0, 25.0, 0]", "1610.0, 25.0]")],
        [("mooring_connector_types", "anchor_types: {}\nmooring_connector_types")],
        [("platform: {rFair: 41.0, zFair: -16.0}", "platforms: [{rFair: 41.0, zFair: 16.0}]")],
        [("d_nom: 0.26, ", "d_nom: 0.26, cost: 7, material: rope, notes: none, name: p, type: q, ")],
    ],
)
def test_the_same_array_in_other_words(changes):
    """Ends by both of their names; no mooring is 0, "0" or nothing; a heading that is not given is 0."""
    pytest.importorskip("yaml")
    text = FAMODEL
    for change in changes:
        assert change[0] in text
        text = text.replace(*change)
    assert said_of(from_famodel, text) == said_of(from_famodel, FAMODEL)


def test_a_line_of_an_array_without_a_heading_goes_along_x():
    pytest.importorskip("yaml")
    text = FAMODEL.replace("keys: [MooringConfigID, heading,", "keys: [MooringConfigID, other,")
    scene, _ = said_of(from_famodel, text.replace(", heading_adjust]", ", other]"))
    assert scene["cable"][0]["from"] == [811.0, 20.0, -210.0]
    first, second = scene["vessel"]
    assert (first["heading_deg"], second["heading_deg"], first["position"]) == (0.0, 0.0, [10.0, 20.0, 0.0])
    assert first["fairleads"]["fowt1_1_fair"] == [40.0, 0.0, -14.0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("type: array of two", "turbine: {}\nseabed: {}"),
            "of this array only moorings are carried over, and not turbine, seabed",
        ),
        (("d_nom: 0.26, ", "w: 3, "), "line_types, poly: w = 3 is not carried over"),
        (("EAd: 3e8", "EAd_Lm: 7"), "mooring_line_types, poly: EAd_Lm = 7, the dynamic stiffness, is left out"),
    ],
)
def test_what_is_left_out_of_an_array(change, said):
    pytest.importorskip("yaml")
    before, after = (said_of(from_famodel, text)[1] for text in (FAMODEL, FAMODEL.replace(*change)))
    assert [note for note in after if note not in before] == [said]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            [("[shared, fowt1, f2, 0], [taut, anch1, f2, 0]", ""), (", ms1, ", ", 0, ")],
            "no mooring of the array has a line.",
        ),
        (
            [("    sections:\n      - {conn", "    parts:\n      - {conn")],
            "mooring_line_configs: fowt1_1 has no sections.",
        ),
        (
            [("{type: chain, length: 301.0}", "{type: chain}")],
            "mooring_line_configs: length of a section of fowt1_1 is None",
        ),
        ([("0, 1610.0, 25.0, 0]", "0, 1610.0, 25.0, 0, 7]")], "array: must have keys, and data with a value for each."),
        ([("array:\n", "arrays:\n")], "there is no array with mooring_line_configs: this is no file of FAModel."),
        ([("mooring_line_configs:\n", "configs:\n")], "there is no array with mooring_line_configs"),
    ],
)
def test_what_is_refused_of_an_array(changes, words):
    pytest.importorskip("yaml")
    text = FAMODEL
    for change in changes:
        assert change[0] in text
        text = text.replace(*change)
    with pytest.raises(InputError, match=re.escape(words)):
        from_famodel.scene_of(text)


# -- WISDEM ------------------------------------------------------------------------------------------------------------


def test_places_of_wisdem():
    """A coordinate that is not given is 0; a member with an end that is unknown has no joints along it."""
    assert from_wisdem._place({"location": {"y": 2}}, "here") == [0.0, 2.0, 0.0]
    for place in (None, [1.0, 2.0], "x", [1.0, 2.0, 3.0, 4.0]):
        with pytest.raises(InputError, match=r"^here: location must be \[x, y, z\]\.$"):
            from_wisdem._place({"location": place}, "here")
    joints = [{"name": 1, "location": [0, 0, 0]}, {"name": "b", "location": [4.0, 8.0, -2.0], "cylindrical": False}]
    members = [
        {"joint1": 1, "joint2": "none", "axial_joints": [{"name": "x", "grid": 0.5}]},
        {"joint1": "none", "joint2": 1, "axial_joints": [{"name": "y", "grid": 0.5}]},
        {"joint1": 1, "joint2": "b"},
        {"joint1": "b", "joint2": 1, "axial_joints": [{"name": 7, "grid": 0.25}, {"name": 8, "grid": 1.0}]},
    ]
    found = from_wisdem._joints({"joints": joints, "members": members})
    assert found == {"1": [0, 0, 0], "b": [4.0, 8.0, -2.0], "7": [3.0, 6.0, -1.5], "8": [0.0, 0.0, 0.0]}
    assert from_wisdem._joints({}) == {}


def test_parts_of_wisdem_by_numbers():
    joints = {"1": [1.0, 2.0, 3.0]}
    point = from_wisdem._point({"node_id": 3, "node_type": "vessel", "joint": 1, "cda": 5, "node_mass": 0}, joints)
    assert point == {"name": "3", "type": "vessel", "location": [1.0, 2.0, 3.0], "CdA": 5}
    both = {"name": "n", "node_id": 3, "node_type": "fixed", "joint": 1, "location": [4, 5, 6]}
    assert from_wisdem._point(both, joints)["location"] == [4.0, 5.0, 6.0]
    assert from_wisdem._point(both, joints)["name"] == "n"
    line = {"line_id": 4, "node1": 1, "node2": 2, "line_type": "m", "unstretched_length": 9}
    expected = {"name": "4", "type": "m", "endA": 1, "endB": 2, "length": 9}
    assert from_wisdem._line(line) == expected
    assert from_wisdem._line(line | {"name": "l"}) == expected | {"name": "l"}
    for given in ({"mass_density": 1}, {"stiffness": 1}):
        with pytest.raises(InputError, match="line_types, k: the properties of 'custom' are WISDEM's own"):
            from_wisdem._type({"name": "k", **given})
    with pytest.raises(InputError, match="nodes: node_id is missing"):
        from_wisdem._point({"node_type": "fixed"}, joints)


def test_a_design_of_wisdem_without_the_rest():
    """Its mooring may stand alone; what no part of it is, is said."""
    pytest.importorskip("yaml")
    scene, said = said_of(from_wisdem, WISDEM.replace("fairlead_type: rigid", "colour: red"))
    assert "nodes: colour is not carried over" in said
    alone = re.sub(r"(?m)^  ", "", WISDEM[: WISDEM.index("environment")].split("components:\n")[1])
    bare, _ = said_of(from_wisdem, alone, depth=201.0)
    assert bare == {key: value for key, value in scene.items() if key != "gravity"} | {"sea": {"depth": 201.0}}
    with pytest.raises(InputError, match=r"this is no file of WISDEM\.$"):
        from_wisdem.scene_of("[1, 2]")


# -- MAP++ -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_lines_of_map_end_in_any_way(end):
    assert said_of(from_map, MAP.replace("\n", end), depth=151.0) == said_of(from_map, MAP, depth=151.0)


@pytest.mark.parametrize(
    ("word", "own"),
    [("#", "0"), ("#-12", "-12"), ("depth", "-151.5"), ("DEPTH", "-151.5"), ("-999.9", "0"), ("-999.90", "0")]
    + [("-999.8", "-999.8"), ("999.9", "999.9"), ("x", "x")],
)
def test_words_of_map(word, own):
    assert from_map._word(word, 3, 151.5) == own


def test_options_of_map():
    text = "--- NODE ---\n a 1\n--- SOLVER ---\nx 1 ! y\n\n b 2\n--- LINE ---\nc\n"
    lines, options = from_map._split(text)
    assert lines == ["--- NODE ---", " a 1", "--- SOLVER ---", "", "", "", "--- LINE ---", "c", ""]
    assert options == [(4, ["x", "1"]), (6, [" ", "b", "2"])]
    scene, said = said_of(from_map, MAP.replace("repeat 120 240", "REPEAT 90\nrepeat 30 x"), depth=151.0)
    assert [cable["from"] for cable in scene["cable"]][3] == pytest.approx([-3.0, 400.0, -151.0])
    assert len(scene["cable"]) == 6
    assert "line 25: the option repeat 30 x is not carried over" in said
    assert not any("REPEAT" in note or "Option" in note or "(-)" in note for note in said)


def test_friction_of_map():
    """A value that is no number is none."""
    scene, said = said_of(from_map, MAP.replace("9.8e8  0.7", "9.8e8  -"), depth=151.0)
    assert scene["seabed"] == {"friction": 0.7, "start": "pulled"}
    assert sum(note.startswith("line 4: CB differs") for note in said) == 1
    scene, said = said_of(from_map, MAP.replace("  0.7  ", "  0  "), depth=151.0)
    assert scene["seabed"] == {}
    assert not any("CB" in note for note in said)


# -- MoorPy and MoorDyn ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("share", "below"), [(-1.0, False), (0.5e-9, False), (2e-9, True)])
@pytest.mark.parametrize("reader", [from_moordyn, from_yaml])
def test_an_anchor_may_be_below_the_bed_by_rounding(reader, share, below):
    text = LINES.replace("12 -100.5", f"12 {-102.5 * (1 + share)!r}")
    if reader is from_yaml:
        pytest.importorskip("yaml")
        text = MOORING.replace("-200.5]", f"{-202 * (1 + share)!r}]")
    if below:
        with pytest.raises(InputError, match="is below the bed"):
            reader.scene_of(text)
    else:
        reader.scene_of(text)


@pytest.mark.parametrize("reader", [from_moordyn, from_yaml])
def test_a_joint_may_be_given_below_the_bed(reader):
    """Where it is at rest is found."""
    text = LINES.replace("7 -60", "7 -103")
    if reader is from_yaml:
        pytest.importorskip("yaml")
        joint = next(line for line in MOORING.splitlines() if "clump" in line and "location" in line)
        text = MOORING.replace(joint, re.sub(r"-[\d.]+\]", "-203]", joint))
        assert text != MOORING
    reader.scene_of(text)


@pytest.mark.parametrize(
    ("key", "value", "own", "found"),
    [
        ("breaking_load", 0, "breaking_load", None),
        ("breaking_load", -1, "breaking_load", None),
        ("tangential_added_mass", 0, "tangential_added_mass", None),
        ("EI", 0, "bending_stiffness", None),
        ("EI", 0.5, "bending_stiffness", 0.5),
        ("transverse_drag", 0, "normal_drag", 0.0),
        ("transverse_added_mass", -1, "added_mass", -1.0),
        ("tangential_drag", 0.5, "tangential_drag", 0.5 * math.pi),
    ],
)
def test_zeros_of_line_types(key, value, own, found):
    """Nothing where it could not be 0; a scene judges all else."""
    reader = Fake(note=lambda text: None)
    kind = {"name": "a", "mass_density": 1.0, "diameter": 2, "stiffness": "3", key: value}
    material = from_yaml._Reader._material(reader, kind)
    whole = {"line_density": 1.0, "diameter": 2.0, "axial_stiffness": 3.0}
    assert material == whole | ({} if found is None else {own: pytest.approx(found, rel=1e-15)})


def test_without_a_reader_of_yaml(monkeypatch):
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(InputError, match=r"^PyYAML is not installed: pip install pyyaml$"):
        from_yaml.read_yaml("a: 1")


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("'a.txt' x", (9, "a.txt")),
        ('"a.txt" X - comment', (9, "a.txt")),
        ("9.790 x", (9, "9.790")),
        ("9.80 x", "line 9: the option x is given twice, 9.79 and 9.80."),
        ("Default x", "line 9: the option x is given twice, 9.79 and Default."),
        ("9.79", "line 9: '9.79' is no option: a value and then its name."),
        ("9.79 9.79", "line 9: '9.79 9.79' is no option: a value and then its name."),
    ],
)
def test_options_of_moordyn(line, found):
    """Given again they must be the same number, or the same word."""
    tables = Tables(options={"x": (3, found[1] if "a.txt" in line else "9.79")})
    if isinstance(found, tuple):
        moordyn_text._option(tables, 9, line)
        assert tables.options == {"x": found}
    else:
        with pytest.raises(InputError) as error:
            moordyn_text._option(tables, 9, line)
        assert str(error.value) == found


def test_an_option_that_is_default_is_none():
    tables = Tables()
    moordyn_text._option(tables, 9, "DEFAULT x")
    assert tables.options == {}
