"""The loops in C and the direct solver alone: the floor of a Newton iteration.

Beside it what a form costs wherever it is compiled: its operations.
"""

from petsc4py import PETSc
from ufl.algorithms import expand_derivatives
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.corealg.traversal import unique_pre_traversal


def back_to_back(newton):
    """A function of numbers of iterations, residuals and Jacobians: loops and direct solver alone, in turn."""
    system = newton.system
    factorise, solve = direct_solver(newton)

    def floor(n_K, n_R, n_J):
        for k in range(n_K):
            for _ in range(n_J * k // n_K, n_J * (k + 1) // n_K):
                system.add_jacobians()
                factorise()
            solve()
            for _ in range(n_R * k // n_K, n_R * (k + 1) // n_K):
                system.add_residuals()

    return floor


def direct_solver(newton):
    """A factorisation of the present Jacobian, and a solve with it."""
    newton.system.assemble_jacobian()
    A = newton.system.A.copy()
    A.diagonalScale(newton.system.row_vector, newton.system.unknown_vector)
    pc = PETSc.PC().create(A.comm)
    pc.setType("lu")
    pc.setFactorSolverType(newton.direct)
    if newton.direct == "petsc":
        pc.setFactorOrdering("natural")
    pc.setOperators(A)
    pc.setUp()

    def again():
        A.stateIncrease()  # PETSc factorises again only what has changed
        pc.setUp()

    x, y = A.createVecs()
    x.set(1.0)
    return again, lambda: pc.apply(x, y)


def operations(form) -> int:
    """Distinct operations of a form, once derivatives and tensor algebra are expanded: a number of the form alone."""
    expanded = expand_derivatives(apply_algebra_lowering(form))
    nodes = {node for integral in expanded.integrals() for node in unique_pre_traversal(integral.integrand())}
    return sum(not node._ufl_is_terminal_ for node in nodes)
