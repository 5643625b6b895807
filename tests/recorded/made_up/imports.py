"""Files of other programs with one thing wrong or unusual in each: the refusal, or what is said of it and changes."""

import json
from pathlib import Path

from dolfbuoy.errors import InputError
from dolfbuoy.formats import files, from_yaml

INPUTS = Path(__file__).parents[1] / "inputs"
CHANGES = {
    ("moordyn", "odd.dat"): [
        ("5.1e7|9.3e7", "curve.dat"), ("5.1e7|9.3e7", "Syrope:a"),
        ("1 Free 1 2 -3 5 0 0 4000", "1 Held 1 2 -3 5 0 0 4000"),
        ("1 Free 1 2 -3 5 0 0 4000", "1 Free 1 2 -3 5 0 0 0"),
        ("1 Free 1 2 -3 5 0 0 4000", "1 Fixed 1 2 -3 5 0 0 4000"), ("4 CoupledPinned", "4 Pinned"), ("0|0|0.4", "0.4"),
        ("0|0|0.4", "0.1|0|0.4"), ("1|2|3|4|5|6", "1|2|3|4"), ("1|2|3|4|5|6", "1|2"), ("300|310|200", "300"),
        ("3 steel Turbine2", "3 steel Nowhere"), ("0 0 1 0 0 3", "0 0 2 0 0 3"), ("0 0 1 0 0 3", "0 0 1 0 0 1"),
        ("500 0 300|310|200 0", "500 0 300|310|200 4"), ("3 Free -100", "3 Loose -100"), ("6 Body3", "6 Body9"),
        ("1 soft 1 3", "1 hemp 1 3"), ("1 soft 1 3", "1 soft 1 1"), ("1 soft 1 3", "1 soft 1 99"),
        ("221 21", "221 2.5"), ("221 21", "221 0"), ("9 stiff 1 R3B", "8 stiff 1 R3B"), ("25 4e5", "0 0"),
        ("9.79 g", "0 g"), ("9.79 g", "much g"), ("2.1e6 kBot", "-1 kBot"), ("2.1e6 kBot", "0 kBot"),
        ("0.43 MU_KT", "0.31 MU_KT"), ("7 strange", "90 WtrDpth"), ("7 strange", "-9 WtrDpth"),
        ("7 strange", "floor.txt WtrDpth"), ("7 strange", "400 WtrDpth"), ("7 strange", "1 WaveKin"),
        ("7 strange", "8 WaveKin"), ("7 strange", "3 Currents"), ("7 strange", "many"),
        ("1013 WtrDnsty", "0 WtrDnsty"), ("Fixed -301 12 -100.5", "Coupled -301 12 -100.5"), ("4 Body1", "4 Body2"),
        ("3 Free -100 7 -60", "3 Free -100 7 -160"), ("TypeName Diam Mass/m EA", "TypeName Diam Diam EA"),
        ("ID Attachment X Y Z Mass", "ID Attachment X Y Depth Mass"),
        ("(-) (m) (kg/m) (N) (N-s/-)", "(-) (ft) (kg/m) (N) (N-s/-)"), ("2 rope 3 2 123", "2 rope 3 2 -"),
        ("1 Body5 0|0|50", "1 Body5 3|0|50"), ("0|0|50 0|0|0 0|0|0 G", "0|0|50 0|0|0 0|0|0 L"),
        ("8 Turbine3 1 1 -4", "8 Vessel3 1 1 -4"), ("7 8 9", "7"), ("7 strange", "0.002 dtM"),
        ("7 strange", "0.0010 dtM"),
        ("1 soft 1 3 221 21 -", "1 soft 1 3"), ("2 rope 3 2 123 13 -", "2 rope 3 2 123 13 - 4"),
        ("1 soft 1 3 221 21", "1 soft R9A 3 221 21"), ("1 soft 1 3 221 21", "1 soft R1C 3 221 21"),
        ("9 stiff 1 R3B", "9 stiff 1 3"),
        ("TypeName Diam Mass/m Cd Ca CdEnd CaEnd", "TypeName Diam Mass/m Cd Ca Cd CaEnd"),
        ("TypeName Diam Mass/m Cd Ca", "TypeName Mass/m Ca Cd Diameter"), ("1 float Body5", "1 flood Body5"),
    ],
    ("moordyn", "dry.dat"): [
        ("0 WtrDnsty", "1025 WtrDnsty"), ("1 1 -10 0 20", "1 1 -10 0 -20"), ("3 0 0 0 22", "3 0 0 0 10"),
        ("(Pa-s)", "(-)"), ("1e6 2e5", "1e6 -1"),
    ],
    ("moordyn", "braced.dat"): [
        ("3 steel Body1 -4 0 -3", "3 steel Body1 -4 1 -3"), ("steel 0.3 301", "steel 0.3 0"),
        ("float 1.3 310", "float 1.3 1400"), ("8 steel Pinned", "8 steel Coupled"),
        ("0 0 0 0 0 0 0 0 0\n2", "0 0 0 90 0 0 0 0 0\n2"), ("1 Free 1 2 -1 0 0 0 0 0", "1 Free 1 2 -9 0 0 0 700 0"),
        ("2 Vessel 30 2 -1 0 0 90", "2 Vessel 30 2 -1 10 0 90"), ("6 steel Body2Pinned", "6 steel CoupledPinned"),
        ("4 rope R4B 1 75", "4 rope 1 2 75"), ("2 float Body1 4 0 -3 4 0 2", "2 float Body1 6 0 -3 6 0 2"),
        ("float 1.3 310", "float 1.3 0"),
        ("steel 0.3 301 0.8 0.95 1.1 0.9\nfloat 1.3 310", "steel 0.3 0 1 1 1 1\nfloat 1.3 0"),
    ],
    ("raft", "raft.yaml"): [
        ("mooring:", "mooring:\n  file: other.dat"), ("name: a design", "name: *a"), ("name: clump", "name: ship"),
        ("{name: ship, type: vessel, location: [1, 2, -15]}", "ship"),
        ("water_depth: 310, rho_water: 1011, g: 9.79}\nmooring:\n  water_depth: 202", "rho_water: 1011}\nmooring:"),
        ("water_depth: 310, rho_water: 1011, g: 9.79}\nmooring:\n  water_depth: 202\n"
         "  points:\n    - {name: foot 1, type: fixed",
         "rho_water: 1011}\nmooring:\n  points:\n    - {name: foot 1, type: vessel"), ("name: a design", "name: ["),
        ("points:", "places:"), ("rho_water: 1011", "rho_water: 0"), ("g: 9.79", "g: 0"), ("g: 9.79", "g: true"),
        ("water_depth: 202", "water_depth: 100"), ("  water_depth: 202\n", "  cost: 3\n"),
        ("type: fixed", "type: hung"), ("[-250, 11, -200.5]", "[-250, 11]"),
        ("[-250, 11, -200.5]", "[-250, deep, -200.5]"), ("type: R4 chain", "type: R5"),
        ("endA: foot 1", "endA: foot 2"), ("endB: ship", "endB: clump"), ("length: 251", "length: long"),
        ("length: 251", "len: 2"), ("mass_density: 103, ", ""), ("mass_density: 103", "mass_density: 103, EI: -1"),
        ("mass_density: 103", "mass_density: 103, EI: 9e3"), ("stiffness: 2.1e7", "stiffness: 2.1e7, EAd: 3"),
        ("{name: upper,", "upper, {"), ("mass: 301", "mass: 301, colour: 3"),
        ("site: {", "wind: 3\nsite: {depth_max: 3, "), ("{water_depth: 310, rho_water: 1011, g: 9.79}", "{}"),
    ],
    ("wisdem", "wisdem.yaml"): [
        ("nodes:", "knots:"), ("joint: pontoon", "joint: pool"), ("joint: pontoon", "joint: pontoon, colour: red"),
        ("grid: 0.25", "grid: half"),
        ("[1.0, 2.0, -21.0]", "[1.0, 2.0]"), ("mass_density: 285.0, ", ""), ("stiffness: 1.1e9, ", ""),
        ("name: low", "line_id: low"), ("name: a1,", ""), ("tower: {}", "tower: {}\n  hub: {}"),
        ("joint1: keel", "joint1: kiel"), ("cylindrical: true", "cylindrical: false"),
        ("water_depth: 201.0", "water_depth: 150"),
    ],
    ("famodel", "famodel.yaml"): [
        ("array:", "arrays:"), ("[fowt1, 1, 1, ms1, 10.0", "[fowt1, 1, 1, ms2, 10.0"),
        ("[fowt1, 1, 1, ms1, 10.0", "[fowt1, 1, 1, ms1, near"),
        ("[f2, 1, 1, 0, 1610.0, 25.0, 0]", "[f2, 1, 1, 0, 1610.0, 25.0, 0, 9]"), ("heading_adjust]", "heading]"),
        ("ms1, 10.0, 20.0, 90", "ms1, 10.0, 20.0, x"), ("[[taut, 30,", "[[tight, 30,"), ("[[taut, 30,", "[[taut, x,"),
        ("anchoring_radius: 801.0", "span: 801.0"), ("anchoring_radius: 801.0", "depth: 3"),
        ("2400.0, 30.0, 0]", "west, 30.0, 0]"), ("[shared, fowt1, f2, 0]", "[shared, fowt1, f3, 0]"),
        ("fairlead_radius: 40.0", "radius: 40.0"), ("fairlead_depth: -14.0", "fairlead_depth: low"),
        ("length: 502.0", "length: long"), ("connectorType: link", "connectorType: knot"),
        ("{m: 141.0, v: 0.13}", "{m: heavy}"),
        ("sections: [{type: poly, length: 81.0}, {connectorType: clump}, {type: poly, length: 690.0}]", "sections: []"),
        ("{type: poly, length: 690.0}]", "{connectorType: clump}]"), ("type: array of two", "substation: 3"),
        ("ms1, 10.0, 20.0, 90", "0, 10.0, 20.0, 90"),
        ("[[shared, fowt1, f2, 0], [taut, anch1, f2, 0]]", "[]"),
        ("water_depth: 210.0", "depth: 210.0"),
        ("platform: {rFair: 41.0, zFair: -16.0}", "platforms: [{rFair: 43.0, zFair: -17.0}, {rFair: 3.0, zFair: 2.0}]"),
    ],
    ("map", "map.txt"): [
        ("repeat 120 240", " repeat 120 240"), ("repeat 120 240", "repeat often"), ("depth 0", "-151 0"),
        ("9.7e7  0.7", "9.7e7  0.5"), ("98.5", "#"), ("2 connect", "2 floating"), ("outer_tol", "inner_tol"),
        ("3    poly    #97.5     2        4", "3    poly    #97.5     2        5"),
    ],
}  # fmt: skip

