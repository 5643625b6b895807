"""Depths of an uneven sea bed: a grid, from a table or a file, and the smooth surface through it."""

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from . import quantities as q
from .mesh_file import check_netcdf
from .quantities import Wrong, number_of
from .section import Section, key
from .wave_files import file_of, is_file, is_netcdf

Array = NDArray[Any]
MOST_LINES = 2000
_Lines = Annotated[list[q.Height], Field(min_length=2, max_length=MOST_LINES)]
#: Orders of the derivatives of the height by x and by y in `Depths.derivatives`.
ORDERS = (0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)
#: Names of depths in a netCDF file, and of heights.
DOWN, UP = ("depth", "deptho", "h"), ("elevation", "z", "topo", "altitude")


class Depths(Section):
    """Depths of the sea bed on a grid; between its lines a cubic surface, beyond them as on the border."""

    x: _Lines = key("x of the lines of the grid, growing", "m")
    y: _Lines = key("y of the lines of the grid, growing", "m")
    depth: Annotated[list[_Lines], Field(min_length=2, max_length=MOST_LINES)] = key(
        "depth below still water, one row per y with one number per x", "m"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name in ("x", "y"):
            if not q.is_rising(getattr(self, name)):
                raise Wrong(name, "[...]", "must be growing numbers")
        if len(self.depth) != len(self.y) or any(len(row) != len(self.x) for row in self.depth):
            raise Wrong("depth", "[...]", "must hold one row for each y, one number for each x")
        return self

    @cached_property
    def _surface(self) -> Any:
        from scipy.interpolate import RectBivariateSpline  # only needed for such a bed

        x, heights = _cubic(np.array(self.x), -np.array(self.depth, dtype=float).T)
        y, heights = _cubic(np.array(self.y), heights.T)
        return RectBivariateSpline(x, y, heights.T, s=0)

    def height(self, x: Any, y: Any) -> Array:
        """z of the bed [m] under (x, y)."""
        inside = np.clip(x, self.x[0], self.x[-1]), np.clip(y, self.y[0], self.y[-1])
        return np.asarray(self._surface.ev(*inside))

    def derivatives(self, x: Array, y: Array) -> Array:
        """z of the bed and its derivatives of ORDERS under (x, y), (..., 6)."""
        inside = np.clip(x, self.x[0], self.x[-1]), np.clip(y, self.y[0], self.y[-1])
        beyond = x != inside[0], y != inside[1]
        found = []
        for orders in ORDERS:
            values = np.asarray(self._surface.ev(*inside, dx=orders[0], dy=orders[1]))
            for order, out in zip(orders, beyond, strict=True):
                values = np.where(out, 0.0, values) if order else values
            found.append(values)
        return np.stack(found, axis=-1)


def _cubic(lines: Array, values: Array) -> tuple[Array, Array]:
    """Grid lines and values (lines, ...) for a cubic spline; two or three lines are extended by a polynomial."""
    if len(lines) > 3:
        return lines, values
    more = np.linspace(lines[0], lines[-1], 5)
    powers = np.arange(len(lines))
    scaled, wanted = ((one - lines[0]) / (lines[-1] - lines[0]) for one in (lines, more))
    basis = wanted[:, None] ** powers @ np.linalg.inv(scaled[:, None] ** powers)
    return more, basis @ values


def depths_of(value: Any) -> Any:
    """Value of `seabed.depths`, with the name of a file replaced by its grid.  Raises ValueError."""
    if not is_file(value):
        return value
    path = file_of(value, "a table of x, y and depth, or the name of a file")
    return _from_netcdf(path) if is_netcdf(path) else depths_from_text(path)


def depths_from_text(path: Path) -> dict[str, Any]:
    """The seafloor file of MoorDyn 2: counts of x and y, their values, then lines x y z; or the bathymetry of
    OpenFAST's MoorDyn: a title, nGridX, nGridY, a line of x, then y and depths row by row."""
    allowed = (
        "its file must be MoorDyn's: NX NY, a line of x, one of y, lines x y z; or a title, nGridX N, nGridY M, ..."
    )
    try:
        lines = [line.split() for line in path.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
        if len(lines[0]) == 2 and all(word.isdigit() for word in lines[0]):
            return _seafloor([[number_of(word) for word in words] for words in lines])
        sizes = {words[0].lower(): int(words[1]) for words in lines[1:3]}
        n, m = sizes["ngridx"], sizes["ngridy"]
        rows = [[number_of(word) for word in words] for words in lines[3 : 4 + m]]
    except (OSError, UnicodeDecodeError, ValueError, KeyError, IndexError):
        raise ValueError(allowed) from None
    if not rows or len(rows) != m + 1 or len(rows[0]) != n or any(len(row) != n + 1 for row in rows[1:]):
        raise ValueError(allowed)
    return {"x": rows[0], "y": [row[0] for row in rows[1:]], "depth": [row[1:] for row in rows[1:]]}


def _seafloor(rows: list[list[float]]) -> dict[str, Any]:
    """Grid from the rows of MoorDyn 2's file.  Raises ValueError or KeyError if points are missing."""
    _, x, y, *points = rows
    heights = {(a, b): z for a, b, z in points}
    if [len(x), len(y)] != [int(count) for count in rows[0]]:
        raise ValueError("other counts")
    return {"x": x, "y": y, "depth": [[-heights[a, b] for a in x] for b in y]}


def _from_netcdf(path: Path) -> dict[str, Any]:
    """depth(y, x), or elevation(y, x), of a netCDF file with coordinates x and y in metres."""
    import xarray as xr

    from ..elsewhere import netCDF4  # noqa: F401  # before xarray starts it

    check_netcdf(path)
    try:
        with xr.open_dataset(path, engine="netcdf4", decode_times=False) as data:
            name = next(name for name in (*DOWN, *UP) if name in data.data_vars)
            if data[name].size > MOST_LINES**2:
                raise ValueError(f"{name} must have {MOST_LINES**2:,} numbers at most")
            grid = data[name].squeeze().transpose("y", "x").sortby(["y", "x"]).load()
            values = grid.values.astype(float) * (1 if name in DOWN else -1)
            lines = {axis: grid[axis].values.astype(float).tolist() for axis in ("x", "y")}
    except (OSError, KeyError, RuntimeError, StopIteration):
        raise ValueError("its netCDF file must hold depth(y, x) or elevation(y, x) over x and y in metres") from None
    if not np.isfinite(values).all():
        raise ValueError("its netCDF file must have a depth everywhere on the grid")
    return lines | {"depth": values.tolist()}


BedGrid = Annotated[Depths, BeforeValidator(depths_of)]
