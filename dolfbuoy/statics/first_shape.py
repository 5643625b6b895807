"""Initial shapes of the cables and poses of the buoys, if given by the scene."""

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..errors import InputError
from ..model.rigid import mooring_offset, rotation_of
from ..scene import Scene
from ..scene.buoy import BuoyStart
from ..scene.network import End, Network
from .catenary import Array

#: Tolerance for coincident points, as a fraction of a length.
SAME = 1e-6
#: (r_C, q4) of buoys by name.
Poses = Mapping[str, tuple[Array, Array]]


def check_first_shape(scene: Scene) -> None:
    """Refuse a straight line or polyline that is impossible for its cable.  Raises InputError."""
    network = scene.network
    if network.pieces and scene.initial.kind != "equilibrium":
        given_shapes(scene, {name: given_pose(buoy.initial) for name, buoy in network.buoys.items()})


def given_pose(initial: BuoyStart | None) -> tuple[Array, Array]:
    """(r_C, q4) from the section [initial] of a buoy.  Raises InputError."""
    if initial is None or initial.buoy_position is None:
        raise InputError("initial.buoy_position: must be given, this start of a moored buoy needs it.")
    q4 = np.array(initial.buoy_orientation or (1.0, 0.0, 0.0, 0.0))
    return np.array(initial.buoy_position), q4 / np.linalg.norm(q4)


def place_of(network: Network, end: End, poses: Poses) -> Any:
    """Position of an end of a line at t = 0, shape (3,) [m]; None for a free one."""
    if end.kind == "buoy" and end.name:
        r_C, q4 = poses[end.name]
        return r_C + rotation_of(q4) @ mooring_offset(network.buoys[end.name], end.fairlead)
    return np.array(end.top.position) if end.top is not None and end.held else None


def with_buoys_held(scene: Scene, poses: Poses) -> Scene:
    """The scene with its buoys replaced by fixed ends of lines."""
    network, cables = scene.network, []
    for number, cable in enumerate(scene.cables):
        changes: dict[str, Any] = {}
        for name, index, piece in (("from", 0, network.first_of(number)), ("to", 1, network.last_of(number))):
            end = network.pieces[piece].ends[index]
            if end.kind == "buoy":
                changes[name] = tuple(float(x) for x in place_of(network, end, poses))
                if end.clamp is not None:
                    turned = rotation_of(poses[str(end.name)][1]) @ end.clamp.direction
                    changes[f"{name}_end"] = end.clamp.model_copy(update={"direction": tuple(turned.tolist())})
        cables.append(cable.model_copy(update=changes))
    absent = dict.fromkeys(("buoy", "wind", "external_force"))
    return scene.model_copy(update={"cable": cables, "take_off": _beside_buoys(network, poses), **absent})


def _beside_buoys(network: Network, poses: Poses) -> Any:
    """Take-offs of a network with buoys replaced by fixed ends; those between two fixed ends are omitted."""
    found = []
    for device in network.take_offs.values():
        if any(end.kind == "joint" for end in device.ends):
            places = (place_of(network, end, poses) for end in device.ends)
            pairs = zip(("from", "to"), device.ends, places, strict=True)
            fixed = {key: tuple(map(float, x)) for key, end, x in pairs if end.kind == "buoy"}
            found.append(device.section.model_copy(update=fixed))
    return found or None


def given_shapes(scene: Scene, poses: Poses) -> list[Callable[[Any], Array]]:
    """Initial shapes of the pieces of line, functions s -> points (n, 3).  Raises InputError."""
    network = scene.network
    shapes: list[Callable[[Any], Array]] = []
    joints: dict[str | None, Array] = {}
    for number in range(len(network.cables)):
        pieces = [network.pieces[k] for k in network.pieces_of(number)]
        length = sum(piece.section.length for piece in pieces)
        ends = pieces[0].ends[0], pieces[-1].ends[1]
        places = [place_of(network, end, poses) for end in ends]
        points, key = _points_of(scene, number, ends, places)
        for index, end, place, word in zip((0, -1), ends, places, ("the anchor", "the top of the cable"), strict=True):
            if place is not None:
                _check_place(points, key, index, place, length, f"must be {word}")
            if end.kind == "joint":
                place, word = joints.setdefault(end.name, points[index]), f"where other cables have {end.name},"
                _check_place(points, key, index, place, length, f"must be {word}")
        elastic = all(np.isfinite(piece.section.axial_stiffness) for piece in pieces)
        _check_length(scene, points, network.key_of(number), length, elastic)
        begin = 0.0
        for piece in pieces:
            shapes.append(_along(points, length, begin))
            begin += piece.section.length
    return shapes


