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
from .sea import Flow

#: |c| is kept this far from 1, where acos(c) has no derivative; changes the wet area by 1e-15 of itself.
CLAMP = 1e-10


class Hull(NamedTuple):
    """Properties of a hull, UFL scalars; None for what is absent."""

    radius: Expr  #: R(zeta) [m]
    softening: Scalar  #: w0 [m], vertical half-extent given to the strip of an upright hull
    added_mass: Scalar | None = None  #: C_A = C_M - 1, all directions, of the displaced mass
    normal_drag: Scalar | None = None  #: C_dn, transverse
    axial_added_mass: Scalar | None = None  #: of the end discs, referred to rho 2/3 pi R^3
    axial_drag: Scalar | None = None  #: of the end discs


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


def hydrostatics(rho_w: Scalar, gravity: Expr, area: Expr, moment: Expr, lever: Expr) -> tuple[Expr, Expr]:
    """Archimedes' force of a strip and its torque about C, per metre of axis: F^r and tau^r of Eq. (10)."""
    lift = -rho_w * gravity
    return area * lift, cross(area * lever + moment, lift)


def strip_loads(
    hull: Hull,
    rho_w: Scalar,
    area: Expr,
    moment: Expr,
    lever: Expr,
    d: Expr,
    flow: Flow,
    motion: BodyMotion | None,
) -> tuple[Expr | None, Expr | None]:
    """F^hyd and tau_C^hyd of a strip, per metre of axis, Eq. (10)_2; (None, None) if nothing is called for.

    Inertia acts on the wet area in all directions, drag on the wetted diameter across the axis; both act at the
    centroid of the wet segment, so that in a uniform flow the strips add up to Eq. (10) with its resultant in B.
    """
    v_rel, a = relative_velocity(flow, motion, lever), None if motion is None else motion.acceleration_at(lever)
    density = None  # force per wet area
    inertia = morison.inertia(rho_w, 1.0, hull.added_mass, a, flow.acceleration)
    if inertia is not None:
        density = inertia
    if hull.normal_drag is not None and v_rel is not None:
        v_n, _ = morison.split(v_rel, d)
        wetted_diameter = 2 / (pi * hull.radius)  # per wet area: 2 R A/(pi R^2)
        drag = morison.normal_drag(rho_w, wetted_diameter, hull.normal_drag, v_n)
        density = drag if density is None else density + drag
    if density is None:
        return None, None
    return area * density, cross(area * lever + moment, density)


def end_disc_force(
    hull: Hull, rho_w: Scalar, area: Expr, lever: Expr, d: Expr, flow: Flow, motion: BodyMotion | None
) -> Expr | None:
    """Axial drag and added mass of a wet end disc [N], on the axis, hence without torque about C; None if absent.

    The added mass is referred to half a sphere, rho_w 2/3 pi R^3 (as MoorDyn's end coefficient); 2/pi is the
    value of one face of a thin disc.
    """
    force = None
    v_rel = relative_velocity(flow, motion, lever)
    if hull.axial_drag is not None and v_rel is not None:
        speed = dot(v_rel, d)
        force = -0.5 * hull.axial_drag * rho_w * area * morison.smooth_abs(speed) * speed * d
    if hull.axial_added_mass is not None:
        a_rel = None if motion is None else motion.acceleration_at(lever)
        if flow.acceleration is not None:
            a_rel = -flow.acceleration if a_rel is None else a_rel - flow.acceleration
        if a_rel is not None:
            added = -hull.axial_added_mass * rho_w * (2 / 3) * hull.radius * area * dot(a_rel, d) * d
            force = added if force is None else force + added
    return force


def relative_velocity(flow: Flow, motion: BodyMotion | None, lever: Expr) -> Expr | None:
    """v_rel = v - v_a at a strip; None when neither the body nor the water moves."""
    if motion is None:
        return None if flow.velocity is None else -flow.velocity
    v = motion.velocity_at(lever)
    return v if flow.velocity is None else v - flow.velocity
