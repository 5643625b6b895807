"""Numbers of a scene change without recompiling or rebuilding anything.

Source: the same scene built from scratch.
"""

import numpy as np
import pytest
from dynamics_helpers import DRAGGED, MOORED, merged
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.model.pool import Pool
from dolfbuoy.model.problem import Problem
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.scene import shipped_scenes
from dolfbuoy.scene.settings import Space, fitting, space_of, stepping_of, with_settings
from dolfbuoy.solver import compat

SCENE = merged(MOORED, cable__elements=4, time={"end": 0.2, "step": 0.02})
SCENE = merged(SCENE, wind={"speed_10m": 8.0, "area": 1.0, "height": 2.0})
#: One number of everything.
OTHER = {
    "gravity": 9.7,
    "sea__density": 1010.0,
    "sea__depth": 20.05,
    "cable__line_density": 25.0,
    "cable__normal_drag": 0.7,
    "cable__added_mass": 0.4,
    "buoy__mass": 1010.0,
    "buoy__added_mass": 0.2,
    "buoy__axial_drag": 0.9,
    "buoy__mooring_height": 0.2,
    "waves__amplitude": 0.6,
    "waves__period": 4.1,
    "waves__direction_deg": 130.0,
    "current__speed": 0.8,
    "wind__speed_10m": 11.0,
    "external_force__force": [300.0, -100.0, 20.0],
}


def march(simulation):
    """Unknowns after every step."""
    return np.array([simulation.system.u.copy() for _ in simulation.run()])


@pytest.mark.parametrize("slack", ["compressive", "tension-only"])
def test_a_problem_serves_another_scene(slack):
    """Bit for bit the run of a problem built for that scene."""
    first, second = (load_scene(merged(SCENE, cable__slack=slack), **changes) for changes in ({}, OTHER))
    fresh = Simulation(second, MPI.COMM_SELF)
    expected = march(fresh)
    used = Simulation(first, MPI.COMM_SELF)
    before = march(used)
    again = Simulation(second, MPI.COMM_SELF, problem=used.problem)
    assert again.problem is used.problem
    np.testing.assert_array_equal(march(again), expected)
    assert np.abs(before - expected).max() > 0.01
    for simulation in (fresh, again):
        simulation.problem.destroy()


@pytest.mark.parametrize(
    "changes",
    [
        {"cable__elements": 5},
        {"cable__normal_drag": 0.0},
        {"cable__axial_stiffness": float("inf")},
        {"waves": None},
        {"solver__hull_cells": 7},
    ],
)
def test_another_structure_needs_another_problem(changes):
    scene = load_scene(SCENE)
    problem = Problem(scene, dynamic=True, comm=MPI.COMM_SELF)
    with pytest.raises(ValueError, match="more than numbers"):
        problem.change(load_scene(scene, **changes))
    problem.destroy()


def test_a_pool_gives_what_a_problem_of_its_own_gives():
    """Runs one after the other, of two structures by turns, from the equilibrium to the record; bit for bit."""
    taut = merged(SCENE, cable__slack="tension-only")
    by_turns([load_scene(s, **c) for c in ({}, OTHER, {"waves__amplitude": 0.9}) for s in (SCENE, taut)])


def test_a_pool_forgets_what_a_run_leaves_behind():
    """Springs of friction that were stretched, under a line and a sinker that are dragged; where the line parted."""
    dragged = merged(DRAGGED, time__end=0.1, cable__fails_at={"time": 0.06, "at": 9.0})
    many = merged(dragged, cable__elements=5)
    other = {"cable__line_density": 1.3, "seabed__friction": 0.4}
    by_turns([load_scene(s, **c) for c in ({}, other, {}) for s in (dragged, many)])


def by_turns(scenes):
    """Runs of a pool, and of problems of their own; of the scenes every other one has the same structure."""
    pool, problems = Pool(), []
    for scene in scenes:
        simulation = Simulation(scene, MPI.COMM_SELF, pool=pool)
        problems.append(simulation.problem)
        found = march(simulation)
        simulation.problem.destroy()
        alone = Simulation(scene, MPI.COMM_SELF)
        np.testing.assert_array_equal(found, march(alone))
        alone.problem.destroy()
    assert problems[0] is problems[2] is problems[4]
    assert problems[1] is problems[3] is problems[5]
    assert problems[0] is not problems[1]
    pool.clear()


ESSENTIAL = ("short", "lazy-wave", "two-buoys")


@pytest.mark.parametrize(
    "name",
    [n if n in ESSENTIAL else pytest.param(n, marks=pytest.mark.slow) for n in shipped_scenes() if n != "free-buoy"],
)
def test_forms_are_those_of_another_mesh(name, monkeypatch):
    """Signatures that a scene's forms are given are those that UFL finds, with half the elements too."""
    given, sign = [], compat.sign

    def compared(forms, kind):
        found = [form.signature() for form in forms]
        sign(forms, kind)
        given.extend(zip(found, (form.signature() for form in forms), strict=True))

    monkeypatch.setattr(compat, "sign", compared)
    scene = load_scene(name)
    cells = max(1, space_of(scene).cells // 2)
    coarse = with_settings(scene, fitting(scene, Space(2, 1, cells)), stepping_of(scene))
    for one in (coarse, with_settings(scene, fitting(scene, Space(2, 1, 2 * cells)), stepping_of(scene))):
        for dynamic in (True, False):
            Problem(one, dynamic, MPI.COMM_SELF).destroy()
    assert given
    assert all(found == own for found, own in given)


def test_a_pool_keeps_few():
    pool = Pool()
    pool.most = 2
    first, second, third = (
        pool.problem(load_scene(SCENE, cable__elements=n), dynamic=True, comm=MPI.COMM_SELF) for n in (3, 4, 5)
    )
    second.newton.fallbacks = 3
    assert pool.problem(load_scene(SCENE, cable__elements=4), dynamic=True, comm=MPI.COMM_SELF) is second
    assert second.newton.fallbacks == 0
    assert pool.problem(load_scene(SCENE, cable__elements=5), dynamic=True, comm=MPI.COMM_SELF) is third
    assert pool.problem(load_scene(SCENE, cable__elements=3), dynamic=True, comm=MPI.COMM_SELF) is not first
    pool.clear()