def given_ends(scene: Scene, shapes: list[Callable[[Any], Array]], poses: Poses) -> list[tuple[Array, Array]]:
    """Positions of both ends of each take-off [m]; shapes: those of the pieces of line.  Raises InputError."""
    network, places = scene.network, dict[str | None, Array]()
    for piece, shape in zip(network.pieces, shapes, strict=True):
        for s, end in zip((0.0, piece.section.length), piece.ends, strict=True):
            if end.kind == "joint":
                places[end.name] = shape(np.array([s]))[0]

    def place(end: End) -> Array:
        if end.kind == "buoy" and end.name not in poses:
            raise InputError(f"initial.points: no line ends at {end.name}, so that they do not say where it is.")
        return places[end.name] if end.name in places else np.asarray(place_of(network, end, poses))

    return [(place(low), place(high)) for low, high in (device.ends for device in network.take_offs.values())]


def _points_of(scene: Scene, number: int, ends: tuple[End, End], places: list[Array | None]) -> tuple[list[Array], str]:
    """(points of the initial line of a cable, name of their key).  Raises InputError."""
    given, name = scene.initial.points, scene.network.cables[number]
    if scene.initial.kind != "straight":
        return points_of(scene, number), "initial.points" + (f".{name}" if isinstance(given, dict) else "")
    known = []
    for end, place in zip(ends, places, strict=True):
        if place is None and end.top is not None and end.top.position is not None:
            place = np.array(end.top.position)  # of a free end: position of release
        if place is None:
            raise InputError(f"initial.kind = 'straight': where cable.{name} ends is not known; take 'polyline'.")
        known.append(place)
    return known, "initial.points"


def points_of(scene: Scene, number: int) -> list[Array]:
    """initial.points of a cable.  Raises InputError."""
    cables, given = scene.network.cables, scene.initial.points
    if not isinstance(given, dict):
        if len(cables) > 1:
            raise InputError(
                f"initial.points = {given}: several cables need a table of points by name, of {', '.join(cables)}."
            )
        return [np.array(p) for p in given or []]
    if cables[number] not in given or not set(given) <= set(cables):
        raise InputError(f"initial.points: must have the points of each cable by name, of {', '.join(cables)}.")
    return [np.array(p) for p in given[cables[number]]]


def _check_place(points: list[Array], key: str, index: int, place: Array, length: float, must: str) -> None:
    """Refuse a first or last point that does not coincide with its end.  Raises InputError."""
    if np.linalg.norm(points[index] - place) > SAME * length:
        shown, wanted = (tuple(float(x) for x in y) for y in (points[index], place))
        raise InputError(f"{key}[{index}] = {shown}: {must} {wanted}.")


def _check_length(scene: Scene, points: list[Array], key: str, length: float, elastic: bool) -> None:
    kind, total = scene.initial.kind, sum(float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(points))
    if not elastic and abs(total - length) > SAME * length:
        raise InputError(
            f"initial.kind = '{kind}': the line is {total:.8g} m long, but an inextensible cable must keep its "
            f"{key}.length = {length:.8g} m."
        )
    if total == 0:
        raise InputError(f"initial.kind = '{kind}': must be a line with a length, not one point.")


def _along(given: list[Array], length: float, begin: float) -> Callable[[Any], Array]:
    """Function s -> point on the polyline, arc length proportional to begin + s."""
    points = np.array(given)
    corners = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    corners *= length / corners[-1]
    return lambda s: np.column_stack([np.interp(s + begin, corners, points[:, k]) for k in range(3)])
