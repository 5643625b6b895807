"""Tables: limited to the width of a terminal, but as wide as needed in a pipe or file."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from rich.console import Console, ConsoleDimensions
from rich.markup import escape
from rich.table import Table

#: Width of an output that is not a terminal: more than any table has.
ENDLESS = 10_000
#: Numbers below this are rounding errors, in metres, degrees and newtons.
NOTHING = 1e-9


class Output(Console):
    """The present standard output; only a terminal has a width."""

    @property  # type: ignore[misc]  # without a setter: its size is that of the terminal
    def size(self) -> ConsoleDimensions:
        size = super().size
        return size if self.file.isatty() else size._replace(width=ENDLESS)


out = Output()


class Plain(Table):
    """A table that shows texts literally; rich would take a unit in brackets for a style."""

    def add_column(self, header: Any = "", *arguments: Any, **how: Any) -> None:
        super().add_column(escape(header), *arguments, **how)

    def add_row(self, *cells: Any, **how: Any) -> None:
        super().add_row(*map(escape, cells), **how)


def rounded(x: float, digits: int = 2) -> str:
    """A number with `digits` significant digits, without exponent below a million: 120, not 1.2e+02.
    Rounding errors give 0."""
    return f"{float(f'{x:.{digits}g}'):g}" if not abs(x) < NOTHING else "0"


def years(life: float) -> str:
    """A life to two digits; beyond a million years only a bound."""
    return rounded(life) if life < 1e6 else "> 1,000,000"


def table(title: str, headings: Iterable[str], right: Iterable[str] | None = None) -> Table:
    """An empty table; right: headings of right-aligned columns, by default all."""
    shown = Plain(title=escape(title), title_justify="left", show_edge=False, pad_edge=False)
    for heading in headings:
        shown.add_column(heading, justify="right" if right is None or heading in right else "left")
    return shown


def show(title: str, rows: list[dict[str, Any]], columns: Mapping[str, str], notes: Iterable[str] = ()) -> None:
    """Print rows as a table, and sentences below it; columns: key -> heading.
    Numbers are given to four digits; a column whose heading ends with [N] is in N or kN, by its size."""
    headings, cells = _texts(rows, columns)
    shown = table(title, headings)
    for row in cells:
        shown.add_row(*row)
    out.print(shown)
    for note in notes:
        out.print(note, soft_wrap=True, markup=False)


def markdown(title: str, rows: list[dict[str, Any]], columns: Mapping[str, str], notes: Iterable[str] = ()) -> str:
    """The table of `show` as Markdown; an empty title is left out."""
    headings, cells = _texts(rows, columns)
    escaped = [[cell.replace("|", "\\|").replace("\n", " ") for cell in line] for line in (headings, *cells)]
    first, *rest = (f"| {' | '.join(line)} |" for line in escaped)
    lines = [first, "|" + "---|" * len(headings), *rest]
    return "\n\n".join([*([f"## {title}"] if title else []), "\n".join(lines), *notes]) + "\n"


def _texts(rows: list[dict[str, Any]], columns: Mapping[str, str]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of cells, as text."""
    units = {key: force_unit([row.get(key) for row in rows]) for key in columns if columns[key].endswith("[N]")}
    headings = [f"{columns[key][:-3]}[{units[key][0]}]" if key in units else columns[key] for key in columns]
    return headings, [[_text(row.get(key), *units.get(key, ())[1:]) for key in columns] for row in rows]


def _text(value: Any, factor: float | None = None) -> str:
    if value is None:
        return "-"
    if factor is not None:
        value = float(value) * factor
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def force_unit(values: Any) -> tuple[str, float]:
    """Unit in which forces of this size [N] are shown, and the factor to it: kN from 1000 N.

    values: an array or a list; None and non-finite values do not count.
    """
    sizes = np.abs(np.asarray(values, dtype=float))
    return ("kN", 1e-3) if np.max(sizes, where=np.isfinite(sizes), initial=0.0) >= 1000 else ("N", 1.0)


def unit_of(values: Any, unit: str) -> tuple[str, float]:
    """Unit in which values are shown, and the factor to it: for forces by their size, else the given unit."""
    return force_unit(values) if unit == "N" else (unit, 1.0)


def plain(x: float) -> str:
    """A number with four digits and no exponent; rounding errors give 0."""
    text = f"{x:.4g}" if abs(x) >= NOTHING else "0"
    if "e-" in text:
        return f"{x:.{3 - math.floor(math.log10(abs(x)))}f}".rstrip("0")
    return f"{float(text):.0f}" if "e+" in text and abs(x) < 1e15 else text


def newtons(force: float) -> str:
    """A force [N] as text, in N or kN."""
    unit, factor = force_unit([force])
    return f"{plain(factor * force)} {unit}"


def groups(rows: list[dict[str, Any]], *keys: str) -> dict[Any, list[dict[str, Any]]]:
    """Rows grouped by their value of a key, or values of several keys, in order of first appearance."""
    found: dict[Any, list[dict[str, Any]]] = {}
    for row in rows:
        values = tuple(row[key] for key in keys)
        found.setdefault(values[0] if len(keys) == 1 else values, []).append(row)
    return found
