"""The physical effects that a scene may call for, each declared once.

From a declaration follow: whether the effect is compiled, its term in the form, the name in a record's list of effects,
what `study effects` leaves out, the account of its power in the energy balance, and the values that random scenes give
to its keys.  The keys themselves, with their units and ranges, stand in `scene.sections`.

A term is a plain UFL function of `forms/`; its signature depends on where it enters:

    line(c, cable, rho_w, flow, point)    force per stretched metre of a line
    strip(c, rho_w, strip)                force per wet area of a strip of a hull, in the centroid of that area
    couple(c, rho_w, strip)               torque per wet area of a strip that comes with it
    face(c, rho_w, strip, face)           (force, torque) on a wet face of a hull
    body(c, body)                         (force, torque) at a point of a body
    line_power(c, r, r_t)                 power that the material of a line takes, for the energy balance
    joint(c, body, rho_w, flow, point)    force on a body at a joint
    bed(mu, contact)                      force of the sea bed per unstretched metre of a line, or on a joint's body
    line_wet(cable, flow, r, share)       part of a line that is under water, for buoyancy and `line`
    joint_wet(body, flow, r)              part of a body at a joint that is under water
    take_off(c, stretch)                  tension of a power take-off
    take_off_energy(c, stretch)           energy that this tension stores; without it its power is absorbed

c are its numbers as UFL constants: one, or several by name.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..forms import bending, buoy, cable, hull, joint, seabed, take_off, wind
from ..scene import Scene
from ..scene.network import OWN
from .rigid import axis_offset
from .sea import heading
from .surfacing import surfacing

#: Where an end stop is that there is not [m].
FAR = 1e9


class Drawn(NamedTuple):
    """Values of a key in random scenes: between low and high, evenly in the logarithm; now and then zero."""

    low: float
    high: float
    zero: bool = False
    even: bool = False  #: evenly in the number itself


@dataclass(frozen=True)
class Effect:
    """One physical effect.

    key: of the scene, `neutral` its value without the effect (None: the section is absent).  needs: sections without
    which the effect is not there.  without: name of what is there instead.  numbers: name -> (scene, section of the
    key) -> number or array; by default the key's own value; None: it has none.  account: of its power in the energy
    balance.  looks_at: buoy -> height above the keel where a term of a body looks at the water; None: at C or the
    surface above it.  default: scene -> value of the key where it is absent.  drawn: key -> Drawn.  removable: whether
    a scene makes sense without it.  brings: keys that make no sense without it.
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
        """True if any line, body or buoy of a scene calls for it, or this one does."""
        return any(value != self.neutral for value in self.values(scene, part))

    def spared(self, scene: Scene) -> bool:
        """True if anything in the scene could call for it and does not."""
        return any(value == self.neutral for value in self.values(scene))

    def given(self, scene: Scene, section: Any) -> dict[str, Any]:
        """Its numbers by name; "" where there is only one.  section: the one that the key belongs to."""
        leaf = self.key.rpartition(".")[2]
        numbers = self.numbers or {"": lambda scene, section: getattr(section, leaf)}
        return {name: get(scene, section) for name, get in numbers.items()}


def _sections(scene: Scene, name: str, part: Any) -> list[Any]:
    """The sections of this name: of every line, body and buoy of a scene, or of one `part`."""
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


def _of_water(name: str, key: str, account: str, drawn: Drawn, **term: Any) -> Effect:
    """A coefficient of a force of the water."""
    return Effect(name, key, needs=("sea",), account=account, drawn={key: drawn}, **term)


def _stop(value: float | None, otherwise: float) -> float:
    """Place of an end stop; far away if there is none."""
    return otherwise if value is None else value


