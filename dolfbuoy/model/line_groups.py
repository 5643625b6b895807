"""Lines of several kinds: those with the same element pair, strain and strain form are a group with its own mesh.

`LineGroups` has the interface of `Lines` for all lines of a scene: arrays are concatenated over the groups, and methods
for one piece, by its number in the scene, are delegated to the group that contains it.
"""

import itertools
from collections.abc import Callable
from functools import cached_property, partial
from types import SimpleNamespace

import numpy as np

from ..elsewhere import MPI
from ..scene import Scene
from ..solver.tension_only import OneSidedRows
from .interface import Model
from .layout import Pieces, laid_out
from .lines import Lines, is_averaged


def lines_of(comm: MPI.Comm, scene: Scene, dynamic: bool) -> "Lines | LineGroups | None":
    """The Lines of a scene, or its LineGroups; None without any."""
    kinds = {}
    for number, piece in enumerate(scene.network.pieces):
        c = piece.section
        kind = c.position_degree, c.tension_degree, is_averaged(c), c.strain_form, c.bending_stiffness > 0
        kinds.setdefault(kind, []).append(number)
    if len(kinds) < 2:
        return Lines(comm, scene, dynamic) if kinds else None
    return LineGroups(comm, scene, dynamic, list(kinds.values()))


def _joined(name: str) -> property:
    """Property: the arrays of all groups, concatenated."""
    return property(lambda self: np.concatenate([getattr(group, name) for group in self.groups]))


def _numbered(name: str) -> property:
    """Property: numbers of pieces of all groups, in the numbering of the scene."""
    return property(lambda self: np.concatenate([np.array(g.numbers)[getattr(g, name)] for g in self.groups]))


def _of_all(name: str, made_one: Callable = lambda found: None) -> Callable:
    """Method: calls that of every group and combines the results, by default to None."""
    return lambda self, *args: made_one([getattr(group, name)(*args) for group in self.groups])


#: Methods whose results are concatenated as arrays, or as lists.
_joined_of = partial(_of_all, made_one=np.concatenate)
_listed = partial(_of_all, made_one=lambda found: list(itertools.chain.from_iterable(found)))


def _of_piece(name: str, at: int = -1) -> Callable:
    """Method: that of the group containing the piece whose number is the argument `at`."""

    def method(self, *args):
        args = list(args)
        group, args[at] = self.holder(args[at])
        return getattr(group, name)(*args)

    return method


