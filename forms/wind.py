"""Wind on the part of the buoy above the water, Eq. (2)."""

from typing import Any

from ufl import max_value

from .buoy import Body, point_torque
from .kinds import Expr, Scalar
from .rotation import rotation_matrix
from .sea import linear_below

#: Height below which the profile, whose slope at the water is infinite, is replaced by a straight line [m].
SMOOTHING_HEIGHT = 1e-3


def wind_force(z: Expr, direction: Expr, speed_10m: Scalar, C_wind: Scalar, rho_air: Scalar, A_T: Scalar) -> Expr:
    """F_wind = 1/2 C rho_air A_T |v| v with v = v10 (z/10)^(1/7), z the height above the water [N].

    Zero at and below z = 0; exact above one millimetre.
    """
    z0 = SMOOTHING_HEIGHT
    squared_profile = linear_below(z, z0, (max_value(z, z0) / 10) ** (2 / 7))
    return 0.5 * C_wind * rho_air * A_T * speed_10m**2 * squared_profile * direction


def wind_load(c: Any, body: Body) -> tuple[Expr, Expr]:
    """Wind force at the body point c.offset from C, from its height above the water there, and its torque about C.

    c: offset, direction, speed, drag_coefficient, air_density, area.
    """
    x = body.position + rotation_matrix(body.quaternion) * c.offset
    surface = body.flow(x).surface
    height = x[2] if surface is None else x[2] - surface
    force = wind_force(height, c.direction, c.speed, c.drag_coefficient, c.air_density, c.area)
    return force, point_torque(body.quaternion, c.offset, force)
