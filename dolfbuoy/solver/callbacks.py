"""Functions in C that PETSc's Newton method calls: residual, Jacobian and stopping rule of a System.

What C remembers from call to call stands in one struct, `numbers`, which Python reads and changes as well.
"""

from petsc4py import PETSc

from .c_code import address, check, core
from .vector_ops import Work


class Callbacks:
    """The C functions for a System, and the context that they get; it must live as long as the SNES."""

    def __init__(self, system) -> None:
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
        self._alive = [system, order]
        if system.numbering.ghosted is None:
            for name, numbers in zip(("begins", "columns"), system.A.getValuesCSR(), strict=False):
                self._alive.append(numbers)
                setattr(c, name, ffi.cast("PetscInt *", numbers.ctypes.data))
        if system.law is not None:
            c.law = system.law.described

    @staticmethod
    def _vector(vector):
        return core().ffi.cast("Vec", 0 if vector is None else vector.handle)

    def read(self, x: PETSc.Vec) -> None:
        """Scaled free unknowns -> `u` of the System."""
        check(core().lib.read_solution(self._context, self._vector(x)))

    def make_residual(self, f: PETSc.Vec) -> None:
        """The latest residual of the System -> scaled rows."""
        check(core().lib.make_residual(self._context, self._vector(f)))

    def hand_to(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec, increment: PETSc.Vec) -> None:
        """Let a SNES call them.  x, f, increment: vectors of its own."""
        c = self._context
        c.snes, c.x = core().ffi.cast("SNES", snes.handle), self._vector(x)
        c.f, c.increment = self._vector(f), self._vector(increment)
        check(core().lib.install(c))

    def work(self, name: str) -> Work:
        """A function of newton.c: `attempt`, `judge_solve` or `improve`."""
        return Work(name, self._context, self)
