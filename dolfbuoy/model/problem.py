"""A scene as one nonlinear system: its lines on all ranks, each buoy on the rank that owns an end of a line there."""

import gc
from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ..elsewhere import MPI
from ..parallel.ranks import allreduce, bcast
from ..scene import Scene
from ..scene.network import attached_ends
from ..solver.loops import Loop
from ..solver.newton import Newton
from ..solver.numbering import Numbering
from ..solver.system import System
from ..solver.tension_only import TensionOnly
from ..solver.unknowns import Block, Part
from ..solver.vector_ops import smallest, together
from .attachment import Attachment
from .bodies import Bodies
from .buoy import Buoy
from .connectivity import Joining
from .feasible import check_size
from .interface import Evolution
from .line_groups import lines_of
from .rigid import weight_per_length
from .structure import structure_of
from .take_off import OnBuoy, TakeOff
from .wet_hull import SUBMERGED
from .winch import Winch

#: Number of problems between garbage collections, each of which takes a quarter of the time of a problem.
COLLECTED = 16


#: With bending: if one iteration reduces the residual by this factor and the next not at all, rounding is reached; for
#: long lines the rounding of angles is so large that increments with a kept matrix stay above the tolerance.
FAST = 1e-4
#: With bending a matrix is more expensive: it is kept after a solve of fewer iterations than this.
MANY = 5


