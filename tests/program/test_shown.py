"""What is shown is what is recorded: curves of figures, numbers of summaries, tables and pictures, with their units.

Source: a made-up record whose quantities all differ, read back from the figures and tables.
"""

import math
import re

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged, rotation_matrix
from scipy.spatial.transform import Rotation

from dolfbuoy import load_scene, solve_static
from dolfbuoy.check import check
from dolfbuoy.model.sea import wavenumber
from dolfbuoy.results import figures
from dolfbuoy.results.observe import cone_angle, roll_pitch_yaw
from dolfbuoy.results.record import FIXED, FRAMES, SERIES
from dolfbuoy.results.snapshot import Instant, instant, snapshot
from dolfbuoy.results.summary import summary, warnings

PERIOD = 5.0
SCENE = load_scene(
    merged(
        MOORED,
        waves={"amplitude": 0.7, "period": PERIOD, "direction_deg": 30.0, "phase_deg": 20.0},
        wind={"speed_10m": 12.0, "direction_deg": 70.0, "area": 1.7, "height": 2.6, "drag_coefficient": 1.1},
        external_force={"force": [300.0, -400.0, 1200.0], "height": 2.0},
        time={"end": 40.0, "step": 0.1, "scheme": "backward-euler"},
    )
)


def made_up(end=40.0):
    """A record of which nothing equals anything else; a whole number of rows per frame."""
    t = np.arange(0, end + 1e-9, 0.1)
    frame = t[::4]
    phase, nodes = 2 * math.pi * t / PERIOD, np.linspace(0, 22, 7)
    C = np.column_stack([4 + 2 * np.cos(phase) + 0.05 * t, 1.5 * np.sin(phase), 0.4 + 0.3 * np.sin(phase + 1)])
    half = np.radians(5 + 3 * np.sin(phase))
    q4 = np.column_stack([np.cos(half), 0.6 * np.sin(half), 0.8 * np.sin(half), 0 * t])
    top = 7000 + 900 * np.sin(phase + 0.3) + 2 * t
    series = {
        "time_step": np.full(len(t), 0.1),
        "newton_iterations": 2 + np.arange(len(t)) % 3,
        "tension_top": top,
        "tension_anchor": 3000 + 500 * np.cos(phase) - t,
        "anchor_force": np.column_stack([-900 + 80 * np.sin(phase), 200 + t, -2500 - 700 * np.cos(phase)]),
        "buoy_position": C,
        "buoy_orientation": q4,
        "cone_angle": np.degrees(2 * half),
        "surface_elevation": 0.7 * np.cos(phase - 0.4),
    }
    shape = np.stack([nodes / 22 * C[::4, i, None] for i in range(3)], axis=-1)
    shape[..., 2] = -20 + nodes / 22 * (20.4 + 0.2 * np.sin(2 * math.pi * frame / 7)[:, None])
    frames = {"cable_position": shape, "cable_tension": np.linspace(3000, 7000, 6) + frame[:, None]}
    data = {name: (("time", *SERIES[name][0]), value) for name, value in series.items()}
    data |= {name: (("frame", *FRAMES[name][0]), value) for name, value in frames.items()}
    coordinates = {"time": t, "frame": frame, "s": ("node", nodes), "xyz": ["x", "y", "z"]}
    return xr.Dataset(data, coordinates, attrs={"failed_steps": 7, "wall_time_s": 12.5})


RECORD = made_up()


def curves(axes):
    """Label -> (x, y) of the lines of a panel; a name of matplotlib's own for what has no label."""
    return {line.get_label(): np.array(line.get_data()) for line in axes.lines}


# -- figures -----------------------------------------------------------------------------------------------------------


def test_tension():
    """Both ends in kN over the whole time, and enlarged over the last three periods."""
    whole, end = figures.tension(RECORD, SCENE).axes
    assert whole.get_ylabel() == "tension [kN]"
    assert end.get_xlabel() == "time [s]"
    late = RECORD.time.values >= 40 - 3 * PERIOD
    for axes, rows in ((whole, slice(None)), (end, late)):
        found = curves(axes)
        for label, name in (
            (r"$|\mathbf{T}_{bnd}|$, upper end", "tension_top"),
            ("$T_h(0)$, anchor", "tension_anchor"),
        ):
            np.testing.assert_allclose(found[label], [RECORD.time[rows], RECORD[name][rows] / 1000])


