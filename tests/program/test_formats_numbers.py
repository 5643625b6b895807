"""Every number of MoorDyn, MoorPy and RAFT files is converted to the scene, in its unit, and back.

Source: MoorDyn's manual, "Input Files", versions 1 and 2, and MoorPy's `System.parseYAML` for the meaning of columns
and keys; sums by hand. No two numbers of a file are equal, so that swapped numbers are detected.
"""

import math

import pytest

from dolfbuoy.formats import from_moordyn, from_yaml
from dolfbuoy.scene import load_scene

LINES = """a made up mooring
--- MoorDyn input with LINES of two types ---
--- LINE TYPES ---
TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
chain 0.11 101.0 5.1e8 310.0 0 1.21 0.91 0.31 0.24
rope 0.07 3.5 2.2e7 0 0 1.62 0.82 0.013 0
--- POINTS ---
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Fixed -301 12 -100.5 0 0 0 0
2 Coupled 3 4 -5 0 0 0 0
3 Free -100 7 -60 501 0.13 1.4 0.53
--- LINES ---
ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs
(#) (-) (#) (#) (m) (-) (-)
1 chain 1 3 221 41 p
2 rope 3 2 123 33 p,t ! 5 knots
--- OPTIONS ---
0.001 dtM
9.79 g
1013 WtrDnsty
102.5 WtrDpth
2.1e6 kBot
0.43 FrictionCoefficient
--- OUTPUTS ---
FairTen1
--- need this line ---
"""
CHAIN = {"line_density": 101.0, "diameter": 0.11, "axial_stiffness": 5.1e8, "normal_drag": 1.21, "added_mass": 0.91}
CHAIN |= {"tangential_drag": math.pi * 0.31, "tangential_added_mass": 0.24, "damping": 310.0}
ROPE = {"line_density": 3.5, "diameter": 0.07, "axial_stiffness": 2.2e7, "normal_drag": 1.62, "added_mass": 0.82}
ROPE |= {"tangential_drag": math.pi * 0.013}
#: What is said of a file of which everything is carried over, but for the point that MoorDyn's caller moves.
MOVED = (
    "line 12: point 2 is moved by the program that calls MoorDyn: it is on a vessel here, at rest until it has a motion"
)
PROPOSAL = "the file says nothing about the length of a run: time.end and time.step are a proposal"


def read(text):
    """The scene, and what is said."""
    scene, notes = from_moordyn.scene_of(text)
    load_scene(scene)
    return scene, [str(note) for note in notes]


def without(line):
    """The file above without the line that ends with it."""
    return "".join(own for own in LINES.splitlines(keepends=True) if not own.rstrip().endswith(line))


def test_lines_points_and_options():
    scene, said = read(LINES)
    both = {"slack": "tension-only"}
    assert scene == {
        "gravity": 9.79,
        "sea": {"depth": 102.5, "density": 1013.0},
        "seabed": {"stiffness": 2.1e6, "friction": 0.43},
        "material": {"chain": CHAIN, "rope": ROPE},
        "cable": [
            {"name": "line1", "material": "chain", "from": [-301.0, 12.0, -100.5], "to": "point3", "length": 221.0}
            | both
            | {"elements": 41},
            {"name": "line2", "material": "rope", "from": "point3", "to": "vessel.point2", "length": 123.0}
            | both
            | {"elements": 33},
        ],
        "joint": [{"name": "point3", "mass": 501.0, "volume": 0.13, "drag_area": 1.4, "added_mass": 0.53}],
        "vessel": [{"name": "vessel", "position": [0.0, 0.0, 0.0], "fairleads": {"point2": [3.0, 4.0, -5.0]}}],
        "time": {"end": 60.0, "step": 0.05, "scheme": "bdf2"},
    }
    assert said == [PROPOSAL, MOVED]  # also the title is none of the sections


