"""A line's end on a body: six numbers (r_O, T_O) that both meshes know, and equations (9), (29) between them."""

from typing import TYPE_CHECKING

import numpy as np
import ufl
from dolfinx import fem

from ..forms import buoy as body
from ..forms import coupling
from ..forms.kinds import Expr
from ..solver import compat
from ..solver.fields import Fields
from ..solver.unknowns import Block, Part

if TYPE_CHECKING:
    from .buoy import Buoy
    from .lines import Lines

FIELDS = Fields(point=3, force=3)


class Attachment:
    """An end of a line at a point of a body.

    lines: the Lines; piece, end: which one, 0 at s = 0 and 1 at s = L.  rank: where the body's unknowns are, these six
    among them.  buoy: the Buoy, None on other ranks; offset: body vector from its C to the point [m], a UFL constant on
    its mesh.
    """

    def __init__(
        self, lines: "Lines", piece: int, end: int, rank: int, buoy: "Buoy | None" = None, offset: Expr | None = None
    ):
        self.lines, number = lines.holder(piece)
        self.piece, self.end, self.rank = piece, end, rank
        self.buoy, self.offset = buoy, offset
        self._on_line = fem.Function(self.lines.at_ends)
        self._on_body = fem.Function(compat.real_space(buoy.mesh, FIELDS.size)) if buoy else None
        self._ds = self.lines.end_measure(number, end)
        self.line_part = self.body_part = None

    def number(self, place: int) -> None:
        """Take the unknowns `place` ... `place` + 6 of this rank."""
        self.line_part = Part("mooring", self._on_line, place)
        if self.buoy:
            self.body_part = Part("mooring on the axis", self._on_body, place)

    @property
    def slice(self) -> slice:
        """Place among the local unknowns."""
        return self.line_part.slice

    def of(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(point, force): r_O [m] and T_O [N] among the local unknowns."""
        return FIELDS.of(u[self.slice])

    # -- on the line's mesh --------------------------------------------------------------------------------------------

    def end_force(self, v: Expr) -> ufl.Form:
        """The last term of (11)_1, with T_bnd = -T_O, Eq. (29)_2."""
        return coupling.end_force(-FIELDS.split(self._on_line).force, v) * self._ds

    def position_equation(self, r: Expr) -> ufl.Form:
        """Eq. (29)_1: r = r_O at the end."""
        r_O, test = FIELDS.split(self._on_line).point, FIELDS.split(self.line_part.test).force
        return coupling.attachment(r, r_O, test) * self._ds

    # -- on the body's mesh --------------------------------------------------------------------------------------------

    def load(self, state: body.Body) -> tuple[Expr, Expr]:
        """(force, torque about C) of the line on the body; state: a forms.buoy.Body."""
        T_O = FIELDS.split(self._on_body).force
        return T_O, body.point_torque(state.quaternion, self.offset, T_O)

    def link(self, state: body.Body) -> Expr:
        """Eq. (9): r_O is a point of the body."""
        r_O, test = FIELDS.split(self._on_body).point, FIELDS.split(self.body_part.test).point
        return coupling.rigid_link(r_O, state.position, state.quaternion, self.offset, test)

    # -- numbers -------------------------------------------------------------------------------------------------------

    def dofs(self) -> tuple[np.ndarray, np.ndarray]:
        """(point, force): local unknowns that are r_O and T_O."""
        return FIELDS.of(np.arange(self.slice.start, self.slice.stop))

    def blocks(self, reach: float, force: float, mass: float) -> list[Block]:
        """Blocks of the six numbers on the body's rank; typical length [m], force [N] and mass [kg]."""
        point, pull = self.dofs()
        return [
            Block("mooring point r_O", point, reach, reach, unit="m"),
            Block("mooring force T_O", pull, force, reach, rounding=mass * reach, unit="N"),
        ]
