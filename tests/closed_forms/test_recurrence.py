"""Every step against the exact backward-Euler recurrence of the same semi-discrete system.

Backward Euler is a recurrence in three successive positions, r_(n+1) - 2 r_n + r_(n-1) = dt^2 a_(n+1), so the tests
start it from the first two recorded positions; how a run starts is a test of its own.

Source: dense numpy code of backward Euler, eigenvalues in tests/reference.
"""

import numpy as np
import pytest
from dynamics_helpers import NumpyCable, merged, running, simulate_evenly, string_matrices
from helpers import reference
from scipy.linalg import eigh

G = 9.81
AZIMUTH = np.array([np.cos(0.6), np.sin(0.6), 0.0])  # a vertical plane that is none of the coordinate planes
DOWN = np.array([0.0, 0.0, -1.0])


def swung(angle):
    """Unit vector at an angle from the downward vertical."""
    return np.sin(angle) * AZIMUTH + np.cos(angle) * DOWN


def rod(angle, L=1.7, density=2.3, step=0.01, end=0.6):
    return {
        "cable": {"length": L, "line_density": density, "elements": 1, "top": {"kind": "free"}},
        "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], (L * swung(angle)).tolist()]},
        "time": {"end": end, "step": step, "output_every": step},
    }


def test_pendulum_rod():
    L, density, dt = 1.7, 2.3, 0.01
    run = simulate_evenly(rod(np.radians(100), L, density, dt))
    x, T = run.cable_position.values[:, 1], run.cable_tension.values[:, 0]
    m, load = density * L / 3, density * L / 2 * G * DOWN
    previous, current = x[0], x[1]
    for n in range(2, len(x)):
        pull = m / dt**2 * (2 * current - previous) + load  # (m/dt^2 + T/L) x = pull and |x| = L
        exact, tension = L * pull / np.linalg.norm(pull), np.linalg.norm(pull) - m * L / dt**2
        assert x[n] == pytest.approx(exact, abs=2e-11)
        assert T[n] == pytest.approx(tension, abs=1e-14 * m * L / dt**2 + 1e-8 * density * L * G)
        previous, current = current, exact
    assert np.degrees(np.arctan2(x[-1] @ AZIMUTH, -x[-1][2])) < 60  # it did swing


def test_first_step_starts_from_the_given_velocity():
    """A rod released at rest: x_1 follows from v = 0, not from a velocity of the order of the step."""
    L, density, dt = 1.7, 2.3, 0.01
    run = simulate_evenly(rod(np.radians(100), L, density, dt, end=dt))
    x = run.cable_position.values[:, 1]
    pull = density * L / 3 / dt**2 * x[0] + density * L / 2 * G * DOWN
    moved = np.linalg.norm(x[1] - x[0])
    assert np.linalg.norm(x[1] - L * pull / np.linalg.norm(pull)) < 1e-5 * moved


CABLES = {
    "elastic between fixed ends": {
        "cable": {
            "length": 2.2,
            "line_density": 1.3,
            "axial_stiffness": 90.0,
            "elements": [[0.8, 2], [1.4, 3]],
            "top": {"kind": "fixed", "position": [1.9, 0.4, 1.2]},
        },
        "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [0.5, 0.9, 0.3], [1.9, 0.4, 1.2]]},
    },
    "inextensible under an end force": {
        "cable": {
            "length": 2.6,
            "line_density": 1.3,
            "elements": [[1.3, 2], [1.3, 3]],
            "top": {"kind": "free", "force": [7.0, -3.0, 2.0]},
        },
        "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [0.5, 1.2, 0.0], [1.7, 1.2, -0.5]]},
    },
    "elastic with a driven end": {
        "cable": {
            "length": 2.2,
            "line_density": 1.3,
            "axial_stiffness": 90.0,
            "elements": [[0.8, 2], [1.4, 3]],
            "top": {
                "kind": "prescribed",
                "position": [1.9, 0.4, 0.2],
                "amplitude": [0.1, -0.3, 0.2],
                "period": 0.7,
                "ramp": 0.2,
            },
        },
    },
}


