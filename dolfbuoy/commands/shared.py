"""Common parts of the commands: options, and how scenes are loaded and results shown."""

import math
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from ..errors import InputError
from ..parallel.ranks import rank
from ..results.tables import out, table
from ..writing import GIVEN, refuse_link

err = Console(stderr=True)

SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path of a TOML file.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="SECTION.KEY=VALUE", help="Change the scene, in TOML; KEY= or KEY=none takes a key away."
    ),
]


def out_option(default):
    """The option --out with this default; its brackets must not be taken for a style."""
    return Annotated[Path | None, typer.Option("--out", help=f"Folder of the results \\[default: {default}].")]


def finite(param: typer.CallbackParam, value: float | None) -> float | None:
    """Callback of options in numbers: refuses nan and inf, which ranges of options let pass (InputError)."""
    if value is not None and not math.isfinite(value):
        raise InputError(f"{param.opts[0]} {value:g}: must be a finite number.")
    return value


OutOption = out_option("results/NAME")
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace results that are in the folder.")]
ParaviewOption = Annotated[bool, typer.Option("--paraview/--no-paraview", help="Write ParaView files too.")]
InstantsOption = Annotated[
    int, typer.Option("--instants", min=1, max=100_000, help="Written for ParaView, of those recorded.")
]
QuantityOption = Annotated[
    str, typer.Option("--quantity", help="tension_top, tension_anchor, buoy_position or cone_angle.")
]


def load(scene, assignments, **overrides):
    """The scene of a command line."""
    from ..scene import load_scene, parse_assignment

    overrides |= dict(parse_assignment(text) for text in assignments or [])
    return load_scene(scene, **overrides)


def default_folder(folder, name):
    """Folder of the results, results/NAME unless one is given; a link must be given.  Raises InputError."""
    if folder is not None:
        return folder
    for place in (Path("results"), Path("results") / name):
        refuse_link(place, GIVEN)
    return place


def folder_of(scene, folder):
    """Folder of the results of a scene."""
    return default_folder(folder, Path(scene).stem)


def table_of(title, *columns):
    """An empty table, its numbers aligned to the right."""
    return table(title, columns, right=("value", "after the run"))


def print_table(title, columns, rows):
    """Print a table of rows of texts."""
    shown = table_of(title, *columns)
    for row in rows:
        shown.add_row(*row)
    out.print(shown)


def draw_into(folder, kind, name, figure):
    """Save a figure in the folder of figures of a result of this kind; returns its path without the ending."""
    from ..results.folder import enlist
    from ..results.style import files_of, save
    from ..writing import made

    target = folder / "figures" / name
    made(folder, "figures")
    enlist(folder, files_of(target), kind)
    save(figure, target)
    return target


def say_warnings(warnings):
    """On rank 0, a line each."""
    if rank() == 0:
        for warning in warnings:
            out.print(f"[yellow]Warning:[/yellow] {escape(warning)}", soft_wrap=True)


def page_of(name, folder):
    """Write the page of a result in a folder, of all that are there without a name; says where."""
    from ..page.folder import write_pages

    if rank() != 0:
        return
    for path in write_pages(folder, name):
        out.print(f"page to look at and to send: {path}", soft_wrap=True, highlight=False)


class Interrupted(Exception):
    """Ctrl-C or SIGTERM; says what there is, and what goes on with it."""
