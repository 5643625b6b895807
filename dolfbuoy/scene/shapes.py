"""Coefficients of a hull by shape: those of an upright cylinder with its water plane and displaced volume."""

import functools
import math
from typing import TYPE_CHECKING, Any, NamedTuple

from .buoy import Buoy
from .cylinder import TERMS, Cylinder, Motion
from .hulls import float_upright, mass_properties, shape_of
from .quantities import Missing, Wrong

if TYPE_CHECKING:
    from .sections import Scene

#: Names of shapes, with the least and largest draft in radii for which they are meant.
SHAPES = {"disc": (0.0, 1.0), "cylinder": (0.5, 6.0), "spar": (4.0, math.inf)}
#: Keys of a buoy that accept the name of a shape.
BY_SHAPE = ("added_mass", "axial_added_mass", "rotational_added_mass")
SOURCE = "truncated cylinder by potential flow (Yeung 1981), at the natural period of heave, or of pitch"
#: Depth in radii or drafts above which the bed has no influence.
DEEP = 10.0
#: Iterations for a natural period, as the added mass depends on it.
ROUNDS = 6
#: Least gap between bottom and bed, as a fraction of the draft.
LEAST_GAP = 0.02


class Estimate(NamedTuple):
    """Natural angular frequencies [rad/s], added masses [kg, kg m^2] and radiation damping [N s/m, N m s] of a hull.

    cylinder: the equivalent cylinder; draft: the hull's own [m].
    """

    cylinder: Cylinder
    draft: float
    heave: float
    pitch: float
    of_surge: float
    of_heave: tuple[float, float]
    of_pitch: tuple[float, float]


def is_by_shape(buoy: Buoy) -> bool:
    """True if any coefficient of a buoy is given by its shape."""
    return any(isinstance(getattr(buoy, name), str) for name in (*BY_SHAPE, "wave_damping"))


def by_shape(scene: "Scene", buoy: Buoy, key: str) -> Buoy:
    """The buoy with names of shapes replaced by numbers; key: of its table.  Raises Wrong or Missing."""
    if not is_by_shape(buoy):
        return buoy
    name = next(name for name in (*BY_SHAPE, "wave_damping") if isinstance(getattr(buoy, name), str))
    if scene.sea is None or scene.gravity == 0:
        raise Missing("sea", f"and gravity: {key}.{name} is of a hull that floats")
    found = estimate(scene, buoy, f"{key}.{name}")
    density, shape = scene.sea.density, shape_of(buoy)
    _, spheres, discs = shape.projected(found.draft)  # type: ignore[union-attr]
    given: dict[str, Any] = {"added_mass": found.of_surge / (density * _volume(found.cylinder))}
    given["axial_added_mass"] = found.of_heave[0] / (density * spheres)
    across = buoy.added_mass if not isinstance(buoy.added_mass, str) else given["added_mass"]
    center = mass_properties(buoy).height
    of_strips = shape.integrate(lambda z, r: math.pi * r**2 * (z - center) ** 2, found.draft)  # type: ignore[union-attr]
    rest = found.of_pitch[0] - across * density * float(of_strips)
    given["rotational_added_mass"] = max(rest, 0.0) / (density * discs)
    given["wave_damping"] = [found.of_heave[1], found.of_pitch[1]]
    return buoy.model_copy(update={name: x for name, x in given.items() if isinstance(getattr(buoy, name), str)})


def _volume(cylinder: Cylinder) -> float:
    return math.pi * cylinder.radius**2 * cylinder.draft


def estimate(scene: "Scene", buoy: Buoy, key: str = "buoy.hull") -> Estimate:
    """Potential-flow estimate for a freely floating hull.  Raises Wrong for one that does not float."""
    shape, mass, sea, g = shape_of(buoy), mass_properties(buoy), scene.sea, scene.gravity
    if sea is None or shape is None or mass.mass >= sea.density * shape.volume() * (1 - 1e-9):
        raise Wrong(key, getattr(buoy, key.rpartition(".")[2], None), "is of a hull that floats without its lines")
    free = float_upright(shape, mass, sea.density, g)
    radius = shape.waterplane_radius(free.draft)
    if radius <= 0 or free.draft >= sea.depth:
        raise Wrong(key, getattr(buoy, key.rpartition(".")[2], None), "is of a hull with a water plane, afloat")
    draft = mass.mass / sea.density / (math.pi * radius**2)
    depth = min(sea.depth + draft - free.draft, DEEP * max(radius, draft))
    depth = max(depth, (1 + LEAST_GAP) * draft)
    cylinder = Cylinder(radius, draft, depth, mass.height - free.draft)
    pitch_stiffness = mass.mass * g * free.GM
    heave = _natural(cylinder, "heave", mass.mass / sea.density, free.heave_stiffness / sea.density, g)
    pitch = heave
    if free.GM > 0:
        pitch = _natural(cylinder, "pitch", mass.inertia[0] / sea.density, pitch_stiffness / sea.density, g)
    of_heave, of_surge = (_radiation(cylinder, motion, heave, g) for motion in ("heave", "surge"))
    of_pitch = _radiation(cylinder, "pitch", pitch, g)
    return Estimate(
        cylinder,
        free.draft,
        heave,
        pitch,
        sea.density * of_surge[0],
        (sea.density * of_heave[0], sea.density * of_heave[1]),
        (sea.density * of_pitch[0], sea.density * of_pitch[1]),
    )


@functools.lru_cache(maxsize=256)
def _radiation(
    cylinder: Cylinder, motion: Motion, omega: float, gravity: float, terms: int = TERMS
) -> tuple[float, float]:
    return cylinder.radiation(motion, omega, gravity, terms)


def _natural(cylinder: Cylinder, motion: Motion, inertia: float, stiffness: float, gravity: float) -> float:
    """Natural angular frequency [rad/s]; inertia and stiffness per density."""
    omega = math.sqrt(stiffness / inertia)
    for _ in range(ROUNDS):
        added, _ = _radiation(cylinder, motion, omega, gravity, TERMS // 4)
        omega = math.sqrt(stiffness / (inertia + max(added, 0.0)))
    return omega