@pytest.mark.parametrize("name", CABLES)
def test_cable_with_piecewise_constant_tension(name):
    """Large motion of a mesh of two sizes, step by step against a dense solver of its own."""
    dt, steps = 0.01, 60
    scene = merged(CABLES[name], time={"end": steps * dt, "step": dt, "output_every": dt})
    run = simulate_evenly(scene)
    r, T, s = run.cable_position.values, run.cable_tension.values, run.s.values
    c = scene["cable"]
    free = c["top"]["kind"] == "free"
    cable = NumpyCable(
        s,
        c["line_density"],
        c.get("axial_stiffness", np.inf),
        c["line_density"] * G * DOWN,
        [0] if free else [0, len(s) - 1],
        c["top"].get("force", (0, 0, 0)),
    )
    previous, current, tension = r[0], r[1], T[1]
    for n in range(2, steps + 1):
        held = None if free else r[n][[0, -1]]
        previous, (current, tension) = current, cable.step(previous, current, tension, dt, held)
        assert np.abs(r[n] - current).max() < 2e-10 * c["length"]
        assert np.abs(T[n] - tension).max() < 1e-7 * np.abs(tension).max()
    assert np.abs(r[-1] - r[0]).max() > 0.05 * c["length"]
    if "amplitude" in c["top"]:  # the end goes where it is told
        top, t = c["top"], run.frame.values
        ramp = np.where(t < top["ramp"], 0.5 * (1 - np.cos(np.pi * t / top["ramp"])), 1.0)
        wave = (ramp * np.sin(2 * np.pi * t / top["period"]))[:, None] * np.array(top["amplitude"])
        np.testing.assert_allclose(r[:, -1], np.array(top["position"]) + wave, atol=1e-13)


def modal_defect(amplitudes, omega, dt):
    """Largest defect of c_(n+1) - 2 c_n + c_(n-1) = -(omega dt)^2 c_(n+1), integrated, relative to the motion."""
    exact = [amplitudes[0], amplitudes[1]]
    for _ in amplitudes[2:]:
        exact.append((2 * exact[-1] - exact[-2]) / (1 + (omega * dt) ** 2))
    return np.abs(np.array(exact) - amplitudes).max() / np.abs(amplitudes).max()


@pytest.mark.parametrize(("degree", "elements"), [(1, 8), (2, 4)])
def test_taut_string_across(degree, elements):
    """Small transverse vibration: the first mode follows its own recurrence with the semi-discrete frequency."""
    table = reference("frequencies")["taut_string"]
    e, L, density, EA = table["unit"]["e"], 2.0, 1.5, 300.0
    T0 = e * EA
    omega = table["unit"]["omega_trans"][0] * np.sqrt(T0 / density) / L
    omega *= 1 + table["rel_error_mode1"][str(degree)][str(elements)]
    s = np.linspace(0, L, elements + 1)
    along, across = np.array([0.6, 0.0, 0.8]), np.array([0.8, 0.0, -0.6])
    points = (1 + e) * s[:, None] * along + 2e-5 * np.sin(np.pi * s / L)[:, None] * across
    dt = 2 * np.pi / omega / 60
    scene = {
        "gravity": 0.0,
        "cable": {
            "length": L,
            "line_density": density,
            "axial_stiffness": EA,
            "elements": elements,
            "position_degree": degree,
            "tension_degree": degree - 1,
            "top": {"kind": "fixed", "position": ((1 + e) * L * along).tolist()},
        },
        "initial": {"kind": "polyline", "points": points.tolist()},
        "time": {"end": 90 * dt, "step": dt, "output_every": dt},
        "solver": {"step_tolerance": 1e-12},
    }
    run = simulate_evenly(scene)
    M, K = string_matrices(degree, s, np.ones_like)
    values, modes = eigh(K[1:-1, 1:-1], M[1:-1, 1:-1])
    assert omega == pytest.approx(np.sqrt(values[0] * T0 / (1 + e) / density), rel=1e-9)
    y = run.cable_position.values @ across
    amplitude = y[:, 1:-1] @ M[1:-1, 1:-1] @ modes[:, 0]
    assert modal_defect(amplitude, omega, dt) < 1e-5
    assert modal_defect(amplitude, omega * 1.001, dt) > 1e-3  # the test would see a wrong frequency
    assert amplitude.min() < -0.5 * amplitude.max()


