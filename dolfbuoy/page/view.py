"""The 3D view of a run: lines, buoys, sea, forces, and the box around everything."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.airy import AirySum
from ..model.sea import highest_water
from ..model.varying import tide_of
from ..results.devices import Point, winches_of
from ..results.frame import Force, Frame, Frames
from ..results.hulls import Floating
from ..results.running import maximum
from .pack import coarse, exact, single

#: Limit of the text of line frames [bytes]; beyond it only every second, third, ... frame is kept.
MOST_OF_FRAMES = 1_500_000
#: Fractions of all tensions below and above the colour scale, so that a snap does not stretch it.
OUTSIDE = 0.005


def view_of(frames: Frames, rows: NDArray[Any]) -> dict[str, Any]:
    """The view of a run; rows: times at which buoys and forces are packed."""
    record, scene = frames.record, frames.scene
    found = base_view(frames)
    if frames.spans:
        times, positions, tensions = frames.times, record.cable_position.values, record.cable_tension.values
        every = math.ceil(positions[0].size * len(times) * 16 / 3 / MOST_OF_FRAMES)
        kept = np.unique([*range(0, len(times), every), len(times) - 1])
        found["lines"] |= {"time": exact(times[kept]), "position": coarse(positions[kept])}
        found["lines"] |= {"tension": single(tensions[kept]), "scale": scale_of(tensions)}
        found["lines"]["velocity"] = coarse(record.cable_velocity.values[kept]) if "cable_velocity" in record else None
        found["lines"]["largest"] = float(maximum(record, "cable_tension").max())
    for k, buoy in enumerate(found["buoys"]):
        position, orientation = (record[f"buoy_{what}"].values[rows, k] for what in ("position", "orientation"))
        buoy |= {"position": coarse(position), "orientation": coarse(orientation)}
    if scene.waves:
        w = AirySum.of(scene)
        packed = {"amplitude": w.amplitude, "kx": w.wavenumber * w.cosine, "ky": w.wavenumber * w.sine}
        packed |= {"omega": w.at_ground, "phase": w.phase}
        found["sea"]["waves"] = {name: exact(values) for name, values in packed.items()} | {"ramp": w.ramp}
    if scene.sea and scene.sea.tide:
        found["sea"]["tide"] = exact(np.array(list(map(tide_of(scene), record.time.values[rows]))))
    for device, drawn in zip(frames.devices, found["devices"], strict=True):
        for end, packed in zip(device.ends, drawn["ends"], strict=True):
            if end.moves and end.path is not None:
                packed["path"] = coarse(np.array([end.path(t) for t in record.time.values[rows]]))
    for shell, drawn in zip(frames.shells, found["vessels"], strict=True):
        if shell.moves:
            drawn["path"] = coarse(np.array([shell.at(t) for t in record.time.values[rows]]))
    vectors = [force.vectors(rows) for force in frames.forces]
    found["forces"] = [_force(force) | {"values": coarse(v)} for force, v in zip(frames.forces, vectors, strict=True)]
    for force, packed in zip(frames.forces, found["forces"], strict=True):
        if force.path is not None:
            packed["path"] = coarse(np.array([force.path(t) for t in record.time.values[rows]]))
    found["largestForce"] = max((float(np.linalg.norm(v, axis=-1).max()) for v in vectors), default=0.0)
    x, y = np.subtract(found["box"][1], found["box"][0])[:2]
    waves_deg = scene.waves.direction_deg if scene.waves else 0.0
    # heading of the plane of the side view [deg]: of the largest extent, else of the waves
    found["direction"] = waves_deg if max(x, y) <= 1.5 * min(x, y) else 0.0 if x > y else 90.0
    return found


def base_view(frames: Frames) -> dict[str, Any]:
    """Everything that does not move: the sea, the nodes of each line, buoys upright about C, names and box."""
    scene = frames.scene
    slope = list(scene.seabed.slope) if scene.seabed else [0.0, 0.0]
    found: dict[str, Any] = {"lines": _lines(frames) if frames.spans else None, "buoys": []}
    found |= {"forces": [], "largestForce": 0.0}
    start = frames.at(frames.times[0])
    found["devices"] = [{"ends": [_point(end, start) for end in one.ends]} for one in frames.devices]
    found["vessels"] = [{"at": shell.at(float(frames.times[0])).ravel().tolist()} for shell in frames.shells]
    found["sea"] = {"depth": scene.sea.depth, "slope": slope, "waves": None} if scene.sea else None
    for name, buoy in zip(frames.buoys, start.buoys, strict=True):
        upright = Floating(buoy.buoy, np.zeros(3), np.eye(3))
        found["buoys"].append({
            "outline": upright.outline.tolist() if upright.shape else None,
            "masses": [float(place[2]) for place in upright.masses],
            "mast": None if upright.mast is None else upright.mast[:, 2].tolist(),
            "size": upright.size,
            "name": name,
            "start": buoy.r_C.tolist(),
        })  # fmt: skip
    return found | {"box": box_around(frames, found["buoys"]), "labels": labels(frames)}


def _point(end: Point, start: Frame) -> dict[str, Any]:
    """Position of an end of a take-off: on a buoy, at a node, or fixed."""
    if end.buoy is not None and end.arm is not None:
        return {"buoy": end.buoy, "place": end.arm.tolist()}
    return {"at": end.at(start).tolist()} if end.node is None else {"node": end.node}


def _force(force: Force) -> dict[str, Any]:
    """Kind and point of action of a force."""
    if force.arm is None:
        return {"kind": force.kind, "node": force.node}
    return {"kind": force.kind, "buoy": force.buoy, "place": force.arm.tolist()}


def _lines(frames: Frames) -> dict[str, Any]:
    """Cables: name, ranges of nodes and elements (first, last + 1), pieces per element.
    Also marks, ends on buoys, and times at which elements parted, by number."""
    cables = [
        {"name": s.name, "node": [s.node.start, s.node.stop], "cell": [s.cell.start, s.cell.stop], "per": s.per}
        for s in frames.spans
    ]
    held = [_force(force) | {"node": force.node} for force in frames.forces if force.kind == "pulls"]
    ends = [{"node": mark.node, "kind": mark.kind} for mark in frames.marks]
    found: dict[str, Any] = {"cables": cables, "ends": ends, "held": held, "parted": {}}
    if "parted_at" in frames.record:
        since = frames.record.parted_at.values
        found["parted"] = {int(cell): float(since[cell]) for cell in np.flatnonzero(np.isfinite(since))}
    return found


def scale_of(tensions: NDArray[Any]) -> list[float]:
    """Least and largest tension of the colour scale [N]."""
    return list(map(float, np.quantile(tensions[np.isfinite(tensions)], (OUTSIDE, 1 - OUTSIDE))))


def labels(frames: Frames) -> list[dict[str, Any]]:
    """Names of cables and buoys if there are several, and of all take-offs, winches and hulls of vessels."""
    found: list[dict[str, Any]] = []
    if len(frames.spans) > 1:
        found += [{"text": s.name, "node": (s.node.start + s.node.stop) // 2} for s in frames.spans]
    if len(frames.buoys) > 1:
        found += [{"text": name, "buoy": k} for k, name in enumerate(frames.buoys)]
    found += [
        {"text": "take-off" if len(frames.devices) == 1 else one.name, "device": k}
        for k, one in enumerate(frames.devices)
    ]
    found += [{"text": shell.name, "vessel": k} for k, shell in enumerate(frames.shells)]
    for name, piece, end in winches_of(frames.network):
        found.append(
            {"text": f"winch {name}" if len(frames.spans) > 1 else "winch", "node": frames.node_of(piece, end)}
        )
    return found


def box_around(frames: Frames, buoys: list[dict[str, Any]]) -> list[list[float]]:
    """Lower and upper corners around all points and buoys, with the water surface and bed if near."""
    scene, points = frames.scene, frames.places
    low, high = points.min(axis=0), points.max(axis=0)
    room = max((0.6 * buoy["size"] for buoy in buoys), default=0.0)
    low, high = low - [room, room, 0], high + room
    span = float((high - low).max()) or 1.0
    if scene.sea:
        crest = highest_water(scene)
        if high[2] + 0.5 * span > 0 > low[2] - 0.5 * span:
            low[2], high[2] = min(low[2], -crest), max(high[2], crest)
        if low[2] - 0.4 * span < -scene.sea.depth:
            low[2] = min(low[2], -scene.sea.depth)
    return [low.tolist(), high.tolist()]
