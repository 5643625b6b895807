"""A buoy without a line: torque-free tops, free flight, heave and pitch of a floating cylinder.

Source: elliptic functions for Euler's top and periods in tests/reference; recurrences of backward Euler.
"""

import numpy as np
import pytest
from dynamics_helpers import merged, quaternion_product, rates, rotation_matrix, simulate_evenly
from helpers import reference

BUOY = reference("buoy")
CENTER = (400 * 0.5 + 150 * 2 + 150 * 3) / 700
CYLINDER = {
    "sea": {"depth": 20.0},
    "buoy": {
        "hull": BUOY["cylinder"]["hull"],
        "mass": 400.0,
        "center_of_mass": 0.5,
        "inertia": [192.0, 288.0],
        "point_masses": [{"mass": 150.0, "height": 2.0}, {"mass": 150.0, "height": 3.0}],
    },
}


def top(inertia, omega, q0, dt, end):
    return {
        "gravity": 0.0,
        "buoy": {"mass": 3.0, "center_of_mass": 0.4, "inertia": list(inertia)},
        "initial": {
            "buoy_position": [0.3, -0.2, 0.7],
            "buoy_orientation": list(q0),
            "buoy_velocity": [0.5, -0.25, 2.0],
            "buoy_angular_velocity": list(omega),
        },
        "time": {"end": end, "step": dt},
    }


@pytest.mark.parametrize("name", ["torque_free_near_axis3", "torque_free_tumble"])
def test_torque_free_top(name):
    """Euler's top against its elliptic functions: order 1; L_C, p and |q| are conserved to the last digit."""
    case = BUOY[name]
    errors = []
    for dt in (0.02, 0.01, 0.005):
        run = simulate_evenly(top(case["I"], case["omega_body0"], case["q0"], dt, 2.0))
        assert run.angular_momentum.values == pytest.approx(np.tile(case["L_inertial"], (len(run.time), 1)), abs=1e-14)
        assert run.linear_momentum.values == pytest.approx(np.tile([1.5, -0.75, 6.0], (len(run.time), 1)), abs=1e-13)
        assert np.linalg.norm(run.buoy_orientation, axis=1) == pytest.approx(1.0, abs=1e-15)
        straight = [0.3, -0.2, 0.7] + run.time.values[:, None] * [0.5, -0.25, 2.0]
        assert run.buoy_position.values == pytest.approx(straight, abs=1e-11)
        worst = 0.0
        for row in (row for row in case["table"] if row["t"] <= 2):
            R = rotation_matrix(run.buoy_orientation.values[round(row["t"] / dt)])
            worst = max(worst, np.abs(R - rotation_matrix(row["q"])).max())
        errors.append(worst)
    assert np.all(np.abs(rates(errors) - 1) < 0.1), errors
    assert errors[-1] < 0.02


def test_top_follows_its_recurrence():
    """q_(n+1) = (q_n + dt/2 omega(q_(n+1)) o q_(n+1)) normalised, for three different moments of inertia."""
    inertia, dt = np.array([1.3, 2.1, 2.9]), 0.05
    q0 = np.array([0.5, -0.1, 0.7, 0.3]) / np.linalg.norm([0.5, -0.1, 0.7, 0.3])
    scene = top(inertia, [0.9, -1.4, 0.6], q0, dt, 2.0) | {"solver": {"step_tolerance": 1e-11}}
    run = simulate_evenly(scene)
    L_C = rotation_matrix(q0) @ (inertia * (rotation_matrix(q0).T @ [0.9, -1.4, 0.6]))
    q = q0
    for recorded in run.buoy_orientation.values[1:]:
        new = q
        for _ in range(200):
            R = rotation_matrix(new)
            omega = np.concatenate([[0.0], R @ (R.T @ L_C / inertia)])
            new = q + 0.5 * dt * quaternion_product(omega, new)
        q = new / np.linalg.norm(new)
        assert recorded == pytest.approx(q, abs=1e-11)
    assert np.abs(run.buoy_orientation.values[-1] - q0).max() > 0.3


def test_free_fall():
    """p falls by M g dt a step; backward Euler's path is z = -g dt^2 n (n + 1)/2."""
    dt, n = 0.01, np.arange(51)
    scene = merged(top([1.3, 2.1, 2.9], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], dt, 0.5), gravity=9.7)
    run = simulate_evenly(scene)
    assert run.linear_momentum.values[:, 2] == pytest.approx(6.0 - 3.0 * 9.7 * dt * n, abs=1e-10)
    path = 0.7 + 2.0 * n * dt - 9.7 * dt**2 * n * (n + 1) / 2
    assert run.buoy_position.values[:, 2] == pytest.approx(path, abs=1e-11)


