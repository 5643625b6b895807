"""Moorings of MAP++, WISDEM and FAModel: every number is converted to the scene; the rest is MoorPy's.

Source: the manuals of MAP++ ("Input File") and WISDEM (mooring), the ontology of FAModel, for the meaning of files;
sums and rotations by hand; MoorPy from PyPI for tensions.  No two numbers of a file are equal.
"""

import math

import numpy as np
import pytest

import dolfbuoy
from dolfbuoy.errors import InputError
from dolfbuoy.formats import from_famodel, from_map, from_wisdem
from dolfbuoy.formats.files import read as read_file
from dolfbuoy.scene import load_scene

MAP = """--------------- LINE DICTIONARY ---------------
LineType  Diam  MassDenInAir  EA  CB  CIntDamp  Ca  Cdn  Cdt
(-)       (m)   (kg/m)        (N) (-) (Pa-s)    (-) (-)  (-)
steel     0.15  119.5  9.8e8  0.7  -999.9  0.9  1.2  0.05
poly      0.20  40.5   9.7e7  0.7  2e6     -999.9 -999.9 -999.9
--------------- NODE PROPERTIES ---------------
Node Type X Y Z M B FX FY FZ
(-) (-) (m) (m) (m) (kg) (m^3) (N) (N) (N)
1 fix      400   3   depth 0    0   # # #
2 connect #91   #1  #-82   601  0.25 0 0 0
3 vessel   20   19  -10    0    0   # # #
4 vessel   21  -18  -11    0    0   # # #
--------------- LINE PROPERTIES ---------------
Line LineType UnstrLen NodeAnch NodeFair Flags
(-)  (-)      (m)      (-)      (-)      (-)
1    steel    341      1        2        tension_fair
2    poly     98.5     2        3
3    poly    #97.5     2        4   ! upper
--------------- SOLVER OPTIONS ----------------
Option
(-)
outer_tol 1e-5
 a comment begins with a blank
repeat 120 240
"""


def test_map():
    """Its guesses, unknowns and depth; what is repeated is turned about z."""
    scene, notes = from_map.scene_of(MAP, depth=151.0)
    load_scene(scene)
    assert scene["sea"] == {"depth": 151.0}
    assert scene["seabed"] == {"friction": 0.7, "start": "pulled"}
    steel, poly = scene["material"].values()
    assert steel == {
        "line_density": 119.5,
        "diameter": 0.15,
        "axial_stiffness": 9.8e8,
        "normal_drag": 1.2,
        "added_mass": 0.9,
        "tangential_drag": pytest.approx(0.05 * math.pi),
    }
    assert poly == {"line_density": 40.5, "diameter": 0.2, "axial_stiffness": 9.7e7, "normal_drag": 0.0} | {
        "added_mass": 0.0,
        "tangential_drag": 0.0,
        "damping": pytest.approx(2e6 * math.pi / 4 * 0.2**2),
    }
    assert [cable["length"] for cable in scene["cable"]] == [341.0, 98.5, 97.5] * 3
    assert [cable["to"] for cable in scene["cable"][:3]] == ["point2", "vessel.point3", "vessel.point4"]
    assert [cable["to"] for cable in scene["cable"][3:6]] == ["point2_2", "vessel.point3_2", "vessel.point4_2"]
    assert scene["joint"] == [{"name": f"point2{k}", "mass": 601.0, "volume": 0.25} for k in ("", "_2", "_3")]
    fairleads = scene["vessel"][0]["fairleads"]
    c, s = -0.5, math.sqrt(0.75)
    assert fairleads["point3"] == [20.0, 19.0, -10.0]
    assert fairleads["point3_2"] == pytest.approx([20 * c - 19 * s, 20 * s + 19 * c, -10.0], rel=1e-13)
    assert scene["cable"][6]["from"] == pytest.approx([400 * c + 3 * s, -400 * s + 3 * c, -151.0], rel=1e-13)
    said = [str(note) for note in notes]
    assert "line 22: the option outer_tol 1e-5 is not carried over" in said
    assert not any("MoorDyn" in note or "Can Cat" in note or "CB" in note or "comment" in note for note in said)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("9.8e8  0.7", "9.8e8  0.6"), "line 4: CB differs among line types, and here it does not: the largest, 0.7"),
        (("341      1", "341      7"), None),
        (("", ""), "line 18: UnstrLen #97.5 is the guess of a length that MAP++ finds: here it is the length"),
        (("repeat 120", " repeat 120"), "line 24: repeat stands behind a blank, and is no option so"),
    ],
)
def test_what_is_said_of_a_file_of_map(change, words):
    if words is None:
        with pytest.raises(InputError, match="line 16: there is no point 7"):
            from_map.scene_of(MAP.replace(*change), depth=151.0)
    else:
        assert any(str(note).startswith(words) for note in from_map.scene_of(MAP.replace(*change), depth=151.0)[1])


