"""The quadratic eigenvalue problem (K + lambda E + lambda^2 M) x = 0 of sparse rows, with SLEPc.

K may be singular, because unrestrained motions have lambda = 0: with a shift of 0 a solver then "converges" to spurious
pairs without an error.  The shift is therefore real and negative.  Rows and columns are first equilibrated, and time is
scaled so that the shift is -1.  SLEPc in real arithmetic has no complex shift, and needs none: the lowest modes lie
around a small real one.
"""

import contextlib
from typing import Any, NamedTuple
from warnings import catch_warnings, simplefilter

import numpy as np
from petsc4py import PETSc
from scipy.linalg import LinAlgWarning, lu_factor, lu_solve
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csc_matrix, csr_matrix, diags, identity, vstack
from scipy.sparse.linalg import splu

from ..elsewhere import MPI, elsewhere
from ..errors import SolveError
from . import Array

#: Imaginary parts below this fraction of |lambda| are rounding errors.
REAL = 1e-9
#: Largest normwise backward error of a pair, in equilibrated rows and columns.
RESIDUAL = 1e-8
#: An eigenvalue below this fraction of the shift is zero: rounding splits a double zero by about sqrt(1e-16) of it.
ZERO = 1e-5
#: Largest relative difference between roots with and without mixing.
MIXED = 1e-2
#: Regularisation added to a singular K: the first of these for which LU does not find it singular.
NEARLY = (1e-13, 1e-12, 1e-11, 1e-10)
#: Target of the shift relative to the smallest nonzero eigenvalue, and the acceptable range of this ratio.
PART, PARTS = 0.2, (0.02, 2.0)
#: For all eigenvalues at once: relative accuracy, and another shift, with which finite eigenvalues must agree.
ACCURACY, OTHER = 1e-6, 1.7
#: Relative distances from an eigenvalue of the shift for inverse iteration of its vector.
NEXT = 1e-9, 3e-9, 1e-8
#: For all eigenvalues at once: ratio of the radii of rings, and the largest number of rings.
RING, RINGS = 30.0, 7
#: Number of trials of SLEPc, each with another number of eigenvalues.
TRIALS = 3
#: Limit of SLEPc's restarts, which mostly needs less than ten, and a lower one if modes are only informative.
RESTARTS, FEW = 500, 40
#: Size of the companion form up to which all its eigenvalues are computed at once.
DENSE = 240


class Pairs(NamedTuple):
    """Eigenpairs: roots (m,) with Im >= 0, by rising |lambda|; vectors (unknowns, m); residuals (m,); zero (m,): mask.

    problem: the Quadratic they belong to.
    """

    roots: Array
    vectors: Array
    residuals: Array
    zero: Array
    problem: "Quadratic"

    def at_zero(self) -> Array:
        """Vectors (unknowns, k) with lambda = 0, improved to solutions of K x = 0; some may be equal."""
        problem = self.problem
        return problem.columns[:, None] * problem.in_kernel(self.vectors[:, self.zero] / problem.columns[:, None])

    def residuals_at_zero(self, vectors: Array) -> Array:
        """Backward errors of vectors (unknowns, k) with lambda = 0."""
        return self.problem.residuals(np.zeros(vectors.shape[1]), vectors / self.problem.columns[:, None])


