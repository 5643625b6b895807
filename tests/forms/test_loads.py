"""Cable equations and hydrodynamic loads on cable and hull at one point, evaluated numerically.

Source: Morison's equation, the strain equation and a disc's wet segment programmed again in numpy.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import ufl
from scipy.integrate import quad
from scipy.spatial.transform import Rotation
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from dolfbuoy import load_scene
from dolfbuoy.forms import buoy, cable, hull, morison, sea
from dolfbuoy.forms.sea import Flow
from dolfbuoy.model.lines import top_position
from dolfbuoy.model.rigid import cross_section, weight_per_length
from dolfbuoy.scene import Top
from dolfbuoy.solver.compat import MPI, interval_mesh

RHO = 1013.0
MESH = interval_mesh(MPI.COMM_SELF, [0.0, 1.0])
S = ufl.SpatialCoordinate(MESH)[0]
#: Position, velocity, acceleration at s: curved, stretched by half at S_0, nothing along an axis.
S_0 = 0.3
PATHS = (
    ((1.3, 0.4), (-0.2, 0.5), (0.6, -0.1)),
    ((0.3, -0.7), (0.5, 0.2), (-0.4, 0.9)),
    ((1.1, 0.2), (-0.8, 0.6), (0.3, 0.7)),
)
PROPERTIES = cable.Cable(
    line_density=7.3,
    EA=900.0,
    diameter=0.07,
    area=0.004,
    damping=13.0,
)
WATER, WATER_T = np.array([0.7, -0.3, 0.2]), np.array([-0.5, 0.8, 0.4])


def value(expression, s=S_0):
    """Number (or array) of an expression of S."""
    expression = ufl.as_ufl(expression)
    if expression.ufl_shape:
        return np.array([value(expression[i], s) for i in range(expression.ufl_shape[0])])
    return float(apply_derivatives(apply_algebra_lowering(expression))((s,)))


def vector(*x):
    return ufl.as_vector([ufl.as_ufl(float(c)) for c in x])


def path(coefficients):
    """(expression, value, slope at S_0) of a quadratic curve in space."""
    x = ufl.as_vector([a * S + b * S**2 for a, b in coefficients])
    a, b = np.array(coefficients).T
    return x, a * S_0 + b * S_0**2, a + 2 * b * S_0


(r, _, SLOPE), (r_t, V, SLOPE_T), (r_tt, A, _) = map(path, PATHS)
TANGENT = SLOPE / np.linalg.norm(SLOPE)


def split(x, t):
    """(normal, tangential) components."""
    return x - (x @ t) * t, (x @ t) * t


# -- cable -------------------------------------------------------------------------------------------------------------


def test_strain_rate_of_a_stretched_cable():
    """d|r'|/dt from the difference of two lengths, and the elastic strain that is left of T = EA e + c e_t."""
    h = 1e-6
    rate = (np.linalg.norm(SLOPE + h * SLOPE_T) - np.linalg.norm(SLOPE - h * SLOPE_T)) / (2 * h)
    assert abs(np.linalg.norm(SLOPE) - 1) > 0.3
    assert value(cable.strain_rate(r, r_t)) == pytest.approx(rate, rel=1e-8)
    e = value(cable.strain(PROPERTIES, ufl.as_ufl(70.0), r, r_t))
    assert PROPERTIES.EA * e + PROPERTIES.damping * rate == pytest.approx(70.0, rel=1e-8)
    assert value(cable.strain(PROPERTIES, ufl.as_ufl(70.0))) == pytest.approx(70.0 / 900.0)
    assert value(cable.damping_power(13.0, r, r_t)) == pytest.approx(-13.0 * rate**2, rel=1e-8)  # force times rate


@pytest.mark.parametrize("form", ["paper", "energy"])
def test_strain_equation(form):
    """Zero for the actual strain of the curve, else half (|r'|^2 - (1+e)^2), over 1+e or its square."""
    length = np.linalg.norm(SLOPE)
    assert value(cable.strain_equation(r, length - 1, 1.0, form)) == pytest.approx(0.0, abs=1e-14)
    defect = 0.5 * (length**2 - 1.2**2) / 1.2 ** (1 if form == "paper" else 2)
    assert value(cable.strain_equation(r, ufl.as_ufl(0.2), 1.0, form)) == pytest.approx(defect, rel=1e-13)
    assert value(cable.strain_equation(r, None, 1.0)) == pytest.approx(0.5 * (length**2 - 1), rel=1e-13)


