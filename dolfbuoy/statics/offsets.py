"""Rest under a growing load from many sides, each solution the start of the next: offset curves of a mooring."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from ..errors import InputError, SolveError
from ..model.problem import Problem
from ..model.sea import heading
from ..scene.network import network_of
from ..scene.sections import Current, ExternalForce
from .equilibrium import solve_equilibrium

#: A step of the load is halved as often as this before its equilibrium is looked for anew.
HALVINGS = 4
LOADS = ("force", "current")


class Rest(NamedTuple):
    """An equilibrium: direction [deg] and size of the load [N or m/s]; the Problem that holds it until the next one is
    asked for, or None and the reason why there is none."""

    direction: float
    size: float
    problem: Problem | None
    reason: str = ""


def loaded(scene, load: str, size: float, direction_deg: float):
    """The scene with more of a horizontal load.

    "force": size [N] is added to its external force, at the same height (default: C).  "current": size [m/s] is the
    speed at the surface of its current, or of a uniform one, which flows into that direction.
    """
    if load == "current":
        return scene.model_copy(update={"current": _current(scene, size, direction_deg)})
    own = scene.external_force or ExternalForce(force=(0.0, 0.0, 0.0))
    force = np.array(own.force) + size * heading(direction_deg)
    return scene.model_copy(update={"external_force": own.model_copy(update={"force": tuple(force.tolist())})})


def _current(scene, speed, direction_deg):
    if scene.current is None:
        return Current(speed=speed, direction_deg=direction_deg)
    found = {"direction_deg": direction_deg}
    if not isinstance(scene.current.profile, list):
        return scene.current.model_copy(update=found | {"speed": speed})
    top = scene.current.profile[-1][1]
    if not top:
        raise InputError("current.profile: has no speed at its upper end that could be varied.")
    rows = [(z, own * speed / top) for z, own in scene.current.profile]
    return scene.current.model_copy(update=found | {"profile": rows})


def rests(scene, load: str, sizes, directions_deg, comm=MPI.COMM_WORLD) -> Iterator[Rest]:
    """The equilibria under all sizes of a load from all directions, direction by direction; collective.

    Raises InputError for a scene without buoy, or one that has no equilibrium at all.
    """
    network = network_of(scene)
    if len(network.buoys) != 1 or not network.pieces:
        raise InputError("Offsets are those of one moored buoy: they need one [buoy] and a [cable].")
    calm, problem = scene.model_copy(update={"waves": None}), None
    try:
        for direction in directions_deg:
            reached = None
            for size in sizes:
                problem, reason = _follow(problem, calm, load, (reached, size), direction, comm)
                reached = None if reason else size
                yield Rest(direction, size, None if reason else problem, reason)
    finally:
        if problem is not None:
            problem.destroy()


def _follow(problem, scene, load, sizes, direction, comm):
    """From the first of two sizes (None: from anywhere) to the second; (Problem, reason)."""
    start, end = sizes
    if start is not None:
        try:
            _march(problem, lambda size: loaded(scene, load, size, direction), start, end)
            return problem, ""
        except SolveError:
            pass
    try:
        fresh = solve_equilibrium(loaded(scene, load, end, direction), comm)
    except SolveError as error:
        return problem, str(error)
    if problem is None:
        return fresh, ""
    problem.change(fresh.scene)
    problem.system.u[:] = fresh.system.u
    if problem.buoy:
        problem.buoy.reference.x.array[:] = fresh.buoy.reference.x.array
    fresh.destroy()
    _settle(problem)
    return problem, ""


def _march(problem, scene_of, start, end, left=HALVINGS):
    """Newton at the end from the solution at the start; where it fails, in two steps of half the size."""
    kept = problem.system.u.copy()
    problem.change(scene_of(end))
    try:
        _settle(problem)
    except SolveError:
        if not left:
            raise
        problem.system.u[:] = kept
        middle = (start + end) / 2
        _march(problem, scene_of, start, middle, left - 1)
        _march(problem, scene_of, middle, end, left - 1)


def _settle(problem):
    problem.set_time(0.0)
    problem.newton.solve()
