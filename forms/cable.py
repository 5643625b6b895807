"""The cable in mixed form, Eq. (11): position r(s, t) [m] and tension T(s, t) [N] over unstretched arc length s.

    rho0 (r_tt, v) + (T/(1+e) r', v') = ((1+e) f, v) + T_bnd . v(L)          (11)_1
    1/2 (|r'|^2/(1+e) - (1+e), q)     = 0                                    (11)_2

with e = T/EA.  An inextensible cable has no e at all: pass EA = None and none of its terms is built.  The
forces f are per unit *stretched* length, Eq. (6).
"""

from typing import NamedTuple

from ufl import dot, inner, sqrt

from . import morison
from .kinds import Expr, Scalar
from .sea import Flow


class Cable(NamedTuple):
    """Properties of a cable, UFL scalars; None for what is absent."""

    line_density: Scalar  #: rho0 [kg/m]
    EA: Scalar | None = None  #: axial stiffness [N]; None: inextensible
    diameter: Scalar | None = None  #: D [m]
    area: Scalar | None = None  #: A0 [m^2]
    added_mass: Scalar | None = None  #: C_A = C_M - 1
    normal_drag: Scalar | None = None  #: C_dn
    tangential_drag: Scalar | None = None  #: C_dt
    tangential_froude_krylov: bool = False
    damping: Scalar | None = None  #: Kelvin-Voigt c of T = EA e + c e_t [N s]; elastic cables in motion


def strain(cable: Cable, T: Expr, r: Expr | None = None, r_t: Expr | None = None) -> Expr | None:
    """e = T/EA, Eq. (12), or with damping and a velocity (T - c e_t)/EA; None for an inextensible cable."""
    if cable.EA is None:
        return None
    if cable.damping is None or r_t is None:
        return T / cable.EA
    return (T - cable.damping * strain_rate(r, r_t)) / cable.EA


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


def tangent(r: Expr) -> Expr:
    """t = r'/|r'|."""
    return r.dx(0) / sqrt(dot(r.dx(0), r.dx(0)))


def hydrodynamic_force(
    cable: Cable, rho_w: Scalar, flow: Flow, r: Expr, r_t: Expr | None = None, r_tt: Expr | None = None
) -> Expr | None:
    """f_am + f_dn + f_dt of Eq. (6) [N per stretched metre]; None where nothing of it is called for.

    `flow` is the undisturbed water at r (forms.sea.flow); r_t and r_tt are None in statics.  The tangential
    Froude-Krylov force rho_w A (a_w.t) t is absent in the paper and a choice of the cable.
    """
    t = tangent(r)
    terms = []

    v_rel = r_t
    if flow.velocity is not None:
        v_rel = -flow.velocity if r_t is None else r_t - flow.velocity
    if v_rel is not None:
        v_n, _ = morison.split(v_rel, t)
        if cable.normal_drag is not None:
            terms.append(morison.normal_drag(rho_w, cable.diameter, cable.normal_drag, v_n))
        if cable.tangential_drag is not None:
            terms.append(morison.tangential_drag(rho_w, cable.diameter, cable.tangential_drag, t, v_rel))

    a_n = None if r_tt is None else morison.split(r_tt, t)[0]
    a_wn, a_wt = (None, None) if flow.acceleration is None else morison.split(flow.acceleration, t)
    terms.append(morison.inertia(rho_w, cable.area, cable.added_mass, a_n, a_wn))
    if cable.tangential_froude_krylov and a_wt is not None:
        terms.append(rho_w * cable.area * a_wt)

    terms = [term for term in terms if term is not None]
    return sum(terms[1:], terms[0]) if terms else None
