"""The assembled Jacobian of the coupled system against finite differences of its residual.

Taylor's remainder |F(u + h d) - F(u) - h J d| must fall as h^2 for directions d in every block of unknowns and in every
block of equations, at a state where nothing is zero: tilted, half submerged, moving fast through waves and current.

Source: finite differences of the residual; a table of couplings written by hand.
"""

import math

import numpy as np
import pytest
from petsc4py import PETSc
from scipy.spatial.transform import Rotation

from dolfbuoy import load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.results.observe import Observer
from dolfbuoy.scene.waves import Waves

TILT = math.radians(40)
STEPS = 1e-4 * 0.5 ** np.arange(5)

#: (equation, unknown) that must couple in dynamics; every other block must be empty.  Equations have the names of their
#: unknowns: "mooring point r_O" is the rigid link (9), "mooring force T_O" the attachment (29)_1.
r, T, r_C, p, q4, L_C, r_O, T_O = (
    "cable position",
    "cable tension",
    "buoy position r_C",
    "buoy momentum p",
    "buoy orientation q_4",
    "buoy angular momentum L_C",
    "mooring point r_O",
    "mooring force T_O",
)
DYNAMIC = {
    r: {r, T, T_O},
    T: {r, T},
    r_C: {r_C, p},
    p: {r_C, p, q4, L_C, T_O},
    q4: {q4, L_C},
    L_C: {r_C, p, q4, L_C, T_O},
    r_O: {r_C, q4, r_O},
    T_O: {r, r_O},
}
TORQUE = "buoy torque balance"  # the unknowns are the vector part of q_4
STATIC = {
    r: {r, T, T_O},
    T: {r, T},
    r_C: {r_C, q4, TORQUE, T_O},
    q4: {q4, TORQUE},
    TORQUE: {r_C, q4, TORQUE, T_O},
    r_O: {r_C, q4, TORQUE, r_O},
    T_O: {r, r_O},
}


def coupled_scene(elastic=True, kinks=False, **buoy):
    """All effects at once.  kinks: of waves and current at the surface."""
    cable = {"length": 14.0, "line_density": 7.3, "diameter": 0.05, "elements": 3, "added_mass": 0.4}
    cable |= {"normal_drag": 0.9, "tangential_drag": 0.2, "anchor": [0.2, -0.1, -12.0]}
    if elastic:
        cable |= {"axial_stiffness": 3e4, "position_degree": 2, "tension_degree": 1}
    masses = [{"mass": 60.0, "height": 2.1}, {"mass": 35.0, "height": -0.4}]
    body = {"hull": [[0, 1.1], [0.5, 1.4], [1.6, 1.2]], "mass": 350.0, "center_of_mass": 0.6, "point_masses": masses}
    body |= {"mooring_height": 0.23, "added_mass": 0.35, "normal_drag": 0.8, "axial_added_mass": 0.6}
    body |= {"axial_drag": 1.3, "rotational_damping": 45.0, "rotational_added_mass": 0.7, "disk_averages": True}
    body |= {"wave_damping": [800.0, 500.0]}
    return load_scene(
        {
            "sea": {"depth": 12.0, "density": 1013.0},
            "cable": cable,
            "buoy": body | buoy,
            "waves": {"amplitude": 0.4, "period": 4.3, "direction_deg": 33.0, "phase_deg": 17.0, "ramp": 7.0}
            | {"stretching": "wheeler" if kinks else "none"},
            "current": {"speed": 0.7, "direction_deg": -52.0, "profile": "power" if kinks else "uniform"},
            "solver": {"hull_quadrature_degree": 29},
            "wind": {"speed_10m": 11.0, "direction_deg": 71.0, "area": 1.7, "height": 2.4, "drag_coefficient": 1.1},
            "external_force": {"force": [120.0, -80.0, 40.0], "height": 1.9},
        }
    )


def tilted_quaternion(rng):
    """A tilt of 40 degrees and a rotation about the axis, not of unit norm."""
    heading, spin = rng.uniform(0, 2 * math.pi, 2)
    tilt = Rotation.from_rotvec(TILT * np.array([math.cos(heading), math.sin(heading), 0]))
    x, y, z, w = (tilt * Rotation.from_rotvec([0, 0, spin])).as_quat()
    return 1.07 * np.array([w, x, y, z])


