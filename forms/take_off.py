"""A power take-off, a spring or a damper between two points: a tension along the line from one to the other.

    T = T_0 + k (l - l_0) + c l_t + c_2 |l_t| l_t + F l_t/sqrt(l_t^2 + v_0^2) + k_s (<l - l_max> - <l_min - l>)

with the distance l of the points, its rate l_t and <x> = max(x, 0).  What the terms with l_t take is the power that is
absorbed.
"""

from typing import Any, NamedTuple

from ufl import dot, max_value, sqrt

from .kinds import Expr, Scalar

#: Square of a distance that is nothing [m^2]: two points that meet have no direction.
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


# -- tensions: functions (coefficients, stretch) [N], None where nothing moves -----------------------------------------


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
    """c_2 |l_t| l_t, written as sqrt(l_t^2) l_t: with a derivative where nothing moves."""
    return None if s.rate is None else coefficient * sqrt(s.rate**2 + NOTHING) * s.rate


def friction(c: Any, s: Stretch) -> Expr | None:
    """F l_t/sqrt(l_t^2 + v_0^2): Coulomb's, smooth where the direction turns."""
    return None if s.rate is None else c.force * s.rate / sqrt(s.rate**2 + c.speed**2)


# -- energies of the tensions that store: functions (coefficients, stretch) [J] ---------------------------------------


def pretension_energy(T_0: Scalar, s: Stretch) -> Expr:
    """T_0 l."""
    return T_0 * s.length


def spring_energy(c: Any, s: Stretch) -> Expr:
    """1/2 k (l - l_0)^2."""
    return c.stiffness * (s.length - c.length) ** 2 / 2


def stops_energy(c: Any, s: Stretch) -> Expr:
    """1/2 k_s (<l - l_max>^2 + <l_min - l>^2)."""
    return c.stiffness * (max_value(s.length - c.longest, 0.0) ** 2 + max_value(c.shortest - s.length, 0.0) ** 2) / 2
