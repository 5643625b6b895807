"""Time schemes: orders in r, v and T, and numerical damping.

Source: rods with scipy, a rotating cable in closed form, Richardson extrapolation, amplification factors by hand.
"""

import math

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged, rates, running
from in_numpy import accept, rule
from rods import SCHEMES, state, two_rods

from dolfbuoy.motion.schemes import BDF2, BackwardEuler, GeneralizedAlpha, Predictor, Series, make_scheme

#: Two inextensible rods of 0.5 m and 1 kg/m, released at 45 and 0 degrees; state at t = 0.5 s, scipy to 1e-10.
RODS_AT_HALF = {
    "nodes": [[0.0, 0.0], [-0.1526988487875112, -0.47611244636006816], [-0.1265681542799077, -0.9754291662929684]],
    "tip_velocity": [-3.4300832494051368, -0.3631663634180436],
    "T": [12.56145743837105, 6.347866332058868],
}


def at_end(scene, end, observe=state):
    """What `observe` sees of a scene after equal steps to `end`."""
    with running(scene) as simulation:
        for _ in range(round(end / scene["time"]["step"])):
            simulation.step(scene["time"]["step"])
        assert simulation.t == pytest.approx(end)
        return observe(simulation)


def assert_orders(errors, order, below=0.15, above=0.35):
    """Every consecutive rate of every quantity is `order`; errors: one row per step size, each half the one before."""
    found = np.array([rates(column) for column in np.array(errors).T])
    assert np.all((found > order - below) & (found < order + above)), f"orders {found} of errors {errors}"


@pytest.mark.parametrize(
    ("scheme", "counts"),
    [("backward-euler", (400, 800, 1600)), ("bdf2", (100, 200, 400)), ("generalized-alpha", (50, 100, 200))],
)
def test_order_with_constraints(scheme, counts):
    """EA = inf, the index-3 problem: orders of r, v and T against the two rods' own differential equation."""
    errors = []
    for count in counts:
        r, v, T = at_end(two_rods(scheme, 0.5 / count), 0.5)
        assert np.abs(np.linalg.norm(np.diff(r, axis=0), axis=1) - 0.5).max() < 1e-10
        differences = (
            r[:, [0, 2]] - RODS_AT_HALF["nodes"],
            v[-1, [0, 2]] - RODS_AT_HALF["tip_velocity"],
            T[:, 0] - RODS_AT_HALF["T"],
        )
        errors.append([np.abs(d).max() for d in differences])
    assert_orders(errors, SCHEMES[scheme])


SPIN, STIFFNESS = 1.0, 4.0  # rad/s and N, of a cable of 1 m and 1 kg/m
SPIN_AXES = np.linalg.qr(np.array([[1.0, 2.0, 2.0], [0.3, -1.0, 0.5]]).T)[0].T  # a plane at random


def rotating(t):
    """A cable that turns about its anchor without gravity: r(s), T(s) and v(s) at time t, in closed form."""
    k = SPIN / np.sqrt(STIFFNESS)
    across = np.cos(SPIN * t) * SPIN_AXES[0] + np.sin(SPIN * t) * SPIN_AXES[1]
    ahead = np.cos(SPIN * t) * SPIN_AXES[1] - np.sin(SPIN * t) * SPIN_AXES[0]

    def radius(s):
        return np.sin(k * s) / (k * np.cos(k))

    return (
        lambda s: np.multiply.outer(radius(s), across),
        lambda s: STIFFNESS * (np.cos(k * s) / np.cos(k) - 1),
        lambda s: SPIN * np.multiply.outer(radius(s), ahead),
    )


def turn(simulation):
    """Start from the rotating cable, with the acceleration and jerk that belong to it."""
    position, tension, velocity = rotating(0.0)
    u, cable = simulation.system.u, simulation.problem.lines
    cable.set_shape(u, position, tension)
    rate, acceleration = np.zeros_like(u), np.zeros_like(u)
    rate[cable.node_dofs] = velocity(cable.node_s)
    acceleration[cable.node_dofs] = -(SPIN**2) * position(cable.node_s)
    simulation.past.begin([rate, acceleration])
    simulation.past.series[0].second, simulation.past.series[1].second = acceleration, -(SPIN**2) * rate
    simulation.predictor = Predictor()
    simulation.predictor.add(0.0, u)


