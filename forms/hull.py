"""The hull as strips along its axis: Archimedes' force and Morison's equation, Eq. (10) integrated along the axis.

The hull is a body of revolution of radius R(zeta), zeta measured from the keel along the unit vector d of the
slenderness axis.  The tangent plane of the free surface cuts a circular segment from the disk at zeta: A_wet is its
area and the loads act at its centroid.  The displaced mass and the restoring moment of the water plane are therefore
correct at any tilt, also upside down, and the hull is turned by the slope of a wave as the isobars are.

Loads along the axis act on faces: end discs, steps, and cones as rows of small steps.
"""

from typing import NamedTuple

from ufl import acos, cross, dot, max_value, min_value, pi, sqrt, zero

from . import morison, rotation
from .kinds import Expr, Scalar
from .sea import Flow, relative

#: Least distance of |c| from 1, where acos(c) has no derivative; the relative change of the wet area is 1e-15.
CLAMP = 1e-10

#: Least angle between a disk and the water plane [rad]: the cut through an upright hull thus extends over a height
#: (2e-7 R), over which the water plane area is spread.  Relative errors of volumes are of the order of its square.
LEAST_TILT = 1e-7

#: A face submerges over this fraction of its radius, or over R sin(tilt) if that is more: otherwise the added mass of
#: an upright disc would jump.
FACE_TILT = 0.05


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
    """A strip of the hull: its position, the undisturbed water on the axis there, and its wet area."""

    lever: Expr  #: from C to the axis [m]
    axis: Expr  #: d
    radius: Expr  #: R [m]
    flow: Flow
    area: Expr  #: A_wet [m^2]
    moment: Expr  #: first moment of the wet area about the axis [m^3]
    motion: BodyMotion | None = None  #: None in statics

    @property
    def wet(self) -> Expr:
        """Wet fraction of the disk."""
        return self.area / (pi * self.radius * self.radius)

    @property
    def relative_velocity(self) -> Expr | None:
        """v_rel = v - v_a; None if neither the body nor the water moves."""
        return relative(self.motion and self.motion.velocity_at(self.lever), self.flow.velocity)

    @property
    def relative_acceleration(self) -> Expr | None:
        """a - a_w; None if both are absent."""
        return relative(self.motion and self.motion.acceleration_at(self.lever), self.flow.acceleration)


class Face(NamedTuple):
    """Wet part of a face normal to the axis: of a ring between the radii r and R, or per metre of a cone."""

    area: Expr  #: pi (R^2 - r^2), or 2 pi R |R'|  [m^2, m^2/m]
    volume: Expr  #: 2/3 pi (R^3 - r^3), or 2 pi R^2 |R'|: half a sphere of water for a disc [m^3, m^3/m]
    inertia: Expr  #: 8/45 (R^5 - r^5), or 8/9 R^4 |R'|: one face of a disc about a diameter [m^5, m^5/m]


def ring(strip: Strip, inner: Scalar) -> Face:
    """The face of a step from the radius `inner` to that of the strip, or an end disc (inner = 0)."""
    R, r, wet = strip.radius, inner, strip.wet
    return Face(
        wet * pi * (R**2 - r**2),
        wet * (2 / 3) * pi * (R**3 - r**3),
        wet * (8 / 45) * (R**5 - r**5),
    )


def cone(strip: Strip, taper: Scalar) -> Face:
    """The face of a cone per metre of axis; taper: |R'|."""
    R, wet = strip.radius, strip.wet * taper
    return Face(wet * 2 * pi * R, wet * 2 * pi * R**2, wet * (8 / 9) * R**4)


def body_motion(R: Expr, mass: Scalar, inertia: Expr, p: Expr, p_t: Expr, L_C: Expr, L_C_t: Expr) -> BodyMotion:
    """Motion of the body from its momenta and their rates."""
    omega = rotation.apply_inverse_inertia(R, inertia, L_C)
    omega_t = rotation.angular_acceleration(R, inertia, L_C, L_C_t)
    return BodyMotion(p / mass, omega, p_t / mass, omega_t)


def wet_section(radius: Expr, d: Expr, x: Expr, flow: Flow, least_tilt: float) -> tuple[Expr, Expr]:
    """Area [m^2] of the wet segment of the disk at x with normal d, and its first moment about x [m^3] (a vector).

    least_tilt: LEAST_TILT, or FACE_TILT for a face.

    The tangent plane of the free surface above x, with the normal n, cuts the disk at the distance c w/R uphill from
    its centre, where w = R |uphill| is the half-extent of the disk across the plane.
    """
    n = flow.normal
    uphill = n - dot(n, d) * d  # in the disk, of length sin(tilt)
    square = radius * radius
    w = radius * sqrt(dot(uphill, uphill) + least_tilt**2)
    c = max_value(min_value(n[2] * flow.depth(x) / w, 1 - CLAMP), -1 + CLAMP)
    chord2 = 1 - c * c
    chord = sqrt(chord2)
    return square * (acos(-c) + c * chord), -(2 / 3) * square * square / w * chord2 * chord * uphill


