"""Small motions about an equilibrium on the command line: modes."""

from typing import Annotated

import typer

from .shared import OutOption, ParaviewOption, SceneArgument, SetOption, folder_of, load, out, rank, table_of

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


def add_to(app: typer.Typer) -> None:
    """Make them commands of an application."""
    app.command()(modes)
