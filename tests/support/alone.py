"""What `dolfbuoy` has by these names, with records to read by hand: without a dimension of what there is one of."""

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
