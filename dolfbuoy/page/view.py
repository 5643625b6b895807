"""What the picture in space shows of a run: lines, buoys, sea, forces, and the box around all of it."""

import math

import numpy as np

from ..model.airy import AirySum
from ..model.rigid import mass_properties, mooring_offset, shape_of
from ..model.sea import crest_height, wind_at
from ..scene.network import attached_ends
from .pack import coarse, exact, single

#: Bytes of text that frames of the lines may take; of more only every second, third, ... is kept.
MOST_OF_FRAMES = 1_500_000
#: Parts of all tensions below and above the colour scale: a snap does not take it all.
OUTSIDE = 0.005


def view_of(record, scene, rows) -> dict:
    """The view of a record; rows: of the times at which buoys and forces are packed."""
    network = scene.network
    found = base_view(scene, network)
    if "cable_position" in record:
        found["lines"] = _lines(record, network)
    for k, buoy in enumerate(found["buoys"]):
        position, orientation = (record[f"buoy_{what}"].values[rows, k] for what in ("position", "orientation"))
        buoy |= {"position": coarse(position), "orientation": coarse(orientation), "start": position[0].tolist()}
    found["forces"], found["largestForce"] = _forces(record, scene, network, rows)
    found["box"] = box_around([*_places(record)], found["buoys"], scene)
    found["direction"] = _direction(scene, found["box"])
    found["labels"] = labels(network, found.get("lines"))
    return found


def base_view(scene, network) -> dict:
    """What does not move: the sea, and the buoys upright about their centres of mass."""
    buoys = [_buoy(buoy, name) for name, buoy in network.buoys.items()]
    return {"lines": None, "buoys": buoys, "sea": _sea(scene), "forces": [], "largestForce": 0.0}


def _buoy(buoy, name):
    shape = shape_of(buoy)
    center = mass_properties(buoy, shape).height
    heights = [
        center,
        buoy.mooring_height,
        *(p.height for p in buoy.point_masses),
        *((0.0, shape.height) if shape else ()),
    ]
    found = {"name": name, "outline": None, "masses": [p.height - center for p in buoy.point_masses], "mast": None}
    if shape:
        found["outline"] = [[h - center, d / 2] for h, d in buoy.hull]
    if buoy.point_masses or not shape:
        foot = shape.height if shape else buoy.mooring_height
        found["mast"] = [foot - center, max(heights) - center]
    width = shape.max_diameter if shape else 0.0
    return found | {"size": max(max(heights) - min(heights), width) or 1.0}


def _sea(scene):
    if scene.sea is None:
        return None
    slope = list(scene.seabed.slope) if scene.seabed else [0.0, 0.0]
    return {"depth": scene.sea.depth, "slope": slope, "waves": _waves(scene)}


def _waves(scene):
    if scene.waves is None:
        return None
    w = AirySum.of(scene)
    packed = {"amplitude": w.amplitude, "kx": w.wavenumber * w.cosine, "ky": w.wavenumber * w.sine}
    packed |= {"omega": w.at_ground, "phase": w.phase}
    return {name: exact(values) for name, values in packed.items()} | {"ramp": w.ramp}


# -- lines -------------------------------------------------------------------------------------------------------------


def _lines(record, network):
    frames, positions, tensions = record.frame.values, record.cable_position.values, record.cable_tension.values
    every = math.ceil(positions[0].size * len(frames) * 16 / 3 / MOST_OF_FRAMES)
    kept = np.unique([*range(0, len(frames), every), len(frames) - 1])
    found = {"time": exact(frames[kept]), "position": coarse(positions[kept]), "tension": single(tensions[kept])}
    found["velocity"] = coarse(record.cable_velocity.values[kept]) if "cable_velocity" in record else None
    found["scale"] = scale_of(tensions)
    found["cables"] = cables(record, network)
    found["ends"] = end_marks(network, found["cables"], joints_of(record, positions[0]))
    found["held"] = [
        {"node": _end_node(network, found["cables"], k, end), "cable": network.pieces[k].cable}
        | _on_buoy(network, k, end)
        for k, end in attached_ends(network)
    ]
    return found


def scale_of(tensions) -> list[float]:
    """Least and largest tension of the colours [N]."""
    return np.quantile(tensions[np.isfinite(tensions)], (OUTSIDE, 1 - OUTSIDE)).tolist()


