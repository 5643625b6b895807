"""The sea bed under the lines: how hard it is, where their friction holds on, and what lies on it."""

import math
from typing import NamedTuple

import numpy as np
import ufl
from dolfinx import fem

from ..forms import seabed as form
from ..solver import compat
from . import effects
from .material import weight_per_length


class Grip(NamedTuple):
    """Numbers of the contact of a metre of a line, or of a body (`forms.seabed.Contact`)."""

    stiffness: float  #: k [N/m]
    damping: float  #: c [N s/m]
    sag: float  #: delta [m]
    stick: float  #: k_t [N/m]


class Lying(NamedTuple):
    """What of a line lies on the bed."""

    length: float  #: unstretched [m]
    s: float  #: arc length at which it leaves the bed towards s = L [m]; -inf if nothing lies
    touchdown: np.ndarray  #: that point [m]; nan if nothing lies
    sag: float  #: deepest penetration [m]
    first: float = np.inf  #: arc length at which it leaves the bed towards s = 0 [m]; inf if nothing lies
    foot: np.ndarray = np.full(3, np.nan)  #: that point [m]; nan if nothing lies


def plane(scene) -> tuple[np.ndarray, float]:
    """(n, d) of the bed n . x = d, n upwards."""
    a, b = scene.seabed.slope
    normal = np.array([-a, -b, 1.0]) / math.sqrt(1 + a * a + b * b)
    return normal, -scene.sea.depth * float(normal[2])


def height_of_bed(scene, points) -> np.ndarray:
    """z of the bed [m] under points (..., 3), or (..., 2), of a scene with a sea."""
    slope = scene.seabed.slope if scene.seabed else (0.0, 0.0)
    return np.asarray(points, dtype=float)[..., :2] @ slope - scene.sea.depth


def largest_sag(scene) -> float:
    """How deep the heaviest line or body may sink under its own weight [m]: it costs 1.2 sag/depth of a tension."""
    return min(1e-4 * scene.sea.depth, 0.01)


def stick_length(scene) -> float:
    """Way on which friction builds up [m]."""
    return scene.seabed.stick_length or min(1e-3 * scene.sea.depth, 0.05)


def rubs(scene, dynamic) -> bool:
    """Whether there is friction: in statics only where lines are taken as pulled."""
    return scene.seabed.friction > 0 and (dynamic or scene.seabed.start == "pulled")


def hardness(scene, sections) -> float:
    """k_b [Pa/m]; sections: of all lines, of which the heaviest says how hard the bed is if the scene does not."""
    if scene.seabed.stiffness is not None:
        return scene.seabed.stiffness
    return max(_load(scene, c) / c.diameter for c in sections) / largest_sag(scene)


def grip_of_line(scene, section, k_b) -> Grip:
    """Of a line on a bed of hardness k_b."""
    return _grip(scene, _load(scene, section), section.line_density, k_b * section.diameter)


def grip_of_body(scene, mass, volume) -> Grip:
    """Of a body at a joint, with its mass [kg] and volume [m^3]."""
    weight = max(abs(mass - scene.sea.density * volume), 1e-3 * mass) * scene.gravity
    return _grip(scene, weight, mass, weight / largest_sag(scene))


def _load(scene, section):
    """What a metre of a line presses with [N/m]; not nothing, for what hardly sinks or floats."""
    return max(abs(weight_per_length(scene, section)), 1e-3 * section.line_density * scene.gravity)


def _grip(scene, weight, mass, stiffness):
    bed = scene.seabed
    damping = 2 * bed.damping_ratio * math.sqrt(stiffness * mass)
    return Grip(stiffness, damping, weight / stiffness, bed.friction * weight / stick_length(scene))


def contact(normal, level, grip, x, x_t=None, held=None) -> form.Contact:
    """`forms.seabed.Contact` at x [m] with velocity x_t; grip: a Grip of UFL scalars; held: r_a, None without friction.

    For a joint's body: p and f_t of it are forces [N] with the Grip of `grip_of_body`.
    """
    slide = None if held is None else x - held
    speed = None if x_t is None else ufl.dot(normal, x_t)
    return form.Contact(normal, form.gap(normal, level, x), *grip[:3], speed, grip.stick, slide)