def test_tension_weight_and_inertia():
    """T r'/(1+e) is T times the unit tangent for the actual strain of the curve; weight minus buoyancy."""
    e = np.linalg.norm(SLOPE) - 1
    assert value(cable.tension_term(r, 50.0, ufl.as_ufl(e), r_t)) == pytest.approx(50.0 * TANGENT @ SLOPE_T, rel=1e-13)
    assert value(cable.tension_term(r, 50.0, None, r_t)) == pytest.approx(50.0 * SLOPE @ SLOPE_T, rel=1e-13)
    g = vector(0, 0, -9.7)
    assert value(cable.weight_in_water(PROPERTIES, g, RHO)) == pytest.approx([0, 0, -9.7 * (7.3 - RHO * 0.004)])
    assert value(cable.weight_in_water(PROPERTIES, g)) == pytest.approx([0, 0, -9.7 * 7.3])
    assert value(cable.inertia(PROPERTIES, r_tt, r_t)) == pytest.approx(7.3 * A @ V)
    assert value(cable.stretched(PROPERTIES, 0.25, 8.0)) == 10.0


def cable_force(v, a, water, water_t, froude_krylov=False):
    """Drag, added mass and Froude-Krylov force [N per stretched metre]; None for quantities that are zero."""
    v_n, v_t = split((0 if v is None else v) - water, TANGENT)
    force = -0.5 * 0.9 * RHO * 0.07 * np.linalg.norm(v_n) * v_n - 0.5 * 0.2 * RHO * 0.07 * np.linalg.norm(v_t) * v_t
    if a is not None:
        force -= RHO * 0.004 * (0.4 * split(a, TANGENT)[0] + 0.15 * split(a, TANGENT)[1])
    if water_t is not None:
        normal, along = split(water_t, TANGENT)
        force += RHO * 0.004 * (1.4 * normal + (0.15 + froude_krylov) * along)
    return force


TERMS = [(cable.normal_drag, 0.9), (cable.tangential_drag, 0.2), (cable.added_mass, 0.4)]
TERMS += [(cable.tangential_added_mass, 0.15), (cable.normal_froude_krylov, None)]


def total(terms, *where):
    """Sum of the terms present at a point."""
    found = [term(c, *where) for term, c in terms]
    return sum(value(force) for force in found if force is not None)


@pytest.mark.parametrize("froude_krylov", [False, True])
def test_water_on_the_cable(froude_krylov):
    terms = TERMS + ([(cable.tangential_froude_krylov, None)] if froude_krylov else [])
    t = cable.tangent(r)
    flow, here = Flow(None, vector(*WATER), vector(*WATER_T)), cable.Point(t, r_t, r_tt)
    moving = total(terms, PROPERTIES, RHO, flow, here)
    assert moving == pytest.approx(cable_force(V, A, WATER, WATER_T, froude_krylov), rel=1e-9)
    current = total(terms, PROPERTIES, RHO, Flow(None, vector(*WATER), None), cable.Point(t))
    assert current == pytest.approx(cable_force(None, None, WATER, None), rel=1e-9)
    still = total(terms, PROPERTIES, RHO, Flow(None, None, None), here)
    assert still == pytest.approx(cable_force(V, A, 0 * WATER, None), rel=1e-9)
    assert total(terms, PROPERTIES, RHO, Flow(None, None, None), cable.Point(t)) == 0  # nothing of it is built


# -- hull --------------------------------------------------------------------------------------------------------------

AXIS, LEVER = np.array([0.36, 0.48, 0.8]), np.array([0.4, -0.2, 0.9])
MOTION = hull.BodyMotion(vector(0.5, -0.6, 0.3), vector(0.2, 0.7, -0.4), vector(-0.9, 0.4, 0.6), vector(0.3, -0.5, 0.8))
RADIUS = 0.6
FLOW = Flow(None, vector(*WATER), vector(*WATER_T))


