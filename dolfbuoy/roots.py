"""Roots of functions of one variable, identical to scipy's brentq to the last bit.

Importing scipy.optimize takes longer than the rest of most starts.  Source: Brent 1973, as in scipy's brentq.c.
"""

import contextlib
import math
from collections.abc import Callable
from typing import Any

RTOL = 4 * 2.0**-52


def brentq(
    f: Callable[[float], Any], a: float, b: float, xtol: float = 2e-12, rtol: float = RTOL, maxiter: int = 100
) -> float:
    """The root of f between a and b, at which its signs differ, to within xtol + rtol |root|.

    Raises ValueError for equal signs or a value that is NaN, RuntimeError after `maxiter` iterations.
    """
    x_pre, x = float(a), float(b)
    f_pre, f_x = _value(f, x_pre), _value(f, x)
    if f_pre == 0:
        return x_pre
    if f_x == 0:
        return x
    if not _signs_differ(f_pre, f_x):
        raise ValueError("f(a) and f(b) must have different signs")
    x_other = f_other = step_pre = step = 0.0
    for _ in range(maxiter):
        if f_pre != 0 and f_x != 0 and _signs_differ(f_pre, f_x):
            x_other, f_other = x_pre, f_pre
            step_pre = step = x - x_pre
        if abs(f_other) < abs(f_x):
            x_pre, x, x_other = x, x_other, x
            f_pre, f_x, f_other = f_x, f_other, f_x
        delta, half = (xtol + rtol * abs(x)) / 2, (x_other - x) / 2
        if f_x == 0 or abs(half) < delta:
            return x
        tried = math.inf  # the next step: secant, inverse quadratic interpolation, or bisection
        if abs(step_pre) > delta and abs(f_x) < abs(f_pre):
            with contextlib.suppress(ZeroDivisionError):
                if x_pre == x_other:
                    tried = -f_x * (x - x_pre) / (f_x - f_pre)
                else:
                    d_pre, d_other = (f_pre - f_x) / (x_pre - x), (f_other - f_x) / (x_other - x)
                    tried = -f_x * (f_other * d_other - f_pre * d_pre) / (d_other * d_pre * (f_other - f_pre))
        short = 2 * abs(tried) < min(abs(step_pre), 3 * abs(half) - delta)
        step_pre, step = (step, tried) if short else (half, half)
        x_pre, f_pre = x, f_x
        x += step if abs(step) > delta else delta if half > 0 else -delta
        f_x = _value(f, x)
    raise RuntimeError(f"Failed to converge after {maxiter} iterations.")


def _signs_differ(a: float, b: float) -> bool:
    return math.copysign(1.0, a) != math.copysign(1.0, b)


def _value(f: Callable[[float], Any], x: float) -> float:
    value = float(f(x))
    if math.isnan(value):
        raise ValueError(f"The function value at x={x} is NaN; solver cannot continue.")
    return value
