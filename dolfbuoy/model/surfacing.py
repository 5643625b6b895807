"""Cables that may leave the water, found from the scene alone, before anything is solved.

A cable may if one of these is above the deepest trough (the lowest still water level, less the amplitude of a regular
wave or the significant height):

- a fixed or moved end, anywhere on its path, a free end pulled up as far as the cable reaches, or a point of the
  initial shape given by the scene;
- an end on a buoy that is above the water line when the buoy floats freely;
- the top of an arch of a cable lighter than water, as high as its length allows, or a float at an end, as far as the
  lines let it rise.

All others hang below their ends: heavy lines held or carried under water.
"""

import heapq
import math

import numpy as np

from ..scene import Scene
from ..scene.cable import Top
from ..scene.network import Network
from ..scene.vessel import Riding
from .riding import rider_of
from .rigid import mass_properties, shape_of, weight_per_length
from .sea import crest_height
from .varying import range_of_tide

#: Name of a joint or buoy, or an end of a piece: (piece, end).
Node = str | tuple[int, int]
#: Height above the water neglected, as a fraction of the cable's length.
ROUNDING = 1e-9
#: A cable lighter than water by less than this fraction of its weight counts as neutrally buoyant.
BALANCED = 0.01


def surfacing(scene: Scene) -> list[str]:
    """Names of the cables that may leave the water, or hang on a float that may; empty without a sea."""
    if scene.sea is None or not scene.network.pieces:
        return []
    network, heights, cables = scene.network, _heights(scene), range(len(scene.network.cables))
    light = {cable for cable in cables if _is_light(scene, cable)}
    rises = {p.cable for k, p in enumerate(network.pieces) if _rises(scene, k, heights, p.cable in light)}
    given = scene.initial.points  # initial shape, which may be above the water
    for cable in cables:
        points = given.get(network.cables[cable]) if isinstance(given, dict) else given
        if points and float(np.max(np.array(points)[:, 2])) > -_fall(scene):
            rises.add(cable)
    return [network.cables[cable] for cable in cables if cable in rises]


def _fall(scene: Scene) -> float:
    """Distance of the deepest trough from the still surface at t = 0 [m]."""
    return crest_height(scene) - range_of_tide(scene)[0]


def _node(network: Network, piece: int, end: int) -> Node:
    """Name of the joint or buoy that holds an end, or the end itself."""
    return network.pieces[piece].ends[end].name or (piece, end)


def _heights(scene: Scene) -> dict[Node, float]:
    """Node -> its largest height above the deepest trough allowed by fixed ends, buoys and lengths [m]."""
    network, crest, reached = scene.network, _fall(scene), {}
    lines: dict[Node, list[tuple[Node, float]]] = {}
    ahead: list[tuple[float, str, Node]] = []
    for k, piece in enumerate(network.pieces):
        nodes = [_node(network, k, i) for i in (0, 1)]
        for i, end in enumerate(piece.ends):
            lines.setdefault(nodes[i], []).append((nodes[1 - i], piece.section.length))
            if end.held or end.is_on_sinker:
                heapq.heappush(ahead, (_highest(scene, end.top) + crest, str(nodes[i]), nodes[i]))
            elif end.kind == "buoy":
                heapq.heappush(ahead, (0.0, str(nodes[i]), nodes[i]))
    while ahead:
        z, _, node = heapq.heappop(ahead)
        if node not in reached:
            reached[node] = z
            for other, length in lines[node]:
                heapq.heappush(ahead, (z + length, str(other), other))
    return reached


def _highest(scene: Scene, top: Top) -> float:
    """Largest height of a fixed or moved end over a run [m]."""
    if isinstance(top, Riding):
        given = max([0.0, *(row[3] for row in top.vessel.motion or [])])
        return top.position[2] + given + rider_of(top).rise(top.own)
    z = top.position[2] + abs(top.amplitude[2] if top.amplitude else 0.0)
    if top.motion:
        z += max(0.0, *(row[3] for row in top.motion))
    if top.velocity and scene.time:
        z += max(0.0, top.velocity[2]) * scene.time.end
    return z


def _rises(scene: Scene, number: int, heights: dict[Node, float], light: bool) -> bool:
    """True if a piece may leave the water; light: its cable is lighter than water."""
    network = scene.network
    piece, least = network.pieces[number], ROUNDING * network.pieces[number].section.length
    highest = [heights.get(_node(network, number, i), math.inf) for i in (0, 1)]
    for end, z in zip(piece.ends, highest, strict=True):
        body = network.bodies.get(end.name)
        floats = body is not None and scene.sea.density * body.volume > body.mass
        pulled = end.kind == "free" and end.top.force[2] > 0
        if z > least and (end.held or floats or pulled):
            return True
        if end.kind == "buoy":  # above the water line when afloat: the hull below that point displaces more
            buoy = network.buoys[end.name]
            height = buoy.mooring_height if end.fairlead is None else buoy.fairleads[end.fairlead][2]
            below = shape_of(buoy).volume(min(max(height, 0.0), shape_of(buoy).height))
            if scene.sea.density * below > mass_properties(buoy).mass:
                return True
    low, high = piece.ends  # vertical reach, up and down: the length, less the horizontal span of two fixed ends
    across = math.dist(low.top.position[:2], high.top.position[:2]) if low.held and high.held else 0.0
    return light and sum(highest) + math.sqrt(max(piece.section.length**2 - across**2, 0.0)) > 2 * least


def _is_light(scene: Scene, cable: int) -> bool:
    """True if a cable as a whole is lighter than water, and not neutrally buoyant like a streamer."""
    sections = scene.network.sections_of(cable)
    mass = sum(c.line_density * c.length for c in sections)
    return sum(weight_per_length(scene, c) * c.length for c in sections) < -BALANCED * scene.gravity * mass
