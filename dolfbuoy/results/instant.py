"""What is known of a run at one time: lines, joints and buoys where they are, and what pushes them."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..meshes import HullShape
from ..model.rigid import mass_properties
from ..model.sea import elevation_at, wind_at
from ..scene.network import is_network, network_of, single
from .paraview import pose
from .parts import parts_of
from .style import COLORS


class Mark(NamedTuple):
    """A joint, or an end that is held: its name or none, place, whether it is held, and its net weight [N]."""

    name: str
    place: np.ndarray
    held: bool
    weight: float = 0.0


@dataclass
class Instant:
    """What is known of a run at one time."""

    scene: object
    time: float
    cable: np.ndarray | None  #: nodes (n, 3)
    r_C: np.ndarray | None
    R: np.ndarray | None
    tension: np.ndarray | None = None  #: of each element of the cable [N]
    mooring: tuple | None = None  #: where the cable holds the buoy, and its force on it [N]

    def __post_init__(self):
        buoy = single(self.scene).buoy if self.r_C is not None else None
        self.shape = HullShape(tuple(buoy.hull)) if buoy and buoy.hull else None
        self.center = mass_properties(buoy, self.shape).height if buoy else None
        self.masses = [self.at(p.height) for p in buoy.point_masses] if buoy else []

    @property
    def lines(self):
        """(name, nodes) of the cable, if there is one."""
        return [("cable", self.cable)] if self.cable is not None else []

    @property
    def buoys(self):
        """Itself, if it has a buoy."""
        return [self] if self.r_C is not None else []

    @property
    def hulls(self):
        """Itself, if it has a hull."""
        return [self] if self.shape else []

    @property
    def marks(self):
        """The anchor."""
        return [Mark("", self.cable[0], True)] if self.cable is not None else []

    @property
    def points(self):
        """Of all that is drawn (n, 3) [m]."""
        heights = [self.at(h) for h in self.heights] if self.r_C is not None else []
        return np.array([*(self.cable if self.cable is not None else []), *heights])

    def elevation(self, points):
        """Of the water at points (..., 3) [m]."""
        return elevation_at(self.scene, self.time, points)

    def at(self, height: float) -> np.ndarray:
        """Place of the point of the buoy's axis at `height` above the keel."""
        return self.r_C + self.R[:, 2] * (height - self.center)

    @property
    def heights(self) -> list[float]:
        """Heights above the keel of everything on the buoy's axis."""
        buoy = single(self.scene).buoy
        heights = [self.center, buoy.mooring_height, *(p.height for p in buoy.point_masses)]
        return heights + ([0.0, self.shape.height] if self.shape else [])

    @property
    def buoy_size(self) -> float:
        """Largest dimension of the buoy [m]."""
        width = self.shape.max_diameter if self.shape else 0.0
        return max(max(self.heights) - min(self.heights), width) or 1.0

    @property
    def direction_deg(self) -> float:
        """Heading of the vertical plane that shows the water's motion; without any, the cable."""
        for section in (self.scene.waves, self.scene.current):
            if section:
                return section.direction_deg
        x, y, _ = self.cable[-1] - self.cable[0] if self.cable is not None else (1.0, 0.0, 0.0)
        return math.degrees(math.atan2(y, x)) if math.hypot(x, y) > 0 else 0.0

    @property
    def depth_below_bed(self) -> float:
        """Of the lowest point of the cable [m]; negative over the bed, and for a cable that lies on it."""
        return -1.0 if self.scene.seabed else float(-self.scene.sea.depth - self.cable[:, 2].min())

    def in_hull(self, x: np.ndarray) -> np.ndarray:
        """Whether the points (..., 3) are inside the hull."""
        if self.shape is None:
            return np.zeros(x.shape[:-1], dtype=bool)
        body = (x - self.r_C) @ self.R
        height = body[..., 2] + self.center
        return np.hypot(body[..., 0], body[..., 1]) < self.shape.radius(height, height)

    def forces(self):
        """(label, point of application, force [N], colour) of what pushes the buoy from outside."""
        found, scene = [], self.scene
        if self.r_C is not None and single(scene).external_force:
            point = (
                self.r_C
                if single(scene).external_force.height is None
                else self.at(single(scene).external_force.height)
            )
            found.append(("external force", point, np.array(single(scene).external_force.force), COLORS["red"]))
        if self.r_C is not None and single(scene).wind:
            point = self.at(single(scene).wind.height)
            found.append(("wind force", point, self._wind_force(point), COLORS["green"]))
        return [f for f in found if np.linalg.norm(f[2]) > 0]

    def pulls(self):
        """The force of the cable on the buoy, as forces has its own."""
        if self.mooring is None or not np.linalg.norm(self.mooring[1]) > 0:
            return []
        return [("mooring force", *self.mooring, COLORS["purple"])]

    def _wind_force(self, point):
        return wind_at(single(self.scene).wind, point[2] - (self.elevation(point) if self.scene.sea else 0.0))


