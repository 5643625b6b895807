"""What is known of a run at one time: lines, joints and buoys where they are, and what pushes them."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..model.rigid import mass_properties, shape_of
from ..model.sea import elevation_at, wind_at
from .paraview import pose
from .parts import names_of, parts_of
from .style import COLORS


class Mark(NamedTuple):
    """A joint, or an end that is held: its name or none, place, its kind (of scene.network.End), net weight [N]."""

    name: str
    place: np.ndarray
    kind: str
    weight: float = 0.0


@dataclass
class Floating:
    """A buoy, a section, where it is."""

    buoy: object
    r_C: np.ndarray
    R: np.ndarray

    def __post_init__(self):
        self.shape = shape_of(self.buoy)
        self.center = mass_properties(self.buoy, self.shape).height
        self.masses = [self.at(p.height) for p in self.buoy.point_masses]

    def at(self, height: float) -> np.ndarray:
        """Place of the point of the buoy's axis at `height` above the keel."""
        return self.r_C + self.R[:, 2] * (height - self.center)

    @property
    def heights(self) -> list[float]:
        """Heights above the keel of everything on the buoy's axis."""
        heights = [self.center, self.buoy.mooring_height, *(p.height for p in self.buoy.point_masses)]
        return heights + ([0.0, self.shape.height] if self.shape else [])

    @property
    def size(self) -> float:
        """Largest dimension of the buoy [m]."""
        width = self.shape.max_diameter if self.shape else 0.0
        return max(max(self.heights) - min(self.heights), width) or 1.0

    def in_hull(self, x: np.ndarray) -> np.ndarray:
        """Whether the points (..., 3) are inside the hull."""
        if self.shape is None:
            return np.zeros(x.shape[:-1], dtype=bool)
        body = (x - self.r_C) @ self.R
        height = body[..., 2] + self.center
        return np.hypot(body[..., 0], body[..., 1]) < self.shape.radius(height, height)


class Instant:
    """The recorded frame nearest to `time` (default: the last one).

    lines: (name, nodes (n, 3)) of each cable.  tensions: of the elements of each [N].  buoys: a Floating for each.
    """

    def __init__(self, record, scene, time: float | None = None):
        times = record.frame.values if "frame" in record else record.time.values
        i = len(times) - 1 if time is None else int(np.abs(times - time).argmin())
        self.scene, self.time, self.network = scene, float(times[i]), scene.network
        self.row = int(np.abs(record.time.values - self.time).argmin())
        cables = parts_of(record, "cable") if "cable_position" in record else []
        self.lines = [(part.record.cable.item(), part.record.cable_position.values[i]) for part in cables]
        self.tensions = [part.record.cable_tension.values[i] for part in cables if "cable_tension" in part.record]
        buoys = parts_of(record, "buoy") if "buoy_position" in record else []
        sections = [self.network.buoys[part.record.buoy.item()] for part in buoys]
        poses = [pose(part.record, self.time) for part in buoys]
        self.buoys = [Floating(buoy, *place) for buoy, place in zip(sections, poses, strict=True)]
        self.marks, self._moorings = list(self._marks(record)), []
        if "mooring_force" in record:
            moorings = (record[f"mooring_{what}"].values[self.row] for what in ("point", "force"))
            self._moorings = list(zip(*moorings, strict=True))

    @property
    def alone(self) -> bool:
        """Whether there is one line at most, and one buoy."""
        return len(self.lines) <= 1 and len(self.buoys) <= 1

    @property
    def cable(self) -> np.ndarray | None:
        """Nodes (n, 3) of all lines; None without."""
        return np.concatenate([nodes for _, nodes in self.lines]) if self.lines else None

    @property
    def hulls(self) -> list[Floating]:
        """The buoys that have one."""
        return [buoy for buoy in self.buoys if buoy.shape]

    @property
    def points(self) -> np.ndarray:
        """Of all that is drawn (n, 3) [m]."""
        on_axes = [buoy.at(height) for buoy in self.buoys for height in buoy.heights]
        return np.concatenate([nodes for _, nodes in self.lines] + ([on_axes] if on_axes else []))

    def elevation(self, points):
        """Of the water at points (..., 3) [m]."""
        return elevation_at(self.scene, self.time, points)

    @property
    def direction_deg(self) -> float:
        """Heading of the vertical plane that shows the water's motion; without any, the lines."""
        for section in (self.scene.waves, self.scene.current):
            if section:
                return section.direction_deg
        x, y, _ = self.cable[-1] - self.cable[0] if self.lines else (1.0, 0.0, 0.0)
        return math.degrees(math.atan2(y, x)) if math.hypot(x, y) > 0 else 0.0

    @property
    def depth_below_bed(self) -> float:
        """Of the lowest point of the lines [m]; negative over the bed, and for lines that lie on it."""
        return -1.0 if self.scene.seabed else float(-self.scene.sea.depth - self.cable[:, 2].min())

    def in_hull(self, x: np.ndarray) -> np.ndarray:
        """Whether the points (..., 3) are inside any hull."""
        return np.any([np.zeros(x.shape[:-1], dtype=bool), *(buoy.in_hull(x) for buoy in self.buoys)], axis=0)

    def forces(self):
        """(label, point of application, force [N], colour) of what pushes the buoys from outside."""
        found, scene = [], self.scene
        for buoy in self.buoys:
            force, wind = buoy.buoy.external_force, buoy.buoy.wind
            if force:
                point = buoy.r_C if force.height is None else buoy.at(force.height)
                found.append(("external force", point, np.array(force.force), COLORS["red"]))
            if wind:
                point = buoy.at(wind.height)
                height = point[2] - (self.elevation(point) if scene.sea else 0.0)
                found.append(("wind force", point, wind_at(wind, height), COLORS["green"]))
        return [f for f in found if np.linalg.norm(f[2]) > 0]

    def pulls(self):
        """The force of the only end of a line that is on a buoy, as forces has its own; of several the lines tell."""
        if len(self._moorings) != 1 or not np.linalg.norm(self._moorings[0][1]) > 0:
            return []
        return [("mooring force", *self._moorings[0], COLORS["purple"])]

    def _marks(self, record):
        """Joints, and ends of cables that stay where they are and have no name."""
        network, scene = self.network, self.scene
        for k, name in enumerate(names_of(record, "joint")):
            body, density = network.bodies.get(name), scene.sea.density if scene.sea else 0.0
            weight = 0.0 if body is None else scene.gravity * (body.mass - density * body.volume)
            top = network.joints[name]
            yield Mark(name, record.joint_position.values[self.row, k], top.kind if top else "joint", weight)
        for number, (_, nodes) in enumerate(self.lines):
            for piece, end in ((network.first_of(number), 0), (network.last_of(number), 1)):
                holder = network.pieces[piece].ends[end]
                if holder.kind == "fixed" and holder.name is None:
                    yield Mark("", nodes[-end], holder.kind)
