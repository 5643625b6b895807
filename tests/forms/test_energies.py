"""Energies, powers and constitutive laws of lines, springs, joints, take-offs and the bed, as UFL expressions.

Source: work integrals of the forces, differences of energies, and the laws programmed again in numpy.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import ufl
from expressions import RHO, S_0, S, across, value, vector
from scipy.integrate import quad

from dolfbuoy.forms import bending, cable, joint, sea, seabed, take_off

EI, E0 = 40.0, 70.0
NUMBERS = np.random.default_rng(4).uniform(-1, 1, (6, 3, 2))


class Curve:
    """a s + b s^2 in space: as an expression, its slope and its bend in numbers."""

    def __init__(self, coefficients):
        self.a, self.b = coefficients.T
        self.ufl = ufl.as_vector([float(a) * S + float(b) * S**2 for a, b in coefficients])
        self.bend = 2 * self.b

    def __call__(self, s=S_0):
        return self.a * s + self.b * s**2

    def slope(self, s=S_0):
        return self.a + 2 * self.b * s


R, R_T, M, V, P, _ = map(Curve, NUMBERS)
STRETCH = np.linalg.norm(R.slope())
T = R.slope() / STRETCH


# -- bending -----------------------------------------------------------------------------------------------------------


def test_shear_and_curvature():
    shear = across(M.slope(), T) / STRETCH
    np.testing.assert_allclose(value(bending.shear(R.ufl, M.ufl)), shear, rtol=1e-12)
    assert value(bending.shear_term(R.ufl, M.ufl, V.ufl)) == pytest.approx(-shear @ V.slope(), rel=1e-12)
    found = bending.curvature_equation(vector(T), M.ufl, EI, E0, P.ufl, 0.25)
    assert value(found) == pytest.approx(-E0 * (M() @ P() / EI + 0.25 * T @ P.slope()), rel=1e-12)
    whole = bending.curvature_equation(vector(T), M.ufl, EI, E0, P.ufl)
    assert value(whole) == pytest.approx(-E0 * (M() @ P() / EI + T @ P.slope()), rel=1e-12)


def test_blended_terms_are_derivatives_of_their_energy():
    """The energy is quadratic in either argument: central differences are exact."""
    h = 1.7
    energy = h**4 / 720 * (R.slope() @ M.bend) ** 2 / (2 * EI)
    assert value(bending.blended_energy(R.ufl, M.ufl, EI, h)) == pytest.approx(energy, rel=1e-12)

    def at(x, y):
        return value(bending.blended_energy(R.ufl + x * V.ufl, M.ufl + y * P.ufl, EI, h))

    slopes = -(at(1, 0) - at(-1, 0)) / 2 - E0 * (at(0, 1) - at(0, -1)) / 2
    assert value(bending.blended_terms(R.ufl, M.ufl, EI, h, E0, V.ufl, P.ufl)) == pytest.approx(slopes, rel=1e-11)


@pytest.mark.parametrize(("end", "sign"), [(0, 1), (1, -1)])
def test_a_spring_at_an_end(end, sign):
    """4 N m/rad, which 3 N m turn by the angle of the triangle 3, 4, 5: its energy is that of the torque on the way."""
    t_0, m = vector([0, 0, 1]), vector([3, 0, 0])
    np.testing.assert_allclose(value(bending.direction(t_0, m, 4.0, end)), [sign * 0.6, 0, 0.8], rtol=1e-14, atol=1e-15)
    longer = bending.direction(2 * t_0, 2 * m, 4.0, end)
    np.testing.assert_allclose(value(longer), [sign * 1.2, 0, 1.6], rtol=1e-14, atol=1e-15)
    assert bending.direction(t_0, m, None, end) is t_0
    energy = quad(lambda angle: 4 * math.sin(angle), 0, math.asin(0.6))[0]
    assert value(bending.spring_energy(t_0, m, 4.0, end)) == pytest.approx(energy, rel=1e-12)
    t_b = vector([0, 0.6, 0.8])
    np.testing.assert_allclose(value(bending.end_torque(m, t_b, end)), [0, sign * 2.4, -sign * 1.8], atol=1e-14)
    assert value(bending.end_direction(t_b, E0, P.ufl, end)) == pytest.approx(
        -sign * E0 * P() @ [0, 0.6, 0.8], rel=1e-13
    )


def test_bending_energy_and_what_damps():
    """The rate of curvature by finite differences along the line."""
    beta, h = 0.3, 1e-5
    assert value(bending.bending_energy(M.ufl, EI)) == pytest.approx(M() @ M() / (2 * EI), rel=1e-13)

    def turning(s):
        slope = R.slope(s)
        size = np.linalg.norm(slope)
        return across(R_T.slope(s), slope / size) / size

    np.testing.assert_allclose(value(bending.turning(R.ufl, R_T.ufl)), turning(S_0), rtol=1e-12)
    rate = (turning(S_0 + h) - turning(S_0 - h)) / (2 * h)
    elastic = bending.elastic_moment(M.ufl, EI, beta, R.ufl, R_T.ufl)
    np.testing.assert_allclose(value(elastic), M() - EI * beta * rate, rtol=1e-7)
    assert value(bending.damping_power(9.0, R.ufl, R_T.ufl)) == pytest.approx(-9.0 * rate @ rate, rel=1e-7)


# -- stretching --------------------------------------------------------------------------------------------------------

#: Softer beyond 50 N, stiffer beyond 200 N; softer below -20 N.
KINKS = (cable.Kink(50.0, 1 / 300 - 1 / 900, False), cable.Kink(200.0, 1 / 700 - 1 / 300, False))
KINKS += (cable.Kink(-20.0, 1 / 450 - 1 / 900, True),)
#: T -> (e, energy), areas under the table by hand.
TABLE = {
    30.0: (30 / 900, 30**2 / 1800),
    80.0: (50 / 900 + 30 / 300, 50**2 / 1800 + 65 * 30 / 300),
    270.0: (50 / 900 + 150 / 300 + 70 / 700, 50**2 / 1800 + 125 * 150 / 300 + 235 * 70 / 700),
    -50.0: (-20 / 900 - 30 / 450, 20**2 / 1800 + 35 * 30 / 450),
}


@pytest.mark.parametrize("compliance", [None, 1 / 900])
@pytest.mark.parametrize("tension", TABLE)
def test_strain_and_energy_of_a_table(tension, compliance):
    e, energy = TABLE[tension]
    line = cable.Cable(1.0, 900.0 if compliance is None else None, compliance=compliance, kinks=KINKS)
    assert value(cable.strain(line, ufl.as_ufl(tension))) == pytest.approx(e, rel=1e-13)
    found = cable.elastic_energy(line, ufl.as_ufl(e), ufl.as_ufl(tension), R.ufl, None)
    assert value(found) == pytest.approx(energy, rel=1e-13)


def test_elastic_energy_is_that_of_the_elastic_tension():
    """T minus c e_t, by Hooke's law with stiffness or compliance; an inextensible line has none."""
    rate, c = T @ R_T.slope(), 13.0
    e = (70.0 - c * rate) / 900
    for line in (cable.Cable(1.0, 900.0, damping=c), cable.Cable(1.0, damping=c, compliance=1 / 900)):
        assert value(cable.strain(line, ufl.as_ufl(70.0), R.ufl, R_T.ufl)) == pytest.approx(e, rel=1e-12)
        found = cable.elastic_energy(line, ufl.as_ufl(e), ufl.as_ufl(70.0), R.ufl, R_T.ufl)
        assert value(found) == pytest.approx(450 * e**2, rel=1e-12)
    assert cable.strain(cable.Cable(1.0), ufl.as_ufl(70.0)) is None
    assert value(cable.mean_strain_equation(7.0, 9.0, 0.5)) == 1.0


