"""Newton's method: stopping criteria, and messages when it fails.

Source: statements about failure, and closed forms of converging iterations.
"""

import re

import numpy as np
import pytest
from alone import simulate, solve_static
from helpers import under_end_force
from mpi4py import MPI
from petsc4py import PETSc

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.model.problem import Problem
from dolfbuoy.statics.equilibrium import solve_equilibrium


@pytest.mark.parametrize("chord", [1e-3, 1e-2, 0.3])
def test_it_does_not_stop_before_the_residual_is_gone(chord):
    """A bar pressed to a thousandth of its length: T = EA (|chord|/L - 1).

    Newton halves the residual here while the increments fall from 1 to 1e-6 at once.
    """
    top = {"kind": "fixed", "position": [chord, 0.0, 0.0]}
    cable = {"length": 1.0, "line_density": 1.0, "axial_stiffness": 100.0, "elements": 1, "top": top}
    record = solve_static({"cable": cable}, comm=MPI.COMM_SELF)
    assert float(record.cable_tension[0]) == pytest.approx(100.0 * (chord - 1), rel=1e-9)


def test_a_line_search_that_finds_nothing_has_come_to_rounding_only_there():
    problem = solve_equilibrium(load_scene("driven"), MPI.COMM_SELF)
    newton, reason = problem.newton, PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH
    try:
        assert newton._stalled_at_rounding(reason)
        assert not newton._stalled_at_rounding(PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT)
        newton.x.array[:] += 1e-3
        assert not newton._stalled_at_rounding(reason)
    finally:
        problem.destroy()


@pytest.mark.parametrize("worst", ["buoy force", "cable tension"])
def test_the_block_with_the_largest_residual_is_named(worst, monkeypatch):
    """One that is no number is the worst."""
    problem = solve_equilibrium(load_scene("driven"), MPI.COMM_SELF)
    newton, reason = problem.newton, PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT
    sizes = {"cable position": 0.5, "buoy force": 3.0, "cable tension": np.nan if worst == "cable tension" else 0.1}
    monkeypatch.setattr(newton, "_checked", lambda: (7, reason))
    monkeypatch.setattr(newton.system, "residual_by_block", lambda: sizes)
    try:
        said = newton._solve_as_best()
    finally:
        problem.destroy()
    assert said == (7, f"DIVERGED_MAX_IT after 7 iterations, largest residual in {worst}")


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
    shape = under_end_force([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], length, 0.0, np.inf)
    for _ in range(2):
        problem.lines.set_shape(problem.system.u, shape.position, shape.tension)
        problem.set_time(0.0)
        try:
            problem.newton.solve()
        except SolveError:
            continue
        assert abs(problem.anchor_tension()) < 1e-9
    problem.destroy()


CABLE = {"length": 1.0, "line_density": 1.0, "elements": 3, "top": {"kind": "fixed", "position": [0.3, 0.0, 0.4]}}


@pytest.mark.parametrize(
    ("change", "words"),
    [({"elements": 1}, r"cable\.elements = 1: .* cannot move"), ({}, r"cable\.line_density = 1\.0: .* no weight here")],
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


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"pc_type": "python"}, "pc_type = 'python': must be one of lu, ilu, bjacobi, asm, jacobi, none"),
        ({"pc_type": "shell", "pc_python_type": "evil.py:PC"}, "pc_type = 'shell'"),
        ({"pc_python_type": "evil.py:PC"}, "pc_python_type = 'evil.py:PC': is no option that a scene may set"),
        ({"snes_view": "ascii:file"}, "snes_view = 'ascii:file': is no option"),
        ({"snes_monitor": "ascii:file"}, "snes_monitor = 'ascii:file': must be true or false"),
        ({"ksp_monitor": "ascii:file"}, "ksp_monitor = 'ascii:file': must be true or false"),
        ({"snes_test_jacobian_view": "ascii:file"}, "no option"),
        ({"options_file": "more.opt"}, "no option"),
        ({"snes_max_it": 0}, "snes_max_it = 0: must be a whole number from 1 to 10000"),
        ({"snes_max_it": True}, "snes_max_it = True: must be a whole number"),
        ({"ksp_rtol": float("nan")}, "ksp_rtol"),
        ({"snes_linesearch_damping": -0.5}, "must be a number from 1e-06 to 1"),
        ({"snes_monitor\nx": True}, r"snes_monitor\nx = True: is no option"),
        ({"ksp_type": {"a": 1}}, "solver.petsc.ksp_type = {'a': 1}: must be one of richardson"),
        ({"sub_pc_type": "lu"}, "sub_pc_type = 'lu': has no effect unless pc_type is bjacobi or asm"),
        ({"pc_factor_levels": 2}, "pc_factor_levels = 2: has no effect unless pc_type is ilu"),
        ({"ksp_gmres_restart": 20}, "ksp_gmres_restart = 20: has no effect unless ksp_type is gmres or fgmres"),
        ({"mat_mumps_icntl_14": 50}, "has no effect unless pc_factor_mat_solver_type is mumps"),
    ],
)
def test_options_that_could_do_harm_or_nothing_are_refused(options, words):
    """Before anything is built: a scene from a stranger runs no code and writes no file."""
    with pytest.raises(InputError, match=re.escape(words)):
        load_scene("short", solver__petsc=options)
