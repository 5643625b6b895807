"""Free bodies and rods of MoorDyn that are bodies of revolution, as buoys, with points on them as fairleads.

A rod is a floating cylinder, to which a body adds mass and inertia [about the centre of mass, as here]; a body without
rods has its volume about its origin.  Rods not in a row along one axis are bars between points of the body.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene.quantities import number_of
from .moordyn_text import Row

_CLOSE = 1e-6  # m
#: Displaced mass of a body without volume, relative to its mass: a hull with negligible buoyancy.
HARDLY = 1e-4
#: Fraction of the mass of its rods assigned to a body without mass.
SHARE = 0.01


#: Mass [kg], centre [m] and inertia (3, 3) about it [kg m^2].
_Part = tuple[float, "NDArray[Any]", "NDArray[Any]"]


@dataclass
class BodyOf:
    """A buoy made from a body: its section, and position of the keel and axes (columns) in the body's frame.

    bars: rods that become bars between points of it, and the fraction of their mass that these keep.
    """

    section: dict[str, Any]
    keel: NDArray[Any]
    axes: NDArray[Any]
    bars: list[Row] = field(default_factory=list)
    own_mass: float = 1.0

    def own(self, place: NDArray[Any]) -> NDArray[Any]:
        """A position in the body's frame, transformed to that of the buoy."""
        return np.asarray((place - self.keel) @ self.axes)

    def fairlead(self, name: str, place: NDArray[Any]) -> str:
        """Name of the end of a cable on this body; place: in the body's frame [m]."""
        self.section.setdefault("fairleads", {})[name] = (self.own(place) + 0.0).tolist()
        return f"{self.section['name']}.{name}"


def turn_of(body: Row) -> NDArray[Any]:
    """Initial rotation matrix R of a body, from roll, pitch and yaw (about z, y, x in turn)."""
    angles = np.radians([body.number(name, 0.0) for name in ("roll", "pitch", "yaw")])
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_x @ about_y @ about_z)


def placed(body: Row, place: NDArray[Any]) -> NDArray[Any]:
    """Initial position of a point of a body in space [m]."""
    return np.asarray([body.number(axis, 0.0) for axis in "xyz"] + turn_of(body) @ place)


def ends_of(rod: Row) -> list[NDArray[Any]]:
    """The ends A and B of a rod [m], in the frame of its body if it is on one."""
    return [np.array([rod.number(f"{axis}{end}") for axis in "xyz"]) for end in "ab"]


def type_of(rod: Row, types: dict[str, Row]) -> Row:
    """The type of a rod.  Raises InputError."""
    if rod["type"] not in types:
        raise InputError(f"line {rod.line}: RodType {rod['type']!r} is none of the ROD TYPES: {', '.join(types)}.")
    return types[rod["type"]]


class NoBuoy(Exception):
    """Reason why a body is not a body of revolution."""


def buoy_of(
    name: str, body: Row | None, rods: list[Row], types: dict[str, Row], rho: float, note: Callable[..., Any]
) -> BodyOf:
    """The buoy for a free body, or for a single free rod; note(line, text): for data that are lost.

    rho: density of the water [kg/m^3].  Raises InputError for a rod without type or a body without mass, NoBuoy with a
    reason if there is no such buoy.
    """
    kinds = [type_of(rod, types) for rod in rods]
    center = _center(body)
    keel, axes = _frame(rods, center)
    if body is not None and rods and body.number("volume", 0.0):
        raise NoBuoy("has a volume besides that of its rods")
    parts = _parts(body, center, rods, kinds)
    total = sum(mass for mass, _, _ in parts)
    if total <= 0:
        raise InputError(f"line {(body or rods[0]).line}: {name} and its rods have no mass.")
    if body is None or rods:
        water = _water_of_rods(rods, kinds, keel, axes, note)
    else:
        keel, water = _own_water(body, keel, axes, total, rho, note)
    masses, axes = _masses(name, parts, keel, axes, (body or rods[0]).line, note)
    if body is not None:
        _say_rest(body, rods, note)
    return BodyOf({"name": name, "hull": water.pop("hull")} | masses | water, keel, axes)


