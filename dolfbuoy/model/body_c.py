"""Numbers of a rigid body that are asked for once or more in a step, in C."""

from ..solver import c_code
from ..solver.c_code import address
from ..solver.rows import Work

_DECLARATIONS = """
void spin(const void *arrays);
void make_unit(const void *arrays);
"""

_SOURCE = """
#include <math.h>
void spin(const void *arrays)
{
    double *const *const array = arrays;
    const double *quaternion = array[0], *angular_momentum = array[1];
    const double a = quaternion[0], b = quaternion[1], c = quaternion[2], d = quaternion[3];
    const double x = angular_momentum[0], y = angular_momentum[1], z = angular_momentum[2];
    const double along = 2 * (b * d + a * c) * x + 2 * (c * d - a * b) * y + (a * a - b * b - c * c + d * d) * z;
    *array[2] = along / (a * a + b * b + c * c + d * d);
}

void make_unit(const void *arrays)
{
    double *const *const array = arrays;
    double *quaternion = array[0], *drift = array[1];
    double square = 0;
    for (int k = 0; k < 4; ++k)
        square += quaternion[k] * quaternion[k];
    const double length = sqrt(square), apart = fabs(length - 1);
    *drift = apart > *drift ? apart : *drift;
    for (int k = 0; k < 4; ++k)
        quaternion[k] /= length;
}
"""


def compiled():
    """The compiled module."""
    return c_code.module("body", _DECLARATIONS, c_code.EVERY_PRODUCT_ROUNDED + _SOURCE)


def spin(quaternion, angular_momentum, out):
    """A function that writes L_C . d to `out` (1,)."""
    return _call("spin", quaternion, angular_momentum, out)


def make_unit(quaternion, drift):
    """A function that makes a quaternion a unit; drift (1,): the largest distance of its length from 1 so far."""
    return _call("make_unit", quaternion, drift)


def _call(name, *arrays):
    library = compiled()
    return Work.of(library, name, library.ffi.new("double *[]", [address(array) for array in arrays]), arrays)