def cables(record, network) -> list[dict]:
    """Of every cable its name, its first node and element and the ones behind its last, and nodes per element."""
    found = []
    for k, name in enumerate(network.cables):
        spans = []
        for dimension in ("node", "cell"):
            own = np.flatnonzero(record[f"cable_of_{dimension}"].values == k)
            spans.append([int(own[0]), int(own[-1]) + 1])
        (a, b), (c, d) = spans
        found.append({"name": name, "node": [a, b], "cell": [c, d], "per": (b - a - 1) // (d - c)})
    return found


def joints_of(record, nodes) -> list[int]:
    """The node at every joint, by where both are at first."""
    if "joint_position" not in record:
        return []
    places = record.joint_position.values[0]
    return [int(np.linalg.norm(nodes - place, axis=1).argmin()) for place in places]


def _end_node(network, spans, piece, end):
    """Node of an end of a cable; pieces within it end at joints."""
    first, behind = spans[network.pieces[piece].cable]["node"]
    return behind - 1 if end else first


def _on_buoy(network, piece, end):
    at = network.pieces[piece].ends[end]
    place = mooring_offset(network.buoys[at.name], at.fairlead)
    return {"buoy": list(network.buoys).index(at.name), "place": place.tolist()}


_KINDS = {"fixed": "anchor", "prescribed": "driven", "free": "free"}


def end_marks(network, spans, joints) -> list[dict]:
    """What is marked: anchors, ends that are moved or free, joints."""
    found = [{"node": node, "kind": "joint"} for node in joints]
    for k in range(len(network.cables)):
        for piece, end in ((network.first_of(k), 0), (network.last_of(k), 1)):
            kind = _KINDS.get(network.pieces[piece].ends[end].kind)
            if kind:
                found.append({"node": _end_node(network, spans, piece, end), "kind": kind})
    return found


def labels(network, lines) -> list[dict]:
    """Names where there are several."""
    found = []
    if lines and len(network.cables) > 1:
        found += [{"text": c["name"], "node": sum(c["node"]) // 2} for c in lines["cables"]]
    if len(network.buoys) > 1:
        found += [{"text": name, "buoy": k} for k, name in enumerate(network.buoys)]
    return found


# -- forces ------------------------------------------------------------------------------------------------------------


def _forces(record, scene, network, rows):
    """What pulls and holds, with its place; and the largest of all [N]."""
    found, sizes = [], [0.0]

    def add(values, **what):
        sizes.append(float(np.linalg.norm(values, axis=-1).max()))
        found.append({"values": coarse(values), **what})

    if "mooring_force" in record:
        for i, (k, end) in enumerate(attached_ends(network)):
            add(record.mooring_force.values[rows, i], kind="pulls", **_on_buoy(network, k, end))
    spans = cables(record, network) if "cable_position" in record else []
    for k in range(len(spans)):
        for name, piece, end in (("anchor_force", network.first_of(k), 0), ("end_tension", network.last_of(k), 1)):
            if name in record and network.pieces[piece].ends[end].held:
                add(record[name].values[rows, k], kind="holds", node=_end_node(network, spans, piece, end))
    for b, buoy in enumerate(network.buoys.values()):
        for values, place in _from_outside(record, buoy, b, rows):
            add(values, kind="outside", buoy=b, place=[0.0, 0.0, place])
    return found, max(sizes)


def _from_outside(record, buoy, number, rows):
    """(force (rows, 3), height of its place over C) of wind and external force on a buoy, a section."""
    center = mass_properties(buoy, shape_of(buoy)).height
    force, wind = buoy.external_force, buoy.wind
    if force:
        yield np.tile(force.force, (len(rows), 1)), 0.0 if force.height is None else force.height - center
    if wind:
        z = record.buoy_position.values[rows, number, 2] + wind.height - center
        if "surface_elevation" in record:
            z = z - record.surface_elevation.values[rows, number]
        known = np.linspace(z.min(), z.max(), 16)
        forces = np.array([wind_at(wind, height) for height in known])
        yield np.array([np.interp(z, known, column) for column in forces.T]).T, wind.height - center


# -- the frame of the picture ------------------------------------------------------------------------------------------


def _places(record):
    for name in ("cable_position", "buoy_position"):
        if name in record:
            yield record[name].values.reshape(-1, 3)


def box_around(places, buoys, scene) -> list[list[float]]:
    """Lower and upper corner of all points and the buoys at them; the water's surface and the bed if they are near."""
    points = np.concatenate(places)
    low, high = points.min(axis=0), points.max(axis=0)
    room = max((0.6 * buoy["size"] for buoy in buoys), default=0.0)
    low, high = low - [room, room, 0], high + room
    span = float((high - low).max()) or 1.0
    if scene.sea:
        crest = crest_height(scene)
        if high[2] + 0.5 * span > 0 > low[2] - 0.5 * span:
            low[2], high[2] = min(low[2], -crest), max(high[2], crest)
        if low[2] - 0.4 * span < -scene.sea.depth:
            low[2] = min(low[2], -scene.sea.depth)
    return [low.tolist(), high.tolist()]


def _direction(scene, box):
    """Heading of the plane that is seen from the side [deg]: of what is widest, else of the waves."""
    x, y = np.subtract(box[1], box[0])[:2]
    if max(x, y) > 1.5 * min(x, y):
        return 0.0 if x > y else 90.0
    return scene.waves.direction_deg if scene.waves else 0.0