@pytest.mark.parametrize(
    ("scheme", "first", "T_floor"), [("backward-euler", 80, 0.0), ("bdf2", 80, 3e-6), ("generalized-alpha", 20, 3e-6)]
)
def test_order_in_steady_rotation(scheme, first, T_floor):
    """A stretched cable against its closed form (second order: T is at the elements' own error from the start)."""
    position, tension, velocity = rotating(1.0)
    assert position(1.0) @ position(1.0) == pytest.approx(1.092604979687581**2)
    assert tension(0.0) == pytest.approx(0.5579757092981961)
    errors = []
    for count in (first, 2 * first, 4 * first):
        with running(turning(scheme, 1 / count)) as simulation:
            turn(simulation)
            for _ in range(count):
                simulation.step(1 / count)
            c, (r, v, T) = simulation.problem.lines, state(simulation)
            s, s_T = np.sort(c.node_s), c.T_s[np.argsort(c.cell_ends[:, 0])]
        errors.append([np.abs(d).max() for d in (r - position(s), v - velocity(s), T - tension(s_T))])
    if T_floor:
        assert max(error.pop() for error in errors) < T_floor
    assert_orders(errors, SCHEMES[scheme], below=0.2)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rod_that_turns_as_a_whole_carries_no_moment(scheme):
    """In steady rotation it is straight, whatever its stiffness and its damping, but for what a scheme makes of its
    speed, which vanishes with the step."""
    found = []
    for count in (20, 40):
        keys = {"position_degree": 2, "tension_degree": 1, "bending_stiffness": 10.0, "bending_damping": 0.1}
        with running(turning(scheme, 1 / count, **keys)) as simulation:
            turn(simulation)
            for _ in range(count):
                simulation.step(1 / count)
            lines, u = simulation.problem.lines, simulation.system.u
            assert np.linalg.norm(u[lines.node_dofs[lines.node_s.argmax()]] - rotating(0.0)[0](1.0)) > 0.5
            found.append(np.abs(lines.moments(u)).max())
    assert found[0] < 10.0 * {"backward-euler": 1e-5, "bdf2": 1e-7, "generalized-alpha": 2e-7}[scheme]
    assert found[1] < 0.6 * found[0]


def turning(scheme, step, **keys):
    """A scene of the rotating cable."""
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": STIFFNESS, "elements": 3, "top": {"kind": "free"}}
    cable |= {"position_degree": 4, "tension_degree": 3} | keys
    start = {"kind": "polyline", "points": [[0.0, 0.0, 0.0], rotating(0.0)[0](1.0).tolist()]}
    return {"gravity": 0.0, "cable": cable, "initial": start, "time": {"end": 1.0, "step": step, "scheme": scheme}}


def stretching(scheme, count):
    """(r, v, T) after 0.5 s of two elastic elements that were released unstretched; T stretches them by a fifth."""
    return at_end(merged(two_rods(scheme, 0.5 / count), cable__axial_stiffness=50.0), 0.5)


@pytest.fixture(scope="module")
def stretched():
    """The same at the limit of small steps."""
    fine, finer = stretching("bdf2", 800), stretching("bdf2", 1600)
    return [b + (b - a) / 3 for a, b in zip(fine, finer, strict=True)]


@pytest.mark.parametrize(("scheme", "first"), [("backward-euler", 400), ("bdf2", 200), ("generalized-alpha", 100)])
def test_order_of_elastic_elements(scheme, first, stretched):
    """Axial and transverse motion together: orders of r, v and T."""
    errors = []
    for count in (first, 2 * first, 4 * first):
        errors.append([np.abs(a - b).max() for a, b in zip(stretching(scheme, count), stretched, strict=True)])
    assert_orders(errors, SCHEMES[scheme], below=0.2)


#: Without the axial spring of cable and buoy (51 ms), which no step below resolves.
COUPLED = merged(
    MOORED,
    cable__axial_stiffness=None,
    cable__elements=6,
    waves__amplitude=0.6,
    waves__ramp=1.0,
    waves__direction_deg=40.0,
)


def coupled(scheme, count, end=1.0):
    """(r_C, p, |T_bnd|) of the moored buoy at `end`."""

    def observe(simulation):
        y = simulation.system.u[simulation.problem.buoy.part.slice]
        return y[:3].copy(), y[3:6].copy(), np.linalg.norm(simulation.end_tension)

    return at_end(merged(COUPLED, time={"end": end, "step": end / count, "scheme": scheme}), end, observe)


@pytest.fixture(scope="module")
def moored():
    """(r_C, p, |T_bnd|) of the moored buoy at 1 s, by BDF2 with Richardson's extrapolation."""
    return [b + (b - a) / 3 for a, b in zip(coupled("bdf2", 200), coupled("bdf2", 400), strict=True)]