def test_draft_at_rest():
    run = simulate_evenly(merged(CYLINDER, time={"end": 0.05, "step": 0.01}))
    assert CENTER - run.buoy_position.values[:, 2] == pytest.approx(BUOY["cylinder"]["draft"], abs=1e-4)
    assert np.ptp(run.buoy_position.values[:, 2]) < 1e-10
    assert run.displaced_mass.values == pytest.approx(700.0, rel=1e-9)


def test_heave_follows_its_recurrence():
    """Without fluid coefficients p_t = (M_D - M) g, and the draft is that of a cylinder."""
    rise, dt = 0.05, 0.01
    draft = BUOY["cylinder"]["draft"]
    scene = merged(
        CYLINDER,
        initial={"buoy_position": [0.4, -0.3, CENTER - draft + rise]},
        time={"end": 1.0, "step": dt},
    )
    run = simulate_evenly(scene)
    p, z, M_D = run.linear_momentum.values, run.buoy_position.values, run.displaced_mass.values
    assert np.diff(p[:, 2]) / dt == pytest.approx((M_D[1:] - 700) * 9.81, abs=1e-7 * 700 * 9.81)
    assert np.diff(z[:, 2]) / dt == pytest.approx(p[1:, 2] / 700, abs=1e-9)
    assert np.abs(p[:, :2]).max() < 1e-9 * np.abs(p).max()
    area = np.pi * 1.2**2
    assert pytest.approx(1025 * area * (CENTER - z[:, 2]), abs=1e-9 * 700) == M_D
    k, y, v = 1025 * 9.81 * area / 700, rise, 0.0  # v' = v - dt k y', y' = y + dt v'
    for recorded in z[1:, 2]:
        v = (v - dt * k * y) / (1 + dt**2 * k)
        y = y + dt * v
        assert recorded - (CENTER - draft) == pytest.approx(y, abs=1e-9 * rise)
    assert z[:, 2].min() < CENTER - draft - 0.4 * rise


def period(signal, dt):
    """Mean period of a decaying oscillation about zero, from its first and last zero crossing."""
    crossing = np.flatnonzero(signal[:-1] * signal[1:] < 0)
    t = dt * (crossing + signal[crossing] / (signal[crossing] - signal[crossing + 1]))
    assert len(t) >= 3
    return 2 * (t[-1] - t[0]) / (len(t) - 1)


def without_step(run_of, dt):
    """Period at step zero of a linear oscillator under backward Euler: its frequency is tan(omega_measured dt)/dt."""
    signal = run_of(dt)
    return 2 * np.pi * dt / np.tan(2 * np.pi / period(signal, dt) * dt)


@pytest.mark.parametrize("C_A", ["0", "0.3", "1"])
def test_heave_period(C_A):
    """Small heave about the equilibrium against T = 2 pi sqrt((M + A_33)/(rho g A)), A_33 = C_A rho A d."""
    draft = BUOY["cylinder"]["draft"]

    def heave(dt):
        scene = merged(
            CYLINDER,
            buoy__added_mass=0.7,  # across the axis: not felt
            buoy__axial_added_mass=float(C_A) * 1.5 * draft / 1.2,  # of the bottom as half a sphere of water
            initial={"buoy_position": [0.0, 0.0, CENTER - draft + 0.004]},
            time={"end": 2.0, "step": dt},
        )
        return simulate_evenly(scene).buoy_position.values[:, 2] - (CENTER - draft)

    assert without_step(heave, 0.005) == pytest.approx(BUOY["cylinder"]["T_heave"][C_A], rel=1e-5)


@pytest.mark.parametrize("C_A", ["0", "0.3", "1"])
def test_pitch_period(C_A):
    """Small pitch: restoring moment of the water plane and added moment of inertia."""
    draft, half = BUOY["cylinder"]["draft"], np.radians(0.5) / 2

    def pitch(dt):
        scene = merged(
            CYLINDER,
            buoy__added_mass=float(C_A),
            initial={
                "buoy_position": [0.0, 0.0, CENTER - draft],
                "buoy_orientation": [np.cos(half), 0.6 * np.sin(half), 0.8 * np.sin(half), 0.0],
            },
            time={"end": 5.0, "step": dt},
        )
        axis = np.array([rotation_matrix(q)[:, 2] for q in simulate_evenly(scene).buoy_orientation.values])
        assert np.abs(axis @ [0.6, 0.8, 0.0]).max() < 1e-6  # it pitches in the plane across its axis of rotation
        return axis @ [0.8, -0.6, 0.0]

    assert without_step(pitch, 0.01) == pytest.approx(BUOY["cylinder"]["T_pitch"][C_A], rel=1e-3)
