"""The buoy as a rigid body: Euler's equations (8) and the static equilibrium they reduce to."""

from collections.abc import Callable
from typing import Any, NamedTuple

from ufl import as_vector, cross, dot, inner

from .hull import BodyMotion
from .kinds import Expr, Scalar
from .rotation import apply_inverse_inertia, axis, conjugate, prolong, quaternion_product, rotation_matrix
from .sea import Flow


class Body(NamedTuple):
    """Position and motion of the body, for loads at its points."""

    position: Expr  #: r_C
    quaternion: Expr  #: q_4
    flow: Callable[[Expr], Flow]  #: x -> undisturbed water there
    motion: "BodyMotion | None" = None  #: None in statics


def translation(r_C_t: Expr, p: Expr, mass: Scalar, test: Expr) -> Expr:
    """(8)_1: r_C_t = p/M_b."""
    return inner(r_C_t - p / mass, test)


def linear_momentum(p_t: Expr, force: Expr, test: Expr) -> Expr:
    """(8)_2: p_t = F, where F is the sum of the point forces; those of the strips are added on the axis."""
    return inner(p_t - force, test)


def orientation(q4_t: Expr, q4: Expr, L_C: Expr, inertia: Expr, test: Expr) -> Expr:
    """(8)_3: q4_t = 1/2 Q(I_C^{-1} L_C) o q4."""
    omega = apply_inverse_inertia(rotation_matrix(q4), inertia, L_C)
    return inner(q4_t - 0.5 * quaternion_product(prolong(omega), q4), test)


def angular_momentum(L_C_t: Expr, torque: Expr, test: Expr) -> Expr:
    """(8)_4: L_C_t = tau_C."""
    return inner(L_C_t - torque, test)


def spin_correction(q4: Expr, L_C: Expr, L_C_t: Expr, spin_t: Expr, inertia: Expr) -> Expr:
    """[(L_C . d)_t - L_C,t . d - L_C . (omega x d)] d: zero exactly, but not when discretised in time.

    Added to (8)_4, it makes the scheme integrate L_C . d itself, which then is constant if no torque acts about the
    axis of a body of revolution.  Without it a buoy that heaves and pitches begins to spin, faster with longer steps.
    """
    d, omega = axis(q4), apply_inverse_inertia(rotation_matrix(q4), inertia, L_C)
    return (spin_t - dot(L_C_t, d) - dot(L_C, cross(omega, d))) * d


def spin(q4: Expr, L_C: Expr) -> Expr:
    """L_C . d, the angular momentum about the axis."""
    return dot(L_C, axis(q4))


def point_torque(q4: Expr, body_offset: Expr, force: Expr) -> Expr:
    """(R(q4) x0) x F: torque about C of a force at the body point x0 from C.

    The lever is computed from the body offset, never as r_O - r_C: FFCx 0.5 cannot compile the derivative of the
    latter, which cancels to a literal.
    """
    return cross(rotation_matrix(q4) * body_offset, force)


# -- loads at points: functions (coefficients, body) -> (force [N], torque about C [N m]), None if absent --------------


def external_force(c: Any, body: Body) -> tuple[Expr, Expr | None]:
    """A constant force c.force at the body point c.offset from C (None: at C)."""
    return c.force, None if c.offset is None else point_torque(body.quaternion, c.offset, c.force)


def rotational_damping(coefficient: Scalar, body: Body) -> tuple[None, Expr | None]:
    """-c (omega . d) d: linear damping of the rotation about the axis d."""
    if body.motion is None:
        return None, None
    d = axis(body.quaternion)
    return None, -coefficient * dot(body.motion.angular_velocity, d) * d


def wave_damping(c: Any, body: Body) -> tuple[Expr | None, Expr | None]:
    """-c.heave v_z e_z at C and -c.pitch times the rotation across the axis, both relative to the surface above C.

    Radiation damping of a floating hull.  It is relative, because a small body that follows the wave radiates none.
    """
    if body.motion is None:
        return None, None
    d, e_z = axis(body.quaternion), as_vector([0.0, 0.0, 1.0])
    heave, spin = body.motion.velocity[2], body.motion.angular_velocity
    above = body.flow(body.position)
    if above.elevation is not None:
        surface = body.flow(as_vector([body.position[0], body.position[1], above.surface]))
        heave -= surface.velocity[2]
        spin -= cross(dot(surface.velocity_gradient, e_z), e_z)  # of the tangent plane
    return -c.heave * heave * e_z, -c.pitch * (spin - dot(spin, d) * d)


def turn(q4: Expr, q4_ref: Expr) -> Expr:
    """Rotation vector from q4_ref to q4 for small angles, 2 vec(q4 o conj(q4_ref))/|q4_ref|^2 (world frame)."""
    delta = quaternion_product(q4, conjugate(q4_ref))
    return 2 / dot(q4_ref, q4_ref) * as_vector([delta[1], delta[2], delta[3]])


def held_horizontally(r_C: Expr, r_ref: Expr, stiffness: Scalar, test: Expr) -> Expr:
    """Unloaded horizontal spring that keeps C of an unmoored buoy at its initial x and y, otherwise undetermined."""
    return stiffness * ((r_C[0] - r_ref[0]) * test[0] + (r_C[1] - r_ref[1]) * test[1])


def equilibrium(
    r_C: Expr,
    q4: Expr,
    force: Expr,
    torque: Expr,
    reference: tuple[Expr, Expr],
    mass: Scalar,
    inertia_scale: Scalar,
    relaxation: Scalar,
    gauge: Scalar,
    tests: tuple[Expr, Expr, Expr],
) -> Expr:
    """F = 0, tau_C = 0, |q4| = 1 for the pose (r_C, q4), with pseudo-inertia for continuation.

    The loads do not determine the rotation about the axis, and their torque about it is identically zero: `gauge`
    (a stiffness [N m]) replaces this one equation by zero rotation about the axis relative to the reference.
    With `relaxation` > 0 [1/s^2] the terms M (r_C - r_C*) and I (turn) lead from the reference pose (r_C*, q4*)
    towards a stable equilibrium; they vanish at 0.
    """
    r_ref, q_ref = reference
    test_force, test_norm, test_torque = tests
    angle = turn(q4, q_ref)
    d = axis(q4)
    balance = inner(relaxation * mass * (r_C - r_ref) - force, test_force)
    rotation = inner(relaxation * inertia_scale * angle + gauge * dot(angle, d) * d - torque, test_torque)
    return balance + rotation + inner(dot(q4, q4) - 1, test_norm)
