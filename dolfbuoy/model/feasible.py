"""What cannot be, found before anything is built."""

import math

import numpy as np

from ..errors import InputError
from ..meshes import HullShape, cable_nodes
from ..scene import Scene
from ..scene.buoy import Buoy
from .hydrostatics import float_upright
from .rigid import MassProperties, cross_section, mass_properties, shape_of, weight_per_length


def check_feasible(scene: Scene) -> None:
    """Refuse what cannot be: an inextensible cable that is too short, a buoy that sinks, a mass that is not positive.

    Raises InputError with one sentence.
    """
    network = scene.network
    if scene.sea is not None:
        _check_effective_masses(scene)
        for name in network.buoys:
            _check_floats(scene, name)
    for number in range(len(network.cables)):
        _check_length(network, number)
    _check_elements(network)


def _check_elements(network):
    """Nodes are told apart by where they are along all lines, one behind the other, see `layout.Layout.slip`."""
    sections = [piece.section for piece in network.pieces]
    whole = sum(c.length for c in sections) + 0.1 * len(sections) * max((c.length for c in sections), default=0.0)
    for piece in network.pieces:
        c = piece.section
        shortest = np.diff(cable_nodes(c.length, c.elements, c.grading)).min() / c.position_degree
        if shortest < 4e-9 * whole:
            raise InputError(
                f"{network.key_of(piece.cable)}.elements: nodes {shortest:.2g} m apart are too close beside lines of "
                f"{whole:.4g} m: they must be {4e-9 * whole:.2g} m apart at least."
            )


def _check_length(network, number):
    """Of a cable without stretch between two ends that are held."""
    pieces = [network.pieces[k] for k in network.pieces_of(number)]
    low, high = pieces[0].ends[0], pieces[-1].ends[1]
    stretches = any(math.isfinite(piece.section.axial_stiffness) for piece in pieces)
    if not (low.held and high.held) or stretches:
        return
    key, length = network.key_of(number), sum(p.section.length for p in pieces)
    chord = np.array(high.top.position) - np.array(low.top.position)
    amplitude = np.array(high.top.amplitude or (0.0, 0.0, 0.0)) - np.array(low.top.amplitude or (0.0, 0.0, 0.0))
    moved = [row[1:] for row in high.top.motion] if high.top.motion else [amplitude * f for f in (-1.0, 0.0, 1.0)]
    longest = np.linalg.norm(chord + np.array(moved), axis=1).max()
    if longest > length * (1 + 1e-12):
        raise InputError(
            f"{key}.length = {length}: is too short, the top is up to {longest:.6g} m from the anchor, "
            "and an inextensible cable (axial_stiffness = inf) cannot stretch."
        )
    if len(pieces) == 1 and pieces[0].section.elements == 1 and pieces[0].section.position_degree == 1:
        raise InputError(
            f"{key}.elements = 1: between two held ends an inextensible element of position_degree 1 cannot move; "
            "take more elements or a higher degree."
        )


def _check_effective_masses(scene):
    """Of every piece of line, with what grows on it, and of every submerged buoy."""
    network, rho_w = scene.network, scene.sea.density
    for piece in network.pieces:
        c, area = piece.section, cross_section(piece.section)
        grown = [(1.0, 1.0), *((thicker, heavier) for _, thicker, heavier in c.marine_growth or ())]
        effective = min(mass * c.line_density + c.added_mass * rho_w * d**2 * area for d, mass in grown)
        _check_positive(f"{network.key_of(piece.cable)}.added_mass", c.added_mass, effective, "kg/m of the cable")
    for name, buoy in network.buoys.items():
        if buoy.added_mass < 0:
            shape, mass = shape_and_mass(buoy)
            effective = mass.mass + buoy.added_mass * rho_w * shape.volume()
            _check_positive(
                f"{network.key_of_buoy(name)}.added_mass", buoy.added_mass, effective, "kg of the submerged buoy"
            )


def _check_positive(key, value, effective, what):
    if effective <= 0:
        raise InputError(
            f"{key} = {value}: the effective mass {effective:.6g} {what} is not positive (added_mass is C_A = C_M - 1)."
        )


def _lines_of(scene, buoy):
    """(pieces from the buoy on, height of the held end below the water) of the cables between a buoy and held ends."""
    network = scene.network
    for cable in range(len(network.cables)):
        pieces = [network.pieces[k] for k in network.pieces_of(cable)]
        ends = pieces[0].ends[0], pieces[-1].ends[1]
        for near, far, along in ((1, 0, pieces[::-1]), (0, 1, pieces)):
            if ends[near].kind == "buoy" and ends[near].name == buoy and ends[far].held:
                yield [piece.section for piece in along], -ends[far].top.position[2]


def hanging_weight(scene: Scene, buoy: str) -> float:
    """Weight in water of the lines that hang from a buoy, at least, when it floats above their held ends [N].

    A line that is heavy all along: what it has down to the held end, and of what hangs lower its half.
    """
    total = 0.0
    for sections, height in _lines_of(scene, buoy):
        weights = [weight_per_length(scene, c) for c in sections]
        if min(weights) < 0 or (scene.sea and height < 0):
            continue
        length = sum(c.length for c in sections)
        reach = height if scene.sea else length
        left = min(reach if scene.seabed or len(sections) > 1 else (length + reach) / 2, length)
        for c, w in zip(sections, weights, strict=True):
            total += w * min(c.length, left)
            left -= min(c.length, left)
    return total


def shape_and_mass(buoy: Buoy) -> tuple[HullShape | None, MassProperties]:
    """(HullShape or None, MassProperties) of a section [buoy]."""
    return shape_of(buoy), mass_properties(buoy)


def _check_floats(scene, name):
    if scene.gravity:
        buoy = scene.network.buoys[name]
        shape, mass = shape_and_mass(buoy)
        pull = hanging_weight(scene, name)
        float_upright(shape, mass, scene.sea.density, scene.gravity, pull, buoy.mooring_height)