def test_what_is_no_file_of_map():
    with pytest.raises(InputError, match=r"this is no input file of MAP\+\+\.$"):
        from_map.scene_of("")


def test_the_depth_of_map_is_asked_for():
    with pytest.raises(InputError, match=r"line 9: depth is that of the program that calls MAP.*give --depth METRES"):
        from_map.scene_of(MAP)
    assert from_map.scene_of(MAP.replace("depth", "-142"))[0]["sea"] == {"depth": 142.0}


WISDEM = """name: a design
components:
  tower: {}
  floating_platform:
    joints:
      - {name: keel, location: [1.0, 2.0, -21.0]}
      - {name: top, location: [1.5, 3.0, 11.0]}
      - {name: pontoon, location: [40.0, 0.5, -15.0], cylindrical: true}
    members:
      - {name: column, joint1: keel, joint2: top, axial_joints: [{name: belt, grid: 0.25}]}
  mooring:
    nodes:
      - {name: a1, node_type: fixed, anchor_type: drag, location: {x: -800.0, y: 5.0, z: -199.0}}
      - {name: f1, node_type: vessel, joint: pontoon, fairlead_type: rigid}
      - {name: f2, node_type: vessel, joint: belt}
      - {name: c1, node_type: connection, location: [-300.0, 4.0, -120.0], node_mass: 700.0, node_volume: 0.3,
         drag_area: 1.7, added_mass: 0.6}
    lines:
      - {name: low, line_type: main, unstretched_length: 560.0, node1: a1, node2: c1}
      - {name: high, line_type: main, unstretched_length: 310.0, node1: c1, node2: f1}
      - {name: other, line_type: main, unstretched_length: 305.0, node1: c1, node2: f2}
    line_types:
      - {name: main, type: chain, diameter: 0.19, mass_density: 285.0, stiffness: 1.1e9, breaking_load: 1.2e7, cost: 3,
         transverse_added_mass: 0.95, tangential_added_mass: 0.15, transverse_drag: 1.6, tangential_drag: 0.1}
    anchor_types: [{name: drag, type: drag_embedment}]
environment: {gravity: 9.79, water_density: 1019.0, water_depth: 201.0}
"""


def test_wisdem():
    pytest.importorskip("yaml")
    scene, notes = from_wisdem.scene_of(WISDEM)
    load_scene(scene)
    bent, _ = from_wisdem.scene_of(WISDEM.replace("cost: 3,", "EI: 2e4,"))
    assert bent["material"]["main"]["bending_stiffness"] == 2e4
    assert (scene["gravity"], scene["sea"]) == (9.79, {"depth": 201.0, "density": 1019.0})
    assert scene["material"]["main"] == {
        "line_density": 285.0,
        "diameter": 0.19,
        "axial_stiffness": 1.1e9,
        "normal_drag": 1.6,
        "added_mass": 0.95,
        "tangential_drag": pytest.approx(0.1 * math.pi),
        "tangential_added_mass": 0.15,
        "breaking_load": 1.2e7,
    }
    assert [(cable["from"], cable["to"], cable["length"]) for cable in scene["cable"]] == [
        ([-800.0, 5.0, -199.0], "c1", 560.0),
        ("c1", "vessel.f1", 310.0),
        ("c1", "vessel.f2", 305.0),
    ]
    assert scene["joint"] == [{"name": "c1", "mass": 700.0, "volume": 0.3, "drag_area": 1.7, "added_mass": 0.6}]
    fairleads = scene["vessel"][0]["fairleads"]
    assert fairleads["f1"] == pytest.approx([40 * math.cos(0.5), 40 * math.sin(0.5), -15.0])
    assert fairleads["f2"] == pytest.approx([1.125, 2.25, -13.0])
    assert any("and not tower" in str(note) for note in notes)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("joint: belt", "joint: wing"), "nodes, f2: joint 'wing' is none of the joints of floating_platform"),
        (("mass_density: 285.0, ", ""), "line_types, main: the properties of 'chain' are WISDEM's own"),
        (("unstretched_length: 560.0", "length: 560.0"), "lines, low: length is None"),
        (("mooring:", "morring:"), "this is no file of WISDEM"),
    ],
)
def test_what_is_refused_of_wisdem(change, words):
    pytest.importorskip("yaml")
    with pytest.raises(InputError) as error:
        from_wisdem.scene_of(WISDEM.replace(*change))
    assert words in str(error.value)


