"""Bodies of MoorDyn: a free one with upright rods on its axis is a buoy; its points are fairleads.

A rod there is a cylinder that floats; a body gives it mass and inertia [about the centre of mass, as here].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..scene.quantities import number_of
from .moordyn_text import Row

if TYPE_CHECKING:
    from numpy.typing import NDArray

_CLOSE = 1e-6  # m


@dataclass
class BodyOf:
    """A buoy made of a body: its section, where the keel is in the body's frame, and the names of its points."""

    section: dict[str, Any]
    keel: NDArray[Any]

    def fairlead(self, point: str, place: NDArray[Any]) -> str:
        """The end of a cable on this body.  place: in the body's frame [m]."""
        own = place - self.keel
        self.section.setdefault("fairleads", {})[f"point{point}"] = own.tolist()
        return f"{self.section['name']}.point{point}"


def placed(body: Row, place: NDArray[Any]) -> NDArray[Any]:
    """A point of a body in space [m]: at rest, turned by roll, pitch and yaw (about z, y, x in turn) as it starts."""
    angles = np.radians([body.number(name, 0.0) for name in ("roll", "pitch", "yaw")])
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray([body.number(axis, 0.0) for axis in "xyz"] + about_x @ about_y @ about_z @ place)


def buoy_of(body: Row, rods: list[Row], types: dict[str, Row], note: Callable[..., Any]) -> BodyOf | None:
    """The buoy that a free body with these rods is; None, and a `note`(line, text), if it cannot be one.

    Raises InputError for a rod of no type.
    """
    number = body["id"]
    for rod in rods:
        if rod["type"] not in types:
            raise InputError(f"line {rod.line}: RodType {rod['type']!r} is none of the ROD TYPES: {', '.join(types)}.")
    reason = _why_not(rods)
    if reason:
        note(body.line, f"body {number} {reason}: its points are held where they stand")
        return None
    rods = sorted(rods, key=lambda rod: _ends(rod)[0][2])
    low, ends = rods[0], [_ends(rod) for rod in rods]
    keel = ends[0][0]
    hull = [
        [float(end[2] - keel[2]), types[rod["type"]].number("diameter")]
        for rod, pair in zip(rods, ends, strict=True)
        for end in pair
    ]
    kind = types[low["type"]]
    section = {"name": f"body{number}", "hull": hull} | _masses(body, rods, types, keel, note)
    section |= {"normal_drag": kind.number("Cd", 0.0), "added_mass": kind.number("Ca", 0.0)}
    section |= {"axial_drag": kind.number("CdEnd", 0.0), "axial_added_mass": kind.number("CaEnd", 0.0)}
    _say_rest(body, rods, types, note)
    return BodyOf(section, keel)


def _ends(rod: Row) -> list[NDArray[Any]]:
    """The lower and the upper end of a rod [m], which is the same upside down."""
    ends = [np.array([rod.number(f"{axis}{end}") for axis in "xyz"]) for end in "ab"]
    return sorted(ends, key=lambda end: end[2])


def _why_not(rods: list[Row]) -> str:
    """Why rods are no hull; empty if they are."""
    if not rods:
        return "has no rod, so that nothing floats it"
    ends = sorted((_ends(rod) for rod in rods), key=lambda pair: pair[0][2])
    axis = ends[0][0][:2]
    if any(np.abs(end[:2] - axis).max() > _CLOSE for pair in ends for end in pair):
        return "has rods that do not stand on one axis"
    if any(high[2] <= low[2] for low, high in ends):
        return "has a rod without height"
    if any(abs(below[1][2] - above[0][2]) > _CLOSE for below, above in pairwise(ends)):
        return "has rods with gaps between them"
    return ""


def _masses(
    body: Row, rods: list[Row], types: dict[str, Row], keel: NDArray[Any], note: Callable[..., Any]
) -> dict[str, float | list[float]]:
    """Mass, height of its centre and moments about it, of body and rods together."""
    center = _numbers(body, "CG", (1, 3))
    center = center if len(center) == 3 else center[0] * np.array([0.0, 0.0, 1.0])
    parts = [(body.number("mass", 0.0), center - keel, np.broadcast_to(_numbers(body, "I", (1, 3)), 3))]
    for rod in rods:
        low, high = _ends(rod)
        length, kind = high[2] - low[2], types[rod["type"]]
        mass, diameter = kind.number("mass_density", 0.0) * length, kind.number("diameter")
        across = mass * (length**2 / 12 + diameter**2 / 16)
        parts.append((mass, (low + high) / 2 - keel, np.array([across, across, mass * diameter**2 / 8])))
    total = sum(mass for mass, _, _ in parts)
    if total <= 0:
        raise InputError(f"line {body.line}: body {body['id']} and its rods have no mass.")
    if any(np.abs(center[:2]).max() > _CLOSE for mass, center, _ in parts if mass):
        raise InputError(f"line {body.line}: the centre of mass of a body off its rods' axis is not carried over.")
    height = sum(mass * center[2] for mass, center, _ in parts) / total
    moments = sum(own + mass * (center[2] - height) ** 2 * np.array([1.0, 1.0, 0.0]) for mass, center, own in parts)
    found: dict[str, Any] = {"mass": float(total), "center_of_mass": float(height)}
    if moments.min() > 0:
        return found | {"inertia": moments.tolist()}
    note(body.line, f"body {body['id']} has no inertia: that of its mass spread over the hull is taken")
    return found


def _numbers(body: Row, column: str, counts: tuple[Any, ...] = (1, 2, 3, 6)) -> NDArray[Any]:
    """Numbers a|b|c, so many of them."""
    text = body.values.get(column, "0")
    try:
        values = np.array([number_of(part) for part in text.split("|")])
    except ValueError:
        values = np.array([])
    if len(values) not in counts:
        allowed = " or ".join(map(str, counts))
        raise InputError(f"line {body.line}: {column} is {text!r}: must be {allowed} numbers, with | between them.")
    return values


def _say_rest(body: Row, rods: list[Row], types: dict[str, Row], note: Callable[..., Any]) -> None:
    """Quantities of a body that a buoy has no place for."""
    for column, what in (("volume", "a volume besides its rods'"), ("CdA", "drag besides its rods'")):
        if _numbers(body, column).any():
            note(body.line, f"the body has {what}, {body[column]}, which is not carried over")
    if any(_numbers(body, name).any() for name in ("Ca", "point_Ca")):
        note(body.line, "the added mass of the body besides its rods' is not carried over")
    for column in ("Cd", "Ca", "CdEnd", "CaEnd"):
        if len({types[rod["type"]].number(column, 0.0) for rod in rods}) > 1:
            note(rods[1].line, f"rods differ in {column}: that of the lowest is taken for the whole hull")
    if any(body.number(name, 0.0) for name in ("roll", "pitch", "yaw")):
        note(body.line, "how the body is turned at the start is left to its equilibrium")