CHANGING = "a\nb\nc\nd\n-40 0\nf\n0 1 0.2 0 0 0 0\n5 1 0.2 0.3 0.1 0 0.1\n9 1 2 3 4 5 6\n"
OVER_TIME = "1\n0\n0\n0\n0\n"
OVER_TIME += "0 0 -9 0 0.1 0.2 0.3\n1 0 -9 0 0.1 0.2 0.3\n0 0 0 0 0.5 0.6 0\n0 0 -9 4 0.4 0.2 0\n0 0 0 4 0.7 0.9 0\n"
SPECTRUM = "0 0 0 0.5\n0.4 0.1 0.2 0.5\n1.2 0.6 0.3 0.5\n1.4 -0.2 0.4 0.5\n"
FLOOR = "3 2\n-20 0 30\n-5 5\n" + "".join(f"{x} {y} {-40 + 0.1 * x - 0.2 * y}\n" for x in (-20, 0, 30) for y in (-5, 5))
OPENFAST = """water
--- WAVES ---
1 WaveKinMod
"eta.dat" WaveKinFile
0.5 dtWave
30 WaveDir
--- CURRENT ---
1 CurrentMod
z x y
0.0 0.9 0.3
150 0.5 0.2
--- need this line ---
"""
#: Options of odd.dat, and files beside it.
WATER = [
    ("2 WaveKin", {"wave_frequencies.txt": SPECTRUM}),
    ("7 WaveKin", {"wave_frequencies.txt": SPECTRUM}),
    ("7 WaveKin", {"wave_frequencies.txt": "-1 1 0\n"}),
    ("2 WaveKin", {"wave_frequencies.txt": "0 0 0\n2 1 0\n1 1 0\n"}),
    ("2 WaveKin", {"wave_frequencies.txt": "0 0 0\n2 0 0\n"}),
    ("3 WaveKin", {"wave_elevation.txt": "t eta\n" + "".join(f"{1 + k / 2} {0.1 * (k % 4)}\n" for k in range(9))}),
    ("0.2 dtWave\n3 WaveKin", {"wave_elevation.txt": "0 0.1\n0.5 0.4\n0.9 -0.2\n1.5 0.3\n"}),
    ("3 WaveKin", {"wave_elevation.txt": "0 0.1\n0.5 0.4\n0.9 -0.2\n2.5 0.3\n"}),
    ("3 WaveKin", {"wave_elevation.txt": "1 0.1\n"}),
    ("1 Currents", {"current_profile.txt": "a\nb\nc\n0 0.8 0.6 0\n-40 0.4 0.3 0.1\n"}),
    ("1 Currents", {"current_profile.txt": "a\nb\nc\n0 0.8 0.6 0\n-40 0.4 0.1 0\n"}),
    ("1 Currents", {"current_profile.txt": "a\nb\nc\n-3 0.8 -0.6 0\n"}),
    (
        "2 Currents",
        {"current_profile_dynamic.txt": CHANGING},
    ),
    (
        "5 Currents",
        {"current_profile_4d.txt": OVER_TIME},
    ),
    ("5 Currents", {"current_profile_4d.txt": "1\n0\n0\n0\n0\n0 0 -9 0 0.1 0.2 0.3\n1 0 -9 0 0.1 0.3 0.3\n"}),
    (
        "water.dat WaterKin",
        {"water.dat": OPENFAST, "eta.dat": "t e\n" + "".join(f"{k * 0.51 + k % 2 / 9} {k % 3}\n" for k in range(11))},
    ),
    ("water.dat WaterKin", {"water.dat": OPENFAST.replace("1 WaveKinMod", "2 WaveKinMod").replace("1 Curr", "2 Curr")}),
    ("water.dat WaterKin", {"water.dat": OPENFAST.replace("150 ", "-150 ").replace("30 WaveDir", "0 WaveDir")}),
    ("water.dat WaterKin", {}),
    ("SEASTATE WaterKin", {}),
    ("floor.txt SeafloorFile", {"floor.txt": FLOOR.replace("-4", "-24").replace("-3", "-23")}),
    ("floor.txt SeafloorFile", {"floor.txt": "1 2\n"}),
    ("floor.txt SeafloorFile", {"floor.txt": FLOOR.replace("3 2", "2 3", 1)}),
    ("floor.txt SeafloorFile", {"floor.txt": FLOOR + " " * 50_000_001}),
    ("2 WaveKin", {"wave_frequencies.txt": "no numbers\n"}),
    ("2 WaveKin", {"wave_frequencies.txt": "0 0 0\n1 2\n2 3 4 5\n"}),
    ("floor.txt SeafloorFile", {}),
]


