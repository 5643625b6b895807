"""PETSc's C callbacks agree with their Python reference to the last bit, and report failures.

Source: tests/support/newton_in_python.py.
"""

import math
import os
import signal

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI
from newton_in_python import InPython

from dolfbuoy import load_scene
from dolfbuoy.errors import SolveError
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.parallel import interruption
from dolfbuoy.solver.newton import Newton
from dolfbuoy.statics.equilibrium import solve_equilibrium

STEPS, MANY_STEPS = 40, 180
UNSETTLED = "rope whose increments are small while rows still change"  # after 165 steps, once
FALLBACKS = 10  # place in a row of `trajectory`
SHORT = merged(MOORED, cable__elements=5)
ROPE = {"length": 1.0, "line_density": 1.0, "slack": "tension-only", "elements": 6}
ROPE |= {"top": {"kind": "fixed", "position": [0.01, 0.0, 0.9]}}
STREAM = {"length": 22.0, "line_density": 27.6, "diameter": 0.08, "elements": 10, "normal_drag": 0.8}
STREAM |= {"tangential_drag": 0.1, "top": {"kind": "fixed", "position": [-12.0, 0.0, -3.5]}}
BENT = {"points": [[0, 0, -20], [67.75 / 68, 0, -20], [-12, 0, -3.5]]}  # not at rest by Newton alone

P2_P1 = {"position_degree": 2, "tension_degree": 1}

RUNS = {
    "new matrices": ("driven", {"solver.keep_jacobian": False}),
    "kept matrices": ("driven", {"time.scheme": "generalized-alpha"}),
    "rope": ("driven-slack", {}),
    UNSETTLED: ("driven-slack", {"solver.step_tolerance": 0.01, "time.step": 0.1}),
    "buoy": ("short", {}),
    "inextensible, P2-P1": (
        merged(SHORT, cable={"axial_stiffness": math.inf, **P2_P1}),
        {"time.scheme": "bdf2", "solver.keep_jacobian": True},
    ),
    "failing steps": ("driven", {"time.step": 0.4, "time.end": 40.0, "solver.petsc": {"snes_max_it": 4}}),
    "adaptive": ("driven", {"time.tolerance": 1e-4}),
    "options of the scene": (SHORT, {"solver.petsc": {"snes_linesearch_type": "l2", "ksp_type": "gmres"}}),
}


def numbers(newton):
    """All that Python and C both change, and the counts of Newton itself."""
    names = "valid", "kept", "checked", "assembled_for", "last_increment", "last_norm"
    found = [float(getattr(newton.numbers, name)) for name in names]
    totals = newton.numbers.residuals_total, newton.numbers.jacobians_total
    return [*found, newton.iterations_total, *totals, newton.fallbacks, newton.numbers.assembled]


def trajectory(scene, steps=STEPS):
    """Every step of a run: time, unknowns, force at the end, and what Newton's method did; the failed steps of it."""
    simulation, rows = Simulation(scene, MPI.COMM_SELF), []
    for _ in zip(range(steps), simulation.run(), strict=False):
        tension = [] if simulation.end_tension is None else simulation.end_tension.ravel()
        rows.append(np.concatenate([[simulation.t], numbers(simulation.newton), simulation.system.u, tension]))
    failed = simulation.control.failed
    simulation.problem.destroy()
    return np.array(rows), failed


def both(monkeypatch, make):
    """What `make` makes in C, and in Python, whose calls are counted."""
    made, begin, oracles = make(), Newton.__init__, []

    def begin_in_python(self, *arguments, **options):
        begin(self, *arguments, **options)
        oracles.append(InPython(self))

    monkeypatch.setattr(Newton, "__init__", begin_in_python)
    results = [made, make()]
    assert sum(oracle.calls for oracle in oracles) > 0
    return results


@pytest.mark.parametrize("name", RUNS)
def test_same_run(name, monkeypatch):
    scene, changes = RUNS[name]
    scene = load_scene(scene, **changes)
    steps = MANY_STEPS if name == UNSETTLED else STEPS
    (in_c, failed), (in_python, failed_too) = both(monkeypatch, lambda: trajectory(scene, steps))
    np.testing.assert_array_equal(in_c, in_python)
    assert np.ptp(in_c[:, -1]) > 0
    assert failed == failed_too
    assert failed > 0 or name != "failing steps"


