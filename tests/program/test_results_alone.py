"""Small parts of results, each alone at its limits: bars, figures over time, rigid directions, ranks, sweeps, folders.

Source: the same numbers by hand; made-up communicators.
"""

import math
import os
import platform
import stat
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made_up import PERIOD, RECORD, SCENE
from matplotlib.figure import Figure

from dolfbuoy import InputError, figures, load_scene
from dolfbuoy.linear.layout import Body
from dolfbuoy.results import (
    after_ramp,
    bars,
    elasticities,
    folder,
    linear_record,
    measured,
    paraview,
    quantities,
    statistics,
    trajectories,
)
from dolfbuoy.results.hulls import Floating
from dolfbuoy.results.observe import Observer
from dolfbuoy.results.places import _turns
from dolfbuoy.results.record import nothing
from dolfbuoy.results.running import Smallest
from dolfbuoy.results.sample import Fatigue, _strength, sample_of
from dolfbuoy.results.series import Series
from dolfbuoy.results.style import at_least

# -- bars and derivatives ----------------------------------------------------------------------------------------------


def with_bars(**attrs):
    """The made-up record with two bars, one of which is not known."""
    rows = {
        "output": ["tension_top.max", "offset.mean"],
        "output_of": ["cable", "buoy"],
        "bar_verdict": ["both", "none"],
    }
    more = {name: ("output", values) for name, values in rows.items()} | {"bar": ("output", [30.0, 0.5])}
    return RECORD.assign(more).assign_attrs(attrs)


def test_bars_by_the_labels_of_series():
    found = bars.by_label(with_bars())
    assert found == {
        "tension_top of cable": {"maximum_bar": 30.0},
        "offset of buoy": {"mean_bar": pytest.approx(math.nan, nan_ok=True)},
    }
    assert bars.by_label(RECORD) == {}
    whole = with_bars().assign(output_of=("output", ["", ""]))
    assert bars.by_label(whole).keys() == {"tension_top", "offset"}


@pytest.mark.parametrize(
    ("begin", "known"), [(12.0, True), (12.0 + 0.9e-9, True), (12.0 + 1.1e-9, False), (11.0, False)]
)
def test_bars_of_a_sample_are_those_of_its_time(begin, known):
    found = sample_of(with_bars(bar_window_from_s=12.0), SCENE, begin)["series"]
    assert found["tension_top of cable"].get("maximum_bar") == (30.0 if known else None)
    assert ("mean_bar" in found["offset of buoy"]) == known


@pytest.mark.parametrize(
    ("value", "text"),
    [(math.nan, "-"), (math.inf, "-"), (4.9e-5, "0"), (-4.9e-5, "0"), (6e-5, "+0.0001"), (0.5, "+0.5000"),
     (1.0, "+1.000"), (-1.0, "-1.000"), (-0.99, "-0.9900")],
)  # fmt: skip
def test_elasticities_in_words(value, text):
    assert elasticities.percent(value) == text


def test_numbers_and_their_units():
    rows = {"parameter_value": [1234.5678, 0.25, np.nan], "parameter_unit": ["kg", "1", "m"]}
    found = xr.Dataset({name: ("parameter", np.array(values)) for name, values in rows.items()})
    assert [elasticities.value_of(found, k) for k in range(3)] == ["1235 kg", "0.25", "all of it"]
    columns = {"a": np.array([0.1, -3.0, np.nan]), "b": np.array([0.2, np.nan, 1.0])}
    assert elasticities.order_of(found, columns).tolist() == [1, 2, 0]


def test_errors_of_angles_are_below_half_a_turn():
    """Where both are infinite, as of a straight line, it is not known."""
    found = quantities.errors(
        {"roll": np.array([179.0, -179.0, 10.0]), "pitch": np.array([9.0]), "min_bend_radius": np.array([np.inf, 3.0])},
        {"roll": np.array([-179.0, 179.0, 4.0]), "pitch": np.array([7.5]), "min_bend_radius": np.array([np.inf, 2.0])},
    )
    assert found["roll_error"].tolist() == [-2.0, 2.0, 6.0]
    assert found["pitch_error"].tolist() == [1.5]
    np.testing.assert_array_equal(found["min_bend_radius_error"], [np.nan, 1.0])