#: In the order in which a record names them.
EFFECTS: list[Effect] = [
    Effect(
        "elastic cable",
        "cable.axial_stiffness",
        neutral=math.inf,
        without="inextensible cable",
        drawn={"cable.axial_stiffness": Drawn(1e2, 1e14)},
    ),
    Effect("mean strain", "cable.strain", neutral="exact"),
    Effect("tension only", "cable.slack", neutral="compressive"),
    Effect(
        "cable damping",
        "cable.damping",
        line_power=cable.damping_power,
        account="damping",
        drawn={"cable.damping": Drawn(1e-3, 1e8, zero=True)},
    ),
    Effect(
        "bending",
        "cable.bending_stiffness",
        drawn={"cable.bending_stiffness": Drawn(1e-2, 1e9)},
        brings=("cable.bending_damping", "cable.minimum_bend_radius", "cable.from_end", "cable.to_end", "joint.weld"),
    ),
    Effect(
        "bending damping",
        "cable.bending_damping",
        line_power=bending.damping_power,
        numbers={"": lambda _, c: c.bending_stiffness * c.bending_damping},
        account="damping",
        drawn={"cable.bending_damping": Drawn(1e-3, 1e1, zero=True)},
    ),
    Effect("winch", "cable.winch", neutral=None, account="winch"),
    Effect("line that parts", "cable.fails_at", neutral=None),
    Effect("marine growth", "cable.marine_growth", neutral=None, needs=("sea",)),
    Effect("buoy", "buoy", neutral=None, removable=False),
    Effect(
        "hydrostatics",
        "sea",
        neutral=None,
        removable=False,
        strip=hull.buoyancy,
        numbers={"": lambda scene, _: np.array([0.0, 0.0, -scene.gravity])},
        account="buoyancy",
    ),
    _of_water("cable normal drag", "cable.normal_drag", "drag", Drawn(1e-3, 1e2), line=cable.normal_drag),
    _of_water("cable tangential drag", "cable.tangential_drag", "drag", Drawn(1e-3, 1e1), line=cable.tangential_drag),
    _of_water("cable added mass", "cable.added_mass", "inertia", Drawn(-0.9, 5, even=True), line=cable.added_mass),
    _of_water(
        "cable tangential added mass",
        "cable.tangential_added_mass",
        "inertia",
        Drawn(1e-3, 5),
        line=cable.tangential_added_mass,
    ),
    _of_water("buoy added mass", "buoy.added_mass", "inertia", Drawn(-0.9, 5, even=True), strip=hull.added_mass),
    _of_water("buoy normal drag", "buoy.normal_drag", "drag", Drawn(1e-3, 1e2), strip=hull.normal_drag),
    _of_water(
        "buoy axial added mass", "buoy.axial_added_mass", "inertia", Drawn(1e-3, 1e1), face=hull.axial_added_mass
    ),
    _of_water("buoy axial drag", "buoy.axial_drag", "drag", Drawn(1e-3, 1e2), face=hull.axial_drag),
    _of_water(
        "buoy rotational added mass",
        "buoy.rotational_added_mass",
        "inertia",
        Drawn(1e-3, 1e1),
        face=hull.rotational_added_mass,
    ),
    Effect(
        "buoy wave damping",
        "buoy.wave_damping",
        neutral=None,
        needs=("sea",),
        body=buoy.wave_damping,
        numbers={"heave": lambda scene, buoy: buoy.wave_damping[0], "pitch": lambda scene, buoy: buoy.wave_damping[1]},
        account="damping",
    ),
    Effect("disk averages", "buoy.disk_averages", neutral=False, needs=("sea", "waves")),
    Effect(
        "buoy rotational damping",
        "buoy.rotational_damping",
        body=buoy.rotational_damping,
        drawn={"buoy.rotational_damping": Drawn(1e-3, 1e8)},
    ),
    Effect(
        "waves",
        "waves",
        neutral=None,
        line=cable.normal_froude_krylov,
        strip=hull.froude_krylov,
        joint=joint.froude_krylov,
        couple=hull.froude_krylov_couple,
        account="inertia",
        numbers=None,
        drawn={
            "waves.amplitude": Drawn(1e-6, 1e2, zero=True),
            "waves.height": Drawn(1e-6, 1e2, zero=True),
            "waves.period": Drawn(0.1, 1e3),
            "waves.wavelength": Drawn(0.1, 1e4),
            "waves.ramp": Drawn(1e-3, 1e3, zero=True),
            "waves.significant_height": Drawn(1e-6, 1e2, zero=True),
            "waves.peak_period": Drawn(0.1, 1e3),
            "waves.gamma": Drawn(1, 10, even=True),
        },
    ),
    Effect(
        "wave spreading",
        "waves.spreading",
        neutral=None,
        needs=("sea", "waves"),
        drawn={"waves.spreading": Drawn(0.1, 1e3)},
    ),
    Effect(
        "current",
        "current",
        neutral=None,
        drawn={"current.speed": Drawn(1e-6, 20, zero=True), "current.exponent": Drawn(1e-3, 1, even=True)},
    ),
    Effect(
        "wind",
        "wind",
        neutral=None,
        body=wind.wind_load,
        looks_at=lambda buoy: buoy.wind.height,
        numbers={
            "speed": lambda _, buoy: buoy.wind.speed_10m,
            "drag_coefficient": lambda _, buoy: buoy.wind.drag_coefficient,
            "air_density": lambda _, buoy: buoy.wind.air_density,
            "area": lambda _, buoy: buoy.wind.area,
            "direction": lambda _, buoy: heading(buoy.wind.direction_deg),
            "offset": lambda _, buoy: axis_offset(buoy, buoy.wind.height),
        },
        drawn={
            "wind.speed_10m": Drawn(1e-3, 100, zero=True),
            "wind.drag_coefficient": Drawn(1e-3, 10, zero=True),
            "wind.area": Drawn(1e-3, 1e3),
            "wind.height": Drawn(0, 30, even=True),
            "wind.air_density": Drawn(1e-3, 10),
        },
    ),
    Effect(
        "external force",
        "external_force",
        neutral=None,
        body=buoy.external_force,
        numbers={
            "force": lambda _, buoy: np.array(buoy.external_force.force),
            "offset": lambda _, buoy: (
                None if buoy.external_force.height is None else axis_offset(buoy, buoy.external_force.height)
            ),
        },
        drawn={"external_force.height": Drawn(-5, 30, even=True)},
    ),
    Effect(
        "cable tangential Froude-Krylov",
        "cable.tangential_froude_krylov",
        neutral=False,
        needs=("sea", "waves"),
        line=cable.tangential_froude_krylov,
        numbers=None,
        account="inertia",
    ),
    Effect(
        "water that ends at the surface",
        "sea.dry_above",
        neutral=False,
        line_wet=cable.wet_part,
        joint_wet=joint.wet_part,
        default=lambda scene: bool(surfacing(scene)),
        numbers=None,
        account="buoyancy",
    ),
    Effect("body drag", "joint.drag_area", needs=("sea",), joint=joint.drag, account="drag"),
    Effect("body added mass", "joint.added_mass", needs=("sea",), joint=joint.added_mass, account="inertia"),
    Effect(
        "sea bed",
        "seabed",
        neutral=None,
        needs=("sea",),
        bed=seabed.support,
        account="bed",
        numbers=None,
        drawn={
            "seabed.stiffness": Drawn(1e2, 1e9),
            "seabed.damping_ratio": Drawn(1e-3, 1e1, zero=True),
            "seabed.stick_length": Drawn(1e-4, 1e1),
        },
    ),
    Effect(
        "bed friction",
        "seabed.friction",
        needs=("sea",),
        bed=seabed.friction,
        account="friction",
        numbers={"": lambda scene, _: scene.seabed.friction},
        drawn={"seabed.friction": Drawn(1e-3, 1e1)},
    ),
    Effect("sinker that drags", "anchor.drags", neutral=False, needs=("seabed",), removable=False),
    Effect(
        "take-off pretension",
        "take_off.pretension",
        take_off=take_off.pretension,
        take_off_energy=take_off.pretension_energy,
    ),
    Effect(
        "take-off spring",
        "take_off.stiffness",
        take_off=take_off.spring,
        take_off_energy=take_off.spring_energy,
        numbers={"stiffness": lambda _, device: device.stiffness, "length": lambda _, device: device.length},
        brings=("take_off.length",),
    ),
    Effect(
        "take-off stops",
        "take_off.stop_stiffness",
        take_off=take_off.stops,
        take_off_energy=take_off.stops_energy,
        numbers={
            "stiffness": lambda _, device: device.stop_stiffness,
            "shortest": lambda _, device: _stop(device.shortest, -FAR),
            "longest": lambda _, device: _stop(device.longest, FAR),
        },
        brings=("take_off.shortest", "take_off.longest"),
    ),
    Effect("take-off damping", "take_off.damping", take_off=take_off.damper, account="take_off"),
    Effect(
        "take-off quadratic damping",
        "take_off.quadratic_damping",
        take_off=take_off.quadratic_damper,
        account="take_off",
    ),
    Effect(
        "take-off friction",
        "take_off.friction",
        take_off=take_off.friction,
        account="take_off",
        numbers={"force": lambda _, device: device.friction, "speed": lambda _, device: device.friction_speed},
    ),
]


def called_by(scene: Scene, where: str | None = None, parts: Iterable[Any] = (None,)) -> list[Effect]:
    """Effects that a scene calls for, or any of some parts; where: only those with such a term ("line", ...)."""
    found = [e for e in EFFECTS if where is None or getattr(e, where) is not None]
    return [e for e in found if any(e.called(scene, part) for part in parts)]


def names(scene: Scene) -> list[str]:
    """Names of the effects that a scene calls for, hence of what is compiled."""
    found = []
    for effect in EFFECTS:
        if effect.called(scene):
            found.append(effect.name)
        if effect.without and effect.spared(scene):
            found.append(effect.without)
    return found
