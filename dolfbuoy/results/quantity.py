"""Declaration of a quantity of a record."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from numpy.typing import NDArray

if TYPE_CHECKING:
    from .noted import Noted

#: Where the main quantities are shown, over runs and cases: tables of statistics and sweeps, their figures and page.
EVERYWHERE = ("statistics", "statistics figure", "sweep", "sweep figure", "sweep page")


class Absent(KeyError):
    """Something that a problem does not have, so that a quantity of it is not recorded."""


class Curve(NamedTuple):
    """A curve on the page of a run: title of its panel, own name, and the component of a vector that it shows."""

    panel: str
    name: str
    component: str = ""


@dataclass(frozen=True)
class Quantity:
    """An output.

    dims: after `over`, which is "time", "frame", "run" (extremes of all steps), "sample" (made for statistics), or ""
    of what is known at the beginning.  read: values (..., *dims) of what is noted, there at the first instant.
    shown: place of EVERYWHERE -> components ("" of a scalar); main: shown in all of them.
    summary: what the table of a run calls its range; component: of a vector there, else its size.  at_ends: what that
    of an equilibrium calls it with the names of the ends, {low} and {high}.
    figure: whether it has a figure of its own over time.  paraview: name of its field, without the unit.
    compared: what it is called where runs are compared.  peaks, cycles: components, or "" of a scalar, whose peaks or
    rainflow ranges are kept.  turning: an angle that goes on over 180 degrees.
    counts: the number of its series that counts where one is shown.
    outputs: whether its numbers have error bars though it is not shown over time.
    place: of an elevation of the water, where it is.  effort: of the solver, no physics.  changing: written again with
    every row.
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
        """Those of its variable in a record."""
        found = {"units": self.unit, "long_name": self.long_name}
        if self.over == "run":
            found["cell_methods"] = f"time: {'minimum' if 'minimum' in self.name else 'maximum'}"
        return found | ({"standard_name": self.standard_name} if self.standard_name else {})

    def series(self, components: str) -> list[str]:
        """Names of the series of these components, of a scalar its own."""
        return [f"{self.name}_{component}" for component in components] or [self.name]

    @property
    def has_outputs(self) -> bool:
        """True if numbers of its series are outputs, with error bars."""
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
    """Return a constructor of Quantities of these dimensions: (name, unit, long name, ...)."""
    return lambda name, unit, long_name, **more: Quantity(name, tuple(dims.split()), unit, long_name, over, **more)