# -- figures -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("end", "panels"), [(30.0, 1), (30.1, 2)])
def test_the_end_is_enlarged_of_more_than_six_periods(end, panels):
    record = RECORD.sel(time=slice(0, end + 0.01))
    times = record.time.values.copy()
    times[-1] = end
    figure = figures.tension(record.assign_coords(time=times), SCENE)
    assert len(figure.axes) == panels
    assert figure.axes[-1].get_title("left") == ("last three periods" if panels > 1 else "")
    turns = RECORD.assign(dict.fromkeys(("roll", "pitch", "yaw"), RECORD.cone_angle))
    assert len(figures.roll_pitch_yaw(turns, SCENE).axes) == 3


@pytest.mark.parametrize(
    ("width", "height", "panel", "expected"),
    [(1.0, 0.1, 2.9, 1.0), (1.0, 5.0, 2.9, 3.2), (2.0, 1.5, 2.0, 1.05 * 2 * 0.75), (0.0, 3.0, 2.9, 2.4)],
)
def test_heights_of_panels(width, height, panel, expected):
    x = np.array([[0.0, 1.0], [width, 1.0 + height], [0.0, 1.0]])
    assert trajectories.panel_height(x, panel) == pytest.approx(expected)
    axes = Figure().subplots()
    trajectories.equal_axes(axes, x)
    half = np.maximum(0.54 * np.array([width, height]), 0.025 * max(width, height))
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    np.testing.assert_allclose(limits.mean(axis=1), [width / 2, 1.0 + height / 2])
    np.testing.assert_allclose(np.ptp(limits, axis=1) / 2, half)


def test_a_point_has_a_panel_of_a_centimetre():
    axes = Figure().subplots()
    trajectories.equal_axes(axes, np.zeros((2, 2)))
    assert (axes.get_xlim(), axes.get_ylim()) == ((-5e-3, 5e-3), (-5e-3, 5e-3))
    axes.set_ylim(0.0, 5e-4)
    at_least(axes)
    assert axes.get_ylim() == pytest.approx((-2.5e-4, 7.5e-4))


@pytest.mark.parametrize(("across", "planar"), [(0.02, True), (0.0201, False)])
def test_a_motion_is_planar_below_a_fiftieth_of_its_length(across, planar):
    x = np.array([[0.0, 0.0, 5.0], [100.0, 100 * across, -5.0]])
    assert trajectories._is_planar(x) == planar
    assert trajectories._is_planar(x[:, [1, 0, 2]]) == planar
    assert trajectories._is_planar(np.array([[0.0, 0.0, 0.0], [9e-7, 9e-7, 1.0]]))
    assert (trajectories.widest(x), trajectories.widest(x[:, [1, 0, 2]]), trajectories.widest(0 * x)) == (0, 1, 0)


@pytest.mark.parametrize(
    ("instants", "end", "said"), [(64, 20.0, ""), (63, 20.0, "64 instants"), (400, 19.99, "4 periods")]
)
def test_what_a_spectrum_needs(instants, end, said):
    """64 instants, and four periods."""
    scene = load_scene(SCENE, waves__ramp=0.0)
    t = np.linspace(0.0, end, instants)
    record = xr.Dataset(coords={"time": t})
    series = [("x", np.sin(2 * np.pi * t / PERIOD))]
    if said:
        with pytest.raises(after_ramp.TooShort, match=said):
            after_ramp.spectra_of(record, scene, "spectrum", series)
        return
    ((name, f, S),), period = after_ramp.spectra_of(record, scene, "spectrum", series)
    assert (name, period, f[S.argmax()]) == ("x", PERIOD, pytest.approx(1 / PERIOD, rel=0.02))


def test_which_part_of_a_spectrum_is_shown():
    """Up to where the highest is a hundred thousandth of its peak, or the fourth harmonic, or the fourth frequency."""
    f, S = np.arange(6.0), np.array([0.0, 10.0, 1.0, 1.01e-4, 0.99e-4, 0.0])
    curves = [("low", f, S / 100), ("high", f, S)]
    assert after_ramp.window_of(curves, None) == pytest.approx((4.0, 1e-5, 40.0))
    assert after_ramp.window_of(curves, 0.5)[0] == 8.0
    wide = [("high", f / 8, S)]
    assert after_ramp.window_of(wide, 40.0)[0] == 0.5
    assert after_ramp.window_of([("high", f / 8, np.where(f == 5, 1.1e-4, S))], 40.0)[0] == 0.625
    assert after_ramp.window_of([("none", f, 0 * S)], None)[1:] == pytest.approx((1e-18, 4e-12))


# -- restoring matrices ------------------------------------------------------------------------------------------------


