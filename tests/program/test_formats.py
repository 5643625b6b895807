"""Moorings in other programs' files: their translation, notes on the rest, and refusals.

Source: MoorDyn's manual for the meaning of its columns; files written here, or by MoorPy from PyPI.
"""

import math

import numpy as np
import pytest

import dolfbuoy
from dolfbuoy.errors import InputError
from dolfbuoy.formats import from_moordyn, from_yaml
from dolfbuoy.formats.files import as_toml, read
from dolfbuoy.formats.to_moordyn import Start, export
from dolfbuoy.scene import load_scene
from dolfbuoy.scene.reading import parse

SECOND = """a mooring
of two lines
--- LINE TYPES ---
TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
chain 0.1 100.0 5e8 {BA} {EI} 1.2 1.0 0.3 {CaAx}
--- POINTS ---
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Fixed -300 0 -100 0 0 0 0
2 Coupled 0 0 -5 0 0 0 0
3 Free -100 0 -60 500 0.1 1 0.5
--- LINES ---
ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs
(#) (-) (#) (#) (m) (-) (-)
1 chain 1 3 220 40 p
2 chain 3 2 120 30 p
--- OPTIONS ---
0.001 dtM
1000 rhoW
100 WtrDpth
2e6 kBot
0.4 FrictionCoefficient
--- need this line ---
"""
PLAIN = {"BA": 0, "EI": 0, "CaAx": 0}


def imported(**changes):
    return from_moordyn.scene_of(SECOND.format(**PLAIN | changes))


def test_meaning_of_moordyns_columns():
    scene, _ = imported(BA=300.0)
    found = load_scene(scene)
    chain = found.material["chain"]
    assert (chain.line_density, chain.diameter, chain.axial_stiffness, chain.damping) == (100.0, 0.1, 5e8, 300.0)
    assert chain.tangential_drag == pytest.approx(0.3 * math.pi, rel=1e-14)  # on the surface pi d l there
    assert (chain.normal_drag, chain.added_mass) == (1.2, 1.0)
    assert (found.sea.depth, found.sea.density, found.seabed.stiffness, found.seabed.friction) == (100.0, 1e3, 2e6, 0.4)
    one, two = found.cable
    assert (getattr(one, "from"), one.to, two.to, one.elements) == (
        (-300.0, 0.0, -100.0),
        "point3",
        "vessel.point2",
        40,
    )
    (free,), (vessel,) = found.joint, found.vessel
    assert (vessel.position, vessel.fairleads) == ((0.0, 0.0, 0.0), {"point2": (0.0, 0.0, -5.0)})
    assert (free.mass, free.volume, free.drag_area, free.added_mass) == (500.0, 0.1, 1.0, 0.5)


@pytest.mark.parametrize(
    ("changes", "line", "words"),
    [
        ({"BA": -0.8}, 6, "numerical"),
        ({"EI": 1e4}, 6, "their ends on points are pinned"),
    ],
)
def test_what_is_not_carried_over_is_said_with_its_line(changes, line, words):
    _, plain = imported()
    _, notes = imported(**changes)
    (new,) = [note for note in notes if note not in plain]
    assert new.line == line
    assert words in new.text


def test_columns_of_the_first_version_are_read_by_name():
    text = (
        SECOND.format(**PLAIN)
        .replace("EI Cd Ca CdAx CaAx", "Can Cat Cdn Cdt")
        .replace(" 0 1.2 1.0 0.3 0\n", " 1.0 0 1.2 0.3\n")
    )
    scene, notes = from_moordyn.scene_of(text)
    assert scene == imported()[0]
    assert [note.line for note in notes if "MoorDyn 1" in note.text] == [4]


