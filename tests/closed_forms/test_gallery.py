"""The scenes users start from, each against a value obtained without the program.

Source: catenaries and elastic lines in closed form, one-dimensional balances, initial value problems solved with scipy.
"""

import math
from itertools import pairwise

import alone
import numpy as np
import pytest
from scipy.integrate import solve_bvp, solve_ivp, trapezoid
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import dolfbuoy
from dolfbuoy.scene import load_scene

RHO, G = 1025.0, 9.81


def volume(hull, draft):
    """Volume of a body of revolution below its water line [m^3], by cones."""
    found = 0.0
    for (low, a), (high, b) in pairwise(hull):
        top = min(high, draft)
        if top <= low:
            continue
        c = a + (b - a) * (top - low) / (high - low)
        found += math.pi / 12 * (top - low) * (a * a + a * c + c * c)
    return found


def test_navigation_buoys_chain_is_an_elastic_catenary():
    """Pushed by 2 kN in still water, without friction: H at the touchdown, V = w s, z = (T - H)/w + V^2/(2 w EA)."""
    H, c = 2000.0, load_scene("navigation-buoy").network.pieces[0].section
    found = alone.solve_static(
        load_scene(
            "navigation-buoy",
            current=None,
            waves=None,
            seabed__start="frictionless",
            seabed__friction=0.0,
            external_force={"force": [H, 0.0, 0.0]},
            cable__elements=288,
        )
    )
    w = (c.line_density - RHO * c.area) * G
    height = 12.0 + float(found.mooring_point[2])
    T = brentq(lambda T: (T - H) / w + (T * T - H * H) / (2 * w * c.axial_stiffness) - height, H, 1e5)
    assert float(found.tension_top) == pytest.approx(T, rel=2e-4)
    assert float(found.anchor_force[0]) == pytest.approx(-H, rel=1e-3)


def test_wave_riders_cord_in_still_water():
    """The draft at which the buoy's buoyancy stretches rope and rubber over the depth."""
    scene = load_scene("wave-rider", current=None, waves=None)
    rope, rubber = (scene.material[name] for name in ("rope", "rubber"))
    strains, tensions = np.array(rubber.axial_stiffness.rows).T
    w_rope, w_rubber = (G * (m.line_density - RHO * math.pi / 4 * m.diameter**2) for m in (rope, rubber))

    def gap(draft):
        """Length of the stretched line minus the water depth below the keel."""
        pull = G * (RHO * volume(scene.buoy[0].hull, draft) - scene.buoy[0].mass)
        s = np.linspace(0.0, 10.0, 2001)
        drawn = trapezoid(1 + np.interp(pull - w_rubber * s, tensions, strains), s)
        middle = pull - 10.0 * w_rubber - 12.0 * w_rope
        return drawn + 24.0 * (1 + middle / rope.axial_stiffness) - (40.0 - draft)

    draft = brentq(gap, 0.4, 0.89)
    found = alone.solve_static(scene)
    assert float(found.submerged_length) == pytest.approx(draft, abs=1e-4)
    pull = G * (RHO * volume(scene.buoy[0].hull, draft) - scene.buoy[0].mass)
    assert float(found.tension_top) == pytest.approx(pull, rel=2e-3)


def test_spars_heave_is_that_of_a_spring():
    """T = 2 pi sqrt((M + m_a + m/3)/(rho g A + EA/L)), m_a: half spheres of water at keel and shoulder."""
    scene = load_scene("spar", waves=None)
    b, c = scene.buoy[0], scene.network.pieces[0].section
    faces = 2 / 3 * math.pi * RHO * (0.6**3 + (0.6**3 - 0.25**3)) * b.axial_added_mass
    mass = b.mass + faces + c.line_density * c.length / 3
    stiffness = RHO * G * math.pi / 4 * 0.5**2 + c.axial_stiffness / c.length
    modes = alone.modes(scene, 12)
    heave = float(modes.period[modes.name == "heave"][0])
    assert heave == pytest.approx(2 * math.pi * math.sqrt(mass / stiffness), rel=5e-3)


