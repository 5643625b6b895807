"""Parameters of the contact with the sea bed: its position, stiffness and friction."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..scene import Scene
from ..scene.cable import Cable
from ..scene.lines import Body, Sinker
from .rigid import weight_per_length


class ContactParameters(NamedTuple):
    """Contact parameters per metre of a line, or of a body (`forms.seabed.Contact`)."""

    stiffness: float  #: k [N/m]
    damping: float  #: c [N s/m]
    sag: float  #: delta [m]
    stick: float  #: k_t [N/m]


def plane(scene: Scene) -> tuple[np.ndarray, float]:
    """(n, d) of the bed n . x = d, n upwards; for an uneven bed the best-fit plane near the fixed ends of lines."""
    (a, b), level = scene.seabed.slope, -scene.sea.depth
    if scene.seabed.depths is not None:
        a, b, level = _nearest_plane(scene)
    normal = np.array([-a, -b, 1.0]) / math.sqrt(1 + a * a + b * b)
    return normal, level * float(normal[2])


def _nearest_plane(scene: Scene) -> tuple[float, float, float]:
    """(a, b, c) of the plane z = a x + b y + c that best fits a bed of depths around the fixed ends of lines."""
    places = [end.position for piece in scene.network.pieces for end in piece.ends if end.position is not None]
    low, high = (fold(np.array(places)[:, :2], axis=0) for fold in (np.min, np.max))
    reach = 0.5 * max(piece.section.length for piece in scene.network.pieces)
    low, high = np.where(high - low < reach, (low - reach, high + reach), (low, high))
    x, y = (grid.ravel() for grid in np.meshgrid(*np.linspace(low, high, 15).T))
    fit = np.column_stack([x, y, np.ones_like(x)])
    a, b, c = np.linalg.lstsq(fit, scene.seabed.depths.height(x, y), rcond=None)[0]
    return float(a), float(b), float(c)


def height_of_bed(scene: Scene, points: np.ndarray) -> np.ndarray:
    """z of the bed [m] under points (..., 3), or (..., 2), of a scene with a sea."""
    if scene.seabed and scene.seabed.depths is not None:
        return np.asarray(scene.seabed.depths.height(*np.moveaxis(np.asarray(points, dtype=float)[..., :2], -1, 0)))
    slope = scene.seabed.slope if scene.seabed else (0.0, 0.0)
    return np.asarray(points)[..., :2] @ slope - scene.sea.depth


def largest_sag(scene: Scene) -> float:
    """Largest penetration of a line or body under its own weight [m]; relative error of a tension: 1.2 sag/depth."""
    return min(1e-4 * scene.sea.depth, 0.01)


def stick_length(scene: Scene) -> float:
    """Displacement over which Coulomb friction is mobilised [m]."""
    return scene.seabed.stick_length or min(1e-3 * scene.sea.depth, 0.05)


def has_friction(scene: Scene, dynamic: bool) -> bool:
    """True if there is friction: in statics only with `seabed.start = "pulled"`."""
    return scene.seabed.friction > 0 and (dynamic or scene.seabed.start == "pulled")


def hardness(scene: Scene, sections: Sequence[Cable]) -> float:
    """k_b [Pa/m]; sections: those of all lines, the heaviest of which determines k_b if the scene does not give it."""
    if scene.seabed.stiffness is not None:
        return scene.seabed.stiffness
    return max(_load(scene, c) / c.diameter for c in sections) / largest_sag(scene)


def parameters_of_line(scene: Scene, section: Cable, k_b: float) -> ContactParameters:
    """Contact parameters of a line on a bed of stiffness k_b [Pa/m]."""
    given = _load(scene, section), section.line_density, k_b * section.diameter
    return _parameters(scene, *given, scene.seabed.friction)


def parameters_of_body(scene: Scene, body: Body) -> ContactParameters:
    """Contact parameters of a body at a joint."""
    weight = max(abs(body.mass - scene.sea.density * body.volume), 1e-3 * body.mass) * scene.gravity
    stiffness = weight / largest_sag(scene)
    return _parameters(scene, weight, body.mass, stiffness, friction_of(scene, body))


def friction_of(scene: Scene, body: Body) -> float:
    """Friction coefficient of a body on the bed."""
    return body.friction if isinstance(body, Sinker) else scene.seabed.friction


def _load(scene, section):
    """Load per metre of a line on the bed [N/m]; positive even for nearly neutrally buoyant lines."""
    return max(abs(weight_per_length(scene, section)), 1e-3 * section.line_density * scene.gravity)


def _parameters(scene, weight, mass, stiffness, friction):
    bed = scene.seabed
    damping = 2 * bed.damping_ratio * math.sqrt(stiffness * mass)
    return ContactParameters(stiffness, damping, weight / stiffness, friction * weight / stick_length(scene))
