"""What all studies share: independent cases spread over ranks, kept on disk, shown as a table, JSON, CSV and figure.

A study is a module with `cases(...)`, a list of plain dicts, `evaluate(case)`, a dict of results computed on
MPI.COMM_SELF, and `figure(rows)`.  The rows are the same for any number of ranks.
"""

import csv
import functools
import hashlib
import json
import math
import shutil
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from mpi4py import MPI
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from .. import forms, meshes
from ..errors import InputError, SolveError
from ..parallel import interruption


def evaluate_all(
    evaluate: Callable[[dict], dict], cases: list[dict], folder: Path, structure=None
) -> list[dict] | None:
    """[{**case, **evaluate(case)}, ...] in the order of the cases; None on all ranks but 0.

    A case that the same program finished before is read from `folder`/cases.  With `mpirun -n N` the others are spread
    over the ranks: each takes the next case that no other has taken, until none is left.  structure(case): what decides
    which forms are compiled; one case of each is evaluated first, by one rank, so that no two ranks compile the same
    form at once.  What one rank raises is raised by all.
    """
    comm, store = MPI.COMM_WORLD, Path(folder) / "cases"
    files = [store / f"{_key(case)}.json" for case in cases]
    missing, claims = None, None
    if comm.rank == 0:
        store.mkdir(parents=True, exist_ok=True)
        missing = [i for i, file in enumerate(files) if not file.is_file()]
        claims = Path(tempfile.mkdtemp(prefix="claims-", dir=store))
    missing, claims = comm.bcast((missing, claims))
    first = {structure(cases[i]): i for i in reversed(missing)} if structure else {}
    pioneers = sorted(first.values())
    followers = [i for i in missing if i not in set(pioneers)]
    try:
        for indices, workers in ((pioneers, 1), (followers, comm.size)):
            work = indices if comm.rank < workers else []
            _raise_together(comm, _evaluate_share, evaluate, cases, files, work, claims)
    finally:
        if comm.rank == 0:
            shutil.rmtree(claims, ignore_errors=True)
    if comm.rank != 0:
        return None
    return [{**case, **json.loads(file.read_text())} for case, file in zip(cases, files, strict=True)]


def _evaluate_share(evaluate, cases, files, indices, claims):
    """Evaluate those of the indices that no other rank has claimed; rank 0 shows how many are done by all."""
    progress = Progress(console=Console(stderr=True), disable=MPI.COMM_WORLD.rank != 0 or not indices)
    with progress:
        task = progress.add_task("cases", total=len(indices))
        for i in indices:
            if (claims / "failed").exists():  # on another rank
                break
            if not _claim(claims / str(i)):
                continue
            try:
                result = evaluate(cases[i])
                interruption.check()
                _write_json(files[i], result)
            except BaseException:
                _claim(claims / "failed")
                raise
            progress.update(task, completed=sum(files[k].is_file() for k in indices))


def _claim(path):
    """Whether this rank is the first to ask: a file is created by one process only."""
    try:
        path.touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def _raise_together(comm, function, *arguments):
    """Call a function that may fail on some ranks; if it does, all ranks raise the error of the first of them."""
    error = None
    try:
        function(*arguments)
    except (InputError, SolveError) as known:
        error = known
    except Exception as unexpected:
        if comm.size == 1:
            raise
        error = RuntimeError("".join(traceback.format_exception(unexpected)))
    errors = [e for e in comm.allgather(error) if e is not None]
    if errors:
        raise error if comm.size == 1 else errors[0]


@functools.cache
def fingerprint() -> str:
    """Changes with the sources and the shipped scenes: what another program computed does not count."""
    roots = [Path(__file__).parents[1], *(Path(m.__file__).parent for m in (forms, meshes))]  # apart in a source tree
    files = sorted({file for root in roots for kind in ("*.py", "*.toml") for file in root.rglob(kind)})
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def _key(case):
    return hashlib.sha256((fingerprint() + json.dumps(case, sort_keys=True)).encode()).hexdigest()[:20]


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
