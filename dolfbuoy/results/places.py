"""Places on lines where the tension is recorded for [fatigue], besides both ends, which every record has.

They are material points, found once in the shape at the start: joints between segments, on either side; the touchdown
point; the highest (hog) and lowest (sag) points between the ends; and points at a regular spacing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..model.problem import Problem
    from ..scene.network import Network

#: A hog or sag counts if the line rises and falls by more than this fraction of its length.
RISE = 1e-6
#: Separator between the name of a segment and the place on it.
AT = " at "
#: Names of places at joints, on the segment below and above.
JOINTS = "upper end", "lower end"


class Place(NamedTuple):
    """A place on a line: "CABLE at WHERE", or "CABLE.NUMBER at WHERE" with several segments; s: on its piece [m]."""

    name: str
    piece: int
    s: float


def piece_of(name: str, network: Network) -> tuple[int, bool]:
    """(number of the piece with the place of this name, True if the place is a joint)."""
    segment, _, where = name.partition(AT)
    return next(k for k in range(len(network.pieces)) if network.name_of(k) == segment), where in JOINTS


def places_of(problem: Problem) -> list[Place]:
    """Places of the lines of a Problem in their present shape, cable by cable; collective, on every rank."""
    fatigue, network = problem.scene.fatigue, problem.network
    if fatigue is None or problem.lines is None:
        return []
    found: list[Place] = []
    nodes = _nodes(problem)
    for cable in range(len(network.cables)):
        pieces, lengths = network.pieces_of(cable), [section.length for section in network.sections_of(cable)]
        ends = np.cumsum([0.0, *lengths])
        low, high = _lying(problem, pieces, ends)
        marks = [("touchdown", at) for at in (low, high) if 1e-9 < at / ends[-1] < 1 - 1e-9]
        turns = _turns(*nodes[cable], RISE * ends[-1])
        marks += [(kind, at) for kind, at in turns if not low <= at <= high]
        marks = [(kind, at) for kind, at in marks if kind in fatigue.places]
        if fatigue.spacing is not None:
            steps = np.arange(1, int(np.ceil(ends[-1] / fatigue.spacing - 1e-9))) * fatigue.spacing
            marks += [(f"{at:.9g} m", float(at)) for at in steps]
        numbers = [min(int(np.searchsorted(ends, at, side="right")) - 1, len(pieces) - 1) for _, at in marks]
        wanted = [(kind, n, at - ends[n]) for (kind, at), n in zip(marks, numbers, strict=True)]
        if "joints" in fatigue.places:
            between = range(len(pieces) - 1)
            wanted += [one for n in between for one in ((JOINTS[0], n, lengths[n]), (JOINTS[1], n + 1, 0.0))]
        seen: list[str] = []
        for kind, n, s in sorted(wanted, key=lambda one: (one[1], one[2])):
            name = f"{network.name_of(pieces[n])}{AT}{kind}"
            seen.append(name)
            again = f" {seen.count(name)}" if seen.count(name) > 1 else ""
            found.append(Place(name + again, pieces[n], float(s)))
    return found


def _nodes(problem: Problem) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """(arc lengths, heights) of the nodes of each cable, from its lower end."""
    lines: Any = problem.lines
    n, network = lines.owned_nodes, problem.network
    piece, u = lines.line_of_node[:n], problem.system.u[lines.part.slice]
    lengths = [p.section.length for p in network.pieces]
    before = np.array([sum(lengths[k - p.number : k]) for k, p in enumerate(network.pieces)])
    s = lines.node_s[:n] - lines.begins[piece] + before[piece]
    cable = np.array([p.cable for p in network.pieces])[piece]
    rows = np.concatenate(problem.comm.allgather(np.column_stack([cable, s, u[lines.node_dofs[:n, 2]]])))
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    return [(mine[:, 1], mine[:, 2]) for mine in (rows[rows[:, 0] == k] for k in range(len(network.cables)))]


def _lying(problem: Problem, pieces: range, ends: NDArray[Any]) -> tuple[float, float]:
    """Arc lengths between which a cable lies on the bed [m]; (inf, -inf) if it does not."""
    lines: Any = problem.lines
    if lines.bed is None:
        return np.inf, -np.inf
    found = [lines.grounded(problem.system.u, piece) for piece in pieces]
    lies = [(start + one.first, start + one.s) for start, one in zip(ends, found, strict=False) if one.length > 0]
    return (lies[0][0], lies[-1][1]) if lies else (np.inf, -np.inf)


def _turns(s: NDArray[Any], z: NDArray[Any], rise: float) -> list[tuple[str, float]]:
    """[("hog" or "sag", arc length), ...] where the heights reverse by more than `rise` on both sides."""
    found: list[tuple[str, float]] = []
    extreme, upwards = 0, None
    for k in range(1, len(z)):
        change = z[k] - z[extreme]
        if upwards is None:
            if abs(change) > rise:
                extreme, upwards = k, change > 0
        elif (change > 0) == upwards and change != 0:
            extreme = k
        elif abs(change) > rise:
            found.append(("hog" if upwards else "sag", float(s[extreme])))
            extreme, upwards = k, not upwards
    return found
