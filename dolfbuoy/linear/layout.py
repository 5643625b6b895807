"""Places of buoys and lines among all unknowns of a linearised scene; the same on all ranks."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.attachment import FIELDS
from ..model.buoy import MOTION
from ..model.problem import Problem
from ..model.rigid import rotation_of


class Body(NamedTuple):
    """A buoy: its 13 places, and C [m], unit quaternion, mass [kg], inertia about C in world axes [kg m^2] at rest."""

    name: str
    places: NDArray[Any]
    position: NDArray[Any]
    orientation: NDArray[Any]
    mass: float
    inertia: NDArray[Any]

    @property
    def at(self) -> Any:
        """Places by the names of the state."""
        return MOTION.of(self.places)

    @property
    def arms(self) -> NDArray[Any]:
        """(6,): 1 for displacements, 1/radius of gyration [1/m] for rotations."""
        return np.array([1.0] * 3 + [np.sqrt(self.mass / np.trace(self.inertia))] * 3)

    def scaled(self, block: NDArray[Any]) -> NDArray[Any]:
        """Symmetric part (6, 6) of a stiffness [N/m], with rotations measured at the radius of gyration."""
        return np.asarray((self.arms[:, None] * (block + block.T) * self.arms) / 2)

    def motion(self, x: NDArray[Any]) -> NDArray[Any]:
        """Change of C and rotation vector (6, ...) in a vector, or columns, of all unknowns."""
        return np.concatenate([x[self.at.position], 4 * half_turns(self.orientation).T @ x[self.at.orientation]])

    def poses(self) -> NDArray[Any]:
        """Columns (13, 6): changes of the state for unit motions in six degrees of freedom, momenta for unit speeds."""
        columns = np.zeros((13, 6))
        columns[MOTION.slices["position"], :3] = np.eye(3)
        columns[MOTION.slices["momentum"], :3] = self.mass * np.eye(3)
        columns[MOTION.slices["orientation"], 3:] = half_turns(self.orientation)
        columns[MOTION.slices["angular_momentum"], 3:] = self.inertia
        return columns


class Hold(NamedTuple):
    """A line's end on a buoy: the buoy's name, number of the cable, whether it is the upper end; lever from C [m] and
    force T_O [N] in equilibrium, places of T_O."""

    body: str
    cable: int
    is_top: bool
    lever: NDArray[Any]
    force: NDArray[Any]
    force_places: NDArray[Any]


class LineNodes(NamedTuple):
    """Nodes of a line in order: arc length [m], positions (n, 3) at rest [m], their places (n, 3), -1 if fixed."""

    name: str
    s: NDArray[Any]
    positions: NDArray[Any]
    places: NDArray[Any]

    def moved(self, x: NDArray[Any]) -> NDArray[Any]:
        """Changes of the positions (n, 3) in a vector of all unknowns."""
        return np.where(self.places >= 0, x[self.places], 0.0)

    @property
    def tangents(self) -> NDArray[Any]:
        """Unit vectors (n - 1, 3) between consecutive nodes; upwards if two nodes coincide."""
        return _units(np.diff(self.positions, axis=0), [0.0, 0.0, 1.0])

    @property
    def heading(self) -> NDArray[Any] | None:
        """Horizontal unit vector from the first node to the last; None if one is above the other."""
        chord = (self.positions[-1] - self.positions[0]) * [1.0, 1.0, 0.0]
        length = np.linalg.norm(chord)
        return chord / length if length > 1e-3 * self.s[-1] else None

    def directions(self, ahead: NDArray[Any]) -> NDArray[Any]:
        """Unit vectors (3, n, 3) at the nodes: along the line, normal to it in its vertical plane, and out of plane.

        ahead: horizontal direction of that plane if the line is vertical.
        """
        pieces, ahead = self.tangents, ahead if self.heading is None else self.heading
        before = np.concatenate([pieces[:1], pieces])
        t = _units(before + np.concatenate([pieces, pieces[-1:]]), before)  # at a fold as before it
        aside = np.cross([0.0, 0.0, 1.0], ahead)
        out = _units(aside - (t @ aside)[:, None] * t, ahead)
        return np.stack([t, np.cross(out, t), out])


def _units(vectors: NDArray[Any], otherwise: NDArray[Any] | list[float]) -> NDArray[Any]:
    """Normalised vectors (n, 3), with `otherwise` in place of zero vectors."""
    sizes = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(sizes > 1e-9, vectors / np.maximum(sizes, 1e-9), otherwise)


def half_turns(q4: NDArray[Any]) -> NDArray[Any]:
    """Columns (4, 3): change of a unit quaternion by a small rotation about each world axis, 1/2 (0, e_i) o q_4."""
    w, v = q4[0], np.asarray(q4[1:])
    return 0.5 * np.column_stack([np.concatenate([[-v @ e], w * e + np.cross(e, v)]) for e in np.eye(3)])


def bodies_of(problem: Problem, u: NDArray[Any]) -> list[Body]:
    """The buoys of a dynamic Problem; u: its local unknowns in equilibrium."""
    number, mine = problem.system.numbering.global_index, []
    buoy: Any
    for name, buoy in problem.buoys.items():
        state = MOTION.of(u[buoy.part.slice])
        R = rotation_of(state.orientation)
        inertia = R @ np.diag(buoy.mass.inertia) @ R.T
        places, pose = number[buoy.part.slice].astype(int), (state.position.copy(), state.orientation.copy())
        mine.append(Body(name, places, *pose, buoy.mass.mass, inertia))
    found = [body for bodies in problem.comm.allgather(mine) for body in bodies]
    return sorted(found, key=lambda body: body.places[0])


def holds_of(problem: Problem, u: NDArray[Any]) -> list[Hold]:
    """Attachment points of lines on buoys."""
    mine, names = [], {id(buoy): name for name, buoy in problem.buoys.items()}
    attachment: Any
    for attachment in (attachment for attachment in problem.attachments if attachment.buoy):
        at = attachment.of(u)
        lever = at.point - MOTION.of(u[attachment.buoy.part.slice]).position
        places = FIELDS.of(problem.system.numbering.global_index[attachment.slice]).force
        cable = problem.network.pieces[attachment.piece].cable
        is_top = attachment.end == 1 and attachment.piece == problem.network.last_of(cable)
        end = names[id(attachment.buoy)], cable, is_top
        mine.append(Hold(*end, lever, at.force.copy(), places.astype(int)))
    return [hold for holds in problem.comm.allgather(mine) for hold in holds]


def lines_of(problem: Problem, u: NDArray[Any]) -> list[LineNodes]:
    """The cables of a Problem; u: its local unknowns in equilibrium."""
    lines: Any = problem.lines
    number = problem.system.numbering.global_index
    if lines is None:
        return []
    mine = slice(lines.owned_nodes)
    dofs = lines.node_dofs[mine]
    parts = problem.comm.allgather((*_along(lines), u[dofs], number[dofs].astype(int)))
    cable, s, positions, places = (np.concatenate(part) for part in zip(*parts, strict=True))
    rows = [_in_order(cable, s, k) for k in range(len(lines.network.cables))]
    names = [name or "cable" for name in lines.network.cables]
    return [LineNodes(name, s[r], positions[r], places[r]) for name, r in zip(names, rows, strict=True)]


def inextensible_tensions(problem: Problem) -> tuple[NDArray[Any], NDArray[Any]]:
    """Places of the tensions of inextensible elements among all unknowns, and the length represented by each [m]."""
    if problem.lines is None:
        return np.zeros(0, dtype=int), np.zeros(0)
    found = [_inextensible_tensions(lines, problem.system.numbering.global_index) for lines in problem.lines.groups]
    every = [mine for of_rank in problem.comm.allgather(found) for mine in of_rank]
    places, sizes = (np.concatenate(part) for part in zip(*every, strict=True))
    return places, sizes


def _inextensible_tensions(lines: Any, number: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    dofs = lines.T_dofs[~lines.stretches] + lines.part.offset
    sizes = np.diff(lines.cell_ends, axis=1)[~lines.stretches] / dofs.shape[1] * np.ones(dofs.shape)
    return number[dofs].ravel().astype(int), sizes.ravel()


def nodes_of(lines: Any) -> list[NDArray[Any]]:
    """Local unknowns (n, 3) of the nodes of each cable, fixed ends included, as in `lines_of`; on one rank only."""
    cable, s = _along(lines)
    return [lines.node_dofs[_in_order(cable, s, k)] for k in range(len(lines.network.cables))]


def _along(lines: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Cable numbers of the owned nodes, and their arc lengths along all its pieces [m]."""
    pieces, before = lines.pieces, []
    for k, piece in enumerate(pieces):
        before.append(sum(other.section.length for other in pieces[:k] if other.cable == piece.cable))
    of_node = lines.line_of_node[: lines.owned_nodes]
    s = lines.node_s[: lines.owned_nodes] - np.asarray(lines.begins)[of_node] + np.array(before)[of_node]
    return np.array([piece.cable for piece in pieces])[of_node], s


def _in_order(cable: NDArray[Any], s: NDArray[Any], k: int) -> Any:
    """Rows of a cable's nodes from s = 0 on; only one of the two coincident nodes where pieces meet."""
    rows = np.flatnonzero(cable == k)
    rows = rows[np.argsort(s[rows], kind="stable")]
    apart = np.diff(s[rows]) > 1e-9 * s[rows].max()
    return rows[np.concatenate([[True], apart])]
