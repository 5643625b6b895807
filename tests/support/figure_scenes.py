"""Scenes for figures, and the made-up record of a buoy without a line."""

import math

import numpy as np

from dolfbuoy.results import record as results
from dolfbuoy.scene import load_scene

WAVES = {"amplitude": 0.8, "period": 5.0, "ramp": 3.0, "direction_deg": 25.0, "phase_deg": 40.0}
MOORED = {
    "sea": {"depth": 20},
    "cable": {
        "length": 22,
        "line_density": 27.6,
        "diameter": 0.08,
        "axial_stiffness": 2.3e8,
        "elements": 6,
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "tangential_drag": 0.1,
    },
    "buoy": {
        "hull": [[0, 1.6], [0.4, 2.4], [1.2, 2.4]],
        "mass": 400,
        "center_of_mass": 0.5,
        "inertia": [192, 288],
        "point_masses": [{"mass": 100, "height": 1.5}],
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "axial_drag": 1.0,
    },
    "current": {"speed": 0.5, "direction_deg": 60},
    "wind": {"speed_10m": 10, "direction_deg": 30, "area": 1.0, "height": 2.0},
    "external_force": {"force": [500, 0, 0]},
    "waves": {**WAVES, "period": 2.0, "amplitude": 0.15, "ramp": 0.0},
    "time": {"end": 2.4, "step": 0.04, "output_every": 0.4},
}
HANGING = {
    "cable": {"length": 5, "line_density": 2, "elements": 5, "anchor": [0, 0, 0], "top": {"kind": "free"}},
    "initial": {"kind": "polyline", "points": [[0, 0, 0], [5, 0, 0]]},
    "time": {"end": 0.2, "step": 0.02, "output_every": 0.05},
}


NETWORK = {
    "sea": {"depth": 20.0},
    "seabed": {"friction": 0.4},
    "material": {"rope": {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 3e6, "normal_drag": 1.1}},
    "joint": [{"name": "Y", "mass": 200.0}, {"name": "ring", "volume": 3.0}],
    "cable": [
        {"name": "a-b", "material": "rope", "from": [0.0, 0.0, -20.0], "to": "Y", "length": 30.0, "elements": 4},
        {"name": "port", "material": "rope", "from": "Y", "to": "ring", "segments": [
            {"length": 8.0, "elements": 3, "body": {"volume": 0.1}}, {"length": 9.0, "elements": 2}]},
        {"name": "starboard", "material": "rope", "from": [30.0, -25.0, -20.0], "to": "Y", "length": 34.0,
         "elements": 5},
        {"name": "up", "material": "rope", "from": "ring", "to": "buoy.side", "length": 8.0, "elements": 3},
    ],
    "buoy": MOORED["buoy"] | {"fairleads": {"side": [0.3, 0.0, 0.1]}},
    "time": {"end": 0.2, "step": 0.1},
}  # fmt: skip


def write_free_buoy(folder, times):
    """The made-up record of a buoy without a cable that heaves and rotates about y."""
    scene = load_scene({key: MOORED[key] for key in ("sea", "buoy", "waves")} | {"time": {"end": 1.0, "step": 0.02}})
    folder.mkdir(exist_ok=True)
    scene.save(folder / "scene.toml")
    record = results.Record(folder / "results.nc", {"title": "made up"}, {}, {"buoy": np.array(["buoy"])})
    for t in times:
        beta = 0.2 + 0.3 * t
        values = {
            "buoy_position": np.array([3.0, -2.0, 0.1 * math.sin(t)]),
            "cone_angle": math.degrees(beta),
        }
        values["buoy_orientation"] = np.array([math.cos(beta / 2), 0.0, math.sin(beta / 2), 0.0])
        values["surface_elevation"] = 0.0
        record.add({"time": [t]} | {name: [[value]] for name, value in values.items()})
    record.flush()
    return folder
