"""The water: Airy waves with stretching above still water, and currents.

World frame, z = 0 at still water level, sea bed at z = -depth.  The elevation is
eta = a cos(theta), theta = k . x - omega t + phase.  A tide raises the still water level and the waves on it.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from ufl import as_matrix, as_vector, bessel_J, conditional, cos, dot, exp, inner, lt, max_value, min_value, sin, sqrt

from .kinds import Expr, Scalar

Current = Callable[[Expr], Expr]  #: x -> velocity of the current there [m/s]
Lesser = Callable[[Expr, Scalar], Expr]  #: minimum of two numbers


class Wave(NamedTuple):
    """A regular wave; all entries are UFL scalars except `stretching`, which is chosen when the form is built."""

    amplitude: Scalar  #: a, ramp included [m]
    wavenumber: Scalar  #: k [1/m]
    frequency: Scalar  #: omega [rad/s]
    time_phase: Scalar  #: phase - omega t [rad]
    cos_direction: Scalar
    sin_direction: Scalar
    depth: Scalar  #: h [m]
    stretching: str = "wheeler"


class Flow(NamedTuple):
    """Undisturbed water at a point; None where a field is absent."""

    elevation: Expr | None  #: of the free surface above the point [m]
    velocity: Expr  #: [m/s]; None in still water
    acceleration: Expr | None  #: due to waves [m/s^2]
    slope: Expr | None = None  #: grad(elevation), a horizontal vector [1]
    acceleration_gradient: Expr | None = None  #: symmetric: potential flow is irrotational [1/s^2]
    velocity_gradient: Expr | None = None  #: of waves, symmetric [1/s]
    level: Expr | None = None  #: tide: still water level above that at t = 0 [m]

    @property
    def normal(self) -> Expr:
        """Unit normal of the tangent plane of the free surface, upwards."""
        e_z = as_vector([0.0, 0.0, 1.0])
        return e_z if self.slope is None else (e_z - self.slope) / sqrt(1 + dot(self.slope, self.slope))

    @property
    def surface(self) -> Expr | None:
        """Height z of the free surface [m]; None: at 0."""
        if self.level is None or self.elevation is None:
            return self.elevation if self.level is None else self.level
        return self.elevation + self.level

    def depth(self, x: Expr) -> Expr:
        """Height of the free surface above x [m]."""
        return -x[2] if self.surface is None else self.surface - x[2]


def phase(wave: Wave, x: Expr) -> Expr:
    """theta = k . x - omega t + phase."""
    along = wave.cos_direction * x[0] + wave.sin_direction * x[1]
    return wave.wavenumber * along + wave.time_phase


def elevation(wave: Wave, x: Expr) -> Expr:
    """eta(x, t) [m]."""
    return wave.amplitude * cos(phase(wave, x))


def stretched(wave: "Wave | Samples", z: Expr, eta: Expr) -> Expr:
    """Height at which the linear kinematics are evaluated for a point at height z under the elevation eta.

    "wheeler" maps [-h, eta] onto [-h, 0], "vertical" uses the values at z = 0 above it, "none" extrapolates
    the exponentials of linear theory.
    """
    if wave.stretching == "wheeler":
        return min_value(wave.depth * (z - eta) / (wave.depth + eta), 0.0)
    if wave.stretching == "vertical":
        return min_value(z, 0.0)
    return z


def depth_decay(wave: Wave, z: Expr) -> tuple[Expr, Expr]:
    """(cosh k(z+h), sinh k(z+h)) / sinh kh, from decaying exponentials that cannot overflow in deep water."""
    k, h = wave.wavenumber, wave.depth
    down, up = exp(k * z), exp(-k * (z + 2 * h))
    bottom = 1 - exp(-2 * k * h)
    return (down + up) / bottom, (down - up) / bottom


def wave_flow(wave: Wave, x: Expr) -> Flow:
    """An Airy wave at x: elevation, its slope, velocity and local acceleration of the water, and their gradients.

    The gradients are those of linear theory at the stretched height: symmetric and traceless.
    """
    eta, theta = elevation(wave, x), phase(wave, x)
    Sc, Ss = depth_decay(wave, stretched(wave, x[2], eta))
    heading = as_vector([wave.cos_direction, wave.sin_direction, 0.0])
    rate, k = wave.amplitude * wave.frequency, wave.wavenumber
    in_phase, behind = cos(theta), sin(theta)
    velocity = _in_plane(wave, rate * Sc * in_phase, rate * Ss * behind)
    acceleration = _in_plane(wave, wave.frequency * rate * Sc * behind, -wave.frequency * rate * Ss * in_phase)
    return Flow(
        eta,
        velocity,
        acceleration,
        -wave.amplitude * k * behind * heading,
        _gradient(wave, wave.frequency * rate * k * Sc * in_phase, wave.frequency * rate * k * Ss * behind),
        _gradient(wave, -rate * k * Sc * behind, rate * k * Ss * in_phase),
    )


class Samples(NamedTuple):
    """Numerical values of a sum of waves at a point near x, which `sampled_flow` extrapolates to x.

    numbers: the point (`PLACE`), and there elevation, slope, and velocity and acceleration of linear theory with
    their derivatives; SMALL of them, or LARGE with second derivatives too.
    """

    numbers: Expr
    depth: Scalar  #: h [m]
    stretching: str = "wheeler"
    steep: bool = False  #: harmonics of one wave: total acceleration, whose gradient has a trace


#: Numbers of a sample: (x, y, stretched z); eta; its slope; v; grad v; a; grad a; second derivatives of eta, v and a.
#: Gradients of potential flow as xx, xy, yy, xz, yz; second gradients as xxx, xxy, xyy, yyy, xxz, xyz, yyz.
PLACE, ETA, SLOPE, V, GRAD_V, A, GRAD_A, CURVATURE, GRAD2_V, GRAD2_A = 0, 3, 4, 6, 9, 14, 17, 22, 25, 32
SMALL, LARGE = 22, 39


def sampled_flow(samples: Samples, x: Expr, z: Expr | None = None) -> Flow:
    """Waves at x by Taylor expansion in (x, y, stretched z): exact at the point of the sample, derivatives included.

    z: the stretched height, if not computed from the elevation of these samples.
    """
    s = samples.numbers
    large = s.ufl_shape[0] == LARGE
    dx, dy = x[0] - s[0], x[1] - s[1]
    eta = s[ETA] + s[SLOPE] * dx + s[SLOPE + 1] * dy
    slope = [s[SLOPE], s[SLOPE + 1]]
    if large:
        xx, xy, yy = (s[CURVATURE + i] for i in range(3))
        turned = xx * dx + xy * dy, xy * dx + yy * dy
        eta += 0.5 * (turned[0] * dx + turned[1] * dy)  # needed for the wind, at some distance
        slope = [slope[0] + turned[0], slope[1] + turned[1]]
    d = as_vector([dx, dy, (stretched(samples, x[2], eta) if z is None else z) - s[2]])
    trace = None
    if samples.steep:  # div((v . grad) v) = G : G
        G = _symmetric([s[GRAD_V + i] for i in range(5)])
        trace = inner(G, G)
    velocity, acceleration = (
        as_vector([s[n + i] for i in range(3)]) + dot(_symmetric([s[g + i] for i in range(5)], of), d)
        for n, g, of in ((V, GRAD_V, None), (A, GRAD_A, trace))
    )
    places = (GRAD_A, GRAD2_A if large else None, trace), (GRAD_V, GRAD2_V if large else None, None)
    gradients = (_gradient_near(s, *place, d) for place in places)
    return Flow(eta, velocity, acceleration, as_vector([*slope, 0.0]), *gradients)


def _symmetric(g: Sequence[Expr], trace: Expr | None = None) -> Expr:
    """Symmetric tensor from xx, xy, yy, xz, yz and its trace (None: zero)."""
    xx, xy, yy, xz, yz = g
    zz = -xx - yy if trace is None else trace - xx - yy
    return as_matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _gradient_near(s: Expr, place: int, second: int | None, trace: Expr | None, d: Expr) -> Expr:
    """A gradient of a sample, extrapolated by d with its derivatives if there are any."""
    g = [s[place + i] for i in range(5)]
    if second is None:
        return _symmetric(g, trace)
    xxx, xxy, xyy, yyy, xxz, xyz, yyz = (s[second + i] for i in range(7))
    rows = (xxx, xxy, xxz), (xxy, xyy, xyz), (xyy, yyy, yyz), (xxz, xyz, -xxx - xyy), (xyz, yyz, -xxy - yyy)
    return _symmetric([part + dot(as_vector(row), d) for part, row in zip(g, rows, strict=True)], trace)


def sampled_average(samples: Sequence[Samples], x: Expr) -> Flow:
    """`averaged_over_disk` for samples: plain ones, ones weighted for means, and ones weighted for first moments."""
    plain = sampled_flow(samples[0], x)
    z = stretched(samples[0], x[2], plain.elevation)
    mean, moment = (sampled_flow(weighted, x, z) for weighted in samples[1:])
    return plain._replace(
        elevation=mean.elevation,
        acceleration=mean.acceleration,
        slope=moment.slope,
        acceleration_gradient=moment.acceleration_gradient,
    )


def _in_plane(wave: Wave, along: Expr, up: Expr) -> Expr:
    """A vector in the wave's vertical plane."""
    return as_vector([wave.cos_direction * along, wave.sin_direction * along, up])


