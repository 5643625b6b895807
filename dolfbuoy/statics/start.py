"""Initial guesses of the statics: lines along given points, or closed forms in still water under all steady loads.

The drag of a current is estimated as that of cross-flow on hulls and lines, half of each line's at either end.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..errors import SolveError
from ..model.contact import plane
from ..model.effects import called_by
from ..model.lines import top_position
from ..model.problem import Problem
from ..model.rigid import mass_properties, mooring_offset, rotation_of, shape_of
from ..model.sea import heading, strongest, velocity_at, wind_at
from ..model.surfacing import surfacing
from ..model.varying import varies
from ..scene import Scene
from ..scene.buoy import Buoy
from ..scene.network import Network as SceneNetwork
from ..scene.network import attached_ends
from ..scene.take_off import TakeOff
from . import network as still
from .adrift import floating_height, places_adrift
from .catenary import Array
from .first_shape import given_ends, given_shapes, points_of
from .on_bed import Bed
from .rods import Bent, bend

UPRIGHT, OVERTURNED = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0, 0.0])
#: Horizontal force on a slack line without any, as a fraction of its weight, to give its fold a width.
NUDGE = 1e-3


class Start(NamedTuple):
    """Shapes of all pieces, and orientations of the buoys by name."""

    problem: Problem
    shapes: Sequence[still.Shape]
    poses: dict[str, Array]

    def put(self) -> None:
        """Write the start to the unknowns of the Problem, with all data of the scene."""
        problem, u, lines = self.problem, self.problem.system.u, self.problem.lines
        floor = 1e-3 * problem.typical_force  # a slack point of the closed form has no stiffness
        for k, shape in enumerate(self.shapes[: len(problem.network.pieces)]):
            if isinstance(shape, Bent):
                lines.set_shape(u, shape.position, shape.tension, k)
                lines.set_moment(u, shape.moment, k)
            else:
                lines.set_shape(u, shape.position, lambda s, shape=shape: np.maximum(shape.tension(s), floor), k)
        for a in problem.attachments:
            u[a.slice] = np.concatenate(self.end(a.piece, a.end))
            if a.clamp:
                clamp: Any = problem.network.pieces[a.piece].ends[a.end].clamp
                way = rotation_of(self.poses[str(problem.network.pieces[a.piece].ends[a.end].name)]) @ clamp.unit
                u[a.clamp.slice] = [*way, *self.moment(a.piece, a.end)]
        for device in problem.take_offs:
            places = self.device(device.name)
            T, _ = device.section.at_rest(float(np.linalg.norm(places[1] - places[0])))
            for end, place, sign in zip(device.ends, places, (1, -1), strict=True):
                force = sign * T * _direction(places[1] - places[0])
                u[end.slice] = [*place, *force][: end.slice.stop - end.slice.start]
        for name, buoy in problem.buoys.items():
            held: list[Any] = [*problem.attached_to(buoy), *problem.take_offs_on(buoy)]
            q4 = self.poses[name]
            if held:
                r_C = held[0].of(u).point - rotation_of(q4) @ held[0].offset.value
            else:
                r_C = np.array([0.0, 0.0, floating_height(problem.scene, buoy.section)])
            u[buoy.part.slice] = buoy.reference.x.array[:] = np.concatenate([r_C, q4])
        problem.set_time(0.0)
        problem.system.share()

    def device(self, name: str) -> list[Array]:
        """Positions of both ends of a take-off [m]; take-offs follow the lines as pieces."""
        network = self.problem.network
        shape = self.shapes[len(network.pieces) + list(network.take_offs).index(name)]
        return [shape.position(np.array([s]))[0] for s in (0.0, _spring(network.take_offs[name].section)[0])]

    def end(self, piece: int, end: int) -> tuple[Array, Array]:
        """(position [m], force of the line there [N]) of an end of a piece."""
        s = np.array([self.problem.network.pieces[piece].section.length * end])
        return self.shapes[piece].position(s)[0], self.shapes[piece].force(s)[0] * (-1 if end else 1)

    def moment(self, piece: int, end: int) -> Array:
        """m at an end of a piece [N m]."""
        shape = self.shapes[piece]
        return shape.moments[-end] if isinstance(shape, Bent) else np.zeros(3)


def given_start(problem: Problem) -> Start:
    """Lines along initial.points, upright buoys at their ends.  Raises InputError."""
    scene, network = problem.scene, problem.network
    poses: dict[str, tuple[Array, Array]] = {}
    for k, i in attached_ends(network):
        end = network.pieces[k].ends[i]
        point = points_of(scene, network.pieces[k].cable)[-i]
        poses.setdefault(str(end.name), (point - mooring_offset(network.buoys[str(end.name)], end.fairlead), UPRIGHT))
    lines = given_shapes(scene, poses)
    shapes = [still.Drawn(shape) for shape in lines]
    for device, (low, high) in zip(network.take_offs.values(), given_ends(scene, lines, poses), strict=True):
        shapes.append(still.Drawn(partial(_straight, low, (high - low) / _spring(device.section)[0])))
    return Start(problem, shapes, dict.fromkeys(network.buoys, UPRIGHT))


def closed_form(problem: Problem, easier: Callable[[still.Network], still.Network] = lambda network: network) -> Start:
    """Lines at rest in still water; easier: simplifies the network of the Problem.  Raises SolveError."""
    poses, scene = dict.fromkeys(problem.network.buoys, UPRIGHT), problem.scene
    c: Any = scene.current
    pressure = np.zeros(3)  # stagnation pressure of the strongest current, in its direction [Pa]
    if c is not None and scene.sea is not None and varies(c):
        stream = strongest(scene)
        pressure = 0.5 * scene.sea.density * np.linalg.norm(stream) * stream
    elif c is not None and scene.sea is not None:
        speed: float = c.speed if c.speed is not None else max(speed for _, speed in c.profile)
        pressure = 0.5 * scene.sea.density * speed**2 * heading(c.direction_deg)

    def rest() -> Start:
        network = easier(still_network(problem, poses, pressure))
        try:
            found = still.solve(network)
        except SolveError:
            if network.surface is None:
                raise
            network = replace(network, surface=None)
            found = still.solve(network)
        if c is not None and problem.lines and not varies(c):
            network, found = _in_stream(
                problem, network, found, lambda drags: easier(still_network(problem, poses, pressure, drags))
            )
        for change in (_drawn_apart, _propped):
            joints = change(problem, network, found)
            if any(a is not b for a, b in zip(joints, network.joints, strict=True)):
                network = replace(network, joints=joints)
                found = still.solve(network, found)
        if not problem.network.bends:
            return Start(problem, found.shapes, poses)
        return Start(problem, *bend(problem.network, found, poses, scene.sea is not None))

    start = rest()
    overturned = [name for name, pose in poses.items() if start.poses[name] is pose and _overturns(start, name)]
    poses |= dict.fromkeys(overturned, OVERTURNED)
    return rest() if overturned else start


def _straight(place: Array, way: Array, s: Array) -> Array:
    return np.asarray(place + np.multiply.outer(np.asarray(s), way))


def _aside(problem: Problem) -> Array:
    """Direction of the current, or of x."""
    current = problem.scene.current
    return heading(current.direction_deg if current else 0.0)


def _drawn_apart(problem: Problem, network: still.Network, rest: still.Rest) -> list[still.Joint]:
    """Joints of the network; free joints of slack lines without width are pulled aside."""
    along, joints = _aside(problem), list(network.joints)
    for piece, pull, lying in zip(network.pieces, rest.pulls, rest.lying, strict=True):
        weight, joint = abs(piece.w) * piece.length, joints[piece.end]
        folds = pull[2] * (pull[2] + piece.w * (piece.length - lying)) < -NUDGE * weight**2
        if joint.free and (folds or lying > 0) and np.hypot(*pull[:2]) < NUDGE * weight:
            joints[piece.end] = replace(joint, push=joint.push + NUDGE * weight * along)
    return joints


def _propped(problem: Problem, network: still.Network, rest: still.Rest) -> list[still.Joint]:
    """Joints of the network; those of struts, two-sided lines among ropes, are fixed aside at the struts' length."""
    joints = list(network.joints)
    sections = problem.lines.sections if problem.lines else []
    for piece, section in zip(network.pieces, sections, strict=False):  # take-offs follow
        ends = sorted((piece.start, piece.end), key=lambda i: network.joints[i].free)
        held, free = (network.joints[i] for i in ends)
        way = rest.positions[ends[1]] - rest.positions[ends[0]]
        is_strut, reach = problem.law is not None and section.slack == "compressive", (1 - NUDGE) * piece.length
        if held.free or not free.free or not is_strut or np.linalg.norm(way) > reach:
            continue
        level = way * [1.0, 1.0, 0.0] if np.hypot(*way[:2]) > NUDGE * piece.length else _aside(problem)
        level *= np.sqrt(reach**2 - way[2] ** 2) / np.linalg.norm(level)
        place = rest.positions[ends[0]] + level + [0.0, 0.0, way[2]]
        joints[ends[1]] = replace(free, free=False, position=place)
    return joints


