"""Starts from which a rest is sought, the way to it and the rest itself; what is said where there is none."""

from fingerprint import of_array
from mpi4py import MPI
from tethers import CHAIN, HULL, tail, tether
from told import refused, show

from dolfbuoy import load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.statics.start import closed_form, given_start

LINE = {"name": "line", "segments": [CHAIN | {"length": 60.0, "elements": 8}], "slack": "tension-only"}
SIDE = {"from": [30.0, 0.0, -50.0], "to": "buoy", "stiffness": 20.0, "length": 45.0}
BESIDE = {"sea": {"depth": 50.0}, "cable": [LINE], "buoy": HULL, "take_off": SIDE}
HANGING = {
    "cable": {
        "anchor": [0.0, 0.0, 0.0],
        "length": 3.0,
        "line_density": 0.5,
        "elements": 8,
        "bending_stiffness": 50.0,
        "to_end": {"direction": [0.6, 0.0, -0.8], "rotational_stiffness": 40.0},
    },
    "buoy": {"mass": 20.0, "center_of_mass": 0.0, "inertia": [2.0, 2.0], "mooring_height": 1.0},
}
SCENES = {
    "tail": tail(),
    "tether": tether(),
    "no bed, still water": tether(bed=False, speed=0.0),
    "beside": BESIDE,
    "beside, from points": BESIDE | {"initial": {"points": [[0.0, 0.0, -50.0], [10.0, 0.0, -30.0], [25.0, 0.0, 0.0]]}},
    "hanging": HANGING,
}


def rest(name, data):
    """The start and the rest of a scene."""
    scene = load_scene(data)
    problem = Problem(scene, dynamic=False, comm=MPI.COMM_SELF)
    (given_start if scene.initial.points else closed_form)(problem).put()
    show({f"{name}: start": problem.system.u})
    problem.destroy()
    problem = solve_equilibrium(scene, MPI.COMM_SELF)
    print(f"{name}: {problem.route}, {problem.iterations} iterations, {of_array(problem.system.u)}")
    problem.destroy()


for name, data in SCENES.items():
    rest(name, data)
BARE = {"length": 10.0, "line_density": 1.0, "axial_stiffness": 1e5, "elements": 4, "anchor": [0.0, 0.0, 0.0]}
HELD, FREE = {"kind": "fixed", "position": [6.0, 0.0, 3.0]}, {"kind": "free"}
AFLOAT = {"sea": {"depth": 20.0}, "buoy": HULL}
NOTHING = [
    {"gravity": 0.0, "cable": BARE | {"top": FREE}},
    {"gravity": 0.0, "cable": BARE | {"top": HELD}},
    {"cable": BARE | {"length": 6.0, "axial_stiffness": float("inf"), "top": HELD}},
    {"gravity": 0.0, "cable": BARE, "buoy": {"mass": 20.0, "center_of_mass": 0.0, "inertia": [2.0, 2.0]}},
    BESIDE | {"initial": {"points": [[1.0, 0.0, -50.0], [25.0, 0.0, 0.0]]}},
    AFLOAT | {"buoy": HULL | {"mass": 9000.0}},
]
refused(*(lambda data=data: solve_equilibrium(load_scene(data), MPI.COMM_SELF) for data in NOTHING))