class LineGroups(Pieces, Model):
    """All lines of a scene; `groups`: the Lines of each kind.  Names not documented here are as in `Lines`."""

    mean_dofs = moment_dofs = None
    cell_ends, stretches, one_sided = _joined("cell_ends"), _joined("stretches"), _joined("one_sided")
    keeps_shape = _joined("keeps_shape")
    owned, turnable, parted_at = _joined("owned"), _joined("turnable"), _joined("parted_at")
    line_of_cell, places, mean_tension = _numbered("line_of_cell"), _joined_of("places"), _joined_of("mean_tension")
    evolutions, blocks, clock = _listed("evolutions"), _listed("blocks"), _listed("clock")
    when_accepted, begin, stop = _listed("when_accepted"), _of_all("begin"), _of_all("stop")
    hold, let_go, follow_water = _of_all("hold"), _of_all("let_go"), _of_all("follow_water")
    publish_points, owns_end, set_shape = _of_all("publish_points"), _of_piece("owns_end", 0), _of_piece("set_shape")
    set_moment = _of_piece("set_moment")
    weight_of, grounded, anchor_tension = _of_piece("weight_of"), _of_piece("grounded"), _of_piece("anchor_tension")
    scene = property(lambda self: self.groups[0].scene)
    bed = property(lambda self: self.groups[0].bed)  #: one of several, on the same plane
    elastic = property(lambda self: any(group.elastic for group in self.groups))
    owned_nodes = property(lambda self: sum(group.owned_nodes for group in self.groups))
    slip = property(lambda self: max(group.slip for group in self.groups))

    def __init__(self, comm: MPI.Comm, scene: Scene, dynamic: bool, kinds: list[list[int]]):
        self.comm, self.dynamic, self.network = comm, dynamic, scene.network
        self.begins = laid_out(self.sections)  #: start of each piece on the mesh of its group [m]
        self.groups = [Lines(comm, scene, dynamic, numbers, self.begins[numbers]) for numbers in kinds]
        turns, backwards, joints = self.turns
        for group in self.groups:
            group.turns = turns[group.numbers], backwards[group.numbers], joints
        self.growth = _Growths(self.groups) if self.groups[0].growth is not None else None
        self._holders = {number: (g, k) for g in self.groups for k, number in enumerate(g.numbers)}
        self.memory = {f"{name}_{k}": x for k, g in enumerate(self.groups) for name, x in g.memory.items()}

    def holder(self, piece: int) -> tuple[Lines, int]:
        return self._holders[piece]

    def change(self, scene: Scene) -> None:
        self.network = scene.network
        for group in self.groups:
            group.change(scene)

    # -- where the unknowns are ---------------------------------------------------------------------------------------

    @property
    def part(self) -> SimpleNamespace:
        """Place of the unknowns of all groups."""
        parts = [group.part for group in self.groups]
        place = slice(parts[0].offset, parts[-1].slice.stop)
        return SimpleNamespace(parts=parts, offset=place.start, slice=place, size=place.stop - place.start)

    def _nodes(self, get):
        """Join arrays over the nodes of all groups, those of this rank first."""
        found = [(get(group), group.owned_nodes) for group in self.groups]
        return np.concatenate([*(x[:n] for x, n in found), *(x[n:] for x, n in found)])

    node_s = property(lambda self: self._nodes(lambda g: g.node_s))
    node_dofs = property(lambda self: self._nodes(lambda g: g.node_dofs + g.part.offset))
    line_of_node = property(lambda self: self._nodes(lambda g: np.array(g.numbers)[g.line_of_node]))

    def moments(self, u: np.ndarray) -> np.ndarray:
        return self._nodes(lambda group: group.moments(u))

    @property
    def T_dofs(self) -> np.ndarray:
        """Dofs of T of each owned cell; shorter rows are padded by repeating the last one."""
        most = max(group.T_dofs.shape[1] for group in self.groups)
        rows = [g.T_dofs[:, np.minimum(np.arange(most), g.T_dofs.shape[1] - 1)] + g.part.offset for g in self.groups]
        return np.concatenate(rows)

    @cached_property
    def end_dofs(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Dofs of r at s = 0 and s = L of each piece, empty if on another rank."""
        found = [self.holder(k) for k in range(len(self.pieces))]
        return [tuple(dofs + group.part.offset for dofs in group.end_dofs[k]) for group, k in found]

    def end_moments(self, piece: int, end: int) -> np.ndarray:
        group, number = self.holder(piece)
        return group.end_moments(number, end) + group.part.offset

    def force_dofs(self) -> np.ndarray:
        return np.concatenate([group.force_dofs() + group.part.offset for group in self.groups])

    def elimination_keys(self) -> tuple[np.ndarray, list[np.ndarray]]:
        found = [(dofs + group.part.offset, keys) for group in self.groups for dofs, keys in [group.elimination_keys()]]
        dofs = np.concatenate([dofs for dofs, _ in found])
        return dofs, [np.concatenate(parts) for parts in zip(*(keys for _, keys in found), strict=True)]

    # -- numbers ------------------------------------------------------------------------------------------------------

    def smallest_stretch(self, u: np.ndarray) -> float:
        return min(group.smallest_stretch(u) for group in self.groups)

    def one_sided_rows(self, force: float) -> OneSidedRows:
        found = [(group, group.one_sided_rows(force)) for group in self.groups]
        parts = {name: [getattr(one, name) for _, one in found] for name in OneSidedRows.__dataclass_fields__}
        parts["rows"] = [one.rows + group.part.offset for group, one in found]
        if not self.dynamic:
            parts["inertia"] = None
        return OneSidedRows(**{name: x and np.concatenate(x) for name, x in parts.items()})

    @property
    def end_loads(self) -> dict:
        """Constants of the forces on loaded free ends, by the number of the piece."""
        return {group.numbers[k]: load for group in self.groups for k, load in group.end_loads.items()}


class _Growths:
    """Marine growth of all groups, concatenated."""

    weights, at, of_the_water = _joined("weights"), _joined_of("at"), _joined_of("of_the_water")

    def __init__(self, groups: list[Lines]):
        self.groups = [group.growth for group in groups]

    @property
    def factors(self) -> np.ndarray:
        return np.concatenate([growth.factors for growth in self.groups])

    @factors.setter
    def factors(self, values: np.ndarray) -> None:
        ends = np.cumsum([len(growth.factors) for growth in self.groups])
        for growth, part in zip(self.groups, np.split(np.asarray(values), ends[:-1]), strict=True):
            growth.factors = part
