"""A body at a joint of lines, a clump or a float: a point with mass m [kg] and volume V [m^3].

    m r_tt = (m - rho_w V) g + 1/2 rho_w C_D A |U - r_t| (U - r_t) + rho_w V [(1 + C_A) a_w - C_A r_tt] + lines' forces

with the velocity U and the acceleration a_w of the undisturbed water at the point.
"""

from typing import NamedTuple

from ufl import max_value, pi

from . import sea
from .kinds import Expr, Scalar
from .morison import smooth_norm
from .sea import Flow, relative

#: Least volume assumed where a body leaves the water [m^3].
LEAST_VOLUME = 1e-9


class JointBody(NamedTuple):
    """Mass m [kg] and volume V [m^3]."""

    mass: Scalar
    volume: Scalar


class Point(NamedTuple):
    """Velocity and acceleration; None in statics."""

    velocity: Expr | None = None
    acceleration: Expr | None = None


def weight_in_water(body: JointBody, gravity: Expr, rho_w: Scalar | None = None) -> Expr:
    """(m - rho_w V) g [N]; dry without rho_w."""
    return body.mass * gravity if rho_w is None else (body.mass - rho_w * body.volume) * gravity


def weight(body: JointBody, gravity: Expr, rho_w: Scalar | None, wet: Expr | None) -> list[Expr]:
    """[weight in water], or for a partly wet body [weight in air, -wet rho_w V g], as `weight_in_water`."""
    if wet is None:
        return [weight_in_water(body, gravity, rho_w)]
    return [weight_in_water(body, gravity), -wet * rho_w * body.volume * gravity]


def wet_part(body: JointBody, flow: Flow, r: Expr) -> Expr:
    """Submerged fraction of a body, taken as a ball of its volume."""
    return sea.wet_part(flow.depth(r), (0.75 / pi * max_value(body.volume, LEAST_VOLUME)) ** (1 / 3))


# -- forces of the water: functions (coefficient, body, rho_w, flow, point) [N], None if neither body nor water moves --


def drag(C_A: Scalar, body: JointBody, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """1/2 rho_w C_D A |U - r_t| (U - r_t); the coefficient is C_D A [m^2]."""
    v_rel = relative(point.velocity, flow.velocity)
    return None if v_rel is None else -0.5 * rho_w * C_A * smooth_norm(v_rel) * v_rel


def added_mass(C_A: Scalar, body: JointBody, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """rho_w V C_A (a_w - r_tt)."""
    a_rel = relative(point.acceleration, flow.acceleration)
    return None if a_rel is None else -rho_w * body.volume * C_A * a_rel


def froude_krylov(_: None, body: JointBody, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """rho_w V a_w."""
    return None if flow.acceleration is None else rho_w * body.volume * flow.acceleration
