"""Functions of `dolfbuoy` under the same names, whose records drop the dimensions of length one, for easy reading."""

import functools

import dolfbuoy
from dolfbuoy.results.parts import alone


def _alone(function):
    @functools.wraps(function)
    def call(*arguments, **options):
        return alone(function(*arguments, **options))

    return call


simulate, solve_static, periodic = map(_alone, (dolfbuoy.simulate, dolfbuoy.solve_static, dolfbuoy.periodic))
modes, stiffness, offsets, response = map(
    _alone, (dolfbuoy.modes, dolfbuoy.stiffness, dolfbuoy.offsets, dolfbuoy.response)
)
