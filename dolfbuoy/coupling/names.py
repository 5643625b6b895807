"""Parts of a scene that a caller can drive, load or read, by name."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..errors import InputError
from ..model.buoy import MOTION
from ..model.problem import Problem
from ..motion.start import initial_state
from ..scene import Scene
from ..scene.network import Network
from .paths import Array


def ends_of(network: Network, name: str) -> list[tuple[int, int]]:
    """[(piece, end: 0 at s = 0, 1 at s = L)] for "CABLE.from" or "CABLE.to", or for all lines at a joint."""
    cable, _, which = name.rpartition(".")
    if cable in network.cables and which in ("from", "to"):
        number = network.cables.index(cable)
        return [(network.first_of(number), 0) if which == "from" else (network.last_of(number), 1)]
    if name not in network.joints:
        return []
    return [(k, i) for k, piece in enumerate(network.pieces) for i in (0, 1) if piece.ends[i].name == name]


def driven_ends(network: Network, name: str) -> list[tuple[int, int]]:
    """`ends_of` a driven name.  Raises InputError for ends that are not held, or are moved by the scene."""
    pairs = ends_of(network, name)
    kinds = {network.pieces[k].ends[i].kind for k, i in pairs}
    if kinds == {"fixed"}:
        return pairs
    known = ", ".join(drivable(network)) or "there is nothing"
    why = "there is no such thing" if not pairs else "the scene moves it"
    why = why if kinds <= {"prescribed"} else "the scene does not hold it"
    raise InputError(f"driven = {name!r}: {why}; must be of {known}.")


def drivable(network: Network) -> list[str]:
    """Names of the parts that can be driven."""
    found = [name for name in network.buoys if _moored(network, name)]
    for number, cable in enumerate(network.cables):
        for which, k, i in (("from", network.first_of(number), 0), ("to", network.last_of(number), 1)):
            end = network.pieces[k].ends[i]
            found += [end.name or f"{cable}.{which}"] if end.kind == "fixed" else []
    found += [name for name in network.meetings() if "." not in name]
    return [*dict.fromkeys(found), *(f"{network.name_of(k)}.winch" for k in range(len(network.pieces)))]


def holding_joints(scene: Scene, driven: Iterable[str], comm: Any) -> Scene:
    """The scene with the driven free joints held at their rest positions, without their bodies.

    Raises InputError for a joint with a weld, or if both ends of a take-off would be held.
    """
    free = {joint.name: joint for joint in scene.joint or [] if joint.position is None}
    chosen = [name for name in driven if name in free]
    if not chosen:
        return scene
    for name in chosen:
        if free[name].weld:
            raise InputError(f"driven = {name!r}: lines go on there without a kink (weld), which would be lost.")
    for key, device in scene.network.take_offs.items():
        names = [end.name for end in device.ends]
        if set(names) & set(chosen) and all(end.held or end.name in chosen for end in device.ends):
            name = next(name for name in names if name in chosen)
            raise InputError(
                f"driven = {name!r}: both ends of {key} would be held; one of the two must be free to move."
            )
    start = initial_state(scene, comm, Problem)
    problem = Problem(scene, dynamic=True, comm=comm)
    try:
        problem.set_time(0.0)
        start.put(problem, problem.system.u)
        places = {name: _place_of(problem, name) for name in chosen}
    finally:
        problem.destroy()
    held = [type(j)(name=j.name, position=places[j.name]) if j.name in places else j for j in scene.joint or []]
    return scene.model_copy(update={"joint": held})


def end_now(problem: Any, piece: int, end: int) -> list[float]:
    """Present position of an end of a piece [m], on every rank."""
    mine = problem.system.u[problem.lines.end_dofs[piece][end]] if problem.lines.owns_end(piece, end) else None
    return [float(x) for x in next(place for place in problem.comm.allgather(mine) if place is not None)]


def _place_of(problem: Problem, name: str) -> tuple[float, ...]:
    """Position of a joint [m], on every rank."""
    return tuple(end_now(problem, *problem.network.meetings()[name][0]))


def wound_piece(network: Network, name: str) -> int | None:
    """Number of the piece whose length is "CABLE.winch" or "CABLE.NUMBER.winch"; None for other names.

    Raises InputError for a length that the scene itself changes.
    """
    names = {f"{network.name_of(k)}.winch": k for k in range(len(network.pieces))}
    piece = names.get(name)
    if piece is not None and network.pieces[piece].section.winch is not None:
        raise InputError(f"driven = {name!r}: the scene has a winch there already.")
    return piece


def mean_tension(problem: Any, piece: int) -> float:
    """Mean tension along a piece of line [N], on every rank: that felt by a winch that winds it uniformly."""
    lines, number = problem.lines.holder(piece)
    cells = lines.cells_of[number]
    sizes = np.diff(lines.cell_ends)[cells, 0]
    found = problem.comm.allreduce(np.array([sizes @ lines.mean_tension(problem.system.u)[cells], sizes.sum()]))
    return float(found[0] / found[1])


def check_body(network: Network, name: str) -> None:
    """Raise InputError for a buoy that cannot be driven."""
    initial = network.buoys[name].initial
    if not _moored(network, name):
        raise InputError(f"driven = {name!r}: no line hangs on it, so that nothing is left to be solved.")
    if initial is not None and (initial.buoy_velocity or initial.buoy_angular_velocity):
        raise InputError(f"driven = {name!r}: it begins at rest, and the scene gives it a velocity.")


def _moored(network: Network, name: str) -> bool:
    return any(end.name == name for piece in network.pieces for end in piece.ends)


def loaded_rows(problem: Any, name: str, driven: Any) -> tuple[int, Array]:
    """Number of components of a load on a part, 6 or 3, and their rows in the System; none on other ranks.

    driven: names of buoys and ends moved by the caller.  Raises InputError for parts that cannot be loaded.
    """
    network = problem.network
    if name in network.buoys and name not in driven:
        buoy = problem.buoys.get(name)
        at: Any = buoy and MOTION.of(np.arange(buoy.part.slice.start, buoy.part.slice.stop))
        return 6, np.concatenate([at.momentum, at.angular_momentum]) if at else np.zeros(0, int)
    pairs = [(k, i) for k, i in ends_of(network, name) if network.pieces[k].ends[i].kind in ("free", "joint")]
    if not pairs:
        known = [buoy for buoy in network.buoys if buoy not in driven] + list(network.meetings())
        tops = {cable: network.pieces[network.last_of(k)].ends[1] for k, cable in enumerate(network.cables)}
        known += [f"{cable}.to" for cable, top in tops.items() if top.kind == "free"]
        raise InputError(f"load: {name!r} must be of what moves freely: {', '.join(known) or 'there is nothing'}.")
    if name in network.bodies:  # its rows, not those of a line there, which give its tension
        bodies = problem.bodies
        return 3, bodies.part.offset + bodies.dofs[bodies.names.index(name)] if bodies else np.zeros(0, int)
    piece, end = pairs[0]
    return 3, problem.lines.end_dofs[piece][end] if problem.lines.owns_end(piece, end) else np.zeros(0, int)
