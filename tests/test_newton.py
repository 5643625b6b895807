"""When Newton's method may stop, and what it says when it cannot go on."""

import pytest
from mpi4py import MPI

from dolfbuoy import solve_static
from dolfbuoy.errors import SolveError


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
    """A hanging body without gravity: nothing determines its place, and MUMPS says so more than once.

    Any place with T = 0 is an equilibrium; what must not happen is a tension, or an error of MUMPS's own.
    """
    scene = {
        "gravity": 0.0,
        "cable": {"length": length, "line_density": 1.0, "elements": 1},
        "buoy": {"mass": 1.0, "center_of_mass": 0.0, "inertia": [1.0, 1.0]},
    }
    tension, reason = 0.0, "DIVERGED"
    try:
        tension = float(solve_static(scene, comm=MPI.COMM_SELF).cable_tension[0])
    except SolveError as error:
        reason = str(error)
    assert abs(tension) < 1e-9
    assert "DIVERGED" in reason
