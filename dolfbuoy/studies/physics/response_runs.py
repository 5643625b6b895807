"""Runs in time beside the linear response: amplitudes in regular waves, standard deviations in an irregular sea."""

import math
import time

import numpy as np
from mpi4py import MPI

from ...errors import SolveError
from ...linear.motions import motions
from ...linear.response import small_waves
from ...linear.seaway import Seaway
from ...model.held import held_still
from ...model.sea import heading, wavenumber
from ...motion.simulation import Simulation
from ...scene.sections import Initial, Time
from .hull_runs import harmonics

#: Periods of a run in which the wave grows, in which it settles, and that are looked at; steps in each.
GROWING, SETTLING, FITTED, STEPS = 6, 6, 4, 200
#: Of a run in an irregular sea: peak periods in which it grows and settles, and that are looked at.
BEFORE, SEEN = 20, 180

#: How small of the largest of its kind does not count, in a comparison.
LEAST = 0.02
KINDS = {"surge": "motion", "sway": "motion", "heave": "motion", "roll": "turn", "pitch": "turn"}


def measured(scene, period, direction_deg, amplitude) -> dict[str, complex]:
    """Name -> complex amplitude per metre, as `linear.seaway` has them, of a run from rest with BDF2; and "seconds".

    Ends that the scene moves are held still.  "unsettled": by how much amplitudes still change, as a part of them.
    Raises SolveError if a step fails.
    """
    began = time.monotonic()
    waves = small_waves(scene, period, direction_deg, amplitude).model_copy(update={"ramp": GROWING * period})
    end = (GROWING + SETTLING + FITTED) * period
    run = _run(scene, waves, end, period)
    times, values, place = _history(run, direction_deg)
    crest = amplitude * np.exp(1j * wavenumber(run) * float(heading(direction_deg) @ place))

    def fitted(start, stop):
        """Of the periods before the end between these."""
        rows = (times > end - (start + 1e-6) * period) & (times < end - (stop - 1e-6) * period)
        columns = np.array([column[rows] for column in values.values()]).T
        return dict(zip(values, harmonics(times[rows], columns, 2 * math.pi / period) / crest, strict=True))

    halves = fitted(FITTED, FITTED / 2), fitted(FITTED / 2, 0)
    unsettled = max((abs(change) / 100 for change in compared(*halves).values()), default=0.0)
    return fitted(FITTED, 0) | {"seconds": time.monotonic() - began, "unsettled": unsettled}


def measured_in_sea(scene, waves) -> tuple[dict[str, float], dict[str, float]]:
    """Standard deviations by name, and "seconds": of the linear response, and of a run with BDF2 over "time" [s].

    Both in the same components, drag linearised for them, over the same time: no chance is in their difference.
    waves: a section [waves] of an irregular sea.  Raises SolveError if a step fails.
    """
    period = waves.main_period
    began = time.monotonic()
    waves = waves.model_copy(update={"ramp": BEFORE / 2 * period})
    times, values, _ = _history(_run(scene, waves, (BEFORE + SEEN) * period, period), waves.direction_deg)
    seconds = time.monotonic() - began
    kept = times > BEFORE * period
    run = {name: float(np.std(column[kept])) for name, column in values.items()}
    began = time.monotonic()
    seaway = Seaway(scene.model_copy(update={"waves": waves}), waves.direction_deg)
    try:
        own = seaway.over_time(waves, times[kept])
    finally:
        seaway.destroy()
    own = {name: float(np.std(column)) for name, column in own.items()}
    return own | {"seconds": time.monotonic() - began}, run | {"seconds": seconds, "time": SEEN * period}


def _run(scene, waves, end, period):
    stepping = Time(end=end, step=period / STEPS, scheme="bdf2")
    return held_still(scene).model_copy(update={"waves": waves, "time": stepping, "initial": Initial()})


def _history(scene, direction_deg):
    """Times, name -> values, and the place of C of the first buoy at rest (without a buoy: of the first top)."""
    simulation = Simulation(scene, MPI.COMM_SELF)
    try:
        read, place = _reader(simulation, direction_deg)
        times, rows = [], []
        for _ in simulation.run():
            times.append(simulation.t)
            rows.append(read())
        if simulation.control.failed:
            raise SolveError("steps failed: these waves are too rough for regular steps")
        return np.array(times), {name: np.array([row[name] for row in rows]) for name in rows[0]}, place
    finally:
        simulation.problem.destroy()


def _reader(simulation, direction_deg):
    """What reads motions and tensions at an instant, named as in `linear.seaway`."""
    problem, u = simulation.problem, simulation.problem.system.u
    bodies = [(name, buoy.fields.of(u[buoy.part.slice])) for name, buoy in problem.buoys.items()]  # views
    at_rest = {name: type(state)(*(part.copy() for part in state)) for name, state in bodies}
    place = at_rest[bodies[0][0]].position if bodies else u[problem.lines.top_dofs(problem.network.last_of(0))].copy()
    cables = problem.network.cables

    def read():
        found = {}
        for name, state in bodies:
            rest = at_rest[name]
            moved = rest._replace(**{n: getattr(state, n) - getattr(rest, n) for n in ("position", "orientation")})
            ending = f" of {name}" if len(bodies) > 1 else ""
            found |= {f"{n}{ending}": x for n, x in motions(rest, moved, direction_deg)._asdict().items()}
        if cables:
            tops = np.linalg.norm(np.reshape(simulation.latest_end_forces["end_tension"], (-1, 3)), axis=1)
            for k, (name, top) in enumerate(zip(cables, tops, strict=True)):
                ending = f"_{name}" if len(cables) > 1 else ""
                found |= {f"tension_top{ending}": float(top), f"tension_anchor{ending}": problem.anchor_tension(k)}
        return found

    return read, place


def compared(own: dict[str, complex], run: dict[str, complex]) -> dict[str, float]:
    """Difference [%] of the linear amplitudes' sizes from those of a run, of what moves at all beside its like.

    Without yaw, which of most buoys nothing holds.
    """
    found = {}
    for kind in ("motion", "turn", "tension"):
        sizes = {name: abs(run[name]) for name in run if name in own and _kind_of(name) == kind}
        for name in (n for n in sizes if sizes[n] > LEAST * max(sizes.values())):
            found[name] = 100 * (abs(own[name]) / sizes[name] - 1)
    return found


def _kind_of(name):
    return "tension" if name.startswith("tension") else KINDS.get(name.split()[0])
