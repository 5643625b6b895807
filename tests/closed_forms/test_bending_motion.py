"""Lines with bending stiffness in motion: frequencies, limits, balances and invariants of a run.

Source: beams under tension (closed form, transcendental equations, Ritz's method), a rigid-rod pendulum, an articulated
column and sums of moments by hand; Lagrange's equations of rigid links with springs (support/rigid_links.py).
"""

import math

import numpy as np
import pytest
from dynamics_helpers import rotation_matrix
from mpi_helpers import needs_mpirun, start_scenes
from rigid_links import falling_rod

import dolfbuoy
from dolfbuoy import load_scene, modes, simulate, solve_static
from dolfbuoy.motion.energy import Meter
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.record import read

BEAM = {
    "length": 10.0,
    "line_density": 5.0,
    "bending_stiffness": 1e4,
    "anchor": [0.0, 0.0, 0.0],
    "elements": 8,
    "position_degree": 3,
    "tension_degree": 2,
}
ALONG = {"direction": [1.0, 0.0, 0.0]}
SCHEMES = {
    "backward-euler": {},
    "bdf2": {},
    "generalized-alpha": {"spectral_radius": 0.8},
}


def found(scene, expected, number=12):
    """Nearest frequency to each expected one."""
    omega = modes(scene, number).omega.values
    return [omega[np.abs(omega - one).argmin()] for one in expected]


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ({}, [6.26266931979, 19.765270717, 41.9008371512]),
        ({"from_end": ALONG, "to_end": ALONG}, [11.1613050885, 29.1995324372, 55.8681667318]),
    ],
)
def test_frequencies_of_a_taut_beam(ends, expected):
    """Stretched by 1 kN between its ends, pinned and clamped."""
    top = {"kind": "fixed", "position": [10.00001, 0.0, 0.0]}
    beam = BEAM | {"axial_stiffness": 1e9, "elements": 16, "top": top} | ends
    assert found({"gravity": 0.0, "cable": beam}, expected) == pytest.approx(expected, rel=1e-4)


def hanging(length, stiffness, density, clamped, count):
    """Angular frequencies of a beam that hangs in air from s = 0, clamped there or pinned, by Ritz's method:
    int EI w''^2 + T w'^2 ds = omega^2 int rho w^2 ds in polynomials with these conditions, T the weight below."""
    from numpy.polynomial import legendre
    from scipy.linalg import eigh

    x, weights = legendre.leggauss(60)
    z = np.polynomial.Polynomial([1.0, 1.0]) ** (2 if clamped else 1)
    basis = [z * np.polynomial.Polynomial(legendre.leg2poly([0.0] * k + [1.0])) for k in range(24)]
    w, slope, bent = (np.array([one.deriv(k)(x) if k else one(x) for one in basis]) for k in (0, 1, 2))
    half, tension = length / 2, density * 9.81 * length / 2 * (1 - x)
    stiff = (bent * weights) @ bent.T * stiffness / half**3 + (slope * weights * tension) @ slope.T / half
    return np.sqrt(eigh(stiff, (w * weights) @ w.T * density * half, eigvals_only=True)[:count])


@pytest.mark.parametrize("clamped", [True, False])
def test_frequencies_of_a_hanging_beam(clamped):
    """Under its own weight, clamped or pinned at the top, free at the bottom, equal in both directions."""
    down = {"from_end": {"direction": [0.0, 0.0, -1.0]}} if clamped else {}
    beam = BEAM | {"length": 50.0, "axial_stiffness": 1e10, "elements": 12, "top": {"kind": "free"}} | down
    expected = hanging(50.0, 1e4, 5.0, clamped, 4)
    assert found({"cable": beam}, expected) == pytest.approx(expected, rel=1e-5)


