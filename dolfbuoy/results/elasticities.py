"""Derivatives of a run's outputs in words and columns: percentage change per one per cent of each parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

#: Outputs shown by default.
USUAL = ("tension_top.max", "anchor.max", "cone_angle.max")


def columns_of_run(found: xr.Dataset, asked: bool) -> dict[str, NDArray[Any]]:
    """Elasticities (parameter,) of the outputs asked for, or the usual ones, by column heading."""
    names, parts = found.output.values.astype(str), found.output_of.values.astype(str)
    several = {name for name in names if (names == name).sum() > 1}
    return {
        f"{name} of {part}" if name in several else name: found.elasticity.values[:, k]
        for k, (name, part) in enumerate(zip(names, parts, strict=True))
        if asked or name in USUAL
    }


def order_of(found: xr.Dataset, columns: dict[str, NDArray[Any]]) -> NDArray[Any]:
    """Order of the parameters by decreasing largest elasticity in the columns."""
    sizes = [
        -max((abs(x[k]) for x in columns.values() if np.isfinite(x[k])), default=0)
        for k in range(found.sizes["parameter"])
    ]
    return np.argsort(sizes, kind="stable")


def value_of(found: xr.Dataset, k: int) -> str:
    """Value of a parameter with its unit; for a vector, a note that it is varied as a whole."""
    value, unit = found.parameter_value.values[k], found.parameter_unit.values[k]
    return "all of it" if np.isnan(value) else f"{value:.4g}{'' if unit == '1' else f' {unit}'}"


def percent(value: float) -> str:
    """An elasticity as text."""
    if not np.isfinite(value):
        return "-"
    if abs(value) < 5e-5:
        return "0"
    return f"{value:+.4f}" if abs(value) < 1 else f"{value:+.3f}"
