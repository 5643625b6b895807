"""The loops in C against dolfinx's assemblers.

Source: dolfinx's assemblers.
"""

import numpy as np
import pytest
from alone import simulate
from assemblers import Assemblers
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.solver import c_code, compat
from dolfbuoy.solver.newton import Newton
from dolfbuoy.solver.unknowns import array_of

CASES = {
    "moored": {"cable__elements": 5},
    "P3-P2": {"cable__elements": 3, "cable__position_degree": 3, "cable__tension_degree": 2},
    "element averages, damping": {"cable__elements": 4, "cable__strain": "element-average", "cable__damping": 10.0},
    "no buoy": {"buoy": None, "external_force": None, "cable__top": {"kind": "fixed", "position": [9.0, 0.0, -1.0]}},
    "no cable": {"cable": None},
}


def given(system):
    """Coefficients and constants of the residuals that are not unknowns."""
    unknown = {id(part.function) for part in system.parts}
    things = (thing for c in system.residuals for thing in (*c.ufl_form.coefficients(), *c.ufl_form.constants()))
    return list({id(thing): thing for thing in things if id(thing) not in unknown}.values())


def assemblers_of(system):
    """dolfinx's, with the points of the hull as a hook leaves them."""
    system.evaluate()
    for thing in given(system):
        if hasattr(thing, "x"):
            thing.x.array[:] = system.numbers_of(thing)
    return Assemblers(system)


def by_dolfinx(system):
    """The residual as dolfinx's assemblers see it."""
    assemblers = assemblers_of(system)
    assemblers.residuals()
    return assemblers.b


@pytest.fixture(params=CASES)
def system(request):
    """A System with random unknowns near the start."""
    problem = Problem(load_scene(merged(MOORED, **CASES[request.param])), dynamic=True, comm=MPI.COMM_SELF)
    rng, system = np.random.default_rng(5), problem.system
    problem.set_time(2.3)
    for thing in given(system):
        if hasattr(thing, "x"):
            thing.x.array[:] = rng.uniform(-1, 1, len(thing.x.array))
    for model, name, value in (("lines", "gamma_v", 7.0), ("lines", "gamma_a", 50.0), ("buoy", "gamma", 8.0)):
        if getattr(problem, model):
            getattr(getattr(problem, model), name).value = value
    system.u[:] = rng.uniform(-1, 1, system.size)
    system.publish()
    yield system
    problem.destroy()


def test_residual(system):
    """The same sums as assemble_vector, in another order."""
    expected = by_dolfinx(system)
    np.testing.assert_allclose(system.evaluate(), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_jacobian(system):
    """The same entries as assemble_matrix puts into the same pattern."""
    system.assemble_jacobian()
    expected = assemblers_of(system)
    expected.jacobians()
    expected.A.assemble()
    a, b = system.A.getValuesCSR()[2], expected.A.getValuesCSR()[2]
    assert np.abs(b).max() > 1
    np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-14 * np.abs(b).max())


def test_it_reads_what_changes(system):
    """Unknowns, and each coefficient and constant alone, as they are at the time of the call."""
    things, felt = given(system), 0
    for values in (system.u, *(array_of(thing) for thing in things)):
        before = system.evaluate().copy()
        values[:] = 1.25 * values + 0.01
        if values is system.u:
            system.publish()
        expected = by_dolfinx(system)
        found = system.evaluate()
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
        felt += np.abs(found - before).max() > 1e-9 * np.abs(before).max()
    assert felt > 0.7 * len(things)  # not each acts at this state


def test_forms_of_the_buoy_have_one_tensor():
    """All cells of the hull's axis share their dofs: their tensors are summed up where they arise."""
    problem = Problem(load_scene(merged(MOORED, cable=None)), dynamic=True, comm=MPI.COMM_SELF)
    integrals = [integral for c in problem.system.jacobians for integral in compat.integrals(c.form, c_code.core().ffi)]
    assert max(len(integral.cells) for integral in integrals) > 1
    tensor = 13**2 + -(13**2) % c_code.ALIGNED
    assert len(problem.system.add_jacobians.out) == tensor * len(integrals) + problem.system.unknowns
    problem.destroy()


def test_after_a_fallback_matrices_are_new(monkeypatch):
    """Another solver never goes on with a kept matrix, whose factorisation nobody has looked at."""
    choose, kept = Newton.choose_solver, []

    def bad(self, package):
        choose(self, package)
        kept.append(self.numbers.valid)
        if package == "petsc":
            self.snes.getKSP().getPC().setType("none")

    expected = simulate(merged(MOORED, cable__elements=5, time={"end": 0.05, "step": 0.01}))
    monkeypatch.setattr(Newton, "choose_solver", bad)
    run = simulate(merged(MOORED, cable__elements=5, time={"end": 0.05, "step": 0.01}))
    assert run.attrs["linear_solver_fallbacks"] == 5
    assert len(kept) > 5
    assert not any(kept)
    np.testing.assert_allclose(run.tension_top, expected.tension_top, rtol=1e-9)
