"""The damped Newton method of a System: PETSc SNES with line search, and the C functions of `callbacks`.

The Jacobian is exact but need not be current: with the matrix and factorisation of an earlier iteration or step,
convergence is linear instead of quadratic.  Such an iteration costs at most a third of one with a new matrix, so
keeping the matrix pays while the convergence factor is small.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from petsc4py import PETSc

from ..errors import InputError, SolveError
from .c_code import check, core
from .vector_ops import copies, together

if TYPE_CHECKING:
    from .system import System

_EXTERNAL_LIBRARY = 76  # PETSc's error code if a library such as MUMPS reports an error
_UNKNOWN_TYPE = 86  # PETSc's error code for an unknown solver or preconditioner
_ACCURACY = 1e-8  # required accuracy of a checked linear solve
_SOLVES = 1, 5  # largest number of linear solves: unchecked, checked
_SLOW = 0.1  # convergence factor above which a new matrix is computed
_MOST = 50  # largest number of iterations of a solve
_MANY = 4  # number of iterations of a solve after which the next one begins with a new matrix
_EVERYWHERE = 10_000_000  # unknowns up to which each of several ranks factorises the whole matrix
_MARGIN = 0.01  # fraction of the tolerance required with a kept matrix, because convergence is only linear


class SolverOptions:
    """Line search and the scene's own PETSc options (solver.petsc), with a separate prefix for each system.

    The scene's stay in the database until a solve has ended: solvers within a preconditioner read theirs that late.
    """

    def __init__(self, scene: dict[str, Any] | None = None) -> None:
        self.scene = dict(scene or {})
        self._in_database: list[str] = []
        # a number in a prefix makes PETSc look up every option twice
        self._prefix = f"dolfbuoy_{''.join(chr(ord('a') + int(digit)) for digit in str(id(self)))}_"

    def apply(self, snes: Any) -> None:
        """Apply the options to a SNES.  Raises InputError if PETSc refuses them."""
        db, options = PETSc.Options(), {"snes_linesearch_type": "bt", **self.scene}
        snes.setOptionsPrefix(self._prefix)
        self._in_database = [self._prefix + key for key in options]
        for key, value in zip(self._in_database, options.values(), strict=True):
            db[key] = None if value is True else value  # a flag has no value
        try:
            snes.setFromOptions()
        except PETSc.Error as error:
            self.forget()
            raise self.refused(error) from None
        if not self.scene:
            self.forget()

    def forget(self) -> None:
        """Remove the options from PETSc's database."""
        while self._in_database:
            del PETSc.Options()[self._in_database.pop()]

    def refused(self, error: Any) -> InputError:
        """InputError for a PETSc error."""
        return InputError(f"solver.petsc = {self.scene}: PETSc refuses it (error {error.ierr}).")


