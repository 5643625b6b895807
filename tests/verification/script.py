"""What the scripts of this folder share: a command line, and a place for their cases."""

import hashlib
import sys
from collections.abc import Callable
from pathlib import Path

import typer

from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.studies.study import run_command


def start(main: Callable) -> None:
    """The command line of a script; bad input ends in one sentence and exit code 2, a failed solve in 1."""
    app = typer.Typer(add_completion=False)
    app.command()(main)
    try:
        app()
    except (InputError, SolveError) as error:
        print(f"Error: {error}", file=sys.stderr)
        sys.exit(2 if isinstance(error, InputError) else 1)


def make(name: str, study: Callable, out: Path | None, **options) -> None:
    """Make the tables of a script in results/study-NAME, or `out`; exit code 1 if it does not pass."""
    if not run_command(name, study, out, **options):
        raise typer.Exit(1)


def kept(folder: Path, file: str) -> Path:
    """Where the cases of a script are kept: elsewhere once the script has changed."""
    return Path(folder) / "work" / hashlib.sha256(Path(file).read_bytes()).hexdigest()[:12]
