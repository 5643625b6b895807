"""A mooring in the YAML of WISDEM and WEIS as a scene, via the YAML of MoorPy.

components:
    floating_platform: {joints: [{name, location, cylindrical}, ...], members: [{joint1, joint2, axial_joints}, ...]}
    mooring:
        nodes:      [{name, node_type: fixed | vessel | connection, location or joint, node_mass, ...}, ...]
        lines:      [{name, line_type, unstretched_length, node1, node2}, ...]
        line_types: [{name, diameter, mass_density, stiffness, breaking_load, transverse_drag, ...}, ...]
environment: {gravity, water_density, water_depth}
"""

import math
from typing import Any

from ..errors import InputError
from . import from_yaml
from .from_yaml import number, read_yaml, text_of
from .names import Note

#: Keys of a node and their names in a point.
NODE = {"node_mass": "mass", "node_volume": "volume", "drag_area": "CdA", "added_mass": "Ca", "cda": "CdA"}
#: Keys without effect on the mooring.
SILENT = ("name", "node_type", "location", "joint", "anchor_type", "fairlead_type", *NODE)


def scene_of(text: str, title: str = "", depth: float | None = None) -> tuple[dict[str, Any], list[Note]]:
    """The scene of a WISDEM mooring, as its sections and keys, and notes on parts that could not be translated.

    depth: of the water [m] where the file does not give it.  Raises InputError.
    """
    data = read_yaml(text)
    parts = data.get("components", data) if isinstance(data, dict) else {}
    mooring = parts.get("mooring") if isinstance(parts, dict) else None
    if not isinstance(mooring, dict) or not all(
        isinstance(mooring.get(name), list) and mooring[name] for name in ("nodes", "lines", "line_types")
    ):
        raise InputError("there is no mooring with nodes, lines and line_types: this is no file of WISDEM.")
    joints = _joints(parts.get("floating_platform") or {})
    air = data.get("environment") or {}
    site = {"water_depth": air.get("water_depth"), "rho_water": air.get("water_density"), "g": air.get("gravity")}
    left = [str(name) for name in parts if name not in ("mooring", "floating_platform")]
    notes = [Note(f"of this design only mooring is carried over, and not {', '.join(left)}")] if left else []
    for key in dict.fromkeys(key for node in mooring["nodes"] for key in node if key not in SILENT):
        notes.append(Note(f"nodes: {key} is not carried over"))
    moorpy = {
        "points": [_point(node, joints) for node in mooring["nodes"]],
        "lines": [_line(line) for line in mooring["lines"]],
        "line_types": [_type(kind) for kind in mooring["line_types"]],
    }
    scene, more = from_yaml.scene_of_mooring(moorpy, {"site": site}, title, depth)
    return scene, [*notes, *more]


def _joints(platform: dict[str, Any]) -> dict[str, list[float]]:
    """Positions of the joints of a platform by name, and of the axial joints of its members."""
    found = {}
    for joint in platform.get("joints") or []:
        name = text_of(joint, "name", "joints")
        x, y, z = _place(joint, f"joints, {name}")
        found[name] = [x * math.cos(y), x * math.sin(y), z] if joint.get("cylindrical") else [x, y, z]
    for member in platform.get("members") or []:
        ends = [found.get(str(member.get(key))) for key in ("joint1", "joint2")]
        for joint in member.get("axial_joints") or []:
            a, b = ends
            if a is None or b is None:
                continue
            share = number(joint.get("grid"), f"members, axial_joints, {joint.get('name')}: grid")
            found[str(joint.get("name"))] = [p + share * (q - p) for p, q in zip(a, b, strict=True)]
    return found


def _place(row: dict[str, Any], where: str) -> list[float]:
    place = row.get("location")
    if isinstance(place, dict):
        place = [place.get(axis, 0.0) for axis in "xyz"]
    if not isinstance(place, list) or len(place) != 3:
        raise InputError(f"{where}: location must be [x, y, z].")
    return [number(value, f"{where}: location") for value in place]


def _point(node: dict[str, Any], joints: dict[str, list[float]]) -> dict[str, Any]:
    name = str(node["name"] if "name" in node else text_of(node, "node_id", "nodes"))
    if (joint := node.get("joint")) is not None and node.get("location") is None:
        if str(joint) not in joints:
            raise InputError(f"nodes, {name}: joint {joint!r} is none of the joints of floating_platform.")
        place = joints[str(joint)]
    else:
        place = _place(node, f"nodes, {name}")
    found = {"name": name, "type": text_of(node, "node_type", f"nodes, {name}"), "location": place}
    return found | {own: node[key] for key, own in NODE.items() if node.get(key)}


def _line(line: dict[str, Any]) -> dict[str, Any]:
    name = str(line["name"] if "name" in line else text_of(line, "line_id", "lines"))
    keys = {"type": "line_type", "endA": "node1", "endB": "node2", "length": "unstretched_length"}
    return {"name": name} | {own: line.get(key) for own, key in keys.items()}


def _type(kind: dict[str, Any]) -> dict[str, Any]:
    word = str(kind.get("type", "custom"))
    if kind.get("mass_density") is None or kind.get("stiffness") is None:
        name = text_of(kind, "name", "line_types")
        allowed = "its mass_density and stiffness must be given"
        raise InputError(f"line_types, {name}: the properties of {word!r} are WISDEM's own: {allowed}.")
    return {key: value for key, value in kind.items() if key != "type"}
