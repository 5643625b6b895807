"""Pages of a sweep, of natural modes and of `study work-precision`, with the data for their scripts."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from ..results.after_ramp import scene_of
from ..results.compare import pareto
from ..results.frame import Frames
from ..results.measured import QUANTITIES
from ..results.mode_record import KINDS, enlargement, moving
from ..results.quantities import shown_in
from ..results.sample import LASTS, STATISTICS
from ..results.series import described, each_series
from ..results.tables import unit_of
from . import html
from .html import fragment, tag
from .pack import single
from .view import base_view

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from ..scene.sections import Scene

#: Most numbers for which the page has all statistics; with more, only maxima, means and standard deviations.
MOST_NUMBERS = 600_000
FEWER = ("maximum", "mean", "standard_deviation")


def sweep_page(dataset: xr.Dataset) -> str:
    """HTML of sweep.nc."""
    found = sweep_data(dataset)
    done = int((dataset.status == "done").sum())
    cases = f"{dataset.sizes['case']:,} cases over {dataset.attrs['varied']}; {done:,} of them done"
    opens = "opens its replay, which is in records/ next to this file, and " if found["records"] else ""
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


def sweep_data(dataset: xr.Dataset) -> dict[str, Any]:
    """Data for the script of the page."""
    keys = dataset.attrs["varied"].split(", ")
    varied = [{"key": key, "values": _listed(dataset[key.replace(".", "_")].values)} for key in keys]
    quantities = each_series(dataset, "mean")
    kept = STATISTICS if len(quantities) * len(STATISTICS) * dataset.sizes["case"] <= MOST_NUMBERS else FEWER
    records = _listed(dataset.record.values) if "record" in dataset else []  # none links elsewhere
    return {
        "kind": "sweep",
        "varied": varied,
        "status": _listed(dataset.status.values),
        "quantities": [_quantity(*one, kept) for one in quantities],
        "lives": single(dataset.shortest_life.values) if "shortest_life" in dataset else None,
        "main": [label for main in shown_in("sweep page") for label, name, _ in quantities if name == main],
        "scene": "scene" in dataset.attrs,
        "source": dataset.attrs.get("source", ""),
        "records": [folder if re.fullmatch(r"records/[0-9a-f]{20}", folder) else "" for folder in records],
    }


def _listed(values: NDArray[Any]) -> list[Any]:
    return [value.item() if isinstance(value, np.generic) else value for value in values]


def _quantity(label: str, name: str, dataset: xr.Dataset, kept: tuple[str, ...]) -> dict[str, Any]:
    unit, long_name = described(name)
    kept = (*kept, LASTS) if f"{name}_{LASTS}" in dataset else kept
    columns = {statistic: dataset[f"{name}_{statistic}"].values for statistic in kept}
    unit, factor = unit_of(np.concatenate([columns[k] for k in kept if k != "dominant_period"]), unit)
    packed = {k: single(v if k == "dominant_period" else factor * v) for k, v in columns.items()}
    return {"name": label, "text": long_name, "unit": unit, "statistics": packed}


def modes_page(dataset: xr.Dataset, scene: Scene | None = None) -> str:
    """HTML of modes.nc.  Raises InputError for a dataset without a scene."""
    scene = scene or scene_of(dataset)
    effects = f"Small motions about the equilibrium of: {dataset.attrs.get('effects', '')}"
    note = "Shapes are enlarged so that they can be seen; their colours are the changes of the tension."
    return html.page(
        f"Modes of {scene.title or 'a scene'}",
        [effects, f"dolfbuoy {dataset.attrs['version_dolfbuoy']}"],
        fragment("stage", note=note),
        html.section("modes", "Modes", tag("div", id="table")),
        tag("div", class_="grid", id="charts"),
        tag("div", html.scene(scene.to_toml(), "modes"), html.versions(dataset.attrs), class_="grid"),
        data=modes_data(dataset, scene),
        script="modes",
    )


def modes_data(dataset: xr.Dataset, scene: Scene) -> dict[str, Any]:
    """Data for the script of the page."""
    frames = Frames(moving(dataset, 1, np.zeros(1), np.zeros(1)), scene)  # at rest
    view = base_view(frames) | {"direction": 0.0}
    for k, buoy in enumerate(view["buoys"]):
        at, turn = (dataset[f"rest_buoy_{what}"].values[k].tolist() for what in ("position", "orientation"))
        buoy |= {"rest": at, "turn": turn}
    if view["lines"]:
        view["rest"] = single(dataset.rest_cable_position.values)
        view["lines"]["s"] = single(dataset.s.values)
    return {"kind": "modes", "view": view, "modes": [_mode(dataset, i) for i in range(dataset.sizes["mode"])]}


def _mode(dataset: xr.Dataset, number: int) -> dict[str, Any]:
    mode = dataset.isel(mode=number)
    found: dict[str, Any] = {name: float(mode[name]) for name in ("period", "omega", "damping_ratio", "residual")}
    found |= {"name": mode.name.item(), "text": KINDS[mode.kind.item()]}
    found |= {"factor": enlargement(dataset, mode), "buoys": []}
    if "cable_position" in mode:
        found |= {"position": single(mode.cable_position.values), "tension": single(mode.cable_tension.values)}
        size = found["factor"] * float(np.abs(mode.cable_tension.values).max())
        unit, factor = unit_of([size], "N")
        found["scale"] = {"size": size, "text": f"{factor * size:.3g} {unit}"}
    if "buoy_position" in mode:
        motions = np.concatenate([mode.buoy_position.values, mode.buoy_rotation.values], axis=-1)
        found["buoys"] = [single(motion) for motion in np.moveaxis(motions, 1, 0)]
    return found


def precision_page(rows: list[dict[str, Any]], notes: list[str], scene: str = "") -> str:
    """HTML of the rows and notes of work-precision.json, with the title of its scene."""
    title = f"Work and precision of {scene}" if scene else "Work and precision"
    quantities = []
    for name in (name for name in QUANTITIES if any(f"bound_{name}" in row for row in rows)):
        done = [i for i, row in enumerate(rows) if row.get(f"bound_{name}") is not None]
        front = [done[i] for i in pareto([(rows[i]["wall"], rows[i][f"bound_{name}"]) for i in done])]
        quantities.append({"key": name, "name": QUANTITIES[name], "front": front})
    return html.page(
        title,
        [f"{len(rows)} cases against a finer reference"],
        tag("div", id="charts", class_="grid"),
        html.section("answer", "The answer", html.paragraphs(notes), class_="whole"),
        html.section("cases", "Cases", tag("div", id="table"), class_="whole"),
        data={"kind": "precision", "quantities": quantities, "rows": rows},
        script="precision",
    )
