"""Rods, bodies, vessels, failures and loads in MoorDyn files, and tables whose columns are read by position.

Source: MoorDyn's manual, "Input Files" and "Rods", for the meaning of files; Archimedes, levers and balances of forces
by hand; MoorDyn from PyPI for positions and tensions at rest.  No two numbers of a file are equal.
"""

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import dolfbuoy
from dolfbuoy.errors import InputError
from dolfbuoy.formats import from_moordyn
from dolfbuoy.formats.moordyn_run import silent
from dolfbuoy.formats.to_moordyn import export
from dolfbuoy.scene import load_scene

TYPES = """a made up mooring
--- LINE TYPES ---
TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
rope 0.05 5.0 2e6 0 {EI} 1.2 1.01 0.1 0.2
--- ROD TYPES ---
TypeName Diam Mass/m Cd Ca CdEnd CaEnd
(-) (m) (kg/m) (-) (-) (-) (-)
steel 0.3 301 0.8 0.95 1.1 0.9
float 1.0 310 0.7 0.96 1.3 0.6
"""
OPTIONS = "--- OPTIONS ---\n5e-4 dtM\n61 WtrDpth\n0 kBot\n0 cBot\n0 TmaxIC\n{more}--- need this line ---\n"
TABLES = {
    "BODIES": "ID Attachment X0 Y0 Z0 r0 p0 y0 Mass CG* I* Volume CdA* Ca*",
    "RODS": "ID RodType Attachment Xa Ya Za Xb Yb Zb NumSegs RodOutputs",
    "POINTS": "ID Attachment X Y Z Mass Volume CdA Ca",
    "LINES": "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs",
    "FAILURE": "FailureID Point Line(s) FailTime FailTen",
    "EXTERNAL LOADS": "ID Object Fext Blin Bquad CSys",
}


def written(more="", EI=0, **tables):
    """Text of a file with these rows of tables; more: lines of its options."""
    text = TYPES.format(EI=EI)
    for name, columns in TABLES.items():
        if rows := tables.get(name.replace(" ", "_")):
            text += "\n".join([f"--- {name} ---", columns, " ".join("(-)" for _ in columns.split()), *rows]) + "\n"
    return text + OPTIONS.format(more=more)


def read(text, **how):
    """The scene as dict, and what is said of it but for options and a run."""
    scene, notes = from_moordyn.scene_of(text, **how)
    load_scene(scene)
    said = [str(note) for note in notes if "cBot" not in note.text and "proposal" not in note.text]
    return scene, said


HUNG = written(
    RODS=["1 steel Free -3 0 -20 3 0 -20.5 10 -"],
    POINTS=["1 Fixed -5 0.5 0.25 0 0 0 0", "2 Fixed 5 1 0 0 0 0 0"],
    LINES=["1 rope 1 R1A 20 20 -", "2 rope R1b 2 21 22 -"],
)
BARREL = written(
    RODS=["1 float Free -3 0 -10 3 0 -10.25 20 -"],
    POINTS=["1 Fixed -5 0 -60 0 0 0 0", "2 Fixed 5 1 -61 0 0 0 0"],
    LINES=["1 rope 1 R1A 50 20 -", "2 rope 2 R1B 49 22 -"],
)
HINGED = written(
    RODS=["1 steel Pinned 0 0.5 -20 6 0 -20.5 10 -"],
    POINTS=["1 Fixed 12 3 0.25 0 0 0 0"],
    LINES=["1 rope R1B 1 21.5 20 -"],
)
BODY = written(
    BODIES=["1 Free 0 0 -14 0 0 0 4000 0|0|-0.3 901|902|803 7.0 3.0 0.7"],
    POINTS=["1 Fixed -20 0 -60 0 0 0 0", "2 Fixed 20 0 -61 0 0 0 0"]
    + ["3 Body1 -1 0 0.1 0 0 0 0", "4 Body1 1 0 0 0 0 0 0"],
    LINES=["1 rope 1 3 50 20 -", "2 rope 2 4 51 22 -"],
)


def test_a_rod_that_is_hung_is_a_bar():
    """End drag 2 x 1.1 pi d^2/4 over the drag of d L, end added mass 2 x 0.9 x 2/3 pi r^3 over the volume."""
    scene, said = read(HUNG)
    length = math.sqrt(36.25)
    assert scene["cable"][2] == {
        "name": "rod1",
        "from": "rod1a",
        "to": "rod1b",
        "length": pytest.approx(length, rel=1e-14),
        "elements": 1,
        "line_density": 301.0,
        "diameter": 0.3,
        "normal_drag": 0.8,
        "added_mass": 0.95,
        "tangential_drag": pytest.approx(2 * 1.1 * math.pi * 0.3**2 / 4 / (0.3 * length), rel=1e-13),
        "tangential_added_mass": pytest.approx(
            2 * 0.9 * 2 / 3 * math.pi * 0.15**3 / (math.pi * 0.15**2 * length), rel=1e-13
        ),
    }
    assert [(cable["from"], cable["to"]) for cable in scene["cable"][:2]] == [
        ([-5.0, 0.5, 0.25], "rod1a"),
        ("rod1b", [5.0, 1.0, 0.0]),
    ]
    assert [joint["name"] for joint in scene["joint"]] == ["rod1a", "rod1b"]
    assert said == ["line 14: rod1 is a bar here: a cable of one element that does not stretch"]


