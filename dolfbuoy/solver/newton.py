"""The damped Newton method of a System: PETSc SNES with line search.

The Jacobian is exact, but need not be of today: while Newton's increments shrink fast with the matrix and the
factorisation of an earlier iteration or step, these are kept (`JacobianAge`).  On one rank PETSc calls the functions in
C of `callbacks`, which do the same as those here.
"""

import numpy as np
from petsc4py import PETSc

from ..errors import InputError, SolveError
from .c_code import check, core
from .callbacks import NOT_FINITE, Callbacks, Number, new_numbers
from .vector_ops import copies, together

_EXTERNAL_LIBRARY = 76  # PETSc's error code when MUMPS or its like reports one
_UNKNOWN_TYPE = 86  # ... when there is no solver or preconditioner of a name
_ACCURACY = 1e-8  # of a linear solve that is checked
_SOLVES = 1, 5  # at most: without a check, with one
_NORMS = PETSc.KSP.NormType.NONE, PETSc.KSP.NormType.UNPRECONDITIONED


class JacobianAge:
    """When the matrix of an earlier iteration or step still serves.

    With a kept matrix Newton's increments shrink by a factor instead of squaring.  Such an iteration costs a third of
    one with a new matrix, or less, so that keeping it pays while the factor is small.
    """

    SLOW = 0.1  #: shrinking of the increments from which on a new matrix is due
    MANY = 4  #: iterations of a solve after which the next one begins with a new matrix
    MARGIN = 0.01  #: part of the tolerance that has to be met, as the last increment does not square the error

    keep = Number()
    valid = Number()  #: the matrix at hand may be used
    kept = Number()  #: ... and is not that of the present iterate

    def __init__(self, keep, numbers):
        self.numbers = numbers
        self.keep, self.valid, self.kept = keep, False, False
        numbers.slow, numbers.margin, numbers.many = self.SLOW, self.MARGIN, self.MANY

    def assembled(self):
        """The matrix at hand is now that of the present iterate."""
        self.valid, self.kept = True, False

    def judge(self, ratio):
        """The increment was `ratio` times the one before it."""
        self.valid = self.keep and ratio <= self.SLOW

    def judge_solve(self, iterations):
        """A solve has ended."""
        self.valid = self.valid and self.keep and iterations < self.MANY


class SolverOptions:
    """Line search and the scene's own PETSc options (solver.petsc), under a prefix of one system's own.

    The scene's stay in the database until a solve has ended: solvers within a preconditioner read theirs only then.
    """

    def __init__(self, scene=None):
        self.scene, self._in_database = dict(scene or {}), []
        # a number in a prefix makes PETSc look up every option twice
        self._prefix = f"dolfbuoy_{''.join(chr(ord('a') + int(digit)) for digit in str(id(self)))}_"

    def apply(self, snes):
        """Let a SNES read them.  Raises InputError for what PETSc refuses."""
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

    def forget(self):
        """Take them out of PETSc's database."""
        while self._in_database:
            del PETSc.Options()[self._in_database.pop()]

    def refused(self, error):
        """InputError for an error of PETSc."""
        return InputError(f"solver.petsc = {self.scene}: PETSc refuses it (error {error.ierr}).")


def reason_name(reason):
    """PETSc's name of a SNES reason."""
    names = {v: k for k, v in vars(PETSc.SNES.ConvergedReason).items() if isinstance(v, int)}
    return names.get(reason, str(reason))


