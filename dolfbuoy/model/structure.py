"""What of a scene decides which forms are compiled and which unknowns there are; the rest are numbers."""

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
    profile = scene.current.profile if scene.current else None
    return (
        tuple(effects.names(scene)),
        *(repr(_value(scene, key)) for key in _KEYS),
        len(profile) if isinstance(profile, list) else profile,
        bool(scene.cable and scene.cable.diameter),
        bool(scene.cable and scene.cable.top and any(scene.cable.top.force)),
        bool(scene.waves and scene.waves.irregular),
        scene.external_force is not None and scene.external_force.height is None,
    )
