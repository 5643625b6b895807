"""The record of a network part by part: each cable and each buoy as if it were alone, for what knows only one."""

from typing import NamedTuple

import numpy as np

from ..scene.network import is_network, network_of, with_buoy, with_line
from .record import FIXED, PER
from .utilisation import stressed


class Part(NamedTuple):
    """name: of the cable or buoy, empty for a scene that is no network.  record, scene: as of that one alone."""

    name: str
    record: object
    scene: object


def parts_of(record, scene) -> list[Part]:
    """The record itself, or of a network one for each cable and one for each buoy.  Lazy: nothing is copied."""
    if not is_network(scene):
        return [Part("", record, scene)]
    network = network_of(scene)
    cables = [Part(name, _cable(record, k, network), cable_alone(scene, k)) for k, name in enumerate(network.cables)]
    buoys = [Part(name, _buoy(record, k), with_buoy(scene, name)) for k, name in enumerate(network.buoys)]
    return cables + buoys


def cable_alone(scene, number):
    """The scene as if it had only this cable, all of it of the material of its first segment."""
    network = network_of(scene)
    pieces = [piece for piece in network.pieces if piece.cable == number]
    keys = {"length": sum(piece.section.length for piece in pieces), "top": pieces[-1].ends[1].top}
    return with_line(scene, pieces[0].section.model_copy(update=keys))


def _cable(record, number, network):
    """Without buoys and joints, and without the other cables."""
    others = [name for name, dimension in PER.items() if dimension not in ("cable", "segment")]
    found = record.drop_vars([name for name in (*others, "joint_position") if name in record], errors="ignore")
    if "cable" in found.dims:
        found = found.isel(cable=number)
    if "utilisation" in found:
        mine = [name for name, piece in stressed(network).items() if network.pieces[piece].cable == number]
        found = found.sel(segment=mine) if mine else found.drop_vars(["utilisation", "segment"])
    for dimension in ("node", "cell"):
        key = f"cable_of_{dimension}"
        if key in found:
            found = found.isel({dimension: np.flatnonzero(record[key].values == number)})
    return found


def _buoy(record, number):
    """Without cables and joints, and without the other buoys."""
    others = [name for name, dimension in PER.items() if dimension != "buoy"]
    others += ["joint_position", "cable_position", "cable_velocity", "cable_tension", *FIXED]
    found = record.drop_vars([name for name in others if name in record.variables])
    return found.isel(buoy=number) if "buoy" in found.dims else found
