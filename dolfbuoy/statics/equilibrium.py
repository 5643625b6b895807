"""Static equilibrium of a scene: lines with buoys, or freely floating buoys."""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..model.contact import has_friction
from ..model.feasible import check_feasible
from ..model.lines import top_position
from ..model.prescribed_ends import adrift_nowhere
from ..model.problem import Problem
from ..model.rigid import weight_per_length
from ..scene import Scene
from .adrift import held_by_take_offs
from .damped import relax
from .growth import settle
from .pulled import pull
from .rods import weak_springs
from .start import Start, closed_form, given_start
from .ways import MOTIONS, WAYS, Way, find_rest

#: Change of yaw below which it is accepted [rad].
SETTLED = 1e-11
#: Residual torque and force, relative to typical ones, accepted where yaw or position is indeterminate.
BALANCED = 1e-8


def solve_equilibrium(scene: Scene, comm: Any = MPI.COMM_WORLD, make: Callable[..., Problem] = Problem) -> Problem:
    """Solve for equilibrium in current, wind and external force (no waves); the solution is in `problem.system.u`.

    make: (scene, dynamic, comm) -> Problem; other factories than Problem may reuse one (`model.pool`).

    Raises InputError for a scene that has no equilibrium, SolveError if the solve fails.
    """
    check_feasible(scene)
    if not scene.network.pieces:
        return _free_buoys(scene, comm, make)
    problem = make(scene, dynamic=False, comm=comm)
    _check_determined(problem)
    if problem.lines.growth is None:
        _rest(problem)
    else:
        settle(problem, lambda: _rest(problem))
    if scene.seabed is not None and has_friction(scene, dynamic=False):
        pull(problem)
    return problem


def _rest(problem: Problem) -> None:
    """Frictionless equilibrium, from the closed form or the points of the scene; the latter also if all else fails."""
    initial, reasons = problem.scene.initial, []
    starts: list[tuple[str, Callable[[Problem], Start], Sequence[Way]]] = [("", closed_form, WAYS)]
    if initial.points is not None:
        starts.insert(0 if initial.kind == "equilibrium" else 1, ("initial.points, ", given_start, MOTIONS))
    problem.iterations = 0
    for name, start, ways in starts:
        try:
            find_rest(problem, start(problem).put, ways)
        except SolveError as error:
            reasons.append(f"{name}{error}")
            continue
        problem.route = f"{name}{problem.route}"
        let_turn(problem)
        return
    with suppress(SolveError):
        reasons += weak_springs(problem.network, closed_form(problem).shapes)
    raise SolveError("; ".join(reasons))


def _check_determined(problem: Problem) -> None:
    """Refuse a scene in which a tension or position is undetermined.  Raises InputError."""
    scene, network = problem.scene, problem.network
    for piece in network.pieces:
        c: Any = piece.section
        key, w = network.key_of(piece.cable), weight_per_length(scene, piece.section)
        key += f".segments.{piece.number}" if len(network.pieces_of(piece.cable)) > 1 else ""
        ends: Sequence[Any] = piece.ends
        top, loose = ends[1].top, w == 0 and scene.current is None and not c.bending_stiffness
        if ends[1].kind == "free" and loose and not any(top.force) and len(network.pieces) == 1:
            raise InputError(
                f"{key}.top.force = {list(top.force)}: nothing pulls at this cable, which has no weight here either: "
                "nothing determines its equilibrium; give a force, weight or a current, or take another initial.kind."
            )
        if not all(end.held for end in ends):
            continue
        distance = math.dist(*(top_position(end.top, 0.0) for end in ends))
        if math.isinf(c.axial_stiffness) and distance >= c.length * (1 - 1e-12):
            raise InputError(
                f"{key}.length = {c.length}: must be more than the {distance:.6g} m between its ends: an inextensible "
                "cable is then exactly taut and its tension undetermined; give a finite axial_stiffness or more length."
            )
        if loose and distance < c.length:
            raise InputError(
                f"{key}.line_density = {c.line_density}: this cable has no weight here and is longer than the "
                f"{distance:.6g} m between its ends: nothing determines its equilibrium; give it weight or a current, "
                "or take another initial.kind."
            )
    _check_taut(network)
    for buoy in network.buoys.values():
        if not (scene.gravity or scene.current or buoy.wind or buoy.external_force):
            raise InputError(
                "gravity = 0.0: no load holds the moored buoy, which may rest anywhere within reach of its cable: "
                "nothing determines its equilibrium; give gravity, current, wind or external_force, or "
                "initial.buoy_position."
            )


