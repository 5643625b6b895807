"""Error bars of a record in tables: `largest top tension 11.17 +- 0.05 kN`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from .quantities import declared
from .series import OF_PART
from .tables import unit_of

if TYPE_CHECKING:
    import xarray as xr

#: Statistics of an output, and the words that precede the name of the series.
NUMBERS = {"max": "largest", "min": "smallest", "mean": "mean", "std": "standard deviation of"}
#: Dimensions of the parts that outputs belong to.
PARTS = ("cable", "buoy", "segment", "anchor", "take_off", "winch", "vessel")
#: Outputs shown in a summary; a page shows all.
SHOWN = ("tension_top.max", "tension_anchor.max", "anchor.max", "cone_angle.max")


class Row(NamedTuple):
    """An output with its bar as text, in `unit`; part: name of the cable or buoy, empty if there is only one.

    step, mesh: contributions to the bar, empty if not known separately.
    """

    part: str
    output: str
    name: str
    value: str
    bar: str
    step: str
    mesh: str
    unit: str
    verdict: str
    chance: str


def rows_of(record: xr.Dataset) -> list[Row]:
    """All outputs with a bar, or with a reason for having none; empty for a record without bars."""
    if "bar" not in record:
        return []
    columns = ("output_of", "output", "bar_value", "bar", "bar_unit", "bar_verdict")
    apart = ("bar_time", "bar_space", "bar_statistics")
    found = []
    for part, output, value, bar, unit, verdict, *more in zip(
        *(record[c].values.tolist() for c in (*columns, *apart)), strict=True
    ):
        kind = next((k for k in PARTS if k in record.dims and part in record[k].values), None)
        alone = kind is None or record.sizes[kind] == 1
        series, _, number = output.rpartition(".")
        unit, factor = unit_of(value, unit.replace("degree", "deg"))
        texts = number_with(factor * value, factor * bar if verdict != "none" else math.nan)
        step, mesh, scatter = ("" if math.isnan(x) else f"{factor * x:.2g}" for x in more)
        part, name = "" if alone else part, f"{NUMBERS[number]} {_name(series)}"
        found.append(Row(part, output, name, *texts, step, mesh, unit, verdict, scatter))
    return found


#: Names of the statistics that hold the bars of these numbers.
STATISTICS = {"max": "maximum_bar", "min": "minimum_bar", "mean": "mean_bar", "std": "standard_deviation_bar"}


def by_label(record: xr.Dataset) -> dict[str, dict[str, float]]:
    """STATISTICS by series label, from a record or a dataset of bars alone; nan where unknown."""
    found: dict[str, dict[str, float]] = {}
    columns = (record[name].values.tolist() for name in ("output_of", "output", "bar", "bar_verdict"))
    for part, output, bar, verdict in zip(*columns, strict=True) if "bar" in record else ():
        series, _, number = output.rpartition(".")
        label = f"{series}{OF_PART}{part}" if part else series
        found.setdefault(label, {})[STATISTICS[number]] = math.nan if verdict == "none" else bar
    return found


def extremes(part: xr.Dataset) -> dict[str, dict[str, tuple[float, float]]]:
    """(value, bar) of every "max" and "min" with a bar, by series, in the record of one part (`parts.part_of`)."""
    found: dict[str, dict[str, tuple[float, float]]] = {}
    names = {str(part[kind].values) for kind in PARTS if kind in part.coords and not part[kind].dims}
    columns = (part[name].values.tolist() for name in ("output_of", "output", "bar_value", "bar", "bar_verdict"))
    for of, output, value, bar, verdict in zip(*columns, strict=True) if "bar" in part else ():
        series, _, number = output.rpartition(".")
        if of in names and number in ("max", "min") and verdict != "none":
            found.setdefault(series, {})[number] = value, bar
    return found


def summary_rows(record: xr.Dataset) -> list[tuple[str, str, str]]:
    """(quantity, value, unit) of the outputs in SHOWN, as text."""
    rows = []
    for row in rows_of(record):
        if row.output in SHOWN:
            text = f"{row.value} +- {row.bar}" if row.bar else f"{row.value} (error not known)"
            parts = [f"{name} {part}" for name, part in (("step", row.step), ("mesh", row.mesh)) if part]
            text += f" ({', '.join(parts)})" if parts else ""
            text += f", {row.verdict}" if row.verdict == "suspect" else ""
            rows.append((f"{row.part}: {row.name}" if row.part else row.name, text, row.unit))
    return rows


def number_with(value: float, bar: float) -> tuple[str, str]:
    """Texts of a value and its bar: the bar to two digits, the value to the same decimals; no bar if it is nan."""
    if math.isnan(bar):
        return f"{value:.4g}", ""
    if bar == 0:
        return f"{value:.6g}", "0"
    digits = min(max(1 - math.floor(math.log10(bar)), 0), 12)
    return f"{value:.{digits}f}", f"{bar:.{digits}f}"


#: Names of series after "largest", "smallest", "mean", where their own names do not fit.
NAMES = {"anchor": "anchor force", "smallest_tension": "tension where it is least"}


def _name(series: str) -> str:
    if series in NAMES:
        return NAMES[series]
    quantity = declared(series)
    component = series.removeprefix(quantity.name).removeprefix("_")
    name = quantity.compared or quantity.name.replace("_", " ")
    return f"{name}, {component}" if component else name
