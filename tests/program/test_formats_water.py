"""Waves, currents and the sea floor from files named by MoorDyn's options, against MoorDyn's own kinematics.

Source: MoorDyn from PyPI (the extra `test`), queried at points and times; numbers by hand.
"""

import math
import re

import numpy as np
import pytest

from dolfbuoy import InputError, load_scene
from dolfbuoy.formats.files import read
from dolfbuoy.model.sea import elevation_at, velocity_at

DEPTH = 50.0
INPUT = """MoorDyn
--- LINE TYPES ---
Name Diam MassDen EA BA EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (N-s) (-) (-) (-) (-) (-)
rope 0.05 5.0 1e4 300 0 1.2 1.0 0 0
--- POINTS ---
ID Attachment X Y Z M V CdA Ca
(-) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 fixed -10 0 -20 0 0 0 0
2 fixed 10 0 -20 0 0 0 0
--- LINES ---
ID LineType AttachA AttachB UnstrLen NumSegs Outputs
(-) (-) (-) (-) (m) (-) (-)
1 rope 1 2 21 4 -
--- OPTIONS ---
50 WtrDpth
0.002 dtM
0 writeLog
0.05 dtWave
0 TmaxIC
MORE
--- need this line ---
"""
GRID = "waves\nx\nkind\n2\n-12 12 13\n2\n-12 12 13\n2\n-50 0 51\n"
OMEGA = 0.2 * np.arange(61)
PARTS = {5: (0.6, 0.3), 6: (-0.2, 0.4)}
SPECTRUM = "".join(f"{w:g} {PARTS.get(i, (0, 0))[0]} {PARTS.get(i, (0, 0))[1]} 0.5\n" for i, w in enumerate(OMEGA))
STEADY = "current\nprofile\nz ux uy uz\n-50 0.1 0.02 0\n-20 0.4 0.3 0\n0 1.0 0.5 0\n"
DYNAMIC = "current\nchanging\n\n\n-50 -10 0\n\n0 0 0 0 0 0 0\n5 0.2 0.5 1.0 0.1 0 -0.3\n60 0.2 0.5 1.0 0.1 0 -0.3\n"
FILES = {
    "2 WaveKin": {"wave_frequencies.txt": SPECTRUM, "water_grid.txt": GRID},
    "7 WaveKin": {"wave_frequencies.txt": SPECTRUM},
    "1 Currents": {"current_profile.txt": STEADY},
    "2 Currents": {"current_profile_dynamic.txt": DYNAMIC},
}


def written(folder, option, files):
    for name, text in files.items():
        (folder / name).write_text(text)
    path = folder / "lines.txt"
    path.write_text(INPUT.replace("MORE", option))
    return path


def imported(folder, option, files):
    """The scene, and what is said but for the proposal of a time."""
    scene, notes = read("moordyn", written(folder, option, files))
    return load_scene(scene), [str(note) for note in notes if "length of a run" not in str(note)]


@pytest.mark.parametrize("option", FILES)
def test_water_is_that_of_moordyn(option, tmp_path):
    moordyn = pytest.importorskip("moordyn")
    scene, said = imported(tmp_path, option, FILES[option])
    assert said == []
    system = moordyn.Create(str(tmp_path / "lines.txt"))
    moordyn.Init(system, [], [])
    waves, t, worst, largest = moordyn.GetWaves(system), 0.0, 0.0, 0.0
    points = np.array([[0.0, 0.0, -5.0], [4.0, -3.0, -12.5], [-8.0, 6.0, -30.0]])
    while t < 9.0:
        moordyn.Step(system, [], [], t, 0.75)
        t += 0.75
        for point in points:
            u, _, zeta, _ = moordyn.GetWavesKin(waves, *point)
            ours = velocity_at(scene, t, point[None])[0]
            worst = max(worst, np.abs(ours - u).max())
            largest = max(largest, np.abs(u).max())
            if "waves" in scene.model_fields_set:
                assert elevation_at(scene, t, point[None])[0] == pytest.approx(zeta, abs=0.02)
    moordyn.Close(system)
    assert largest > 0.2
    assert worst < 0.02 * largest


