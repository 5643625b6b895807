"""A hull of revolution given by stations (height above keel, diameter), straight in between."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

_GAUSS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class HullShape:
    """Stations from the keel up; a repeated height is a step in diameter."""

    stations: tuple[tuple[float, float], ...]

    @cached_property
    def heights(self):
        return np.array([h for h, _ in self.stations])

    @cached_property
    def radii(self):
        return np.array([d for _, d in self.stations]) / 2

    @property
    def height(self) -> float:
        """Height of the top above the keel [m]."""
        return float(self.heights[-1])

    @property
    def max_diameter(self) -> float:
        return float(2 * self.radii.max())

    @cached_property
    def segments(self):
        """(height0, height1, radius0, radius1) of every frustum; nearly coincident stations are a step, and parts of
        zero diameter are omitted."""
        h, r, least = self.heights.tolist(), self.radii.tolist(), 1e-9 * self.height
        pairs = zip(h, h[1:], r, r[1:], strict=False)
        return [(a, b, ra, rb) for a, b, ra, rb in pairs if b - a > least and ra + rb > 0]

    def pieces(self, cells):
        """The frusta of `segments`, subdivided into about `cells` parts over the whole height.

        No part is longer than two diameters of the hull: waves short enough to vary along it are diffracted.
        """
        found = []
        for a, b, ra, rb in self.segments:
            count = max(1, round(cells * (b - a) / self.height), math.ceil((b - a) / (2 * self.max_diameter) - 1e-9))
            heights, radii = np.linspace(a, b, count + 1), np.linspace(ra, rb, count + 1)
            found += zip(heights, heights[1:], radii, radii[1:], strict=False)
        return found

    def faces(self):
        """(height, inner radius, outer radius) of every end disc and of the ring at each step."""
        h, r, least = self.heights, self.radii, 1e-9 * self.height
        found = [(0.0, 0.0, r[0])]
        for a, b, ra, rb in zip(h, h[1:], r, r[1:], strict=False):
            if b - a <= least:
                found.append((a, min(ra, rb), max(ra, rb)))
        found.append((self.height, 0.0, r[-1]))
        return [(float(z), float(inner), float(outer)) for z, inner, outer in found if outer > inner]

    def projected(self, draft):
        """Sums over the faces below the height `draft` of the upright hull, including cones: area pi |d R^2| [m^2],
        half spheres 2/3 pi |d R^3| [m^3], discs about a diameter 8/45 |d R^5| [m^5]."""
        pairs = [(inner, outer) for z, inner, outer in self.faces() if z <= draft and z < self.height]
        for a, b, ra, rb in self.segments:
            if a < draft:
                pairs.append((ra, ra + (rb - ra) * (min(b, draft) - a) / (b - a)))
        if draft >= self.height:
            pairs.append((0.0, self.radii[-1]))
        powers = ((2, np.pi), (3, 2 / 3 * np.pi), (5, 8 / 45))
        return tuple(float(sum(factor * abs(r1**n - r0**n) for r0, r1 in pairs)) for n, factor in powers)

    @property
    def tapered(self) -> bool:
        """True if the hull has a cone."""
        return any(ra != rb for _, _, ra, rb in self.segments)

    def radius(self, zeta, inside):
        """R(zeta) [m] of the frustum that contains the height `inside`, which selects the side at a step."""
        zeta, inside = np.broadcast_arrays(np.asarray(zeta, float), inside)
        result = np.zeros(zeta.shape)
        for a, b, ra, rb in self.segments:
            here = (inside > a) & (inside < b)
            result[here] = (ra + (rb - ra) * (zeta - a) / (b - a))[here]
        return result

    def integrate(self, function, top=None):
        """Integral over heights from the keel to `top` of function(height, radius); exact up to degree 9."""
        total = 0.0
        for a, b, ra, rb in self.segments:
            end = b if top is None else min(b, top)
            if end <= a:
                break
            x = a + (end - a) * (_GAUSS[0] + 1) / 2
            total = total + (end - a) / 2 * np.sum(_GAUSS[1] * function(x, ra + (rb - ra) * (x - a) / (b - a)), axis=-1)
        return total

    def volume(self, draft=None):
        """Volume below the height `draft` of the upright hull [m^3] (total volume by default)."""
        return float(self.integrate(lambda z, r: np.pi * r**2, draft))

    def centroid(self, draft=None):
        """Height of the centroid of that volume above the keel (KB) [m]."""
        return float(self.integrate(lambda z, r: np.pi * r**2 * z, draft)) / self.volume(draft)

    def waterplane_radius(self, draft):
        """Radius of the water plane of the upright hull [m]; at a step, the one below it."""
        inside = np.clip(draft - 1e-9 * self.height, 1e-9 * self.height, (1 - 1e-9) * self.height)
        return float(self.radius(draft, inside)) if 0 <= draft <= self.height else 0.0

    def solid_inertia(self):
        """(transverse, axial) moments of inertia of the solid hull about its centroid, per unit mass [m^2]."""
        c, volume = self.centroid(), self.volume()
        axial = self.integrate(lambda z, r: np.pi * r**4 / 2) / volume
        transverse = self.integrate(lambda z, r: np.pi * r**4 / 4 + np.pi * r**2 * (z - c) ** 2) / volume
        return float(transverse), float(axial)
