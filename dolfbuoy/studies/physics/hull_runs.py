"""The response of a buoy to small waves as runs in time show it."""

import math

import numpy as np
from mpi4py import MPI

from ...errors import SolveError
from ...linear.motions import Motions, motions
from ...linear.response import small_waves
from ...model.feasible import shape_and_mass
from ...model.sea import heading, wavenumber
from ...motion.simulation import Simulation
from ...scene.sections import Initial, Time

#: Periods of a run in which the wave grows, in which it settles, and that are looked at; steps in each.
GROWING, SETTLING, FITTED, STEPS = 8, 4, 4, 200

#: Amplitude over the diameter of the hull: small enough for drag and slopes, large enough for Newton's tolerance.
AMPLITUDE = 1e-3


def measured_motions(scene, period, direction_deg=0.0) -> Motions:
    """Complex motions per metre of amplitude, as `linear.response` has them, from a run from rest with BDF2."""
    amplitude = AMPLITUDE * shape_and_mass(next(iter(scene.network.buoys.values())))[0].max_diameter
    waves = small_waves(scene, period, direction_deg, amplitude).model_copy(update={"ramp": GROWING * period})
    end = (GROWING + SETTLING + FITTED) * period
    time = Time(end=end, step=period / STEPS, scheme="bdf2")
    run = scene.model_copy(update={"waves": waves, "time": time, "initial": Initial()})
    times, moved, place = _history(run, direction_deg)
    last = times > end - (FITTED + 1e-6) * period
    crest = amplitude * np.exp(1j * wavenumber(run) * float(heading(direction_deg) @ place))
    return Motions(*harmonics(times[last], moved[last], 2 * math.pi / period) / crest)


def _history(scene, direction_deg):
    """Times, motions (times, 6) against the place at rest, and that place."""
    simulation = Simulation(scene, MPI.COMM_SELF)
    try:
        problem, buoy = simulation.problem, simulation.problem.buoy
        state = buoy.fields.of(problem.system.u[buoy.part.slice])  # a view: always of the present
        at_rest = buoy.fields.of(problem.system.u[buoy.part.slice].copy())
        times, moved = [], []
        for _ in simulation.run():
            change = at_rest._replace(
                position=state.position - at_rest.position, orientation=state.orientation - at_rest.orientation
            )
            times.append(simulation.t)
            moved.append(motions(at_rest, change, direction_deg))
        if simulation.control.failed:
            raise SolveError("steps failed in waves that are small")
        return np.array(times), np.array(moved), at_rest.position
    finally:
        simulation.problem.destroy()


def harmonics(times, values, omega) -> np.ndarray:
    """X of Re[X exp(-i omega t)] in every column of values (times, n), by least squares beside a parabola in time."""
    phase, slow = omega * times, (times - times.mean()) / np.ptp(times)
    basis = np.column_stack([np.cos(phase), np.sin(phase), np.ones_like(slow), slow, slow**2])
    cosine, sine = np.linalg.lstsq(basis, values, rcond=None)[0][:2]
    return cosine + 1j * sine
