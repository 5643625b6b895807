"""Buoys of scenes without lines: those held by take-offs, and positions of those held by nothing."""

from collections.abc import Callable

from ..model.rigid import float_upright, mass_properties, shape_of
from ..scene import Scene
from ..scene.buoy import Buoy
from ..scene.network import Network
from ..scene.take_off import TakeOff

#: Initial elongation of a take-off, as a fraction of its length.
NUDGE = 1e-6


def held_by_take_offs(network: Network) -> set[str | None]:
    """Names of buoys held in statics by take-offs, from a fixed point or from another such buoy."""
    ends = [device.ends for device in network.take_offs.values() if device.section.holds]
    pairs, held = [*ends, *(pair[::-1] for pair in ends)], set[str | None]()
    for _ in ends:
        held |= {far.name for near, far in pairs if near.held or near.name in held}
    return held


def places_adrift(scene: Scene, length: Callable[[TakeOff], float]) -> dict[str, list[float]]:
    """Positions of C [m] of buoys whose take-offs do not lead to a fixed point: afloat, side by side along x.

    length: length of a take-off without tension [m]; if it has none, the hulls are placed side by side.
    """
    network, found = scene.network, dict[str, list[float]]()
    ends = [(device.section, device.ends) for device in network.take_offs.values() if not network.pieces]
    pairs = [*ends, *((section, pair[::-1]) for section, pair in ends)]
    fixed = {far.name for _, (near, far) in pairs if near.held}
    parts = network.parts() if ends else {}
    loose = [name for name in network.buoys if name in parts and not parts[name] & fixed]
    radii = {name: max((d for _, d in network.buoys[name].hull or ()), default=1.0) / 2 for name in loose}
    for first in loose:
        found.setdefault(first, [0.0, 0.0, floating_height(scene, network.buoys[first])])
        for _ in ends:
            for section, (near, far) in pairs:
                if near.name in found and far.name in radii and far.name not in found:
                    beside = max(length(section), 0.0) or radii[near.name] + radii[far.name]
                    height = floating_height(scene, network.buoys[far.name])
                    found[far.name] = [found[near.name][0] + beside * (1 + NUDGE), 0.0, height]
    return found


def floating_height(scene: Scene, buoy: Buoy) -> float:
    """Height of C above still water of a buoy floating upright without lines [m]; 0 without water or gravity."""
    if scene.sea is None or not scene.gravity:
        return 0.0
    mass = mass_properties(buoy)
    return float(mass.height - float_upright(shape_of(buoy), mass, scene.sea.density, scene.gravity).draft)