def test_frequencies_of_a_cantilever_with_a_mass():
    cable = BEAM | {"from_end": ALONG, "to": "mass"}
    scene = {"gravity": 0.0, "cable": cable, "joint": [{"name": "mass", "mass": 100.0}]}
    expected = [0.51796149269, 7.09320564133]
    assert found(scene, expected) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_cantilever_let_go(scheme):
    """From straight under a weak weight: the tip goes down to twice the deflection at rest and is back after a period,
    within what the second mode adds (2.7 %)."""
    period = 2 * math.pi / ((1.8751040687 / 10) ** 2 * math.sqrt(1e4 / 5.0))
    time = {"end": period, "step": period / (2000 if scheme == "backward-euler" else 200), "scheme": scheme}
    scene = {
        "gravity": 0.01,
        "cable": BEAM | {"from_end": ALONG, "top": {"kind": "free"}, "elements": 4},
        "initial": {"kind": "polyline", "points": [[0, 0, 0], [10, 0, 0]]},
        "time": time | SCHEMES[scheme],
    }
    run = simulate(scene)
    z, rest = run.cable_position.values[:, -1, 2], -0.01 * 5.0 * 1e4 / 8 / 1e4
    assert z.min() == pytest.approx(2 * rest, rel=0.03)
    assert run.frame.values[z.argmin()] == pytest.approx(period / 2, rel=0.03)
    assert z[-1] == pytest.approx(0.0, abs=0.03 * abs(rest))
    # at rest the moment at the root is that of the weight
    assert run.anchor_moment.values.max() == pytest.approx(2 * 0.01 * 5.0 * 100 / 2, rel=0.15)


def test_a_swinging_rod_carries_little_moment():
    """A stiff pinned rod is a pendulum: period by elliptic integrals, bent only by its inertia."""
    from scipy.special import ellipk

    angle = 0.5
    tip = [10 * math.sin(angle), 0.0, -10 * math.cos(angle)]
    cable = BEAM | {"bending_stiffness": 1e8, "top": {"kind": "free"}, "elements": 2}
    period = 4 * math.sqrt(2 * 10.0 / 3 / 9.81) * ellipk(math.sin(angle / 2) ** 2)
    time = {"end": period, "step": period / 400, "scheme": "bdf2", "output_every": period / 400}
    run = simulate({"cable": cable, "initial": {"kind": "polyline", "points": [[0, 0, 0], tip]}, "time": time})
    end = run.cable_position.values[:, -1]
    assert end[-1] == pytest.approx(tip, abs=5e-3)
    assert end[200, 0] == pytest.approx(-tip[0], abs=5e-3)
    # bending of a uniform rod in angular acceleration alpha and weight: largest w sin(angle) L^2/27 near 2 L/3
    m = np.linalg.norm(run.cable_moment.values, axis=-1)
    assert m[10].max() == pytest.approx(5 * 9.81 * math.sin(angle) * 100 / 27, rel=0.1)
    assert m[:, [0, -1]].max() == 0.0


@pytest.mark.slow
def test_a_rod_that_falls_far():
    """Released from horizontal its tip falls by half its length: 16 and 32 rigid links, extrapolated in h^2."""
    times = np.arange(0.0, 3.01, 0.05)
    coarse, fine = (falling_rod(10.0, 5.0, 2e4, 9.81, links, times) for links in (16, 32))
    expected = fine + (fine - coarse) / 3
    cable = BEAM | {"bending_stiffness": 2e4, "elements": 6, "from_end": ALONG, "top": {"kind": "free"}}
    scene = {"cable": cable, "initial": {"kind": "polyline", "points": [[0, 0, 0], [10, 0, 0]]}}
    for scheme, limit in (("generalized-alpha", 4e-3), ("bdf2", 8e-3)):
        time = {"end": 3.0, "step": 0.005, "scheme": scheme, "output_every": 0.05}
        run = simulate(scene | {"time": time | SCHEMES[scheme]})
        assert run.cable_position.values[:, -1, [0, 2]] == pytest.approx(expected, abs=limit)
    assert expected[:, 1].min() < -5.0


