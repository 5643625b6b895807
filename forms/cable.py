"""The cable in mixed form, Eq. (11): position r(s, t) [m] and tension T(s, t) [N] over unstretched arc length s.

    rho0 (r_tt, v) + (T/(1+e) r', v') = ((1+e) f, v) + T_bnd . v(L)          (11)_1
    1/2 (|r'|^2/(1+e) - (1+e), q)     = 0                                    (11)_2

with e = T/EA.  An inextensible cable has no e at all: pass EA = None and none of its terms is built.  The
forces f are per unit *stretched* length, Eq. (6).
"""

from typing import NamedTuple

from ufl import dot, inner, sqrt

from . import morison


class Cable(NamedTuple):
    """Material of a cable, UFL scalars; None for what is absent."""

    line_density: object  #: rho0 [kg/m]
    EA: object = None  #: axial stiffness [N]; None: inextensible
    diameter: object = None  #: D [m]
    area: object = None  #: A0 [m^2]
    damping: object = None  #: Kelvin-Voigt c of T = EA e + c e_t [N s]; elastic cables in motion


class Point(NamedTuple):
    """A point of the cable: unit tangent, velocity and acceleration; the latter are None in statics."""

    tangent: object
    velocity: object = None
    acceleration: object = None


def strain(cable, T, r=None, r_t=None):
    """e = T/EA, Eq. (12), or with damping and a velocity (T - c e_t)/EA; None for an inextensible cable."""
    if cable.EA is None:
        return None
    if cable.damping is None or r_t is None:
        return T / cable.EA
    return (T - cable.damping * strain_rate(r, r_t)) / cable.EA


def strain_rate(r, r_t):
    """e_t = t . r_t' of e = |r'| - 1 [1/s]."""
    return inner(tangent(r), r_t.dx(0))


def stretched(cable, e, f):
    """(1+e) f: a force per stretched length as a force per unstretched length."""
    return f if e is None else (1 + e) * f


def tension_term(r, T, e, v):
    """(T/(1+e) r', v')."""
    along = inner(r.dx(0), v.dx(0))
    return T * along if e is None else T / (1 + e) * along


def strain_equation(r, e, q, strain_form="paper"):
    """(11)_2, or with strain_form = "energy" 1/2 (|r'|^2/(1+e)^2 - 1, q).

    Both hold where |r'| = 1 + e.  The second is the derivative of an energy with respect to T, so that the
    Jacobian is symmetric for every pair of elements; the first is the second weighted by (1+e), symmetric for
    constant T on each element only.
    """
    stretch2 = dot(r.dx(0), r.dx(0))
    if e is None:
        return 0.5 * (stretch2 - 1) * q
    if strain_form == "energy":
        return 0.5 * (stretch2 / (1 + e) ** 2 - 1) * q
    return 0.5 * (stretch2 / (1 + e) - (1 + e)) * q


def mean_strain_equation(T, T_mean, q):
    """(T_mean - T, q): T_mean is the average of T on each element (the paper's Sect. 3.3.2)."""
    return (T_mean - T) * q


def inertia(cable, r_tt, v):
    """rho0 (r_tt, v)."""
    return cable.line_density * inner(r_tt, v)


def weight_in_water(cable, gravity, rho_w=None):
    """(1+e) f_hg = rho0 (1 - rho_w/rho_c) g per unstretched length [N/m], rho_c = rho0/A0; dry without rho_w."""
    if rho_w is None:
        return cable.line_density * gravity
    return (cable.line_density - rho_w * cable.area) * gravity


def tangent(r):
    """t = r'/|r'|."""
    return r.dx(0) / sqrt(dot(r.dx(0), r.dx(0)))


# -- forces of the water, Eq. (6): functions (coefficient, cable, rho_w, flow, point) [N per stretched metre] ----------
#
# `flow` is the undisturbed water at the point (forms.sea.flow).  Each returns None where nothing moves that it feels.


def relative_velocity(flow, velocity):
    """v_rel = v - v_a; None when neither the cable nor the water moves."""
    if flow.velocity is None:
        return velocity
    return -flow.velocity if velocity is None else velocity - flow.velocity


def normal_drag(C_dn, cable, rho_w, flow, point):
    """f_dn."""
    v_rel = relative_velocity(flow, point.velocity)
    if v_rel is None:
        return None
    return morison.normal_drag(rho_w, cable.diameter, C_dn, morison.split(v_rel, point.tangent)[0])


def tangential_drag(C_dt, cable, rho_w, flow, point):
    """f_dt."""
    v_rel = relative_velocity(flow, point.velocity)
    if v_rel is None:
        return None
    return morison.tangential_drag(rho_w, cable.diameter, C_dt, point.tangent, v_rel)


def added_mass(C_A, cable, rho_w, flow, point):
    """The part of f_am that the cable's own inertia in the water makes: rho_w A C_A (a_w,n - a_n)."""
    a_rel = relative_acceleration(flow, point.acceleration)
    if a_rel is None:
        return None
    return -rho_w * cable.area * C_A * morison.split(a_rel, point.tangent)[0]


def normal_froude_krylov(_, cable, rho_w, flow, point):
    """The rest of f_am, the pressure of the undisturbed wave: rho_w A a_w,n."""
    if flow.acceleration is None:
        return None
    return rho_w * cable.area * morison.split(flow.acceleration, point.tangent)[0]


def tangential_froude_krylov(_, cable, rho_w, flow, point):
    """rho_w A (a_w.t) t: absent in the paper, a choice of the cable."""
    if flow.acceleration is None:
        return None
    return rho_w * cable.area * morison.split(flow.acceleration, point.tangent)[1]


def relative_acceleration(flow, acceleration):
    """a - a_w; None when neither is there."""
    if flow.acceleration is None:
        return acceleration
    return -flow.acceleration if acceleration is None else acceleration - flow.acceleration


# -- power that stays in the material ----------------------------------------------------------------------------------


def damping_power(c, r, r_t):
    """-c e_t^2 per unstretched length [W/m], what Kelvin-Voigt damping takes."""
    return -c * strain_rate(r, r_t) ** 2
