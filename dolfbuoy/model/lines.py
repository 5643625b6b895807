"""Lines on one mesh of disjoint intervals: spaces, material, residual."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem

from ..forms import cable as form
from ..forms import coupling
from ..meshes import cable_nodes
from ..solver import compat
from ..solver.tension_only import OneSidedRows
from ..solver.unknowns import Block, array_of
from . import effects
from .evolution import Evolution
from .held import HeldEnds, motion_of
from .kinematics import on_line
from .material import cross_section, weight_per_length
from .numbers import Numbers
from .sea import SeaState
from .seabed import Seabed


def top_position(top, t):
    """r_bnd(t) of the scene's section cable.top, fixed or prescribed [m]."""
    return np.array(motion_of(top)(t))


@dataclass(frozen=True)
class Line:
    """A line of a scene: its name, and its section as a function of the scene.

    Its ends are s = 0, held at the anchor, and s = L, which `top` says: "fixed", "prescribed", "free" or "buoy".
    """

    name: str
    section: Callable

    def top(self, scene) -> str:
        """What holds s = L."""
        top = self.section(scene).top
        return "buoy" if top is None else top.kind

    def anchor(self, scene) -> tuple[float, float, float]:
        """Position of s = 0 [m]."""
        return scene.anchor_of(self.section(scene))


def lines_of(scene) -> list[Line]:
    """The lines that a scene describes."""
    return [Line("cable", lambda scene: scene.cable)] if scene.cable else []