def test_a_scene_goes_to_moordyn_and_back():
    """Lines, joints, bodies and the bed of a scene that MoorDyn can say come back as they were."""
    rope = {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 3e6, "normal_drag": 1.1, "tangential_drag": 0.2}
    buoy = {"name": "body1", "hull": [[0.0, 1.0], [0.8, 1.0], [0.8, 3.0], [2.0, 3.0]], "mass": 4000.0}
    buoy |= {"center_of_mass": 0.9, "inertia": [4000.0, 4500.0, 5000.0], "normal_drag": 0.8}
    cables = [
        {"name": "line1", "from": [40.0, 0.0, -30.0], "to": "point2", "length": 30.0},
        {"name": "line2", "from": "point2", "to": "body1.point3", "length": 20.0},
    ]
    scene = {"sea": {"depth": 30.0}, "seabed": {"stiffness": 1e5}, "cable": [rope | cable for cable in cables]}
    scene |= {"joint": [{"name": "point2", "mass": 10.0, "volume": 0.1}]}
    scene |= {"buoy": [buoy | {"fairleads": {"point3": [1.5, 0.0, 0.8]}}]}
    given = load_scene(scene)
    back, _ = from_moordyn.scene_of(export(given, Start()).files["lines.txt"])
    found = load_scene(back)
    assert found.material["type1"].tangential_drag == pytest.approx(0.2, rel=1e-12)
    for cable, other in zip(given.cable, found.cable, strict=True):
        assert (getattr(cable, "from"), cable.to, cable.length) == (getattr(other, "from"), other.to, other.length)
    assert found.joint == given.joint
    (body,) = found.buoy
    for key in ("hull", "mass", "center_of_mass", "inertia", "normal_drag", "fairleads"):
        assert getattr(body, key) == getattr(given.buoy[0], key), key


def test_moordyn_begins_where_the_scene_does():
    """Not at rest, if [initial] says otherwise: there this line hangs straight down from the ship."""
    from dolfbuoy.studies.peer import beginning

    start = beginning(load_scene("towed-array"))
    for name, place in {"drogue": (-213.137, 0.0, -40.0), "array.1": (-113.137, 0.0, -40.0)}.items():
        assert start.joints[name] == pytest.approx(place, abs=1e-3)


