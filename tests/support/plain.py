"""The plain solution of a step: one matrix per pair of blocks, combined in Python, factorised by UMFPACK.

Shares with the program the UFL residual of the scene and nothing of what makes it fast: contributions are assembled by
dolfinx's own functions into separate vectors and matrices, every iteration has a new Jacobian, and the coefficients are
packed anew each time.  With `estimated` the quadrature degree is left to UFL.
"""

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx.fem import petsc
from petsc4py import PETSc
from ufl.algorithms import expand_derivatives

from dolfbuoy.solver import compat


def _free_of_degree(form):
    return ufl.Form([integral.reconstruct(metadata={}) for integral in form.integrals()])


class PlainNewton:
    """`solve` for a Problem on one rank, in place of its System's."""

    def __init__(self, problem, estimated=False):
        self.system, self.buoy = problem.system, problem.buoy
        self.parts, residuals = problem.system.parts, problem.residuals()
        if estimated:
            residuals = [(part, _free_of_degree(form)) for part, form in residuals]
        self.vectors = [(part, compat.compile_form(form)) for part, form in residuals]
        self.blocks = list(self._blocks(residuals))
        self.ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        self.ksp.setType("preonly")
        self.ksp.getPC().setType("lu")
        self.ksp.getPC().setFactorSolverType("umfpack")

    def _blocks(self, residuals):
        for row, form in residuals:
            for column in self.parts:
                if column.function in form.coefficients():
                    derivative = ufl.derivative(form, column.function, column.trial)
                    if not expand_derivatives(derivative).empty():
                        yield row, column, compat.compile_form(derivative)

    def residual(self):
        """Residual of all local unknowns."""
        b = np.zeros(self.system.size)
        for part, form in self.vectors:
            vector = petsc.assemble_vector(form)
            b[part.slice] += vector.array_r[: part.size]
            vector.destroy()
        return b

    def jacobian(self):
        """Jacobian of all local unknowns, a scipy matrix."""
        n = self.system.size
        J = sp.csr_matrix((n, n))
        for row, column, form in self.blocks:
            A = petsc.assemble_matrix(form)
            A.assemble()
            indptr, indices, data = A.getValuesCSR()
            block = sp.csr_matrix((data, indices, indptr), shape=A.getSize()).tocoo()
            J = J + sp.csr_matrix((block.data, (block.row + row.offset, block.col + column.offset)), shape=(n, n))
            A.destroy()
        return J

    def solve(self):
        """Newton's method from the values in `u` until the increment meets the tolerance; returns the iterations."""
        system, free = self.system, self.system.order
        previous = None
        for iteration in range(1, 51):
            self._publish()
            b, J = self.residual(), self.jacobian()[free][:, free].tocsr()
            step = self._direct(J, b[free])
            system.u[free] -= step
            increment = np.abs(step / system.unknown_scales).max()
            ratio = 1.0 if previous is None else min(1.0, increment / max(previous, 1e-300))
            previous = increment
            if increment * ratio <= system.tolerance:
                self._publish()
                system.last_residual[:] = self.residual()
                return iteration
        raise RuntimeError("the plain Newton method did not converge")

    def _publish(self):
        self.system.publish()
        if self.buoy:
            self.buoy.publish_points()

    def _direct(self, J, b):
        A = PETSc.Mat().createAIJ(size=J.shape, csr=(J.indptr, J.indices, J.data), comm=PETSc.COMM_SELF)
        rhs, x = PETSc.Vec().createWithArray(b.copy(), comm=PETSc.COMM_SELF), A.createVecRight()
        self.ksp.setOperators(A)
        self.ksp.solve(rhs, x)
        values = x.array_r.copy()
        for item in (A, rhs, x):
            item.destroy()
        return values


def simulation(scene, estimated=False):
    """A Simulation of a scene with the plain solver."""
    from mpi4py import MPI

    from dolfbuoy.motion.simulation import Simulation

    made = Simulation(scene, MPI.COMM_SELF)
    made.newton.begin, made.newton.end = lambda: None, PlainNewton(made.problem, estimated).solve
    made._made_for = None  # the old ones
    return made
