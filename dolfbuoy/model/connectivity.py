"""Numbering of the unknowns of a Problem: elimination order, joints tied by one index, ghosts on other ranks."""

from typing import TYPE_CHECKING

import numpy as np
from dolfinx import fem

if TYPE_CHECKING:
    from .problem import Problem


class Joining:
    """Order, ghosts and ties of the unknowns of a `Problem` on this rank, for `solver.numbering.Numbering`.

    All ends of lines at a free joint, and its body if it has one, share one global index, that of the first end; so do
    the moments of two lines that are continued there without a kink.  If several of them are on one rank, one
    represents the others there.
    """

    def __init__(self, problem: "Problem"):
        self.comm, self.lines, self.bodies = problem.comm, problem.lines, problem.bodies
        self.attachments, self.buoys, self.take_offs = problem.attachments, problem.buoys, problem.take_offs
        #: Local dofs (3,) of the members of each joint, None for members on other ranks; `here`: without these.
        self.groups = []
        for name, ends in problem.network.meetings().items() if self.lines else ():
            members = [self.lines.end_dofs[piece][end] for piece, end in ends]
            members = [dofs if len(dofs) else None for dofs in members]
            if self.bodies and name in self.bodies.names:
                members.append(self.bodies.part.offset + self.bodies.dofs[self.bodies.names.index(name)])
            members += [dofs for device in self.take_offs for dofs in device.at_joint(name)]
            self.groups.append(members)
            if name in problem.network.welds:
                moments = [self.lines.end_moments(piece, end) for piece, end in ends]
                self.groups.append([dofs if len(dofs) else None for dofs in moments])
        self.here = [[dofs for dofs in members if dofs is not None] for members in self.groups]

    def numbers(self) -> tuple:
        """(order, its keys, ghosts or None, ties): arguments of a Numbering."""
        tied = [(dofs, members[0]) for members in self.here for dofs in members[1:]]
        ties = tuple(np.concatenate([np.zeros(0, int), *(pair[k] for pair in tied)]) for k in (0, 1))
        order, keys = self._order()
        if self.comm.size == 1 or self.lines is None:
            return order, keys, None, ties
        return order, keys, self._ghosts(order, ties), ties

    def _order(self):
        """Free owned unknowns in elimination order, and its sort keys (3, n), the last one first, of all ranks.

        Lines and joints come first, each line followed by its attachment to a buoy; then take-offs, and last the buoys.
        A single line has its attachment after the buoy.
        """
        free = [buoy.part.slice for buoy in self.buoys.values() if buoy.motion is None]
        parts = [(np.arange(place.start, place.stop), (0, 0, np.inf)) for place in free]
        parts += [(device.free(), (0, -1, np.inf)) for device in self.take_offs]
        for a in self.attachments:
            if a.rank == self.comm.rank:
                alone = len(self.attachments) == 1
                turn = (0, 1, np.inf) if alone else (0, np.inf, self.lines.turns[0][a.piece] + 0.25)
                parts.append((np.arange(a.whole.start, a.whole.stop), turn))
        if self.lines is not None:
            order, keys = self.lines.elimination_order()
            followers = [dofs for members in self.groups for dofs in members[1:] if dofs is not None]
            free = ~np.isin(order, np.concatenate([np.zeros(0, int), *followers]))
            parts.insert(0, (order[free], keys[:, free]))
        dofs = np.concatenate([np.zeros(0, int), *(dofs for dofs, _ in parts)])
        spread = [np.broadcast_to(np.reshape(keys, (3, -1)), (3, len(dofs))) for dofs, keys in parts]
        keys = np.concatenate([np.zeros((3, 0)), *spread], axis=1)
        order = np.lexsort(keys)
        return dofs[order], keys[:, order]

    def _ghosts(self, order, ties):
        """(local, global) numbers of unknowns owned by other ranks."""
        first = self.comm.scan(len(order)) - len(order)
        last = [self.lines.part, *([self.bodies.part] if self.bodies else []), *self.take_offs][-1]
        number = np.full(last.slice.stop, -1, dtype=np.int64)
        mine = self._owned(order)
        number[order[mine]] = first + np.flatnonzero(mine)
        for lines in self.lines.groups:
            shared, place = fem.Function(lines.space), lines.part.slice
            shared.x.array[:] = number[place]
            shared.x.scatter_forward()
            number[place] = np.where(lines.owned, number[place], shared.x.array.astype(np.int64))
        known = np.full((len(self.groups), 3), -1, dtype=np.int64)
        for k, members in enumerate(self.groups):
            if members[0] is not None and self._owned(members[0][:1]).all():
                known[k] = number[members[0]]
        known = np.max(self.comm.allgather(known), axis=0)  # each from the rank that owns the first end there
        for here, numbers in zip(self.here, known, strict=True):
            if here:
                number[here[0]] = numbers
        elsewhere = np.setdiff1d(np.arange(len(number)), np.concatenate([order, ties[0]]))
        local, numbers = self._attachments_elsewhere(order, first)
        return np.concatenate([elsewhere, local]), np.concatenate([number[elsewhere], numbers])

    def _owned(self, places):
        """Mask of these local unknowns: those of the lines that this rank owns."""
        own = self.lines.owned
        return (places < len(own)) & own[np.minimum(places, len(own) - 1)]

    def _attachments_elsewhere(self, order, first):
        """(local, global) numbers of attachments whose line ends here and whose buoy is on another rank."""
        place = np.full(max((a.whole.stop for a in self.attachments), default=0), -1, dtype=np.int64)
        inside = order < len(place)
        place[order[inside]] = first + np.flatnonzero(inside)
        local, numbers = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
        for attachment in self.attachments:
            here = attachment.rank == self.comm.rank
            known = self.comm.bcast(place[attachment.whole] if here else None, root=attachment.rank)
            if not here and self.lines.owns_end(attachment.piece, attachment.end):
                local.append(np.arange(attachment.whole.start, attachment.whole.stop))
                numbers.append(known)
        return np.concatenate(local), np.concatenate(numbers)