def test_a_bar_of_a_body_without_mass_has_next_to_none():
    """A ten thousandth of that of the water in its place, as a line has some."""
    text = (
        SIDE_BY_SIDE.format(mass=2500).replace("steel 0.3 301", "steel 0.3 0").replace("float 1.0 310", "float 1.0 0")
    )
    bars = [cable for cable in read(text)[0]["cable"] if cable["name"].startswith("rod")]
    areas = np.array([math.pi / 4 * bar["diameter"] ** 2 for bar in bars])
    np.testing.assert_allclose([bar["line_density"] for bar in bars], 1e-4 * 1025 * areas, rtol=1e-12)
    assert len(set(areas)) > 1


def test_the_free_end_of_a_bar_is_a_joint_too():
    """Also where no line ends on it."""
    text = written(
        RODS=["1 steel Free -3 0 -20 3 0 -20.5 10 -"],
        POINTS=["1 Fixed -5 0.5 0.25 0 0 0 0"],
        LINES=["1 rope 1 R1A 20 20 -"],
    )
    scene, _ = read(text)
    assert [joint["name"] for joint in scene["joint"]] == ["rod1a", "rod1b"]
    assert [cable["name"] for cable in scene["cable"]][-1] == "rod1"


def test_a_rod_that_floats_upright_is_a_buoy():
    """Three lines to its lower end; what it displaces is its mass and the pull of the lines."""
    legs = [(-60.0, 0.0), (30.0, 30 * math.sqrt(3)), (30.0, -30 * math.sqrt(3))]
    text = written(
        RODS=["1 float Free 0 0 2 0 0 -6 20 -"],
        POINTS=[f"{k} Fixed {x} {y} -60 0 0 0 0" for k, (x, y) in enumerate(legs, 1)],
        LINES=[f"{k} rope {k} R1B 82 20 -" for k in (1, 2, 3)],
    )
    scene, said = read(text)
    (buoy,) = scene["buoy"]
    across = 2480 * (8**2 / 12 + 1 / 16)
    assert buoy == {
        "name": "rod1",
        "hull": [[0.0, 1.0], [8.0, 1.0]],
        "mass": 2480.0,
        "center_of_mass": 4.0,
        "inertia": pytest.approx([across, across, 2480 / 8], rel=1e-13),
        "normal_drag": 0.7,
        "added_mass": 0.96,
        "axial_drag": 1.3,
        "axial_added_mass": 0.6,
        "fairleads": {"b": [0.0, 0.0, 0.0]},
    }
    assert said == []
    rest = dolfbuoy.solve_static(scene)
    pull = rest.end_tension.values[:3, 2].sum()
    draft = -float(rest.buoy_position.values[0, 2]) + 4.0
    assert 1025 * math.pi / 4 * draft == pytest.approx(2480 + pull / 9.81, rel=1e-6)


@pytest.mark.parametrize(
    ("attachment", "ends", "said"),
    [
        ("Fixed", [[1.0, 2.0, -3.0], [1.5, 2.0, -7.0]], None),
        ("Coupled", ["vessel.rod1a", "vessel.rod1b"], None),
        ("Body1", ["body1.rod1a", "body1.rod1b"], "line 14: body1 is moved by the program"),
        ("Pinned", [[1.0, 2.0, -3.0], "rod1b"], "line 18: rod1 is a bar"),
        ("CoupledPinned", ["vessel.rod1a", "rod1b"], "line 18: rod1 is a bar"),
        ("Body1Pinned", ["body1.rod1a", "rod1b"], "line 18: rod1 is a bar"),
    ],
)
def test_what_a_rod_stands_on(attachment, ends, said):
    text = written(
        BODIES=["1 Vessel 10 20 -1.5 0 0 90 0 0 0 0 0 0"],
        RODS=[f"1 steel {attachment} 1 2 -3 1.5 2 -7 10 -"],
        POINTS=["1 Fixed 12 3 0.25 0 0 0 0"],
        LINES=["1 rope R1A 1 41.5 20 -", "2 rope R1B 1 42.5 20 -"],
    )
    scene, notes = read(text)
    assert [cable["from"] for cable in scene["cable"][:2]] == ends
    assert len(scene["cable"]) == 2 + ("inned" in attachment)
    assert said is None or any(note.startswith(said) for note in notes)
    places = {"vessel": ([0.0, 0.0, 0.0], None), "body1": ([10.0, 20.0, -1.5], 90.0)}
    for vessel in scene.get("vessel", []):
        assert (vessel["position"], vessel.get("heading_deg")) == places[vessel["name"]]
        assert vessel["fairleads"]["rod1a"] == [1.0, 2.0, -3.0]


