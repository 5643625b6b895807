"""Balances of a coupled run at every step, with loads computed again in numpy.

Source: dense numpy code of the equations (tests/support/dynamics_helpers.py): cable nodes and hull slices.
"""

import itertools

import numpy as np
import pytest
from dynamics_helpers import (
    MOORED,
    Body,
    NumpySea,
    Strips,
    cable_residual,
    merged,
    quaternion_product,
    rotation_matrix,
    running,
    wind_force,
)

from dolfbuoy.results.observe import Observer

#: Everything moves, in all three directions: waves, wind, current and force each have their own heading; it spins too.
ROUGH = merged(
    MOORED,
    cable__elements=6,
    buoy__axial_added_mass=0.6,
    current__direction_deg=70.0,
    waves__direction_deg=-25.0,
    waves__ramp=0.3,
    waves__phase_deg=200.0,
    wind={
        "speed_10m": 25.0,
        "direction_deg": 150.0,
        "area": 6.0,
        "height": 2.6,
        "drag_coefficient": 1.1,
        "air_density": 1.3,
    },
    external_force={"force": [900.0, -700.0, 200.0], "height": 2.2},
    initial__buoy_angular_velocity=[0.15, -0.1, 1.2],
    time__step=0.02,
)

CASES = {
    "elastic, P1-P0": ROUGH,
    "inextensible, P2-P1": merged(
        ROUGH, cable__axial_stiffness=None, cable__position_degree=2, cable__tension_degree=1, cable__elements=4
    ),
    # loaded until it is nearly awash: crests go over its deck
    "submerged at times": merged(
        ROUGH,
        external_force__force=[900.0, -700.0, -41000.0],
        waves__amplitude=0.6,
        waves__period=3.0,
        waves__phase_deg=-90.0,
    ),
}


class Snapshot:
    """The complete state at an instant, starting from the anchor."""

    def __init__(self, simulation):
        cable, problem = simulation.problem.lines, simulation.problem
        u = simulation.system.u
        self.t = simulation.t
        self.r = u[cable.node_dofs[np.argsort(cable.node_s)]]
        cells = np.argsort(cable.cell_ends[:, 0])
        places = np.argsort(cable.T_s[cells], axis=1)
        self.T = np.take_along_axis(u[cable.T_dofs[cells]], places, axis=1)
        self.r_C, self.p, self.q4, self.L_C = np.split(u[problem.buoy.part.slice].copy(), [3, 6, 10])
        self.r_O, self.T_O = np.split(u[problem.attachments[0].slice].copy(), 2)
        (self.T_bnd,), (self.anchor,) = simulation.end_tension, simulation.end_forces["anchor_force"]
        self.R = rotation_matrix(self.q4)
        self.d = self.R[:, 2]


class History:
    """A run of 25 steps: snapshots, residual by block of every step, and the record of the last step."""

    def __init__(self, scene):
        self.scene, self.body, self.dt = scene, Body(scene), scene["time"]["step"]
        with running(scene) as simulation:
            self.snapshots, self.blocks = [Snapshot(simulation)], []
            for _ in range(25):
                simulation.step(self.dt)
                self.snapshots.append(Snapshot(simulation))
                self.blocks.append(simulation.system.residual_by_block())
            recorded = Observer(simulation.problem).values(simulation.end_forces)
            self.recorded = {name: np.squeeze(value) for name, value in recorded.items()}

    def omega(self, s):
        return s.R @ (s.R.T @ s.L_C / self.body.inertia)

    def strips(self, old, new):
        """The hull after a step."""
        omega, L_t = self.omega(new), (new.L_C - old.L_C) / self.dt
        omega_t = new.R @ (new.R.T @ (L_t - np.cross(omega, new.L_C)) / self.body.inertia)
        mass = self.body.mass
        motion = new.p / mass, omega, (new.p - old.p) / self.dt / mass, omega_t
        return Strips(self.scene, new.r_C, new.q4, self.body.center, new.t, motion)


@pytest.fixture(scope="module", params=CASES)
def history(request):
    return History(CASES[request.param])