COLUMN = {
    "length": 20.0,
    "line_density": 30.0,
    "diameter": 0.2,
    "axial_stiffness": 1e8,
    "bending_stiffness": 1e6,
    "elements": 6,
    "position_degree": 2,
    "tension_degree": 1,
    "to_end": {"direction": [0.0, 0.0, 1.0]},
}
HULL = {"hull": [[0.0, 1.5], [4.0, 1.5]], "mass": 1500.0, "center_of_mass": 1.2, "added_mass": 1.0, "normal_drag": 1.0}
TOWER = {"sea": {"depth": 22.0}, "cable": COLUMN, "buoy": HULL}


def test_an_articulated_column_by_hand():
    """A stiff rod pinned at the bed, a buoy welded on top, rotates about its pin: static angle and period."""
    stiff = TOWER | {"cable": COLUMN | {"bending_stiffness": 1e12}}
    rest = solve_static(stiff | {"external_force": {"force": [50.0, 0.0, 0.0], "height": 3.0}})
    tilt, (x, z) = math.radians(rest.cone_angle.item()), rest.buoy_position.values[0][[0, 2]]
    assert math.atan2(x, z + 22.0) == pytest.approx(tilt, rel=1e-6)
    rho, g, area = 1025.0, 9.81, math.pi * 0.75**2
    draft = 1.2 - (solve_static(stiff).buoy_position.values[0, 2])  # of the hull's keel below still water
    mass_of_rod, length = 30.0 * 20.0, 20.0
    buoyancy_of_rod = rho * math.pi * 0.1**2 * length
    lever = 20.0
    hydrostatic = rho * g * area * (draft * (lever + draft / 2) + 0.75**2 / 4)  # with the waterplane's own stiffness
    stiffness = hydrostatic + g * (buoyancy_of_rod - mass_of_rod) * length / 2 - 1500.0 * g * 21.2
    assert stiffness * tilt == pytest.approx(50.0 * 23.0, rel=2e-3)
    solid = 1500.0 * (3 * 0.75**2 + 4.0**2) / 12 + 1500.0 * (2.0 - 1.2) ** 2
    calm = stiff | {"buoy": HULL | {"added_mass": 0.0, "normal_drag": 0.0, "inertia": [solid, 1000.0]}}
    inertia = mass_of_rod * length**2 / 3 + solid + 1500.0 * 21.2**2
    expected = math.sqrt(stiffness / inertia)
    assert found(calm, [expected])[0] == pytest.approx(expected, rel=2e-3)


HANGING_ROD = BEAM | {"line_density": 30.0, "axial_stiffness": 1e8, "elements": 6, "to": "buoy.top"}
HANGING_ROD |= {f"{end}_end": {"direction": [0.0, 0.0, -1.0]} for end in ("from", "to")}
SPAR = {"hull": [[0.0, 0.5], [2.0, 0.5]], "mass": 400.0, "center_of_mass": 0.8, "inertia": [200.0, 60.0]}
SPAR |= {"fairleads": {"top": [0.0, 0.0, 2.0]}}


