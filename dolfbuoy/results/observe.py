"""What is recorded of a problem: the 19 numbers, tensions, the wet hull, and shapes of the cable."""

import math
import time as clock

import numpy as np

from ..model import effects
from ..model.attachment import FIELDS
from ..model.buoy import MOTION, REST
from ..model.components import components_of
from ..model.rigid import mass_properties, shape_of
from ..model.wet_hull import SUBMERGED
from ..solver import compat
from ..solver.rows import picked, traced
from ..solver.unknowns import Part
from ..version import __version__
from .record import SERIES


class Observer:
    """Reads the recorded quantities from a solved Problem.  Collective; values are complete on rank 0.

    end_forces: by name, arrays that are up to date whenever `note` is called.
    """

    def __init__(self, problem, end_forces=None):
        self.problem, self.comm, self._wet, self._lying = problem, problem.comm, None, np.zeros(4)
        buoy = problem.scene.buoy
        self._mass = mass_properties(buoy, shape_of(buoy)).mass if buoy else None
        if problem.buoy and problem.scene.sea:
            form = problem.buoy.wet_hull_form()
            self._wet = problem.system.functional(form, Part("wet hull", _function_of(form), 0))
        sources, self._places, self.width = self._sources(end_forces or {}), {}, 0
        for name, entries in sources.items():
            self._places[name] = slice(self.width, self.width + len(entries))
            self.width += len(entries)
        self._row = np.zeros(self.width)
        self._pick = picked([entry for entries in sources.values() for entry in entries], self._row)

    def _sources(self, end_forces):
        """What is noted at an instant, by name: where its numbers stand, as `picked` has them; 0 on other ranks."""
        problem, u, found = self.problem, self.problem.system.u, {}
        for name, force in end_forces.items():
            found[name] = _all_of(force, self.comm.rank == 0)
        if problem.lines:
            tension = lambda: problem.lines.anchor_tension(u)  # noqa: E731
            found["tension_anchor"] = traced(tension, [u]) if np.isfinite(tension()) else _all_of(np.zeros(1))
            if problem.lines.bed is not None:
                found["bed"] = _all_of(self._lying, self.comm.rank == 0)
        if problem.scene.buoy:
            mine, fields = problem.buoy is not None, MOTION if problem.dynamic else REST
            found["buoy"] = _all_of(u[problem.buoy.part.slice] if mine else np.zeros(fields.size))
            for attachment in problem.attachments:
                found["mooring"] = _all_of(u[attachment.slice], mine)
            if problem.scene.sea:
                found["water"] = _all_of(self._wet.out if mine else np.zeros(SUBMERGED))
        return found

    def values(self, end_forces):
        """Quantities of this instant.  end_forces: of the Simulation, or of the Problem at rest."""
        row, values = self.note(), dict(end_forces)
        if "end_tension" in values:
            values["tension_top"] = length(values["end_tension"])
        return values if row is None else values | self.values_of(row.copy())

    def note(self):
        """The numbers of this instant in one row, whose memory is used again, for `values_of`; None on other ranks."""
        if self._wet is not None:
            self.problem.system.read_given()
            self._wet()
        if "bed" in self._places:
            found = self.problem.lines.bed.lying(self.problem.system.u)
            self._lying[:] = found.length, *found.touchdown
        self._pick()
        if self.comm.size == 1:
            return self._row
        total = np.zeros_like(self._row)
        self.comm.Reduce(self._row, total)
        return total if self.comm.rank == 0 else None

    def values_of(self, rows):
        """Quantities at instants (..., numbers of `note`), names as in results.SERIES (without time and solver)."""
        noted = {name: rows[..., place] for name, place in self._places.items()}
        values = {name: noted[name] for name in noted if name in SERIES}
        if "tension_anchor" in values:
            values["tension_anchor"] = noted["tension_anchor"][..., 0]
        if "end_tension" in values:
            values["tension_top"] = length(noted["end_tension"])
        if "bed" in noted:
            values["length_on_bed"], values["touchdown"] = noted["bed"][..., 0], noted["bed"][..., 1:]
        if "buoy" in noted:
            fields = MOTION if self.problem.dynamic else REST
            y = fields.of(noted["buoy"])
            values |= {"buoy_position": y.position, "buoy_orientation": y.orientation}
            values["cone_angle"] = cone_angle(y.orientation)
            values["roll"], values["pitch"], values["yaw"] = roll_pitch_yaw(y.orientation)
            if self.problem.dynamic:
                values |= {"linear_momentum": y.momentum, "angular_momentum": y.angular_momentum}
        if "mooring" in noted:
            values["mooring_point"], values["mooring_force"] = FIELDS.of(noted["mooring"])
        if "water" in noted:
            values |= self._wet_hull(noted["water"], y.position)
        return values

    def _wet_hull(self, b, position):
        """Of the numbers of `Buoy.wet_hull_form`."""
        mass, wet = b[..., 0], b[..., 4]
        dry = mass <= 1e-9 * self._mass
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
        """Arc lengths of nodes and cells, in order, and components of an irregular sea, on rank 0 (others: nothing)."""
        return self._along() | (self._components() if self.comm.rank == 0 else {})

    def _components(self):
        waves = self.problem.scene.waves
        if waves is None or not waves.irregular or not self.problem.dynamic:
            return {}
        names = (f"wave_{name}" for name in ("amplitude", "period", "direction_deg", "phase_deg"))
        return dict(zip(names, components_of(waves).as_rows().T, strict=True))

    def _along(self):
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


def _all_of(array, here=True):
    """Entries for `picked` of all numbers of an array; zeros if it is not here."""
    array = array.ravel() if here else np.zeros(array.size)
    return [(array, k, 1.0) for k in range(array.size)]


def _function_of(form):
    """A stand-in with the numbering of a linear form's test space."""
    from dolfinx import fem

    return fem.Function(form.arguments()[0].ufl_function_space())


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
