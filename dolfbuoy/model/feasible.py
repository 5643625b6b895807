"""What cannot be, found before anything is built."""

import math

import numpy as np

from ..errors import InputError
from .hydrostatics import float_upright
from .lines import cross_section, weight_per_length
from .rigid import mass_properties, shape_of


def check_feasible(scene) -> None:
    """Refuse what cannot be: an inextensible cable that is too short, a buoy that sinks, a mass that is not positive.

    Raises InputError with one sentence.
    """
    _check_effective_mass(scene)
    cable = scene.cable
    if cable is not None and cable.top is not None and cable.top.kind != "free" and math.isinf(cable.axial_stiffness):
        amplitude = np.array(cable.top.amplitude or (0.0, 0.0, 0.0))
        chord = np.array(cable.top.position) - np.array(scene.anchor)
        longest = max(np.linalg.norm(chord + amplitude * f) for f in (-1.0, 0.0, 1.0))
        if longest > cable.length * (1 + 1e-12):
            raise InputError(
                f"cable.length = {cable.length}: is too short, the top is up to {longest:.6g} m from the anchor, "
                "and an inextensible cable (axial_stiffness = inf) cannot stretch."
            )
        if cable.elements == 1 and cable.position_degree == 1:
            raise InputError(
                "cable.elements = 1: between two held ends an inextensible element of position_degree 1 cannot move; "
                "take more elements or a higher degree."
            )
    if scene.buoy is not None and scene.sea is not None:
        _check_floats(scene)


def _check_effective_mass(scene):
    rho_w = scene.sea.density if scene.sea else 0.0
    c, b = scene.cable, scene.buoy
    if c is not None and rho_w:
        effective = c.line_density + c.added_mass * rho_w * cross_section(c)
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


def shape_and_mass(scene):
    """(HullShape or None, MassProperties) of the scene's buoy."""
    shape = shape_of(scene.buoy)
    return shape, mass_properties(scene.buoy, shape)


def _check_floats(scene):
    if scene.gravity:
        shape, mass = shape_and_mass(scene)
        float_upright(shape, mass, scene.sea.density, scene.gravity, hanging_weight(scene), scene.buoy.mooring_height)