@pytest.mark.parametrize(
    ("change", "section", "expected"),
    [
        (("9.79 g", "0 g"), "gravity", 0.0),
        (("9.79 g", "1.62 gravity"), "gravity", 1.62),
        (("1013 WtrDnsty", "998 rhoW"), "sea", {"depth": 102.5, "density": 998.0}),
        (("1013 WtrDnsty", "999 rho"), "sea", {"depth": 102.5, "density": 999.0}),
        (("1013 WtrDnsty", "DEFAULT WtrDnsty"), "sea", {"depth": 102.5}),
        (("1013 WtrDnsty", "0 WtrDnsty"), "sea", None),
        (("1013 WtrDnsty", "0 WtrDnsty"), "seabed", None),
        (("9.79 g", "0 g"), "seabed", None),
        (("102.5 WtrDpth", "140 depth"), "sea", {"depth": 140.0, "density": 1013.0}),
        (("102.5 WtrDpth", "141 WtrDepth"), "sea", {"depth": 141.0, "density": 1013.0}),
        (("102.5 WtrDpth", "bathymetry.txt WtrDpth"), "sea", {"depth": 100.5, "density": 1013.0}),
        (("102.5 WtrDpth", "0.01 dtOut"), "sea", {"depth": 100.5, "density": 1013.0}),
        (("2.1e6 kBot", "3e5 cBot"), "seabed", {"stiffness": 3e6, "friction": 0.43}),  # kBot's default
        (("2.1e6 kBot", "2.2e6 kb"), "seabed", {"stiffness": 2.2e6, "friction": 0.43}),
        (("2.1e6 kBot", "0 kBot"), "seabed", None),
        (("0.43 FrictionCoefficient", "0.2 mu_kA"), "seabed", {"stiffness": 2.1e6, "friction": 0.2}),
        (("0.43 FrictionCoefficient", "0.3 MU_KT\n0.1 MU_KA"), "seabed", {"stiffness": 2.1e6, "friction": 0.1}),
        (("0.43 FrictionCoefficient", "0 FrictionCoefficient"), "seabed", {"stiffness": 2.1e6}),
    ],
)
def test_options_are_what_the_file_says(change, section, expected):
    scene, _ = read(LINES.replace(*change))
    assert scene.get(section) == expected


def test_the_depth_of_a_small_tank():
    text = LINES.replace("102.5 WtrDpth\n", "").replace("12 -100.5", "12 -0.6").replace("4 -5", "4 -0.1")
    assert read(text.replace("7 -60", "7 -0.3"))[0]["sea"]["depth"] == 0.6


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("0 g", "0 g"), []),
        (("1013 WtrDnsty", "0 WtrDnsty"), ["line 22: the density of the water is 0"]),
        (("9.79 g", "0 g"), ["line 21: gravity is 0: there is no bed"]),
        (("2.1e6 kBot", "0 kBot"), ["line 25: there is no bed (kBot = 0), and no friction on it"]),
        (("102.5 WtrDpth", "0.01 dtOut"), ["no single depth is given: the deepest point, which is fixed"]),
        (("102.5 WtrDpth", "sea.txt WtrDpth"), ["line 23: no single depth is given"]),
        (("0.43 FrictionCoefficient", "0.3 MU_KT"), ["line 25: friction differs across lines (MU_KT = 0.3) and along"]),
        (("0.001 dtM", "3 WaveKin"), ["line 20: WaveKin = 3: there is no file wave_elevation.txt"]),
        (("0.001 dtM", "0 WaveKin"), []),
        (("0.001 dtM", "1 Currents"), ["line 20: Currents = 1: there is no file current_profile.txt"]),
        (("0.001 dtM", '"sea.dat" WaterKin'), ["line 20: WaterKin: there is no file sea.dat"]),
        (("0.001 dtM", "3e5 cBot"), ["line 20: cBot = 3e5: damping of the bed"]),
        (("0.001 dtM", "200 FricDamp"), ["line 20: the option fricdamp = 200 is not carried over"]),
        (("0.001 dtM", "0.9 MC"), ["line 20: the option mc = 0.9 is not carried over"]),
        (("0.001 dtM", "100.0 TmaxIC"), []),
        (("310.0 0 1.21", "-0.8 0 1.21"), ["line 6: BA = -0.8 is a share of critical damping"]),
        (("310.0 0 1.21", "damping.txt 0 1.21"), ["line 6: BA = damping.txt is no single number"]),
        (("310.0 0 1.21", "310.0 2e4 1.21"), ["line 6: EI = 2e4 N m^2: such lines carry compression"]),
        (("310.0 0 1.21", "310.0 1|2 1.21"), ["line 6: EI = 1|2 is no single number"]),
        (("--- OUTPUTS ---", "--- SYROPE IC ---"), ["line 26: the section 'SYROPE IC' is not known"]),
        (
            ("--- OPTIONS ---", "--- FAILURE ---\nID Point Lines FailTime FailTen\n() () (,) (s) (N)\n1 3 1,2 0 2e5\n"
             "--- OPTIONS ---"),
            ["line 22: the failure at point 3 is of several lines"],
        ),
        (
            ("2 Coupled", "9 Fixed 1 2 -3 0 0 0 0\n8 Free 1 2 -3 0 0 0 0\n2 Coupled"),
            ["line 13: point 8 holds no line and was left out"],
        ),
    ],
)  # fmt: skip
def test_what_is_left_out_is_said_once_with_its_line(change, said):
    _, notes = read(LINES.replace(*change))
    new = [note for note in notes if note != PROPOSAL and "is moved by the program" not in note]
    assert len(new) == len(said)
    for note, words in zip(new, said, strict=True):
        assert note.startswith(words)


