"""Datasets without a time axis: modes, responses, stiffnesses, offsets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

#: Labels of the dimension `part` of complex numbers, which NetCDF lacks.
PARTS = ("real", "imaginary")
#: Dimensions, values, and attributes, or unit and long name.
Variable = tuple[Any, ...]


def unit_and_name(unit: str, text: str) -> dict[str, str]:
    """Attributes of a variable; without a unit, only its long name."""
    return {"units": unit, "long_name": text} if unit else {"long_name": text}


def labelled(
    variables: Mapping[str, Variable], labels: Mapping[str, Sequence[Any]], attributes: dict[str, Any]
) -> xr.Dataset:
    """A dataset of {name: (dimensions, values, (unit, long name))}; labels: coordinates by their dimension.

    Complex values are split into their two parts along the dimension `part`.
    """
    import xarray as xr

    made = {}
    for name, (dims, values, what) in variables.items():
        if np.iscomplexobj(values):
            values = np.stack([values.real, values.imag], axis=list(dims).index("part"))
        made[name] = dims, values, unit_and_name(*what)
    return xr.Dataset(made, {name: list(names) for name, names in labels.items()}, attributes)


def complex_of(variable: xr.DataArray) -> NDArray[Any]:
    """Complex values of a variable with the dimension `part`."""
    return np.asarray(variable.isel(part=0).values + 1j * variable.isel(part=1).values)