@pytest.mark.parametrize("degree", [2, *(pytest.param(degree, marks=pytest.mark.slow) for degree in (1, 3, 4))])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_balance_of_moments_in_motion(scheme, degree):
    """Of a rod between a clamp and a body that swings and spins, about the clamp: to Newton's tolerance, whatever the
    elements and the scheme, with the rates that the scheme makes."""
    start = {"buoy_angular_velocity": [0.3, 0.6, 0.2], "buoy_velocity": [0.0, 0.3, 0.0]}
    rod = HANGING_ROD | {"position_degree": degree, "tension_degree": degree - 1}
    time = {"end": 1.0, "step": 0.02, "scheme": scheme} | SCHEMES[scheme]
    simulation = Simulation(load_scene({"cable": rod, "buoy": SPAR, "initial": start, "time": time}))
    for _ in range(20):
        simulation.step(0.02)
    u, lines, buoy = simulation.system.u, simulation.problem.lines, simulation.problem.buoy
    g, order = np.array([0.0, 0.0, -9.81]), np.argsort(lines.node_s)
    (_, (gamma, history)), nodes = lines.evolutions()[0].rates, lines.node_dofs[order]
    acceleration = (gamma.value * u[lines.part.slice] + history.x.array)[nodes]
    line = 30.0 * moment_of(degree, lines.node_s[order], u[nodes], g - acceleration)
    ((gamma, history),), y = buoy.evolutions()[0].rates, u[buoy.part.slice]
    place, _, quaternion, L = np.split(y, [3, 6, 10])
    _, p_t, _, L_t = np.split(gamma.value * y + history.x.array, [3, 6, 10])
    # the scheme follows the spin about the axis itself
    (gamma, history), R = buoy.spin.rates[0], rotation_matrix(quaternion)
    axis, omega = R[:, 2], R @ (R.T @ L / [200.0, 200.0, 60.0])
    spin = gamma.value * (L @ axis) + history.value - L_t @ axis - L @ np.cross(omega, axis)
    root = np.cross([0.0, 0.0, -1.0], u[lines.end_moments(0, 0)])
    total = line - np.cross(place, p_t - 400.0 * g) - L_t - spin * axis - root
    assert np.abs(total).max() < 1e-12 * np.linalg.norm(line)
    assert np.linalg.norm(L_t) > 0.01 * np.linalg.norm(line)
    assert np.linalg.norm(u[lines.end_moments(0, 1)]) > 0.01 * np.linalg.norm(line)


def moment_of(degree, s, r, force):
    """int r x force ds of nodal values, exact for elements of this degree that are equally long."""
    h = s[degree] - s[0]
    x, weights = np.polynomial.legendre.leggauss(6)
    own = s[: degree + 1] / h
    basis = np.array([[np.prod([((x + 1) / 2 - b) / (a - b) for b in own if b != a]) for a in own] for x in x])
    cells = np.arange(0, len(s) - 1, degree)[:, None] + np.arange(degree + 1)
    at = (np.einsum("qn,cnx->cqx", basis, values[cells]) for values in (r, force))
    return h / 2 * np.einsum("q,cqx->x", weights, np.cross(*at))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_end_turns_with_the_buoy(scheme):
    """The line keeps the direction of the buoy's axis in waves."""
    waves = {"amplitude": 0.3, "period": 6.0, "ramp": 2.0}
    time = {"end": 4.0, "step": 0.02, "scheme": scheme, "output_every": 0.02}
    bare = {key: HULL[key] for key in ("hull", "mass", "center_of_mass")}
    run = simulate(
        {"sea": {"depth": 22.0}, "cable": COLUMN, "buoy": bare, "waves": waves, "time": time | SCHEMES[scheme]}
    )
    assert run.end_moment.values.max() > 50.0
    ends = run.cable_position.values[:, -3:]
    way = 3 * ends[:, 2] - 4 * ends[:, 1] + ends[:, 0]  # derivative of the parabola at its end
    q = run.buoy_orientation.values[:, 0]
    axis = np.column_stack(
        [
            2 * (q[:, 1] * q[:, 3] + q[:, 0] * q[:, 2]),
            2 * (q[:, 2] * q[:, 3] - q[:, 0] * q[:, 1]),
            1 - 2 * (q[:, 1] ** 2 + q[:, 2] ** 2),
        ]
    )
    sine = np.linalg.norm(np.cross(way, axis), axis=1) / np.linalg.norm(way, axis=1)
    bend = run.end_moment.values[:, 0] / 1e6 * 20.0 / 6
    assert sine.max() < 0.2 * bend.max() + 1e-6


@pytest.mark.parametrize(
    "degree", [pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow), 3]
)
def test_damping_ratios(degree):
    """m = EI (t' + beta t'_t) is proportional to the stiffness: beta omega/2 in every mode of a cantilever."""
    cable = BEAM | {"from_end": ALONG, "top": {"kind": "free"}, "position_degree": degree, "tension_degree": degree - 1}
    found = modes({"gravity": 0.0, "cable": cable | {"bending_damping": 0.02}}, 6)
    assert found.damping_ratio.values == pytest.approx(0.01 * found.omega.values, rel=1e-6)


