"""A tide: a still water level that rises and falls during a run.

Source: equilibrium of the same mooring at the instantaneous depth; the tideless motion, raised with the water; the
level by hand.
"""

import numpy as np
import pytest
from every_key import shows
from scipy.interpolate import CubicSpline

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.check.report import derived
from dolfbuoy.model.riding import rider_of
from dolfbuoy.model.sea import elevation_at, velocity_at
from dolfbuoy.model.surfacing import surfacing
from dolfbuoy.model.varying import range_of_tide, tide_of
from dolfbuoy.page.pack import exact
from dolfbuoy.page.view import view_of
from dolfbuoy.results.frame import Frames

ROWS = [[0.0, 0.3], [600.0, 1.8], [1200.0, -0.7]]
#: A float on a light line, which follows the water and the current.
MOORED = {
    "sea": {"depth": 20.0, "tide": ROWS},
    "cable": {"length": 22.0, "elements": 3, "diameter": 0.05, "line_density": 2.5, "normal_drag": 1.2},
    "buoy": {"hull": [[0.0, 1.0], [1.0, 1.0]], "mass": 300.0, "center_of_mass": 0.2, "normal_drag": 1.0},
    "current": {"profile": [[-20.0, 0.1], [0.0, 0.8]]},
    "time": {"end": 1200.0, "step": 4.0},
}
#: A small float that begins where the water stands from the first step on.
FREE = {
    "sea": {"depth": 20.0, "tide": [[0.0, 0.0], [0.001, 1.5]]},
    "buoy": {"hull": [[0.0, 0.6], [0.5, 0.6]], "mass": 80.0, "center_of_mass": 0.1, "added_mass": 1.0},
    "initial": {"buoy_position": [0.2, 0.0, 1.35]},
    "time": {"end": 20.0, "step": 0.05},
}
REGULAR = {"height": 0.4, "period": 5.0, "ramp": 2.0}
SEA = {"significant_height": 0.4, "peak_period": 5.0, "spectrum": "jonswap", "components": 20, "ramp": 2.0}


def test_level_is_a_spline_from_that_of_the_start():
    scene = load_scene(MOORED)
    path = CubicSpline(*np.transpose(ROWS), bc_type="clamped")
    for t in (0.0, 40.0, 600.0, 1100.0, 5000.0):
        level = path(np.clip(t, 0.0, 1200.0)) - 0.3
        assert tide_of(scene)(t) == pytest.approx(level, abs=1e-12)
        assert elevation_at(scene, t, np.zeros((2, 3))) == pytest.approx(level, abs=1e-12)
        lifted = velocity_at(scene, t, [[0.0, 0.0, level - 10.0]])
        np.testing.assert_allclose(lifted, [[0.45, 0.0, 0.0]])  # the profile counts from the surface


