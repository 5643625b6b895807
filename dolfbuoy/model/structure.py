"""What of a scene decides which forms are compiled and which unknowns there are; the rest are numbers."""

from ..scene.cable import Cable
from ..scene.lines import Body
from ..scene.network import network_of, single_scenes
from ..scene.stretching import bends_of
from . import effects

#: Keys whose values are part of the structure.
_KEYS = (
    "cable.length",
    "cable.elements",
    "cable.grading",
    "cable.position_degree",
    "cable.tension_degree",
    "cable.strain",
    "cable.strain_form",
    "cable.slack",
    "cable.top.kind",
    "buoy.hull",
    "waves.stretching",
    "seabed.start",
    "solver",
)


def _value(scene, key):
    for name in key.split("."):
        scene = getattr(scene, name) if scene is not None else None
    return scene


def structure_of(scene) -> tuple:
    """Equal for scenes that one `Problem` can serve one after the other."""
    return tuple(_structure_of(one) for one in single_scenes(scene)), _topology(scene) if scene.is_network else None


def _structure_of(scene):
    """Of a scene with one line and one buoy at most."""
    profile = scene.current.profile if scene.current else None
    return (
        tuple(effects.names(scene)),
        *(repr(_value(scene, key)) for key in _KEYS),
        len(profile) if isinstance(profile, list) else profile,
        bool(scene.cable and scene.cable.diameter),
        *(len(bends_of(scene.cable.axial_stiffness, below)) if scene.cable else 0 for below in (False, True)),
        bool(scene.cable and scene.cable.top and any(scene.cable.top.force)),
        bool(scene.waves and scene.waves.irregular),
        scene.external_force is not None and scene.external_force.height is None,
    )


def _topology(scene):
    """What hangs together with what, and which numbers pieces or bodies share: those are constants of the forms."""
    network = network_of(scene)
    ends = [[(end.kind, end.name, end.fairlead, _pulled(end)) for end in piece.ends] for piece in network.pieces]
    shared = []
    for kind, sections in ((Cable, [piece.section for piece in network.pieces]), (Body, network.bodies.values())):
        values = [{repr(getattr(section, name)) for section in sections} for name in kind.model_fields]
        shared += [len(found) == 1 for found in values]
    return repr((ends, network.cables, list(network.joints), list(network.bodies), list(network.buoys), shared))


def _pulled(end):
    return end.kind == "free" and any(end.top.force)
