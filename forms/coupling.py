"""The rigid link from C to the mooring point O, Eq. (9), and the coupling of buoy and cable, Eq. (29)."""

from ufl import inner

from .kinds import Expr
from .rotation import rotation_matrix


def rigid_link(r_O: Expr, r_C: Expr, q4: Expr, body_offset: Expr, test: Expr) -> Expr:
    """(9): (r_O - R(q4) r_CO^0 - r_C) . test, with the offset r_CO^0 of O from C in the body frame."""
    return inner(r_O - rotation_matrix(q4) * body_offset - r_C, test)


def attachment(r: Expr, r_O: Expr, test: Expr) -> Expr:
    """(29)_1: (r(L) - r_O) . test; its unknown is T_O."""
    return inner(r - r_O, test)


def end_force(T_bnd: Expr, v: Expr) -> Expr:
    """- T_bnd . v(L), the last term of (11)_1.  With a buoy T_bnd = -T_O, Eq. (29)_2, which eliminates T_bnd."""
    return -inner(T_bnd, v)
