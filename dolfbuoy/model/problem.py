"""A scene as one nonlinear system: the lines on all ranks, the buoy on the rank that owns the line's upper end."""

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..errors import InputError
from ..meshes import number_of_cells
from ..parallel.ranks import combined, told
from ..solver.newton import Newton
from ..solver.numbering import Numbering
from ..solver.rows import smallest
from ..solver.system import System
from ..solver.tension_only import TensionOnly
from ..solver.unknowns import Block, Part
from .attachment import Attachment
from .buoy import Buoy
from .lines import Lines
from .structure import structure_of


def _check_ranks(scene, comm):
    """dolfinx cannot work with a rank that has no cell."""
    if scene.cable is None:
        return
    count = number_of_cells(scene.cable.elements)
    if comm.size > count:
        raise InputError(
            f"cable.elements = {count}: must be at least the number of MPI ranks of this run, {comm.size}."
        )


class Problem:
    """Lines, buoy, their attachments, and the system that couples them.

    Unknowns of a rank: [lines | attachments (6 each) | state of the buoy (13, statics 7)], each only if the scene has
    it.  scene: may be changed by `change`.  lines: instead of those of the scene (`lines.Line`).
    """

    def __init__(self, scene, dynamic, comm=MPI.COMM_WORLD, lines=None):
        self.scene, self.dynamic, self.comm = scene, dynamic, comm
        self.route = None  # how the equilibrium was found
        _check_ranks(scene, comm)
        self.lines = Lines(comm, scene, dynamic, lines) if scene.cable else None
        self.buoy_rank = self._find_buoy_rank()
        comm.barrier()  # forms of the lines are compiled by all ranks together, those of the buoy by one
        self.buoy = Buoy(scene, dynamic) if scene.buoy and comm.rank == self.buoy_rank else None
        self.attachments = self._attach()
        #: Models of this rank, each with its evolutions, memory and forces.
        self.models = [model for model in (self.lines, self.buoy) if model is not None]
        parts = self._number()
        one_sided = self.lines is not None and scene.cable.slack == "tension-only"
        self.law = TensionOnly(self.lines.one_sided_rows(self.typical_force)) if one_sided else None
        order, ghosts = self._order()
        numbering = Numbering(comm, max((p.offset + p.size for p in parts), default=0), order, ghosts)
        tolerance = scene.solver.step_tolerance
        noted = [self.buoy.wet_hull_form()] if self.buoy and self.buoy.hull else []
        self.system = System(parts, self.residuals(), self._blocks(), numbering, tolerance, self.law, noted)
        for model in self.models:
            model.follow_water(self.system)
        keep = dynamic and not one_sided and scene.solver.keep_jacobian  # one-sided rows change with what is slack
        self.newton = Newton(self.system, "petsc" if dynamic else "mumps", scene.solver.petsc, keep)
        if self.lines and not one_sided and self.lines.elastic and not (dynamic and scene.cable.damping):
            of_cells = self.lines.T_dofs if self.lines.mean_dofs is None else self.lines.mean_dofs
            self._smallest_tension = smallest(self.system.u, of_cells, 0.0)
            self.newton.fault = self._inside_out

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _inside_out(self):
        """What is wrong if 1 + T/EA < 0 somewhere: |r'| = |1 + e| has that root too.  None if nothing is."""
        T = combined(self.comm, self._smallest_tension(), MPI.MIN)
        stretch = 1 + T / self._softest() if T < 0 else 1.0
        return None if stretch >= 0 else f"the cable tension turns an element inside out, to a stretch of {stretch:.3g}"

    def _softest(self):
        """Smallest axial stiffness as the forms have it at the moment [N]."""
        EA = self.lines.cable.EA
        return float(EA.value if isinstance(EA, fem.Constant) else EA.x.array.min())

    def _find_buoy_rank(self):
        if self.lines is None:
            return 0
        tags = self.lines.ends
        owned = tags.indices[tags.values == 2] < self.lines.mesh.topology.index_map(0).size_local
        holders = self.comm.allgather(bool(np.any(owned)))
        return holders.index(True)

    def _attach(self):
        """Tops of lines that are on the buoy."""
        if self.lines is None:
            return []
        tops = [k for k, line in enumerate(self.lines.lines) if line.top(self.scene) == "buoy"]
        return [Attachment(self.lines, 2 * k + 2, self.buoy, self.buoy and self.buoy.offset) for k in tops]

    def _number(self):
        """Give the unknowns their places; returns the parts of this rank."""
        parts, offset = [], 0
        if self.lines:
            self.lines.part = Part("cable", self.lines.w, offset)
            parts.append(self.lines.part)
            offset += self.lines.part.size
        for attachment in self.attachments:
            attachment.number(offset)
            parts += [part for part in (attachment.line_part, attachment.body_part) if part]
            offset += attachment.line_part.size
        if self.buoy:
            self.buoy.part = Part("buoy", self.buoy.state, offset)
            parts.append(self.buoy.part)
        return parts

    def residuals(self):
        """All equations of this rank, [(part that is tested, linear form), ...]."""
        found = []
        if self.lines:
            found.append((self.lines.part, self.lines.residual(self.lines.part.test, self.attachments)))
            r = self.lines.kinematics()[0]
            found += [(attachment.line_part, attachment.position_equation(r)) for attachment in self.attachments]
        if self.buoy:
            found += self.buoy.residuals(self.attachments)
        return found

    def _blocks(self):
        blocks, force = [], self.typical_force
        if self.lines:
            blocks += self.lines.blocks(force)
        if self.scene.buoy:
            if self.buoy:
                mine = self._buoy_blocks(force)
                self.comm.bcast([b.name for b in mine], root=self.buoy_rank)
            else:  # the same names on every rank, for messages
                names = self.comm.bcast(None, root=self.buoy_rank)
                mine = [Block(name, np.zeros(0, int), 1.0, 1.0) for name in names]
            blocks += mine
        return blocks

    def _buoy_blocks(self, force):
        length = self.lines.longest if self.lines else 0.0
        blocks = self.buoy.blocks(length, force)
        for attachment in self.attachments:
            blocks += attachment.blocks(*self.buoy.reach_and_force(length, force), self.buoy.mass.mass)
        return blocks

    @property
    def typical_force(self) -> float:
        """Size of a tension in this scene [N], for scaling."""
        scene, sizes = self.scene, [1e-6]
        if scene.cable:
            c = scene.cable
            sizes += [abs(self.lines.weight_per_length) * c.length, c.line_density * c.length]
            if c.top is not None:
                sizes += [float(np.linalg.norm(c.top.force)), self._stretching_force()]
        if scene.buoy:
            sizes.append(scene.buoy.mass * scene.gravity)
        if scene.external_force:
            sizes.append(float(np.linalg.norm(scene.external_force.force)))
        return max(sizes)

    def _stretching_force(self):
        """Tension of an elastic cable whose ends are farther apart than its length, or just as far [N]."""
        c = self.scene.cable
        if c.top.position is None or np.isinf(c.axial_stiffness):
            return 0.0
        strain = float(np.linalg.norm(np.subtract(c.top.position, self.scene.anchor))) / c.length - 1
        level = (c.axial_stiffness * (self.lines.weight_per_length * c.length) ** 2 / 24) ** (1 / 3)  # and just taut
        return max(c.axial_stiffness * strain, level if strain > -1e-6 else 0.0)

    def _order(self):
        """Elimination order of the free owned unknowns, and the ghosts' (local, global) numbers."""
        order, ghosts = np.zeros(0, int), None
        if self.lines:
            order = self.lines.elimination_order()
        if self.buoy:
            behind = [self.buoy.part.slice, *(attachment.slice for attachment in self.attachments)]
            order = np.concatenate([order, *(np.arange(place.start, place.stop) for place in behind)])
        if self.lines and self.comm.size > 1:
            ghosts = self._ghost_numbers(order)
        return order, ghosts

    def _ghost_numbers(self, order):
        first = self.comm.scan(len(order)) - len(order)
        n = self.lines.space.dofmap.index_map.size_local
        number = fem.Function(self.lines.space)
        number.x.array[:] = -1
        mine = order < n
        number.x.array[order[mine]] = first + np.flatnonzero(mine)
        number.x.scatter_forward()
        ghosts = np.arange(n, self.lines.part.size)
        return ghosts, number.x.array[ghosts].astype(np.int64)

    def change(self, scene):
        """Take the numbers of another scene, for which nothing has to be compiled or built anew.

        Raises ValueError if the scenes differ in more than numbers (`structure.structure_of`).
        """
        if structure_of(scene) != structure_of(self.scene):
            raise ValueError("the scenes differ in more than numbers")
        self.scene = scene
        for model in self.models:
            model.change(scene)
        if self.law is not None:
            self.law.resize(self.lines.one_sided_rows(self.typical_force))
        self.system.blocks[:] = self._blocks()
        self.newton.forget()

    # -- time --------------------------------------------------------------------------------------------------------

    def set_time(self, t):
        """Advance everything that is given as a function of time; constrained values go into `system.u`."""
        for model in self.models:
            model.set_time(t)
        if self.lines:
            self.lines.constrain(self.system.u, t)

    def evolutions(self):
        """What the models of this rank tell time stepping, in the order of the unknowns."""
        return [evolution for model in self.models for evolution in model.evolutions()]

    def places(self):
        """Where the unknowns of this rank sit, by which a state that is taken up again knows its numbering."""
        return np.concatenate([model.places() for model in self.models] or [np.zeros(0)])

    def force_dofs(self):
        """Local unknowns that are tensions, or forces at attachments."""
        found = [np.zeros(0, dtype=int), *(model.force_dofs() for model in self.models)]
        if self.buoy:
            found += [a.force_dofs() for a in self.attachments]
        return np.concatenate(found)

    # -- numbers ------------------------------------------------------------------------------------------------------

    def smallest_tension(self) -> float:
        """Smallest element mean of T [N], over all ranks."""
        means = self.lines.mean_tension(self.system.u)
        return combined(self.comm, means.min(initial=np.inf), MPI.MIN)

    def end_tension(self, fresh=True, line=0):
        """T_bnd, the force that holds the upper end of a line [N], on every rank; None without lines.

        Of a fixed or prescribed top it is the reaction: the residual of Eq. (11)_1 at the end node.  With
        fresh = False the residual is the one that Newton evaluated last.
        """
        if self.lines is None:
            return None
        kind = self.lines.lines[line].top(self.scene)
        if kind == "buoy":
            mine = -self.attachment_of(line).of(self.system.u).force if self.buoy else None
            return told(self.comm, mine, self.buoy_rank)
        if kind == "free":
            return np.array(self.lines.sections[line].top.force)
        return self._reaction(self.lines.top_dofs(line), fresh)

    def anchor_force(self, fresh=True, line=0):
        """The force that holds s = 0 of a line [N], on every rank; None without lines.

        The reaction, with all that acts on the first element and moves it: the residual of Eq. (11)_1 at that node.
        With fresh = False the residual is the one that Newton evaluated last.
        """
        return None if self.lines is None else self._reaction(self.lines.anchor_dofs(line), fresh)

    def _reaction(self, dofs, fresh):
        """Residual at three dofs that are given, empty where another rank has them [N]."""
        residual = self.system.evaluate() if fresh else self.system.last_residual
        return combined(self.comm, residual[dofs] if len(dofs) else np.zeros(3), MPI.SUM)

    def end_forces(self, fresh=True) -> dict[str, np.ndarray]:
        """Forces that hold the ends of the cable [N], by their names in a record; empty without one."""
        if self.lines is None:
            return {}
        return {"anchor_force": self.anchor_force(fresh), "end_tension": self.end_tension(fresh)}

    def attachment_of(self, line) -> Attachment:
        """The attachment of a line's upper end."""
        return next(a for a in self.attachments if a.tag == 2 * line + 2)

    def anchor_tension(self, line=0) -> float:
        """T_h(0) of a line [N], on every rank."""
        mine = self.lines.anchor_tension(self.system.u, line)
        values = [mine] if self.comm.size == 1 else self.comm.allgather(mine)
        return next(v for v in values if not np.isnan(v))

    def tension_at(self, s, line=0) -> float:
        """Mean of T on the element of a line at arc length s [N], on every rank."""
        begins, ends = (self.lines.cell_ends - self.lines.begins[line]).T
        here = (self.lines.line_of_cell == line) & (begins <= s) & (s <= ends)
        mine = self.lines.mean_tension(self.system.u)[here].max(initial=-np.inf)
        return combined(self.comm, float(mine), MPI.MAX)

    def destroy(self):
        """Give PETSc's objects back."""
        self.newton.destroy()
