"""Statistics of runs: crossings, peaks, rainflow, fatigue, Gumbel fits and intervals, watch circles, sets of runs.

Source: ASTM E1049-85, sums and integrals by hand, scipy's fits, samples from known distributions.
"""

import collections
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import optimize, stats

import dolfbuoy
from dolfbuoy import InputError, load_scene, statistics
from dolfbuoy.commands.statistics import show
from dolfbuoy.model import spectra
from dolfbuoy.model.airy import AirySum, components_of
from dolfbuoy.model.sea import elevation_at
from dolfbuoy.results import extremes
from dolfbuoy.results.offsets import smallest_circle
from dolfbuoy.results.parts import alone
from dolfbuoy.results.sample import NUMBERS, Fatigue, binned, sample_of
from dolfbuoy.results.series import Series, described
from dolfbuoy.results.statistics import exceedance, set_of
from dolfbuoy.scene.waves import Waves
from dolfbuoy.studies.one_case import BINS

# -- cycles ----------------------------------------------------------------------------------------------------------


def series(x, t=None, noise=0.0):
    """A series of these values, every second if no times are given."""
    return Series("tension", np.arange(float(len(x))) if t is None else t, np.asarray(x, dtype=float), noise)


def sampled(ranges, counts, duration):
    """A sample of one line with these cycles."""
    return {"duration": duration, "cycles": {"tension": [ranges, counts]}}


def test_rainflow_is_that_of_astm_e1049():
    """The example of the standard, Fig. 6: half cycles as 0.5."""
    ranges, counts = series([-2, 1, -3, 5, -1, 3, -4, 4, -2.0]).ranges()
    found = collections.Counter()
    for size, count in zip(ranges, counts, strict=True):
        found[size] += count
    assert dict(found) == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}


def test_a_series_without_turns_has_no_cycles():
    for x in (np.full(10, 3.0), np.array([1.0])):
        ranges, counts = series(x).ranges()
        assert len(ranges) == len(counts) == 0
        assert Fatigue().equivalent_load(sampled(ranges, counts, 100.0), "tension") == 0.0


def test_damage_of_known_ranges():
    """Ten cycles of 2 and half a one of 4, m = 3: 112 N^3; equivalent in 14 cycles, 28 s at 0.5 Hz: 2."""
    sample = sampled([2.0, 4.0], [10.0, 0.5], 28.0)
    assert Fatigue(3.0).power_sum(sample, "tension") == pytest.approx(112.0, rel=1e-14)
    assert Fatigue(3.0, frequency=0.5).equivalent_load(sample, "tension") == pytest.approx(2.0, rel=1e-14)


@pytest.mark.parametrize("exponent", [3.0, 5.0, 10.0])
def test_bins_lose_what_they_say(exponent):
    ranges = np.random.default_rng(3).rayleigh(size=20_000)
    exact = np.sum(ranges**exponent)
    for bins in (32, 64, 128):
        values, counts = binned(ranges, np.ones(len(ranges)), bins)
        assert len(values) <= bins
        assert counts.sum() == len(ranges)
        assert np.sum(counts * values) == pytest.approx(ranges.sum(), rel=1e-12)
        lost = 1 - np.sum(counts * values**exponent) / exact
        widest = (ranges.max() / np.median(np.repeat(ranges, 1))) ** 2  # what counts most lies above the median
        assert 0 < lost < exponent * (exponent - 1) / 24 / bins**2 * widest
    assert exponent * (exponent - 1) / 24 / BINS**2 < 1e-3  # of the cases of a sweep
    assert binned(ranges, ranges, len(ranges))[0] is ranges
    halves = np.where(ranges > 2, 0.5, 1.0)
    values, counts = binned(ranges, halves, 32)
    assert counts.sum() == halves.sum()
    assert np.sum(counts * values) == pytest.approx(np.sum(halves * ranges), rel=1e-12)


def test_crossings_and_peaks_of_a_sinusoid():
    """The period is interpolated, the peaks are the sampled ones."""
    t = np.linspace(0, 30, 4001)
    x = 2 + 1.5 * np.sin(2 * np.pi * t / 3.7 - 1.0)
    assert series(x, t).period == pytest.approx(3.7, rel=1e-5)
    found, counts = series(x, t).peaks()
    assert found == pytest.approx(np.full(7, 3.5), rel=1e-5)
    assert counts.tolist() == [1.0] * 7
    assert np.isnan(series(x[:200], t[:200]).period)
    assert len(series(1e-12 * x, t, noise=1e-9).peaks()[0]) == 0


