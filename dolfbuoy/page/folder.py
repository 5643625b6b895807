"""Pages of results: page.html, modes.html, sweep.html, work-precision.html in a folder, and any in a notebook."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import InputError
from ..results.folder import enlist, remarks
from ..results.record import fitting, read, undamaged
from ..writing import write_text

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene


class Page(NamedTuple):
    """Name of a page, the kind of its result, and the function that makes its text from the result's file."""

    name: str
    kind: str
    make: Callable[[Path], str]


def write_pages(folder: str | Path, name: str | None = None) -> list[Path]:
    """Write the page of a result in a folder, one of PAGES, or of all results there; returns the files.

    Raises InputError if there is no result, or if a file of the user's would be replaced.
    """
    folder, written = Path(folder), []
    for result, page in PAGES.items():
        if name in (None, result) and os.path.isfile(folder / result):
            text = page.make(folder / result)
            written.append(folder / page.name)
            enlist(folder, written[-1:], page.kind)
            write_text(written[-1], text)
    if not written:
        raise InputError(f"{folder} holds nothing that has a page: none of {', '.join(PAGES)} is in it.")
    return written


def _run(file: Path) -> str:
    from ..results.paraview import read_run
    from .run_page import run_page

    record, scene = read_run(file.parent)
    known, derivatives = remarks(file.parent, "run"), file.parent / "sensitivity.nc"
    slopes = read(derivatives) if os.path.isfile(derivatives) else None
    with fitting(file if slopes is None else derivatives):
        return run_page(record, scene, known.get("case"), slopes)


def _of_others(file: Path) -> str:
    """The page of modes.nc, sweep.nc or work-precision.json."""
    from .result_pages import modes_page, precision_page, sweep_page

    if file.suffix == ".json":
        with undamaged(file, "is damaged, or not of study work-precision: compute it again."):
            found = json.loads(file.read_text())
            return precision_page(found["rows"], found["notes"], found.get("title", ""))
    make: Callable[[Any], str] = modes_page if file.name == "modes.nc" else sweep_page
    with fitting(file):
        return make(read(file))


#: Page of each result, by file name of the result.
PAGES = {
    "results.nc": Page("page.html", "run", _run),
    "modes.nc": Page("modes.html", "modes", _of_others),
    "sweep.nc": Page("sweep.html", "sweep", _of_others),
    "work-precision.json": Page("work-precision.html", "study", _of_others),
}


class Shown:
    """The result of `dolfbuoy.show`; a notebook displays it at the end of a cell."""

    def __init__(self, page: str, height: int):
        self.page, self.height = page, height

    def _repr_html_(self) -> str:
        """A frame with the page, whose scripts cannot reach the notebook."""
        held = html.escape(self.page)
        look = f"width: 100%; height: {self.height}px; border: 1px solid #d5dce3"
        return f'<iframe srcdoc="{held}" sandbox="allow-scripts" style="{look}" title="dolfbuoy"></iframe>'

    def __repr__(self) -> Any:
        return f"<page of {len(self.page) / 1e6:.2g} MB: the last line of a notebook's cell shows it>"


def show(record: xr.Dataset, scene: Scene | None = None, height: int = 820) -> Shown:
    """The page of a record with its replay, in a frame of this height [pixels].

    record: from `simulate`, opened with xarray, or from `modes`.  scene: by default that in the record.
    Raises InputError for a dataset without a page.
    """
    if "eigenvalue" in record:
        from .result_pages import modes_page

        return Shown(modes_page(record, scene), height)
    if not record.sizes.get("time"):
        raise InputError("This is neither the record of a run nor modes: compute one with simulate, or modes.")
    from .run_page import run_page

    return Shown(run_page(record, scene), height)
