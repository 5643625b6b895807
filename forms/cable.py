"""The cable in mixed form, Eq. (11): position r(s, t) [m] and tension T(s, t) [N] over unstretched arc length s.

    rho0 (r_tt, v) + (T/(1+e) r', v') = ((1+e) f, v) + T_bnd . v(L)          (11)_1
    1/2 (|r'|^2/(1+e) - (1+e), q)     = 0                                    (11)_2

with e = T/EA.  For an inextensible cable pass EA = None: no term with e is built.  The forces f are per unit
*stretched* length, Eq. (6).
"""

from typing import NamedTuple

from ufl import dot, inner, max_value, min_value, sqrt

from . import morison, sea
from .kinds import Expr, Scalar
from .sea import Flow, relative


class Kink(NamedTuple):
    """Kink of a table T(e): at T [N] the compliance changes by `change` [1/N], going away from T = 0."""

    T: Scalar
    change: Scalar
    below: bool  #: whether it is at T < 0

    def beyond(self, T: Expr) -> Expr:
        """T beyond the kink."""
        return min_value(T - self.T, 0) if self.below else max_value(T - self.T, 0)


class Cable(NamedTuple):
    """Material of a cable as UFL scalars; None where a property is absent."""

    line_density: Scalar  #: rho0 [kg/m]
    EA: Scalar = None  #: axial stiffness [N]; None: inextensible
    diameter: Scalar = None  #: D [m]
    area: Scalar | None = None  #: A0 [m^2]
    damping: Scalar | None = None  #: Kelvin-Voigt c of T = EA e + c e_t [N s]; elastic cables in motion
    compliance: Scalar | None = None  #: 1/EA [1/N], 0 if inextensible; used instead of EA if it varies
    kinks: tuple[Kink, ...] = ()  #: of a table T(e) with the slope EA at 0; none: Hooke's law

    def grown(self, diameter: Scalar, mass: Scalar) -> "Cable":
        """Cable with marine growth: diameter and mass multiplied by factors (area by diameter^2), stiffness kept."""
        thicker = {"diameter": diameter * self.diameter, "area": diameter**2 * self.area}
        return self._replace(line_density=mass * self.line_density, **thicker)


class Point(NamedTuple):
    """A point of the cable: unit tangent, velocity and acceleration; the latter are None in statics."""

    tangent: Expr
    velocity: Expr | None = None
    acceleration: Expr | None = None


def elastic_tension(cable: Cable, T: Expr, r: Expr | None, r_t: Expr | None) -> Expr:
    """T less the damping tension, T - c e_t; T itself without damping or in statics."""
    if cable.damping is None or r_t is None:
        return T
    return T - cable.damping * strain_rate(r, r_t)


def strain(cable: Cable, T: Expr, r: Expr | None = None, r_t: Expr | None = None) -> Expr | None:
    """Strain e due to the elastic tension: T/EA, Eq. (12), or from a table; None for an inextensible cable."""
    if cable.EA is None and cable.compliance is None:
        return None
    T = elastic_tension(cable, T, r, r_t)
    e = T / cable.EA if cable.compliance is None else T * cable.compliance
    return e + sum(kink.change * kink.beyond(T) for kink in cable.kinks) if cable.kinks else e


def elastic_energy(cable: Cable, e: Expr, T: Expr, r: Expr, r_t: Expr) -> Expr:
    """Integral of the elastic tension over e per unstretched length [J/m]; 1/2 EA e^2 for Hooke's law."""
    if cable.compliance is None and not cable.kinks:
        return 0.5 * cable.EA * e**2
    T = elastic_tension(cable, T, r, r_t)
    if not cable.kinks:
        return 0.5 * e * T
    compliance = 1 / cable.EA if cable.compliance is None else cable.compliance
    return T * e - 0.5 * (compliance * T**2 + sum(kink.change * kink.beyond(T) ** 2 for kink in cable.kinks))


def strain_rate(r: Expr, r_t: Expr) -> Expr:
    """e_t = t . r_t' of e = |r'| - 1 [1/s]."""
    return inner(tangent(r), r_t.dx(0))


def stretched(cable: Cable, e: Expr | None, f: Expr) -> Expr:
    """(1+e) f: a force per stretched length as a force per unstretched length."""
    return f if e is None else (1 + e) * f


def tension_term(r: Expr, T: Expr, e: Expr | None, v: Expr) -> Expr:
    """(T/(1+e) r', v')."""
    along = inner(r.dx(0), v.dx(0))
    return T * along if e is None else T / (1 + e) * along


def strain_equation(r: Expr, e: Expr | None, q: Expr, strain_form: str = "paper") -> Expr:
    """(11)_2, or with strain_form = "energy" 1/2 (|r'|^2/(1+e)^2 - 1, q).

    Both mean |r'| = 1 + e.  The second is the derivative of an energy with respect to T, so the Jacobian is
    symmetric for every pair of elements; the first is the second multiplied by (1+e), symmetric only if T is
    constant on each element.
    """
    stretch2 = dot(r.dx(0), r.dx(0))
    if e is None:
        return 0.5 * (stretch2 - 1) * q
    if strain_form == "energy":
        return 0.5 * (stretch2 / (1 + e) ** 2 - 1) * q
    return 0.5 * (stretch2 / (1 + e) - (1 + e)) * q


