"""The loops in C against dolfinx's assemblers, and how their library comes into the cache."""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI
from petsc4py import PETSc

from dolfbuoy import compat, load_scene, loops
from dolfbuoy.problem import Problem

CASES = {
    "moored": {"cable__elements": 5},
    "P3-P2": {"cable__elements": 3, "cable__position_degree": 3, "cable__tension_degree": 2},
    "element averages, damping": {"cable__elements": 4, "cable__strain": "element-average", "cable__damping": 10.0},
    "no buoy": {"buoy": None, "external_force": None, "cable__top": {"kind": "fixed", "position": [9.0, 0.0, -1.0]}},
    "no cable": {"cable": None},
}


@pytest.fixture(params=CASES)
def system(request):
    """A System with random unknowns near the start."""
    problem = Problem(load_scene(merged(MOORED, **CASES[request.param])), dynamic=True, comm=MPI.COMM_SELF)
    rng, system = np.random.default_rng(5), problem.system
    problem.set_time(2.3)
    for thing in (problem.cable, problem.buoy):
        for name in ("gamma", "gamma_v", "gamma_a"):
            if hasattr(thing, name):
                getattr(thing, name).value = 7.0
    system.u[:] = rng.uniform(-1, 1, system.size)
    system.publish()
    yield system
    problem.destroy()


def test_residual(system):
    """The same sums as assemble_vector, in another order."""
    expected = np.zeros(system.size)
    for c in system.residuals:
        c.prepare()
        c.add_to_vector(expected)
    np.testing.assert_allclose(system.evaluate(), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_jacobian(system):
    """The same entries as assemble_matrix puts into the same pattern."""
    system.assemble_jacobian()
    expected = system.A.duplicate()
    expected.setLGMap(system.lgmap, system.lgmap)
    for c in system.jacobians:
        numbers = (np.arange(p.slice.start, p.slice.stop, dtype=PETSc.IntType) for p in c.sides)
        block = expected.getLocalSubMatrix(*(PETSc.IS().createGeneral(n, comm=PETSc.COMM_SELF) for n in numbers))
        c.prepare()
        c.add_to_matrix(block)
    expected.assemble()
    a, b = system.A.getValuesCSR()[2], expected.getValuesCSR()[2]
    assert np.abs(b).max() > 1
    np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-14 * np.abs(b).max())


def test_it_reads_what_changes(system):
    """A call sees unknowns, coefficients and constants as they are then."""
    before = system.evaluate().copy()
    for part in system.parts:
        part.values[:] *= 1.25
    values = system.evaluate().copy()
    assert np.abs(values - before).max() > 0
    constants = [thing for c in system.residuals for thing in c.ufl_form.constants()]
    kept = [np.copy(c.value) for c in constants]
    for c in constants:
        c.value = 1.25 * c.value
    assert np.abs(system.evaluate() - values).max() > 0
    for c, old in zip(constants, kept, strict=True):
        c.value = old
    np.testing.assert_array_equal(system.evaluate(), values)


def test_forms_of_the_buoy_have_one_tensor():
    """All cells of the hull's axis share their dofs: their tensors are summed up where they arise."""
    problem = Problem(load_scene(merged(MOORED, cable=None)), dynamic=True, comm=MPI.COMM_SELF)
    integrals = [integral for c in problem.system.jacobians for integral in compat.integrals(c.form)]
    assert max(len(integral.cells) for integral in integrals) > 1
    assert len(problem.system._add_jacobians.rows) == 13**2 * len(integrals)
    problem.destroy()


def test_library_is_built_once_and_whole(tmp_path, monkeypatch):
    """Two processes may build it at the same time: each puts a whole file in place; nothing else stays."""
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path / "cache")
    build, built = loops._build, []
    monkeypatch.setattr(loops, "_build", lambda *args: (built.append(args), build(*args)))
    first = loops._library.__wrapped__()
    again = loops._library.__wrapped__()
    build(*built[0])
    assert len(built) == 1
    assert [file.name for file in (tmp_path / "cache").iterdir()] == [first.__spec__.origin.rsplit("/", 1)[1]]
    assert first.lib is not None
    assert again.lib is not None
