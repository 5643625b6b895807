"""Point loads on a buoy, its balances, and sampled or averaged water kinematics, as UFL expressions.

Source: rigid bodies, Euler's equations and Taylor's formula programmed again in numpy; rotations with scipy.
"""

from types import SimpleNamespace as Fake

import numpy as np
import pytest
import ufl
from expressions import value, vector
from scipy.spatial.transform import Rotation

from dolfbuoy.forms import buoy, hull, radiation, sea, wind

TURN = Rotation.from_rotvec([0.3, -0.5, 0.8])
QUATERNION = vector(np.roll(TURN.as_quat(), 1))
D = TURN.apply([0, 0, 1])
SPIN, SPIN_T, LINEAR_T = np.array([0.4, -0.7, 1.1]), np.array([-0.2, 0.3, 0.5]), np.array([0.9, 0.1, -0.8])
MOTION = hull.BodyMotion(vector([0.5, -0.3, 0.2]), vector(SPIN), vector(LINEAR_T), vector(SPIN_T))
BODY = buoy.Body(vector([3.0, -2.0, 1.0]), QUATERNION, lambda x: sea.Flow(None, None, None), MOTION)
STILL = BODY._replace(motion=None)


def told(load):
    return [None if part is None else value(part) for part in load]


def test_radiation_of_a_leaning_buoy():
    """(F, m) on (v, d_t): F, and the torque d x m."""
    matrix = np.random.default_rng(2).uniform(-1, 1, (5, 5))
    five, place = np.arange(1.0, 6.0), np.array([2.5, -2.25])
    force, torque = told(radiation.load(vector(five), BODY))
    np.testing.assert_allclose(force, [1, 2, 3], rtol=1e-14)
    np.testing.assert_allclose(torque, np.cross(D, [4, 5, 0]), rtol=1e-12)

    def expected(x):
        return np.concatenate([x[:3], np.cross(D, [x[3], x[4], 0.0])])

    leaning = np.cross(SPIN, D)
    faster = np.cross(SPIN_T, D) + np.cross(SPIN, leaning)
    found = radiation.added_mass(ufl.as_matrix(matrix.tolist()), BODY)
    x = -matrix @ [*LINEAR_T, *faster[:2]]
    np.testing.assert_allclose(np.concatenate(told(found)), expected(x), rtol=1e-11)
    c = Fake(force=vector(five), damping=ufl.as_matrix(matrix.tolist()), place=vector(place))
    c.slope = ufl.as_matrix(matrix[:, :2].tolist())
    x = five - matrix @ [0.5, -0.3, 0.2, *leaning[:2]]
    np.testing.assert_allclose(np.concatenate(told(radiation.memory(c, BODY))), expected(x), rtol=1e-11)
    x = five + matrix[:, :2] @ [0.5, 0.25]
    np.testing.assert_allclose(np.concatenate(told(radiation.diffraction(c, BODY))), expected(x), rtol=1e-11)
    force, torque = told(radiation.drift(c, BODY))
    assert (force.tolist(), torque) == ([1.0, 2.0, 0.0], None)
    for term in (radiation.added_mass, radiation.memory, radiation.diffraction, radiation.drift):
        assert term(c, STILL) == (None, None)


def test_loads_at_points_of_a_buoy():
    arm, push = np.array([0.2, -0.1, 1.5]), np.array([5.0, 7.0, -3.0])
    np.testing.assert_allclose(
        value(buoy.point_torque(QUATERNION, vector(arm), vector(push))), np.cross(TURN.apply(arm), push)
    )
    force, torque = told(buoy.external_force(Fake(force=vector(push), offset=vector(arm)), BODY))
    np.testing.assert_allclose(np.concatenate([force, torque]), [*push, *np.cross(TURN.apply(arm), push)], rtol=1e-12)
    assert told(buoy.external_force(Fake(force=vector(push), offset=None), BODY))[1] is None
    force, torque = told(buoy.rotational_damping(6.0, BODY))
    assert force is None
    np.testing.assert_allclose(torque, -6.0 * (SPIN @ D) * D, rtol=1e-12)
    assert buoy.rotational_damping(6.0, STILL) == buoy.wave_damping(None, STILL) == (None, None)


