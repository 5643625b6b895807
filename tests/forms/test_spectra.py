"""Wave spectra and derived data: moments, bins of equal energy, directions, records, files.

Source: moments in tests/reference/sea.json (mpmath, Gamma functions), closed forms for cos^2s and Gaussian seas.
"""

import math

import numpy as np
import pytest
import xarray as xr
from helpers import reference

from dolfbuoy import InputError, load_scene, wave_components
from dolfbuoy.model import spectra
from dolfbuoy.model.airy import AirySum, components_of, dispersion_wavenumber, propagation
from dolfbuoy.results import extremes
from dolfbuoy.scene.waves import Waves

CASES = {case["id"]: case for case in reference("sea")["cases"]}
JONSWAP = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 6.0}
SCENE = {"sea": {"depth": 30.0}, "buoy": {"hull": [[0, 2], [2, 2]], "mass": 500.0}}


def spectrum_of(case):
    """Spectrum from the input of a case."""
    given = case["input"]
    if "gamma" in given:
        return spectra.jonswap(given["Hs"], given["Tp"], given["gamma"])
    return spectra.pierson_moskowitz(given["Hs"], given["Tp"])


@pytest.mark.parametrize("name", [name for name in CASES if "jonswap" in name or "pierson" in name])
def test_moments(name):
    spectrum, expected = spectrum_of(CASES[name]), CASES[name]["expected"]
    bands = {(0.0, math.inf): expected.get("full", expected)}
    bands |= {(0.5, top): expected[f"cut_0.5_to_{top}_wp"] for top in (3, 5) if "full" in expected}
    for (low, high), moments in bands.items():
        for n in (n for n in (-1, 0, 1, 2, 4) if f"m{n}" in moments):
            found = spectrum.moment(n, low * spectrum.peak, high * spectrum.peak)
            assert found == pytest.approx(moments[f"m{n}"], rel=1e-8)


@pytest.mark.parametrize("seed", range(50))
def test_m0_and_m2_are_exact_by_construction(seed):
    """With fixed amplitudes, for any seed and spreading."""
    waves = Waves(**JONSWAP, seed=seed, spreading=3.0 + seed, components=20 + seed)
    found, spectrum = components_of(waves), spectra.jonswap(2.0, 6.0)
    top = spectrum.frequencies_at(np.array([0.999 * 0.25]))[0]
    for n in (0, 2):
        assert found.moment(n) == pytest.approx(spectrum.moment(n, 0.5 * spectrum.peak, top), rel=1e-12)
    assert np.ptp(found.amplitude) < 1e-12 * found.amplitude[0]
    assert np.all(np.diff(found.frequency) > 0)


@pytest.mark.slow
def test_random_amplitudes_scatter_as_theory_says():
    """m0 of N components of equal energy and random amplitude: standard deviation 1/sqrt(N) of its mean."""
    energies = [components_of(Waves(**JONSWAP, seed=seed, amplitudes="random")).moment(0) for seed in range(400)]
    fixed = components_of(Waves(**JONSWAP)).moment(0)
    assert np.mean(energies) == pytest.approx(fixed, rel=4 / math.sqrt(200 * 400))
    assert np.std(energies) / fixed == pytest.approx(1 / math.sqrt(200), rel=4 / math.sqrt(2 * 400))


