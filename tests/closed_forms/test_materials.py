"""Library materials: chain, wire and rope by catalogue name, and materials from a user's file.

Source: breaking loads of IACS UR W22 and W18 as they are printed: R3 to R4 by a manufacturer after DNV-OS-E302, R4S by
Vicinay (137 mm; a course book of Delft prints load and mass of that bar), R5 by the formula of DNVGL-OS-E302 alone, the
grades of ships by a chandler after ABS, in inches and pounds; the material library of MoorPy; Parafil PF1; Dewey 1999.
"""

import math

import pytest
import tomli_w
from alone import solve_static
from every_key import shows

from dolfbuoy import load_scene
from dolfbuoy.check import check
from dolfbuoy.errors import InputError
from dolfbuoy.scene import varied
from dolfbuoy.scene.floats import DENSITY, FLOATS, with_float
from dolfbuoy.scene.inputs import inputs_of
from dolfbuoy.scene.library import material

#: Grade, bar [mm], breaking load [kN] as printed, rounded up or to the nearest.
PRINTED = [
    ("R3", 34, 1065), ("R3", 50, 2230), ("R3", 70, 4196), ("R3S", 34, 1189), ("R3S", 60, 3514), ("R4", 34, 1308),
    ("R4", 50, 2740), ("R4", 68, 4886), ("R4S", 137, 18852), ("R5", 50, 3200), ("Q1", 34, 468), ("Q2", 34, 655),
    ("Q3", 34, 937),
]  # fmt: skip
#: Bar [inch], breaking loads of Q1, Q2, Q3 [lb], rounded to as much as 500 lb.
IN_POUNDS = [
    (0.75, 34000, 47600, 68000), (1.0, 59700, 83600, 119500), (1.25, 92200, 129000, 184000),
    (1.5, 131000, 183500, 262000), (1.75, 176000, 247000, 352000), (1.875, 201000, 281000, 402000),
]  # fmt: skip

OWN = """
["my rubber cord, 30 mm"]
line_density = 0.9
diameter = 0.03
axial_stiffness = [[0.0, 0.0], [0.5, 400.0], [1.0, 1500.0]]
breaking_load = 3000.0

["wire 20 mm"]
line_density = 5.0
diameter = 0.02
axial_stiffness = 1e7
"""


def scene(*names, **more):
    segments = [{"length": 20.0, "elements": 8, "material": name} for name in names]
    top = {"kind": "fixed", "position": [16.0 * len(names), 0.0, -1.0]}
    return {"sea": {"depth": 15.0}, "cable": {"segments": segments, "top": top}, **more}


@pytest.mark.parametrize(("grade", "size", "breaking"), PRINTED)
def test_chains_break_as_printed(grade, size, breaking):
    """Stud or not: the grade decides."""
    for link in ("studless", "studlink"):
        assert material(f"chain {grade} {link} {size} mm")["breaking_load"] == pytest.approx(1e3 * breaking, rel=1.5e-3)


@pytest.mark.parametrize(("inches", "loads"), [(row[0], row[1:]) for row in IN_POUNDS])
def test_chains_of_ships_break_as_printed_in_pounds(inches, loads):
    for grade, pounds in zip(("Q1", "Q2", "Q3"), loads, strict=True):
        name = f"chain {grade} studlink {25.4 * inches:g} mm"
        assert material(name)["breaking_load"] / 4.4482216 == pytest.approx(pounds, abs=500)


def test_chain():
    """A chain of steel as long as its two bars and bends; corrosion takes strength only."""
    for link, steel in (("studless", 7850), ("studlink", 7850)):
        new, old = (material(f"chain R3 {link} {text}") for text in ("76 mm", "76 mm less 6 mm"))
        assert new["line_density"] / new["area"] == pytest.approx(steel, rel=0.01)
        assert old["breaking_load"] == material(f"chain R3 {link} 70 mm")["breaking_load"]
        assert {**old, **{key: new[key] for key in ("breaking_load", "steel_area", "catalogue")}} == new
        assert old["steel_area"] == pytest.approx(2 * math.pi / 4 * 0.070**2, rel=1e-12)
        assert new["diameter"] == 0.076
        E = new["axial_stiffness"] / (2 * math.pi / 4 * 0.076**2)
        assert 5.3e10 < E < 6.5e10  # DNV-OS-E301: 5.4e10 to 5.6e10 less what the diameter takes, 6.4e10 with studs