@pytest.mark.parametrize("spring", [None, 1e5])
@pytest.mark.parametrize("held", ["turned", "vessel"])
def test_rigid_rotation_is_not_damped(held, spring):
    """A light rod follows a steadily rotating end without the lag beta, and without moment."""
    angles = 0.2 * np.arange(8)
    rows = [[t, math.cos(a), 0.0, math.sin(a)] for t, a in enumerate(angles)]
    end = {"motion": rows} if held == "turned" else ALONG
    end |= {} if spring is None else {"rotational_stiffness": spring}
    rod = BEAM | {"elements": 3, "line_density": 0.1, "bending_damping": 0.5, "top": {"kind": "free"}, "from_end": end}
    scene = {"gravity": 0.0, "initial": {"kind": "polyline", "points": [[0, 0, 0], [10, 0, 0]]}}
    if held == "vessel":
        vessel = {"name": "ship", "position": [0.0, 0.0, 0.0], "fairleads": {"bow": [0.0, 0.0, 0.0]}}
        vessel["motion"] = [[t, 0, 0, 0, 0, -math.degrees(a), 0] for t, a in enumerate(angles)]
        scene["vessel"] = [vessel]
        rod = {key: value for key, value in rod.items() if key != "anchor"} | {"from": "ship.bow"}
    run = simulate(scene | {"cable": rod, "time": {"end": 4.0, "step": 0.02, "scheme": "bdf2"}})
    x, _, z = run.cable_position.values[-1, -1]
    assert math.atan2(z, x) == pytest.approx(0.8, abs=2e-3)
    assert run.anchor_moment.values[-1] < 1e-3 * 1e4 * 0.5 * 0.2  # EI beta times the rate, over a metre


@pytest.mark.slow
def test_damping_of_a_column_with_a_buoy():
    """A nearly rigid rod rotates about its pin with the buoy: bending damping does not affect this."""
    time = {"end": 6.0, "step": 0.02, "scheme": "bdf2"}
    calm = {"sea": {"depth": 22.0}, "buoy": {key: HULL[key] for key in ("hull", "mass", "center_of_mass")}}
    moved = calm | {"time": time, "waves": {"amplitude": 0.5, "period": 6.0, "ramp": 2.0}}
    column = COLUMN | {"bending_stiffness": 1e9}
    runs = [simulate(moved | {"cable": column | {"bending_damping": beta}}) for beta in (0.0, 1.0)]
    plain, damped = (np.interp(np.arange(0.0, 6.0, 0.1), run.time, run.buoy_position.values[:, 0, 0]) for run in runs)
    assert np.ptp(plain) > 0.2
    assert damped == pytest.approx(plain, abs=0.01 * np.ptp(plain))


def test_energy_that_damping_takes():
    """The energy lost by a falling cantilever is that dissipated in the material, more closely with more elements."""
    cable = BEAM | {"bending_stiffness": 1e3, "bending_damping": 0.05, "from_end": ALONG, "top": {"kind": "free"}}
    scene = {"cable": cable, "initial": {"kind": "polyline", "points": [[0, 0, 0], [10, 0, 0]]}}
    defects = []
    for elements in (8, 16):
        cable["elements"] = elements
        simulation = Simulation(load_scene(scene, time={"end": 3.0, "step": 0.01, "scheme": "bdf2"}))
        meter = Meter(simulation)
        before = now = meter.read()
        taken = turnover = 0.0
        while simulation.t < 3.0 - 1e-9:
            simulation.step(0.01)
            last, now = now, meter.read()
            taken += 0.005 * (now["damping"] + last["damping"])
            turnover = max(turnover, now["kinetic"])
        defects.append(abs(sum(now[name] - before[name] for name in ("kinetic", "elastic", "gravity")) - taken))
        assert -taken > 0.1 * turnover
    assert defects[1] < 0.5 * defects[0] < 0.005 * turnover