@pytest.mark.parametrize("number", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_scatter_of_m0_with_duration(number):
    """Variance of the elevation over a duration, with random amplitudes over 200 seeds."""
    row = CASES["sea/m0_scatter"]["expected"][number]
    t = np.arange(0.0, row["T"], 0.5)
    found = []
    for seed in range(200):
        c = components_of(Waves(**JONSWAP, seed=seed, amplitudes="random", components=400))
        found.append(np.var(np.cos(np.outer(t, c.frequency) - c.phase) @ c.amplitude))
    assert np.std(found) / np.mean(found) == pytest.approx(row["cv"], rel=0.2)


def test_streams_are_apart():
    """More spreading or random amplitudes keep the phases; more components keep those of the first ones."""
    base, spread = components_of(Waves(**JONSWAP, seed=3)), components_of(Waves(**JONSWAP, seed=3, spreading=4.0))
    assert np.array_equal(base.phase, spread.phase)
    assert np.array_equal(base.phase, components_of(Waves(**JONSWAP, seed=3, amplitudes="random")).phase)
    assert np.array_equal(base.phase, components_of(Waves(**JONSWAP, seed=3, components=300)).phase[:200])
    assert not np.any(base.phase == components_of(Waves(**JONSWAP, seed=4)).phase)


@pytest.mark.parametrize("name", [name for name in CASES if "cos2s" in name])
def test_spreading(name):
    """First and second circular moments; one direction per component, distributed over the frequencies."""
    s, expected, N = CASES[name]["input"]["s"], CASES[name]["expected"], 2000
    found = components_of(Waves(**JONSWAP, spreading=s, direction_deg=40.0, components=N))
    theta = np.radians(found.direction_deg - 40.0)
    assert np.mean(np.cos(theta)) == pytest.approx(expected["r1"], abs=1e-4)
    assert np.mean(np.cos(2 * theta)) == pytest.approx(expected["r2"], abs=1e-3)
    assert np.mean(np.sin(theta)) == pytest.approx(0.0, abs=1e-12)
    assert len(set(found.direction_deg)) == N
    half = np.cos(theta[: N // 2])  # not sorted by frequency
    assert np.mean(half) == pytest.approx(expected["r1"], abs=3 * math.sqrt((1 - expected["r1"] ** 2) / N))


def test_table_and_its_band():
    """Linear between rows: the moments of a triangle; a band in peak frequencies."""
    waves = {"spectrum": [[0.1, 0.0], [0.2, 4.0], [0.4, 0.0]]}
    found = components_of(Waves(**waves, band=[0.0, 10.0], components=50))
    assert found.moment(0) == pytest.approx(0.5 * 4 * 0.3, rel=1e-12)
    f = np.array([0.1, 0.2, 0.4])  # second moment of a triangle of area 0.6
    expected = 0.6 * (2 * math.pi) ** 2 * (np.sum(f**2) + f[0] * f[1] + f[1] * f[2] + f[0] * f[2]) / 6
    assert found.moment(2) == pytest.approx(expected, rel=1e-12)
    cut = components_of(Waves(**waves, band=[1.0, 1.5], components=50))
    assert cut.moment(0) == pytest.approx(4 * 0.1 * 0.75, rel=1e-12)
    assert components_of(Waves(**waves)).moment(0) == pytest.approx(0.999 * 0.6, rel=1e-12)


def test_nothing_in_the_band():
    with pytest.raises(InputError, match="energy"):
        components_of(Waves(spectrum=[[0.1, 1.0], [0.2, 1.0]], band=[5.0, 6.0]))


def directional(mean=70.0):
    """A spectrum over directions: (frequency [Hz], direction_deg, density)."""
    f, theta = np.linspace(0.05, 0.4, 30), np.arange(0.0, 360.0, 10.0)
    D = np.maximum(np.cos(np.radians(theta - mean)), 0) ** 2
    return f, theta, np.outer(np.exp(-(((f - 0.15) / 0.05) ** 2)), D)


def test_directional_spectrum():
    f, theta, density = directional()
    given = {"frequency": f.tolist(), "direction_deg": theta.tolist(), "density": density.tolist()}
    found = components_of(Waves(spectrum=given, band=[0.0, 10.0], components=400, direction_deg=5.0))
    S = density.sum(1) * 10.0
    assert found.moment(0) == pytest.approx(np.sum(0.5 * (S[1:] + S[:-1]) * np.diff(f)), rel=1e-10)
    mean = np.angle(np.mean(np.exp(1j * np.radians(found.direction_deg))))
    assert math.degrees(mean) == pytest.approx(75.0, abs=0.2)


@pytest.mark.parametrize(("unit", "degrees"), [("degree", 1.0), ("rad", 180 / math.pi)])
def test_netcdf_file_of_directions(tmp_path, unit, degrees):
    """efth(freq, dir), per degree or per radian: coming from, clockwise from north; x points east."""
    f, theta, density = directional()
    coming = np.mod(270.0 - theta, 360.0)
    efth = (("time", "dir", "freq"), degrees * density.T[None], {"units": f"m^{{2}}.s.{unit}^{{-1}}"})
    xr.Dataset({"efth": efth}, coords={"freq": f, "dir": coming})[{"freq": slice(None, None, -1)}].to_netcdf(
        tmp_path / "sea.nc"
    )
    (tmp_path / "scene.toml").write_text(
        '[sea]\ndepth = 30.0\n[buoy]\nhull = [[0, 2], [2, 2]]\nmass = 500.0\n[waves]\nspectrum = "sea.nc"\n'
    )
    scene = load_scene(tmp_path / "scene.toml")
    np.testing.assert_allclose(scene.waves.spectrum.direction_deg, theta, atol=1e-10)
    np.testing.assert_allclose(scene.waves.spectrum.density, density, rtol=1e-12)
    again = load_scene(scene.to_dict())  # complete without the file
    assert wave_components(again).identical(wave_components(scene))


def test_files_of_columns(tmp_path):
    """Two columns for a spectrum or an elevation, four for components; headings and comments are skipped."""
    (tmp_path / "s.csv").write_text("f, S\n# buoy 7\n0.1, 0\n0.2; 4\n 0.4  0 # end\n")
    (tmp_path / "c.txt").write_text("0.5 6 10 20\n0.2 4 -10 200\n")
    assert Waves(spectrum=str(tmp_path / "s.csv")).spectrum == [(0.1, 0.0), (0.2, 4.0), (0.4, 0.0)]
    found = wave_components(SCENE | {"waves": {"components": str(tmp_path / "c.txt"), "direction_deg": 5.0}})
    np.testing.assert_allclose(found.period.values, [6.0, 4.0])
    np.testing.assert_allclose(found.direction_deg.values, [15.0, -5.0])
    (tmp_path / "bad.txt").write_text("f, S\n0.1 2 3\n0.2 4\n")
    with pytest.raises(InputError, match="line 2 of its file must be 2 numbers"):
        load_scene(SCENE | {"waves": {"spectrum": str(tmp_path / "bad.txt")}})
    for text in ("0.1 2\n0.2\n", "", "\0", "0.1 2\nx y\n"):
        (tmp_path / "bad.txt").write_text(text)
        with pytest.raises(InputError, match="file"):
            load_scene(SCENE | {"waves": {"spectrum": str(tmp_path / "bad.txt")}})


@pytest.mark.parametrize("name", ["../s.csv", "/etc/hosts", "link.csv", "nothing.csv"])
def test_a_stranger_names_nothing_outside(tmp_path, name):
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "s.csv").write_text("0.1 1\n0.2 1\n")
    (folder / "link.csv").symlink_to(tmp_path / "s.csv")
    for key in ("spectrum", "components", "elevation"):
        text = f'[sea]\ndepth = 30.0\n[buoy]\nhull = [[0, 2], [2, 2]]\nmass = 500.0\n[waves]\n{key} = "{name}"\n'
        (folder / "scene.toml").write_text(text)
        with pytest.raises(InputError, match=rf"waves\.{key}"):
            load_scene(folder / "scene.toml")


def test_elevation_record_comes_back():
    """At x = y = 0 and the record's times, except for the taper; with its full variance if requested."""
    rng, t = np.random.default_rng(7), 100.0 + np.arange(0.0, 400.0, 0.5)
    true = [(1.0, 0.1, 0.3), (0.6, 0.16, 2.0), (0.3, 0.22, 5.0)]
    eta = sum(a * np.cos(2 * math.pi * f * t - p) for a, f, p in true) + 0.7 + 1e-3 * rng.standard_normal(len(t))
    scene = load_scene(SCENE | {"waves": {"elevation": np.column_stack([t, eta]).tolist()}})
    found = AirySum.of(scene)
    middle = slice(80, -80)
    again = np.array([found.elevation(time, np.zeros(3)) for time in t])
    assert np.std((again - eta)[middle]) < 0.05 * np.std(eta)
    assert np.mean((again - eta)[middle]) == pytest.approx(-0.7, abs=0.02)
    repeated = np.array([found.elevation(time + 400.0, np.zeros(3)) for time in t])
    np.testing.assert_allclose(repeated, again, atol=1e-9)
    amplitude, frequency, _ = spectra.of_record(t, eta, part=1.0, taper=0.0)
    np.testing.assert_allclose(np.sort(amplitude)[-3:], [0.3, 0.6, 1.0], rtol=1e-3)
    assert 2 * math.pi * 0.1 == pytest.approx(frequency[np.argmax(amplitude)])


@pytest.mark.parametrize("part", [0.1, 0.4])
def test_a_taper_takes_its_share_of_the_variance(part):
    """The mean square of a cosine taper is 3/8: 5/8 of the variance is lost in the tapered part."""
    t = np.arange(0.0, 4000.0, 0.5)
    amplitude, *_ = spectra.of_record(t, np.cos(2 * math.pi * 0.21 * t), part=1.0, taper=part)
    assert np.sum(amplitude**2) == pytest.approx(1 - 5 / 8 * part, rel=1e-3)


@pytest.mark.parametrize("seen", ["water", "ground"])
@pytest.mark.parametrize("direction", [0.0, 180.0, 60.0])
def test_current_shifts_periods(seen, direction):
    """omega = sigma + k . U with sigma^2 = g k tanh(kh); without the key both are equal."""
    current = {"speed": 0.9, "direction_deg": 0.0}
    waves = {"amplitude": 1.0, "period": 5.0, "direction_deg": direction, "period_seen_from": seen}
    scene = load_scene(SCENE | {"current": current, "waves": waves})
    found = propagation(scene, 5.0, direction)
    k = found.wavenumber
    assert found.in_water**2 == pytest.approx(9.81 * k * math.tanh(30 * k), rel=1e-12)
    shift = k * 0.9 * math.cos(math.radians(direction))
    assert found.at_ground - found.in_water == pytest.approx(shift, rel=1e-12)
    assert (found.in_water if seen == "water" else found.at_ground) == pytest.approx(2 * math.pi / 5, rel=1e-12)
    plain = propagation(load_scene(scene, waves__period_seen_from=None), 5.0, direction)
    assert plain.in_water == plain.at_ground == 2 * math.pi / 5


def test_sheared_current_is_felt_near_the_surface():
    """A linear profile in deep water: U = u(0) - u'/(2k)."""
    current = {"profile": [[-30.0, 0.1], [0.0, 1.0]]}
    waves = {"amplitude": 1.0, "period": 2.0, "period_seen_from": "water"}
    found = propagation(load_scene(SCENE | {"current": current, "waves": waves}), 2.0, 0.0)
    expected = found.wavenumber * (1.0 - 0.03 / (2 * found.wavenumber))
    assert found.at_ground - found.in_water == pytest.approx(expected, rel=1e-6)


def test_current_that_stops_waves():
    current = {"speed": 4.0, "direction_deg": 180.0}
    waves = {"amplitude": 1.0, "period": 3.0, "period_seen_from": "ground"}
    with pytest.raises(InputError, match="current"):
        propagation(load_scene(SCENE | {"current": current, "waves": waves}), 3.0, 0.0)


def test_variance_of_velocities_at_depth():
    """Of the components against int (w cosh k(z + h)/sinh kh)^2 S dw, and spread over two directions as cos^2s does."""
    scene = load_scene(SCENE | {"waves": JONSWAP | {"spreading": 5.0, "components": 1000, "direction_deg": 0.0}})
    airy, z, h = AirySum.of(scene), -4.0, 30.0
    k, w, rate = airy.wavenumber, airy.in_water, airy.amplitude * airy.in_water
    along = rate * np.cosh(k * (z + h)) / np.sinh(k * h)
    variance = np.array([np.sum((along * c) ** 2) / 2 for c in (airy.cosine, airy.sine)])
    spectrum = spectra.jonswap(2.0, 6.0)
    edges = np.linspace(0.5 * spectrum.peak, w.max(), 4000)
    wave = np.array([dispersion_wavenumber(2 * math.pi / e, h, 9.81) for e in edges])
    transfer = (edges * np.cosh(wave * (z + h)) / np.sinh(wave * h)) ** 2 * spectrum.density(edges)
    total = np.sum(0.5 * (transfer[1:] + transfer[:-1]) * np.diff(edges))
    expected = CASES["sea/cos2s_s5"]["expected"]
    assert variance.sum() == pytest.approx(total, rel=2e-3)
    assert variance / variance.sum() == pytest.approx([expected["mean_cos2"], expected["mean_sin2"]], abs=0.02)


@pytest.mark.parametrize("crests", [100, 1000])
def test_largest_of_rayleigh_crests(crests):
    expected = CASES[f"sea/rayleigh_max_{crests}"]["expected"]
    found = extremes.largest_crest(crests)
    numbers = found.mean, found.standard_deviation
    assert numbers == pytest.approx((expected["mean_over_sigma"], expected["std_over_sigma"]), rel=1e-6)


@pytest.mark.parametrize("row", CASES["sea/m0_scatter"]["expected"], ids=lambda row: f"{row['T']} s")
def test_scatter_in_theory(row):
    found = math.sqrt(extremes.memory_of(spectra.jonswap(2.0, 6.0)) / row["T"])
    assert found == pytest.approx(row["cv"], rel=1e-6)


@pytest.mark.parametrize("count", [12, pytest.param(25, marks=pytest.mark.slow)])
def test_few_components_have_low_crests(count):
    """Envelope of N phasors, 4 10^6 samples, against Pearson's term: the level exceeded with probability 1/1000."""
    rng, levels = np.random.default_rng(1), []
    for _ in range(8):
        phasors = np.exp(2j * math.pi * rng.random((count, 500_000))).sum(0) * math.sqrt(2 / count)
        levels.append(np.quantile(np.abs(phasors), 0.999))
    low = 1 - np.mean(levels) / math.sqrt(2 * math.log(1000))
    assert low == pytest.approx((math.log(1000) / 2 - 1) / (4 * count), rel=0.2)
    assert abs(extremes.components_needed(1000, low) - count) <= 0.25 * count


@pytest.mark.slow
def test_largest_crest_of_three_hours():
    """Mean over 30 seeds against that of as many independent Rayleigh crests."""
    t, found, count = np.arange(0.0, 10800.0, 0.25), [], []
    for seed in range(30):
        c = components_of(Waves(**JONSWAP, seed=seed))
        eta = np.concatenate([np.cos(np.outer(part, c.frequency) - c.phase) @ c.amplitude for part in np.split(t, 100)])
        eta /= math.sqrt(c.moment(0))
        crossings = np.flatnonzero((eta[:-1] < 0) & (eta[1:] >= 0))
        found.append(eta.max())
        count.append(len(crossings))
    largest = extremes.largest_crest(np.mean(count))
    mean, spread = largest.mean, largest.standard_deviation
    assert np.mean(found) == pytest.approx(mean, abs=3 * spread / math.sqrt(30) + 0.02 * mean)
    assert np.std(found) == pytest.approx(spread, rel=0.5)


@pytest.mark.parametrize(
    ("waves", "words"),
    [
        ({"spectrum": "jonswap"}, "significant_height"),
        ({"spectrum": "jonswap", "significant_height": 1.0}, "peak_period"),
        ({**JONSWAP, "amplitude": 1.0}, "period only"),
        ({**JONSWAP, "elevation": [[0.5 * k, 0.1 * k % 3] for k in range(20)]}, "does not go with"),
        ({**JONSWAP, "wavelength": 30.0}, "wavelength"),
        ({**JONSWAP, "stretching": "none"}, "stretching"),
        ({**JONSWAP, "band": [2.0, 1.0]}, "band"),
        ({**JONSWAP, "spectrum": "pierson-moskowitz", "gamma": 2.0}, "gamma"),
        ({"spectrum": [[0.1, 1.0], [0.2, 1.0]], "significant_height": 1.0}, "significant_height"),
        ({"spectrum": [[0.2, 1.0], [0.1, 1.0]]}, "rise"),
        ({"spectrum": [[0.1, 0.0], [0.2, 0.0]]}, "zero"),
        ({"spectrum": "storm"}, "file not found"),
        ({"components": [[1.0, 5.0]]}, "components"),
        ({"components": [[1.0, 5.0, 0.0, 0.0]], "seed": 3}, "seed"),
        ({"elevation": [[0.0, 1.0], [1.0, 2.0]]}, "8 rows"),
        ({"elevation": [[float(k * k), 1.0] for k in range(20)]}, "equal steps"),
        ({"period": 5.0, "amplitude": 1.0, "seed": 3}, "seed"),
        ({"period": 5.0, "amplitude": 1.0, "components": 20}, "components"),
        ({"direction_deg": 3.0}, "period"),
    ],
)
def test_what_is_no_sea(waves, words):
    with pytest.raises(InputError, match=words):
        load_scene(SCENE | {"waves": waves})
