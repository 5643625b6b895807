"""Kelvin-Voigt damping T = EA e + c e_t: decay of axial vibrations, order of the scheme, energy, and where it acts.

Source: the damped first axial mode in closed form, d'Alembert's waves, an energy balance in numpy.
"""

import alone
import numpy as np
import pytest
from dynamics_helpers import rates, running

from dolfbuoy import load_scene
from dolfbuoy.model.effects import names as effects
from dolfbuoy.motion.consistent import make_consistent
from dolfbuoy.motion.schemes import Predictor, make_scheme
from dolfbuoy.statics.equilibrium import solve_equilibrium

L, RHO, EA = 1.0, 1.0, 1.0e4
K = np.pi / (2 * L)  # first mode, fixed at s = 0 and free at s = L
OMEGA = K * np.sqrt(EA / RHO)
AMPLITUDE = 1e-5
PERIOD = 2 * np.pi / OMEGA


def bar(damping, step, periods=4.0, elements=16, degrees=(2, 1), scheme="bdf2", **cable):
    """A straight cable without gravity and water, one end fixed."""
    section = {"length": L, "line_density": RHO, "axial_stiffness": EA, "elements": elements, "damping": damping}
    section |= {"position_degree": degrees[0], "tension_degree": degrees[1], "top": {"kind": "free"}}
    return {
        "gravity": 0.0,
        "cable": section | cable,
        "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [L, 0.0, 0.0]]},
        "solver": {"step_tolerance": 1e-11},
        "time": {"end": periods * PERIOD, "step": step, "scheme": scheme},
    }


def release(simulation):
    """Start at rest from the first axial mode, x = s + AMPLITUDE sin(K s)."""
    cable, u = simulation.problem.lines, simulation.system.u
    s = cable.node_s
    u[cable.node_dofs[:, 0]] = s + AMPLITUDE * np.sin(K * s)
    simulation.begin()
    make_consistent(simulation)
    simulation.predictor = Predictor()
    simulation.predictor.add(0.0, u)


def vibration(scene):
    """(t, x(L) - L, energy, dissipated power / c) after every step, the energy of motion and of T - c e_t over EA."""
    rows = []
    with running(scene) as simulation:
        cable, c = simulation.problem.lines, simulation.scene.network.pieces[0].section
        M, D = matrices(cable) if c.position_degree == 2 else (None, None)
        release(simulation)
        for _ in simulation.run():
            u = simulation.system.u
            order = np.argsort(cable.node_s)
            x, v = (a[cable.node_dofs[order]][:, 0] for a in (u, simulation.past.series[1].values[0]))
            if M is None:
                rows.append((simulation.t, x[-1] - L, np.nan, np.nan))
                continue
            strain, rate, weights = D @ x - 1, D @ v, M[1]
            energy = 0.5 * c.line_density * v @ M[0] @ v + 0.5 * c.axial_stiffness * weights @ strain**2
            rows.append((simulation.t, x[-1] - L, energy, weights @ rate**2))
    return np.array(rows).T


def matrices(cable):
    """((mass matrix, weights), slopes at the Gauss points): quadratic elements on an even mesh."""
    n, h = len(cable.cell_ends), L / len(cable.cell_ends)
    xi, w = np.polynomial.legendre.leggauss(3)
    N = np.column_stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2])
    dN = np.column_stack([xi - 0.5, -2 * xi, xi + 0.5]) * 2 / h
    M, D = np.zeros((2 * n + 1, 2 * n + 1)), np.zeros((3 * n, 2 * n + 1))
    for e in range(n):
        nodes = slice(2 * e, 2 * e + 3)
        M[nodes, nodes] += N.T @ np.diag(w * h / 2) @ N
        D[3 * e : 3 * e + 3, nodes] = dN
    return (M, np.tile(w * h / 2, n)), D


def exact(t, damping):
    """x(L) - L of rho x_tt = EA x_ss + c x_sst released from the first mode: exp(-c K^2 t/(2 rho)) and its phase."""
    decay = damping * K**2 / (2 * RHO)
    omega = np.sqrt(OMEGA**2 - decay**2)
    return AMPLITUDE * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))


