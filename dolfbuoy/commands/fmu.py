"""`dolfbuoy fmu`: a scene for programs that couple FMUs."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..writing import refuse_present
from .app import app
from .shared import OverwriteOption, SceneArgument, SetOption, load, say


@app.command()
def fmu(
    scene: SceneArgument,
    driven: Annotated[
        list[str] | None,
        typer.Option("--drive", metavar="NAME", help="End of a line, CABLE.to, or buoy that is moved."),
    ] = None,
    target: Annotated[Path | None, typer.Option("--out", help="File \\[default: SCENE's name, .fmu].")] = None,
    assign: SetOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """A scene as FMU for co-simulation (FMI 3.0).  Example: dolfbuoy fmu three-legs --drive buoy --out mooring.fmu"""
    from ..coupling.fmu import export

    target = target if target is not None else Path(f"{Path(scene).stem}.fmu")
    if target.suffix != ".fmu":
        raise InputError(f"--out {target}: must end in .fmu.")
    refuse_present([target], overwrite)
    layout = export(load(scene, assign), target, driven or ())
    counts = [sum(one.causality == kind for one in layout.variables) for kind in ("input", "output")]
    say(f"{target}: {counts[0]} inputs, {counts[1]} outputs; it calls the dolfbuoy that is installed here")
