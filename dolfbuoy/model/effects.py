"""The physical effects available to a scene, each declared once.

A declaration determines whether the effect is compiled, its term in the form, its name in a record's list of effects,
what `study effects` leaves out, the account of its power in the energy balance, and the values of its keys in random
scenes.  The keys themselves, with their units and ranges, are in `scene.sections`.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..forms import bending, buoy, cable, hull, joint, radiation, seabed, take_off, wind
from ..scene import Scene
from .effect import Drawn, Effect
from .potential_flow import coefficients_of, on_five
from .rigid import axis_offset
from .surfacing import surfacing
from .varying import force_over_time, wind_over_time

#: Position of an absent end stop [m].
FAR = 1e9


def _of_water(name: str, key: str, account: str, drawn: Drawn, **term: Any) -> Effect:
    """An effect given by the coefficient of a hydrodynamic force."""
    return Effect(name, key, needs=("sea",), account=account, drawn={key: drawn}, **term)


def _stop(value: float | None, otherwise: float) -> float:
    """Position of an end stop; far away if absent."""
    return otherwise if value is None else value


#: Effects whose coefficients depend on the time step or on the position of a buoy (`radiation`).
MEMORY, DIFFRACTION, DRIFT = "radiation memory", "diffraction", "mean drift"


def _of_potential_flow() -> list[Effect]:
    """Effects based on coefficients of potential flow."""

    def one(name: str, body: Callable[..., Any], account: str, numbers: dict[str, Any], *needs: str) -> Effect:
        return Effect(
            name,
            "buoy.potential_flow",
            neutral=None,
            needs=("sea", *needs),
            body=body,
            account=account,
            numbers=numbers,
            brings=("buoy.memory_order", "buoy.drift"),
        )

    at_once = {"": lambda scene, buoy: on_five(coefficients_of(scene, buoy).at_once)}
    by_step = {"damping": lambda *_: np.zeros((5, 5)), "force": lambda *_: np.zeros(5)}
    by_place = {"force": lambda *_: np.zeros(5), "slope": lambda *_: np.zeros((5, 2)), "place": lambda *_: np.zeros(2)}
    return [
        one("added mass at infinite frequency", radiation.added_mass, "inertia", at_once),
        one(MEMORY, radiation.memory, "radiation", by_step),
        one(DIFFRACTION, radiation.diffraction, "inertia", by_place, "waves"),
        Effect(
            DRIFT,
            "buoy.drift",
            neutral=None,
            needs=("sea", "waves"),
            body=radiation.drift,
            account="drift",
            numbers={"force": lambda *_: np.zeros(2)},
        ),
    ]


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
    *_of_potential_flow(),
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
            "speed": lambda _, buoy: wind_over_time(buoy.wind, None)(0.0)[0],
            "drag_coefficient": lambda _, buoy: buoy.wind.drag_coefficient,
            "air_density": lambda _, buoy: buoy.wind.air_density,
            "area": lambda _, buoy: buoy.wind.area,
            "direction": lambda _, buoy: wind_over_time(buoy.wind, None)(0.0)[1],
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
            "force": lambda _, buoy: force_over_time(buoy.external_force)(0.0),
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
    """Effects present in a scene, or in any of some parts; where: only those with such a term ("line", ...)."""
    found = [e for e in EFFECTS if where is None or getattr(e, where) is not None]
    return [e for e in found if any(e.called(scene, part) for part in parts)]


def names(scene: Scene) -> list[str]:
    """Names of the effects present in a scene, which are those compiled."""
    found = []
    for effect in EFFECTS:
        if effect.called(scene):
            found.append(effect.name)
        if effect.without and effect.spared(scene):
            found.append(effect.without)
    return found
