"""Lines that were laid slack on a sea bed and pulled in place: friction along all that has moved.

They are laid from the ends that are held on the bed on, over joints that lie too.  What the tension T_0 at the
touchdown s_0 can pull on has slid towards it, the rest lies as it was laid: along a line of one weight

    T(s) = max(T_0 - w (sin(alpha) + mu cos(alpha)) (s_0 - s), 0),

and less by the same of a body at a joint.  There friction holds on a stick length behind the places where the line was
laid, so that its limit is reached, and is left as soon as the line would come back; where the tension dies, by a part
of that length.  A form with limit friction everywhere is wrong there.  What is left of the tension at the end that is
held, which a line too stiff to slide would carry there, goes to what has slid in the next round: the reach is that with
which the end has nothing to hold.  What lies between two parts that hang, with no end held, is not pulled.
"""

from dataclasses import dataclass, field

import numpy as np

from ..errors import SolveError
from ..model.seabed import GroundedLength, stick_length
from ..parallel.ranks import bcast
from .damped import relax
from .on_bed import UP

ROUNDS = 3  # friction on the bed changes T_0 by less than a hundredth, and that its reach
#: More of them until less than this part of T_0 is left at an end that need not hold, and the most of all.
LEFT, MOST_ROUNDS = 0.01, 6
#: A piece lies down to its end if no more than this part of it does not.
WHOLE = 1e-9


def pull(problem) -> None:
    """From the equilibrium without friction at hand to that of pulled lines.  Raises SolveError."""
    beds = [model.bed for model in (*problem.lines.groups, problem.bodies) if model]
    for bed in beds:
        bed.enable_friction()
    left = {}  #: piece that is held on the bed -> tension that its end carried and need not [N]
    for done in range(1, MOST_ROUNDS + 1):
        laying = _Laying(problem, left)
        laying.hold()
        _settle(problem)
        if not laying.leaves_much() and done >= ROUNDS:
            break
    for bed in beds:
        bed.accept(problem.system.u)


def _settle(problem):
    """To rest under the friction that holds now: Newton, or where lines are too slack for it a damped motion."""
    try:
        problem.iterations += problem.newton.solve()
    except SolveError:
        relax(problem)


@dataclass
class Laid:
    """What lies of a piece that was laid from its end `near` on; distances are from there.

    begin, end: where it lies; along: unit vector from one to the other, in the plane of the bed; joint: name of that at
    the far end, if it lies down to there; behind: what was laid on from it.
    """

    piece: int
    near: int
    begin: float
    end: float
    along: np.ndarray
    joint: str | None = None
    behind: list["Laid"] = field(default_factory=list)