@pytest.mark.slow
def test_disc_buoy_follows_the_surface():
    """Heave and local elevation have equal standard deviations: the waves are 20 times its radius."""
    found = alone.simulate("disc-buoy", time__end=100.0)
    late = found.sel(time=slice(10.0, None))
    heave, water = float(late.buoy_position[:, 2].std()), float(late.surface_elevation.std())
    assert heave == pytest.approx(water, rel=0.03)


def flow_line(top_force, pieces, velocity, start):
    """Shape and tension of a line from one end on, in a steady flow: dT/ds = -(weight + drag), dr/ds = t (1 + e).

    pieces: (length, weight [N/m], diameter, C_n, C_t, EA).  velocity: of the water, as a function of z [m/s].
    Returns (r, T) at the other end; forces act in the plane x, z.
    """
    state = np.concatenate([start, top_force])
    for length, w, d, C_n, C_t, EA in pieces:

        def slope(s, y, w=w, d=d, C_n=C_n, C_t=C_t, EA=EA):
            T = math.hypot(y[2], y[3])
            t, stretch = y[2:] / T, 1 + T / EA
            u = np.array([velocity(y[1]), 0.0])
            along = (u @ t) * t
            across = u - along
            drag = 0.5 * RHO * d * stretch * (C_n * math.hypot(*across) * across + C_t * math.hypot(*along) * along)
            load = drag + [0.0, -w]
            return np.concatenate([-t * stretch, load])

        state = solve_ivp(slope, (0.0, length), state, rtol=1e-9, atol=1e-9).y[:, -1]
    return state[:2], math.hypot(*state[2:])


def test_subsurface_float_hangs_as_an_initial_value_problem_says():
    scene = load_scene("subsurface-float", waves=None, cable__line__elements=240)
    c, body = scene.cable[0], scene.joint[0]
    speed = lambda z: 0.8 * max(1 + z / 120.0, 0.0) ** (1 / 7)  # noqa: E731
    found = alone.solve_static(scene)
    x, _, z = found.joint_position.sel(joint="float").values
    drag = 0.5 * RHO * body.drag_area * speed(z) ** 2
    lift = G * (RHO * body.volume - body.mass)
    w = G * (c.line_density - RHO * math.pi / 4 * c.diameter**2)
    line = (c.length, w, c.diameter, c.normal_drag, c.tangential_drag, c.axial_stiffness)
    foot, tension = flow_line(np.array([drag, lift]), [line], speed, np.array([x, z]))
    assert foot == pytest.approx([0.0, -120.0], abs=0.02)
    assert float(found.tension_anchor) == pytest.approx(tension, rel=1e-3)


def test_towed_array_settles_to_its_steady_shape():
    scene = load_scene("towed-array")
    found = alone.simulate(scene)
    body, lines = scene.joint[0], []
    for segment in scene.cable[0].segments:
        m = scene.material[segment.material]
        w = G * (m.line_density - RHO * math.pi / 4 * m.diameter**2)
        lines.append((segment.length, w, m.diameter, m.normal_drag, m.tangential_drag, m.axial_stiffness))
    drag, lift = 0.5 * RHO * body.drag_area * 2.5**2, G * (RHO * body.volume - body.mass)
    tail, _, depth = found.joint_position.sel(joint="drogue").values[-1]
    end, tension = flow_line(np.array([-drag, lift]), lines, lambda z: -2.5, np.array([tail, depth]))
    assert end == pytest.approx([2.5 * (120.0 - 10.0), 0.0], abs=0.3)
    assert float(found.tension_top[-1]) == pytest.approx(tension, rel=5e-3)


