"""A power take-off, spring or damper between two points: a tension along the line between them.

    T = T_0 + k (l - l_0) + c l_t + c_2 |l_t| l_t + F l_t/sqrt(l_t^2 + v_0^2) + k_s (<l - l_max> - <l_min - l>)

with the distance l of the points, its rate l_t and <x> = max(x, 0).  The absorbed power is that of the terms with l_t.
"""

from typing import Any, NamedTuple

from ufl import dot, max_value, sqrt

from .kinds import Expr, Scalar

#: Square of a negligible distance [m^2]: coincident points have no direction.
NOTHING = 1e-24


class Stretch(NamedTuple):
    """Unit vector from the first point to the second, their distance l [m] and its rate l_t [m/s], None at rest."""

    direction: Expr
    length: Expr
    rate: Expr | None


def stretch(first: Expr, second: Expr, first_t: Expr | None = None, second_t: Expr | None = None) -> Stretch:
    """Stretch between two points with their velocities."""
    way = second - first
    length = sqrt(dot(way, way) + NOTHING)
    rate = None if first_t is None or second_t is None else dot(way, second_t - first_t) / length
    return Stretch(way / length, length, rate)


# -- tensions: functions (coefficients, stretch) [N], None in statics --------------------------------------------------


def pretension(T_0: Scalar, s: Stretch) -> Expr:
    """T_0, whatever the length."""
    return T_0


def spring(c: Any, s: Stretch) -> Expr:
    """k (l - l_0)."""
    return c.stiffness * (s.length - c.length)


def stops(c: Any, s: Stretch) -> Expr:
    """k_s (<l - l_max> - <l_min - l>)."""
    return c.stiffness * (max_value(s.length - c.longest, 0.0) - max_value(c.shortest - s.length, 0.0))


def damper(coefficient: Scalar, s: Stretch) -> Expr | None:
    """c l_t."""
    return None if s.rate is None else coefficient * s.rate


def quadratic_damper(coefficient: Scalar, s: Stretch) -> Expr | None:
    """c_2 |l_t| l_t, written with a smoothed sqrt(l_t^2) to have a derivative at l_t = 0."""
    return None if s.rate is None else coefficient * sqrt(s.rate**2 + NOTHING) * s.rate


def friction(c: Any, s: Stretch) -> Expr | None:
    """F l_t/sqrt(l_t^2 + v_0^2): Coulomb friction, smoothed at reversal."""
    return None if s.rate is None else c.force * s.rate / sqrt(s.rate**2 + c.speed**2)


# -- energies of the conservative tensions: functions (coefficients, stretch) [J] --------------------------------------


def pretension_energy(T_0: Scalar, s: Stretch) -> Expr:
    """T_0 l."""
    return T_0 * s.length


def spring_energy(c: Any, s: Stretch) -> Expr:
    """1/2 k (l - l_0)^2."""
    return c.stiffness * (s.length - c.length) ** 2 / 2


def stops_energy(c: Any, s: Stretch) -> Expr:
    """1/2 k_s (<l - l_max>^2 + <l_min - l>^2)."""
    return c.stiffness * (max_value(s.length - c.longest, 0.0) ** 2 + max_value(c.shortest - s.length, 0.0) ** 2) / 2