@pytest.mark.parametrize("scale", [2.0, 0.5])
def test_power_of_a_damped_rope(scale):
    """Taut: the power dissipated by its damper; slack and without tension: zero."""
    r, r_t, c = float(scale / STRETCH) * R.ufl, R_T.ufl, 13.0
    rate, strain, rope = T @ R_T.slope(), scale - 1, cable.Cable(1.0, 900.0, damping=13.0)
    tension = 900 * strain + c * rate if scale > 1 else 0.0
    energy = cable.taut_energy(rope, r)
    assert value(energy) == pytest.approx(450 * max(strain, 0.0) ** 2, rel=1e-12)
    e = ufl.as_ufl(strain if scale > 1 else -0.1)
    power = cable.taut_damping_power(rope, r, ufl.as_ufl(tension), e, r_t)
    assert value(power) == pytest.approx(-c * rate**2 if scale > 1 else 0.0, rel=1e-11)
    pulled = cable.taut_damping_power(rope, r, ufl.as_ufl(5.0), ufl.as_ufl(0.25), r_t)  # whatever it is
    assert value(pulled) == pytest.approx((900 * max(strain, 0.0) - 5.0 * scale / 1.25) * rate, rel=1e-11)


def test_a_grown_line():
    line = cable.Cable(3.0, 900.0, diameter=0.1, area=0.02, damping=4.0)
    assert line.grown(1.5, 2.0) == cable.Cable(6.0, 900.0, diameter=pytest.approx(0.15), area=0.045, damping=4.0)


