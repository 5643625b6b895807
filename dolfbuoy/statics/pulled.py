"""Lines laid slack on a sea bed and pulled into place: friction along the part that has slid.

They are laid from fixed ends on the bed onward, across joints that are grounded too.  The part that the tension T_0 at
the touchdown point s_0 can mobilise has slid towards it, the rest lies as laid: along a line of uniform weight

    T(s) = max(T_0 - w (sin(alpha) + mu cos(alpha)) (s_0 - s), 0),

reduced further in the same way by a body at a joint.  Along the part that has slid, the stick point is a stick length
behind the position as laid, so that friction is at its limit, and leaves it as soon as the line moves back; where the
tension vanishes, it is a fraction of that length behind.  Limit friction everywhere would be wrong there.  Any tension
left at the fixed end, which a line too stiff to slide would carry there, is assigned to the slid part in the next
round, so that the end carries no load.  A grounded part between two hanging ones, without a fixed end, is not pulled.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import SolveError
from ..model.contact import stick_length
from ..model.grounding import GroundedLength
from ..model.problem import Problem
from ..parallel.ranks import bcast
from .catenary import Array
from .damped import relax
from .on_bed import UP

ROUNDS = 3  # bed friction changes T_0, and hence its reach, by less than a hundredth
#: Further rounds until less than this fraction of T_0 is left at an end that need not hold, and the limit of rounds.
LEFT, MOST_ROUNDS = 0.01, 6
#: Largest hanging fraction of a piece that counts as grounded down to its end.
WHOLE = 1e-9


def pull(problem: Problem) -> None:
    """Go from the frictionless equilibrium to that of pulled lines.  Raises SolveError."""
    beds = [model.bed for model in (*problem.lines.groups, problem.bodies) if model]
    seabed: Any = problem.scene.seabed
    for bed in beds:
        bed.friction.value = seabed.friction  # used in statics only here
    left: dict[int, float] = {}  #: piece fixed on the bed -> tension that its end carried and need not [N]
    for done in range(1, MOST_ROUNDS + 1):
        laying = _Laying(problem, left)
        laying.hold()
        try:
            problem.iterations += problem.newton.solve()
        except SolveError:
            relax(problem)  # lines too slack for Newton
        if not laying.leaves_much() and done >= ROUNDS:
            break
    for bed in beds:
        bed.accept(problem.system.u)


@dataclass
class Laid:
    """Grounded part of a piece laid from its end `near` onward; distances are from there.

    begin, end: those of the part; along: unit vector from one to the other, in the plane of the bed; joint: name of the
    joint at the far end, if grounded up to it; onward: parts laid on from there.
    """

    piece: int
    near: int
    begin: float
    end: float
    along: Array
    joint: str = ""
    onward: list["Laid"] = field(default_factory=list)


class _Laying:
    """Positions in which the lines of a Problem were laid, from its present state."""

    def __init__(self, problem: Problem, left: dict[int, float]):
        self.left, self.root = left, -1
        self.dies: dict[int, tuple[int, Array, float]] = {}
        self.problem, self.lines, self.bed = problem, problem.lines, problem.lines.bed
        self.u, self.n = problem.system.u, self.bed.normal.value
        self.mu = problem.scene.seabed.friction if problem.scene.seabed else 0.0
        self.stick = stick_length(problem.scene)
        #: Vector from a point at rest to the stick point whose friction carries the downslope weight.
        self.uphill = self.stick / self.mu * (UP - self.n[2] * self.n)
        self.meetings = problem.network.meetings()
        #: Stick points of the lines of each group.
        self.places = {g: g.bed.at(self.u[g.part.slice]) for g in self.lines.groups}

    def hold(self) -> None:
        """Set the stick points a stick length behind the positions as laid, or to the present positions elsewhere."""
        for lines, places in self.places.items():
            lines.bed.hold(places)
        if self.problem.bodies:
            self.problem.bodies.bed.begin(self.u)
        #: Piece -> (end fixed on the bed, its position, grounded part of the piece).
        firsts: dict[int, tuple[int, Array, GroundedLength]] = {}
        for piece, end in self._held():
            place, lies = np.array(self.lines.pieces[piece].ends[end].top.position), self.lines.grounded(self.u, piece)
            if lies.length and self.bed.gap(place) <= lies.sag:
                firsts.setdefault(piece, (end, place, lies))
        self.seen = set(firsts)
        for piece, (near, place, found) in firsts.items():
            self.root, laid = piece, self._follow(piece, near, found)
            if self._at_end(laid) <= 0:
                self.dies[piece] = near, laid.along, self._at_touchdown(laid)
            self._hold(laid, place)
        for lines, places in self.places.items():
            lines.bed.hold(places)

    def _held(self) -> list[tuple[int, int]]:
        """(piece, end) of ends that are fixed or on sinkers."""
        ends = enumerate(self.lines.pieces)
        return [(k, i) for k, piece in ends for i in (0, 1) if piece.ends[i].held or piece.ends[i].is_on_sinker]

    def leaves_much(self) -> bool:
        """Record the tension left at ends that need not hold; True if any is worth another round.  Collective."""
        before = dict(self.left)
        for piece, (near, along, T) in self.dies.items():
            rest = -float(self.problem.end_force(piece, near) @ along)
            if abs(rest) > LEFT * T:
                self.left[piece] = self.left.get(piece, 0.0) + rest
        return self.left != before

    def _follow(self, piece: int, near: int, found: GroundedLength) -> Laid:
        """Grounded part of a piece and, across its far end, of those onward."""
        L, ends = self.lines.sections[piece].length, [(found.first, found.foot), (found.s, found.touchdown)]
        (a, start), (b, end) = ends if near == 0 else [(L - s, place) for s, place in reversed(ends)]
        along = end - start - np.dot(end - start, self.n) * self.n
        laid = Laid(piece, near, a, b, along / (np.linalg.norm(along) or 1.0))  # a vertical line does not slide
        far = self.lines.pieces[piece].ends[1 - near]
        if b < L * (1 - WHOLE) or far.kind != "joint":
            return laid
        laid.joint = far.name
        for k, i in self.meetings[far.name]:
            if k not in self.seen and (lies := self.lines.grounded(self.u, k)).length:
                self.seen.add(k)
                laid.onward.append(self._follow(k, i, lies))
        return laid

    def _fall(self, laid: Laid) -> float:
        """Decrease of the tension along the grounded part, towards its near end [N/m]."""
        return float(self.lines.weight_of(laid.piece) * (laid.along[2] + self.mu * self.n[2]))

    def _pull(self, laid: Laid, least: float = 0.0) -> float:
        """Tension at the far end of the grounded part, at least `least` if it comes through onward parts [N]."""
        if len(laid.onward) == 1 and len(self.meetings[laid.joint]) == 2:
            T = max(self._at_end(laid.onward[0]), least)
            if laid.joint in self.problem.network.bodies:
                bodies = self.problem.bodies  # on the first rank
                pressure = bcast(self.problem.comm, bodies and bodies.bed.pressure(laid.joint, self.u))
                T -= float(pressure * (self.mu + laid.along[2] / self.n[2]))
            return max(T, least)
        section = self.lines.sections[laid.piece]
        T = self.problem.tension_at(laid.end if laid.near == 0 else section.length - laid.end, laid.piece)
        return T + self.left.get(self.root, 0.0)

    def _at_touchdown(self, laid: Laid) -> float:
        """Tension T_0 at the touchdown point of the part laid from one end, across all its pieces [N]."""
        return max((self._at_touchdown(one) for one in laid.onward), default=self._pull(laid))

    def _at_end(self, laid: Laid) -> float:
        """Tension at the near end of the grounded part; negative if it vanishes before [N]."""
        return self._pull(laid) - max(self._fall(laid), 0.0) * (laid.end - laid.begin)

    def _hold(self, laid: Laid, base: Array) -> None:
        """Set the stick points along a piece laid from `base` onward, and along those after it."""
        lines, number = self.lines.holder(laid.piece)
        section, points = lines.sections[number], lines.bed.points
        fall, T = self._fall(laid), self._pull(laid)
        # where the tension vanishes, possibly beyond the far end
        still = laid.end - self._pull(laid, -np.inf) / fall if fall > 0 else -np.inf
        s = points.s - lines.begins[number]
        distance = s if laid.near == 0 else section.length - s
        reach = np.diff(lines.cell_ends, axis=1) / s.shape[1]  # length represented by a quadrature point
        slid = np.clip((distance - still) / reach + 0.5, 0.0, 1.0)[..., None]
        places = base + np.multiply.outer(distance - laid.begin, laid.along)
        places = places - slid * self.stick * laid.along + (1 - slid) * self.uphill
        lies = (distance <= laid.end) & (points.line == number)[:, None]
        self.places[lines] = np.where(lies[..., None], places, self.places[lines])
        base = base + (laid.end - laid.begin) * laid.along
        if laid.joint in self.problem.network.bodies and self.problem.bodies:
            place = base + (-self.stick * laid.along if T > 0 else self.uphill)
            self.problem.bodies.bed.hold_body(laid.joint, place)
        for one in laid.onward:
            self._hold(one, base)
