"""Response to small waves: (K - i omega E - omega^2 M) X = -F about the equilibrium, per metre of amplitude.

All amplitudes are complex: eta = Re[exp(i (k x - omega t))] with x along the wave from the place of C at rest, and a
motion is Re[X exp(-i omega t)].
"""

import math
from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from scipy.sparse.linalg import splu

from ..model.sea import heading, wavenumber
from ..scene.sections import Waves
from .linearisation import Linearisation, linearise

#: Amplitude [m] of the waves whose forces are taken for linear: what drag adds, and what rounding does, are below 1e-5.
SMALL = 1e-5


class Response(NamedTuple):
    """Of a buoy to waves of one period, complex: at C along the wave and up [m/m], about the axes [rad/m].

    pitch turns the top along the wave, roll about the wave's direction.  slope: of the wave, k i.
    """

    period: float
    wavenumber: float
    surge: complex
    sway: complex
    heave: complex
    roll: complex
    pitch: complex
    yaw: complex

    @property
    def pitch_over_slope(self) -> complex:
        """pitch over d(eta)/dx at C: -1 where the buoy follows the slope (about +y)."""
        return self.pitch / (1j * self.wavenumber)


def responses(scene, periods, direction_deg=0.0) -> list[Response]:
    """Response of the scene's buoy to small waves of these periods [s] along a direction.

    The wave's elevation is counted from the buoy's place at rest.  Raises InputError for a scene without buoy or water,
    SolveError if the equilibrium is not found.
    """
    waves = Waves(amplitude=SMALL, period=periods[0], direction_deg=direction_deg)
    found = linearise(scene, MPI.COMM_SELF, waves)
    try:
        return [_response(found, waves.model_copy(update={"period": period})) for period in periods]
    finally:
        found.destroy()


def _response(found: Linearisation, waves) -> Response:
    problem = found.problem
    flat = waves.model_copy(update={"amplitude": 0.0})
    problem.change(problem.scene.model_copy(update={"waves": flat}))
    omega, k = 2 * math.pi / waves.period, wavenumber(problem.scene)
    buoy = problem.buoy
    at_rest = buoy.fields.of(found.u[buoy.part.slice])
    ahead = heading(waves.direction_deg)
    start = -k * float(ahead @ at_rest.position)  # the wave has its crest above C at t = 0
    F = force(found, start) + 1j * force(found, start - math.pi / 2)
    A = found.K - 1j * omega * found.E - omega**2 * found.M
    X = np.zeros(problem.system.size, dtype=complex)
    X[problem.system.order] = splu(A.tocsc()).solve(-F)
    moved = buoy.fields.of(X[buoy.part.slice])
    axes = np.array([ahead, np.cross([0.0, 0.0, 1.0], ahead), [0.0, 0.0, 1.0]])
    return Response(waves.period, k, *axes @ moved.position, *axes @ turn(at_rest.orientation, moved.orientation))


def force(found: Linearisation, time_phase) -> np.ndarray:
    """Residual of the free unknowns in a small wave over its amplitude, by a central difference."""
    problem = found.problem
    evolved = problem.evolutions()
    for evolution in evolved:
        for level in range(evolution.order):
            evolution.hand_out(level, 0.0, 0.0)
    sides = []
    for amplitude in (SMALL, -SMALL):
        for model in problem.models:
            model.sea.set_wave(amplitude, time_phase)
        problem.system.u[:] = found.u
        problem.system.publish()
        sides.append(problem.system.evaluate()[problem.system.order].copy())
    return (sides[0] - sides[1]) / (2 * SMALL)


def turn(q4, change) -> np.ndarray:
    """Rotation vector (world frame) of a small change of the unit quaternion q4, which may be complex."""
    w, v = change[0], np.asarray(change[1:])
    return 2 * (q4[0] * v - w * q4[1:] - np.cross(v, q4[1:]))
