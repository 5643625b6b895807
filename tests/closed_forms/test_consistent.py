"""Initial conditions of a run with a given velocity: exact tension, end force and velocity, without ringing.

Source: conservation of momentum and centripetal force by hand.
"""

import numpy as np
import pytest
from alone import simulate
from mpi4py import MPI

INF = float("inf")
BODY, ROD = 2.0, 1.0  # kg of the body, kg/m of the rod of 1 m


def swung(velocity, EA=INF, scheme="generalized-alpha", **cable):
    """A weightless body of no size at the end of a straight cable, started with a velocity."""
    scene = {
        "gravity": 0.0,
        "cable": {"length": 1.0, "line_density": ROD, "axial_stiffness": EA, "elements": 1} | cable,
        "buoy": {"mass": BODY, "center_of_mass": 0.0, "inertia": [1.0, 1.0]},
        "initial": {"kind": "straight", "buoy_position": [1.0, 0.0, 0.0], "buoy_velocity": velocity},
        "time": {"end": 0.1, "step": 0.01, "scheme": scheme},
    }
    return simulate(scene, comm=MPI.COMM_SELF)


@pytest.mark.parametrize(("scheme", "ringing"), [("bdf2", 2.5e-3), ("generalized-alpha", 5e-4)])
def test_rigid_rod_that_turns(scheme, ringing):
    """The body's momentum is shared with the rod, (M + m/3) v = M v0, and the rod pulls it towards the centre.

    T = (M + m/3) v^2/L in the element and M v^2/L at the body, at t = 0 already, and constant up to the step's square.
    """
    record = swung([0.0, 2.0, 0.0], scheme=scheme)
    speed = 2.0 * BODY / (BODY + ROD / 3)
    tension = (BODY + ROD / 3) * speed**2
    assert np.allclose(record.linear_momentum[0], [0.0, BODY * speed, 0.0], rtol=0, atol=1e-8)
    assert float(record.linear_momentum[0, 1]) == pytest.approx(BODY * speed, rel=1e-12)  # nothing of the tiny steps
    assert float(record.tension_anchor[0]) == pytest.approx(tension, rel=1e-5)
    assert float(record.tension_top[0]) == pytest.approx(BODY * speed**2, rel=1e-5)
    assert np.abs(record.tension_anchor / tension - 1).max() < ringing


@pytest.mark.parametrize("form", ["paper", "energy"])
@pytest.mark.parametrize("EA", [1e3, 1e7, 2.3e8])
def test_elastic_cable_that_is_being_stretched(EA, form):
    """Its tension at t = 0 is that of its strain, which is zero: not EA times rate times a small time."""
    pair = {"elements": 4, "position_degree": 2, "tension_degree": 1}
    record = swung([1.0, 0.0, 0.0], EA, strain_form=form, **pair)
    assert np.abs(record.cable_tension[0]).max() < 1e-9 * EA
    assert np.abs(record.tension_anchor[0]) < 1e-9 * EA


def test_damper_of_an_elastic_cable():
    """With Kelvin-Voigt damping the rate of stretch counts at t = 0: T = damping v/L of the one element."""
    record = swung([1.0, 0.0, 0.0], 1e3, damping=5.0)
    rate = float(record.linear_momentum[0, 0]) / BODY
    assert rate == pytest.approx(BODY / (BODY + ROD / 3), rel=1e-4)
    assert float(record.cable_tension[0, 0]) == pytest.approx(5.0 * rate, rel=1e-6)
