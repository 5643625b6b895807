"""Moorings in the files of other programs, and a scene beside MoorDyn, on the command line."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..writing import refuse_present, write_text
from .app import app
from .shared import OverwriteOption, SceneArgument, SetOption, default_folder, err, finite, load, out, out_option, rank

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="Input of MoorDyn, or YAML of MoorPy or RAFT.")]
FormatArgument = Annotated[str, typer.Argument(metavar="FORMAT", help="moordyn, moorpy or raft.")]
PeerArgument = Annotated[str, typer.Argument(metavar="FORMAT", help="moordyn.")]
COLUMNS = {
    "quantity": "quantity",
    "unit": "unit",
    "mean": "mean",
    "mean_moordyn": "MoorDyn",
    "least": "least",
    "least_moordyn": "MoorDyn",
    "largest": "largest",
    "largest_moordyn": "MoorDyn",
    "bar": "+- of ours",
    "beyond": "differ by more",
    "percent": "rms difference [%]",
    "of": "of the",
}


@app.command("import")
def import_(
    kind: FormatArgument,
    file: FileArgument,
    target: Annotated[Path | None, typer.Option("--out", help="Scene file \\[default: FILE's name, .toml].")] = None,
):
    """A mooring of another program as a scene.  Example: dolfbuoy import moordyn lines.txt --out mine.toml"""
    from ..formats.files import as_toml, read

    scene, notes = read(kind, file)
    target = target if target is not None else Path(f"{file.stem}.toml")
    try:
        with target.open("x", encoding="utf-8") as new:
            new.write(as_toml(scene, notes, file.name))
    except FileExistsError:
        raise InputError(f"--out {target}: must be a new file; this one exists and is left as it is.") from None
    except OSError as error:
        raise InputError(f"--out {target}: cannot be written ({error.strerror}).") from None
    for note in notes:
        _say(f"{file.name}, {note}" if note.line else f"{file.name}: {note}")
    _say(f"{target}: check it with dolfbuoy check {target}")


@app.command()
def export(
    kind: PeerArgument,
    scene: SceneArgument,
    folder: out_option("results/moordyn-NAME") = None,
    assign: SetOption = None,
    overwrite: OverwriteOption = False,
):
    """A scene as input of MoorDyn 2.  Example: dolfbuoy export moordyn three-legs --out harbour"""
    from ..formats.to_moordyn import export as write
    from ..studies.peer import beginning

    _only_moordyn(kind)
    loaded = load(scene, assign)
    _needs_cable(loaded)
    folder = default_folder(folder, f"moordyn-{Path(scene).stem}")
    written = write(loaded, beginning(loaded))
    if rank() != 0:
        return
    refuse_present([folder / name for name in written.files], overwrite)
    _make(folder)
    for name, text in written.files.items():
        write_text(folder / name, text)
    for note in written.notes:
        _say(str(note))
    if written.driven:
        _say("Coupled points are moved by the program that calls MoorDyn: their motion is in none of these files")
    _say(f"{', '.join(written.files)} in {folder}")


@app.command()
def compare(
    kind: PeerArgument,
    scene: SceneArgument,
    end: Annotated[
        float | None, typer.Option("--t-end", min=1e-3, callback=finite, help="End of both runs \\[s].")
    ] = None,
    segments: Annotated[
        int, typer.Option("--segments", min=1, max=100, help="Of MoorDyn for each element of a line.")
    ] = 1,
    folder: out_option("results/moordyn-NAME") = None,
    assign: SetOption = None,
    overwrite: OverwriteOption = False,
):
    """A scene run by dolfbuoy and by MoorDyn, side by side.  Example: dolfbuoy compare moordyn bridle --t-end 30"""
    from ..results.style import files_of
    from ..studies import peer

    _only_moordyn(kind)
    loaded = load(scene, assign)
    _needs_cable(loaded)
    folder = default_folder(folder, f"moordyn-{Path(scene).stem}")
    refuse_present([folder / "comparison.json", *files_of(folder / "comparison")], overwrite)
    _make(folder)
    found = peer.compare(loaded, end, segments)
    if rank() != 0:
        return
    from ..results.tables import show

    for note in found.notes:
        err.print(f"MoorDyn: {note}", soft_wrap=True, markup=False, highlight=False)
    rows = [row | {"percent": 100 * row["relative"]} for row in found.rows]
    show("Second half of both runs", rows, COLUMNS)
    write_text(folder / "comparison.json", json.dumps({"rows": found.rows, "notes": found.notes}, indent=1) + "\n")
    peer.draw(found, folder)
    _say(f"comparison.json and its figure in {folder}")


def _only_moordyn(kind):
    if kind != "moordyn":
        raise InputError(f"FORMAT = {kind!r}: must be moordyn.")


def _needs_cable(scene):
    if scene.cable is None:
        raise InputError("SCENE: must have a [cable]: MoorDyn's input is of lines.")


def _make(folder):
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be made ({error.strerror}).") from None


def _say(text):
    if rank() == 0:
        out.print(text, soft_wrap=True, markup=False, highlight=False)