@pytest.mark.parametrize(
    ("attachment", "place", "way"),
    [
        ("Fixed", "1 2 -3 1 2 -7", [0.0, 0.0, -1.0]),
        ("Body1", "1 2 -3 4 2 -3", [1.0, 0.0, 0.0]),  # in the frame of the vessel, which heads for y
        ("Coupled", "1 2 -3 1 8 -3", [0.0, 1.0, 0.0]),
    ],
)
@pytest.mark.parametrize(
    ("ends", "key", "sign"),
    [("R1B 1", "from_end", 1), ("R1A 1", "from_end", -1), ("1 R1A", "to_end", 1), ("1 R1B", "to_end", -1)],
)
def test_a_line_that_bends_leaves_a_rod_along_it(attachment, place, way, ends, key, sign):
    """Away from the rod at its end, in the direction of the line's own s."""
    text = written(
        EI=1e4,
        BODIES=["1 Coupled 10 20 -1.5 0 0 90 0 0 0 0 0 0"],
        RODS=[f"1 steel {attachment} {place} 10 -"],
        POINTS=["1 Fixed 12 3 0.25 0 0 0 0"],
        LINES=[f"1 rope {ends} 41.5 20 -"],
    )
    (cable,) = read(text)[0]["cable"]
    assert cable[key]["direction"] == pytest.approx([sign * x for x in way], abs=1e-14)
    assert {"from_end", "to_end"} - {key} - set(cable) == {"from_end", "to_end"} - {key}


def test_a_body_without_rods():
    """A cylinder as high as wide, pi D^3/4 = 7 m^3 about the origin; areas and masses of the file: 3 m^2, 0.7 V.

    Its axis is that through its centre of mass, upwards.
    """
    scene, said = read(BODY)
    (body,) = scene["buoy"]
    D = (4 * 7.0 / math.pi) ** (1 / 3)
    assert body["hull"] == pytest.approx(np.array([[0.0, D], [D, D]]), rel=1e-13)
    assert (body["mass"], body["center_of_mass"]) == (4000.0, pytest.approx(D / 2 - 0.3, rel=1e-13))
    assert body["inertia"] == pytest.approx([901.0, 902.0, 803.0], rel=1e-13)
    assert body["normal_drag"] * D * D == pytest.approx(3.0, rel=1e-13)
    assert body["axial_drag"] * 2 * math.pi / 4 * D * D == pytest.approx(3.0, rel=1e-13)
    assert body["added_mass"] == 0.7
    assert body["axial_added_mass"] * 2 * 2 / 3 * math.pi * (D / 2) ** 3 == pytest.approx(0.7 * 7.0, rel=1e-13)
    assert body["fairleads"]["point3"] == pytest.approx([-1.0, 0.0, D / 2 + 0.1], rel=1e-13)
    assert said == []


@pytest.mark.parametrize(
    ("columns", "areas"),
    [("1.1|1.2|1.3", (1.15, 1.3)), ("1.1|1.2|1.3|4|5|6", (1.15, 1.3)), ("1.1|9", (1.1, 1.1))],
)
def test_drag_areas_of_a_body(columns, areas):
    scene, said = read(BODY.replace("7.0 3.0 0.7", f"7.0 {columns} 0.7"))
    (body,) = scene["buoy"]
    D = (4 * 7.0 / math.pi) ** (1 / 3)
    assert body["normal_drag"] * D * D == pytest.approx(areas[0], rel=1e-13)
    assert body["axial_drag"] * 2 * math.pi / 4 * D * D == pytest.approx(areas[1], rel=1e-13)
    turning = [note for note in said if "what is of turning" in note]
    assert len(turning) == (len(columns.split("|")) != 3)


