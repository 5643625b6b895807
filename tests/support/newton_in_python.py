"""Python versions of the callbacks of PETSc's Newton method, the reference for core/newton.c, on one rank.

What both remember from call to call stands in `numbers` of a Newton.
"""

import numpy as np
from petsc4py import PETSc

from dolfbuoy.solver.numbering import set_values

ITERATING, CONVERGED = PETSc.SNES.ConvergedReason.ITERATING, PETSc.SNES.ConvergedReason.CONVERGED_SNORM_RELATIVE
NOT_FINITE = -4
NORMS = PETSc.KSP.NormType.NONE, PETSc.KSP.NormType.UNPRECONDITIONED


class InPython:
    """Makes a Newton call these functions.  calls: number of evaluations of the stopping rule."""

    calls = 0

    def __init__(self, newton):
        self.newton, self.system, self.law, self.numbers = newton, newton.system, newton.system.law, newton.numbers
        newton.snes.setFunction(self.residual, newton.x.duplicate())
        newton.snes.setJacobian(self.jacobian, self.system.A)
        newton.snes.setConvergenceTest(self.converged)
        before = np.zeros_like(self.system.u)
        newton.begin = lambda: self.begin(before)
        newton._again = lambda: self.again(before)
        newton._go_back = lambda: np.copyto(self.system.u, before)

    # -- a solve ------------------------------------------------------------------------------------------------------

    def begin(self, before):
        before[:] = self.system.u
        self.system.read_given()
        self.attempt()
        numbers = self.numbers
        numbers.valid = numbers.valid and numbers.keep and numbers.iterations < numbers.many
        self.system.publish()

    def again(self, before):
        self.system.u[:] = before
        self.attempt()
        self.system.publish()

    def attempt(self):
        newton, system, numbers = self.newton, self.system, self.numbers
        newton.x.setArray(system.u[system.order] / system.unknown_scales[: len(system.order)])
        try:
            newton.snes.solve(None, newton.x)
            numbers.error = 0
        except PETSc.Error as error:
            numbers.error = error.ierr
        numbers.reason, numbers.iterations = newton.snes.getConvergedReason(), newton.snes.getIterationNumber()
        system.scaled_unknowns.put(newton.x.array_r)
        numbers.in_order = not numbers.error and numbers.reason > 0

    # -- callbacks ----------------------------------------------------------------------------------------------------

    def residual(self, snes, x, f):
        self.numbers.residuals_total += 1
        self.system.scaled_unknowns.put(x.array_r)
        b = self.system.add_residuals()
        if self.law is not None:
            law = self.law
            g, bound = b[law.rows], -law.c * self.system.u[law.rows]
            law.slack[:] = ~(g > bound)
            b[law.rows] = np.where(law.slack, bound, g)
        f.setArray(self.system.scaled_residual.take())

    def jacobian(self, snes, x, J, P):
        self.system.scaled_unknowns.put(x.array_r)
        set_values(P, self.system.add_jacobians())
        self.numbers.assembled += 1
        if self.law is not None:
            self.change_matrix(P)
        P.diagonalScale(self.system.row_vector, self.system.unknown_vector)
        self.numbers.valid, self.numbers.kept = True, False
        self.numbers.assembled_for = self.numbers.assembled
        self.numbers.jacobians_total += 1

    def change_matrix(self, A):
        law, place = self.law, np.empty(self.system.size, dtype=int)
        place[self.system.order] = np.arange(len(self.system.order))
        law.slack_before[:] = law.slack
        A.zeroRowsLocal(law.rows[law.slack].astype(PETSc.IntType), diag=0.0)
        diagonal = A.getDiagonal()
        diagonal.array[place[law.rows][law.slack]] = -law.c[law.slack]
        A.setDiagonal(diagonal)

    def converged(self, snes, iteration, norms):
        self.calls += 1
        reason, law, numbers = self.judged(snes, iteration, norms), self.law, self.numbers
        settled = law is None or np.array_equal(law.slack, law.slack_before)
        if reason > 0 and not settled and numbers.last_increment > numbers.tolerance:
            reason = ITERATING
        if reason == ITERATING:
            self.choose_matrix(snes)
        return reason

    def judged(self, snes, iteration, norms):
        numbers = self.numbers
        if not np.isfinite(norms[2]):
            return NOT_FINITE
        if iteration == 0:
            numbers.last_norm = norms[2]
            return ITERATING
        update = snes.getSolutionUpdate()
        increment = update.norm(PETSc.NormType.NORM_INFINITY)
        if increment > 0:
            increment *= max(1.0, norms[1] / update.norm())
        shrinking, ratio = 0.0, 1.0
        if iteration > 1:
            shrinking = increment / max(numbers.last_increment, 1e-300)
            ratio = min(1.0, max(shrinking, norms[2] / max(numbers.last_norm, 1e-300)))
        numbers.last_increment, numbers.last_norm = increment, norms[2]
        if increment * ratio <= numbers.tolerance * (numbers.margin if numbers.kept else 1.0):
            return CONVERGED
        numbers.valid = numbers.keep and shrinking <= numbers.slow
        return PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT if iteration >= snes.getTolerances()[3] else ITERATING

    def choose_matrix(self, snes):
        numbers = self.numbers
        numbers.valid = numbers.valid and numbers.assembled_for == numbers.assembled
        numbers.kept = numbers.valid
        if not numbers.own_options and numbers.checked != (not numbers.kept):
            numbers.checked, ksp = not numbers.kept, snes.getKSP()
            ksp.setNormType(NORMS[numbers.checked])
            accuracy = {"rtol": numbers.linear_tolerance, "atol": 0, "max_it": numbers.linear_solves[numbers.checked]}
            ksp.setTolerances(**accuracy)
        if not numbers.valid:
            self.jacobian(snes, snes.getSolution(), self.system.A, self.system.A)
