"""A prescribed crest in a random sea, and NewWave.

Source: the autocorrelation of JONSWAP by quadrature; mean and variance of a Gaussian process conditioned on a maximum,
E = A r and var = m0 (1 - r^2 - r'^2/lambda2) (Lindgren 1970), lambda2 = m2/m0.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from dolfbuoy import InputError, load_scene, simulate, wave_components
from dolfbuoy.check import derived
from dolfbuoy.model.sea import elevation_at

PLACE, TIME, CREST = [30.0, -12.0], 40.0, 4.5
SEA = {
    "spectrum": "jonswap",
    "significant_height": 4.0,
    "peak_period": 9.0,
    "components": 400,
    "crest": CREST,
    "crest_time": TIME,
    "crest_position": PLACE,
}
FLOAT = {"sea": {"depth": 80.0}, "buoy": {"hull": [[0, 2], [2, 2]], "mass": 3000.0, "center_of_mass": 0.4}}


def scene(current=None, **waves):
    return load_scene(FLOAT | {"waves": SEA | waves} | ({"current": current} if current else {}))


def over_time(one, times, place=(*PLACE, 0.0)):
    return np.array([elevation_at(one, t, np.array(place)) for t in times])


def autocorrelation(lags, order=0):
    """r, or its derivative, of JONSWAP with gamma 3.3 and its band of 0.5 to 3 peak frequencies."""
    peak = 2 * np.pi / 9.0

    def density(w):
        sigma = 0.07 if w <= peak else 0.09
        return w**-5.0 * np.exp(-1.25 * (peak / w) ** 4) * 3.3 ** np.exp(-((w / peak - 1) ** 2) / (2 * sigma**2))

    ends, how = (0.5 * peak, 3 * peak), {"points": [peak], "limit": 400}
    whole = quad(density, *ends, **how)[0]
    wave = (np.cos, lambda x: -np.sin(x))[order]

    def of(lag):
        return quad(lambda w: w**order * density(w) * wave(w * lag), *ends, **how)[0] / whole

    return np.array([of(lag) for lag in lags])


def test_newwave_is_the_autocorrelation():
    lags = np.linspace(-20.0, 20.0, 41)
    found = over_time(scene(crest_sea="newwave", band=[0.5, 3.0]), TIME + lags)
    assert found == pytest.approx(CREST * autocorrelation(lags), abs=0.005 * CREST)


@pytest.mark.parametrize(
    "waves",
    [{}, {"spreading": 10.0}, {"amplitudes": "random"}, {"period_seen_from": "water"}, {"seed": 9, "ramp": 30.0}],
)
def test_the_crest_is_there(waves):
    """Its height to rounding, and no slope in time; with a current that carries the waves too."""
    one = scene({"speed": 1.0} if "period_seen_from" in waves else None, **waves)
    before, there, after = over_time(one, [TIME - 1e-4, TIME, TIME + 1e-4])
    assert there == pytest.approx(CREST, rel=1e-12)
    assert abs(after - before) < 1e-9 * CREST
    assert min(there - before, there - after) > 0


@pytest.mark.slow
def test_mean_and_deviation_over_seeds():
    """The sea's own far from the crest, NewWave beside it."""
    lags = np.array([0.0, 1.0, 2.0, 3.5, 5.0, 8.0])
    seeds = [over_time(scene(seed=seed, band=[0.5, 3.0], components=120), TIME + lags) for seed in range(400)]
    r, slope = autocorrelation(lags), autocorrelation(lags, 1)
    peak = 2 * np.pi / 9.0
    step = 1e-3 / peak
    curvature = 2 * (1 - autocorrelation([step])[0]) / step**2
    expected = np.sqrt(np.maximum(1 - r**2 - slope**2 / curvature, 0))  # m0 = 1 m^2
    assert np.mean(seeds, axis=0) == pytest.approx(CREST * r, abs=3.5 / np.sqrt(400))
    assert np.std(seeds, axis=0) == pytest.approx(expected, abs=0.12)


def test_a_small_float_rides_over_it():
    """The record has the crest above the buoy, and the components that make it."""
    place = {"initial": {"buoy_position": [*PLACE, -0.55]}, "time": {"end": 0.5, "step": 0.25}}
    run = simulate(FLOAT | {"waves": SEA | {"crest_time": 0.0}} | place)
    assert run.surface_elevation.values[0, 0] == pytest.approx(CREST, rel=1e-12)
    parts = wave_components(scene())
    k = (2 * np.pi / parts.period.values) ** 2 / 9.81  # deep water
    there = np.radians(parts.phase_deg.values) - 2 * np.pi / parts.period.values * TIME + k * PLACE[0]
    assert parts.amplitude.values @ np.cos(there) == pytest.approx(CREST, rel=1e-3)


def test_what_check_says():
    rows = {name: (value, remark) for name, value, _, remark in derived(scene()).numbers}
    assert rows["prescribed crest"][0] == CREST
    assert "t = 40 s" in rows["prescribed crest"][1]
    late = derived(load_scene(FLOAT | {"waves": SEA, "time": {"end": 10.0, "step": 0.1}}))
    assert any("after the end of the run" in warning for warning in late.warnings)


@pytest.mark.parametrize(
    ("waves", "sentence"),
    [
        ({"crest_time": None}, "waves.crest_time"),
        ({"crest_time": 5.0, "ramp": 10.0}, "waves.crest_time = 5.0: must not lie within the ramp"),
        ({"crest": None}, "goes with crest only"),
        ({"crest": -1.0}, "waves.crest = -1.0"),
        ({"spectrum": None, "components": 3, "period": 5.0, "amplitude": 1.0}, "waves.crest"),
    ],
)
def test_refused(waves, sentence):
    given = {key: value for key, value in (SEA | waves).items() if value is not None}
    if "period" in waves:
        for key in ("significant_height", "peak_period", "components"):
            given.pop(key, None)
    with pytest.raises(InputError, match=sentence.replace("(", r"\(")):
        load_scene(FLOAT | {"waves": given})
