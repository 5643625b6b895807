"""Current, wind and force varying in time, from rows and files, and gusts from their spectra.

Source: impulses as integrals by hand; equilibria in the instantaneous current; the turbulence intensity of ISO 19901-1
and of Kaimal; sums over depth and time in numpy.
"""

import math

import numpy as np
import pytest
import xarray as xr
from every_key import shows
from scipy.integrate import trapezoid

import dolfbuoy
from dolfbuoy import InputError, load_scene
from dolfbuoy.check import weather
from dolfbuoy.check.report import derived
from dolfbuoy.model.sea import velocity_at
from dolfbuoy.model.varying import COMPONENTS, Grid, Gusts, seed_of, spectrum_of
from dolfbuoy.scene import wave_files

#: A body of 100 kg in empty space, whose wind acts 10 m above z = 0, where it has its speed.
BODY = {
    "gravity": 0.0,
    "buoy": {"mass": 100.0, "center_of_mass": 0.0, "inertia": [1e6, 1e6]},
    "initial": {"buoy_position": [0.0, 0.0, 10.0]},
    "time": {"end": 2.0, "step": 0.005, "scheme": "bdf2"},
}
LINE = {
    "cable": {
        "length": 9.0,
        "line_density": 1.0,
        "diameter": 0.02,
        "elements": 2,
        "top": {"kind": "fixed", "position": [1.0, 0.0, -1.0]},
    }
}
WIND = {
    "speed_10m": 8.0,
    "direction_deg": 30.0,
    "area": 2.0,
    "height": 0.0,
    "air_density": 1.2,
    "drag_coefficient": 1.5,
}
#: A float on a light line, which follows a slow current.
MOORED = {
    "sea": {"depth": 20.0},
    "cable": {"length": 22.0, "elements": 3, "diameter": 0.05, "line_density": 2.5, "normal_drag": 1.2},
    "buoy": {"hull": [[0.0, 1.0], [1.0, 1.0]], "mass": 300.0, "center_of_mass": 0.2, "normal_drag": 1.0},
    "time": {"end": 300.0, "step": 1.0},
}

TIDE = [[0.0, 0.25, 0.0], [100.0, 1.0, 60.0]]


def momentum(scene):
    """Momentum of the body at the end of a run [N s]."""
    return dolfbuoy.simulate(load_scene(scene)).linear_momentum.values[-1, 0]


@shows("external_force.over_time", "buoy.external_force.over_time")
def test_a_force_over_time_is_added():
    """Its impulse is the area under the rows, and after the last one it stays."""
    rows = [[0.0, 0.0, 0.0, 5.0], [0.5, 20.0, 0.0, 5.0], [1.5, -10.0, 4.0, 5.0]]
    found = momentum(BODY | {"external_force": {"force": [1.0, 0.0, 0.0], "over_time": rows}})
    x = 2.0 + (0.5 * 20.0) / 2 + (20.0 - 10.0) / 2 - 0.5 * 10.0
    np.testing.assert_allclose(found, [x, 4.0 / 2 + 0.5 * 4.0, 10.0], atol=0.03)


@shows("wind.over_time", "buoy.wind.over_time")
def test_a_wind_over_time_turns_as_a_vector():
    """Half way between rows at a right angle it is as weak as the vector between them."""
    rows = [[0.0, 1.0, 0.0], [2.0, 1.0, 90.0]]
    found = momentum(BODY | {"wind": WIND | {"over_time": rows}})
    t = np.linspace(0.0, 2.0, 20001)
    v = 8.0 * ((1 - t / 2) + 1j * t / 2) * np.exp(1j * math.radians(30.0))
    impulse = trapezoid(0.5 * 1.5 * 1.2 * 2.0 * np.abs(v) * v, t)
    np.testing.assert_allclose(found[:2], [impulse.real, impulse.imag], rtol=5e-3)


@shows("wind.gusts", "wind.seed", "wind.ramp", "wind.turbulence")
@shows("buoy.wind.gusts", "buoy.wind.seed", "buoy.wind.ramp", "buoy.wind.turbulence")
@pytest.mark.parametrize("gusts", [{"gusts": "npd"}, {"gusts": "kaimal", "turbulence": 0.12}])
def test_gusts_push_with_the_speed_of_the_moment(gusts):
    wind = WIND | gusts | {"seed": 4, "ramp": 1.0}
    scene = load_scene(BODY | {"wind": wind})
    of = Gusts(scene.wind, 4)
    t = np.linspace(0.0, 2.0, 4001)
    v = 8.0 + np.array([of(x) for x in t])
    impulse = trapezoid(0.5 * 1.5 * 1.2 * 2.0 * v**2, t)
    assert np.hypot(*momentum(scene)[:2]) == pytest.approx(impulse, rel=5e-3)
    assert of(0.0) == 0.0
    assert abs(impulse / (0.5 * 1.5 * 1.2 * 2.0 * 64.0 * 2.0) - 1) > 0.02
    assert seed_of(scene, scene.wind) == 4
    assert seed_of(load_scene("storm", waves__seed=3), load_scene(scene, wind__seed=None).wind) == 3