def test_record_of_the_elevation(tmp_path):
    """As the file has it, of waves along x; between rows of other steps as MoorDyn brings them to dtWave."""
    t = 0.25 * np.arange(64)
    eta = 0.5 * np.sin(math.pi / 4 * t) + 0.1 * np.cos(math.pi / 2 * t)
    rows = [f"{a:g} {b:.12f}\n" for a, b in zip(t, eta, strict=True)]
    scene, said = imported(tmp_path, "3 WaveKin", {"wave_elevation.txt": "".join(rows)})
    assert said == []
    places = np.zeros((64, 3))
    found = [elevation_at(scene, time, place[None])[0] for time, place in zip(t, places, strict=True)]
    np.testing.assert_allclose(found, eta, atol=6e-3)  # of 0.6 m
    k = (math.pi / 4) ** 2 / 9.81
    assert elevation_at(scene, 3.0, np.array([[0.1 / k, 5.0, 0.0]]))[0] == pytest.approx(
        0.5 * math.sin(math.pi / 4 * 3.0 - 0.1) + 0.1 * math.cos(math.pi / 2 * 3.0 - 0.4), abs=6e-3
    )
    scene, said = imported(tmp_path, "3 WaveKin", {"wave_elevation.txt": "".join(rows[:10] + rows[11:])})
    assert said == ["line 21: wave_elevation.txt: its steps are not equal; it is brought to 0.05 s between its rows"]
    assert dict(scene.waves.elevation)[2.5] == pytest.approx((eta[9] + eta[11]) / 2)


def test_current_in_one_direction_is_a_profile(tmp_path):
    """In a grid of depth and time where it turns; what is the same over x and y of a grid in space."""
    text = "a\nb\nc\n0 0.8 0.6 0\n-40 0.4 0.3 0.1\n"
    scene, said = imported(tmp_path, "1 Currents", {"current_profile.txt": text})
    assert said == ["line 21: current_profile.txt: what runs up or down is not carried over"]
    assert scene.current.direction_deg == pytest.approx(math.degrees(math.atan2(0.6, 0.8)))
    assert np.ravel(scene.current.profile) == pytest.approx([-40.0, 0.5, 0.0, 1.0])
    rows = "".join(f"{t} {t} 1 0.2 0.3 0.1 0.1\n" for t in (0, 10, 20))  # u, v and w at two depths
    scene, said = imported(tmp_path, "2 Currents", {"current_profile_dynamic.txt": "a\nb\nc\nd\n-40 0\nf\n" + rows})
    assert said == ["line 21: current_profile_dynamic.txt: what runs up or down is not carried over"]
    assert scene.current.grid[2:4] == [(10.0, -40.0, 10.0, 0.2), (10.0, 0.0, 1.0, 0.3)]
    head = "2 1 2 1\n0 1\n0\n-40 0\n0\n"
    points = [f"{x} 0 {z} 0 {0.1 * (z + 50)} 0.2 0\n" for x in (0, 1) for z in (-40, 0)]
    scene, said = imported(tmp_path, "5 Currents", {"current_profile_4d.txt": head + "".join(points)})
    assert (said, scene.current.grid) == ([], [(0.0, -40.0, 1.0, 0.2), (0.0, 0.0, 5.0, 0.2)])
    points[0] = points[0].replace("0.2", "0.3")
    scene, said = imported(tmp_path, "5 Currents", {"current_profile_4d.txt": head + "".join(points)})
    assert said == [
        "line 21: current_profile_4d.txt: a current that changes over x or y is not carried over; add [current]"
    ]
    assert scene.current is None


OPENFAST = """MoorDyn water
notes
--- WAVES ---
1 WaveKinMod - type
"eta.dat" WaveKinFile - record
0.25 dtWave - step
30 WaveDir - heading
0 - X
0
--- CURRENT ---
1 CurrentMod - type
z-depth x-current y-current
(m) (m/s) (m/s)
0.0 0.9 0.0
150 0.5 0.0
--- need this line ---
"""