def test_a_body_on_its_side():
    """Rods along y, its centre of mass on their axis: the buoy's own axis, its moments turned with it."""
    text = written(
        BODIES=["1 Free 1 2 -14 0 0 0 4000 0|0.5|0 901|803|901 0 0 0"],
        RODS=["1 steel Body1 0 1 0 0 -2 0 4 -", "2 float Body1 0 -2 0 0 -3 0 4 -"],
        POINTS=["1 Fixed -20 0 -60 0 0 0 0", "3 Body1 0.25 1 0.75 0 0 0 0"],
        LINES=["1 rope 1 3 50 20 -", "2 rope 1 R2B 51 20 -"],
    )
    scene, _ = read(text)
    (body,) = scene["buoy"]
    assert body["hull"] == pytest.approx(np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.3], [4.0, 0.3]])) or body[
        "hull"
    ] == pytest.approx(np.array([[0.0, 0.3], [3.0, 0.3], [3.0, 1.0], [4.0, 1.0]]))
    low = body["hull"][0][1] == 1.0  # which end the keel is at is a choice
    y = (4000 * 0.5 + 3 * 301 * -0.5 + 310 * -2.5) / (4000 + 903 + 310)
    assert body["center_of_mass"] == pytest.approx(y + 3 if low else 1 - y, rel=1e-12)
    along = 803 + 903 * 0.3**2 / 8 + 310 / 8
    assert body["inertia"][2] == pytest.approx(along, rel=1e-12)
    assert np.hypot(*body["fairleads"]["point3"][:2]) == pytest.approx(math.hypot(0.25, 0.75), rel=1e-12)
    assert body["fairleads"]["rod2b"] == pytest.approx([0.0, 0.0, 0.0 if low else 4.0], abs=1e-12)


def in_body_frame(buoy, points):
    """Axes of a buoy in the frame of its MoorDyn body (rows: of the body), and the body's origin in that of the buoy.

    points: names of fairleads at the origin and one metre along each axis.
    """
    at = [np.array(buoy["fairleads"][name]) for name in points]
    return np.array([place - at[0] for place in at[1:]]), at[0]


def test_main_axes_of_a_body():
    """Its axis goes through the centre of mass, and about that it is turned to the main axes: across it its inertia is
    whole, along it too; what is left out is what couples the two, and is said."""
    ends = ["3 Body1 0 0 0", "4 Body1 1 0 0", "5 Body1 0 1 0", "6 Body1 0 0 1"]
    text = written(
        BODIES=["1 Free 0 0 -14 0 0 0 4000 0.1|0.2|0.3 901|1402|803 7.0 3.0 0.7"],
        POINTS=["1 Fixed -20 0 -60 0 0 0 0", *(f"{end} 0 0 0 0" for end in ends)],
        LINES=[f"{k} rope 1 {k + 2} 5{k} 20 -" for k in range(1, 5)],
    )
    scene, said = read(text)
    (buoy,) = scene["buoy"]
    axes, _ = in_body_frame(buoy, ["point3", "point4", "point5", "point6"])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    along = np.array([0.1, 0.2, 0.3]) / math.sqrt(0.14)
    np.testing.assert_allclose(axes[:, 2], along, atol=1e-12)
    given, found = np.diag([901.0, 1402.0, 803.0]), axes @ np.diag(buoy["inertia"]) @ axes.T
    across = np.eye(3) - np.outer(along, along)
    np.testing.assert_allclose(across @ found @ across, across @ given @ across, atol=1e-9)
    assert along @ found @ along == pytest.approx(along @ given @ along, rel=1e-12)
    product = np.linalg.norm(across @ given @ along) / max(buoy["inertia"])
    (note,) = (note for note in said if "products of inertia" in note)
    assert product / math.sqrt(2) <= float(note.split("up to ")[1].split()[0]) * 1.05 <= product * 1.1


#: Rods side by side, of which two reach the surface as the body starts, and one across.
SIDE_BY_SIDE = written(
    BODIES=["1 Free 0 0 -2 0 0 0 {mass} 0|0|-1.5 901|902|803 0.5 1.0 0.7"],
    RODS=["1 float Body1 2 0 -3 2 0 3 6 -", "2 float Body1 -2 0.5 -3 -2 0.5 2.5 5 -"]
    + ["3 steel Body1 -2 0.5 -3 2 0 -3 6 -"],
    POINTS=["1 Fixed -20 0 -60 0 0 0 0", "2 Body1 0 0 0 0 0 0 0", "3 Body1 1 0 0 0 0 0 0"]
    + ["4 Body1 0 1 0 0 0 0 0", "5 Body1 0 0 1 0 0 0 0"],
    LINES=[f"{k} rope 1 {k + 1} 8{k} 20 -" for k in range(1, 5)],
)