def test_a_column_that_is_not_known_is_said_once_by_its_name():
    """Lift: both types have it, 0 of one says nothing."""
    text = LINES.replace("CdAx CaAx", "CdAx CaAx Cl dF").replace(
        "(-) (-) (-) (-)\nchain", "(-) (-) (-) (-) (-) (-)\nchain"
    )
    text = text.replace("0.31 0.24\n", "0.31 0.24 0.7 0\n").replace("0.013 0\n", "0.013 0 0.8 0 # no remark\n")
    scene, said = read(text)
    assert scene == read(LINES)[0]
    assert [note for note in said if note not in (PROPOSAL, MOVED)] == [
        "line 4: the column Cl of LINE TYPES is not carried over: 0.7, 0.8"
    ]


def test_a_column_that_is_missing_counts_as_nothing_and_is_said():
    text = LINES.replace("UnstrLen NumSegs", "UnstrLen").replace("221 41", "221").replace("123 33", "123")
    scene, said = read(text.replace("CdAx CaAx", "along CaAx"))
    assert [cable["elements"] for cable in scene["cable"]] == [20, 20]
    assert scene["material"]["chain"]["tangential_drag"] == 0.0
    assert "line 15: LINES has no column segments: 20 is taken" in said
    assert "line 4: LINE TYPES has no column CdAx: 0 is taken" in said
    assert "line 4: the column along of LINE TYPES is not carried over: 0.013, 0.31" in said


@pytest.mark.parametrize(
    ("EA", "BA"), [("1.4e8|1.6e8", "4E9|11e6"), ("1.4e8|1.6e8", "-0.8|11e6"), ("1.4e8|4.0e8|8.9e6", "4E9|11e6")]
)
def test_a_viscoelastic_line_is_its_static_stiffness_without_damping(EA, BA):
    """Two springs in series: 4e9 N s belongs to the slow one alone, and would hold the whole line fast."""
    scene, said = read(LINES.replace("5.1e8 310.0", f"{EA} {BA}"))
    chain = scene["material"]["chain"]
    assert (chain["axial_stiffness"], "damping" in chain) == (1.4e8, False)
    (note,) = [note for note in said if note.startswith("line 6")]
    assert f"EA = {EA} with BA = {BA} is viscoelastic" in note


