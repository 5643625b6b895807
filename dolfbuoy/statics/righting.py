"""Righting levers of a hull at any heel, from the same strips as the equilibrium."""

import math
from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np

from ..elsewhere import MPI
from ..errors import InputError
from ..model.buoy import REST_ROWS
from ..model.problem import Problem
from ..roots import brentq
from ..scene import Scene
from ..scene.buoy import ExternalForce
from ..scene.sections import Initial

#: Sections of a scene that are left out.
_ABSENT = dict.fromkeys(("cable", "joint", "seabed", "waves", "current", "wind", "external_force"))


class Righting(NamedTuple):
    """Heel [deg], height of C above still water [m], lever GZ [m]: times the buoy's weight, the righting moment."""

    heel_deg: float
    height: float
    lever: float


def righting_curve(scene: Scene, heels_deg: Iterable[float], pull: float = 0.0) -> list[Righting]:
    """GZ of the scene's first buoy at these heels, each in vertical equilibrium in still water.

    pull: constant downward force at the mooring point [N].  Raises InputError if weight and pull sink the buoy, or
    without water or gravity.
    """
    if not scene.buoy or scene.sea is None or not scene.gravity:
        raise InputError("Righting levers are those of a floating buoy: they need [buoy], [sea] and gravity.")
    buoy = scene.buoy[0]
    held = ExternalForce(force=(0.0, 0.0, -pull), height=buoy.mooring_height)
    own = {"wind": None, "external_force": held, "initial": Initial()}
    alone = scene.model_copy(update=_ABSENT | {"buoy": [buoy.model_copy(update=own)], "initial": Initial()})
    problem = Problem(alone, dynamic=False, comm=MPI.COMM_SELF)
    try:
        (hull,) = problem.buoys.values()
        shape, weight = hull.shape, hull.mass.mass * scene.gravity
        reach = shape.height + shape.max_diameter  # beyond this, fully dry or submerged
        found = []
        for heel in map(float, heels_deg):
            if _lift(problem, heel, -reach) < 0:
                raise InputError(f"The buoy sinks under a pull of {pull:.6g} N.")
            height = brentq(partial(_lift, problem, heel), -reach, reach, xtol=1e-12 * reach)
            found.append(Righting(heel, height, _loads(problem, height, heel)[1] / weight))
        return found
    finally:
        problem.destroy()


def _lift(problem: Problem, heel: float, height: float) -> float:
    return _loads(problem, height, heel)[0]


def _loads(problem: Problem, height: float, heel: float) -> tuple[float, float]:
    """Vertical force [N] and righting moment about C [N m] with C at a height, the top leaning towards x."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_rotvec([0.0, math.radians(heel), 0.0]).as_quat()
    pose = np.array([0.0, 0.0, height, w, x, y, z])
    (buoy,), system = problem.buoys.values(), problem.system
    buoy.reference.x.array[:] = pose  # no rotation and no offset relative to it
    system.u[buoy.part.slice] = pose
    system.publish()
    rows = REST_ROWS.of(system.evaluate()[buoy.part.slice])  # minus the loads
    return -rows.force[2], rows.torque[1]