def test_what_is_rigid_is_infinite():
    """A direction that mixes x and the turn about y: signs, what is left across it, and the motion."""
    body = Body("b", np.arange(13), np.zeros(3), np.array([1.0, 0, 0, 0]), 4.0, np.diag([6.0, 6.0, 4.0]))  # arms 1/2
    rigid = np.array([[-0.6, 0.0, 0.0, 1e-9, 0.8, 0.0]]).T
    K = np.diag([100.0, 200.0, 300.0, 400.0, 500.0, 600.0])
    both = np.block([[K, np.full((6, 6), 7.0)], [np.full((6, 6), 8.0), 10 * K]])
    free = np.zeros((6, 0))
    found = SimpleNamespace(bodies=[body, body], rigid=[rigid, free], mooring=both, hull=2 * both)
    data = linear_record._of_bodies(found)
    np.testing.assert_array_equal(data["mooring"][1][1], 10 * K)
    assert np.isnan(data["rigid"][1][1]).all()
    np.testing.assert_allclose(data["mooring_eigenvalue"][1][1], 10 * np.sort([100, 200, 300, 100, 125, 150]))
    total, hull, mooring = (data[name][1][0] for name in ("total", "hull", "mooring"))
    np.testing.assert_array_equal(hull, 2 * K)
    expected = np.zeros((6, 6))
    expected[0, 0] = expected[4, 4] = np.inf
    expected[0, 4] = expected[4, 0] = -np.inf
    for matrix, factor in ((mooring, 1), (total, 3)):
        np.testing.assert_array_equal(np.where(np.isinf(matrix), matrix, 0.0), expected)
        np.testing.assert_allclose(np.diag(matrix)[[1, 2, 3, 5]], factor * np.diag(K)[[1, 2, 3, 5]], rtol=1e-6)
    assert "hull_across" not in data
    x, free = np.array([-0.6, 0, 0, 0, 0.4, 0]), np.array([0.8, 0, 0, 0, 0.3, 0])
    across = data["total_across"][1][0]
    np.testing.assert_allclose(across @ x, 0.0, atol=1e-4)
    assert free @ across @ free == pytest.approx(3 * (0.64 * 100 + 0.36 * 0.25 * 500))
    finite = 3 * np.sort([0.64 * 100 + 0.36 * 0.25 * 500, 200, 300, 100, 150])
    np.testing.assert_allclose(data["total_eigenvalue"][1][0], [*finite, np.inf], rtol=1e-6)
    np.testing.assert_allclose(data["hull_eigenvalue"][1][0], np.sort([200, 400, 600, 200, 250, 300]))
    rows = data["rigid"][1][0]
    assert np.isnan(rows[:5]).all()
    np.testing.assert_allclose(rows[5], [0.6, 0, 0, 0, -0.4, 0])
    np.testing.assert_array_equal(linear_record._rows(data["rigid"][1]), rows[5:])


# -- several ranks -----------------------------------------------------------------------------------------------------


class Comm(SimpleNamespace):
    """The first of two ranks, or the other, whose other one has the same."""

    size = 2

    def gather(self, array, root=0):
        return [array, 10 * array] if self.rank == 0 else None

    def Reduce(self, sent, received, op=None):
        if self.rank == 0:
            received[:] = 3 * sent


def test_notes_of_several_ranks_are_put_together():
    """On the first; the others have nothing."""
    taken = []
    for rank, row in ((0, [3.0, 6.0]), (1, None)):
        own = SimpleNamespace(comm=Comm(rank=rank), _row=np.array([1.0, 2.0]), _take=lambda: taken.append(1))
        own.note = lambda own=own: Observer.note(own)
        found, out = own.note(), np.full(2, 9.0)
        assert (found if found is None else found.tolist()) == row
        Observer.noting(own, out)()
        assert out.tolist() == (row or [0.0, 0.0])
        gathered = Observer._gather(own, np.array([1.0, 2.0]))
        assert (gathered if gathered is None else gathered.tolist()) == (None if rank else [1.0, 2.0, 10.0, 20.0])
        own._gather = lambda array, own=own: Observer._gather(own, array)
        own._node_order, own._cell_order = np.array([3, 0]), np.array([1])
        along = Observer.along(own, {"a": np.array([1.0, 2.0])}, {"b": np.array([5.0])})
        assert {name: x.tolist() for name, x in along.items()} == ({} if rank else {"a": [20.0, 1.0], "b": [50.0]})
    assert len(taken) == 4
    smallest = SimpleNamespace(_find=lambda: taken.append(2), _comm=Comm(rank=0), values=np.array([2.0]))
    Smallest._of_all_ranks(smallest)
    assert (taken[-1], smallest.values.tolist(), nothing().sizes) == (2, [6.0], {})