def test_heave_and_cone_angle():
    """Height of C, of the water, and their difference; the angle in degrees."""
    z, water = RECORD.buoy_position.values[:, 2], RECORD.surface_elevation.values
    heights, difference, _ = figures.heave(RECORD, SCENE).axes
    found = curves(heights)
    np.testing.assert_allclose(found["$r_{C,z}$, centre of mass"], [RECORD.time, z])
    np.testing.assert_allclose(found["$z_w$, water surface"], [RECORD.time, water])
    np.testing.assert_allclose(difference.lines[0].get_ydata(), z - water)
    assert [axes.get_ylabel() for axes in (heights, difference)] == ["height [m]", "$r_{C,z} - z_w$ [m]"]
    (angle, _) = figures.cone_angle(RECORD, SCENE).axes
    np.testing.assert_allclose(angle.lines[0].get_data(), [RECORD.time, RECORD.cone_angle])
    assert angle.get_ylabel() == "cone angle [°]"


def test_trajectory_and_orbit():
    """The path from above and from the side, its last period set off; the same period alone."""
    x, late = RECORD.buoy_position.values, RECORD.time.values >= 40 - PERIOD - 1e-6
    for axes, (i, j) in zip(figures.trajectory(RECORD, SCENE).axes, ((0, 1), (0, 2)), strict=True):
        assert (axes.get_xlabel(), axes.get_ylabel()) == (f"{'xyz'[i]} [m]", f"{'xyz'[j]} [m]")
        np.testing.assert_allclose(axes.lines[0].get_data(), x[:, [i, j]].T)
        found = curves(axes)
        np.testing.assert_allclose(found["last period"], x[late][:, [i, j]].T)
        np.testing.assert_allclose(found["start"].ravel(), x[0, [i, j]])
        np.testing.assert_allclose(found["end"].ravel(), x[-1, [i, j]])
    (space,) = figures.orbit(RECORD, SCENE).axes
    paths = [np.array(line.get_data_3d()) for line in space.lines]
    assert any(path.shape == x[late].T.shape and np.allclose(path, x[late].T) for path in paths)
    marks = {line.get_label(): np.ravel(line.get_data_3d()) for line in space.lines}
    np.testing.assert_allclose(marks["start of the period"], x[late][0])
    np.testing.assert_allclose(marks["end"], x[-1])


def test_a_constant_is_a_line_in_the_middle():
    """Rounding noise does not fill a panel."""
    record = RECORD.copy(deep=True)
    record["cone_angle"] = 7.0 + 1e-9 * np.cos(record.time)
    low, high = figures.cone_angle(record, SCENE).axes[0].get_ylim()
    assert (low + high) / 2 == pytest.approx(7.0, abs=1e-6)
    assert 1e-3 * (1 - 1e-9) < high - low < 0.1


def test_a_planar_path_is_shown_from_its_side():
    record = RECORD.copy(deep=True)
    record.buoy_position[:, 0] = 3.0
    side, time = figures.trajectory(record, SCENE).axes
    np.testing.assert_allclose(side.lines[0].get_data(), record.buoy_position.values[:, [1, 2]].T)
    np.testing.assert_allclose(time.lines[0].get_data(), [record.time, record.buoy_position[:, 1]])
    assert (side.get_xlabel(), time.get_xlabel(), time.get_ylabel()) == ("y [m]", "time [s]", "y [m]")


def test_shapes():
    """Cables of the last period, each with the colour of its time."""
    axes = figures.shapes(RECORD, SCENE).axes[0]
    (lines,) = axes.collections
    times = np.array(lines.get_array())
    assert len(times) == 13
    assert times[0] == pytest.approx(40 - PERIOD, abs=0.21)
    assert times[-1] == pytest.approx(40)
    for time, segment in zip(times, lines.get_segments(), strict=True):
        row = RECORD.cable_position.sel(frame=time, method="nearest")
        assert float(row.frame) == pytest.approx(time)
        np.testing.assert_allclose(segment, row.values[:, [0, 2]])


