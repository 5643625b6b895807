"""What all studies share: independent cases spread over ranks, kept on disk, shown as a table, JSON, CSV and figure.

A study is a module with `cases(...)`, a list of plain dicts, `evaluate(case)`, a dict of results computed on
MPI.COMM_SELF, and `figure(rows)`.  The rows are the same for any number of ranks.
"""

import csv
import hashlib
import json
import math
from collections.abc import Callable
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from mpi4py import MPI
from rich.console import Console
from rich.progress import track
from rich.table import Table


def evaluate_all(
    evaluate: Callable[[dict], dict], cases: list[dict], folder: Path, structure=None
) -> list[dict] | None:
    """[{**case, **evaluate(case)}, ...] in the order of the cases; None on all ranks but 0.

    A case that was finished before is read from `folder`/cases.  With `mpirun -n N` the others are spread over the
    ranks.  structure(case): what decides which forms are compiled; one case of each is evaluated first, by one rank, so
    that no two ranks compile the same form at once.
    """
    comm = MPI.COMM_WORLD
    store = Path(folder) / "cases"
    if comm.size == 1:
        return _collect(map, evaluate, cases, store, structure)
    from mpi4py.futures import MPICommExecutor

    with MPICommExecutor(comm, root=0) as pool:
        return _collect(pool.map, evaluate, cases, store, structure) if pool is not None else None


def _collect(mapping, evaluate, cases, store, structure):
    store.mkdir(parents=True, exist_ok=True)
    files = [store / f"{_key(case)}.json" for case in cases]
    missing = [i for i, file in enumerate(files) if not file.is_file()]
    first = {structure(cases[i]): i for i in reversed(missing)} if structure else {}
    pioneers = sorted(first.values())
    followers = [i for i in missing if i not in set(pioneers)]
    console = Console(stderr=True)
    for indices, how in ((pioneers, map), (followers, mapping)):
        if not indices:
            continue
        results = how(evaluate, [cases[i] for i in indices])
        for i, result in zip(indices, track(results, "cases", len(indices), console=console), strict=True):
            _write_json(files[i], result)
    return [{**case, **json.loads(file.read_text())} for case, file in zip(cases, files, strict=True)]


def _key(case):
    return hashlib.sha256(json.dumps(case, sort_keys=True).encode()).hexdigest()[:20]


def _write_json(path, value):
    part = path.with_suffix(".part")
    part.write_text(json.dumps(value))
    part.replace(path)


def orders(rows: list[dict], error: str, size: str = "h") -> None:
    """Add the observed order between consecutive rows as `order_<error>` (None in the first)."""
    for before, row in zip([None, *rows], rows, strict=False):
        row[f"order_{error}"] = None
        if before and before[error] and row[error] and before[error] > 0 and row[error] > 0:
            row[f"order_{error}"] = math.log(before[error] / row[error]) / math.log(before[size] / row[size])


def save(folder: Path, name: str, rows: list[dict], figure=None, notes: list[str] | None = None) -> None:
    """Write folder/name.json, .csv and, with a matplotlib figure, .png and .svg."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    _write_json(folder / f"{name}.json", {"rows": rows, "notes": notes or []})
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with open(folder / f"{name}.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)
    if figure is not None:
        FigureCanvasAgg(figure)
        for suffix in ("png", "svg"):
            figure.savefig(folder / f"{name}.{suffix}", dpi=200)


def show(title: str, rows: list[dict], columns: dict[str, str], notes: list[str] | None = None) -> None:
    """Print rows as a table; columns: key -> heading.  Numbers get four digits."""
    table = Table(title=title, title_justify="left", show_edge=False, pad_edge=False)
    for heading in columns.values():
        table.add_column(heading, justify="right")
    for row in rows:
        table.add_row(*(_text(row.get(key)) for key in columns))
    console = Console()
    console.print(table)
    for note in notes or []:
        console.print(note, soft_wrap=True)


def _text(value):
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
