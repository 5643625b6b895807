"""The linearised equations: modes of a hanging chain, and a step's Jacobian assembled in three parts.

Source: zeros of a Bessel function; Jacobians of time steps.
"""

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from helpers import rates
from mpi4py import MPI
from scipy.linalg import eigvals
from scipy.special import jn_zeros

from dolfbuoy import load_scene
from dolfbuoy.linear.linearisation import linearise

CHAIN = {"gravity": 9.81, "cable": {"length": 3.0, "line_density": 2.0, "top": {"kind": "free"}}}


def frequencies(scene, count):
    """Lowest angular frequencies of an undamped scene [rad/s]."""
    found = linearise(load_scene(scene), MPI.COMM_SELF)
    assert abs(found.E).max() == 0
    inverse_squares = eigvals(found.M.toarray(), found.K.toarray())  # (K - omega^2 M) x = 0
    found.destroy()
    squares = 1 / np.sort(inverse_squares.real[np.isfinite(inverse_squares)])[::-1][: 2 * count]
    return np.sqrt(np.abs(squares))


@pytest.mark.parametrize(("pair", "order"), [((1, 0), 2), ((2, 1), 4)])
def test_modes_of_a_hanging_chain(pair, order):
    """omega_n = j_(0,n)/2 sqrt(g/L), each in two planes; errors fall with the order of the pair, or faster."""
    exact = np.repeat(jn_zeros(0, 3) / 2 * np.sqrt(9.81 / 3.0), 2)
    degrees = {"cable__position_degree": pair[0], "cable__tension_degree": pair[1]}
    sizes = [8, 16, 32]
    found = [frequencies(merged(CHAIN, cable__elements=n, **degrees), 3) for n in sizes]
    np.testing.assert_allclose(found[-1], exact, rtol=0.02 if pair == (1, 0) else 1e-3)
    for errors in np.abs(np.array(found) / exact - 1).T:
        assert np.all(rates(errors, sizes) > 0.75 * order)


def test_a_step_is_affine_in_its_rates():
    """J(gamma_v, gamma_a) = K + gamma_v E + gamma_a M for the moored buoy, drag and current included."""
    scene = load_scene(merged(MOORED, cable__elements=4))
    found = linearise(scene, MPI.COMM_SELF)
    problem, gamma = found.problem, 7.3
    for evolution in problem.evolutions():
        for level in range(evolution.order):
            power = gamma ** (level + 1)
            evolution.hand_out(level, power, -power * evolution.values(found.u))
    problem.system.assemble_jacobian()
    n = len(problem.system.order)
    exact = problem.system.A.getValues(range(n), range(n))
    assembled = (found.K + gamma * found.E + gamma**2 * found.M).toarray()
    sizes = np.abs(exact).max(axis=1, keepdims=True)
    np.testing.assert_allclose(assembled / sizes, exact / sizes, atol=1e-9)
    assert abs(found.E).max() > 0
    assert abs(found.M).max() > 0
    found.destroy()
