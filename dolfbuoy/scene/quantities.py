"""Types of the values of a scene.

Their bounds are far beyond any buoy, cable or sea: a value outside is a typing error.  The largest ship has 1e9 kg, the
deepest sea 1.1e4 m, the strongest mooring chain breaks at 3e7 N, a tidal current runs 5 m/s.
"""

import math
import re
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def number_of(text: str) -> float:
    """A finite number in plain digits.
    Raises ValueError for 1_0, digits of other scripts, nan, inf, and numbers that underflow to 0."""
    found = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
    if not math.isfinite(found) or (found == 0 and re.search("[1-9]", re.split("[eE]", text)[0])):
        raise ValueError(f"{text!r} is no finite number")
    return found


class Wrong(ValueError):
    """Error for a value that conflicts with other keys of its section."""

    def __init__(self, key: str, value: Any, allowed: str):
        super().__init__(f"{key} = {value!r}: {allowed}")
        self.key, self.value, self.allowed = key, value, allowed


class Missing(ValueError):
    """Error for a key that the other keys require."""

    def __init__(self, key: str, why: str):
        super().__init__(f"{key}: must be given, {why}")
        self.key, self.why = key, why


def is_rising(values: Sequence[float]) -> bool:
    """True if each value is larger than the one before."""
    return all(b > a for a, b in pairwise(values))


def _at_least(low: float) -> AfterValidator:
    """Validator: reject a size whose square or inverse is not representable."""

    def check(value: float) -> float:
        if value < low:
            raise ValueError(f"must be at least {low:g}")
        return value

    return AfterValidator(check)


def finite_numbers(count: int) -> Callable[[Any], tuple[float, ...]]:
    """Function that converts a list of `count` finite numbers to a tuple; raises ValueError for other values."""

    def check(value: Any) -> tuple[float, ...]:
        good = isinstance(value, list | tuple) and len(value) == count
        # below 1e300, also for whole numbers too large for a float
        if not good or not all(type(v) is not bool and isinstance(v, int | float) and abs(v) < 1e300 for v in value):
            raise ValueError(f"must be {count} finite numbers")
        return tuple(float(v) for v in value)

    return check


_tiny, _fine = _at_least(1e-20), _at_least(1e-9)
_two, _three, _four = (BeforeValidator(finite_numbers(count)) for count in (2, 3, 4))

