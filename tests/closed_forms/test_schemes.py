"""Time schemes: their orders in r, v and T, their damping, and what a start and a change of step do to the tension.

Source: rods by scipy, a rotating cable in closed form, Richardson's limit, amplification factors by hand.
"""

import itertools

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged, rates, running

from dolfbuoy.motion.schemes import BDF2, BackwardEuler, GeneralizedAlpha, Predictor, Series, make_scheme

SCHEMES = {"backward-euler": 1, "bdf2": 2, "generalized-alpha": 2}

#: Two inextensible rods of 0.5 m and 1 kg/m, released at 45 and 0 degrees; state at t = 0.5 s, scipy to 1e-10.
RODS_AT_HALF = {
    "nodes": [[0.0, 0.0], [-0.1526988487875112, -0.47611244636006816], [-0.1265681542799077, -0.9754291662929684]],
    "tip_velocity": [-3.4300832494051368, -0.3631663634180436],
    "T": [12.56145743837105, 6.347866332058868],
}


def rods(angles, scheme, step, length=1.0, density=1.0):
    """A hanging chain of rods at these angles from the downward vertical, released at rest."""
    h = length / len(angles)
    x, z = np.cumsum(h * np.sin(angles)), np.cumsum(-h * np.cos(angles))
    points = [[0.0, 0.0, 0.0], *([float(a), 0.0, float(b)] for a, b in zip(x, z, strict=True))]
    return {
        "cable": {"length": length, "line_density": density, "elements": len(angles), "top": {"kind": "free"}},
        "initial": {"kind": "polyline", "points": points},
        "time": {"end": 10.0, "step": step, "scheme": scheme},
    }


def two_rods(scheme, step):
    return rods(np.radians([45.0, 0.0]), scheme, step)


def state(simulation):
    """(r, v, T) at the nodes and in the elements, in order from the anchor."""
    cable, u = simulation.problem.lines, simulation.system.u
    nodes, cells = np.argsort(cable.node_s), np.argsort(cable.cell_ends[:, 0])
    velocity = simulation.past.series[0].rate
    return u[cable.node_dofs[nodes]], velocity[cable.node_dofs[nodes]], u[cable.T_dofs[cells]]


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
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": STIFFNESS, "elements": 3, "top": {"kind": "free"}}
    cable |= {"position_degree": 4, "tension_degree": 3}
    start = {"kind": "polyline", "points": [[0.0, 0.0, 0.0], rotating(0.0)[0](1.0).tolist()]}
    position, tension, velocity = rotating(1.0)
    assert position(1.0) @ position(1.0) == pytest.approx(1.092604979687581**2)
    assert tension(0.0) == pytest.approx(0.5579757092981961)
    errors = []
    for count in (first, 2 * first, 4 * first):
        time = {"end": 1.0, "step": 1 / count, "scheme": scheme}
        with running({"gravity": 0.0, "cable": cable, "initial": start, "time": time}) as simulation:
            turn(simulation)
            for _ in range(count):
                simulation.step(1 / count)
            c, (r, v, T) = simulation.problem.lines, state(simulation)
            s, s_T = np.sort(c.node_s), c.T_s[np.argsort(c.cell_ends[:, 0])]
        errors.append([np.abs(d).max() for d in (r - position(s), v - velocity(s), T - tension(s_T))])
    if T_floor:
        assert max(error.pop() for error in errors) < T_floor
    assert_orders(errors, SCHEMES[scheme], below=0.2)


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
        gamma, h_x = scheme.rule(step, x)
        _, h_v = scheme.rule(step, v)
        value = -(gamma * h_x + h_v) / (gamma**2 + omega**2)
        velocity = gamma * value + h_x
        scheme.accept(x, value, velocity)
        scheme.accept(v, velocity, gamma * velocity + h_v)
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


# -- start and change of step ------------------------------------------------------------------------------------------


def tensions(scene, steps, tamper=None):
    """Tension of the upper element after each of these steps."""
    with running(scene) as simulation:
        if tamper:
            tamper(simulation)
        found = []
        for step in steps:
            simulation.step(step)
            found.append(state(simulation)[2][0, 0])
    return np.array(found)


def forget_acceleration(simulation):
    """Start as if at rest: what a start that solves for nothing would do."""
    for series in simulation.past.series:
        series.second = np.zeros_like(series.second)
        series.rate = np.zeros_like(series.rate)
        series.previous_rate = series.rate


def ringing(T):
    return np.abs(np.diff(T, 2)).max() / 4  # of what alternates from step to step


def test_generalized_alpha_starts_without_ringing():
    """Released rods: with acceleration and tension of the start the tension is right from the first step on."""
    step, count = 0.01, 24
    fine = tensions(two_rods("generalized-alpha", step / 16), [step / 16] * 16 * count)[15::16]
    good = tensions(two_rods("generalized-alpha", step), [step] * count)
    bad = tensions(two_rods("generalized-alpha", step), [step] * count, forget_acceleration)
    assert np.abs(good - fine).max() < 0.01 * fine.max()
    assert ringing(good - fine) < 1e-3 * fine.max()
    assert ringing(bad - fine) > 5 * ringing(good - fine)
    assert np.abs(bad - fine).max() > 5 * np.abs(good - fine).max()


CHANGE = 0.24  # s, when the step after the change ends


@pytest.fixture(scope="module")
def at_change():
    """Tension at CHANGE."""
    fine, finer = (tensions(two_rods("bdf2", CHANGE / n), [CHANGE / n] * n)[-1] for n in (400, 800))
    return finer + (finer - fine) / 3


