"""`dolfbuoy calibrate`: numbers of a scene from what was measured."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .app import app
from .sensitivity import listed
from .shared import (
    OutOption,
    PlotOption,
    SceneArgument,
    SetOption,
    draw_into,
    folder_of,
    load,
    number,
    print_table,
    say,
    say_warnings,
)


@app.command()
def calibrate(
    scene: SceneArgument,
    record: Annotated[Path, typer.Option("--record", help="Measured: results.nc, or CSV with a column time.")],
    fit: Annotated[str, typer.Option("--fit", metavar="KEY=LOW..HIGH,...", help="Numbers to be found.")],
    of: Annotated[str, typer.Option("--of", help="Series with commas, as tension_top.")] = "tension_top",
    noise: Annotated[float | None, number("--noise", "Standard deviation of what was measured.", min=0)] = None,
    point: Annotated[
        str | None,
        typer.Option("--point", metavar="X,Y,Z", help="Of the buoy, whose acceleration_z and so on --of names."),
    ] = None,
    offset: Annotated[
        str | None,
        typer.Option("--offset", metavar="LOW..HIGH", help="Bounds of what the record's clock is ahead \\[s]."),
    ] = None,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
) -> None:
    """Numbers of a scene from measured series.  Example: dolfbuoy calibrate SCENE --record m.csv --fit KEY=1..9"""
    from ..scene.quantities import number_of
    from ..sensitivity import calibrate as find

    loaded, folder = load(scene, assign), folder_of(scene, folder, "calibrate")
    try:
        place = None if point is None else [number_of(part) for part in point.split(",")]
    except ValueError:
        raise InputError(f"--point {point}: must be X,Y,Z in metres.") from None
    clock = None if offset is None else bounds(f"time_offset={offset}", "--offset")["time_offset"]
    found = find(loaded, record, bounds(fit), listed("--of", of) or [], noise or None, folder, place, clock)
    one, rows = found.dataset, []
    for k, key in enumerate(one.parameter.values):
        unit = str(one.parameter_unit.values[k])
        numbers = (f"{float(one[name][k]):.5g}" for name in ("begin", "estimate", "deviation"))
        rows.append((str(key), *numbers, "" if unit == "1" else unit))
    print_table(
        f"\n{loaded.title or scene}, {folder / 'calibrate.nc'}",
        ("number", "scene", "estimate", "1 sigma", "unit"),
        rows,
    )
    unit = "the noise" if noise else "the standard deviation of the series"
    say(f"{one.attrs['runs']} runs; residuals are {one.attrs['residual']:.3g} of {unit} (rms).")
    say(f"scene with these numbers: {folder / 'calibrated.toml'}")
    say_warnings(found.sentences)
    if plot:
        from ..results.sweep_figure import residuals

        draw_into(folder, "calibrate", residuals=residuals(one))
        say(f"figure: {folder / 'figures' / 'residuals.png'}")


def bounds(text: str, option: str = "--fit") -> dict[str, tuple[float, float]]:
    """KEY=LOW..HIGH,... -> bounds by key.  Raises InputError."""
    from ..scene.quantities import number_of

    found = {}
    for part in text.split(","):
        key, equals, pair = (piece.strip() for piece in part.partition("="))
        low, dots, high = pair.partition("..")
        try:
            if not (key and equals and dots) or key in found:
                raise ValueError
            found[key] = number_of(low), number_of(high)
        except ValueError:
            raise InputError(f"{option} {part.strip()}: must have the form KEY=LOW..HIGH, each key once.") from None
    return found
