"""Moorings in the files of other programs, and comparisons with MoorDyn, on the command line."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from ..parallel.ranks import rank
from ..results.tables import show, unit_of
from ..writing import refuse_present, write_text
from .app import app
from .shared import OverwriteOption, SceneArgument, SetOption, err, folder_of, load, number, out_option, say

if TYPE_CHECKING:
    from ..scene import Scene

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="Input of MoorDyn or MAP++, or YAML of the others.")]
FormatArgument = Annotated[str, typer.Argument(metavar="FORMAT", help="moordyn, map, moorpy, raft, wisdem or famodel.")]
PeerArgument = Annotated[str, typer.Argument(metavar="FORMAT", help="moordyn.")]
OutOption = Annotated[Path | None, out_option("results/moordyn-NAME")]
COLUMNS = {"quantity": "quantity", "unit": "unit"}
for _name in ("mean", "least", "largest"):
    COLUMNS |= {_name: _name, f"{_name}_moordyn": "MoorDyn"}
COLUMNS |= {"bar": "+- of ours", "beyond": "differ by more", "percent": "rms difference [%]", "of": "of the"}


@app.command("import")
def import_(
    kind: FormatArgument,
    file: FileArgument,
    target: Annotated[Path | None, typer.Option("--out", help="Scene file \\[default: FILE's name, .toml].")] = None,
    columns: Annotated[
        str, typer.Option("--columns", help="Of MoorDyn: found by name, or by place as in MoorDyn 2.")
    ] = "name",
    depth: Annotated[
        float | None, number("--depth", "Of the water, where FILE does not give it \\[m].", min=1e-3, max=1e5)
    ] = None,
) -> None:
    """A mooring of another program as a scene.  Example: dolfbuoy import moordyn lines.txt --out mine.toml"""
    from ..formats.files import as_toml, read

    scene, notes = read(kind, file, columns, depth)
    target = target if target is not None else Path(f"{file.stem}.toml")
    try:
        with target.open("x", encoding="utf-8") as new:
            new.write(as_toml(scene, notes, file.name))
    except FileExistsError:
        raise InputError(f"--out {target}: must be a new file; this one exists and is left as it is.") from None
    except OSError as error:
        raise InputError(f"--out {target}: cannot be written ({error.strerror}).") from None
    say(*(f"{file.name}, {note}" if note.line else f"{file.name}: {note}" for note in notes))
    say(f"{target}: check it with dolfbuoy check {target}")


@app.command()
def export(
    kind: PeerArgument,
    scene: SceneArgument,
    folder: OutOption = None,
    assign: SetOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """A scene as input of MoorDyn 2.  Example: dolfbuoy export moordyn three-legs --out harbour"""
    from ..formats.to_moordyn import export as write
    from ..studies.peer import beginning

    loaded, folder = _of_lines(kind, scene, assign), folder_of(scene, folder, "moordyn")
    written = write(loaded, beginning(loaded))
    if rank() != 0:
        return
    refuse_present([folder / name for name in written.files], overwrite)
    _make(folder)
    for name, text in written.files.items():
        write_text(folder / name, text)
    say(*map(str, written.notes))
    if written.driven:
        say("Coupled points are moved by the program that calls MoorDyn: their motion is in none of these files")
    say(f"{', '.join(written.files)} in {folder}")


@app.command()
def compare(
    kind: PeerArgument,
    scene: SceneArgument,
    end: Annotated[float | None, number("--t-end", "End of both runs \\[s].", min=1e-3)] = None,
    segments: Annotated[
        int, typer.Option("--segments", min=1, max=100, help="Of MoorDyn for each element of a line.")
    ] = 1,
    folder: OutOption = None,
    assign: SetOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """A scene run by dolfbuoy and by MoorDyn, side by side.  Example: dolfbuoy compare moordyn bridle --t-end 30"""
    from ..results.style import files_of
    from ..studies import peer

    loaded, folder = _of_lines(kind, scene, assign), folder_of(scene, folder, "moordyn")
    refuse_present([folder / "comparison.json", *files_of(folder / "comparison")], overwrite)
    _make(folder)
    found = peer.compare(loaded, end, segments)
    if rank() != 0:
        return
    for note in found.notes:
        err.print(f"MoorDyn: {note}", soft_wrap=True, markup=False, highlight=False)
    rows = [_in_its_unit(row) | {"percent": 100 * row["relative"]} for row in found.rows]
    show("Second half of both runs", rows, COLUMNS)
    write_text(folder / "comparison.json", json.dumps({"rows": found.rows, "notes": found.notes}, indent=1) + "\n")
    peer.draw(found, folder)
    say(f"comparison.json and its figure in {folder}")


def _in_its_unit(row: dict[str, Any]) -> dict[str, Any]:
    """A row of a comparison with forces in the unit of their size."""
    unit, factor = unit_of([row[name] for name in ("mean", "least", "largest")], row["unit"])
    sizes = (*(f"{name}{ending}" for name in ("mean", "least", "largest") for ending in ("", "_moordyn")), "bar")
    return row | {"unit": unit} | {name: factor * row[name] for name in sizes if row[name] is not None}


def _of_lines(kind: str, scene: str, assignments: list[str] | None) -> "Scene":
    """The scene of a command line that is about MoorDyn.  Raises InputError for another format, or without a line."""
    if kind != "moordyn":
        raise InputError(f"FORMAT = {kind!r}: must be moordyn.")
    loaded = load(scene, assignments)
    if loaded.cable is None:
        raise InputError("SCENE: must have a [cable]: MoorDyn's input is of lines.")
    return loaded


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be made ({error.strerror}).") from None
