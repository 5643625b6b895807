"""The sea bed under lines and bodies at joints: contact parameters, friction, and grounded length."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem

from ..forms import seabed as form
from ..scene import Scene
from ..scene.bathymetry import ORDERS
from ..scene.cable import Cable
from ..scene.lines import Body, Sinker
from ..solver import compat
from . import effects
from .rigid import weight_per_length

if TYPE_CHECKING:
    from .bodies import Bodies
    from .lines import Lines
    from .masses import Masses


class ContactParameters(NamedTuple):
    """Numbers of the contact of a metre of a line, or of a body (`forms.seabed.Contact`)."""

    stiffness: float  #: k [N/m]
    damping: float  #: c [N s/m]
    sag: float  #: delta [m]
    stick: float  #: k_t [N/m]


class GroundedLength(NamedTuple):
    """Grounded part of a line."""

    length: float  #: unstretched [m]
    s: float  #: arc length at which it leaves the bed towards s = L [m]; -inf if nothing lies
    touchdown: np.ndarray  #: that point [m]; nan if nothing lies
    sag: float  #: deepest penetration [m]
    first: float = np.inf  #: arc length at which it leaves the bed towards s = 0 [m]; inf if nothing lies
    foot: np.ndarray = np.full(3, np.nan)  #: that point [m]; nan if nothing lies


def plane(scene: Scene) -> tuple[np.ndarray, float]:
    """(n, d) of the bed n . x = d, n upwards; of one that is no plane the nearest one under the held ends of lines."""
    (a, b), level = scene.seabed.slope, -scene.sea.depth
    if scene.seabed.depths is not None:
        a, b, level = _nearest_plane(scene)
    normal = np.array([-a, -b, 1.0]) / math.sqrt(1 + a * a + b * b)
    return normal, level * float(normal[2])


def _nearest_plane(scene: Scene) -> tuple[float, float, float]:
    """(a, b, c) of the plane z = a x + b y + c that fits best a bed of depths, around the held ends of lines."""
    places = [end.position for piece in scene.network.pieces for end in piece.ends if end.position is not None]
    low, high = (fold(np.array(places)[:, :2], axis=0) for fold in (np.min, np.max))
    reach = 0.5 * max(piece.section.length for piece in scene.network.pieces)
    low, high = np.where(high - low < reach, (low - reach, high + reach), (low, high))
    x, y = (grid.ravel() for grid in np.meshgrid(*np.linspace(low, high, 15).T))
    fit = np.column_stack([x, y, np.ones_like(x)])
    a, b, c = np.linalg.lstsq(fit, scene.seabed.depths.height(x, y), rcond=None)[0]
    return float(a), float(b), float(c)


def height_of_bed(scene: Scene, points: np.ndarray) -> np.ndarray:
    """z of the bed [m] under points (..., 3), or (..., 2), of a scene with a sea."""
    if scene.seabed and scene.seabed.depths is not None:
        return np.asarray(scene.seabed.depths.height(*np.moveaxis(np.asarray(points, dtype=float)[..., :2], -1, 0)))
    slope = scene.seabed.slope if scene.seabed else (0.0, 0.0)
    return np.asarray(points, dtype=float)[..., :2] @ slope - scene.sea.depth


def largest_sag(scene: Scene) -> float:
    """Largest penetration of a line or body under its own weight [m]: it costs 1.2 sag/depth of a tension."""
    return min(1e-4 * scene.sea.depth, 0.01)


def stick_length(scene: Scene) -> float:
    """Displacement over which Coulomb friction is mobilised [m]."""
    return scene.seabed.stick_length or min(1e-3 * scene.sea.depth, 0.05)


def has_friction(scene: Scene, dynamic: bool) -> bool:
    """True if there is friction: in statics only where lines are taken as pulled."""
    return scene.seabed.friction > 0 and (dynamic or scene.seabed.start == "pulled")


def hardness(scene: Scene, sections: Sequence[Cable]) -> float:
    """k_b [Pa/m]; sections: of all lines, of which the heaviest determines the hardness if the scene gives none."""
    if scene.seabed.stiffness is not None:
        return scene.seabed.stiffness
    return max(_load(scene, c) / c.diameter for c in sections) / largest_sag(scene)


def parameters_of_line(scene: Scene, section: Cable, k_b: float) -> ContactParameters:
    """Contact parameters of a line on a bed of stiffness k_b [Pa/m]."""
    given = _load(scene, section), section.line_density, k_b * section.diameter
    return _parameters(scene, *given, scene.seabed.friction)


def parameters_of_body(scene: Scene, body: Body) -> ContactParameters:
    """Contact parameters of a body at a joint."""
    weight = max(abs(body.mass - scene.sea.density * body.volume), 1e-3 * body.mass) * scene.gravity
    stiffness = weight / largest_sag(scene)
    return _parameters(scene, weight, body.mass, stiffness, friction_of(scene, body))


def friction_of(scene: Scene, body: Body) -> float:
    """Friction coefficient of a body on the bed."""
    return body.friction if isinstance(body, Sinker) else scene.seabed.friction


def _load(scene, section):
    """Load of a metre of a line on the bed [N/m]; not 0 for lines that hardly sink or float."""
    return max(abs(weight_per_length(scene, section)), 1e-3 * section.line_density * scene.gravity)


def _parameters(scene, weight, mass, stiffness, friction):
    bed = scene.seabed
    damping = 2 * bed.damping_ratio * math.sqrt(stiffness * mass)
    return ContactParameters(stiffness, damping, weight / stiffness, friction * weight / stick_length(scene))


class Points:
    """Points of the owned cells of lines: those of the quadrature of a degree; with_nodes: and their nodes, in order.

    nodes: of each cell.  s: mesh coordinates, shape (cells, points).  line: number of the line of each cell.  presses:
    mask of the points of the quadrature, shape (points,).
    """

    def __init__(self, lines: "Lines", positions: fem.FunctionSpace, degree: int, with_nodes: bool = False):
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

    def of(self, values: np.ndarray, nodes: np.ndarray | None = None) -> np.ndarray:
        """Values at the points of all cells, or those with these nodes, shape (cells, points, 3), of values (n, 3)."""
        return self._basis @ values[self.nodes if nodes is None else nodes]

    def scalars(self, values: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Values at the points of the cells with these nodes, shape (cells, points), of values (n,)."""
        return values[nodes] @ self._basis.T