@pytest.mark.parametrize("speed", [10.0, 25.0])
def test_gusts_have_the_turbulence_of_their_spectrum(speed):
    """ISO 19901-1: I_u = 0.06 (1 + 0.043 U) at 10 m; Kaimal's is given, less what slower gusts have."""
    wind = load_scene(BODY | {"wind": WIND | {"speed_10m": speed, "gusts": "npd"}}).wind
    assert Gusts(wind, 0).deviation / speed == pytest.approx(0.06 * (1 + 0.043 * speed), rel=0.04)
    wind = load_scene(BODY | {"wind": WIND | {"speed_10m": speed, "gusts": "kaimal", "turbulence": 0.15}}).wind
    slower = 1 - (1 + 6 / 600 * 8.1 * 7 / speed) ** (-2 / 3)  # integral of the spectrum from 0 to 1/600 Hz
    faster = (1 + 6 * 0.5 * 8.1 * 7 / speed) ** (-2 / 3)
    assert Gusts(wind, 0).deviation / speed == pytest.approx(0.15 * math.sqrt(1 - slower - faster), rel=0.02)


def test_a_series_of_gusts_has_the_spectrum():
    """Variance in bands of frequency, over seeds."""
    wind = load_scene(BODY | {"wind": WIND | {"gusts": "npd"}}).wind
    sums = [Gusts(wind, seed) for seed in range(20)]
    assert all(len(one.amplitude) == COMPONENTS for one in sums)
    for low, high in ((0.004, 0.02), (0.02, 0.1), (0.1, 0.4)):
        f = np.linspace(low, high, 4001)
        inside = [one.amplitude[(low < one.frequency / 2 / np.pi) & (one.frequency / 2 / np.pi < high)] for one in sums]
        mean = np.mean([np.sum(amplitude**2) / 2 for amplitude in inside])
        assert mean == pytest.approx(trapezoid(spectrum_of(wind)(f), f), rel=0.03)
    t = np.arange(0.0, 3000.0, 1.0)
    series = np.array([sums[0](x) for x in t])
    assert series.std() == pytest.approx(sums[0].deviation, rel=0.1)
    assert not np.allclose(series, [sums[1](x) for x in t])


@pytest.mark.parametrize("t", [0.0, 10.0, 14.0, 20.0, 43.0, 50.0, 60.0])
def test_a_grid_is_linear_between_its_times(t):
    """Whenever it begins, and as it is at its ends before and after them."""
    times, u = [10.0, 20.0, 50.0], [0.3, 0.9, -0.4]
    grid = Grid([[t, z, (1 + z) * x, x**2] for t, x in zip(times, u, strict=True) for z in (0.0, -2.0)])
    speed, across = np.interp(t, times, u), np.interp(t, times, np.square(u))
    np.testing.assert_allclose(grid(t), [[-speed, across, 0.0], [speed, across, 0.0]], atol=1e-15)


def test_how_fast_a_current_changes():
    """Rows of a factor and of an angle: the chord of the turn, over the time between."""
    rows = [[5.0, 1.0, 0.0], [9.0, 1.0, 60.0], [10.0, 0.6, 60.0]]
    current = load_scene({"sea": {"depth": 9.0}, "current": {"speed": 2.0, "over_time": rows}} | LINE).current
    assert weather._rate(current) == pytest.approx(2.0 * 0.4 / 1.0)
    slower = current.model_copy(update={"over_time": rows[:2]})
    assert weather._rate(slower) == pytest.approx(2.0 * 1.0 / 4.0)


@pytest.mark.parametrize(
    ("count", "said"),
    [(1_000_000, "must hold time, x, y, z"), (1_000_001, "a series over time of at most 1000000 numbers, not 1000001")],
)
def test_files_of_motions_are_of_bounded_length(tmp_path, count, said):
    """What is compressed may be long: its numbers are counted before they are read."""
    xr.Dataset({"time": ("time", np.zeros(count))}).to_netcdf(tmp_path / "motion.nc")
    with pytest.raises(ValueError, match=said):
        wave_files._motions(tmp_path / "motion.nc")


