"""C functions called by PETSc's Newton method: residual, Jacobian and stopping rule of a System.

Their state between calls is in one struct, `numbers`, which Python reads and changes as well.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from petsc4py import PETSc

from . import Array
from .c_code import address, check, core
from .vector_ops import Work, in_a_row

if TYPE_CHECKING:
    from .system import System


class Callbacks:
    """The C functions for a System, and their context; it must live as long as the SNES."""

    def __init__(self, system: "System") -> None:
        ffi, order = core().ffi, system.order
        self.numbers = ffi.new("numbers *")
        self._context = c = ffi.new("newton *")
        c.numbers, c.failed = self.numbers, address(system.hooks.failed)
        c.residuals, c.jacobians = system.add_residuals.described, system.add_jacobians.described
        c.unknowns, c.rows = system.scaled_unknowns.described, system.scaled_residual.described
        c.matrix, c.ghosted = ffi.cast("Mat", system.A.handle), self._vector(system.numbering.ghosted)
        if system.numbering.elimination is not None:
            c.elimination = ffi.cast("IS", system.numbering.elimination.handle)
        c.row_scale, c.unknown_scale = address(system.row_scales), address(system.unknown_scales)
        c.row_scales, c.unknown_scales = (self._vector(v) for v in (system.row_vector, system.unknown_vector))
        self._alive: list[Any] = [system, order]
        if system.numbering.ghosted is None:
            for name, numbers in zip(("begins", "columns"), system.A.getValuesCSR(), strict=False):
                self._alive.append(numbers)
                setattr(c, name, ffi.cast("PetscInt *", numbers.ctypes.data))
        if system.law is not None:
            c.law = system.law.described

    @staticmethod
    def _vector(vector: Any) -> Any:
        return core().ffi.cast("Vec", 0 if vector is None else vector.handle)

    def read(self, x: PETSc.Vec) -> None:
        """Scaled free unknowns -> `u` of the System."""
        check(core().lib.read_solution(self._context, self._vector(x)))

    def make_residual(self, f: PETSc.Vec) -> None:
        """The latest residual of the System -> scaled rows."""
        check(core().lib.make_residual(self._context, self._vector(f)))

    def hand_to(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec, increment: PETSc.Vec) -> None:
        """Install the functions in a SNES; x, f, increment: its vectors."""
        c = self._context
        c.snes, c.x = core().ffi.cast("SNES", snes.handle), self._vector(x)
        c.f, c.increment = self._vector(f), self._vector(increment)
        check(core().lib.install(c))

    def work(self, name: str) -> Work:
        """A function of newton.c: `attempt`, `judge_solve` or `renew_matrix`."""
        return Work(name, self._context, self)

    def improving(self, enough: float, most: int) -> Work:
        """Function that takes increments from `u` with the present matrix, until one is not larger than `enough`.

        In units of the unknowns, and at most `most` of them; `numbers.improved` is then true if one was small enough.
        In rows of fixed and tied unknowns the residual then includes the last increment, linearised.
        """
        system: System = self._alive[0]
        increment = np.zeros_like(system.u)
        unknowns = system.scaled_unknowns.of(increment)
        found = core().ffi.new("increments *", {"newton": self._context, "enough": enough, "most": most})
        found.unknowns, found.increment = unknowns.described[0], address(increment)
        self._put_ends(found.ends)
        return Work("improve", found, (self, unknowns, increment))

    def _put_ends(self, ends: Any) -> None:
        """Set the entries of the Jacobian in rows from which end forces are read."""
        entries = self._alive[0].entries_of_ends
        ends.count = len(entries[0])
        ends.places, ends.of_rows, ends.of_columns = map(address, entries)

    def improving_tangent(self, residual: Array, change: Array, enough: float, rough: float) -> Work:
        """Function that subtracts from `change` the increment for `residual`, with the present matrix.

        Both are for local unknowns.  `numbers.improved` is then true if the next increment is expected to be at most
        `enough` times the change, or `quiet` typical sizes (in the context, initially 0); or if increments no longer
        decrease and this one was at most `rough` times the change, or ten times `quiet`.
        In rows of fixed and tied unknowns `residual` is updated to its value after the increment.
        """
        increment, system = np.zeros_like(change), self._alive[0]
        rows, unknowns = system.scaled_residual.of(residual), system.scaled_unknowns.of(increment)
        arrays = {"residual": residual, "change": change, "increment": increment}
        found = core().ffi.new("tangent *", {name: address(array) for name, array in arrays.items()})
        found.newton, found.rows, found.unknowns = self._context, rows.described[0], unknowns.described[0]
        found.enough, found.rough, found.rate = enough, rough, 1.0
        self._put_ends(found.ends)
        return Work("improve_tangent", found, (self, rows, unknowns, arrays))

    def until_improved(self, increment: Work, functions: Sequence[Work], most: int) -> Work:
        """Function that calls these, including `increment`, until `numbers.improved`, at most `most` times."""
        found, row = core().ffi.new("improvement *"), in_a_row(functions)
        found.tangent, found.works, found.most = increment.context, row.context, most
        return Work("improve_until", found, (increment, row))