def _check_taut(network: Any) -> None:
    """Refuse inextensible cables that are taut between two fixed points, via joints.  Raises InputError."""
    nodes: dict[Any, int] = {}
    ways = []
    for piece in network.pieces:
        ends = [tuple(top_position(end.top, 0.0)) if end.held else end.name for end in piece.ends]
        if math.isinf(piece.section.axial_stiffness) and all(end.held or end.kind == "joint" for end in piece.ends):
            low, high = (nodes.setdefault(end, len(nodes)) for end in ends)
            ways.append((piece.section.length, low, high))
    held = {node: np.array(place) for place, node in nodes.items() if not isinstance(place, str)}
    if len(held) == len(nodes):
        return
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import shortest_path  # slow to import

    lengths, low, high = np.array(ways).T
    # of two cables between the same nodes keep the shorter one: csr_matrix would add them up
    order = np.lexsort((lengths, high, low))
    first = order[np.unique(np.column_stack([low, high])[order], axis=0, return_index=True)[1]]
    graph = csr_matrix((lengths[first], (low[first], high[first])), 2 * (len(nodes),))
    found = shortest_path(graph, directed=False, indices=[*held])
    for (a, place), row in zip(held.items(), found, strict=True):
        for b, other in held.items():
            distance = math.dist(place, other)
            if b > a and row[b] <= distance * (1 + 1e-12):
                raise InputError(
                    f"Inextensible cables {row[b]:.6g} m long together lead from {place.tolist()} to "
                    f"{other.tolist()}: they must be more than the {distance:.6g} m between these: exactly taut, "
                    "their tension is undetermined; give one of them a finite axial_stiffness or more length."
                )


def _free_buoys(scene: Scene, comm: Any, make: Callable[..., Problem]) -> Problem:
    """Equilibrium of buoys without lines, upright; in still water unless take-offs hold all of them, because steady
    horizontal loads would set them adrift.  Without water to float in either, they stay at their start."""
    held = scene.network.buoys.keys() <= held_by_take_offs(scene.network)
    calm = scene if held else adrift_nowhere(scene)
    problem = make(calm.model_copy(update={"waves": None}), dynamic=False, comm=comm)
    if held or (scene.sea is not None and scene.gravity):
        _rest(problem)
    else:
        closed_form(problem).put()
        problem.system.publish()
        problem.iterations, problem.route = 0, "none: it floats where it is"
    return problem


def let_turn(problem: Problem) -> None:
    """Find the yaw under off-axis lines, and the position of buoys without lines: the artificial spring that restrains
    yaw or drift is re-centred and weakened until the pose settles; if that fails, the buoy turns in a damped motion."""
    parts: list[Any] = [*problem.network.pieces, *problem.network.take_offs.values()]
    if not any(end.fairlead for part in parts for end in part.ends) and not problem.network.take_offs:
        return
    for _ in range(20):
        before = problem.system.u.copy()
        for buoy in problem.buoys.values():
            buoy.reference.x.array[:] = before[buoy.part.slice]
            buoy.gauge.value = 0.1 * buoy.gauge.value
        try:
            problem.iterations += problem.newton.solve()
        except SolveError:
            left = problem.system.residual_by_block()
            if max(left["buoy torque balance"], left["buoy position r_C"]) < BALANCED:
                return  # only the gauge restrains it: any position will do
            break
        change = problem.system.u - before
        turns = [b.fields.of(change[b.part.slice]).orientation for b in problem.buoys.values()]
        turns += [b.fields.of(change[b.part.slice]).position for b in problem.buoys.values() if problem.take_offs_on(b)]
        largest = max((float(np.abs(turn).max()) for turn in turns), default=0.0)
        if max(problem.comm.allgather(largest)) < SETTLED:
            return
    for buoy in problem.buoys.values():
        buoy.gauge.value = 1e-9 * buoy.gauge.value
    try:
        relax(problem, growth=1.1, steps=900)
    except SolveError as error:
        raise SolveError(f"the yaw and the places of the buoys were not found: {error}") from None
