"""About an equilibrium, on the command line: small motions, stiffness, and how far loads push it."""

from typing import Annotated

import numpy as np
import typer

from ..errors import InputError
from ..results.tables import force_unit
from .app import app
from .shared import (
    OutOption,
    SceneArgument,
    SetOption,
    draw_into,
    finite,
    folder_of,
    load,
    out,
    page_of,
    print_table,
    rank,
    say_warnings,
    table_of,
)

DirectionOption = Annotated[
    float, typer.Option("--direction", callback=finite, help="Of surge and of the figures' plane, from x \\[deg].")
]
#: Damping ratios below this are rounding.
NO_DAMPING = 1e-9
#: Part of the largest stiffness that is shown as 0.
ROUNDING = 1e-10
PlotOption = Annotated[bool, typer.Option("--plot/--no-plot", help="Draw figures.")]


@app.command()
def modes(
    scene: SceneArgument,
    number: Annotated[int, typer.Option("--number", help="Of modes, the slowest first, 1 to 500.")] = 10,
    direction: DirectionOption = 0.0,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
    paraview: Annotated[bool, typer.Option("--paraview", help="Write the shapes, moving, for ParaView.")] = False,
):
    """Natural periods, damping and shapes about the equilibrium.  Example: dolfbuoy modes short --number 10"""
    from ..linear_api import modes as find
    from ..results.mode_figures import draw_modes
    from ..results.mode_record import KINDS
    from ..results.stiffness_record import on_friction

    loaded, folder = load(scene, assign), folder_of(scene, folder)
    found = find(loaded, number, folder, direction_deg=direction)
    if rank() != 0:
        return
    title = f"Modes of {loaded.title or scene}, {folder / 'modes.nc'}"
    shown = table_of(title, "", "what moves", "period [s]", "omega [rad/s]", "damping ratio", "residual", "")
    for i in range(found.sizes["mode"]):
        mode = found.isel(mode=i)
        numbers = [_number_of(mode[name].item()) for name in ("period", "omega", "damping_ratio")]
        shown.add_row(str(i + 1), mode.name.item(), *numbers, f"{mode.residual.item():.0e}", KINDS[mode.kind.item()])
    out.print(shown)
    for note in on_friction(loaded):
        out.print(note, soft_wrap=True)
    if plot:
        drawn = draw_modes(folder, found, loaded, paraview, direction)
        out.print(f"{len(drawn)} files in {folder}", soft_wrap=True)
        page_of("modes.nc", folder)


def _number_of(value):
    """A number of a mode; damping that is rounding is none."""
    return "-" if np.isnan(value) else f"{value:.5g}" if abs(value) > NO_DAMPING else "0"


@app.command()
def stiffness(scene: SceneArgument, folder: OutOption = None, assign: SetOption = None):
    """Restoring matrices of mooring and hull at the equilibrium.  Example: dolfbuoy stiffness short"""
    from ..linear_api import stiffness as find
    from ..results.response_record import each_buoy
    from ..results.stiffness_record import notes

    loaded, folder = load(scene, assign), folder_of(scene, folder)
    found = find(loaded, folder)
    if rank() != 0:
        return
    for of_buoy, one in each_buoy(found):
        _show_stiffness(of_buoy, one)
    for note in notes(found, loaded):
        out.print(note, soft_wrap=True)


def _show_stiffness(of_buoy, found):
    """Matrices of a buoy, and the eigenvalues of their symmetric parts."""
    for name in ("mooring", "hull", "total"):
        title = f"{found[name].attrs['long_name']}{of_buoy}; N and N m for 1 m and 1 rad"
        rows = zip(found.reaction.values.tolist(), _without_rounding(found[name].values), strict=True)
        rows = [(row, *map(_stiffness_text, values)) for row, values in rows]
        print_table(f"\n{title}", ("", *found.motion.values.tolist()), rows)
    title = f"\nEigenvalues of the symmetric parts{of_buoy}, turns at the radius of gyration [N/m]"
    values = {name: _without_rounding(found[f"{name}_eigenvalue"].values) for name in ("mooring", "hull", "total")}
    rows = [(name, *map(_stiffness_text, row)) for name, row in values.items()]
    print_table(title, ("", *map(str, range(1, 7))), rows)


