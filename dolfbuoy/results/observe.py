"""What is recorded of a problem: the 19 numbers, tensions, the wet hull, and shapes of the cable."""

import itertools
import math
import time as clock

import numpy as np

from ..model import effects
from ..model.attachment import FIELDS
from ..model.buoy import MOTION, REST
from ..model.components import components_of
from ..model.rigid import mass_properties, shape_of
from ..model.wet_hull import SUBMERGED
from ..scene.network import attached_ends
from ..solver import compat
from ..solver.rows import picked, traced
from ..version import __version__
from .record import FORMAT
from .utilisation import Utilisation, stressed


class Observer:
    """Reads the recorded quantities from a solved Problem.  Collective; values are complete on rank 0.

    end_forces: by name, arrays that are up to date whenever `note` is called.
    """

    def __init__(self, problem, end_forces=None):
        self.problem, self.comm, self.network = problem, problem.comm, problem.network
        self._masses = np.array([mass_properties(b, shape_of(b)).mass for b in self.network.buoys.values()])
        self._lying = np.zeros((len(self.network.cables), 4))
        self._wet = problem.wet_hulls if problem.buoys and problem.scene.sea else None
        self._stress = Utilisation(problem) if stressed(self.network) else None
        sources, self._places, self.width = self._sources(end_forces or {}), {}, 0
        for name, entries in sources.items():
            self._places[name] = slice(self.width, self.width + len(entries))
            self.width += len(entries)
        self._row = np.zeros(self.width)
        self._pick = picked([entry for entries in sources.values() for entry in entries], self._row)

    def _sources(self, end_forces):
        """What is noted at an instant, by name: where its numbers stand, as `picked` has them; 0 on other ranks."""
        problem, u, found, root = self.problem, self.problem.system.u, {}, self.comm.rank == 0
        for name, force in end_forces.items():
            found[name] = _all_of(force, root)
        if problem.lines:
            found["tension_anchor"] = _joined(map(self._tension_at, range(len(self.network.cables))))
            if problem.lines.bed is not None:
                found["bed"] = _all_of(self._lying, root)
            if self._stress is not None:
                found["utilisation"] = _all_of(self._stress.values, root)
        if self.network.buoys:
            fields = MOTION if problem.dynamic else REST
            mine = [problem.buoys.get(name) for name in self.network.buoys]
            states = [u[buoy.part.slice] if buoy else np.zeros(fields.size) for buoy in mine]
            found["buoy"] = _joined(map(_all_of, states))
            if problem.scene.sea:
                known = dict(
                    zip(problem.buoys, self._wet.out.reshape(-1, SUBMERGED) if self._wet else (), strict=False)
                )
                wet = [known.get(name, np.zeros(SUBMERGED)) for name in self.network.buoys]
                found["water"] = _joined(map(_all_of, wet))
        if problem.attachments:
            found["mooring"] = _joined(_all_of(u[a.slice], a.buoy is not None) for a in problem.attachments)
        if self.network.joints:
            found["joint"] = _joined(map(self._place_of, self.network.joints))
        return found

    def _tension_at(self, cable):
        """Entries of T_h(0) of a cable."""
        problem, u, piece = self.problem, self.problem.system.u, self.network.first_of(cable)

        def tension():
            return problem.lines.anchor_tension(u, piece)

        return traced(tension, [u]) if np.isfinite(tension()) else _all_of(np.zeros(1))

    def _place_of(self, joint):
        """Entries of the place of a joint, from the first end there."""
        lines = self.problem.lines
        ends = (
            (k, i)
            for k, piece in enumerate(self.network.pieces)
            for i, end in enumerate(piece.ends)
            if end.name == joint
        )
        piece, end = next(ends)
        if not lines.owns_end(piece, end):
            return _all_of(np.zeros(3))
        return [(self.problem.system.u, int(dof), 1.0) for dof in lines.end_dofs[piece][end]]

    def labels(self) -> dict[str, np.ndarray]:
        """Names of cables, buoys, joints, ... by the dimensions that this record has beside xyz and quaternion."""
        n = self.network
        ends = [f"{n.cables[n.pieces[k].cable]}.{('from', 'to')[end]}" for k, end in attached_ends(n)]
        found = {"cable": n.cables, "buoy": n.buoys, "attachment": ends, "joint": n.joints, "segment": stressed(n)}
        return {name: np.array(list(names)) for name, names in found.items() if names}

    def values(self, end_forces):
        """Quantities of this instant.  end_forces: of the Simulation, or of the Problem at rest."""
        row, values = self.note(), {name: np.reshape(force, (-1, 3)) for name, force in end_forces.items()}
        if "end_tension" in values:
            values["tension_top"] = length(values["end_tension"])
        return values if row is None else values | self.values_of(row.copy())

    def note(self):
        """The numbers of this instant in one row, whose memory is used again, for `values_of`; None on other ranks."""
        if self._wet:
            self.problem.system.read_given()
            self._wet()
        if "bed" in self._places:
            self._note_bed()
        if self._stress is not None:
            self._stress.note()
        self._pick()
        if self.comm.size == 1:
            return self._row
        total = np.zeros_like(self._row)
        self.comm.Reduce(self._row, total)
        return total if self.comm.rank == 0 else None

    def _note_bed(self):
        """What of each cable lies, and where its uppermost piece that does leaves the bed."""
        bed, u = self.problem.lines.bed, self.problem.system.u
        for cable, row in enumerate(self._lying):
            pieces = range(self.network.first_of(cable), self.network.last_of(cable) + 1)
            found = [bed.lying(u, piece) for piece in pieces]
            last = next((one for one in reversed(found) if one.length > 0), found[-1])
            row[:] = sum(one.length for one in found), *last.touchdown

    def values_of(self, rows):
        """Quantities at instants (..., numbers of `note`), names as in results.SERIES (without time and solver)."""
        noted = {name: rows[..., place] for name, place in self._places.items()}
        values = {}
        for name in ("anchor_force", "end_tension"):
            if name in noted:
                values[name] = _each(noted[name], 3)
        if "tension_anchor" in noted:
            values["tension_anchor"] = noted["tension_anchor"]
        if "end_tension" in values:
            values["tension_top"] = length(values["end_tension"])
        if "bed" in noted:
            bed = _each(noted["bed"], 4)
            values["length_on_bed"], values["touchdown"] = bed[..., 0], bed[..., 1:]
        if "utilisation" in noted:
            values["utilisation"] = noted["utilisation"]
        if "buoy" in noted:
            fields = MOTION if self.problem.dynamic else REST
            y = fields.of(_each(noted["buoy"], fields.size))
            values |= {"buoy_position": y.position, "buoy_orientation": y.orientation}
            values["cone_angle"] = cone_angle(y.orientation)
            values["roll"], values["pitch"], values["yaw"] = roll_pitch_yaw(y.orientation)
            if self.problem.dynamic:
                values |= {"linear_momentum": y.momentum, "angular_momentum": y.angular_momentum}
        if "mooring" in noted:
            values["mooring_point"], values["mooring_force"] = FIELDS.of(_each(noted["mooring"], FIELDS.size))
        if "water" in noted:
            values |= self._wet_hull(_each(noted["water"], SUBMERGED), y.position)
        if "joint" in noted:
            values["joint_position"] = _each(noted["joint"], 3)
        return values

    def _wet_hull(self, b, position):
        """Of the numbers of `Buoy.wet_hull_form`."""
        mass, wet = b[..., 0], b[..., 4]
        dry = mass <= 1e-9 * self._masses
        with np.errstate(divide="ignore", invalid="ignore"):
            center, diameter = b[..., 1:4] / mass[..., None], b[..., 5] / wet
        return {
            "displaced_mass": mass,
            "buoyancy_center": np.where(dry[..., None], position, center),
            "submerged_length": wet,
            "submerged_diameter": np.where(dry, 0.0, diameter),
            "surface_elevation": b[..., 6],
        }

    def fixed(self):
        """Arc lengths of nodes and cells, in order, what grows on these, and components of an irregular sea, on rank 0
        (others: nothing)."""
        return self._along() | self._grown() | (self._components() if self.comm.rank == 0 else {})

    def _grown(self):
        """After `_along`, which finds the order."""
        growth = self.problem.lines.growth if self.problem.lines else None
        if growth is None:
            return {}
        found = self._gather(np.column_stack([growth.factors, growth.weights]))
        if self.comm.rank != 0:
            return {}
        return dict(zip(("growth_diameter", "growth_mass", "growth_weight"), found[self._cell_order].T, strict=True))

    def _components(self):
        waves = self.problem.scene.waves
        if waves is None or not waves.irregular or not self.problem.dynamic:
            return {}
        names = (f"wave_{name}" for name in ("amplitude", "period", "direction_deg", "phase_deg"))
        return dict(zip(names, components_of(waves).as_rows().T, strict=True))

    def _along(self):
        """Cable after cable, each from its lower end on, and which cable and segment they belong to."""
        lines = self.problem.lines
        if lines is None:
            return {}
        s = self._gather(lines.node_s[: lines.owned_nodes])
        middle = self._gather(lines.cell_ends.mean(axis=1))
        if self.comm.rank != 0:
            return {}
        self._node_order, self._cell_order = np.argsort(s, kind="stable"), np.argsort(middle, kind="stable")
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

    def parted(self, fixed) -> str:
        """Which cables have parted, where and when, in words, on rank 0; fixed: what `fixed` gave."""
        parting = self.problem.lines.parting if self.problem.lines else None
        if parting is None:
            return ""
        since = self._gather(parting.of_elements)
        if self.comm.rank != 0:
            return ""
        since = since[self._cell_order]
        cable = fixed["cable_of_cell"]
        gone = (k for k in np.argsort(since, kind="stable") if np.isfinite(since[k]))
        where = (f"{self.network.cables[cable[k]]} at s = {fixed['s_cell'][k]:g} m, t = {since[k]:g} s" for k in gone)
        return "; ".join(where)

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


