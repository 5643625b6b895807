"""The sea bed, a plane n . x = d or a surface z = b(x, y): a spring with a damper that fades in, and friction with
memory.

Per unstretched metre of a line, or for a body as a whole, with the gap g = n . r - d and <-g> = max(-g, 0):

    p   = max(k <-g> - c min(<-g>/delta, 1) n . r_t, 0)
    f_t = -k_t u min(1, mu p/(k_t |u|)),     u = (I - n n)(r - r_a)

delta is the penetration under its own weight.  A damper that acts fully at first contact makes Newton fail; this one
grows with the penetration.  Friction is a spring from the stick point r_a, which slides when the spring force exceeds
mu p: at the end of each step r_a := r - u min(1, mu p/(k_t |u|)).  At rest it does not creep.
"""

from typing import NamedTuple

from ufl import as_vector, dot, max_value, min_value, sqrt

from .kinds import Expr, Scalar

#: Length below which |u| is smoothed [m]: the spring is linear there anyway.
SMOOTHING_LENGTH = 1e-9


class Contact(NamedTuple):
    """A point on or above the bed and its contact coefficients, per metre of a line or for a whole body."""

    normal: Expr  #: n, upwards
    gap: Expr  #: g [m]
    stiffness: Scalar  #: k [N/m]
    damping: Scalar  #: c [N s/m]
    sag: Scalar  #: delta [m]
    speed: Expr | None = None  #: n . r_t [m/s]; None in statics
    stick: Scalar | None = None  #: k_t [N/m]; None without friction
    displacement: Expr | None = None  #: r - r_a [m]

    @property
    def penetration(self) -> Expr:
        """<-g> [m]."""
        return max_value(-self.gap, 0.0)


def gap(normal: Expr, level: Scalar, x: Expr) -> Expr:
    """g = n . x - d [m]."""
    return dot(normal, x) - level


class Ground(NamedTuple):
    """A bed near the point (x_0, y_0): its height b there, slope and curvature, for a Taylor expansion."""

    x: Expr
    y: Expr
    height: Expr
    slope: tuple[Expr, Expr]  #: b_x, b_y
    curvature: tuple[Expr, Expr, Expr]  #: b_xx, b_xy, b_yy

    def normal_and_gap(self, r: Expr) -> tuple[Expr, Expr]:
        """Upward normal of the bed below r, and the distance (r_z - b)/sqrt(1 + |grad b|^2) [m]."""
        dx, dy = r[0] - self.x, r[1] - self.y
        (b_x, b_y), (b_xx, b_xy, b_yy) = self.slope, self.curvature
        height = self.height + b_x * dx + b_y * dy + 0.5 * (b_xx * dx**2 + b_yy * dy**2) + b_xy * dx * dy
        along, across = b_x + b_xx * dx + b_xy * dy, b_y + b_xy * dx + b_yy * dy
        size = sqrt(1 + along**2 + across**2)
        return as_vector([-along / size, -across / size, 1 / size]), (r[2] - height) / size


def pressure(contact: Contact) -> Expr:
    """p [N]: never negative, because the bed does not pull."""
    spring = contact.stiffness * contact.penetration
    if contact.speed is None:
        return spring
    faded = contact.damping * min_value(contact.penetration / contact.sag, 1.0)
    return max_value(spring - faded * contact.speed, 0.0)


def support(_: None, contact: Contact) -> Expr:
    """p n [N]."""
    return pressure(contact) * contact.normal


def friction(mu: Scalar, contact: Contact) -> Expr:
    """f_t [N]."""
    n, d = contact.normal, contact.displacement
    u = d - dot(n, d) * n
    size = sqrt(dot(u, u) + SMOOTHING_LENGTH**2)
    return -min_value(contact.stick, mu * pressure(contact) / size) * u


def holding(is_sinker: Scalar, contact: Contact) -> Expr:
    """-k <g> n - k_t u [N]: additional force that holds a sinker in place in statics, however large the pull."""
    n, d = contact.normal, contact.displacement
    return -is_sinker * (contact.stiffness * max_value(contact.gap, 0.0) * n + contact.stick * (d - dot(n, d) * n))


# -- energy ------------------------------------------------------------------------------------------------------------


def spring_energy(contact: Contact) -> Expr:
    """1/2 k <-g>^2 [J]."""
    return 0.5 * contact.stiffness * contact.penetration**2


def damping_power(contact: Contact) -> Expr:
    """(p - k <-g>) n . r_t [W], never positive."""
    return (pressure(contact) - contact.stiffness * contact.penetration) * contact.speed
