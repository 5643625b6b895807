"""Printed output agrees with the record: numbers and warnings of summaries, angles, units, and terminal tables.

Source: a made-up record of distinct quantities, rotations with scipy, the rows of the tables.
"""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import merged, rotation_matrix
from made_up import ALONE, PERIOD, RECORD, SCENE
from scipy.spatial.transform import Rotation

from dolfbuoy import SolveError, load_scene, simulate, solve_static
from dolfbuoy.check import check
from dolfbuoy.errors import NoResult
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.attitude import cone_angle, roll_pitch_yaw
from dolfbuoy.results.cautions import cut, steps_of_peak
from dolfbuoy.results.quantities import over
from dolfbuoy.results.series import Series
from dolfbuoy.results.summary import _compressed, static_rows, summary, warnings
from dolfbuoy.studies.sweep import sweep

# -- numbers -----------------------------------------------------------------------------------------------------------


def test_summary():
    rows = {name: (value, unit) for name, value, unit in summary(RECORD, SCENE)}

    def extremes(values, unit):
        return f"{float(values.min()):.4g} ... {float(values.max()):.4g}", unit

    C, water = ALONE.buoy_position, ALONE.surface_elevation
    assert rows["tension at the top"] == extremes(ALONE.tension_top / 1000, "kN")
    assert rows["force at the anchor"] == extremes(np.linalg.norm(ALONE.anchor_force, axis=1) / 1000, "kN")
    assert rows["tension of its elements"] == ("2.1 ... 7.84", "kN")
    assert rows["s of the largest"] == (f"{22 * 11 / 12:.4g}", "m")
    assert rows["uplift at the anchor"] == extremes(-ALONE.anchor_force[:, 2] / 1000, "kN")
    assert rows["horizontal force on the anchor"] == extremes(ALONE.anchor_horizontal / 1000, "kN")
    assert rows["offset of C from the anchor"] == extremes(np.linalg.norm(C[:, :2], axis=1), "m")
    assert rows["freeboard"] == extremes(ALONE.freeboard, "m")
    for i, axis in enumerate("xyz"):
        assert rows[f"{axis} of C"] == extremes(C[:, i], "m")
    assert rows["z of C over the water"] == extremes(C[:, 2] - water, "m")
    assert rows["lean at the start"] == (f"{float(RECORD.cone_angle.values.ravel()[0]):.4g}", "deg")
    named = [name for name, *_ in summary(RECORD, SCENE)]
    below = [named[k + 1] for k, name in enumerate(named) if name in ("tension at the top", "force at the anchor")]
    assert below == ["exceeded there for 1 s"] * 2
    force = np.linalg.norm(ALONE.anchor_force, axis=1) / 1000
    lasting = [value for name, value, _ in summary(RECORD, SCENE) if name == below[0]]
    assert float(lasting[1]) == pytest.approx(Series("", RECORD.time.values, force).lasting_maximum, rel=1e-3)
    assert rows["cone angle"] == extremes(RECORD.cone_angle, "deg")
    assert rows["steps, of which retried"] == ("400, 7", "")
    assert "steps made smaller where a line came taut" not in rows
    jerked = summary(RECORD.assign_attrs(rejected_steps=5), SCENE)
    assert ("steps made smaller where a line came taut", "5", "") in jerked
    iterations = RECORD.newton_iterations.values[1:]
    assert rows["Newton iterations per step"] == (f"{iterations.sum() / 400:.2f}", "")
    assert (rows["wall time"], rows["speed"]) == (("12.5", "s"), ("3.2", "x real time"))
    left = 100 * (1 + (2 * math.pi / PERIOD * 0.1) ** 2) ** (-200)
    assert rows["left by the scheme of a free 5 s motion"] == (f"{left:.1f}", "%")


def test_an_equilibrium_of_several_lines_names_their_ends():
    record, scene = solve_static("three-legs"), load_scene("three-legs")
    rows = {name: [float(x) for x in value.split()] for name, value, unit in static_rows(record, scene) if unit == "kN"}
    for k, name in enumerate(record.cable.values):
        low, high = scene.network.ends_of(k)
        assert low != high
        wanted = {
            f"tension at {high}": record.tension_top[k],
            f"tension at {low}": record.tension_anchor[k],
            f"force that holds it at {low}": record.anchor_force[k],
            f"force that holds it at {high}": record.end_tension[k],
        }
        for what, values in wanted.items():
            np.testing.assert_allclose(1000 * np.array(rows[f"{name}: {what}"]), values, rtol=1e-5, atol=1e-2)


def test_warnings_have_their_numbers():
    assert warnings(RECORD, SCENE) == ["7 steps failed and were retried with smaller ones."]
    record = RECORD.copy(deep=True)
    record.cable_position_minimum[2, 2] = -20.37
    record.cable_tension_minimum[1] = -12.5
    said = " ".join(warnings(record, SCENE))
    assert "up to 0.37 m below the sea bed" in said
    assert "smallest tension -12.5 N; element 2 (s = 3.667 ... 7.333 m)" in said


