"""Small motions, stiffness and offsets about an equilibrium, on the command line."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from ..errors import InputError
from ..parallel.ranks import rank
from ..results.tables import force_unit
from . import shared as cli
from .app import app

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

#: Damping ratios below this are rounding.
NO_DAMPING = 1e-9
#: Part of the largest stiffness that is shown as 0.
ROUNDING = 1e-10


@app.command()
def modes(
    scene: cli.SceneArgument,
    count: Annotated[int, typer.Option("--number", help="Of modes, the slowest first, 1 to 500.")] = 10,
    direction: Annotated[float, cli.number("--direction", "Of surge and of the figures' plane, from x \\[deg].")] = 0.0,
    folder: cli.OutOption = None,
    assign: cli.SetOption = None,
    plot: cli.PlotOption = True,
    paraview: Annotated[bool, typer.Option("--paraview", help="Write the shapes, moving, for ParaView.")] = False,
    svg: cli.SvgOption = False,
    oscillating: Annotated[bool, typer.Option("--oscillating", help="Only modes that have a period.")] = False,
) -> None:
    """Natural periods, damping and shapes about the equilibrium.  Example: dolfbuoy modes short --number 10"""
    from ..linear_api import modes as find
    from ..results.linear_record import on_friction
    from ..results.mode_figures import draw_modes
    from ..results.mode_record import KINDS

    loaded, folder = cli.load(scene, assign), cli.folder_of(scene, folder)
    found = find(loaded, count, folder, direction_deg=direction, oscillating=oscillating)
    if rank() != 0:
        return
    rows = []
    of_buoys = [name.split()[0] in ("surge", "sway", "heave", "roll", "pitch", "yaw") for name in found.name.values]
    for i in sorted(range(found.sizes["mode"]), key=lambda i: not of_buoys[i]):
        mode = found.isel(mode=i)
        numbers = [_number_of(mode[name].item()) for name in ("period", "omega", "damping_ratio")]
        rows.append([str(i + 1), mode.name.item(), *numbers, f"{mode.residual.item():.0e}", KINDS[mode.kind.item()]])
    headings = ("", "what moves", "period [s]", "omega [rad/s]", "damping ratio", "residual", "")
    cli.print_table(f"Modes of {loaded.title or scene}, {folder / 'modes.nc'}", headings, rows)
    cli.say(*on_friction(loaded), *filter(None, [found.attrs.get("notes", "")]))
    if plot:
        cli.say(f"{len(draw_modes(folder, found, loaded, paraview, direction, svg))} files in {folder}")
        cli.page_of("modes.nc", folder)


def _number_of(value: float) -> str:
    """A number of a mode; damping that is rounding is 0."""
    return "-" if np.isnan(value) else f"{value:.5g}" if abs(value) > NO_DAMPING else "0"


@app.command()
def stiffness(scene: cli.SceneArgument, folder: cli.OutOption = None, assign: cli.SetOption = None) -> None:
    """Restoring matrices of mooring, hull and vessels at the equilibrium.  Example: dolfbuoy stiffness short"""
    from ..linear_api import stiffness as find
    from ..results.linear_record import each_buoy, notes

    loaded, folder = cli.load(scene, assign), cli.folder_of(scene, folder)
    found = find(loaded, folder)
    if rank() != 0:
        return
    for of_buoy, one in each_buoy(found):
        _show_stiffness(of_buoy, one)
    for of_vessel, one in each_buoy(found, "vessel"):
        _show_matrix(one.vessel_mooring, of_vessel or f" of {one.vessel.item()}")
        pulls = _stiffness_texts(one.vessel_pull.values[None])
        cli.print_table(f"\n{one.vessel_pull.attrs['long_name'].capitalize()}", one.reaction.values.tolist(), pulls)
    cli.say(*notes(found, loaded))


def _show_matrix(matrix: "xr.DataArray", whose: str) -> None:
    title = f"{matrix.attrs['long_name']}{whose}; N and N m for 1 m and 1 rad"
    rows = zip(matrix.reaction.values.tolist(), _stiffness_texts(matrix.values), strict=True)
    cli.print_table(f"\n{title}", ("", *matrix.motion.values.tolist()), ([first, *texts] for first, texts in rows))


def _show_stiffness(of_buoy: str, found: "xr.Dataset") -> None:
    """Print matrices of a buoy, and the eigenvalues of their symmetric parts."""
    rows = []
    for name in ("mooring", "hull", "total"):
        _show_matrix(found[name], of_buoy)
        rows.append([name, *_stiffness_texts(found[f"{name}_eigenvalue"].values[None])[0]])
    title = f"\nEigenvalues of the symmetric parts{of_buoy}, turns at the radius of gyration [N/m]"
    cli.print_table(title, ("", *map(str, range(1, 7))), rows)


def _stiffness_texts(values: "NDArray[Any]") -> list[list[str]]:
    """Texts of a matrix; 0 for what is very small compared with the largest number."""
    values = np.where(np.abs(values) < ROUNDING * np.abs(values[np.isfinite(values)]).max(initial=0.0), 0.0, values)
    return [[f"{x:.5g}" if np.isfinite(x) else "rigid" if x > 0 else "-rigid" for x in row] for row in values]


@app.command()
def offsets(
    scene: cli.SceneArgument,
    force: Annotated[str | None, typer.Option("--force", help="Sizes \\[N], a,b,c or start:stop:step.")] = None,
    current: Annotated[str | None, typer.Option("--current", help="Or speeds at the surface \\[m/s].")] = None,
    directions: Annotated[str, typer.Option("--directions", help="Of the load, from x \\[deg].")] = "0:330:30",
    buoy: Annotated[
        str | None, typer.Option("--buoy", help="Of several, which the force acts on \\[default: each].")
    ] = None,
    folder: cli.OutOption = None,
    assign: cli.SetOption = None,
    plot: cli.PlotOption = True,
) -> None:
    """Offsets and tensions under loads from many sides.  Example: dolfbuoy offsets short --force 0:5000:500"""
    from ..api import offsets as find
    from ..results.linear_figures import offset_curves
    from ..results.offset_record import sentences
    from ..scene.variants import numbers_of

    given = [(name, text) for name, text in (("force", force), ("current", current)) if text is not None]
    if len(given) != 1:
        raise InputError("--force: must be given, or --current, and not both.")
    ((what, text),) = given
    sizes = numbers_of(f"--{what}", text)
    if min(sizes) < 0:
        raise InputError(f"--{what} {min(sizes):g}: must not be negative; --directions turns the load round.")
    turns = list(dict.fromkeys(angle % 360 for angle in numbers_of("--directions", directions)))
    loaded, folder = cli.load(scene, assign), cli.folder_of(scene, folder)
    if buoy is not None and what == "current":
        raise InputError("--buoy: goes with --force, a current flows past all of them.")
    found = find(loaded, sizes, turns, what, folder, buoys=None if buoy is None else [buoy])
    if rank() != 0:
        return
    _show_offsets(found, what, folder)
    cli.say_warnings(sentences(found))
    if plot:
        tops = [end.top for piece in loaded.network.pieces for end in piece.ends if end.held]
        held = [top.position[:2] for top in tops if top and top.position]
        cli.draw_into(folder, "offsets", offsets=offset_curves(found, held))
        cli.say(f"figure: {folder / 'figures' / 'offsets'}.png")


def _show_offsets(found: "xr.Dataset", what: str, folder: Path) -> None:
    """Print the largest offset along the load and tension towards each side, and watch circles of the largest load."""
    from ..results.linear_record import each_buoy
    from ..results.offset_record import top_tension

    unit, factor = force_unit(found.tension_top.values)
    buoys, rows = each_buoy(found), []
    for direction in found.direction.values:
        one = found.sel(direction=direction)
        if not one.found.any():
            continue
        moved = [part.sel(direction=direction).offset_along for _, part in buoys] if "offset_along" in one else []
        row = int(np.nanargmax(np.max(moved, axis=0))) if moved else -1
        texts = [f"{values.values[row]:.5g}" for values in moved] or ["-"] * len(buoys)
        tension = f"{factor * top_tension(one).max().item():.5g}"
        rows.append([f"{direction:g}", f"{one[what].values[row]:g}", *texts, tension])
    title = f"Largest offset along the load and tension towards each side, {folder / 'offsets.nc'}"
    names = [f"offset{of_buoy} [m]" for of_buoy, _ in buoys]
    cli.print_table(title, ("direction [deg]", f"at {what}", *names, f"tension at the top [{unit}]"), rows)
    for of_buoy, one in buoys if found.sizes["direction"] > 2 else ():
        last = one.isel({what: -1})
        x, y = np.round(last.watch_centre.values, 9) + 0.0
        if np.isfinite(x):
            size = f"{last[what].item():g} {'N' if what == 'force' else 'm/s'}"
            circle = f"a radius of {last.watch_radius.item():.4g} m about ({x:.4g}, {y:.4g})"
            cli.say(f"At {size} the watch circle{of_buoy} has {circle}.")