@shows("sea.tide")
def test_what_follows_a_tide_is_at_rest_in_water_as_deep():
    """At high and at low water."""
    record = dolfbuoy.simulate(load_scene(MOORED))
    levels = record.surface_elevation.values[:, 0]
    assert levels.max() > 1.4
    for row in (0, levels.argmax(), levels.argmin()):
        rest = dolfbuoy.solve_static(load_scene(MOORED | {"sea": {"depth": 20.0 + levels[row]}}))
        place = rest.buoy_position.values[0] + [0.0, 0.0, levels[row]]
        np.testing.assert_allclose(record.buoy_position.values[row, 0], place, atol=5e-3)
        assert record.tension_top.values[row, 0] == pytest.approx(rest.tension_top.values[0], rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("waves", "averaged"),
    [
        (None, False),
        (REGULAR, False),
        (REGULAR, True),
        (SEA, False),
        (SEA, True),
        (REGULAR | {"theory": "stream"}, False),
    ],
)
def test_all_of_the_water_is_lifted(waves, averaged):
    """A float moves as without a tide, 1.5 m higher."""
    damped = {"disk_averages": averaged, "normal_drag": 1.0, "axial_drag": 1.0, "wave_damping": [400.0, 60.0]}
    scene = FREE | {"buoy": FREE["buoy"] | damped} | ({"waves": waves} if waves else {})
    low = scene | {"sea": {"depth": 20.0}, "initial": {"buoy_position": [0.2, 0.0, -0.15]}}
    high, low = (dolfbuoy.simulate(load_scene(one)) for one in (scene, low))
    lifted = high.buoy_position.values[:, 0] - low.buoy_position.values[:, 0]
    assert np.ptp(low.buoy_position.values[:, 0, 2]) > 0.01
    np.testing.assert_allclose(lifted, np.broadcast_to([0.0, 0.0, 1.5], lifted.shape), atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("waves", [REGULAR, SEA])
def test_a_line_is_dry_where_the_water_has_fallen(waves):
    """A line through the surface between held ends: its end forces at low water are those of both ends 1 m higher."""
    line = {"length": 6.0, "elements": 12, "diameter": 0.1, "line_density": 20.0, "normal_drag": 1.2, "added_mass": 1.0}
    ends = {"anchor": [0.0, 0.0, -3.0], "top": {"kind": "fixed", "position": [2.0, 0.0, 2.5]}}
    scene = {"sea": {"depth": 20.0}, "cable": line | ends, "waves": waves, "time": {"end": 90.0, "step": 0.1}}
    fallen = scene | {"sea": {"depth": 20.0, "tide": [[0.0, 1.0], [40.0, 0.0]]}}
    lifted = scene | {
        "cable": line | {"anchor": [0.0, 0.0, -2.0], "top": {"kind": "fixed", "position": [2.0, 0.0, 3.5]}}
    }
    tide, other = (dolfbuoy.simulate(load_scene(one)) for one in (fallen, lifted))
    late = tide.time.values > 60.0
    found, true = tide.tension_top.values[late, 0], other.tension_top.values[late, 0]
    assert np.ptp(true) > 5.0
    np.testing.assert_allclose(found, true, atol=0.01 * np.ptp(true))


def test_a_line_may_leave_the_water_when_it_falls():
    line = {"length": 19.0, "elements": 4, "diameter": 0.05, "line_density": 4.0, "anchor": [0.0, 0.0, -19.0]}
    scene = {"sea": {"depth": 20.0}, "cable": line | {"top": {"kind": "fixed", "position": [3.0, 0.0, -0.5]}}}
    assert surfacing(load_scene(scene)) == []
    assert surfacing(load_scene(scene, sea__tide=[[0.0, 1.0], [60.0, 0.6]])) == []
    assert len(surfacing(load_scene(scene, sea__tide=[[0.0, 1.0], [60.0, 0.4]]))) == 1


def test_a_vessel_rides_the_tide():
    """Its fairlead is as much higher as the water."""
    operators = [[5.0, 0.0, *[0.0, 0.0] * 2, 1.0, 0.0, *[0.0, 0.0] * 3]]
    scene = {
        "sea": {"depth": 20.0},
        "waves": {"height": 0.2, "period": 5.0},
        "vessel": [
            {"name": "ship", "position": [0.0, 0.0, 0.0], "fairleads": {"bow": [1.0, 0.0, -2.0]}, "raos": operators}
        ],
        "cable": [{"length": 22.0, "elements": 3, "diameter": 0.05, "line_density": 2.5, "to": "ship.bow"}],
    }
    place = {}
    for tide in (None, ROWS):
        made = load_scene(scene, sea__tide=tide)
        (piece,) = made.network.pieces
        place[tide is None] = np.array(rider_of(piece.ends[1].top).place("bow", 600.0))
    np.testing.assert_allclose(place[False] - place[True], [0.0, 0.0, 1.5], atol=1e-12)


def test_a_file_is_the_rows_in_it(tmp_path):
    (tmp_path / "tide.csv").write_text("t, z\n0, 0.3\n600, 1.8\n1200, -0.7\n")
    (tmp_path / "scene.toml").write_text(
        "sea = {depth = 20.0, tide = 'tide.csv'}\nbuoy = {hull = [[0, 1], [1, 1]], mass = 300}\n"
    )
    scene = load_scene(tmp_path / "scene.toml")
    assert [list(row) for row in scene.sea.tide] == ROWS
    assert load_scene(scene.to_dict()) == scene


def test_check_says_what_a_tide_is_and_what_is_too_much():
    waves = {"waves": {"height": 0.2, "period": 5.0}}
    report = derived(load_scene(MOORED | waves, sea__tide=[[0.0, 0.0], [100.0, 3.0], [200.0, -2.0]]))
    (row,) = [row for row in report.numbers if row[0] == "range of the tide"]
    top = 10.5 * (14 / 15) ** 2 - 7.5 * (14 / 15) ** 3  # of the curve, by hand: 0.05 m above the row
    assert row[1] == pytest.approx(top + 2.0)
    said = "\n".join(report.warnings)
    steepest = 0.015 + 0.24**2 / (4 * 0.255)  # by hand; the rows are 0.05 m/s apart
    for part in (f"changes by up to {steepest:.2g} m/s", "sea.tide ends at 200 s", "changes the depth by 5.05 m"):
        assert part in said
    assert "tide" not in "\n".join(derived(load_scene(MOORED | waves, sea__tide=None)).warnings)


def test_extremes_between_rows_count():
    """A stand of high water between two rows, over which the curve rises by a quarter of the range."""
    rows = [[0.0, 0.3], [600.0, 2.3], [1200.0, 2.3], [1800.0, 0.3]]
    scene = load_scene(MOORED, sea__tide=rows)
    level = max(map(tide_of(scene), np.linspace(0.0, 1800.0, 1801)))
    assert range_of_tide(scene) == (pytest.approx(0.0, abs=1e-12), pytest.approx(2.5, abs=1e-12))
    assert level == pytest.approx(2.5, abs=1e-9)
    assert any("sea.tide goes 0.5 m beyond its rows" in said for said in derived(scene).warnings)
    assert not any("beyond" in said for said in derived(load_scene(MOORED)).warnings)
    assert range_of_tide(load_scene(MOORED, sea__tide=[[0.0, 1.0], [9.0, 1.0], [20.0, 1.0]])) == (0.0, 0.0)
    with pytest.raises(InputError, match="falls by 22"):
        tide_of(load_scene(MOORED, sea__tide=[[t, -8.8 * (z - 0.3)] for t, z in rows]))


@pytest.mark.parametrize(("rows", "fall"), [([[0.0, 0.0], [9.0, -20.0]], 20), ([[0.0, 3.0], [9.0, -27.0]], 30)])
def test_a_tide_leaves_water(rows, fall, call, tmp_path):
    (tmp_path / "scene.toml").write_text(load_scene(MOORED).to_toml(), encoding="utf-8")
    code, _, error = call("run", tmp_path / "scene.toml", "--set", f"sea.tide={rows}", "--out", tmp_path / "run")
    assert code == 2
    assert f"sea.tide falls by {fall} m from t = 0 on: it must fall by less than sea.depth, 20 m." in " ".join(
        error.split()
    )
    tide_of(load_scene(MOORED, sea__tide=[[0.0, 5.0], [9.0, -14.9]]))


@pytest.mark.parametrize("rows", [[], [[5.0, 2.0]], [[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0, 2.0]], "no such file"])
def test_what_is_no_tide(rows):
    with pytest.raises(InputError, match=r"sea\.tide"):
        load_scene(MOORED, sea__tide=rows)


def test_a_record_and_its_page_have_the_level():
    """The record's scene keeps the rows: it is complete without a file; its page has the level at all its rows."""
    scene = load_scene(FREE, time__end=1.0)
    record = dolfbuoy.simulate(scene)
    assert "tide = [" in record.attrs["scene"]
    rows = np.arange(0, record.sizes["time"], 5)
    packed = view_of(Frames(record, scene), rows)["sea"]["tide"]
    assert packed == exact(np.array([0.0, *[1.5] * (len(rows) - 1)]))
