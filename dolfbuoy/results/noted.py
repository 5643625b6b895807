"""Notes of instants, from which quantities are read: the numbers of each source, intermediate results.
Also the design numbers of a mooring: loads on its anchors, offsets and freeboard of its buoys."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.attachment import FIELDS
from ..model.buoy import MOTION, REST
from ..model.rigid import mass_properties
from ..model.wet_hull import SUBMERGED
from ..scene import Scene
from ..scene.anchors import anchors_of, ends_of, given_anchors
from ..scene.lines import Sinker
from .attitude import cone_angle, roll_pitch_yaw
from .quantity import Absent

if TYPE_CHECKING:
    from ..model.problem import Problem


class Design:
    """Computes design numbers of a scene from notes.

    anchors: see `anchors_of`.  centres: mean (x, y) of the anchors that hold each buoy [m], nan if there are none.
    """

    def __init__(self, scene: Scene) -> None:
        self.network = network = scene.network
        self.anchors, self.given = anchors_of(network), given_anchors(scene)
        parts, places = network.parts(), {}
        for ends in self.anchors.values():
            cable, i = ends[0]
            places[cable, i] = np.array(ends_of(network, cable)[i].position[:2])  # type: ignore[index]
        self.centres = np.full((len(network.buoys), 2), np.nan)
        for k, name in enumerate(network.buoys):
            mine = [place for (cable, _), place in places.items() if cable in parts[name]]
            if mine:
                self.centres[k] = np.mean(mine, axis=0)

    def pulls(self, *of_ends: NDArray[Any]) -> NDArray[Any]:
        """Forces of the lines on the anchors (..., anchor, 3) [N].  Raises Absent if there is none.
        of_ends: forces that hold the lower and the upper ends of the cables."""
        if not self.anchors:
            raise Absent("anchors")
        sums = [-sum(of_ends[i][..., cable, :] for cable, i in ends) for ends in self.anchors.values()]
        return np.stack(sums, axis=-2)

    def needed_weight(self, pulls: NDArray[Any]) -> NDArray[Any]:
        """Least submerged weights at which sinkers do not move, H/mu + V (..., anchor) [N].
        Raises Absent unless all anchors are sinkers."""
        if not self.given or any(one.friction is None for one in self.given.values()):
            raise Absent("sinkers")
        friction = np.array([self.given[name].friction for name in self.anchors])
        return np.asarray(np.hypot(pulls[..., 0], pulls[..., 1]) / friction + pulls[..., 2])

    def use(self, pulls: NDArray[Any]) -> NDArray[Any]:
        """Utilisation of anchors (..., anchor): needed weight over weight of a sinker, or H over holding capacity.
        Raises Absent if their capacity is not known."""
        if not self.given:
            raise Absent("anchors")
        given = [self.given[name] for name in self.anchors]
        of_pull = np.array([1 / (one.holding_capacity or (one.weight or 1) * (one.friction or 1)) for one in given])
        of_lift = np.array([1 / one.weight if one.weight else 0.0 for one in given])
        return np.asarray(np.hypot(pulls[..., 0], pulls[..., 1]) * of_pull + pulls[..., 2] * of_lift)

    @cached_property
    def _sinkers(self) -> list[tuple[int, int, NDArray[Any]]]:
        """(index of the anchor, index of the joint, initial position [m]) of sinkers that may drag."""
        anchors, joints = list(self.anchors), list(self.network.joints)
        bodies = [(name, body) for name, body in self.network.bodies.items() if isinstance(body, Sinker)]
        return [(anchors.index(name), joints.index(name), np.array(body.place)) for name, body in bodies]

    def moved(self, joints: NDArray[Any]) -> NDArray[Any]:
        """Distances of sinkers from their initial positions (..., anchor) [m], 0 for other anchors.
        joints: positions of all joints.  Raises Absent if no sinker may drag."""
        if not self._sinkers:
            raise Absent("sinkers that drag")
        found = np.zeros((*joints.shape[:-2], len(self.anchors)))
        for anchor, joint, place in self._sinkers:
            found[..., anchor] = np.linalg.norm(joints[..., joint, :] - place, axis=-1)
        return found

    def offset(self, position: NDArray[Any]) -> NDArray[Any]:
        """Horizontal distances of C from the centre of the anchors (..., buoy) [m].
        Raises Absent if a buoy has none."""
        if np.isnan(self.centres).any():
            raise Absent("anchors")
        x, y = np.moveaxis(position[..., :2] - self.centres, -1, 0)
        return np.asarray(np.hypot(x, y))

    @cached_property
    def _decks(self) -> NDArray[Any]:
        """Height of the top of each hull above C, and its radius there [m]."""
        hulls = [
            (mass_properties(buoy).height, *(buoy.hull or [(0.0, 0.0)])[-1]) for buoy in self.network.buoys.values()
        ]
        return np.array([(top - centre, diameter / 2) for centre, top, diameter in hulls]).T

    def freeboard(self, state: Any, surface: NDArray[Any]) -> NDArray[Any]:
        """Heights of the lowest points of the hulls' upper rims above the water at C (..., buoy) [m]."""
        (height, radius), lean = self._decks, np.radians(cone_angle(state.orientation))
        return np.asarray(state.position[..., 2] + height * np.cos(lean) - radius * np.sin(lean) - surface)


