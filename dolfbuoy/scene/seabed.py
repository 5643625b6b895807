"""The section [seabed]."""

from typing import Literal

from .quantities import BedStiffness, Coefficient, Length, Slope
from .section import Section, key


class Seabed(Section):
    """A bed that carries lines and bodies: the plane z = -depth + slope . (x, y)."""

    friction: Coefficient = key("Coulomb friction coefficient mu", "1", default=0.0)
    stiffness: BedStiffness | None = key(
        "normal stiffness, pressure per penetration; absent: penetration of 1e-4 depth or 1 cm at most",
        "Pa/m",
        default=None,
    )
    damping_ratio: Coefficient = key("damping ratio of normal contact; 1: critical", "1", default=1.0)
    stick_length: Length | None = key(
        "displacement over which Coulomb friction is mobilised; absent: 1e-3 depth, 5 cm at most", "m", default=None
    )
    slope: Slope = key("slope of the sea bed [dz/dx, dz/dy]", "1", default=(0.0, 0.0))
    start: Literal["frictionless", "pulled"] = key(
        "initial friction state: none, or that of lines laid slack on the bed and then pulled",
        default="frictionless",
    )