def test_elastic_bar_along():
    """A straight cable under a sudden end force is linear: every node follows the recurrence to rounding."""
    L, density, EA, elements, dt = 2.0, 1.5, 300.0, 6, 0.01
    direction, force = np.array([2.0, -1.0, 2.0]) / 3, 20.0
    scene = {
        "gravity": 0.0,
        "cable": {
            "length": L,
            "line_density": density,
            "axial_stiffness": EA,
            "elements": elements,
            "top": {
                "kind": "free",
                "position": (L * direction).tolist(),
                "force": (force * direction).tolist(),
            },
        },
        "initial": {"kind": "straight"},
        "time": {"end": 0.6, "step": dt, "output_every": dt},
    }
    run = simulate_evenly(scene)
    s = np.linspace(0, L, elements + 1)
    M, K = (A[1:, 1:] for A in string_matrices(1, s, np.ones_like))
    x = run.cable_position.values @ direction - s
    across = run.cable_position.values - (x + s)[:, :, None] * direction
    assert np.abs(across).max() < 1e-12 * L
    load = np.zeros(elements)
    load[-1] = force
    previous, current = x[0, 1:], x[1, 1:]
    for n in range(2, len(x)):
        rhs = density * M @ (2 * current - previous) / dt**2 + load
        previous, current = current, np.linalg.solve(density * M / dt**2 + EA * K, rhs)
        assert np.abs(x[n, 1:] - current).max() < 1e-10 * L
        assert run.cable_tension.values[n] == pytest.approx(EA * np.diff(x[n]) / (L / elements), abs=1e-7 * force)
    assert x[:, -1].max() > 1.2 * force * L / EA  # overshoots its rest position
    angle = np.pi / (2 * elements)  # first frequency of the fixed-free bar in linear elements
    c = np.sqrt(EA / density)
    omega = 2 * elements / L * c * np.sqrt(3) * np.sin(angle / 2) / np.sqrt(2 + np.cos(angle))
    values, modes = eigh(EA * K, density * M)
    assert omega == pytest.approx(np.sqrt(values[0]), rel=1e-12)
    amplitude = (x[:, 1:] - s[1:] * force / EA) @ M @ modes[:, 0]
    assert modal_defect(amplitude, omega, dt) < 1e-9


@pytest.mark.parametrize(("degree", "elements"), [(1, 8), (2, 4)])
def test_hanging_chain(degree, elements):
    """Small swing of an inextensible chain: semi-discrete frequencies of the first two modes."""
    table = reference("frequencies")["hanging_chain"]
    L, density = 2.3, 1.7
    s = np.linspace(0, L, elements + 1)
    x = 3e-5 * L * ((s / L) + 0.7 * (s / L) ** 3)
    drop = np.concatenate([[0.0], np.cumsum(np.sqrt(np.diff(s) ** 2 - np.diff(x) ** 2))])
    points = x[:, None] * AZIMUTH + drop[:, None] * DOWN
    errors = table["semidiscrete_rel_error"][str(degree)][str(elements)]
    omegas = [w * np.sqrt(G / L) * (1 + err) for w, err in zip(table["omega_unit"], errors, strict=True)]
    dt = 2 * np.pi / omegas[0] / 90
    scene = {
        "cable": {
            "length": L,
            "line_density": density,
            "elements": elements,
            "position_degree": degree,
            "tension_degree": degree - 1,
            "top": {"kind": "free"},
        },
        "initial": {"kind": "polyline", "points": points.tolist()},
        "time": {"end": 100 * dt, "step": dt, "output_every": dt},
        "solver": {"step_tolerance": 1e-12},
    }
    run = simulate_evenly(scene)
    M, K = (A[1:, 1:] for A in string_matrices(degree, s, lambda s: G * (L - s)))
    values, modes = eigh(K, M)
    y = run.cable_position.values[:, 1:] @ AZIMUTH
    for mode in range(2):
        assert np.sqrt(values[mode]) == pytest.approx(omegas[mode], rel=1e-8)
        amplitude = y @ M @ modes[:, mode]
        assert modal_defect(amplitude, omegas[mode], dt) < 1e-5
    amplitude = y @ M @ modes[:, 0]
    assert modal_defect(amplitude, omegas[0] * 1.001, dt) > 1e-3
    assert amplitude.min() < -0.5 * amplitude.max()


def test_residual_of_every_accepted_step_is_small():
    scene = merged(CABLES["elastic between fixed ends"], time={"end": 0.2, "step": 0.01})
    with running(scene) as simulation:
        for _ in range(20):
            simulation.step(0.01)
            for block, size in simulation.system.residual_by_block().items():
                assert size < 1e-10, block