def test_water_of_openfast(tmp_path):
    """Depths are counted downwards; the record is named in the file."""
    files = {"water.dat": OPENFAST, "eta.dat": "time elevation\n" + "".join(f"{t} {t % 3}\n" for t in range(12))}
    scene, said = imported(tmp_path, '"water.dat" WaterKin', files)
    assert said == []
    assert scene.current.profile == [(-150.0, 0.5), (0.0, 0.9)]
    assert scene.waves.direction_deg == 30.0
    assert scene.waves.elevation[:3] == [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]


FLOOR = "3 2\n-20 0 30\n-5 5\n" + "".join(f"{x} {y} {-40 + 0.1 * x - 0.2 * y}\n" for x in (-20, 0, 30) for y in (-5, 5))


@pytest.mark.parametrize("option", ["floor.txt SeafloorFile", "./sub/floor.txt SeafloorPath"])
def test_sea_floor(option, tmp_path):
    """A grid of depths, found by its name beside the input too; waves feel its depth at the origin."""
    scene, said = imported(tmp_path, option, {"floor.txt": FLOOR})
    assert said == [
        "line 16: the bed is a grid of depths; sea.depth, which waves feel, is its depth at x = y = 0, 40 m"
    ]
    assert scene.sea.depth == pytest.approx(40.0)
    assert scene.seabed.depths.height(30.0, 5.0) == pytest.approx(-38.0)


@pytest.mark.parametrize(
    ("option", "files", "said"),
    [
        ("3 WaveKin", {}, "WaveKin = 3: there is no file wave_elevation.txt beside the input, and nothing of it is"),
        ("1 WaveKin", {}, "WaveKin = 1: waves come from the program that calls MoorDyn; add [waves]"),
        ("4 WaveKin", {}, "WaveKin = 4: MoorDyn itself has no waves of this kind"),
        ("1 Currents", {}, "Currents = 1: there is no file current_profile.txt beside the input"),
        ("3 Currents", {}, "Currents = 3: MoorDyn itself has no current of this kind"),
        ("SEASTATE WaterKin", {}, "WaterKin = SEASTATE: waves and current come from OpenFAST"),
        ("floor.txt SeafloorFile", {}, "SeafloorFile = floor.txt: there is no such file beside the input"),
        ("../floor.txt SeafloorFile", {}, "SeafloorFile = ../floor.txt: there is no such file beside the input"),
    ],
)
def test_what_is_not_carried_over(option, files, said, tmp_path):
    _, found = imported(tmp_path, option, files)
    assert len(found) == 1
    assert found[0].startswith(f"line 21: {said}")


@pytest.mark.parametrize(
    ("option", "files", "said"),
    [
        ("3 WaveKin", {"wave_elevation.txt": "0 1\n0 2\n"}, "wave_elevation.txt: must hold times that grow."),
        ("3 WaveKin", {"wave_elevation.txt": "0 1 2\n"}, "wave_elevation.txt: must hold lines of 2 numbers."),
        ("7 WaveKin", {"wave_frequencies.txt": "1 0 0\n"}, "must hold an amplitude that is not 0."),
        ("2 WaveKin", {"wave_frequencies.txt": "0 0 0\n2 1 0\n1 1 0\n"}, "must hold frequencies from 0 on, growing."),
        (
            "1 Currents",
            {"current_profile.txt": "a\nb\nc\n0 1 2\n"},
            "current_profile.txt: must hold lines of 4 numbers.",
        ),
        ("f.txt SeafloorFile", {"f.txt": "1 2\n"}, "line 21: f.txt: must hold NX NY, a line of x"),
    ],
)
def test_files_that_are_refused(option, files, said, tmp_path):
    with pytest.raises(InputError, match=re.escape(said)):
        imported(tmp_path, option, files)