def test_the_run_is_rough(history):
    """Every term is significant in the states used for the balances below."""
    first, last = history.snapshots[0], history.snapshots[-1]
    assert np.linalg.norm(last.p) > 0.2 * history.body.mass
    assert np.all(np.abs(last.r - first.r).max(axis=0) > 0.01)
    assert np.abs(history.omega(last)).max() > 0.02
    assert np.degrees(np.arccos(last.d[2])) > 1


def test_one_of_the_runs_is_submerged_at_times(history):
    """In it the deck is under water in some steps and dry in others; in the other runs it stays dry."""
    over = []
    for s in history.snapshots:
        deck = s.r_C + (history.scene["buoy"]["hull"][-1][0] - history.body.center) * s.d
        eta = NumpySea(history.scene).at(deck[None, :], s.t)[0][0]
        over.append(eta > deck[2])
    assert any(over) == (history.scene["external_force"]["force"][2] < 0)
    assert not all(over)


def test_residual_of_every_block(history):
    for n, step in enumerate(history.blocks):
        for name, size in step.items():
            assert size < 1e-9, f"{name} after step {n + 1}"


def test_constraints(history):
    """The cable ends in O, O is fixed to the body, the quaternion has norm 1, and action equals reaction."""
    for s in history.snapshots:
        assert s.r[0] == pytest.approx([0.0, 0.0, -history.scene["sea"]["depth"]], abs=1e-14)
        assert s.r[-1] == pytest.approx(s.r_O, abs=1e-11)
        assert s.r_O - s.r_C == pytest.approx(-history.body.center * s.d, abs=1e-11)
        assert np.linalg.norm(s.q4) == pytest.approx(1.0, abs=1e-15 if s.t else 1e-12)
        assert np.array_equal(s.T_bnd, -s.T_O)


def test_momentum_of_every_node(history):
    """Inertia, tension, weight and water balance at every node; at the ends they leave the anchor's force and T_bnd.

    Summed over all nodes this is the balance of the whole cable, whose momentum changes by its loads, by T_bnd and by
    what the anchor holds.
    """
    scene, dt = history.scene, history.dt
    v = [(new.r - old.r) / dt for old, new in itertools.pairwise(history.snapshots)]
    for n, s in enumerate(history.snapshots[2:], start=1):
        momentum, strain = cable_residual(scene, s.r, s.T, v[n], (v[n] - v[n - 1]) / dt, s.t)
        size = np.abs(s.T).max()
        momentum[-1] -= s.T_bnd
        momentum[0] -= s.anchor
        assert np.abs(s.anchor).max() > 100
        assert np.abs(momentum).max() < 1e-6 * size
        assert strain < 1e-10


WHIP = {
    "cable": {
        "length": 3.0,
        "line_density": 2.0,
        "elements": 5,
        "top": {"kind": "free", "force": [3.0, 4.0, 5.0]},
        "anchor": [1.0, 2.0, 3.0],
    },
    "initial": {"kind": "polyline", "points": [[1.0, 2.0, 3.0], [2.152, 2.864, 1.08], [2.512, 3.344, 1.08]]},
    "time": {"end": 0.2, "step": 0.01},
}
#: Simpson's rule over nodes and middles, and the trapezoidal rule over the nodes.
WEIGHTS = {1: np.array([1, 2, 2, 2, 2, 1]) / 10, 2: np.array([1, 4, 2, 4, 2, 4, 2, 4, 2, 4, 1]) / 30}