def test_peaks_are_between_upward_crossings():
    """Not what comes after the last one, which may still rise."""
    found, counts = series([-1, 1, -1, 2, -1, 3, -1, 4, -1.0]).peaks()
    assert found.tolist() == [1.0, 2.0, 3.0]
    assert counts.tolist() == [1.0] * 3


def test_exceedance_of_four_peaks():
    values, share = exceedance(np.array([1.0, 3.0, 2.0]), np.array([1.0, 1.0, 2.0]))
    assert values.tolist() == [3.0, 2.0, 1.0]
    assert share.tolist() == [0.2, 0.6, 0.8]


def test_numbers_of_a_known_series():
    """x = t^2 on uneven steps: mean 1/3, variance 4/45, third moment 16/945."""
    t = np.linspace(0, 1, 4001) ** 1.5
    found = series(t**2, t).numbers(NUMBERS)
    assert found["mean"] == pytest.approx(1 / 3, rel=1e-6)
    assert found["standard_deviation"] == pytest.approx(math.sqrt(4 / 45), rel=1e-6)
    assert found["skewness"] == pytest.approx(16 / 945 / (4 / 45) ** 1.5, rel=1e-5)
    assert (found["minimum"], found["maximum"]) == (0.0, 1.0)


# -- extremes --------------------------------------------------------------------------------------------------------


def test_gumbel_is_the_likeliest():
    sample = stats.gumbel_r.rvs(7.0, 2.0, size=40, random_state=5)
    found = extremes.fit_gumbel(sample)
    location, scale = stats.gumbel_r.fit(sample)
    assert (found.location, found.scale) == pytest.approx((location, scale), rel=1e-5)
    likelihood = stats.gumbel_r.logpdf(sample, found.location, found.scale).sum()
    assert likelihood >= stats.gumbel_r.logpdf(sample, location, scale).sum() - 1e-9


def test_the_most_probable_value_of_a_longer_time():
    """The distribution of the largest of three runs, F^3, is at its steepest there."""
    found = extremes.Gumbel(5.0, 2.0, 20)
    x = np.linspace(0, 20, 200_001)
    below = stats.gumbel_r.cdf(x, found.location, found.scale) ** 3
    density = np.gradient(below, x)
    assert found.above(x, 3.0) == pytest.approx(1 - below, rel=1e-12, abs=1e-15)
    assert found.most_probable(3.0) == pytest.approx(x[density.argmax()], abs=2e-4)


@pytest.mark.parametrize(("runs", "times"), [(10, 1.0), (10, 9.0), (30, 3.0)])
def test_the_interval_covers_the_truth_as_often_as_it_says(runs, times):
    """Of 2000 samples 95 %, within three deviations of their number."""
    generator, hits, trials = np.random.default_rng(11), 0, 2000
    truth = 40.0 + 3.0 * math.log(times)
    for sample in generator.gumbel(40.0, 3.0, size=(trials, runs)):
        low, high = extremes.fit_gumbel(sample).interval(times)
        hits += low <= truth <= high
    share = extremes.COVERED
    assert hits / trials == pytest.approx(share, abs=3 * math.sqrt(share * (1 - share) / trials))


def test_too_few_or_equal_maxima_have_no_distribution():
    with pytest.raises(InputError, match="10 seeds at least, and here are 9"):
        extremes.fit_gumbel(np.arange(9.0))
    with pytest.raises(InputError, match="all the same"):
        extremes.fit_gumbel(np.full(12, 3.0))


# -- certainty -------------------------------------------------------------------------------------------------------


def test_the_memory_of_a_sea_is_that_of_its_spectrum():
    """Mean of 40 seeds of ten minutes, random amplitudes; a constant has none."""
    waves = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 6.0, "amplitudes": "random"}
    t, found = np.arange(0.0, 600.0, 0.5), []
    for seed in range(40):
        c = components_of(Waves(**waves, seed=seed))
        found.append(series(3.0 + np.cos(np.outer(t, c.frequency) - c.phase) @ c.amplitude, t).memory)
    theory = extremes.memory_of(spectra.jonswap(2.0, 6.0))
    assert np.mean(found) == pytest.approx(theory, rel=0.15)
    assert np.isnan(series(np.ones(len(t)), t).memory)


