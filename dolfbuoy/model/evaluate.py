"""Form functions in numbers: what a form says, where a table, a start or a picture has to say the same.

UFL evaluates an expression at one point; a picture has thousands, so that the few operations of which the sea and the
wind are made are done here with arrays.
"""

import numpy as np
import ufl
from ufl import classes


def value(expression):
    """Number of a scalar UFL expression of numbers, or array of a vector."""
    return at_points(expression, np.zeros(3))[()]


def at_points(expression, points) -> np.ndarray:
    """Numbers of an expression of `compat.point_in_space`, a scalar or a vector, at points (..., 3).

    Raises NotImplementedError for what is neither arithmetic, an elementary function, a bound nor a choice.
    """
    points, expression = np.asarray(points, dtype=float), ufl.as_ufl(expression)
    components = np.ndindex(expression.ufl_shape)
    found = [np.broadcast_to(_component(expression, points, c, {}), points.shape[:-1]) for c in components]
    return np.stack(found, axis=-1) if expression.ufl_shape else np.array(found[0], dtype=float)


def _component(e, x, component, indices):
    """Of the expression `e` at the points x, with the free indices that have a value."""
    if isinstance(e, classes.SpatialCoordinate):
        return x[..., component[0]]
    if isinstance(e, classes.Zero):
        return 0.0
    if isinstance(e, classes.ScalarValue):
        return float(e)
    if isinstance(e, classes.ListTensor):
        return _component(e.ufl_operands[component[0]], x, component[1:], indices)
    if isinstance(e, classes.ComponentTensor):
        bound = {i.count(): c for i, c in zip(e.ufl_operands[1], component, strict=True)}
        return _component(e.ufl_operands[0], x, (), indices | bound)
    if isinstance(e, classes.Indexed):
        numbers = (indices[i.count()] if isinstance(i, classes.Index) else int(i) for i in e.ufl_operands[1])
        return _component(e.ufl_operands[0], x, tuple(numbers), indices)
    if isinstance(e, classes.Conditional):
        test, *choices = e.ufl_operands
        sides = (_component(side, x, (), indices) for side in test.ufl_operands)
        chosen = _OPERATIONS[type(test).__name__](*sides)
        return np.where(chosen, *(_component(c, x, component, indices) for c in choices))
    name = getattr(e, "_name", type(e).__name__) if isinstance(e, classes.MathFunction) else type(e).__name__
    if name not in _OPERATIONS:
        raise NotImplementedError(f"no array operation for {name} of UFL")
    return _OPERATIONS[name](*(_component(operand, x, component, indices) for operand in e.ufl_operands))


_OPERATIONS = {
    "Sum": np.add,
    "Product": np.multiply,
    "Division": np.divide,
    "Power": np.power,
    "MinValue": np.minimum,
    "MaxValue": np.maximum,
    "LT": np.less,
    "cos": np.cos,
    "sin": np.sin,
    "exp": np.exp,
    "sqrt": np.sqrt,
}
