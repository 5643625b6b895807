"""`dolfbuoy sensitivity`: what moves the results of a scene."""

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from ..errors import InputError
from ..parallel.ranks import rank
from .app import app
from .shared import (
    OutOption,
    PlotOption,
    SceneArgument,
    SetOption,
    draw_into,
    folder_of,
    load,
    print_table,
    say,
)

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

#: Amplitude per metre below which a motion is none.
SMALL = 1e-6


@app.command()
def sensitivity(
    scene: SceneArgument,
    by: Annotated[str | None, typer.Option("--by", help="Keys of numbers with commas; without it all.")] = None,
    of: Annotated[str | None, typer.Option("--of", help="Outputs with commas, as tension_top.max.")] = None,
    every: Annotated[bool, typer.Option("--all", help="By all numbers of the scene that are not zero.")] = False,
    static: Annotated[bool, typer.Option("--static", help="Of the equilibrium.")] = False,
    periods: Annotated[bool, typer.Option("--modes", help="Of natural periods and damping.")] = False,
    response: Annotated[bool, typer.Option("--response", help="Of the largest linear response to waves.")] = False,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
) -> None:
    """Derivatives by numbers of the scene, in % for 1 %.  Example: dolfbuoy sensitivity short --by buoy.mass"""
    from ..results.elasticities import columns_of_run, order_of, percent, value_of
    from ..sensitivity import sensitivities

    if every and by is not None:
        raise InputError("--all: does not go with --by.")
    kinds = [name for name, chosen in (("static", static), ("modes", periods), ("response", response)) if chosen]
    if len(kinds) > 1:
        raise InputError(f"--{kinds[0]}: does not go with --{kinds[1]}.")
    loaded, folder = load(scene, assign), folder_of(scene, folder)
    what = kinds[0] if kinds else "run"
    found = sensitivities(loaded, listed("--by", by), listed("--of", of), folder, what)
    if rank() != 0:
        return
    columns = {"run": columns_of_run, "static": _at_rest, "modes": _of_modes, "response": _of_response}[what](
        found, of is not None
    )
    rows = [
        (str(found.parameter.values[k]), value_of(found, k), *(percent(x[k]) for x in columns.values()))
        for k in order_of(found, columns)
    ]
    title = (
        f"\n{loaded.title or scene}, {folder / 'sensitivity.nc'}: change in per cent for one per cent of each number"
    )
    print_table(title, ("number", "value", *columns), rows)
    if plot:
        from ..results.sweep_figure import tornado

        draw_into(folder, "sensitivity", tornado=tornado(found.parameter.values, columns))
        say(f"figure: {folder / 'figures' / 'tornado.png'}")


def listed(option: str, text: str | None) -> list[str] | None:
    """Names of an option with commas; None without it.  Raises InputError."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise InputError(f"{option} {text}: there is an empty name between the commas.")
    return names


def _at_rest(found: "xr.Dataset", asked: bool) -> dict[str, "NDArray[Any]"]:
    """Elasticities of tensions and of the lean."""
    columns = {}
    for name in ("tension_top", "tension_anchor", "cone_angle"):
        if name in found:
            kind = found[name].dims[0]
            for part in found[kind].values:
                one, slope = found[name].sel({kind: part}), found[f"d_{name}"].sel({kind: part})
                columns[name if found.sizes[kind] == 1 else f"{name} of {part}"] = _relative(
                    found, slope.values, one.values
                )
    return columns


def _of_modes(found: "xr.Dataset", asked: bool) -> dict[str, "NDArray[Any]"]:
    """Elasticities of the natural periods."""
    periods, names = found.period.values, found.name.values
    return {
        f"{names[k]} {periods[k]:.3g} s": _relative(found, found.d_period.values[:, k], periods[k])
        for k in range(len(periods))
        if np.isfinite(periods[k])
    }


def _of_response(found: "xr.Dataset", asked: bool) -> dict[str, "NDArray[Any]"]:
    """Elasticities of the largest amplitude of each motion of the buoys over the periods."""
    columns = {}
    for buoy in found.buoy.values if "buoy" in found.dims else ():
        for motion in found.motion.values:
            X, slope = (found[name].sel(buoy=buoy, motion=motion) for name in ("rao", "d_rao"))
            size = np.hypot(X.sel(part="real").values, X.sel(part="imaginary").values)
            k = int(size.argmax())
            if size[k] > SMALL:
                rate = (
                    sum(X.sel(part=p).values[k] * slope.sel(part=p).values[:, k] for p in ("real", "imaginary"))
                    / size[k]
                )
                several = f" of {buoy}" if found.sizes["buoy"] > 1 else ""
                columns[f"{motion}{several}, {found.period.values[k]:.3g} s"] = _relative(found, rate, size[k])
    return columns


def _relative(found: "xr.Dataset", slope: "NDArray[Any]", value: "NDArray[Any]") -> "NDArray[Any]":
    sizes = found.parameter_value.values
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(slope * np.where(np.isnan(sizes), 1.0, sizes) / value)
