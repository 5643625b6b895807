"""Take-offs, winches and vessels in space: the points over time from which they are drawn, and the wind on vessels."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..model.prescribed_ends import motion_of
from ..model.rigid import mooring_offset
from ..model.sea import elevation_at, wind_at
from ..model.varying import seed_of, wind_over_time

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..scene import Scene
    from ..scene.network import End, Network
    from .frame import Frame, Frames


class Point(NamedTuple):
    """An end of a take-off: on a buoy (its number, and the arm from C [m]), at a node, or on a path over time."""

    node: int | None = None
    buoy: int | None = None
    arm: NDArray[Any] | None = None
    path: Callable[[float], Any] | None = None
    moves: bool = False

    def at(self, now: Frame) -> NDArray[Any]:
        """Position (3,) at an instant [m]."""
        if self.buoy is not None and self.arm is not None:
            return now.buoys[self.buoy].place(self.arm)
        return np.asarray(now.x[self.node] if self.path is None else self.path(now.time), dtype=float)


class Device(NamedTuple):
    """A take-off: its name and two ends."""

    name: str
    ends: tuple[Point, Point]

    def at(self, now: Frame) -> NDArray[Any]:
        """Positions (2, 3) of both ends at an instant [m]."""
        return np.array([end.at(now) for end in self.ends])


def devices_of(frames: Frames) -> list[Device]:
    """The take-offs of a run."""
    nodes = {mark.name: mark.node for mark in frames.marks}

    def point(end: End) -> Point:
        if end.kind == "buoy" and end.name is not None:
            buoy = frames.network.buoys[end.name]
            return Point(buoy=frames.buoys.index(end.name), arm=mooring_offset(buoy, end.fairlead))
        if end.held and end.top is not None:
            return Point(path=motion_of(end.top), moves=end.kind == "prescribed")
        return Point(node=nodes[str(end.name)])

    found = frames.network.take_offs.items()
    return [Device(name, (point(one.ends[0]), point(one.ends[1]))) for name, one in found]


def winches_of(network: Network) -> Iterator[tuple[str, int, int]]:
    """(name, piece, end) of every winch, at the end that is held or on a buoy; if both are, the upper one."""
    for name, piece in network.winches.items():
        low, high = network.pieces[piece].ends
        fixed = [end for end, holder in ((1, high), (0, low)) if holder.held or holder.kind == "buoy"]
        yield name, piece, [*fixed, 1][0]


#: Indices into `corners_of` of the corners of the six sides of a box, and of its deck.
SIDES = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]])
DECK = SIDES[-1]


class Shell(NamedTuple):
    """The box of a vessel; paths: its eight corners over time [m]; moves: True if they move."""

    name: str
    paths: tuple[Callable[[float], Any], ...]
    moves: bool

    def at(self, time: float) -> NDArray[Any]:
        """Corners (8, 3) at a time [m]."""
        return np.array([path(time) for path in self.paths], dtype=float)


def corners_of(hull: tuple[float, float, float, float]) -> list[tuple[float, float, float]]:
    """Corners of a box [length, breadth, keel, deck] in the frame of its vessel [m]."""
    length, breadth, keel, deck = hull
    return list(itertools.product((-length / 2, length / 2), (-breadth / 2, breadth / 2), (keel, deck)))


def shells_of(frames: Frames) -> Iterator[Shell]:
    """Boxes of the vessels that have one and move as the scene prescribes, not as driven by a session."""
    driven = str(frames.record.attrs.get("session", "")).removeprefix("driven: ").split(", ")
    for vessel in frames.scene.vessel or []:
        if vessel.hull is not None and vessel.name not in driven:
            corners = {f"c{k}": corner for k, corner in enumerate(corners_of(vessel.hull))}
            box = vessel.model_copy(update={"fairleads": corners})
            tops = [box.held(name, frames.scene) for name in corners]
            moves = any(top.kind == "prescribed" for top in tops)
            yield Shell(vessel.name, tuple(map(motion_of, tops)), moves)


class Blown(NamedTuple):
    """Wind on a vessel over time: point of action [m], and force [N]."""

    place: Callable[[float], Any]
    force: Callable[[float], NDArray[Any]]


def winds_of(scene: Scene, moving: bool = True) -> dict[str, Blown]:
    """The wind on vessels by name; moving: in a run, with waves and gusts, which an equilibrium lacks."""
    scene = scene if moving else scene.model_copy(update={"waves": None})
    return {vessel.name: _wind_on(vessel, scene, moving) for vessel in scene.vessel or [] if vessel.wind is not None}


def _wind_on(vessel: Any, scene: Scene, moving: bool) -> Blown:
    wind = vessel.wind
    point = vessel.model_copy(update={"fairleads": {"wind": (0.0, 0.0, wind.height)}})
    place = motion_of(point.held("wind", scene))
    blows = wind_over_time(wind, seed_of(scene, wind) if moving else None)

    def force(t: float) -> NDArray[Any]:
        x = np.array(place(t), dtype=float)
        water = float(elevation_at(scene, t, x)) if scene.sea else 0.0
        return wind_at(wind, x[2] - water, blows(t))

    return Blown(place, force)