def test_what_a_snapshot_knows():
    """Points of the axis lie at their heights above the keel, forces where they act; the legend has their numbers."""
    now = instant(RECORD, SCENE, 12.1)
    assert now.time == pytest.approx(12.0)
    row = RECORD.sel(time=12.0, method="nearest")
    R, C = rotation_matrix(row.buoy_orientation.values), row.buoy_position.values
    center = (400 * 0.5 + 150 * 2 + 150 * 3) / 700
    np.testing.assert_allclose(now.cable, RECORD.cable_position.sel(frame=12.0, method="nearest"))
    np.testing.assert_allclose(now.masses, [C + (h - center) * R[:, 2] for h in (2.0, 3.0)])
    (name, place, force, _), (wind, at, push, _) = now.forces()
    assert (name, wind) == ("external force", "wind force")
    np.testing.assert_allclose(place, C + (2.0 - center) * R[:, 2])
    np.testing.assert_allclose(force, [300, -400, 1200])
    np.testing.assert_allclose(at, C + (2.6 - center) * R[:, 2])
    k = wavenumber(SCENE)
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    ramp = SCENE.waves.ramp
    assert ramp <= 12.0
    theta = k * (c * at[0] + s * at[1]) - 2 * math.pi / PERIOD * now.time + math.radians(20)
    speed = 12.0 * ((at[2] - 0.7 * math.cos(theta)) / 10) ** (1 / 7)
    size = 0.5 * 1.1 * SCENE.wind.air_density * 1.7 * speed**2
    angle = math.radians(70)
    np.testing.assert_allclose(push, size * np.array([math.cos(angle), math.sin(angle), 0.0]), rtol=1e-12)
    figure = snapshot(RECORD, SCENE, 12.1)
    whole, detail = figure.axes
    ends = [C + (h - center) * R[:, 2] for h in (0.0, 3.0)]  # keel and highest mass
    for i, limits in enumerate((detail.get_xlim(), detail.get_ylim(), detail.get_zlim())):
        assert np.mean(limits) == pytest.approx((ends[0][i] + ends[1][i]) / 2)
        assert np.ptp(limits) > 3.0
    assert whole.get_zlim()[0] <= -20 < whole.get_zlim()[1] - 20
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "external force, 1.3 kN" in labels
    assert f"wind force, {size:.3g} N" in labels
    (shown,) = (label for label in labels if label.startswith("water, up to"))
    speeds = [float(number) for number in re.findall(r"\d+\.?\d*(?:e[+-]\d+)?", shown)]
    surface = 0.5 + 0.7 * 2 * math.pi / PERIOD / math.tanh(k * 20)  # of the current and of a crest: none is faster
    assert all(0.5 < v <= 1.01 * surface for v in speeds)


def test_an_instant_without_a_buoy_has_no_forces():
    assert Instant(SCENE, 0.0, RECORD.cable_position.values[0], None, None).forces() == []


# -- numbers -----------------------------------------------------------------------------------------------------------


def test_summary():
    rows = {name: (value, unit) for name, value, unit in summary(RECORD, SCENE)}

    def extremes(values, unit):
        return f"{float(values.min()):.4g} ... {float(values.max()):.4g}", unit

    C, water = RECORD.buoy_position, RECORD.surface_elevation
    assert rows["tension at the top |T_bnd|"] == extremes(RECORD.tension_top / 1000, "kN")
    assert rows["force at the anchor"] == extremes(np.linalg.norm(RECORD.anchor_force, axis=1) / 1000, "kN")
    assert rows["uplift at the anchor"] == extremes(-RECORD.anchor_force[:, 2] / 1000, "kN")
    for i, axis in enumerate("xyz"):
        assert rows[f"{axis} of C"] == extremes(C[:, i], "m")
    assert rows["z of C over the water"] == extremes(C[:, 2] - water, "m")
    assert rows["cone angle"] == extremes(RECORD.cone_angle, "deg")
    assert rows["steps, of which retried"] == ("400, 7", "")
    iterations = RECORD.newton_iterations.values[1:]
    assert rows["Newton iterations per step"] == (f"{iterations.sum() / 400:.2f}", "")
    assert (rows["wall time"], rows["speed"]) == (("12.5", "s"), ("3.2", "x real time"))
    left = 100 * (1 + (2 * math.pi / PERIOD * 0.1) ** 2) ** (-200)
    assert rows["left by the scheme of a free 5 s motion"] == (f"{left:.1f}", "%")


def test_warnings_have_their_numbers():
    assert warnings(RECORD, SCENE) == ["7 steps failed and were retried with smaller ones."]
    record = RECORD.copy(deep=True)
    record.cable_position[3, 2, 2] = -20.37
    record.cable_tension[5, 1] = -12.5
    said = " ".join(warnings(record, SCENE))
    assert "up to 0.37 m below the sea bed" in said
    assert "smallest tension -12.5 N; element 2 (s = 3.667 ... 7.333 m)" in said


def test_cone_angle_is_the_angle_of_the_axis():
    """In degrees, whatever the spin, accurate near the upright and upside down."""
    rng = np.random.default_rng(3)
    for q4 in [*rng.standard_normal((5, 4)), [1.0, 1e-9, 0, 0], [0.0, 0.6, 0.8, 1e-9]]:
        d = rotation_matrix(q4)[:, 2]
        expected = math.degrees(math.atan2(math.hypot(d[0], d[1]), d[2]))
        assert cone_angle(q4) == pytest.approx(expected, rel=1e-6, abs=1e-12)