def _overturns(start: Start, name: str) -> bool:
    """True if a buoy that does not float hangs upside down on its lines."""
    network, scene = start.problem.network, start.problem.scene
    if scene.sea is not None and scene.gravity:
        return False
    ends = [(k, i, network.pieces[k].ends[i]) for k, i in attached_ends(network)]
    offsets = [(k, i, mooring_offset(network.buoys[name], e.fairlead)[2]) for k, i, e in ends if e.name == name]
    return bool(sum(start.end(k, i)[1][2] * offset for k, i, offset in offsets) < 0)


#: Rounds of updating the drag on lines from their shapes, and number of points per line.
ROUNDS, POINTS = 6, 9
#: Least drag of a line, relative to the typical force of its scene, that has a direction.
FELT = 1e-12


def _in_stream(
    problem: Problem, network: still.Network, rest: still.Rest, make: Callable[[dict[int, Array]], still.Network]
) -> tuple[still.Network, still.Rest]:
    """The network and its equilibrium with the mean drag of the current on every piece that touches neither bed nor
    surface; make: drags by numbers of pieces [N/m] -> network."""
    drags: dict[int, Array] = {}
    for _ in range(ROUNDS):
        free = np.flatnonzero(rest.lying <= still.LYING * np.array([piece.length for piece in network.pieces]))
        lines = [int(k) for k in free if k < len(problem.lines.sections)]
        new = {k: _drag(problem, k, rest.shapes[k]) for k in lines}
        counts = {
            k for k, x in new.items() if np.linalg.norm(x) * network.pieces[k].length > FELT * problem.typical_force
        }
        drags = {k: new[k] if k not in drags else (new[k] + drags[k]) / 2 for k in counts}
        try:
            following = replace(make(drags), surface=network.surface)
            found = still.solve(following, rest)
            _ = found.shapes
        except SolveError:
            break
        moved = float(np.abs(found.positions - rest.positions).max(initial=0.0))
        network, rest = following, found
        if moved < 1e-3 * max(piece.length for piece in network.pieces):
            break
    return network, rest


