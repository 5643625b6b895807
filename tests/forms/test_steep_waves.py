"""Steady waves of finite height: the solver, their kinematics in numpy and in C, and the limiting height.

Source: Fourier collocation by another program (N = 24 and 32, agreeing with raschii 2.0.0 to 1e-6), Stokes's second
order, the surface conditions, finite differences of the total acceleration.
"""

import math

import numpy as np
import pytest
from test_kinematics import scene_of

from dolfbuoy import InputError, load_scene
from dolfbuoy.forms import sea
from dolfbuoy.model.airy import AirySum, propagation, stream_wave
from dolfbuoy.model.kinematics import Kinematics
from dolfbuoy.model.problem import Problem
from dolfbuoy.model.sea import wavenumber
from dolfbuoy.scene.stream import _Series, breaking_height

G = 9.81
#: (H, T, d, current along the wave): k, crest, Q, R, u at the crest's surface and at the bed below, Dw/Dt at the crest,
#: Du/Dt and w at z = 0 a quarter of a period on, first three amplitudes.
CASES = {
    (
        2,
        6,
        20,
        0,
    ): "0.11275919 1.0625871 185.21276 43.1364 1.1984637 0.21906085 -1.0849252 1.1048037 1.0324438 0.99434695 "
    "0.061979526 0.0055812442",
    (
        4,
        8,
        20,
        0,
    ): "0.069376933 2.229073 224.69223 64.242016 2.1147835 0.81939844 -1.3301842 1.3402902 1.5147862 1.9676741 "
    "0.22366356 0.031328539",
    (
        6,
        10,
        20,
        0,
    ): "0.050138207 3.6118653 247.1918 79.058107 3.1908843 1.5636646 -1.5650507 1.3476129 1.6965499 2.8670744 "
    "0.57879217 0.12387383",
    (
        10,
        10,
        1000,
        0,
    ): "0.038759528 5.5107072 16203.14 131.39317 3.7741968 8.8654253e-17 -1.8388293 1.8911062 3.0166516 "
    "4.9209817 0.49616792 0.076074923",
}


def steep(height, period, depth=20.0, **more):
    """A scene with a steady wave."""
    return scene_of({"theory": "stream", "height": height, "period": period, **more}, depth).model_copy(
        update={"gravity": G}
    )


@pytest.mark.parametrize("case", CASES, ids=str)
def test_wave_of_another_program(case):
    """To the given digits; the waves are taken from the scene as in a run."""
    H, T, d, _ = case
    expected = [float(x) for x in CASES[case].split()]
    scene = steep(H, T, float(d))
    wave, water = stream_wave(scene), AirySum.of(scene)
    k, quarter = wave.wavenumber, math.pi / 2 / wave.wavenumber
    (u, _, _), (_, _, rising) = water.flow(0.0, [0.0, 0.0, wave.crest])
    bed = water.flow(0.0, [0.0, 0.0, -float(d)])[0]
    v, a = water.flow(0.0, [quarter, 0.0, 0.0])
    found = [k, wave.crest, wave.discharge, wave.bernoulli, u, bed[0], rising, a[0], v[2], *wave.elevation[:3]]
    assert found == pytest.approx(expected, rel=1e-6)
    assert wave.crest - wave.trough == pytest.approx(H, rel=1e-12)
    assert bed[2] == 0
    assert 2 * math.pi / k / T == pytest.approx(wave.speed, rel=1e-12)


def test_given_by_its_length():
    """The period computed from the wavelength gives the same wavelength back, in the scene and in its file."""
    hull = {"hull": [[0, 2], [2, 2]], "mass": 3000.0}
    waves = {"theory": "stream", "height": 4.0, "wavelength": 70.0}
    scene = load_scene({"sea": {"depth": 20.0}, "buoy": hull, "waves": waves})
    assert scene.waves.wavelength is None
    assert wavenumber(scene) == pytest.approx(2 * math.pi / 70.0, rel=1e-9)
    assert load_scene(scene.to_dict()) == scene
    for wrong, words in (({"period": 6.0}, "give one of them"), ({"period_seen_from": "ground"}, "goes with period")):
        with pytest.raises(InputError, match=words):
            load_scene({"sea": {"depth": 20.0}, "buoy": hull, "waves": waves | wrong})
    with pytest.raises(InputError, match="of the height at which a wave of 30 m breaks"):
        load_scene({"sea": {"depth": 20.0}, "buoy": hull, "waves": waves | {"wavelength": 30.0}})