class Hull(NamedTuple):
    """Results of `Buoy.wet_hull_form` for the wet hulls: displaced mass, centre of buoyancy, length, diameter, eta."""

    mass: NDArray[Any]
    centre: NDArray[Any]
    length: NDArray[Any]
    diameter: NDArray[Any]
    surface: NDArray[Any]


class Noted(dict[str, NDArray[Any]]):
    """Notes of instants: source -> numbers (..., count), from which a Quantity is read; raises Absent for others.

    Sources: anchor_force, end_tension, tension_anchor, smallest_tension, bed, utilisation, bending, touchdown_moment,
    bend_utilisation, buoy, mooring, water, drift, joint, take_off, winch, wind, place_tension.
    """

    def __init__(
        self, columns: dict[str, NDArray[Any]], problem: Problem, masses: NDArray[Any], design: Design
    ) -> None:
        super().__init__(columns)
        self.problem, self._masses, self.design = problem, masses, design

    def __missing__(self, source: str) -> NDArray[Any]:
        raise Absent(source)

    def each(self, source: str, size: int) -> NDArray[Any]:
        """Numbers of a source per item, (..., n, size)."""
        flat = self[source]
        return np.asarray(flat.reshape(*flat.shape[:-1], -1, size))

    @cached_property
    def buoy(self) -> Any:
        """Fields of the buoys' states, (..., buoy, size) each."""
        fields = MOTION if self.problem.dynamic else REST
        return fields.of(self.each("buoy", fields.size))

    @property
    def motion(self) -> Any:
        """As `buoy`, for a dynamic problem.  Raises Absent at rest."""
        if not self.problem.dynamic:
            raise Absent("motion")
        return self.buoy

    @cached_property
    def pulls(self) -> NDArray[Any]:
        """Forces of the lines on the anchors (..., anchor, 3) [N]."""
        return self.design.pulls(self.each("anchor_force", 3), self.each("end_tension", 3))

    @cached_property
    def turns(self) -> Any:
        """(roll, pitch, yaw) [degree]."""
        return roll_pitch_yaw(self.buoy.orientation)

    @cached_property
    def attachment(self) -> Any:
        """Points and forces of the cables' ends on buoys."""
        return FIELDS.of(self.each("mooring", FIELDS.size))

    @cached_property
    def hull(self) -> Hull:
        """Numbers of the wet hulls; the centre of buoyancy of a dry hull is set to C."""
        b = self.each("water", SUBMERGED)
        mass, wet = b[..., 0], b[..., 4]
        dry = mass <= 1e-9 * self._masses
        with np.errstate(divide="ignore", invalid="ignore"):
            centre, diameter = b[..., 1:4] / mass[..., None], b[..., 5] / wet
        centre, diameter = np.where(dry[..., None], self.buoy.position, centre), np.where(dry, 0.0, diameter)
        return Hull(mass, centre, wet, diameter, b[..., 6])
