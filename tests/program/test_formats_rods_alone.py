"""MoorDyn rods and tables at limits: floats, bars, braces at the surface, bending lines on floats, and discretisation.

Source: MoorDyn's manual, "Rods" and "Input Files"; Archimedes, rotations and grids by hand.
"""

import math

import numpy as np
import pytest
from test_formats_rods import HUNG, read, written

from dolfbuoy.formats import moordyn_rods, moordyn_water
from dolfbuoy.formats.to_moordyn import export
from dolfbuoy.scene import load_scene

FLOAT = "float 1.0 310"
ALONE = written(
    RODS=["1 float Free -1 0 -4 -1 0 4 8 -"],
    POINTS=["1 Fixed -5 0 -60 0 0 0 0"],
    LINES=["1 rope 1 R1A 60 20 -"],
)


DENSE = 1025.0 * math.pi / 4  # of the water in its place [kg/m]


@pytest.mark.parametrize(("mass", "sections"), [(math.nextafter(DENSE, 0), "buoy"), (DENSE, "joint")])
def test_a_free_rod_floats_or_is_a_bar(mass, sections):
    """It is a buoy if it is lighter than its water."""
    scene, _ = read(ALONE.replace(FLOAT, f"float 1.0 {mass!r}"))
    assert [name for name in ("buoy", "joint") if name in scene] == [sections]
    assert len(scene["cable"]) == (1 if sections == "buoy" else 2)


@pytest.mark.parametrize(
    ("b", "stands"), [([3, 4, 5], False), ([3, 4, 5.01], True), ([3, 4, -5.01], True), ([0, 0, 1], True)]
)
def test_a_rod_stands_if_it_is_steeper_than_45_degrees(b, stands):
    assert moordyn_rods._stands([np.zeros(3), np.array(b, dtype=float)]) is stands


@pytest.mark.parametrize(
    ("top", "segments", "count"), [(-0.1, 5, 1), (0.0, 5, 5), (0.5, 5, 5), (0.5, 0, 1), (0.5, 1, 1)]
)
def test_a_brace_at_the_surface_is_a_bar_for_each_segment(top, segments, count):
    """Of the body at 2 m below it; deeper down it is one."""
    text = written(
        BODIES=["1 Free 0 0 -2 0 0 0 3000 0|0|-2 2001|2001|2001 0.5 1.0 0.7"],
        RODS=[f"4 float Body1 3 0 -4 3 0 {top + 2} {segments} -", "5 float Body1 -3 0 -4 -3 0 -3 7 -"],
        POINTS=["1 Fixed 60 0 -60 0 0 0 0", "2 Body1 3 0 -4 0 0 0 0"],
        LINES=["1 rope 1 2 80.5 20 -"],
    )
    scene, _ = read(text)
    bars = [cable for cable in scene["cable"] if cable["name"].startswith("rod4")]
    names = ["rod4"] if count == 1 else [f"rod4s{k}" for k in range(1, count + 1)]
    ends = ["body1.rod4a", *(f"body1.rod4s{k}" for k in range(1, count)), "body1.rod4b"]
    assert [cable["name"] for cable in bars] == names
    assert [cable["from"] for cable in bars] == ends[:-1]
    assert [cable["to"] for cable in bars] == ends[1:]
    assert [cable["length"] for cable in bars] == pytest.approx([(6 + top) / count] * count, rel=1e-13)
    heights = [scene["buoy"][0]["fairleads"][end.partition(".")[2]][2] for end in ends]
    np.testing.assert_allclose(np.diff(heights), (6 + top) / count, rtol=1e-12)
    assert sum(cable["name"] == "rod5" for cable in scene["cable"]) == 1


@pytest.mark.parametrize(
    ("ends", "key", "sign"),
    [("R1B 1", "from_end", 1), ("R1A 1", "from_end", -1), ("1 R1A", "to_end", 1), ("1 R1B", "to_end", -1)],
)
def test_a_line_that_bends_on_what_floats(ends, key, sign):
    """Its direction is in the frame of the buoy, whose axis a leaning rod is."""
    text = written(
        EI=1e4,
        BODIES=["1 Free 0 0 -2 0 0 0 3000 0|0|0 2001|2001|2001 0 0 0"],
        RODS=["1 float Body1 -1.5 0 -2 1.5 0 2 8 -"],
        POINTS=["1 Fixed 12 3 -60 0 0 0 0"],
        LINES=[f"1 rope {ends} 61.5 20 -"],
    )
    scene, _ = read(text)
    assert [buoy["name"] for buoy in scene["buoy"]] == ["body1"]
    np.testing.assert_allclose(scene["cable"][0][key]["direction"], [0.0, 0.0, sign], atol=1e-14)


