"""Axial stiffness of a cable: one number, or a table of tension over strain."""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, PlainSerializer, WrapValidator

from .quantities import Stiffness, finite_numbers

MOST_ROWS = 50


class TensionTable(float):
    """Tension [N] over strain, linear between the rows and beyond them.

    As a number it is the slope below the first tension, or at 0 without negative strains, like EA in Hooke's law.
    Tables are equal if their rows are.
    """

    rows: tuple[tuple[float, float], ...]

    def __new__(cls, table: Iterable[Sequence[float]]) -> Self:
        """Raise ValueError for an invalid material law."""
        rows = tuple((float(strain), float(tension)) for strain, tension in table)
        if not 2 <= len(rows) <= MOST_ROWS:
            raise ValueError(f"must be a number or a table of 2 to {MOST_ROWS} rows [strain, tension]")
        if any(b[0] <= a[0] or b[1] <= a[1] for a, b in pairwise(rows)) or (0.0, 0.0) not in rows:
            raise ValueError("must hold [strain, tension] that both grow from row to row, one of them [0, 0]")
        if rows[0][0] <= -1 or rows[-1][0] > 100 or max(abs(rows[0][1]), rows[-1][1]) > 1e10:
            raise ValueError("must hold strains above -1 and up to 100, tensions up to 1e10")
        first = max(rows.index((0.0, 0.0)) - 1, 0)
        (e0, T0), (e1, T1) = rows[first : first + 2]
        made = super().__new__(cls, (T1 - T0) / (e1 - e0))
        made.rows = rows
        return made

    def __getnewargs__(self) -> tuple[tuple[tuple[float, float], ...]]:  # type: ignore[override]  # of rows, not of a float
        return (self.rows,)

    def __eq__(self, other: object) -> bool:
        return self.rows == other.rows if isinstance(other, TensionTable) else float(self) == other

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self.rows)

    def __repr__(self) -> str:
        return repr([list(row) for row in self.rows])

    @cached_property
    def kinks(self) -> list[tuple[float, float]]:
        """(T, change of the compliance de/dT there [1/N]) on the way from 0 to each end of the table."""
        compliances = [(b[0] - a[0]) / (b[1] - a[1]) for a, b in pairwise(self.rows)]
        inner = zip(self.rows[1:-1], pairwise(compliances), strict=True)
        return [(T, after - before if T >= 0 else before - after) for (_, T), (before, after) in inner]

    def strain(self, T: float) -> float:
        """Strain e at a tension."""
        found = T / self
        for kink, change in self.kinks:
            found += change * (max(T - kink, 0.0) if kink >= 0 else min(T - kink, 0.0))
        return found


def _number_or_table(value: Any, as_number: Callable[[Any], Any]) -> Any:
    if isinstance(value, list | tuple):
        return TensionTable(map(finite_numbers(2), value))
    return value if isinstance(value, TensionTable) else as_number(value)


if TYPE_CHECKING:
    AxialStiffness = float  # a table is a float too
else:
    AxialStiffness = Annotated[
        Stiffness | Annotated[list[tuple[float, float]], Field(min_length=2, max_length=MOST_ROWS)],
        WrapValidator(_number_or_table),
        PlainSerializer(lambda value: [list(row) for row in value.rows] if isinstance(value, TensionTable) else value),
    ]  # N


def kinks_of(stiffness: Any, below: bool) -> list[tuple[float, float]]:
    """Kinks of a table at T < 0 or at T >= 0; empty for a number."""
    kinks = stiffness.kinks if isinstance(stiffness, TensionTable) else []
    return [kink for kink in kinks if (kink[0] < 0) == below]


def secant(stiffness: Any, T: float) -> float:
    """EA of Hooke's law with the same strain at this tension [N]."""
    return T / stiffness.strain(T) if isinstance(stiffness, TensionTable) and T > 0 else float(stiffness)
