"""The page of natural modes: a table of them, and each shape moving in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..results.after_ramp import scene_of
from ..results.frame import Frames
from ..results.mode_record import KINDS, enlargement, moving
from ..results.tables import unit_of
from . import html
from .document import fragment, tag
from .pack import single
from .view import base_view

if TYPE_CHECKING:
    import xarray as xr

    from ..scene.sections import Scene


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
        data=data_of(dataset, scene),
        script="modes",
    )


def data_of(dataset: xr.Dataset, scene: Scene) -> dict[str, Any]:
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
    found |= {"name": mode.name.item(), "said": KINDS[mode.kind.item()]}
    found |= {"factor": enlargement(dataset, mode), "buoys": []}
    if "cable_position" in mode:
        found |= {"position": single(mode.cable_position.values), "tension": single(mode.cable_tension.values)}
        size = found["factor"] * float(np.abs(mode.cable_tension.values).max())
        unit, factor = unit_of([size], "N")
        found["scale"] = {"size": size, "said": f"{factor * size:.3g} {unit}"}
    if "buoy_position" in mode:
        motions = np.concatenate([mode.buoy_position.values, mode.buoy_rotation.values], axis=-1)
        found["buoys"] = [single(motion) for motion in np.moveaxis(motions, 1, 0)]
    return found
