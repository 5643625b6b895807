"""Numbers that a mooring is designed by: loads on its anchors, offsets of its buoys, their freeboard."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.rigid import mass_properties
from ..scene.network import End, Network
from .attitude import cone_angle
from .quantities import Absent


def anchors_of(network: Network) -> dict[str, list[tuple[int, int]]]:
    """Name of an anchor -> [(cable, its end there: 0 at s = 0, 1 at s = L), ...].

    Ends that stay where they are, not above the other end if that does so too: those at a fixed joint are one anchor of
    its name, the others CABLE.from and CABLE.to.
    """
    found: dict[str, list[tuple[int, int]]] = {}
    for cable, name in enumerate(network.cables):
        ends = ends_of(network, cable)
        for i, (end, other) in enumerate((ends, ends[::-1])):
            if end.kind == "fixed" and (other.kind != "fixed" or _height(end) <= _height(other)):
                found.setdefault(end.name or f"{name}.{('from', 'to')[i]}", []).append((cable, i))
    return found


def ends_of(network: Network, cable: int) -> tuple[End, End]:
    """Lower and upper end of a cable."""
    return network.pieces[network.first_of(cable)].ends[0], network.pieces[network.last_of(cable)].ends[1]


def _height(end: End) -> float:
    return end.position[2] if end.position else 0.0


class Design:
    """Readers of design numbers off the notes of a network.

    anchors: see `anchors_of`.  centres: (x, y) of the mean of the anchors that hold each buoy [m], nan without any.
    """

    def __init__(self, network: Network) -> None:
        self.network, self.anchors = network, anchors_of(network)
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
        """Forces of the lines on the anchors (..., anchor, 3) [N], of those that hold the cables' ends.  Raises Absent
        without an anchor."""
        if not self.anchors:
            raise Absent("anchors")
        sums = [-sum(of_ends[i][..., cable, :] for cable, i in ends) for ends in self.anchors.values()]
        return np.stack(sums, axis=-2)

    def offset(self, position: NDArray[Any]) -> NDArray[Any]:
        """Horizontal distances of C from the middle of the anchors (..., buoy) [m].  Raises Absent if there are none
        for some buoy."""
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
