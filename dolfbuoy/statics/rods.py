"""Lines with bending stiffness under the loads of a cable between the same ends: initial guess for Newton's method.

A cable hangs along its force F(s).  A line with bending stiffness carries F + c under the same loads, with a constant
vector c, which is 0 if an end is loose: its directions t make

    1/2 EI |t'|^2 - (F + c) . t

stationary, with c the multiplier of the chord between its ends.  Here the line is discretised by rigid links with
springs between them, two or three per nodal interval, ending at the nodes; Newton's method turns them, with a matrix
that is banded except for the three columns of c.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import SolveError
from ..meshes import cable_nodes
from ..model.prescribed_ends import direction_of
from ..model.rigid import rotation_of
from ..scene.network import End, Network, Piece, attached_ends
from .catenary import Array
from .network import Rest

#: Links between nodes of an element, for degree 2 and for others, chosen to minimise Newton iterations.
LINKS_OF_DEGREE_2, LINKS = 2, 3
#: Limit of Newton iterations, largest rotation of a link in one of them [rad], and the negligible rotation.
MOST, LARGEST, NONE = 40, 1.0, 1e-6
#: Change of the force at an end, as a fraction of the largest force, that would move a buoy or joint there far.
FELT = 0.1


@dataclass(frozen=True)
class Bent:
    """Shape of a piece with bending stiffness (`network.Shape`): that of its cable, and at the ends `s` of its links
    the positions, tensions and moments m [N m]; more: the force c added to that of the cable [N]."""

    cable: Any
    more: Array
    s: Array
    places: Array
    tensions: Array
    moments: Array

    def position(self, s: Any) -> Array:
        return _between(s, self.s, self.places)

    def force(self, s: Any) -> Array:
        return np.asarray(self.cable.force(s) + self.more)

    def tension(self, s: Any) -> Array:
        return np.interp(s, self.s, self.tensions)

    def moment(self, s: Any) -> Array:
        """m(s), shape (n, 3) [N m]."""
        return _between(s, self.s, self.moments)


def _between(s: Any, at: Array, values: Array) -> Array:
    return np.stack([np.interp(s, at, column) for column in values.T], axis=-1)


def turned(way: Array, to: Array, x: float) -> Array:
    """Direction at a fraction x of the rotation from one to another, in any plane if they are opposite."""
    angle = angle_between(way, to)
    across: Array = to - (way @ to) * way
    if (size := np.linalg.norm(across)) < 1e-9:
        across = np.cross(way, np.eye(3)[np.abs(way).argmin()])
        size = np.linalg.norm(across)
    return np.asarray(np.cos(x * angle) * way + np.sin(x * angle) * across / size)


def angle_between(way: Array, to: Array) -> float:
    """Angle between two directions [rad]."""
    return float(np.arccos(np.clip(way @ to, -1.0, 1.0)))


def bend(network: Network, rest: Rest, poses: dict[str, Array], afloat: bool) -> tuple[list[Any], dict[str, Array]]:
    """Shapes of all pieces, bent if they have bending stiffness, hang, and a bent shape is found, and poses of the
    buoys, rotated if held by a rod only; poses: those under cables; afloat: whether buoys float."""
    shapes, found, poses, bed = rest.shapes, list(rest.shapes), dict(poses), rest.network.bed
    chains, rods = [*_chains(network, rest.lying)], _chains(network, 0 * rest.lying)
    if bed is None:  # grounded here means lying on the surface
        chains += [rod for rod in rods if rod not in chains and _tip(network, rod) is not None]
    for numbers in chains:
        given = network, [network.pieces[k] for k in numbers], [shapes[k] for k in numbers], poses
        tip, lies = _tip(network, numbers), rest.lying[numbers].any()
        tries: list[int | None] = [None] if tip is None or (afloat and not lies) else []
        tries += [tip] if tip is not None else []
        for loose in tries:
            with suppress(SolveError, np.linalg.LinAlgError):  # otherwise keep the cable's shape
                chain = _Chain(*given, loose, afloat)
                bent = chain.bend()
                if bed is None or all(bed.height_above(place) >= 0 for shape in bent for place in shape.places[1:-1]):
                    for k, shape in zip(numbers, bent, strict=True):
                        found[k] = shape
                    poses |= chain.turned_buoy(bent)
                break
    return found, poses


def _tip(network: Network, numbers: Sequence[int]) -> int | None:
    """End of a chain of pieces, 0 or 1, at a buoy held only by the clamp at the other end; None without one."""
    ends = network.pieces[numbers[0]].ends[0], network.pieces[numbers[-1]].ends[1]
    pulled = [network.pieces[k].ends[i].name for k, i in attached_ends(network)]
    pulled += [end.name for device in network.take_offs.values() for end in device.ends]
    for i, (end, other) in enumerate(zip(ends, ends[::-1], strict=True)):
        if end.kind == "buoy" and end.clamp and other.clamp and other.kind != "buoy" and pulled.count(end.name) == 1:
            return i
    return None


def weak_springs(network: Network, shapes: Sequence[Any]) -> list[str]:
    """Messages on springs at ends of bent shapes that turn by more than 60 degrees, where k sin(angle) is far below
    k times the angle; beyond a right angle the spring no longer restrains the end."""
    found = []
    for piece, shape in zip(network.pieces, shapes, strict=False):
        for i, end in enumerate(piece.ends):
            k = end.clamp.rotational_stiffness if end.clamp else None
            if k and isinstance(shape, Bent) and np.linalg.norm(shape.moments[-i]) > k:
                key = f"{network.key_of(piece.cable)}.{('from', 'to')[i]}_end.rotational_stiffness = {k:g}"
                found.append(f"{key}: may be too weak, this spring holds nothing that it turns beyond a right angle")
    return found


def _chains(network: Network, lying: Array) -> Iterator[list[int]]:
    """Numbers of consecutive pieces with bending stiffness that are not grounded and are joined without a hinge."""
    for cable in range(len(network.cables)):
        run: list[int] = []
        for k in network.pieces_of(cable):
            bends = network.pieces[k].section.bending_stiffness and not lying[k]
            if not (bends and run and network.pieces[k].ends[0].name in network.welds):
                if run:
                    yield run
                run = []
            if bends:
                run = [*run, k]
        if run:
            yield run


@dataclass(frozen=True)
class _Links:
    """Links of these lengths [m] under these forces [N], with springs [N m] at their ends; the outermost ones turn the
    line towards `ways`; chord: vector between the ends, None if an end is loose."""

    lengths: Array
    forces: Array
    springs: Array
    ways: Array
    chord: Array | None

    def settled(self, t: Array) -> tuple[Array, Array]:
        """(directions, c) in equilibrium, from initial directions.  Raises SolveError, LinAlgError."""
        c = np.zeros(3)
        for _ in range(MOST):
            turn, more = self._turn(t, c)
            size = np.linalg.norm(turn, axis=1, keepdims=True)
            part = min(1.0, LARGEST / max(size.max(), NONE))
            t = np.cos(part * size) * t + part * np.sinc(part * size / np.pi) * turn
            t /= np.linalg.norm(t, axis=1, keepdims=True)
            c = c + part * more
            if size.max() < NONE:
                return t, c
        raise SolveError(f"links still turn after {MOST} iterations")

    def _turn(self, t: Array, c: Array) -> tuple[Array, Array]:
        """Newton increments: rotation of each link, perpendicular to it, and change of c."""
        from scipy.linalg import solve_banded  # slow to import

        k, across, n = self.springs, _across(t), len(t)
        pull = self.lengths[:, None] * (self.forces + c)
        pull[1:] += k[1:-1, None] * t[:-1]
        pull[:-1] += k[1:-1, None] * t[1:]
        pull[[0, -1]] += k[[0, -1], None] * self.ways
        band, columns = np.zeros((7, 2 * n)), np.zeros((2 * n, 4))
        band[3] = np.repeat(np.einsum("ni,ni->n", pull, t), 2)
        beside = -k[1:-1, None, None] * across[:-1] @ across[1:].transpose(0, 2, 1)
        for i, j in np.ndindex(2, 2):
            row, column = 2 * np.arange(n - 1) + i, 2 * np.arange(1, n) + j
            band[3 + row - column, column] = band[3 + column - row, row] = beside[:, i, j]
        columns[:, 0] = np.einsum("nij,nj->ni", across, pull).ravel()
        columns[:, 1:] = (self.lengths[:, None, None] * across).reshape(2 * n, 3)
        free, more = solve_banded((3, 3), band, columns), np.zeros(3)
        if self.chord is not None:
            by_c = columns[:, 1:].T @ free
            more = np.linalg.solve(by_c[:, 1:], self.chord - self.lengths @ t - by_c[:, 0])
        turn = free @ [1.0, *more]
        return np.einsum("ni,nij->nj", turn.reshape(n, 2), across), more


def _across(t: Array) -> Array:
    """Two unit vectors perpendicular to each direction, shape (n, 2, 3)."""
    first = np.cross(t, np.eye(3)[np.abs(t).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(t, first)], axis=1)


class _Chain:
    """Consecutive pieces of a line in the shapes of their cables, or straight if only one end is held, with a
    direction.

    tip: the end at a buoy that moves with the rod, with its weight or, afloat, without.
    """

    def __init__(
        self,
        network: Network,
        pieces: Sequence[Piece],
        shapes: Sequence[Any],
        poses: dict[str, Array],
        tip: int | None = None,
        afloat: bool = False,
    ):
        self.shapes, ends = shapes, (pieces[0].ends[0], pieces[-1].ends[1])
        self.sections = [piece.section for piece in pieces]
        self.s = [_ends_of_links(section) for section in self.sections]
        alone = {name for name, there in network.meetings().items() if len(there) == 1}
        self.moves = any(end.kind in ("joint", "buoy") for end in ends)
        self.loose = [end.kind == "free" or end.name in alone or i == tip for i, end in enumerate(ends)]
        # None: pinned, or the direction of the cable at a weld
        ways = [None if i == tip else _direction(end, poses) for i, end in enumerate(ends)]
        self.tip, self.at_tip = tip, ends[tip or 0]
        steps = self._steps(ways)
        lengths = np.linalg.norm(steps, axis=1)
        if not lengths.all():
            raise SolveError("the cable has folds of no length")
        self.t = steps / lengths[:, None]
        forces = self._of_pieces(lambda shape, s: shape.force((s[1:] + s[:-1]) / 2))
        self.carried = shapes[-tip].force(self.s[-tip][[-tip]])[0] if tip is not None and afloat else np.zeros(3)
        given = [t if way is None else way for t, way in zip(self.t[[0, -1]], ways, strict=True)]
        chord = None if any(self.loose) else steps.sum(axis=0)
        self.links = _Links(
            lengths, forces - self.carried, 1 / self._flexibility(network, pieces, tip), np.array(given), chord
        )

    def _of_pieces(self, what: Callable[[Any, Array], Array]) -> Array:
        """Values for all links, concatenated from what(shape, s) of the pieces."""
        return np.concatenate([what(shape, s) for shape, s in zip(self.shapes, self.s, strict=True)])

    def _steps(self, ways: Sequence[Array | None]) -> Array:
        """Initial link vectors [m]."""
        held = [way for way, loose in zip(ways, self.loose, strict=True) if way is not None and not loose]
        if any(self.loose) and held:
            return self._of_pieces(lambda _, s: np.multiply.outer(np.diff(s), held[0]))
        return self._of_pieces(lambda shape, s: np.diff(shape.position(s), axis=0))

    def _flexibility(self, network: Network, pieces: Sequence[Piece], tip: int | None) -> Array:
        """Rotation per moment at the ends of all links, infinite in a hinge [1/(N m)]."""
        halves = zip(self.s, pieces, strict=True)
        of_halves = np.concatenate([np.diff(s) / 2 / piece.section.bending_stiffness for s, piece in halves])
        found = np.append(of_halves, 0.0) + np.append(0.0, of_halves)
        for i, end in enumerate((pieces[0].ends[0], pieces[-1].ends[1])):
            place = -i
            if (end.clamp is None and end.name not in network.welds) or i == tip:
                found[place] = np.inf
            elif end.clamp and end.clamp.rotational_stiffness:
                found[place] += 1 / end.clamp.rotational_stiffness
        return np.asarray(found)

    def bend(self) -> list[Bent]:
        """Bent shapes of the pieces; ends far from their directions are rotated there in steps."""
        links, t, begins = self.links, self.t, self.t[[0, -1]]
        turns = int(np.ceil(max(map(angle_between, begins, links.ways)) / LARGEST)) or 1
        for k in range(1, turns + 1):
            ways = [turned(way, to, k / turns) for way, to in zip(begins, links.ways, strict=True)]
            t, c = replace(links, ways=np.array(ways)).settled(t)
        if self.moves and np.linalg.norm(c) > FELT * np.linalg.norm(links.forces, axis=1).max():
            raise SolveError("what holds an end would go away")
        return list(self._pieces(t, c))

    def turned_buoy(self, bent: Sequence[Bent]) -> dict[str, Array]:
        """Name and pose of the buoy at the tip, rotated in line with the rod."""
        if self.tip is None or self.at_tip.clamp is None:
            return {}
        step = np.diff(bent[-self.tip].places, axis=0)[-self.tip]
        own = np.asarray(self.at_tip.clamp.unit)
        half = turned(own, step / np.linalg.norm(step), 0.5)
        return {str(self.at_tip.name): np.array([own @ half, *np.cross(own, half)])}

    def _pieces(self, t: Array, c: Array) -> Iterator[Bent]:
        links, first = self.links, 0
        moments = links.springs[:, None] * np.diff(np.vstack([links.ways[:1], t, links.ways[1:]]), axis=0)
        places = np.vstack([np.zeros(3), np.cumsum(links.lengths[:, None] * t, axis=0)])
        end = -1 if self.loose[0] else 0
        places += self.shapes[end].position(self.s[end][[end]]) - places[end]
        tensions = np.einsum("ni,ni->n", links.forces + c, t)
        for shape, s, section in zip(self.shapes, self.s, self.sections, strict=True):
            T, ends = tensions[first : first + len(s) - 1], slice(first, first + len(s))
            if section.position_degree == 2:
                moments[ends] = _blended(moments[ends], places[ends])
            T = np.concatenate([[1.5 * T[0] - 0.5 * T[1]], (T[1:] + T[:-1]) / 2, [1.5 * T[-1] - 0.5 * T[-2]]])
            yield Bent(shape, c - self.carried, s, places[ends], T, moments[ends])
            first += len(s) - 1


def _ends_of_links(section: Any) -> Array:
    """Unstretched lengths at which the links of a piece end [m]; they include the Gauss-Lobatto nodes."""
    inner = np.polynomial.Legendre.basis(section.position_degree).deriv().roots()
    within = (np.concatenate([[-1.0], inner]) + 1) / 2
    links = LINKS_OF_DEGREE_2 if section.position_degree == 2 else LINKS
    ends = cable_nodes(section.length, section.elements, section.grading)
    nodes = np.append(ends[:-1, None] + np.diff(ends)[:, None] * within, ends[-1])
    return np.interp(np.arange(links * (len(nodes) - 1) + 1) / links, np.arange(len(nodes)), nodes)


def _blended(moments: Array, places: Array) -> Array:
    """Moments of links whose quadratic part in elements of degree 2 is halved along the line, as with
    `forms.bending.blended_energy`."""
    step, found = LINKS_OF_DEGREE_2, moments.copy()
    begin, end, middle = moments[: -2 * step : 2 * step], moments[2 * step :: 2 * step], moments[step :: 2 * step]
    chords = np.diff(places[:: 2 * step], axis=0)
    along = np.einsum("ni,ni->n", begin + end - 2 * middle, chords) / np.einsum("ni,ni->n", chords, chords)
    found[step :: 2 * step] += along[:, None] * chords / 4
    return found


def _direction(end: End, poses: dict[str, Array]) -> Array | None:
    """Direction of an end, None if pinned."""
    if end.clamp is None:
        return None
    if end.kind == "buoy":
        return np.asarray(rotation_of(poses[str(end.name)]) @ end.clamp.unit)
    path = direction_of(end.clamp)
    return np.asarray(end.clamp.unit if path is None else path(0.0))
