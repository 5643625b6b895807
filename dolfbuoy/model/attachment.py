"""A line's end on a body: six unknowns (r_O, T_O) shared by both meshes, with Eqs. (9), (29); six more for an end whose
direction turns with the body, this direction and the moment of the end."""

from typing import TYPE_CHECKING

import numpy as np
import ufl
from dolfinx import fem

from ..forms import bending, coupling
from ..forms import buoy as body
from ..forms.kinds import Expr
from ..forms.rotation import rotation_matrix
from ..solver import compat
from ..solver.unknowns import Block, Fields, Part

if TYPE_CHECKING:
    from ..scene import Scene
    from ..scene.cable import EndDirection
    from .buoy import Buoy
    from .lines import Lines

FIELDS = Fields(point=3, force=3)
CLAMPED = Fields(direction=3, moment=3)


class Attachment:
    """An end of a line at a point of a body.

    lines: the Lines; piece, end: its piece and end, 0 at s = 0 and 1 at s = L.  rank: owner of the body's unknowns and
    of these six.  buoy: the Buoy, None on other ranks; offset: body vector from its C to the point [m], a UFL constant
    on its mesh.  clamp: the Clamp if the end has a direction.
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
        self.clamp = Clamp(self, number) if lines.network.pieces[piece].ends[end].clamp else None

    def number(self, place: int) -> list[Part]:
        """Take the unknowns of this rank from `place` on, 6, or 12 with a clamp; returns all parts."""
        self.line_part = Part("mooring", self._on_line, place)
        if self.buoy:
            self.body_part = Part("mooring on the axis", self._on_body, place)
        further = self.clamp.number(place + FIELDS.size) if self.clamp else []
        return [part for part in (self.line_part, self.body_part, *further) if part]

    @property
    def slice(self) -> slice:
        """Place among the local unknowns."""
        return self.line_part.slice

    @property
    def whole(self) -> slice:
        """Place of all its unknowns, including those of a clamp."""
        return slice(self.slice.start, (self.clamp or self).slice.stop)

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
        torque = body.point_torque(state.quaternion, self.offset, T_O)
        return T_O, torque if self.clamp is None else torque + self.clamp.torque(state)

    def link(self, state: body.Body) -> Expr:
        """Eq. (9): r_O is a point of the body."""
        r_O, test = FIELDS.split(self._on_body).point, FIELDS.split(self.body_part.test).point
        return coupling.rigid_link(r_O, state.position, state.quaternion, self.offset, test)

    # -- numbers -------------------------------------------------------------------------------------------------------

    def dofs(self) -> tuple[np.ndarray, np.ndarray]:
        """(point, force): numbers of the local unknowns r_O and T_O."""
        return FIELDS.of(np.arange(self.slice.start, self.slice.stop))

    def blocks(self, reach: float, force: float, mass: float) -> list[Block]:
        """Blocks of the six unknowns on the body's rank; arguments: typical length [m], force [N] and mass [kg]."""
        point, pull = self.dofs()
        return [
            Block("mooring point r_O", point, reach, reach, unit="m"),
            Block("mooring force T_O", pull, force, reach, rounding=mass * reach, unit="N"),
            *(self.clamp.blocks() if self.clamp else []),
        ]