@pytest.mark.parametrize(
    ("column", "unit", "damping"),
    [
        ("cIntDamp", "(Pa-s)", 1e8 * math.pi * 0.11**2 / 4),  # MoorDyn 1: a stress over a rate of strain
        ("cIntDamp", "(N-s)", 1e8),
        ("BA/-zeta", "(Pa-s/-)", 1e8),
        ("BA", "(N-s)", 1e8),
    ],
)
def test_damping_in_pascal_seconds(column, unit, damping):
    text = LINES.replace("BA/-zeta", column).replace("(N-s/-)", unit).replace("310.0", "1e8")
    scene, said = read(text)
    assert scene["material"]["chain"]["damping"] == pytest.approx(damping, rel=1e-14)
    assert any("cIntDamp = 1e8 Pa s" in note for note in said) == (damping < 1e8)


FIRST = """--------------------- MoorDyn Input File of two LINES ---------------------
FALSE Echo - echo the input file data (flag)
--- LINE DICTIONARY ---
1 NTypes - number of line types
LineType Diam MassDenInAir EA BA/-zeta Can Cat Cdn Cdt
(-) (m) (kg/m) (N) (Pa-s/-) (-) (-) (-) (-)
1 0.11 101.0 5.1e8 310.0 0.91 0 1.21 0.31
--- NODE PROPERTIES ---
Node Type X Y Z M V FX FY FZ CdA CA
(-) (-) (m) (m) (m) (kg) (m^3) (kN) (kN) (kN) (m^2) (-)
1 Fix -301 12 -100.5 0 0 0 0 0 0 0
2 Vessel 3 4 -5 0 0 0 0 0 0 0
3 Connect -100 7 -60 501 0.13 0 1 0 1.4 0.53
--- LINE PROPERTIES ---
Line LineType UnstrLen NumNodes NodeAnch NodeFair Flags/Outputs
[-] [-] [m] [-] [-] [-] [-]
1 1 221 41 1 3 -
2 1 -1.25 33 3 2 -
--- SOLVER OPTIONS ---
0.002 DT - time step
102.5 WtrDpth - water depth
--- need this line ---
"""


def test_a_file_of_the_first_version():
    """Its columns, names, counts of rows, brackets; a negative length is a multiple of the distance of the ends."""
    scene, said = read(FIRST)
    whole, _ = read(LINES)
    assert scene["material"] == {"type1": {key: CHAIN[key] for key in CHAIN if key != "tangential_added_mass"}}
    assert (scene["joint"], scene["vessel"]) == (whole["joint"], whole["vessel"])
    first, second = scene["cable"]
    assert first == whole["cable"][0] | {"material": "type1"}
    assert second["length"] == pytest.approx(1.25 * math.sqrt(103**2 + 3**2 + 55**2), rel=1e-14)
    assert second["elements"] == 33
    assert scene["seabed"] == {"stiffness": 3e6}
    assert "gravity" not in scene
    assert [note.split(":")[0] for note in said] == ["line types", PROPOSAL.split(":")[0]] + [
        f"line {n}" for n in (5, 12, 13, 18)
    ]
    assert "line types: type '1' is called type1 here" in said
    assert "line 13: the constant force on point 3 is not carried over" in said


def test_ends_by_other_names_and_odd_ends_of_lines():
    for names in ("EndA EndB", "NodeA NodeB", "AttachAnch NodeFair"):
        assert read(LINES.replace("AttachA AttachB", names)) == read(LINES)
    assert read(LINES.replace("(-) (m) (kg/m) (N) (N-s/-)", "- m kg/m N N-s/-")) == read(LINES)
    for end in ("\r\n", "\r"):
        assert read("\ufeff" + LINES.replace("\n", end)) == read(LINES)