class Points:
    """Points of the owned cells of lines: those of the quadrature of a degree; with_nodes: and their nodes, in order.

    nodes: of each cell.  s: mesh coordinates, shape (cells, points).  line: number of the line of each cell.  presses:
    mask of the points of the quadrature, shape (points,).
    """

    def __init__(self, lines, positions, degree, with_nodes=False):
        self.nodes = compat.cell_dofs(positions)
        ends = lines.node_s[self.nodes]  # the first two nodes of a cell are its ends
        first, size = ends[:, :1], ends[:, 1:2] - ends[:, :1]
        nodes, (xi, _) = (ends[0] - first[0]) / size[0], compat.interval_quadrature(degree)
        self.presses = np.ones(len(xi), bool)
        if with_nodes:
            xi = np.concatenate([nodes, xi])
            order = np.argsort(xi)
            xi, self.presses = xi[order], order >= len(nodes)
        self.s, self.line = first + xi * size, lines.line_of_cell
        power = np.arange(ends.shape[1])
        self._basis = xi[:, None] ** power @ np.linalg.inv(nodes[:, None] ** power)

    def of(self, values, nodes=None):
        """Values at the points of all cells, or those with these nodes, shape (cells, points, 3), of values (n, 3)."""
        return self._basis @ values[self.nodes if nodes is None else nodes]

    def scalars(self, values, nodes):
        """Values at the points of the cells with these nodes, shape (cells, points), of values (n,)."""
        return values[nodes] @ self._basis.T


