"""Many independent cases: distributed over ranks, each stored on disk when done, resumed after an interruption.

A case is a plain Row, and so is its result.  A result is valid only for its case and for the version of the program
that computed it.
"""

import hashlib
import json
import math
import shutil
import tempfile
import time as clock
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import cache, partial
from pathlib import Path
from typing import Any, Self

from rich.console import Console
from rich.progress import Progress

from .. import forms, meshes
from ..elsewhere import MPI
from ..errors import InputError, SolveError
from ..writing import made
from . import interruption, pace
from .store import SUFFIX, Store, Writer

Row = dict[str, Any]  #: a case, or its result

#: Least duration of the cases that is announced [s].
ANNOUNCED = 20.0
#: Least work of a case.
TINY = 1e-12


def evaluate_all(
    evaluate: Callable[[Row], Row],
    cases: list[Row],
    folder: Path,
    structure: Callable[[Row], Any] | None = None,
    work: Callable[[Row], float] | None = None,
) -> list[Row] | None:
    """[{**case, **evaluate(case)}, ...] in the order of the cases; None on all ranks but 0.

    See `compute` for the arguments.
    """
    compute(evaluate, cases, folder, structure, work=work)
    return None if MPI.COMM_WORLD.rank != 0 else rows_of(cases, folder)


def rows_of(cases: list[Row], folder: Path) -> list[Row]:
    """[{**case, **result}, ...] from the store in a folder, which must have a result for every case."""
    found = store_in(folder).results([key(case) for case in cases])
    return [{**case, **(result or {})} for case, result in zip(cases, found, strict=True)]


def store_in(folder: Path) -> Store:
    """Results of this program in a folder."""
    return Store(Path(folder) / "cases", fingerprint())


def compute(
    evaluate: Callable[[Row], Row],
    cases: list[Row],
    folder: Path,
    structure: Callable[[Row], Any] | None = None,
    part: str = "",
    again: Callable[[Row], bool] | None = None,
    executor: Any = None,
    failed: Callable[[Exception], Row] | None = None,
    say: Callable[[list[str]], None] = lambda sentences: None,
    work: Callable[[Row], float] | None = None,
) -> None:
    """Evaluate the cases without a result and write each result at once to `folder`/cases; collective.

    With `mpirun -n N` they are distributed over the ranks, which share the folder: each takes the next unclaimed case
    until none is left.  structure(case): what determines the compiled forms; one case of each structure is evaluated
    first, by one rank, so that no two ranks compile the same form at once.  An error of one rank is raised by all.
    part: a subfolder of the store for the results of this process; no other process may write there.  again(result):
    whether a case with this result is recomputed; default: never.  executor: from concurrent.futures, or one whose
    futures have `done`, `result` and `cancel`; it evaluates, and only this process writes.  failed(error): the result
    of a case that failed in the executor; without it the error is raised.  say: called with messages about damage to
    the store.  work(case): relative duration, for time estimates; in seconds with an executor, whose workers report no
    progress.
    """
    comm, store = ranks_beside(executor), Path(folder) / "cases" / part
    missing, attempts, claims = comm.bcast(_prepared(folder, store, cases, again, say) if comm.rank == 0 else None)
    pioneers: list[int] = []
    if structure and executor is None:  # the first case of each
        pioneers = sorted({structure(cases[i]): i for i in reversed(missing)}.values())
    followers = [i for i in missing if i not in set(pioneers)]
    writer = Writer(store / f"rank-{comm.rank}{SUFFIX}", fingerprint())

    def keep(i: int, result: Row) -> None:
        writer.add(key(cases[i]), result, attempts[i])

    shares = {i: max(work(cases[i]), TINY) if work else 1.0 for i in missing} if comm.rank == 0 else {}
    try:
        if executor is not None:
            _evaluate_elsewhere(executor, evaluate, cases, missing, keep, failed, shares)
            return
        with _Progress(shares, comm.size) as progress:
            for indices, workers in ((pioneers, 1), (followers, comm.size)):
                mine = indices if comm.rank < workers else []
                share = _claimed(mine, claims) if comm.size > 1 else mine
                _raise_together(comm, _evaluate_share, evaluate, cases, share, keep, claims, progress)
    finally:
        writer.close()
        if comm.rank == 0:
            shutil.rmtree(claims, ignore_errors=True)


