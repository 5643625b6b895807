"""State of a run at an instant, for all 3D pictures: pieces of lines, hulls, marks, forces, water and bed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..model.airy import AirySum
from ..model.contact import height_of_bed
from ..model.rigid import mass_properties, mooring_offset, rotation_of
from ..model.sea import elevation_at, velocity_at, wind_at
from ..model.varying import force_over_time, seed_of, varies, wind_over_time
from ..scene import Scene
from ..scene.lines import Sinker
from ..scene.network import attached_ends
from .devices import devices_of, shells_of, winches_of, winds_of
from .hulls import Floating
from .parts import names_of

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.buoy import ExternalForce, Wind
    from ..scene.network import End


class Span(NamedTuple):
    """A cable: its name, and its nodes and elements in the record."""

    name: str
    node: slice
    cell: slice

    @property
    def per(self) -> int:
        """Number of straight pieces by which an element is drawn."""
        return int((self.node.stop - self.node.start - 1) // (self.cell.stop - self.cell.start))


class Mark(NamedTuple):
    """A joint, or an end not on a buoy: name (or ""), kind, weight of its body in water [N], and node.
    kind: of scene.network.End, or "clump" or "float" for a body heavier or lighter than water."""

    name: str
    kind: str
    weight: float
    node: int


class Force(NamedTuple):
    """A force over the rows of a record.

    kind: "outside" (wind and external force), "pulls" (an end of a line at a buoy) or "holds" (the support of an end).
    vectors: rows (n,) -> (n, 3) [N].  node: of the end.  buoy, arm: its number, and point of action from C (3,) [m].
    path: point of action on a vessel over time [m].
    """

    kind: str
    name: str
    vectors: Callable[[NDArray[Any]], NDArray[Any]]
    node: int | None = None
    buoy: int | None = None
    arm: NDArray[Any] | None = None
    path: Callable[[float], Any] | None = None


def pieces_of(x: NDArray[Any], whole: NDArray[Any]) -> list[NDArray[Any]]:
    """Split the nodes (n, 3) of a line into pieces where elements have parted; whole: (elements,)."""
    per = (len(x) - 1) // len(whole)
    gone = np.flatnonzero(~whole)
    bounds = zip([0, *per * (gone + 1)], [*per * gone, len(x) - 1], strict=True)
    return [x[first : last + 1] for first, last in bounds if last > first]


def whole_at(record: xr.Dataset, time: float) -> NDArray[Any]:
    """Mask of the elements of a record, or of its part of one cable, that have not parted by a time."""
    if "parted_at" not in record:
        return np.ones(record.sizes["cell"], dtype=bool)
    return np.asarray(~(record.parted_at.values <= time))


@dataclass(frozen=True)
class Frame:
    """Everything drawn of a run at `time` [s]; number: of the recorded frame, row: of the record's times.

    x: nodes (n, 3) of all lines [m].  tension, whole: mean tension of their elements [N], and mask of those not parted.
    lines: name of each cable and nodes of its pieces, several if it has parted.  buoys: positions and attitudes.
    """

    run: Frames
    number: int
    time: float
    row: int
    x: NDArray[Any]
    tension: NDArray[Any]
    whole: NDArray[Any]
    lines: list[tuple[str, list[NDArray[Any]]]]
    buoys: list[Floating]

    @property
    def scene(self) -> Scene:
        return self.run.scene

    @property
    def alone(self) -> bool:
        """True if there is at most one line and at most one buoy."""
        return len(self.run.spans) <= 1 and len(self.run.buoys) <= 1

    @property
    def hulls(self) -> list[Floating]:
        """The buoys that have a hull."""
        return [buoy for buoy in self.buoys if buoy.shape]

    @property
    def points(self) -> NDArray[Any]:
        """Points (n, 3) of everything drawn [m]."""
        ends = itertools.chain.from_iterable(device.at(self) for device in self.run.devices)
        corners = itertools.chain.from_iterable(shell.at(self.time) for shell in self.run.shells)
        buoys = (buoy.at(height) for buoy in self.buoys for height in buoy.heights)
        blown = (force.path(self.time) for force in self.run.forces if force.path is not None)
        return np.array([*self.x, *buoys, *ends, *corners, *blown])

    def elevation(self, points: NDArray[Any]) -> NDArray[Any]:
        """Height of the water at points (..., 3) [m]."""
        return elevation_at(self.scene, self.time, points)

    def flow(self, points: NDArray[Any]) -> NDArray[Any]:
        """Velocity (..., 3) of the undisturbed water at points (..., 3) [m/s]."""
        return velocity_at(self.scene, self.time, points)

    def on_bed(self, points: NDArray[Any]) -> NDArray[Any]:
        """Points (n, 3) of the sea bed below or above points (n, 2 or 3) [m]."""
        return np.column_stack([points[:, :2], height_of_bed(self.scene, points)])

    @property
    def direction_deg(self) -> float:
        """Heading of the vertical plane that shows the water's motion or, without waves and current, the lines."""
        for section in (self.scene.waves, self.scene.current):
            if section:
                return float(section.direction_deg)
        x, y, _ = self.x[-1] - self.x[0] if len(self.x) else (1.0, 0.0, 0.0)
        return math.degrees(math.atan2(y, x)) if math.hypot(x, y) > 0 else 0.0

    @property
    def bed(self) -> float:
        """Height of the bed at the origin [m]; -inf without water."""
        return -self.scene.sea.depth if self.scene.sea else -math.inf

    @property
    def depth_below_bed(self) -> float:
        """Depth of the lowest point of the lines below the bed [m]; negative above it, and with a [seabed]."""
        return -1.0 if self.scene.seabed else float(self.bed - self.x[:, 2].min())

    def in_hull(self, x: NDArray[Any]) -> NDArray[Any]:
        """True for points (..., 3) inside any hull."""
        return np.asarray(
            np.any([np.zeros(x.shape[:-1], dtype=bool), *(buoy.in_hull(x) for buoy in self.buoys)], axis=0)
        )

    def arrows(
        self, kind: str, box: Any = (-np.inf, np.inf), beyond: Any = None
    ) -> list[tuple[str, NDArray[Any], NDArray[Any]]]:
        """(name, point of action [m], vector [N]) of the forces of a kind on buoys, and on vessels inside a box.
        beyond: a second box; then only forces on vessels outside it."""
        row, places = np.array([self.row]), [(f, f.buoy, f.arm) for f in self.run.forces if f.kind == kind]
        on = [(f, self.buoys[k].place(arm)) for f, k, arm in places if k is not None and arm is not None]
        on += [(f, np.array(f.path(self.time))) for f in self.run.forces if f.kind == kind and f.path is not None]
        on = [(f, place) for f, place in on if f.path is None or np.all((place >= box[0]) & (place <= box[1]))]
        if beyond is not None:
            on = [(f, x) for f, x in on if f.path is not None and np.any((x < beyond[0]) | (x > beyond[1]))]
        return [(f.name, place, f.vectors(row)[0]) for f, place in on]