def full_section(radius: Expr, d: Expr, x: Expr, flow: Flow) -> tuple[Expr, Expr]:
    """`wet_section` of a fully submerged disk."""
    return pi * radius * radius, zero(3)


def across(x: Expr, d: Expr) -> Expr:
    """x without its part along d."""
    return x - dot(x, d) * d


def strip_load(strip: Strip, density: Expr, couple: Expr | None = None) -> tuple[Expr, Expr]:
    """Force and torque about C, per metre of axis, of a force per wet area that acts at the wet segment's centroid.

    couple: additional torque per wet area.  Pressure exerts no torque on a body of revolution about its axis, and
    neither may drag and added mass, which represent it: the torque about the axis is left out.  In a uniform flow the
    strips then add up to Eq. (10)_2 with its resultant in B.
    """
    torque = cross(strip.area * strip.lever + strip.moment, density)
    if couple is not None:
        torque += strip.area * couple
    return strip.area * density, across(torque, strip.axis)


# -- Eq. (10) on strips: functions (coefficient, hull, rho_w, strip) [N per wet area and metre of axis] ---------------
#
# Each returns None if its velocity or acceleration is absent.


def buoyancy(gravity: Expr, rho_w: Scalar, strip: Strip) -> Expr:
    """Archimedes: -rho_w g, which gives F^r and tau^r of Eq. (10)."""
    return -rho_w * gravity


def froude_krylov(_: None, rho_w: Scalar, strip: Strip) -> Expr | None:
    """Pressure of the undisturbed wave, rho_w a_w."""
    return None if strip.flow.acceleration is None else rho_w * strip.flow.acceleration


def froude_krylov_couple(_: None, rho_w: Scalar, strip: Strip) -> Expr | None:
    """Couple of the pressure gradient across the disk: rho_w R^2/4 sum_i e_i x (e_i . grad) a_w, e_1, e_2 in the disk.

    The sum over all three directions is the curl of a_w, which is zero, so it is computed from the term of the axis.
    """
    G = strip.flow.acceleration_gradient
    return None if G is None else -0.25 * rho_w * strip.radius**2 * cross(strip.axis, dot(G, strip.axis))


def added_mass(C_A: Scalar, rho_w: Scalar, strip: Strip) -> Expr | None:
    """rho_w C_A (a_w - a)_n, across the axis."""
    a_rel = strip.relative_acceleration
    return None if a_rel is None else -rho_w * C_A * across(a_rel, strip.axis)


def normal_drag(C_dn: Scalar, rho_w: Scalar, strip: Strip) -> Expr | None:
    """Drag across the axis, on the wetted diameter 2 R A/(pi R^2)."""
    v_rel = strip.relative_velocity
    if v_rel is None:
        return None
    wetted_diameter = 2 / (pi * strip.radius)  # per wet area
    return morison.normal_drag(rho_w, wetted_diameter, C_dn, across(v_rel, strip.axis))


# -- on faces: functions (coefficient, rho_w, strip, face) -> (force [N], torque about C [N m]), absent: None ----------
#
# Forces act along the axis and on it: no torque about C.  For cones both are per metre of axis.


def axial_drag(C: Scalar, rho_w: Scalar, strip: Strip, face: Face) -> tuple[Expr | None, None]:
    """-1/2 C rho_w A |v_rel.d| (v_rel.d) d on the projected area A of a wet face."""
    v_rel = strip.relative_velocity
    if v_rel is None:
        return None, None
    speed = dot(v_rel, strip.axis)
    return -0.5 * C * rho_w * face.area * morison.smooth_abs(speed) * speed * strip.axis, None


def axial_added_mass(C: Scalar, rho_w: Scalar, strip: Strip, face: Face) -> tuple[Expr | None, None]:
    """C rho_w 2 pi int R^2 |dR| (a_w - a).d d: a stepped or tapered end has the added mass of one disc.

    The coefficient refers to half a sphere, rho_w 2/3 pi R^3 (as in MoorDyn); it is 2/pi for one face of a thin disc.
    """
    a_rel = strip.relative_acceleration
    if a_rel is None:
        return None, None
    return -C * rho_w * face.volume * dot(a_rel, strip.axis) * strip.axis, None


def rotational_added_mass(C: Scalar, rho_w: Scalar, strip: Strip, face: Face) -> tuple[None, Expr | None]:
    """-C rho_w 8/45 R^5 times the angular acceleration about a diameter, relative to the water in the disc."""
    own = strip.motion and across(strip.motion.angular_acceleration, strip.axis)
    G = strip.flow.acceleration_gradient
    spin = relative(own, None if G is None else cross(dot(G, strip.axis), strip.axis))
    return None, None if spin is None else -C * rho_w * face.inertia * spin
