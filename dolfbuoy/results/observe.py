"""What is recorded of a problem: the 19 numbers, tensions, the wet hull, and shapes of the cable."""

import math
import time as clock

import numpy as np

from ..model import effects
from ..parallel.ranks import told
from ..solver import compat
from ..solver.unknowns import Contribution, Part
from ..version import __version__


class Observer:
    """Reads the recorded quantities from a solved Problem.  Collective; values are complete on rank 0."""

    def __init__(self, problem):
        self.problem, self.comm = problem, problem.comm
        self._wet = None
        if problem.buoy and problem.scene.sea:
            form = problem.buoy.wet_hull_form()
            self._wet_part = Part("wet hull", _function_of(form), 0)
            self._wet = Contribution(form, self._wet_part)

    def values(self, end_forces):
        """Quantities of this instant, names as in results.SERIES (without time and solver).

        end_forces: of the Simulation, or of the Problem at rest.
        """
        problem, values = self.problem, dict(end_forces)
        if problem.lines:
            values["tension_top"] = float(np.linalg.norm(end_forces["end_tension"]))
            values["tension_anchor"] = problem.anchor_tension()
            if problem.lines.bed is not None:
                found = problem.lines.bed.lying(problem.system.u)
                values |= {"length_on_bed": found.length, "touchdown": found.touchdown}
        if problem.scene.buoy:
            mine = self._buoy_values() if problem.buoy else None
            values.update(told(self.comm, mine, problem.buoy_rank))
        return values

    def _buoy_values(self):
        problem, u = self.problem, self.problem.system.u
        y = problem.buoy.fields.of(u[problem.buoy.part.slice])
        values = {"buoy_position": y.position.copy(), "buoy_orientation": y.orientation.copy()}
        values["cone_angle"] = cone_angle(y.orientation)
        values["roll"], values["pitch"], values["yaw"] = roll_pitch_yaw(y.orientation)
        if problem.dynamic:
            values |= {"linear_momentum": y.momentum.copy(), "angular_momentum": y.angular_momentum.copy()}
        for attachment in problem.attachments:
            point, force = attachment.of(u)
            values |= {"mooring_point": point.copy(), "mooring_force": force.copy()}
        if self._wet:
            values |= self._wet_hull(y.position)
        return values

    def _wet_hull(self, position):
        b, buoy = np.zeros(7), self.problem.buoy
        buoy.part.values[:] = self.problem.system.u[buoy.part.slice]
        buoy.publish_points()
        self._wet.prepare()
        self._wet.add_to_vector(b)
        mass, length = b[0], b[4]
        dry = mass <= 1e-9 * buoy.mass.mass
        return {
            "displaced_mass": mass,
            "buoyancy_center": b[1:4] / mass if not dry else position.copy(),
            "submerged_length": length,
            "submerged_diameter": b[5] / length if not dry else 0.0,
            "surface_elevation": b[6],
        }

    def fixed(self):
        """Arc lengths of nodes and cells, in order, on rank 0 (empty dict on the others and without a cable)."""
        cable = self.problem.lines
        if cable is None:
            return {}
        s = self._gather(cable.node_s[: cable.owned_nodes])
        middle = self._gather(cable.cell_ends.mean(axis=1))
        if self.comm.rank != 0:
            return {}
        self._node_order, self._cell_order = np.argsort(s, kind="stable"), np.argsort(middle, kind="stable")
        return {"s": s[self._node_order], "s_cell": middle[self._cell_order]}

    def frame(self, velocity=None):
        """Shape, velocity and element tensions in order from the anchor, on rank 0; call `fixed` before.

        velocity: of the lines' unknowns [m/s]; at rest there is none.
        """
        cable, u = self.problem.lines, self.problem.system.u
        nodes = {"cable_position": u} | ({} if velocity is None else {"cable_velocity": velocity})
        nodes = {name: self._gather(values[cable.node_dofs[: cable.owned_nodes]]) for name, values in nodes.items()}
        tension = self._gather(cable.mean_tension(u))
        if self.comm.rank != 0:
            return {}
        return {name: values[self._node_order] for name, values in nodes.items()} | {
            "cable_tension": tension[self._cell_order]
        }

    def _gather(self, array):
        if self.comm.size == 1:
            return np.array(array)
        parts = self.comm.gather(np.ascontiguousarray(array), root=0)
        return np.concatenate(parts) if parts is not None else None


def _function_of(form):
    """A stand-in with the numbering of a linear form's test space."""
    from dolfinx import fem

    return fem.Function(form.arguments()[0].ufl_function_space())


def cone_angle(q4) -> float:
    """Angle between the vertical and the axis R(q4) e3 [deg], accurate near 0 and 180."""
    a, b, c, d = map(float, q4)
    across = 2 * math.hypot(b * d + a * c, c * d - a * b)
    return math.degrees(math.atan2(across, a * a - b * b - c * c + d * d))


#: Distance of the pitch from 90 degrees, halved [rad], below which roll and yaw are one turn.
LOCKED = 1e-8


def roll_pitch_yaw(q4) -> tuple[float, float, float]:
    """Turns about e1, e2, e3 of the body [deg] that make an orientation: first the yaw, then the pitch, then the roll.

    R = R_z(yaw) R_y(pitch) R_x(roll); -180 < roll, yaw <= 180 and -90 <= pitch <= 90.  With the pitch at 90 or -90 only
    the difference or sum of yaw and roll has a meaning: then the roll is 0.  From sum and difference of the half
    angles, of which q_4 has products, so that nothing is lost near those pitches.
    """
    a, b, c, d = map(float, q4)
    sum_size, difference_size = math.hypot(a - c, d + b), math.hypot(a + c, d - b)
    half_sum, half_difference = math.atan2(d + b, a - c), math.atan2(d - b, a + c)
    pitch = math.pi / 2 - 2 * math.atan2(sum_size, difference_size)
    if sum_size <= LOCKED * difference_size:
        half_sum = half_difference
    elif difference_size <= LOCKED * sum_size:
        half_difference = half_sum
    roll, yaw = _one_turn(half_sum - half_difference), _one_turn(half_sum + half_difference)
    return roll, math.degrees(pitch), yaw


def _one_turn(angle):
    """An angle [rad] in degrees, -180 < x <= 180."""
    x = math.remainder(math.degrees(angle), 360)
    return 180.0 if x == -180 else x


def attributes(problem) -> dict:
    """Global attributes of a record: after CF, versions, the complete scene as TOML, and what was solved."""
    versions = {f"version_{name}": value for name, value in compat.versions().items()}
    return {
        "Conventions": "CF-1.9",
        "title": problem.scene.title,
        "source": f"dolfbuoy {__version__}",
        "scene": problem.scene.to_toml(),
        "unknowns": problem.system.unknowns,
        "effects": ", ".join(effects.names(problem.scene)),
        "ranks": problem.comm.size,
        "created": clock.strftime("%Y-%m-%dT%H:%M:%SZ", clock.gmtime()),
        "version_dolfbuoy": __version__,
        **versions,
    }