def _all_of(array, here=True):
    """Entries for `picked` of all numbers of an array; zeros if it is not here."""
    array = array.ravel() if here else np.zeros(array.size)
    return [(array, k, 1.0) for k in range(array.size)]


def _joined(lists):
    return list(itertools.chain.from_iterable(lists))


def _each(flat, size):
    """Of numbers (..., n size) those of each of n things, (..., n, size)."""
    return flat.reshape(*flat.shape[:-1], -1, size)


def length(vectors):
    """Of vectors (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.sqrt(x * x + y * y + z * z)


def cone_angle(q4):
    """Angle between the vertical and the axis R(q4) e3 [deg] for q4 (..., 4), accurate near 0 and 180."""
    a, b, c, d = np.moveaxis(np.asarray(q4), -1, 0)
    across = 2 * np.hypot(b * d + a * c, c * d - a * b)
    return np.degrees(np.arctan2(across, a * a - b * b - c * c + d * d))


#: Distance of the pitch from 90 degrees, halved [rad], below which roll and yaw are one turn.
LOCKED = 1e-8


def roll_pitch_yaw(q4):
    """Turns about e1, e2, e3 of the body [deg] that make orientations (..., 4): first the yaw, the pitch, the roll.

    R = R_z(yaw) R_y(pitch) R_x(roll); -180 < roll, yaw <= 180 and -90 <= pitch <= 90.  With the pitch at 90 or -90 only
    the difference or sum of yaw and roll has a meaning: then the roll is 0.  From sum and difference of the half
    angles, of which q_4 has products, so that nothing is lost near those pitches.
    """
    a, b, c, d = np.moveaxis(np.asarray(q4), -1, 0)
    sum_size, difference_size = np.hypot(a - c, d + b), np.hypot(a + c, d - b)
    half_sum, half_difference = np.arctan2(d + b, a - c), np.arctan2(d - b, a + c)
    pitch = math.pi / 2 - 2 * np.arctan2(sum_size, difference_size)
    no_sum = sum_size <= LOCKED * difference_size
    no_difference = ~no_sum & (difference_size <= LOCKED * sum_size)
    half_sum, half_difference = (
        np.where(no_sum, half_difference, half_sum),
        np.where(no_difference, half_sum, half_difference),
    )
    roll, yaw = _one_turn(half_sum - half_difference), _one_turn(half_sum + half_difference)
    return roll, np.degrees(pitch), yaw


def _one_turn(angle):
    """Angles [rad] in degrees, -180 < x <= 180."""
    x = np.degrees(angle)
    x = x - 360 * np.round(x / 360)
    return np.where(x == -180, 180.0, x)


def attributes(problem) -> dict:
    """Global attributes of a record: after CF, versions, the complete scene as TOML, what was solved and how."""
    versions = {f"version_{name}": value for name, value in compat.versions().items()}
    return {
        "Conventions": "CF-1.9",
        "title": problem.scene.title,
        "source": f"dolfbuoy {__version__}",
        "scene": problem.scene.to_toml(),
        "unknowns": problem.system.unknowns,
        "effects": ", ".join(effects.names(problem.scene)),
        "format": FORMAT,
        "ranks": problem.comm.size,
        "created": clock.strftime("%Y-%m-%dT%H:%M:%SZ", clock.gmtime()),
        "version_dolfbuoy": __version__,
        **versions,
        **({"route": problem.route} if problem.route else {}),
    }
