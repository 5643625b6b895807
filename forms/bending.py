"""Bending of a line: the moment vector m(s, t) = EI t' [N m] as a third field, in the space of r.

With t = r'/|r'|, primes being derivatives in *unstretched* s, (11)_1 gains the shear force and m has its own equation:

    - (P m'/|r'|, v')                                      P = I - t t
    - (E0/EI m, p) - (E0 t, p') + E0 [t_b . p]_0^L = 0

The line is a Kirchhoff rod, straight when unloaded, with equal stiffness in all directions and no torsion; the bending
moment is t x m, the curvature |m|/EI.  Both equations follow from one functional (Hellinger and Reissner), so T is
still the axial tension.  E0 is one typical stiffness for the whole line: a stiffness varying from cell to cell would
lose the jumps of t in (t, p').  At a pinned end m = 0; at an end with a given direction t_b, m is free.  A material
with damping, m = EI (t' + beta t'_t), has t + beta t_t and t_b + beta t_b,t in place of t and t_b.

With m of degree 2, `blended_energy` is also subtracted from the functional.  Linear waves gain two orders of accuracy
if (m, p) is a blend of Gauss and Lobatto quadrature, whose errors have opposite signs: this adds h^4/720 (m'', p'')
(Ainsworth and Wajid 2010; Deng, Puzyrev and Calo 2019).  In a strongly bent line the error of m'' along it counts,
r'.m'' = -3 EI k k' with the curvature k, as 13 EI (k k')^2 against T k'^2 in that of the nodes: hence the blend along
the line.  Across the line it would double the error of the moment at a slightly bent clamp.
"""

from ufl import cross, dot, inner, sqrt

from .cable import tangent
from .kinds import Expr, Scalar


def shear(r: Expr, m: Expr) -> Expr:
    """P m'/|r'|: minus the force across the line [N]."""
    t = tangent(r)
    return (m.dx(0) - inner(m.dx(0), t) * t) / sqrt(dot(r.dx(0), r.dx(0)))


def shear_term(r: Expr, m: Expr, v: Expr) -> Expr:
    """- (P m'/|r'|, v')."""
    return -inner(shear(r, m), v.dx(0))


def turning(r: Expr, r_t: Expr) -> Expr:
    """t_t = P r_t'/|r'|: rate of change of the direction [1/s]."""
    return shear(r, r_t)


def curvature_equation(t: Expr, m: Expr, EI: Scalar, E0: Scalar, p: Expr, share: Scalar = 1.0) -> Expr:
    """- (E0/EI m, p) - (E0 t, p'); share: fraction of the curvature applied, below 1 in statics by continuation."""
    return -E0 * (inner(m, p) / EI + share * inner(t, p.dx(0)))


def blended_energy(r: Expr, m: Expr, EI: Scalar, h: Expr) -> Expr:
    """h^4/720 (r'.m'')^2/2 EI per unstretched length [J/m], in elements of length h."""
    return h**4 / 1440 * inner(r.dx(0), _second(m)) ** 2 / EI


def blended_terms(r: Expr, m: Expr, EI: Scalar, h: Expr, E0: Scalar, v: Expr, p: Expr) -> Expr:
    """Minus the derivatives of `blended_energy` with respect to r and m: both are needed for an exact moment balance;
    they vanish for constant p, so the rotation of the direction is exact too."""
    part = h**4 / 720 * inner(r.dx(0), _second(m)) / EI
    return -part * (inner(_second(m), v.dx(0)) + E0 * inner(r.dx(0), _second(p)))


def _second(f: Expr) -> Expr:
    return f.dx(0).dx(0)


def end_direction(t_b: Expr, E0: Scalar, p: Expr, end: int) -> Expr:
    """E0 [t_b . p] at s = 0 (end 0) or s = L (end 1)."""
    return (2 * end - 1) * E0 * inner(t_b, p)


def direction(t_0: Expr, m: Expr, k: Scalar | None, end: int) -> Expr:
    """Direction t_b of an end clamped at t_0, or turned towards t_0 by a spring k [N m/rad]: |m| = k sin(angle between
    them).  Its length is that of t_0, which differs from 1 if damping is included."""
    if k is None:
        return t_0
    turned = t_0 + (1 - 2 * end) * m / k
    return turned * sqrt(inner(t_0, t_0) / inner(turned, turned))


def end_torque(m: Expr, t_b: Expr, end: int) -> Expr:
    """Torque of the line's end at s = 0 (end 0) or s = L (end 1) on its support: -m x t_b or m x t_b [N m]."""
    return (2 * end - 1) * cross(m, t_b)


def spring_energy(t_0: Expr, m: Expr, k: Scalar, end: int) -> Expr:
    """k (1 - cos(angle between the direction of an end and its spring's rest direction t_0)) [J]."""
    return k * (1 - inner(t_0, direction(t_0, m, k, end)))


def bending_energy(m: Expr, EI: Scalar) -> Expr:
    """1/2 |m|^2/EI per unstretched length [J/m]."""
    return 0.5 * inner(m, m) / EI


def elastic_moment(m: Expr, EI: Scalar, beta: Scalar, r: Expr, r_t: Expr) -> Expr:
    """m without its damping part: EI t' [N m]."""
    return m - EI * beta * turning(r, r_t).dx(0)


def damping_power(c: Scalar, r: Expr, r_t: Expr) -> Expr:
    """-c |t'_t|^2 per unstretched length [W/m], with c = EI beta."""
    rate = turning(r, r_t).dx(0)
    return -c * inner(rate, rate)