def _drag(problem: Problem, piece: int, shape: still.Shape) -> Array:
    """Mean drag of the current on a piece in its shape, per unstretched length [N/m]."""
    scene, c = problem.scene, problem.lines.sections[piece]
    if scene.sea is None or not c.diameter or not (c.normal_drag or c.tangential_drag):
        return np.zeros(3)
    r = shape.position(np.linspace(0.0, c.length, POINTS))
    way = np.diff(r, axis=0)
    size = np.linalg.norm(way, axis=1, keepdims=True)
    t = way / np.maximum(size, 1e-12 * c.length)
    U = velocity_at(scene.model_copy(update={"waves": None}), 0.0, (r[1:] + r[:-1]) / 2)
    along = (U * t).sum(axis=1, keepdims=True) * t
    across = U - along
    force = c.normal_drag * np.linalg.norm(across, axis=1, keepdims=True) * across
    force = force + c.tangential_drag * np.linalg.norm(along, axis=1, keepdims=True) * along
    mean: Array = 0.5 * scene.sea.density * c.diameter * (force * size).sum(axis=0) / c.length
    return mean


def still_network(
    problem: Problem,
    poses: dict[str, Array] | None = None,
    pressure: Any = 0.0,
    drags: dict[int, Array] | None = None,
) -> still.Network:
    """The network of a Problem for `statics.network`: every buoy is a joint at its C, with its (upright) orientation.

    pressure: that of the current on hulls and lines (3,) [Pa].  drags: on pieces, by their numbers (3,) [N/m], instead
    of at their ends.
    """
    scene, network = problem.scene, problem.network
    weight = max((buoy.mass * scene.gravity for buoy in network.buoys.values()), default=0.0)
    joints: list[still.Joint] = []
    number: dict[object, int] = {}
    adrift = places_adrift(scene, lambda device: _spring(device)[0] if device.stiffness else 0.0)

    def place(end: Any) -> tuple[int, Any]:
        """(number of the joint, offset of the end from it)."""
        name = end.name or object()  # an end without a name is a separate joint
        if name not in number:
            number[name] = len(joints)
            joints.append(_joint(scene, network, end, pressure))
            if end.name in adrift:
                joints[-1] = replace(joints[-1], free=False, position=adrift[end.name])
        if end.kind != "buoy":
            return number[name], still.ORIGIN
        q4 = (poses or {}).get(end.name, UPRIGHT)
        return number[name], rotation_of(q4) @ mooring_offset(network.buoys[end.name], end.fairlead)

    pieces = []
    for k, piece in enumerate(network.pieces):
        (low, a), (high, b) = (place(end) for end in piece.ends)
        c: Any = piece.section
        drag = (drags or {}).get(k, np.zeros(3))
        pieces.append(still.Piece(low, high, c.length, _weight(problem, k), c.axial_stiffness, a, b, drag))
        if drag.any():
            continue
        push = c.normal_drag * (c.diameter or 0.0) * c.length / 2 * pressure
        for i in (low, high):
            joints[i] = replace(joints[i], push=joints[i].push + push)
    for device in network.take_offs.values():
        (low, a), (high, b) = (place(end) for end in device.ends)
        pieces.append(still.Piece(low, high, *_spring(device.section, weight), a, b))
    bed = Bed(*plane(scene)) if scene.seabed else None
    return still.Network(joints, pieces, bed, 0.0 if leaves_water(scene) else None)


