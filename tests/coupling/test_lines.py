"""Unconnected lines on one mesh give independent answers.

Source: each line alone.
"""

import numpy as np
import pytest
import ufl
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model.lines import Lines
from dolfbuoy.model.problem import Problem
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.statics import catenary

SEA = {"depth": 30.0}
TOP = {"kind": "prescribed", "amplitude": [0.3, 0.2, 0.5], "period": 2.0, "phase_deg": 30.0}
CABLE = {"length": 40.0, "line_density": 12.0, "diameter": 0.05, "elements": 7, "position_degree": 2}
CABLE |= {"tension_degree": 1, "added_mass": 0.9, "normal_drag": 1.1, "tangential_drag": 0.1}
FIRST = CABLE | {"axial_stiffness": 3e6, "top": TOP | {"position": [20.0, 3.0, -4.0]}}
SECOND = CABLE | {"axial_stiffness": 8e5, "length": 33.0, "elements": 4, "line_density": 21.0, "normal_drag": 0.6}
SECOND |= {"anchor": [50.0, 5.0, -28.0], "top": TOP | {"position": [60.0, -2.0, 0.0], "period": 3.0}}
REST = {"sea": SEA, "current": {"speed": 0.6, "direction_deg": 40.0}, "time": {"end": 1.0, "step": 0.02}}


def alone(cable):
    return load_scene({**REST, "cable": cable})


def pair(first, second):
    """A scene of both lines."""
    return load_scene({**REST, "cable": [{**first, "name": "first"}, {**second, "name": "second"}]})


def steps(problem, pieces, count=10):
    """Shapes and tensions of the lines after several backward Euler steps from the static catenaries."""
    lines, u, h = problem.lines, problem.system.u, 0.02
    for k, piece in enumerate(pieces):
        c, (low, high) = piece.section, piece.ends
        w = catenary.between(low.top.position, high.top.position, c.length, 80.0, c.axial_stiffness)
        lines.set_shape(u, w.position, w.tension, k)
    problem.set_time(0.0)
    r, v = u[lines.part.slice].copy(), np.zeros(lines.part.size)
    lines.gamma_v.value, lines.gamma_a.value = 1 / h, 1 / h**2
    problem.newton.set_scales(1 / h)
    for n in range(count):
        lines.history_v.x.array[:], lines.history_a.x.array[:] = -r / h, -r / h**2 - v / h
        problem.set_time((n + 1) * h)
        problem.newton.solve()
        new = u[lines.part.slice].copy()
        r, v = new, (new - r) / h
    return [line_state(problem, k) for k in range(len(pieces))]


def line_state(problem, k):
    lines, u = problem.lines, problem.system.u
    nodes, cells = np.flatnonzero(lines.line_of_node == k), np.flatnonzero(lines.line_of_cell == k)
    nodes, cells = nodes[np.argsort(lines.node_s[nodes])], cells[np.argsort(lines.cell_ends[cells, 0])]
    forces = np.array([problem.anchor_force(cable=k), problem.end_tension(cable=k)])
    return u[lines.node_dofs[nodes]], np.sort(u[lines.T_dofs[cells]], axis=1), forces


@pytest.fixture(scope="module")
def answers():
    """(two lines on one mesh, each line alone)."""
    first, second = alone(FIRST), alone(SECOND)
    both = Problem(pair(FIRST, SECOND), dynamic=True, comm=MPI.COMM_SELF)
    found = steps(both, both.network.pieces)
    both.destroy()
    single = []
    for scene in (first, second):
        problem = Problem(scene, dynamic=True, comm=MPI.COMM_SELF)
        single += steps(problem, scene.network.pieces)
        problem.destroy()
    return found, single


def test_two_lines_are_two_answers(answers):
    """Shape, tension and end reactions, to rounding; the lines differ in everything but their element pair."""
    for (r, T, force), (r_alone, T_alone, force_alone) in zip(*answers, strict=True):
        np.testing.assert_allclose(r, r_alone, atol=1e-9)
        np.testing.assert_allclose(T, T_alone, rtol=1e-7, atol=1e-7 * np.abs(T_alone).max())
        np.testing.assert_allclose(force, force_alone, rtol=1e-7, atol=1e-7 * np.abs(T_alone).max())


def test_the_lines_move(answers):
    """The lines move, and differently."""
    (r, T, _), (other, T_other, _) = answers[0]
    assert np.ptp(r, axis=0).min() > 1.0
    assert len(r) != len(other)
    assert abs(T.mean() / T_other.mean() - 1) > 0.1


def test_what_lines_share_is_no_property_per_cell():
    """Lines that differ only in position have constants only; an inextensible scene has no strain."""
    twin = pair(FIRST, FIRST | {"anchor": [0.0, 40.0, -30.0]})
    equal, different = (Lines(MPI.COMM_SELF, scene, True) for scene in (twin, pair(FIRST, SECOND)))
    count = [len(_coefficients(lines)) for lines in (equal, different)]
    assert count[1] == count[0] + 3  # line density, axial stiffness, normal drag
    chain = alone(FIRST | {"axial_stiffness": float("inf")})
    assert Lines(MPI.COMM_SELF, chain, True).kinematics()[2] is None


def _coefficients(lines):
    return lines.residual(ufl.TestFunction(lines.space)).coefficients()


def test_one_line_is_numbered_as_ever():
    """A single line begins at s = 0."""
    with_one = Simulation(alone(FIRST), MPI.COMM_SELF)
    lines = with_one.problem.lines
    assert lines.begins.tolist() == [0.0]
    assert lines.node_s.max() == pytest.approx(FIRST["length"])
    with_one.problem.destroy()