@pytest.mark.parametrize(("degrees", "damping"), [((1, 0), 4.0), ((2, 1), 4.0), ((2, 1), 20.0)])
def test_free_vibration_decays_as_the_closed_form(degrees, damping):
    t, x, _, _ = vibration(bar(damping, PERIOD / 400, degrees=degrees, elements=32 // degrees[0]))
    assert np.abs(x - exact(t, damping)).max() < (0.01 if degrees[0] == 1 else 2e-3) * AMPLITUDE


@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 1), ("bdf2", 2), ("generalized-alpha", 2)])
def test_order_in_the_step(scheme, order):
    errors = []
    for n in (100, 200, 400):
        t, x, _, _ = vibration(bar(10.0, PERIOD / n, periods=2.0, scheme=scheme))
        errors.append(np.abs(x - exact(t, 10.0))[t > PERIOD].max())
    np.testing.assert_allclose(rates(errors), order, atol=0.25)


def test_energy_goes_into_the_damper():
    """The loss of kinetic and strain energy is the integral of c e_t^2; without damping the scheme conserves it."""
    amplification = abs(make_scheme("generalized-alpha", 0.9).amplification(OMEGA, PERIOD / 400))
    for damping in (0.0, 10.0):
        scene = bar(damping, PERIOD / 400, scheme="generalized-alpha")
        scene["time"]["spectral_radius"] = 0.9
        t, _, energy, power = vibration(scene)
        lost = energy[0] - energy
        dissipated = damping * np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(t))])
        by_scheme = 1 - amplification ** (2 * len(t))
        np.testing.assert_allclose(lost / energy[0], dissipated / energy[0], atol=2e-3 + by_scheme)
        assert (lost[-1] > 0.5 * energy[0]) == (damping > 0)


@pytest.mark.parametrize("slack", ["tension-only", "compressive"])
@pytest.mark.parametrize("damping", [0.0, 200.0])
def test_a_jerk_is_an_elastic_wave(slack, damping):
    """An end pulled at 0.5 m/s has T + Z v, Z = sqrt(EA rho), the fixed one T + 2 Z v from L/c to 3 L/c = 60 ms."""
    top = {"kind": "prescribed", "position": [20.02, 0.0, 0.0], "amplitude": [2.5 / np.pi, 0.0, 0.0], "period": 10.0}
    cable = {"length": 20.0, "line_density": 1.0, "axial_stiffness": 1e6, "elements": 80, "top": top}
    cable |= {"anchor": [0.0, 0.0, 0.0], "slack": slack, "damping": damping}
    time = {"end": 0.05, "step": 2.5e-4, "scheme": "bdf2"}
    found = alone.simulate({"gravity": 0.0, "cable": cable, "time": time})
    held = np.linalg.norm(found.anchor_force, axis=1)

    def between(force, begin, end):
        return np.asarray(force)[(found.time > begin) & (found.time < end)]

    assert between(held, 0.0, 0.012) == pytest.approx(1000, abs=1)
    assert between(found.tension_top, 0.01, 0.03) == pytest.approx(1500, abs=1)
    assert between(held, 0.03, 0.05) == pytest.approx(2000, abs=3)


def test_rest_knows_no_damping():
    """The equilibrium is that of the undamped cable; no damping term is compiled for undamped scenes."""
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": 50.0, "elements": 8}
    cable["top"] = {"kind": "fixed", "position": [0.6, 0.0, 0.5]}
    states = []
    for damping in (0.0, 3.0):
        scene = load_scene({"cable": cable | {"damping": damping}})
        assert ("cable damping" in effects(scene)) == (damping > 0)
        problem = solve_equilibrium(scene)
        states.append(problem.system.u.copy())
        assert (problem.lines.cable.damping is None) == (damping == 0)
        problem.destroy()
    np.testing.assert_array_equal(*states)


def test_sum_is_bounded_at_zero():
    """Tension-only: T = max(0, EA e + c e_t), so a string let go shortens without pushing and is not held back."""
    scene = bar(10.0, PERIOD / 200, periods=1.0, degrees=(1, 0), scheme="backward-euler", slack="tension-only")
    with running(scene) as simulation:
        cable = simulation.problem.lines
        release(simulation)
        order = np.argsort(cable.node_s)
        cells = np.argsort(cable.cell_ends[:, 0])
        bounded = 0
        for _ in simulation.run():
            x, v = (a[cable.node_dofs[order]] for a in (simulation.system.u, simulation.past.series[0].rate))
            h = L / len(cells)
            strain = np.linalg.norm(np.diff(x, axis=0), axis=1) / h - 1
            rate = np.diff(v[:, 0]) / h
            T = simulation.system.u[cable.T_dofs[cells, 0]]
            np.testing.assert_allclose(T, np.maximum(EA * strain + 10.0 * rate, 0), atol=1e-6)
            bounded += (T == 0).sum()
        assert bounded > 100
