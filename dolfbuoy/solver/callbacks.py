"""What PETSc's Newton method calls, in C: residual, Jacobian and stopping rule of a `newton.Newton` on one rank.

Each says the same as the method of that name in `newton.Newton`, to the last bit: that one is the oracle, and what
several ranks use.  What both remember from call to call stands in one place, `numbers`, which Python reads as well.
"""

import numpy as np
from petsc4py import PETSc

from .c_code import address, check, core
from .vector_ops import Work

#: PETSc's reason DIVERGED_FNORM_NAN, or DIVERGED_FUNCTION_NANORINF since 3.25.
NOT_FINITE = -4


class Number:
    """Attribute of an object whose `numbers` are those that C has: the one of the same name, whatever underscore."""

    def __set_name__(self, owner, name):
        self._name = name.lstrip("_")

    def __get__(self, instance, owner=None):
        return getattr(instance.numbers, self._name)

    def __set__(self, instance, value):
        setattr(instance.numbers, self._name, value)


def new_numbers():
    """Numbers that Python and C share; a `Newton` fills them in."""
    return core().ffi.new("numbers *")


class Callbacks:
    """The C functions for a System on one rank, and the context that they get; it must live as long as the SNES.

    numbers: of `new_numbers`.
    """

    def __init__(self, system, numbers) -> None:
        self._alive = [system, numbers]
        c, ffi = self._new("newton"), core().ffi
        self._context = c
        c.numbers, c.assembled, c.failed = numbers, address(system.assemblies), address(system.hooks.failed)
        c.residuals, c.jacobians = system.add_residuals.described, system.add_jacobians.described
        c.unknowns, c.rows = system.scaled_unknowns.described, system.scaled_residual.described
        c.matrix = ffi.cast("Mat", system.A.handle)
        begins, columns, _ = system.A.getValuesCSR()
        c.begins, c.columns = self._numbers(begins), self._numbers(columns)
        c.row_scale, c.unknown_scale = address(system.row_scales), address(system.unknown_scales)
        self._alive += [system.row_scales, system.unknown_scales]
        if system.law is not None:
            c.law = self._one_sided(system.law)

    def hand_to(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        """Let a SNES call them.  x, f: its vectors."""
        ffi = core().ffi
        self._context.snes, self._context.x = ffi.cast("SNES", snes.handle), ffi.cast("Vec", x.handle)
        check(core().lib.install(self._context, ffi.cast("Vec", f.handle)))

    def solving(self) -> list[Work]:
        """The functions of a `Newton` for its attempts, and for judging one."""
        return [Work(name, self._context, self) for name in ("attempt", "judge_solve")]

    def _one_sided(self, law):
        described = self._new("one_sided")
        described.count, described.diagonal = len(law.rows), core().ffi.cast("Vec", law.diagonal.handle)
        described.rows, described.zeroed = self._numbers(law.rows), self._numbers(np.zeros_like(law.rows))
        for name in ("places", "c", "u", "slack", "slack_before"):
            self._alive.append(getattr(law, name))
            setattr(described, name, address(self._alive[-1]))
        return described

    def _new(self, kind):
        made = core().ffi.new(f"{kind} *")
        self._alive.append(made)
        return made

    def _numbers(self, array: np.ndarray):
        """Pointer to integers of PETSc."""
        array = np.ascontiguousarray(array, dtype=PETSc.IntType)
        self._alive.append(array)
        return core().ffi.cast("PetscInt *", array.ctypes.data)