def equilibrium(scene):
    """Unknowns, route, iterations and numbers of an equilibrium."""
    problem = solve_equilibrium(load_scene(scene), MPI.COMM_SELF)
    found = [*problem.system.u, problem.iterations, *numbers(problem.newton)], problem.route
    problem.destroy()
    return found


@pytest.mark.parametrize(
    ("scene", "route"),
    [
        (MOORED, "newton"),
        (
            {"sea": {"depth": 20.0}, "cable": STREAM, "initial": BENT, "current": {"speed": 4.0}},
            "initial.points, relaxation",
        ),
        ({"gravity": 1.0, "cable": ROPE}, "newton"),
        ({"gravity": 1.0, "cable": ROPE | {"axial_stiffness": 20.0, **P2_P1}}, "newton"),
    ],
    ids=["moored", "strong current", "rope", "elastic rope, P2-P1"],
)
def test_same_equilibrium(scene, route, monkeypatch):
    (in_c, way), (in_python, other) = both(monkeypatch, lambda: equilibrium(scene))
    np.testing.assert_array_equal(in_c, in_python)
    assert way == other == route


def test_same_after_a_fallback(monkeypatch):
    """Solves without a factorisation fail, and those with MUMPS follow."""
    choose = Newton.choose_solver

    def bad(self, package):
        choose(self, package)
        if package == "petsc":
            self.snes.getKSP().getPC().setType("none")

    monkeypatch.setattr(Newton, "choose_solver", bad)
    scene = load_scene(SHORT, time={"end": 0.05, "step": 0.01})
    (in_c, _), (in_python, _) = both(monkeypatch, lambda: trajectory(scene))
    np.testing.assert_array_equal(in_c, in_python)
    assert in_c[-1, FALLBACKS] == 5


@pytest.fixture
def driven():
    """A run of `driven` that has made ten steps."""
    simulation = Simulation(load_scene("driven"), MPI.COMM_SELF)
    march = simulation.run()
    for _ in range(10):
        next(march)
    yield simulation, march
    simulation.problem.destroy()


def test_a_matrix_that_somebody_else_has_used_is_new(driven):
    """And one that nobody has touched is kept."""
    simulation, march = driven
    newton = simulation.newton
    while not newton.numbers.valid:
        next(march)
    made = []
    for touch in (lambda: None, simulation.system.assemble_jacobian):
        touch()
        before = newton.numbers.jacobians_total
        newton.solve()
        made.append(newton.numbers.jacobians_total - before)
    assert made[0] == 0 < made[1]


@pytest.mark.parametrize("error", [ArithmeticError, KeyboardInterrupt])
@pytest.mark.parametrize("evaluation", [1, 2, 3])
def test_what_a_hook_raises_ends_the_solve(driven, error, evaluation):
    """In a residual and in a Jacobian, at once; the next solve knows nothing of it."""
    simulation, _ = driven
    newton, system, calls = simulation.newton, simulation.system, []
    newton.numbers.valid = False  # residual, Jacobian, residual
    start = system.u.copy()

    def bad(values):
        calls.append(True)
        if len(calls) == evaluation:
            raise error("no such state")

    system.hooks.add(bad)
    system.u[:] = start + 1e-4
    with pytest.raises(error, match="no such state"):
        newton.solve()
    assert len(calls) == evaluation
    system.u[:] = start
    newton.solve()
    np.testing.assert_allclose(system.u, start, rtol=0, atol=1e-6 * np.abs(start).max())


def test_an_interruption_ends_the_run(driven, monkeypatch):
    """A signal that comes within the solve, whose callbacks let no Python run."""
    monkeypatch.setattr(interruption, "_received", False)  # what it notes stays behind no longer than the test
    simulation, march = driven
    t = simulation.t
    simulation.system.hooks.add(lambda values: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        next(march)
    assert simulation.t == t


def test_nothing_finite_is_a_failed_solve(driven):
    simulation, _ = driven
    simulation.system.u[:] = np.nan
    with pytest.raises(SolveError, match=r"DIVERGED_FNORM_NAN|DIVERGED_FUNCTION_NANORINF"):
        simulation.newton.solve()
