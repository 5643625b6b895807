"""Equilibrium of a network of lines in still water by closed forms, without elements: the initial guess of the statics.

A line is one Piece or several: uniform, elastic or inextensible, heavier or lighter than water, between two joints.
Joints are fixed or free; free ones carry a net force, which may depend on their position (a float, a moored hull).
There may be a flat bed without friction.  The equations, and why they can be solved without an initial guess, are in
`network_equations`; this module has the network and the shape of its equilibrium.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..errors import SolveError
from ..scene.stiffness import secant
from . import catenary, on_bed
from .catenary import Array, Catenary
from .on_bed import UP, Bed, Lying, OnBed

ORIGIN = (0.0, 0.0, 0.0)
FLIP = np.diag([1.0, 1.0, -1.0])
#: Least grounded length, as a fraction of the piece; less is an artefact of smoothing.
LYING = 3e-5
#: Rounds in which a table T(e) is replaced by one stiffness, and the relative change of it that is negligible.
ROUNDS, SAME = 20, 1e-3
#: Height below which an end counts as on the bed, as a fraction of the piece's length.
AT_BED = 1e-7


@dataclass(frozen=True)
class Joint:
    """Point to which pieces are tied.

    Fixed at `position`, or free, with no guess (None) or one of `position`; `load` is the net force on a free one [N],
    or a function of the position giving it and its derivative, shapes (3,) and (3, 3); `push` [N] is added.
    """

    position: Sequence[float] | Array | None = None
    free: bool = False
    load: Sequence[float] | Array | Callable[[Array], tuple[Array, Array]] = ORIGIN
    push: Array = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Piece:
    """Uniform line between two joints (indices), or points fixed to them: `length` [m], weight in water `w` [N/m].

    drag: that of a current, uniform along the piece [N/m]; with drag the line is taken not to touch the bed.
    """

    start: int
    end: int
    length: float
    w: float
    EA: float
    start_offset: Sequence[float] | Array = ORIGIN
    end_offset: Sequence[float] | Array = ORIGIN
    drag: Sequence[float] | Array = ORIGIN

    @cached_property
    def load(self) -> Array:
        """Weight and drag [N/m]."""
        return np.array([0.0, 0.0, -self.w]) + self.drag

    @cached_property
    def frame(self) -> Array:
        """Axes (rows) of a frame in which the load points down."""
        down = self.load / np.linalg.norm(self.load)
        across = np.cross(down, np.eye(3)[np.abs(down).argmin()])
        across /= np.linalg.norm(across)
        return np.array([across, np.cross(across, down), -down])


@dataclass(frozen=True)
class Network:
    """Joints, pieces, the bed (None: no bed) and the height of the water surface, which buoyant lines do not cross."""

    joints: Sequence[Joint]
    pieces: Sequence[Piece]
    bed: Bed | None = None
    surface: float | None = None

    @cached_property
    def floor(self) -> float | None:
        """Height of a flat bed [m]; a sloping one is ignored while solving for the joints."""
        return None if self.bed is None or self.bed.normal[2] < 1 else self.bed.offset

    def floats(self, piece: Piece) -> bool:
        """True if a piece may float on the surface: buoyant, with no end fixed above it."""
        if self.surface is None or piece.w >= 0 or np.any(piece.drag):
            return False
        ends = (self.joints[piece.start], piece.start_offset), (self.joints[piece.end], piece.end_offset)
        return all(
            joint.free or joint.position is None or joint.position[2] + offset[2] <= self.surface
            for joint, offset in ends
        )

    def is_held(self, piece: Piece) -> bool:
        """True if both ends of a piece are fixed."""
        return not (self.joints[piece.start].free or self.joints[piece.end].free)


class Shape(Protocol):
    """Closed form of a piece from its start; s: unstretched lengths (n,)."""

    def position(self, s: ArrayLike) -> Array:
        """r(s), shape (n, 3) [m]."""

    def force(self, s: ArrayLike) -> Array:
        """Tension as a vector along the line, shape (n, 3) [N]."""

    def tension(self, s: ArrayLike) -> Array:
        """T(s), shape (n,) [N]."""


class Drawn(NamedTuple):
    """Shape of a weightless piece, or along given points, under a uniform tension [N]."""

    position: Callable[[Any], Array]
    pull: Sequence[float] | Array = ORIGIN

    def force(self, s: ArrayLike) -> Any:
        return np.multiply.outer(np.ones_like(s, float), self.pull)

    def tension(self, s: ArrayLike) -> Any:
        return np.linalg.norm(self.force(s), axis=-1)


class Turned(NamedTuple):
    """Shape of a piece in its own frame (rows): upside down under the surface, or aligned with weight plus drag."""

    shape: Any
    frame: Array

    def position(self, s: ArrayLike) -> Array:
        return np.asarray(self.shape.position(s) @ self.frame)

    def force(self, s: ArrayLike) -> Array:
        return np.asarray(self.shape.force(s) @ self.frame)

    def tension(self, s: ArrayLike) -> Array:
        return np.asarray(self.shape.tension(s))

    @property
    def length_on_bed(self) -> float:
        return float(self.shape.length_on_bed)


@dataclass(frozen=True)
class Rest:
    """A network in equilibrium: `positions` of all joints; tension at the start, grounded length, ends of each piece.

    state: unknowns of the free part, a guess for similar networks; None if nothing is free.
    """

    network: Network
    positions: Array
    pulls: Array
    lying: Array
    ends: Array
    state: Any = None

    @cached_property
    def shapes(self) -> list[Shape]:
        return [self._shape(i) for i in range(len(self.network.pieces))]

    def _shape(self, i: int) -> Any:
        piece, (start, end), pull = self.network.pieces[i], self.ends[i], self.pulls[i]
        if (turned := _in_own_frame(self.network, piece)) is None:
            return self._hanging(i, self.network, piece, (start, end), pull)
        network, own, frame = turned
        return Turned(self._hanging(i, network, own, (frame @ start, frame @ end), frame @ pull), frame)

    def _hanging(self, i: int, network: Network, piece: Piece, ends: Sequence[Array], pull: Array) -> Any:
        """Shape of a piece in a network with or without a bed."""
        start, end = ends
        if network.is_held(piece):
            return _between(network, piece, start, end)
        if piece.w == 0:
            line = lambda s: start + np.multiply.outer(np.asarray(s, float) / piece.length, end - start)  # noqa: E731
            return Drawn(line, pull)
        H, room = float(np.hypot(*pull[:2])), end[:2] - start[:2]
        width = float(np.hypot(*room))
        way = room / width if width > 0 else np.array([1.0, 0.0])
        along = np.array([*way, 0.0])
        sloped = network.bed is not None and network.floor is None
        if sloped or (0 < self.lying[i] <= LYING * piece.length and width > 1e-3 * piece.length):
            return _between(network, piece, start, end)
        if self.lying[i] <= LYING * piece.length:
            return Catenary(start, along, piece.w, piece.EA, H, float(pull[2]))
        return self._on_bed(i, network, piece, ends, along, (H, float(pull[2])))

    def _on_bed(
        self, i: int, network: Network, piece: Piece, ends: Sequence[Array], along: Array, pull: tuple[float, float]
    ) -> OnBed:
        (start, end), (H, V), w, EA = ends, pull, piece.w, piece.EA
        hanging = [-V / w, piece.length - self.lying[i] + V / w]
        at_bed = [z - network.floor < AT_BED * piece.length for z in (start[2], end[2])]
        first_length, last_length = (0.0 if low else max(part, 0.0) for low, part in zip(at_bed, hanging, strict=True))
        first = Catenary(start, along, w, EA, H, -w * first_length)
        last = Catenary(end, along, w, EA, H, 0.0)
        foot, touchdown = first.position(first_length), 2 * end - last.position(last_length)
        length = piece.length - first_length - last_length
        squeeze = float(np.dot(touchdown - foot, along)) / (length * (1 + H / EA))
        lying = Lying(foot, along, length, EA, H, 0.0, squeeze)
        return OnBed(first, lying, Catenary(touchdown, along, w, EA, H, 0.0), first_length, last_length)


def _in_own_frame(network: Network, piece: Piece) -> tuple[Network, Piece, Array] | None:
    """The network and the piece in the piece's own frame, and this frame; None for the world frame."""
    if np.any(piece.drag):
        own = replace(piece, w=float(np.linalg.norm(piece.load)), drag=ORIGIN)
        return replace(network, bed=None), own, piece.frame
    if network.floats(piece):
        upside_down = replace(network, bed=Bed(UP, -(network.surface or 0.0)))
        return upside_down, replace(piece, w=-piece.w), FLIP
    return None


