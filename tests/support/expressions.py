"""Numerical evaluation of UFL expressions of a line's coordinate."""

import numpy as np
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from dolfbuoy.solver.compat import MPI, interval_mesh

S = ufl.SpatialCoordinate(interval_mesh(MPI.COMM_SELF, [0.0, 1.0]))[0]
S_0 = 0.3  #: where they are evaluated
RHO = 1013.0


def value(expression, s=S_0):
    """Number (or array) of an expression of S."""
    expression = ufl.as_ufl(expression)
    if expression.ufl_shape:
        return np.array([value(expression[i], s) for i in range(expression.ufl_shape[0])])
    return float(apply_derivatives(apply_algebra_lowering(expression))((s,)))


def vector(x):
    return ufl.as_vector([ufl.as_ufl(float(c)) for c in x])


def across(x, t):
    """Component of x perpendicular to a unit vector."""
    return x - (x @ t) * t