def test_wet_part_of_a_line():
    """From twice the height of its share, and its radius, above the surface to as much below it; of a slope besides."""
    line, share = cable.Cable(1.0, diameter=0.8), 9.0
    flow = sea.Flow(ufl.as_ufl(0.7), None, None, vector([0.3, -0.2, 0.0]))
    up = R.slope()[2] - np.array([0.3, -0.2, 0.0]) @ R.slope()
    c = (0.7 - R()[2]) / math.hypot(share * up, 0.4)
    assert abs(c) < 0.9
    assert value(cable.wet_part(line, flow, R.ufl, share)) == pytest.approx(0.5 + 0.75 * c - 0.25 * c**3, rel=1e-12)
    still = cable.wet_part(line, sea.Flow(None, None, None), R.ufl, share)
    c = -R()[2] / math.hypot(share * R.slope()[2], 0.4)
    assert value(still) == pytest.approx(0.5 + 0.75 * c - 0.25 * c**3, rel=1e-12)


@pytest.mark.parametrize(
    ("depth", "part"), [(-3.0, 0.0), (-2.0, 0.0), (0.0, 0.5), (1.0, 0.84375), (2.0, 1.0), (5.0, 1.0)]
)
def test_wet_part_of_a_ball(depth, part):
    assert value(sea.wet_part(ufl.as_ufl(depth), ufl.as_ufl(2.0))) == pytest.approx(part, abs=1e-15)


# -- bodies, take-offs and the bed -------------------------------------------------------------------------------------


def test_forces_on_a_body_at_a_joint():
    body, g = joint.JointBody(9.0, 0.036), vector([0, 0, -9.7])
    flow = sea.Flow(ufl.as_ufl(0.7), vector([0.7, -0.3, 0.2]), vector([-0.5, 0.8, 0.4]))
    point = joint.Point(vector([0.1, 0.2, -0.4]), vector([1.0, -2.0, 0.5]))
    v, a = np.array([0.6, -0.5, 0.6]), np.array([-1.5, 2.8, -0.1])
    drag = 0.5 * RHO * 1.3 * np.linalg.norm(v) * v
    np.testing.assert_allclose(value(joint.drag(1.3, body, RHO, flow, point)), drag, rtol=1e-11)
    np.testing.assert_allclose(value(joint.added_mass(0.6, body, RHO, flow, point)), RHO * 0.036 * 0.6 * a, rtol=1e-13)
    fk = value(joint.froude_krylov(None, body, RHO, flow, point))
    np.testing.assert_allclose(fk, RHO * 0.036 * np.array([-0.5, 0.8, 0.4]), rtol=1e-13)
    still = sea.Flow(None, None, None)
    terms = joint.drag, joint.added_mass, joint.froude_krylov
    assert [term(1.0, body, RHO, still, joint.Point()) for term in terms] == [None] * 3
    (whole,) = joint.weight(body, g, RHO, None)
    assert value(whole)[2] == pytest.approx(-9.7 * (9 - RHO * 0.036))
    (dry,) = joint.weight(body, g, None, None)
    assert value(dry)[2] == pytest.approx(-9.7 * 9)
    own, lift = joint.weight(body, g, RHO, 0.25)
    assert (value(own)[2], value(lift)[2]) == pytest.approx((-9.7 * 9, 9.7 * 0.25 * RHO * 0.036))
    ball = joint.JointBody(9.0, 4 / 3 * math.pi * 0.2**3)
    wet = joint.wet_part(ball, flow, vector([0.0, 0.0, 0.6]))  # half its radius below the surface
    assert value(wet) == pytest.approx(0.84375, rel=1e-12)
    assert value(joint.wet_part(joint.JointBody(9.0, 0.0), flow, vector([0, 0, 0.7]))) == 0.5