@pytest.mark.parametrize("mass", [2500, 0])
def test_rods_side_by_side_are_bars_of_their_body(mass):
    """Mass, centre and inertia of body and bars together are those of body and rods, by Steiner; volume too."""
    scene, said = read(SIDE_BY_SIDE.format(mass=mass))
    (buoy,), cables = scene["buoy"], [cable for cable in scene["cable"] if cable["name"].startswith("rod")]
    assert [cable["name"] for cable in cables] == [f"rod1s{k}" for k in range(1, 7)] + [
        f"rod2s{k}" for k in range(1, 6)
    ] + ["rod3"]
    assert (
        said[0] == "line 14: body1 has rods that do not stand on one axis: its rods are bars between points of it here"
    )
    assert any(note.startswith("line 14: body1 has no mass: 1% of that of its rods") for note in said) == (mass == 0)
    axes, origin = in_body_frame(buoy, ["point2", "point3", "point4", "point5"])

    def place(name):
        return axes @ (np.array(buoy["fairleads"][name.removeprefix("body1.")]) - origin)

    def about(mass, center, own, point):
        arm = np.asarray(center) - point
        return own + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    def thin(mass, way, share=1 / 12, spin=0.0):
        return mass * (share * (way @ way * np.eye(3) - np.outer(way, way)) + spin)

    center = axes @ (np.array([0.0, 0.0, buoy["center_of_mass"]]) - origin)
    ours = [(buoy["mass"], center, axes @ np.diag(buoy["inertia"]) @ axes.T)]
    for cable in cables:
        a, b = place(cable["from"]), place(cable["to"])
        assert cable["length"] == pytest.approx(np.linalg.norm(b - a), rel=1e-12)
        heavy = cable["line_density"] * cable["length"]
        ours.append((heavy, (a + b) / 2, thin(heavy, b - a)))
    theirs = [(mass, np.array([0.0, 0.0, -1.5]), np.diag([901.0, 902.0, 803.0]))]
    rods = [((2, 0, -3), (2, 0, 3), 310, 1.0), ((-2, 0.5, -3), (-2, 0.5, 2.5), 310, 1.0)]
    for a, b, density, d in [*rods, ((-2, 0.5, -3), (2, 0, -3), 301, 0.3)]:
        way = np.subtract(b, a)
        unit, heavy = way / np.linalg.norm(way), density * np.linalg.norm(way)
        spin = d**2 / 16 * (np.eye(3) + np.outer(unit, unit))
        theirs.append((heavy, np.add(a, b) / 2, thin(heavy, way, spin=spin)))
    for parts in (ours, theirs):
        total = sum(part[0] for part in parts)
        middle = sum(part[0] * part[1] for part in parts) / total
        parts[:] = [total, middle, sum(about(*part, middle) for part in parts)]
    assert ours[0] == pytest.approx(theirs[0], rel=1e-12)
    np.testing.assert_allclose(ours[1], theirs[1], atol=1e-12)
    np.testing.assert_allclose(ours[2], theirs[2], atol=2e-3 * theirs[2].max())  # products of the body's own
    size = buoy["hull"][1][1]
    assert math.pi / 4 * size**3 == pytest.approx(0.5, rel=1e-12)
    assert {cable["diameter"] for cable in cables[:-1]} == {1.0}
    assert cables[0]["tangential_drag"] == pytest.approx(1.3 * math.pi * 1.0 / (2 * 6), rel=1e-12)


def test_draft_of_columns_side_by_side():
    """Three columns about the origin, and a body: they displace what all weigh with their lines."""
    angles = np.radians([90, 210, 330])
    columns = [f"{3 * np.cos(a):.6f} {3 * np.sin(a):.6f}" for a in angles]
    text = written(
        BODIES=["1 Free 0 0 -2 0 0 0 3000 0|0|-2 2001|2001|2001 0.5 1.0 0.7"],
        RODS=[f"{k} float Body1 {xy} -4 {xy} 4 8 -" for k, xy in enumerate(columns, 1)],
        POINTS=[f"{k} Fixed {60 * np.cos(a)} {60 * np.sin(a)} -60 0 0 0 0" for k, a in enumerate(angles, 1)]
        + [f"{k} Body1 {xy} -4 0 0 0 0" for k, xy in enumerate(columns, 4)],
        LINES=[f"{k} rope {k} {k + 3} 80.5 20 -" for k in (1, 2, 3)],
    )
    scene, _ = read(text)
    rest = dolfbuoy.solve_static(scene)
    pull = rest.end_tension.values[:3, 2].sum()
    bottom = float(rest.buoy_position.values[0, 2]) - 2.0  # C is 2 m above it
    weight = 3000 + 3 * 8 * 310 + pull / 9.81
    assert 1025 * (0.5 - 3 * math.pi / 4 * bottom) == pytest.approx(weight, rel=2e-3)
    assert float(rest.cone_angle[0]) < 1e-3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("7.0 3.0 0.7", "0 3.0 0.7"), "line 14: body 1 has no volume: a hull that displaces 0.0001 of its mass"),
        (
            ("0|0|-0.3", "0.3|0|0.3"),
            "line 14: products of inertia of body1, up to 0.054 of its largest moment, are left out",
        ),
        (("Free 0 0 -14", "Pinned 0 0 -14"), "line 14: body1 is hinged: its points are on a vessel at rest"),
        (("Free 0 0 -14", "1Coupled 0 0 -14"), "line 14: body1 is moved by the program that calls MoorDyn"),
        (("Free 0 0 -14", "Turbine2 0 0 -14"), "line 14: body1 is on turbine2: it is a vessel at rest here"),
    ],
)
def test_what_is_said_of_a_body(change, said):
    assert any(note.startswith(said) for note in read(BODY.replace(*change))[1])