class Frames:
    """The frames of a record, with everything in the scene that is drawn.

    times: of the frames, or of all rows of a record without lines [s].  spans, buoys, marks: cables, names of the
    buoys, joints and other ends, in the order of the record.  forces: on buoys and ends.  devices: take-offs.  shells:
    hulls of vessels.
    """

    def __init__(self, record: xr.Dataset, scene: Scene):
        self.record, self.scene, self.network = record, scene, scene.network
        self.times = (record.frame if "frame" in record else record.time).values
        self.spans = _spans(record) if "cable_position" in record else []
        self.buoys = names_of(record, "buoy") if "buoy_position" in record else []
        self.marks = list(self._marks()) if self.spans else []
        self.forces = [*self._recorded(), *self._outside()]
        self.devices = devices_of(self)
        self.shells = list(shells_of(self))

    def at(self, time: float | None = None) -> Frame:
        """The frame nearest to a time [s]; by default the last."""
        number = len(self.times) - 1 if time is None else int(np.abs(self.times - time).argmin())
        record, time = self.record, float(self.times[number])
        row = int(np.abs(record.time.values - time).argmin())
        x, tension, whole = np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=bool)
        if self.spans:
            arrays = (record[name].values[number] for name in ("cable_position", "cable_tension"))
            (x, tension), whole = arrays, whole_at(record, time)
        lines = [(span.name, pieces_of(x[span.node], whole[span.cell])) for span in self.spans]
        buoys = [self.buoy(k, row) for k in range(len(self.buoys))]
        return Frame(self, number, time, row, x, tension, whole, lines, buoys)

    def buoy(self, number: int, row: int) -> Floating:
        """A buoy at a row of the record's times; its velocities follow from its momenta."""
        buoy, record = self.network.buoys[self.buoys[number]], self.record
        r_C, R = record.buoy_position.values[row, number], rotation_of(record.buoy_orientation.values[row, number])
        if "linear_momentum" not in record:
            return Floating(buoy, r_C, R)
        p, L = (record[f"{kind}_momentum"].values[row, number] for kind in ("linear", "angular"))
        body = mass_properties(buoy)
        return Floating(buoy, r_C, R, p / body.mass, R @ ((R.T @ L) / body.inertia))

    @property
    def joints(self) -> list[Mark]:
        return [mark for mark in self.marks if mark.name]

    @property
    def places(self) -> NDArray[Any]:
        """Points (n, 3) of all nodes and centres of mass at all times [m].
        Those of take-offs and vessels at the first time only."""
        known = [self.record[name].values for name in ("cable_position", "buoy_position") if name in self.record]
        known += [device.at(self.at(self.times[0])) for device in self.devices]
        known += [shell.at(float(self.times[0])) for shell in self.shells]
        return np.concatenate([places.reshape(-1, 3) for places in known])

    def node_of(self, piece: int, end: int) -> int:
        """Node at an end of a piece of the network."""
        span, number = self.spans[self.network.pieces[piece].cable], self.network.pieces[piece].number
        before = np.searchsorted(self.record.segment_of_cell.values[span.cell], number + end)
        return int(span.node.start + span.per * int(before))

    def _ends(self) -> Iterator[tuple[int, int, End]]:
        """(piece, end, End) of all ends of cables."""
        for cable in range(len(self.spans)):
            for piece, end in ((self.network.first_of(cable), 0), (self.network.last_of(cable), 1)):
                yield piece, end, self.network.pieces[piece].ends[end]

    def _marks(self) -> Iterator[Mark]:
        """Joints in the order of the record, unnamed ends, and winches."""
        pieces, density = self.network.pieces, self.scene.sea.density if self.scene.sea else 0.0
        places = {end.name: (k, i) for k, piece in enumerate(pieces) for i, end in enumerate(piece.ends)}
        for name, held in self.network.joints.items():
            body = self.network.bodies.get(name)
            weight = 0.0 if body is None else self.scene.gravity * (body.mass - density * body.volume)
            kind = "joint" if weight == 0 else "clump" if weight > 0 else "float"
            kind = "fixed" if isinstance(body, Sinker) else kind
            yield Mark(name, held.kind if held else kind, weight, self.node_of(*places[name]))
        for piece, end, holder in self._ends():
            if holder.name is None and holder.kind != "buoy":
                yield Mark("", holder.kind, 0.0, self.node_of(piece, end))
        for _, piece, end in winches_of(self.network):
            yield Mark("", "winch", 0.0, self.node_of(piece, end))

    def _recorded(self) -> Iterator[Force]:
        """Forces of lines on buoys, and of the supports of their ends."""
        if "mooring_force" in self.record and self.spans and self.buoys:
            for i, (piece, end) in enumerate(attached_ends(self.network)):
                held, vectors = self.network.pieces[piece].ends[end], self._column("mooring_force", i)
                name = str(held.name)
                arm, buoy = mooring_offset(self.network.buoys[name], held.fairlead), self.buoys.index(name)
                yield Force("pulls", "mooring force", vectors, self.node_of(piece, end), buoy, arm)
        for piece, end, holder in self._ends():
            name = ("anchor_force", "end_tension")[end]
            if name in self.record and holder.held:
                yield Force(
                    "holds", name, self._column(name, self.network.pieces[piece].cable), self.node_of(piece, end)
                )

    def _column(self, name: str, number: int) -> Callable[..., Any]:
        return lambda rows: self.record[name].values[rows, number]

    def _outside(self) -> Iterator[Force]:
        for number, name in enumerate(self.buoys):
            buoy, upright = self.network.buoys[name], self.buoy(number, 0)
            force, wind = buoy.external_force, buoy.wind
            if force:
                arm = upright.arm(upright.center if force.height is None else force.height)
                yield Force("outside", "external force", self._force(force), None, number, arm)
            if wind:
                arm = upright.arm(wind.height)
                yield Force("outside", "wind force", self._wind(number, wind, arm), None, number, arm)
        for number, one in enumerate(winds_of(self.scene).values() if "wind_force" in self.record else []):
            yield Force("outside", "wind force", self._column("wind_force", number), path=one.place)

    def _force(self, section: ExternalForce) -> Callable[..., Any]:
        pulls = force_over_time(section)
        return lambda rows: np.array([pulls(t) for t in self.record.time.values[rows]])

    def _wind(self, number: int, wind: Wind, arm: NDArray[Any]) -> Callable[..., Any]:
        """Wind force at its height above the water; for many instants, interpolated in a table over that height."""

        def vectors(rows: NDArray[Any]) -> NDArray[Any]:
            points = np.array([self.buoy(number, row).place(arm) for row in rows])
            heights = points[:, 2]
            if self.scene.waves:
                times = self.record.time.values[rows]
                heights = heights - AirySum.of(self.scene).over_time(times, points)
            known = np.linspace(heights.min(), heights.max(), 16) if len(rows) > 16 else np.sort(heights)
            table = np.array([wind_at(wind, height) for height in known])
            found = np.column_stack([np.interp(heights, known, column) for column in table.T])
            if not varies(wind):
                return found
            blows = wind_over_time(wind, seed_of(self.scene, wind))
            weather = [blows(t) for t in self.record.time.values[rows]]
            steady = wind_over_time(wind, None)(0.0)[0] or math.inf
            sizes = np.linalg.norm(found, axis=1)
            return np.array([f * (v / steady) ** 2 * way for f, (v, way) in zip(sizes, weather, strict=True)])

        return vectors


def _spans(record: xr.Dataset) -> list[Span]:
    names = names_of(record, "cable")
    of_node, of_cell = (record[f"cable_of_{along}"].values for along in ("node", "cell"))
    nodes, cells = (np.searchsorted(of, np.arange(len(names) + 1)).tolist() for of in (of_node, of_cell))
    return [Span(name, slice(*nodes[k : k + 2]), slice(*cells[k : k + 2])) for k, name in enumerate(names)]
