"""Notes of instants, of which quantities are read: the numbers of each source, and what several quantities share."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.attachment import FIELDS
from ..model.buoy import MOTION, REST
from ..model.wet_hull import SUBMERGED
from .attitude import roll_pitch_yaw
from .quantity import Absent

if TYPE_CHECKING:
    from ..model.problem import Problem
    from .design import Design


class Hull(NamedTuple):
    """Results of `Buoy.wet_hull_form` for the wet hulls: displaced mass, centre of buoyancy, length, diameter, eta."""

    mass: NDArray[Any]
    centre: NDArray[Any]
    length: NDArray[Any]
    diameter: NDArray[Any]
    surface: NDArray[Any]


class Noted(dict[str, NDArray[Any]]):
    """Notes of instants: source -> numbers (..., count), of which a Quantity is read; else Absent.

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
        """Numbers of each of n things, (..., n, size)."""
        flat = self[source]
        return np.asarray(flat.reshape(*flat.shape[:-1], -1, size))

    @cached_property
    def buoy(self) -> Any:
        """Fields of the buoys' states, (..., buoy, size) each."""
        fields = MOTION if self.problem.dynamic else REST
        return fields.of(self.each("buoy", fields.size))

    @property
    def motion(self) -> Any:
        """As `buoy`, of what moves."""
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
        """Numbers of the wet hulls; the centre of a dry one is C."""
        b = self.each("water", SUBMERGED)
        mass, wet = b[..., 0], b[..., 4]
        dry = mass <= 1e-9 * self._masses
        with np.errstate(divide="ignore", invalid="ignore"):
            centre, diameter = b[..., 1:4] / mass[..., None], b[..., 5] / wet
        centre, diameter = np.where(dry[..., None], self.buoy.position, centre), np.where(dry, 0.0, diameter)
        return Hull(mass, centre, wet, diameter, b[..., 6])
