"""`dolfbuoy periodic`: one period of the limit cycle."""

from typing import Annotated

import typer

from ..parallel.ranks import rank
from .app import app
from .shared import OutOption, SceneArgument, SetOption, folder_of, load, print_table, say, say_warnings


@app.command()
def periodic(
    scene: SceneArgument,
    folder: OutOption = None,
    assign: SetOption = None,
    accuracy: Annotated[str, typer.Option("--accuracy", help="Of the cycle, relative to the ranges.")] = "0.01%",
    most: Annotated[int, typer.Option("--periods", min=4, max=1_000_000, help="To be run at most.")] = 1000,
) -> None:
    """One period of the limit cycle, without its transient.  Example: dolfbuoy periodic long --set time.step=0.06"""
    from ..api import periodic as find
    from ..results.compare import parse_accuracy, percent
    from ..results.summary import summary, warnings

    loaded, folder = load(scene, assign), folder_of(scene, folder)
    record = find(loaded, folder, accuracy=parse_accuracy(accuracy), most=most)
    if rank() != 0:
        return
    title = f"\n{loaded.title or 'Limit cycle'}, {folder / 'periodic.nc'}"
    print_table(title, ("quantity", "value", "unit"), summary(record, loaded))
    count, error = record.attrs["cycle_periods"], percent(record.attrs["cycle_error"])
    say(f"The limit cycle to {error} of its ranges (estimated), after {count} periods.")
    say_warnings(warnings(record, loaded))