def errors_after_change(scheme, factor, right, counts=(40, 80, 160, 320)):
    """Error of the tension in the first step of `factor` times the size, after so many steps of equal size."""
    sizes = [(n, CHANGE / (n + factor)) for n in counts]
    return np.array([tensions(two_rods(scheme, h), [h] * n + [factor * h])[-1] - right for n, h in sizes])


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_tension_after_a_change_of_step(scheme, factor, at_change, monkeypatch):
    """It is of the scheme's order in the first step of another size (of order 1 at least: generalized-alpha)."""
    order = 1 if scheme == "generalized-alpha" else SCHEMES[scheme]
    errors = errors_after_change(scheme, factor, at_change)
    assert np.all(rates(np.abs(errors)) > order - 0.35), f"{errors}"
    if scheme == "generalized-alpha":
        return
    monkeypatch.setattr(Series, "resample", lambda *_: None)
    wrong = errors_after_change(scheme, factor, at_change, (160, 320))
    assert np.all(np.abs(wrong) > 5 * np.abs(errors[2:])), f"{wrong}"
    assert wrong[1] == pytest.approx(wrong[0], rel=0.2)  # no step is small enough to make it good


@pytest.mark.parametrize("lagged", [False, True])
@pytest.mark.parametrize(
    ("order", "coefficients", "count"),
    [(1, [0.7, -1.3], 5), (2, [0.7, -1.3, 0.4, 2.1], 5), (1, [0.7, -1.3], 1), (2, [0.7, -1.3], 2)],
)
def test_resampling_is_exact_for_polynomials(order, coefficients, count, lagged):
    """y, or with a lag y - lag h^p y^(p), of degree below 2 p: told as if it had been made at that step."""
    y, lag, h0 = np.polynomial.Polynomial(coefficients), 0.3, 0.2
    rate = y.deriv(order)

    def told(h, n):
        t = -h * np.arange(n)
        return y(t) - lagged * lag * h**order * rate(t)

    for factor in (0.5, 0.1, 1.6, 2.0):
        series = Series(np.zeros(1), np.array([y.deriv()(0.0)]), lagged)
        series.values, series.step = [np.array([v]) for v in told(h0, count)], h0
        series.resample(factor * h0, order, lag)
        found = np.ravel(series.values)
        assert len(found) == (count if factor < 1 or count <= order else 1 + int((count - 1) / factor))
        np.testing.assert_allclose(found, told(factor * h0, len(found)), atol=1e-12)


def decay(scheme, steps):
    """Error of y_t = -y, y(0) = 1, after steps of these sizes."""
    series = Series(np.ones(1), -np.ones(1))
    series.second = np.ones(1)
    for h in steps:
        scheme.begin(h, series)
        gamma, history = scheme.rule(h, series)
        y = -history / (gamma + 1)
        scheme.accept(series, y, -y)
    return abs(series.values[0][0] - np.exp(-sum(steps)))


@pytest.mark.parametrize("before", [1, 2, 3, 4])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_step_longer_than_the_past(scheme, before):
    """Ten times the size of so few steps before it: its local error has the scheme's order at least."""
    errors = [decay(make_scheme(scheme), [h] * before + [10 * h]) for h in (0.01, 0.005, 0.0025)]
    assert np.all(rates(errors) > SCHEMES[scheme] + 0.8), errors


def late_rates(forget, h, count=20):
    """Auxiliary rates of generalized-alpha for y_t = -y, `count` steps of h and as many of h/10, over y."""
    scheme, series = GeneralizedAlpha(0.8), Series(np.ones(1), -np.ones(1))
    series.second, found = np.ones(1), []
    for step in [h] * count + [h / 10] * count:
        if forget and len(found) == count:
            series.forget()
        scheme.begin(step, series)
        gamma, history = scheme.rule(step, series)
        y = -history / (gamma + 1)
        scheme.accept(series, y, -y)
        found.append(series.auxiliary[0] / y[0])
    return np.array(found[count:])


def test_generalized_alpha_does_not_ring_after_a_forgotten_past():
    """Its auxiliary rate, y_t at t + (alpha_f - alpha_m) h, is taken along: -y exp(...) up to the second order."""
    scheme, h = GeneralizedAlpha(0.8), 0.01
    exact = -np.exp((scheme.alpha_m - scheme.alpha_f) * h / 10)
    assert np.abs(late_rates(True, h) - exact).max() < 1e-4
    assert np.abs(late_rates(True, h) - late_rates(False, h)).max() < 1e-12


def energy(simulation):
    """Kinetic and potential energy of a chain of rods of 1 kg/m in all, 1 m long."""
    r, v, _ = state(simulation)
    h = 1 / (len(r) - 1)
    kinetic = sum(h / 6 * (a @ a + a @ b + b @ b) for a, b in itertools.pairwise(v))
    return kinetic + 9.81 * h * (r[1:-1, 2].sum() + (r[0, 2] + r[-1, 2]) / 2)


def energy_history(scheme, step=0.01, end=10.0):
    """Energy of three rods after every step, over what their release sets free."""
    with running(rods(np.radians([60.0, 20.0, -30.0]), scheme, step)) as simulation:
        values = [energy(simulation)]
        for _ in range(round(end / step)):
            simulation.step(step)
            values.append(energy(simulation))
    return (np.array(values) - values[0]) / (values[0] + 9.81 / 2)


def test_energy_over_ten_seconds():
    """A free chain of rods: generalized-alpha keeps its energy, BDF2 loses some of it, backward Euler nearly all."""
    kept, bdf2, euler = (energy_history(scheme) for scheme in ("generalized-alpha", "bdf2", "backward-euler"))
    assert abs(kept[-200:].mean()) < 0.01
    assert np.abs(kept).max() < 0.1
    assert euler[-1] < 2 * bdf2[-1] < -0.2
    assert euler.max() < 1e-12
