"""Lines of several kinds: those with one pair of elements, strain and strain form are a group, on a mesh of its own.

What reads or moves all lines of a scene finds the same names here as in `Lines`: arrays of all groups one behind the
other, and functions of one piece, by its number in the scene, that ask the group which has it.
"""

from functools import cached_property
from types import SimpleNamespace

import numpy as np

from ..solver.tension_only import OneSidedRows
from .elimination import order_of_pieces
from .layout import laid_out
from .lines import Lines, is_averaged


def lines_of(comm, scene, dynamic):
    """The Lines of a scene, or its LineGroups; None without any."""
    kinds = {}
    for number, piece in enumerate(scene.network.pieces):
        c = piece.section
        kind = c.position_degree, c.tension_degree, is_averaged(c), c.strain_form
        kinds.setdefault(kind, []).append(number)
    if len(kinds) < 2:
        return Lines(comm, scene, dynamic) if kinds else None
    return LineGroups(comm, scene, dynamic, list(kinds.values()))


def _joined(name):
    """Property: this of all groups, one behind the other."""
    return property(lambda self: np.concatenate([getattr(group, name) for group in self.groups]))


def _in_each(name):
    """Method: that of every group."""

    def method(self, *args):
        for group in self.groups:
            getattr(group, name)(*args)

    return method


def _listed(name):
    """Method: what that of every group lists."""
    return lambda self, *args: [found for group in self.groups for found in getattr(group, name)(*args)]