def test_steps_that_were_cut():
    """One in ten of the steps, each in two halves; with a tolerance those that failed."""
    t = np.sort(np.concatenate([0.1 * np.arange(41), 0.1 * np.arange(4) + 0.25]))
    data = {"time_step": ("time", np.diff(t, prepend=0.0))}
    record = xr.Dataset(data, {"time": t}, attrs={"failed_steps": 4})
    assert cut(record, SCENE) == 0.1
    adaptive = load_scene(SCENE, time__scheme="bdf2", time__tolerance=1e-3)
    assert cut(record, adaptive) == pytest.approx(4 / 44)
    whole = RECORD.isel(time=slice(41))
    assert cut(whole, SCENE) == 0
    said = "4 steps failed and were retried with smaller ones, in 10 % of the run: see whether its numbers stay"
    longer = RECORD.isel(time=np.searchsorted(RECORD.time, t - 1e-9)).assign_coords(time=t).assign_attrs(failed_steps=4)
    longer["time_step"] = "time", data["time_step"][1]
    assert any(sentence.startswith(said) for sentence in warnings(longer, SCENE))


@pytest.fixture
def fails_whole(monkeypatch):
    """Whole steps fail until a time [s] that is set in it."""
    step, until = Simulation.step, [math.inf]

    def fails(self, h, judge=None):
        if h > 0.6 * self.scene.time.step and self.t < until[0]:
            raise SolveError("on purpose")
        return step(self, h, judge)

    monkeypatch.setattr(Simulation, "step", fails)
    return until


def test_a_run_of_cut_steps_is_no_result(call, tmp_path, fails_whole):
    """Every step fails once: told, and exit code 1, also of the finished run."""
    for _ in range(2):
        code, _, err = call("run", "driven", "--t-end", "0.05", "--no-plot", "--out", tmp_path / "out")
        assert code == 1
        assert "100 % of all steps failed and were retried with smaller ones" in " ".join(err.split())
    with pytest.raises(NoResult, match="100 % of all steps failed") as caught:
        simulate("driven", time__end=0.05)
    assert caught.value.record.time[-1] == 0.05
    found = sweep(load_scene("driven", time__end=0.05), ["cable.normal_drag=0.5,1"], None, tmp_path / "sweep")
    assert all(text.startswith("NoResult: 100 % of all steps failed") for text in found.status.values)


def test_often_cut_steps_are_told(call, tmp_path, fails_whole):
    """Of twenty steps three: by `simulate` as a warning, by `sweep` for its cases."""
    fails_whole[0] = 0.015
    with pytest.warns(UserWarning, match="3 steps failed and were retried with smaller ones, in 15 % of the run"):
        simulate("driven", time__end=0.1)
    of = ("driven", "--set", "time.end=0.1", "--vary", "cable.normal_drag=0.5,1")
    code, out, _ = call("sweep", *of, "--out", tmp_path)
    assert code == 0
    said = "In 2 cases many steps failed and were retried with smaller ones, most in number 1, 15 %: see whether"
    assert said in " ".join(out.split())


@pytest.mark.parametrize(
    ("force", "steps"),
    [
        ([1, 1, 1, 9, 1, 1, 1], 1),
        ([1, 1, 1, 6, 9, 5, 1, 1, 1], 2),  # 5 is the middle itself
        ([1, 8, 1, 1, 6, 7, 9, 8, 1, 1, 1, 1], 4),
        ([1, 1, 1, 1, 1, 6, 9], math.inf),  # still rising
        ([9, 1, 1, 1, 1], math.inf),  # of the start
        ([9.1, 9.1, 10, 9.1, 9.1], math.inf),  # hardly a peak
        ([8.9, 8.9, 10, 8.9, 8.9], 1),
    ],
)
def test_steps_of_a_peak(force, steps):
    assert steps_of_peak(force) == steps