BODY = LINES.replace(
    "--- POINTS ---",
    """--- ROD TYPES ---
TypeName Diam Mass/m Cd Ca CdEnd CaEnd
(-) (m) (kg/m) (-) (-) (-) (-)
wide 2 100 0.61 0.93 1.14 0.85
slim 1 50 0.61 0.93 1.14 0.85
--- BODIES ---
ID Attachment X0 Y0 Z0 r0 p0 y0 Mass CG* I* Volume CdA* Ca*
(#) (-) (m) (m) (m) (deg) (deg) (deg) (kg) (m) (kg-m^2) (m^3) (m^2) (-)
1 {kind} 10 20 -3 {angles} 1000 {CG} 10|20|30 0 0 0
--- RODS ---
ID RodType Attachment Xa Ya Za Xb Yb Zb NumSegs RodOutputs
(#) (-) (-) (m) (m) (m) (m) (m) (m) (-) (-)
1 slim Body1 0 0 2 0 0 0 4 -
2 wide Body1 0 0 -1 0 0 0 4 -
--- POINTS ---""",
).replace("2 Coupled 3 4 -5", "2 Body1 0.4 0.3 -0.5")
FREE = {"kind": "Free", "angles": "0 0 0", "CG": "0|0|0.5"}


@pytest.mark.parametrize("CG", ["0|0|0.5", "0.5"])
def test_a_free_body_with_upright_rods(CG):
    """Centre and moments by the parallel-axis theorem; heights from the keel, the lowest end of its rods.

    Masses 1000, 2 x 50, 1 x 100 kg at 1.5, 2, 0.5 m: C at 1750/1200 m. Across x: 10 of its own, 100 (4/12 + 1/16) and
    100 (1/12 + 4/16) of the rods, 1000, 100, 100 kg at 1/24, 13/24, -23/24 m from C; about z 30 + 100/8 + 400/8.
    """
    scene, said = read(BODY.format(**FREE | {"CG": CG}))
    (body,) = scene["buoy"]
    inertia, center = body.pop("inertia"), body.pop("center_of_mass")
    assert center == pytest.approx(1750 / 1200, rel=1e-14)
    assert inertia == pytest.approx([205 + 5 / 6, 215 + 5 / 6, 92.5], rel=1e-12)
    assert body == {
        "name": "body1",
        "hull": [[0.0, 2.0], [1.0, 2.0], [1.0, 1.0], [3.0, 1.0]],
        "mass": 1200.0,
        "normal_drag": 0.61,
        "added_mass": 0.93,
        "axial_drag": 1.14,
        "axial_added_mass": 0.85,
        "fairleads": {"point2": [0.4, 0.3, 0.5]},
    }
    assert scene["cable"][1]["to"] == "body1.point2"
    assert said == [PROPOSAL]


