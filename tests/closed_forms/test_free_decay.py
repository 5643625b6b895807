"""Free decay of small motions: period and damping of a run released in a mode shape.

Source: logarithmic decrement of `run` with BDF2 against the eigenvalue of `modes`.
"""

import math

import numpy as np
import pytest
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.linear.linearisation import linearise
from dolfbuoy.linear.natural import lowest_modes
from dolfbuoy.motion.simulation import Simulation

#: A string with Kelvin-Voigt damping between two points, and a buoy with wave damping on a rope.
STRING = {
    "gravity": 0.0,
    "cable": {"line_density": 1.0, "length": 10.0, "axial_stiffness": 4e4, "damping": 400.0, "elements": 4}
    | {"position_degree": 2, "tension_degree": 1, "top": {"kind": "fixed", "position": [10.1, 0.0, 0.0]}},
}
MOORED = {
    "sea": {"depth": 30.0},
    "buoy": {"hull": [[0.0, 1.2], [4.0, 1.2]], "mass": 1500.0, "center_of_mass": 1.2, "inertia": [2500.0, 400.0]}
    | {"added_mass": 0.5, "wave_damping": [500.0, 300.0]},
    "cable": {"length": 28.0, "line_density": 3.0, "diameter": 0.05, "added_mass": 1.0, "axial_stiffness": 2e5}
    | {"elements": 4},
}
#: Largest displacement [m]; periods and steps in each of them.
SMALL, PERIODS, STEPS = 1e-5, 5, 400


def mode_of(scene, name):
    """The slowest mode of that name, and the amplitudes (unknowns) that its shape has."""
    found = linearise(load_scene(scene), MPI.COMM_SELF)
    try:
        return next(mode for mode in lowest_modes(found, 40) if name in mode.name)
    finally:
        found.destroy()


def decay(scene, mode):
    """Times and the displacement along the shape of the mode, from its real part on, at rest."""
    stepping = {"end": PERIODS * mode.period, "step": mode.period / STEPS, "scheme": "bdf2"}
    simulation = Simulation(load_scene(scene | {"time": stepping}), MPI.COMM_SELF)
    try:
        system, shape = simulation.system, SMALL * mode.vector.real
        rest = system.u[system.order].copy()
        system.u[system.order] += shape
        system.publish()
        velocity = np.zeros(system.size)
        velocity[system.order] = SMALL * (mode.root * mode.vector).real
        simulation.begin(velocity[simulation.problem.lines.part.slice])
        along = shape / (shape @ shape)
        found = [(simulation.t, along @ (system.u[system.order] - rest)) for _ in simulation.run()]
        return np.array(found).T
    finally:
        simulation.problem.destroy()


@pytest.mark.parametrize(("scene", "name"), [(STRING, "axial"), (MOORED, "heave")], ids=["string", "moored buoy"])
def test_decay(scene, name):
    mode = mode_of(scene, name)
    t, x = decay(scene, mode)
    peaks = [i for i in range(1, len(x) - 1) if x[i - 1] < x[i] >= x[i + 1] and x[i] > 0]
    sizes, times = x[peaks], t[peaks]
    rate = math.log(sizes[0] / sizes[-1]) / (times[-1] - times[0])
    damped = 2 * math.pi / mode.root.imag
    assert (times[-1] - times[0]) / (len(peaks) - 1) == pytest.approx(damped, rel=0.01)
    assert rate == pytest.approx(-mode.root.real, rel=0.01)