@pytest.mark.parametrize(
    ("name", "across", "along", "added"),
    [
        ("chain R4 studless 84 mm", 2.4, 1.15, 1.0),
        ("chain R4 studlink 84 mm", 2.6, 1.4, 1.0),
        ("wire 90 mm", 1.2, 0.0, 1.0),
        ("wire IWRC 90 mm", 1.8, 0.0, 1.0),
        ("polyester 160 mm", 1.6, 0.0, 1.1),
    ],
)
def test_drag_is_that_of_dnv(name, across, along, added):
    """DNV-OS-E301, Ch. 2 Sec. 1, on the nominal diameter; added mass of ropes of Bureau Veritas NR 493."""
    found = material(name)
    assert (found["normal_drag"], found.get("tangential_drag", 0.0), found["added_mass"]) == (across, along, added)


@pytest.mark.parametrize("size", [12.0, 24.5, 80.0])
@pytest.mark.parametrize("kind", ["wire", "polyester", "nylon", "HMPE"])
def test_ropes_are_those_of_moorpy(kind, size):
    """Mass, volume, stiffness and breaking load."""
    helpers = pytest.importorskip("moorpy.helpers")
    theirs = helpers.getLineProps(size, kind.lower(), lineProps=helpers.loadLineProps(None))
    mine = material(f"{kind} {size:g} mm")
    assert mine["line_density"] == pytest.approx(theirs["m"], rel=1e-6)
    assert mine["area"] == pytest.approx(math.pi / 4 * theirs["d_vol"] ** 2, rel=1e-6)
    assert mine["breaking_load"] == pytest.approx(theirs["MBL"], rel=1e-6)
    assert mine["axial_stiffness"] == pytest.approx(theirs["EA"], rel=1e-6)
    assert mine["diameter"] * mine["normal_drag"] == pytest.approx(theirs["d_vol"] * theirs["Cd"], rel=6e-3)
    for load in (10, 22.5, 60) if kind != "wire" else ():
        dynamic = theirs["EAd"] + theirs["EAd_Lm"] * load / 100 * theirs["MBL"]
        other = material(f"{kind} {size:g} mm at {load:g} %")
        assert other["axial_stiffness"] == pytest.approx(dynamic, rel=1e-6)
        assert other["damping"] / other["axial_stiffness"] == pytest.approx(0.01, rel=1e-12)
        changed = {"axial_stiffness", "damping", "source", "catalogue"}
        assert {key for key in other if other[key] != mine[key]} == changed
        assert f"dynamic stiffness about {load:g} %" in other["source"]


@pytest.mark.parametrize("size", [12.0, 24.0, 60.0])
def test_six_strand_wire_is_that_of_the_standard(size):
    """EN 12385-4, 6x36 with a wire core, grade 1770: 0.356 d^2 1770 N and 0.409 d^2 kg per 100 m, d in mm."""
    mine = material(f"wire IWRC {size:g} mm")
    assert mine["breaking_load"] == pytest.approx(0.356 * size**2 * 1770, rel=0.01)
    assert mine["line_density"] == pytest.approx(0.409e-2 * size**2, rel=0.03)
    assert mine["line_density"] / mine["area"] == pytest.approx(7850, rel=1e-9)  # it displaces its steel
    E = mine["axial_stiffness"] / mine["area"]
    assert 0.35 < E / 206e9 < 0.55  # strands of steel stretch twice as far as a bar