def barred(
    name: str, body: Row, rods: list[Row], types: dict[str, Row], rho: float, note: Callable[..., Any]
) -> BodyOf:
    """The buoy for a free body without its rods, which become bars between points of it.

    A bar has the mass, volume and drag of its rod along it, and its inertia except that about its own axis, which is
    added to the body.  A body without mass gets a fraction of the mass of its rods, at their centre.
    """
    rods = [rod for rod in rods if np.linalg.norm(np.subtract(*ends_of(rod))) > _CLOSE]
    center, mass, share = _center(body), body.number("mass", 0.0), 0.0
    whole = _parts(body, center, rods, [type_of(rod, types) for rod in rods])
    own, of_rods = whole[0], whole[1:]
    if mass <= 0:
        share, mass = SHARE, SHARE * sum(one for one, _, _ in of_rods)
        if mass <= 0:
            raise InputError(f"line {body.line}: {name} and its rods have no mass.")
        center = np.sum([SHARE * one * at for one, at, _ in of_rods], axis=0) / mass
        own = (mass, center, own[2] + sum(_about_point(one, SHARE, center) for one in of_rods))
        note(body.line, f"{name} has no mass: {SHARE:.0%} of that of its rods is at their centre, and not in them")
    spins = sum((1 - share) * _spin(rod, type_of(rod, types)) for rod in rods)
    keel, axes = _frame([], center)
    keel, water = _own_water(body, keel, axes, mass, rho, note)
    masses, axes = _masses(name, [(own[0], center, own[2] + spins)], keel, axes, body.line, note)
    _say_rest(body, [], note)
    return BodyOf({"name": name, "hull": water.pop("hull")} | masses | water, keel, axes, rods, 1 - share)


def _about_point(part: _Part, share: float, point: NDArray[Any]) -> NDArray[Any]:
    """Inertia of a fraction of a part about a point (parallel-axis theorem)."""
    mass, center, inertia = part
    arm = center - point
    return np.asarray(share * (inertia + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))))


def _spin(rod: Row, kind: Row) -> NDArray[Any]:
    """Inertia of a rod beyond that of a thin one."""
    a, b = ends_of(rod)
    length, diameter = float(np.linalg.norm(b - a)), kind.number("diameter")
    way, mass = (b - a) / length, kind.number("mass_density", 0.0) * length
    return np.asarray(mass * diameter**2 / 16 * (np.eye(3) + np.outer(way, way)))


def _center(body: Row | None) -> NDArray[Any]:
    """Centre of mass of a body without its rods, in its frame."""
    if body is None:
        return np.zeros(3)
    if "xcg" in body.values:
        return np.array([body.number(f"{axis}cg", 0.0) for axis in "xyz"])
    center = numbers(body, "CG", (1, 3))
    return center if len(center) == 3 else center[0] * np.array([0.0, 0.0, 1.0])


def _moments(body: Row) -> NDArray[Any]:
    if "Ix" in body.values:
        return np.array([body.number(f"I{axis}", 0.0) for axis in "xyz"])
    return np.broadcast_to(numbers(body, "I", (1, 3)), 3)


