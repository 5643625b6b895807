"""Natural modes of random scenes: each is an eigenpair of the dense problem, and none in the range is missing.

Source: dense QZ (LAPACK) of the companion pencil, with the same matrices.
"""

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from random_scenes import STRUCTURES, free_structures, scenes
from scipy.linalg import eig

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.linear.linearisation import linearise
from dolfbuoy.linear.natural import lowest_modes
from dolfbuoy.solver.quadratic import Quadratic

#: The same scenes in every run; nothing is gained by simpler ones.
FIXED = {
    "phases": [Phase.generate],
    "derandomize": True,
    "deadline": None,
    "database": None,
    "suppress_health_check": list(HealthCheck),
}
#: Roots of QZ that are nearer to each other than this part are one set.
NEAR = 1e-3
#: Below this part of the smallest root they are zeros, which are double, and which QZ splits.
NONE = 1e-3

ENDS = ("confirmed", "refused", "no equilibrium", "nothing moves")


def judge(data, number=6):
    """Compare the modes of a scene with QZ; returns how it ended."""
    try:
        scene = load_scene(data)
        found = linearise(scene, MPI.COMM_SELF)
    except (InputError, SolveError):  # test_random_scenes looks at those
        return "no equilibrium"
    try:
        modes = lowest_modes(found, number)
    except (InputError, SolveError) as error:
        return "refused" if str(error).startswith("At rest ") else f"failed: {error}"
    finally:
        found.destroy()
    assert max((mode.residual for mode in modes), default=0.0) < 1e-8
    roots = np.array([mode.root for mode in modes if mode.root])
    if not len(roots):
        return "nothing moves"
    return compare(roots, Quadratic(MPI.COMM_SELF, *found.whole, np.abs(roots).min()))


def compare(roots, problem):
    """As sets: roots of QZ that are together have the same mean and number as what was found there."""
    exact = problem.speed * dense(problem)
    exact = exact[(np.abs(exact) > NONE * np.abs(roots).min()) & (exact.imag > -1e-9 * np.abs(exact))]
    groups = clusters(exact)
    mine = [[] for _ in groups]
    for root in roots:
        mine[int(np.argmin([np.abs(group - root).min() for group in groups]))].append(root)
    for group, found in zip(groups, mine, strict=True):
        if np.abs(group).max() < (1 - 1e-9) * np.abs(roots).max():
            assert len(found) == len(group), (group, roots)
        if len(found) == len(group):
            assert abs(np.mean(found) - group.mean()) < 1e-6 * abs(group.mean()), (group, roots)
        elif found:  # the rest of the group was not asked for
            assert max(np.abs(group - root).min() for root in found) < NEAR * abs(group.mean()), (group, roots)
    return "confirmed"


def dense(problem):
    """Roots of the companion pencil, in units in which stiff lines do not swamp the rounding of QZ."""
    K, E, M = (A.toarray() for A in (problem.K, problem.E, problem.M))
    size = np.abs(K.diagonal()) + np.abs(M.diagonal())
    unit = np.where(size > 0, size, 1.0) ** -0.5
    K, E, M = (unit[:, None] * A * unit for A in (K, E, M))
    zero, one = np.zeros_like(K), np.eye(len(K))
    with np.errstate(all="ignore"):
        found = eig(np.block([[zero, one], [-K, -E]]), np.block([[one, zero], [zero, M]]), right=False)
    return found[np.isfinite(found)]


def clusters(roots):
    """Roots in groups that are nearer to each other than NEAR."""
    left, found = list(roots), []
    while left:
        group, more = [left.pop()], True
        while more:
            more = [z for z in left if min(abs(z - other) for other in group) < NEAR * abs(z)]
            group += more
            left = [z for z in left if z not in more]
        found.append(np.array(group))
    return found


def confirmed(ends):
    assert all(end in ENDS or ("mode" in end and "\n" not in end) for end in ends), ends
    return np.mean([end == "confirmed" for end in ends])


def collect(strategy, count):
    ends = []

    @settings(max_examples=count, **FIXED)
    @given(strategy)
    def run(scene):
        ends.append(judge(scene))

    run()
    return ends


def test_random_modes():
    ends = collect(st.sampled_from(sorted(STRUCTURES)).flatmap(lambda name: scenes(STRUCTURES[name])), 20)
    assert confirmed(ends) > 0.2, ends


def test_a_motion_much_stiffer_than_the_others():
    """25 t on a hanging rope that hardly stretches: sqrt(EA/L/m) = 789 rad/s, among motions of the rope itself."""
    cable = {"length": 13.2, "line_density": 0.0145, "elements": 4, "grading": 2.85, "axial_stiffness": 2.026e11}
    cable |= {"position_degree": 2, "tension_degree": 1}
    buoy = {"mass": 24650.0, "hull": [[0.0, 6.3], [0.53, 3.65]], "center_of_mass": 0.0, "inertia": [1e5, 1e5]}
    found = linearise(load_scene({"cable": cable, "buoy": buoy}), MPI.COMM_SELF)
    modes = lowest_modes(found, 6)
    assert min(abs(mode.omega - np.sqrt(2.026e11 / 13.2 / 24650.0)) for mode in modes) < 1.0
    assert judge({"cable": cable, "buoy": buoy}) == "confirmed"
    found.destroy()


@pytest.mark.slow
def test_many_random_modes():
    ends = collect(st.sampled_from(sorted(STRUCTURES)).flatmap(lambda name: scenes(STRUCTURES[name])), 200)
    assert confirmed(ends) > 0.3, ends


@pytest.mark.slow
def test_modes_of_random_structures():
    ends = collect(free_structures().flatmap(scenes), 100)
    assert confirmed(ends) > 0.2, ends
