"""Take-offs and winches in space: between which points of a run a take-off is drawn, and at which end a winch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..model.prescribed_ends import motion_of
from ..model.rigid import mooring_offset

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..scene.network import End, Network
    from .frame import Frame, Frames


class Point(NamedTuple):
    """An end of a take-off: on a buoy (its number, and where, off C [m]), at a node, or on a path over time."""

    node: int | None = None
    buoy: int | None = None
    arm: NDArray[Any] | None = None
    path: Callable[[float], Any] | None = None
    moves: bool = False

    def at(self, now: Frame) -> NDArray[Any]:
        """Place (3,) at an instant [m]."""
        if self.buoy is not None and self.arm is not None:
            return now.buoys[self.buoy].place(self.arm)
        return np.asarray(now.x[self.node] if self.path is None else self.path(now.time), dtype=float)


class Device(NamedTuple):
    """A take-off by its name, and its two ends."""

    name: str
    ends: tuple[Point, Point]

    def at(self, now: Frame) -> NDArray[Any]:
        """Places (2, 3) of both ends at an instant [m]."""
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
    """(name, piece, end) of every winch: the end that is held or on a buoy, the upper one of two."""
    for name, piece in network.winches.items():
        low, high = network.pieces[piece].ends
        fixed = [end for end, holder in ((1, high), (0, low)) if holder.held or holder.kind == "buoy"]
        yield name, piece, [*fixed, 1][0]
