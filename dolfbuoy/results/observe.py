"""What is recorded of a problem: the 19 numbers, tensions, the wet hull, and shapes of the cable."""

import math
import time as clock

import numpy as np
from mpi4py import MPI

from ..model import effects
from ..parallel.ranks import combined, told
from ..scene.network import attached_ends
from ..solver import compat
from ..solver.unknowns import Contribution, Part
from ..version import __version__


class Observer:
    """Reads the recorded quantities from a solved Problem.  Collective; values are complete on rank 0."""

    def __init__(self, problem):
        self.problem, self.comm, self.network = problem, problem.comm, problem.network
        self._wet = {}
        for name, buoy in problem.buoys.items():
            if problem.scene.sea:
                form = buoy.wet_hull_form()
                part = Part("wet hull", _function_of(form), 0)
                self._wet[name] = part, Contribution(form, part)

    def labels(self) -> dict[str, np.ndarray]:
        """Labels of the dimensions that this record has beside those of all: names of several cables, of joints, ..."""
        found, n = {"cable": self.network.cables, "buoy": self.network.buoys}, self.network
        found = {name: list(names) for name, names in found.items() if len(names) > 1}
        ends = [(n.cables[n.pieces[k].cable], ("from", "to")[end]) for k, end in attached_ends(n)]
        if len(ends) > 1:
            found["attachment"] = [".".join(end) for end in ends]
        if n.joints:
            found["joint"] = list(n.joints)
        return {name: np.array(names) for name, names in found.items()}

    def values(self, end_forces):
        """Quantities of this instant, names as in results.SERIES (without time and solver).

        end_forces: of the Simulation, or of the Problem at rest.
        """
        problem, values = self.problem, dict(end_forces)
        if problem.lines:
            values["tension_top"] = _length(end_forces["end_tension"])
            values["tension_anchor"] = _one_or_all([problem.anchor_tension(k) for k in range(len(self.network.cables))])
        buoys = [
            told(self.comm, self._buoy_values(name) if name in problem.buoys else None, rank)
            for name, rank in problem.buoy_ranks.items()
        ]
        if buoys:
            values |= {name: _one_or_all([buoy[name] for buoy in buoys]) for name in buoys[0]}
        if problem.attachments:
            values |= self._attachments()
        if self.network.joints:
            values["joint_position"] = self._joints()
        return values

    def _attachments(self):
        found = []
        for attachment in self.problem.attachments:
            mine = [x.copy() for x in attachment.of(self.problem.system.u)] if attachment.buoy else None
            found.append(told(self.comm, mine, attachment.rank))
        points, forces = zip(*found, strict=True)
        return {"mooring_point": _one_or_all(points), "mooring_force": _one_or_all(forces)}

    def _joints(self):
        """Places of the joints, from an end there of each."""
        n, u, found = self.network, self.problem.system.u, []
        ends = {
            end.name: (k, i) for k, piece in reversed(list(enumerate(n.pieces))) for i, end in enumerate(piece.ends)
        }
        for name in n.joints:
            piece, end = ends[name]
            here = self.problem.lines.owns_end(piece, end)
            mine = u[self.problem.lines.end_dofs[piece][end]] if here else np.zeros(3)
            found.append(mine)
        return combined(self.comm, np.array(found), MPI.SUM)

    def _buoy_values(self, name):
        problem, u, buoy = self.problem, self.problem.system.u, self.problem.buoys[name]
        y = buoy.fields.of(u[buoy.part.slice])
        values = {"buoy_position": y.position.copy(), "buoy_orientation": y.orientation.copy()}
        values["cone_angle"] = cone_angle(y.orientation)
        values["roll"], values["pitch"], values["yaw"] = roll_pitch_yaw(y.orientation)
        if problem.dynamic:
            values |= {"linear_momentum": y.momentum.copy(), "angular_momentum": y.angular_momentum.copy()}
        if name in self._wet:
            values |= self._wet_hull(buoy, y.position, *self._wet[name])
        return values

    def _wet_hull(self, buoy, position, part, form):
        b = np.zeros(7)
        buoy.part.values[:] = self.problem.system.u[buoy.part.slice]
        buoy.publish_points()
        form.prepare()
        form.add_to_vector(b)
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
        """Arc lengths of nodes and cells, in order, on rank 0 (empty dict on the others and without a cable).

        Of a network: cable after cable, each from its lower end on, and which cable and segment they belong to.
        """
        lines = self.problem.lines
        if lines is None:
            return {}
        s = self._gather(lines.node_s[: lines.owned_nodes])
        middle = self._gather(lines.cell_ends.mean(axis=1))
        if self.comm.rank != 0:
            return {}
        self._node_order, self._cell_order = np.argsort(s, kind="stable"), np.argsort(middle, kind="stable")
        if len(self.network.pieces) == 1:
            return {"s": s[self._node_order], "s_cell": middle[self._cell_order]}
        return self._of_pieces(s[self._node_order], middle[self._cell_order])

    def _of_pieces(self, s, middle):
        """`fixed` from sorted mesh coordinates; a node between two segments counts once, with the lower one."""
        lines, pieces = self.problem.lines, self.network.pieces
        piece, of_cell = lines.line_at(s), lines.line_at(middle)
        number = np.array([p.number for p in pieces])
        lengths = [p.section.length for p in pieces]
        before = np.array([sum(lengths[k - p.number : k]) for k, p in enumerate(pieces)]) - lines.begins
        first = np.concatenate([[True], np.diff(piece) > 0])
        kept = ~(first & (number[piece] > 0))
        self._node_order, piece, s = self._node_order[kept], piece[kept], s[kept]
        cable = np.array([p.cable for p in pieces])
        found = {"s": s + before[piece], "s_cell": middle + before[of_cell]}
        found |= {"cable_of_node": cable[piece], "cable_of_cell": cable[of_cell]}
        return found | {"segment_of_cell": number[of_cell]}

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


def _one_or_all(values):
    """The only one of several, or an array of all."""
    return values[0] if len(values) == 1 else np.array(values)


def _length(vectors):
    """Of a vector, or of each of several."""
    return float(np.linalg.norm(vectors)) if vectors.ndim == 1 else np.linalg.norm(vectors, axis=1)


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