def turned(roll, pitch, yaw):
    """Body to world after the yaw about z, the pitch about the new y and the roll about the newest x [deg]."""
    return Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True)


def test_roll_pitch_yaw_make_the_orientation():
    """Each in its range, at any length and sign of the quaternion."""
    rng = np.random.default_rng(5)
    for roll, pitch, yaw in rng.uniform([-180, -90, -180], [180, 90, 180], (50, 3)):
        x, y, z, w = rng.uniform(0.5, 2) * rng.choice([-1, 1]) * turned(roll, pitch, yaw).as_quat()
        assert roll_pitch_yaw([w, x, y, z]) == pytest.approx((roll, pitch, yaw), abs=1e-9)


def test_directions_of_roll_pitch_yaw():
    """Right-handed about x, y, z: y goes up, the top leans to +x, x turns to y."""
    for i, about in enumerate(np.eye(3)):
        q4 = [math.cos(0.1), *(math.sin(0.1) * about)]
        assert roll_pitch_yaw(q4) == pytest.approx(np.degrees(0.2) * np.eye(3)[i], abs=1e-12)
    assert roll_pitch_yaw([0.0, 0.0, 0.0, 1.0]) == (0.0, 0.0, 180.0)
    assert roll_pitch_yaw([0.0, 0.0, 0.0, -1.0]) == (0.0, 0.0, 180.0)


@pytest.mark.parametrize("pitch", [90.0, -90.0])
def test_roll_is_zero_where_the_axes_of_roll_and_yaw_are_one(pitch):
    """Only their sum or difference turns the body then; close by, all three are told apart."""
    for roll, yaw in ((0.0, 30.0), (20.0, 50.0), (-100.0, 130.0), (170.0, -160.0)):
        x, y, z, w = turned(roll, pitch, yaw).as_quat()
        found = roll_pitch_yaw([w, x, y, z])
        assert found[0] == 0.0
        assert found[1] == pytest.approx(pitch, abs=1e-6)
        assert -180 < found[2] <= 180
        assert (turned(*found) * turned(roll, pitch, yaw).inv()).magnitude() < 1e-7
        x, y, z, w = turned(roll, pitch * (1 - 1e-6), yaw).as_quat()
        assert roll_pitch_yaw([w, x, y, z]) == pytest.approx((roll, pitch * (1 - 1e-6), yaw), abs=1e-6)


def test_units_of_the_record():
    """SI, degrees for the one angle."""
    units = {
        "N": "tension_top tension_anchor anchor_force end_tension mooring_force cable_tension",
        "m": "buoy_position mooring_point surface_elevation buoyancy_center submerged_length submerged_diameter "
        "cable_position s s_cell",
        "s": "time time_step frame",
        "kg": "displaced_mass",
        "kg m s-1": "linear_momentum",
        "kg m2 s-1": "angular_momentum",
        "degree": "cone_angle roll pitch yaw",
        "1": "newton_iterations buoy_orientation",
    }
    known = {name: unit for unit, names in units.items() for name in names.split()}
    assert {name: unit for name, (_, unit, _) in {**SERIES, **FRAMES, **FIXED}.items()} == known


# -- tables on the terminal --------------------------------------------------------------------------------------------


def table_rows(text):
    """First cell -> the other cells of what looks like the rows of tables: cells are two blanks apart at least."""
    rows = [[cell for cell in re.split(r"\s{2,}|\s*│\s*", line.strip()) if cell] for line in text.splitlines()]
    return {row[0]: row[1:] for row in rows if len(row) > 1}


def test_tables_on_the_terminal(call, tmp_path):
    """`check` prints its report, and what remains of a motion in per cent; `static` prints what it writes."""
    rows, report = table_rows(call("check", "short")[1]), check(load_scene("short"))
    assert len(report.numbers) > 15
    for name, value, unit, _ in report.numbers:
        assert rows[name][0] == f"{value:.5g}"
        assert unit in rows[name][1] if unit else True, name
    step, end = 0.01, 120.0
    for name, period in report.periods.items():
        left = 100 * (1 + (2 * math.pi / period * step) ** 2) ** (-0.5 * end / step)
        assert rows[name] == [f"{period:.5g}", "s", f"{left:.1f} %"]
    rows, record = table_rows(call("static", "short", "--out", tmp_path)[1]), solve_static("short")
    for name in ("tension_top", "tension_anchor", "buoy_position", "cone_angle", "displaced_mass"):
        text = " ".join(f"{v:.6g}" for v in record[name].values.ravel())
        label = record[name].attrs["long_name"]
        assert rows[label] == [text, record[name].attrs["units"]]