class Bed:
    """Contact of `masses.Masses` with the bed, at places of which each kind has its own.

    `held`: r_a, the places where friction holds on, a Function; None without friction, and in statics unless lines are
    taken as pulled.
    """

    keeps = False  #: whether there are bodies that friction holds at rest however they are pulled

    def __init__(self, model: "Masses", space: Callable):
        self.model, scene, numbers = model, model.scene, model.constants
        self._known = None
        self.normal, self.level = (numbers.constant(lambda scene, _, i=i: plane(scene)[i]) for i in (0, 1))
        parts = (lambda section, i=i: self.parameters_of(section)[i] for i in range(len(ContactParameters._fields)))
        self.parameters = ContactParameters(*map(numbers.per_cell, parts))
        self.friction: Any = numbers.constant(lambda scene, _: scene.seabed.friction if model.dynamic else 0.0)
        rubs = has_friction(scene, model.dynamic)
        self.held = fem.Function(space()) if rubs or self.keeps else None
        self.memory = {"bed_holds": self.held.x.array} if rubs else {}
        self.ground = Terrain(self) if scene.seabed.depths is not None else None
        terms = effects.called_by(scene, "bed")
        self.terms = terms if rubs else [e for e in terms if e.bed is not form.friction]

    def parameters_of(self, section: Any) -> ContactParameters:
        """Contact parameters of a line or a body, in the present scene."""
        raise NotImplementedError

    def at(self, values: np.ndarray) -> np.ndarray:
        """Values at the places of the contact, (..., 3), of an array like the model's unknowns."""
        raise NotImplementedError

    def _of_scene(self, find):
        """Result of `find`, evaluated once for each scene."""
        if self._known is None or self._known[0] is not self.model.scene:
            self._known = self.model.scene, find()
        return self._known[1]

    @property
    def coefficient(self) -> Any:
        """Friction coefficient as UFL."""
        return self.friction

    def coefficients(self) -> Any:
        """Friction coefficients in numbers, at the places."""
        return float(self.friction.value)

    # -- forms ---------------------------------------------------------------------------------------------------------

    def contact(self) -> form.Contact:
        """Pressure and friction at the places, per metre of a line and for a body as a whole."""
        x, *_, x_t, _ = self.model.kinematics()
        slide = None if self.held is None else x - self.held
        normal, gap = self.normal, None
        if self.ground is not None:
            normal, gap = self.ground.near().normal_and_gap(x)
        speed = None if x_t is None else ufl.dot(normal, x_t)
        gap = form.gap(self.normal, self.level, x) if gap is None else gap
        return form.Contact(normal, gap, *self.parameters[:3], speed, self.parameters.stick, slide)

    def forces(self) -> list[tuple[effects.Effect, Any]]:
        """[(effect, force as UFL)], per unstretched metre of a line [N/m], of a body [N]."""
        at = self.contact()
        return [(effect, effect.bed(self.coefficient, at)) for effect in self.terms]

    def powers(self) -> list[tuple[str, Any]]:
        """[(account, energy or power as UFL)] of these forces, for balances."""
        at, (_, *_, x_t, _) = self.contact(), self.model.kinematics()
        power = {form.support: form.damping_power(at)}
        if self.held is not None:
            power[form.friction] = ufl.inner(form.friction(self.coefficient, at), x_t)
        return [("elastic", form.spring_energy(at)), *((effect.account, power[effect.bed]) for effect in self.terms)]

    # -- memory --------------------------------------------------------------------------------------------------------

    @property
    def holds(self) -> np.ndarray:
        """Places where friction holds on."""
        return self.held.x.array[self._place]

    def hold(self, places: np.ndarray) -> None:
        """Let it hold on at others."""
        self.held.x.array[self._place] = places

    def begin(self, u: np.ndarray) -> None:
        """Friction holds on where the model is, and does not pull yet."""
        if self.held is not None:
            self.hold(self.at(u[self.model.part.slice]))

    def accept(self, u: np.ndarray) -> None:
        """A step was taken: where friction pulls more than it can, it slides after the model."""
        if self.held is None:
            return
        model, mu, speed = self.model, self.coefficients(), 0.0
        r = self.at(u[model.part.slice])
        n = self.normals(r)
        if model.dynamic:
            speed = _dot(model.gamma_v.value * r + self.at(model.history_v.x.array), n)
        k, c, sag, stick = self.parameter_values()
        below = np.maximum(-self.gap(r), 0.0)
        p = np.maximum(k * below - c * np.minimum(below / sag, 1.0) * speed, 0.0)
        slide = r - self.holds
        slide -= _dot(slide, n)[..., None] * n
        pull = stick * np.sqrt((slide * slide).sum(axis=-1))
        share = np.minimum(1.0, mu * p / np.maximum(pull, 1e-300))
        self.hold(r - share[..., None] * slide)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Distance of points (..., 3) from the bed [m]."""
        if self.ground is not None:
            return (x[..., 2] - height_of_bed(self.model.scene, x)) * self.normals(x)[..., 2]
        return x @ self.normal.value - self.level.value

    def normals(self, x: np.ndarray) -> np.ndarray:
        """Upward normal of the bed (3,), or under points (..., 3) of one that is no plane."""
        return self.normal.value if self.ground is None else self.ground.normals(x)

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        """Space of `size` numbers at the places of the contact, and where those of each place are, (..., size)."""
        raise NotImplementedError

    def follow(self, system: Any) -> None:
        """Let the forms of a System see a bed that is no plane."""
        if self.ground is not None:
            self.ground.follow(system)

    def publish(self) -> None:
        """The same for forms that no System evaluates."""
        if self.ground is not None:
            self.ground.fill(self.ground.coefficient.x.array, self.ground.unknowns())


class Terrain:
    """A bed that is no plane, for the forms of a Bed: numbers at its places, taken there before every evaluation."""

    SIZE = 2 + len(ORDERS)  #: x, y, and the height with its derivatives

    def __init__(self, bed: Bed):
        self.bed = bed
        space, self._place = bed.blocks(self.SIZE)
        self.coefficient = fem.Function(space)

    def near(self) -> form.Ground:
        """The bed near the places, as UFL."""
        c = [self.coefficient[i] for i in range(self.SIZE)]
        return form.Ground(c[0], c[1], c[2], (c[3], c[4]), (c[5], c[6], c[7]))

    def unknowns(self) -> np.ndarray:
        """Those of the model, as its Function has them."""
        return np.asarray(self.bed.model.part.function.x.array)

    def fill(self, values: np.ndarray, u: np.ndarray) -> None:
        """Put the numbers for the model's unknowns u into the values of the coefficient."""
        r = self.bed.at(u)
        depths = self.bed.model.scene.seabed.depths
        values[self._place] = np.concatenate([r[..., :2], depths.derivatives(r[..., 0], r[..., 1])], axis=-1)

    def follow(self, system: Any) -> None:
        """Fill before every evaluation of a System."""
        values, place = system.numbers_of(self.coefficient), self.bed.model.part.slice
        if values is not None:
            system.filled_by_hook(self.coefficient)
            system.hooks.add(lambda _: self.fill(values, system.u[place]))

    def normals(self, x: np.ndarray) -> np.ndarray:
        """Upward normals (..., 3) under points."""
        slopes = self.bed.model.scene.seabed.depths.derivatives(x[..., 0], x[..., 1])
        up = np.stack([-slopes[..., 1], -slopes[..., 2], np.ones(x.shape[:-1])], axis=-1)
        return up / np.linalg.norm(up, axis=-1, keepdims=True)


