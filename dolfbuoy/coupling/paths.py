"""Motions of driven parts between the instants given by the caller, and states that it reads."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[Any]
Numbers = Sequence[float]

#: Largest number accepted as a coordinate [m], and as a load [N, N m].
FARTHEST, LARGEST = 1e9, 1e15
#: Fraction of a step within which two times are equal.
SAME = 1e-9


class BodyState(NamedTuple):
    """Position of C [m], quaternion, velocity of C [m/s] and angular velocity [rad/s] in the world frame."""

    position: Array
    orientation: Array
    velocity: Array
    angular_velocity: Array


class PointState(NamedTuple):
    """Position [m] and velocity [m/s] of a point."""

    position: Array
    velocity: Array


class Wrench(NamedTuple):
    """Force [N] and moment about C [N m], both in the world frame."""

    force: Array
    moment: Array


class Path:
    """Position of a driven end [m] as a function of time over the current step.

    With a velocity at the end of the step it is the cubic Hermite interpolant of positions and velocities at both ends
    (error of order 4 in the step, continuous velocity); without one, the parabola through the last three positions
    (order 3), at first a straight line.  Uses plain numbers, as small arrays cost more.

    function: of time, used instead.
    """

    def __init__(self, t: float, value: Numbers) -> None:
        """Start at rest, as for a long time before t."""
        rest = [0.0] * len(value)
        #: (time, value, rate or None) at the beginnings of the previous and this step, and at its end.
        self.before: tuple[float, Numbers, Any] | None = None
        self.start: tuple[float, Numbers, Any] = (t, value, rest)
        self.end: tuple[float, Numbers, Any] = (t, value, rest)
        self.function: Callable[[float], Any] | None = None
        self._rest = rest
        self._last: tuple[Any, ...] = ()  # values before `go` or `stay`
        self._powers: list[Array] | None = None

    def go(self, end: float, value: Numbers, rate: Numbers | None = None) -> None:
        """Start a step that ends at the time `end` at this value and rate."""
        self._last = self.before, self.start, self.end
        if rate is not None and self.end[2] is None:
            self.end = (*self.end[:2], self._inside(self.end[0])[1])
        self.before, self.start, self.end = self.start, self.end, (end, value, rate)
        self._powers = None

    def target(self, name: str, position: Any, orientation: Any, velocity: Any, spin: Any) -> tuple[Any, ...]:
        """Value and rate (or None) from the caller's data for the end of a step.  Raises InputError."""
        if orientation is not None or spin is not None:
            raise InputError(f"{name!r} is an end of a line: it has a position and a velocity only.")
        return numbers_of("position", position, 3), None if velocity is None else numbers_of("velocity", velocity, 3)

    def follow(self, end: float, target: tuple[Any, ...] | None) -> None:
        """Take the step to the time `end`: to the value of the function, to a `target`, or stay."""
        if self.function is not None:
            target = self._given(self.function(end))
        if target is None:
            self.stay(end)
        else:
            self.go(end, *target)

    def _given(self, place: Any) -> tuple[Any, ...]:
        return place, None

    def stay(self, end: float) -> None:
        """Stay in place until the time `end`."""
        self._last = self.before, self.start, self.end
        value = self.end[1]
        self.before, self.start, self.end = None, (self.end[0], value, self._rest), (end, value, self._rest)
        self._powers = [np.zeros(len(value))]

    def cut(self, t: float) -> None:
        """End the current step, in which a solve failed, at the time t reached."""
        if t > self.start[0]:
            value, rate = self._inside(t)
            self.end = (t, list(value), None if self.end[2] is None else list(rate))
        elif self._last:
            self.before, self.start, self.end = self._last
        self._powers = None

    def at(self, t: float) -> tuple[Numbers, Numbers]:
        """(value, rate) at a time of the step."""
        end, value, rate = self.end
        if abs(t - end) > SAME * (end - self.start[0]):
            return self._inside(t)
        return value, self._inside(end)[1] if rate is None else rate

    def _inside(self, t: float) -> tuple[Any, Any]:
        (begin, y0, v0), (end, y1, v1) = self.start, self.end
        h = end - begin
        if self._powers is None:
            change = np.subtract(y1, y0)
            self._powers = (
                _cubic(change, h * np.array(v0), h * np.array(v1)) if v1 is not None else self._parabola(change)
            )
        s = (t - begin) / h if h else 0.0
        value, rate = np.array(y0), np.zeros(len(y0))
        for k, p in enumerate(self._powers, 1):
            value, rate = value + p * s**k, rate + k * p * s ** (k - 1)
        return value, rate / (h or 1.0)

    def _parabola(self, change: Array) -> list[Array]:
        if self.before is None or self.before[0] == self.start[0]:
            return [change]
        past = (self.start[0] - self.before[0]) / (self.end[0] - self.start[0])
        bend = (np.subtract(self.before[1], self.start[1]) + past * change) / (past + past**2)
        return [change - bend, bend]

    def __call__(self, t: float) -> Any:
        if self.function is not None:
            return self.function(t)
        end, value, _ = self.end
        return value if abs(t - end) <= SAME * (end - self.start[0]) else self._inside(t)[0]