class Seabed:
    """Contact of `Lines` with the bed.

    number, per_line: make UFL numbers, as `numbers.Numbers.constant` and for each line; positions: the space of r;
    degree: of the quadrature.  `held`: r_a, the places where friction holds on to the points of the quadrature, a
    Function; None without friction, and in statics unless the line is taken as pulled.
    """

    def __init__(self, lines, number, per_line, positions, degree):
        self.lines, self._known = lines, None
        self.normal, self.level = (number(lambda scene, _, i=i: plane(scene)[i]) for i in (0, 1))
        self.grip = Grip(*(per_line(self._part(name)) for name in Grip._fields))
        self.friction = number(lambda scene, _: scene.seabed.friction if lines.dynamic else 0.0)
        self.held = self.points = None
        if rubs(lines.scene, lines.dynamic):
            self.points = Points(lines, positions, degree)
            element = compat.quadrature_element(lines.mesh, degree, 3)
            self.held = fem.Function(compat.function_space(lines.mesh, element))
            self._place = compat.cell_dofs(self.held.function_space)
        self.memory = {} if self.held is None else {"bed_holds": self.held.x.array}
        terms = effects.called_by(lines.scene, "bed")
        self.terms = terms if self.held is not None else [e for e in terms if e.bed is not form.friction]
        self.soundings = Points(lines, positions, degree, with_nodes=True)
        #: Nodes of each line, which of these its own cells have, from its start on, and where their soundings are.
        self._along = [self._sounded(k) for k in range(len(lines.pieces))]

    def _sounded(self, line):
        nodes, cells, at = self.lines.nodes_of[line], self.lines.cells_of[line], self.soundings
        cells = cells[np.argsort(at.s[cells, 0])]
        return nodes, np.searchsorted(nodes, at.nodes[cells]), at.s[cells]

    def _part(self, name):
        return lambda section: getattr(grip_of_line(self.lines.scene, section, self._hardness()), name)

    def _hardness(self):
        """Of the bed of the present scene."""
        scene = self.lines.scene
        if self._known is None or self._known[0] is not scene:
            self._known, self._cells = (scene, hardness(scene, [piece.section for piece in scene.network.pieces])), None
        return self._known[1]

    # -- forms ---------------------------------------------------------------------------------------------------------

    def contact(self) -> form.Contact:
        """At the points of the lines."""
        r, _, _, r_t, _ = self.lines.kinematics()
        return contact(self.normal, self.level, self.grip, r, r_t, self.held)

    def forces(self):
        """[(effect, force per unstretched length [N/m] as UFL)]."""
        at = self.contact()
        return [(effect, effect.bed(self.friction, at)) for effect in self.terms]

    def powers(self):
        """[(account, energy [J/m] or power [W/m] per unstretched length)] for balances."""
        at, (_, _, _, r_t, _) = self.contact(), self.lines.kinematics()
        power = {form.support: form.damping_power(at)}
        if self.held is not None:
            power[form.friction] = ufl.inner(form.friction(self.friction, at), r_t)
        return [("elastic", form.spring_energy(at)), *((effect.account, power[effect.bed]) for effect in self.terms)]

    # -- memory --------------------------------------------------------------------------------------------------------

    @property
    def holds(self):
        """Places (cells, points, 3) where friction holds on."""
        return self.held.x.array.reshape(-1, 3)[self._place]

    def hold(self, places):
        """Let it hold on at others."""
        self.held.x.array.reshape(-1, 3)[self._place] = places

    def begin(self, u):
        """Friction holds on where the line is, and does not pull yet."""
        if self.held is not None:
            self.hold(self.points.of(u[self.lines.node_dofs]))

    def accept(self, u):
        """A step was taken: where friction pulls more than it can, it slides after the line."""
        if self.held is None:
            return
        lines, n, mu = self.lines, self.normal.value, float(self.friction.value)
        r = self.points.of(u[lines.node_dofs])
        speed = 0.0
        if lines.dynamic:
            speed = (lines.gamma_v.value * r + self.points.of(lines.history_v.x.array[lines.node_dofs])) @ n
        k, c, sag, stick = self._grips
        below = np.maximum(-self.gap(r), 0.0)
        p = np.maximum(k * below - c * np.minimum(below / sag, 1.0) * speed, 0.0)
        slide = r - self.holds
        slide -= (slide @ n)[..., None] * n
        pull = stick * np.sqrt((slide * slide).sum(axis=-1))
        share = np.minimum(1.0, mu * p / np.maximum(pull, 1e-300))
        self.hold(r - share[..., None] * slide)

    @property
    def _grips(self):
        """Numbers of the contact in every cell, arrays (cells, 1)."""
        hard = self._hardness()
        if self._cells is None:
            grips = np.array([grip_of_line(self.lines.scene, section, hard) for section in self.lines.sections])
            self._cells = grips[self.points.line].T[:, :, None]
        return self._cells

    def rub(self):
        """Let friction act in statics too."""
        self.friction.value = self.lines.scene.seabed.friction

    # -- numbers -------------------------------------------------------------------------------------------------------

    def gap(self, x):
        """Distance of points (..., 3) from the bed [m]."""
        return x @ self.normal.value - self.level.value

    def lying(self, u, line=0) -> Lying:
        """What of a line lies, on every rank.

        All lies between two points of the quadrature that touch the bed, if they are of one element or of neighbours:
        what rises there is the element's wave, not the line.  Elsewhere the gap is linear from sounding to sounding.
        """
        s, g, position = self._sound(u, line)
        bridged = _bridged((g < 0) & self.soundings.presses)
        s, g = s.ravel(), g.ravel()
        share = np.where(bridged, 1.0, _share_below(g[:-1], g[1:]))
        length, sag, lies = float(share @ np.diff(s)), max(-float(g.min()), 0.0), np.flatnonzero(share)
        if not len(lies):
            return Lying(length, -np.inf, np.full(3, np.nan), sag)
        low, high = lies[0], lies[-1]

        def point(k, x):
            place = (1 - x) * position(k) + x * position(k + 1)
            return float((1 - x) * s[k] + x * s[k + 1] - self.lines.begins[line]), place

        first, foot = point(low, 0.0 if bridged[low] or g[low] < 0 else 1 - share[low])
        last, touchdown = point(high, 1.0 if bridged[high] or g[high] >= 0 else share[high])
        return Lying(length, last, touchdown, sag, first, foot)

    def _sound(self, u, line):
        """(s, gap, k -> position of the k-th) at the soundings of a whole line, s and gap of shape (cells, points)."""
        (nodes, of_cells, s), at = self._along[line], self.soundings
        r = u[self.lines.node_dofs[nodes]]
        g = at.scalars(self.gap(r), of_cells)
        if self.lines.comm.size == 1:
            return s, g, lambda k: at.of(r, of_cells[k // s.shape[1]])[k % s.shape[1]]
        every = zip(*self.lines.comm.allgather((s, g, at.of(r, of_cells))), strict=True)
        s, g, places = (np.concatenate(part) for part in every)
        order = np.argsort(s[:, 0])
        places = places[order].reshape(-1, 3)
        return s[order], g[order], lambda k: places[k]


def _bridged(touches):
    """Mask of the intervals between the points (cells, points) that have a touching point near on both sides."""
    at, change = np.flatnonzero(touches), np.zeros(touches.size, int)
    near = np.diff(at // touches.shape[1]) <= 1
    change[at[:-1][near]] += 1
    change[at[1:][near]] -= 1
    return np.cumsum(change)[:-1] > 0


def _share_below(first, last):
    """Part of an interval on which a linear function is negative."""
    low, high = np.minimum(first, last), np.maximum(first, last)
    return np.where(high <= 0, 1.0, np.maximum(-low, 0.0) / np.maximum(high - low, 1e-300))
