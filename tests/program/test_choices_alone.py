"""Choice of recorded and displayed quantities, each alone: names, samples, start times, curves, winches, headings.

Source: made-up declarations, records and datasets.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made_up import RECORD, SCENE
from matplotlib.figure import Figure
from test_figures_read_back import swept
from test_numbers_shown import made_up_offsets

from dolfbuoy import InputError, load_scene
from dolfbuoy.page import run_page
from dolfbuoy.results import frame, linear_figures, linear_record, sample, series
from dolfbuoy.results.criteria import verdicts
from dolfbuoy.results.devices import winches_of
from dolfbuoy.results.draw3d import _ticks, equal_scale, sheet
from dolfbuoy.results.elasticities import columns_of_run
from dolfbuoy.results.quantities import QUANTITIES, chosen, declared, over, shown_in
from dolfbuoy.results.quantity import Curve, Quantity
from dolfbuoy.results.sample import Fatigue, sample_of
from dolfbuoy.results.sweep_figure import draw

CURVES = (Curve("panel", "name"),)


@pytest.mark.parametrize(
    ("more", "has"),
    [
        ({}, False),
        ({"main": True}, True),
        ({"curves": CURVES}, True),
        ({"compared": "it"}, True),
        ({"outputs": True}, True),
        ({"summary": "it"}, True),
        ({"summary": "it", "component": "x"}, False),
        ({"main": True, "over": "frame"}, False),
        ({"summary": "it", "over": ""}, False),
    ],
)
def test_which_quantities_have_outputs(more, has):
    assert Quantity("a", ("cable",), "m", "a thing", **more).has_outputs is has


def test_errors_are_declared_beside_their_quantities():
    """Of what has outputs over time, and of the force on the anchor."""
    of_errors = {name.removesuffix("_error") for name in QUANTITIES if name.endswith("_error")}
    for name in ("tension_top", "anchor_force", "buoy_position", "roll", "utilisation", "take_off_length"):
        assert name in of_errors
        one, error = QUANTITIES[name], QUANTITIES[f"{name}_error"]
        assert (error.dims, error.unit, error.over, error.turning) == (one.dims, one.unit, "time", one.turning)
        assert (error.effort, error.has_outputs) == (True, False)
    for name in ("lean_at_start", "time", "time_step", "end_tension", "touchdown", "buoy_orientation", "cable_tension"):
        assert name not in of_errors
    assert [name for name, one in QUANTITIES.items() if one.integer] == [
        "newton_iterations", "cable_of_node", "cable_of_cell", "segment_of_cell",
    ]  # fmt: skip
    assert [name for name, one in QUANTITIES.items() if one.changing] == ["parted_at"]
    assert [name for name, one in QUANTITIES.items() if one.effort and not name.endswith("_error")] == [
        "time_step", "newton_iterations",
    ]  # fmt: skip
    assert [name for name, one in QUANTITIES.items() if one.turning and not one.effort] == ["roll", "yaw"]
    assert [name for name, one in QUANTITIES.items() if one.main] == ["tension_top", "tension_anchor", "absorbed_power"]
    assert {name for name, one in QUANTITIES.items() if one.counts == "minimum"} == {
        "length_on_bed", "smallest_tension", "freeboard",
    }  # fmt: skip
    assert [name for name, one in QUANTITIES.items() if one.figure] == ["cone_angle"]
    assert [name for name, one in QUANTITIES.items() if one.outputs] == [
        "anchor_use", "anchor_moved", "utilisation", "smallest_tension", "bend_utilisation",
    ]  # fmt: skip


def test_of_which_notes_quantities_are_read():
    """Columns of what is noted of each line, device, vessel and buoy."""
    sizes = {
        "bed": 4,
        "bending": 3,
        "take_off": 3,
        "wind": 3,
        "drift": 3,
        "joint": 3,
        "anchor_force": 3,
        "end_tension": 3,
    }
    values = {name: 10.0 * k + np.arange(size) for k, (name, size) in enumerate(sizes.items())}

    class Notes(dict):
        def each(self, source, size):
            assert sizes[source] == size
            return values[source][None]

    plain = (
        "tension_anchor",
        "utilisation",
        "smallest_tension",
        "touchdown_moment",
        "bend_utilisation",
        "place_tension",
    )
    noted = Notes({name: np.array([len(name)]) for name in (*plain, "place_tension", "winch")})
    columns = {
        "length_on_bed": ("bed", 0), "touchdown": ("bed", slice(1, 4)), "anchor_moment": ("bending", 0),
        "end_moment": ("bending", 1), "largest_curvature": ("bending", 2), "take_off_length": ("take_off", 0),
        "take_off_tension": ("take_off", 1), "absorbed_power": ("take_off", 2), "wind_force": ("wind", slice(3)),
        "drift_force": ("drift", slice(3)), "joint_position": ("joint", slice(3)),
        "anchor_force": ("anchor_force", slice(3)), "end_tension": ("end_tension", slice(3)),
    }  # fmt: skip
    for name, (source, column) in columns.items():
        np.testing.assert_array_equal(QUANTITIES[name].read(noted), values[source][None, column], err_msg=name)
    for name in (*plain, "place_tension"):
        assert QUANTITIES[name].read(noted) == len(name)
    assert QUANTITIES["winch_length"].read(noted) == len("winch")
    assert QUANTITIES["min_bend_radius"].read(noted) == 1 / values["bending"][2]
    assert QUANTITIES["tension_top"].read(noted) == pytest.approx(np.linalg.norm(values["end_tension"]))


def test_names_of_series_and_fields():
    """The longest name that fits, components, and attributes of extremes."""
    assert [declared(name).name for name in ("buoy_position_z", "tension_top", "tension_top_error", "offset")] == [
        "buoy_position", "tension_top", "tension_top_error", "offset",
    ]  # fmt: skip
    assert QUANTITIES["cone_angle"].field == "cone angle [degree]"
    assert (QUANTITIES["tension_top"].series(""), QUANTITIES["buoy_position"].series("xz")) == (
        ["tension_top"], ["buoy_position_x", "buoy_position_z"],
    )  # fmt: skip
    assert QUANTITIES["cable_tension_minimum"].attributes()["cell_methods"] == "time: minimum"
    assert QUANTITIES["curvature_maximum"].attributes()["cell_methods"] == "time: maximum"
    assert "cell_methods" not in QUANTITIES["cable_tension"].attributes()
    assert QUANTITIES["roll"].attributes()["standard_name"] == "platform_roll_starboard_down"
    assert (QUANTITIES["time"].kind, QUANTITIES["tension_top"].kind) == ("", "cable")
    assert list(over("sample")) == ["fixed_point_elevation"]
    assert shown_in("sweep page") == [
        "tension_top",
        "tension_anchor",
        "buoy_position_z",
        "cone_angle",
        "absorbed_power",
    ]
    assert chosen("cycles") == {"tension_top", "tension_anchor", "place_tension"}
    assert {"buoy_position_z", "roll", "offset"} <= chosen("peaks")
    assert not {"buoy_position_x", "yaw", "freeboard"} & chosen("peaks")


# -- samples -----------------------------------------------------------------------------------------------------------


def test_a_sample_needs_two_instants():
    """From its start on, but for rounding; of a sea of chance it has a memory."""
    times = RECORD.time.values
    for start in (times[-2], times[-2] * (1 + 0.9e-9)):
        found = sample_of(RECORD, SCENE, start)
        assert (found["start"], found["duration"]) == (times[-2], times[-1] - times[-2])
    with pytest.raises(InputError, match=r"^The run ends at t = 40 s, and statistics begin at t = 39\.9 s: they need"):
        sample_of(RECORD, SCENE, times[-2] * (1 + 1.1e-9))
    assert sample_of(RECORD, SCENE)["start"] == pytest.approx(SCENE.waves.ramp)
    assert "memory" not in found["series"]["tension_top of cable"]
    sea = {"spectrum": "jonswap", "significant_height": 1.0, "peak_period": 5.0, "components": 8}
    by_chance = load_scene(load_scene(SCENE, waves=None), waves=sea)
    assert "memory" in sample_of(RECORD, by_chance, 39.0)["series"]["tension_top of cable"]


def test_which_forces_last():
    """Those whose peaks are kept."""
    labels = ("tension_top of a", "anchor_uplift of b", "offset of c", "smallest_tension")
    assert [sample.lasts(label) for label in labels] == [True, True, False, False]


@pytest.mark.parametrize(
    ("name", "bad", "good"),
    [
        ("exponent", (0.0, -1.0, math.inf, math.nan), (1e-9, 50.0)),
        ("constant", (0.0, math.inf), (1e-9,)),
        ("frequency", (0.0, math.inf), (1e-9,)),
        ("safety_factor", (0.0, math.inf), (1e-9,)),
        ("corrosion", (-1e-9, math.inf, math.nan), (0.0, 0.01)),
        ("curve", ("none", "0 N^3"), ("1e14 N^3",)),
    ],
)
def test_numbers_of_fatigue(name, bad, good):
    for value in good:
        assert getattr(Fatigue(**{name: value}), name) == value
    for value in bad:
        with pytest.raises(InputError, match=f"^{name} = "):
            Fatigue(**{name: value})
    with pytest.raises(InputError, match="does not go with curve"):
        Fatigue(curve="1e14 N^3", constant=1.0)


def test_damage_by_a_constant_and_its_doubt():
    """Above 1 within a run; the damage-equivalent range of nothing is 0."""
    one = {"cycles": {"a": [[2.0, 1.0], [3.0, 8.0]]}, "duration": 16.0}
    for constant, doubt in ((32.0, False), (31.9, True)):
        found = Fatigue(constant=constant).damage(one, "a")
        assert (found.sum, ("lead to failure" in found.curve)) == (pytest.approx(32.0 / constant), doubt)
    assert found.curve.startswith("K = 31.9 and m = 3 of ranges in N, which")
    assert Fatigue().equivalent_load(one, "a") == pytest.approx((32 / 16) ** (1 / 3))
    assert Fatigue(exponent=2.0, frequency=0.25).equivalent_load(one, "a") == pytest.approx(math.sqrt(20 / 4))
    assert (Fatigue().equivalent_load(one, "b"), Fatigue().damage(one, "a")) == (0.0, None)
    assert sample.lives({"cycles": {"a": [[], []]}, "duration": 1.0}, Fatigue(constant=1.0)) == {"a": math.inf}
    assert (Fatigue().factor({}), Fatigue(safety_factor=2.0).factor({"fatigue": {"safety_factor": 3.0}})) == (1.0, 2.0)
    assert Fatigue().factor({"fatigue": {"safety_factor": 3.0}}) == 3.0


def test_series_of_any_length():
    """What lasts needs a second, a period two crossings, an oscillation eight instants of the later half."""
    t = np.arange(11) / 10
    assert series.Series("x", t, np.where(t > 0.45, 3.0, 1.0)).lasting_maximum == 1.0
    assert math.isnan(series.Series("x", t[:-1], t[:-1]).lasting_maximum)
    assert series.Series("x", 3 * t, 3 * t).lasting_maximum == pytest.approx(2.0)
    assert series.Series("x", 3 * t, np.abs(3 * t - 1.5)).lasting_maximum == pytest.approx(0.5, abs=1e-12)
    wave = np.sin(2 * np.pi * np.arange(15) / 4.0)
    assert series.Series("x", np.arange(15.0), wave).dominant_period == pytest.approx(4.0, rel=1e-9)
    assert math.isnan(series.Series("x", np.arange(14.0), wave[:14]).dominant_period)
    assert math.isnan(series.Series("x", np.arange(15.0), wave, noise=1.0).dominant_period)
    assert series.Series("x", np.arange(15.0), wave, noise=0.99).dominant_period == pytest.approx(4.0, rel=1e-9)
    late = np.sin(2 * np.pi * (np.arange(10) - 0.5) / 4.0)
    for count, period in ((10, 4.0), (6, 4.0), (5, math.nan)):
        found = series.Series("x", np.arange(float(count)), late[:count]).period
        assert found == pytest.approx(period, rel=1e-12, nan_ok=True)
    still = series.Series("x", np.arange(3.0), np.array([1.0, 1.0 + 2e-16, 1.0]))
    assert still.standard_deviation == 0.0
    assert series.Series("x", np.arange(2.0), np.array([1.0, 3.0])).standard_deviation == 1.0


# -- names -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("low", "high", "end"),
    [("buoy", "free", 0), ("free", "buoy", 1), ("held", "buoy", 1), ("held", "held", 1), ("free", "free", 1)],
)
def test_at_which_end_a_winch_stands(low, high, end):
    """The one that is held or on a buoy, the upper one of two."""
    ends = [SimpleNamespace(kind=kind, held=kind == "held") for kind in (low, high)]
    network = SimpleNamespace(winches={"w": 3}, pieces={3: SimpleNamespace(ends=ends)})
    assert list(winches_of(network)) == [("w", 3, end)]


@pytest.mark.parametrize(
    ("buoys", "names"),
    [
        ({"a": 1}, ["waves", "wind", "force"]),
        ({"a": 1, "b": 2}, ["waves", "wind on a", "force on a", "wind on b", "force on b"]),
        ({}, ["waves", "wind", "force"]),
    ],
)
def test_headings_are_named_where_there_are_several_buoys(monkeypatch, buoys, names):
    """What pushes only one of them is; without curves all instants are kept."""
    empty = {
        "parts_of": [],
        "columns_of": [],
        "panels": [],
        "moments": [],
        "envelopes": [],
        "spectra": [],
        "view_of": {},
    }
    for name, value in empty.items():
        monkeypatch.setattr(run_page, name, lambda *_, value=value: value)
    frames = SimpleNamespace(spans=[], times=[0.0], at=lambda time: SimpleNamespace(x=np.zeros((0, 3))))
    monkeypatch.setattr(run_page, "Frames", lambda record, scene: frames)
    monkeypatch.setattr(run_page, "rows_that_fit", lambda *_: 9)
    monkeypatch.setattr(run_page, "period_of", lambda scene: 7.0)
    known = {name: np.array([k, 2.0]) for k, name in enumerate(("waves", "wind", "force"))}
    monkeypatch.setattr(run_page, "pushes", lambda scene, name: known)
    record = xr.Dataset(coords={"time": [0.0, 1.0, 2.0]})
    found = run_page.data_of(record, SimpleNamespace(network=SimpleNamespace(buoys=buoys)))
    assert [name for name, _ in found["headings"]] == names
    assert (found["kept"], found["every"], found["period"], found["headings"][1][1]) == (3, 3, 7.0, [1.0, 2.0])


@pytest.mark.parametrize(("count", "long", "label"), [(9, 1, "a.x"), (10, 1, "case"), (2, 36, "a.x"), (2, 37, "case")])
def test_groups_of_a_sweep_that_can_be_told_apart(count, long, label):
    """Nine at most, of forty letters."""
    cases = [{"a.x": float(x), "b.y": f"{k}".rjust(long, "w")} for x in (1, 2) for k in range(count)]
    assert draw(swept(cases)).axes[0].get_xlabel() == label


@pytest.mark.parametrize(("more", "said"), [(0.9e-6, False), (1.1e-6, True)])
def test_matrices_that_are_not_symmetric(more, said):
    """By more than a millionth of the largest; what is infinite is left out."""
    matrix = np.diag([1e6, np.inf, 5.0])
    matrix[0, 2] = 1e6 * more
    found = linear_record.notes(xr.Dataset({"total": (("buoy", "reaction", "motion"), matrix[None])}), SCENE)
    assert found[0] == "The mooring follows at rest; motion is in world axes, about C."
    assert (
        found[1:]
        == ["The matrices are not symmetric: current, wind and the quaternion's torques have no potential."] * said
    )
    for friction, words in ((0.5, "sticks: its springs are in these numbers"), (0.0, "is 0: what lies slides freely")):
        bed = load_scene(SCENE, seabed={"friction": friction})
        assert linear_record.on_friction(bed) == [f"Friction of the bed {words}."]
    assert linear_record.on_friction(SCENE) == []


def test_a_wind_of_many_instants_is_read_from_a_table():
    """Of more than 16 rows, between heights; of 16 each as it is."""
    frames = frame.Frames(RECORD, SCENE)
    (wind,) = (force for force in frames.forces if force.name == "wind force")
    for count in (16, 17, 200):
        rows = np.arange(0, 2 * count, 2)
        each = np.array([wind.vectors(np.array([row]))[0] for row in rows])
        difference = np.abs(wind.vectors(rows) - each).max() / np.abs(each).max()
        assert difference < (1e-12 if count == 16 else 2e-3)
        assert (difference > 0) or count == 16


@pytest.mark.parametrize(
    ("low", "high", "longest", "lying", "upright"),
    [
        (0.0, 10.0, 10.0, [2, 4, 6, 8], [2, 4, 6, 8, 10]),
        (0.0, 7.0, 20.0, [2, 6], [5]),
        (0.0, 4.0, 20.0, [2], [2, 4]),
        (0.0, 1.5, 20.0, [1], [1]),
        (0.0, 1.0, 20.0, [0.5], [1]),
        (0.1, 0.9, 40.0, [0.5], [0.5]),
    ],
)
def test_numbers_on_an_axis_in_space(low, high, longest, lying, upright):
    """Round ones, two on a short axis that lies, at least one; none at the corners."""
    for way, ticks in ((False, lying), (True, upright)):
        np.testing.assert_allclose(_ticks(low, high, longest, way), ticks)


def test_the_upright_axis_has_a_number_at_its_top():
    """The others, which meet there, have not."""
    axes = Figure().add_axes((0, 0, 1, 1), projection="3d")
    equal_scale(axes, np.array([[0.0, 0.0, -10.0], [10.0, 10.0, 0.0]]), 14.0, -60.0)
    ticks = [axis.get_major_locator().locs.tolist() for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    assert ticks == [[2, 4, 6, 8], [2, 4, 6, 8], [-8, -6, -4, -2, 0]]


def test_a_sheet_has_no_holes():
    """Whatever way its patches are given, they run the same way for who sees them, each closed."""
    ring = np.array([[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [2.0, 1.0, 5.0], [0.0, 1.0, 5.0]])
    patches = np.stack([ring, ring[::-1] + [3.0, 0.0, 1.0]])
    for up in (1.0, -1.0):
        drawn = sheet(patches, np.array([0.0, 0.0, up]), facecolor="red")
        points = np.array(drawn._segment3d).reshape(2, 5, 3)
        assert np.array_equal(points[:, 0], points[:, -1])
        x, y = points[..., 0], points[..., 1]
        areas = (x[:, :-1] * y[:, 1:] - x[:, 1:] * y[:, :-1]).sum(axis=1) / 2
        np.testing.assert_allclose(areas, 2.0 * up)
        assert points[..., 2].tolist() == [[5.0] * 5, [6.0] * 5]
        assert (list(drawn._code3d), drawn.get_linewidth()) == ([1, 2, 2, 2, 79] * 2, 0)


def test_offsets_over_a_current():
    """In metres a second, whatever its size."""
    made = made_up_offsets().rename(force="current")
    left, middle, _ = linear_figures.offset_curves(made).axes
    assert [axes.get_xlabel() for axes in (left, middle)] == ["current at the surface [m/s]"] * 2
    np.testing.assert_allclose(left.lines[0].get_xdata(), [0.0, 2000.0, 4000.0])


@pytest.mark.parametrize(("start", "largest"), [(39.9, 6.0), (40.0, 9.0), (99.0, 9.0)])
def test_criteria_of_less_than_two_instants_are_of_the_whole(start, largest):
    t = RECORD.time.values
    record = RECORD.assign(offset=(("time", "buoy"), np.where(t > 39.85, 6.0, 9.0)[:, None]))
    (found,) = verdicts(record, load_scene(SCENE, criteria={"largest_offset": 7.0}), start)
    assert found.value == largest


def test_outputs_whose_elasticities_are_shown():
    """The usual ones, or all; with the name of their part where there are several."""
    names = ["tension_top.max", "tension_top.max", "offset.mean", "cone_angle.max"]
    data = {"output": ("o", names), "output_of": ("o", ["a", "b", "buoy", "buoy"])}
    found = xr.Dataset(data | {"elasticity": (("parameter", "o"), np.arange(8.0).reshape(2, 4))})
    few = columns_of_run(found, False)
    assert {name: x.tolist() for name, x in few.items()} == {
        "tension_top.max of a": [0, 4], "tension_top.max of b": [1, 5], "cone_angle.max": [3, 7],
    }  # fmt: skip
    assert list(columns_of_run(found, True)) == [*list(few)[:2], "offset.mean", "cone_angle.max"]