@pytest.mark.parametrize(("inches", "pounds", "per_hundred_feet"), [(1.25, 18900, 27.0), (2.0, 46800, 69.0)])
def test_polypropylene_beside_a_chandlers(inches, pounds, per_hundred_feet):
    """Ropes of three strands as a chandler prints them are lighter, and 10 to 20 % weaker by their mass, than eight."""
    mine = material(f"polypropylene {25.4 * inches:g} mm")
    mass = per_hundred_feet * 0.45359 / 30.48
    assert 1.0 < mine["line_density"] / mass < 1.15
    assert 1.1 < mine["breaking_load"] / mine["line_density"] / (pounds * 4.4482 / mass) < 1.2
    assert mine["line_density"] < 1000 * mine["area"]  # it floats


@pytest.mark.parametrize("size", [20.0, 31.0, 53.0])
def test_aramid_is_what_its_fibre_and_sheath_are(size):
    """Ropes of polyester of 20, 31 and 53 mm as Parafil PF1 prints them: fibre in mm^2, kg/m dry and under water.

    Those of aramid hold as much of a heavier fibre.  Kevlar 49 stretches by 1.7 % until it breaks.
    """
    mine = material(f"aramid {size:g} mm")
    fibre, mass, weight = {20.0: (119.6, 0.30, 0.046), 31.0: (318.8, 0.73, 0.093), 53.0: (956.0, 2.15, 0.32)}[size]
    assert mine["breaking_load"] == pytest.approx(1926 * fibre, rel=0.11)
    assert mine["line_density"] == pytest.approx(mass + (1440 - 1380) * 1e-6 * fibre, rel=0.04)
    wet = mine["line_density"] - 1025 * mine["area"]
    assert wet == pytest.approx(weight + (1440 - 1380) * 1e-6 * fibre, rel=0.08)
    assert mine["breaking_load"] / mine["axial_stiffness"] == pytest.approx(1926 / 112e3, rel=0.01)
    assert mine["source"].startswith("estimate")


@shows("joint.float", "cable.segments.body.float")
def test_floats_have_their_buoyancy_and_drag():
    """Under water by statics: a float on a line pulls with what its catalogue says, 23 and 620 kg."""
    for name, kg, drag in (("glass 17 in", 23.0, 0.95 * 0.51**2), ("ORE 48 in", 620.0, 0.65 * 1.234**2)):
        line = {"length": 10.0, "elements": 2, "line_density": 1e-3, "diameter": 1e-3, "to": "up"}
        found = load_scene({"sea": {"depth": 15.0}, "cable": line, "joint": [{"name": "up", "float": name}]})
        assert float(solve_static(found).tension_top) == pytest.approx(9.81 * kg, rel=2e-3)
        (body,) = found.network.bodies.values()
        assert body.drag_area == pytest.approx(math.pi / 4 * drag, rel=1e-12)
        assert (body.added_mass, body.float) == (0.5, None)
        assert load_scene(found.to_dict()) == found
        (said,) = [row for row in inputs_of(found) if row.meaning.startswith("mooring float")]
        assert (said.section, said.value) == ("joint", name)
        assert "Dewey" in said.meaning
    two = scene("wire 20 mm", "wire 20 mm")
    two["cable"]["segments"][0]["body"] = {"float": "sphere 30 in", "drag_area": 2.0}
    (body,) = load_scene(two).network.bodies.values()
    assert 1025 * body.volume - body.mass == pytest.approx(160.0)
    assert (body.drag_area, body.volume) == (2.0, pytest.approx(math.pi / 6 * 0.76**3))


def test_a_variation_takes_another_float():
    """What a scene gives itself stays; what came from the float before goes."""
    line = {"length": 10.0, "elements": 2, "line_density": 1.0, "diameter": 0.02, "to": "up"}
    found = load_scene(
        {"sea": {"depth": 15.0}, "cable": line, "joint": [{"name": "up", "float": "glass 17 in", "drag_area": 0.7}]}
    )
    change = {"joint.up.float": "ORE 28 in"}
    for other in (load_scene(found, **change), varied(found, change)):
        (body,) = other.network.bodies.values()
        assert DENSITY * body.volume - body.mass == pytest.approx(133.0)
        assert body.drag_area == 0.7