def random_state(problem, rng):
    """Put an asymmetric state into the system; velocities of metres per second."""
    system, scene, u = problem.system, problem.scene, problem.system.u
    problem.lines.set_shape(
        u,
        lambda s: (
            np.array(scene.network.pieces[0].ends[0].top.position)
            + np.column_stack([0.3 * s, 0.1 * s * np.sin(s), 0.8 * s + 0.01 * s**2])
        ),
        lambda s: 900.0 + 130.0 * s,
    )
    u[problem.lines.part.slice] *= 1 + 0.02 * rng.standard_normal(problem.lines.part.size)
    problem.set_time(3.1)
    pose = np.array([1.3, -0.7, -0.15])
    quaternion = tilted_quaternion(rng)
    u[problem.attachments[0].slice] = [*(pose + rng.uniform(-0.5, 0.5, 3)), 300.0, -450.0, -1100.0]
    if problem.dynamic:
        cable, buoy, h = problem.lines, problem.buoy, 0.13
        momentum, spin = np.array([600.0, -500.0, 350.0]), np.array([110.0, -140.0, 60.0])
        state = np.concatenate([pose, momentum, quaternion, spin])
        cable.gamma_v.value, cable.gamma_a.value = 1 / h, 1.4 / h**2
        r_now = u[problem.lines.part.slice]
        cable.history_v.x.array[:] = -r_now / h + rng.uniform(-2, 2, len(r_now))
        cable.history_a.x.array[:] = -1.4 * r_now / h**2 + rng.uniform(-3, 3, len(r_now))
        buoy.gamma.value = 1 / h
        buoy.history.x.array[:] = -state / h + 0.1 * np.maximum(np.abs(state), 1) * rng.uniform(-1, 1, 13)
    else:
        state = np.concatenate([pose, quaternion])
        problem.buoy.relaxation.value = 0.7
        problem.buoy.reference.x.array[:] = state + 0.05 * rng.standard_normal(7)
    u[problem.buoy.part.slice] = state
    for contribution in [*system.residuals, *system.jacobians]:
        contribution.prepare()
    system.set_scales(7.7)


class Linearised:
    """Residual and Jacobian in the scaled free unknowns, split by block."""

    def __init__(self, problem):
        self.system = system = problem.system
        self.u0 = system.u.copy()
        self.names = [b.name for b in system.blocks if len(b.dofs)]
        free = {dof: k for k, dof in enumerate(system.order)}
        self.members = {b.name: np.array([free[i] for i in b.dofs if i in free]) for b in system.blocks if len(b.dofs)}
        system.publish()
        system.assemble_jacobian()
        n = len(system.order)
        dense = system.A.convert(PETSc.Mat.Type.DENSE)
        self.J = system.row_scales[:, None] * dense.getDenseArray()[:n, :n] * system.unknown_scales[None, :]
        self.F0 = self.residual(np.zeros(n))

    def residual(self, step):
        self.system.u[:] = self.u0
        self.system.u[self.system.order] += step * self.system.unknown_scales
        self.system.publish()
        return self.system.evaluate()[self.system.order] * self.system.row_scales

    def block(self, row, column):
        return self.J[np.ix_(self.members[row], self.members[column])]


#: Three components in as many directions; a scene refuses them without stretching, which here would make kinks.
IRREGULAR = {"components": [[0.2, 6.1, 50.0, 17.0], [0.25, 4.3, 10.0, 250.0], [0.08, 2.9, -20.0, 111.0]]}
IRREGULAR |= {"kinematics": "exact", "ramp": 7.0}


def irregular_scene(**changes):
    """The coupled scene in a sea of three components."""
    waves = Waves(**IRREGULAR | changes).model_copy(update={"stretching": "none"})
    return coupled_scene().model_copy(update={"waves": waves})


@pytest.fixture(scope="module", params=["elastic", "inextensible", "static", "irregular"])
def linearised(request):
    scene = irregular_scene() if request.param == "irregular" else coupled_scene(request.param != "inextensible")
    problem = Problem(scene, dynamic=request.param != "static")
    random_state(problem, np.random.default_rng(5))
    result = Linearised(problem)
    result.table = dict(STATIC if request.param == "static" else DYNAMIC)
    if request.param == "inextensible":
        result.table[T] = {r}
    yield result
    problem.destroy()


