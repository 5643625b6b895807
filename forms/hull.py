"""The hull as strips along its axis: Archimedes' force and Morison's equation, Eq. (10) integrated along the axis.

The hull is a body of revolution of radius R(zeta), zeta measured from the keel along the unit vector d of the
slenderness axis.  The local water plane cuts a circular segment from the disk at zeta: A_wet is its area and the
loads act at its centroid.  The displaced mass and the restoring moment of the water plane are then right at any
tilt, upside down too.
"""

from typing import NamedTuple

from ufl import acos, as_vector, cross, dot, max_value, min_value, pi, sqrt

from . import morison, rotation
from .kinds import Expr, Scalar
from .sea import Flow, relative

#: |c| is kept this far from 1, where acos(c) has no derivative; changes the wet area by 1e-15 of itself.
CLAMP = 1e-10


class Hull(NamedTuple):
    """Shape of a hull, UFL scalars."""

    radius: Expr  #: R(zeta) [m]
    softening: Scalar  #: w0 [m], vertical half-extent given to the strip of an upright hull


class BodyMotion(NamedTuple):
    """Rigid motion: velocity and acceleration of C, angular velocity and acceleration (world frame)."""

    velocity: Expr
    angular_velocity: Expr
    acceleration: Expr
    angular_acceleration: Expr

    def velocity_at(self, lever: Expr) -> Expr:
        """v + omega x lever."""
        return self.velocity + cross(self.angular_velocity, lever)

    def acceleration_at(self, lever: Expr) -> Expr:
        """a + omega_t x lever + omega x (omega x lever)."""
        w = self.angular_velocity
        return self.acceleration + cross(self.angular_acceleration, lever) + cross(w, cross(w, lever))


class Strip(NamedTuple):
    """A strip of the hull: lever from C, axis d, undisturbed water there, wet area [m^2] and its first moment [m^3]."""

    lever: Expr
    axis: Expr
    flow: Flow
    area: Expr
    moment: Expr
    motion: BodyMotion | None = None  #: None in statics

    @property
    def relative_velocity(self) -> Expr | None:
        """v_rel = v - v_a; None when neither the body nor the water moves."""
        return relative(self.motion and self.motion.velocity_at(self.lever), self.flow.velocity)

    @property
    def relative_acceleration(self) -> Expr | None:
        """a - a_w; None when neither is there."""
        return relative(self.motion and self.motion.acceleration_at(self.lever), self.flow.acceleration)


def body_motion(R: Expr, mass: Scalar, inertia: Expr, p: Expr, p_t: Expr, L_C: Expr, L_C_t: Expr) -> BodyMotion:
    """Motion of the body from its momenta and their rates."""
    omega = rotation.apply_inverse_inertia(R, inertia, L_C)
    omega_t = rotation.angular_acceleration(R, inertia, L_C, L_C_t)
    return BodyMotion(p / mass, omega, p_t / mass, omega_t)


def axis(q4: Expr) -> Expr:
    """d = R(q4) e3, the slenderness axis in the world frame, from keel to top."""
    return rotation.rotation_matrix(q4) * as_vector([0.0, 0.0, 1.0])


def wet_section(radius: Expr, softening: Scalar, d: Expr, x: Expr, eta: Expr | None) -> tuple[Expr, Expr]:
    """Area [m^2] of the wet segment of the disk at x with normal d, and its first moment about x [m^3] (a vector).

    The disk's vertical half-extent R sin(tilt) is rounded to w = ((R sin(tilt))^8 + w0^8)^(1/8), which keeps
    the displaced mass differentiable when the hull is upright, and is gone when it is not.  Two things keep the
    centre of buoyancy where it belongs for any w0: the factor R sin(tilt)/w in the moment within the disk, from which
    the restoring moment of the water plane (BM) comes, and a moment along the axis that takes back by how much the
    wider transition from wet to dry would raise it (KB).
    """
    e_z = as_vector([0.0, 0.0, 1.0])
    uphill = e_z - d[2] * d  # in the disk, of length sin(tilt)
    square = radius * radius
    extent2 = square * dot(uphill, uphill)
    w = _eighth_root(_fourth_power(extent2) + _fourth_power(softening * softening))
    depth = -x[2] if eta is None else eta - x[2]
    c = max_value(min_value(depth / w, 1 - CLAMP), -1 + CLAMP)
    chord2 = 1 - c * c
    chord = sqrt(chord2)
    area = square * (acos(-c) + c * chord)
    within, along = -(2 / 3) * square * square / w, -(1 / 3) * square * (w * w - extent2) / w
    return area, chord2 * chord * (within * uphill + along * d[2] * d)


