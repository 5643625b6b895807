"""Rotation of a rigid body by a quaternion q4 = (q0, q), body frame to world frame (Sect. 2.3.1)."""

import ufl
from ufl import as_matrix, as_vector, cross, dot

from .kinds import Expr


def rotation_matrix(q4: Expr) -> Expr:
    """R(q4) for any |q4| > 0: the quaternion is normalised.

    With q4 = (cos(beta/2), lambda sin(beta/2)) this is the matrix of the paper,
    cos(beta) I + (1 - cos(beta)) lambda lambda^T + sin(beta) S(lambda).
    """
    a, b, c, d = (q4[i] for i in range(4))
    return as_matrix(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    ) / dot(q4, q4)


def axis(q4: Expr) -> Expr:
    """d = R(q4) e3, the slenderness axis in the world frame, from keel to top."""
    return rotation_matrix(q4) * as_vector([0.0, 0.0, 1.0])


def quaternion_product(v4: Expr, u4: Expr) -> Expr:
    """Product v4 o u4 of two quaternions, as defined below Eq. (8)."""
    v0, u0 = v4[0], u4[0]
    v, u = (as_vector([w4[1], w4[2], w4[3]]) for w4 in (v4, u4))
    w = v0 * u + u0 * v + cross(v, u)
    return as_vector([v0 * u0 - dot(v, u), w[0], w[1], w[2]])


def prolong(v: Expr) -> Expr:
    """Q v = (0, v): a vector as a quaternion."""
    return as_vector([ufl.as_ufl(0.0), v[0], v[1], v[2]])


def conjugate(q4: Expr) -> Expr:
    """(q0, -q)."""
    return as_vector([q4[0], -q4[1], -q4[2], -q4[3]])


def apply_inverse_inertia(R: Expr, inertia: Expr, L_C: Expr) -> Expr:
    """I_C^{-1} L_C = R diag(inertia)^{-1} R^T L_C in the world frame; inertia: the body's principal moments."""
    L_body = ufl.transpose(R) * L_C
    return R * as_vector([L_body[i] / inertia[i] for i in range(3)])


def angular_acceleration(R: Expr, inertia: Expr, L_C: Expr, L_C_t: Expr) -> Expr:
    """omega_t = I_C^{-1} (L_C_t - omega x L_C), from L_C = I_C omega with I_C rotating with the body."""
    omega = apply_inverse_inertia(R, inertia, L_C)
    return apply_inverse_inertia(R, inertia, L_C_t - cross(omega, L_C))
