"""Time-step errors from a second, corrected trajectory, and the runs for which there is none.

Source: runs on the same mesh with short steps; orders of convergence; runs that were stopped, or made on two ranks.
"""

import math

import numpy as np
import pytest
import xarray as xr
from mpi_helpers import needs_mpirun, start_scenes

from dolfbuoy import figures, load_scene, simulate
from dolfbuoy.motion.corrected import can_follow
from dolfbuoy.results.bars import summary_rows
from dolfbuoy.results.quantities import errors
from dolfbuoy.results.record import read
from dolfbuoy.results.recorder import Recorder

TIME = {"accuracy__estimate": "time"}
SERIES = {
    "top tension": lambda record: record.tension_top.values[:, 0],
    "anchor force": lambda record: np.linalg.norm(record.anchor_force.values[:, 0], axis=-1),
    "height": lambda record: record.buoy_position.values[:, 0, 2],
    "cone angle": lambda record: record.cone_angle.values[:, 0],
}


def corrected(record):
    names = [name for name in record.data_vars if f"{name}_error" in record]
    return record.assign({name: record[name] - record[f"{name}_error"] for name in names})


def rms(x):
    return math.sqrt(np.mean(np.square(x)))


@pytest.fixture(scope="module")
def short():
    """Scheme -> (run of `short` with errors of the steps, run of the same mesh with an eighth of the steps)."""
    found = {}
    for scheme, step in (("backward-euler", 0.01), ("bdf2", 0.05)):
        scene = load_scene("short", time={"scheme": scheme, "step": step, "end": 6.0})
        fine = load_scene(scene, time={"scheme": "bdf2", "step": step / 8, "end": 6.0})
        found[scheme] = simulate(scene, **TIME), simulate(fine)
    return found


@pytest.mark.parametrize(("scheme", "most"), [("backward-euler", 0.15), ("bdf2", 0.25)])
@pytest.mark.parametrize("name", SERIES)
def test_what_is_left_without_the_error(short, scheme, most, name):
    run, fine = short[scheme]
    late, series = run.time.values >= 1.5, SERIES[name]
    truth = np.interp(run.time, fine.time, series(fine))[late]
    assert rms(series(run)[late] - truth) > 2e-4 * np.ptp(truth)
    assert rms(series(corrected(run))[late] - truth) < most * rms(series(run)[late] - truth)


@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 2), ("bdf2", 3)])
def test_order_without_the_error(scheme, order):
    """One more than the scheme's own, for forces and positions."""
    scene = load_scene("driven", cable__elements=4, time={"end": 4.0}, solver={"step_tolerance": 1e-9})
    fine = simulate(scene, time={"scheme": "bdf2", "step": 0.005, "end": 4.0})
    left = []
    for step in (0.16, 0.08):
        run = simulate(scene, time={"scheme": scheme, "step": step, "end": 4.0}, **TIME)
        truth = np.interp(run.time, fine.time, fine.tension_top[:, 0])
        late = run.time.values > 2.5
        left.append(rms((corrected(run).tension_top[:, 0] - truth)[late]))
    assert math.log2(left[0] / left[1]) > order - 0.15


def test_a_run_stays_what_it_is(short):
    """To the last bit; a scene that requests no errors has none."""
    run, _ = short["bdf2"]
    plain = simulate("short", time={"scheme": "bdf2", "step": 0.05, "end": 6.0})
    assert [name for name in plain.data_vars if name.endswith("_error")] == []
    for name in plain.data_vars:
        np.testing.assert_array_equal(run[name], plain[name])
    assert run.attrs["quaternion_drift"] == plain.attrs["quaternion_drift"]


class Stop(Exception):
    """Raised in the middle of a run."""


STOPS = [(1, "bdf2"), (7, "backward-euler"), (2, "bdf2"), (7, "bdf2"), (1, "backward-euler"), (2, "backward-euler")]


@pytest.mark.parametrize(
    ("steps", "scheme"), [*STOPS[:2], *(pytest.param(*stop, marks=pytest.mark.slow) for stop in STOPS[2:])]
)
def test_a_run_that_was_stopped(tmp_path, monkeypatch, scheme, steps):
    """Equal errors to the last bit, even if stopped while the history was still too short."""
    monkeypatch.setattr(Recorder, "pause", 0.0)
    monkeypatch.setattr(Recorder, "share", 1e9)

    def stop(simulation, iterations):
        if simulation.t > (steps - 0.5) * 0.05:
            raise Stop

    scene = load_scene("short", cable__elements=4, time={"scheme": scheme, "step": 0.05, "end": 0.6}, **TIME)
    with pytest.raises(Stop):
        simulate(scene, tmp_path, progress=stop)
    assert len(read(tmp_path / "results.nc").time) == steps + 1
    whole, resumed = simulate(scene), simulate(resume=tmp_path)
    for name in (name for name in whole.data_vars if name.endswith("_error")):
        np.testing.assert_array_equal(resumed[name], whole[name])
    assert np.abs(whole.tension_top_error).max() > 0.1


