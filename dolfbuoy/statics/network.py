"""Rest of a network of lines in still water by closed forms: the start of the statics, with no element in it.

A line is one Piece or several: uniform, elastic or inextensible, heavier or lighter than water, between two joints.
Joints are held or free; free ones carry a net force, which may depend on where they are (a float, a moored hull).
Under it all may lie a flat bed without friction.  The equations and why they can be solved from nowhere are those of
`network_equations`; this module says what a network is and what its rest looks like.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import SolveError
from .catenary import Catenary, between
from .on_bed import UP, Lying, OnBed

ORIGIN = (0.0, 0.0, 0.0)
#: A length that lies counts from this part of the piece on; less is what smoothing leaves.
LYING = 3e-5
#: An end is on the bed below this part of the piece's length.
AT_BED = 1e-7


@dataclass(frozen=True)
class Joint:
    """Point to which pieces are tied.

    Held at `position`, or free, from anywhere (None) or near `position`; `load` is the net force on a free one [N],
    or a function that gives it and its derivative, shapes (3,) and (3, 3), from the position.
    """

    position: Sequence[float] | None = None
    free: bool = False
    load: Sequence[float] | Callable = ORIGIN


@dataclass(frozen=True)
class Piece:
    """Uniform line between two joints (indices), or points fixed to them: `length` [m], weight in water `w` [N/m]."""

    start: int
    end: int
    length: float
    w: float
    EA: float
    start_offset: Sequence[float] = ORIGIN
    end_offset: Sequence[float] = ORIGIN


@dataclass(frozen=True)
class Network:
    """Joints, pieces and the height of the flat bed [m] (None: no bed)."""

    joints: Sequence[Joint]
    pieces: Sequence[Piece]
    bed: float | None = None


@dataclass(frozen=True)
class Straight:
    """Line without weight between two points; methods as those of a Catenary."""

    start: np.ndarray
    chord: np.ndarray
    length: float
    pull: np.ndarray

    length_on_bed = 0.0
    touchdown = None

    def position(self, s):
        """r(s), shape (n, 3) [m]."""
        return self.start + np.multiply.outer(np.asarray(s, float) / self.length, self.chord)

    def force(self, s):
        """Tension as a vector along the line, shape (n, 3) [N]."""
        return np.multiply.outer(np.ones_like(s, float), self.pull)

    def tension(self, s):
        """T(s) [N]."""
        return np.linalg.norm(self.force(s), axis=-1)


@dataclass(frozen=True)
class Rest:
    """A network at rest: `positions` of all joints, and of each piece the tension at its start, what lies, its ends."""

    network: Network
    positions: np.ndarray
    pulls: np.ndarray
    lying: np.ndarray
    ends: np.ndarray

    @cached_property
    def shapes(self):
        """Closed form of every piece from its start, with position(s), tension(s) and force(s)."""
        return [self._shape(i) for i in range(len(self.network.pieces))]

    def force_on(self, joint):
        """Force of all pieces on a joint or the body that stands for it [N]."""
        total = np.zeros(3)
        for i, piece in enumerate(self.network.pieces):
            hanging = piece.length - self.lying[i]
            total += self.pulls[i] if piece.start == joint else 0.0
            total -= self.pulls[i] + piece.w * hanging * UP if piece.end == joint else 0.0
        return total

    def _shape(self, i):
        piece, (start, end), pull = self.network.pieces[i], self.ends[i], self.pulls[i]
        if piece.w == 0:
            return Straight(start, end - start, piece.length, pull)
        H, room = float(np.hypot(*pull[:2])), end[:2] - start[:2]
        width = float(np.hypot(*room))
        way = room / width if width > 0 else np.array([1.0, 0.0])
        along = np.array([*way, 0.0])
        if 0 < self.lying[i] <= LYING * piece.length and width > 1e-3 * piece.length:
            return between(start, end, piece.length, piece.w, piece.EA)
        if self.lying[i] <= LYING * piece.length:
            return Catenary(start, along, piece.w, piece.EA, H, float(pull[2]))
        return self._on_bed(i, piece, start, end, along, H)

    def _on_bed(self, i, piece, start, end, along, H):
        w, EA, pull = piece.w, piece.EA, float(self.pulls[i, 2])
        hanging = [-pull / w, piece.length - self.lying[i] + pull / w]
        heights = start[2] - self.network.bed, end[2] - self.network.bed
        at_bed = [height < AT_BED * piece.length for height in heights]
        first_length, last_length = (0.0 if low else max(part, 0.0) for low, part in zip(at_bed, hanging, strict=True))
        first = Catenary(start, along, w, EA, H, -w * first_length)
        last = Catenary(end, along, w, EA, H, 0.0)
        foot, touchdown = first.position(first_length), 2 * end - last.position(last_length)
        length = piece.length - first_length - last_length
        squeeze = float(np.dot(touchdown - foot, along)) / (length * (1 + H / EA))
        lying = Lying(foot, along, length, EA, H, 0.0, squeeze)
        return OnBed(first, lying, Catenary(touchdown, along, w, EA, H, 0.0), first_length, last_length)


def solve(network) -> Rest:
    """Rest of a network, from nowhere: no start is needed.  Raises SolveError if it has none or none is found."""
    _check(network)
    from .network_equations import Equations  # and scipy: 0.1 s of every start

    equations = Equations(network)
    return Rest(network, *equations.solve())


def _check(network):
    """Refuse what can have no rest."""
    for number, piece in enumerate(network.pieces):
        start, end = network.joints[piece.start], network.joints[piece.end]
        if not (start.free or end.free) and np.isinf(piece.EA):
            chord = np.add(end.position, piece.end_offset) - np.add(start.position, piece.start_offset)
            if (distance := float(np.linalg.norm(chord))) >= piece.length:
                raise SolveError(
                    f"piece {number}: an inextensible line of {piece.length:.6g} m cannot span {distance:.6g} m"
                )
