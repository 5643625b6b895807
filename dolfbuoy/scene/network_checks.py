"""Checks of the network of a scene: unheld parts, lines without length, misplaced directions."""

from typing import TYPE_CHECKING

from .cable import FailsAt
from .network import OWN, Network
from .quantities import Missing, Wrong

if TYPE_CHECKING:
    from .sections import Scene


def check_network(scene: "Scene") -> None:
    """Raise Wrong or Missing for an invalid network, such as unheld parts or lines without length."""
    network = scene.network
    for piece in network.pieces:
        key, section = network.key_of(piece.cable), piece.section
        if scene.sea is not None and section.diameter is None:
            raise Missing(f"{key}.diameter", "the sea needs it")
        low, high = piece.ends
        if low.name is not None and low.kind == high.kind and low.name == high.name and low.fairlead == high.fairlead:
            raise Wrong(f"{key}.to", high.name, "is where the cable comes from: its ends must be two places")
        if scene.initial.kind == "straight" and high.kind == "free" and high.position is None:
            raise Wrong("initial.kind", "straight", f"needs {key}.top.position, the end of the straight line")
    unknown = set(scene.initial.points) - set(network.cables) if isinstance(scene.initial.points, dict) else ()
    if unknown:
        raise Wrong("initial.points", min(unknown), f"must be of the cables: {', '.join(network.cables) or 'none'}")
    for number, section in enumerate(scene.cables):
        low, high = network.pieces[network.first_of(number)].ends[0], network.pieces[network.last_of(number)].ends[1]
        if low.held and high.held and low.position == high.position:
            key = f"{network.key_of(number)}.{'to' if getattr(section, 'to', None) is not None else 'top.position'}"
            raise Wrong(key, high.position, "is where the cable comes from: its ends must be two places")
    _check_bending(network)
    _check_parting(network)
    _check_held(network)
    for name in OWN[:2] if len(network.buoys) > 1 else ():
        if getattr(scene, name) is not None:
            allowed = f"belongs to one buoy, and there are several: give [buoy.{name}] to those it acts on"
            raise Wrong(name, "[...]", allowed)
    for name in type(scene.initial).model_fields if len(network.buoys) > 1 else ():
        if name.startswith("buoy_") and (value := getattr(scene.initial, name)) is not None:
            raise Wrong(f"initial.{name}", value, "belongs to one buoy, and there are several: give [buoy.initial]")


def _check_bending(network: Network) -> None:
    """Check directions, which need held ends of bending lines, and welds, which need two such lines."""
    for piece in network.pieces:
        for name, end in zip(("from_end", "to_end"), piece.ends, strict=True):
            key = f"{network.key_of(piece.cable)}.{name}.direction"
            if end.clamp is None:
                continue
            if not piece.section.bending_stiffness:
                raise Wrong(key, list(end.clamp.unit), "goes with a line that has bending_stiffness")
            if end.kind == "joint":
                raise Wrong(key, list(end.clamp.unit), "goes with an end that is held, free or on a buoy")
    for name, ends in network.meetings().items():
        if name in network.welds:
            bend = [network.pieces[k].section.bending_stiffness > 0 for k, _ in ends]
            if bend != [True, True]:
                raise Wrong("joint.weld", True, f"joins two lines with bending_stiffness, not {len(ends)} at {name}")
            damping = [network.pieces[k].section.bending_damping for k, _ in ends]
            if damping[0] != damping[1]:
                key = f"{network.key_of(network.pieces[ends[1][0]].cable)}.bending_damping"
                raise Wrong(
                    key, damping[1], f"must be that of the line it goes on from without a kink, {damping[0]:g} s"
                )


def _check_parting(network: Network) -> None:
    """Check failure rules of cables and segments."""
    lengths: dict[tuple[int, FailsAt | None], float] = {}
    for piece in network.pieces:
        place = piece.cable, piece.section.fails_at
        lengths[place] = lengths.get(place, 0.0) + piece.section.length
    for (cable, rule), length in lengths.items():
        if rule is not None and rule.at is not None and rule.at > length:
            key = f"{network.key_of(cable)}.fails_at.at"
            raise Wrong(key, rule.at, f"must be on the cable, 0 to length = {length:g} m")


def _check_held(network: Network) -> None:
    """Check that every connected part has a held end."""
    parts = network.parts()
    held: set[str | int] = {name for name, top in network.joints.items() if top is not None}
    held |= {piece.cable for piece in network.pieces if any(end.held or end.is_on_sinker for end in piece.ends)}
    springs = [device.ends for device in network.take_offs.values() if device.section.holds]
    held |= {str(other.name) for ends in springs for end, other in (ends, ends[::-1]) if end.held}
    for number, name in enumerate(network.cables):
        if not parts[number] & held:
            raise Wrong("cable.name", name, "hangs on nothing that is held: some end must have a place [x, y, z]")
    for name in network.buoys:
        if network.pieces and not parts[name] & held:
            raise Wrong("buoy.name", name, "hangs on no cable: name it in from or to of a [[cable]]")
