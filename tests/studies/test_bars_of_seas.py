"""Error bars of extremes in a long sea, from coarser runs around them: when, in which waves, and with what result.

Source: made-up records; the sum of the sea's components; a companion with a given difference; the run itself.
"""

import numpy as np
import pytest
import xarray as xr
from mpi4py import MPI

from dolfbuoy import load_scene, simulate
from dolfbuoy.accuracy.bars import RESOLVED, SUSPECT, bars_of
from dolfbuoy.accuracy.companion import Event, companion_around, covered, events_of
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.api import _quietly
from dolfbuoy.model.airy import AirySum
from dolfbuoy.model.pool import Pool


def made_up(scene, heights):
    """A record of `storm` whose top tension has spikes of these heights [N] at these times [s], on a ripple."""
    t = np.arange(0.0, scene.time.end + 0.05, 0.1)
    top = 5000 + 100 * np.sin(t)
    for at, height in heights.items():
        top = top + height * np.exp(-((t - at) ** 2))
    record = xr.Dataset({"tension_top": (("time", "cable"), top[:, None])}, {"time": t, "cable": ["cable"]})
    return record


STORM_OF_400_S = {"time": {"end": 400.0, "step": 0.1, "scheme": "bdf2"}}


def test_events():
    """Around the largest tension after what the companion covers, if the sea is all that depends on time."""
    scene = load_scene("storm", **STORM_OF_400_S)  # a sea of 6 s that grows for 20 s
    assert covered(scene) == pytest.approx(20 + 38)
    (event,) = events_of(scene, made_up(scene, {300.0: 5000.0}))
    assert event == pytest.approx((258.0, 294.0, 306.0), abs=0.11)
    assert events_of(scene, made_up(scene, {30.0: 5000.0})) == []  # the companion has it
    cut = load_scene(scene, cable__fails_at={"time": 399.0})
    assert events_of(cut, made_up(scene, {300.0: 5000.0})) == []
    short = load_scene(scene, time__end=140.0)
    assert covered(short) == 140.0
    assert events_of(short, made_up(short, {130.0: 5000.0})) == []


def test_the_sea_around_an_event():
    """Elevation at a place, with and without a current that shifts the frequencies, from the grown sea on."""
    for more in ({}, {"waves__period_seen_from": "water"}):
        scene = load_scene("storm", **STORM_OF_400_S, **more)
        around = companion_around(scene, Event(100.0, 136.0, 150.0))
        assert (around.time.end, around.time.step, around.waves.ramp) == (50.0, 0.2, 12.0)
        seas = [AirySum.of(one) for one in (scene, around)]
        t, places = np.linspace(120.0, 150.0, 7), np.tile([3.0, -2.0, 0.0], (7, 1))
        expected, found = seas[0].over_time(t, places), seas[1].over_time(t - 100.0, places)
        np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_bars_of_an_event():
    """A third of what the companion around it differs by; without it, or on another way, it is suspect."""
    scene = load_scene("storm", **STORM_OF_400_S)
    record, event = made_up(scene, {300.0: 5000.0, 150.0: -3000.0}), Event(250.0, 286.0, 306.0)
    coarse = record.isel(time=record.time.values <= covered(scene))
    late = record.isel(time=(record.time.values >= 250.0) & (record.time.values <= 306.0))
    for height, verdict in ((150.0, RESOLVED), (-1500.0, SUSPECT)):
        other = late + height * np.exp(-((late.time - 300.0) ** 2))
        other = other.assign_coords(time=late.time.values - 250.0)
        bar = bars_of(record, scene, coarse, events={event: other})[0][Output("tension_top", "max", "cable")]
        assert bar.bar == pytest.approx(abs(height) / 3, rel=1e-2)
        assert bar.verdict == verdict
    alone = bars_of(record, scene, coarse)[0][Output("tension_top", "max", "cable")]
    assert alone.verdict == SUSPECT


def test_a_sea_of_many_periods_has_companions_around_its_extremes():
    """Both extremes of a run of a minute of a short sea are known, and not only those of its beginning."""
    sea = {"spectrum": "jonswap", "significant_height": 0.2, "peak_period": 2.0, "components": 40, "ramp": 4.0}
    scene = load_scene("storm").to_dict() | {"waves": sea}
    run = simulate(scene, time={"end": 60.0, "step": 0.04, "scheme": "bdf2"}, accuracy={"estimate": "companion"})
    bars = dict(zip(run.output.values.tolist(), run.bar_verdict.values.tolist(), strict=True))
    assert run.time.values[run.tension_top.values[:, 0].argmax()] > 12.0
    assert bars["tension_top.max"] == RESOLVED


def test_a_run_that_is_only_compared_with_is_the_run():
    """Series to the last bit, of a problem that served another scene before; shapes of lines are left out."""
    pool, scene = Pool(), load_scene("short", cable__elements=6, time={"end": 1.0, "step": 0.05, "scheme": "bdf2"})
    _quietly(load_scene(scene, waves__amplitude=0.3), MPI.COMM_SELF, pool)
    found, run = _quietly(scene, MPI.COMM_SELF, pool), simulate(scene)
    pool.clear()
    assert {"tension_top", "anchor_force", "buoy_position", "cone_angle"} <= set(found.data_vars)
    for name in found.data_vars:
        np.testing.assert_array_equal(found[name], run[name])
    assert {name for name in run.data_vars if "time" in run[name].dims} <= set(found.data_vars)
    assert found.attrs["failed_steps"] == run.attrs["failed_steps"]