def ranks_beside(executor: Any) -> Any:
    """Participating ranks: with an executor only this process, as other ranks may be its workers (mpi4py.futures)."""
    return MPI.COMM_WORLD if executor is None else MPI.COMM_SELF


def _prepared(
    folder: Path,
    store: Path,
    cases: list[Row],
    again: Callable[[Row], bool] | None,
    say: Callable[[list[str]], None],
) -> tuple[list[int], dict[int, int], Path]:
    """Numbers of the cases without a result (once for repeated ones), their attempts, and a folder for claims."""
    known = store_in(folder)
    if known.damaged:
        say(known.damaged)
    missing: dict[str, int] = {}
    for i, case in enumerate(cases):
        name = key(case)
        if name not in known.entries or (again is not None and again(known.result(name) or {})):
            missing.setdefault(name, i)
    made(folder, *store.relative_to(folder).parts)
    claims = Path(tempfile.mkdtemp(prefix="claims-", dir=store))
    return sorted(missing.values()), {i: known.attempt(name) for name, i in missing.items()}, claims


def _evaluate_share(
    evaluate: Callable[[Row], Row],
    cases: list[Row],
    share: Iterable[int],
    keep: Callable[[int, Row], None],
    claims: Path,
    progress: "_Progress",
) -> None:
    """Evaluate cases one by one; rank 0 shows the overall progress."""
    for i in share:
        try:
            with progress.watching(i):
                result = evaluate(cases[i])
            interruption.check()
            keep(i, result)
        except BaseException:
            _claim(claims / "failed")
            raise
        progress.done(i, claims)


def _claimed(indices: Iterable[int], claims: Path) -> Iterator[int]:
    """Cases not claimed by other ranks, until a case has failed on any rank."""
    for i in indices:
        if (claims / "failed").exists():
            return
        if _claim(claims / str(i)):
            yield i


def _evaluate_elsewhere(
    executor: Any,
    evaluate: Callable[[Row], Row],
    cases: list[Row],
    indices: list[int],
    keep: Callable[[int, Row], None],
    failed: Callable[[Exception], Row] | None,
    shares: dict[int, float],
) -> None:
    """Evaluate cases with an executor; a failure of the executor itself is fatal."""
    waiting = {executor.submit(evaluate, cases[i]): i for i in indices}
    with _Progress(shares, workers := _workers(executor)) as progress:
        progress.sent(workers)
        try:
            for future in _finished(waiting):
                try:
                    result = future.result()
                except Exception as error:
                    if failed is None or isinstance(error, BrokenExecutor):
                        raise
                    result = failed(error)
                keep(waiting[future], result)
                interruption.check()
                progress.done(waiting[future])
        finally:
            for future in waiting:
                future.cancel()


def _workers(executor: Any) -> int:
    """Number of cases an executor evaluates at once, 1 if unknown."""
    return int(getattr(executor, "num_workers", None) or getattr(executor, "_max_workers", None) or 1)


def _finished(futures: Iterable[Any]) -> Iterator[Any]:
    """Futures in the order of completion."""
    waiting = list(futures)
    while waiting:
        done = [future for future in waiting if future.done()]
        yield from done
        if done:
            waiting = [future for future in waiting if future not in set(done)]
        else:
            clock.sleep(0.02)


def duration(seconds: float) -> str:
    """A time in the largest suitable unit, with two digits."""
    units = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s"))
    size, unit = next((u for u in units if seconds >= 1.5 * u[0]), units[-1])
    return f"{seconds / size:.2g} {unit}"


