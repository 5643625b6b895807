"""First steps of scenes that no command of cases.toml runs: starts that are given, lines that part, sinkers, memory."""

from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

from dynamics_helpers import DRAGGED
from told import MOORED, refused, show

from dolfbuoy import load_scene
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.observe import Observer

INF = float("inf")
FILE = Path(__file__).parents[2] / "reference" / "truncated_cylinder.nc"
BODY = {"mass": 2.0, "center_of_mass": 0.0, "inertia": [1.0, 1.0]}


def swung(scheme, EA, kind="straight", **cable):
    """A body that is thrown at the end of a line."""
    points = {"points": [[0.0, 0.0, 0.0], [0.5, 0.1, 0.0], [1.0, 0.0, 0.0]]} if kind == "polyline" else {}
    start = {"kind": kind, "buoy_position": [1.0, 0.0, 0.0], "buoy_velocity": [0.3, 2.0, 0.1]} | points
    line = {"length": 1.0, "line_density": 1.0, "axial_stiffness": EA, "elements": 4} | cable
    time = {"end": 0.1, "step": 0.01, "scheme": scheme}
    return {"gravity": 0.0, "cable": line, "buoy": BODY, "initial": start, "time": time}


def parting(rule, own):
    """A chain of three segments that hangs and parts."""
    segments = [{"length": length, "elements": n} for length, n in ((1.0, 2), (2.0, 4), (1.0, 2))]
    segments[1] |= {"fails_at": own} if own else {}
    cable = {"line_density": 3.0, "anchor": [0.0, 0.0, 0.0], "top": {"kind": "free"}, "fails_at": rule}
    return {"cable": cable | {"segments": segments}, "time": {"end": 0.4, "step": 0.02, "scheme": "backward-euler"}}


CYLINDER = {
    "sea": {"depth": 20.0},
    "waves": {"amplitude": 0.15, "period": 3.0, "ramp": 0.1, "direction_deg": 30.0},
    "buoy": {
        "hull": [[0.0, 2.0], [1.6, 2.0]],
        "mass": 2576.1,
        "center_of_mass": 0.6,
        "inertia": [1500.0, 1300.0],
        "potential_flow": str(FILE),
        "initial": {"buoy_position": [0.0, 0.0, 0.1], "buoy_velocity": [0.2, 0.0, 0.0]},
    },
    "time": {"end": 12.0, "step": 0.02, "scheme": "bdf2"},
}
PLACED = MOORED | {"initial": {"buoy_position": [7.0, 1.0, -0.6], "buoy_orientation": [1.0, 0.05, 0.02, 0.1]}}
SCENES = {
    "a rod": swung("generalized-alpha", INF),
    "a rod by bdf2": swung("bdf2", INF),
    "a line": swung("generalized-alpha", 1e3, "polyline", position_degree=2, tension_degree=1, length=1.1),
    "a damped line": swung("bdf2", 1e3, damping=5.0),
    "above all": parting({"time": 0.06, "at": 1.7}, None),
    "by tension": parting({"tension": 100.0}, None),
    "twice": parting({"time": 0.04}, {"time": 0.08, "at": 0.2}),
    "a sinker": DRAGGED,
    "memory": CYLINDER,
    "memory and drift": CYLINDER | {"buoy": CYLINDER["buoy"] | {"drift": "newman"}},
    "placed": PLACED,
}


def steps(name, scene):
    """Five steps of a scene, and what it starts with."""
    simulation = Simulation(load_scene(scene))
    with closing(SimpleNamespace(close=simulation.problem.destroy)):
        show({f"{name}: start": simulation.system.u} | {f"{name}: {k}": v for k, v in simulation.end_forces.items()})
        for _ in range(5):
            simulation.step(simulation.scene.time.step)
        observer = Observer(simulation.problem)
        show({f"{name}: {key}": values for key, values in observer.values(simulation.end_forces).items()})
        show({f"{name}: unknowns": simulation.system.u})
        print(name, f"{simulation.t:.6g} s, {simulation.newton.numbers.iterations} iterations")


for name, scene in SCENES.items():
    steps(name, scene)
refused(
    lambda: Simulation(load_scene(swung("bdf2", INF, "polyline"))),
    lambda: Simulation(load_scene(swung("bdf2", INF, length=0.9))),
    lambda: Simulation(load_scene(swung("bdf2", INF) | {"initial": {"kind": "straight"}})),
    lambda: Simulation(load_scene(swung("bdf2", INF) | {"initial": {"kind": "polyline", "points": [[0, 0, 0]]}})),
    lambda: Simulation(load_scene({"cable": MOORED["cable"], "sea": MOORED["sea"]})),
)
