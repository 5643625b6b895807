"""Waves, currents, wind and drag as UFL expressions, evaluated numerically.

Source: kinematics and dispersion in tests/reference (scipy/mpmath), finite differences, the formulas in numpy.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import ufl
from helpers import reference
from ufl.algorithms.analysis import extract_constants
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from dolfbuoy import load_scene
from dolfbuoy.forms import morison, sea, wind
from dolfbuoy.forms.buoy import Body
from dolfbuoy.model.airy import dispersion_wavenumber, ramp
from dolfbuoy.model.sea import SeaState, heading, wavenumber
from dolfbuoy.solver.compat import MPI, interval_mesh

WAVES = reference("waves")


def value(expression):
    """Number (or array) of an expression without coefficients."""
    expression = ufl.as_ufl(expression)
    if expression.ufl_shape:
        return np.array([value(expression[i]) for i in range(expression.ufl_shape[0])])
    return float(expression(()))


def lowered(expression):
    """`value` of products of matrices and vectors."""
    expression = apply_algebra_lowering(ufl.as_ufl(expression))
    if expression.ufl_shape:
        return np.array([lowered(expression[i]) for i in range(expression.ufl_shape[0])])
    return float(expression(()))


def wave(T, h, a, t=0.0, phase=0.0, direction=0.0, stretching="none"):
    k, omega = dispersion_wavenumber(T, h, 9.81), 2 * math.pi / T
    c, s = math.cos(direction), math.sin(direction)
    return sea.Wave(a, k, omega, phase - omega * t, c, s, h, stretching)


def point(*x):
    return ufl.as_vector([ufl.as_ufl(float(c)) for c in x])


@pytest.mark.parametrize("name", WAVES["dispersion"])
def test_dispersion(name):
    period, depth = float(name[1:].split("_h")[0]), float(name.split("_h")[1])
    k = dispersion_wavenumber(period, depth, 9.81)
    assert pytest.approx(WAVES["dispersion"][name]["k"], rel=2e-14) == k
    assert pytest.approx(WAVES["dispersion"][name]["wavelength"], rel=2e-14) == 2 * math.pi / k


@pytest.mark.parametrize("depth", [0.3, 2.0, 20.0, 187.0, 4000.0])
@pytest.mark.parametrize("period", [0.4, 3.0, 11.0, 90.0])
def test_wavenumber_satisfies_the_dispersion_relation(period, depth):
    k = dispersion_wavenumber(period, depth, 3.7)
    assert pytest.approx((2 * math.pi / period) ** 2, rel=1e-13) == 3.7 * k * math.tanh(k * depth)


def test_wavelength_of_the_scene_overrides_dispersion():
    scene = {"sea": {"depth": 20.0}, "buoy": {"hull": [[0, 2], [2, 2]], "mass": 500.0}}
    given = load_scene(scene | {"waves": {"amplitude": 1.5, "period": 5.0, "wavelength": 40.0}})
    assert wavenumber(given) == 2 * math.pi / 40.0
    free = load_scene(scene | {"waves": {"amplitude": 1.5, "period": 5.0}})
    assert pytest.approx(WAVES["dispersion"]["T5_h20.0"]["k"], rel=1e-14) == wavenumber(free)


@pytest.mark.parametrize("case", WAVES["kinematics_points"])
@pytest.mark.parametrize("direction", [0.0, 0.9])
def test_kinematics(case, direction):
    """Elevation, velocity and acceleration of linear theory, for waves along x and turned."""
    c, s = math.cos(direction), math.sin(direction)
    x = point(case["x"] * c, case["x"] * s, case["z"])
    flow = sea.flow(x, wave(case["T"], case["h"], case["a"], t=case["t"], direction=direction))
    tolerance = 2e-11
    assert pytest.approx(case["eta"], abs=tolerance) == value(flow.elevation)
    u, a = value(flow.velocity), value(flow.acceleration)
    np.testing.assert_allclose(u, [case["u"] * c, case["u"] * s, case["w"]], atol=tolerance)
    np.testing.assert_allclose(a, [case["ax"] * c, case["ax"] * s, case["az"]], atol=tolerance)


@pytest.mark.parametrize("case", WAVES["no_overflow_z-1"])
def test_deep_water_does_not_overflow(case):
    """kh up to 2800, where cosh overflows; at z = -1 and, extrapolated, above the water."""
    w = wave(case["T"], case["h"], 1.0)
    assert pytest.approx(case["kh"], rel=1e-12) == w.wavenumber * case["h"]
    for part in sea.depth_decay(w, ufl.as_ufl(-1.0)):
        assert pytest.approx(case["stable"], rel=1e-12) == value(part)
    assert np.isfinite(value(sea.flow(point(0, 0, 1.0), w).velocity)).all()


def test_water_at_the_bed_and_continuity():
    """No flow through the bed; divergence and curl vanish, and the local acceleration is dv/dt."""
    x0, h, d = np.array([3.0, -2.0, -4.0]), 20.0, 1e-4

    def velocity(x, t=0.7):
        return value(sea.flow(point(*x), wave(5.0, h, 0.8, t=t, phase=0.3, direction=0.6)).velocity)

    assert abs(velocity([3.0, -2.0, -h])[2]) < 1e-15
    gradient = np.array([(velocity(x0 + d * e) - velocity(x0 - d * e)) / (2 * d) for e in np.eye(3)])
    assert abs(np.trace(gradient)) < 1e-8
    np.testing.assert_allclose(gradient, gradient.T, atol=1e-8)
    assert np.abs(gradient).max() > 0.01
    rate = (velocity(x0, 0.7 + d) - velocity(x0, 0.7 - d)) / (2 * d)
    acceleration = value(sea.flow(point(*x0), wave(5.0, h, 0.8, t=0.7, phase=0.3, direction=0.6)).acceleration)
    np.testing.assert_allclose(rate, acceleration, atol=1e-7)


@pytest.mark.parametrize("t", [0.0, 1.3, 2.5])
def test_stretching(t):
    """Wheeler: the linear value at z = 0 is found at the elevation; vertical: it holds from 0 up; none: it grows."""
    a, T, h = 0.9, 5.0, 20.0
    linear = wave(T, h, a, t=t)
    eta = value(sea.elevation(linear, point(0, 0, 0)))

    def at(z, stretching):
        return value(sea.flow(point(0, 0, z), wave(T, h, a, t=t, stretching=stretching)).velocity)

    surface = at(0.0, "none")
    np.testing.assert_allclose(at(eta, "wheeler"), surface, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(at(-h, "wheeler"), at(-h, "none"), rtol=1e-13, atol=1e-15)
    z = -3.0
    np.testing.assert_allclose(at(z, "wheeler"), at(h * (z - eta) / (h + eta), "none"), rtol=1e-13, atol=1e-15)
    assert np.abs(at(z, "wheeler") - at(z, "none")).max() > 1e-3
    np.testing.assert_allclose(at(0.6, "vertical"), surface, rtol=1e-13)
    np.testing.assert_allclose(at(z, "vertical"), at(z, "none"), rtol=1e-13)
    assert np.linalg.norm(at(0.6, "none")) > 1.05 * np.linalg.norm(surface)
    np.testing.assert_allclose(at(eta + 2.0, "wheeler"), surface, rtol=1e-13, atol=1e-15)  # dry: no growth


def test_absent_sea_motion_is_none_and_not_zero():
    assert sea.flow(point(0, 0, -1)) == sea.Flow(None, None, None)
    only_current = sea.flow(point(0, 0, -1), current=sea.uniform_current(point(0.3, 0.4, 0)))
    assert only_current.elevation is None
    assert only_current.acceleration is None
    both = sea.flow(point(0, 0, -1), wave(5.0, 20.0, 0.8), sea.uniform_current(point(0.3, 0.4, 0)))
    alone = sea.flow(point(0, 0, -1), wave(5.0, 20.0, 0.8))
    np.testing.assert_allclose(value(both.velocity) - value(alone.velocity), [0.3, 0.4, 0], atol=1e-15)


def test_power_law_current():
    profile = sea.power_law_current(point(1.2, -0.5, 0.0), 30.0, 1 / 7)
    for z, factor in ((0.0, 1.0), (4.0, 1.0), (-15.0, 0.5 ** (1 / 7)), (-29.0, 30 ** (-1 / 7))):
        np.testing.assert_allclose(value(profile(point(0, 0, z))), np.array([1.2, -0.5, 0]) * factor, rtol=1e-14)
    assert np.isfinite(value(profile(point(0, 0, -31.0)))).all()


def test_tabulated_current():
    z, speed = [-30.0, -12.0, -2.0, 1.0], [0.1, 0.5, 1.4, 1.1]
    profile = sea.tabulated_current(point(0.6, 0.8, 0.0), z, speed)
    for height in (-40.0, -30.0, -20.0, -12.0, -7.7, -2.0, 0.0, 1.0, 5.0):
        expected = np.interp(height, z, speed) * np.array([0.6, 0.8, 0])
        np.testing.assert_allclose(value(profile(point(0, 0, height))), expected, rtol=1e-13)


ROUND = sea.at_most
#: Profile, height of a corner [m], speed there [m/s], mean slope of both sides [1/s].
CORNERS = {
    "power": (sea.power_law_current(point(1.0), 20.0, 1 / 7, ROUND), 0.0, 1.0, 1 / 280),
    "its end": (sea.tabulated_current(point(1.0), [-20.0, 0.0], [0.5, 1.5], ROUND), 0.0, 1.5, 0.025),
    "a row within": (
        sea.tabulated_current(point(1.0), [-20.0, -5.0, 8.0], [0.5, 2.0, 0.7], ROUND),
        -5.0,
        2.0,
        0.0,
    ),
    "its foot": (sea.tabulated_current(point(1.0), [-20.0, 0.0], [0.5, 1.5], ROUND), -20.0, 0.5, 0.025),
}


@pytest.mark.parametrize("name", CORNERS)
@pytest.mark.parametrize("off", [0.0, 4e-9, -4e-9])
def test_slope_of_a_current_in_a_corner(name, off):
    """The mean of both sides (closed form), whatever the rounding of the height; the speed there is exact."""
    profile, corner, speed, slope = CORNERS[name]
    z = ufl.variable(ufl.as_ufl(corner + off))
    found = apply_derivatives(apply_algebra_lowering(ufl.diff(profile(ufl.as_vector([0, 0, z]))[0], z)))
    assert found(()) == pytest.approx(slope, rel=1e-4, abs=2e-5)
    assert value(profile(point(0, 0, corner)))[0] == pytest.approx(speed, rel=1e-15)


def test_heading_is_exact_along_the_axes():
    for degrees, expected in ((0, [1, 0, 0]), (90, [0, 1, 0]), (180, [-1, 0, 0]), (-90, [0, -1, 0]), (450, [0, 1, 0])):
        assert np.array_equal(heading(degrees), expected)
    np.testing.assert_allclose(heading(-123.0), [math.cos(math.radians(-123)), math.sin(math.radians(-123)), 0])


def test_ramp():
    assert (ramp(0.0, 4.0), ramp(4.0, 4.0), ramp(9.0, 4.0), ramp(0.0, 0.0)) == (0.0, 1.0, 1.0, 1.0)
    assert pytest.approx(0.5) == ramp(2.0, 4.0)


def test_wave_of_a_scene_moves_with_time():
    """Direction, phase, ramp and height reach the expressions."""
    scene = load_scene(
        {
            "sea": {"depth": 20.0},
            "buoy": {"hull": [[0, 2], [2, 2]], "mass": 500.0},
            "waves": {"height": 1.8, "period": 5.0, "direction_deg": 90.0, "phase_deg": 40.0, "ramp": 6.0},
        }
    )
    state = SeaState(interval_mesh(MPI.COMM_SELF, [0.0, 1.0]), scene)
    time = np.array([2.0])
    (advance,) = state.clock(time)
    advance()
    amplitude = 0.9 * 0.5 * (1 - math.cos(math.pi * 2.0 / 6.0))
    assert pytest.approx(amplitude) == float(state.wave.amplitude.value)
    assert pytest.approx(math.radians(40) - 2 * math.pi / 5 * 2.0) == float(state.wave.time_phase.value)
    time[0] = 8.0
    advance()
    assert float(state.wave.amplitude.value) == 0.9
    assert (float(state.wave.cos_direction.value), float(state.wave.sin_direction.value)) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("profile", "speeds"), [("uniform", {-7.5: 0.7}), ([[-15.0, 0.2], [0.0, 0.9]], {-15.0: 0.2, -7.5: 0.55, 0.0: 0.9})]
)
def test_current_of_a_scene_is_scaled(profile, speeds):
    """To any fraction and back, as in continuation towards a strong current."""
    current = {"direction_deg": 90.0, "profile": profile} | ({"speed": 0.7} if profile == "uniform" else {})
    scene = load_scene(
        {
            "sea": {"depth": 20.0},
            "cable": {
                "length": 30.0,
                "line_density": 5.0,
                "diameter": 0.1,
                "elements": 2,
                "normal_drag": 1.0,
                "top": {"kind": "free"},
            },
            "current": current,
        }
    )
    state = SeaState(interval_mesh(MPI.COMM_SELF, [0.0, 1.0]), scene)
    for factor in (0.25, 0.0, 1.0):
        state.scale_current(factor)
        for height, speed in speeds.items():
            velocity = state.flow(point(0, 0, height)).velocity
            numbers = {constant: constant.value for constant in extract_constants(velocity)}
            assert velocity[1]((), numbers) == pytest.approx(factor * speed, rel=1e-14)


@pytest.mark.parametrize("profile", ["uniform", "power", [[-15.0, 0.2], [0.0, 0.9]]])
def test_current_of_a_scene_turns_with_time(profile):
    """Its rows at the given time, for any profile: half as strong and rotated by 60 degrees."""
    current = {"direction_deg": 20.0, "profile": profile} | ({} if isinstance(profile, list) else {"speed": 0.7})
    line = {"length": 30.0, "line_density": 5.0, "diameter": 0.1, "elements": 2, "normal_drag": 1.0}
    scene = {"sea": {"depth": 20.0}, "cable": line | {"top": {"kind": "free"}}}
    scene = load_scene(scene | {"current": current | {"over_time": [[0.0, 1.0, 0.0], [8.0, 0.5, 60.0]]}})
    state, time = SeaState(interval_mesh(MPI.COMM_SELF, [0.0, 1.0]), scene), np.array([8.0])

    def flow():
        velocity = state.flow(point(0, 0, -7.5)).velocity
        numbers = {constant: constant.value for constant in extract_constants(velocity)}
        return np.array([velocity[i]((), numbers) for i in (0, 1)])

    size = np.hypot(*flow())
    (advance,) = state.clock(time)
    advance()
    np.testing.assert_allclose(flow(), 0.5 * size * np.array([math.cos(math.radians(80)), math.sin(math.radians(80))]))


@pytest.mark.parametrize("z", [0.002, 0.5, 3.0, 10.0, 27.0])
def test_wind_force(z):
    """Eq. (2) with the 1/7 power profile."""
    direction = heading(25.0)
    F = value(wind.wind_force(ufl.as_ufl(z), ufl.as_vector(list(direction)), 12.0, 0.9, 1.25, 1.7))
    v = 12.0 * (z / 10) ** (1 / 7)
    np.testing.assert_allclose(F, 0.5 * 0.9 * 1.25 * 1.7 * v**2 * direction, rtol=1e-13)


def test_wind_falls_to_the_water_on_a_straight_line():
    """Below a millimetre, where the slope of the profile is unbounded: half the pressure at half the height."""
    at = [value(wind.wind_force(ufl.as_ufl(z), point(1, 0, 0), 12.0, 0.9, 1.25, 1.7))[0] for z in (1e-3, 5e-4, 1e-4)]
    assert at[0] == pytest.approx(0.5 * 0.9 * 1.25 * 1.7 * 144 * 1e-4 ** (2 / 7), rel=1e-12)
    assert at[1:] == pytest.approx([at[0] / 2, at[0] / 10], rel=1e-12)


def test_wind_of_a_body_is_that_above_the_water_below_it():
    """At a lever of an upright body at rest: at its height above the local elevation, with the torque x times F."""
    where, lever, eta = np.array([2.0, -1.0, 0.4]), np.array([0.0, 0.0, 3.0]), lambda x: 0.3 * x[0] - 0.1
    load = SimpleNamespace(offset=point(*lever), direction=point(0.6, 0.8, 0), speed=12.0, drag_coefficient=0.9)
    load.air_density, load.area = 1.25, 1.7
    upright = ufl.as_vector([ufl.as_ufl(c) for c in (1.0, 0.0, 0.0, 0.0)])
    for flow, level in ((lambda x: sea.Flow(eta(x), None, None), 0.5), (lambda x: sea.Flow(None, None, None), 0.0)):
        force, torque = wind.wind_load(load, Body(point(*where), upright, flow))
        speed = 12.0 * ((3.4 - level) / 10) ** (1 / 7)
        exact = 0.5 * 0.9 * 1.25 * 1.7 * speed**2 * np.array([0.6, 0.8, 0])
        np.testing.assert_allclose(lowered(force), exact, rtol=1e-12)
        np.testing.assert_allclose(lowered(torque), np.cross(lever, exact), rtol=1e-12)


def test_gradients_near_a_sample_are_those_of_a_potential():
    """As far from it as it may be: symmetric, without trace, and so are their derivatives in any two directions."""
    numbers = np.random.default_rng(5).uniform(-1, 1, sea.LARGE)
    samples, x, h = sea.Samples(ufl.as_vector(numbers.tolist()), 30.0, "none"), np.array([0.3, -0.4, 0.2]), 0.1

    def gradients(at):
        flow = sea.sampled_flow(samples, point(*at))
        found = flow.velocity_gradient, flow.acceleration_gradient
        return np.array([[[lowered(g[i, j]) for j in range(3)] for i in range(3)] for g in found])

    turned = np.array([(gradients(x + h * e) - gradients(x - h * e)) / (2 * h) for e in np.eye(3)])
    assert np.abs(turned).min() > 0
    for axes in ((1, 0, 2, 3), (1, 2, 0, 3), (1, 0, 3, 2)):
        np.testing.assert_allclose(turned.transpose(axes), turned.transpose(1, 0, 2, 3), atol=1e-12)
    np.testing.assert_allclose(np.trace(turned, axis1=2, axis2=3), 0, atol=1e-12)
    np.testing.assert_allclose(np.trace(gradients(x), axis1=1, axis2=2), 0, atol=1e-12)


def test_no_wind_at_and_below_the_water():
    for z in (0.0, -1e-9, -3.0):
        F = value(wind.wind_force(ufl.as_ufl(z), point(1, 0, 0), 12.0, 0.9, 1.25, 1.7))
        assert np.array_equal(F, np.zeros(3))


@pytest.mark.parametrize(("speed", "tolerance"), [(1e-3, 1e-6), (1e-2, 1e-8), (1.0, 1e-12), (7.0, 1e-13)])
def test_drag_is_quadratic_down_to_a_millimetre_per_second(speed, tolerance):
    v = speed * np.array([0.6, 0.0, 0.8])
    F = value(morison.normal_drag(1013.0, 0.07, 0.9, point(*v)))
    np.testing.assert_allclose(F, -0.5 * 0.9 * 1013.0 * 0.07 * speed * v, rtol=tolerance)
    t = np.array([0.8, 0.0, 0.6])
    F = value(morison.tangential_drag(1013.0, 0.07, 0.2, point(*t), point(*v)))
    np.testing.assert_allclose(F, -0.5 * 0.2 * 1013.0 * 0.07 * abs(v @ t) * (v @ t) * t, rtol=2 * tolerance)


def test_drag_at_rest_is_zero_and_has_a_derivative():
    """Without smoothing the derivative of |v| v at rest is 0/0."""
    v, w = ufl.variable(point(0, 0, 0)), ufl.variable(ufl.as_ufl(0.0))
    assert np.array_equal(value(morison.normal_drag(1013.0, 0.07, 0.9, point(0, 0, 0))), np.zeros(3))
    for norm, variable, size in ((morison.smooth_norm(v), v, 3), (morison.smooth_abs(w), w, 1)):
        slope = apply_derivatives(apply_algebra_lowering(ufl.diff(norm, variable)))
        components = [slope[i] for i in range(size)] if size > 1 else [slope]
        assert [value(c) for c in components] == [0.0] * size


@pytest.mark.parametrize(("t", "direction"), [(0.7, 0.0), (2.9, 2.2)])
def test_slope_and_gradients_are_derivatives(t, direction):
    """Of elevation, acceleration and velocity in all directions, below still water; of velocities that have a
    potential they are symmetric, of water without trace."""
    w, x, h = wave(5.0, 12.0, 0.4, t, 0.3, direction), np.array([1.3, -2.1, -1.7]), 1e-5
    flow = sea.wave_flow(w, point(*x))
    ends = [[sea.wave_flow(w, point(*(x + side * h * e))) for side in (1, -1)] for e in np.eye(3)]
    slope = [(value(a.elevation) - value(b.elevation)) / (2 * h) for a, b in ends]
    assert value(flow.slope) == pytest.approx(slope, abs=1e-10)
    for name, gradient in (("acceleration", flow.acceleration_gradient), ("velocity", flow.velocity_gradient)):
        rows = [(value(getattr(a, name)) - value(getattr(b, name))) / (2 * h) for a, b in ends]
        found = np.array([value(gradient[i, :]) for i in range(3)])
        np.testing.assert_allclose(found, np.array(rows).T, atol=1e-9)
        np.testing.assert_allclose(found, found.T, atol=1e-15)
        assert np.trace(found) == pytest.approx(0.0, abs=1e-15)
        assert np.abs(found).max() > 0.01


@pytest.mark.parametrize("radius", [0.0, 0.4, 3.0, 9.0])
def test_averages_over_a_disk(radius):
    """Of elevation and acceleration over a disk, and of their gradients as its first moments tell them, by sums."""
    w, x = wave(4.0, 500.0, 0.4, 0.9, 0.3, 0.7), np.array([1.3, -2.1, -1.7])
    flow = sea.averaged_over_disk(sea.wave_flow(w, point(*x)), ufl.as_ufl(w.wavenumber * radius))
    r, weights = np.polynomial.legendre.leggauss(12)
    r, weights = (1 + r) / 2, weights / 2
    angles = np.arange(24) * 2 * np.pi / 24
    mean, first = np.zeros(4), np.zeros((4, 3))
    for rho, weight in zip(r, weights, strict=True):
        for angle in angles:
            lever = radius * rho * np.array([np.cos(angle), np.sin(angle), 0.0])
            at = sea.wave_flow(w, point(*(x + lever)))
            values = np.array([value(at.elevation), *value(at.acceleration)])
            mean += 2 * rho * weight / 24 * values
            first += 2 * rho * weight / 24 * np.outer(values, lever)
    assert [value(flow.elevation), *value(flow.acceleration)] == pytest.approx(mean, abs=1e-12)
    if radius:
        gradients = first / (radius**2 / 4)  # of a linear function exactly
        assert value(flow.slope)[:2] == pytest.approx(gradients[0, :2], abs=1e-12)
        found = np.array([value(flow.acceleration_gradient[i, :]) for i in range(3)])
        np.testing.assert_allclose(found[:, :2], gradients[1:, :2], atol=1e-12)