def test_what_no_body_hangs_on_is_refused():
    with pytest.raises(InputError, match="line 14: the attachment 'Glued' of a body is not known"):
        read(BODY.replace("Free 0 0 -14", "Glued 0 0 -14"))


def test_the_first_bodies_of_moordyn():
    """Their number and what they hang on in one word, moments and centre in columns of their own."""
    columns = "BodyID X0 Y0 Z0 r0 p0 y0 Xcg Ycg Zcg M V IX IY IZ CdA Ca"
    text = BODY.replace(TABLES["BODIES"], columns)
    old = "1 Free 0 0 -14 0 0 0 4000 0|0|-0.3 901|902|803 7.0 3.0 0.7"
    assert read(text.replace(old, "1Free 0 0 -14 0 0 0 0 0 -0.3 4000 7.0 901 902 803 3.0 0.7")) == read(BODY)
    held, _ = read(text.replace(old, "1Coupled 0 0 -14 0 0 0 0 0 -0.3 4000 7.0 901 902 803 3.0 0.7"))
    assert [vessel["name"] for vessel in held["vessel"]] == ["body1"]


def test_points_by_numbers_and_on_turbines():
    """-1, 0, 1 as in MoorPy; 0, 1, 2 in the first files, where a 0 stands lowest."""
    names = {"1": "Fixed", "0": "Free", "-1": "Coupled"}
    points = ["1 {Fixed} -20 0 -61 0 0 0 0", "2 {Free} 0 0 -30 900 0.1 0 0", "3 {Coupled} 5 0 -4 0 0 0 0"]
    lines = ["1 rope 1 2 50 20 -", "2 rope 2 3 51 20 -"]
    words = written(POINTS=[point.format(**{w: w for w in names.values()}) for point in points], LINES=lines)
    for known in (names, {"0": "Fixed", "2": "Free", "1": "Coupled"}):
        numbers = {word: number for number, word in known.items()}
        scene, said = read(written(POINTS=[point.format(**numbers) for point in points], LINES=lines))
        assert scene == read(words)[0]
        assert any(f"attachments are numbers: {', '.join(f'{n} is {w.lower()}' for n, w in known.items())}" in note
                   for note in said) or len(said) == 2  # fmt: skip
    assert read(words.replace("3 Coupled", "3 3Coupled"))[0] == read(words)[0]
    scene, said = read(words.replace("3 Coupled", "3 Turbine7"))
    assert scene["vessel"] == [{"name": "turbine7", "position": [0.0] * 3, "fairleads": {"point3": [5.0, 0.0, -4.0]}}]
    assert any("point 3 is on turbine7, a vessel at the origin here" in note for note in said)


@pytest.mark.parametrize("count", ["2 NTypes", "2  nTypes", "2 LineTypes - how many there are", "2 NTypes - number"])
def test_counts_of_rows_are_no_columns(count):
    text = HUNG.replace("--- LINE TYPES ---\n", f"--- LINE TYPES ---\n{count}\n")
    assert read(text)[0] == read(HUNG)[0]


def test_columns_of_the_first_version_by_place():
    """What MoorDyn 2 would do with these names; by name they are what they say."""
    text = HUNG.replace("EI Cd Ca CdAx CaAx", "EI Can Cat Cdn Cdt")
    by_name, said = read(text)
    assert any("so does --columns place" in note for note in said)
    water = ("normal_drag", "added_mass", "tangential_drag", "tangential_added_mass")
    assert [by_name["material"]["rope"][key] for key in water] == [0.1, 1.2, pytest.approx(0.2 * math.pi), 1.01]
    assert read(text, by_place=True)[0] == read(HUNG)[0]


@pytest.mark.parametrize(
    ("row", "rule", "said"),
    [
        ("1 R1A 1 12 0", {"time": 12.0, "at": 20.0}, None),
        ("1 1 1 12 0", {"time": 12.0, "at": 0.0}, None),
        ("1 R1A 1 0 2e5", {"tension": 2e5}, "line 1 parts where its tension is largest, once that is 200000 N"),
        ("1 R1A 1 12 2e5", {"time": 12.0, "at": 20.0}, "line 1 parts at 12 s here, and not at 200000 N"),
        ("1 R1A 1,2 0 2e5", None, "the failure at point R1A is of several lines"),
        ("1 2 1 0 2e5", None, "the failure at point 2 is of a line that does not end there"),
    ],
)
@pytest.mark.parametrize("columns", [TABLES["FAILURE"], "FailureID Node Lines FailTime FailTension"])
def test_failures(row, rule, said, columns):
    scene, notes = read(
        HUNG.replace("--- OPTIONS", f"--- FAILURE ---\n{columns}\n() () (,) (s) (N)\n{row}\n--- OPTIONS")
    )
    assert scene["cable"][0].get("fails_at") == rule
    assert "fails_at" not in scene["cable"][1]
    assert said is None or any(said in note for note in notes)