def test_memory_of_steps_that_adapt():
    """The same of a series whether its steps are even or not."""
    even = np.arange(0.0, 600.0, 0.1)
    uneven = even + 0.05 * np.sin(even)
    first, other = (series(np.cos(t) + 0.5 * np.cos(1.3 * t), t).memory for t in (even, uneven))
    assert other == pytest.approx(first, rel=0.01)


@pytest.mark.slow
def test_a_deviation_is_as_well_known_as_is_said():
    """Of 300 runs, each of five minutes, 95 % lie within the bounds; counted within three deviations."""
    waves = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 6.0, "amplitudes": "random"}
    t, hits = np.arange(0.0, 300.0, 0.5), 0
    known = extremes.deviation_uncertainty(extremes.memory_of(spectra.jonswap(2.0, 6.0)), 300.0)
    for seed in range(300):
        c = components_of(Waves(**waves, seed=seed, components=400))
        hits += abs((np.cos(np.outer(t, c.frequency) - c.phase) @ c.amplitude).std() / 0.5 - 1) < known
    assert hits / 300 == pytest.approx(0.95, abs=3 * math.sqrt(0.95 * 0.05 / 300))


@pytest.mark.parametrize("runs", [10, 14, 25])
@pytest.mark.parametrize("times", [1.0, 18.0])
def test_how_well_a_largest_value_is_known(runs, times):
    """Beside half of the interval from samples; the number of runs is the inverse."""
    largest = extremes.Gumbel(30.0, 2.0, runs)
    low, high = largest.interval(times)
    known = largest.uncertainty(runs, times, 10.0)
    assert known == pytest.approx(0.5 * (high - low) / (largest.most_probable(times) - 10.0), rel=0.05)
    assert largest.runs_needed(known * (1 + 1e-9), times, 10.0) == runs
    assert largest.runs_needed(10.0, times) == extremes.LEAST


@pytest.mark.parametrize("crests", [500.0, 3000.0])
@pytest.mark.parametrize("part", [0.003, 0.01])
def test_components_that_lower_a_crest_by_a_part(crests, part):
    """The height that is exceeded once, with Pearson's first term and without: its root is found."""
    n = extremes.components_needed(crests, part)

    def exceeded(q):
        return math.log(crests) - q + math.log1p(-(q**2 / 2 - q) / (2 * n))

    q = optimize.brentq(exceeded, 1.0, math.log(crests))
    assert 1 - math.sqrt(q / math.log(crests)) == pytest.approx(part, rel=0.05)


def test_the_largest_crest_is_rayleighs():
    """Beside the asymptotic distribution of as many independent crests, to the first order of 1/ln N."""
    found, steepness = extremes.largest_crest(extremes.crests_of(5.0)), math.sqrt(2 * math.log(10800 / 5.0))
    assert found.most_probable() == pytest.approx(steepness, rel=0.01)
    assert found.scale == pytest.approx(1 / steepness, rel=0.1)