def at_lever():
    """Velocity and acceleration of the point at LEVER of a rigid body."""
    v, w, a, w_t = (np.array(value(x)) for x in MOTION)
    return v + np.cross(w, LEVER), a + np.cross(w_t, LEVER) + w * (w @ LEVER) - LEVER * (w @ w)


def test_rigid_motion_of_a_strip():
    v, a = at_lever()
    assert value(MOTION.velocity_at(vector(*LEVER))) == pytest.approx(v, rel=1e-13)
    assert value(MOTION.acceleration_at(vector(*LEVER))) == pytest.approx(a, rel=1e-13)


GRADIENT = np.array([[0.3, -0.2, 0.5], [-0.2, 0.4, 0.1], [0.5, 0.1, -0.7]])


def strip_at(area, moment=(0, 0, 0), flow=FLOW, motion=MOTION):
    return hull.Strip(vector(*LEVER), vector(*AXIS), ufl.as_ufl(RADIUS), flow, area, vector(*moment), motion)


def test_water_on_a_strip():
    """Inertia of the wet area, across the axis where it is the body's, and drag of the wetted diameter 2 R A/(pi R^2),
    both in its centroid; nothing of it turns the hull about its axis."""
    area, moment, (v, a) = 0.7, np.array([0.02, -0.05, 0.01]), at_lever()
    terms = [(hull.froude_krylov, None), (hull.added_mass, 0.35), (hull.normal_drag, 0.8)]
    strip = strip_at(area, moment)
    force, torque = map(value, hull.strip_load(strip, vector(*total(terms, RHO, strip))))
    v_n = split(v - WATER, AXIS)[0]
    drag = -0.5 * 0.8 * RHO * 2 * RADIUS * area / (math.pi * RADIUS**2) * np.linalg.norm(v_n) * v_n
    expected = drag + RHO * area * (WATER_T + 0.35 * split(WATER_T - a, AXIS)[0])
    assert force == pytest.approx(expected, rel=1e-9)
    assert torque == pytest.approx(split(np.cross(LEVER + moment / area, expected), AXIS)[0], rel=1e-9)
    assert abs(np.cross(LEVER + moment / area, expected) @ AXIS) > 1.0  # there is something to leave out
    held = strip._replace(flow=Flow(None, vector(*WATER), None), motion=None)
    u_n = split(WATER, AXIS)[0]
    at_rest = area * total(terms, RHO, held)
    assert at_rest == pytest.approx(0.8 * RHO * area / (math.pi * RADIUS) * np.linalg.norm(u_n) * u_n)
    lift = value(hull.buoyancy(vector(0, 0, -9.7), RHO, strip))
    assert lift == pytest.approx([0, 0, RHO * 9.7])


def test_couple_of_the_pressure_gradient():
    """rho int x cross (G x) over the disk, by its second moment pi R^4/4 about any diameter."""
    flow = FLOW._replace(acceleration_gradient=ufl.as_matrix(GRADIENT.tolist()))
    full = math.pi * RADIUS**2
    strip = strip_at(full, flow=flow)
    couple = hull.froude_krylov_couple(None, RHO, strip)
    e_1 = np.cross(AXIS, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(AXIS, [0.0, 0.0, 1.0]))
    second = math.pi * RADIUS**4 / 4
    expected = RHO * second * sum(np.cross(e, GRADIENT @ e) for e in (e_1, np.cross(AXIS, e_1)))
    torque = value(hull.strip_load(strip, vector(0, 0, 0), couple)[1])
    assert torque == pytest.approx(expected, rel=1e-12)
    assert abs(torque @ AXIS) < 1e-9  # symmetric gradients turn nothing about the axis
    assert hull.froude_krylov_couple(None, RHO, strip_at(full)) is None