Length = Annotated[float, Field(gt=0, le=1e5), _tiny]  # m
Height = Annotated[float, Field(ge=-1e5, le=1e5)]  # m
Wavelength = Annotated[float, Field(gt=0, le=1e7), _tiny]  # m
Area = Annotated[float, Field(gt=0, le=1e6), _tiny]  # m^2
Mass = Annotated[float, Field(gt=0, le=1e9), _tiny]  # kg, kg/m
Volume = Annotated[float, Field(ge=0, le=1e9)]  # m^3
DragArea = Annotated[float, Field(ge=0, le=1e6)]  # m^2
Inertia = Annotated[float, Field(gt=0, le=1e15), _tiny]  # kg m^2
Density = Annotated[float, Field(gt=0, le=1e5), _tiny]  # kg/m^3
Force = Annotated[float, Field(ge=-1e10, le=1e10)]  # N
Damping = Annotated[float, Field(ge=0, le=1e12)]  # N s, N m s
Speed = Annotated[float, Field(ge=0, le=1e3)]  # m/s
Gravity = Annotated[float, Field(ge=0, le=1e3)]  # m/s^2
Coefficient = Annotated[float, Field(ge=0, le=1e4)]
AddedMass = Annotated[float, Field(ge=-1e4, le=1e4)]
Angle = Annotated[float, Field(ge=-1e6, le=1e6)]  # deg
BedStiffness = Annotated[float, Field(gt=0, le=1e12), _fine]  # Pa/m
Duration = Annotated[float, Field(ge=0, le=1e9)]  # s
Period = Annotated[float, Field(gt=0, le=1e9), _tiny]  # s
Step = Annotated[float, Field(gt=0, le=1e9), _fine]  # s
Tolerance = Annotated[float, Field(gt=0, lt=1)]
Degree = Annotated[int, Field(ge=1, le=30)]
_when = Annotated[float, Field(ge=-1e9, le=1e9)]  # s
_turn = Annotated[float, Field(ge=-1e4, le=1e4)]  # deg
Vector = Annotated[tuple[Height, Height, Height], _three]  # m
ForceVector = Annotated[tuple[Force, Force, Force], _three]
_speed = Annotated[float, Field(ge=-1e3, le=1e3)]
VelocityVector = Annotated[tuple[_speed, _speed, _speed], _three]  # m/s, rad/s
_part = Annotated[float, Field(ge=-1e6, le=1e6)]
_share = Annotated[float, Field(ge=0, le=1e3)]
Turning = Annotated[tuple[_when, _share, _turn], _three]  # s, factor of a speed, deg
ForceInTime = Annotated[tuple[_when, Force, Force, Force], _four]
CurrentInTime = Annotated[tuple[_when, Height, _speed, _speed], _four]  # s, m, m/s
Quaternion = Annotated[tuple[_part, _part, _part, _part], _four]
Pair = Annotated[tuple[Height, Height], _two]
_rise = Annotated[float, Field(ge=-10, le=10)]
Slope = Annotated[tuple[_rise, _rise], _two]
Angles = Annotated[tuple[Angle, Angle, Angle], _three]  # of each component
Rows = Annotated[list[Pair], Field(max_length=10_000)]
Share = Annotated[tuple[Length, Annotated[float, Field(ge=1, le=1e7)]], _two]  # of a cable, and its elements
Frequency = Annotated[float, Field(ge=0, le=1e3)]  # Hz
SpectralDensity = Annotated[float, Field(ge=0, le=1e8)]  # m^2/Hz, m^2/Hz/deg
SpectrumRow = Annotated[tuple[SpectralDensity, SpectralDensity], _two]  # Hz and that
_instant = Annotated[float, Field(ge=-1e9, le=1e9)]
_elevation = Annotated[float, Field(ge=-1e4, le=1e4)]
Instant = Annotated[tuple[_instant, _elevation], _two]  # s, m
Component = Annotated[tuple[Annotated[float, Field(ge=0, le=1e4)], Period, Angle, Angle], _four]  # m, s, deg, deg
Multiple = Annotated[float, Field(ge=0, le=1e3)]  # of a frequency
_SPREAD = re.compile(rf"(?:(normal|lognormal|uniform) +)?({_NUMBER.pattern}) *(%?)", re.ASCII)


def spread_of(value: float | str) -> tuple[str, float, bool]:
    """(distribution, standard deviation, True if relative) of an entry of [uncertain].  Raises ValueError."""
    found = _SPREAD.fullmatch(str(value).strip())
    sigma = number_of(found[2]) if found else math.nan
    if not found or not 0 < sigma <= 1e10:
        raise ValueError(f"{value!r} must be a number > 0, of per cent with a %, after normal, lognormal or uniform")
    return found[1] or "normal", sigma / 100 if found[5] else sigma, bool(found[5])


def _spreads(table: dict[str, float | str]) -> dict[str, float | str]:
    for key, value in table.items():
        try:
            spread_of(value)
        except ValueError as error:
            raise ValueError(f"{key}: {error}") from None
    return table


Spreads = Annotated[
    dict[Annotated[str, Field(max_length=200)], float | Annotated[str, Field(max_length=60)]],
    Field(min_length=1, max_length=100),
    AfterValidator(_spreads),
]


def _stiff(value: float) -> float:
    if math.isnan(value) or value < 1e-20 or 1e16 < value < math.inf:
        raise ValueError("must be a number from 1e-20 to 1e16, or inf")
    return value


Stiffness = Annotated[float, Field(gt=0, allow_inf_nan=True), AfterValidator(_stiff)]  # N


def _one_line(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must be text on one line, without control characters")
    return text


Title = Annotated[str, Field(max_length=200), AfterValidator(_one_line)]
Expression = Annotated[str, Field(max_length=1000), AfterValidator(_one_line)]


def _name(text: str) -> str:
    if not text[:1].isalpha() or not text.replace("_", "").replace("-", "").isalnum():
        raise ValueError("must begin with a letter and have letters, digits, _ and - only")
    return text


Name = Annotated[str, Field(max_length=50), AfterValidator(_name)]