def mean_strain_equation(T: Expr, T_mean: Expr, q: Expr) -> Expr:
    """(T_mean - T, q): T_mean is the average of T on each element (the paper's Sect. 3.3.2)."""
    return (T_mean - T) * q


def inertia(cable: Cable, r_tt: Expr, v: Expr) -> Expr:
    """rho0 (r_tt, v)."""
    return cable.line_density * inner(r_tt, v)


def weight_in_water(cable: Cable, gravity: Expr, rho_w: Scalar | None = None) -> Expr:
    """(1+e) f_hg = rho0 (1 - rho_w/rho_c) g per unstretched length [N/m], rho_c = rho0/A0; dry without rho_w."""
    if rho_w is None:
        return cable.line_density * gravity
    return (cable.line_density - rho_w * cable.area) * gravity


def weight(cable: Cable, gravity: Expr, rho_w: Scalar | None, wet: Expr | None) -> list[Expr]:
    """[weight in water], or for a partly wet line [weight in air, -wet rho_w A0 g], as `weight_in_water`."""
    if wet is None:
        return [weight_in_water(cable, gravity, rho_w)]
    return [weight_in_water(cable, gravity), -wet * rho_w * cable.area * gravity]


def wet_part(cable: Cable, flow: Flow, r: Expr, share: Expr) -> Expr:
    """Submerged fraction of the line near a quadrature point that represents the length `share` [m].

    Where the surface cuts the line, it falls from 1 to 0 over twice the height of that length, diameter included.  Over
    half of that, gaps would remain between the quadrature points: this way the error is 3 instead of 25 % of `share`,
    and the force has a derivative wherever the surface is.  In an irregular sea summed at every evaluation, the
    curvature of the surface is unknown and missing from the derivative of that height.
    """
    up = r.dx(0)[2] if flow.slope is None else r.dx(0)[2] - dot(flow.slope, r.dx(0))
    return sea.wet_part(flow.depth(r), sqrt((share * up) ** 2 + (0.5 * cable.diameter) ** 2))


def tangent(r: Expr) -> Expr:
    """t = r'/|r'|."""
    return r.dx(0) / sqrt(dot(r.dx(0), r.dx(0)))


# -- forces of the water, Eq. (6): functions (coefficient, cable, rho_w, flow, point) [N per stretched metre] ----------
#
# `flow` is the undisturbed water at the point (forms.sea.flow).  Each returns None if neither line nor water moves.


def normal_drag(C_dn: Scalar, cable: Cable, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """f_dn."""
    v_rel = relative(point.velocity, flow.velocity)
    if v_rel is None:
        return None
    return morison.normal_drag(rho_w, cable.diameter, C_dn, morison.split(v_rel, point.tangent)[0])


def tangential_drag(C_dt: Scalar, cable: Cable, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """f_dt."""
    v_rel = relative(point.velocity, flow.velocity)
    if v_rel is None:
        return None
    return morison.tangential_drag(rho_w, cable.diameter, C_dt, point.tangent, v_rel)


def added_mass(C_A: Scalar, cable: Cable, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """The added-mass part of f_am: rho_w A C_A (a_w,n - a_n)."""
    a_rel = relative(point.acceleration, flow.acceleration)
    if a_rel is None:
        return None
    return -rho_w * cable.area * C_A * morison.split(a_rel, point.tangent)[0]


def tangential_added_mass(C_At: Scalar, cable: Cable, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """rho_w A C_At (a_w,t - a_t): water carried along by the line, such as that in the gaps of a chain."""
    a_rel = relative(point.acceleration, flow.acceleration)
    if a_rel is None:
        return None
    return -rho_w * cable.area * C_At * morison.split(a_rel, point.tangent)[1]


def normal_froude_krylov(_: None, cable: Cable, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """The rest of f_am, the pressure of the undisturbed wave: rho_w A a_w,n."""
    if flow.acceleration is None:
        return None
    return rho_w * cable.area * morison.split(flow.acceleration, point.tangent)[0]


def tangential_froude_krylov(_: None, cable: Cable, rho_w: Scalar, flow: Flow, point: Point) -> Expr | None:
    """rho_w A (a_w.t) t: absent in the paper, an option of the cable."""
    if flow.acceleration is None:
        return None
    return rho_w * cable.area * morison.split(flow.acceleration, point.tangent)[1]


# -- power dissipated in the material ----------------------------------------------------------------------------------


def damping_power(c: Scalar, r: Expr, r_t: Expr) -> Expr:
    """-c e_t^2 per unstretched length [W/m], dissipated by Kelvin-Voigt damping."""
    return -c * strain_rate(r, r_t) ** 2


def taut_energy(cable: Cable, r: Expr) -> Expr:
    """1/2 EA <|r'| - 1>^2 [J/m], elastic energy of a damped tension-only line, whose strain is not T/EA when slack."""
    return 0.5 * cable.EA * _taut_strain(r) ** 2


def taut_damping_power(cable: Cable, r: Expr, T: Expr, e: Expr, r_t: Expr) -> Expr:
    """The rest of -T/(1+e) r' . r_t' [W/m]: -c e_t^2 of a taut line, EA <|r'| - 1> e_t of a slack one."""
    stretch = sqrt(dot(r.dx(0), r.dx(0)))
    return (cable.EA * _taut_strain(r) - T * stretch / (1 + e)) * strain_rate(r, r_t)


def _taut_strain(r: Expr) -> Expr:
    return max_value(sqrt(dot(r.dx(0), r.dx(0))) - 1, 0)
