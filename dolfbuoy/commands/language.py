"""The scene language on the command line: its keys, its schema, and new scenes."""

import contextlib
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..results.tables import out, table
from .app import app
from .shared import say


@app.command()
def keys(
    section: Annotated[str | None, typer.Argument(metavar="SECTION", help="Such as cable or cable.top.")] = None,
) -> None:
    """Keys of a scene: unit, default, range, meaning.  Example: dolfbuoy keys cable"""
    from ..scene.keys import keys_of

    shown = table("Keys of a scene", ("key", "unit", "default", "range", "meaning"), right=())
    for row in keys_of(section):
        shown.add_row(*row)
    out.print(shown)


@app.command()
def schema() -> None:
    """JSON Schema of a scene, for editors.  Example: dolfbuoy schema > schema.json"""
    from ..scene.schema import as_text

    out.print(as_text(), end="", soft_wrap=True, markup=False, highlight=False)


@app.command()
def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the scene; its file is NAME.toml.")],
    like: Annotated[str, typer.Option("--like", metavar="SCENE", help="Scene whose values it begins with.")] = "short",
) -> None:
    """A commented scene with every key, and schema.json for editors.  Example: dolfbuoy new mine --like free-buoy"""
    path = Path(name if name.endswith(".toml") else f"{name}.toml")
    write_new(path, like)
    say(f"{path}: check it with dolfbuoy check {path}")


def write_new(path: Path, like: str) -> None:
    """Write a commented scene with the values of another, and next to it the schema that it names, for editors; never
    over a file.  One like a shipped scene has the scheme and step that error bars recommend.  Raises InputError."""
    from ..scene import load_scene
    from ..scene.reading import recommended
    from ..scene.schema import FILE, as_text, commented

    if path.stem.startswith(".") or not path.stem.strip() or not str(path).isprintable():
        raise InputError(f"NAME = {str(path)!r}: must be the name of a file, in characters that can be printed.")
    text = commented(load_scene(like, title=path.stem, **recommended(like)), FILE.name)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
        with contextlib.suppress(FileExistsError), path.with_name(FILE.name).open("x", encoding="utf-8") as file:
            file.write(as_text())
    except FileExistsError:
        raise InputError(f"NAME = {str(path)!r}: must be a new file; this one exists and is left as it is.") from None
    except OSError as error:
        raise InputError(f"NAME = {str(path)!r}: must be a file that can be written ({error.strerror}).") from None
