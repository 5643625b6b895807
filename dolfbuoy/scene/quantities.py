"""Types of the values of a scene.

Their bounds are far beyond any buoy, cable or sea: a value outside is a slip of the pen, not a scene.  The largest
ship has 1e9 kg, the deepest sea 1.1e4 m, the strongest mooring chain breaks at 3e7 N, a tidal current runs 5 m/s.
"""

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def number_of(text: str) -> float:
    """A finite number in plain digits.  Raises ValueError for others that Python reads: 1_0, digits of other scripts,
    nan, inf, and what is too small to be anything but 0."""
    found = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
    if not math.isfinite(found) or (found == 0 and re.search("[1-9]", re.split("[eE]", text)[0])):
        raise ValueError(f"{text!r} is no finite number")
    return found


class Wrong(ValueError):
    """A value that does not go with the other keys of its section."""

    def __init__(self, key: str, value: Any, allowed: str):
        super().__init__(f"{key} = {value!r}: {allowed}")
        self.key, self.value, self.allowed = key, value, allowed


class Missing(ValueError):
    """A key without which the others are no scene."""

    def __init__(self, key: str, why: str):
        super().__init__(f"{key}: must be given, {why}")
        self.key, self.why = key, why


def is_rising(values: Sequence[float]) -> bool:
    """True if each value is larger than the one before."""
    return all(b > a for a, b in pairwise(values))


def _between(low, high, kind=float):
    return Annotated[kind, Field(ge=low, le=high)]


def _at_least(low):
    """Validator: what is so small that its square or inverse leaves the numbers of a computer is no size."""

    def check(value):
        if value < low:
            raise ValueError(f"must be at least {low:g}")
        return value

    return AfterValidator(check)


def _up_to(high, low=1e-20):
    return Annotated[float, Field(gt=0, le=high), _at_least(low)]


Length = _up_to(1e5)  # m
Height = _between(-1e5, 1e5)  # m
Wavelength = _up_to(1e7)  # m
Area = _up_to(1e6)  # m^2
Mass = _up_to(1e9)  # kg, kg/m
Volume = _between(0, 1e9)  # m^3
DragArea = _between(0, 1e6)  # m^2
Inertia = _up_to(1e15)  # kg m^2
Density = _up_to(1e5)  # kg/m^3
Force = _between(-1e10, 1e10)  # N
Damping = _between(0, 1e12)  # N s, N m s
Speed = _between(0, 1e3)  # m/s
Gravity = _between(0, 1e3)  # m/s^2
Coefficient = _between(0, 1e4)
AddedMass = _between(-1e4, 1e4)
Angle = _between(-1e6, 1e6)  # deg
BedStiffness = _up_to(1e12, 1e-9)  # Pa/m
Duration = _between(0, 1e9)  # s
Period = _up_to(1e9)  # s
Step = _up_to(1e9, 1e-9)  # s
Tolerance = Annotated[float, Field(gt=0, lt=1)]
Degree = _between(1, 30, int)


def finite_numbers(count):
    """Function that makes a tuple of a list of `count` finite numbers; it raises ValueError for what is none."""

    def check(value):
        good = isinstance(value, list | tuple) and len(value) == count
        if not good or not all(isinstance(v, int | float) and not isinstance(v, bool) and _finite(v) for v in value):
            raise ValueError(f"must be {count} finite numbers")
        return tuple(float(v) for v in value)

    return check


def _finite_numbers(count):
    return BeforeValidator(finite_numbers(count))


def _finite(number):
    return abs(number) < 1e300  # also for whole numbers that no float can hold


def _vector(component):
    return Annotated[tuple[component, component, component], _finite_numbers(3)]


Vector = _vector(Height)  # m
ForceVector = _vector(Force)
VelocityVector = _vector(_between(-1e3, 1e3))  # m/s, rad/s
_part = _between(-1e6, 1e6)
Quaternion = Annotated[tuple[_part, _part, _part, _part], _finite_numbers(4)]
Pair = Annotated[tuple[Height, Height], _finite_numbers(2)]
_rise = _between(-10, 10)
Slope = Annotated[tuple[_rise, _rise], _finite_numbers(2)]
Angles = Annotated[tuple[Angle, Angle, Angle], _finite_numbers(3)]  # of each component
Rows = Annotated[list[Pair], Field(max_length=10_000)]
Share = Annotated[tuple[Length, _between(1, 1e7)], _finite_numbers(2)]  # of a cable, and its elements
Frequency = _between(0, 1e3)  # Hz
SpectralDensity = _between(0, 1e8)  # m^2/Hz, m^2/Hz/deg
SpectrumRow = Annotated[tuple[SpectralDensity, SpectralDensity], _finite_numbers(2)]  # Hz and that
Instant = Annotated[tuple[_between(-1e9, 1e9), _between(-1e4, 1e4)], _finite_numbers(2)]  # s, m
Component = Annotated[tuple[_between(0, 1e4), Period, Angle, Angle], _finite_numbers(4)]  # m, s, deg, deg
Multiple = _between(0, 1e3)  # of a frequency


def _stiff(value):
    if math.isnan(value) or value < 1e-20 or 1e16 < value < math.inf:
        raise ValueError("must be a number from 1e-20 to 1e16, or inf")
    return value


Stiffness = Annotated[float, Field(gt=0, allow_inf_nan=True), AfterValidator(_stiff)]  # N


def _one_line(text):
    if not text.isprintable():
        raise ValueError("must be text on one line, without control characters")
    return text


Title = Annotated[str, Field(max_length=200), AfterValidator(_one_line)]


def _name(text):
    if not text[:1].isalpha() or not text.replace("_", "").replace("-", "").isalnum():
        raise ValueError("must begin with a letter and have letters, digits, _ and - only")
    return text


Name = Annotated[str, Field(max_length=50), AfterValidator(_name)]