@pytest.mark.parametrize(
    ("row", "force", "said"),
    [
        ("1 Body1 1.5|2.5|3.5 0|0|0 0|0|0 G", [1.5, 2.5, 3.5], None),
        ("1 Body1 1.5|2.5|3.5 0|0|0 0|0|0 L", None, "the force on Body1 is not carried over"),
        ("1 Body1 0|0|0 1|0|0 0|0|0 G", None, "the damping of Body1 is not carried over"),
        ("1 Point3 1|2|3 0|0|0 0|0|0 -", None, "the force on Point3 is not carried over"),
    ],
)
def test_external_loads(row, force, said):
    """At the body's origin, in the middle of its hull."""
    table = f"--- EXTERNAL LOADS ---\n{TABLES['EXTERNAL LOADS']}\n(#) () (N) () () (-)\n{row}\n--- OPTIONS"
    scene, notes = read(BODY.replace("--- OPTIONS", table))
    load = scene["buoy"][0].get("external_force")
    assert (load and load["force"]) == force
    assert load is None or load["height"] == pytest.approx(scene["buoy"][0]["hull"][1][0] / 2, rel=1e-13)
    assert said is None or any(said in note for note in notes)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("steel 0.3 301", "steel 0.3 0"), "line 14: rod1 moves and has no mass"),
        (("2e6 0", "Syrope:a.txt 0"), "line 5: EA is a Syrope model, which is not read: give a number in its place"),
        (("1 steel Free", "1 iron Free"), "line 14: RodType 'iron' is none of the ROD TYPES: steel, float"),
    ],
)
def test_what_is_refused(change, words):
    with pytest.raises(InputError) as error:
        read(HUNG.replace(*change))
    assert words in str(error.value)


def test_a_vessel_goes_to_moordyn_and_back():
    """Its ends are coupled points, which MoorDyn's caller holds."""
    text = written(POINTS=["1 Fixed -20 0 -61 0 0 0 0", "2 Coupled 5 1 -4 0 0 0 0"], LINES=["1 rope 1 2 70 20 -"])
    scene, _ = read(text)
    out = export(load_scene(scene))
    assert read(out.files["lines.txt"])[0]["vessel"] == scene["vessel"]
    assert [top.position for top in out.driven] == [(5.0, 1.0, -4.0)]
    assert not any("wind" in note.text for note in out.notes)
    (ship,) = scene["vessel"]
    moved = {"motion": [[0.0, *6 * [0.0]], [9.0, *6 * [0.0]]], "wind": {"speed_10m": 9.0, "area": 30.0, "height": 4.0}}
    out = export(load_scene(scene | {"vessel": [ship | moved]}))
    assert "vessel.wind is not carried over: it moves nothing, its force is an output" in [
        note.text for note in out.notes
    ]


