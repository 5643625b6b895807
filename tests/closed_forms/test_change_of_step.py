"""Time schemes at the start of a run and at a change of step: tension, histories, and energy over many steps.

Source: runs with exact starting values, Richardson extrapolation, polynomials, decays in closed form.
"""

import itertools

import numpy as np
import pytest
from dynamics_helpers import rates, running
from in_numpy import accept, rule
from rods import SCHEMES, rods, state, two_rods

from dolfbuoy.motion.schemes import GeneralizedAlpha, Series, make_scheme


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
    """Start with zero acceleration, as if no initial problem were solved."""
    for series in simulation.past.series:
        series.second = np.zeros_like(series.second)
        series.rate = np.zeros_like(series.rate)
        series.previous_rate = series.rate


def ringing(T):
    return np.abs(np.diff(T, 2)).max() / 4  # of what alternates from step to step


def test_generalized_alpha_starts_without_ringing():
    """Released rods: with consistent acceleration and tension, the tension is right from the first step."""
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
    """Error of the tension in the first step of `factor` times the size, after several equal steps."""
    sizes = [(n, CHANGE / (n + factor)) for n in counts]
    return np.array([tensions(two_rods(scheme, h), [h] * n + [factor * h])[-1] - right for n, h in sizes])


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_tension_after_a_change_of_step(scheme, factor, at_change, monkeypatch):
    """It has the scheme's order in the first step of a new size (order 1 at least: generalized-alpha)."""
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
    """y, or with a lag y - lag h^p y^(p), of degree below 2 p, as if computed with that step."""
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


def test_noise_has_no_derivative():
    """Velocities alternating after an impact stay of the same size through changes of step."""
    noise, series = np.array([1.0, -0.6, 0.0]), Series(np.zeros(3), np.zeros(3), True)
    series.values, series.step = [noise * (-1) ** j for j in range(5)], 0.1
    for factor in (2.0, 2.0, 0.5, 0.5) * 3:
        series.resample(factor * series.step, 2, 1 / 3)
        series.step *= factor
        series.values = [*series.values, *[noise * (-1) ** j for j in range(5)]][:5]
        assert np.all(np.abs(series.values) <= 3 * np.abs(noise))


@pytest.mark.parametrize(
    ("order", "values", "bounds"),
    [
        (1, [2.0, 1.0, 0.0], (-np.inf, np.inf)),
        (1, [3.0, 1.0, 0.0], (-np.inf, np.inf)),  # differences 2 and 1, which differ by half of the larger one
        (1, [3.1, 1.0, 0.0], (0.0, 4.2)),
        (1, [-3.0, -1.0, 0.0], (-np.inf, np.inf)),
        (1, [-3.1, -1.0, 0.0], (-4.2, 0.0)),
        (1, [0.0, 1.0, 0.0], (0.0, 0.0)),
        (1, [5.0, 1.0], (-np.inf, np.inf)),
        (2, [0.0, 0.0, 0.0, 1.0], (0.0, 0.0)),
        (2, [6.0, 3.0, 1.0, 0.0], (-np.inf, np.inf)),
        (2, [9.0, 4.0, 1.0, 0.5], (-np.inf, np.inf)),  # 2 and 2.5
        (2, [9.0, 3.0, 1.0, 0.5], (0.0, 8.0)),  # 4 and 1.5
        (2, [9.0, 3.0, 1.0], (-np.inf, np.inf)),
    ],
)
def test_bounds_of_derivatives(order, values, bounds):
    """Where differences of their order disagree by more than half: from 0 to twice the largest one, if all have a
    sign, else 0."""
    series = Series(np.zeros(1), np.zeros(1))
    series.values = [np.array([value]) for value in values]
    np.testing.assert_allclose(np.ravel(series._limits(order)), bounds, rtol=1e-12)


def decay(scheme, steps):
    """Error of y_t = -y, y(0) = 1, after steps of these sizes."""
    series = Series(np.ones(1), -np.ones(1))
    series.second = np.ones(1)
    for h in steps:
        scheme.begin(h, series)
        gamma, history = rule(scheme, h, series)
        y = -history / (gamma + 1)
        accept(scheme, series, y, -y)
    return abs(series.values[0][0] - np.exp(-sum(steps)))


@pytest.mark.parametrize("before", [1, 2, 3, 4])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_step_longer_than_the_past(scheme, before):
    """Ten times the few steps before it: the local error has at least the scheme's order."""
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
        gamma, history = rule(scheme, step, series)
        y = -history / (gamma + 1)
        accept(scheme, series, y, -y)
        found.append(series.auxiliary[0] / y[0])
    return np.array(found[count:])


def test_generalized_alpha_does_not_ring_after_a_forgotten_past():
    """Its auxiliary rate, y_t at t + (alpha_f - alpha_m) h, is kept: -y exp(...) to second order."""
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
    """Energy of three rods after every step, relative to the energy released."""
    with running(rods(np.radians([60.0, 20.0, -30.0]), scheme, step)) as simulation:
        values = [energy(simulation)]
        for _ in range(round(end / step)):
            simulation.step(step)
            values.append(energy(simulation))
    return (np.array(values) - values[0]) / (values[0] + 9.81 / 2)


def test_energy_over_ten_seconds():
    """A free chain of rods: generalized-alpha conserves energy, BDF2 loses some, backward Euler nearly all."""
    kept, bdf2, euler = (energy_history(scheme) for scheme in ("generalized-alpha", "bdf2", "backward-euler"))
    assert abs(kept[-200:].mean()) < 0.01
    assert np.abs(kept).max() < 0.1
    assert euler[-1] < 2 * bdf2[-1] < -0.2
    assert euler.max() < 1e-12
