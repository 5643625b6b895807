"""Closed form of a cable on a plane sea bed: a hanging part at each end and a grounded part in between.

The bed is flat or sloped and rigid.  In the vertical plane of the cable it rises by k = tan(alpha); the hanging parts
are catenaries tangent to it, V = k H there.  Towards the start the tension of the grounded part decreases by

    dT/ds = w (sin(alpha) + mu cos(alpha)),

down to 0, with Coulomb friction mu for a cable laid slack and pulled at its end (Jonkman, *Dynamics Modeling and Loads
Analysis of an Offshore Floating Wind Turbine*, 2007, for the flat bed).  A line across the slope is assumed to be held
sideways.  A cable too long for H > 0 hangs vertically at its ends and lies without tension in between; its position
there is undetermined, and a straight line is assumed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..roots import brentq
from . import catenary
from .catenary import Array, Catenary

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Bed:
    """Plane normal . x = offset, with the unit vector `normal` pointing out of the bed."""

    normal: Array
    offset: float
    friction: float = 0.0

    def height_above(self, point: Array) -> float:
        """Vertical distance of a point from the bed [m]."""
        return float((np.dot(self.normal, point) - self.offset) / self.normal[2])

    def rise(self, along: Array) -> float:
        """tan(alpha) in the horizontal direction `along`."""
        return -float(np.dot(self.normal, along) / self.normal[2])


@dataclass(frozen=True)
class Lying:
    """Grounded part of a cable, from `start` along the unit vector `along`; u: length from its start, arrays.

    T(u) = max(T_end - fall (length - u), 0) [N]; `squeeze` < 1 if the cable is longer than the distance.
    """

    start: Array
    along: Array
    length: float
    EA: float
    T_end: float
    fall: float
    squeeze: float = 1.0

    def tension(self, u: ArrayLike) -> Any:
        """T(u) [N]."""
        return np.maximum(self.T_end - self.fall * (self.length - np.asarray(u, float)), 0.0)

    def stretched(self, u: ArrayLike) -> Any:
        """Stretched length from 0 to u [m]."""
        u = np.asarray(u, float)
        T0, T = self.tension(0.0), self.tension(u)
        # T is linear where it is not 0, and can be 0 towards the start only
        pulled = np.minimum(u, T / self.fall) if self.fall > 0 else u
        return u + pulled * (T0 + T) / 2 / self.EA

    def position(self, u: ArrayLike) -> Any:
        """r(u), shape (n, 3) [m]."""
        return self.start + np.multiply.outer(self.squeeze * self.stretched(u), self.along)


@dataclass(frozen=True)
class OnBed:
    """Cable with a grounded middle part; methods and forces as in Catenary, all take arrays of s."""

    first: Catenary
    lying: Lying
    last: Catenary
    first_length: float
    last_length: float

    @property
    def length_on_bed(self) -> float:
        """Unstretched grounded length [m]."""
        return self.lying.length

    def tension(self, s: ArrayLike) -> Any:
        """T(s) [N]."""
        return np.linalg.norm(self.force(s), axis=-1)

    def force(self, s: ArrayLike) -> Array:
        """Tension as a vector along the line, shape (n, 3) [N]."""
        lying = np.multiply.outer(self.lying.tension(np.asarray(s, float) - self.first_length), self.lying.along)
        return self._by_part(s, self.first.force, lying, self.last.force)

    def position(self, s: ArrayLike) -> Array:
        """r(s), shape (n, 3) [m]."""
        lying = self.lying.position(np.asarray(s, float) - self.first_length)
        return self._by_part(s, self.first.position, lying, self.last.position)

    def _by_part(
        self, s: ArrayLike, first: Callable[[Any], Array], lying: Array, last: Callable[[Any], Array]
    ) -> Array:
        s = np.asarray(s, float)
        a, b = self.first_length, self.first_length + self.lying.length
        on_first, on_last = (s < a)[..., None], (s > b)[..., None]
        last_s = np.clip(s - b, 0.0, None)
        return np.where(on_first, first(np.minimum(s, a)), np.where(on_last, last(last_s), lying))


def between(start: ArrayLike, end: ArrayLike, L: float, w: float, EA: float, bed: Bed) -> Catenary | OnBed:
    """Cable between two points on or above the bed: a Catenary if it hangs free, else OnBed.

    Ends below the bed are taken to be on it.  Raises ValueError for an inextensible cable shorter than the distance.
    """
    free = catenary.between(start, end, L, w, EA)
    if w <= 0:
        return free
    lowest = np.clip((free.H * bed.rise(free.along) - free.V0) / w, 0.0, L)  # where the tangent is parallel to the bed
    ends = free.position(np.array([0.0, L]))
    depth = -bed.height_above(free.position(lowest))
    if depth > max(0.0, *(-bed.height_above(end) for end in ends)) + 1e-14 * L:
        return _Contact(free.start, np.asarray(end, float), free.along, L, w, EA, bed).solve()
    return free


@dataclass(frozen=True)
class _Contact:
    """Solver for H at the end, which determines all lengths; gaps: heights of the ends above the bed."""

    start: Array
    end: Array
    along: Array
    L: float
    w: float
    EA: float
    bed: Bed

    @cached_property
    def k(self) -> float:
        return self.bed.rise(self.along)

    @cached_property
    def gaps(self) -> list[float]:
        return [max(self.bed.height_above(point), 0.0) for point in (self.start, self.end)]

    @cached_property
    def fall(self) -> float:
        return self.w * (self.k + self.bed.friction) / math.hypot(1.0, self.k)

    def solve(self) -> OnBed:
        """The cable that fits the distance between the ends."""
        room = float(np.dot(self.end - self.start, self.along))
        if self.reach(0.0) >= room:
            return self.shape(0.0)
        low = high = math.log(self.w * self.L)
        while self.reach(math.exp(low)) > room:
            low -= 2
        while self.reach(math.exp(high)) < room:
            high += 2
        return self.shape(math.exp(brentq(lambda log_H: self.reach(math.exp(log_H)) - room, low, high, xtol=1e-15)))

    def reach(self, H: float) -> float:
        """Horizontal distance of the ends under the horizontal force H at the end."""
        first, last, H_first = self.parts(H)
        lying = self.lying(H, self.L - first - last)
        flat = float(lying.stretched(lying.length)) / math.hypot(1.0, self.k)
        return _width(H_first, first, -self.k, self.w, self.EA) + flat + _width(H, last, self.k, self.w, self.EA)

    def parts(self, H: float) -> tuple[float, float, float]:
        """Hanging lengths at the start and at the end, and the horizontal force at the start."""
        last = _hanging_length(self.gaps[1], H, self.k, self.w, self.EA)

        def first_at(length: float) -> tuple[float, float]:
            H_first = float(self.lying(H, length).tension(0.0)) / math.hypot(1.0, self.k)
            return _hanging_length(self.gaps[0], H_first, -self.k, self.w, self.EA), H_first

        def spare(length: float) -> float:
            return self.L - first_at(length)[0] - last - length

        longest = max(self.L - last, 0.0)
        if self.gaps[0] == 0.0 or spare(0.0) <= 0.0:
            length = longest if self.gaps[0] == 0.0 else 0.0
        else:
            length = brentq(spare, 0.0, longest, xtol=1e-15 * self.L)
        first, H_first = first_at(length)
        return first, last, H_first

    def lying(self, H: float, length: float, start: Array | None = None, squeeze: float = 1.0) -> Lying:
        """The grounded part, with a length of at least 0."""
        along = (self.along + self.k * UP) / math.hypot(1.0, self.k)
        T_end = H * math.hypot(1.0, self.k)
        return Lying(
            self.start if start is None else start, along, max(length, 0.0), self.EA, T_end, self.fall, squeeze
        )

    def shape(self, H: float) -> OnBed:
        """The whole line under H, fitted to the distance if it is slack."""
        first_length, last_length, H_first = self.parts(H)
        first = Catenary(self.start, self.along, self.w, self.EA, H_first, self.k * H_first - self.w * first_length)
        last = Catenary(self.start, self.along, self.w, self.EA, H, self.k * H)
        feet = first.position(first_length), self.end - (last.position(last_length) - self.start)
        lying = self.lying(H, self.L - first_length - last_length, feet[0])
        distance, natural = float(np.linalg.norm(feet[1] - feet[0])), float(lying.stretched(lying.length))
        squeeze = distance / natural if H == 0 and natural > 0 else 1.0
        lying = self.lying(H, lying.length, feet[0], squeeze)
        last = Catenary(feet[1], self.along, self.w, self.EA, H, self.k * H)
        return OnBed(first, lying, last, first_length, last_length)


def _hanging_length(gap: float, H: float, k: float, w: float, EA: float) -> float:
    """Length of a hanging part that rises tangentially from the bed to `gap` above it."""
    if gap == 0.0:
        return 0.0

    def height(length: float) -> float:
        """z - k x - gap, with H k/EA cancelled on both sides and T - T_0 without cancellation."""
        V0, V = H * k, H * k + w * length
        bent = (V + V0) / (math.hypot(H, V) + math.hypot(H, V0)) * length if length else 0.0
        width = k * H / w * (math.asinh(V / H) - math.asinh(k)) if H and k else 0.0
        return w * length**2 / (2 * EA) + bent - width - gap

    high = gap
    while height(high) < 0:
        high *= 2
    return brentq(height, 0.0, high, xtol=1e-15 * high)


def _width(H: float, length: float, k: float, w: float, EA: float) -> float:
    """Horizontal width of a hanging part."""
    return H * length / EA + H / w * (math.asinh(k + w * length / H) - math.asinh(k)) if H > 0 else 0.0
