"""Blocks and forms become one nonlinear system that PETSc SNES solves.

A `Part` is a Function together with the place of its dofs among the unknowns of this rank; the same unknowns may
appear as parts on two meshes (the mooring point and force, on the cable and on the hull's axis).  Residual forms are
added up by the part that they test; the Jacobian is their derivative with respect to every part on the same mesh.

Constrained dofs (an anchored end) are simply not unknowns: PETSc is given the index -1 for them and drops their rows
and columns.  Unknowns and rows are scaled by typical sizes, so that metres, newtons and newton-metre-seconds meet in
one norm.

The Jacobian is exact, but need not be of today: while Newton's increments shrink fast with the matrix and the
factorisation of an earlier iteration or step, these are kept (`newton.JacobianAge`).
"""

import numpy as np
import ufl
from petsc4py import PETSc

from ..errors import SolveError
from . import compat
from .loops import Loop, Scaled
from .newton import JacobianAge, SolverOptions, reason_name
from .unknowns import Contribution, Values

_EXTERNAL_LIBRARY = 76  # PETSc's error code when MUMPS or its like reports one
_UNKNOWN_TYPE = 86  # ... when there is no solver or preconditioner of a name


class System:
    """Residual and Jacobian of a set of parts, and the damped Newton method that solves them.

    comm: of the whole problem.  parts: this rank's parts.  residuals: list of (part, linear form).  blocks: cover all
    local unknowns.  order: free local unknowns owned by this rank, in the order of the matrix.  ghosts: (local index,
    global index) arrays of unknowns owned elsewhere.  direct: PETSc solver package for the factorisation;
    "petsc" (natural ordering, no pivoting) falls back to "mumps" when a solve is not accurate.  keep_jacobian: use a
    matrix for several iterations and steps.
    """

    def __init__(
        self,
        comm,
        parts,
        residuals,
        blocks,
        order,
        ghosts=None,
        direct="mumps",
        options=None,
        tolerance=1e-9,
        keep_jacobian=False,
    ):
        self.comm, self.parts, self.blocks = comm, parts, blocks
        self.size = max((p.offset + p.size for p in parts), default=0)
        self.tolerance, self.options = tolerance, SolverOptions(options)
        self.iterations_total = self.residuals_total = self.jacobians_total = self.fallbacks = 0
        self.fault = lambda: None  # says what is wrong with a solution that no physical state can be
        self.age, self._gamma = JacobianAge(keep_jacobian), None
        self.residuals = [Contribution(form, part) for part, form in residuals]
        self.jacobians = self._differentiate(residuals)
        self._values = Values(parts, [c.ufl_form for c in (*self.residuals, *self.jacobians)])
        self.u = self._values.unknowns  # physical values of the local unknowns, where the loops read them
        self._number(order, ghosts)
        self._add_residuals = Loop(self.residuals, self._values, self.size)
        self._add_jacobians = Loop(self.jacobians, self._values, spare=len(self.order))
        self._b = self._add_residuals.out
        self._xs, self._fs = np.ones(len(self.visible)), np.ones(len(self.order))  # units of unknowns, 1/units of rows
        self._scaled_unknowns = Scaled(self.u, self.visible, self._xs)
        self._scaled_residual = Scaled(self._b, self.order, self._fs)
        self._create_matrix()
        self.direct = direct if comm.size == 1 else "mumps"
        self._create_snes()
        self.set_scales(1.0)

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _differentiate(self, residuals):
        jacobians = []
        for row, form in residuals:
            for column in self.parts:
                if column.function in form.coefficients():
                    derivative = ufl.derivative(form, column.function, column.trial)
                    jacobians.append(Contribution(derivative, row, column))
        return jacobians

    def _number(self, order, ghosts):
        """Global numbering of the free unknowns: rank after rank, `order` within a rank."""
        first = self.comm.scan(len(order)) - len(order)
        self.unknowns = self.comm.allreduce(len(order))
        global_index = np.full(self.size, -1, dtype=PETSc.IntType)
        global_index[order] = first + np.arange(len(order))
        self.ghosts = np.zeros(0, dtype=np.int64)
        if ghosts is not None:
            local, number = ghosts
            free = number >= 0
            self.ghosts = local[free]
            global_index[self.ghosts] = number[free]
        self.order = np.asarray(order)
        self.visible = np.concatenate([self.order, self.ghosts]).astype(np.int64)
        self.lgmap = PETSc.LGMap().create(global_index, comm=self.comm)
        self._global_index = global_index

    def _create_matrix(self):
        n, N = len(self.order), self.unknowns
        A = PETSc.Mat().create(self.comm)
        A.setSizes([[n, N], [n, N]])
        A.setType("aij")
        A.setLGMap(self.lgmap, self.lgmap)
        # the spare entries: a diagonal even where the forms have none, for the factorisation
        places = [np.append(entries, self.order) for entries in self._add_jacobians.entries]
        compat.preallocate_coo(A, *(self._global_index[place] for place in places))
        self._add_jacobians.entries = None  # as large as the tensors, and no longer needed
        compat.set_values_coo(A, self._add_jacobians.out)
        self.A = A

    def _create_snes(self):
        x = self._vector()
        self.x, self._f = x, x.duplicate()
        self._ghosted = None
        if self.comm.size > 1:
            ghosts = self._global_index[self.ghosts]
            self._ghosted = PETSc.Vec().createGhost(ghosts, (len(self.order), self.unknowns), comm=self.comm)
        self._row_scale, self._unknown_scale = x.duplicate(), x.duplicate()
        snes = PETSc.SNES().create(self.comm)
        snes.setFunction(self._residual, self._f)
        snes.setJacobian(self._jacobian, self.A)
        snes.setType("newtonls")
        snes.setTolerances(rtol=0, atol=0, stol=0, max_it=50)
        snes.setConvergenceTest(self._converged)
        self.snes = snes
        self._set_direct_solver(self.direct)

    def _set_direct_solver(self, package):
        ksp = self.snes.getKSP()
        ksp.reset()
        self.age.valid = False  # a kept matrix goes with its factorisation
        pc = ksp.getPC()
        pc.setType("lu")
        pc.setFactorSolverType(package)
        if package == "petsc":
            pc.setFactorOrdering("natural")
        ksp.setType("richardson")
        self._checked = None
        self._check_linear_solves(True)
        self.options.apply(self.snes)

    def _check_linear_solves(self, check):
        """Richardson on an exact factorisation: one solve, a look at its residual, refinement if it is not small.

        A kept matrix, whose factorisation was looked at when it was new, is not worth that: Newton refines.
        """
        if check is self._checked:
            return
        self._checked, ksp, norm = check, self.snes.getKSP(), PETSc.KSP.NormType
        ksp.setNormType(norm.UNPRECONDITIONED if check else norm.NONE)
        ksp.setTolerances(rtol=1e-8, atol=0, max_it=5 if check else 1)

    def _vector(self):
        x = PETSc.Vec().create(self.comm)
        x.setSizes([len(self.order), self.unknowns])
        x.setUp()
        return x

    # -- callbacks --------------------------------------------------------------------------------------------------

    def _read(self, x):
        """Unknowns of SNES -> physical values."""
        if self._ghosted is None:
            self._scaled_unknowns.put(x.array_r)
            return
        x.copy(self._ghosted)
        self._ghosted.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
        with self._ghosted.localForm() as local:
            self._scaled_unknowns.put(local.array_r)

    def publish(self):
        """Copy `u` into the parts' Functions."""
        for part in self.parts:
            part.values[:] = self.u[part.slice]

    def evaluate(self):
        """Local residual at the present Functions, constrained rows included (they hold the reactions) [physical].

        The Functions' values are those of `u` from then on.
        """
        self._read_functions()
        return self._assemble_residual()

    def _read_functions(self):
        self._values.read_unknowns()
        self._values.read_given()

    def _assemble_residual(self):
        return self._add_residuals()

    @property
    def last_residual(self):
        """Local residual of the latest evaluation, which after `solve` is the one at the solution [physical]."""
        return self._b

    def _residual(self, snes, x, f):
        self.residuals_total += 1
        self._read(x)
        self._assemble_residual()
        self._scale(f)

    def _scale(self, f):
        """Residual -> what SNES sees."""
        if self._ghosted is None:
            f.setArray(self._scaled_residual.take())
            return
        g = self._ghosted
        with g.localForm() as local:
            local.setArray(self._b[self.visible])
        g.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        f.setArray(g.array_r * self._fs)

    def _jacobian(self, snes, x, J, P):
        self.age.kept = self.age.valid
        if not self.options.scene:  # else it chooses how its solves are checked
            self._check_linear_solves(not self.age.kept)
        if self.age.valid:
            return
        self._read(x)
        self._assemble_matrix()
        P.diagonalScale(self._row_scale, self._unknown_scale)
        if J != P:
            J.assemble()
        self.age.assembled()
        self.jacobians_total += 1

    def assemble_jacobian(self):
        """The Jacobian at the present Functions, unscaled, in `A`; their values are those of `u` from then on."""
        self._read_functions()
        self._assemble_matrix()
        self.age.valid = False

    def _assemble_matrix(self):
        compat.set_values_coo(self.A, self._add_jacobians())

    def _converged(self, snes, iteration, norms):
        """Stop when the error that the next increment would remove is below `tolerance` of the typical sizes.

        The increment shrinks at least linearly with its last ratio, so that |dx_k| min(1, |dx_k|/|dx_(k-1)|) bounds it;
        where the residual shrinks more slowly than the increment (near a singular state), its ratio counts.  Where the
        line search damped the increment, the one that Newton asked for counts.
        """
        if not np.isfinite(norms[2]):
            return PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN
        if iteration == 0:
            self._last_increment, self._last_norm = None, norms[2]
            return PETSc.SNES.ConvergedReason.ITERATING
        update = snes.getSolutionUpdate()
        increment = update.norm(PETSc.NormType.NORM_INFINITY)
        if increment > 0:
            increment *= max(1.0, norms[1] / update.norm())  # norms[1] is that of the undamped increment
        shrinking, ratio = 0.0, 1.0
        if self._last_increment is not None:
            shrinking = increment / max(self._last_increment, 1e-300)
            ratio = min(1.0, max(shrinking, norms[2] / max(self._last_norm, 1e-300)))
        self._last_increment, self._last_norm = increment, norms[2]
        if increment * ratio <= self.tolerance * (self.age.MARGIN if self.age.kept else 1.0):
            return PETSc.SNES.ConvergedReason.CONVERGED_SNORM_RELATIVE
        self.age.judge(shrinking)
        if iteration >= snes.getTolerances()[3]:
            return PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT
        return PETSc.SNES.ConvergedReason.ITERATING

    # -- use --------------------------------------------------------------------------------------------------------

    def set_scales(self, gamma):
        """Scale unknowns and rows for a step with d/dt ~ gamma."""
        if self._gamma is not None and abs(gamma - self._gamma) <= 1e-9 * gamma:
            return
        self._gamma, self.age.valid = gamma, False  # the matrix at hand has the old gamma, and the old scales
        xs, fs = np.ones(self.size), np.ones(self.size)
        for block in self.blocks:
            xs[block.dofs] = block.unknown_size(gamma, self.tolerance)
            fs[block.dofs] = 1 / block.residual_size(gamma)
        self._xs[:], self._fs[:] = xs[self.visible], fs[self.order]
        self._row_scale.setArray(self._fs)
        self._unknown_scale.setArray(xs[self.order])

    def solve(self):
        """Damped Newton from the values in `u`; returns the number of iterations.

        `u` holds the solution afterwards, or what it held before if SolveError is raised.
        """
        before = self.u.copy()
        self._values.read_given()
        iterations, reason = self._run(before)
        if reason < 0 and self.age.keep:  # perhaps only the matrix was too old
            more, reason = self._run_afresh(before)
            iterations += more
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE and self.direct == "petsc":
            self.fallbacks += 1
            self._set_direct_solver("mumps")
            more, reason = self._run(before)
            iterations += more
            self._set_direct_solver(self.direct)
        self.iterations_total += iterations
        self.age.judge_solve(iterations)
        self._read(self.x)
        self.publish()
        if reason < 0 and not self._stalled_at_rounding(reason):
            fault = f"{reason_name(reason)} after {iterations} iterations, largest residual in {self.worst_block()}"
        else:
            fault = self.fault()
        if fault:
            self.u[:] = before
            self.publish()
            raise SolveError(fault)
        return iterations

    def _run(self, start):
        self.u[:] = start
        self.x.setArray(start[self.order] / self._xs[: len(self.order)])
        try:
            self.snes.solve(None, self.x)
            reason = self.snes.getConvergedReason()
        except PETSc.Error as error:
            if error.ierr == _UNKNOWN_TYPE:
                raise self.options.refused(error) from None
            if error.ierr != _EXTERNAL_LIBRARY:
                raise
            reason = PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE
        finally:
            self.options.forget()
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE:
            self._set_direct_solver(self.direct)  # MUMPS does not recover from a singular matrix by itself
        return self.snes.getIterationNumber(), reason

    def _run_afresh(self, start):
        """With a new matrix in every iteration."""
        self.age.keep = self.age.valid = False
        try:
            return self._run(start)
        finally:
            self.age.keep = True

    def _stalled_at_rounding(self, reason):
        """The line search found nothing better because the residual is rounding noise already: the increment that
        Newton asks for is tiny."""
        if reason != PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH:
            return False
        increment = self.x.duplicate()
        self.snes.computeFunction(self.x, self._f)
        self.snes.getKSP().solve(self._f, increment)
        size = increment.norm(PETSc.NormType.NORM_INFINITY)
        increment.destroy()
        return size <= 100 * self.tolerance

    def residual_by_block(self):
        """Largest scaled residual of every block at the present Functions."""
        self.evaluate()
        self._scale(self._f)
        scaled = np.zeros(self.size)
        scaled[self.order] = np.abs(self._f.array_r)
        largest = {b.name: (scaled[b.dofs].max() if len(b.dofs) else 0.0) for b in self.blocks}
        return {name: self.comm.allreduce(value, op=compat.MPI.MAX) for name, value in largest.items()}

    def worst_block(self):
        """Name of the block with the largest scaled residual."""
        sizes = self.residual_by_block()
        return max(sizes, key=lambda name: sizes[name] if np.isfinite(sizes[name]) else np.inf)

    def state(self):
        """The matrix that is kept for the next solve, if one is (values of this rank), and its gamma."""
        values = self.A.getValuesCSR()[2] if self.age.valid else None
        return {"gamma": self._gamma, "matrix": values, "fallbacks": self.fallbacks}

    def restore(self, state):
        """Go on with the matrix of `state`."""
        self.fallbacks = state["fallbacks"]
        self.set_scales(state["gamma"])
        if state.get("matrix") is None:
            return
        rows, columns, _ = self.A.getValuesCSR()
        self.A.setValuesCSR(rows, columns, state["matrix"])
        self.A.assemble()
        self.age.assembled()

    def destroy(self):
        """Give PETSc's objects back (sweeps make many systems)."""
        self.options.forget()
        for item in [self.snes, self.A, self.x, self._f, self._row_scale, self._unknown_scale, self.lgmap]:
            item.destroy()
        if self._ghosted is not None:
            self._ghosted.destroy()