def _dot(vectors, n):
    """Components of vectors (..., 3) along one normal (3,), or along that of each."""
    return vectors @ n if n.ndim == 1 else (vectors * n).sum(axis=-1)


class Landing(Bed):
    """Contact of `Bodies` with the bed, of each as a whole; sinkers stay at their places in statics."""

    def __init__(self, bodies: "Bodies"):
        self.keeps = any(isinstance(body, Sinker) for body in bodies.bodies)
        super().__init__(bodies, lambda: bodies.space)
        self._place, number = bodies.dofs, bodies.constants.per_cell
        if self.keeps:
            self._sinks: Any = number(lambda body: float(isinstance(body, Sinker)))
            if bodies.dynamic:
                self.friction = number(lambda body: friction_of(bodies.scene, body))
            else:
                self._keep()

    def parameters_of(self, section: Body) -> ContactParameters:
        return parameters_of_body(self.model.scene, section)

    @property
    def coefficient(self) -> Any:
        return self.friction * (1 - self._sinks) if self.keeps and not self.model.dynamic else self.friction

    def coefficients(self) -> Any:
        model = self.model
        if not (self.keeps and model.dynamic):
            return super().coefficients()
        return np.array([friction_of(model.scene, body) for body in model.bodies])

    def forces(self) -> list[tuple[effects.Effect, Any]]:
        found = super().forces()
        if self.keeps and not self.model.dynamic:
            found.append((self.terms[0], form.holding(self._sinks, self.contact())))
        return found

    def hold(self, places: np.ndarray) -> None:
        super().hold(places)
        if self.keeps and not self.model.dynamic:
            self._keep()

    def begin(self, u: np.ndarray) -> None:
        super().begin(u)
        if self.keeps:
            self._keep()

    def _keep(self):
        """Let friction hold sinkers on to their places."""
        for name, body in zip(self.model.names, self.model.bodies, strict=True):
            if isinstance(body, Sinker):
                self.hold_body(name, np.array(body.place))

    def change(self) -> None:
        """Take the places of sinkers of another scene."""
        if self.keeps and not self.model.dynamic:
            self._keep()

    def parameter_values(self) -> np.ndarray:
        """Numbers of the contact of every body."""
        return self._of_scene(lambda: np.array([self.parameters_of(body) for body in self.model.bodies]).T)

    def at(self, values: np.ndarray) -> np.ndarray:
        return values[self.model.dofs]

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        mesh = self.model.mesh
        space = compat.function_space(mesh, compat.element(mesh, "DG", 0, size))
        return space, size * (self.model.dofs[:, :1] // 3) + np.arange(size)

    def hold_body(self, name: str, place: np.ndarray) -> None:
        """Let friction hold the body at a joint on to a place."""
        self.held.x.array[self.model.dofs[self.model.names.index(name)]] = place

    def pressure(self, name: str, u: np.ndarray) -> float:
        """Force of the body at a joint on the bed at rest [N]."""
        k = self.model.names.index(name)
        depth = -self.gap(self.at(u[self.model.part.slice])[k])
        return self.parameters_of(self.model.bodies[k]).stiffness * max(depth, 0.0)


class Seabed(Bed):
    """Contact of `Lines` with the bed, at the points of their quadrature."""

    def __init__(self, lines: "Lines"):
        positions, degree = lines.positions, lines.dx.metadata()["quadrature_degree"]
        needs = has_friction(lines.scene, lines.dynamic) or lines.scene.seabed.depths is not None
        self.points = Points(lines, positions, degree) if needs else None

        def space():
            return compat.function_space(lines.mesh, compat.quadrature_element(lines.mesh, degree, 3))

        super().__init__(lines, space)
        if self.held is not None:
            self._place = 3 * compat.cell_dofs(self.held.function_space)[..., None] + np.arange(3)
        self.soundings = Points(lines, positions, degree, with_nodes=True)
        #: Nodes of each line, which of these its own cells have, from its start on, and where their soundings are.
        self._along, at = [], self.soundings
        for nodes, cells in zip(lines.nodes_of, lines.cells_of, strict=True):
            cells = cells[np.argsort(at.s[cells, 0])]
            self._along.append((nodes, np.searchsorted(nodes, at.nodes[cells]), at.s[cells]))

    def parameters_of(self, section: Cable) -> ContactParameters:
        scene = self.model.scene
        return parameters_of_line(scene, section, self._of_scene(self._of_lines)[0])

    def _of_lines(self):
        """(hardness of the bed, numbers of the contact in every cell)."""
        scene = self.model.scene
        hard = hardness(scene, [piece.section for piece in scene.network.pieces])
        values = np.array([parameters_of_line(scene, section, hard) for section in self.model.sections])
        return hard, values[self.model.line_of_cell].T[:, :, None]

    def parameter_values(self) -> np.ndarray:
        """Numbers of the contact in every cell, arrays (cells, 1)."""
        return self._of_scene(self._of_lines)[1]

    def blocks(self, size: int) -> tuple[fem.FunctionSpace, np.ndarray]:
        lines, degree = self.model, self.model.dx.metadata()["quadrature_degree"]
        space = compat.function_space(lines.mesh, compat.quadrature_element(lines.mesh, degree, size))
        return space, size * compat.cell_dofs(space)[..., None] + np.arange(size)

    def at(self, values: np.ndarray) -> np.ndarray:
        return self.points.of(values[self.model.node_dofs])

    # -- numbers -------------------------------------------------------------------------------------------------------

    def grounded(self, u: np.ndarray, line: int = 0) -> GroundedLength:
        """Grounded length of a line, on every rank.

        All lies between two points of the quadrature that touch the bed, if they are of one element or of neighbours:
        what rises there is the element's wave, not the line.  Elsewhere the gap is linear from sounding to sounding.
        """
        s, g, position = self._sound(u, line)
        bridged = _bridged((g < 0) & self.soundings.presses)
        s, g = s.ravel(), g.ravel()
        lower, upper = np.minimum(g[:-1], g[1:]), np.maximum(g[:-1], g[1:])
        below = np.maximum(-lower, 0.0) / np.maximum(upper - lower, 1e-300)  # part on which a linear gap is negative
        share = np.where(bridged | (upper <= 0), 1.0, below)
        length, sag, lies = float(share @ np.diff(s)), max(-float(g.min()), 0.0), np.flatnonzero(share)
        if not len(lies):
            return GroundedLength(length, -np.inf, np.full(3, np.nan), sag)
        low, high = lies[0], lies[-1]

        def point(k, x):
            place = (1 - x) * position(k) + x * position(k + 1)
            return float((1 - x) * s[k] + x * s[k + 1] - self.model.begins[line]), place

        first, foot = point(low, 0.0 if bridged[low] or g[low] < 0 else 1 - share[low])
        last, touchdown = point(high, 1.0 if bridged[high] or g[high] >= 0 else share[high])
        return GroundedLength(length, last, touchdown, sag, first, foot)

    def _sound(self, u, line):
        """(s, gap, k -> position of the k-th) at the soundings of a whole line, s and gap of shape (cells, points)."""
        (nodes, of_cells, s), at = self._along[line], self.soundings
        r = u[self.model.part.slice][self.model.node_dofs[nodes]]
        g = at.scalars(self.gap(r), of_cells)
        if self.model.comm.size == 1:
            return s, g, lambda k: at.of(r, of_cells[k // s.shape[1]])[k % s.shape[1]]
        every = zip(*self.model.comm.allgather((s, g, at.of(r, of_cells))), strict=True)
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