# -- circles ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_smallest_circle_of_any_points(seed):
    points = np.random.default_rng(seed).normal(size=(60, 2)) * [3.0, 1.0] + [5.0, -2.0]
    centre, radius = smallest_circle(points)

    def reach(place):
        return np.linalg.norm(points - place, axis=1).max()

    assert reach(centre) == pytest.approx(radius, rel=1e-9)
    best = optimize.minimize(reach, points.mean(axis=0), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    assert radius == pytest.approx(best.fun, rel=1e-7)


def test_smallest_circle_of_few_points():
    for points, centre, radius in (
        ([[1, 2]], (1, 2), 0),
        ([[0, 0], [4, 0], [1, 0]], (2, 0), 2),
        ([[0, 0], [0, 0]], (0, 0), 0),
        ([[0, 0], [2, 0], [1, 1], [1, -1]], (1, 0), 1),
        ([[0, 0], [1, 0], [0.5, math.sqrt(3) / 2]], (0.5, math.sqrt(3) / 6), 1 / math.sqrt(3)),
    ):
        found, size = smallest_circle(np.array(points, dtype=float))
        assert tuple(found) == pytest.approx(centre, abs=1e-12)
        assert size == pytest.approx(radius, abs=1e-12)


# -- runs ------------------------------------------------------------------------------------------------------------

SCENE = load_scene("short", time__end=1200.0, waves={"amplitude": 1.0, "ramp": 100.0, "direction_deg": 30.0})


def narrow(seed, length=1200.0, scene=SCENE, loud_ramp=50.0):
    """A made-up record: a Gaussian sea of variance 1, a tension that follows its square, and noise in the ramp."""
    generator = np.random.default_rng(seed)
    t = np.arange(0, length + 0.01, 0.2)
    w, phase = generator.normal(1.25, 0.1, 200), generator.uniform(0, 2 * np.pi, 200)
    x, y = (math.sqrt(2 / 200) * f(np.outer(t, w) + phase).sum(axis=1) for f in (np.cos, np.sin))
    x[t < 100] += loud_ramp
    data = {
        "surface_elevation": (("time", "buoy"), x[:, None]),
        "tension_top": (("time", "cable"), 5000 + 900 * x[:, None]),
        "buoy_position": (("time", "buoy", "xyz"), np.stack([12 + 2 * x, y, 0 * x], axis=1)[:, None]),
        "offset": (("time", "buoy"), np.hypot(12 + 2 * x, y)[:, None]),
        "newton_iterations": ("time", np.ones(len(t), dtype=int)),
    }
    labels = {"time": t, "xyz": list("xyz"), "cable": ["cable"], "buoy": ["buoy"]}
    return xr.Dataset(data, labels, attrs={"scene": scene.to_toml()})


@pytest.fixture(scope="module")
def runs():
    return [narrow(seed) for seed in range(30)]


@pytest.fixture(scope="module")
def found(runs):
    return alone(statistics(runs, exponent=4.0, constant=1e18, frequency=0.2))


def test_the_ramp_is_left_out(runs, found):
    """Noise in it would raise every number."""
    assert found.start.values == pytest.approx(100.0)
    assert found.duration.values == pytest.approx(1100.0)
    late = runs[3].isel(time=slice(500, None))
    assert float(found.surface_elevation_maximum[3]) == float(late.surface_elevation.max())
    assert statistics(runs[3], start=300.0).duration.item() == pytest.approx(900.0)
    assert statistics(runs[3], start=0.0).surface_elevation_maximum.item() > 50


def test_moments_of_the_sea(found):
    assert found.surface_elevation_m0.mean() == pytest.approx(1.0, abs=0.1)
    deviation = found.surface_elevation_standard_deviation.values
    assert found.surface_elevation_Hs.values == pytest.approx(4 * deviation)
    assert found.surface_elevation_period.mean() == pytest.approx(2 * np.pi / math.hypot(1.25, 0.1), rel=0.01)
    assert float(abs(found.surface_elevation_skewness).max()) < 0.3


def test_peaks_of_a_narrow_band_are_rayleighs(found):
    """Their exceedance, pooled over 30 runs of 200 peaks, within the scatter of shares."""
    peaks, share = found.surface_elevation_peak.values, found.surface_elevation_peak_exceedance.values
    assert len(peaks) > 5000
    for level in (1.0, 2.0, 3.0):
        expected = math.exp(-(level**2) / 2)
        here = np.interp(-level, -peaks, share)
        assert here == pytest.approx(expected, abs=0.02 * expected + 5 * math.sqrt(expected / len(peaks)))


def test_most_probable_maximum_of_a_gaussian_sea(found):
    """sqrt(2 ln N) deviations for the N crests of 3 h lies in the interval; a mean of the maxima does not."""
    crests = 3 * 3600 / float(found.surface_elevation_period.mean())
    estimate, low, high = found.surface_elevation_most_probable.values[0]
    assert low < estimate < high
    assert low < math.sqrt(2 * math.log(crests)) < high
    assert float(found.surface_elevation_maximum.mean()) < low


def test_damage_of_a_run(runs, found):
    ranges, counts = series(runs[0].tension_top.values[500:, 0]).ranges()
    damage = np.sum(counts * ranges**4)
    assert float(found.tension_top_damage[0]) == pytest.approx(damage / 1e18, rel=1e-12)
    assert float(found.tension_top_equivalent_load[0]) == pytest.approx((damage / 220) ** 0.25, rel=1e-12)


def test_circles_of_offsets(runs, found):
    tracks = np.concatenate([run.buoy_position.values[500:, 0, :2] for run in runs])
    centre = np.array([float(found.circle_x[0]), float(found.circle_y[0])])
    assert np.linalg.norm(tracks - centre, axis=1).max() == pytest.approx(float(found.circle_radius[0]), rel=1e-9)
    assert float(found.watch_circle_radius[0]) == pytest.approx(np.linalg.norm(tracks, axis=1).max(), rel=1e-12)
    assert float(found.offset_maximum.max()) == float(found.watch_circle_radius[0])


def test_few_runs_have_no_extreme_and_say_so(runs):
    few = statistics(runs[:9])
    assert "tension_top_most_probable" not in few
    assert "needs 10 seeds at least, and here are 9" in few.attrs["notes"]


def test_runs_of_several_scenes_are_sets(runs):
    other = load_scene(SCENE, waves__amplitude=2.0)
    several = statistics([*runs[:10], *(narrow(100 + k, scene=other) for k in range(10)), narrow(0, 800.0)])
    assert several.sizes["set"] == 2
    assert several.set_of_run.values.tolist() == [0] * 10 + [1] * 10 + [0]
    values = several.tension_top_most_probable.sel(cable="cable", bound="estimate").values
    assert np.isnan(values[0])  # not all of its runs are equally long
    assert np.isfinite(values[1])
    assert "not equally long" in several.attrs["notes"]
    assert "in 1 of 2 sets" in several.attrs["notes"]


def test_sets_may_have_different_lines(runs, capsys):
    other = load_scene(SCENE, waves__amplitude=2.0)
    several = statistics([*runs[:10], *(narrow(k, scene=other).assign_coords(cable=["port"]) for k in range(10))])
    finite = np.isfinite(several.tension_top_most_probable.sel(bound="estimate"))
    assert finite.transpose("set", "cable").values.tolist() == [[True, False], [False, True]]
    assert "not all runs" not in several.attrs["notes"]
    show(several, Path("st"))
    first, second = capsys.readouterr().out.split("set 1: ")
    assert "tension top of cable" in first
    assert "of port" not in first
    assert "tension top of port" in second
    assert "of cable" not in second


def test_neither_a_title_nor_a_seed_makes_a_set():
    assert set_of(load_scene(SCENE, title="other")) == set_of(SCENE)
    assert set_of(load_scene(SCENE, waves__phase_deg=3.0)) != set_of(SCENE)
    first, second = (load_scene("storm", waves__seed=seed) for seed in (1, 2))
    assert set_of(first) == set_of(second) != set_of(load_scene("storm", waves__components=7))


def test_a_run_within_its_ramp_is_refused():
    with pytest.raises(InputError, match=r"run 0: The run ends at t = 80 s, and statistics begin at t = 100 s"):
        statistics(narrow(1, 80.0))


def test_bad_numbers_are_refused(runs):
    for name in ("exponent", "constant", "frequency"):
        with pytest.raises(InputError, match=f"{name} = -1"):
            statistics(runs[0], **{name: -1.0})
    with pytest.raises(InputError, match="no run"):
        statistics([])


def test_elevation_at_a_fixed_point_is_that_of_the_forms():
    times = np.array([0.0, 3.0, 50.0, 99.0, 100.0, 123.4])
    for point in ((0.0, 0.0), (7.0, -11.0)):
        expected = [float(elevation_at(SCENE, t, np.array([*point, 0.0]))) for t in times]
        assert AirySum.of(SCENE).over_time(times, point) == pytest.approx(expected, abs=1e-12)


def test_the_fixed_point_of_a_regular_wave(runs):
    """Half the square of its amplitude, over whole periods, wherever it is."""
    record = runs[0].isel(time=slice(0, 5501))  # to t = 1100 s: 200 periods behind the ramp
    for point in (None, (3.0, 4.0)):
        found = statistics(record, point=point)
        assert found.fixed_point_elevation_m0.item() == pytest.approx(0.5, rel=1e-6)
        assert found.fixed_point_elevation_period.item() == pytest.approx(SCENE.waves.period, rel=1e-6)


def test_a_driven_cable_has_statistics_too(tmp_path):
    """No buoy, no waves: tensions only."""
    rod = {
        "cable": {"length": 3.0, "line_density": 2.0, "elements": 2, "top": {"kind": "free", "force": [1.0, 2.0, 9.0]}},
        "time": {"end": 0.3, "step": 0.01},
    }
    record = dolfbuoy.simulate(rod)
    sample = sample_of(record, load_scene(rod))
    anchored = {"anchor_uplift of cable.from", "anchor_horizontal of cable.from"}
    assert set(sample["peaks"]) == {"tension_top of cable", "tension_anchor of cable", *anchored}
    assert sample["duration"] == pytest.approx(0.3)
    assert "circle_radius" not in statistics(record)


def test_several_lines_have_statistics_each():
    """Of a record with a dimension for them, by their names."""
    t = np.linspace(0, 50, 501)
    tension = np.stack([5 + np.sin(t), 7 + 2 * np.sin(2 * t)], axis=1)
    force = np.stack([tension, 0 * tension, -tension], axis=2)
    data = {"tension_top": (("time", "cable"), tension), "anchor_force": (("time", "cable", "xyz"), force)}
    record = xr.Dataset(data, {"time": t, "cable": ["fore", "aft"], "xyz": list("xyz")})
    sample = sample_of(record, load_scene("hanging-chain"), start=0.0)
    assert set(sample["cycles"]) == {"tension_top of fore", "tension_top of aft"}
    assert sample["series"]["tension_top of aft"]["period"] == pytest.approx(math.pi, rel=1e-3)
    assert sample["series"]["anchor_force_z of aft"]["minimum"] == pytest.approx(-9, abs=1e-3)
    assert described("anchor_force_z of aft") == ("N", described("anchor_force")[1])
    found = statistics(record.assign_attrs(scene=load_scene("hanging-chain").to_toml()), start=0.0)
    assert found.tension_top_mean.dims == ("run", "cable")
    assert found.tension_top_period.sel(cable="aft").item() == pytest.approx(math.pi, rel=1e-3)
    mine = found.tension_top_range_cable == "aft"
    worn = found.tension_top_range.values[mine]
    assert worn.max() == pytest.approx(4.0, abs=1e-3)
    assert found.tension_top_range.values[~mine].max() == pytest.approx(2.0, abs=1e-3)


# -- the command -----------------------------------------------------------------------------------------------------


def test_the_command_prints_and_writes(call, tmp_path, runs):
    folders = []
    for k, run in enumerate(runs[:12]):
        folders.append(tmp_path / f"run{k}")
        folders[-1].mkdir()
        run.to_netcdf(folders[-1] / "results.nc")
    arguments = [*folders, "--out", tmp_path / "st", "--exponent", "4", "--constant", "1e18 N^4", "--from", "200"]
    code, out, err = call("statistics", *arguments)
    assert (code, err) == (0, "")
    for words in ("12 runs, 1000 s from t = 200 s on", "Miner sum per year", "Most probable maximum of 3 h", "Offsets"):
        assert words in out
    written = xr.load_dataset(tmp_path / "st" / "statistics.nc")
    assert written.sizes["run"] == 12
    assert f"{float(written.surface_elevation_m0.mean()):.5g}" in out
    assert all(
        {"units", "long_name"} <= set(written[name].attrs)
        for name in written
        if not name.endswith(("_set", "_cable", "_buoy"))
    )
    for name in ("exceedance", "cycles", "extremes", "circle"):
        assert (tmp_path / "st" / f"{name}.png").stat().st_size > 5000


def test_what_the_command_refuses(call, tmp_path, runs):
    (tmp_path / "run").mkdir()
    runs[0].to_netcdf(tmp_path / "run" / "results.nc")
    for arguments, words in (
        ([tmp_path / "nothing"], "is not the folder of a run"),
        ([tmp_path / "run", "--point", "3"], "--point 3: must be X,Y"),
        ([tmp_path / "run", "--exponent", "0"], "exponent = 0.0: must be a positive number"),
        ([tmp_path / "run", "--from", "5000"], "The run ends at t = 1200 s"),
    ):
        code, _, err = call("statistics", *arguments, "--out", tmp_path / "st")
        assert code == 2
        assert words in err
        assert err.strip().count("\n") == 0
