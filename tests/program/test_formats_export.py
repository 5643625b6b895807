"""Every number of a scene is written to MoorDyn's input, in the unit and column MoorDyn expects.

Source: MoorDyn's manual, "Input Files", for positions, units and reference quantities of coefficients; sums by hand.
"""

import math

import numpy as np
import pytest

from dolfbuoy.formats.to_moordyn import Numerics, Start, export
from dolfbuoy.scene import load_scene

ROPE = {"length": 30.0, "line_density": 12.0, "diameter": 0.06, "area": math.pi * 0.05**2 / 4, "axial_stiffness": 3e6}
ROPE |= {"normal_drag": 1.1, "added_mass": 0.9, "tangential_drag": 0.2, "damping": 40.0, "elements": 15}
TAIL = {
    "length": 21.0,
    "line_density": 5.0,
    "diameter": 0.04,
    "axial_stiffness": 2e6,
    "elements": [[10.5, 4], [10.5, 3]],
}
BUOY = {"name": "float", "hull": [[0.0, 1.0], [0.8, 1.0], [0.8, 3.0], [2.0, 3.0]], "mass": 4000.0}
BUOY |= {"center_of_mass": 0.9, "inertia": [4001.0, 4502.0, 5003.0], "normal_drag": 0.8, "added_mass": 0.7}
BUOY |= {"axial_drag": 1.3, "axial_added_mass": 0.4, "fairleads": {"side": [1.5, 0.25, 0.75]}}
SCENE = {
    "title": "made up",
    "gravity": 9.79,
    "sea": {"depth": 31.0, "density": 1013.0},
    "seabed": {"stiffness": 1e5, "friction": 0.3},
    "cable": [
        ROPE | {"name": "low", "from": [40.0, 2.0, -30.0], "to": "knot"},
        TAIL | {"name": "high", "from": "knot", "to": "float.side", "slack": "tension-only"},
    ],
    "joint": [{"name": "knot", "mass": 10.0, "volume": 0.11, "drag_area": 1.2, "added_mass": 0.6}],
    "buoy": [BUOY],
    "time": {"end": 10.0, "step": 0.1},
}
BEGIN = Start({"knot": np.array([17.0, 3.0, -21.0])}, {"float": np.array([5.0, 6.0, -0.5])})
ROPE_OF_ONE = {"cable": {key: value for key, value in ROPE.items() if key != "area"}}


def exported(changes=None, start=BEGIN, numerics=None):
    """Rows of each section, as numbers where they are; options; notes; the Export."""
    found = export(load_scene(SCENE | (changes or {})), start, numerics)
    tables, options, section = {}, {}, None
    for line in found.files["lines.txt"].splitlines()[2:]:
        if line.startswith("---"):
            section = line.strip("- ")
        elif section == "OPTIONS":
            value, name = line.split()
            options[name] = _value(value)
        else:
            tables.setdefault(section, []).append([_value(word) for word in line.split()])
    return {name: rows[2:] for name, rows in tables.items()}, options, [note.text for note in found.notes], found


def _value(word):
    try:
        return float(word)
    except ValueError:
        return word


def close(rows):
    """Rows with numbers to 14 digits."""
    return [[pytest.approx(v, rel=1e-13, abs=1e-13) if isinstance(v, float) else v for v in row] for row in rows]


def test_columns_stand_where_moordyn_reads_them():
    text = exported()[3].files["lines.txt"]
    assert text.startswith("made up\nwritten by dolfbuoy\n--- LINE TYPES ---\n")
    for columns in (
        "TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx",
        "TypeName Diam Mass/m Cd Ca CdEnd CaEnd",
        "ID Attachment X0 Y0 Z0 r0 p0 y0 Mass CG* I* Volume CdA* Ca*",
        "ID RodType Attachment Xa Ya Za Xb Yb Zb NumSegs RodOutputs",
        "ID Attachment X Y Z Mass Volume CdA Ca",
        "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs",
    ):
        assert f"\n{columns}\n" in text