class Problem:
    """Lines, bodies at their joints, buoys, their attachments, and the system that couples them.

    Unknowns of a rank: [lines | bodies (3 each) | take-offs (3 or 6 at each end) | attachments (6 each) | state of each
    buoy (13, statics 7)], each only if the scene, and for bodies and buoys this rank, has it.  scene: may be changed by
    `change`.  driven: prescribed motions of buoys by name, which are then not unknowns: the residual of their rows is
    the force and moment that produces the motion.
    """

    lines: Any  #: Lines or LineGroups; None without cables
    bodies: Any  #: Bodies; None without any, and on all ranks but the first
    take_offs: list[Any]  #: each TakeOff, on the first rank
    buoys: dict[str, Any]  #: name -> Buoy of this rank
    attachments: list[Any]  #: one Attachment for each end of a line on a buoy
    route: str | None  #: how the equilibrium was found
    iterations: int  #: number of Newton iterations, as counted in statics
    destroyed = 0  #: problems of this process

    def __init__(
        self,
        scene: Scene,
        dynamic: bool,
        comm: MPI.Comm = MPI.COMM_WORLD,
        driven: Mapping[str, Callable[[float], tuple[np.ndarray, ...]]] = MappingProxyType({}),
    ):
        self.scene, self.dynamic, self.comm = scene, dynamic, comm
        self.network = scene.network
        self.time, self._advance = np.zeros(1), None  #: time of all prescribed functions [s]
        self.route = None
        check_size(scene, comm)
        self.lines = lines_of(comm, scene, dynamic)
        comm.barrier()  # forms of the lines are compiled by all ranks together, those of the buoys by one
        self.bodies = Bodies(scene, dynamic) if self.network.bodies and comm.rank == 0 else None
        #: Name of each buoy -> its rank, and on that rank the Buoy.
        self.buoy_ranks = self._ranks()
        mine = (name for name, rank in self.buoy_ranks.items() if rank == comm.rank)
        self.buoys = {name: Buoy(scene, name, dynamic) for name in mine}
        for name in self.buoys.keys() & driven.keys():
            self.buoys[name].motion = driven[name]
        self.attachments = []
        for piece, end in attached_ends(self.network):
            held = self.network.pieces[piece].ends[end]
            buoy, rank = self.buoys.get(held.name), self.buoy_ranks[held.name]
            offset = buoy and (buoy.offset_of(held.fairlead) if held.fairlead else buoy.offset)
            self.attachments.append(Attachment(self.lines, piece, end, rank, buoy, offset))
        devices = self.network.take_offs if comm.rank == 0 else ()
        self.take_offs = [TakeOff(scene, name, dynamic, self.buoys) for name in devices]
        self._at_ends = {(a.piece, a.end): a for a in self.attachments}
        #: Models of this rank, each with its evolutions, memory and forces.
        models = (self.lines, self.bodies, *self.take_offs, *self.buoys.values())
        self.models = [model for model in models if model is not None]
        parts = self._number()
        one_sided = any(piece.section.slack == "tension-only" for piece in self.network.pieces)
        self.law = TensionOnly(self.lines.one_sided_rows(self.typical_force)) if one_sided else None
        size = max((p.offset + p.size for p in parts), default=0)
        numbering = Numbering(comm, size, *Joining(self).numbers())
        tolerance = scene.solver.step_tolerance
        self._wet_forms = [buoy.wet_hull_form() for buoy in self.buoys.values() if buoy.hull]
        equations, blocks = self.residuals(), self._blocks()
        kind = structure_of(scene, mesh=False), dynamic, comm.rank, comm.size, *sorted(driven)
        self.system = System(parts, equations, blocks, numbering, tolerance, self.law, self._wet_forms, kind=kind)
        for model in self.models:
            model.follow_water(self.system)
        keep = dynamic and not one_sided and scene.solver.keep_jacobian  # one-sided rows change as elements go slack
        self.newton = Newton(self.system, "petsc" if dynamic else "mumps", scene.solver.petsc, keep)
        if self.network.bends:
            self.newton.numbers.fast, self.newton.numbers.many = FAST, MANY
        if self.lines and self.lines.turnable.any():
            of_cells = self.lines.T_dofs if self.lines.mean_dofs is None else self.lines.mean_dofs
            self._least = np.zeros(1)
            self._find_least = smallest(self.system.u, [of_cells], 0.0, self._least)
            self._bearable = self._pushed_half_flat()
            self.newton.fault = self._inside_out

    @cached_property
    def wet_hulls(self) -> Loop:
        """Submerged part of each buoy of this rank, and the water above it, from all `Buoy.wet_hull_form`s."""
        numbers = [fem.Function(form.arguments()[0].ufl_function_space()) for form in self._wet_forms]
        parts = [Part("wet hull", function, k * SUBMERGED) for k, function in enumerate(numbers)]
        return self.system.functional(zip(self._wet_forms, parts, strict=True))

    @property
    def samples_once(self) -> bool:
        """True if waves are summed only once per time, at the first evaluation of the forms."""
        waves = self.scene.waves
        return bool(waves and waves.summed and waves.kinematics != "exact")

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _pushed_half_flat(self):
        """Tension at which the softest element is compressed to half its length [N]."""
        found = [c for g in self.lines.groups for c, turns in zip(g.sections, g.turnable, strict=True) if turns]
        return -0.5 * min(float(c.axial_stiffness) for c in found)

    def _inside_out(self):
        """Message if 1 + T/EA < 0 in some element, a spurious root of |r'| = |1 + e|; else None."""
        self._find_least()
        if allreduce(self.comm, self._least[0], MPI.MIN) >= self._bearable:
            return None
        stretch = allreduce(self.comm, self.lines.smallest_stretch(self.system.u), MPI.MIN)
        return None if stretch >= 0 else f"the cable tension turns an element inside out, to a stretch of {stretch:.3g}"

    @property
    def buoy(self) -> Buoy | None:
        """The first buoy of this rank; None without any."""
        return next(iter(self.buoys.values()), None)

    def _ranks(self):
        """The rank of each buoy: the owner of the first line's end there; for buoys with take-offs the first rank."""
        first = {}
        for piece, end in attached_ends(self.network):
            first.setdefault(self.network.pieces[piece].ends[end].name, (piece, end))
        owned = {name: self.comm.allgather(self.lines.owns_end(*end)).index(True) for name, end in first.items()}
        owned |= {end.name: 0 for device in self.network.take_offs.values() for end in device.ends}
        return {name: owned.get(name, 0) for name in self.network.buoys}

    def attached_to(self, buoy: Buoy) -> list[Attachment]:
        """Attachments of a Buoy of this rank."""
        return [attachment for attachment in self.attachments if attachment.buoy is buoy]

    def take_offs_on(self, buoy: Buoy) -> list[OnBuoy]:
        """Ends of take-offs on a Buoy of this rank."""
        return [end for device in self.take_offs for end in device.on(buoy)]

    def _number(self):
        """Assign places to the unknowns; returns the parts of this rank."""
        parts, offset = [], 0

        def add(model, name, function):
            nonlocal offset
            model.part = Part(name, function, offset)
            parts.append(model.part)
            offset += model.part.size

        for lines in self.lines.groups if self.lines else ():
            add(lines, "cable", lines.w)
        if self.bodies:
            add(self.bodies, "bodies", self.bodies.state)
        for device in self.take_offs:
            parts += device.number(offset)
            offset = device.slice.stop
        for attachment in self.attachments:
            parts += attachment.number(offset)
            offset = attachment.whole.stop
        for buoy in self.buoys.values():
            add(buoy, "buoy", buoy.state)
        return parts

    def residuals(self) -> list[tuple[Part, ufl.Form]]:
        """All equations of this rank, [(part of the test function, linear form), ...]."""
        found = []
        for lines in self.lines.groups if self.lines else ():
            test, r = lines.part.test, lines.kinematics()[0]
            attached = [attachment for attachment in self.attachments if attachment.lines is lines]
            forces = [attachment.end_force(ufl.split(test)[0]) for attachment in attached]
            found += [(lines.part, form) for form in (lines.residual(test), *forces, *lines.end_residuals(test))]
            found += [(attachment.line_part, attachment.position_equation(r)) for attachment in attached]
            for clamp in (attachment.clamp for attachment in attached if attachment.clamp):
                m = ufl.split(lines.w)[-1]
                found.append((lines.part, clamp.end_direction(m, ufl.split(test)[-1])))
                found.append((clamp.line_part, clamp.moment_equation(m)))
        if self.bodies:
            found.append((self.bodies.part, self.bodies.residual(self.bodies.part.test)))
        for buoy in self.buoys.values():
            found += buoy.residuals(self.attached_to(buoy), self.take_offs_on(buoy))
        for device in self.take_offs:
            found += device.residuals()
        return found

    def _blocks(self):
        """Blocks of this rank; for messages, those of bodies and buoys exist by name on every rank."""
        force, length = self.typical_force, self.lines.longest if self.lines else 0.0
        blocks = self.lines.blocks(length, force) if self.lines else []
        found = [(0, self.bodies and self.bodies.blocks(length, force))] if self.network.bodies else []
        for name, rank in self.buoy_ranks.items():
            mine = None
            if (buoy := self.buoys.get(name)) is not None:
                mine, sizes = buoy.blocks(length, force), (*buoy.reach_and_force(length, force), buoy.mass.mass)
                held = (*self.attached_to(buoy), *self.take_offs_on(buoy))
                mine += [block for attachment in held for block in attachment.blocks(*sizes)]
            found.append((rank, mine))
        for rank, mine in found:
            names = self.comm.bcast([b.name for b in mine] if mine else None, root=rank)
            blocks += mine or [Block(name, np.zeros(0, int), 1.0, 1.0) for name in names]
        return blocks

    @property
    def typical_force(self) -> float:
        """Size of a tension in this scene [N], for scaling."""
        scene, sizes = self.scene, [1e-6]
        for piece in self.network.pieces:
            c = piece.section
            weight = abs(weight_per_length(scene, c)) * c.length
            sizes += [weight, c.line_density * c.length]
            if piece.ends[1].top is not None:
                sizes += [float(np.linalg.norm(piece.ends[1].top.force)), _stretching_force(piece, weight)]
        for body in self.network.bodies.values():
            displaced = scene.sea.density * body.volume if scene.sea else 0.0
            sizes.append(abs(body.mass - displaced) * scene.gravity)
        sizes += [abs(device.section.pretension) for device in self.network.take_offs.values()]
        for buoy in self.network.buoys.values():
            sizes.append(buoy.mass * scene.gravity)
            if buoy.external_force:
                sizes.append(float(np.linalg.norm(buoy.external_force.force)))
        return max(sizes)

    def change(self, scene: Scene) -> None:
        """Take the numbers of another scene, without recompiling or rebuilding anything.

        Raises ValueError if the scenes differ in more than numbers (`structure.structure_of`).
        """
        if structure_of(scene) != structure_of(self.scene):
            raise ValueError("the scenes differ in more than numbers")
        self.scene, self.network, self._advance = scene, scene.network, None
        for model in self.models:
            model.change(scene)
        if self.law is not None:
            self.law.resize(self.lines.one_sided_rows(self.typical_force))
        if self.lines and self.lines.turnable.any():
            self._bearable = self._pushed_half_flat()
        self.system.blocks[:] = self._blocks()
        self.newton.forget()

    # -- time --------------------------------------------------------------------------------------------------------

    def set_time(self, t: float) -> None:
        """Set everything prescribed over time to a time; prescribed unknowns are written to `system.u`."""
        self.time[0] = t
        if self._advance is None:
            self._advance = together(*self.clock())
        self._advance()

    def clock(self) -> list[Callable]:
        """Functions that do so for `time`, valid until a `change`."""
        return [function for model in self.models for function in model.clock(self.time, self.system.u)]

    def drive(self, piece: int, end: int, motion: Callable[[float], np.ndarray]) -> None:
        """Prescribe the motion of a fixed end of a piece (0 at s = 0, 1 at s = L): t -> its position [m]."""
        lines, number = self.lines.holder(piece)
        lines.driven[number, end] = motion
        self._advance = None

    def wind(self, piece: int, length: Callable[[float], float]) -> None:
        """Prescribe the unstretched length [m] of a piece as a function of time."""
        lines, number = self.lines.holder(piece)
        if lines.winch is None:
            lines.winch = Winch(lines)
            lines.winch.follow(self.system)
        lines.winch.driven[number] = length
        self._advance = None

    def stop_ends(self) -> None:
        """Stop all moving ends at their present positions."""
        for model in (*([self.lines] if self.lines else []), *self.take_offs):
            model.stop(self.time.copy())
        self._advance = None

    def when_accepted(self) -> list[Callable]:
        """Functions called after an accepted step to `time`; they return whether the equations have changed."""
        return [function for model in self.models for function in model.when_accepted(self.time, self.system.u)]

    def evolutions(self) -> list[Evolution]:
        """Evolutions of the models of this rank, in the order of the unknowns."""
        return [evolution for model in self.models for evolution in model.evolutions()]

    def places(self) -> np.ndarray:
        """Coordinates of the unknowns of this rank, which identify the numbering of a resumed state."""
        return np.concatenate([model.places() for model in self.models] or [np.zeros(0)])

    def force_dofs(self) -> np.ndarray:
        """Local unknowns that are tensions, or forces at attachments."""
        found = [np.zeros(0, dtype=int), *(model.force_dofs() for model in self.models)]
        mine = [a for a in self.attachments if a.rank == self.comm.rank]
        found += [a.dofs().force for a in mine] + [a.clamp.dofs().moment for a in mine if a.clamp]
        return np.concatenate(found)

    # -- numbers ------------------------------------------------------------------------------------------------------

    def smallest_tension(self, of_rods: bool = True) -> float:
        """Smallest element mean of T [N], over all ranks; of_rods: include elements that are stable without tension."""
        means = self.lines.mean_tension(self.system.u)
        means = means if of_rods else means[~self.lines.keeps_shape]
        return allreduce(self.comm, means.min(initial=np.inf), MPI.MIN)

    def end_force(self, piece: int, end: int, fresh: bool = True) -> np.ndarray:
        """The force that holds an end of a piece of line [N], on every rank; at a joint its share of the sum there.

        At a fixed end or a joint it is the reaction including all loads and inertia of the element there: the residual
        of Eq. (11)_1 at that node.  With fresh = False the last residual evaluated by Newton is used.
        """
        holder = self.network.pieces[piece].ends[end]
        if holder.kind == "buoy":
            attachment = self._at_ends[piece, end]
            mine = -attachment.of(self.system.u).force if attachment.buoy else None
            return bcast(self.comm, mine, attachment.rank)
        if holder.kind == "free":
            return np.array(holder.top.force)
        residual = self.system.evaluate() if fresh else self.system.last_residual
        owned = self.lines.end_dofs[piece][end] if self.lines.owns_end(piece, end) else []
        return allreduce(self.comm, residual[owned] if len(owned) else np.zeros(3), MPI.SUM)

    def end_tension(self, fresh: bool = True, cable: int = 0) -> np.ndarray | None:
        """T_bnd, the force that holds the upper end of a cable [N], on every rank; None without lines."""
        return None if self.lines is None else self.end_force(self.network.last_of(cable), 1, fresh)

    def anchor_force(self, fresh: bool = True, cable: int = 0) -> np.ndarray | None:
        """The force that holds s = 0 of a cable [N], on every rank; None without lines."""
        return None if self.lines is None else self.end_force(self.network.first_of(cable), 0, fresh)

    def end_forces(self, fresh: bool = True) -> dict[str, np.ndarray]:
        """Forces that hold the ends of each cable [N], (cable, 3), by their names in a record."""
        if self.lines is None:
            return {}
        if fresh:
            self.system.evaluate()
        ends, cables = {"anchor_force": self.anchor_force, "end_tension": self.end_tension}, self.network.cables
        return {name: np.array([get(False, k) for k in range(len(cables))]) for name, get in ends.items()}

    def anchor_tension(self, cable: int = 0) -> float:
        """T_h(0) of a cable [N], on every rank."""
        mine = self.lines.anchor_tension(self.system.u, self.network.first_of(cable))
        values = [mine] if self.comm.size == 1 else self.comm.allgather(mine)
        return next(v for v in values if not np.isnan(v))

    def tension_at(self, s: float, line: int = 0) -> float:
        """Mean of T on the element of a line at arc length s [N], on every rank."""
        begins, ends = (self.lines.cell_ends - self.lines.begins[line]).T
        here = (self.lines.line_of_cell == line) & (begins <= s) & (s <= ends)
        mine = self.lines.mean_tension(self.system.u)[here].max(initial=-np.inf)
        return allreduce(self.comm, float(mine), MPI.MAX)

    def destroy(self) -> None:
        """Free PETSc objects, and occasionally collect reference cycles.

        Python does not collect them by itself: objects created in a `quick_start` never count as new.
        """
        self.newton.destroy()
        Problem.destroyed += 1
        if Problem.destroyed % COLLECTED == 0 and gc.isenabled():
            gc.collect()


def _stretching_force(piece, weight):
    """Tension of an elastic line whose ends are at least its length apart [N]; else 0."""
    c, (low, high) = piece.section, piece.ends
    if low.top is None or high.top is None or high.top.position is None or np.isinf(c.axial_stiffness):
        return 0.0
    strain = float(np.linalg.norm(np.subtract(high.top.position, low.top.position))) / c.length - 1
    level = (c.axial_stiffness * weight**2 / 24) ** (1 / 3)  # when just taut
    return max(c.axial_stiffness * strain, level if strain > -1e-6 else 0.0)
