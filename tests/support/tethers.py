"""A heavy tail below a buoyant rope, and tethers of wave riders: several kinds of segment below a buoy."""

ROPE = {"line_density": 0.072, "diameter": 0.012, "axial_stiffness": 3.0e4}
CHAIN = {"line_density": 5.0, "diameter": 0.03, "axial_stiffness": 1.0e7}
RUBBER = [[0.0, 0.0], [0.5, 230.0], [1.0, 390.0], [2.0, 660.0], [3.0, 1100.0]]
CORD = {"line_density": 0.96, "diameter": 0.033, "axial_stiffness": RUBBER}
HULL = {"hull": [[0.0, 0.9], [0.9, 0.9]], "mass": 225.0, "center_of_mass": 0.3}
FLOAT, CLUMP = {"mass": 1.0, "volume": 0.006, "drag_area": 0.03}, {"mass": 6.0, "volume": 0.001, "drag_area": 0.01}


def tail(**more):
    """5 m of 5 kg/m, then 115 m of buoyant rope, in 100 m of water flowing at 1.5 m/s."""
    segments = [CHAIN | {"length": 5.0, "elements": 5}, ROPE | {"length": 115.0, "elements": 40}]
    cable = {"name": "line", "segments": segments, "slack": "tension-only", "normal_drag": 1.2}
    scene = {"sea": {"depth": 100.0}, "seabed": {}, "current": {"speed": 1.5, "profile": "power"}}
    return scene | {"cable": [cable], "buoy": HULL | {"normal_drag": 0.6}} | more


def tether(depth=60.0, speed=0.5, rope=40.0, bed=True, bodies=(FLOAT, CLUMP), **cable):
    """Chain, rope with a float and a clump, and a rubber cord up to the buoy."""
    segments = [CHAIN | {"length": 10.0, "elements": 10}]
    segments += [ROPE | {"length": rope, "elements": 20}, ROPE | {"length": 25.0, "elements": 12}]
    for segment, body in zip(segments[1:], bodies, strict=False):
        segment["body"] = body
    segments += [CORD | {"length": 15.0, "elements": 12}]
    line = {"name": "tether", "segments": segments, "slack": "tension-only", "normal_drag": 1.2} | cable
    scene = {"sea": {"depth": depth, "dry_above": False}, "cable": [line], "buoy": HULL}  # drag as in `drag_and_weight`
    scene |= {"current": {"speed": speed}} if speed else {}
    return scene | ({"seabed": {} if bed is True else bed} if bed else {})
