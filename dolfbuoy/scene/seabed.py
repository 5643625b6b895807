"""The section [seabed]."""

from typing import Literal

from .quantities import BedStiffness, Coefficient, Length, Slope
from .section import Section, key


class Seabed(Section):
    """A bed that carries lines and bodies: the plane z = -depth + slope . (x, y)."""

    friction: Coefficient = key("Coulomb's coefficient mu", "1", default=0.0)
    stiffness: BedStiffness | None = key(
        "pressure per penetration; absent: no line sinks deeper than 1e-4 depth and 1 cm", "Pa/m", default=None
    )
    damping_ratio: Coefficient = key("of what lies on the bed, 1: critical", "1", default=1.0)
    stick_length: Length | None = key(
        "way on which friction builds up; absent: 1e-3 depth, 5 cm at most", "m", default=None
    )
    slope: Slope = key("[dz/dx, dz/dy]", "1", default=(0.0, 0.0))
    start: Literal["frictionless", "pulled"] = key(
        "equilibrium without friction, or of lines laid slack from their ends on the bed, and pulled",
        default="frictionless",
    )
