"""Buoys in space: points of the axis, surface and silhouette of the hull."""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.rigid import mass_properties, shape_of
from ..scene.buoy import Buoy


@dataclass
class Floating:
    """A buoy of a scene with its centre of mass C at r_C (3,) [m], turned by R (3, 3).

    velocity, spin: of C and about it (3,) [m/s, rad/s], if known.  shape: its hull, if any.  center: height of C above
    the keel, heights: of everything on the axis [m].  size: largest dimension [m].  masses: positions of point masses.
    mast: ends (2, 3) of the line drawn above the hull, or instead of one.
    """

    buoy: Buoy
    r_C: NDArray[Any]
    R: NDArray[Any]
    velocity: NDArray[Any] | None = None
    spin: NDArray[Any] | None = None

    def __post_init__(self) -> None:
        buoy, self.shape = self.buoy, shape_of(self.buoy)
        self.center, masses = mass_properties(buoy).height, [p.height for p in buoy.point_masses]
        top = [0.0, self.shape.height] if self.shape else []
        self.heights = [self.center, buoy.mooring_height, *masses, *top]
        width = self.shape.max_diameter if self.shape else 0.0
        self.size = max(max(self.heights) - min(self.heights), width) or 1.0
        self.masses = [self.at(height) for height in masses]
        foot = self.shape.height if self.shape else buoy.mooring_height
        self.mast = np.array([self.at(foot), self.at(max(self.heights))]) if masses or not self.shape else None

    def arm(self, height: float) -> NDArray[Any]:
        """Vector (3,) from C to the point of the axis at `height` above the keel, of the upright buoy [m]."""
        return np.array([0.0, 0.0, height - self.center])

    def place(self, arm: NDArray[Any]) -> NDArray[Any]:
        """Position of the point of the body at `arm` (3,) from C when upright [m]."""
        return np.asarray(self.r_C + self.R @ arm)

    def at(self, height: float) -> NDArray[Any]:
        """Position of the point of the buoy's axis at `height` above the keel."""
        return self.place(self.arm(height))

    @property
    def outline(self) -> NDArray[Any]:
        """(height above C, radius) (n, 2) of the stations of the hull or, without one, of the axis [m]."""
        if self.shape:
            return np.column_stack([self.shape.heights - self.center, self.shape.radii])
        return np.array([[self.buoy.mooring_height - self.center, 0.0], [0.0, 0.0]])

    def in_hull(self, x: NDArray[Any]) -> NDArray[Any]:
        """True for points (..., 3) inside the hull."""
        if self.shape is None:
            return np.zeros(x.shape[:-1], dtype=bool)
        body = (x - self.r_C) @ self.R
        height = body[..., 2] + self.center
        return np.asarray(np.hypot(body[..., 0], body[..., 1]) < self.shape.radius(height, height))

    def surface(self, around: int = 48, cell: float = np.inf) -> tuple[NDArray[Any], NDArray[Any]]:
        """Points (n, 3) and quadrilaterals (m, 4) of the hull, see `surface_of`."""
        points, quads = surface_of(self.outline, around, cell)
        return self.r_C + points @ self.R.T, quads

    def silhouette(self, view: NDArray[Any]) -> NDArray[Any]:
        """Outline (n, 2) of the hull in the vertical plane along a horizontal direction."""
        axis, stations = self.R[:, 2], self.outline
        aside = view - (view @ axis) * axis
        aside /= np.linalg.norm(aside) or 1.0
        middle = self.r_C + stations[:, :1] * axis
        sides = [middle + sign * stations[:, 1:] * aside for sign in (1, -1)]
        points = np.concatenate([sides[0], sides[1][::-1], sides[0][:1]])
        return np.column_stack([points @ view, points[:, 2]])


def surface_of(outline: NDArray[Any], around: int = 48, cell: float = np.inf) -> tuple[NDArray[Any], NDArray[Any]]:
    """Points (n, 3) and quadrilaterals (m, 4) of the closed surface of revolution of an outline.
    outline: (height, radius) from the lowest station up.

    around: number of meridians.  cell: longest quadrilateral along a meridian [m].
    """
    (low, _), (high, _) = outline[0], outline[-1]
    outline = _refined(np.array([(low, 0.0), *outline, (high, 0.0)]), cell)
    angle = 2 * np.pi * np.arange(around) / around
    z, r = outline[:, :1], outline[:, 1:]
    points = np.stack([r * np.cos(angle), r * np.sin(angle), np.broadcast_to(z, (len(z), around))], axis=-1)
    ring, j = np.arange(len(outline) - 1)[:, None] * around, np.arange(around)
    following = (j + 1) % around
    quads = np.stack([ring + j, ring + following, ring + around + following, ring + around + j], axis=-1)
    return points.reshape(-1, 3), quads.reshape(-1, 4)


def _refined(outline: NDArray[Any], cell: float) -> NDArray[Any]:
    """The outline divided into pieces no longer than `cell`; pieces of zero length are dropped."""
    points = [outline[:1]]
    for a, b in itertools.pairwise(outline):
        length = float(np.hypot(*(b - a)))
        count = int(np.ceil(length / cell)) if np.isfinite(cell) else 1
        if length > 0:
            points.append(a + (b - a) * np.arange(1, max(count, 1) + 1)[:, None] / max(count, 1))
    return np.concatenate(points)