class LineGroups:
    """All lines of a scene; `groups`: the Lines of each kind.  What is not explained here is as in `Lines`."""

    mean_dofs = None
    cell_ends, stretches, one_sided = _joined("cell_ends"), _joined("stretches"), _joined("one_sided")
    owned, turnable = _joined("owned"), _joined("turnable")
    let_go, stop, scale_current = _in_each("let_go"), _in_each("stop"), _in_each("scale_current")
    follow_water, publish_points, hold = _in_each("follow_water"), _in_each("publish_points"), _in_each("hold")
    evolutions, blocks = _listed("evolutions"), _listed("blocks")
    scene = property(lambda self: self.groups[0].scene)
    pieces = property(lambda self: self.network.pieces)
    sections = property(lambda self: [piece.section for piece in self.pieces])
    section = property(lambda self: self.pieces[0].section)
    elastic = property(lambda self: any(group.elastic for group in self.groups))
    longest = property(lambda self: max(group.longest for group in self.groups))
    owned_nodes = property(lambda self: sum(group.owned_nodes for group in self.groups))

    def __init__(self, comm, scene, dynamic, kinds):
        self.comm, self.dynamic, self.network = comm, dynamic, scene.network
        self.begins = laid_out(self.sections)  #: where each piece begins on the mesh of its group [m]
        self.groups = [Lines(comm, scene, dynamic, numbers, self.begins[numbers]) for numbers in kinds]
        self.turns = turns, backwards, joints = order_of_pieces(self.network.pieces)
        for group in self.groups:
            group.turns = turns[group.numbers], backwards[group.numbers], joints
        self.bed = _Beds(self) if scene.seabed else None
        self.growth = _Growths(self.groups) if any(group.growth for group in self.groups) else None
        self.parting = _Partings(self.groups) if any(group.parting for group in self.groups) else None
        self._holders = {number: (g, k) for g in self.groups for k, number in enumerate(g.numbers)}
        self.memory = {f"{name}_{k}": x for k, g in enumerate(self.groups) for name, x in g.memory.items()}

    def holder(self, piece):
        """(the Lines that have a piece of the scene, its number there)."""
        return self._holders[piece]

    def change(self, scene):
        """Take the numbers of another scene of the same structure."""
        self.network = scene.network
        for group in self.groups:
            group.change(scene)

    def clock(self, time, u):
        """Functions that bring the sea, and in u the ends that are held, to time[0]."""
        return [function for group in self.groups for function in group.clock(time, u[group.part.slice])]

    def when_accepted(self, time, u):
        """Functions that are called when a step to time[0] was taken; whether the equations are others now."""
        return [function for group in self.groups for function in group.when_accepted(time, u[group.part.slice])]

    def begin(self, u):
        """Memory as at the start of a run."""
        for group in self.groups:
            group.begin(u[group.part.slice])

    def grow_as(self, other):
        """Take the marine growth of other LineGroups of the same elements."""
        for group, one in zip(self.groups, other.groups, strict=True):
            group.grow_as(one)

    # -- where the unknowns are ---------------------------------------------------------------------------------------

    @property
    def part(self):
        """Where the unknowns of all groups are."""
        parts = [group.part for group in self.groups]
        place = slice(parts[0].offset, parts[-1].slice.stop)
        return SimpleNamespace(parts=parts, offset=place.start, slice=place, size=place.stop - place.start)

    def _nodes(self, get):
        """Of the nodes of all groups, those of this rank first."""
        found = [(get(group), group.owned_nodes) for group in self.groups]
        return np.concatenate([*(x[:n] for x, n in found), *(x[n:] for x, n in found)])

    node_s = property(lambda self: self._nodes(lambda g: g.node_s))
    node_dofs = property(lambda self: self._nodes(lambda g: g.node_dofs + g.part.offset))
    line_of_node = property(lambda self: self._nodes(lambda g: np.array(g.numbers)[g.line_of_node]))
    line_of_cell = property(lambda self: np.concatenate([np.array(g.numbers)[g.line_of_cell] for g in self.groups]))

    @property
    def T_dofs(self):
        """Of each owned cell; a row of fewer tensions than others repeats its last one."""
        most = max(group.T_dofs.shape[1] for group in self.groups)
        rows = [g.T_dofs[:, np.minimum(np.arange(most), g.T_dofs.shape[1] - 1)] + g.part.offset for g in self.groups]
        return np.concatenate(rows)

    @cached_property
    def end_dofs(self):
        """Dofs of r at s = 0 and s = L of each piece, empty where another rank has them."""
        found = [self.holder(k) for k in range(len(self.pieces))]
        return [tuple(dofs + group.part.offset for dofs in group.end_dofs[k]) for group, k in found]

    def top_dofs(self, line=0):
        """Dofs of r at s = L."""
        return self.end_dofs[line][1]

    def held_ends(self):
        """(piece, end, its dofs) of all ends whose position is given."""
        ends = [(k, i) for k, piece in enumerate(self.pieces) for i, end in enumerate(piece.ends) if end.held]
        return [(k, i, self.end_dofs[k][i]) for k, i in ends]

    def line_at(self, s):
        """Number of the piece at mesh coordinates."""
        return np.searchsorted(self.begins, s + max(g.slip for g in self.groups), side="right") - 1

    def owns_end(self, piece, end):
        """Whether the cell at an end is one of this rank's."""
        group, number = self.holder(piece)
        return group.owns_end(number, end)

    def meetings(self):
        """Name of a free joint -> [(piece, end)] of all that meet there."""
        return self.network.meetings()

    def places(self):
        """Mesh coordinates of the nodes, in the order of their dofs [m]."""
        return np.concatenate([group.places() for group in self.groups])

    def force_dofs(self):
        """Local unknowns that are tensions."""
        return np.concatenate([group.force_dofs() + group.part.offset for group in self.groups])

    def turn_of(self, piece):
        """Of a piece in the elimination."""
        return self.turns[0][piece]

    def elimination_order(self):
        """(free owned dofs, how early each), as of `Lines`, the groups' pieces each in its turn."""
        found = [(dofs + group.part.offset, keys) for group in self.groups for dofs, keys in [group.elimination_keys()]]
        dofs = np.concatenate([dofs for dofs, _ in found])
        keys = [np.concatenate(parts) for parts in zip(*(keys for _, keys in found), strict=True)]
        order = np.lexsort((dofs, *keys))
        return dofs[order], keys[-1][order]

    # -- numbers ------------------------------------------------------------------------------------------------------

    def weight_of(self, line):
        """Weight in water per unstretched length of a piece [N/m]."""
        group, number = self.holder(line)
        return group.weight_of(number)

    def top_position(self, t, line=0):
        """r_bnd(t) of a fixed or prescribed top [m]."""
        group, number = self.holder(line)
        return group.top_position(t, number)

    def set_shape(self, u, position, tension, line=0):
        """Interpolate position(s) -> (n, 3) and tension(s) -> (n,) of a piece into the local unknowns u."""
        group, number = self.holder(line)
        group.set_shape(u[group.part.slice], position, tension, number)

    def anchor_tension(self, u, line=0):
        """T_h(0) of a piece [N], on the rank that owns its first cell; nan elsewhere."""
        group, number = self.holder(line)
        return group.anchor_tension(u[group.part.slice], number)

    def mean_tension(self, u):
        """Average of T on each owned cell [N]."""
        return np.concatenate([group.mean_tension(u[group.part.slice]) for group in self.groups])

    def smallest_stretch(self, u):
        """Smallest 1 + T/EA of the owned cells that may be turned inside out."""
        return min(group.smallest_stretch(u[group.part.slice]) for group in self.groups)

    def one_sided_rows(self, force):
        """Rows of the tension for the tension-only law; `force` is a typical tension [N]."""
        found = [(group, group.one_sided_rows(force)) for group in self.groups]
        parts = {name: [getattr(one, name) for _, one in found] for name in OneSidedRows.__dataclass_fields__}
        parts["rows"] = [one.rows + group.part.offset for group, one in found]
        if not self.dynamic:
            parts["inertia"] = None
        return OneSidedRows(**{name: x and np.concatenate(x) for name, x in parts.items()})

    @property
    def end_loads(self):
        """Constants of the forces on the free ends that are pulled, by the number of the piece."""
        return {group.numbers[k]: load for group in self.groups for k, load in group.end_loads.items()}