def test_state_is_tilted_and_half_submerged():
    """The state of these tests is as described."""
    problem = Problem(coupled_scene(), dynamic=True)
    random_state(problem, np.random.default_rng(5))
    found = Observer(problem).values({"end_tension": np.zeros(3)})
    values = {name: np.squeeze(value) for name, value in found.items()}
    full = problem.scene.sea.density * problem.buoy.shape.volume()
    assert 0.3 < values["displaced_mass"] / full < 0.7
    assert abs(values["cone_angle"] - 40) < 1e-6
    assert abs(np.linalg.norm(values["linear_momentum"]) / problem.buoy.mass.mass) > 1.5
    problem.destroy()


def test_blocks_couple_as_the_equations_do(linearised):
    """A block has a derivative exactly where the equations couple."""
    assert set(linearised.names) == set(linearised.table)
    for row in linearised.names:
        for column in linearised.names:
            size = np.abs(linearised.block(row, column)).max()
            assert (size > 1e-7) == (column in linearised.table[row]), f"d({row})/d({column}) = {size}"


def test_taylor_remainder_is_of_second_order(linearised):
    """In random directions of each block of unknowns, for each block of equations."""
    rng, nonlinear = np.random.default_rng(11), 0
    for column in linearised.names:
        direction = np.zeros(len(linearised.F0))
        direction[linearised.members[column]] = rng.uniform(-1, 1, len(linearised.members[column]))
        linear = linearised.J @ direction
        remainders = [linearised.residual(h * direction) - linearised.F0 - h * linear for h in STEPS]
        for row in linearised.table:
            inside = linearised.members[row]
            sizes = np.array([np.abs(remainder[inside]).max() for remainder in remainders])
            rounding = 1e-12 * max(1.0, np.abs(linearised.F0[inside]).max())
            if sizes.max() < 1e3 * rounding:
                assert np.all(sizes < 1e3 * rounding)  # the block is linear or empty
                continue
            nonlinear += 1
            orders = np.log2(sizes[:-1] / sizes[1:])[sizes[1:] > 30 * rounding]
            assert len(orders) > 0
            assert np.all(np.abs(orders - 2) < 0.1), f"d({row})/d({column}): {orders}"
            derivative = np.abs(linear[inside]).max() * STEPS[-1]
            assert sizes[-1] < 0.05 * derivative, f"d({row})/d({column}): {sizes[-1]} of {derivative}"
    assert nonlinear >= 6


def test_taylor_remainder_in_all_unknowns_at_once(linearised):
    direction = np.random.default_rng(12).uniform(-1, 1, len(linearised.F0))
    linear = linearised.J @ direction
    sizes = [np.abs(linearised.residual(h * direction) - linearised.F0 - h * linear).max() for h in STEPS]
    assert np.all(np.abs(np.log2(np.divide(sizes[:-1], sizes[1:])) - 2) < 0.1)


def test_kinks_at_the_surface():
    """Stretched waves and a power-law current end at the surface with a kink in the midst of the cut hull.

    There the points of the hull, which stay where they are in differentiation, are good to 1e-4.
    """
    problem = Problem(coupled_scene(kinks=True), dynamic=True)
    random_state(problem, np.random.default_rng(5))
    linearised, rng = Linearised(problem), np.random.default_rng(13)
    for _ in range(5):
        direction = rng.uniform(-1, 1, len(linearised.F0))
        change = (linearised.residual(1e-5 * direction) - linearised.residual(-1e-5 * direction)) / 2e-5
        assert np.abs(change - linearised.J @ direction).max() < 1e-4 * np.abs(change).max()
    problem.destroy()


def test_jacobian_changes_with_the_mooring_point():
    """mooring_height is the lever of T_O and the position of r_O, and nothing else."""
    jacobians = []
    for height in (0.23, 0.31):
        problem = Problem(coupled_scene(mooring_height=height), dynamic=True)
        random_state(problem, np.random.default_rng(5))
        jacobians.append(Linearised(problem))
        problem.destroy()
    first, second = jacobians
    changed = {
        (row, column)
        for row in DYNAMIC
        for column in DYNAMIC
        if np.any(first.block(row, column) != second.block(row, column))
    }
    assert changed == {(r_O, q4), (L_C, q4), (L_C, T_O)}