def test_power_cable_is_an_elastica_on_springs():
    """In still water without friction: Kirchhoff's equations in the plane, collocated by scipy from the shape found."""
    scene = load_scene("power-cable", current=None, waves=None, seabed__friction=0.0)
    found = alone.solve_static(scene)
    sections = [piece.section for piece in scene.network.pieces]
    ends = np.cumsum([0.0, *(c.length for c in sections)])
    EI = np.array([c.bending_stiffness for c in sections])
    w = np.array([G * (c.line_density - RHO * (c.area or math.pi / 4 * c.diameter**2)) for c in sections])
    k = np.array([1e5 * c.diameter for c in sections])
    x, _, z = found.cable_position.values.T
    s, (n, top) = found.s.values, (len(sections), scene.network.pieces[-1].ends[1])
    angle = math.atan2(top.clamp.direction[2], top.clamp.direction[0])

    # all pieces at once, each over 0 ... 1: (x, z, theta, M, V) of the first, of the second, ...; H is the parameter
    def slopes(xi, y, p):
        rates = []
        for i in range(n):
            _, height, theta, M, V = y[5 * i : 5 * i + 5]
            bed = k[i] * np.maximum(-60.0 - height, 0.0)
            rates += [np.cos(theta), np.sin(theta), M / EI[i], p[0] * np.sin(theta) - V * np.cos(theta), w[i] - bed]
        return np.array(rates) * np.repeat(np.diff(ends), 5)[:, None]

    def gaps(low, high, p):
        joined = np.concatenate([high[5 * i : 5 * i + 5] - low[5 * i + 5 : 5 * i + 10] for i in range(n - 1)])
        at_ends = [low[0], low[1] + 60.0, low[3], high[-5] - 92.0, high[-4] + 5.0, high[-3] - angle]
        return np.concatenate([at_ends, joined])

    xi = np.linspace(0.0, 1.0, 101)
    H = float(found.end_tension[0])
    theta = np.unwrap(np.arctan2(np.gradient(z, s), np.gradient(x, s)))
    M = -found.cable_moment.values[:, 0] * np.sin(theta) + found.cable_moment.values[:, 2] * np.cos(theta)
    above = np.append(np.cumsum((w * np.diff(ends))[::-1])[::-1], 0.0)  # weight of what is above
    V = float(found.end_tension[2]) - np.interp(s, ends, above)
    guess = [np.interp(a + (b - a) * xi, s, values) for a, b in pairwise(ends) for values in (x, z, theta, M, V)]
    solved = solve_bvp(slopes, gaps, xi, np.array(guess), [H], tol=1e-4)
    assert solved.success, solved.message
    assert pytest.approx(solved.p[0], rel=1e-3) == H
    assert float(found.end_moment) == pytest.approx(abs(solved.y[-2, -1]), rel=2e-3)
    # sharpest at the touchdown, at the hog, and below the stiffener
    bends = [np.abs(solved.y[5 * i + 3]).max() / EI[i] for i in range(n)]
    mine = [found.curvature.values[(s >= a + 1e-6) & (s <= b - 1e-6)].max() for a, b in pairwise(ends)]
    assert mine[:3] == pytest.approx(bends[:3], rel=5e-3)
    assert float(found.min_bend_radius) == pytest.approx(1 / max(bends), rel=5e-3)