def leaves_water(scene: Scene) -> bool:
    """True if lines and bodies at joints lose their buoyancy where they leave the water."""
    dry_above = scene.sea.dry_above if scene.sea else False
    return bool(surfacing(scene)) if dry_above is None else dry_above


#: Stiffness assumed for a take-off without static tension, as a fraction of a buoy's weight per metre.
WEAK = 1e-6
#: Length assumed for a take-off with constant tension [m].
SHORT = 1e-3


def _spring(device: TakeOff, weight: float = 1.0) -> tuple[float, float, float]:
    """(length [m], weight [N/m], stiffness EA [N]) of an elastic line with about the static tension of a take-off."""
    k = device.stiffness or abs(device.pretension) or WEAK * max(weight, 1.0)
    length = max((device.length or 0.0) - device.pretension / k if device.stiffness else 0.0, SHORT)
    return length, 0.0, k * length


def _direction(way: Array) -> Array:
    return np.asarray(way / max(float(np.linalg.norm(way)), 1e-300))


def _weight(problem: Problem, piece: int) -> float:
    """Weight per length [N/m]: in water, or in air for a buoyant piece with both ends above the water."""
    scene, given = problem.scene, problem.network.pieces[piece]
    weight = float(problem.lines.weight_of(piece))
    dry = all(end.held and end.position is not None and end.position[2] > 0 for end in given.ends)
    if weight < 0 and dry and called_by(scene, "line_wet"):
        return float(given.section.line_density * scene.gravity)
    return weight


def _joint(scene: Scene, network: SceneNetwork, end: Any, pressure: Any) -> still.Joint:
    """Network joint for the joint, fixed point or buoy that holds an end of a line."""
    if end.kind == "buoy":
        return still.Joint(free=True, load=_Floating(scene, network.buoys[end.name], pressure))
    if end.held or end.is_on_sinker:
        return still.Joint(position=top_position(end.top, 0.0))
    if end.kind == "free":
        return still.Joint(free=True, load=end.top.force)
    body, load = network.bodies.get(end.name), np.zeros(3)
    if body is not None and body.volume and leaves_water(scene):
        return still.Joint(free=True, load=_Ball(scene, body, pressure))
    if body is not None:
        displaced = scene.sea.density * body.volume if scene.sea else 0.0
        load = (displaced - body.mass) * scene.gravity * np.array([0.0, 0.0, 1.0]) + body.drag_area * pressure
    return still.Joint(free=True, load=load)


class _Ball:
    """Steady loads, and their derivative, on a body at a joint that may leave the water, by its position."""

    def __init__(self, scene: Scene, body: Any, pressure: Any):
        sea: Any = scene.sea
        self.radius = float(np.cbrt(0.75 * body.volume / np.pi))
        self.buoyancy = sea.density * body.volume * scene.gravity
        self.steady = body.drag_area * pressure - np.array([0.0, 0.0, body.mass * scene.gravity])

    def __call__(self, position: Array) -> tuple[Array, Array]:
        c = float(np.clip(-position[2] / self.radius, -1.0, 1.0))
        force, slope = self.steady.copy(), np.zeros((3, 3))
        force[2] += self.buoyancy * (0.5 + 0.75 * c - 0.25 * c**3)
        slope[2, 2] = -self.buoyancy * 0.75 * (1 - c * c) / self.radius
        return force, slope


class _Floating:
    """Steady loads and buoyancy of a buoy kept upright, and their derivative, by the position of its C."""

    def __init__(self, scene: Scene, buoy: Buoy, pressure: Any):
        self.scene = scene
        self.shape: Any = shape_of(buoy)
        self.mass = mass_properties(buoy)
        self.steady = np.array([0.0, 0.0, -self.mass.mass * scene.gravity])
        if buoy.external_force:
            self.steady = self.steady + buoy.external_force.force
        if buoy.wind:
            self.steady = self.steady + wind_at(buoy.wind, max(buoy.wind.height, 0.1))
        if self.shape:
            self.steady += buoy.normal_drag * self.shape.max_diameter * self.shape.height / 2 * pressure

    def __call__(self, position: Array) -> tuple[Array, Array]:
        force, slope = self.steady.copy(), np.zeros((3, 3))
        if self.scene.sea is not None:
            pressure, draft = self.scene.sea.density * self.scene.gravity, self.mass.height - position[2]
            force[2] += pressure * self.shape.volume(min(max(draft, 0.0), self.shape.height)) if draft > 0 else 0.0
            if 0 < draft < self.shape.height:
                slope[2, 2] = -pressure * np.pi * self.shape.waterplane_radius(draft) ** 2
        return force, slope