def test_a_variation_brings_a_material():
    """In a scene that had none."""
    plain = {"length": 20.0, "elements": 8, "line_density": 1.0, "diameter": 0.02, "axial_stiffness": 1e6}
    found = load_scene({"sea": {"depth": 15.0}, "cable": plain | {"top": {"kind": "fixed", "position": [9, 0, -1]}}})
    other = varied(found, {"cable.material": "wire 20 mm", "cable.line_density": None})
    assert other.network.pieces[0].section.line_density == pytest.approx(5293.0 * 0.02**2)


def test_every_float_floats_and_weighs_something():
    for name, one in FLOATS.items():
        keys = with_float({"float": name})
        assert keys["mass"] > 0.1 * one.buoyancy, name
        assert DENSITY * keys["volume"] - keys["mass"] == pytest.approx(one.buoyancy)


@pytest.mark.parametrize("name", ["glass 18 in", 3, ["ORE 48 in"]])
def test_no_such_float(name):
    joint = [{"name": "up", "float": name}]
    line = {"length": 10.0, "elements": 2, "line_density": 1.0, "to": "up"}
    with pytest.raises(InputError, match=r"^joint\.0\.float = .*must be one of 'ORE 28 in'"):
        load_scene({"sea": {"depth": 15.0}, "cable": line, "joint": joint})


@pytest.mark.parametrize("name", ["chain R4 studlink 40 mm", "wire IWRC 20 mm", "polyester 60 mm", "HMPE 24 mm"])
def test_materials_are_damped_and_say_so(name):
    """c/EA in seconds; what a scene makes inextensible has no strain to be damped, what it gives itself counts."""
    tau = 0.01 if name.startswith(("polyester", "HMPE")) else 0.005
    found = load_scene(scene(name)).network.pieces[0].section
    assert found.damping == pytest.approx(tau * found.axial_stiffness, rel=1e-14)
    assert material(name)["source"].endswith(f"damping chosen, c/EA = {1e3 * tau:g} ms")
    for own, damping in (({"axial_stiffness": math.inf}, 0.0), ({"damping": 3.0}, 3.0), ({"damping": 0.0}, 0.0)):
        other = scene(name)
        other["cable"]["segments"][0] |= own
        assert load_scene(other).network.pieces[0].section.damping == damping
        one = {"length": 20.0, "material": name, "top": other["cable"]["top"]}
        whole = load_scene({"sea": {"depth": 15.0}, "cable": one | own})
        assert whole.network.pieces[0].section.damping == damping


def test_a_scene_is_complete_without_the_library():
    """The material becomes a section of its own; the scene that is written solves the same."""
    first = load_scene(scene("chain R3 studless 19 mm less 2 mm", "polyester 24.5 mm"))
    assert list(first.material) == ["chain-R3-studless-19-mm-less-2-mm", "polyester-24_5-mm"]
    again = load_scene(first.to_dict())
    assert again == first
    a, b = solve_static(first), solve_static(again)
    assert float(a.tension_top) == float(b.tension_top)
    assert [piece.section.diameter for piece in first.network.pieces] == [0.019, 0.0245]
    rows = {name: remark for name, _, _, remark in check(first).numbers}
    assert "IACS UR W22" in rows["breaking load of chain-R3-studless-19-mm-less-2-mm"]


def test_what_a_cable_gives_itself_counts():
    """Its own key before that of the material; that of a segment before all of the cable; a material for all its
    segments; a list of cables; a variation."""
    one = {"from": [0.0, 0.0, -15.0], "to": [10.0, 0.0, -1.0], "length": 20.0, "material": "wire 20 mm"}
    found = load_scene(
        {"sea": {"depth": 15.0}, "cable": [one | {"name": "a"}, one | {"name": "b", "normal_drag": 2.0}]}
    )
    assert [piece.section.normal_drag for piece in found.network.pieces] == [1.2, 2.0]
    other = load_scene(found, **{"cable.b.material": "nylon 30 mm"})
    assert [piece.section.diameter for piece in other.network.pieces] == [0.02, 0.03]
    for_all = scene("wire 20 mm", "wire 20 mm")
    for segment in for_all["cable"]["segments"]:
        del segment["material"]
    for_all["cable"]["material"] = "wire 20 mm"
    assert [piece.section.diameter for piece in load_scene(for_all).network.pieces] == [0.02, 0.02]
    for_all["cable"] |= {"normal_drag": 2.0}
    for_all["cable"]["segments"][1]["material"] = "nylon 30 mm"
    first, second = (piece.section for piece in load_scene(for_all).network.pieces)
    assert (first.normal_drag, second.normal_drag) == (2.0, 1.6)  # of ropes


