"""The runner of studies: independent cases, computed once, then tables, words and figures.

A study is a file of words (see `declaration`) and a module that declares

    cases(**request)            plain dicts
    evaluate(case)              a dict of results, computed on MPI.COMM_SELF
    tables(rows, **request)     what is written and shown: a list of Table

and where they are needed

    request(**options)          what `cases` and `tables` are called with, if not the options themselves
    structure(case)             what decides which forms are compiled, see `parallel.cases`
    compute(folder, **request)  the rows, None on all ranks but 0; for a study that is more than one list of cases

The rows are the same for any number of ranks.
"""

import csv
import math
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import ModuleType

import matplotlib
from matplotlib.figure import Figure
from mpi4py import MPI

from ..parallel import cases as engine
from ..results import style
from ..results.tables import show
from .declaration import STUDIES


@dataclass
class Table:
    """Rows that are written to NAME.json and .csv, with a figure to .png and .svg; shown if there are columns.

    title: "{folder}" in it becomes the folder of the results.  columns: key -> heading.  A table without a name is
    only shown.  passed: False if a study that is to hold fails.
    """

    name: str
    rows: list[dict]
    title: str = ""
    columns: dict[str, str] | None = None
    notes: list[str] = field(default_factory=list)
    figure: Figure | None = None
    passed: bool = True


@dataclass
class Outcome:
    """Rows of the tables by their names, empty on all ranks but 0; whether all passed."""

    rows: dict[str, list[dict]]
    passed: bool


def run(study: ModuleType, folder: Path, **request) -> Outcome:
    """Compute what is missing, write the tables of a study into `folder` and show them."""
    computed = rows_of(study, folder, **request)
    tables = []
    if computed is not None:
        with matplotlib.rc_context(style.STYLE):
            tables = study.tables(computed, **request)
        for table in tables:
            if table.name:
                save(folder, table)
        for table in tables:
            if table.columns is not None:
                show(table.title.replace("{folder}", str(folder)), table.rows, table.columns, table.notes)
    passed = MPI.COMM_WORLD.bcast(all(table.passed for table in tables))
    return Outcome({table.name: table.rows for table in tables if table.name}, passed)


def run_command(name: str, out: Path | None, **options) -> bool:
    """Run one of STUDIES as its command, with options as they were given.  Returns whether it passed."""
    study = import_module(f".{STUDIES[name]}", __package__)
    request = study.request(**options) if hasattr(study, "request") else options
    return run(study, out or Path("results") / f"study-{name}", **request).passed


def rows_of(study: ModuleType, folder: Path, **request) -> list[dict] | None:
    """Every case with its results; None on all ranks but 0."""
    if hasattr(study, "compute"):
        return study.compute(folder, **request)
    return engine.evaluate_all(study.evaluate, study.cases(**request), folder, getattr(study, "structure", None))


def save(folder: Path, table: Table) -> None:
    """Write the files of a table."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    engine.write_json(folder / f"{table.name}.json", {"rows": table.rows, "notes": table.notes})
    columns = list(dict.fromkeys(key for row in table.rows for key in row))
    with open(folder / f"{table.name}.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(table.rows)
    if table.figure is not None:
        style.save(table.figure, folder / table.name)


def orders(rows: list[dict], error: str, size: str = "h") -> None:
    """Add the observed order between consecutive rows as `order_<error>` (None in the first)."""
    for before, row in zip([None, *rows], rows, strict=False):
        row[f"order_{error}"] = None
        if before and before[error] and row[error] and before[error] > 0 and row[error] > 0:
            row[f"order_{error}"] = math.log(before[error] / row[error]) / math.log(before[size] / row[size])


def groups(rows: list[dict], *keys: str) -> dict:
    """Rows by their value of a key, by their values of several, in the order in which these come."""
    found = {}
    for row in rows:
        values = tuple(row[key] for key in keys)
        found.setdefault(values[0] if len(keys) == 1 else values, []).append(row)
    return found
