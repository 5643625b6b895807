"""Common parts of the commands: options, and how scenes are loaded and results shown."""

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..errors import InputError
from ..parallel.ranks import rank
from ..results.tables import out, table
from ..writing import GIVEN, refuse_link

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from ..scene import Scene

err = Console(stderr=True)


def finite(param: typer.CallbackParam, value: float | None) -> float | None:
    """Callback of options in numbers: refuses nan and inf, which ranges of options let pass (InputError)."""
    if value is not None and not math.isfinite(value):
        raise InputError(f"{param.opts[0]} {value:g}: must be a finite number.")
    return value


def number(name: str, text: str, **limits: Any) -> Any:
    """Option in finite numbers; limits: min, max."""
    return typer.Option(name, callback=finite, help=text, **limits)


def out_option(default: str) -> Any:
    """The option --out with this default; its brackets must not be taken for a style."""
    return typer.Option("--out", help=f"Folder of the results \\[default: {default}].")


SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path of a TOML file.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="SECTION.KEY=VALUE", help="Change the scene, in TOML; KEY= or KEY=none takes a key away."
    ),
]
OutOption = Annotated[Path | None, out_option("results/NAME")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace results that are in the folder.")]
PlotOption = Annotated[bool, typer.Option("--plot/--no-plot", help="Draw figures.")]
ParaviewOption = Annotated[bool, typer.Option("--paraview/--no-paraview", help="Write ParaView files too.")]
SvgOption = Annotated[bool, typer.Option("--svg", help="Write each figure as SVG too.")]
InstantsOption = Annotated[
    int, typer.Option("--instants", min=1, max=100_000, help="Written for ParaView, of those recorded.")
]


def load(scene: str, assignments: list[str] | None, **overrides: Any) -> "Scene":
    """The scene of a command line."""
    from ..scene import load_scene, parse_assignment

    overrides |= dict(parse_assignment(text) for text in assignments or [])
    return load_scene(scene, **overrides)


def default_folder(folder: Path | None, name: str) -> Path:
    """Folder of the results, results/NAME unless one is given; a link must be given.  Raises InputError."""
    if folder is not None:
        return folder
    for place in (Path("results"), Path("results") / name):
        refuse_link(place, GIVEN)
    return place


def folder_of(scene: str, folder: Path | None, kind: str = "") -> Path:
    """Folder of the results of a scene, results/NAME or results/KIND-NAME unless one is given."""
    return default_folder(folder, f"{kind}{'-' if kind else ''}{Path(scene).stem}")


def table_of(title: str, *columns: str) -> Table:
    """An empty table, its numbers aligned to the right."""
    return table(title, columns, right=("value", "after the run"))


def print_table(title: str, columns: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print a table of rows of texts."""
    shown = table_of(title, *columns)
    for row in rows:
        shown.add_row(*row)
    out.print(shown)


def print_criteria(record: "xr.Dataset", scene: "Scene") -> None:
    """Print what governs of each criterion of a scene, if it has any."""
    from ..results.criteria import HEADINGS, governing, verdicts

    if judged := governing(verdicts(record, scene)):
        print_table("\nCriteria", HEADINGS, [one.row() for one in judged])


def print_kept_criteria(found: "xr.Dataset") -> None:
    """Print what governs of each criterion over the cases of a sweep or the runs of statistics, if they have any."""
    from ..results.criteria import HEADINGS

    if "criteria" in found.attrs:
        print_table("\nCriteria", HEADINGS, json.loads(found.attrs["criteria"]))


def say(*sentences: str) -> None:
    """On rank 0, a line each, as they are."""
    if rank() == 0:
        for sentence in sentences:
            out.print(sentence, soft_wrap=True, markup=False, highlight=False)


def say_warnings(warnings: Iterable[str]) -> None:
    """On rank 0, a line each."""
    if rank() == 0:
        for warning in warnings:
            out.print(f"[yellow]Warning:[/yellow] {escape(warning)}", soft_wrap=True)


def draw_into(folder: Path, kind: str, **figures: "Figure") -> None:
    """Save figures by their names in the folder of figures of a result of this kind."""
    from ..results.style import keep

    for name, figure in figures.items():
        keep(figure, folder, name, kind)


def page_of(name: str | None, folder: Path) -> None:
    """Write the page of a result in a folder, of all that are there without a name, and print where."""
    from ..page.folder import write_pages

    if rank() == 0:
        say(*(f"page to look at and to send: {path}" for path in write_pages(folder, name)))


class Interrupted(Exception):
    """Ctrl-C or SIGTERM: what there is, and what goes on with it."""