def test_moorpys_yaml_and_its_equilibrium():
    """A catenary leg of RAFT's YAML against MoorPy, which reads the same values."""
    moorpy, yaml = pytest.importorskip("moorpy"), pytest.importorskip("yaml")
    chain = {
        "name": "chain",
        "diameter": 0.1,
        "mass_density": 100.0,
        "stiffness": 5e8,
        "transverse_drag": 1.2,
        "breaking_load": 9e6,
    }
    points = [
        {"name": "foot", "type": "fixed", "location": [-250.0, 0.0, -100.0]},
        {"name": "ship", "type": "vessel", "location": [0.0, 0.0, -5.0]},
    ]
    line = {"name": "leg", "endA": "foot", "endB": "ship", "type": "chain", "length": 300.0}
    mooring = {"water_depth": 100.0, "points": points, "lines": [line], "line_types": [chain]}
    scene, notes = from_yaml.scene_of(yaml.safe_dump({"mooring": mooring, "platform": 1}))
    assert any("vessels rest" in str(note) for note in notes)
    assert scene["material"]["chain"]["breaking_load"] == 9e6
    scene["cable"][0]["elements"] = 200
    found = dolfbuoy.solve_static(scene)
    system = moorpy.System(depth=100.0, rho=1025.0, g=9.81)
    system.parseYAML(mooring)
    system.bodyList[0].type = 1  # the vessel is held
    system.initialize()
    assert float(found.tension_top) == pytest.approx(system.lineList[0].TB, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no section LINES"),
        (SECOND.format(**PLAIN).replace("1 chain 1 3", "1 rope 1 3"), "line 16: LineType 'rope' is none of the"),
        (SECOND.format(**PLAIN).replace("1 chain 1 3", "1 chain 1 7"), "line 16: there is no point 7"),
        (SECOND.format(**PLAIN).replace("100.0 5e8", "heavy 5e8"), "line 6: mass_density is 'heavy'"),
        (SECOND.format(**PLAIN).replace("5e8", "stiffness.txt"), "line 6: EA is the file"),
        (SECOND.format(**PLAIN).replace("1 chain 1 3 220", "1 chain 1 R1A 220"), "line 16"),
        (SECOND.format(**PLAIN).replace("Fixed", "Glued"), "line 10: the attachment 'Glued'"),
        (SECOND.format(**PLAIN).replace("2e6 kBot", "hard kBot"), "line 22: kBot is 'hard'"),
        (SECOND.format(**PLAIN).replace("1000 rhoW", "heavy rhoW"), "line 20: rho is 'heavy'"),
        (SECOND.format(**PLAIN).replace("-60 500", "-60 nan"), "line 12: mass is 'nan'"),
        (SECOND.format(**PLAIN).replace("-60 500", "-60 inf"), "line 12: mass is 'inf'"),
        (SECOND.format(**PLAIN).replace("3 220", "3 1e-400"), "line 16: length is '1e-400'"),
        (SECOND.format(**PLAIN).replace("3 220", "3 2_20"), "line 16: length is '2_20'"),
        (SECOND.format(**PLAIN).replace("3 220", "3 ٢٢٠"), "line 16: length is '٢٢٠'"),
        (SECOND.format(**PLAIN).replace("(m) (kg/m)", "(ft) (kg/m)"), "line 5: the unit (ft)"),
        (SECOND.format(**PLAIN).replace("Mass/m EA", "Mass/m"), "line 4"),
        (SECOND.format(**PLAIN).replace("100.0 5e8 0", "5e8 0"), "line 6: there are 9 values in 10 columns"),
        (SECOND.format(**PLAIN).replace(" Cd Ca CdAx", " Ca CdAx"), "line 6: there are 10 values in 9 columns"),
        (SECOND.format(**PLAIN).replace("ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs\n", ""), "must name"),
        (SECOND.format(**PLAIN).replace("2 Coupled", "1 Coupled"), "line 11: 1 of POINTS is given twice"),
        (SECOND.format(**PLAIN).replace("2 chain 3 2", "1 chain 3 2"), "line 17: 1 of LINES is given twice"),
    ],
)
def test_a_bad_file_of_moordyn_is_one_sentence(text, words):
    with pytest.raises(InputError) as error:
        from_moordyn.scene_of(text)
    assert words in str(error.value)


ODD = ("nan", "inf", "-inf", "1_0", "٣", "1e400", "1e-400", "-1", "0", "1e9", "x", "(", "---", "|", "1|2", "\0")


def changed_files():
    """The file above with one word taken away, written twice or replaced, or one line taken away or written twice."""
    lines = SECOND.format(**PLAIN).splitlines()
    for k, line in enumerate(lines):
        yield [*lines[:k], *lines[k + 1 :]]
        yield [*lines[: k + 1], *lines[k:]]
        words = line.split()
        for i, word in enumerate(words):
            for new in ("", f"{word} {word}", *ODD):
                yield [*lines[:k], " ".join([*words[:i], new, *words[i + 1 :]]), *lines[k + 1 :]]


def test_any_change_of_a_file_of_moordyn(tmp_path):
    """A scene, or one sentence; what is new is said, unless it is another number."""
    path, ended = tmp_path / "lines.txt", {"scene": 0, "sentence": 0}
    said = []
    for lines in changed_files():
        path.write_text("\n".join(lines), encoding="utf-8")
        try:
            read("moordyn", path)
            ended["scene"] += 1
        except InputError as error:
            ended["sentence"] += 1
            said.append(str(error))
    assert [text for text in said if not (text.isprintable() and text.endswith("."))] == []
    assert min(ended.values()) > 300


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: &a [1]\nb: [*a, *a]\n", "aliases"),
        ("!!python/object/apply:os.system ['true']\n", "this is no YAML"),
        ("[" * 5000, "YAML"),
        ("\x04", "this is no YAML: special characters are not allowed."),
        ("mooring: {points: [1], lines: [1], line_types: [1]}\n", "is no table"),
        ("x: 1\n", "no file of MoorPy or RAFT"),
        ("points: [{name: a}, {name: a}]\nlines: [{name: a}]\nline_types: [{name: a}]\n", "points: 'a' is given twice"),
    ],
)
def test_bad_yaml_is_one_sentence_and_runs_nothing(text, words):
    pytest.importorskip("yaml")
    with pytest.raises(InputError) as error:
        from_yaml.scene_of(text)
    assert words in str(error.value)