FAMODEL = """type: array of two
site:
  general: {water_depth: 210.0, rho_water: 1021.0, rho_air: 1.2}
array:
  keys: [ID, turbineID, platformID, mooringID, x_location, y_location, heading_adjust]
  data:
    - [fowt1, 1, 1, ms1, 10.0, 20.0, 90]
    - [f2, 1, 1, 0, 1610.0, 25.0, 0]
array_mooring:
  anchor_keys: [ID, type, x, y, embedment]
  anchor_data: [[anch1, drag, 2400.0, 30.0, 0]]
  line_keys: [MooringConfigID, end A, end B, lengthAdjust]
  line_data: [[shared, fowt1, f2, 0], [taut, anch1, f2, 0]]
platform: {rFair: 41.0, zFair: -16.0}
mooring_systems:
  ms1:
    keys: [MooringConfigID, heading, anchorType, lengthAdjust]
    data: [[taut, 30, drag, 0], [taut, 270, drag, 5]]
mooring_line_configs:
  taut:
    anchoring_radius: 801.0
    fairlead_radius: 40.0
    fairlead_depth: -14.0
    sections:
      - {connectorType: shackle}
      - {type: chain, length: 301.0}
      - {connectorType: link}
      - {type: poly, length: 502.0}
  shared:
    symmetric: true
    sections: [{type: poly, length: 81.0}, {connectorType: clump}, {type: poly, length: 690.0}]
mooring_line_types:
  keys: [name, d_vol, m, EA, MBL, EAd]
  data: [[chain, 0.3, 401.0, 1.5e9, 1.6e7, 0]]
  poly: {d_nom: 0.26, d_vol: 0.22, m: 55.0, EA: 1.6e8, MBL: 1.1e7, EAd: 3e8, Cd: 1.3, CdAx: 0.07, Ca: 0.97, CaAx: 0.12}
mooring_connector_types:
  link: {m: 141.0, v: 0.13}
  clump: {m: 20001.0, v: 0.8, CdA: 3.5}
  shackle: {m: 50.0, v: 0.01}
"""


def test_famodel():
    """Lines of a platform go out at their heading and its own; a symmetric one has its middle section once, doubled."""
    pytest.importorskip("yaml")
    scene, notes = from_famodel.scene_of(FAMODEL)
    network = load_scene(scene).network
    assert scene["sea"] == {"depth": 210.0, "density": 1021.0}
    poly = {"line_density": 55.0, "diameter": 0.22, "axial_stiffness": 1.6e8, "normal_drag": 1.3, "added_mass": 0.97}
    poly |= {"tangential_drag": pytest.approx(0.07 * math.pi), "tangential_added_mass": 0.12, "breaking_load": 1.1e7}
    assert scene["material"]["poly"] == poly
    assert scene["material"]["chain"]["breaking_load"] == 1.6e7
    lengths = [cable["length"] for cable in scene["cable"]]
    assert lengths == [301.0, 502.0] * 2 + [81.0, 1380.0, 81.0] + [301.0, 502.0]
    assert sorted((joint["mass"], joint.get("drag_area")) for joint in scene["joint"]) == sorted(
        [(141.0, None)] * 3 + [(20001.0, 3.5)] * 2, key=str
    )
    low, high = network.pieces[0].ends[0].position, network.pieces[1].ends[1].position
    turn = math.radians(120)
    assert low == pytest.approx([10 + 801 * math.cos(turn), 20 + 801 * math.sin(turn), -210.0])
    assert high == pytest.approx([10 + 40 * math.cos(turn), 20 + 40 * math.sin(turn), -14.0])
    a, b = network.pieces[4].ends[0].position, network.pieces[6].ends[1].position
    way = np.array([1600.0, 5.0]) / math.hypot(1600, 5)
    assert a == pytest.approx([10 + 41 * way[0], 20 + 41 * way[1], -16.0])
    assert b == pytest.approx([1610 - 41 * way[0], 25 - 41 * way[1], -16.0])
    assert network.pieces[7].ends[0].position == (2400.0, 30.0, -210.0)
    said = [str(note) for note in notes]
    for words in ("lengthAdjust = 5 is not", "poly: EAd = 3e8, the dynamic stiffness", "counterclockwise"):
        assert sum(words in note for note in said) == 1, words


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("ms1, 10.0", "ms7, 10.0"), "array: mooringID 'ms7' is none of mooring_systems: ms1"),
        (("[[taut, 30", "[[loose, 30"), "MooringConfigID 'loose' is none of mooring_line_configs: taut, shared"),
        (("fowt1, f2, 0]", "f7, f2, 0]"), "line_data, row 1: 'f7' is none of the anchors and platforms"),
        (("anchoring_radius: 801.0", "radius: 801.0"), "anchoring_radius (or span) is None"),
        (("keys: [ID, ", "names: [ID, "), "array: must have keys, and data with a value for each"),
        (("water_depth: 210.0, ", ""), "site.general.water_depth is None"),
    ],
)
def test_what_is_refused_of_famodel(change, words):
    pytest.importorskip("yaml")
    with pytest.raises(InputError) as error:
        from_famodel.scene_of(FAMODEL.replace(*change))
    assert words in str(error.value)


