"""A made-up record in which all numbers differ, and its scene."""

import math

import numpy as np
import xarray as xr
from dynamics_helpers import MOORED, merged

from dolfbuoy import load_scene
from dolfbuoy.results.parts import alone
from dolfbuoy.results.quantities import QUANTITIES

PERIOD = 5.0
SCENE = load_scene(
    merged(
        MOORED,
        waves={"amplitude": 0.7, "period": PERIOD, "direction_deg": 30.0, "phase_deg": 20.0},
        wind={"speed_10m": 12.0, "direction_deg": 70.0, "area": 1.7, "height": 2.6, "drag_coefficient": 1.1},
        external_force={"force": [300.0, -400.0, 1200.0], "height": 2.0},
        time={"end": 40.0, "step": 0.1, "scheme": "backward-euler"},
    )
)


def extremes(cable_position, cable_tension):
    """Running extremes, as if larger between the frames, and larger still within the ramp."""
    least, largest = cable_tension.min(axis=0), cable_tension.max(axis=0)
    values = {"cable_position_minimum": cable_position.min(axis=0), "cable_tension_minimum": least - 900}
    values |= {"cable_position_maximum": cable_position.max(axis=0) + 0.1, "cable_tension_maximum": largest + 800}
    values["cable_tension_minimum_after_ramp"] = least - np.linspace(100, 700, 6)
    values["cable_tension_maximum_after_ramp"] = largest + np.linspace(700, 200, 6)
    return {name: (QUANTITIES[name].dims, value) for name, value in values.items()}


def made_up(end=40.0):
    """A record in which all numbers differ, with a whole number of rows per frame."""
    t = np.arange(0, end + 1e-9, 0.1)
    frame = t[::4]
    phase, nodes = 2 * math.pi * t / PERIOD, np.linspace(0, 22, 7)
    C = np.column_stack([4 + 2 * np.cos(phase) + 0.05 * t, 1.5 * np.sin(phase), 0.4 + 0.3 * np.sin(phase + 1)])
    half = np.radians(5 + 3 * np.sin(phase))
    q4 = np.column_stack([np.cos(half), 0.6 * np.sin(half), 0.8 * np.sin(half), 0 * t])
    top = 7000 + 900 * np.sin(phase + 0.3) + 2 * t
    series = {
        "time_step": np.full(len(t), 0.1),
        "newton_iterations": 2 + np.arange(len(t)) % 3,
        "tension_top": top,
        "tension_anchor": 3000 + 500 * np.cos(phase) - t,
        "anchor_force": np.column_stack([-900 + 80 * np.sin(phase), 200 + t, -2500 - 700 * np.cos(phase)]),
        "buoy_position": C,
        "buoy_orientation": q4,
        "cone_angle": np.degrees(2 * half),
        "surface_elevation": 0.7 * np.cos(phase - 0.4),
        "anchor_uplift": 2500 + 700 * np.cos(phase),
        "anchor_horizontal": np.hypot(-900 + 80 * np.sin(phase), 200 + t),
        "offset": np.hypot(C[:, 0], C[:, 1]),
        "freeboard": 0.9 + 0.2 * np.sin(phase + 2),
    }
    shape = np.stack([nodes / 22 * C[::4, i, None] for i in range(3)], axis=-1)
    shape[..., 2] = -20 + nodes / 22 * (20.4 + 0.2 * np.sin(2 * math.pi * frame / 7)[:, None])
    frames = {"cable_position": shape, "cable_tension": np.linspace(3000, 7000, 6) + frame[:, None]}
    sizes = {"time": len(t), "cable": 1, "buoy": 1, "anchor": 1, "xyz": 3, "quaternion": 4}
    dims = {name: ("time", *QUANTITIES[name].dims) for name in series}
    data = {name: (dims[name], np.reshape(value, [sizes[d] for d in dims[name]])) for name, value in series.items()}
    data |= {name: (("frame", *QUANTITIES[name].dims), value) for name, value in frames.items()}
    data |= extremes(**frames) | {"lean_at_start": (("buoy",), np.degrees(2 * half[:1]))}
    middle = (nodes[1:] + nodes[:-1]) / 2
    coordinates = {"time": t, "frame": frame, "s": ("node", nodes), "s_cell": ("cell", middle), "xyz": ["x", "y", "z"]}
    coordinates |= {"cable": ["cable"], "buoy": ["buoy"], "anchor": ["cable.from"]}
    for dimension, size in (("node", 7), ("cell", 6)):
        coordinates[f"cable_of_{dimension}"] = dimension, np.zeros(size, dtype=int)
    coordinates["segment_of_cell"] = "cell", np.zeros(6, dtype=int)
    return xr.Dataset(data, coordinates, attrs={"failed_steps": 7, "wall_time_s": 12.5})


RECORD = made_up()
#: To read by hand.
ALONE = alone(RECORD)