def _between(network: Network, piece: Piece, start: Array, end: Array) -> Any:
    """Closed form of a piece between two points."""
    if (turned := _in_own_frame(network, piece)) is not None:
        network, own, frame = turned
        return Turned(_between(network, own, frame @ start, frame @ end), frame)
    given = start, end, piece.length, piece.w, piece.EA
    try:
        return catenary.between(*given) if network.bed is None else on_bed.between(*given, network.bed)
    except ValueError as error:
        raise SolveError(str(error)) from None


def solve(network: Network, near: Rest | None = None) -> Rest:
    """Equilibrium of a network, without an initial guess.  Raises SolveError if it has none or none is found.

    near: equilibrium of a similar one with the same joints and pieces, as an optional guess to save time.  A table T(e)
    is replaced by one stiffness, approximately that at the largest tension of its piece.
    """
    for number, piece in enumerate(network.pieces):
        start, end = network.joints[piece.start], network.joints[piece.end]
        if network.is_held(piece) and np.isinf(piece.EA):
            places = [np.asarray(start.position) + piece.start_offset, np.asarray(end.position) + piece.end_offset]
            chord = places[1] - places[0]
            if (distance := float(np.linalg.norm(chord))) >= piece.length:
                raise SolveError(
                    f"piece {number}: an inextensible line of {piece.length:.6g} m cannot span {distance:.6g} m"
                )
    rest = _solve(network, near)
    for _ in range(ROUNDS):
        pairs = zip(network.pieces, rest.shapes, strict=True)
        EA = [secant(p.EA, float(max(shape.tension(np.array([0.0, p.length]))))) for p, shape in pairs]
        if all(new == old.EA or abs(new / old.EA - 1) < SAME for new, old in zip(EA, rest.network.pieces, strict=True)):
            return rest
        pieces = [replace(piece, EA=new) for piece, new in zip(network.pieces, EA, strict=True)]
        rest = _solve(replace(network, pieces=pieces), rest)
    return rest


def _solve(network: Network, near: Rest | None) -> Rest:
    """Equilibrium with a number for each table.  Pieces between fixed ends are independent of the others."""
    places = [np.zeros(3) if joint.free else np.asarray(joint.position) for joint in network.joints]
    positions = np.array(places, float)
    held, n = np.array([network.is_held(piece) for piece in network.pieces]), len(network.pieces)
    pulls, lying, ends, state = np.zeros((n, 3)), np.zeros(n), np.zeros((n, 2, 3)), None
    if not held.all():
        from .network_equations import Equations  # imports scipy: 0.1 s

        moving = replace(network, pieces=[piece for piece, h in zip(network.pieces, held, strict=True) if not h])
        found = Equations(moving).solve(near.state if near else None)
        positions, pulls[~held], lying[~held], ends[~held], state = found
    for i in np.flatnonzero(held):
        piece = network.pieces[i]
        ends[i] = positions[[piece.start, piece.end]] + [piece.start_offset, piece.end_offset]
        shape = _between(network, piece, *ends[i])
        pulls[i], lying[i] = shape.force(np.zeros(1))[0], shape.length_on_bed
    return Rest(network, positions, pulls, lying, ends, state)