class _Beds:
    """The sea bed under all groups."""

    def __init__(self, lines):
        self.lines, first = lines, lines.groups[0].bed
        self.normal, self.gap = first.normal, first.gap

    def rub(self):
        """Let friction act in statics too."""
        for group in self.lines.groups:
            group.bed.rub()

    def accept(self, u):
        """A step was taken: where friction pulls more than it can, it slides after the line."""
        for group in self.lines.groups:
            group.bed.accept(u[group.part.slice])

    def lying(self, u, line=0):
        """What of a piece lies, on every rank."""
        group, number = self.lines.holder(line)
        return group.bed.lying(u[group.part.slice], number)


class _Growths:
    """Marine growth of all groups, one behind the other; a group without any has none of it."""

    def __init__(self, groups):
        self.groups = groups

    def _of(self, get, none):
        """get(group) of those that grow; `none` of each element of the others."""
        blank = [np.full((len(group.line_of_cell), *np.shape(none)), none) for group in self.groups]
        found = zip(blank, self.groups, strict=True)
        return np.concatenate([one if group.growth is None else get(group) for one, group in found])

    @property
    def factors(self):
        """(diameter, mass) of each owned element."""
        return self._of(lambda group: group.growth.factors, [1.0, 1.0])

    @factors.setter
    def factors(self, values):
        ends = np.cumsum([len(group.line_of_cell) for group in self.groups])
        for group, part in zip(self.groups, np.split(np.asarray(values), ends[:-1]), strict=True):
            if group.growth is not None:
                group.growth.factors = part

    def at(self, u):
        """Factors that belong to the positions in the local unknowns u."""
        return self._of(lambda group: group.growth.at(u[group.part.slice]), [1.0, 1.0])

    def of_the_water(self):
        """Means over the depth of the water."""
        return self._of(lambda group: group.growth.of_the_water(), [1.0, 1.0])

    @property
    def weights(self):
        """Weight in water that it adds to each owned element [N]."""
        return self._of(lambda group: group.growth.weights, 0.0)


class _Partings:
    """Elements that have parted, of all groups."""

    def __init__(self, groups):
        self.groups = groups

    @property
    def of_elements(self):
        """When this rank's elements have parted [s]; nan for those that are whole."""
        whole = [np.full(len(group.line_of_cell), np.nan) for group in self.groups]
        found = zip(whole, self.groups, strict=True)
        return np.concatenate([none if g.parting is None else g.parting.of_elements for none, g in found])