def test_water_on_a_face():
    """Drag and added mass along the axis only; inertia from the relative acceleration of water and body."""
    (v, a), inner = at_lever(), 0.2
    strip = strip_at(0.75 * math.pi * RADIUS**2)  # three quarters of it are wet
    face = hull.ring(strip, inner)
    area, volume = 0.75 * math.pi * (0.6**2 - 0.2**2), 0.75 * 2 / 3 * math.pi * (0.6**3 - 0.2**3)
    terms = [(hull.axial_drag, 1.3), (hull.axial_added_mass, 0.7)]

    def force(strip):
        found = [term(c, RHO, strip, face) for term, c in terms]
        assert all(torque is None for _, torque in found)
        return sum(value(F) for F, _ in found if F is not None)

    speed = (v - WATER) @ AXIS
    drag, mass = -0.5 * 1.3 * RHO * area * abs(speed) * speed, 0.7 * RHO * volume
    assert force(strip) == pytest.approx((drag - mass * (a - WATER_T) @ AXIS) * AXIS, rel=1e-9)
    still = force(strip._replace(flow=Flow(None, vector(*WATER), None)))
    assert still == pytest.approx((drag - mass * a @ AXIS) * AXIS, rel=1e-9)
    held = force(strip._replace(motion=None))
    through = 0.5 * 1.3 * RHO * area * abs(WATER @ AXIS) * (WATER @ AXIS)
    assert held == pytest.approx((through + mass * WATER_T @ AXIS) * AXIS, rel=1e-9)


def test_a_face_that_turns():
    """Inertia of the water about diameters, against the angular acceleration of the water that crosses the disc.

    A body that turns as the disc of water does, (w x x).d = (G x).d for every x of the disc, feels nothing.
    """
    strip, face = strip_at(math.pi * RADIUS**2), hull.ring(strip_at(math.pi * RADIUS**2), 0.0)
    force, torque = hull.rotational_added_mass(0.9, RHO, strip, face)
    w_t = np.array(value(MOTION.angular_acceleration))
    assert force is None
    assert value(torque) == pytest.approx(-0.9 * RHO * 8 / 45 * RADIUS**5 * split(w_t, AXIS)[0], rel=1e-12)
    moving = strip._replace(flow=FLOW._replace(acceleration_gradient=ufl.as_matrix(GRADIENT.tolist())), motion=None)
    inertia = 0.9 * RHO * 8 / 45 * RADIUS**5
    w = value(hull.rotational_added_mass(0.9, RHO, moving, face)[1]) / inertia
    for x in (np.cross(AXIS, [1.0, 0, 0]), np.cross(AXIS, [0, 1.0, 0])):
        assert np.cross(w, x) @ AXIS == pytest.approx((GRADIENT @ x) @ AXIS, rel=1e-12)
    assert hull.rotational_added_mass(0.9, RHO, strip._replace(motion=None), face) == (None, None)


def test_steps_and_cones_add_up_to_one_disc():
    """Rings and a cone from 0 to R have area, volume and inertia of a disc of R, projected."""
    wet = strip_at(math.pi * RADIUS**2)
    disc = hull.ring(wet, 0.0)
    inner = hull.ring(wet._replace(radius=ufl.as_ufl(0.25), area=math.pi * 0.25**2), 0.0)
    step = hull.ring(wet._replace(radius=ufl.as_ufl(0.4), area=math.pi * 0.4**2), 0.25)
    x, weights = np.polynomial.legendre.leggauss(4)
    cone = np.zeros(3)
    for r, weight in zip(0.5 + 0.1 * x, 0.1 * weights, strict=True):  # from 0.4 to 0.6 over a height of 0.1
        slice_ = hull.cone(wet._replace(radius=ufl.as_ufl(r), area=math.pi * r**2), 2.0)
        cone += weight / 2.0 * np.array([value(part) for part in slice_])
    together = [value(a) + value(b) + c for a, b, c in zip(inner, step, cone, strict=True)]
    assert together == pytest.approx([value(part) for part in disc], rel=1e-12)
    assert value(disc.inertia) == pytest.approx(8 / 45 * RADIUS**5, rel=1e-14)


def water(eta=None, slope=None, acceleration=None):
    """Still water, or a plane surface with a uniform acceleration."""
    return Flow(eta, None, acceleration, slope, None)