class Quadratic:
    """K, E and M, equilibrated, with the shift -speed: scipy matrices (rows of this rank, all unknowns).

    restarts: limit for SLEPc; with FEW it fails unless all requested pairs converge.
    """

    def __init__(self, comm: Any, K: Any, E: Any, M: Any, speed: float, restarts: int = RESTARTS) -> None:
        self.comm, self.speed, self.restarts = comm, speed, restarts
        self.rows, self.columns = _equilibrated(comm, abs(K) + speed * abs(E) + speed**2 * abs(M))
        left, right = diags(self.rows), diags(self.columns)
        self.K, self.E, self.M = (left @ A @ right for A in (K, speed * E, speed**2 * M))
        self.norms = [np.sqrt(comm.allreduce(float(abs(A).power(2).sum()))) for A in (self.K, self.E, self.M)]

    def is_small(self, count: int) -> bool:
        """True if all eigenvalues are computed at once when `count` of them are requested."""
        return bool(2 * self.K.shape[1] <= max(DENSE, 4 * count))

    def pairs(self, count: int) -> tuple[Array, Array]:
        """Eigenvalues closest to -1, `count` or more, and their vectors."""
        roots, vectors = self._all_pairs() if self.is_small(count) else self._nearest_pairs(count)
        real = np.abs(roots.imag) < REAL * np.abs(roots)  # a double root splits into conjugates
        return np.where(real, roots.real, roots), vectors

    def _all_pairs(self) -> tuple[Array, Array]:
        """Eigenvalues mu = 1/(lambda + c) of the companion form in (x, lambda x) with the shift -c, c = 1.

        Infinite eigenvalues have mu = 0; rounding makes them finite but large, because with constraints they are
        defective (index 3).  They change with the shift, which identifies them.
        """
        inverse = self._inverse(1.0)
        # LAPACK loses vectors of equal eigenvalues if the matrix decouples, like that of a line in two planes
        mixing = np.linalg.qr(np.random.default_rng(0).standard_normal(inverse.shape))[0]
        mu, vectors = np.linalg.eig(mixing.T @ inverse @ mixing)
        vectors = mixing @ vectors
        with np.errstate(divide="ignore", invalid="ignore"):
            roots = 1 / mu - 1
            exact, others = (1 / np.linalg.eigvals(self._inverse(c)) - c for c in (1.0, OTHER))
        exact, others = exact[np.isfinite(exact)], others[np.isfinite(others)]
        apart = np.abs(exact[:, None] - others).min(axis=1, initial=np.inf)
        exact = exact[(apart < ACCURACY * np.abs(exact)) & (np.abs(exact) >= ZERO)]
        zero, vectors = np.abs(roots) < ZERO, vectors[: len(vectors) // 2].astype(complex)
        # match roots of the mixed matrix, whose vectors are good, with the accurate ones without mixing
        known = np.where(np.isfinite(roots), roots, np.inf)
        apart = np.minimum(np.abs(known[:, None] - exact) / np.abs(exact), 1.0)
        mine, theirs = linear_sum_assignment(apart)
        near = apart[mine, theirs] < MIXED
        mine, theirs = mine[near], theirs[near]
        for k, root in zip(mine, exact[theirs], strict=True):
            if abs(root) <= RING:
                vectors[:, k] = self._refined(root, vectors[:, k])
        # roots lost by mixing among motions a thousand times as stiff: start from random vectors
        lost = [root for root in np.delete(exact, theirs) if abs(root) <= RING]
        starts = np.random.default_rng(1).standard_normal((len(lost), len(vectors)))
        found = [(root, self._refined(root, start)) for root, start in zip(lost, starts, strict=True)]
        found = [pair for pair in found if self.residuals(pair[0], pair[1][:, None])[0] < RESIDUAL]
        vectors = np.hstack([vectors[:, zero], vectors[:, mine], *(vector[:, None] for _, vector in found)])
        return np.concatenate([roots[zero], exact[theirs], [root for root, _ in found]]), vectors

    def _refined(self, root: complex, vector: Array) -> Array:
        """Inverse iteration with a shift close to an eigenvalue."""
        K, E, M = (self._whole(A) for A in (self.K, self.E, self.M))
        with catch_warnings():
            simplefilter("error", LinAlgWarning)
            for near in NEXT:
                c = root * (1 + near)
                with contextlib.suppress(LinAlgWarning):  # exactly singular
                    solve = lu_factor(K + c * E + c**2 * M)
                    break
            else:
                return vector
        for _ in range(2):
            vector = lu_solve(solve, (E + 2 * c * M) @ vector)
            vector = vector / np.linalg.norm(vector)
        return vector

    def _inverse(self, c: float) -> Array:
        """(A + c B)^-1 B of the companion form A z = lambda B z."""
        K, E, M = (self._whole(A) for A in (self.K, self.E, self.M))
        first = -np.linalg.solve(K - c * E + c**2 * M, np.hstack([E - c * M, M]))
        return np.vstack([first, np.eye(len(K), 2 * len(K)) - c * first])

    def _whole(self, A: Any) -> Array:
        return np.vstack(self.comm.allgather(A.toarray()))

    def _nearest_pairs(self, count: int) -> tuple[Array, Array]:
        with elsewhere():  # it looks for slepc.cfg
            from slepc4py import SLEPc

        matrices = [self._petsc(A) for A in (self.K, self.E, self.M)]
        solver = SLEPc.PEP().create(self.comm)
        try:
            solver.setOperators(matrices)
            solver.setProblemType(SLEPc.PEP.ProblemType.GENERAL)
            solver.setType(SLEPc.PEP.Type.TOAR)
            solver.setTarget(-1.0)
            solver.setWhichEigenpairs(SLEPc.PEP.Which.TARGET_MAGNITUDE)
            solver.setDimensions(count)
            solver.setTolerances(1e-12, self.restarts)
            transformation = solver.getST()
            transformation.setType(SLEPc.ST.Type.SINVERT)
            ksp = transformation.getKSP()
            ksp.setType("preonly")
            ksp.getPC().setType("lu")
            ksp.getPC().setFactorSolverType("mumps")
            solver.solve()
            if self.restarts == FEW and solver.getConverged() < count:
                raise SolveError(f"the modes were not found in {FEW} restarts of SLEPc's solver.")
            return self._read(solver, matrices[0])
        except PETSc.Error as error:
            raise SolveError(f"the modes were not found: SLEPc's error {error.ierr}.") from None
        finally:
            for item in (solver, *matrices):
                item.destroy()

    def _petsc(self, A: Any) -> Any:
        A = csr_matrix(A)
        A.sort_indices()
        n, N = A.shape
        pattern = A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data
        made = PETSc.Mat().createAIJ(((n, N), (n, N)), csr=pattern, comm=self.comm)
        made.assemble()
        return made

    def _read(self, solver: Any, A: Any) -> tuple[Array, Array]:
        roots, vectors, (real, imaginary) = [], [], (A.createVecRight(), A.createVecRight())
        for i in range(solver.getConverged()):
            roots.append(solver.getEigenpair(i, real, imaginary))
            parts = [np.concatenate(self.comm.allgather(v.array_r.copy())) for v in (real, imaginary)]
            vectors.append(parts[0] + 1j * parts[1])
        real.destroy()
        imaginary.destroy()
        if not roots:
            raise SolveError("the modes were not found: SLEPc's solver did not converge.")
        return np.array(roots), np.array(vectors).T

    def in_kernel(self, vectors: Array) -> Array:
        """Inverse iteration with K: the vectors of a double zero have an error of at least the root of rounding."""
        if not vectors.shape[1]:
            return vectors
        solve = _nearly(csc_matrix(vstack(self.comm.allgather(csr_matrix(self.K))))).solve
        for _ in range(2):
            vectors = solve(vectors / np.linalg.norm(vectors, axis=0))
        return np.asarray(vectors / np.linalg.norm(vectors, axis=0))

    def residuals(self, roots: Array, vectors: Array) -> Array:
        """Backward errors |(K + lambda E + lambda^2 M) x| over the sum of the terms' norms times |x|."""
        r = self.K @ vectors + (self.E @ vectors) * roots + (self.M @ vectors) * roots**2
        squares = self.comm.allreduce((np.abs(r) ** 2).sum(axis=0))
        sizes = self.norms[0] + np.abs(roots) * self.norms[1] + np.abs(roots) ** 2 * self.norms[2]
        return np.asarray(np.sqrt(squares) / (sizes * np.linalg.norm(vectors, axis=0)))


def _nearly(K: Any) -> Any:
    """LU factorisation of a possibly singular matrix, with a tiny regularisation."""
    for size in NEARLY:
        with contextlib.suppress(RuntimeError):  # "Factor is exactly singular"
            return splu((K + size * identity(K.shape[0])).astype(complex).tocsc())
    raise SolveError(
        "the modes were not found: the stiffness is singular in more ways than motions that nothing holds."
    )


def lowest_pairs(comm: Any, K: Any, E: Any, M: Any, count: int, restarts: int = RESTARTS) -> Pairs:
    """The `count` eigenvalues of smallest |lambda|, or all that are finite; K, E, M: this rank's rows.

    Collective; the same on all ranks.  A conjugate pair is represented by the root with Im > 0.  Raises SolveError if
    the solver fails, or for a pair whose residual is above RESIDUAL.  restarts: see `Quadratic`.
    """
    problem = _about_the_lowest(comm, K, E, M, restarts)
    found = _rings(problem, (K, E, M), count) if problem.is_small(2 * count) else [_nearest(problem, count)]
    parts = [(at.speed * roots, at.columns[:, None] * x, at.residuals(roots, x)) for at, roots, x in found]
    roots, vectors, residuals = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    chosen = np.argsort(np.abs(roots), kind="stable")[:count]
    roots, vectors, residuals = roots[chosen], vectors[:, chosen], residuals[chosen]
    zero = np.abs(roots) < ZERO * problem.speed  # mostly double, with vectors accurate to the root of rounding
    if residuals[~zero].max(initial=0.0) > RESIDUAL:
        raise SolveError(f"a mode was found with a residual of {residuals[~zero].max():.2g}, above {RESIDUAL:g}.")
    return Pairs(roots, vectors, residuals, zero, problem)


def _about_the_lowest(comm: Any, K: Any, E: Any, M: Any, restarts: int) -> Quadratic:
    """The problem with a shift of the order of the smallest nonzero eigenvalue."""
    speed = 1.0
    for _ in range(8):
        problem = Quadratic(comm, K, E, M, speed, restarts)
        sizes = np.abs(problem.pairs(6)[0])
        lowest = sizes[sizes > ZERO].min(initial=np.inf)
        if PARTS[0] <= 1 / lowest <= PARTS[1] or lowest == np.inf:
            break
        speed *= PART * lowest
    return problem


def _nearest(problem: Quadratic, count: int) -> tuple[Quadratic, Array, Array]:
    """(problem, roots, vectors) without gaps: roots complete in a radius R about -1 are so in R - 1 about 0."""
    wanted, limit = 2 * count + 8, problem.K.shape[1]
    while True:
        roots, vectors = _tried(problem, wanted)
        chosen = (roots.imag >= 0) & (np.abs(roots) <= np.abs(roots + 1).max() - 1)
        if np.count_nonzero(chosen) >= count or wanted >= limit:
            return problem, roots[chosen], vectors[:, chosen]
        wanted = min(2 * wanted, limit)


def _tried(problem: Quadratic, count: int) -> tuple[Array, Array]:
    """`pairs`, with a few more if LAPACK fails to order nearly equal values."""
    for more in range(0, 7 * TRIALS, 7):
        try:
            return problem.pairs(count + more)
        except SolveError:
            if more == 7 * (TRIALS - 1) or problem.restarts == FEW:
                raise
    raise AssertionError("the last trial raises")


def _rings(problem: Quadratic, matrices: tuple[Any, Any, Any], count: int) -> list[tuple[Quadratic, Array, Array]]:
    """[(problem, roots, vectors)] in rings about 0, each with its own shift, for accuracy in all of them."""
    found, inner = [], -1.0
    for _ in range(RINGS):
        roots, vectors = problem.pairs(2 * count)
        sizes = np.abs(roots)
        chosen = (roots.imag >= 0) & (sizes > inner) & (sizes <= RING)
        found.append((problem, roots[chosen], vectors[:, chosen]))
        count -= np.count_nonzero(chosen)
        if count <= 0:
            break
        problem, inner = Quadratic(problem.comm, *matrices, RING * problem.speed), 1.0
    return found


def _equilibrated(comm: Any, A: Any, sweeps: int = 8) -> tuple[Array, Array]:
    """Row and column scaling factors that bring the largest entry of each close to 1 (Ruiz)."""
    A = csr_matrix(A)
    rows, columns = np.ones(A.shape[0]), np.ones(A.shape[1])
    for _ in range(sweeps):
        scaled = (diags(rows) @ A @ diags(columns)).tocoo()
        in_row, in_column = np.zeros(len(rows)), np.zeros(len(columns))
        np.maximum.at(in_row, scaled.row, scaled.data)
        np.maximum.at(in_column, scaled.col, scaled.data)
        comm.Allreduce(MPI.IN_PLACE, in_column, MPI.MAX)
        rows /= np.sqrt(np.where(in_row > 0, in_row, 1.0))
        columns /= np.sqrt(np.where(in_column > 0, in_column, 1.0))
    return rows, columns
