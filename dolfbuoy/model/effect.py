"""Declaration of a physical effect; all effects are in `effects`.

A term is a plain UFL function of `forms/`; its signature depends on where it enters:

    line(c, cable, rho_w, flow, point)    force per stretched metre of a line
    strip(c, rho_w, strip)                force per wet area of a strip of a hull, at the centroid of that area
    couple(c, rho_w, strip)               additional torque per wet area of a strip
    face(c, rho_w, strip, face)           (force, torque) on a wet face of a hull
    body(c, body)                         (force, torque) at a point of a body
    line_power(c, r, r_t)                 power of the material of a line, for the energy balance
    joint(c, body, rho_w, flow, point)    force on a body at a joint
    bed(mu, contact)                      force of the sea bed per unstretched metre of a line, or on a joint's body
    line_wet(cable, flow, r, share)       submerged fraction of a line, for buoyancy and `line`
    joint_wet(body, flow, r)              submerged fraction of a body at a joint
    take_off(c, stretch)                  tension of a power take-off
    take_off_energy(c, stretch)           energy stored by this tension; without it the power is absorbed

c are the coefficients of the effect as UFL constants: one, or several by name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ..scene import Scene
from ..scene.network import OWN


class Drawn(NamedTuple):
    """Values of a key in random scenes: log-uniform between low and high; occasionally zero if `zero`."""

    low: float
    high: float
    zero: bool = False
    even: bool = False  #: uniform instead of log-uniform


@dataclass(frozen=True)
class Effect:
    """One physical effect.

    key: scene key; `neutral`: its value without the effect (None: the section is absent).  needs: sections required
    for the effect.  without: name of what applies instead.  numbers: name -> (scene, section of the key) -> number or
    array; by default the key's own value; None: no coefficients.  account: that of its power in the energy balance.
    looks_at: buoy -> height above the keel where a term of a body evaluates the water; None: at C or the surface above
    it.  default: scene -> value of the key if absent.  drawn: key -> Drawn.  removable: whether a scene makes sense
    without it.  brings: keys that make no sense without it.
    """

    name: str
    key: str
    neutral: Any = 0.0
    needs: tuple[str, ...] = ()
    without: str | None = None
    line: Callable[..., Any] | None = None
    strip: Callable[..., Any] | None = None
    couple: Callable[..., Any] | None = None
    face: Callable[..., Any] | None = None
    body: Callable[..., Any] | None = None
    line_power: Callable[..., Any] | None = None
    joint: Callable[..., Any] | None = None
    bed: Callable[..., Any] | None = None
    line_wet: Callable[..., Any] | None = None
    joint_wet: Callable[..., Any] | None = None
    take_off: Callable[..., Any] | None = None
    take_off_energy: Callable[..., Any] | None = None
    default: Callable[..., Any] | None = None
    numbers: Mapping[str, Callable[..., Any]] | None = field(default_factory=dict)
    looks_at: Callable[..., Any] | None = None
    account: str = "outer"
    drawn: Mapping[str, Drawn] = field(default_factory=dict)
    removable: bool = True
    brings: tuple[str, ...] = ()

    def values(self, scene: Scene, part: Any = None) -> list[Any]:
        """Values of the key in all sections of the scene that have it, or in those of one `part` of its network."""
        if any(getattr(scene, name) is None for name in self.needs):
            return []
        name, _, leaf = self.key.partition(".")
        found = [section for section in _sections(scene, name, part) if section is not None]
        values = [getattr(section, leaf) if leaf else section for section in found]
        values = [self.default(scene) if value is None and self.default else value for value in values]
        return [value for value in values if value is not None]

    def called(self, scene: Scene, part: Any = None) -> bool:
        """True if any line, body or buoy of a scene, or this `part`, has the effect."""
        return any(value != self.neutral for value in self.values(scene, part))

    def spared(self, scene: Scene) -> bool:
        """True if any line, body or buoy of the scene could have the effect and does not."""
        return any(value == self.neutral for value in self.values(scene))

    def given(self, scene: Scene, section: Any) -> dict[str, Any]:
        """Its coefficients by name, "" if there is only one; section: the one the key belongs to."""
        leaf = self.key.rpartition(".")[2]
        numbers = self.numbers or {"": lambda scene, section: getattr(section, leaf)}
        return {name: get(scene, section) for name, get in numbers.items()}


def _sections(scene: Scene, name: str, part: Any) -> list[Any]:
    """The sections of this name in every line, body and buoy of a scene, or in one `part`."""
    network = scene.network
    parts: dict[str, list[Any]] = {
        "cable": [piece.section for piece in network.pieces],
        "joint": list(network.bodies.values()),
        "buoy": list(network.buoys.values()),
        "take_off": [device.section for device in network.take_offs.values()],
    }
    if name in parts:
        return parts[name] if part is None else [part]
    if name in OWN:
        return [getattr(buoy, name) for buoy in (parts["buoy"] if part is None else [part])]
    if name == "anchor":
        return scene.anchor or []
    return [getattr(scene, name)]