class _Progress:
    """A progress bar on rank 0, weighted by the work of each case; with a folder of claims it counts all ranks' cases.

    The total time is estimated and printed as soon as the first case shows its pace, and again after it, for logs too;
    the bar updates the estimate after each case.
    """

    def __init__(self, work: dict[int, float], ranks: int = 1):
        self._bar = Progress(console=Console(stderr=True), disable=MPI.COMM_WORLD.rank != 0 or not work)
        self._work, self._all = work, sum(work.values())
        self._done, self._looked, self._ranks = set[int](), 0.0, ranks

    def __enter__(self) -> Self:
        self._bar.__enter__()
        self._task, self._began = self._bar.add_task("cases", total=self._all), clock.monotonic()
        return self

    def watching(self, i: int) -> AbstractContextManager[None]:
        """Context for evaluating case i; the first case is timed."""
        watched = not self._done and len(self._work) > 1 and not self._bar.disable
        return pace.watched(partial(self._expect, i)) if watched else nullcontext()

    def _expect(self, i: int, seconds: float) -> None:
        if (whole := seconds + self._left(i, seconds)) >= ANNOUNCED:
            self._bar.console.print(f"{len(self._work)} cases: about {duration(whole)}, by the first steps.")

    def sent(self, workers: int) -> None:
        """Print the estimated time for workers that report no progress, from work in seconds."""
        if (whole := self._all / min(workers, max(len(self._work), 1))) >= ANNOUNCED:
            at_once = f", {workers} at once" if workers > 1 else ""
            text = f"{len(self._work)} cases{at_once}: about {duration(whole)}, by their steps, elements and waves."
            self._bar.console.print(text)

    def _left(self, i: int, seconds: float) -> float:
        """Estimated time for all cases but i, which takes this many seconds; ranks take whole cases."""
        others = len(self._work) - 1
        share = math.ceil(others / self._ranks) / max(others, 1)
        return seconds * (self._all / self._work[i] - 1) * share

    def done(self, i: int, claims: Path | None = None) -> None:
        """Count case i, and occasionally those claimed by other ranks."""
        if self._bar.disable:
            return
        if not self._done:
            first = clock.monotonic() - self._began
            if (left := self._left(i, first)) >= ANNOUNCED:
                text = f"The first of {len(self._work)} cases took {duration(first)}: about {duration(left)} to go."
                self._bar.console.print(text)
        self._done.add(i)
        if MPI.COMM_WORLD.size > 1 and claims is not None and clock.monotonic() > self._looked + 0.5:
            self._done |= {int(path.name) for path in claims.iterdir() if path.name.isdigit()}
            self._looked = clock.monotonic()
        self._bar.update(self._task, completed=sum(self._work[k] for k in self._done))

    def __exit__(self, *exception: Any) -> None:
        self._bar.__exit__(*exception)


def _claim(path: Path) -> bool:
    """True if this rank is the first to claim a case; only one process can create the file."""
    try:
        path.touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def _raise_together(comm: Any, function: Callable[..., None], *arguments: Any) -> None:
    """Call a function that may fail on some ranks; if it does, all ranks raise the error of the first of them."""
    error: Exception | None = None
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
        raise error if error is not None and comm.size == 1 else errors[0]


@cache
def fingerprint() -> str:
    """Digest of the sources and the shipped scenes, so that results of other versions are ignored."""
    roots = [Path(__file__).parents[1], *(Path(m.__file__).parent for m in (forms, meshes))]  # apart in a source tree
    files = sorted({file for root in roots for kind in ("*.py", "*.toml") for file in root.rglob(kind)})
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def key(case: Row) -> str:
    """Digest of a case and of the program."""
    return hashlib.sha256((fingerprint() + json.dumps(case, sort_keys=True)).encode()).hexdigest()[:20]


def with_file(case: Row, folder: Path, name: str) -> Row:
    """The case with the name of a file for data in addition to its result."""
    return case | {"file": str(Path(folder) / "cases" / f"{name}-{key(case)}.npz")}
