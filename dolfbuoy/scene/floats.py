"""Mooring floats by their catalogue names.

Net buoyancy in sea water, diameter and drag coefficient: R. K. Dewey, Mooring Design & Dynamics, Marine Models 1 (1999)
103-157, its database of elements.  Balls displace their volume; a glass one that of the glass, in a hard hat of the
given diameter, which is weightless in water.  The mass follows from the net buoyancy.  Added mass: 0.5, as of a sphere.
"""

import math
from typing import Any, NamedTuple

from ..errors import InputError

DENSITY = 1025.0  # sea water of the buoyancies [kg/m^3]

SOURCE = "Dewey, Mooring Design & Dynamics, Marine Models 1 (1999)"


class Float(NamedTuple):
    """Net buoyancy [kg], outer diameter [m], drag coefficient, and diameter of the ball if smaller [m]."""

    buoyancy: float
    diameter: float
    drag: float = 0.65
    ball: float | None = None


FLOATS = {
    "ORE 28 in": Float(133, 0.71),
    "ORE 37 in": Float(300, 0.94),
    "ORE 41 in": Float(433, 1.04),
    "ORE 48 in": Float(620, 1.234),
    "ORE 61 in": Float(999, 1.65),
    "sphere 30 in": Float(160, 0.76),
    "sphere 54 cm": Float(61, 0.54),
    "CDMS 1.2 m": Float(682, 1.2, 0.5),
    "CDMS 2 m": Float(2470, 2.0, 0.5),
    "Viny 16 in": Float(19, 0.4, 0.6),
    "glass 12 in": Float(10, 0.343, 0.95, 0.305),
    "glass 17 in": Float(23, 0.51, 0.95, 0.432),
}


def with_float(table: Any) -> Any:
    """The keys of a [[joint]] or of a segment's body, completed by those of the float that it names.

    Raises InputError for an unknown float.
    """
    if not isinstance(table, dict) or table.get("float") is None:
        return table
    name = table["float"]
    if not isinstance(name, str) or name not in FLOATS:
        raise InputError(f"float = {name!r}: must be one of {', '.join(map(repr, FLOATS))}.")
    others = [keys_of(one) for one in FLOATS.values()]  # a variant of a scene still has those of the previous float
    own = {key: value for key, value in table.items() if all(value != other.get(key) for other in others)}
    return keys_of(FLOATS[name]) | {key: value for key, value in own.items() if key != "float"}


def float_of(body: Any) -> str | None:
    """Name of the float with the mass and volume of a body, which are all that a scene stores of it."""
    for name, one in FLOATS.items():
        keys = keys_of(one)
        if (body.mass, body.volume) == (keys["mass"], keys["volume"]):
            return name
    return None


def keys_of(one: Float) -> dict[str, float]:
    """Keys of a body that is a float."""
    volume = math.pi / 6 * (one.ball or one.diameter) ** 3
    area = math.pi / 4 * one.diameter**2
    mass = DENSITY * volume - one.buoyancy
    return {"mass": mass, "volume": volume, "drag_area": one.drag * area, "added_mass": 0.5}