class _Laying:
    """Where the lines of a Problem were laid, as far as its present state tells."""

    def __init__(self, problem, left):
        self.left, self.root, self.dies = left, None, {}
        self.problem, self.lines, self.bed = problem, problem.lines, problem.lines.bed
        self.u, self.mu, self.n = problem.system.u, problem.scene.seabed.friction, self.bed.normal.value
        self.stick = stick_length(problem.scene)
        #: Where friction carries the weight down the slope from, for what lies still.
        self.uphill = self.stick / self.mu * (UP - self.n[2] * self.n)
        self.meetings = problem.network.meetings()
        #: Where friction holds on to the lines of each group.
        self.places = {g: g.bed.at(self.u[g.part.slice]) for g in self.lines.groups}

    def hold(self):
        """Let friction hold on behind the places where lines were laid; else where they are."""
        self._put()
        if self.problem.bodies:
            self.problem.bodies.bed.begin(self.u)
        firsts = self._held_on_bed()
        self.seen = set(firsts)
        for piece, (near, place, found) in firsts.items():
            self.root, laid = piece, self._follow(piece, near, found)
            if self._at_end(laid) <= 0:
                self.dies[piece] = near, laid.along, self._at_touchdown(laid)
            self._hold(laid, place)
        self._put()

    def leaves_much(self):
        """Note what is left of the tension at ends that need not hold; whether any is worth it.  Collective."""
        before = dict(self.left)
        for piece, (near, along, T) in self.dies.items():
            rest = -float(self.problem.end_force(piece, near) @ along)
            if abs(rest) > LEFT * T:
                self.left[piece] = self.left.get(piece, 0.0) + rest
        return self.left != before

    def _put(self):
        for lines, places in self.places.items():
            lines.bed.hold(places)

    # -- what lies -----------------------------------------------------------------------------------------------------

    def _held_on_bed(self):
        """Piece -> (end that is held on the bed, its place, what lies of the piece)."""
        found = {}
        for piece, end, _ in self.lines.held_ends():
            place, lies = np.array(self.lines.pieces[piece].ends[end].top.position), self.lines.grounded(self.u, piece)
            if lies.length and self.bed.gap(place) <= lies.sag:
                found.setdefault(piece, (end, place, lies))
        return found

    def _follow(self, piece, near, found: GroundedLength) -> Laid:
        """What lies of a piece and, over its far end, of those behind it."""
        L, ends = self.lines.sections[piece].length, [(found.first, found.foot), (found.s, found.touchdown)]
        (a, start), (b, end) = ends if near == 0 else [(L - s, place) for s, place in reversed(ends)]
        along = end - start - np.dot(end - start, self.n) * self.n
        laid = Laid(piece, near, a, b, along / (np.linalg.norm(along) or 1.0))  # straight down it slides nowhere
        far = self.lines.pieces[piece].ends[1 - near]
        if b < L * (1 - WHOLE) or far.kind != "joint":
            return laid
        laid.joint = far.name
        for k, i in self.meetings[far.name]:
            if k not in self.seen and (lies := self.lines.grounded(self.u, k)).length:
                self.seen.add(k)
                laid.behind.append(self._follow(k, i, lies))
        return laid

    # -- tensions ------------------------------------------------------------------------------------------------------

    def _fall(self, laid):
        """Of the tension along what lies, towards where it was laid from [N/m]."""
        return self.lines.weight_of(laid.piece) * (laid.along[2] + self.mu * self.n[2])

    def _pull(self, laid, least=0.0):
        """Tension at the far end of what lies, not below `least` where it comes through what lies behind [N]."""
        if len(laid.behind) == 1 and len(self.meetings[laid.joint]) == 2:
            return max(max(self._at_end(laid.behind[0]), least) - self._fall_at(laid), least)
        section = self.lines.sections[laid.piece]
        T = self.problem.tension_at(laid.end if laid.near == 0 else section.length - laid.end, laid.piece)
        return T + self.left.get(self.root, 0.0)

    def _at_touchdown(self, laid):
        """Tension T_0 where what was laid from one end leaves the bed, over all of its pieces [N]."""
        return max((self._at_touchdown(one) for one in laid.behind), default=self._pull(laid))

    def _at_end(self, laid):
        """Tension that comes through what lies; negative where it dies before [N]."""
        return self._pull(laid) - max(self._fall(laid), 0.0) * (laid.end - laid.begin)

    def _fall_at(self, laid):
        """Of the tension at a body that lies at the far end [N]."""
        if laid.joint not in self.problem.network.bodies:
            return 0.0
        bodies = self.problem.bodies  # of the first rank
        pressure = bcast(self.problem.comm, bodies and bodies.bed.pressure(laid.joint, self.u))
        return pressure * (self.mu + laid.along[2] / self.n[2])

    # -- places --------------------------------------------------------------------------------------------------------

    def _hold(self, laid, base):
        """Friction holds on along a piece that was laid from `base` on, and along those behind it."""
        lines, number = self.lines.holder(laid.piece)
        section, points = lines.sections[number], lines.bed.points
        fall, T = self._fall(laid), self._pull(laid)
        # where the tension dies, also if that is behind the far end
        still = laid.end - self._pull(laid, -np.inf) / fall if fall > 0 else -np.inf
        s = points.s - lines.begins[number]
        distance = s if laid.near == 0 else section.length - s
        reach = np.diff(lines.cell_ends, axis=1) / s.shape[1]  # what a point of the quadrature stands for
        slid = np.clip((distance - still) / reach + 0.5, 0.0, 1.0)[..., None]
        places = base + np.multiply.outer(distance - laid.begin, laid.along)
        places = places - slid * self.stick * laid.along + (1 - slid) * self.uphill
        lies = (distance <= laid.end) & (points.line == number)[:, None]
        self.places[lines] = np.where(lies[..., None], places, self.places[lines])
        base = base + (laid.end - laid.begin) * laid.along
        if laid.joint in self.problem.network.bodies and self.problem.bodies:
            place = base + (-self.stick * laid.along if T > 0 else self.uphill)
            self.problem.bodies.bed.hold_body(laid.joint, place)
        for one in laid.behind:
            self._hold(one, base)
