"""When Newton's method may stop, and what it says when it cannot go on."""

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from dolfbuoy import catenary, load_scene, simulate, solve_static
from dolfbuoy.continuation import begin
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.problem import Problem


@pytest.mark.parametrize("chord", [1e-3, 1e-2, 0.3])
def test_it_does_not_stop_before_the_residual_is_gone(chord):
    """A bar pressed to a thousandth of its length: T = EA (|chord|/L - 1).

    Newton halves the residual here while the increments fall from 1 to 1e-6 at once.
    """
    top = {"kind": "fixed", "position": [chord, 0.0, 0.0]}
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": 100.0, "elements": 1, "top": top}
    record = solve_static({"cable": cable}, comm=MPI.COMM_SELF)
    assert float(record.cable_tension[0]) == pytest.approx(100.0 * (chord - 1), rel=1e-9)


@pytest.mark.parametrize("length", [10.0, 9.99976974414163])
def test_a_singular_matrix_is_a_failed_solve(length):
    """A moored body without any load: nothing determines its place, and MUMPS says so more than once.

    Any place with T = 0 is an equilibrium; what must not happen is a tension, or an error of MUMPS's own.
    """
    scene = {
        "gravity": 0.0,
        "cable": {"length": length, "line_density": 1.0, "elements": 1},
        "buoy": {"mass": 1.0, "center_of_mass": 0.0, "inertia": [1.0, 1.0]},
    }
    problem = Problem(load_scene(scene), dynamic=False, comm=MPI.COMM_SELF)
    shape = catenary.under_end_force([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], length, 0.0, np.inf)
    for _ in range(2):
        begin(problem, shape)
        try:
            problem.system.solve()
        except SolveError:
            continue
        assert abs(problem.anchor_tension()) < 1e-9
    problem.destroy()


CABLE = {"length": 1.0, "line_density": 1.0, "elements": 3, "top": {"kind": "fixed", "position": [0.3, 0.0, 0.4]}}


@pytest.mark.parametrize(
    ("change", "words"),
    [({"elements": 1}, r"cable\.elements = 1: .* cannot move"), ({}, r"cable\.line_density = 1\.0 .* no weight here")],
)
def test_what_has_no_equilibrium_is_refused(change, words):
    """A single rigid element between two points; a slack cable without weight."""
    with pytest.raises(InputError, match=words):
        solve_static({"gravity": 0.0 if not change else 9.81, "cable": CABLE | change}, comm=MPI.COMM_SELF)


def test_a_stiff_cable_stretched_far_beyond_its_weight():
    """Its tension, 2.6e8 N, is the size by which rounding counts, not its weight of 0.45 N."""
    top = {"kind": "fixed", "position": [0.0, 0.0, 16.0]}
    cable = {"length": 11.22, "line_density": 0.04, "axial_stiffness": 6e8, "elements": 6, "grading": 0.9999769}
    cable |= {"position_degree": 2, "tension_degree": 1, "top": top}
    record = solve_static({"gravity": 1.0, "cable": cable}, comm=MPI.COMM_SELF)
    assert float(record.tension_top) == pytest.approx(6e8 * (16.0 / 11.22 - 1), rel=1e-8)


def test_options_of_a_solver_within_a_preconditioner():
    """They are read when the matrix is first there, and gone from PETSc's database afterwards."""
    nested = {"ksp_type": "gmres", "pc_type": "bjacobi", "sub_pc_type": "lu", "sub_pc_factor_mat_solver_type": "mumps"}
    before = PETSc.Options().getAll()
    plain, other = (simulate("short", time__end=0.05, solver__petsc=options) for options in ({}, nested))
    assert np.allclose(plain.tension_top, other.tension_top, rtol=1e-8)
    assert PETSc.Options().getAll() == before


def test_a_solver_that_petsc_does_not_know_is_refused():
    for options in ({"pc_type": "magic"}, {"pc_type": "bjacobi", "sub_pc_type": "magic"}):
        with pytest.raises(InputError, match=r"solver\.petsc = .*magic.*PETSc refuses it"):
            simulate("short", time__end=0.05, solver__petsc=options)