class Newton:
    """Solves a `System` from the values in its `u`.

    direct: PETSc's package for the factorisation on one rank; "petsc" (natural ordering, no pivoting) falls back to
    "mumps" when a solve is not accurate; several ranks take "mumps".  options: the scene's own for PETSc.
    keep_jacobian: use a matrix for several iterations and steps.
    """

    in_c = True  #: on one rank PETSc calls functions in C, which do the same as `residual`, `jacobian` and `converged`

    residuals_total, jacobians_total = Number(), Number()
    _assembled_for, _last_increment, _last_norm = Number(), Number(), Number()

    def __init__(self, system, direct="mumps", options=None, keep_jacobian=False):
        self.system, self.options = system, SolverOptions(options)
        self.iterations_total = self.fallbacks = 0
        self.numbers = new_numbers()  # what C reads and changes too
        self.numbers.linear_tolerance, self.numbers.linear_solves = _ACCURACY, _SOLVES
        self.numbers.tolerance, self.numbers.own_options = system.tolerance, bool(self.options.scene)
        self.fault = lambda: None  # says what is wrong with a solution that no physical state can be
        self.age = JacobianAge(keep_jacobian, self.numbers)
        self.direct = direct if system.comm.size == 1 else "mumps"
        self.x = system.numbering.vector()
        self._f, self._increment, before = self.x.duplicate(), self.x.duplicate(), np.zeros_like(system.u)
        self._go_back = copies([(system.u, before)])
        self.snes = self._create_snes()
        self.choose_solver(self.direct)
        if self._callbacks is None:
            attempt, judge = self._attempt, lambda: self.age.judge_solve(self.numbers.iterations)
        else:
            attempt, judge = self._callbacks.solving()
        #: The first part of `solve`, what needs no decisions.
        self.begin = together(copies([(before, system.u)]), system.read_given, attempt, judge, system.publish)
        self._again = together(self._go_back, attempt, system.publish)

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _create_snes(self):
        snes = PETSc.SNES().create(self.system.comm)
        self._callbacks = None
        if self.in_c and self.system.comm.size == 1:
            self._callbacks = Callbacks(self.system, self.numbers)
            self._callbacks.hand_to(snes, self.x, self._f)
        else:
            snes.setFunction(self.residual, self._f)
            snes.setJacobian(self.jacobian, self.system.A)
            snes.setConvergenceTest(self.converged)
        # The stopping rule sees to Jacobians: whenever SNES asks for one, it looks up a dozen options.
        check(core().lib.SNESSetLagJacobian(core().ffi.cast("SNES", snes.handle), -1))
        snes.setType("newtonls")
        snes.setTolerances(rtol=0, atol=0, stol=0, max_it=50)
        return snes

    def choose_solver(self, package):
        """Solve linear systems with a factorisation of this package, unless the scene's options say otherwise."""
        ksp = self.snes.getKSP()
        ksp.reset()
        self.age.valid = False  # a kept matrix goes with its factorisation
        pc = ksp.getPC()
        pc.setType("lu")
        pc.setFactorSolverType(package)
        if package == "petsc":
            pc.setFactorOrdering("natural")
        ksp.setType("richardson")
        self.numbers.checked = -1  # not known
        self._check_linear_solves(True)
        self.options.apply(self.snes)

    def _check_linear_solves(self, check):
        """Richardson on an exact factorisation: one solve, a look at its residual, refinement if it is not small.

        A kept matrix, whose factorisation was looked at when it was new, is not worth that: Newton refines.
        """
        if check == self.numbers.checked:
            return
        self.numbers.checked, ksp = check, self.snes.getKSP()
        ksp.setNormType(_NORMS[check])
        ksp.setTolerances(rtol=_ACCURACY, atol=0, max_it=_SOLVES[check])

    def set_scales(self, gamma):
        """Scale the system for a step with d/dt ~ gamma."""
        if self.system.set_scales(gamma):
            self.age.valid = False  # the matrix at hand has the old gamma, and the old scales

    def forget(self):
        """Scale anew before the next solve, and keep no matrix: the equations are others."""
        self.system.gamma, self.age.valid = None, False
        self.set_scales(1.0)

    # -- callbacks --------------------------------------------------------------------------------------------------

    def residual(self, snes, x, f):
        """Scaled residual, for SNES."""
        self.residuals_total += 1
        self.system.residual(x, f)

    def jacobian(self, snes, x, J, P):
        """Scaled Jacobian, for SNES."""
        self.system.jacobian(x, P)
        self._assembled()
        self.jacobians_total += 1

    def _assembled(self):
        self.age.assembled()
        self._assembled_for = int(self.system.assemblies[0])

    def converged(self, snes, iteration, norms):
        """Stop when the error that the next increment would remove is below the tolerance, and the rows are settled."""
        reason = self._judge(snes, iteration, norms)
        law = self.system.law
        if law is not None and law.unsettled(reason > 0) and self._last_increment > self.system.tolerance:
            reason = PETSc.SNES.ConvergedReason.ITERATING
        if reason == PETSc.SNES.ConvergedReason.ITERATING:
            self._choose_matrix(snes)
        return reason

    def _choose_matrix(self, snes):
        """Before an iteration: a new Jacobian if the one at hand does not serve."""
        self.age.valid &= self._assembled_for == int(self.system.assemblies[0])  # nobody else has used the matrix
        self.age.kept = self.age.valid
        if not self.options.scene:  # else it chooses how its solves are checked
            self._check_linear_solves(not self.age.kept)
        if not self.age.valid:
            self.jacobian(snes, snes.getSolution(), self.system.A, self.system.A)

    def _judge(self, snes, iteration, norms):
        """The increment shrinks at least linearly with its last ratio, so that |dx_k| min(1, |dx_k|/|dx_(k-1)|) bounds
        the next one; where the residual shrinks more slowly than the increment (near a singular state), its ratio
        counts.  Where the line search damped the increment, the one that Newton asked for counts.
        """
        if not np.isfinite(norms[2]):
            return NOT_FINITE
        if iteration == 0:
            self._last_norm = norms[2]
            return PETSc.SNES.ConvergedReason.ITERATING
        update = snes.getSolutionUpdate()
        increment = update.norm(PETSc.NormType.NORM_INFINITY)
        if increment > 0:
            increment *= max(1.0, norms[1] / update.norm())  # norms[1] is that of the undamped increment
        shrinking, ratio = 0.0, 1.0
        if iteration > 1:
            shrinking = increment / max(self._last_increment, 1e-300)
            ratio = min(1.0, max(shrinking, norms[2] / max(self._last_norm, 1e-300)))
        self._last_increment, self._last_norm = increment, norms[2]
        if increment * ratio <= self.system.tolerance * (self.age.MARGIN if self.age.kept else 1.0):
            return PETSc.SNES.ConvergedReason.CONVERGED_SNORM_RELATIVE
        self.age.judge(shrinking)
        if iteration >= snes.getTolerances()[3]:
            return PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT
        return PETSc.SNES.ConvergedReason.ITERATING

    # -- use --------------------------------------------------------------------------------------------------------

    def solve(self):
        """Damped Newton from the values in `u` of the system; returns the number of iterations.

        `u` holds the solution afterwards, or what it held before if SolveError is raised.
        """
        self.begin()
        return self.end()

    def end(self):
        """The second part of `solve`: what to do if it did not go well, and whether the solution can be one."""
        iterations, fault = self.numbers.iterations, None
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

    def follow(self, enough: float, most: int) -> bool:
        """From `u` of the system, take increments with the matrix at hand, and evaluate the residual where they end.

        True once one is smaller than `enough`, False if `most` of them are not.
        """
        system, x, increment = self.system, self.x, self._increment
        x.setArray(system.scaled_start())
        system.residual(x, self._f)
        for _ in range(most):
            self.snes.getKSP().solve(self._f, increment)
            x.axpy(-1.0, increment)
            system.residual(x, self._f)
            if (size := increment.norm(PETSc.NormType.NORM_INFINITY)) <= enough:
                return True
            if not np.isfinite(size):
                break
        return False

    def _solve_as_best(self):
        """Iterations, and what is wrong: with the matrix at hand, else with new ones, else with pivoting."""
        iterations, reason = self._checked()
        if reason < 0 and self.age.keep:  # perhaps only the matrix was too old
            more, reason = self._run_afresh()
            iterations += more
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE and self.direct == "petsc":
            self.fallbacks += 1
            self.choose_solver("mumps")
            more, reason = self._run()
            iterations += more
            self.choose_solver(self.direct)
        self.age.judge_solve(iterations)
        if reason >= 0 or self._stalled_at_rounding(reason):
            return iterations, None
        where = f"largest residual in {self.worst_block()}"
        return iterations, f"{reason_name(reason)} after {iterations} iterations, {where}"

    def _attempt(self):
        """From `u` to the solution, in `u`; `numbers` hold what came of it."""
        numbers = self.numbers
        self.x.setArray(self.system.scaled_start())
        try:
            self.snes.solve(None, self.x)
            numbers.error = 0
        except PETSc.Error as error:
            numbers.error = error.ierr
        numbers.reason, numbers.iterations = self.snes.getConvergedReason(), self.snes.getIterationNumber()
        self.system.put(self.x)
        numbers.in_order = not numbers.error and numbers.reason > 0

    def _run(self):
        self._again()
        return self._checked()

    def _checked(self):
        """Iterations and reason of the latest attempt.  Raises what a hook has raised, and PETSc's errors."""
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
        self.system.hooks.check()  # C lets a solve end before it tells
        return self.numbers.iterations, reason

    def _run_afresh(self):
        """With a new matrix in every iteration."""
        self.age.keep = self.age.valid = False
        try:
            return self._run()
        finally:
            self.age.keep = True

    def _stalled_at_rounding(self, reason):
        """The line search found nothing better because the residual is rounding noise already: the increment that
        Newton asks for is tiny."""
        if reason != PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH:
            return False
        increment = self.x.duplicate()
        self.residual(self.snes, self.x, self._f)
        self.snes.getKSP().solve(self._f, increment)
        size = increment.norm(PETSc.NormType.NORM_INFINITY)
        increment.destroy()
        return size <= 100 * self.system.tolerance

    def worst_block(self):
        """Name of the block with the largest scaled residual at the present Functions."""
        sizes = self.system.residual_by_block()
        return max(sizes, key=lambda name: sizes[name] if np.isfinite(sizes[name]) else np.inf)

    # -- interruption -------------------------------------------------------------------------------------------------

    def state(self):
        """The matrix that is kept for the next solve, if one is (values of this rank), and its gamma."""
        values = self.system.A.getValuesCSR()[2] if self.age.valid else None
        return {"gamma": self.system.gamma, "matrix": values, "fallbacks": self.fallbacks}

    def restore(self, state):
        """Go on with the matrix of `state`."""
        self.fallbacks = state["fallbacks"]
        self.set_scales(state["gamma"])
        if state.get("matrix") is None:
            return
        A = self.system.A
        rows, columns, _ = A.getValuesCSR()
        A.setValuesCSR(rows, columns, state["matrix"])
        A.assemble()
        self._assembled()

    def destroy(self):
        """Give PETSc's objects back, the system's too."""
        self.options.forget()
        for item in (self.snes, self.x, self._f, self._increment, self.system):
            item.destroy()