@pytest.mark.parametrize(
    ("angles", "place"),
    [
        ("0 0 0", [10.4, 20.3, -3.5]),
        ("90 0 0", [10.4, 20.5, -2.7]),  # y to z, z to -y
        ("0 90 0", [9.5, 20.3, -3.4]),  # z to x, x to -z
        ("0 0 90", [9.7, 20.4, -3.5]),  # x to y, y to -x
        ("90 0 90", [9.7, 20.5, -2.6]),  # first about z, then about x
        ("90 90 0", [9.5, 20.4, -2.7]),  # first about y, then about x
    ],
)
def test_points_on_a_body_that_is_held(angles, place):
    """R = R_x(r0) R_y(p0) R_z(y0), in degrees, about the body's origin: on the ground, or on a vessel there."""
    scene, said = read(BODY.format(kind="Coupled", angles=angles, CG=0))
    end = load_scene(scene).network.pieces[1].ends[1]
    assert end.name == "body1.point2"
    assert end.position == pytest.approx(place, abs=1e-12)
    assert any("body1 is moved by the program that calls MoorDyn: it is a vessel at rest" in note for note in said)
    fixed, _ = read(BODY.format(kind="Fixed", angles=angles, CG=0))
    assert fixed["cable"][1]["to"] == pytest.approx(place, abs=1e-12)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("10|20|30 0 0 0", "10|20|30 1.5 0 0"), "line 16: body1 has a volume besides that of its rods: its"),
        (("10|20|30 0 0 0", "10|20|30 0 1|2 0"), "line 16: the body has drag besides its rods', 1|2"),
        (("10|20|30 0 0 0", "10|20|30 0 0 0.5"), "line 16: the added mass of the body besides its rods'"),
        (("10|20|30 0 0 0", "0 0 0 0"), None),
        (("slim 1 50 0.61", "slim 1 50 0.7"), "line 20: rods differ in Cd"),
        (("Free 10 20 -3 0 0 0", "Free 10 20 -3 0 5 0"), "line 16: how the body is turned at the start"),
        (
            ("2 wide Body1 0 0 -1 0 0 0", "2 wide Body1 0 0 -1 0 0 -1"),
            "line 16: body1 has a rod without length: its rods are bars",
        ),
        (
            ("2 wide Body1 0 0 -1 0 0 0", "2 wide Body1 1 0 -1 1 0 0"),
            "line 16: body1 has rods that do not stand on one axis: its rods are",
        ),
        (
            ("2 wide Body1 0 0 -1 0 0 0", "2 wide Body1 0 0 -2 0 0 -1"),
            "line 16: body1 has rods with gaps between them: its rods are bars",
        ),
        (("0|0|0.5", "1|0|0.5"), "line 16: body1 has its centre of mass off the axis of its rods: its rods are"),
        (("2 wide Body1 0 0 -1 0 0 0", "2 wide Free 0 0 -1 0 0 0"), "line 21: rod2 holds no line and was left out"),
        (("2 Body1 0.4 0.3 -0.5 0", "2 Body1 0.4 0.3 -0.5 40"), "line 26: mass of point 2 on body 1"),
    ],
)
def test_what_a_buoy_has_no_place_for(change, said):
    _, notes = read(BODY.format(**FREE).replace(*change))
    own = [note for note in notes if note != PROPOSAL]
    assert (said is None and own == []) or any(note.startswith(said) for note in own)


MOORING = """name: a design
site: {water_depth: 310, rho_water: 1011, g: 9.79}
mooring:
  water_depth: 202
  points:
    - {name: foot 1, type: fixed, location: [-250, 11, -200.5]}
    - {name: ship, type: vessel, location: [1, 2, -15]}
    - {name: clump, type: connection, location: [-90, 5, -150], mass: 301, volume: 0.14}
  lines:
    - {name: 1, endA: foot 1, endB: clump, type: R4 chain, length: 251}
    - {name: upper, endA: clump, endB: ship, type: wire, length: 181.5}
  line_types:
    - {name: R4 chain, diameter: 0.12, mass_density: 103, stiffness: 5.1e8, breaking_load: 9.1e6, cost: 5,
       transverse_drag: 1.22, tangential_drag: 0.32, transverse_added_mass: 0.92, tangential_added_mass: 0.21}
    - {name: wire, diameter: 0.08, mass_density: 4.5, stiffness: 2.1e7, breaking_load: 0}
"""


def read_yaml(text):
    """The scene, and what is said."""
    pytest.importorskip("yaml")
    scene, notes = from_yaml.scene_of(text)
    load_scene(scene)
    return scene, [str(note) for note in notes]


def test_keys_of_yaml():
    scene, said = read_yaml(MOORING)
    assert scene.pop("material") == {
        "R4_chain": {
            "line_density": 103.0,
            "diameter": 0.12,
            "axial_stiffness": 5.1e8,
            "normal_drag": 1.22,
            "added_mass": 0.92,
            "tangential_drag": math.pi * 0.32,
            "tangential_added_mass": 0.21,
            "breaking_load": 9.1e6,
        },
        "wire": {"line_density": 4.5, "diameter": 0.08, "axial_stiffness": 2.1e7},
    }
    both = {"elements": 20, "slack": "tension-only"}
    assert scene == {
        "gravity": 9.79,
        "sea": {"depth": 202.0, "density": 1011.0},
        "seabed": {},
        "cable": [
            {"name": "part1", "material": "R4_chain", "from": [-250.0, 11.0, -200.5], "to": "clump", "length": 251.0}
            | both,
            {"name": "upper", "material": "wire", "from": "clump", "to": "vessel.ship", "length": 181.5} | both,
        ],
        "joint": [{"name": "clump", "mass": 301.0, "volume": 0.14}],
        "vessel": [{"name": "vessel", "position": [0.0, 0.0, 0.0], "fairleads": {"ship": [1.0, 2.0, -15.0]}}],
        "time": {"end": 60.0, "step": 0.05, "scheme": "bdf2"},
    }
    assert sorted(said) == sorted(
        [
            PROPOSAL,
            "line_types: type 'R4 chain' is called R4_chain here",
            "points and lines: part '1' is called part1 here",
            "vessels rest until they have a motion, or raos",
        ]
    )


