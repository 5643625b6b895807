"""Lines: material, residual, and interface to time stepping."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import ufl
from dolfinx import fem

from ..elsewhere import MPI
from ..forms import bending, coupling
from ..forms import cable as form
from ..forms.kinds import Expr
from ..scene import Scene
from ..scene.cable import Cable, Top
from ..scene.stiffness import kinks_of
from ..solver import compat
from ..solver.system import System
from ..solver.tension_only import OneSidedRows
from ..solver.unknowns import Block
from . import effects
from .grounding import GroundedLength, Seabed
from .growth import Growth
from .interface import Evolution
from .kinematics import on_line
from .layout import Layout
from .masses import Masses
from .parting import Parting
from .prescribed_ends import direction_of, held, motion_of
from .rigid import cross_section, weight_per_length
from .winch import Winch


def top_position(top: Top, t: float) -> np.ndarray:
    """r_bnd(t) of the scene's section cable.top, fixed or prescribed [m]."""
    return np.array(motion_of(top)(t))


def is_averaged(section: Cable) -> bool:
    """True if the strain is averaged on each element (the paper's Sect. 3.3.2); the same for all pieces."""
    return section.strain == "element-average"


class Lines(Layout, Masses):
    """Spaces and forms of pieces of line of a scene, by their `numbers`; the unknown is w = (r, T, mean T, m), the last
    two only if needed.

    All have the same element pair, strain and strain form: lines of several kinds are several `groups`.

    All other properties may vary from cell to cell.  If some pieces are inextensible and others not, there is a
    compliance per cell, 0 for the former; if all are inextensible, there is no strain.
    """

    where = "line"

    def __init__(
        self,
        comm: MPI.Comm,
        scene: Scene,
        dynamic: bool,
        numbers: list[int] | None = None,
        begins: np.ndarray | None = None,
    ):
        self.numbers = list(range(len(scene.network.pieces))) if numbers is None else numbers
        network = self._part_of(scene)
        stiffness = [piece.section.axial_stiffness for piece in network.pieces]
        self.elastic, self.mixed = not all(map(math.isinf, stiffness)), False
        self.mixed = self.elastic and any(map(math.isinf, stiffness))
        first = network.pieces[0].section
        super().__init__(comm, network, self.elastic and is_averaged(first), first.bending_stiffness > 0, begins)
        self._equip(scene, dynamic)
        self.stopped = None  #: time at which moving ends have stopped, an array (1,)
        #: (piece, end: 0 or 1) -> its position [m] as a function of time, overriding the scene's.
        self.driven: dict[tuple[int, int], Callable[[float], np.ndarray]] = {}
        mu = self.section.position_degree
        self._degree = scene.solver.quadrature_degree or max(2 * mu + 1, 3 * mu - 3)
        self.dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": self._degree})
        grown = scene.sea is not None and any(piece.section.marine_growth for piece in scene.network.pieces)
        self.growth = Growth(self) if grown else None
        self.memory |= self.growth.memory if self.growth else {}
        self._material()
        self.winch = Winch(self) if any(c.winch for c in self.sections) else None
        self.parting = Parting(self) if dynamic and any(c.fails_at for c in self.sections) else None
        self.memory |= self.parting.memory if self.parting else {}
        self._sampled = self._waves_at_points()
        if scene.seabed:
            self.bed = Seabed(self)
            self.memory |= self.bed.memory
        if dynamic:
            self._move()
        else:  # inertia in the damped motion of statics
            self.relaxation, self.reference = compat.constant(self.mesh, 0.0), fem.Function(self.space)

    # -- set-up -----------------------------------------------------------------------------------------------------

    @property
    def groups(self) -> list["Lines"]:
        """List of these lines, for compatibility with `line_groups.LineGroups`."""
        return [self]

    def holder(self, piece: int) -> tuple["Lines", int]:
        """(the Lines that contain a piece of the scene, its number there)."""
        return self, piece

    def _part_of(self, scene):
        """The network of a scene, restricted to the pieces of these lines."""
        return replace(scene.network, pieces=tuple(scene.network.pieces[k] for k in self.numbers))

    @property
    def stretches(self) -> np.ndarray:
        """Mask of the owned cells that are elastic."""
        return np.isfinite([c.axial_stiffness for c in self.sections])[self.line_of_cell]

    @property
    def one_sided(self) -> np.ndarray:
        """Mask of the owned cells with the tension-only law."""
        return np.array([c.slack == "tension-only" for c in self.sections])[self.line_of_cell]

    @property
    def keeps_shape(self) -> np.ndarray:
        """Mask of the owned cells that are stable without tension: lines with bending stiffness, and bars on buoys."""
        return np.array([p.section.bending_stiffness > 0 or p.is_bar for p in self.pieces])[self.line_of_cell]

    @property
    def turnable(self) -> np.ndarray:
        """Mask of the pieces whose elements could be inverted by compression, their stretch being given by T."""
        found = [c.slack == "compressive" and not (self.dynamic and c.damping) for c in self.sections]
        return np.isfinite([c.axial_stiffness for c in self.sections]) & found

    def smallest_stretch(self, u: np.ndarray) -> float:
        """Smallest 1 + T/EA of the owned cells of `turnable` pieces, with the current EA of the forms."""
        u = u[self.part.slice]
        T = u[self.T_dofs].min(axis=1) if self.mean_dofs is None else u[self.mean_dofs]
        EA, compliance = self.cable.EA, self.cable.compliance
        found = 1 / self._in_cells(EA) if compliance is None else self._in_cells(compliance)
        return float((1 + T * found)[self.turnable[self.line_of_cell]].min(initial=1.0))

    def _in_cells(self, number):
        """Values in the owned cells of a Constant or of a Function constant per cell."""
        if isinstance(number, fem.Constant):
            return number.value
        return number.x.array[compat.cell_dofs(number.function_space)[:, 0]]

    def _material(self):
        dry = not self.section.diameter
        self._count(lambda scene: [scene.network.pieces[k].section for k in self.numbers], self.line_of_cell)
        number = self.constants.per_cell
        self.cable = form.Cable(
            line_density=number(lambda c: c.line_density),
            EA=number(lambda c: c.axial_stiffness) if self.elastic and not self.mixed else None,
            diameter=None if dry else number(lambda c: c.diameter),
            area=None if dry else number(cross_section),
            damping=number(lambda c: c.damping) if any(c.damping for c in self.sections) else None,
            compliance=number(lambda c: 1 / c.axial_stiffness) if self.mixed else None,
            kinks=(*self._kinks(below=False), *self._kinks(below=True)),
        )
        if self.growth is not None and any(c.marine_growth for c in self.sections):
            self.cable = self.cable.grown(self.growth.diameter, self.growth.mass)
        self.clamps = {}
        if self.moment_dofs is not None:
            self._bending(number)
        self.gravity = self.constants.constant(lambda scene, _: np.array([0.0, 0.0, -scene.gravity]))
        self._loads, self.powers = self._called(self.where), self._called("line_power")
        self._surfaces = bool(effects.called_by(self.scene, "line_wet"))
        self.end_loads = {}
        for k, piece in enumerate(self.pieces):
            top = piece.ends[1].top
            if piece.ends[1].kind == "free" and any(top.force):
                self.end_loads[k] = self.constants.constant(
                    lambda scene, _, n=self.numbers[k]: np.array(scene.network.pieces[n].ends[1].top.force)
                )

    def _bending(self, number):
        """Bending stiffness, its typical size, and the direction and spring of each clamped end."""

        def clamp(k, i, get):
            return self.constants.constant(lambda scene, _: get(scene.network.pieces[self.numbers[k]].ends[i].clamp))

        self.EI, self.blended = number(lambda c: c.bending_stiffness), self.section.position_degree == 2
        damped = self.dynamic and any(c.bending_damping for c in self.sections)
        self.bending_damping = number(lambda c: c.bending_damping) if damped else None
        self.typical_EI = self.constants.constant(
            lambda scene, _: max(scene.network.pieces[k].section.bending_stiffness for k in self.numbers)
        )
        self.share_of_bending = compat.constant(self.mesh, 1.0)
        for k, piece in enumerate(self.pieces):
            for i, end in enumerate(piece.ends):
                if end.clamp is not None and end.kind != "buoy":  # at a buoy the Attachment has it
                    spring = end.clamp.rotational_stiffness and clamp(k, i, lambda c: c.rotational_stiffness)
                    self.clamps[k, i] = clamp(k, i, lambda c: np.array(c.unit)), spring

    def _kinks(self, below):
        """Kinks of tables T(e), padded with kinks without effect to the same number in all sections."""

        def kink(section, k):
            return (*kinks_of(section.axial_stiffness, below), *[(0.0, 0.0)] * most)[k]

        most = max(len(kinks_of(c.axial_stiffness, below)) for c in self.sections)
        number = self.constants.per_cell
        return [
            form.Kink(number(lambda c, k=k: kink(c, k)[0]), number(lambda c, k=k: kink(c, k)[1]), below)
            for k in range(most)
        ]

    def change(self, scene: Scene) -> None:
        self.network, self.stopped = self._part_of(scene), None
        super().change(scene)

    # -- forms ------------------------------------------------------------------------------------------------------

    def kinematics(self) -> tuple[Expr, Expr, Expr | None, Expr | None, Expr | None]:
        """(r, T, strain, r_t, r_tt) as UFL; the last two are None in statics."""
        parts, r_t, r_tt = ufl.split(self.w), None, None
        if self.dynamic:
            r_t = self.gamma_v * parts[0] + ufl.split(self.history_v)[0]
            r_tt = self.gamma_a * parts[0] + ufl.split(self.history_a)[0]
        e = form.strain(self.cable, parts[2] if self.mean_dofs is not None else parts[1], parts[0], r_t)
        return parts[0], parts[1], e, r_t, r_tt

    def water_forces(self) -> list[tuple[effects.Effect, Expr]]:
        """[(effect, force per stretched length [N/m] as UFL)] of the effects of the scene."""
        r, _, _, r_t, r_tt = self.kinematics()
        return self._forces_of_water(self.cable, r, form.Point(form.tangent(r), r_t, r_tt))

    def wet_part(self) -> Expr | None:
        """Submerged fraction of the line; None if forces of the water do not end at the surface."""
        if not self._surfaces:
            return None
        r, (points, _) = self.kinematics()[0], compat.interval_quadrature(self._degree)
        return form.wet_part(self.cable, self.water_at(r), r, ufl.CellVolume(self.mesh) / len(points))

    def weight(self) -> list[Expr]:
        """`forms.cable.weight` [N/m]."""
        return form.weight(self.cable, self.gravity, self.sea.density, self.wet_part())

    def _waves_at_points(self):
        """Points where an irregular sea is sampled; empty without one."""
        if self.sea.kinematics is None:
            return []
        cells = self.mesh.topology.index_map(1).size_local
        V, dofs = compat.collapse(self.space, 0)
        blocks = compat.cell_dofs(V)[:cells]
        places = np.asarray(dofs).reshape(-1, 3)[blocks]
        degree = self.dx.metadata()["quadrature_degree"]
        points = on_line(self.mesh, degree, self.w, (places, self.node_s[blocks]))
        return [self.sea.kinematics.add(points)]

    def residual(self, test: Expr) -> ufl.Form:
        """Eq. (11) tested with `test`, without forces at ends; in statics without inertia, added mass and waves."""
        tests, cable = ufl.split(test), self.cable
        r, T, e, r_t, r_tt = self.kinematics()
        v, q = tests[:2]
        strain = form.strain_equation(r, e, q, self.section.strain_form)
        if self.parting is not None:
            strain = self.parting.strain_equation(strain, T, q)
        F = form.tension_term(r, T, e, v) + strain
        F -= sum(ufl.inner(force, v) for force in self.weight())
        if self.mean_dofs is not None:
            F += form.mean_strain_equation(T, ufl.split(self.w)[2], tests[2])
        if self.moment_dofs is not None:
            m, p = ufl.split(self.w)[-1], tests[-1]
            E0 = self.typical_EI
            t = form.tangent(r)
            if self.bending_damping is not None:
                t += self.bending_damping * bending.turning(r, r_t)
            F += bending.shear_term(r, m, v) + bending.curvature_equation(t, m, self.EI, E0, p, self.share_of_bending)
            if self.blended:
                F += bending.blended_terms(r, m, self.EI, ufl.CellVolume(self.mesh), E0, v, p)
        if self.dynamic:
            F += form.inertia(cable, r_tt, v)
        forces = [force for _, force in self.water_forces()]
        if forces:
            f = sum(forces[1:], forces[0])
            F -= ufl.inner(form.stretched(cable, e, f), v)
        if self.bed is not None:
            for _, force in self.bed.forces():
                F -= ufl.inner(force, v)
        if self.relaxation is not None:
            F += form.inertia(cable, self.relaxation * (r - ufl.split(self.reference)[0]), v)
        return F * self.dx

    def end_residuals(self, test: Expr) -> list[ufl.Form]:
        """The last term of (11)_1 for loaded free ends, and the terms of ends with a direction, each as a separate
        form."""
        tests = ufl.split(test)
        found = [coupling.end_force(load, tests[0]) * self.end_measure(k, 1) for k, load in self.end_loads.items()]
        if self.moment_dofs is not None:
            m = ufl.split(self.w)[-1]
            for (k, i), (t_b, spring) in self.clamps.items():
                t_b = self.share_of_bending * bending.direction(t_b, m, spring, i)
                found.append(bending.end_direction(t_b, self.typical_EI, tests[-1], i) * self.end_measure(k, i))
        return found

    # -- time -------------------------------------------------------------------------------------------------------

    def evolutions(self) -> list[Evolution]:
        """Evolution of r, of second order in time; T is not a state."""
        L, g = self.longest, max(self.scene.gravity, 1.0)
        sizes = []
        for size in (L, np.sqrt(g * L)):
            sizes.append(np.full(len(self.w.x.array), np.inf))
            sizes[-1][self.node_dofs] = size
        return [Evolution(self.part, self.rates, False, sizes)]

    def clock(self, time: np.ndarray, u: np.ndarray) -> list[Callable]:
        """Functions that update the sea, and in u the prescribed ends, to time[0]."""
        tops = [(dofs, self.pieces[k].ends[i].top, (k, i)) for k, i, dofs in self.held_ends() if len(dofs)]
        own = [(dofs, motion_of(top) if top.kind == "prescribed" else top.position, end) for dofs, top, end in tops]
        ends = [(dofs, self.driven.get(end, motion)) for dofs, motion, end in own]
        now = time if self.stopped is None else self.stopped
        wound = self.winch.clock(now) if self.winch else []
        return [*self.sea.clock(time), *held(ends, now, u[self.part.slice]), *self._turning(now), *wound]

    def follow_water(self, system: System) -> None:
        super().follow_water(system)
        if self.winch is not None:
            self.winch.follow(system)

    def publish_lengths(self, time: float) -> None:
        """Update the lengths of winches to a time, for forms that no System evaluates."""
        if self.winch is not None:
            self.winch.publish(time)

    def _turning(self, now):
        """Functions that update the directions of ends with prescribed rotation."""
        damping = [c.bending_damping if self.dynamic else 0.0 for c in self.sections]
        ends = [
            (t_b, direction_of(self.pieces[k].ends[i].clamp, damping[k])) for (k, i), (t_b, _) in self.clamps.items()
        ]

        def turn(constant, direction):
            constant.value[:] = direction(now.item())

        return [partial(turn, *end) for end in ends if end[1] is not None]

    def begin(self, u: np.ndarray) -> None:
        if self.growth is not None:
            self.growth.begin(u)
        super().begin(u)

    def when_accepted(self, time: np.ndarray, u: np.ndarray) -> list:
        found = super().when_accepted(time, u)
        return found + ([lambda: self.parting.accept(u, time.item())] if self.parting is not None else [])

    def stop(self, time: np.ndarray) -> None:
        """Stop moving ends at their positions at this time."""
        self.stopped = time

    # -- numbers ----------------------------------------------------------------------------------------------------

    def weight_of(self, line: int) -> float:
        """Submerged weight per unstretched length of a piece, including its mean marine growth [N/m]."""
        if self.growth is not None:
            return self.growth.weight_per_length(line)
        return weight_per_length(self.scene, self.sections[line])

    @property
    def parted_at(self) -> np.ndarray:
        """Times at which this rank's elements parted [s]; nan for intact ones."""
        return np.full(len(self.line_of_cell), np.nan) if self.parting is None else self.parting.of_elements

    def grounded(self, u: np.ndarray, line: int = 0) -> GroundedLength:
        """Grounded length of a piece, on every rank."""
        return self.bed.grounded(u, line)

    def blocks(self, length: float, force: float) -> list[Block]:
        L, h, first = self.longest, self.smallest_cell, self.part.offset
        moving = max(c.line_density for c in self.sections) * h * L
        blocks = [
            Block("cable position", first + self.node_dofs.ravel(), L, force, moving, 2, unit="m"),
            Block("cable tension", first + self.T_dofs.ravel(), force, h, rounding=moving, unit="N"),
        ]
        if self.mean_dofs is not None:
            means = first + self.mean_dofs
            blocks.append(Block("cable mean tension", means, force, force * h, rounding=moving, unit="N"))
        if self.moment_dofs is not None:
            # Rows are angles times EI.  In statics 0.01 and 1 make some lines diverge; in dynamics rounding counts, and
            # with 1 these rows dominate the residual left by a kept matrix, so that the line search shortens steps.
            EI, share = float(self.typical_EI.value), 30.0 if self.dynamic else 0.1
            # Measured rounding error of EI r'': 4 EI L over the square of the node spacing.
            dofs, between = first + self.moment_dofs.ravel(), h / max(c.position_degree for c in self.sections)
            noise = 10 * EI * L / between**2 if self.dynamic else 0.0
            # In statics, the moment at a clamp of a line straightened by a typical tension.
            clamped = not self.dynamic and any(end.clamp for piece in self.pieces for end in piece.ends)
            size = max(EI / L, math.sqrt(EI * force) if clamped else 0.0)
            blocks.append(Block("cable moment", dofs, size, EI * share, of_shape=noise, unit="N m"))
        return blocks

    def one_sided_rows(self, force: float) -> OneSidedRows:
        """Rows of the tension for the tension-only law; `force` is a typical tension [N]."""
        c, owned = self.section, self.space.dofmap.index_map.size_local
        sizes = np.broadcast_to(np.diff(self.cell_ends), self.T_dofs.shape)
        mine = (self.T_dofs < owned) & self.one_sided[:, None]
        density, stiffness = (
            np.broadcast_to(np.array([getattr(c, name) for c in self.sections])[self.line_of_cell][:, None], mine.shape)
            for name in ("line_density", "axial_stiffness")
        )
        return OneSidedRows(
            rows=self.T_dofs[mine],
            weights=sizes[mine] / (c.tension_degree + 1),
            inertia=density[mine] * (sizes[mine] / c.position_degree) ** 2 if self.dynamic else None,
            compliance=1 / stiffness[mine],
            rest=1 / np.minimum(stiffness[mine], 0.1 * force),  # measured: the fewest iterations
        )
