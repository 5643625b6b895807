"""Runner of studies: computes cases once, then writes and shows their tables.

A study is a function of its results folder and options that computes its cases by `parallel.cases.evaluate_all` and
returns its tables on rank 0, an empty list on the others.  The rows do not depend on the number of ranks.
"""

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..elsewhere import MPI
from ..errors import InputError
from ..page.folder import PAGES, write_pages
from ..results import style
from ..results.folder import claimed, enlist, refuse_own
from ..results.style import Figure, matplotlib
from ..results.tables import markdown, show
from ..scene import Scene
from ..writing import GIVEN, refuse_link, replacing, write_text

Row = dict[str, Any]  #: of a table, or a case before it is computed


def refuse_network(scene: Scene) -> None:
    """Raise InputError for a scene with more than one piece of line or more than one buoy."""
    if max(len(scene.network.pieces), len(scene.network.buoys)) > 1:
        raise InputError("SCENE: this study is of one [cable] and one [buoy], and this scene is a network.")


@dataclass
class Table:
    """Rows written to NAME.json and .csv, and a figure to .png and .svg; if it has columns, shown and in tables.md.

    title: "{folder}" in it becomes the folder of the results.  columns: key -> heading.  A table without a name is only
    shown.  passed: False if a study that must pass fails.
    """

    name: str
    rows: list[Row]
    title: str = ""
    columns: dict[str, str] | None = None
    notes: list[str] = field(default_factory=list)
    figure: Figure | None = None
    passed: bool = True


@dataclass
class Outcome:
    """Rows of the tables by name, empty on all ranks but 0; True if all passed."""

    rows: dict[str, list[Row]]
    passed: bool


def run(study: Callable[..., list[Table]], folder: Path, **options: Any) -> Outcome:
    """Compute missing cases, write the tables of a study into `folder` and show them."""
    with matplotlib.rc_context(style.STYLE):
        tables = study(folder, **options)
    for table in tables:
        if table.name:
            save(folder, table)
    if tables:
        texts = []
        for t in (table for table in tables if table.columns is not None):
            show(t.title.replace("{folder}", str(folder)), t.rows, t.columns or {}, t.notes)
            title = t.title.replace("; {folder}", "").strip()  # tables.md may be moved: no folder names
            texts.append(markdown(title, t.rows, t.columns or {}, t.notes))
        enlist(folder, [Path(folder) / "tables.md"], "study")
        write_text(Path(folder) / "tables.md", "\n".join(texts))
    passed = MPI.COMM_WORLD.bcast(all(table.passed for table in tables))
    return Outcome({table.name: table.rows for table in tables if table.name}, passed)


def run_command(name: str, study: Callable[..., list[Table]], out: Path | None, **options: Any) -> bool:
    """Run a study in its folder, by default results/study-NAME.  Returns True if it passed."""
    folder = out or Path("results") / f"study-{name}"
    if out is None:
        refuse_link(folder.parent, GIVEN)
        refuse_link(folder, GIVEN)
    with claimed(folder, MPI.COMM_WORLD):
        files = ["tables.md", *(f"{name}.{kind}" for kind in ("json", "csv", "png", "svg"))]
        refuse_own(folder, files, "study", MPI.COMM_WORLD)
        return run(study, folder, **options).passed


def save(folder: Path, table: Table) -> None:
    """Write the files of a table, and its page if it has one."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    drawn = [] if table.figure is None else style.files_of(folder / table.name)
    enlist(folder, [*(folder / f"{table.name}.{kind}" for kind in ("json", "csv")), *drawn], "study")
    found = {"title": table.title, "rows": table.rows, "notes": table.notes}
    write_text(folder / f"{table.name}.json", json.dumps(found))
    columns = list(dict.fromkeys(key for row in table.rows for key in row))
    with replacing(folder / f"{table.name}.csv") as part, open(part, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(table.rows)
    if table.figure is not None:
        style.save(table.figure, folder / table.name)
    if f"{table.name}.json" in PAGES:
        write_pages(folder, f"{table.name}.json")