def test_wind_at_a_point_of_a_buoy():
    """From the height above the water there; twice the height gives 2^(2/7) times the force."""
    c = Fake(offset=vector([0, 0, 1.5]), direction=vector([0.6, 0.8, 0]), speed=9.0, drag_coefficient=1.1)
    c.air_density, c.area = 1.25, 2.0
    arm = TURN.apply([0, 0, 1.5])
    for level, height in ((None, 1.0 + arm[2]), (0.4, 0.6 + arm[2])):
        flow = sea.Flow(None, None, None, level=None if level is None else ufl.as_ufl(level))
        force, torque = told(wind.wind_load(c, BODY._replace(flow=lambda x, flow=flow: flow)))
        expected = 0.5 * 1.1 * 1.25 * 2.0 * 81.0 * (height / 10) ** (2 / 7) * np.array([0.6, 0.8, 0])
        np.testing.assert_allclose(force, expected, rtol=1e-12)
        np.testing.assert_allclose(torque, np.cross(arm, expected), rtol=1e-12)


def test_balances_of_a_buoy_at_rest():
    """Each term alone: pseudo-inertia, gauge of rotation about the axis, loads and norm of the quaternion."""
    small = Rotation.from_rotvec([1e-5, 2e-5, -3e-5])
    q, r, r_ref = vector(np.roll((small * TURN).as_quat(), 1)), np.array([1.0, 2.0, 3.0]), np.array([1.5, 1.0, 4.0])
    np.testing.assert_allclose(value(buoy.turn(q, 2 * QUATERNION)), [5e-6, 1e-5, -1.5e-5], rtol=1e-8)
    tests = np.array([1.0, -2.0, 0.5]), 3.0, np.array([0.7, 0.2, -0.4])
    force, torque, angle = np.array([4.0, 5.0, 6.0]), np.array([7.0, 8.0, 9.0]), np.array([1e-5, 2e-5, -3e-5])
    for relaxation, gauge in ((0.0, 0.0), (2.0, 0.0), (0.0, 1e6), (2.0, 1e6)):
        found = buoy.equilibrium(
            vector(r), 1.0 * q, vector(force), vector(torque), (vector(r_ref), QUATERNION), 11.0, 13.0, relaxation,
            gauge, (vector(tests[0]), ufl.as_ufl(tests[1]), vector(tests[2])),
        )  # fmt: skip
        axis = (small * TURN).apply([0, 0, 1])
        expected = (relaxation * 11.0 * (r - r_ref) - force) @ tests[0]
        expected += (relaxation * 13.0 * angle + gauge * (angle @ axis) * axis - torque) @ tests[2]
        assert value(found) == pytest.approx(expected, rel=1e-8)
    doubled = buoy.equilibrium(
        vector(r), 2.0 * q, vector(0 * force), vector(0 * torque), (vector(r), QUATERNION), 1.0, 1.0, 0.0, 0.0,
        (vector(tests[0]), ufl.as_ufl(3.0), vector(tests[2])),
    )  # fmt: skip
    assert value(doubled) == pytest.approx(9.0, rel=1e-13)  # 3 (4 - 1)
    sprung = buoy.held_horizontally(vector(r), vector(r_ref), 8.0, vector([1.0, -2.0, 99.0]))
    assert value(sprung) == pytest.approx(8 * (-0.5 - 2.0))


def test_spin_that_a_scheme_follows():
    """Where the rates are those of Euler's equations nothing is added; what a scheme errs by is, along the axis."""
    inertia, L = np.array([2.0, 2.0, 5.0]), np.array([1.0, -0.5, 2.0])
    turn = TURN.as_matrix()
    omega = turn @ ((turn.T @ L) / inertia)
    L_t = np.array([0.3, 0.7, -0.2])
    exact = L_t @ D + L @ np.cross(omega, D)
    for off in (0.0, 0.4):
        found = buoy.spin_correction(QUATERNION, vector(L), vector(L_t), ufl.as_ufl(exact + off), vector(inertia))
        np.testing.assert_allclose(value(found), off * D, atol=1e-13)
    assert value(buoy.spin(QUATERNION, vector(L))) == pytest.approx(L @ D, rel=1e-13)