def _without_rounding(values):
    """0 for what is very small beside the largest number."""
    largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    return np.where(np.abs(values) < ROUNDING * largest, 0.0, values)


def _stiffness_text(value):
    return f"{value:.5g}" if np.isfinite(value) else "rigid" if value > 0 else "-rigid"


@app.command()
def offsets(
    scene: SceneArgument,
    force: Annotated[str | None, typer.Option("--force", help="Sizes \\[N], a,b,c or start:stop:step.")] = None,
    current: Annotated[str | None, typer.Option("--current", help="Or speeds at the surface \\[m/s].")] = None,
    directions: Annotated[str, typer.Option("--directions", help="Of the load, from x \\[deg].")] = "0:330:30",
    buoy: Annotated[
        str | None, typer.Option("--buoy", help="Of several, which the force acts on \\[default: each].")
    ] = None,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
):
    """Offsets and tensions under loads from many sides.  Example: dolfbuoy offsets short --force 0:5000:500"""
    from ..api import offsets as find
    from ..results.offset_record import sentences
    from ..scene.variants import numbers_of

    if (force is None) == (current is None):
        raise InputError("--force: must be given, or --current, and not both.")
    what, text = ("force", force) if force is not None else ("current", current)
    sizes = numbers_of(f"--{what}", text)
    if min(sizes) < 0:
        raise InputError(f"--{what} {min(sizes):g}: must not be negative; --directions turns the load round.")
    turns = list(dict.fromkeys(angle % 360 for angle in numbers_of("--directions", directions)))
    loaded, folder = load(scene, assign), folder_of(scene, folder)
    if buoy is not None and what == "current":
        raise InputError("--buoy: goes with --force, a current flows past all of them.")
    found = find(loaded, sizes, turns, what, folder, buoys=None if buoy is None else [buoy])
    if rank() != 0:
        return
    _show_offsets(found, what, folder)
    say_warnings(sentences(found))
    if plot:
        _draw_offsets(found, loaded, folder)


def _show_offsets(found, what, folder):
    """Largest offset along the load and tension of each direction, and the watch circle of the largest load."""
    from ..results.offset_record import top_tension
    from ..results.response_record import each_buoy

    unit, factor = force_unit(found.tension_top.values)
    title, buoys = (
        f"Largest offset along the load and tension towards each side, {folder / 'offsets.nc'}",
        each_buoy(found),
    )
    offsets = [f"offset{of_buoy} [m]" for of_buoy, _ in buoys]
    shown = table_of(title, "direction [deg]", f"at {what}", *offsets, f"tension at the top [{unit}]")
    for direction in found.direction.values:
        one = found.sel(direction=direction)
        if not one.found.any():
            continue
        moved = [part.sel(direction=direction).offset_along for _, part in buoys] if "offset_along" in one else []
        row = int(np.nanargmax(np.max(moved, axis=0))) if moved else -1
        texts = [f"{values.values[row]:.5g}" for values in moved] or ["-"] * len(buoys)
        tension = f"{factor * top_tension(one).max().item():.5g}"
        shown.add_row(f"{direction:g}", f"{one[what].values[row]:g}", *texts, tension)
    out.print(shown)
    for of_buoy, one in buoys if found.sizes["direction"] > 2 else ():
        last = one.isel({what: -1})
        x, y = np.round(last.watch_centre.values, 9) + 0.0
        words = f"the watch circle{of_buoy} has a radius of {last.watch_radius.item():.4g} m about ({x:.4g}, {y:.4g})"
        if np.isfinite(x):
            size = f"{last[what].item():g} {'N' if what == 'force' else 'm/s'}"
            out.print(f"At {size} {words}.", soft_wrap=True)


def _draw_offsets(found, scene, folder):
    from ..results.offset_figures import offset_curves

    held = [end.top.position[:2] for piece in scene.network.pieces for end in piece.ends if end.held]
    target = draw_into(folder, "offsets", "offsets", offset_curves(found, held))
    out.print(f"figure: {target}.png", soft_wrap=True)
