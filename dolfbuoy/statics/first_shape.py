"""The shapes of the cables and the poses of the buoys from which a run starts, where the scene gives them."""

import itertools
from collections.abc import Callable

import numpy as np

from ..errors import InputError
from ..model.rigid import mooring_offset, rotation_of
from ..scene import Scene
from ..scene.network import End, Network
from ..scene.sections import Initial

#: Places that should be one may differ by this part of a length.
SAME = 1e-6


def check_first_shape(scene: Scene) -> None:
    """Refuse a straight line or a polyline that no cable of the scene can have.  Raises InputError."""
    network = scene.network
    if network.pieces and scene.initial.kind != "equilibrium":
        given_shapes(scene, {name: given_pose(buoy.initial) for name, buoy in network.buoys.items()})


def is_pose_given(initial: Initial) -> bool:
    """Whether the section [initial] of a buoy says where it is, or how it is turned."""
    return (initial.buoy_position or initial.buoy_orientation) is not None


def given_pose(initial: Initial) -> tuple[np.ndarray, np.ndarray]:
    """(r_C, q4) from the section [initial] of a buoy.  Raises InputError."""
    if initial.buoy_position is None:
        raise InputError("initial.buoy_position: must be given, this start of a moored buoy needs it.")
    q4 = np.array(initial.buoy_orientation or (1.0, 0.0, 0.0, 0.0))
    return np.array(initial.buoy_position), q4 / np.linalg.norm(q4)


def place_of(network: Network, end: End, poses: dict) -> np.ndarray | None:
    """Where an end of a line is at t = 0 [m]; None for a free one.  poses: (r_C, q4) of the buoys by name."""
    if end.kind == "buoy":
        r_C, q4 = poses[end.name]
        return r_C + rotation_of(q4) @ mooring_offset(network.buoys[end.name], end.fairlead)
    return np.array(end.top.position) if end.held else None


def with_buoys_held(scene: Scene, poses: dict) -> Scene:
    """The scene with its buoys replaced by fixed ends of the lines there; poses: (r_C, q4) by name."""
    alone = {"buoy": None, "wind": None, "external_force": None}
    network = scene.network
    places = [[place_of(network, end, poses) for end in piece.ends] for piece in network.pieces]
    places = [[None if x is None else tuple(float(c) for c in x) for x in pair] for pair in places]
    cables = []
    for number, cable in enumerate(scene.cables):
        changes = {}
        for name, end, piece in (("from", 0, network.first_of(number)), ("to", 1, network.last_of(number))):
            if network.pieces[piece].ends[end].kind == "buoy":
                changes[name] = places[piece][end]
        cables.append(cable.model_copy(update=changes))
    return scene.model_copy(update={"cable": cables, **alone})


# -- shapes ------------------------------------------------------------------------------------------------------------


def given_shapes(scene: Scene, poses: dict) -> list[Callable]:
    """Of each piece of line the function s -> points (n, 3) on the initial line.

    poses: (r_C, q4) of the buoys by name.  Raises InputError.
    """
    network, shapes, joints = scene.network, [], {}
    for number in range(len(network.cables)):
        pieces = [network.pieces[k] for k in network.pieces_of(number)]
        ends = pieces[0].ends[0], pieces[-1].ends[1]
        places = [place_of(network, end, poses) for end in ends]
        points, key = _points_of(scene, network, number, ends, places)
        length = sum(piece.section.length for piece in pieces)
        _check_ends(points, key, places, length)
        _check_joints(points, key, ends, joints, length)
        elastic = all(np.isfinite(piece.section.axial_stiffness) for piece in pieces)
        _check_length(scene, points, network.key_of(number), length, elastic)
        along, begin = _along(points, length), 0.0
        for piece in pieces:
            shapes.append(lambda s, along=along, begin=begin: along(s + begin))
            begin += piece.section.length
    return shapes


def _points_of(scene, network, number, ends, places):
    """(points of the initial line of a cable, name of their key).  Raises InputError."""
    kind, given, name = scene.initial.kind, scene.initial.points, network.cables[number]
    if kind == "straight":
        places = [_begins_at(end, place) for end, place in zip(ends, places, strict=True)]
        if any(place is None for place in places):
            raise InputError(f"initial.kind = 'straight': where cable.{name} ends is not known; take 'polyline'.")
        return places, "initial.points"
    return points_of(scene, number), "initial.points" + (f".{name}" if isinstance(given, dict) else "")


def points_of(scene: Scene, number: int) -> list[np.ndarray]:
    """initial.points of a cable.  Raises InputError."""
    cables, given = scene.network.cables, scene.initial.points
    if not isinstance(given, dict):
        if len(cables) > 1:
            raise InputError(
                f"initial.points = {given}: several cables need a table of points by name, of {', '.join(cables)}."
            )
        return [np.array(p) for p in given]
    if cables[number] not in given or not set(given) <= set(cables):
        raise InputError(f"initial.points: must have the points of each cable by name, of {', '.join(cables)}.")
    return [np.array(p) for p in given[cables[number]]]


def _begins_at(end, place):
    """Place of an end; where a free one is let go, if its section says so."""
    given = end.top.position if place is None and end.top is not None else None
    return place if given is None else np.array(given)


def _check_ends(points, key, places, length):
    """The first and the last point are where the ends are held."""
    for index, place, word in zip((0, -1), places, ("the anchor", "the top of the cable"), strict=True):
        if place is not None and np.linalg.norm(points[index] - place) > SAME * length:
            shown, place = (tuple(float(x) for x in y) for y in (points[index], place))
            raise InputError(f"{key}[{index}] = {shown}: must be {word} {place}.")


def _check_joints(points, key, ends, joints, length):
    """Lines that meet begin at one place; joints: name -> place, filled here."""
    for index, end in zip((0, -1), ends, strict=True):
        if end.kind == "joint":
            place = joints.setdefault(end.name, points[index])
            if np.linalg.norm(points[index] - place) > SAME * length:
                shown, place = (tuple(float(x) for x in y) for y in (points[index], place))
                raise InputError(f"{key}[{index}] = {shown}: must be where other cables have {end.name}, {place}.")


def _check_length(scene, points, key, length, elastic):
    kind, total = scene.initial.kind, sum(np.linalg.norm(b - a) for a, b in itertools.pairwise(points))
    if not elastic and abs(total - length) > SAME * length:
        raise InputError(
            f"initial.kind = '{kind}': the line is {total:.8g} m long, but an inextensible cable must keep its "
            f"{key}.length = {length:.8g} m."
        )
    if total == 0:
        raise InputError(f"initial.kind = '{kind}': must be a line with a length, not one point.")


def _along(points, length):
    """s -> point on the polyline, arc length proportional to s."""
    points = np.array(points)
    corners = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    corners *= length / corners[-1]
    return lambda s: np.column_stack([np.interp(s, corners, points[:, k]) for k in range(3)])