def test_a_span_is_between_the_ends():
    pytest.importorskip("yaml")
    scene, _ = from_famodel.scene_of(FAMODEL.replace("anchoring_radius: 801.0", "span: 760.0"))
    turn = math.radians(120)
    assert scene["cable"][0]["from"] == pytest.approx([10 + 800 * math.cos(turn), 20 + 800 * math.sin(turn), -210.0])


def test_formats_by_name(tmp_path):
    """As read from the command line; a depth that the file lacks is given there, one that it has counts."""
    pytest.importorskip("yaml")
    for kind, text, depth in (("map", MAP, 151.0), ("wisdem", WISDEM, 201.0), ("famodel", FAMODEL, 210.0)):
        path = tmp_path / "file.txt"
        path.write_text(text)
        assert read_file(kind, path, depth=151.0)[0]["sea"]["depth"] == depth
    with pytest.raises(InputError, match="--columns = 'place': must be name, or place with moordyn"):
        read_file("map", path, columns="place")


def moorpy_tensions(scene):
    """Tensions at both ends of every line of a scene in MoorPy, from its own equilibrium of the joints."""
    moorpy, found = pytest.importorskip("moorpy"), load_scene(scene)
    network, sea = found.network, found.sea
    system, points = moorpy.System(depth=sea.depth, rho=sea.density, g=found.gravity), {}
    places = dolfbuoy.solve_static(scene)
    joints = dict(zip(places.joint.values.tolist(), places.joint_position.values.tolist(), strict=True))
    for k, piece in enumerate(network.pieces):
        c = piece.section
        system.lineTypes[str(k)] = {"name": str(k), "d_vol": c.diameter, "m": c.line_density, "EA": c.axial_stiffness}
        system.lineTypes[str(k)] |= {"w": (c.line_density - sea.density * math.pi / 4 * c.diameter**2) * found.gravity}
        for end in piece.ends:
            key = end.name or end.position
            if key not in points:
                body = network.bodies.get(end.name)
                size = (body.mass, body.volume) if body else (0.0, 0.0)
                place = end.position or joints[end.name]
                system.addPoint(1 if end.held else 0, np.array(place), m=size[0], v=size[1])
                points[key] = len(system.pointList)
        ends = [points[end.name or end.position] for end in piece.ends]
        system.addLine(c.length, str(k), pointA=ends[0], pointB=ends[1])
    system.initialize()
    system.solveEquilibrium(tol=1e-8)
    return np.array([[line.TA, line.TB] for line in system.lineList]), places


@pytest.mark.filterwarnings("ignore:Polyfit")
@pytest.mark.parametrize("kind", [pytest.param("map", marks=pytest.mark.slow), "wisdem", "famodel"])
def test_rest_beside_moorpy(kind):
    """Tensions at all ends within 0.2 % of the largest, with 60 elements a line; without friction, which MoorPy's
    system does not hand on to its lines."""
    pytest.importorskip("yaml")
    reader, text = {"map": (from_map, MAP), "wisdem": (from_wisdem, WISDEM), "famodel": (from_famodel, FAMODEL)}[kind]
    scene, _ = reader.scene_of(text, depth=151.0)
    scene["seabed"] = {}
    for cable in scene["cable"]:
        cable["elements"] = 60
    theirs, rest = moorpy_tensions(scene)
    ours = [np.linalg.norm(rest[name].values, axis=-1) for name in ("anchor_force", "end_tension")]
    assert np.transpose(ours) == pytest.approx(theirs, abs=2e-3 * theirs.max())