def _fourth_power(x: Expr) -> Expr:
    """By products: a power costs as much as the rest of a strip."""
    return (x * x) * (x * x)


def _eighth_root(x: Expr) -> Expr:
    return sqrt(sqrt(sqrt(x)))


def strip_load(strip: Strip, density: Expr) -> tuple[Expr, Expr]:
    """Force and torque about C, per metre of axis, of a force per wet area that acts at the wet segment's centroid.

    In a uniform flow the strips then add up to Eq. (10)_2 with its resultant in B.
    """
    return strip.area * density, cross(strip.area * strip.lever + strip.moment, density)


# -- Eq. (10) on strips: functions (coefficient, hull, rho_w, strip) [N per wet area and metre of axis] ---------------
#
# Each returns None where nothing moves that it feels.


def buoyancy(gravity: Expr, hull: Hull, rho_w: Scalar, strip: Strip) -> Expr:
    """Archimedes: -rho_w g, of which F^r and tau^r of Eq. (10) come."""
    return -rho_w * gravity


def froude_krylov(_: None, hull: Hull, rho_w: Scalar, strip: Strip) -> Expr | None:
    """Pressure of the undisturbed wave, rho_w a_w."""
    return None if strip.flow.acceleration is None else rho_w * strip.flow.acceleration


def added_mass(C_A: Scalar, hull: Hull, rho_w: Scalar, strip: Strip) -> Expr | None:
    """rho_w C_A (a_w - a), in all directions."""
    a_rel = strip.relative_acceleration
    return None if a_rel is None else -rho_w * C_A * a_rel


def normal_drag(C_dn: Scalar, hull: Hull, rho_w: Scalar, strip: Strip) -> Expr | None:
    """Drag across the axis, on the wetted diameter 2 R A/(pi R^2)."""
    v_rel = strip.relative_velocity
    if v_rel is None:
        return None
    wetted_diameter = 2 / (pi * hull.radius)  # per wet area
    return morison.normal_drag(rho_w, wetted_diameter, C_dn, morison.split(v_rel, strip.axis)[0])


# -- on the end discs: functions (coefficient, hull, rho_w, strip) [N], on the axis, hence without torque about C ------


def axial_drag(C: Scalar, hull: Hull, rho_w: Scalar, strip: Strip) -> Expr | None:
    """-1/2 C rho_w A |v_rel.d| (v_rel.d) d of a wet end disc."""
    v_rel = strip.relative_velocity
    if v_rel is None:
        return None
    speed = dot(v_rel, strip.axis)
    return -0.5 * C * rho_w * strip.area * morison.smooth_abs(speed) * speed * strip.axis


def axial_added_mass(C: Scalar, hull: Hull, rho_w: Scalar, strip: Strip) -> Expr | None:
    """Added mass of a wet end disc along the axis, referred to half a sphere, rho_w 2/3 pi R^3 (as MoorDyn's end
    coefficient); 2/pi is the value of one face of a thin disc.
    """
    a_rel = strip.relative_acceleration
    if a_rel is None:
        return None
    return -C * rho_w * (2 / 3) * hull.radius * strip.area * dot(a_rel, strip.axis) * strip.axis
