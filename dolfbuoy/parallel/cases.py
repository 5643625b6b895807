"""Many independent cases: spread over ranks, each kept on disk as it is done, taken up again after an interruption.

A case is a plain dict, its result another.  A result belongs to the case and to the program that computed it: of
another program it does not count.
"""

import functools
import hashlib
import json
import shutil
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path

from mpi4py import MPI
from rich.console import Console
from rich.progress import Progress

from .. import forms, meshes
from ..errors import InputError, SolveError
from . import interruption


def evaluate_all(
    evaluate: Callable[[dict], dict], cases: list[dict], folder: Path, structure: Callable | None = None
) -> list[dict] | None:
    """[{**case, **evaluate(case)}, ...] in the order of the cases; None on all ranks but 0.

    A case that was finished before is read from `folder`/cases.  With `mpirun -n N` the others are spread over the
    ranks, which share the folder: each takes the next case that no other has taken, until none is left.
    structure(case): what decides which forms are compiled; one case of each is evaluated first, by one rank, so that no
    two ranks compile the same form at once.  What one rank raises is raised by all.
    """
    comm, store = MPI.COMM_WORLD, Path(folder) / "cases"
    files = [store / f"{key(case)}.json" for case in cases]
    missing, claims = comm.bcast(_prepared(store, files) if comm.rank == 0 else None)
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


def _prepared(store, files):
    """Numbers of the cases without a file, one of each that comes twice, and a folder for claims."""
    store.mkdir(parents=True, exist_ok=True)
    missing = {file: i for i, file in reversed(list(enumerate(files))) if not _whole(file)}
    return sorted(missing.values()), Path(tempfile.mkdtemp(prefix="claims-", dir=store))


def _whole(file):
    """Whether a file holds a result; one that was damaged does not count."""
    try:
        return isinstance(json.loads(file.read_text()), dict)
    except (OSError, ValueError, RecursionError):
        return False


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
                write_json(files[i], result)
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


def key(case: dict) -> str:
    """Digest of a case and of the program."""
    return hashlib.sha256((fingerprint() + json.dumps(case, sort_keys=True)).encode()).hexdigest()[:20]


def with_file(case: dict, folder: Path, name: str) -> dict:
    """The case, and with it a file of its own for what it keeps beside its result."""
    return case | {"file": str(Path(folder) / "cases" / f"{name}-{key(case)}.npz")}


def write_json(path: Path, value) -> None:
    """Write a file that is whole whenever it is there."""
    part = path.with_suffix(".part")
    part.write_text(json.dumps(value))
    part.replace(path)