class System:
    """An instant of a network, with what a picture of an Instant asks for: lines, buoys and joints as lists.

    lines: (name, nodes) of each cable.  buoys: an Instant for each.
    """

    r_C, shape, tension = None, None, None

    def __init__(self, record, scene, time):
        self.scene, self.time, network = scene, time, network_of(scene)
        known = [(part.name, _instant(part.record, part.scene, time)) for part in parts_of(record, scene)]
        self.lines = [(name, one.cable) for name, one in known if one.cable is not None]
        self.buoys = [one for _, one in known if one.r_C is not None]
        self.cable = np.concatenate([nodes for _, nodes in self.lines])
        self.marks = _marks(record, scene, network, self.lines, time)

    @property
    def points(self):
        """Of all that is drawn (n, 3) [m]."""
        return np.concatenate([self.cable, *(buoy.points for buoy in self.buoys)])

    @property
    def hulls(self):
        """Instants of the buoys that have one."""
        return [buoy for buoy in self.buoys if buoy.shape]

    def elevation(self, points):
        """Of the water at points (..., 3) [m]."""
        return elevation_at(self.scene, self.time, points)

    direction_deg, depth_below_bed = Instant.direction_deg, Instant.depth_below_bed

    def in_hull(self, x: np.ndarray) -> np.ndarray:
        """Whether the points (..., 3) are inside any hull."""
        return np.any([np.zeros(x.shape[:-1], dtype=bool), *(buoy.in_hull(x) for buoy in self.buoys)], axis=0)

    def forces(self):
        """As of an Instant, of all buoys."""
        return [force for buoy in self.buoys for force in buoy.forces()]

    def pulls(self):
        """None: a picture of a network shows lines rather than their forces."""
        return []


def _marks(record, scene, network, lines, time):
    """Joints, and ends of cables that are held without a name."""
    row, found = int(np.abs(record.time.values - time).argmin()), []
    for k, (name, top) in enumerate(network.joints.items()):
        body = network.bodies.get(name)
        density = scene.sea.density if scene.sea else 0.0
        weight = 0.0 if body is None else scene.gravity * (body.mass - density * body.volume)
        found.append(Mark(name, record.joint_position.values[row, k], top is not None, weight))
    for number, (_, nodes) in enumerate(lines):
        for piece, end in ((network.first_of(number), 0), (network.last_of(number), 1)):
            holder = network.pieces[piece].ends[end]
            if holder.held and holder.name is None:
                found.append(Mark("", nodes[-end], True))
    return found


def instant(record, scene, time: float | None = None) -> Instant | System:
    """The recorded frame nearest to `time` (default: the last one)."""
    if not is_network(scene):
        return _instant(record, scene, time)
    times = record.frame.values
    return System(record, scene, float(times[-1] if time is None else times[np.abs(times - time).argmin()]))


def _instant(record, scene, time):
    times = record.frame.values if "frame" in record else record.time.values
    i = len(times) - 1 if time is None else int(np.abs(times - time).argmin())
    cable = record.cable_position.values[i] if "cable_position" in record else None
    r_C, R = pose(record, times[i]) if "buoy_position" in record else (None, None)
    tension = record.cable_tension.values[i] if "cable_tension" in record else None
    mooring = _mooring(record, times[i]) if r_C is not None else None
    return Instant(scene, float(times[i]), cable, r_C, R, tension, mooring)


def _mooring(record, time):
    """(place, force) where the only cable of a buoy holds it; None without one."""
    if "mooring_force" not in record or record.mooring_force.dims != ("time", "xyz"):
        return None
    row = int(np.abs(record.time.values - time).argmin())
    return record.mooring_point.values[row], record.mooring_force.values[row]