def test_take_offs_at_a_point():
    law = Fake(stiffness=400.0, length=3.0, longest=4.4, shortest=3.2, force=40.0, speed=0.05)
    s = take_off.stretch(vector([1, 0, 0]), vector([1, 3, 4]), vector([0, 0, 0.5]), vector([0, 1, -0.5]))
    np.testing.assert_allclose(value(s.direction), [0, 0.6, 0.8], rtol=1e-14, atol=1e-15)
    assert (value(s.length), value(s.rate)) == pytest.approx((5.0, -0.2))
    terms = take_off.spring, take_off.stops, take_off.friction
    assert [value(term(law, s)) for term in terms] == pytest.approx([800.0, 240.0, -40 * 0.2 / math.hypot(0.2, 0.05)])
    numbers = [value(term(30.0, s)) for term in (take_off.damper, take_off.quadratic_damper, take_off.pretension)]
    assert numbers == pytest.approx([-6.0, -1.2, 30.0])
    assert value(take_off.stops_energy(law, s)) == pytest.approx(400 * 0.6**2 / 2)
    assert value(take_off.spring_energy(law, s)) == pytest.approx(400 * 2**2 / 2)
    assert value(take_off.pretension_energy(30.0, s)) == pytest.approx(150.0)
    law.shortest = 7.0
    assert value(take_off.stops(law, s)) == pytest.approx(400 * (0.6 - 2.0))
    assert value(take_off.stops_energy(law, s)) == pytest.approx(400 * (0.6**2 + 2.0**2) / 2)
    rest = take_off.stretch(vector([1, 0, 0]), vector([1, 0, 0]))  # where both meet nothing is infinite
    assert value(rest.direction).tolist() == [0, 0, 0]
    assert value(rest.length) == pytest.approx(1e-12)
    moving = take_off.damper, take_off.quadratic_damper, take_off.friction
    assert [term(law, rest) for term in moving] == [None] * 3


def test_a_ground_that_is_no_plane():
    """On a parabola, for which Taylor's formula is exact."""
    a, b, c, d, e = 0.3, -0.2, 0.4, 0.1, -0.6

    def height(x, y):
        return -7 + a * x + b * y + c * x**2 / 2 + d * x * y + e * y**2 / 2

    x0, y0, (x, y, z) = 0.5, -0.4, (0.8, -0.9, -6.2)
    slope = a + c * x0 + d * y0, b + d * x0 + e * y0
    ground = seabed.Ground(x0, y0, height(x0, y0), slope, (c, d, e))
    n, gap = ground.normal_and_gap(vector([x, y, z]))
    up = np.array([-(a + c * x + d * y), -(b + d * x + e * y), 1.0])
    np.testing.assert_allclose(value(n), up / np.linalg.norm(up), rtol=1e-13)
    assert value(gap) == pytest.approx((z - height(x, y)) / np.linalg.norm(up), rel=1e-13)


@pytest.mark.parametrize(("gap", "lifted"), [(0.2, 0.2), (-0.3, 0.0)])
def test_what_holds_a_sinker(gap, lifted):
    """A spring down to the bed and one along it; zero for bodies that are not sinkers."""
    n, moved = np.array([0.0, 0.6, 0.8]), np.array([0.5, 0.3, -0.1])
    at = seabed.Contact(vector(n), ufl.as_ufl(gap), 70.0, 3.0, 0.01, None, 9.0, vector(moved))
    np.testing.assert_allclose(value(seabed.holding(1.0, at)), -(70 * lifted * n + 9 * across(moved, n)), rtol=1e-13)
    assert value(seabed.holding(0.0, at)).tolist() == [0.0] * 3