def in_moordyn(text, end=120.0):
    """Tensions (line, end) and places of both ends (line, end, 3) in MoorDyn, means over the second half of a run."""
    moordyn = pytest.importorskip("moordyn")
    found = []
    with tempfile.TemporaryDirectory() as folder, silent():
        path = Path(folder) / "lines.txt"
        path.write_text(text)
        system = moordyn.Create(str(path))
        try:
            moordyn.SetVerbosity(system, moordyn.LEVEL_NONE)
            moordyn.Init(system, [], [])
            for k in range(int(end / 0.5)):
                moordyn.Step(system, [], [], 0.5 * k, 0.5)
                rows = []
                for i in range(moordyn.GetNumberLines(system)):
                    line = moordyn.GetLine(system, i + 1)
                    for node in (0, moordyn.GetLineN(line)):
                        size = np.linalg.norm(moordyn.GetLineNodeTen(line, node))
                        rows.append([size, *moordyn.GetLineNodePos(line, node)])
                found.append(rows)
        finally:
            moordyn.Close(system)
    means = np.array(found[len(found) // 2 :]).mean(axis=0).reshape(-1, 2, 4)
    return means[..., 0], means[..., 1:]


#: A float of four columns and two braces; and rods side by side deep in the water.
COLUMNS = written(
    BODIES=["1 Free 0 0 -2 0 0 0 4500 0|0|-3 20001|20002|30003 0.5 1.0 0.7"],
    RODS=[
        f"{k} float Body1 {x} {y} -4 {x} {y} 6 10 -" for k, (x, y) in enumerate([(4, 4), (-4, 4), (-4, -4), (4, -4)], 1)
    ]
    + ["5 steel Body1 -4 -4 -4 4 4 -4 8 -", "6 steel Body1 4 -4 -4 -4 4 -4 8 -"],
    POINTS=["1 Fixed -70 0 -60 0 0 0 0", "2 Fixed 35 60 -60 0 0 0 0", "3 Fixed 35 -60 -60 0 0 0 0"]
    + ["4 Body1 -4 4 -4 0 0 0 0", "5 Body1 4 4 -4 0 0 0 0", "6 Body1 4 -4 -4 0 0 0 0"],
    LINES=["1 rope 1 4 90 20 -", "2 rope 2 5 92 22 -", "3 rope 3 6 91 20 -"],
)
SUNK = written(
    BODIES=["1 Free 0 0 -14 0 0 0 2500 0.1|0|-0.3 901|902|803 1.5 2.0 0.7"],
    RODS=["1 float Body1 2 0 -3 2 0 3 6 -", "2 float Body1 -2 0.5 -3 -2 0.5 2.5 6 -"]
    + ["3 steel Body1 -2 0.5 -3 2 0 -3 6 -"],
    POINTS=["1 Fixed -30 0 -60 0 0 0 0", "2 Fixed 20 25 -61 0 0 0 0", "3 Fixed 20 -25 -60 0 0 0 0"]
    + ["4 Body1 -2 0.5 -3.1 0 0 0 0", "5 Body1 2 0 -3.1 0 0 0 0"],
    LINES=["1 rope 1 4 53 20 -", "2 rope 2 5 55 22 -", "3 rope 3 5 54 20 -"],
)


@pytest.mark.slow
def test_free_decay_of_columns_beside_moordyn():
    """From 0.9 m too high: six motions over 40 s.  In MoorDyn the drag of end faces is at the ends, and here along the
    rods: heave within 3 % of its range, surge and sway 2 %, yaw 1 %; roll and pitch, some 0.02 rad, within 0.005."""
    moordyn = pytest.importorskip("moordyn")
    scene, _ = read(COLUMNS)
    scene["buoy"][0]["initial"] = {"buoy_position": [0.0, 0.0, -5.0], "buoy_orientation": [1.0, 0.0, 0.0, 0.0]}
    run = dolfbuoy.simulate(scene | {"time": {"end": 40.0, "step": 0.05, "scheme": "bdf2"}})
    q0, *q = run.buoy_orientation.values.reshape(-1, 4).T
    turn = Rotation.from_quat(np.transpose([*q, q0]))
    ours = np.hstack([run.buoy_position.values.reshape(-1, 3), turn.as_euler("XYZ")])[10::10]
    rows = []
    with tempfile.TemporaryDirectory() as folder, silent():
        path = Path(folder) / "lines.txt"
        path.write_text(COLUMNS.replace("2e6 0 0", "2e6 -1 0"))
        system = moordyn.Create(str(path))
        try:
            moordyn.SetVerbosity(system, moordyn.LEVEL_NONE)
            moordyn.Init(system, [], [])
            for k in range(80):
                moordyn.Step(system, [], [], 0.5 * k, 0.5)
                rows.append(moordyn.GetBodyState(moordyn.GetBody(system, 1))[0])
        finally:
            moordyn.Close(system)
    theirs = np.array(rows)
    theirs[:, :3] += Rotation.from_euler("XYZ", theirs[:, 3:]).apply([0.0, 0.0, -3.0])  # of the centre of mass
    difference, span = np.abs(ours - theirs).max(axis=0), np.ptp(theirs, axis=0)
    assert (span > [1, 0.5, 1, 0.02, 0.02, 0.3]).all()
    assert (difference < [0.02, 0.02, 0.03, 0.3, 0.15, 0.01] * span).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", [HUNG, BARREL, HINGED, BODY, SUNK], ids=["hung", "barrel", "hinged", "body", "side by side"]
)
def test_rest_of_rods_and_bodies_beside_moordyn(text):
    """Tensions in the middles of lines, where half a segment's weight counts at neither end: their sum within 0.1 %,
    each within 0.6 %, as some still swing in MoorDyn."""
    scene, _ = read(text)
    rest = dolfbuoy.solve_static(scene)
    count = sum(cable["name"].startswith("line") for cable in scene["cable"])
    ours = [np.linalg.norm(rest[name].values[:count], axis=-1) for name in ("anchor_force", "end_tension")]
    tension, _ = in_moordyn(text.replace("2e6 0 0", "2e6 -1 0"))
    middle = np.mean(ours, axis=0)
    assert middle == pytest.approx(tension.mean(axis=1), rel=6e-3)
    assert middle.sum() == pytest.approx(tension.mean(axis=1).sum(), rel=1e-3)
