"""The page of a sweep: axes side by side with a line for each case, a table that sorts, and every case by a click."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from ..results.quantities import shown_in
from ..results.sample import STATISTICS
from ..results.series import described, each_series
from ..results.tables import unit_of
from . import html
from .document import tag
from .pack import single

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

#: Numbers of statistics up to which all are in the page; of more only the largest values, means and deviations.
MOST_NUMBERS = 600_000
FEWER = ("maximum", "mean", "standard_deviation")


def sweep_page(dataset: xr.Dataset) -> str:
    """HTML of sweep.nc."""
    found = data_of(dataset)
    done = int((dataset.status == "done").sum())
    cases = f"{dataset.sizes['case']:,} cases over {dataset.attrs['varied']}; {done:,} of them done"
    opens = "opens its replay, which is in records/ beside this file, and " if found["records"] else ""
    hint = f"A line is a case; a click on it, or on its row below, {opens}shows its numbers and how to run it alone."
    empty = tag("div", tag("p", "Choose a line or a row."), id="chosen", aria_live="polite")
    return html.page(
        f"Sweep of {dataset.attrs.get('title') or 'a scene'}",
        [cases],
        html.section("parallel", "All cases", tag("p", hint, class_="note"), tag("div", id="axes"), class_="whole"),
        html.section("cases", "Cases", tag("div", id="table")),
        html.section("case", "One case", empty),
        tag("div", html.scene(dataset.attrs["scene"], common=True), class_="grid") if found["scene"] else None,
        data=found,
        script="sweep",
    )


def data_of(dataset: xr.Dataset) -> dict[str, Any]:
    """Data for the script of the page."""
    keys = dataset.attrs["varied"].split(", ")
    varied = [{"key": key, "values": _listed(dataset[key.replace(".", "_")].values)} for key in keys]
    quantities = each_series(dataset, "maximum")
    kept = STATISTICS if len(quantities) * len(STATISTICS) * dataset.sizes["case"] <= MOST_NUMBERS else FEWER
    return {
        "kind": "sweep",
        "varied": varied,
        "status": _listed(dataset.status.values),
        "quantities": [_quantity(*one, kept) for one in quantities],
        "main": [label for main in shown_in("sweep page") for label, name, _ in quantities if name == main],
        "scene": "scene" in dataset.attrs,
        "source": dataset.attrs.get("source", ""),
        "records": _records(dataset),
    }


def _records(dataset: xr.Dataset) -> list[str]:
    """Folder of every case's record, empty where it was not kept; none of them leads anywhere else."""
    found = _listed(dataset.record.values) if "record" in dataset else []
    return [folder if re.fullmatch(r"records/[0-9a-f]{20}", folder) else "" for folder in found]


def _listed(values: NDArray[Any]) -> list[Any]:
    return [value.item() if isinstance(value, np.generic) else value for value in values]


def _quantity(label: str, name: str, dataset: xr.Dataset, kept: tuple[str, ...]) -> dict[str, Any]:
    unit, long_name = described(name)
    columns = {statistic: dataset[f"{name}_{statistic}"].values for statistic in kept}
    unit, factor = unit_of(np.concatenate([columns[k] for k in kept if k != "dominant_period"]), unit)
    packed = {k: single(v if k == "dominant_period" else factor * v) for k, v in columns.items()}
    return {"name": label, "said": long_name, "unit": unit, "statistics": packed}
