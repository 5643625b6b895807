"""Radiation and diffraction by a hull of revolution from potential flow, at small tilt.

There are five velocities, v = (x_C, y_C, z_C, d_x, d_y)_t: those of C and the horizontal ones of the axis d.  In each
vertical plane those of C and d correspond to surge and pitch.  The generalised forces (F, m) act on the body as the
force F and the torque d x m.  Their power is that of (F, m) on v, and they have no torque about the axis.

    (F, m) = -A_inf v_t - int K(t - s) v(s) ds + sum over the wave components of diffraction

Functions (coefficients, body) -> (force [N], torque about C [N m]).
"""

from typing import Any

from ufl import as_vector, cross, dot

from .buoy import Body
from .kinds import Expr
from .rotation import axis

Load = tuple[Expr | None, Expr | None]


def load(five: Expr, body: Body) -> Load:
    """Force and torque of (F, m)."""
    force, m = as_vector([five[i] for i in range(3)]), as_vector([five[3], five[4], 0.0])
    return force, cross(axis(body.quaternion), m)


def added_mass(at_once: Expr, body: Body) -> Load:
    """-A_inf v_t; at_once: A_inf (5, 5), the added mass at infinite frequency."""
    if body.motion is None:
        return None, None
    d, a = axis(body.quaternion), body.motion.acceleration
    leaning = body.motion.acceleration_at(d) - a
    return load(-at_once * _five(a, leaning), body)


def memory(c: Any, body: Body) -> Load:
    """-c.damping v + c.force, the memory integral discretised over a time step (`model.radiation`)."""
    if body.motion is None:
        return None, None
    v, leaning = body.motion.velocity, cross(body.motion.angular_velocity, axis(body.quaternion))
    return load(c.force - c.damping * _five(v, leaning), body)


def diffraction(c: Any, body: Body) -> Load:
    """c.force + c.slope (x - c.place): diffraction force of the wave components at C, linearised about c.place."""
    if body.motion is None:
        return None, None
    x = as_vector([body.position[i] - c.place[i] for i in range(2)])
    return load(c.force + dot(c.slope, x), body)


def drift(c: Any, body: Body) -> Load:
    """c.force in the horizontal plane, at C: the slowly varying second-order wave drift force."""
    if body.motion is None:
        return None, None
    return as_vector([c.force[0], c.force[1], 0.0]), None


def _five(v: Expr, leaning: Expr) -> Expr:
    return as_vector([v[0], v[1], v[2], leaning[0], leaning[1]])
