"""What is called before an evaluation, and the coordinates that all forms on a mesh share.

Source: integrals in closed form.
"""

import cffi
import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model.problem import Problem

SCENE = merged(MOORED, cable=None, solver__hull_cells=6)


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
    assert len(calls) == problem.newton.residuals_total + problem.newton.jacobians_total > 2


def test_what_a_hook_raises_is_raised(problem):
    def bad(values):
        raise ArithmeticError("no such state")

    problem.system.hooks.add(bad)
    with pytest.raises(ArithmeticError, match="no such state"):
        problem.system.evaluate()


def test_a_hook_moves_the_quadrature_points(problem):
    """All forms on the hull's axis read one array of vertices: half as long cells are half the volume."""
    full = lift(problem)
    volume = problem.buoy.shape.volume()
    assert full == pytest.approx(problem.scene.sea.density * problem.scene.gravity * volume, rel=1e-9)
    x = problem.system.coordinates.of(problem.buoy.mesh)
    before = x.copy()

    def halve(values):
        x[:] = before / 2

    problem.system.hooks.add(halve)
    assert lift(problem) == pytest.approx(full / 2, rel=1e-9)


def test_the_points_of_the_hull_are_those_of_its_forms(problem):
    """Summed up over them the disks are the volume, as the forms have it; they move with the vertices."""
    buoy, x = problem.buoy, problem.system.coordinates.of(problem.buoy.mesh)
    gravity = problem.scene.sea.density * problem.scene.gravity
    for stretch in (1.0, 0.8):
        x *= stretch
        zeta, weights = buoy.axis_points(x)
        assert zeta.shape == weights.shape == (len(x), zeta.shape[1])
        inside = (x[:, 0] + x[:, 3])[:, None] / 2 / stretch
        disks = np.pi * buoy.shape.radius(zeta / stretch, inside) ** 2
        assert gravity * np.sum(weights * disks) == pytest.approx(lift(problem), rel=1e-9)


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
    x = problem.system.coordinates.of(problem.buoy.mesh)
    c = scaling_hook.ffi
    context = c.new("context *", {"x": c.cast("double *", x.ctypes.data), "n": x.size, "factor": 0.5})
    address = int(c.cast("uintptr_t", scaling_hook.lib.scale_hook()))
    problem.system.hooks.add(address, int(c.cast("uintptr_t", context)))
    assert lift(problem) == pytest.approx(full / 2, rel=1e-9)
    assert lift(problem) == pytest.approx(full / 4, rel=1e-9)