def _cubic(change: Array, v0: Array, v1: Array) -> list[Array]:
    return [v0, 3 * change - 2 * v0 - v1, v0 + v1 - 2 * change]


class Pose(Path):
    """Path of a body: position of C [m] and quaternion; a call returns the argument of `Buoy.moving_state`."""

    def target(self, name: str, position: Any, orientation: Any, velocity: Any, spin: Any) -> tuple[Any, ...]:
        """As for a Path; orientation: a quaternion.  Velocity and spin are in the world frame, or both None."""
        if orientation is None or (velocity is None) != (spin is None):
            raise InputError(f"{name!r} needs position and orientation, and velocity and angular_velocity or none.")
        turn = numbers_of("orientation", orientation, 4)
        if not any(turn):
            raise InputError("orientation: must not be the zero quaternion.")
        place, speed = numbers_of("position", position, 3), numbers_of("velocity", velocity, 3)
        return self._pair(place, turn, speed, numbers_of("angular_velocity", spin, 3))

    def _pair(self, position: Any, orientation: Any, velocity: Any, spin: Any) -> tuple[Any, Any]:
        size = math.hypot(*orientation)
        old = self.end[1][3:]
        size = size if sum(a * b for a, b in zip(orientation, old, strict=True)) >= 0 else -size  # the shorter way
        q4 = [x / size for x in orientation]
        if velocity is None or spin is None:
            return [*position, *q4], None
        return [*position, *q4], [*velocity, *(x / 2 for x in product([0.0, *spin], q4))]

    def _given(self, place: Any) -> tuple[Any, ...]:
        return self._pair(*place)

    def __call__(self, t: float) -> Any:
        """(r_C, q_4, velocity of C, omega in the world frame)."""
        if self.function is not None:
            return tuple(map(np.array, self.function(t)))
        value, rate = self.at(t)
        w, x, y, z = value[3:]
        size = w * w + x * x + y * y + z * z
        spin = [2 * part / size for part in product(rate[3:], [w, -x, -y, -z])[1:]]
        length = math.sqrt(size)
        return np.array(value[:3]), np.array([w, x, y, z]) / length, np.array(rate[:3]), np.array(spin)


class Length(Path):
    """Path of a single number, the unstretched length of a line [m]."""

    def target(self, name: str, position: Any, orientation: Any, velocity: Any, spin: Any) -> tuple[Any, ...]:
        """As for a Path; position and velocity may be plain numbers."""
        if orientation is not None or spin is not None:
            raise InputError(f"{name!r} is a length: it has a position and a velocity only.")
        (place,) = numbers_of("position", np.ravel(position), 1)
        if place <= 0:
            raise InputError(f"position = {place}: must be a length > 0 of {name}.")
        return [place], None if velocity is None else numbers_of("velocity", np.ravel(velocity), 1)

    def _given(self, place: Any) -> tuple[Any, ...]:
        return np.ravel(place), None


def product(p: Numbers, q: Numbers) -> list[float]:
    """Quaternion product p o q."""
    (a, b, c, d), (w, x, y, z) = p, q
    return [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]


def numbers_of(key: str, value: Any, count: int, most: float = FARTHEST) -> Any:
    """A caller's numbers as a list; None stays None.  Raises InputError."""
    if value is None:
        return None
    try:
        found = [*map(float, value)]
    except (TypeError, ValueError):
        found = []
    if len(found) != count or (not math.hypot(*found) <= most and not all(abs(x) <= most for x in found)):
        raise InputError(f"{key} = {value}: must be {count} numbers of {most:g} at most.")
    return found