# -- files and machines ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("interval", "shown"),
    [(0.25, [0.0, 0.3, 0.5, 0.8, 1.0]), (0.1, np.arange(11) / 10), (0.0, np.arange(11) / 10),
     (0.4, [0.0, 0.4, 0.8, 1.0]), (0.5 * (1 + 0.9e-6), [0.0, 0.5, 1.0]), (0.5 * (1 + 1.3e-6), [0.0, 0.6, 1.0])],
)  # fmt: skip
def test_instants_of_a_record_without_lines(monkeypatch, interval, shown):
    monkeypatch.setattr(paraview, "frame_interval", lambda scene: interval)
    times = 5.0 + np.arange(11) / 10
    found = paraview.instants(xr.Dataset(coords={"time": times}), SCENE)
    np.testing.assert_allclose(found, 5.0 + np.array(shown))
    long = xr.Dataset(coords={"time": np.arange(401.0)})
    assert len(paraview.instants(long, SimpleNamespace(time=None))) == 201


def test_hulls_and_joints_have_the_numbers_that_they_have_in_the_record():
    """A buoy without a hull counts, and has none."""
    points, quads = np.zeros((4, 3)), np.array([[0, 1, 2, 3]])
    hull = SimpleNamespace(shape=1, surface=lambda: (points, quads), spin=None)
    mesh = paraview.hull_mesh(SimpleNamespace(buoys=[SimpleNamespace(shape=None), hull, hull]))
    assert mesh.cell_data["buoy [1]"][0].tolist() == [1, 2]
    assert mesh.cells[0].data.tolist() == [[0, 1, 2, 3], [4, 5, 6, 7]]
    assert mesh.point_data == {}
    marks = [SimpleNamespace(weight=5.0, node=2), SimpleNamespace(weight=-7.0, node=0)]
    x = np.arange(9.0).reshape(3, 3)
    joints = paraview.joint_mesh(SimpleNamespace(x=x, run=SimpleNamespace(joints=marks)))
    assert joints.points.tolist() == x[[2, 0]].tolist()
    assert joints.point_data["net weight [N]"].tolist() == [5.0, -7.0]
    assert (joints.point_data["joint [1]"].tolist(), joints.cells[0].data.tolist()) == ([0, 1], [[0], [1]])


def test_a_collection_names_its_files_by_time_and_part(tmp_path):
    """In order, with a header that ParaView reads; what there is one of is of all instants."""
    frames = [SimpleNamespace(time=time) for time in (0.0, 0.1 + 0.2)]
    files = [Path(f"a/cable_{k}.vtu") for k in range(2)], [Path("a/bed_0.vtu")] * 2
    paraview._write_collection(tmp_path / "all.pvd", frames, *files)
    lines = (tmp_path / "all.pvd").read_text().splitlines()
    assert lines[:3] == [
        "<?xml version='1.0' encoding='utf-8'?>",
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
        "  <Collection>",
    ]
    assert [line.strip() for line in lines[3:7]] == [
        f'<DataSet timestep="{time}" part="{part}" file="{file}" />'
        for time, k in (("0.0", 0), ("0.30000000000000004", 1))
        for part, file in ((0, f"cable_{k}.vtu"), (1, "bed_0.vtu"))
    ]


def test_a_buoy_without_a_hull_is_its_axis():
    buoy = SCENE.network.buoys["buoy"].model_copy(update={"hull": None, "mooring_height": 0.3})
    one = Floating(buoy, np.zeros(3), np.eye(3))
    assert one.outline.tolist() == [[pytest.approx(0.3 - one.center), 0.0], [0.0, 0.0]]
    assert one.in_hull(np.zeros((2, 5, 3))).tolist() == [[False] * 5] * 2
    assert one.mast.tolist() == [one.at(0.3).tolist(), one.at(max(one.heights)).tolist()]


def test_the_processor(monkeypatch):
    monkeypatch.setattr(Path, "read_text", lambda path: "vendor: x\nmodel name\t: A B: C \nmodel name: D")
    assert measured.machine() == "A B: C"
    for text in (lambda path: "vendor: x", lambda path: (_ for _ in ()).throw(FileNotFoundError)):
        monkeypatch.setattr(Path, "read_text", text)
        assert measured.machine() == platform.machine()