@pytest.mark.parametrize(
    ("change", "section", "expected"),
    [
        (("rho_water: 1011, g: 9.79", "g: 0"), "gravity", 0.0),
        (("rho_water: 1011, g: 9.79", "g: 0"), "seabed", None),
        (("water_depth: 202", "rho: 1017"), "sea", {"depth": 310.0, "density": 1017.0}),
        (("water_depth: 202", "water_density: 1018"), "sea", {"depth": 310.0, "density": 1018.0}),
        (("rho_water: 1011", "rho_water: 0"), "sea", None),
        (("rho_water: 1011", "rho_water: 0"), "seabed", None),
        (("site: {water_depth: 310, rho_water: 1011, g: 9.79}", ""), "sea", {"depth": 202.0}),
    ],
)
def test_the_water_of_a_design(change, section, expected):
    """RAFT's site gives what its mooring does not."""
    assert read_yaml(MOORING.replace(*change))[0].get(section) == expected


def test_without_a_depth_the_deepest_anchor_sets_it():
    text = MOORING.replace("water_depth: 310, ", "").replace("water_depth: 202", "rho: 1017")
    scene, said = read_yaml(text)
    assert scene["sea"]["depth"] == 200.5
    assert "there is no water_depth: the deepest fixed point sets it, 200.5 m" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("site:", "settings: {nIter: 4}\nturbine: {}\nsite:"),
            "of this design only mooring is carried over, and not settings, turbine",
        ),
        (
            ("g: 9.79", "g: 9.79, rho_air: 1.2"),
            "of site only water_depth, rho_water, g are carried over, and not rho_air",
        ),
        (("water_depth: 202", "water_depth: 202\n  anchor_types: []"), "anchor_types is not carried over"),
        (("-200.5]", "-200.5], anchor_type: drag"), "points: anchor_type is not carried over"),
        (("length: 251", "length: 251, nSegs: 7"), "lines: nSegs is not carried over"),
    ],
)
def test_keys_that_are_left_out_are_said_once(change, said):
    _, before = read_yaml(MOORING)
    _, after = read_yaml(MOORING.replace(*change))
    assert [note for note in after if note not in before] == [said]


def test_a_line_type_that_bends():
    """EI is carried over, with compression; of MoorPy's own files 0 stands for none."""
    bent, said = read_yaml(MOORING.replace("breaking_load: 0}", "EI: 1.2e4}"))
    assert bent["material"]["wire"]["bending_stiffness"] == 1.2e4
    assert "bending_stiffness" not in bent["material"]["R4_chain"]
    assert ["slack" in cable for cable in bent["cable"]] == [True, False]
    assert "line_types, wire: with EI lines carry compression, and their ends are pinned" in said
    assert read_yaml(MOORING.replace("breaking_load: 0}", "EI: 0}")) == read_yaml(MOORING)


def test_moorpys_and_rafts_files_are_read_alike(tmp_path):
    """By name, with the title of the file."""
    pytest.importorskip("yaml")
    from dolfbuoy.formats.files import read as read_file

    path = tmp_path / "harbour.yaml"
    path.write_text(MOORING)
    expected = {"title": "harbour"} | read_yaml(MOORING)[0]
    assert read_file("raft", path)[0] == read_file("moorpy", path)[0] == expected