def test_bending_stiffness_there_and_back():
    """Of its type; such lines carry compression, the others of the file none."""
    scene, _ = imported(EI=1e4)
    scene = load_scene(scene)
    stiff = [piece.section for piece in scene.network.pieces if piece.section.bending_stiffness]
    assert {c.bending_stiffness for c in stiff} == {1e4}
    assert {c.slack for c in stiff} == {"compressive"}
    text = export(scene).files["lines.txt"]
    columns, row = (
        next(line.split() for line in text.splitlines() if line.startswith(x)) for x in ("TypeName", "type1")
    )
    assert float(row[columns.index("EI")]) == 1e4


def test_names_of_a_file_cannot_leave_the_comments_of_the_scene():
    text = SECOND.format(**PLAIN).replace("0.4 FrictionCoefficient", "4 x\x01gravity=1")
    scene, notes = from_moordyn.scene_of(text)
    assert any("gravity" in str(note) for note in notes)
    assert parse(as_toml(scene, notes, "lines\n\u2028gravity = 1")) == parse(as_toml(scene, [], "lines.txt"))


def test_import_and_export_as_commands(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lines.txt").write_text(SECOND.format(**PLAIN | {"EI": 1e3}))
    code, said, _ = call("import", "moordyn", "lines.txt", "--out", "mine.toml")
    assert (code, "lines.txt, line 6: EI" in said) == (0, True)
    code, _, error = call("import", "moordyn", "lines.txt", "--out", "mine.toml")
    assert code == 2
    assert "must be a new file" in error
    code, said, _ = call("export", "moordyn", "mine.toml", "--out", "theirs")
    assert code == 0
    assert "seabed.friction" in said
    assert (
        "chain" not in (tmp_path / "theirs" / "lines.txt").read_text()
    )  # names of types are its own: any name will do
    assert call("import", "orcaflex", "lines.txt")[0] == 2
    assert call("export", "moordyn", "free-buoy")[0] == 2
    assert call("import", "moordyn", "nothing.txt")[0] == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bridle", "lazy-wave"])
def test_shipped_networks_beside_moordyn(name):
    """Both programs at the scene's resolution: top tensions within 1 % of their range (rms), peaks within 0.5 %."""
    pytest.importorskip("moordyn")
    from dolfbuoy.studies import peer

    found = peer.compare(load_scene(name), 20.0)
    tops = [row for row in found.rows if row["quantity"].endswith("tension_top")]
    assert tops
    for row in tops:
        assert row["relative"] < 0.01
        assert row["largest"] == pytest.approx(row["largest_moordyn"], rel=5e-3)
    assert np.isfinite([row["relative"] for row in found.rows]).all()


@pytest.mark.slow
def test_a_line_that_bends_beside_moordyn():
    """Top tensions within 0.5 % of their range (rms); what a stiffness of 1 kN m^2 takes from the peak and the trough
    (57 and 282 N of 7.1 and 3.4 kN), within 15 %."""
    pytest.importorskip("moordyn")
    from dolfbuoy.studies import peer

    found = {}
    for stiffness in (0.0, 1e3):
        rows = peer.compare(load_scene("driven", cable__bending_stiffness=stiffness), 20.0).rows
        (found[stiffness],) = (row for row in rows if row["quantity"].endswith("tension_top"))
    assert found[1e3]["relative"] < 0.005
    for name in ("largest", "least"):
        mine, theirs = (found[0.0][key] - found[1e3][key] for key in (name, f"{name}_moordyn"))
        assert mine == pytest.approx(theirs, rel=0.15)
