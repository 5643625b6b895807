"""Hooks called before an evaluation, and the mesh coordinates shared by all forms.

Source: integrals in closed form.
"""

import cffi
import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.results.observe import Observer

SCENE = merged(MOORED, cable=None)


@pytest.fixture
def problem():
    made = Problem(load_scene(SCENE), dynamic=False, comm=MPI.COMM_SELF)
    pose = np.array([0.0, 0.0, -50.0, 1.0, 0.0, 0.0, 0.0])  # far below the water
    made.system.u[:] = pose
    made.buoy.reference.x.array[:] = pose
    made.system.publish()
    yield made
    made.destroy()


def lift(problem):
    """Vertical force of the water on the submerged hull [N]."""
    b = problem.system.evaluate()
    weight = problem.buoy.mass.mass * problem.scene.gravity
    return weight - b[problem.buoy.part.slice][2]


def test_every_evaluation_calls_the_hooks(problem):
    """Residuals, those of the line search too, and Jacobians."""
    calls, system = [], problem.system
    system.hooks.add(lambda values: calls.append(values is system.u.base or len(values)))
    system.evaluate()
    system.assemble_jacobian()
    assert len(calls) == 2
    problem.buoy.relaxation.value = 1.0
    calls.clear()
    problem.newton.solve()
    assert len(calls) == problem.newton.numbers.residuals_total + problem.newton.numbers.jacobians_total > 2


def test_what_a_hook_raises_is_raised(problem):
    def bad(values):
        raise ArithmeticError("no such state")

    problem.system.hooks.add(bad)
    with pytest.raises(ArithmeticError, match="no such state"):
        problem.system.evaluate()


def test_forms_on_a_mesh_share_its_coordinates(problem):
    """A hook that makes the cells of the hull half as long makes half of the volume of all forms on them."""
    full = lift(problem)
    volume = problem.buoy.shape.volume()
    assert full == pytest.approx(problem.scene.sea.density * problem.scene.gravity * volume, rel=1e-9)
    x = problem.system.shared.coordinates(problem.buoy.mesh)
    before = x.copy()

    def halve(values):
        x[:] = before / 2

    problem.system.hooks.add(halve)
    assert lift(problem) == pytest.approx(full / 2, rel=1e-9)


def test_a_hook_says_how_many_cells_count(problem):
    """Cells behind the last that a hook asks for are not looked at."""
    points, seen = problem.buoy.hull.points.wet, []
    count = problem.system.shared.count(points.mesh, points.cells)
    full = lift(problem)
    assert 1 < count[0] <= len(points.cells)

    def less(values):
        seen.append(int(count[0]))
        count[0] = 0

    problem.system.hooks.add(less)
    assert lift(problem) == pytest.approx(0.0, abs=1e-9 * full)
    assert seen == [3 * len(problem.buoy.shape.pieces(problem.scene.solver.hull_cells))]


def test_the_points_of_the_hull_are_those_of_its_forms(problem):
    """Written into the coefficients, they add up to the same volume in forms that no System evaluates."""
    values = Observer(problem).values({})
    assert values["displaced_mass"] * problem.scene.gravity == pytest.approx(lift(problem), rel=1e-12)


def test_a_hook_in_c(problem, tmp_path, monkeypatch):
    """Compiled code with a context of its own is called without Python."""
    ffi = cffi.FFI()
    ffi.cdef("typedef struct { double *x; int n; double factor; } context; void (*scale_hook(void))(void *, double *);")
    ffi.set_source(
        "scaling_hook",
        """
        typedef struct { double *x; int n; double factor; } context;
        static void scale(void *pointer, double *values)
        {
            context *c = (context *)pointer;
            for (int k = 0; k < c->n; ++k) c->x[k] *= c->factor;
        }
        static void (*scale_hook(void))(void *, double *) { return scale; }
        """,
    )
    monkeypatch.chdir(tmp_path)
    ffi.compile(tmpdir=str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    import scaling_hook

    full = lift(problem)
    x = problem.system.shared.coordinates(problem.buoy.mesh)
    c = scaling_hook.ffi
    context = c.new("context *", {"x": c.cast("double *", x.ctypes.data), "n": x.size, "factor": 0.5})
    address = int(c.cast("uintptr_t", scaling_hook.lib.scale_hook()))
    problem.system.hooks.add(address, int(c.cast("uintptr_t", context)))
    assert lift(problem) == pytest.approx(full / 2, rel=1e-9)
    assert lift(problem) == pytest.approx(full / 4, rel=1e-9)
