"""Iterations by every way to rest that suits a scene, and the rest that it finds."""

from functools import partial
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
from fingerprint import of_array
from mpi4py import MPI
from told import MOORED

from dolfbuoy import SolveError, load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.statics import ways
from dolfbuoy.statics.start import closed_form
from dolfbuoy.statics.ways import WAYS, Way

line = MOORED["cable"]
free = line | {"top": {"kind": "free", "force": [2000.0, 0.0, 12000.0]}}
fixed = line | {"top": {"kind": "fixed", "position": [12.0, 1.0, -3.5]}}
folded = fixed | {"slack": "tension-only"}
taut = line | {"top": {"kind": "fixed", "position": [15.0, 1.0, 0.0]}}
for name, cable in {"free": free, "fixed": fixed, "folded": folded, "taut": taut}.items():
    scene = load_scene({"sea": {"depth": 20.0}, "current": {"speed": 0.8}, "cable": cable})
    problem = Problem(scene, dynamic=False, comm=MPI.COMM_SELF)
    problem.set_time(0.0)
    print(f"{name}: forces are measured by {problem.typical_force:.6g} N")
    for way in (way for way in WAYS if way.suits(problem) and (name != "taut" or way.name == "newton")):
        problem.iterations = 0
        closed_form(problem).put()
        try:
            way.go(problem)
        except SolveError as error:
            print(f"{name} by {way.name}: {error}")
        else:
            print(f"{name} by {way.name}: {problem.iterations} iterations to {of_array(problem.system.u)}")
    problem.destroy()


class Made:
    """A problem that ways find, or do not: what they end in, by name, and whether that is compressed."""

    def __init__(self, ends, suits=True):
        self.comm, self.route, self.iterations, self.ends, self.tried = MPI.COMM_SELF, None, 0, ends, []
        self.system = SimpleNamespace(u=np.zeros(1), publish=lambda: None, evaluate=lambda: None)
        self.ways = [Way(name, partial(self.go, name), lambda _, name=name: suits or "2" not in name) for name in ends]

    def go(self, name, _):
        """Go this way."""
        self.tried.append(name)
        if isinstance(self.ends[name], str):
            raise SolveError(self.ends[name])
        self.system.u[0] = self.ends[name]

    def put(self):
        """Begin anew."""
        self.system.u[0] = 0.0


for ends in (
    {"newton": 1.0, "way 2": 2.0},
    {"newton": "it diverged", "way 2": 2.0},
    {"newton": "it diverged"},
    {"newton": "it diverged", "way 2": "it stalled", "way 3": "it sank"},
    {"newton": -1.0, "way 2": 2.0, "relaxation": -3.0, "other slack law": 4.0},
    {"newton": -1.0, "relaxation": "it moved", "other slack law": -4.0},
):
    for suits in (True, False):
        problem = Made(ends, suits)
        with patch.object(ways, "is_compressed", lambda made: made.system.u[0] < 0):
            try:
                ways.find_rest(problem, problem.put, problem.ways)
            except SolveError as error:
                print(*problem.tried, "|", error)
            else:
                print(*problem.tried, "|", problem.route, problem.system.u)
for reach in (2.0, 0.6, 0.3, 0.0):
    fractions = []

    def newton(_, reach=reach, fractions=fractions):
        """Fail for a step that is too large for where it begins."""
        good = [x for x, solved in fractions[:-1] if solved]
        fractions[-1][1] = not good or fractions[-1][0] - good[-1] <= reach * (1.1 - good[-1])
        if not fractions[-1][1]:
            raise SolveError("it diverged")

    with patch.object(ways, "newton", newton):
        try:
            ways.march(None, lambda x, fractions=fractions: fractions.append([x, False]))
        except SolveError as error:
            print(error)
    print(*(f"{x:.4g}{'' if solved else '!'}" for x, solved in fractions))
