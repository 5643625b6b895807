"""The shape of the cable and the pose of the buoy from which a run starts, where the scene gives them."""

import itertools

import numpy as np

from ..errors import InputError
from .rigid import axis_offset, rotation_of


def check_first_shape(scene) -> None:
    """Refuse a straight line or a polyline that no cable of the scene can have.  Raises InputError."""
    if scene.cable is not None and scene.initial.kind != "equilibrium":
        points_of(scene, given_pose(scene)[2] if scene.buoy else None)


def given_pose(scene):
    """(r_C, q4, r_O) from the section [initial].  Raises InputError."""
    initial = scene.initial
    if initial.buoy_position is None:
        raise InputError("initial.buoy_position: must be given, this start of a moored buoy needs it.")
    q4 = np.array(initial.buoy_orientation or (1.0, 0.0, 0.0, 0.0))
    q4 = q4 / np.linalg.norm(q4)
    r_C = np.array(initial.buoy_position)
    r_O = r_C + rotation_of(q4) @ axis_offset(scene.buoy, scene.buoy.mooring_height)
    return r_C, q4, r_O


def points_of(scene, r_O):
    """Points of the initial line, from the anchor to the top; r_O: where it holds a buoy.  Raises InputError."""
    initial, cable = scene.initial, scene.cable
    end = r_O if r_O is not None else (None if cable.top.position is None else np.array(cable.top.position))
    if initial.kind == "straight":
        points = [np.array(scene.anchor), end]
    else:
        points = [np.array(p) for p in initial.points]
        if np.linalg.norm(points[0] - scene.anchor) > 1e-6 * cable.length:
            raise InputError(f"initial.points[0] = {initial.points[0]}: must be the anchor {scene.anchor}.")
        held = r_O is not None or cable.top.kind != "free"
        if held and np.linalg.norm(points[-1] - end) > 1e-6 * cable.length:
            top = tuple(float(x) for x in end)
            raise InputError(f"initial.points[-1] = {initial.points[-1]}: must be the top of the cable {top}.")
    total = sum(np.linalg.norm(b - a) for a, b in itertools.pairwise(points))
    if np.isinf(cable.axial_stiffness) and abs(total - cable.length) > 1e-6 * cable.length:
        raise InputError(
            f"initial.kind = '{initial.kind}': the line is {total:.8g} m long, but an inextensible cable must keep its "
            f"cable.length = {cable.length:.8g} m."
        )
    if total == 0:
        raise InputError(f"initial.kind = '{initial.kind}': must be a line with a length, not one point.")
    return points
