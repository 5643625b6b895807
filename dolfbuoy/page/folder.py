"""Pages of what a folder holds: page.html of a run, modes.html, sweep.html, work-precision.html."""

import os
from pathlib import Path

from ..errors import InputError
from ..results.folder import enlist, remarks
from ..results.paraview import read_run
from ..results.record import replacing


def write_pages(folder: str | Path) -> list[Path]:
    """Write a page of each result that is in a folder; returns the files.

    Raises InputError if there is none, or if a file of the user's would be replaced.
    """
    folder = Path(folder)
    found = [write(folder) for name, write in PAGES.items() if os.path.isfile(folder / name)]
    if not found:
        raise InputError(f"{folder} holds nothing that has a page: none of {', '.join(PAGES)} is in it.")
    return found


def _run(folder):
    from .run_page import run_page

    record, scene = read_run(folder)
    enlist(folder, [folder / "page.html"])
    return _written(folder / "page.html", run_page(record, scene, remarks(folder, "run").get("advice")))


def _written(path, text):
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")
    return path


#: Name of a result: what writes its page.
PAGES = {"results.nc": _run}