@shows("current.over_time", "current.grid")
@pytest.mark.parametrize(
    "current",
    [
        pytest.param({"speed": 0.8, "direction_deg": 20.0, "over_time": TIDE}, marks=pytest.mark.slow),
        pytest.param({"profile": [[-20.0, 0.1], [0.0, 0.8]], "over_time": TIDE}, marks=pytest.mark.slow),
        {"grid": [[0.0, -20.0, 0.1, 0.0], [0.0, 0.0, 0.3, 0.0], [100.0, -20.0, 0.1, 0.2], [100.0, 0.0, 0.4, 0.7]]},
    ],
)
def test_what_follows_a_slow_current_is_at_rest_in_that_of_the_moment(current):
    """At t = 0 in that of the first row, long after the last in the last."""
    scene = load_scene(MOORED | {"current": current})
    record = dolfbuoy.simulate(scene)
    for row, t in ((0, 0.0), (-1, 100.0)):
        heights = np.array([[0.0, 0.0, -20.0], [0.0, 0.0, 0.0]])
        flow = velocity_at(scene, t, heights)
        steady = [[0.0, z, u, v] for (_, _, z), (u, v, _) in zip(heights, flow, strict=True)]
        rest = dolfbuoy.solve_static(load_scene(MOORED | {"current": {"grid": steady}}))
        found = record.buoy_position.values[row, 0]
        assert np.linalg.norm(rest.buoy_position.values[0, :2]) > 1.0
        np.testing.assert_allclose(found, rest.buoy_position.values[0], atol=0.05)


def test_files_are_the_rows_in_them(tmp_path):
    (tmp_path / "wind.csv").write_text("t, factor, turn\n0, 1, 0\n10, 2, 30\n")
    (tmp_path / "force.csv").write_text("0 1 2 3\n5 4 5 6\n")
    u, v = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]), np.zeros((2, 3))
    data = xr.Dataset(
        {"uo": (("time", "depth"), u), "vo": (("time", "depth"), v)},
        coords={"time": ("time", [1.0, 2.0], {"units": "hours since 2020-01-01"}), "depth": [0.0, 10.0, 20.0]},
    )
    data.to_netcdf(tmp_path / "stream.nc")
    (tmp_path / "scene.toml").write_text(
        "sea = {depth = 20.0}\nwind = {speed_10m = 5.0, area = 1.0, height = 1.0, over_time = 'wind.csv'}\n"
        "external_force = {force = [0.0, 0.0, 0.0], over_time = 'force.csv'}\ncurrent = {grid = 'stream.nc'}\n"
        "buoy = {hull = [[0.0, 1.0], [1.0, 1.0]], mass = 300.0}\n"
    )
    scene = load_scene(tmp_path / "scene.toml")
    assert scene.wind.over_time == [(0.0, 1.0, 0.0), (10.0, 2.0, 30.0)]
    assert scene.external_force.over_time == [(0.0, 1.0, 2.0, 3.0), (5.0, 4.0, 5.0, 6.0)]
    np.testing.assert_allclose(velocity_at(scene, 1800.0, [[0.0, 0.0, -5.0]]), [[0.3, 0.0, 0.0]])
    assert load_scene(scene.to_dict()) == scene
    rows = [
        f"{t}, {z}, {x}, 0" for t, of in zip((0, 3600), u, strict=True) for z, x in zip((0, -10, -20), of, strict=True)
    ]
    (tmp_path / "stream.csv").write_text("\n".join(["t, z, u, v", *rows]))
    (tmp_path / "other.toml").write_text((tmp_path / "scene.toml").read_text().replace("stream.nc", "stream.csv"))
    assert load_scene(tmp_path / "other.toml").current == scene.current


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"current": {"grid": [[0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 1.0, 0.0]], "speed": 1.0}}, "does not go with a grid"),
        ({"current": {"grid": [[0.0, 0.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.0]]}}, "a row for every height"),
        ({"current": {"speed": 1.0, "over_time": [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]}}, "with t increasing"),
        ({"wind": WIND | {"gusts": "kaimal"}}, "wind.turbulence: must be given"),
        ({"wind": WIND | {"seed": 1}}, "wind.seed = 1: goes with gusts"),
    ],
)
def test_what_is_no_change_over_time(change, said):
    with pytest.raises(InputError) as error:
        load_scene(MOORED, **change)
    assert said in str(error.value)


def test_a_shift_of_frequency_needs_a_steady_current():
    waves = {"amplitude": 0.5, "period": 6.0, "period_seen_from": "ground"}
    current = {"speed": 0.8, "over_time": [[0.0, 0.25, 0.0], [100.0, 1.0, 60.0]]}
    with pytest.raises(InputError, match="goes with a steady current"):
        load_scene(MOORED | {"waves": waves, "current": current})


def test_check_says_what_gusts_are_and_what_is_too_fast():
    wind, current = WIND | {"gusts": "npd"}, {"speed": 1.0, "over_time": [[0.0, 0.0, 0.0], [20.0, 1.0, 0.0]]}
    report = derived(load_scene(MOORED | {"wind": wind, "current": current}))
    (row,) = [row for row in report.numbers if row[0] == "standard deviation of the gusts"]
    assert row[1] == pytest.approx(0.06 * (1 + 0.043 * 8.0) * 8.0, rel=0.05)
    assert any("changes by up to 0.05 m/s" in said for said in report.warnings)
    assert any("current.over_time ends at 20 s" in said for said in report.warnings)