def _gradient(wave: Wave, stretching: Expr, shear: Expr) -> Expr:
    """Gradient of a vector in the wave's plane: d(along)/d(along) = -d(up)/dz, d(along)/dz = d(up)/d(along)."""
    c, s = wave.cos_direction, wave.sin_direction
    return as_matrix(
        [
            [c * c * stretching, c * s * stretching, c * shear],
            [c * s * stretching, s * s * stretching, s * shear],
            [c * shear, s * shear, -stretching],
        ]
    )


def averaged_over_disk(flow: Flow, k_R: Expr) -> Flow:
    """Elevation and acceleration averaged over a horizontal disk of radius R, slope and gradient weighted with its
    second moment: factors 2 J1(kR)/(kR) and 8 J2(kR)/(kR)^2.

    Velocities remain those at the centre, because drag is not an integral over the disk.
    """
    x = max_value(k_R, 1e-6)  # at a pointed end the factors are 1
    mean, moment = 2 * bessel_J(1, x) / x, 8 * bessel_J(2, x) / (x * x)
    return flow._replace(
        elevation=mean * flow.elevation,
        acceleration=mean * flow.acceleration,
        slope=moment * flow.slope,
        acceleration_gradient=moment * flow.acceleration_gradient,
    )


def uniform_current(velocity: Expr) -> Current:
    """The same current everywhere: x -> velocity."""
    return lambda x: velocity


