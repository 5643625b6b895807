"""`dolfbuoy uncertain`: scatter of results by what is not known exactly."""

from typing import Annotated

import typer

from ..parallel.ranks import rank
from ..results.tables import force_unit
from .app import app
from .sensitivity import listed
from .shared import OutOption, SceneArgument, SetOption, folder_of, load, print_table, say


@app.command()
def uncertain(
    scene: SceneArgument,
    method: Annotated[str, typer.Option("--method", help="first, chaos or samples.")] = "first",
    runs: Annotated[int | None, typer.Option("--runs", min=2, max=100_000, help="Of the scene's variants.")] = None,
    of: Annotated[str | None, typer.Option("--of", help="Outputs with commas, as tension_top.max.")] = None,
    folder: OutOption = None,
    assign: SetOption = None,
) -> None:
    """Scatter of outputs by numbers that are not known exactly.  Example: dolfbuoy uncertain scene.toml"""
    from ..sensitivity import uncertainty

    loaded, folder = load(scene, assign), folder_of(scene, folder, "uncertain")
    found = uncertainty(loaded, method, runs, listed("--of", of), folder)
    if rank() != 0:
        return
    rows, notes = [], []
    for k, name in enumerate(found.output.values):
        one, unit, factor = found.isel(output=k), str(found.output_unit.values[k]), 1.0
        if unit == "N":
            unit, factor = force_unit(abs(one["mean"].values))
        label = f"{name} of {found.output_of.values[k]}"
        numbers = [f"{factor * float(one[n]):.4g}" for n in ("mean", "sigma", "p05", "p95")]
        shares = [f"{100 * float(s):.0f} %" for s in one.share.values]
        rows.append((label, *numbers, unit, f"{float(one.r2):.2f}", *shares))
        if float(one.r2) < 0.8:
            notes.append(f"{label}: runs are not what this model says of them (R^2 = {float(one.r2):.2f}).")
    headings = ("output", "mean", "sigma", "5 %", "95 %", "unit", "R^2", *map(str, found.parameter.values))
    print_table(
        f"\n{loaded.title or scene}, {folder / 'uncertain.nc'}: scatter, and which number makes how much of it",
        headings,
        rows,
    )
    if notes and method == "first":
        notes.append("A linear answer would mislead: --method chaos, or samples.")
    say(*notes)
