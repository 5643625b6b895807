"""`dolfbuoy study ...`: one command per study."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="Studies.  Example: mpirun -n 2 dolfbuoy study convergence")

OutOption = Annotated[Path | None, typer.Option("--out", help="Folder of the results [default: results/study-NAME].")]


def folder_of(name: str, folder: Path | None) -> Path:
    """Folder of a study's results."""
    return folder if folder is not None else Path("results") / f"study-{name}"
