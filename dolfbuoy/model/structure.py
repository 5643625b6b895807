"""Structure of a scene, which determines the compiled forms and the unknowns; all else is numbers."""

from typing import Any

from ..scene import Scene
from ..scene.buoy import Buoy
from ..scene.cable import Cable
from ..scene.lines import Body
from ..scene.network import OWN, End, Network
from ..scene.stiffness import kinks_of
from . import effects
from .potential_flow import states_of

#: Keys of a piece of line that are part of the structure; `_OF_MESH`: those that affect the mesh only.
_OF_MESH = ("elements", "grading")
_OF_LINES = (
    *("length", *_OF_MESH),
    *("position_degree", "tension_degree", "strain", "strain_form", "slack"),
)


def structure_of(scene: Scene, mesh: bool = True) -> tuple[Any, ...]:
    """Structure, equal for scenes that can share a `Problem`, or with `mesh` false for scenes with the same forms."""
    network, waves = scene.network, scene.waves
    profile = scene.current.profile if scene.current else None
    return (
        len(profile) if isinstance(profile, list) else profile,
        len({row[1] for row in (scene.current and scene.current.grid) or []}),
        scene.sea is not None and scene.sea.tide is not None,
        waves and (waves.summed, waves.theory, waves.stretching),
        scene.seabed and (scene.seabed.start, scene.seabed.depths is not None),
        repr(scene.solver),
        tuple(effects.names(scene)),
        *(_of_line(scene, piece.section, mesh) for piece in network.pieces),
        *(_called(scene, "joint", body) for body in network.bodies.values()),
        *(
            (
                repr(buoy.hull),
                buoy.external_force and buoy.external_force.height is None,
                _states(scene, buoy),
                _called(scene, "buoy", buoy),
            )
            for buoy in network.buoys.values()
        ),
        *(_called(scene, "take_off", device.section) for device in network.take_offs.values()),
        _topology(network),
    )


def _states(scene: Scene, buoy: Buoy) -> tuple[int, ...]:
    """Numbers of states of the radiation memory."""
    return tuple(len(s.rate) for s in states_of(scene, buoy)) if buoy.potential_flow and scene.sea else ()


def _of_line(scene: Scene, section: Cable, mesh: bool) -> tuple[Any, ...]:
    keys = [repr(getattr(section, name)) for name in _OF_LINES if mesh or name not in _OF_MESH]
    kinks = [len(kinks_of(section.axial_stiffness, below)) for below in (False, True)]
    return *keys, *kinks, section.winch is not None, bool(section.diameter), _called(scene, "cable", section)


def _called(scene: Scene, kind: str, part: Any) -> tuple[str, ...]:
    """Names of the effects present in a part of the network."""
    own = (kind, *OWN) if kind == "buoy" else (kind,)
    return tuple(e.name for e in effects.EFFECTS if e.key.partition(".")[0] in own and e.called(scene, part))


def _topology(network: Network) -> str:
    """Topology, and which numbers are the same for all pieces or bodies and hence constants of the forms."""
    ends = [[_end(end) for end in piece.ends] for piece in network.pieces]
    shared = []
    for kind, sections in ((Cable, [piece.section for piece in network.pieces]), (Body, network.bodies.values())):
        values = [{repr(getattr(section, name)) for section in sections} for name in kind.model_fields]
        shared += [len(found) == 1 for found in values]
    shared.append(len({getattr(body, "friction", None) for body in network.bodies.values()}) == 1)
    names = [list(part) for part in (network.joints, network.bodies, network.buoys, sorted(network.welds))]
    devices = [[(e.kind, e.name, e.fairlead) for e in device.ends] for device in network.take_offs.values()]
    return repr((ends, network.cables, *names, shared, [*network.take_offs], devices))


def _end(end: End) -> tuple[Any, ...]:
    pulled = end.kind == "free" and end.top is not None and any(end.top.force)
    return end.kind, end.is_on_sinker, end.name, end.fairlead, pulled, _clamp(end)


def _clamp(end: End) -> str | None:
    if end.clamp is None:
        return None
    return "held" if end.clamp.rotational_stiffness is None else "spring"
