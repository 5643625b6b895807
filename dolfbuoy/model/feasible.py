"""What cannot be, found before anything is built."""

import math

import numpy as np

from ..errors import InputError
from ..roots import brentq
from ..scene.network import network_of, single_scenes, with_buoy
from .hydrostatics import float_upright
from .material import cross_section, weight_per_length
from .rigid import mass_properties, shape_of


def check_feasible(scene) -> None:
    """Refuse what cannot be: an inextensible cable that is too short, a buoy that sinks, a mass that is not positive.

    Raises InputError with one sentence.
    """
    for one in single_scenes(scene):
        _check_effective_mass(one)
    network = network_of(scene)
    for number in range(len(network.cables)):
        _check_length(network, number, scene.is_network)
    if scene.sea is not None:
        for name in network.buoys:
            _check_floats(with_buoy(scene, name))


def _check_length(network, number, named):
    """Of a cable without stretch between two ends that are held."""
    pieces = [piece for piece in network.pieces if piece.cable == number]
    low, high = pieces[0].ends[0], pieces[-1].ends[1]
    stretches = any(math.isfinite(piece.section.axial_stiffness) for piece in pieces)
    if not (low.held and high.held) or stretches:
        return
    key, length = f"cable.{network.cables[number]}" if named else "cable", sum(p.section.length for p in pieces)
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


def _check_effective_mass(scene):
    rho_w = scene.sea.density if scene.sea else 0.0
    c, b = scene.cable, scene.buoy
    if c is not None and rho_w:
        grown = [(1.0, 1.0), *((thicker, heavier) for _, thicker, heavier in c.marine_growth or ())]
        area = cross_section(c)
        effective = min(mass * c.line_density + c.added_mass * rho_w * d**2 * area for d, mass in grown)
        if effective <= 0:
            raise InputError(
                f"cable.added_mass = {c.added_mass}: the effective mass {effective:.6g} kg/m of the cable is not "
                "positive (added_mass is C_A = C_M - 1)."
            )
    if b is not None and rho_w and b.added_mass < 0:
        shape, mass = shape_and_mass(scene)
        effective = mass.mass + b.added_mass * rho_w * shape.volume()
        if effective <= 0:
            raise InputError(
                f"buoy.added_mass = {b.added_mass}: the effective mass {effective:.6g} kg of the submerged buoy is not "
                "positive (added_mass is C_A = C_M - 1)."
            )


def hanging_weight(scene) -> float:
    """Weight in water of the cable that hangs from the buoy when it floats above the anchor [N] (0 if it floats)."""
    if scene.cable is None:
        return 0.0
    c, w = scene.cable, weight_per_length(scene, scene.cable)
    height = max(-scene.anchor[2], 0.0) if scene.sea else c.length
    return max(w, 0.0) * min((c.length + height) / 2, c.length)


def pull_upright(scene) -> float:
    """Pull of the cable on the upright buoy straight above its anchor [N].

    The weight that hangs from it, if the cable is long enough for the buoy to float; else what draws the buoy down,
    all of its spare buoyancy at most.  Raises InputError for a buoy that sinks.
    """
    pull, c = hanging_weight(scene), scene.cable
    if c is None or scene.sea is None or not scene.gravity:
        return pull
    shape, mass = shape_and_mass(scene)
    most = spare_buoyancy(scene) * (1 - 1e-12)

    def room(pull):
        """Length of the stretched cable less the height of the mooring point above the anchor [m]."""
        draft = float_upright(shape, mass, scene.sea.density, scene.gravity, pull, scene.buoy.mooring_height).draft
        strain = (pull - weight_per_length(scene, c) * c.length / 2) / c.axial_stiffness
        return c.length * (1 + strain) - (scene.buoy.mooring_height - draft - scene.anchor[2])

    if room(pull) >= 0:
        return pull
    return most if room(most) < 0 else float(brentq(room, pull, most))


def spare_buoyancy(scene) -> float:
    """What pulls a drowned buoy up [N]."""
    shape, mass = shape_and_mass(scene)
    return (scene.sea.density * shape.volume() - mass.mass) * scene.gravity


def drowned(scene) -> bool:
    """Whether the cable is too short for any of the buoy to be above the water."""
    return scene.cable is not None and pull_upright(scene) >= spare_buoyancy(scene) * (1 - 1e-9)


def shape_and_mass(scene):
    """(HullShape or None, MassProperties) of the scene's buoy."""
    shape = shape_of(scene.buoy)
    return shape, mass_properties(scene.buoy, shape)


def _check_floats(scene):
    if scene.gravity:
        shape, mass = shape_and_mass(scene)
        float_upright(shape, mass, scene.sea.density, scene.gravity, hanging_weight(scene), scene.buoy.mooring_height)