@pytest.mark.parametrize("eta", [None, 0.25, 9.0])
@pytest.mark.parametrize("degrees", [10, 60, 90, 130, 175])
def test_wet_segment(degrees, eta):
    """Area and first moment of the part of a tilted disk below the water, by quadrature over its chords."""
    tilt, radius, depth = math.radians(degrees), 0.9, 0.1
    d = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    x = vector(0.3, -0.2, (eta or 0.0) - depth)
    area, moment = hull.wet_section(ufl.as_ufl(radius), vector(*d), x, water(eta and ufl.as_ufl(eta)), hull.LEAST_TILT)
    level = max(min(depth / math.sin(tilt), radius), -radius)  # along the disk, from its centre uphill
    chord = lambda x: 2 * math.sqrt(radius**2 - x**2)  # noqa: E731
    uphill = np.array([-math.cos(tilt), 0.0, math.sin(tilt)])
    assert value(area) == pytest.approx(quad(chord, -radius, level, epsabs=1e-12)[0], rel=1e-9)
    first = quad(lambda x: x * chord(x), -radius, level, epsabs=1e-12)[0]
    assert value(moment) == pytest.approx(first * uphill, abs=1e-8)


def test_tilted_tank():
    """A tank that is accelerated has a tilted surface and gravity across it: the loads of still water, turned.

    a_w = (-g tan a, 0, 0) and the slope tan a, at random radii, depths and poses.
    """
    draw, g = np.random.default_rng(5), 9.81
    for _ in range(12):
        tilt, heading = draw.uniform(-0.6, 0.6), draw.uniform(0, 2 * np.pi)
        across = np.array([-math.sin(heading), math.cos(heading), 0.0])  # the tank is turned about it by -tilt
        turned = Rotation.from_rotvec(-tilt * across)
        d, lever = Rotation.random(random_state=draw.integers(2**31)).apply([0, 0, 1]), draw.uniform(-1, 1) * 0.8
        radius = ufl.as_ufl(draw.uniform(0.2, 1.5))
        x = np.array([draw.uniform(-3, 3), draw.uniform(-3, 3), draw.uniform(-0.6, 0.6)])
        slope = math.tan(tilt) * np.array([math.cos(heading), math.sin(heading), 0.0])

        def load(d, x, flow, radius=radius, lever=lever):
            section = hull.wet_section(radius, vector(*d), vector(*x), flow, hull.LEAST_TILT)
            strip = hull.Strip(vector(*(lever * d)), vector(*d), radius, flow, *section)
            terms = [hull.buoyancy(vector(0, 0, -g), RHO, strip), hull.froude_krylov(None, RHO, strip)]
            density = terms[0] if terms[1] is None else terms[0] + terms[1]
            return np.concatenate([value(part) for part in hull.strip_load(strip, density)])

        still = load(d, x, water())
        there = turned.apply(x)
        tank = water(ufl.as_ufl(float(slope @ there)), vector(*slope), vector(*(-g * slope)))
        found = load(turned.apply(d), there, tank)
        expected = np.concatenate([turned.apply(still[:3]), turned.apply(still[3:])]) / math.cos(tilt)
        assert found == pytest.approx(expected, abs=1e-12 * RHO * g * np.pi * value(radius) ** 2 * 1.5)


def test_wave_damping():
    """Linear in heave and in the rotation across the axis, against the surface above C; nothing for a body that rides
    on it."""
    w = sea.Wave(0.4, 0.16, 1.25, 0.9, math.cos(0.5), math.sin(0.5), 500.0)
    turned, place = Rotation.from_rotvec([0.2, -0.1, 0.4]), np.array([1.2, 0.7, 0.2])
    d = turned.apply([0, 0, 1])
    q4 = vector(turned.as_quat()[3], *turned.as_quat()[:3])
    c = SimpleNamespace(heave=300.0, pitch=70.0)

    def load(motion, wave=None):
        state = buoy.Body(vector(*place), q4, lambda x: sea.flow(x, wave), motion)
        return [value(part) for part in buoy.wave_damping(c, state)]

    v, omega = (np.array(value(x)) for x in (MOTION.velocity, MOTION.angular_velocity))
    force, torque = load(MOTION)
    assert force == pytest.approx([0, 0, -300.0 * v[2]], rel=1e-12)
    assert torque == pytest.approx(-70.0 * split(omega, d)[0], rel=1e-12)
    h, eta = 1e-5, lambda x, phase: 0.4 * math.cos(0.16 * (math.cos(0.5) * x[0] + math.sin(0.5) * x[1]) + phase)
    rise = lambda x: (eta(x, 0.9 - 1.25 * h) - eta(x, 0.9 + 1.25 * h)) / (2 * h)  # noqa: E731
    tilting = [(rise(place + 0.01 * e) - rise(place - 0.01 * e)) / 0.02 for e in np.eye(3)[:2]]
    surface = np.array([tilting[1], -tilting[0], 0.0])  # the normal turns with -grad eta_t
    riding = MOTION._replace(velocity=vector(0, 0, rise(place)), angular_velocity=vector(*surface))
    force, torque = load(riding, w)
    assert np.abs(force).max() < 1e-5 * 300.0
    assert np.abs(torque).max() < 1e-5 * 70.0
    force, torque = load(MOTION, w)
    assert force[2] == pytest.approx(-300.0 * (v[2] - rise(place)), rel=1e-5)
    assert torque == pytest.approx(-70.0 * split(omega - surface, d)[0], rel=1e-5)
    assert buoy.wave_damping(c, buoy.Body(vector(*place), q4, lambda x: sea.flow(x), None)) == (None, None)