def _frame(rods: list[Row], center: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The lowest point on the axis of rods in a row (without rods, the origin), and the frame about it.
    Columns are the axes.  Raises NoBuoy."""
    if not rods:
        far = np.linalg.norm(center)
        return np.zeros(3), _about(center / far if far > _CLOSE else np.array([0.0, 0.0, 1.0]))
    pairs = [ends_of(rod) for rod in rods]
    way = max((b - a for a, b in pairs), key=lambda along: float(np.linalg.norm(along)))
    if np.linalg.norm(way) < _CLOSE or any(np.linalg.norm(b - a) < _CLOSE for a, b in pairs):
        raise NoBuoy("has a rod without length")
    axes = _about(way / np.linalg.norm(way))
    start = pairs[0][0]
    places = [[(end - start) @ axes for end in pair] for pair in pairs]
    if any(np.hypot(*end[:2]) > _CLOSE for pair in places for end in pair):
        raise NoBuoy("has rods that do not stand on one axis")
    spans = sorted(sorted(float(end[2]) for end in pair) for pair in places)
    if any(abs(below[1] - above[0]) > _CLOSE for below, above in pairwise(spans)):
        raise NoBuoy("has rods with gaps between them")
    return start + spans[0][0] * axes[:, 2], axes


def _about(axis: NDArray[Any]) -> NDArray[Any]:
    """A frame whose third column is the axis, pointing up, by the shortest rotation."""
    axis = -axis if axis[2] < 0 else axis
    across, c = np.array([-axis[1], axis[0], 0.0]), axis[2]
    skew = np.array([[0, 0, across[1]], [0, 0, -across[0]], [-across[1], across[0], 0]])
    found: NDArray[Any] = np.eye(3) + skew + skew @ skew / (1 + c)
    return found


def _parts(body: Row | None, center: NDArray[Any], rods: list[Row], kinds: list[Row]) -> list[_Part]:
    """Mass, centre and inertia (3, 3) about it, of the body and of its rods, in the body's frame."""
    found: list[_Part] = [] if body is None else [(body.number("mass", 0.0), center, np.diag(_moments(body)))]
    for rod, kind in zip(rods, kinds, strict=True):
        a, b = ends_of(rod)
        length, diameter = float(np.linalg.norm(b - a)), kind.number("diameter")
        mass, way = kind.number("mass_density", 0.0) * length, (b - a) / length
        across, along = mass * (length**2 / 12 + diameter**2 / 16), mass * diameter**2 / 8
        found.append((mass, (a + b) / 2, across * np.eye(3) + (along - across) * np.outer(way, way)))
    return found


def _masses(
    name: str, parts: list[_Part], keel: NDArray[Any], axes: NDArray[Any], line: int, note: Callable[..., Any]
) -> tuple[dict[str, Any], NDArray[Any]]:
    """Mass, height of its centre and moments about it, and the axes rotated about the third to principal ones.
    Raises NoBuoy."""
    placed_parts = [(mass, (center - keel) @ axes, axes.T @ inertia @ axes) for mass, center, inertia in parts]
    if any(np.abs(center[:2]).max() > _CLOSE for mass, center, _ in placed_parts if mass):
        raise NoBuoy("has its centre of mass off the axis of its rods")
    total = sum(mass for mass, _, _ in parts)
    height = sum(mass * center[2] for mass, center, _ in placed_parts) / total
    tensor: Any = sum(
        own + mass * (center[2] - height) ** 2 * np.diag([1.0, 1.0, 0.0]) for mass, center, own in placed_parts
    )
    largest = np.abs(np.diag(tensor)).max()
    if abs(tensor[0, 1]) > _CLOSE * largest:
        angle = 0.5 * math.atan2(2 * tensor[0, 1], tensor[0, 0] - tensor[1, 1])
        angle -= math.pi / 2 * round(angle / (math.pi / 2))  # the nearest
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        axes, tensor = axes @ turn, turn.T @ tensor @ turn
    if (product := np.abs(tensor[:2, 2]).max()) > _CLOSE * largest:
        note(line, f"products of inertia of {name}, up to {product / largest:.2g} of its largest moment, are left out")
    found: dict[str, Any] = {"mass": float(total), "center_of_mass": float(height)}
    moments = np.diag(tensor)
    if moments.min() > 0:
        return found | {"inertia": moments.tolist()}, axes
    note(line, f"{name} has no inertia: that of its mass spread over the hull is taken")
    return found, axes


def _water_of_rods(
    rods: list[Row], kinds: list[Row], keel: NDArray[Any], axes: NDArray[Any], note: Callable[..., Any]
) -> dict[str, Any]:
    """Hull and coefficients of rods in a row."""
    spans = [sorted(float((end - keel) @ axes[:, 2]) for end in ends_of(rod)) for rod in rods]
    order = sorted(range(len(rods)), key=lambda k: spans[k][0])
    hull = [[height + 0.0, kinds[k].number("diameter")] for k in order for height in spans[k]]
    low = kinds[order[0]]
    for column in ("Cd", "Ca", "CdEnd", "CaEnd"):
        if len({kind.number(column, 0.0) for kind in kinds}) > 1:
            note(rods[order[1]].line, f"rods differ in {column}: that of the lowest is taken for the whole hull")
    found = {"hull": hull, "normal_drag": low.number("Cd", 0.0), "added_mass": low.number("Ca", 0.0)}
    return found | {"axial_drag": low.number("CdEnd", 0.0), "axial_added_mass": low.number("CaEnd", 0.0)}


def _own_water(
    body: Row, origin: NDArray[Any], axes: NDArray[Any], mass: float, rho: float, note: Callable[..., Any]
) -> tuple[NDArray[Any], dict[str, Any]]:
    """Keel and hull of a body without rods: a cylinder as high as wide with its volume about its origin.
    Its coefficients reproduce the drag areas and added masses of the body."""
    volume = body.number("volume", 0.0)
    if volume <= 0:
        volume = HARDLY * mass / (rho or 1.0)
        note(body.line, f"body {body['id']} has no volume: a hull that displaces {HARDLY:g} of its mass stands for it")
    size = float(np.cbrt(4 * volume / math.pi))
    areas, added = (_of_axes(body, column, note) @ axes**2 for column in ("CdA", _added(body)))
    faces, spheres = 2 * math.pi / 4 * size**2, 2 * 2 / 3 * math.pi * (size / 2) ** 3
    found = {"hull": [[0.0, size], [size, size]], "normal_drag": float(areas[:2].mean()) / size**2}
    found |= {"added_mass": float(added[:2].mean())}
    found |= {"axial_drag": float(areas[2]) / faces, "axial_added_mass": float(added[2]) * volume / spheres}
    return origin - size / 2 * axes[:, 2], found


def _added(body: Row) -> str:
    return "point_Ca" if "point_Ca" in body.values else "Ca"


def _of_axes(body: Row, column: str, note: Callable[..., Any]) -> NDArray[Any]:
    """Values along the three axes of a body, from a column with one value for all, or one for each."""
    values = numbers(body, column)
    if (len(values) == 2 and values[1]) or (len(values) == 6 and values[3:].any()):
        note(body.line, f"of {column.removeprefix('point_')} = {body[column]} what is of turning is not carried over")
    return values[:3] if len(values) >= 3 else np.full(3, values[0])


def numbers(body: Row, column: str, counts: Sequence[int] = (1, 2, 3, 6)) -> NDArray[Any]:
    """Numbers a|b|c, of one of these counts.  Raises InputError."""
    text = body.values.get(column, "0")
    try:
        values = np.array([number_of(part) for part in text.split("|")])
    except ValueError:
        values = np.array([])
    if len(values) not in counts:
        allowed = " or ".join(map(str, counts))
        raise InputError(f"line {body.line}: {column} is {text!r}: must be {allowed} numbers, with | between them.")
    return values


def _say_rest(body: Row, rods: list[Row], note: Callable[..., Any]) -> None:
    """Note quantities of a body that a buoy lacks."""
    if rods and numbers(body, "CdA").any():
        note(body.line, f"the body has drag besides its rods', {body['CdA']}, which is not carried over")
    if rods and numbers(body, _added(body)).any():
        note(body.line, "the added mass of the body besides its rods' is not carried over")
    if any(body.number(name, 0.0) for name in ("roll", "pitch", "yaw")):
        note(body.line, "how the body is turned at the start is left to its equilibrium")