@pytest.mark.parametrize(
    ("scheme", "counts"),
    [("backward-euler", (50, 100, 200)), ("bdf2", (25, 50, 100)), ("generalized-alpha", (25, 50, 100))],
)
def test_order_of_the_coupled_buoy(scheme, counts, moored):
    """Moored in waves and current: orders of the buoy's position and momentum and of the tension at the top."""
    errors = [
        [np.abs(value - right).max() for value, right in zip(coupled(scheme, count), moored, strict=True)]
        for count in counts
    ]
    assert_orders(errors, SCHEMES[scheme], below=0.2)


def oscillate(scheme, omega, step, steps):
    """Amplitude that a scheme leaves of x_tt = -omega^2 x after some steps, by carrying them out."""
    x, v = Series(np.array([1.0]), np.array([0.0])), Series(np.array([0.0]), np.array([-(omega**2)]))
    x.second = np.array([-(omega**2)])
    for _ in range(steps):
        for series in (x, v):
            scheme.begin(step, series)
        gamma, h_x = rule(scheme, step, x)
        _, h_v = rule(scheme, step, v)
        value = -(gamma * h_x + h_v) / (gamma**2 + omega**2)
        velocity = gamma * value + h_x
        accept(scheme, x, value, velocity)
        accept(scheme, v, velocity, gamma * velocity + h_v)
    return float(np.hypot(value, velocity / omega)[0])


@pytest.mark.parametrize(("name", "remaining"), [("backward-euler", 0.38774505882744), ("bdf2", 0.9999252221194541)])
def test_damping_of_the_paper(name, remaining):
    """A free motion of 5 s after 120 s at dt = 0.01 s."""
    factor = make_scheme(name).amplification(2 * np.pi / 5.0, 0.01)
    assert abs(factor) ** 12000 == pytest.approx(remaining, rel=1e-9)


@pytest.mark.parametrize("x", [0.01, 0.3, 1.0])
def test_amplification_in_closed_form(x):
    """1 - 1/zeta = i x; 3/2 - 2/zeta + 1/(2 zeta^2) = i x; the two averages of Jansen, Whiting and Hulbert."""
    assert BackwardEuler().amplification(x / 0.1, 0.1) == pytest.approx(1 / (1 - 1j * x))
    assert BDF2().amplification(x / 0.1, 0.1) == pytest.approx((2 + np.sqrt(1 + 2j * x)) / (3 - 2j * x))
    for radius in (0.0, 0.8):
        found = GeneralizedAlpha(radius).amplification(x / 0.1, 0.1)
        assert np.abs(found - np.linalg.eigvals(averages(x, radius))).min() < 1e-12


def averages(x, radius):
    """One step of generalized-alpha for y_t = i x y at step 1, as a matrix on (y, auxiliary rate)."""
    alpha_m, alpha_f = (3 - radius) / (1 + radius) / 2, 1 / (1 + radius)
    gamma = 0.5 + alpha_m - alpha_f
    new = [[1, -gamma], [-1j * x * alpha_f, alpha_m]]
    return np.linalg.solve(new, [[1, 1 - gamma], [1j * x * (1 - alpha_f), alpha_m - 1]])


@pytest.mark.parametrize("scheme", [BackwardEuler(), BDF2(), GeneralizedAlpha(0.8), GeneralizedAlpha(0.0)])
def test_amplification_is_what_the_steps_do(scheme):
    """A free motion carried out loses per step what `amplification` says."""
    omega, step = 2 * np.pi, 0.02
    found = (oscillate(scheme, omega, step, 150) / oscillate(scheme, omega, step, 50)) ** 0.01
    assert found == pytest.approx(abs(scheme.amplification(omega, step)), abs=1e-5)


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.8])
def test_spectral_radius(radius):
    """Very fast motions shrink by the spectral radius in every step: a double root, hence n radius^n after n steps."""
    amplitudes = [oscillate(GeneralizedAlpha(radius), 1e5, 1.0, n) for n in (5, 6)]
    assert amplitudes[1] == pytest.approx(radius * 6 / 5 * amplitudes[0], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("scheme", [BackwardEuler(), BDF2()], ids=lambda scheme: scheme.name)
def test_error_of_a_rate_is_its_lag(scheme):
    """Of t^(p + 1) at t = 0, where the rate is 0: - lag h^p (p + 1)!."""
    h, p = 0.25, scheme.order
    _, history = scheme.formula(h)
    rate = sum(weight * (-(row + 1) * h) ** (p + 1) for weight, row in history.terms) / history.over
    assert rate == pytest.approx(-scheme.lag * h**p * math.factorial(p + 1))