@pytest.mark.parametrize(("degree", "elements"), [(3, 8), (2, 3)])
def test_energy(degree, elements):
    """Of a rod on a spring at its root that falls: the balance closes with the order of the scheme, on few elements of
    degree 2 with what they blend."""
    pair = {"elements": elements, "position_degree": degree, "tension_degree": degree - 1}
    cable = (
        BEAM
        | pair
        | {
            "bending_stiffness": 1e3,
            "from_end": ALONG | {"rotational_stiffness": 3e3},
            "top": {"kind": "free"},
        }
    )
    scene = {"cable": cable, "initial": {"kind": "polyline", "points": [[0, 0, 0], [10, 0, 0]]}}
    defects = []
    for step in (0.02, 0.01):
        simulation = Simulation(load_scene(scene, time={"end": 3.0, "step": step, "scheme": "bdf2"}))
        meter = Meter(simulation)
        before, turnover = meter.read(), 0.0
        while simulation.t < 3.0 - 1e-9:
            simulation.step(step)
            now = meter.read()
            turnover = max(turnover, now["kinetic"])
        defects.append(abs(sum(now[name] - before[name] for name in ("kinetic", "elastic", "gravity"))) / turnover)
    assert defects[0] < 3e-3
    assert defects[1] < 0.35 * defects[0]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "end"), [("long", 6.0), ("driven", 10.0), ("lazy-wave", 10.0)])
def test_matrices_are_kept_where_lines_bend(name, end):
    """New matrices and iterations of a step, by which a step with bending is less than 2.2 times as dear as one without
    (benchmarks/stiff_lines.py): no more matrices than without, half as many iterations again at most, whatever EI."""
    cost = {}
    for EI in (0.0, 1e-6, 1e2, 1e4, 1e6):
        cable = {"bending_stiffness": EI, "slack": "compressive"}
        simulation = Simulation(load_scene(name, cable=cable, time={"end": end}))
        steps = sum(1 for _ in simulation.run())
        cost[EI] = simulation.newton.numbers.jacobians_total / steps, simulation.iterations / steps
    assert max(cost[EI][0] for EI in (1e2, 1e4)) < 1.05 * cost[0.0][0]
    assert max(iterations for _, iterations in cost.values()) < 1.5 * cost[0.0][1]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_welded_pieces_move_as_one(scheme):
    """Segments without a kink, and two cables welded at a joint, beside the whole line in a swing."""
    whole = BEAM | {"bending_stiffness": 2e3, "from_end": ALONG, "top": {"kind": "free"}}
    cut = {key: value for key, value in whole.items() if key not in ("length", "elements")}
    sizes = [{"length": 2.5, "elements": 2}, {"length": 7.5, "elements": 6}]
    low = {key: value for key, value in cut.items() if key != "top"} | {"name": "low", "to": "weld"} | sizes[0]
    high = {key: value for key, value in cut.items() if key not in ("anchor", "from_end")}
    both = [low, high | {"name": "high", "from": "weld"} | sizes[1]]
    lines = (
        {"cable": whole},
        {"cable": cut | {"segments": sizes}},
        {"cable": both, "joint": [{"name": "weld", "weld": True}]},
    )
    points = (
        [[0, 0, 0], [10, 0, 0]],
        [[0, 0, 0], [10, 0, 0]],
        {"low": [[0, 0, 0], [2.5, 0, 0]], "high": [[2.5, 0, 0], [10, 0, 0]]},
    )
    time = {"end": 0.5, "step": 0.02, "scheme": scheme} | SCHEMES[scheme]
    ends = []
    for line, line_points in zip(lines, points, strict=True):
        run = simulate(line | {"initial": {"kind": "polyline", "points": line_points}, "time": time})
        ends.append([*run.cable_position.values[-1, -1], run.anchor_moment.values[-1].max()])
    assert ends[0][2] < -0.5
    for other in ends[1:]:
        assert other == pytest.approx(ends[0], rel=1e-7, abs=1e-7)