@pytest.mark.parametrize("seen", ["water", "ground"])
@pytest.mark.parametrize(("direction", "along"), [(180.0, -1.0), (60.0, 0.5)])
def test_frequencies_of_a_steep_wave_in_a_current(seen, direction, along):
    """omega = sigma + k . U; the given frequency is that of the period."""
    scene = steep(3.0, 8.0, period_seen_from=seen)
    scene = type(scene)(**scene.to_dict() | {"current": {"speed": 1.0, "direction_deg": direction}})
    found = propagation(scene, 8.0, 0.0)
    given = found.in_water if seen == "water" else found.at_ground
    assert given == pytest.approx(2 * math.pi / 8, rel=1e-12)
    assert found.at_ground - found.in_water == pytest.approx(along * found.wavenumber, rel=1e-8)


def test_in_a_current():
    """T = 8 s at a fixed point against 1 m/s: wave number, crest and ground speed of the crests."""
    scene = scene_of({"theory": "stream", "height": 4.0, "period": 8.0, "period_seen_from": "ground"})
    current = {"speed": 1.0, "direction_deg": 180.0}
    scene = type(scene)(**scene.to_dict() | {"gravity": G, "current": current})
    wave = stream_wave(scene)
    assert wave.wavenumber == pytest.approx(0.080259739, rel=1e-6)
    assert wave.crest == pytest.approx(2.2272609, rel=1e-6)
    assert wave.speed - 1.0 == pytest.approx(9.7857054, rel=1e-6)


def test_jacobian():
    series = _Series(8, 1.3, 1.0, 0.1)
    x = series.linear(0.3) + 0.01 * np.random.default_rng(0).standard_normal(21)
    ends = [(series.equations(0.3, x + 1e-6 * e)[0], series.equations(0.3, x - 1e-6 * e)[0]) for e in np.eye(21)]
    numbers = np.array([(a - b) / 2e-6 for a, b in ends]).T
    np.testing.assert_allclose(series.equations(0.3, x)[1], numbers, atol=1e-8)


def test_small_waves_are_stokes_waves():
    """a_2/(k a^2) tends to cosh kd (2 + cosh 2kd)/(4 sinh^3 kd), and k to Airy's, with the square of the height."""
    errors = []
    for H in (0.4, 0.2):
        wave = stream_wave(steep(H, 8.0))
        k = wave.wavenumber
        kd = 20 * k
        stokes = math.cosh(kd) * (2 + math.cosh(2 * kd)) / (4 * math.sinh(kd) ** 3)
        second = wave.elevation[1] / (k * wave.elevation[0] ** 2)
        errors.append([abs(second / stokes - 1), abs((2 * math.pi / 8) ** 2 / (G * k * math.tanh(kd)) - 1)])
    assert np.max(errors[0]) < 1e-3
    assert np.divide(*errors) == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_conditions_at_the_surface(case):
    """w = eta_t + u eta_x, and no pressure gradient along the surface, all along it."""
    H, T, d, _ = case
    scene = steep(H, T, float(d), direction_deg=30.0, phase_deg=20.0)
    water = AirySum.of(scene)
    along = np.array([math.cos(math.pi / 6), 0.5, 0.0])
    s = np.linspace(0, 2 * math.pi / water.wavenumber[0], 57)
    x, t, h = np.outer(s, along), 0.3, 1e-4
    x[:, 2] = water.elevation(t, x)
    rate = (water.elevation(t + h, x) - water.elevation(t - h, x)) / (2 * h)
    slope = (water.elevation(t, x + h * along) - water.elevation(t, x - h * along)) / (2 * h)
    v, a = water.flow(t, x)
    assert np.abs(v[:, 2] - rate - v @ along * slope).max() < 1e-6
    assert np.abs(a @ along + slope * (G + a[:, 2])).max() / G < 1e-6


def test_no_divergence_and_no_curl():
    """Velocity below the crest, by finite differences, relative to its largest slope."""
    water, h = AirySum.of(steep(6.0, 10.0, direction_deg=30.0)), 1e-3
    x = np.random.default_rng(3).uniform([-60.0, -60.0, -20.0], [60.0, 60.0, 1.0], (200, 3))
    gradient = np.array([(water.flow(2.0, x + e)[0] - water.flow(2.0, x - e)[0]) / (2 * h) for e in h * np.eye(3)])
    size = np.abs(gradient).max()
    assert size > 0.1
    assert np.abs(np.einsum("ini->n", gradient)).max() < 1e-7 * size
    assert np.abs(gradient - gradient.transpose(2, 1, 0)).max() < 1e-7 * size


