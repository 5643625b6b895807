"""About an equilibrium, on the command line: small motions, stiffness, and how far loads push it."""

from typing import Annotated

import numpy as np
import typer

from ..errors import InputError
from ..results.tables import force_unit
from .shared import (
    OutOption,
    ParaviewOption,
    SceneArgument,
    SetOption,
    folder_of,
    load,
    out,
    rank,
    say_warnings,
    table_of,
)

DirectionOption = Annotated[
    float, typer.Option("--direction", help="Of surge and of the figures' plane, from x \\[deg].")
]
PlotOption = Annotated[bool, typer.Option("--plot/--no-plot", help="Draw figures.")]


def modes(
    scene: SceneArgument,
    number: Annotated[int, typer.Option("--number", min=1, help="Of modes, the slowest first.")] = 10,
    direction: DirectionOption = 0.0,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
    paraview: ParaviewOption = True,
):
    """Natural periods, damping and shapes about the equilibrium.  Example: dolfbuoy modes short --number 10"""
    from ..api import modes as find
    from ..results.mode_figures import draw_modes
    from ..results.mode_record import KINDS

    loaded, folder = load(scene, assign), folder_of(scene, folder)
    found = find(loaded, number, folder, direction_deg=direction)
    if rank() != 0:
        return
    title = f"Modes of {loaded.title or scene}, {folder / 'modes.nc'}"
    shown = table_of(title, "", "what moves", "period [s]", "omega [rad/s]", "damping ratio", "residual", "")
    for i in range(found.sizes["mode"]):
        mode = found.isel(mode=i)
        numbers = [f"{mode[name].item():.5g}" for name in ("period", "omega", "damping_ratio")]
        numbers = ["-" if text == "nan" else text for text in numbers]
        shown.add_row(str(i + 1), mode.name.item(), *numbers, f"{mode.residual.item():.0e}", KINDS[mode.kind.item()])
    out.print(shown)
    if plot:
        drawn = draw_modes(folder, found, loaded, paraview, direction)
        out.print(f"{len(drawn)} files in {folder}", soft_wrap=True)


def stiffness(scene: SceneArgument, folder: OutOption = None, assign: SetOption = None):
    """Restoring matrices of mooring and hull at the equilibrium.  Example: dolfbuoy stiffness short"""
    from ..api import stiffness as find
    from ..results.stiffness_record import notes

    loaded, folder = load(scene, assign), folder_of(scene, folder)
    found = find(loaded, folder)
    if rank() != 0:
        return
    motions = found.motion.values.tolist()
    for name in ("mooring", "hull", "total"):
        title = f"{found[name].attrs['long_name']}; N and N m for 1 m and 1 rad"
        shown = table_of(f"\n{title}", "", *motions)
        for row, values in zip(found.reaction.values.tolist(), found[name].values, strict=True):
            shown.add_row(row, *(f"{value:.5g}" for value in values))
        out.print(shown)
    title = "\nEigenvalues of the symmetric parts, turns at the radius of gyration [N/m]"
    shown = table_of(title, "", *map(str, range(1, 7)))
    for name in ("mooring", "hull", "total"):
        shown.add_row(name, *(f"{value:.5g}" for value in found[f"{name}_eigenvalue"].values))
    out.print(shown)
    for note in notes(found, loaded):
        out.print(note, soft_wrap=True)


def offsets(
    scene: SceneArgument,
    force: Annotated[str | None, typer.Option("--force", help="Sizes \\[N], a,b,c or start:stop:step.")] = None,
    current: Annotated[str | None, typer.Option("--current", help="Or speeds at the surface \\[m/s].")] = None,
    directions: Annotated[str, typer.Option("--directions", help="Of the load, from x \\[deg].")] = "0:330:30",
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
    what, sizes = ("force", numbers_of("--force", force)) if force else ("current", numbers_of("--current", current))
    turns = list(dict.fromkeys(angle % 360 for angle in numbers_of("--directions", directions)))
    loaded, folder = load(scene, assign), folder_of(scene, folder)
    found = find(loaded, sizes, turns, what, folder)
    if rank() != 0:
        return
    _show_offsets(found, what, folder)
    say_warnings(sentences(found))
    if plot:
        _draw_offsets(found, loaded, folder)


def _show_offsets(found, what, folder):
    """Largest offset and tension of each direction."""
    unit, factor = force_unit(found.tension_top.values)
    title = f"Largest offset and tension towards each side, {folder / 'offsets.nc'}"
    shown = table_of(title, "direction [deg]", f"at {what}", "offset [m]", f"tension at the top [{unit}]")
    for direction in found.direction.values:
        one = found.sel(direction=direction)
        if one.found.any():
            row = one.isel({what: int(np.nanargmax(one.offset.values))}) if "offset" in one else one.isel({what: -1})
            offset = f"{row.offset.item():.5g}" if "offset" in row else "-"
            tension = f"{factor * one.tension_top.max().item():.5g}"
            shown.add_row(f"{direction:g}", f"{row[what].item():g}", offset, tension)
    out.print(shown)


def _draw_offsets(found, scene, folder):
    from ..results.folder import enlist
    from ..results.offset_figures import offset_curves
    from ..results.style import files_of, save

    target = folder / "figures" / "offsets"
    enlist(folder, files_of(target), "offsets")
    target.parent.mkdir(exist_ok=True)
    save(offset_curves(found, scene.anchor[:2]), target)
    out.print(f"figure: {target}.png", soft_wrap=True)


def add_to(app: typer.Typer) -> None:
    """Make them commands of an application."""
    for command in (modes, stiffness, offsets):
        app.command()(command)