def test_lines():
    """Diam is that of the volume (0.05 m); drag on 0.06 m takes up the difference, along the line over pi besides."""
    tables, _, said, _ = exported()
    assert tables["LINE TYPES"] == close(
        [
            ["type1", 0.05, 12.0, 3e6, 40.0, 0.0, 1.1 * 1.2, 0.9, 0.2 * 1.2 / math.pi, 0.0],
            ["type2", 0.04, 5.0, 2e6, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ]
    )
    assert tables["LINES"] == [[1.0, "type1", 1.0, 2.0, 30.0, 15.0, "-"], [2.0, "type2", 2.0, 3.0, 21.0, 7.0, "-"]]
    for words in ("BA = -1: ", "elements: ", "slack: "):
        assert sum(note.startswith(words) for note in said) == 1


def test_points():
    tables, *_ = exported()
    assert tables["POINTS"] == [
        [1.0, "Fixed", 40.0, 2.0, -30.0, 0.0, 0.0, 0.0, 0.0],
        [2.0, "Free", 17.0, 3.0, -21.0, 10.0, 0.11, 1.2, 0.6],
        [3.0, "Body1", 1.5, 0.25, 0.75, 0.0, 0.0, 0.0, 0.0],
    ]


def test_a_line_without_a_fairlead_ends_on_the_axis():
    tail = SCENE["cable"][1] | {"to": "float"}
    tables, *_ = exported({"cable": [SCENE["cable"][0], tail], "buoy": [BUOY | {"mooring_height": 0.3}]})
    assert tables["POINTS"][2][1:5] == ["Body1", 0.0, 0.0, 0.3]


def test_a_body_and_its_rods():
    """The keel stands 0.9 m below C; faces of diameters 1, 3 - 1 and 3 over those of both rods: 1 + 8 + 9 over
    2 (1 + 9) in area, 1 + 26 + 27 over 2 (1 + 27) in volume; 18 segments over the height of the hull."""
    tables, _, said, _ = exported()
    (body,) = tables["BODIES"]
    assert (
        body
        == close([[1.0, "Free", 5.0, 6.0, -1.4, 0.0, 0.0, 0.0, 4000.0, "0|0|0.9", "4001|4502|5003", 0.0, 0.0, 0.0]])[0]
    )
    ends = [1.3 * 18 / 20, 0.4 * 54 / 56]
    assert tables["ROD TYPES"] == close([["rod1", 1.0, 0.0, 0.8, 0.7, *ends], ["rod2", 3.0, 0.0, 0.8, 0.7, *ends]])
    assert tables["RODS"] == [
        [1.0, "rod1", "Body1", 0.0, 0.0, 0.0, 0.0, 0.0, 0.8, 7.0, "-"],
        [2.0, "rod2", "Body1", 0.0, 0.0, 0.8, 0.0, 0.0, 2.0, 11.0, "-"],
    ]
    assert any(note.startswith("hull: drag and added mass of MoorDyn's rod ends") for note in said)


def test_a_cone_is_cylinders_of_its_volume():
    cone = BUOY | {"hull": [[0.0, 0.0], [2.0, 1.0]], "fairleads": {"side": [0.0, 0.0, 0.0]}}
    tables, _, said, _ = exported({"buoy": [cone]})
    diameters = [row[1] for row in tables["ROD TYPES"]]
    assert diameters == pytest.approx([0.25 * math.sqrt(n / 3) for n in (1, 7, 19, 37)], rel=1e-13)  # (n^3)' of thirds
    assert [row[8] for row in tables["RODS"]] == [0.5, 1.0, 1.5, 2.0]
    assert sum(math.pi / 4 * d**2 * 0.5 for d in diameters) == pytest.approx(math.pi / 12 * 2.0, rel=1e-13)
    assert any(note.startswith("hull: MoorDyn has no cones") for note in said)


def test_options():
    """A bed of damping ratio 1: 2 sqrt(k d m) over d of the line for which it is largest."""
    _, options, said, found = exported()
    damping = 2 * math.sqrt(1e5 * 0.06 * 12.0) / 0.06
    assert found.step == pytest.approx(0.8 * min(2.0 * math.sqrt(12 / 3e6), 3.0 * math.sqrt(5 / 2e6)) / 2, rel=1e-13)
    assert options == {
        "dtM": pytest.approx(found.step, rel=1e-13),
        "tScheme": "RK2",
        "writeLog": 0.0,
        "g": 9.79,
        "rho": 1013.0,
        "WtrDpth": 31.0,
        "kBot": 1e5,
        "cBot": pytest.approx(damping, rel=1e-13),
        "FrictionCoefficient": 0.3,
        "TmaxIC": 0.0,
        "disableOutput": 1.0,
        "disableOutTime": 1.0,
    }
    assert sum(note.startswith("seabed.") for note in said) == 2


def test_numerics():
    tables, options, _, found = exported(numerics=Numerics("RK4", 1e-3, 3))
    assert (options["dtM"], options["tScheme"], found.step) == (1e-3, "RK4", 1e-3)
    assert [row[5] for row in tables["LINES"]] == [45.0, 21.0]
    assert exported(numerics=Numerics(segments=3))[3].step == pytest.approx(exported()[3].step / 3, rel=1e-13)


def test_without_a_bed_moordyns_is_far_away_and_without_water_there_is_none():
    _, options, said, _ = exported({"seabed": None})
    assert (options["WtrDpth"], options["kBot"], options["cBot"]) == (310.0, 0.0, 0.0)
    assert any(note.startswith("sea.depth: WtrDpth is 10 times it") for note in said)
    _, options, _, _ = exported({"seabed": None, "sea": None})
    assert (options["WtrDpth"], options["rho"]) == (1e4, 0.0)


def test_a_line_without_stretch_and_a_table():
    """EA is 1e4 times its weight in air; of a table the slope at 0."""
    line = ROPE_OF_ONE["cable"] | {"anchor": [0.0, 0.0, -29.0], "damping": 0.0}
    tables, _, said, _ = exported({"cable": line | {"axial_stiffness": math.inf}, "joint": None})
    assert tables["LINE TYPES"][0][3] == pytest.approx(1e4 * 12.0 * 9.79 * 30.0, rel=1e-13)
    assert any(note.startswith("axial_stiffness: MoorDyn has no inextensible") for note in said)
    table = [[-0.1, -100.0], [0.0, 0.0], [0.1, 5000.0]]
    tables, _, said, _ = exported({"cable": line | {"axial_stiffness": table}, "joint": None})
    assert tables["LINE TYPES"][0][3] == pytest.approx(1000.0, rel=1e-13)
    assert any(note.startswith("axial_stiffness: of a table") for note in said)


@pytest.mark.parametrize(
    ("top", "point"),
    [
        ({"kind": "fixed", "position": [1.0, 2.0, 3.0]}, ["Fixed", 1.0, 2.0, 3.0]),
        ({"kind": "prescribed", "position": [1.0, 2.0, 3.0], "velocity": [1.0, 0.0, 0.0]}, ["Coupled", 1.0, 2.0, 3.0]),
    ],
)
def test_an_end_that_is_held(top, point):
    only = {"buoy": None, "joint": None, "cable": ROPE_OF_ONE["cable"] | {"anchor": [0.0, 0.0, -29.0], "top": top}}
    tables, _, _, found = exported(only)
    assert tables["POINTS"][0][1:5] == ["Fixed", 0.0, 0.0, -29.0]
    assert tables["POINTS"][1][1:5] == point
    assert len(found.driven) == (point[0] == "Coupled")


def test_what_has_no_place_is_said():
    buoy = BUOY | {"rotational_damping": 3.0, "wave_damping": [1.0, 2.0], "rotational_added_mass": 0.1}
    buoy |= {
        "disk_averages": True,
        "initial": {"buoy_velocity": [1.0, 0.0, 0.0]},
        "external_force": {"force": [1, 0, 0]},
    }
    grown = SCENE["cable"][0] | {"marine_growth": [[-31.0, 1.1, 1.2]], "tangential_froude_krylov": False}
    parted = SCENE["cable"][1] | {"fails_at": {"time": 5.0}}
    bed = SCENE["seabed"] | {"slope": [0.01, 0.0]}
    _, _, said, _ = exported({"buoy": [buoy], "cable": [grown, parted], "seabed": bed})
    for words in (
        "buoy.rotational_damping",
        "buoy.wave_damping",
        "buoy.rotational_added_mass",
        "buoy.disk_averages",
        "initial.buoy_velocity",
        "[external_force]",
        "marine_growth",
        "tangential_froude_krylov",
        "fails_at",
        "seabed.slope",
    ):
        assert sum(note.startswith(words) for note in said) == 1, words


def test_a_sinker_that_drags_is_fixed_and_a_current_steady():
    """Also where nothing else is held, of which the table of a wave in space is made."""
    cable = ROPE | {"anchor": [1.0, 2.0, -31.0], "to": "float"}
    sinker = {"weight": 1e3, "friction": 0.5, "density": 2000.0, "drags": True}
    current = {"speed": 0.5, "over_time": [[0.0, 1.0, 0.0], [9.0, 2.0, 0.0]]}
    sea = {"depth": 31.0, "tide": [[0.0, 0.0], [9.0, 1.0]]}
    tables, _, said, _ = exported(
        {"cable": cable, "joint": None, "anchor": sinker, "current": current, "sea": sea} | WAVE
    )
    assert tables["POINTS"][0][1:5] == ["Fixed", 1.0, 2.0, -31.0]
    for words in ("anchor.drags", "current: MoorDyn's is steady", "sea.tide: "):
        assert sum(note.startswith(words) for note in said) == 1, words


WAVE = {"waves": {"amplitude": 0.7, "period": 4.0, "direction_deg": 30.0, "phase_deg": 60.0}}


def test_a_wave_is_one_component_of_a_spectrum():
    """a exp(-i phase) and the direction in radians at omega = pi/2, among 64 steps to a period; it lasts ceil(10/4) + 1
    periods."""
    _, options, said, found = exported(WAVE)
    rows = np.loadtxt(found.files["wave_frequencies.txt"].splitlines())
    assert options["WaveKin"] == 2
    assert rows.shape == (4 * 64 // 2 + 1, 4)
    assert rows[:, 0] == pytest.approx(np.arange(129) * math.pi / 2 / 4, rel=1e-12)
    assert rows[4, 1:] == pytest.approx([0.7 * 0.5, -0.7 * math.sqrt(0.75), math.pi / 6], rel=1e-12)
    assert not rows[np.arange(129) != 4, 1:].any()
    assert any(note.startswith("waves.ramp") for note in said)


def test_the_table_of_a_wave_in_space():
    """64 points to a wave length (deep water: g T^2/(2 pi) = 24.9 m, tanh 1), and half one beyond what is held."""
    wave = 9.79 * 4.0**2 / (2 * math.pi)
    _, _, _, found = exported({"waves": WAVE["waves"] | {"direction_deg": 0.0}})
    lines = found.files["water_grid.txt"].splitlines()
    x, y, z = (np.array([float(word) for word in lines[k].split()]) for k in (4, 6, 8))
    assert (lines[3], lines[5], lines[7]) == ("1", "1", "1")
    assert [x[0], x[-1]] == pytest.approx([40 - wave / 2, 40 + wave / 2], rel=1e-3)
    assert np.diff(x) == pytest.approx(wave / 64, rel=1e-3)
    assert y.tolist() == [-1e4, 1e4]
    assert (z[0], z[-1]) == (-31.0, 0.0)
    near = z > -wave / 2 + 1e-6
    assert near.sum() == 32  # as fine half a wave length down, twelve points to the bed
    assert np.diff(z[near]) == pytest.approx(wave / 64, rel=1e-3)
    assert len(z) == 32 + 11


def test_a_current():
    """Of a power law, which ends at 1e-3 of the depth, at 21 depths; of a table at its own; towards its direction."""
    current = {"speed": 0.9, "direction_deg": 60.0, "profile": "power", "exponent": 0.25}
    _, options, _, found = exported({"current": current})
    rows = np.loadtxt(found.files["current_profile.txt"].splitlines()[3:])
    assert options["Currents"] == 1
    assert rows[:, 0] == pytest.approx(np.linspace(-31.0, 0.0, 21), abs=1e-12)
    speed = 0.9 * np.maximum(1 + rows[:, 0] / 31.0, 1e-3) ** 0.25
    assert rows[:, 1:] == pytest.approx(np.outer(speed, [0.5, math.sqrt(0.75), 0.0]), abs=1e-12)
    _, _, _, found = exported({"current": {"profile": [[-31.0, 0.1], [-5.0, 0.4], [0.0, 0.8]]}})
    rows = np.loadtxt(found.files["current_profile.txt"].splitlines()[3:])
    assert rows.tolist() == [[-31.0, 0.1, 0.0, 0.0], [-5.0, 0.4, 0.0, 0.0], [0.0, 0.8, 0.0, 0.0]]


def test_tensions_at_ends_are_carried_on_from_the_nodes_beside_them():
    """Of a line that hangs straight the tension grows linearly: 7 N a segment, here with 5, 3 and 2 of them."""
    from types import SimpleNamespace

    from dolfbuoy.formats.moordyn_run import _ends

    def ends_of(last):
        def tension(_, node):
            return 0.0, 0.6 * (10 + 7 * node), 0.8 * (10 + 7 * node)

        return _ends(SimpleNamespace(GetLineN=lambda _: last, GetLineNodeTen=tension), None)

    assert ends_of(5) == pytest.approx((10.0, 45.0), rel=1e-12)
    assert ends_of(3) == pytest.approx((10.0, 31.0), rel=1e-12)
    assert ends_of(2) == pytest.approx((17.0, 17.0), rel=1e-12)  # only one node between the ends


def test_moordyn_runs_what_is_exported():
    """A taut line between two places, one above the other, in air: its ends differ by its weight, m g L."""
    pytest.importorskip("moordyn")
    from dolfbuoy.formats.moordyn_run import run

    top = {"kind": "fixed", "position": [0.0, 0.0, 0.5]}
    line = {"length": 20.0, "line_density": 12.0, "diameter": 0.06, "axial_stiffness": 1e5, "elements": 20}
    line |= {"anchor": [0.0, 0.0, -20.0], "top": top}
    found = run(export(load_scene({"gravity": 9.79, "cable": line})), 10.0)
    low, high = found.tension[-1, 0]
    assert high - low == pytest.approx(12.0 * 9.79 * 20.0, rel=1e-4)
    assert (high + low) / 2 == pytest.approx(1e5 * 0.5 / 20.0, rel=1e-9)
    assert found.t[-1] == pytest.approx(10.0, abs=0.05)


def test_a_line_without_a_diameter_and_without_an_area():
    """In air nothing asks for one: a thin line without drag, not one of a metre."""
    rope = {
        key: value for key, value in ROPE.items() if key in ("length", "line_density", "axial_stiffness", "elements")
    }
    scene = {"gravity": 9.8, "cable": rope | {"from": [0.0, 0.0, 5.0], "to": [3.0, 0.0, 6.0]}}
    text = export(load_scene(scene), Start({}, {})).files["lines.txt"]
    (row,) = (line.split() for line in text.splitlines() if line.startswith("type1"))
    assert [float(word) for word in row[1:3]] == [1e-3, ROPE["line_density"]]
    assert [float(word) for word in row[6:10]] == [0.0, 0.0, 0.0, 0.0]
