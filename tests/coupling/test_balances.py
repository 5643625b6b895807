"""Balances of a coupled run at every step, with loads that are worked out again in numpy."""

import itertools

import numpy as np
import pytest
from dynamics_helpers import MOORED, cable_residual, hull_loads, merged, quaternion_product, rotation_matrix, running

#: Everything moves, in all three directions: waves, current and force each have their own heading.
ROUGH = merged(
    MOORED,
    cable__elements=6,
    current__direction_deg=70.0,
    waves__direction_deg=-25.0,
    waves__ramp=0.3,
    waves__phase_deg=200.0,
    external_force__force=[900.0, -700.0, 200.0],
    external_force__height=2.2,
    solver__hull_cells=100,
    time__step=0.02,
)

CASES = {
    "elastic, P1-P0": ROUGH,
    "inextensible, P2-P1": merged(
        ROUGH, cable__axial_stiffness=None, cable__position_degree=2, cable__tension_degree=1, cable__elements=4
    ),
}


class Snapshot:
    """Everything of an instant, in order from the anchor."""

    def __init__(self, simulation):
        cable, problem = simulation.cable, simulation.problem
        u = simulation.system.u
        self.t = simulation.t
        self.r = u[cable.node_dofs[np.argsort(cable.node_s)]]
        cells = np.argsort(cable.cell_ends[:, 0])
        places = np.argsort(cable.T_s[cells], axis=1)
        self.T = np.take_along_axis(u[cable.T_dofs[cells]], places, axis=1)
        self.r_C, self.p, self.q4, self.L_C = np.split(u[problem.state_part.slice].copy(), [3, 6, 10])
        self.r_O, self.T_O = np.split(u[problem.mooring_slice].copy(), 2)
        self.T_bnd = np.array(simulation.end_tension)


@pytest.fixture(scope="module", params=CASES)
def history(request):
    """(scene, simulation's constants, snapshots, residual by block of every step)."""
    scene = CASES[request.param]
    with running(scene) as simulation:
        snapshots, blocks = [Snapshot(simulation)], []
        for _ in range(25):
            simulation.step(scene["time"]["step"])
            snapshots.append(Snapshot(simulation))
            blocks.append(simulation.system.residual_by_block())
    return scene, snapshots, blocks


MASS, CENTER = 700.0, (400 * 0.5 + 150 * 2 + 150 * 3) / 700
STEINER = 400 * (0.5 - CENTER) ** 2 + 150 * (2 - CENTER) ** 2 + 150 * (3 - CENTER) ** 2
INERTIA = np.array([192 + STEINER, 192 + STEINER, 288.0])


def omega_of(s):
    R = rotation_matrix(s.q4)
    return R @ (R.T @ s.L_C / INERTIA)


def test_the_run_is_rough(history):
    """The balances below are those of a state in which every term counts."""
    _, snapshots, _ = history
    first, last = snapshots[0], snapshots[-1]
    assert np.linalg.norm(last.p) > 0.2 * MASS
    assert np.all(np.abs(last.r - first.r).max(axis=0) > 0.01)
    assert np.abs(omega_of(last)).max() > 0.02
    assert np.degrees(np.arccos(rotation_matrix(last.q4)[2, 2])) > 1


def test_residual_of_every_block(history):
    _, _, blocks = history
    for n, step in enumerate(blocks):
        for name, size in step.items():
            assert size < 1e-9, f"{name} after step {n + 1}"


def test_constraints(history):
    """The cable ends in O, O is fixed to the body, the quaternion has length 1, and action equals reaction."""
    scene, snapshots, _ = history
    for s in snapshots:
        assert s.r[0] == pytest.approx([0.0, 0.0, -scene["sea"]["depth"]], abs=1e-14)
        assert s.r[-1] == pytest.approx(s.r_O, abs=1e-11)
        assert s.r_O - s.r_C == pytest.approx(-CENTER * rotation_matrix(s.q4)[:, 2], abs=1e-11)
        assert np.linalg.norm(s.q4) == pytest.approx(1.0, abs=1e-15 if s.t else 1e-12)
        assert np.array_equal(s.T_bnd, -s.T_O)


def test_momentum_of_every_node(history):
    """Inertia, tension, weight and water balance at every free node; at the upper end they leave T_bnd.

    Summed over all nodes this is the balance of the whole cable, whose momentum changes by its loads, by T_bnd and by
    what the anchor holds.
    """
    scene, snapshots, _ = history
    dt = scene["time"]["step"]
    v = [np.zeros_like(snapshots[0].r)]
    for old, new in itertools.pairwise(snapshots):
        v.append((new.r - old.r) / dt)
        momentum, strain = cable_residual(scene, new.r, new.T, v[-1], (v[-1] - v[-2]) / dt, new.t)
        size = np.abs(new.T).max()
        momentum[-1] -= new.T_bnd
        assert np.abs(momentum[1:]).max() < 1e-6 * size
        assert strain < 1e-10


def test_momentum_of_the_buoy(history):
    """p_t = F, L_t = tau_C, r_C,t = p/M and the turn of the quaternion, with the water's loads strip by strip."""
    scene, snapshots, _ = history
    dt, force_ext = scene["time"]["step"], np.array(scene["external_force"]["force"])
    for old, new in itertools.pairwise(snapshots):
        omega, p_t, L_t = omega_of(new), (new.p - old.p) / dt, (new.L_C - old.L_C) / dt
        R = rotation_matrix(new.q4)
        d = R[:, 2]
        omega_t = R @ (R.T @ (L_t - np.cross(omega, new.L_C)) / INERTIA)
        force, torque = hull_loads(scene, new.r_C, new.q4, CENTER, new.p / MASS, omega, p_t / MASS, omega_t, new.t)
        force = force + force_ext + new.T_O + [0, 0, -9.81 * MASS]
        torque = torque + np.cross((scene["external_force"]["height"] - CENTER) * d, force_ext)
        torque = torque + np.cross(new.r_O - new.r_C, new.T_O)
        torque = torque - scene["buoy"]["rotational_damping"] * (omega @ d) * d
        size = 9.81 * MASS
        assert np.abs(p_t - force).max() < 2e-4 * size
        assert np.abs(L_t - torque).max() < 2e-4 * size
        assert (new.r_C - old.r_C) / dt == pytest.approx(new.p / MASS, abs=1e-9)
        before = new.q4 - 0.5 * dt * quaternion_product(np.concatenate([[0.0], omega]), new.q4)
        assert before / np.linalg.norm(before) == pytest.approx(old.q4, abs=1e-11)