def test_a_library_of_ones_own(tmp_path):
    """Beside the scene; its names come before those of the program, and the complete scene needs the file no more."""
    (tmp_path / "mine.toml").write_text(OWN)
    file = tmp_path / "scene.toml"
    file.write_text(tomli_w.dumps({"library": "mine.toml"} | scene("my rubber cord, 30 mm")))
    found = load_scene(file)
    assert found.network.pieces[0].section.breaking_load == 3000.0
    (tmp_path / "mine.toml").unlink()
    assert load_scene(found.to_dict()) == found
    (tmp_path / "mine.toml").write_text(OWN)
    own = load_scene(scene("wire 20 mm"), library=str(tmp_path / "mine.toml"))
    assert own.network.pieces[0].section.line_density == 5.0


@pytest.mark.parametrize(
    ("library", "words"),
    [
        ("../mine.toml", "without '..'"),
        ("/etc/passwd", "below the folder"),
        ("nowhere.toml", "not found"),
        ("link.toml", "link that leaves"),
        ("bad.toml", "library = 'bad.toml'"),
        ("flat.toml", "table of keys"),
        ("long.toml", "bytes at most"),
        ("wrong.toml", "line_density"),
        (3, "name of a TOML file"),
    ],
)
def test_libraries_that_are_none(tmp_path, library, words):
    """A scene of a stranger touches nothing outside its folder."""
    (tmp_path / "mine.toml").write_text(OWN)
    folder = tmp_path / "inner"
    folder.mkdir()
    (folder / "link.toml").symlink_to(tmp_path / "mine.toml")
    (folder / "bad.toml").write_text("x = [")
    (folder / "flat.toml").write_text("line_density = 3.0")
    (folder / "long.toml").write_text("#" * 1_000_001)
    (folder / "wrong.toml").write_text(OWN.replace("5.0", "-5.0"))
    file = folder / "scene.toml"
    file.write_text(tomli_w.dumps({"library": library} | scene("wire 20 mm")))
    with pytest.raises(InputError, match=words):
        load_scene(file)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("chain R9 studless 19 mm", "one of the grades"),
        ("chain R3 19 mm", "must be written like"),
        ("chain R3 studless 400 mm", "5 to 250 mm"),
        ("chain R3 studless 19 mm less 19 mm", "less corrosion"),
        ("wire 2 mm", "5 to 250 mm"),
        ("wire 20 mm at 10 %", "has one stiffness, whatever its load"),
        ("nylon 20 mm at 0 %", "above 0 and up to 60 %"),
        ("nylon 20 mm at 61 %", "above 0 and up to 60 %"),
        ("nylon", "must be the name of a"),
        ("hemp 20 mm", "like 'chain R3 studless 19 mm'"),
    ],
)
def test_names_that_are_none(name, words):
    with pytest.raises(InputError, match=words):
        load_scene(scene(name))


def test_two_materials_of_one_name():
    """Nothing is taken for something else in silence."""
    other = {"wire-20-mm": {"line_density": 1.0, "diameter": 0.02}}
    with pytest.raises(InputError, match=r"another \[material.wire-20-mm\]"):
        load_scene(scene("wire 20 mm") | {"material": other})


def test_a_material_that_there_is_not_is_told_by_its_place():
    bad = scene("wire 20 mm", "wire 2000 mm")
    with pytest.raises(InputError, match=r"^cable\.segments\.1\.material = 'wire 2000 mm': must have a size"):
        load_scene(bad)
    bad["cable"]["segments"][1] = bad["cable"]["segments"][0] | {"body": {"float": "none"}}
    with pytest.raises(InputError, match=r"^cable\.segments\.1\.body\.float = 'none': must be one of"):
        load_scene(bad)