# -- what a run keeps --------------------------------------------------------------------------------------------------

MIXED = {
    "sea": {"depth": 22.0},
    "waves": {"amplitude": 0.5, "period": 5.0},
    "buoy": HULL | {"fairleads": {"side": [0.75, 0.0, 1.0]}},
    "cable": [
        COLUMN | {"name": "column", "to": "buoy"},
        {
            "name": "chain",
            "length": 45.0,
            "line_density": 8.0,
            "diameter": 0.03,
            "axial_stiffness": 1e7,
            "elements": 12,
            "from": [40.0, 0.0, -22.0],
            "to": "buoy.side",
            "normal_drag": 1.2,
        },
    ],
    "time": {"end": 0.6, "step": 0.05, "scheme": "bdf2"},
}


@pytest.mark.slow
@needs_mpirun
def test_two_ranks(tmp_path):
    done = start_scenes(2, {"mixed": MIXED}, tmp_path)
    assert done.returncode == 0, done.stderr
    together, alone = read(tmp_path / "mixed" / "results.nc"), dolfbuoy.simulate(MIXED)
    for name in ("buoy_position", "tension_top", "end_moment", "largest_curvature"):
        size = np.abs(alone[name].values).max()
        assert np.abs(together[name].values - alone[name].values).max() < 1e-8 * size, name


def test_bars_beside_a_line_that_never_bends():
    """Its radius is infinite and no output, and takes nothing from others' bars; nothing warns."""
    run = simulate(MIXED, accuracy={}, time={"end": 1.0, "step": 0.01, "scheme": "backward-euler"})
    outputs = zip(run.output_of.values, run.output.values, strict=True)
    assert np.isinf(run.min_bend_radius.sel(cable="chain")).all()
    assert {of for of, output in outputs if "radius" in output} == {"column"}
    assert "cannot be followed" not in run.attrs["bar_says"]
    assert "resolved" in run.bar_verdict.values


def test_an_end_that_is_turned():
    """Slowly from along x to 60 degrees and held: the curve at rest of that direction, with a direction in time or on a
    vessel that pitches."""
    cable = BEAM | {"elements": 6, "position_degree": 2, "tension_degree": 1}
    cable |= {"top": {"kind": "free"}}
    angles = np.linspace(0.0, 60.0, 7)
    rows = [
        [t, math.cos(math.radians(a)), 0.0, math.sin(math.radians(a))] for t, a in zip(range(7), angles, strict=True)
    ]
    time = {"end": 60.0, "step": 0.2, "scheme": "backward-euler"}
    own = {"gravity": 1.0, "cable": cable | {"from_end": {"motion": rows}}, "time": time}
    vessel = {"name": "ship", "position": [0.0, 0.0, 0.0], "fairleads": {"bow": [0.0, 0.0, 0.0]}}
    vessel["motion"] = [[t, 0.0, 0.0, 0.0, 0.0, -a, 0.0] for t, a in zip(range(7), angles, strict=True)]
    free = {key: value for key, value in cable.items() if key not in ("anchor",)} | {
        "from": "ship.bow",
        "from_end": ALONG,
    }
    pitched = {"gravity": 1.0, "vessel": [vessel], "cable": free, "time": time}
    ended = {"direction": rows[-1][1:]}
    rest = solve_static({"gravity": 1.0, "cable": cable | {"from_end": ended}})
    for scene in (own, pitched):
        run = simulate(scene)
        assert run.cable_position.values[0, 1] == pytest.approx([run.cable_position.values[0, 1, 0], 0, 0], abs=0.02)
        assert run.cable_position.values[-1, -1] == pytest.approx(rest.cable_position.values[-1], abs=0.05)
        assert run.anchor_moment.values[-1] == pytest.approx(rest.anchor_moment.item(), rel=0.05)