@pytest.mark.parametrize(("z", "direction"), [(-3.001, [0.0, 0.0, -1.0]), (-3, None)])
def test_a_line_that_bends_on_a_short_rod(z, direction):
    """A millimetre has a direction, a rod without length none."""
    text = written(
        EI=1e4,
        RODS=[f"1 steel Fixed 1 2 -3 1 2 {z} 10 -"],
        POINTS=["1 Fixed 12 3 0.25 0 0 0 0"],
        LINES=["1 rope R1B 1 41.5 20 -"],
    )
    (cable,) = read(text)[0]["cable"]
    assert cable.get("from_end", {}).get("direction") == direction


def test_rods_that_hold_no_line():
    """What stands still needs none; what moves is said, once."""
    idle = ["7 steel Free 0 0 -20 6 0 -20 10 -", "8 steel Fixed 0 0 -30 6 0 -30 10 -"]
    text = HUNG.replace("--- POINTS", "\n".join([*idle, "--- POINTS"]))
    before, said = read(HUNG)
    after, more = read(text)
    assert after == before
    assert [note.partition(": ")[2] for note in more if "rod1" not in note] == [
        "rod7 is a bar here: a cable of one element that does not stretch",
        "rod7 holds no line and was left out",
    ]
    assert sum("rod1" in note for note in more) == len(said) == 1


# -- what is written ---------------------------------------------------------------------------------------------------


LINE = {"length": 60.0, "line_density": 1.0, "diameter": 0.1, "axial_stiffness": 1e6}


def test_rods_and_lines_have_two_segments_at_least():
    """18 segments over 4.5 m, so that 0.25 m would have one."""
    hull = [[0.0, 1.0], [0.25, 1.0], [0.25, 2.0], [4.5, 2.0]]
    scene = {
        "sea": {"depth": 40.0},
        "cable": LINE | {"anchor": [30.0, 0.0, -40.0], "to": "float", "elements": 1},
        "buoy": {"name": "float", "hull": hull, "mass": 500.0},
    }
    found = export(load_scene(scene))
    rows = [line.split() for line in found.files["lines.txt"].splitlines()]
    assert [row[9] for row in rows if row[1:3] in (["rod1", "Body1"], ["rod2", "Body1"])] == ["2", "17"]
    assert [row[5] for row in rows if row[:2] == ["1", "type1"]] == ["2"]
    assert found.step == pytest.approx(0.8 * 30.0 * math.sqrt(1.0 / 1e6) / 2, rel=1e-13)


@pytest.mark.parametrize("angle", [90.0, 60.0, 240.0])
def test_the_table_of_a_wave_in_any_direction(angle):
    """Points as far apart as 64 to a wave along it; of shallow water all is as fine."""
    top = {"kind": "fixed", "position": [10.0, 40.0, 0.0]}
    scene = load_scene(
        {
            "sea": {"depth": 6.0},
            "cable": LINE | {"anchor": [-5.5, 1.0, -6.0], "top": top},
            "waves": {"amplitude": 0.1, "wavelength": 20.0, "period": 3.6, "direction_deg": angle},
        }
    )
    text = moordyn_water._grid(scene, scene.network, scene.waves, 6.0)
    x, y, z = (np.array(line.split(), float) for line in text.splitlines()[4::2])
    if angle == 90.0:
        assert x.tolist() == [-1e4, 1e4]
    else:
        assert (x[0], x[-1], len(x)) == (-15.5, 20.0, math.ceil(35.5 * 0.5 * 64 / 20) + 1)
    share = math.sin(math.radians(60.0)) if angle != 90.0 else 1.0
    assert (y[0], y[-1], len(y)) == (-9.0, 50.0, math.ceil(59 * share * 64 / 20) + 1)
    np.testing.assert_allclose(z[::-1][:20], -20 / 64 * np.arange(20), atol=1e-6)
    assert (len(z), z[0]) == (31, -6.0)
