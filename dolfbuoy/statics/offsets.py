"""Equilibria under a growing load from many directions, each the guess for the next: offset curves of a mooring."""

import contextlib
from collections.abc import Callable, Collection, Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..model.contact import has_friction
from ..model.problem import Problem
from ..model.sea import heading
from ..scene import Scene
from ..scene.buoy import Buoy, ExternalForce
from ..scene.sections import Current
from .catenary import Array
from .equilibrium import let_turn, solve_equilibrium

#: Largest number of halvings of a load step before its equilibrium is computed from scratch.
HALVINGS = 4


class Rest(NamedTuple):
    """An equilibrium: direction [deg] and size of the load [N or m/s]; the Problem that contains it until the next one
    is requested, or None and the reason."""

    direction: float
    size: float
    problem: Problem | None
    reason: str = ""


def loaded(scene: Scene, load: str, size: float, direction_deg: float, buoys: Collection[str] | None = None) -> Scene:
    """The scene with an additional horizontal load.

    "force": size [N] is added to the external force on each of these buoys (None: on all), at the same height (default:
    C).  "current": size [m/s] is the surface speed of the scene's current, or of a uniform one, towards that
    direction.
    """
    if load == "current":
        changes: dict[str, Any] = {"current": _current(scene, size, direction_deg)}
    else:
        more, found = size * heading(direction_deg), scene.network.buoys.items()
        changes = {"buoy": [_pulled(b, more) if buoys is None or name in buoys else b for name, b in found]}
    return scene.model_copy(update=changes)


def _pulled(buoy: Buoy, more: Array) -> Buoy:
    """A buoy with an addition to its external force."""
    own = buoy.external_force or ExternalForce(force=(0.0, 0.0, 0.0))
    force = tuple((np.array(own.force) + more).tolist())
    return buoy.model_copy(update={"external_force": own.model_copy(update={"force": force})})


def _current(scene: Scene, speed: float, direction_deg: float) -> Current:
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


def rests(
    scene: Scene,
    load: str,
    sizes: Iterable[float],
    directions_deg: Iterable[float],
    comm: Any = MPI.COMM_WORLD,
    buoys: Collection[str] | None = None,
) -> Iterator[Rest]:
    """The equilibria under all sizes of a load from all directions, direction by direction; collective.

    buoys: names of those on which a force acts, in full on each; None: all.  Raises InputError for a scene without a
    moored buoy or without one of these, or without any equilibrium.
    """
    network = scene.network
    if not network.buoys or not network.pieces:
        raise InputError("Offsets are those of moored buoys: they need [buoy] and [cable].")
    unknown = [name for name in buoys or [] if name not in network.buoys]
    if unknown:
        raise InputError(f"buoy {unknown[0]}: must be one of {', '.join(network.buoys)}.")
    calm, problem = scene.model_copy(update={"waves": None}), None

    try:
        for direction in directions_deg:
            reached = None
            for size in sizes:
                on_the_way = partial(loaded, calm, load, direction_deg=direction, buoys=buoys)
                problem, reason = _follow(problem, on_the_way, reached, size, comm)
                reached = None if reason else size
                yield Rest(direction, size, None if reason else problem, reason)
    finally:
        if problem is not None:
            problem.destroy()


def _follow(
    problem: Problem | None, scene_of: Callable[[float], Scene], start: float | None, end: float, comm: Any
) -> tuple[Problem | None, str]:
    """Go from one size (None: from scratch) to another; returns (Problem, reason)."""
    if problem is not None and start is not None:
        friction = problem.scene.seabed and has_friction(problem.scene, dynamic=False)
        if problem.lines.growth is None and not friction:  # else more than Newton is needed
            with contextlib.suppress(SolveError):
                _march(problem, scene_of, start, end)
                return problem, ""
    try:
        fresh = solve_equilibrium(scene_of(end), comm)
    except SolveError as error:
        return problem, str(error)
    if problem is not None:
        problem.destroy()
    return fresh, ""


def _march(
    problem: Problem, scene_of: Callable[[float], Scene], start: float, end: float, left: int = HALVINGS
) -> None:
    """Newton at the end from the solution at the start; if it fails, in two steps of half the size."""
    kept = problem.system.u.copy()
    problem.change(scene_of(end))
    try:
        problem.set_time(0.0)
        problem.newton.solve()
        let_turn(problem)  # `change` has restored the spring that restrains yaw
    except SolveError:
        if not left:
            raise
        problem.system.u[:] = kept
        middle = (start + end) / 2
        _march(problem, scene_of, start, middle, left - 1)
        _march(problem, scene_of, middle, end, left - 1)