def test_times_of_a_run_are_medians(monkeypatch):
    """Of one run unless more are asked for; its numbers are those of the first."""
    walls = iter([5.0, 4.0, 1.0, 3.0])
    made = lambda *_: measured.Run(np.zeros(1), {}, wall := next(walls), wall / 2)  # noqa: E731
    monkeypatch.setattr(measured, "_once", made)
    assert measured.compute(SCENE, []).wall == 5.0
    found = measured.compute(SCENE, [], 3)
    assert (found.wall, found.cpu) == (3.0, 1.5)
    assert [measured.window_start(load_scene(SCENE, waves__ramp=r)) for r in (0.0, 32.0, 32.1)] == [4.0, 32.0, 4.0]


def test_a_run_without_a_cost(tmp_path):
    """As it is kept: times and quantities, and no seconds, steps or unknowns."""
    run = measured.Run(np.arange(3.0), {"a": np.ones((3, 2)), "b": np.zeros((3, 1))}, 5.0, 4.0, 3, 2, 1, 7, 9)
    run.save(tmp_path / "run.npz")
    again = measured.Run.kept(tmp_path / "run.npz")
    assert (again.t.tolist(), again.values.keys()) == ([0.0, 1.0, 2.0], {"a", "b"})
    assert all(np.array_equal(again.values[name], run.values[name]) for name in "ab")
    costs = ("wall", "cpu", "steps", "iterations", "rejected", "failed", "unknowns")
    assert [getattr(again, name) for name in costs] == [0] * 7
    assert [getattr(run, name) for name in costs] == [5.0, 4.0, 3, 2, 1, 7, 9]


def test_a_folder_may_be_shared(tmp_path):
    """By those that share it, by no other; then it is free."""
    place = tmp_path / "a"
    before = os.umask(0)
    with folder.claimed(place, shared=True):
        os.umask(before)
        with folder.claimed(place, shared=True), pytest.raises(InputError, match="is in use"):
            folder.claimed(place).__enter__()
    assert stat.S_IMODE((place / folder.LOCK).stat().st_mode) == 0o666
    for _ in range(2):
        with folder.claimed(place), pytest.raises(InputError, match="is in use"):
            folder.claimed(place, shared=True).__enter__()


# -- runs and cases ----------------------------------------------------------------------------------------------------


def test_what_is_no_number_is_text():
    assert statistics._column([1, 2.5]).tolist() == [1.0, 2.5]
    assert statistics._column([True, "b", [1, 2], None]).tolist() == ["true", "b", "[1, 2]", "null"]
    assert statistics.shortest_life(["a"], [math.inf], 2.0) == []
    assert statistics.shortest_life(["a", "b"], [9.0, 4.0], 1.0) == ["The shortest life is 4 years, of b."]


def test_runs_have_the_numbers_of_their_places(tmp_path):
    record = RECORD.assign_attrs(scene=SCENE.to_toml())
    assert [one.name for one in statistics.runs_of([record, record], 9.0, (1.0, 2.0))] == ["run 0", "run 1"]
    assert statistics.run_of(record).name == "run 0"
    (tmp_path / "cases").mkdir()
    for more in ({"start": 1.0}, {"point": (1.0, 2.0)}):
        with pytest.raises(InputError, match="a sweep keeps no records"):
            statistics.runs_of([tmp_path], **more)


def test_lives_without_damage_and_series_without_a_line():
    for yearly in (0.0, math.nan):
        assert math.isnan(Fatigue().life({}, "tension_top of cable", yearly))
    assert Fatigue().life({}, "tension_top of cable", 0.25) == 4.0
    assert _strength("offset of buoy", SCENE) == {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "rainflow", None)
        with pytest.raises(InputError, match="rainflow is not installed"):
            Series("x", np.arange(3.0), np.arange(3.0)).ranges()


@pytest.mark.parametrize("rise", [1.0, 0.99])
def test_turns_of_a_line_that_rises_and_falls_enough(rise):
    z = [0.0, 2.0, 2.0, 1.0, 4.0, 4.5, 3.0, 3.4, 1.0]
    turns = [("hog", 5.0)] if rise == 1.0 else [("hog", 1.0), ("sag", 3.0), ("hog", 5.0)]
    assert _turns(np.arange(9.0), np.array(z), rise) == turns
    assert _turns(np.arange(3.0), np.array([0.0, 1.0, 2.0]), 0.5) == []
