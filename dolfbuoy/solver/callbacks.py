"""What PETSc's Newton method calls, in C: residual, Jacobian and stopping rule of a `newton.Newton` on one rank.

Each says the same as the method of that name in `newton.Newton`, to the last bit: that one is the oracle, and what
several ranks use.  What both remember from call to call stands in one place, `numbers`, which Python reads as well.
PETSc's functions are handed over as pointers, found in the library that petsc4py has loaded.
"""

import ctypes

import numpy as np
from petsc4py import PETSc

from . import loops, petsc_library
from .callbacks_c import compiled
from .rows import Work

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
    reason, norm = PETSc.SNES.ConvergedReason, PETSc.KSP.NormType
    numbers = compiled().ffi.new("numbers *")
    numbers.iterating, numbers.converged = reason.ITERATING, reason.CONVERGED_SNORM_RELATIVE
    numbers.not_finite, numbers.too_many = NOT_FINITE, reason.DIVERGED_MAX_IT
    numbers.linear_norm = [norm.NONE, norm.UNPRECONDITIONED]
    return numbers


class Callbacks:
    """The C functions for a System on one rank, and the context that they get; it must live as long as the SNES.

    numbers: of `new_numbers`.
    """

    def __init__(self, system, numbers):
        self._library, self._alive = compiled(), [system, numbers]
        self._context = self._new("newton")
        c = self._context
        c.petsc, c.numbers = self._petsc(), numbers
        c.assembled, c.failed = self._pointer(system.assemblies), self._pointer(system.hooks.failed)
        for name in ("add_up", "put", "take"):
            self._set_function(c, name, loops.function(name))
        for described, loop in ((c.residuals, system.add_residuals), (c.jacobians, system.add_jacobians)):
            self._fill(described, loop.arguments)
        for described, entries in ((c.unknowns, system.scaled_unknowns), (c.rows, system.scaled_residual)):
            self._fill(described, entries.arguments)
        c.matrix, c.n = self._cast(system.A.handle), len(system.order)
        begins, columns, _ = system.A.getValuesCSR()
        scales = system.row_scales, system.unknown_scales
        self._alive += [begins, columns]
        c.begins, c.columns, c.row_scale, c.unknown_scale = map(self._pointer, (begins, columns, *scales))
        if system.law is not None:
            c.law = self._one_sided(system.law)

    def hand_to(self, snes, f, A):
        """Let PETSc call them.  f: for the residual.  A: matrix of the System."""
        pointers = [ctypes.c_void_p(thing.handle) for thing in (snes, f, A)]
        snes, f, A = pointers
        context = self._number(self._context)
        functions = (self._number(self._library.ffi.addressof(self._library.lib, name)) for name in _CALLED)
        residual, jacobian, converged = functions
        petsc_library.call("SNESSetFunction", snes, f, residual, context)
        petsc_library.call("SNESSetJacobian", snes, A, A, jacobian, context)
        petsc_library.call("SNESSetConvergenceTest", snes, converged, context, None)

    def solving(self, snes, x):
        """The functions of a `Newton` for its attempts, and for judging one, with a SNES and its vector x."""
        c = self._context
        c.snes, c.x = self._cast(snes.handle), self._cast(x.handle)
        return [Work.of(self._library, name, c, self) for name in ("attempt", "judge_solve")]

    def _petsc(self):
        functions = self._new("petsc")
        for name, _ in self._library.ffi.typeof("petsc").fields:
            self._set_function(functions, name, petsc_library.address(name))
        return functions

    def _one_sided(self, law):
        described = self._new("one_sided")
        described.count, described.diagonal = len(law.rows), self._cast(law.diagonal.handle)
        zeroed = np.zeros_like(law.rows)
        self._alive.append(zeroed)
        arrays = {"rows": law.rows, "places": law.places, "c": law.c, "u": law.u, "slack": law.slack}
        for name, array in (arrays | {"slack_before": law.slack_before, "zeroed": zeroed}).items():
            setattr(described, name, self._pointer(array))
        return described

    def _new(self, kind):
        self._alive.append(self._library.ffi.new(f"{kind} *"))
        return self._alive[-1]

    def _fill(self, described, values):
        ffi = self._library.ffi
        for (name, field), value in zip(ffi.typeof(described).fields, values, strict=True):
            setattr(described, name, ffi.cast(field.type, value))

    def _set_function(self, described, name, place):
        ffi = self._library.ffi
        fields = dict(ffi.typeof(described[0]).fields)
        setattr(described, name, ffi.cast(fields[name].type, place))

    def _pointer(self, array):
        return self._cast(array.ctypes.data)

    def _cast(self, place):
        return self._library.ffi.cast("void *", place)

    def _number(self, pointer):
        return ctypes.c_void_p(int(self._library.ffi.cast("uintptr_t", pointer)))


_CALLED = "residual", "jacobian", "converged"
