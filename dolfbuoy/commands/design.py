"""`dolfbuoy design`: numbers of a scene for which something is least."""

from typing import Annotated

import typer

from .app import app
from .calibrate import bounds
from .shared import OutOption, SceneArgument, SetOption, folder_of, load, print_table, say, say_warnings


@app.command()
def design(
    scene: SceneArgument,
    vary: Annotated[
        str | None, typer.Option("--vary", metavar="KEY=LOW..HIGH,...", help="Numbers that may be chosen.")
    ] = None,
    least: Annotated[
        str | None, typer.Option("--least", help="Expression of keys and outputs that is to be least.")
    ] = None,
    hold: Annotated[list[str] | None, typer.Option("--hold", help="EXPRESSION < LIMIT, or >; may be repeated.")] = None,
    case: Annotated[
        list[str] | None,
        typer.Option("--case", metavar="KEY=VALUE;...", help="A load case, changes of the scene; may be repeated."),
    ] = None,
    folder: OutOption = None,
    assign: SetOption = None,
) -> None:
    """Numbers for which an expression is least within limits.  Without options: those of its design table."""
    from ..scene import parse_assignment
    from ..sensitivity import design as find

    loaded, folder = load(scene, assign), folder_of(scene, folder, "design")
    cases = [dict(parse_assignment(part) for part in text.split(";")) for text in case or []]
    found = find(loaded, bounds(vary, "--vary") if vary else None, least, hold, cases, folder)
    one = found.dataset
    rows = [
        (str(key), f"{float(one.begin[k]):.6g}", f"{float(one.value[k]):.6g}", str(one.parameter_unit.values[k]))
        for k, key in enumerate(one.parameter.values)
    ]
    print_table(f"\n{loaded.title or scene}, {folder / 'design.nc'}", ("number", "begin", "found", "unit"), rows)
    if one.sizes["limit"]:
        limits = [
            (
                str(text),
                f"{float(one.limit_value[k]):.6g}",
                f"{float(one.limit_bar[k]):.2g}".replace("nan", "-"),
                "yes" if bool(one.active[k]) else "no",
                _multiplier(one, k),
            )
            for k, text in enumerate(one.limit.values)
        ]
        print_table("Limits", ("limit", "reached", "error bar", "active", "gain for a unit more"), limits)
    say(f"{one.attrs['least_of']} = {one.attrs['least']:.6g}, after {one.attrs['runs']} runs")
    say(f"scene with these numbers: {folder / 'designed.toml'}")
    say_warnings(found.sentences)


def _multiplier(one, k):  # type: ignore[no-untyped-def]  # a Dataset
    return f"{float(one.multiplier[k]):.4g}" if bool(one.active[k]) else "-"