@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2", "generalized-alpha"])
@pytest.mark.parametrize(
    "cable",
    [
        {},
        {"axial_stiffness": 2e3, "damping": 30.0, "position_degree": 2, "tension_degree": 1},
        {"axial_stiffness": 2e3, "slack": "tension-only"},
    ],
    ids=["inextensible", "damped P2-P1", "tension-only"],
)
def test_the_anchor_takes_what_moves_the_cable(cable, scheme):
    """Anchor force, end force and weight add up to the rate of momentum, with the scheme's accelerations."""
    radius = {"spectral_radius": 0.0} if scheme == "generalized-alpha" else {}
    scene = merged(WHIP, cable=WHIP["cable"] | cable, time={**WHIP["time"], "scheme": scheme, **radius})
    with running(scene) as simulation:
        lines, largest = simulation.problem.lines, 0.0
        weights = 3.0 * 2.0 * WEIGHTS[lines.section.position_degree]
        for _ in range(20):
            simulation.step(0.01)
            a = lines.gamma_a.value * simulation.system.u[lines.part.slice] + lines.history_a.x.array
            rate = weights @ a[lines.node_dofs[np.argsort(lines.node_s)]]
            outside = simulation.end_forces["anchor_force"][0] + [3.0, 4.0, 5.0 - 3.0 * 2.0 * 9.81]
            size = np.abs(rate).max()
            assert np.abs(outside - rate).max() < 1e-9 * size
            largest = max(largest, size)
    assert largest > 10


def test_momentum_of_the_buoy(history):
    """p_t = F, L_t = tau_C, r_C,t = p/M and the turn of the quaternion.

    The water's loads are taken slice by slice.
    """
    scene, dt, body = history.scene, history.dt, history.body
    force_ext = np.array(scene["external_force"]["force"])
    for old, new in itertools.pairwise(history.snapshots):
        omega, p_t, L_t = history.omega(new), (new.p - old.p) / dt, (new.L_C - old.L_C) / dt
        force, torque = history.strips(old, new).loads()
        levers = [(scene[key]["height"] - body.center) * new.d for key in ("external_force", "wind")]
        forces = [force_ext, wind_force(scene, new.r_C + levers[1], new.t)]
        force = force + sum(forces) + new.T_O + [0, 0, -9.81 * body.mass]
        torque = torque + sum(map(np.cross, levers, forces)) + np.cross(new.r_O - new.r_C, new.T_O)
        torque = torque - scene["buoy"]["rotational_damping"] * (omega @ new.d) * new.d
        size = 9.81 * body.mass
        assert np.abs(p_t - force).max() < 1e-4 * size
        spin_t = (new.L_C @ new.d - old.L_C @ old.d) / dt  # made by the torque about the axis, not by the steps
        torque = torque + (L_t @ new.d - spin_t + new.L_C @ np.cross(omega, new.d)) * new.d
        assert np.abs(L_t - torque).max() < 1e-4 * size
        assert (new.r_C - old.r_C) / dt == pytest.approx(new.p / body.mass, abs=1e-9)
        before = new.q4 - 0.5 * dt * quaternion_product(np.concatenate([[0.0], omega]), new.q4)
        assert before / np.linalg.norm(before) == pytest.approx(old.q4, abs=1e-11)


def test_what_is_recorded(history):
    """Wet hull, elevation above C and tensions in the record, at the end."""
    last, values = history.snapshots[-1], history.recorded
    mass, center, wet, diameter = history.strips(*history.snapshots[-2:]).wet()
    assert values["displaced_mass"] == pytest.approx(mass, rel=1e-5)
    assert values["buoyancy_center"] == pytest.approx(center, abs=1e-5)
    assert values["submerged_length"] == pytest.approx(wet, rel=1e-5)
    assert values["submerged_diameter"] == pytest.approx(diameter, rel=1e-9)
    eta = NumpySea(history.scene).at(last.r_C[None, :], last.t)[0][0]
    assert abs(eta) > 0.005
    assert values["surface_elevation"] == pytest.approx(eta, abs=1e-10)
    assert values["cone_angle"] == pytest.approx(np.degrees(np.arccos(last.d[2])), abs=1e-6)
    assert values["tension_top"] == pytest.approx(np.linalg.norm(last.T_bnd))
    assert values["anchor_force"] == pytest.approx(last.anchor)
    assert values["tension_anchor"] == pytest.approx(last.T[0, 0], rel=1e-12)
    assert values["linear_momentum"] == pytest.approx(last.p)
    assert values["angular_momentum"] == pytest.approx(last.L_C)
    assert values["mooring_force"] == pytest.approx(last.T_O)
