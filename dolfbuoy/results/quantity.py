"""Declaration of a quantity of a record."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from numpy.typing import NDArray

if TYPE_CHECKING:
    from .noted import Noted

#: Places where main quantities are shown over runs and cases: tables, figures and page of statistics and sweeps.
EVERYWHERE = ("statistics", "statistics figure", "sweep", "sweep figure", "sweep page")


class Absent(KeyError):
    """Error for something that a problem does not have, so that its quantity is not recorded."""


class Curve(NamedTuple):
    """A curve on the page of a run: title of its panel, its name, and the component if it is of a vector."""

    panel: str
    name: str
    component: str = ""


@dataclass(frozen=True)
class Quantity:
    """A recorded quantity.

    dims: those after `over`, which is "time", "frame", "run" (extremes of all steps), "sample" (made for statistics),
    or "" (known at the beginning).  read: computes values (..., *dims) from notes, from the first instant on.
    shown: place of EVERYWHERE -> components ("" for a scalar); main: shown in all of them.
    summary: name of its range in the table of a run; component: of a vector there, else its norm.  at_ends: its name in
    the table of an equilibrium, with the names of the ends, {low} and {high}.
    figure: True if it has its own figure over time.  paraview: name of its field, without the unit.
    compared: its name where runs are compared.  peaks, cycles: components ("" for a scalar) whose peaks or rainflow
    ranges are kept.  turning: True for an angle that continues beyond 180 degrees.
    counts: the statistic that counts where only one is shown.
    outputs: True if its statistics have error bars although it is not shown over time.
    place: location of a surface elevation.  effort: of the solver, not physical.  changing: written again with every
    row.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    long_name: str
    over: str = "time"
    standard_name: str = ""
    read: Callable[[Noted], NDArray[Any]] | None = None
    main: bool = False
    shown: Mapping[str, str] = field(default_factory=dict)
    curves: tuple[Curve, ...] = ()
    summary: str = ""
    component: str = ""
    at_ends: str = ""
    figure: bool = False
    paraview: str = ""
    compared: str = ""
    peaks: str | None = None
    cycles: str | None = None
    turning: bool = False
    counts: str = "maximum"
    outputs: bool = False
    place: str = ""
    effort: bool = False
    integer: bool = False
    changing: bool = False

    def attributes(self) -> dict[str, str]:
        """Attributes of its variable in a record."""
        found = {"units": self.unit, "long_name": self.long_name}
        if self.over == "run":
            found["cell_methods"] = f"time: {'minimum' if 'minimum' in self.name else 'maximum'}"
        return found | ({"standard_name": self.standard_name} if self.standard_name else {})

    def series(self, components: str) -> list[str]:
        """Names of the series of these components; for a scalar, its own name."""
        return [f"{self.name}_{component}" for component in components] or [self.name]

    @property
    def has_outputs(self) -> bool:
        """True if statistics of its series are outputs, with error bars."""
        shown = self.main or self.curves or self.compared or self.outputs or (self.summary and not self.component)
        return bool(shown and self.over == "time")

    @property
    def kind(self) -> str:
        """Its first dimension: "cable", "buoy", "joint", ...; empty if it has none."""
        return self.dims[0] if self.dims else ""

    @property
    def field(self) -> str:
        """Name of the field in ParaView."""
        return f"{self.paraview} [{self.unit}]"


def of(dims: str, over: str = "time") -> Callable[..., Quantity]:
    """Return a constructor of Quantities with these dimensions: (name, unit, long name, ...)."""
    return lambda name, unit, long_name, **more: Quantity(name, tuple(dims.split()), unit, long_name, over, **more)
