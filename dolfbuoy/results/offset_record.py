"""Offset curves as a dataset, offsets.nc: recorded quantities of equilibria over directions and sizes of a load."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .cautions import is_under
from .labelled import Variable, unit_and_name
from .observe import Observer, attributes
from .offsets import smallest_circle
from .record import dataset_of

if TYPE_CHECKING:
    import xarray as xr

    from ..model.problem import Problem

#: A line is slack below this fraction of the typical force of its scene.
LEAST_TENSION = 1e-4
LOADS = {
    "force": ("N", "horizontal force, added to the scene's"),
    "current": ("m s-1", "speed of the current at the surface"),
}
TOWARDS = unit_and_name("degree", "direction of the load, from x towards y")
_LOADED = {
    "found": ("1", "whether there is an equilibrium"),
    "slack": ("1", "whether some of the line is slack"),
    "under": ("1", "whether a buoy is drawn under the water"),
    "smallest_tension": ("N", "smallest mean tension of an element"),
    "offset": ("m", "horizontal distance of C from where it rests without current, wind and external force"),
    "offset_along": ("m", "the part of it along the load"),
    "watch_radius": ("m", "radius of the smallest circle around the places of C under loads towards all sides"),
    "watch_centre": ("m", "its centre"),
}
LOADED = {name: unit_and_name(*words) for name, words in _LOADED.items()}
DRAWN_UNDER = "the buoy is drawn under the water"


class Rows:
    """Collects equilibria (`statics.offsets.Rest`) one by one; collective."""

    def __init__(self, load: str) -> None:
        self.load = load
        self._observer: Observer | None = None
        self._rows: list[tuple[float, float, dict[str, Any]]] = []
        self.attributes: dict[str, Any] = {}
        self.labels: dict[str, NDArray[Any]] = {}

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, rest: Any) -> None:
        """Add an equilibrium; its Problem may change afterwards."""
        row = {"found": rest.problem is not None, "slack": False, "under": False}
        if rest.problem is not None:
            row |= self._values(rest.problem)
        self._rows.append((rest.direction, rest.size, row))

    def _values(self, problem: Problem) -> dict[str, Any]:
        if self._observer is None or self._observer.problem is not problem:
            self._observer, self.attributes = Observer(problem), attributes(problem)
            self.labels = self._observer.labels()
        smallest = problem.smallest_tension(of_rods=False)
        values = self._observer.values(problem.end_forces())
        slack, scene = smallest <= LEAST_TENSION * problem.typical_force, problem.scene
        displaced = values.get("displaced_mass") if scene.sea is not None else None
        buoys = () if displaced is None else zip(displaced, scene.network.buoys.values(), strict=True)
        under = any(is_under(mass, scene, buoy) for mass, buoy in buoys)
        values = {name: value for name, value in values.items() if name not in LOADED}
        return values | {"smallest_tension": smallest, "slack": slack, "under": under}

    def dataset(self, at_rest: NDArray[Any] | None) -> xr.Dataset:
        """Dataset of all equilibria on rank 0; at_rest: r_C without any load [m], or None."""
        import xarray as xr

        shapes = {name: np.shape(value) for _, _, row in self._rows for name, value in row.items()}
        directions = list(dict.fromkeys(direction for direction, _, _ in self._rows))
        sizes = list(dict.fromkeys(size for _, size, _ in self._rows))
        data = {}
        for name, shape in shapes.items():
            values = [row.get(name, np.full(shape, np.nan)) for _, _, row in self._rows]
            data[name] = np.reshape(values, (len(directions), len(sizes), *shape))
        recorded = {n: np.zeros(s) for n, s in shapes.items() if n not in LOADED}
        described = dataset_of(recorded, {}, self.attributes, self.labels)
        over, variables = ("direction", self.load), dict[str, Variable]()
        for name, one in described.data_vars.items():
            variables[str(name)] = (*over, *one.dims), data[str(name)], one.attrs
        for name in (n for n in LOADED if n in data):
            variables[name] = over, data[name], LOADED[name]
        made = xr.Dataset(variables, attrs=self.attributes)
        made = made.assign_coords({k: described[k] for k in described.coords})
        made["direction"] = "direction", directions, TOWARDS
        made[self.load] = self.load, sizes, unit_and_name(*LOADS[self.load])
        if "buoy_position" in made:
            made = _with_watch_circles(made)
        if "buoy_position" in made and at_rest is not None:
            dx, dims = made.buoy_position.values - at_rest, made.buoy_position.dims[:-1]
            angle = np.radians(made.direction.values).reshape(-1, *[1] * (len(dims) - 1))
            made["offset"] = (dims, np.hypot(dx[..., 0], dx[..., 1]), LOADED["offset"])
            along = dx[..., 0] * np.cos(angle) + dx[..., 1] * np.sin(angle)
            made["offset_along"] = (dims, along, LOADED["offset_along"])
        return made


def top_tension(dataset: xr.Dataset) -> xr.DataArray:
    """Largest tension at the upper end of a line [N], over directions and sizes."""
    largest: xr.DataArray = dataset.tension_top.max("cable")
    return largest


def _with_watch_circles(made: xr.Dataset) -> xr.Dataset:
    """Add the watch circle for each load size and buoy; nan if an equilibrium is missing in some direction."""
    import xarray as xr

    places = made.buoy_position.isel(xyz=slice(2)).rename(xyz="xy")
    found = xr.apply_ufunc(
        _circle, places, input_core_dims=[["direction", "xy"]], output_core_dims=[["part"]], vectorize=True
    )
    made["watch_centre"] = found.isel(part=slice(2)).rename(part="xy").assign_attrs(LOADED["watch_centre"])
    made["watch_radius"] = found.isel(part=2).assign_attrs(LOADED["watch_radius"])
    return made.assign_coords(xy=["x", "y"])


def _circle(places: NDArray[Any]) -> NDArray[Any]:
    if not np.isfinite(places).all():
        return np.full(3, np.nan)
    centre, radius = smallest_circle(places)
    return np.array([*centre, radius])


def sentences(dataset: xr.Dataset) -> list[str]:
    """Warnings, one for each kind and direction."""
    load, found = dataset.slack.dims[1], []
    unit = LOADS[load][0].replace(" s-1", "/s")
    for direction in dataset.direction.values:
        one = dataset.sel(direction=direction)
        for bad, words in (
            (one.slack.values, "some of the line is slack"),
            (one.under.values, DRAWN_UNDER if one.sizes.get("buoy") == 1 else "a buoy is drawn under the water"),
            (~one.found.values.astype(bool), "no equilibrium was found"),
        ):
            sizes = one[load].values[np.asarray(bad, dtype=bool)]
            if len(sizes):
                reach = f"{sizes[0]:g}" if len(sizes) == 1 else f"{sizes[0]:g} to {sizes[-1]:g}"
                found.append(f"Towards {direction:g} degrees, at {reach} {unit}: {words}.")
    return found