def test_parts_of_a_vector():
    """Perpendicular to a tangent and along it."""
    a = vector(*A)
    normal, along = morison.split(a, vector(*TANGENT))
    assert value(normal) == pytest.approx(split(A, TANGENT)[0])
    assert value(along) == pytest.approx(split(A, TANGENT)[1])


# -- what moves the top of a cable -------------------------------------------------------------------------------------


def test_place_of_a_driven_top():
    """position + ramp amplitude sin(2 pi t/T + phase)."""
    numbers = {
        "position": (12.0, 0.5, -3.5),
        "amplitude": (0.1, 0.2, 1.5),
        "period": 5.0,
        "phase_deg": 40.0,
        "ramp": 4.0,
    }
    top = Top(kind="prescribed", **numbers)
    for t, grown in ((1.0, 0.5 * (1 - math.cos(math.pi / 4))), (7.0, 1.0)):
        swing = grown * math.sin(2 * math.pi * t / 5 + math.radians(40))
        assert top_position(top, t) == pytest.approx(np.array([12.0, 0.5, -3.5]) + swing * np.array([0.1, 0.2, 1.5]))


def test_a_phase_for_each_component():
    """An end moving on an ellipse."""
    numbers = {"position": (12.0, 0.5, -3.5), "amplitude": (0.1, 0.2, 1.5), "period": 5.0}
    phases = (40.0, -20.0, 130.0)
    top = Top(kind="prescribed", phase_deg=phases, **numbers)
    for t in (0.0, 1.3, 4.1):
        swing = np.array([math.sin(2 * math.pi * t / 5 + math.radians(phase)) for phase in phases])
        expected = np.array([12.0, 0.5, -3.5]) + swing * np.array([0.1, 0.2, 1.5])
        assert top_position(top, t) == pytest.approx(expected, rel=1e-14)


def test_area_apart_from_the_diameter_of_the_drag():
    """A chain's displaced area differs from its drag circle; if not given, it is that circle."""
    cable = {"length": 9.0, "line_density": 60.0, "diameter": 0.1, "top": {"kind": "free"}}
    scene = load_scene({"sea": {"depth": 20.0, "density": RHO}, "cable": cable | {"area": 0.003}})
    assert cross_section(scene.network.pieces[0].section) == 0.003
    assert weight_per_length(scene, scene.network.pieces[0].section) == pytest.approx(
        (60.0 - RHO * 0.003) * 9.81, rel=1e-14
    )
    section = load_scene(scene, cable__area=None).network.pieces[0].section
    assert cross_section(section) == pytest.approx(math.pi * 0.01 / 4, rel=1e-14)


def test_a_free_buoy_is_held_where_it_started():
    """Work of the spring's force -k (x - x_0) on a displacement, in x and y only."""
    force, away = 30.0 * np.array([0.2, -0.5, 0.0]), (7.0, 11.0, 13.0)
    assert buoy.held_horizontally((1.2, 3.5, 9.0), (1.0, 4.0, 2.0), 30.0, away) == pytest.approx(force @ away)
