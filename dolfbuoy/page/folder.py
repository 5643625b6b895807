"""Pages of what a folder holds: page.html of a run, modes.html, sweep.html, work-precision.html."""

import json
import os
from pathlib import Path

from ..errors import InputError
from ..results.folder import enlist, remarks
from ..writing import write_text


def write_pages(folder: str | Path, name: str | None = None) -> list[Path]:
    """Write the page of a result in a folder, one of PAGES, or of all that are there; returns the files.

    Raises InputError if there is none, or if a file of the user's would be replaced.
    """
    folder = Path(folder)
    wanted = PAGES if name is None else [name]
    found = [PAGES[one](folder) for one in wanted if os.path.isfile(folder / one)]
    if not found:
        raise InputError(f"{folder} holds nothing that has a page: none of {', '.join(PAGES)} is in it.")
    return found


def _run(folder):
    from ..results.paraview import read_run
    from ..results.record import fitting
    from .run_page import run_page

    record, scene = read_run(folder)
    enlist(folder, [folder / "page.html"])
    known = remarks(folder, "run")
    with fitting(folder / "results.nc"):
        text = run_page(record, scene, known.get("case"))
    return _written(folder / "page.html", text)


def _modes(folder):
    from ..results.record import fitting, read
    from .modes_page import modes_page

    enlist(folder, [folder / "modes.html"], "modes")
    with fitting(folder / "modes.nc"):
        text = modes_page(read(folder / "modes.nc"))
    return _written(folder / "modes.html", text)


def _sweep(folder):
    from ..results.record import fitting, read
    from .sweep_page import sweep_page

    enlist(folder, [folder / "sweep.html"], "sweep")
    with fitting(folder / "sweep.nc"):
        text = sweep_page(read(folder / "sweep.nc"))
    return _written(folder / "sweep.html", text)


def _precision(folder):
    from ..results.record import undamaged
    from .precision_page import precision_page

    file = folder / "work-precision.json"
    enlist(folder, [folder / "work-precision.html"], "study")
    with undamaged(file, "is damaged, or not of study work-precision: compute it again."):
        found = json.loads(file.read_text())
        text = precision_page(found["rows"], found["notes"], found.get("title", ""))
    return _written(folder / "work-precision.html", text)


def _written(path, text):
    write_text(path, text)
    return path


#: Name of a result: what writes its page.
PAGES = {"results.nc": _run, "modes.nc": _modes, "sweep.nc": _sweep, "work-precision.json": _precision}