def taken(kind, text, depth=151.0):
    """(notes, scene as lines) of a file, or its refusal."""
    Path("one.txt").write_text(text)
    try:
        scene, notes = files.read(kind, Path("one.txt"), depth=depth if kind == "map" else None)
    except InputError as error:
        return [str(error)], []
    scene = json.loads(json.dumps(scene, default=str), parse_float=lambda text: round(float(text), 9) + 0.0)
    return [str(note) for note in notes], json.dumps(scene, indent=1).splitlines()


def told():
    """What each change changes."""
    for (kind, name), changes in CHANGES.items():
        text = (INPUTS / name).read_text()
        notes, scene = taken(kind, text)
        if name == "odd.dat":
            changes = changes + [("7 strange", option) for option, _ in WATER]
        for number, (old, new) in enumerate(changes):
            assert old in text, (name, old)
            beside = WATER[number - len(CHANGES[kind, name])][1] if number >= len(CHANGES[kind, name]) else {}
            for file, content in beside.items():
                Path(file).write_text(content)
            said, found = taken(kind, text.replace(old, new, 1))
            for file in beside:
                Path(file).unlink()
            lines = found and [
                *(f"- {x}" for x in scene if x not in found),
                *(f"+ {x}" for x in found if x not in scene),
            ]
            print(f"{name}: {old.strip()!r} -> {new.strip()!r}:", *(x for x in said if x not in notes), sep="\n  ")
            print(" ", " ".join(line.replace(" ", "") for line in lines)[:900])
    for kind, columns in (("moordyn", "order"), ("raft", "place"), ("other", "name")):
        try:
            files.read(kind, INPUTS / "raft.yaml", columns)
        except InputError as error:
            print(error)
    print(*taken("map", (INPUTS / "map.txt").read_text(), None)[0], sep="\n")
    for text in ("[" * 5000, "a: *b", "a: 1\nb: [2"):
        try:
            from_yaml.read_yaml(text)
        except InputError as error:
            print(error)


told()
