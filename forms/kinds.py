"""Types of arguments and results.  Scalars may be plain numbers where a form is checked by hand."""

from ufl.core.expr import Expr

Scalar = Expr | float

__all__ = ["Expr", "Scalar"]