class Lines:
    """Mesh, spaces and forms of lines that do not touch; w = (r, T) or (r, T, mean T) is the unknown.

    Line k lies on the mesh from `begins[k]` on, with tags 2 k + 1 at s = 0 and 2 k + 2 at s = L.  All share pair,
    strain, strain form and slack law, and are all elastic or all inextensible; what they do not share is a property per
    cell.
    """

    def __init__(self, comm, scene, dynamic, lines=None):
        self.comm, self.scene, self.dynamic = comm, scene, dynamic
        self.lines = lines_of(scene) if lines is None else lines
        self.sections = [line.section(scene) for line in self.lines]
        self.section, self._held = self.sections[0], None
        self._lay_out()
        self.space = compat.function_space(self.mesh, self._element())
        self.w, self.part = fem.Function(self.space), None
        self.sea = SeaState(self.mesh, scene, with_waves=dynamic)
        self.memory: dict[str, np.ndarray] = {}  #: what accepted steps leave behind besides unknowns
        self._measures()
        self._numbering()
        self._material()
        self._sampled, self._publish = self._waves_at_points(), None
        self._lay_on_bed()
        if dynamic:
            self.gamma_v, self.gamma_a = (fem.Constant(self.mesh, 0.0) for _ in range(2))
            self.history_v, self.history_a = fem.Function(self.space), fem.Function(self.space)

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _lay_out(self):
        """Intervals one after the other, apart from each other by a tenth of the longest."""
        nodes = [cable_nodes(c.length, c.elements, c.grading) for c in self.sections]
        lengths = [c.length for c in self.sections]
        gap = 0.1 * max(lengths)
        self.begins = np.concatenate([[0.0], np.cumsum(np.array(lengths) + gap)])[:-1]
        self.nodes = [begin + n for begin, n in zip(self.begins, nodes, strict=True)]
        self.smallest_cell = min(np.diff(n).min() for n in nodes)
        self.mesh = compat.interval_mesh(self.comm, *self.nodes)
        self._tolerance = 1e-9 * max(*lengths, self.begins[-1] + lengths[-1] if len(lengths) > 1 else 0.0)

    @property
    def averaged(self):
        """Whether the strain is its average on each element (the paper's Sect. 3.3.2)."""
        return self.section.strain == "element-average" and self.elastic

    @property
    def elastic(self):
        """Whether there is a strain at all."""
        return bool(np.isfinite(self.section.axial_stiffness))

    def _element(self):
        c = self.section
        elements = [
            compat.element(self.mesh, "P", c.position_degree, 3),
            compat.element(self.mesh, "DG", c.tension_degree),
        ]
        if self.averaged:
            elements.append(compat.element(self.mesh, "DG", 0))
        return compat.mixed_element(elements)

    def _measures(self):
        mu = self.section.position_degree
        self._degree = self.scene.solver.quadrature_degree or max(2 * mu + 1, 3 * mu - 3)
        places = [s for n in self.nodes for s in (n[0], n[-1])]
        self.ends = compat.end_tags(self.mesh, *places)
        self.dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": self._degree})
        self.ds = ufl.Measure("ds", domain=self.mesh, subdomain_data=self.ends)

    def _numbering(self):
        """Where the dofs of w sit on the mesh: nodes of r, cells of T."""
        V, r_dofs = compat.collapse(self.space, 0)
        self._positions = V
        Q, T_dofs = compat.collapse(self.space, 1)
        self.node_s = V.tabulate_dof_coordinates()[:, 0].copy()
        self.node_dofs = np.asarray(r_dofs).reshape(-1, 3)
        self.owned_nodes = V.dofmap.index_map.size_local
        self.cell_ends = compat.cell_ends(self.mesh)
        cells = compat.cell_dofs(Q)
        self.T_dofs, self.T_s = np.asarray(T_dofs)[cells], Q.tabulate_dof_coordinates()[cells, 0]
        self.mean_dofs = None
        if self.averaged:
            Q0, mean_dofs = compat.collapse(self.space, 2)
            self.mean_dofs = np.asarray(mean_dofs)[compat.cell_dofs(Q0)[:, 0]]
        self.line_of_node = self._line_at(self.node_s)
        self.line_of_cell = self._line_at(self.cell_ends.mean(axis=1))
        #: Dofs of r at s = 0 and s = L of each line, empty where another rank has them.
        self.end_dofs = [tuple(self._dofs_at(n[i]) for i in (0, -1)) for n in self.nodes]
        firsts = [np.isclose(self.cell_ends[:, 0], n[0], rtol=0, atol=self._tolerance) for n in self.nodes]
        self._anchor_cell_dofs = [self.T_dofs[first].ravel() for first in firsts]
        self._at_anchor, self._averaging = self._weights(lambda k: float(k == 0)), self._weights(lambda k: 1 / (k + 1))

    def _line_at(self, s):
        """Number of the line at mesh coordinates."""
        return np.searchsorted(self.begins, s + self._tolerance, side="right") - 1

    def _dofs_at(self, s):
        return self.node_dofs[np.isclose(self.node_s, s, rtol=0, atol=self._tolerance)].ravel()

    def _weights(self, moment):
        """Weights of the T dofs of a cell for a functional with value moment(k) on xi^k, 0 <= xi <= 1.

        All cells number their dofs alike, as affine images of one reference cell.
        """
        ends = self.cell_ends[0]
        xi = (self.T_s[0] - ends[0]) / (ends[1] - ends[0])
        degree = np.arange(len(xi))
        return np.linalg.solve(xi[None, :] ** degree[:, None], [moment(k) for k in degree])

    def _material(self):
        scene = self.scene
        self._numbers = Numbers(self.mesh, scene, self.lines[0].section)
        self._per_cell = []
        self.cable = form.Cable(
            line_density=self._property(lambda c: c.line_density),
            EA=self._property(lambda c: c.axial_stiffness) if self.elastic else None,
            diameter=self._property(lambda c: c.diameter) if self.section.diameter else None,
            area=self._property(cross_section) if self.section.diameter else None,
            damping=self._property(lambda c: c.damping) if any(c.damping for c in self.sections) else None,
        )
        self.gravity = self._numbers.constant(lambda scene, _: np.array([0.0, 0.0, -scene.gravity]))
        self._loads, self._powers = self._called("line" if scene.sea else None), self._called("line_power")
        self.end_loads = {}
        for k in (k for k in self._all if self.lines[k].top(scene) == "free" and any(self.sections[k].top.force)):
            get = self.lines[k].section
            self.end_loads[k] = self._numbers.constant(lambda scene, _, get=get: np.array(get(scene).top.force))

    def _lay_on_bed(self):
        """The sea bed, and what relaxes lines on it: at H = 0 their statics are singular."""
        self.bed = self.relaxation = None
        if self.scene.seabed:
            self.bed = Seabed(self, self._numbers.constant, self._property, self._positions, self._degree)
            self.memory |= self.bed.memory
            if not self.dynamic:
                self.relaxation, self.reference = fem.Constant(self.mesh, 0.0), fem.Function(self.space)

    @property
    def _all(self):
        return range(len(self.lines))

    def _alone(self, scene, line):
        """The scene as if it had this line only."""
        return scene if len(self.lines) == 1 else scene.model_copy(update={"cable": self.lines[line].section(scene)})

    def _called(self, where):
        """[(effect, coefficient)] of the effects with such a term that any of the lines calls for."""
        found = [e for e in effects.EFFECTS if where and getattr(e, where)]
        called = [e for e in found if any(e.called(self._alone(self.scene, k)) for k in self._all)]
        return [(effect, self._coefficient(effect)) for effect in called]

    def _coefficient(self, effect):
        if effect.numbers is None:
            return None
        return self._property(lambda c: effect.given(self.scene, c)[""])

    def _property(self, get):
        """A number of each line as UFL: a Constant if all have the same, else constant on each cell."""
        if len({get(c) for c in self.sections}) == 1:
            return self._numbers.constant(lambda scene, section: get(section))
        made = fem.Function(compat.function_space(self.mesh, compat.element(self.mesh, "DG", 0)))
        self._per_cell.append((made, get))
        self._fill(made, get)
        return made

    def _fill(self, made, get):
        values = np.array([get(c) for c in self.sections])
        made.x.array[compat.cell_dofs(made.function_space)[:, 0]] = values[self.line_of_cell]
        compat.scatter_forward(made)

    def change(self, scene):
        """Take the numbers of another scene of the same structure."""
        self.scene, self.sections = scene, [line.section(scene) for line in self.lines]
        self.section, self._held = self.sections[0], None
        self._numbers.change(scene)
        for made, get in self._per_cell:
            self._fill(made, get)
        self.sea.change(scene)

    # -- forms ------------------------------------------------------------------------------------------------------

    def kinematics(self):
        """(r, T, strain, r_t, r_tt) as UFL; the last two are None in statics."""
        parts, r_t, r_tt = ufl.split(self.w), None, None
        if self.dynamic:
            r_t = self.gamma_v * parts[0] + ufl.split(self.history_v)[0]
            r_tt = self.gamma_a * parts[0] + ufl.split(self.history_a)[0]
        e = form.strain(self.cable, parts[2] if self.mean_dofs is not None else parts[1], parts[0], r_t)
        return parts[0], parts[1], e, r_t, r_tt

    def water_forces(self):
        """[(effect, force per stretched length [N/m] as UFL)] of what the scene calls for."""
        r, _, _, r_t, r_tt = self.kinematics()
        flow, point = self.water_at(r), form.Point(form.tangent(r), r_t, r_tt)
        found = [(e, e.line(c, self.cable, self.sea.density, flow, point)) for e, c in self._loads]
        return [(effect, force) for effect, force in found if force is not None]

    def _waves_at_points(self):
        """Where an irregular sea is wanted; empty without one."""
        if self.sea.kinematics is None:
            return []
        cells = self.mesh.topology.index_map(1).size_local
        V, dofs = compat.collapse(self.space, 0)
        blocks = compat.cell_dofs(V)[:cells]
        places = np.asarray(dofs).reshape(-1, 3)[blocks]
        degree = self.dx.metadata()["quadrature_degree"]
        points = on_line(self.mesh, degree, self.w, (places, self.node_s[blocks]))
        return [self.sea.kinematics.add(points)]

    def water_at(self, r):
        """Undisturbed water at the position r of the lines, at the points of `dx`."""
        return self.sea.flow(r, *self._sampled)

    def follow_water(self, system):
        """An irregular sea follows the unknowns of a System."""
        if self.sea.kinematics is not None:
            self.sea.kinematics.follow(system)

    def publish_points(self):
        """Put an irregular sea where the unknowns' Function says: for forms that no System evaluates."""
        if self.sea.kinematics is not None:
            self._publish = self._publish or self.sea.kinematics.into_functions(array_of)
            self._publish()

    def material_powers(self):
        """[(effect, power per unstretched length [W/m] as UFL)] that the material takes, for balances."""
        r, _, _, r_t, _ = self.kinematics()
        return [(effect, effect.line_power(c, r, r_t)) for effect, c in self._powers]

    def residual(self, test, attachments=()):
        """Eq. (11) tested by `test`; without inertia, added mass and waves in statics."""
        tests, cable, dx = ufl.split(test), self.cable, self.dx
        r, T, e, _, r_tt = self.kinematics()
        v, q = tests[:2]
        F = form.tension_term(r, T, e, v) * dx + form.strain_equation(r, e, q, self.section.strain_form) * dx
        F -= ufl.inner(form.weight_in_water(cable, self.gravity, self.sea.density), v) * dx
        if self.mean_dofs is not None:
            F += form.mean_strain_equation(T, ufl.split(self.w)[2], tests[2]) * dx
        if self.dynamic:
            F += form.inertia(cable, r_tt, v) * dx
        forces = [force for _, force in self.water_forces()]
        if forces:
            f = sum(forces[1:], forces[0])
            F -= ufl.inner(form.stretched(cable, e, f), v) * dx
        if self.bed is not None:
            for _, force in self.bed.forces():
                F -= ufl.inner(force, v) * dx
        if self.relaxation is not None:
            F += form.inertia(cable, self.relaxation * (r - ufl.split(self.reference)[0]), v) * dx
        for attachment in attachments:
            F += attachment.end_force(v)
        for line, load in self.end_loads.items():
            F += coupling.end_force(load, v) * self.ds(2 * line + 2)
        return F

    # -- time -------------------------------------------------------------------------------------------------------

    def evolutions(self) -> list[Evolution]:
        """r is of second order; T is no state."""
        L, g = self.longest, max(self.scene.gravity, 1.0)
        sizes = []
        for size in (L, np.sqrt(g * L)):
            sizes.append(np.full(len(self.w.x.array), np.inf))
            sizes[-1][self.node_dofs] = size
        rates = [(self.gamma_v, self.history_v), (self.gamma_a, self.history_a)]
        return [Evolution(self.part, rates, False, sizes)]

    def set_time(self, t):
        """Advance the sea."""
        self.sea.set_time(t)

    def begin(self, u):
        """Memory as at the start of a run."""
        if self.bed is not None:
            self.bed.begin(u)

    def accept(self, u):
        """A step was taken."""
        if self.bed is not None:
            self.bed.accept(u)

    # -- relaxation, in statics on a sea bed ---------------------------------------------------------------------------

    def hold(self, u, h):
        """Inertia of a step of h [s] from rest in the positions of u."""
        self.reference.x.array[:], self.relaxation.value = u[self.part.slice], h**-2

    def let_go(self):
        """No inertia."""
        self.relaxation.value = 0.0

    # -- numbers ----------------------------------------------------------------------------------------------------

    @property
    def longest(self) -> float:
        """Length of the longest line [m]."""
        return max(c.length for c in self.sections)

    @property
    def weight_per_length(self) -> float:
        """Weight in water per unstretched length of the first line [N/m]."""
        return weight_per_length(self.scene, self.section)

    def _held_ends(self):
        """(line, end, its dofs): anchors, and tops that are fixed or prescribed."""
        for k, dofs in enumerate(self.end_dofs):
            yield k, 0, dofs[0]
            if self.lines[k].top(self.scene) in ("fixed", "prescribed"):
                yield k, 1, dofs[1]

    def constrained_dofs(self):
        """Dofs that are given."""
        return np.concatenate([dofs for _, _, dofs in self._held_ends()])

    def constrain(self, u, t):
        """Put the given positions at time t into the local unknowns u."""
        if self._held is None:  # u stays in place
            held = [(k, end, dofs) for k, end, dofs in self._held_ends() if len(dofs)]
            self._held = HeldEnds([(dofs, self._motion(k, end)) for k, end, dofs in held], u)
        self._held.put(t)

    def _motion(self, line, end):
        """Of an end that is held, or its position [m]."""
        if end == 0:
            return self.lines[line].anchor(self.scene)
        top = self.sections[line].top
        return motion_of(top) if top.kind == "prescribed" else top.position

    def top_position(self, t, line=0):
        """r_bnd(t) of a fixed or prescribed top [m]."""
        return top_position(self.sections[line].top, t)

    def anchor_dofs(self, line=0):
        """Dofs of r at s = 0."""
        return self.end_dofs[line][0]

    def top_dofs(self, line=0):
        """Dofs of r at s = L."""
        return self.end_dofs[line][1]

    def places(self):
        """Mesh coordinates of the nodes, in the order of their dofs [m]."""
        return self.node_s

    def force_dofs(self):
        """Local unknowns that are tensions."""
        dofs = self.T_dofs.ravel()
        return dofs if self.mean_dofs is None else np.concatenate([dofs, self.mean_dofs])

    def elimination_order(self):
        """Free owned dofs along the lines, each tension after the positions that it constrains.

        In this order the saddle-point matrix has a factorisation without pivoting.
        """
        n = self.space.dofmap.index_map.size_local
        place, kind = np.zeros(len(self.w.x.array)), np.ones(len(self.w.x.array))
        place[self.node_dofs] = self.node_s[:, None]
        kind[self.node_dofs] = 0
        place[self.T_dofs] = self.cell_ends[:, 1][:, None]
        if self.mean_dofs is not None:
            place[self.mean_dofs] = self.cell_ends[:, 1]
            kind[self.mean_dofs] = 2
        order = np.lexsort((np.arange(n), kind[:n], place[:n]))
        return order[~np.isin(order, self.constrained_dofs())]

    def blocks(self, force):
        """Blocks of w; `force` is a typical tension [N]."""
        L, h = self.longest, self.smallest_cell
        moving = max(c.line_density for c in self.sections) * h * L
        blocks = [
            Block("cable position", self.node_dofs.ravel(), L, force, moving, 2, unit="m"),
            Block("cable tension", self.T_dofs.ravel(), force, h, rounding=moving, unit="N"),
        ]
        if self.mean_dofs is not None:
            blocks.append(Block("cable mean tension", self.mean_dofs, force, force * h, rounding=moving, unit="N"))
        return blocks

    def one_sided_rows(self, force) -> OneSidedRows:
        """Rows of the tension for the tension-only law; `force` is a typical tension [N]."""
        c, owned = self.section, self.space.dofmap.index_map.size_local
        sizes = np.broadcast_to(np.diff(self.cell_ends, axis=1), self.T_dofs.shape)
        mine = self.T_dofs < owned
        return OneSidedRows(
            rows=self.T_dofs[mine],
            weights=sizes[mine] / (c.tension_degree + 1),
            inertia=c.line_density * (sizes[mine] / c.position_degree) ** 2 if self.dynamic else None,
            compliance=1 / c.axial_stiffness,
            rest=1 / min(c.axial_stiffness, 0.1 * force),  # measured: the fewest iterations
        )

    def set_shape(self, u, position, tension, line=0):
        """Interpolate position(s) -> (n, 3) and tension(s) -> (n,) of a line into the local unknowns u."""
        nodes, cells = self.line_of_node == line, self.line_of_cell == line
        u[self.node_dofs[nodes]] = position(self.node_s[nodes] - self.begins[line])
        u[self.T_dofs[cells]] = tension(self.T_s[cells] - self.begins[line])
        if self.mean_dofs is not None:
            u[self.mean_dofs] = self.mean_tension(u)

    def mean_tension(self, u):
        """Average of T on each owned cell [N]."""
        return u[self.T_dofs] @ self._averaging

    def anchor_tension(self, u, line=0):
        """T_h(0) of a line [N], on the rank that owns its first cell; nan elsewhere."""
        dofs = self._anchor_cell_dofs[line]
        return float(self._at_anchor @ u[dofs]) if len(dofs) else np.nan
