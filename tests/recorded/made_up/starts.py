"""Starts of the search for rest, which it may forgive: shapes, evaluations of the network, iterations from there."""

from unittest.mock import patch

import numpy as np
from fingerprint import of_array
from mpi4py import MPI

from dolfbuoy import SolveError, load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.statics import network_equations
from dolfbuoy.statics.equilibrium import _rest
from dolfbuoy.statics.start import closed_form

SCENES = ("short", "chain-on-bed", "three-legs", "navigation-buoy", "lazy-wave", "two-buoys", "hanging-chain")
SCENES += ("towed-array", "bridle", "power-cable", "jumper", "subsurface-float", "articulated-column")
#: What else a start looks at, of scenes that are there.
CHANGES = (
    ("three-legs", {"current": {"speed": 1.2, "direction_deg": 40.0}}),
    ("chain-on-bed", {"seabed.slope": [0.05, -0.02]}),
    ("navigation-buoy", {"current.speed": 2.5}),
)
solve = network_equations.Equations.solve
evaluations = []


def counted(equations, near=None):
    """`Equations.solve`, whose evaluations are counted."""
    found = solve(equations, near)
    evaluations.append(equations.evaluations)
    return found


def told(name, changes=None):
    """The start of a scene, what it took, and what it takes from there."""
    problem = Problem(load_scene(name, **changes or {}), dynamic=False, comm=MPI.COMM_SELF)
    problem.set_time(0.0)
    evaluations.clear()
    try:
        with patch.object(network_equations.Equations, "solve", counted):
            start = closed_form(problem)
        print(name, *(changes or {}), "evaluations", *evaluations)
        for piece, shape in zip(problem.network.pieces, start.shapes, strict=False):
            s = np.linspace(0.0, piece.section.length, 6)
            print(" ", of_array(shape.position(s)), of_array(shape.tension(s)), type(shape).__name__)
        start.put()
        print("  unknowns", of_array(problem.system.u))
        _rest(problem)
        print(f"  {problem.route}: {problem.iterations} iterations to {of_array(problem.system.u)}")
    except SolveError as error:
        print(" ", error)
    finally:
        problem.destroy()


for scene in SCENES:
    told(scene)
for scene, other in CHANGES:
    told(scene, other)