class Newton:
    """Solves a `System` from the values in its `u`.

    direct: PETSc's package for the factorisation on one rank; "petsc" (natural ordering, no pivoting) falls back to
    "mumps" if a solve is not accurate.  Several ranks each factorise the whole matrix in the same way, unless there are
    so many unknowns that the factors must be distributed, by MUMPS.  options: the scene's PETSc options.
    keep_jacobian: use a matrix for several iterations and steps.
    """

    def __init__(
        self,
        system: "System",
        direct: str,
        options: dict[str, Any] | None,
        keep_jacobian: bool,
    ) -> None:
        self.system, self.options = system, SolverOptions(options)
        self.iterations_total = self.fallbacks = 0
        numbers = self.numbers = system.callbacks.numbers  #: shared with C
        numbers.linear_tolerance, numbers.linear_solves = _ACCURACY, _SOLVES
        numbers.tolerance, numbers.own_options = system.tolerance, bool(self.options.scene)
        numbers.keep, numbers.slow, numbers.margin, numbers.many = keep_jacobian, _SLOW, _MARGIN, _MANY
        self.fault: Callable[[], str | None] = lambda: None  # fault of a solution that is not a physical state
        self.everywhere = system.comm.size > 1 and not options and system.numbering.unknowns <= _EVERYWHERE
        self.direct = direct if system.comm.size == 1 or self.everywhere else "mumps"
        self.x = system.numbering.vector()
        self._f, self._increment, before = self.x.duplicate(), self.x.duplicate(), np.zeros_like(system.u)
        self._go_back = copies([(system.u, before)])
        self.snes = snes = PETSc.SNES().create(system.comm)
        system.callbacks.hand_to(snes, self.x, self._f, self._increment)
        # The stopping rule updates Jacobians: SNES would look up a dozen options each time.
        check(core().lib.SNESSetLagJacobian(core().ffi.cast("SNES", snes.handle), -1))
        snes.setType("newtonls")
        snes.setTolerances(rtol=0, atol=0, stol=0, max_it=_MOST)
        self.choose_solver(self.direct)
        attempt, judge = (system.callbacks.work(name) for name in ("attempt", "judge_solve"))
        #: The first part of `solve`, without decisions.
        self.begin = together(copies([(before, system.u)]), system.read_given, attempt, judge, system.publish)
        self._again = together(self._go_back, attempt, system.publish)

    def choose_solver(self, package: str) -> None:
        """Solve linear systems with a factorisation of this package, unless the scene's options say otherwise."""
        ksp = self.snes.getKSP()
        ksp.reset()
        self.numbers.valid = False  # a kept matrix is lost with its factorisation
        pc, natural = ksp.getPC(), package == "petsc"
        if self.everywhere:
            check(core().lib.factorise_everywhere(core().ffi.cast("PC", pc.handle), package.encode(), natural))
        else:
            pc.setType("lu")
            pc.setFactorSolverType(package)
            if natural:
                pc.setFactorOrdering("natural")
        # Richardson with an exact factorisation: one solve, a check of its residual, refinement if it is not small.  C
        # omits the check for a kept matrix, whose factorisation was checked when it was new: Newton itself refines.
        ksp.setType("richardson")
        self.numbers.checked = True
        ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        ksp.setTolerances(rtol=_ACCURACY, atol=0, max_it=_SOLVES[True])
        self.options.apply(self.snes)

    def set_scales(self, gamma: float) -> None:
        """Scale the system for a step with d/dt ~ gamma."""
        if self.system.set_scales(gamma):
            self.numbers.valid = False  # the present matrix has the old gamma and scales

    def forget(self) -> None:
        """Discard scales and matrix because the equations have changed."""
        self.system.gamma, self.numbers.valid = None, False
        self.set_scales(1.0)

    # -- use --------------------------------------------------------------------------------------------------------

    def solve(self) -> int:
        """Damped Newton from the values in `u` of the system; returns the number of iterations.

        `u` holds the solution afterwards, or what it held before if SolveError is raised.
        """
        self.begin()
        return self.end()

    def approach(self, most: int) -> tuple[int, bool]:
        """Take at most `most` iterations from `u`, which then holds the result; returns their number, and whether it is
        a solution.

        Raises SolveError, with `u` restored, if a linear system has no solution.
        """
        self.snes.setTolerances(rtol=0, atol=0, stol=0, max_it=most)
        try:
            self.begin()
            if self.numbers.in_order:
                return int(self.numbers.iterations), True
            iterations, reason = self._checked()
        finally:
            self.snes.setTolerances(rtol=0, atol=0, stol=0, max_it=_MOST)
        stopped = PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT, PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH
        if reason not in stopped:
            self._go_back()
            self.system.publish()
            raise SolveError("no step of Newton's method was found")
        return iterations, self._stalled_at_rounding(reason)

    def end(self) -> int:
        """The second part of `solve`: retries after failure, and a check that the solution is physical."""
        iterations: int = self.numbers.iterations
        fault: str | None = None
        if self.options.scene:
            self.options.forget()
        if not self.numbers.in_order:
            iterations, fault = self._solve_as_best()
        self.iterations_total += iterations
        fault = fault or self.fault()
        if fault:
            self._go_back()
            self.system.publish()
            raise SolveError(fault)
        return iterations

    def _solve_as_best(self) -> tuple[int, str | None]:
        """(iterations, fault or None), with the present matrix, else with new ones, else with pivoting."""
        iterations, reason = self._checked()
        if reason < 0 and self.numbers.keep:  # perhaps only the matrix was too old
            self.numbers.keep = self.numbers.valid = False
            try:
                more, reason = self._run()
            finally:
                self.numbers.keep = True
            iterations += more
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE and self.direct == "petsc":
            self.fallbacks += 1
            self.choose_solver("mumps")
            more, reason = self._run()
            iterations += more
            self.choose_solver(self.direct)
        self.numbers.valid &= self.numbers.keep and iterations < _MANY
        if reason >= 0 or self._stalled_at_rounding(reason):
            return iterations, None
        names = {v: k for k, v in vars(PETSc.SNES.ConvergedReason).items() if isinstance(v, int)}
        sizes = self.system.residual_by_block()
        worst = max(sizes, key=lambda name: sizes[name] if np.isfinite(sizes[name]) else np.inf)
        return iterations, f"{names.get(reason, reason)} after {iterations} iterations, largest residual in {worst}"

    def _run(self) -> tuple[int, int]:
        self._again()
        return self._checked()

    def _checked(self) -> tuple[int, int]:
        """Iterations and reason of the latest attempt.  Raises exceptions of hooks, and PETSc errors."""
        self.options.forget()
        error, reason = self.numbers.error, self.numbers.reason
        if error:
            if error not in (_UNKNOWN_TYPE, _EXTERNAL_LIBRARY):
                raise PETSc.Error(error)
            if error == _UNKNOWN_TYPE:
                raise self.options.refused(PETSc.Error(error))
            reason = PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE:
            self.choose_solver(self.direct)  # MUMPS does not recover from a singular matrix by itself
        self.system.hooks.check()  # raised only after a solve has ended
        return self.numbers.iterations, reason

    def _stalled_at_rounding(self, reason: int) -> bool:
        """True if the line search failed because the residual has reached rounding level: Newton's increment is
        tiny."""
        if reason != PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH:
            return False
        increment = self.x.duplicate()
        self.snes.computeFunction(self.x, self._f)
        self.snes.getKSP().solve(self._f, increment)
        size = increment.norm(PETSc.NormType.NORM_INFINITY)
        increment.destroy()
        return bool(size <= 100 * self.system.tolerance)

    # -- interruption -------------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """The matrix kept for the next solve, if any (values of this rank), and its gamma."""
        values = self.system.A.getValuesCSR()[2] if self.numbers.valid else None
        return {"gamma": self.system.gamma, "matrix": values, "fallbacks": self.fallbacks}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue with the matrix of `state`."""
        self.fallbacks, self.numbers.valid = state["fallbacks"], False
        if self.system.gamma != state["gamma"]:
            self.system.gamma = None  # scales of a nearly equal step would be kept, and differ by rounding
        self.set_scales(state["gamma"])
        if state.get("matrix") is None:
            return
        A = self.system.A
        rows, columns, _ = A.getValuesCSR()
        A.setValuesCSR(rows, columns, state["matrix"])
        A.assemble()
        numbers = self.numbers
        numbers.valid, numbers.kept, numbers.assembled_for = True, False, numbers.assembled

    def destroy(self) -> None:
        """Free PETSc objects, including those of the system."""
        self.options.forget()
        for item in (self.snes, self.x, self._f, self._increment, self.system):
            item.destroy()