#: Half the width over which a corner is rounded; a power of two, so that sums are exact.
CORNER = 2.0**-16


def at_most(x: Expr, high: Scalar) -> Expr:
    """Minimum of the two with a rounded corner: the slope there is the mean of both sides, the value exact.

    The middle point of a hull in still water is at z = 0 to rounding (1e-8 of the hull), in the corner of every
    profile that ends or bends there; at a sharp corner its slope would be a matter of chance.  For lines, whose points
    only pass a corner, rounding is not worth its cost, a tenth of their equations.
    """
    t = max_value(min_value((x - high) / CORNER, 1.0), -1.0)
    return min_value(x, high - CORNER) + CORNER * (1 + t / 2 - t**2 + max_value(t, -t) * t**2 / 2)


def power_law_current(velocity: Expr, depth: Scalar, exponent: Scalar, lesser: Lesser = min_value) -> Current:
    """x -> velocity (1 + z/depth)^exponent, velocity at and above still water.

    lesser: the minimum that forms the corner; see `at_most`.
    The last thousandth of the depth is cut off, where the exact profile has an infinite slope.
    """

    def profile(x: Expr) -> Expr:
        height = max_value(lesser(1 + x[2] / depth, 1.0), 1e-3)
        return velocity * height**exponent

    return profile


def tabulated_current(
    direction: Expr, z: Sequence[Scalar], speed: Sequence[Scalar], lesser: Lesser = min_value
) -> Current:
    """x -> direction * s(z), s piecewise linear through (z_i, speed_i), z_i increasing, constant beyond the ends.

    lesser: the minimum that forms the corners; see `at_most`.
    """

    def profile(x: Expr) -> Expr:
        s = speed[0]
        for z0, z1, s0, s1 in zip(z, z[1:], speed, speed[1:], strict=False):
            inside = lesser((x[2] - z0) / (z1 - z0), 1.0)
            s = s - (s1 - s0) * lesser(-inside, 0.0)
        return direction * s

    return profile


def relative(own: Expr | None, water: Expr | None) -> Expr | None:
    """Velocity or acceleration of a body relative to the water; None means absent, and the result is None if both
    are."""
    if water is None:
        return own
    return -water if own is None else own - water


def flow(x: Expr, wave: "Wave | Samples | None" = None, current: Current | None = None) -> Flow:
    """The undisturbed water at x: v_a = v_w + v_c.  Absent parts are None, not zero (elevation None: still water)."""
    if wave is None:
        water = Flow(None, None, None)
    else:
        water = wave_flow(wave, x) if isinstance(wave, Wave) else sampled_flow(wave, x)
    return with_current(water, x, current)


def with_current(waves: Flow, x: Expr, current: Current | None) -> Flow:
    """Waves and, if there is one, a current: v_a = v_w + v_c."""
    if current is None:
        return waves
    stream = current(x)
    return waves._replace(velocity=stream if waves.velocity is None else waves.velocity + stream)


def wet_part(depth: Expr, extent: Expr) -> Expr:
    """Submerged fraction, 0 to 1, of a ball of radius `extent` whose centre is at the given depth."""
    c = max_value(min_value(depth / extent, 1.0), -1.0)
    return 0.5 + 0.75 * c - 0.25 * c**3


def linear_below(x: Expr, x0: Scalar, value: Expr) -> Expr:
    """`value` above x0, falling linearly to zero at x = 0, and zero below: removes an infinite slope at 0."""
    return conditional(lt(x, x0), max_value(x, 0.0) / x0, 1.0) * value
