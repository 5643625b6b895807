"""Iterations by every way to rest that suits a scene, and the rest that it finds."""

from fingerprint import of_array
from mpi4py import MPI
from told import MOORED

from dolfbuoy import SolveError, load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.statics.start import closed_form
from dolfbuoy.statics.ways import WAYS

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