@pytest.mark.parametrize(("width", "said"), [(1, "1 step:"), (5, "5 steps:"), (6, None)])
def test_a_peak_of_a_few_steps_is_told(width, said):
    """At the end where it is, with its size and time."""
    record = RECORD.copy(deep=True)
    record.tension_top[:] = 4000.0
    record.tension_top[100 : 100 + width, 0] = 9000.0
    record.anchor_force[:] = np.array([0.0, 3000.0, -4000.0])
    at = f"{float(record.time[100]):.5g}"
    told = (
        f"The largest tension at the top, 9 kN at {at} s, rests on {said} a snap, of which smaller steps may show more."
    )
    expected = [told] if said else []
    assert [sentence for sentence in warnings(record, SCENE) if "rests on" in sentence] == expected


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
    """SI, degrees for angles."""
    units = {
        "N m": "anchor_moment end_moment touchdown_moment cable_moment",
        "m-1": "largest_curvature curvature curvature_maximum curvature_maximum_after_ramp",
        "W": "absorbed_power",
        "N": "tension_top tension_anchor smallest_tension anchor_force anchor_uplift anchor_horizontal needed_weight "
        "end_tension mooring_force wind_force drift_force cable_tension growth_weight place_tension take_off_tension "
        "cable_tension_minimum cable_tension_maximum cable_tension_minimum_after_ramp cable_tension_maximum_after_ramp",
        "m": "buoy_position mooring_point surface_elevation buoyancy_center submerged_length submerged_diameter "
        "cable_position s s_cell place_s length_on_bed touchdown joint_position offset freeboard "
        "anchor_moved take_off_length winch_length "
        "cable_position_minimum cable_position_maximum wave_amplitude min_bend_radius",
        "s": "time time_step frame wave_period parted_at",
        "m s-1": "cable_velocity",
        "kg": "displaced_mass",
        "kg m s-1": "linear_momentum",
        "kg m2 s-1": "angular_momentum",
        "degree": "cone_angle lean_at_start roll pitch yaw wave_direction_deg wave_phase_deg",
        "1": "newton_iterations buoy_orientation cable_of_node cable_of_cell segment_of_cell "
        "utilisation anchor_use bend_utilisation cable_utilisation_maximum growth_diameter growth_mass",
    }
    known = {name: unit for unit, names in units.items() for name in names.split()}
    found = {name: one.unit for name, one in over("time", "frame", "run", "").items()}
    errors = {name: found.pop(name) for name in [*found] if name.endswith("_error")}
    assert found == known
    assert {name.removesuffix("_error"): unit for name, unit in errors.items()}.items() < known.items()


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
        if unit == "N" and abs(value) >= 1000:
            value, unit = value / 1000, "kN"
        assert rows[name][0] == f"{value:.5g}"
        assert rows[name][1] == unit if unit else True, name
    step, end = 0.01, 120.0
    for name, period in report.periods.items():
        left = 100 * (1 + (2 * math.pi / period * step) ** 2) ** (-0.5 * end / step)
        assert rows[name] == [f"{period:.5g}", "s", f"{left:.1f} %"]
    rows, record = table_rows(call("static", "short", "--out", tmp_path)[1]), solve_static("short")
    for name in ("tension_top", "tension_anchor", "buoy_position", "cone_angle", "displaced_mass"):
        values, unit = record[name].values.ravel(), record[name].attrs["units"]
        if unit == "N":  # thousands of it
            values, unit = values / 1000, "kN"
        text = " ".join(f"{v:.6g}" for v in values)
        assert rows[record[name].attrs["long_name"]] == [text, unit]


# -- lines without damping ---------------------------------------------------------------------------------------------

CHAIN = {
    "sea": {"depth": 10.0},
    "cable": {"length": 16.0, "line_density": 31.0, "diameter": 0.05, "axial_stiffness": 4e6, "elements": 8},
}
CHAIN["cable"] |= {"normal_drag": 1.0, "top": {"kind": "fixed", "position": [10.0, 0.0, -3.0]}}
FALLS = merged(CHAIN, seabed={"friction": 0.0}, time={"end": 0.4, "step": 0.02, "output_every": 0.1})


@pytest.mark.parametrize(
    ("cable", "said"),
    [
        ({"slack": "tension-only"}, "lay on the sea bed"),
        ({"slack": "tension-only", "damping": 1e3}, None),
        ({"slack": "tension-only", "axial_stiffness": math.inf}, None),
        ({"slack": "tension-only", "top": {"kind": "free"}}, "went slack and lay on the sea bed"),
        ({"top": {"kind": "free"}}, "lay on the sea bed"),
        ({"anchor": [0.0, 0.0, -9.0], "length": 11.0, "top": {"kind": "fixed", "position": [9.0, 0.0, -5.0]}}, None),
    ],
)
def test_a_line_without_damping_that_went_slack_or_lay_is_told(cable, said):
    """What was let go falls slack; what hangs clear of the bed does neither."""
    scene = merged(FALLS, cable=FALLS["cable"] | cable)
    scene["initial"] = {"kind": "equilibrium"}
    if "top" in cable and cable["top"]["kind"] == "free":
        scene["initial"] = {"kind": "polyline", "points": [[0, 0, -10.0], [1, 0, -10.0], [13.0, 0.0, -1.0]]}
    found = [text for text in warnings(simulate(scene), load_scene(scene)) if "no damping" in text]
    assert len(found) == (said is not None)
    assert all(text.startswith(f"The cable {said}, and has no damping: pulses") for text in found)


@pytest.mark.parametrize(("least", "said"), [(-9800.0, 0), (-9900.0, 1)])
def test_what_an_element_carries_before_it_buckles_is_no_warning(least, said):
    """EI (pi/h)^2 of an element that bends: 9870 N of 1 kN m^2 over 1 m."""
    rod = SimpleNamespace(bending_stiffness=1e3, length=6.0, elements=6)
    tension = ("cell", np.array([500.0, least, 400.0, 300.0, 200.0, 100.0]))
    record = ALONE.assign(cable_tension_minimum=tension, cable_tension_maximum=("cell", np.full(6, 500.0)))
    assert len(_compressed(record, [rod])) == said
