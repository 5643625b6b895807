"""Amplitudes of motions and tensions in regular waves by runs in time, to hold the linear response against."""

import math
import time

import numpy as np
from mpi4py import MPI

from ...errors import SolveError
from ...linear.motions import motions
from ...linear.response import small_waves
from ...model.sea import heading, wavenumber
from ...motion.simulation import Simulation
from ...scene.sections import Initial, Time
from .hull_runs import harmonics

#: Periods of a run in which the wave grows, in which it settles, and that are looked at; steps in each.
GROWING, SETTLING, FITTED, STEPS = 6, 6, 4, 200

#: What is compared with each other, and how small of it does not count.
GROUPS = (("surge", "sway", "heave"), ("roll", "pitch"), ("tension_top", "tension_anchor"))
LEAST = 0.02


def measured(scene, period, direction_deg, amplitude) -> dict[str, complex]:
    """Name -> complex amplitude per metre, as `linear.seaway` has them, of a run from rest with BDF2; and "seconds".

    Raises SolveError if a step fails.
    """
    began = time.monotonic()
    waves = small_waves(scene, period, direction_deg, amplitude).model_copy(update={"ramp": GROWING * period})
    end = (GROWING + SETTLING + FITTED) * period
    stepping = Time(end=end, step=period / STEPS, scheme="bdf2")
    run = scene.model_copy(update={"waves": waves, "time": stepping, "initial": Initial()})
    times, values, place, names = _history(run, direction_deg)
    last = times > end - (FITTED + 1e-6) * period
    crest = amplitude * np.exp(1j * wavenumber(run) * float(heading(direction_deg) @ place))
    found = harmonics(times[last], values[last], 2 * math.pi / period) / crest
    return dict(zip(names, found, strict=True)) | {"seconds": time.monotonic() - began}


def _history(scene, direction_deg):
    """Times, values (times, names), the place of C at rest (without a buoy: of the top), and their names."""
    simulation = Simulation(scene, MPI.COMM_SELF)
    try:
        read, place, names = _reader(simulation.problem, direction_deg)
        times, values = [], []
        for _ in simulation.run():
            times.append(simulation.t)
            values.append(read())
        if simulation.control.failed:
            raise SolveError("steps failed: these waves are too rough for regular steps")
        return np.array(times), np.array(values), place, names
    finally:
        simulation.problem.destroy()


def _reader(problem, direction_deg):
    """What reads motions and tensions at an instant."""
    names, buoy, u = [], problem.buoy, problem.system.u
    if buoy:
        state = buoy.fields.of(u[buoy.part.slice])  # a view: always of the present
        at_rest = buoy.fields.of(u[buoy.part.slice].copy())
        names += [*motions(at_rest, at_rest._replace(position=0 * at_rest.position), direction_deg)._fields]
        place = at_rest.position
    else:
        place = u[problem.lines.top_dofs()].copy()
    if problem.lines:
        names += (["tension_top"] if problem.attachments else []) + ["tension_anchor"]

    def read():
        found = []
        if buoy:
            moved = {name: getattr(state, name) - getattr(at_rest, name) for name in ("position", "orientation")}
            found += motions(at_rest, at_rest._replace(**moved), direction_deg)
        if problem.lines:
            found += [float(np.linalg.norm(a.of(u).force)) for a in problem.attachments]
            found.append(problem.anchor_tension())
        return found

    return read, place, names


def compared(own: dict[str, complex], run: dict[str, complex]) -> dict[str, float]:
    """Difference [%] of the linear amplitudes' sizes from those of a run, of what moves at all beside its like."""
    found = {}
    for group in GROUPS:
        sizes = {name: abs(run[name]) for name in group if name in run and name in own}
        for name in (n for n in sizes if sizes[n] > LEAST * max(sizes.values())):
            found[name] = 100 * (abs(own[name]) / sizes[name] - 1)
    return found