def test_a_period_later_the_phases_have_the_same_bits():
    water = AirySum.of(steep(4.0, 8.0))
    first = water.time_phase(3.25).copy()
    assert np.array_equal(first, water.time_phase(3.25 + 8.0 * 1000))
    assert np.isfinite(first).all()


@pytest.mark.parametrize("ramp", [0.0, 40.0])
def test_total_acceleration_in_c(ramp):
    """At the points of a hull velocity, total acceleration, and the latter's gradient by differences in numpy."""
    scene = steep(5.0, 7.0, direction_deg=25.0, ramp=ramp, kinematics="exact")
    problem = Problem(scene, dynamic=True)
    (buoy,) = problem.buoys.values()
    turned = np.array([1.0, 0.1, 0.2, 0.0]) / math.sqrt(1.05)
    problem.system.u[buoy.part.slice] = buoy.moving_state(np.array([3.0, 1.0, -0.2]), turned, np.zeros(3), np.zeros(3))
    problem.set_time(23.7)
    problem.system.publish()
    problem.system.evaluate()
    water, seen = AirySum.of(scene), 0
    for model in problem.models:
        for points in model.sea.kinematics.sets:
            numbers = problem.system.numbers_of(points.coefficient)
            if numbers is None:
                continue
            found = numbers.reshape(-1, points.size)
            for one in found[np.abs(found).max(axis=1) > 0]:
                place, h = one[:3], 1e-4
                v, a = water.flow(23.7, place)
                np.testing.assert_allclose(one[sea.V : sea.V + 3], v, atol=1e-10)
                np.testing.assert_allclose(one[sea.A : sea.A + 3], a, atol=1e-10)
                ends = [[water.flow(23.7, place + sign * h * e)[1] for sign in (1, -1)] for e in np.eye(3)]
                gradient = np.array([(b - c) / (2 * h) for b, c in ends])
                expected = gradient[[0, 0, 1, 0, 1], [0, 1, 1, 2, 2]]
                if points.size == sea.LARGE:
                    np.testing.assert_allclose(one[sea.GRAD_A : sea.GRAD_A + 5], expected, atol=1e-6)
                    xx, xy, yy, xz, yz = one[sea.GRAD_V : sea.GRAD_V + 5]
                    G2 = xx**2 + yy**2 + (xx + yy) ** 2 + 2 * (xy**2 + xz**2 + yz**2)
                    assert np.trace(gradient) == pytest.approx(G2, abs=1e-6)
                    seen += 1
    assert seen > 3
    problem.destroy()


def test_near_breaking_is_refused_with_the_limit():
    with pytest.raises(
        InputError, match=r"waves.height = 16 m: must be at most 1\d\.\d+ m .* 0.9 of the height"
    ) as refused:
        stream_wave(steep(16.0, 8.0))
    highest = float(str(refused.value).split("at most ")[1].split(" m")[0])
    wave = stream_wave(steep(0.97 * highest, 8.0))
    assert 0.97 * highest <= 0.9 * breaking_height(wave.wavenumber, 20.0)
    with pytest.raises(InputError, match=r"waves.order = 4: too low"):
        stream_wave(steep(8.0, 12.0, order=4))
    with pytest.raises(InputError, match=r"waves.order = 64: no wave of 9 m is found"):
        stream_wave(steep(9.0, 8.0, order=64))


def test_orders_agree():
    for T, H in ((6.0, 4.0), (10.0, 6.0)):
        low, high = (stream_wave(steep(H, T, order=order)) for order in (20, 32))
        assert low.wavenumber == pytest.approx(high.wavenumber, rel=1e-9)
        assert low.crest == pytest.approx(high.crest, rel=1e-9)


def test_hull_looks_no_further_than_the_crest():
    """Above the crests the series would grow without bound: C evaluates it at the crest height there."""
    scene = steep(4.0, 8.0)
    assert Kinematics(scene).waves.highest == pytest.approx(stream_wave(scene).crest, rel=1e-3)
