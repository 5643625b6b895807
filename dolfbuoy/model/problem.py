"""A scene as one nonlinear system: the cable on all ranks, the buoy on the rank that owns the cable's upper end."""

from functools import partial

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..errors import InputError
from ..meshes import number_of_cells
from ..parallel.ranks import combined, told
from ..solver.system import System
from ..solver.tension_only import TensionOnlySystem
from ..solver.unknowns import Block, Part
from .buoy import BuoyModel
from .lines import TOP, CableModel


def _check_ranks(scene, comm):
    """dolfinx cannot work with a rank that has no cell."""
    if scene.cable is None:
        return
    count = number_of_cells(scene.cable.elements)
    if comm.size > count:
        raise InputError(f"cable.elements = {count}: fewer elements than the {comm.size} MPI ranks of this run.")


class Problem:
    """Cable, buoy and the system that couples them.

    Unknowns of a rank: [cable | mooring (6) | state of the buoy (13, statics 7)], each only if the scene has it.
    """

    def __init__(self, scene, dynamic, comm=MPI.COMM_WORLD):
        self.scene, self.dynamic, self.comm = scene, dynamic, comm
        self.route = None  # how the equilibrium was found
        _check_ranks(scene, comm)
        self.cable = CableModel(comm, scene, dynamic) if scene.cable else None
        self.buoy_rank = self._find_buoy_rank()
        comm.barrier()  # forms of the cable are compiled by all ranks together, those of the buoy by one
        self.buoy = BuoyModel(scene, dynamic) if scene.buoy and comm.rank == self.buoy_rank else None
        parts, residuals = self._parts()
        direct = "petsc" if dynamic else "mumps"
        solver = scene.solver
        smooth = self.cable is None or scene.cable.slack == "compressive"  # else rows change with what is slack
        keep = dynamic and smooth and solver.keep_jacobian
        self.system = self._law()(
            comm, parts, residuals, self._blocks(), *self._order(), direct, solver.petsc, solver.step_tolerance, keep
        )
        if self.cable and smooth and self.cable.cable.EA is not None and not (dynamic and scene.cable.damping):
            self.system.fault = self._inside_out

    def _law(self):
        """The kind of system: with a tension-only cable the rows of its tension are one-sided."""
        if self.cable is None or self.scene.cable.slack == "compressive":
            return System
        return partial(TensionOnlySystem, self.cable, self.typical_force)

    def _inside_out(self):
        """What is wrong if 1 + T/EA < 0 somewhere: |r'| = |1 + e| has that root too.  None if nothing is."""
        c = self.cable
        T = self.system.u.take(c.T_dofs if c.mean_dofs is None else c.mean_dofs)
        smallest = combined(self.comm, T.min(initial=0.0), MPI.MIN)
        stretch = 1 + smallest / float(c.cable.EA.value) if smallest < 0 else 1.0
        return None if stretch >= 0 else f"the cable tension turns an element inside out, to a stretch of {stretch:.3g}"

    def _find_buoy_rank(self):
        if self.cable is None:
            return 0
        tags = self.cable.ends
        owned = tags.indices[tags.values == TOP] < self.cable.mesh.topology.index_map(0).size_local
        holders = self.comm.allgather(bool(np.any(owned)))
        return holders.index(True)

    def _parts(self):
        parts, residuals, offset = [], [], 0
        self.cable_part = self.mooring_part = self.state_part = None
        if self.cable:
            self.cable_part = Part("cable", self.cable.w, 0)
            parts.append(self.cable_part)
            residuals.append((self.cable_part, self.cable.residual(self.cable_part.test, self.dynamic)))
            offset = self.cable_part.size
            if self.cable.mooring is not None:
                part = Part("mooring", self.cable.mooring, offset)
                parts.append(part)
                residuals.append((part, self.cable.attachment(part.test)))
        self.mooring_slice = slice(offset, offset + 6) if self.scene.cable and self.scene.buoy else None
        if self.buoy:
            if self.mooring_slice:
                self.mooring_part = Part("mooring on the axis", self.buoy.mooring, offset)
                parts.append(self.mooring_part)
                offset += 6
            self.state_part = Part("buoy", self.buoy.state, offset)
            parts.append(self.state_part)
            residuals.extend(self.buoy.residuals(self.state_part, self.mooring_part))
        return parts, residuals

    def _blocks(self):
        blocks, force = [], self.typical_force
        if self.cable:
            blocks += self.cable.blocks(force)
        if self.scene.buoy:
            if self.buoy:
                length = self.scene.cable.length if self.scene.cable else None
                mooring = self.mooring_slice.start if self.mooring_slice else None
                mine = self.buoy.blocks(self.state_part.offset, mooring, length, force)
                self.comm.bcast([b.name for b in mine], root=self.buoy_rank)
            else:  # the same names on every rank, for messages
                names = self.comm.bcast(None, root=self.buoy_rank)
                mine = [Block(name, np.zeros(0, int), 1.0, 1.0) for name in names]
            blocks += mine
        return blocks

    @property
    def typical_force(self) -> float:
        """Size of a tension in this scene [N], for scaling."""
        scene, sizes = self.scene, [1e-6]
        if scene.cable:
            c = scene.cable
            sizes += [abs(self.cable.weight_per_length) * c.length, c.line_density * c.length]
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
        level = (c.axial_stiffness * (self.cable.weight_per_length * c.length) ** 2 / 24) ** (1 / 3)  # and just taut
        return max(c.axial_stiffness * strain, level if strain > -1e-6 else 0.0)

    def _order(self):
        """Elimination order of the free owned unknowns, and the ghosts' (local, global) numbers."""
        order, ghosts = np.zeros(0, int), None
        if self.cable:
            order = self.cable.elimination_order()
        if self.buoy:
            order = np.concatenate([order, np.arange(self.state_part.slice.start, self.state_part.slice.stop)])
            if self.mooring_slice:
                order = np.concatenate([order, np.arange(self.mooring_slice.start, self.mooring_slice.stop)])
        if self.cable and self.comm.size > 1:
            ghosts = self._ghost_numbers(order)
        return order, ghosts

    def _ghost_numbers(self, order):
        first = self.comm.scan(len(order)) - len(order)
        n = self.cable.space.dofmap.index_map.size_local
        number = fem.Function(self.cable.space)
        number.x.array[:] = -1
        mine = order < n
        number.x.array[order[mine]] = first + np.flatnonzero(mine)
        number.x.scatter_forward()
        ghosts = np.arange(n, self.cable_part.size)
        return ghosts, number.x.array[ghosts].astype(np.int64)

    # -- time --------------------------------------------------------------------------------------------------------

    def set_time(self, t):
        """Advance everything that is given as a function of time; constrained values go into `system.u`."""
        for model in (self.cable, self.buoy):
            if model is not None:
                model.sea.set_time(t)
        if self.cable:
            self.cable.constrain(self.system.u, t)

    # -- numbers ------------------------------------------------------------------------------------------------------

    def smallest_tension(self) -> float:
        """Smallest element mean of T [N], over all ranks."""
        means = self.cable.mean_tension(self.system.u)
        return combined(self.comm, means.min(initial=np.inf), MPI.MIN)

    def end_tension(self, fresh=True):
        """T_bnd, the force that holds the cable's top end [N], on every rank.

        Of a fixed or prescribed top it is the reaction: the residual of Eq. (11)_1 at the end node.  With
        fresh = False the residual is the one that Newton evaluated last.
        """
        if self.mooring_slice:
            mine = -self.system.u[self.mooring_slice][3:] if self.buoy else None
            return told(self.comm, mine, self.buoy_rank)
        if self.cable.top_kind == "free":
            return np.array(self.scene.cable.top.force)
        residual = self.system.evaluate() if fresh else self.system.last_residual
        mine = residual[self.cable.top_dofs] if len(self.cable.top_dofs) else np.zeros(3)
        return combined(self.comm, mine, MPI.SUM)

    def anchor_tension(self) -> float:
        """T_h(0) [N], on every rank."""
        mine = self.cable.anchor_tension(self.system.u)
        values = [mine] if self.comm.size == 1 else self.comm.allgather(mine)
        return next(v for v in values if not np.isnan(v))

    def destroy(self):
        self.system.destroy()