def test_until_the_first_other_step():
    """Here the last step is shorter than the others: its errors are unknown."""
    run = simulate("short", cable__elements=4, time={"scheme": "bdf2", "step": 0.05, "end": 0.48}, **TIME)
    known = np.isfinite(run.tension_top_error[:, 0])
    assert known.values.tolist() == [True] * 10 + [False]


def test_a_run_that_cannot_be_followed():
    """With 25 steps per period the run is wrong by a third of the range; errors found before stay small."""
    run = simulate("short", time={"scheme": "bdf2", "step": 0.2, "end": 16.0}, **TIME)
    error, known = run.tension_top_error[:, 0].values, np.isfinite(run.tension_top_error[:, 0].values)
    assert 30 < known.sum() < len(error)
    assert not known[known.sum() :].any()
    assert np.abs(error[known]).max() < 0.3 * np.ptp(run.tension_top[:, 0].values)


@pytest.mark.parametrize(
    ("name", "changes", "can"),
    [
        ("short", {"time__scheme": "backward-euler"}, True),
        ("short", {"time__scheme": "bdf2"}, True),
        ("three-legs", {"time__scheme": "bdf2"}, True),
        ("short", {"time__scheme": "generalized-alpha"}, False),
        ("short", {"time__scheme": "bdf2", "time__tolerance": 1e-3}, False),
        ("short", {"time__scheme": "bdf2", "cable__slack": "tension-only"}, False),
        ("short", {"time__scheme": "bdf2", "cable__fails_at": {"time": 1.0, "at": 5.0}}, False),
        ("chain-on-bed", {"time__scheme": "bdf2"}, False),
    ],
)
def test_scenes_that_have_errors_of_the_steps(name, changes, can):
    assert can_follow(load_scene(name, **changes)) == can


def test_angles_that_turn_on():
    values, others = {"yaw": np.array([179.0])}, {"yaw": np.array([-179.0]), "roll": np.zeros(1)}
    assert errors(values, others) == {"yaw_error": pytest.approx(-2.0)}


def test_the_band_in_the_figure(short):
    """From the run to the run minus its error, in kN."""
    run, _ = short["backward-euler"]
    bands = figures.tension(run).axes[0].collections
    for band, name in zip(bands, ("tension_top", "tension_anchor"), strict=True):
        x, error = run[name].values[:, 0] / 1000, run[f"{name}_error"].values[:, 0] / 1000
        corners = {tuple(corner) for corner in band.get_paths()[0].vertices.round(9).tolist()}
        expected = np.concatenate([np.column_stack([run.time, y]) for y in (x, x - error)]).round(9)
        assert {tuple(corner) for corner in expected.tolist()} <= corners


def test_parts_in_the_summary():
    """Known contributions follow the error bar, in its unit."""
    record = xr.Dataset(
        {
            "bar_value": ("output", [12345.0, 20.0, 30.0]),
            "bar": ("output", [250.0, 0.5, 0.6]),
            "bar_time": ("output", [240.0, math.nan, 0.07]),
            "bar_space": ("output", [68.0, math.nan, math.nan]),
            "bar_statistics": ("output", [math.nan] * 3),
            "bar_unit": ("output", ["N", "degree", "N"]),
            "bar_verdict": ("output", ["resolved", "suspect", "none"]),
            "output_of": ("output", [""] * 3),
        },
        {"output": ["tension_top.max", "cone_angle.max", "anchor.max"]},
    )
    assert summary_rows(record) == [
        ("largest top tension", "12.35 +- 0.25 (step 0.24, mesh 0.068)", "kN"),
        ("largest cone angle", "20.00 +- 0.50, suspect", "deg"),
        ("largest anchor force", "30 (error not known) (step 0.07)", "N"),
    ]


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_errors_on_two_ranks(tmp_path):
    scene = load_scene("short", time={"scheme": "bdf2", "step": 0.05, "end": 0.5}, **TIME)
    free = load_scene("free-buoy", time={"scheme": "bdf2", "step": 0.05, "end": 0.5}, **TIME)  # on one rank, all of it
    done = start_scenes(2, {"two": scene.to_dict(), "free": free.to_dict()}, tmp_path)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    one, two = simulate(scene), read(tmp_path / "two" / "results.nc")
    alone, shared = simulate(free), read(tmp_path / "free" / "results.nc")
    np.testing.assert_allclose(shared.buoy_position_error.values, alone.buoy_position_error.values, atol=1e-12)
    for name in ("tension_top_error", "buoy_position_error"):
        np.testing.assert_allclose(two[name].values, one[name].values, atol=2e-3 * float(np.abs(one[name]).max()))
