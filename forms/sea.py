"""The water: Airy waves with stretching above still water, and currents.

World frame, z = 0 at still water level, sea bed at z = -depth.  The elevation is
eta = a cos(theta), theta = k . x - omega t + phase.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from ufl import as_vector, conditional, cos, exp, lt, max_value, min_value, sin

from .kinds import Expr, Scalar

Current = Callable[[Expr], Expr]  #: x -> velocity of the current there [m/s]


class Wave(NamedTuple):
    """A regular wave; every entry is a UFL scalar but `stretching`, which is a choice made when the form is built."""

    amplitude: Scalar  #: a, ramp included [m]
    wavenumber: Scalar  #: k [1/m]
    frequency: Scalar  #: omega [rad/s]
    time_phase: Scalar  #: phase - omega t [rad]
    cos_direction: Scalar
    sin_direction: Scalar
    depth: Scalar  #: h [m]
    stretching: str = "wheeler"


class Flow(NamedTuple):
    """Undisturbed water at a point: elevation [m], velocity [m/s], acceleration due to waves [m/s^2] or None."""

    elevation: Expr | None
    velocity: Expr | None
    acceleration: Expr | None


def phase(wave: Wave, x: Expr) -> Expr:
    """theta = k . x - omega t + phase."""
    along = wave.cos_direction * x[0] + wave.sin_direction * x[1]
    return wave.wavenumber * along + wave.time_phase


def elevation(wave: Wave, x: Expr) -> Expr:
    """eta(x, t) [m]."""
    return wave.amplitude * cos(phase(wave, x))


def stretched(wave: Wave, z: Expr, eta: Expr) -> Expr:
    """Height at which the linear kinematics are read for a point at height z under the elevation eta.

    "wheeler" maps [-h, eta] onto [-h, 0], "vertical" reads everything above z = 0 at z = 0, "none"
    extrapolates the exponentials of linear theory.
    """
    if wave.stretching == "wheeler":
        return min_value(wave.depth * (z - eta) / (wave.depth + eta), 0.0)
    if wave.stretching == "vertical":
        return min_value(z, 0.0)
    return z


def depth_decay(wave: Wave, z: Expr) -> tuple[Expr, Expr]:
    """(cosh k(z+h), sinh k(z+h)) / sinh kh, in decaying exponentials that cannot overflow in deep water."""
    k, h = wave.wavenumber, wave.depth
    down, up = exp(k * z), exp(-k * (z + 2 * h))
    bottom = 1 - exp(-2 * k * h)
    return (down + up) / bottom, (down - up) / bottom


def wave_flow(wave: Wave, x: Expr) -> Flow:
    """Elevation, velocity and local acceleration of the water particles of an Airy wave at x."""
    eta, theta = elevation(wave, x), phase(wave, x)
    Sc, Ss = depth_decay(wave, stretched(wave, x[2], eta))
    a, om = wave.amplitude, wave.frequency
    horizontal = a * om * Sc
    v = as_vector(
        [
            wave.cos_direction * horizontal * cos(theta),
            wave.sin_direction * horizontal * cos(theta),
            a * om * Ss * sin(theta),
        ]
    )
    acceleration = om * as_vector(
        [
            wave.cos_direction * horizontal * sin(theta),
            wave.sin_direction * horizontal * sin(theta),
            -a * om * Ss * cos(theta),
        ]
    )
    return Flow(eta, v, acceleration)


def uniform_current(velocity: Expr) -> Current:
    """The same current everywhere: x -> velocity."""
    return lambda x: velocity


def power_law_current(velocity: Expr, depth: Scalar, exponent: Scalar) -> Current:
    """x -> velocity (1 + z/depth)^exponent, velocity at and above still water.

    The last thousandth of the depth is cut off, where the exact profile has an infinite slope.
    """

    def profile(x: Expr) -> Expr:
        height = max_value(min_value(1 + x[2] / depth, 1.0), 1e-3)
        return velocity * height**exponent

    return profile


def tabulated_current(direction: Expr, z: Sequence[Scalar], speed: Sequence[Scalar]) -> Current:
    """x -> direction * s(z), s piecewise linear through (z_i, speed_i), z_i increasing, constant beyond the ends."""

    def profile(x: Expr) -> Expr:
        s = speed[0]
        for z0, z1, s0, s1 in zip(z, z[1:], speed, speed[1:], strict=False):
            inside = min_value(max_value((x[2] - z0) / (z1 - z0), 0.0), 1.0)
            s = s + (s1 - s0) * inside
        return direction * s

    return profile


def relative(own: Expr | None, water: Expr | None) -> Expr | None:
    """A body's velocity or acceleration less the water's; what is absent is None, and so is their difference if both
    are."""
    if water is None:
        return own
    return -water if own is None else own - water


def flow(x: Expr, wave: Wave | None = None, current: Current | None = None) -> Flow:
    """The undisturbed water at x: v_a = v_w + v_c.  An absent part is None, not zero; no sea motion at all gives a
    Flow of three Nones (elevation None means still water)."""
    eta = velocity = acceleration = None
    if wave is not None:
        eta, velocity, acceleration = wave_flow(wave, x)
    if current is not None:
        velocity = current(x) if velocity is None else velocity + current(x)
    return Flow(eta, velocity, acceleration)


def linear_below(x: Expr, x0: Scalar, value: Expr) -> Expr:
    """`value` above x0, its linear fall to zero at x = 0, zero below: removes an infinite slope at 0."""
    return conditional(lt(x, x0), max_value(x, 0.0) / x0, 1.0) * value