def test_hose_between_buoys_is_an_elastica():
    """In still water: Kirchhoff's equations between the ends and directions that the buoys have; alike at both ends."""
    scene = load_scene("hose", current=None, waves=None)
    found = alone.solve_static(scene)
    c, hose = next(p.section for p in scene.network.pieces if p.section.bending_stiffness), found.cable_of_node == 2
    w, EI = G * (c.line_density - RHO * math.pi / 4 * c.diameter**2), c.bending_stiffness
    x, _, z = found.cable_position.values[hose].T
    s, one = found.s.values[hose], found.sel(cable="hose")
    angles = []
    for buoy, own in zip(found.buoy_orientation.values, ([0.6, 0.0, -0.8], [0.6, 0.0, 0.8]), strict=True):
        way = Rotation.from_quat(np.roll(buoy, -1)).apply(own)
        angles.append(math.atan2(way[2], way[0]))

    def slopes(s, y, p):
        cosine, sine = np.cos(y[2]), np.sin(y[2])
        stretch = 1 + (p[0] * cosine + y[4] * sine) / c.axial_stiffness
        shear = p[0] * sine - y[4] * cosine
        return np.array([stretch * cosine, stretch * sine, y[3] / EI, stretch * shear, w + 0 * s])

    def gaps(low, high, p):
        ends = [low[0] - x[0], low[1] - z[0], low[2] - angles[0]]
        return np.array([*ends, high[0] - x[-1], high[1] - z[-1], high[2] - angles[1]])

    H = float(one.end_tension[0])
    theta = np.arctan2(np.gradient(z, s), np.gradient(x, s))
    guess = np.array([x, z, theta, EI * np.gradient(theta, s), w * (s - s[-1] / 2)])
    solved = solve_bvp(slopes, gaps, s, guess, [H], tol=1e-6)
    assert solved.success, solved.message
    assert pytest.approx(solved.p[0], rel=1e-3) == H
    moments = [float(one.anchor_moment), float(one.end_moment)]
    assert moments == pytest.approx(np.abs(solved.y[3, [0, -1]]), rel=5e-3)
    assert moments[0] == pytest.approx(moments[1], rel=1e-6)
    assert float(one.min_bend_radius) == pytest.approx(EI / moments[0], rel=1e-9)


def test_articulated_column_turns_about_its_hinge():
    """Without waves and added mass: restoring moment of hull, waterplane and rod over the inertia about the pin."""
    none = {"cable__added_mass": 0.0, "buoy__added_mass": 0.0, "cable__normal_drag": 0.0, "buoy__normal_drag": 0.0}
    scene = load_scene("articulated-column", waves=None, **none)
    c, buoy = scene.network.pieces[0].section, scene.network.buoys["buoy"]
    L, m, radius, height, lever = c.length, buoy.mass, 0.75, 4.0, c.length + buoy.center_of_mass
    draft, area = scene.sea.depth - L, math.pi * radius**2
    hull = RHO * G * area * (draft * (L + draft / 2) + radius**2 / 4)
    rod = G * (RHO * math.pi * c.diameter**2 / 4 - c.line_density) * L**2 / 2
    inertia = c.line_density * L**3 / 3 + m * lever**2
    inertia += m * (3 * radius**2 + height**2) / 12 + m * (height / 2 - buoy.center_of_mass) ** 2
    expected = math.sqrt((hull + rod - m * G * lever) / inertia)
    omega = dolfbuoy.modes(scene, 8).omega.values
    assert omega[np.abs(omega - expected).argmin()] == pytest.approx(expected, rel=2e-3)


@pytest.mark.slow
def test_calm_buoys_heave_is_that_of_the_file():
    """X = F/(C - omega^2 (M + A) - i omega B) of the file's rows, with the springs of the lines, at 7 and 10 s."""
    from dolfbuoy.linear.seaway import responses

    scene = load_scene("calm-buoy", current=None, waves=None)
    buoy, flow = scene.buoys[0], scene.buoys[0].potential_flow
    C = RHO * G * math.pi * 6.0**2 + 3 * 4e6 / 143.0 * (38.0 / 143.0) ** 2
    for found in responses(scene, [7.0, 10.0]):
        w = 2 * math.pi / found.period
        A, B = (np.interp(w, flow.omega, [row[1] for row in rows]) for rows in (flow.added_mass, flow.damping))
        F = complex(*(np.interp(w, flow.omega, [row[k] for row in flow.excitation]) for k in (2, 3)))
        expected = F / (C - w**2 * (buoy.mass + A) - 1j * w * B)
        assert abs(found.motions.heave - expected) < 0.015 * abs(expected)