class Clamp:
    """Direction of a line's end on a body: t_b = R(q_4) t_0 and the moment m of the end, shared by both meshes."""

    def __init__(self, attachment: Attachment, number: int):
        lines, buoy, self.end = attachment.lines, attachment.buoy, attachment.end
        self._lines, self._ds = lines, lines.end_measure(number, self.end)
        self._on_line = fem.Function(compat.real_space(lines.mesh, CLAMPED.size))
        self._on_body = fem.Function(compat.real_space(buoy.mesh, CLAMPED.size)) if buoy else None
        self.line_part = self.body_part = None
        piece, end = attachment.piece, attachment.end

        def given(scene: "Scene") -> "EndDirection":
            return scene.network.pieces[piece].ends[end].clamp

        self.sprung = sprung = given(lines.scene).rotational_stiffness is not None
        spring = lambda scene, _: given(scene).rotational_stiffness  # noqa: E731
        self._spring_of_line = lines.constants.constant(spring) if sprung else None
        self._spring_of_body = buoy.constant(spring) if sprung and buoy else None
        self.direction = buoy.constant(lambda scene, _: np.array(given(scene).unit)) if buoy else None
        section = lines.network.pieces[number].section
        beta = lambda scene, _: scene.network.pieces[piece].section.bending_damping  # noqa: E731
        #: With bending damping the direction t_0 on the line's mesh includes beta times its rate.
        self._damping = buoy.constant(beta) if buoy and buoy.dynamic and section.bending_damping else None

    def number(self, place: int) -> list[Part | None]:
        """Take the unknowns `place` ... `place` + 6 of this rank."""
        self.line_part = Part("clamp", self._on_line, place)
        if self._on_body is not None:
            self.body_part = Part("clamp on the axis", self._on_body, place)
        return [self.line_part, self.body_part]

    @property
    def slice(self) -> slice:
        """Place among the local unknowns."""
        return self.line_part.slice

    def end_direction(self, m: Expr, p: Expr) -> ufl.Form:
        """The term of this end in the equation for m."""
        t_b = bending.direction(CLAMPED.split(self._on_line).direction, m, self._spring_of_line, self.end)
        return bending.end_direction(t_b, self._lines.typical_EI, p, self.end) * self._ds

    def moment_equation(self, m: Expr) -> ufl.Form:
        """Equality of the shared moment and m at the end."""
        moment, test = CLAMPED.split(self._on_line).moment, CLAMPED.split(self.line_part.test).moment
        return ufl.inner(moment - m, test) * self._ds

    def _turned(self, state: body.Body) -> Expr:
        """R(q_4) t_0."""
        return rotation_matrix(state.quaternion) * self.direction

    def torque(self, state: body.Body) -> Expr:
        """Torque of the end's moment on the body [N m]."""
        known = CLAMPED.split(self._on_body)
        t_0 = known.direction if self._damping is None else self._turned(state)
        t_b = bending.direction(t_0, known.moment, self._spring_of_body, self.end)
        return bending.end_torque(known.moment, t_b, self.end)

    def torque_of(self, u: np.ndarray) -> np.ndarray:
        """Value of that torque from the local unknowns, on the body's rank [N m]."""
        known = CLAMPED.of(u[self.slice])
        t_b = known.direction
        if self._spring_of_body is not None:
            t_b = known.direction + (1 - 2 * self.end) * known.moment / self._spring_of_body.value
            t_b = t_b / np.linalg.norm(t_b)
        return (2 * self.end - 1) * np.cross(known.moment, t_b)

    def energy(self) -> tuple[Expr, ufl.Measure]:
        """(energy of the spring [J] as UFL, measure of the end)."""
        m, t_0 = ufl.split(self._lines.w)[-1], CLAMPED.split(self._on_line).direction
        return bending.spring_energy(t_0, m, self._spring_of_line, self.end), self._ds

    def link(self, state: body.Body) -> Expr:
        """Condition that the direction turns with the body."""
        test = CLAMPED.split(self.body_part.test).direction
        turned = self._turned(state)
        if self._damping is not None and state.motion is not None:
            turned += self._damping * ufl.cross(state.motion.angular_velocity, turned)
        return ufl.inner(CLAMPED.split(self._on_body).direction - turned, test)

    def dofs(self) -> tuple[np.ndarray, np.ndarray]:
        """(direction, moment): local unknowns."""
        return CLAMPED.of(np.arange(self.slice.start, self.slice.stop))

    def blocks(self) -> list[Block]:
        """Blocks of its unknowns on the body's rank."""
        direction, moment = self.dofs()
        size = float(self._lines.typical_EI.value) / self._lines.longest
        return [
            Block("direction of an end", direction, 1.0, 1.0),
            Block("moment of an end", moment, size, size, unit="N m"),
        ]
