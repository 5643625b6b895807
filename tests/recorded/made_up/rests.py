"""Starts from which a rest is sought, the way to it and the rest itself; what is said where there is none."""

from fingerprint import of_array
from mpi4py import MPI
from told import refused, show

from dolfbuoy import load_scene
from dolfbuoy.model.problem import Problem
from dolfbuoy.statics.equilibrium import solve_equilibrium
from dolfbuoy.statics.start import closed_form, given_start

ROPE = {"line_density": 0.072, "diameter": 0.012, "axial_stiffness": 3.0e4}
CHAIN = {"line_density": 5.0, "diameter": 0.03, "axial_stiffness": 1.0e7}
RUBBER = [[0.0, 0.0], [0.5, 230.0], [1.0, 390.0], [2.0, 660.0], [3.0, 1100.0]]
CORD = {"line_density": 0.96, "diameter": 0.033, "axial_stiffness": RUBBER}
HULL = {"hull": [[0.0, 0.9], [0.9, 0.9]], "mass": 225.0, "center_of_mass": 0.3}
FLOAT, CLUMP = {"mass": 1.0, "volume": 0.006, "drag_area": 0.03}, {"mass": 6.0, "volume": 0.001, "drag_area": 0.01}


def tail():
    """A heavy tail under a rope that floats."""
    segments = [CHAIN | {"length": 5.0, "elements": 5}, ROPE | {"length": 115.0, "elements": 40}]
    cable = {"name": "line", "segments": segments, "slack": "tension-only", "normal_drag": 1.2}
    scene = {"sea": {"depth": 100.0}, "seabed": {}, "current": {"speed": 1.5, "profile": "power"}}
    return scene | {"cable": [cable], "buoy": HULL | {"normal_drag": 0.6}}


def tether(speed=0.5, bed=True):
    """Chain, rope with a float and a clump, and a rubber cord up to the buoy."""
    segments = [CHAIN | {"length": 10.0, "elements": 10}]
    segments += [ROPE | {"length": 40.0, "elements": 20}, ROPE | {"length": 25.0, "elements": 12}]
    for segment, body in zip(segments[1:], (FLOAT, CLUMP), strict=False):
        segment["body"] = body
    segments += [CORD | {"length": 15.0, "elements": 12}]
    line = {"name": "tether", "segments": segments, "slack": "tension-only", "normal_drag": 1.2}
    scene = {"sea": {"depth": 60.0, "dry_above": False}, "cable": [line], "buoy": HULL}
    scene |= {"current": {"speed": speed}} if speed else {}
    return scene | ({"seabed": {}} if bed else {})


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
