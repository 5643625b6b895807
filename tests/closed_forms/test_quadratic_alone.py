"""Parts of the eigenvalue solver for the lowest modes, each alone: shifts, rings, accepted pairs, singular matrices.

Source: the same numbers by hand; made-up problems with known eigenvalues.
"""

from types import SimpleNamespace as Fake

import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_matrix

from dolfbuoy.errors import SolveError
from dolfbuoy.solver import quadratic
from dolfbuoy.solver.quadratic import Pairs, Quadratic, lowest_pairs


def problems(monkeypatch, eigenvalues):
    """Problems with these eigenvalues at any speed, in order of which they were made."""
    made = []

    def quadratic_problem(comm, K, E, M, speed, restarts=500):
        asked = []

        def pairs(count):
            asked.append(count)
            return np.array(eigenvalues) / speed, np.arange(len(eigenvalues))[None]

        made.append(Fake(comm=comm, speed=speed, pairs=pairs, asked=asked, restarts=restarts))
        return made[-1]

    monkeypatch.setattr(quadratic, "Quadratic", quadratic_problem)
    return made


@pytest.mark.parametrize(
    ("eigenvalues", "speeds"),
    [
        ([8j, 9j], [1.0]),
        ([500j, 700j], [1.0, 100.0]),
        ([0.1j, 0.0, 4j], [1.0, 0.02]),
        ([49j], [1.0]),
        ([51j], [1.0, 10.2]),
        ([0.51j], [1.0]),
        ([0.49j], [1.0, 0.098]),
        ([0.0, 0.9e-5], [1.0]),
        ([1.1e-5], [1.0, 2.2e-6]),
    ],
)
def test_the_shift_is_a_fifth_of_the_lowest_that_is_not_zero(eigenvalues, speeds, monkeypatch):
    """Or within a fiftieth and twice of it, as it is; of zeros alone there is none."""
    made = problems(monkeypatch, eigenvalues)
    found = quadratic._about_the_lowest(MPI.COMM_SELF, None, None, None, 77)
    assert [one.speed for one in made] == pytest.approx(speeds)
    assert (found, found.restarts) == (made[-1], 77)
    assert all(one.asked == [6] for one in made)


def test_rings_about_zero(monkeypatch):
    """Up to thirty times the shift, then thirty times as far; none counts twice, and of conjugates one."""
    made = problems(monkeypatch, [0.5j, -0.5j, 0.0, 30j, 40j, -900.0, 27001j])
    first = quadratic.Quadratic(MPI.COMM_SELF, 1, 2, 3, 1.0)
    found = quadratic._rings(first, (1, 2, 3), 5)
    assert [(at.speed, list(roots), vectors.ravel().tolist()) for at, roots, vectors in found] == [
        (1.0, [0.5j, 0.0, 30j], [0, 2, 3]),
        (30.0, [40j / 30, -30.0], [4, 5]),
    ]
    assert [one.asked for one in made] == [[10], [4]]
    made.clear()
    every = quadratic._rings(quadratic.Quadratic(MPI.COMM_SELF, 1, 2, 3, 1.0), (1, 2, 3), 99)
    assert [at.speed for at, _, _ in every] == pytest.approx(list(30.0 ** np.arange(7)))
    assert sum(len(roots) for _, roots, _ in every) == 6


def lowest(monkeypatch, roots, residuals, count=9):
    """`lowest_pairs` of what is found at a shift of 2."""
    at = Fake(speed=2.0, columns=np.array([10.0, 1.0]), is_small=lambda count: False)
    at.residuals = lambda roots, x: np.array(residuals)
    vectors = np.array([np.arange(len(roots)), np.ones(len(roots))])
    monkeypatch.setattr(quadratic, "_about_the_lowest", lambda *given: at)
    monkeypatch.setattr(quadratic, "_nearest", lambda problem, count: (at, np.array(roots), vectors))
    return lowest_pairs(MPI.COMM_SELF, None, None, None, count)


def test_pairs_that_count(monkeypatch):
    """The lowest, in their own units; a zero may have any error."""
    found = lowest(monkeypatch, [3j, 0.9e-5, 1j, 1.1e-5j, -2.0], [9.9e-9, 0.5, 1e-9, 1e-10, 2e-9], 4)
    np.testing.assert_allclose(found.roots, [1.8e-5, 2.2e-5j, 2j, -4.0])
    assert found.zero.tolist() == [True, False, False, False]
    np.testing.assert_array_equal(found.vectors, [[10, 30, 20, 40], [1, 1, 1, 1]])
    np.testing.assert_array_equal(found.residuals, [0.5, 1e-10, 1e-9, 2e-9])
    with pytest.raises(SolveError, match=r"^a mode was found with a residual of 1\.1e-08, above 1e-08\.$"):
        lowest(monkeypatch, [3j, 1j], [1e-9, 1.1e-8])


def test_vectors_of_zeros_solve_the_static_equations():
    """In the columns of the problem; what is not zero stays out."""
    problem = Fake(columns=np.array([2.0, 4.0]), in_kernel=lambda x: 10 * x)
    problem.residuals = lambda roots, x: (roots.tolist(), x.tolist())
    vectors = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    pairs = Pairs(np.zeros(3), vectors, np.zeros(3), np.array([True, False, True]), problem)
    np.testing.assert_array_equal(pairs.at_zero(), 10 * vectors[:, [0, 2]])
    assert pairs.residuals_at_zero(vectors[:, :1]) == ([0.0], [[0.5], [1.0]])


def test_kernels_of_singular_matrices():
    """By inverse iteration; vectors have the length 1."""
    K = csr_matrix(np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]]))
    problem = Quadratic(MPI.COMM_SELF, K, 0 * K, csr_matrix(np.eye(3)), 1.0)
    found = problem.in_kernel(np.array([[1.0], [0.9], [0.1]]))
    np.testing.assert_allclose(np.abs(problem.K @ found), 0.0, atol=1e-12)
    assert np.linalg.norm(found) == pytest.approx(1.0)
    assert problem.in_kernel(np.zeros((3, 0))).shape == (3, 0)


def test_hardly_anything_is_added_to_a_singular_matrix(monkeypatch):
    """The first size with which it has factors; none is found where all fail."""
    tried = []

    def splu(A):
        tried.append(float(A.diagonal()[0].real))
        if len(tried) < fails:
            raise RuntimeError("Factor is exactly singular")
        return "factors"

    monkeypatch.setattr(quadratic, "splu", splu)
    fails = 3
    assert quadratic._nearly(csr_matrix((1, 1))) == "factors"
    assert tried == [1e-13, 1e-12, 1e-11]
    fails, tried[:] = 9, []
    with pytest.raises(SolveError, match="singular in more ways"):
        quadratic._nearly(csr_matrix((1, 1)))
    assert len(tried) == 4


def test_values_next_to_each_other_are_refined():
    """A vector that is a hundredth off comes to that of its eigenvalue, of damped oscillators."""
    K, E, M = (csr_matrix(np.diag(x)) for x in ([4.0, 9.0, 25.0], [0.4, 0.0, 1.0], [1.0, 1.0, 1.0]))
    problem = Quadratic(MPI.COMM_SELF, K, E, M, 1.0)
    root = np.roots([1.0, 0.4, 4.0])[0]
    found = problem._refined(root, np.array([1.0, 0.01, 0.01]))
    np.testing.assert_allclose(np.abs(found), [1.0, 0.0, 0.0], atol=1e-9)
    assert problem.residuals(np.array([root]), found[:, None])[0] < 1e-15