# -- waves -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stretching", "z", "eta", "found"),
    [
        ("wheeler", -4.0, 2.0, -5.0),
        ("wheeler", 1.0, 0.5, 0.0),
        ("vertical", -4.0, 2.0, -4.0),
        ("vertical", 0.5, 2.0, 0.0),
        ("none", 0.5, 2.0, 0.5),
    ],
)
def test_heights_that_are_read(stretching, z, eta, found):
    """Water 10 m deep."""
    samples = sea.Samples(None, 10.0, stretching)
    assert value(sea.stretched(samples, ufl.as_ufl(z), ufl.as_ufl(eta))) == pytest.approx(found, abs=1e-14)


def test_average_of_samples_over_a_disk():
    """Elevation and acceleration of the means, slope and gradient of the moments, all at the plain one's height."""
    rows = np.random.default_rng(3).uniform(-1, 1, (3, sea.LARGE))
    rows[:, :3] = [0.1, -0.2, -5.0]
    x, h = np.array([0.3, 0.1, -4.0]), 30.0
    d = x[:2] - [0.1, -0.2]

    def elevation(s):
        bend = np.array([[s[22], s[23]], [s[23], s[24]]])
        return s[3] + s[4:6] @ d + d @ bend @ d / 2, s[4:6] + bend @ d

    eta = elevation(rows[0])[0]
    way = np.array([*d, h * (-4.0 - eta) / (h + eta) + 5.0])

    def symmetric(g):
        xx, xy, yy, xz, yz = g
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]])

    def gradient(g, second):
        xxx, xxy, xyy, yyy, xxz, xyz, yyz = second
        along = [[xxx, xxy, xxz], [xxy, xyy, xyz], [xyy, yyy, yyz], [xxz, xyz, -xxx - xyy], [xyz, yyz, -xxy - yyy]]
        return symmetric(g + np.array(along) @ way)

    found = sea.sampled_average([sea.Samples(vector(row), h) for row in rows], vector(x))
    plain, mean, moment = rows
    assert value(found.elevation) == pytest.approx(elevation(mean)[0], rel=1e-12)
    np.testing.assert_allclose(value(found.slope), [*elevation(moment)[1], 0.0], rtol=1e-12)
    np.testing.assert_allclose(value(found.velocity), plain[6:9] + symmetric(plain[9:14]) @ way, rtol=1e-12)
    np.testing.assert_allclose(value(found.acceleration), mean[14:17] + symmetric(mean[17:22]) @ way, rtol=1e-12)
    matrix = [[value(found.acceleration_gradient[i, j]) for j in range(3)] for i in range(3)]
    np.testing.assert_allclose(matrix, gradient(moment[17:22], moment[32:39]), rtol=1e-12)
    matrix = [[value(found.velocity_gradient[i, j]) for j in range(3)] for i in range(3)]
    np.testing.assert_allclose(matrix, gradient(plain[9:14], plain[25:32]), rtol=1e-12)


def test_surface_of_a_flow():
    eta, level = ufl.as_ufl(0.4), ufl.as_ufl(1.5)
    flows = [sea.Flow(a, None, None, level=b) for a in (None, eta) for b in (None, level)]
    assert [None if flow.surface is None else value(flow.surface) for flow in flows] == [None, 1.5, 0.4, 1.9]
    assert [value(flow.depth(vector([0, 0, -2.0]))) for flow in flows] == [2.0, 3.5, 2.4, 3.9]
    tilted = sea.Flow(eta, None, None, vector([0.75, 0.0, 0.0])).normal
    np.testing.assert_allclose(value(tilted), [-0.6, 0, 0.8], rtol=1e-14)
    assert value(flows[0].normal).tolist() == [0, 0, 1]
