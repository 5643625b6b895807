"""Many variants of one scene: statistics of each run, distributed over ranks, parts or an executor, stored by case."""

import hashlib
import json
import math
import re
import time as clock
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..check import derived
from ..check.accuracy import seconds_of
from ..errors import InputError, printable
from ..page.folder import write_pages
from ..parallel.cases import compute, key, ranks_beside, store_in
from ..results import style
from ..results.folder import FILES, claimed, enlist
from ..results.statistics import collect
from ..results.sweep_figure import draw
from ..scene import Scene, load_scene, varied
from ..scene.variants import cases_of, check_known, in_words, latin_hypercube, with_seeds
from ..solver import compat
from ..version import __version__
from ..writing import refuse_link, replacing
from .one_case import evaluate, failed
from .study import Row

#: Placeholder in `status` and `collect` for a case without a result.
MISSING: Row = {"status": "not computed", "statistics": {}, "sample": None}
#: Least number of cases that `check` examines before a sweep begins.
LOOKED_AT = 50
#: Folder of running cases, below that of the sweep.
RUNNING = Path("cases") / "running"
#: Folder of kept records, one per case, next to sweep.nc.
RECORDS = "records"


@dataclass(frozen=True)
class Plan:
    """The cases of a sweep: changes of a scene, one dict for each.

    source: the scene and its common settings as on the command line; empty from Python.
    """

    base: Scene
    changes: list[Row]
    source: str = ""

    @property
    def cases(self) -> list[Row]:
        """Cases for `parallel.cases`, with the scene represented by its digest."""
        data = json.dumps(self.base.to_dict(), sort_keys=True)
        base = hashlib.sha256(data.encode()).hexdigest()[:20]
        return [{"base": base, "changes": change} for change in self.changes]

    def share(self, part: "Part | None") -> list[Row]:
        """The cases of a part, or all."""
        return self.cases if part is None else part.of_all(self.cases)


@dataclass(frozen=True)
class Part:
    """Part `number` of `of`, counted from 1: takes every `of`-th case."""

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> "Part":
        """Parse i/n.  Raises InputError."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip())
        if not found or not 1 <= int(found[1]) <= int(found[2]):
            raise InputError(f"--part {text}: must be i/n, part i of n, with i from 1 to n.")
        return cls(int(found[1]), int(found[2]))

    def of_all(self, cases: list[Row]) -> list[Row]:
        return cases[self.number - 1 :: self.of]

    @property
    def folder(self) -> str:
        """Folder of the part's store, below that of all cases."""
        return f"part-{self.number}-of-{self.of}"

    def __str__(self) -> str:
        return f"part {self.number} of {self.of}"


def plan(
    scene: Any, vary: Any, table: Any, seeds: int | None = None, latin: int | None = None, source: str = ""
) -> Plan:
    """The plan of a sweep: its cases and their names.  Raises InputError for a bad scene or bad cases.

    seeds, latin: see `variants.with_seeds`, `variants.latin_hypercube`; source: see `Plan`.
    """
    base = load_scene(scene)
    changes = cases_of(vary, table, seeds) if latin is None else latin_hypercube(vary, table, latin)
    changes = changes if seeds is None else with_seeds(changes, seeds)
    for name in dict.fromkeys(name for change in changes for name in change):
        check_known(base, name)
    check_wavelength(base, changes)
    if base.accuracy is not None and base.accuracy.target is not None:
        raise InputError("accuracy.target: cases of a sweep keep their settings; take accuracy.estimate for bars.")
    return Plan(base, changes, source)


def warnings(base: Scene, changes: list[Row]) -> list[str]:
    """Warnings on the cases before the first is run, each kind once, with its first case.

    Every case is read, to find invalid scenes.  As `check` takes a hundred times as long, it examines only LOOKED_AT
    evenly spaced cases, and those with the smallest or largest value of a key.
    """
    refused: dict[str, list[tuple[Row, str]]] = {}
    warned: dict[str, list[tuple[Row, str]]] = {}
    chosen = _looked_at(changes)
    for i, change in enumerate(changes):
        try:
            scene, kinds = varied(base, change), warned
            texts = derived(scene).warnings if i in chosen else []
        except InputError as error:
            texts, kinds = [str(error)], refused
        for text in texts:
            kinds.setdefault(re.sub(r"[-+.e\d]*\d", "#", text), []).append((change, text))  # without its numbers
    looked = "" if len(chosen) == len(changes) else " examined"
    counted = [(cases, f"{len(changes)} cases will not run") for cases in refused.values()]
    counted += [(cases, f"{len(chosen)} cases{looked}") for cases in warned.values()]
    return [f"{len(cases)} of {what}, the first with {in_words(cases[0][0])}: {cases[0][1]}" for cases, what in counted]


def _looked_at(changes: list[Row]) -> set[int]:
    """Indices of the cases that `check` examines."""
    found = set(range(0, len(changes), max(1, len(changes) // LOOKED_AT)))
    for name in dict.fromkeys(name for change in changes for name in change):
        values = [(change[name], i) for i, change in enumerate(changes) if isinstance(change.get(name), int | float)]
        found |= {min(values)[1], max(values)[1]} if values else set()
    return found


def check_wavelength(base: Scene, changes: list[Row]) -> None:
    """Raise InputError if the wave period is varied at a fixed wavelength, which violates the dispersion relation."""
    wavelength = base.waves.wavelength if base.waves else None
    keys = {key for change in changes for key in change}
    if wavelength is not None and "waves.period" in keys and not keys & {"waves", "waves.wavelength"}:
        raise InputError(
            f"waves.wavelength = {wavelength}: would stay while waves.period varies; take it away with --set "
            "waves.wavelength= (dispersion gives it then), or vary it too."
        )


def sweep(
    scene: Any,
    vary: Any,
    table: Any,
    folder: Path,
    say: Callable[[list[str]], None] = lambda sentences: None,
    seeds: int | None = None,
    latin: int | None = None,
    source: str = "",
    **how: Any,
) -> xr.Dataset | None:
    """Run all cases and write folder/sweep.nc, sweep.png and .svg; the dataset on rank 0, None on the others.

    Finished cases, including failed ones, are stored in folder/cases and not computed again; all ranks take part and
    share the folder.  say: called with warnings about the cases before the first is run.  seeds, latin, source: see
    `plan`.  how: retry, executor, limit and keep, see `run_part`.  Raises InputError for a bad scene, bad cases, or a
    folder that is not writable.
    """
    planned, folder = plan(scene, vary, table, seeds, latin, source), Path(folder)
    comm = ranks_beside(how.get("executor"))
    with claimed(folder, comm):
        enlist(folder, [folder / name for name in FILES["sweep"]], "sweep", comm)
        say(warnings(planned.base, planned.changes))
        _compute(planned, None, folder, say, **how)
        return _written(planned, folder) if comm.rank == 0 else None


def run_part(
    planned: Plan,
    folder: Path,
    part: Part,
    say: Callable[[list[str]], None] = lambda sentences: None,
    **how: Any,
) -> None:
    """Run the cases of one part and store them in folder/cases, while other processes run other parts.

    say: called with warnings about these cases before the first is run, and about their store.
    how: retry: run failed cases again.  executor: see `parallel.cases.compute`.  limit: seconds of wall time, after
    which the running case is left with a checkpoint and interruption.TimeUp is raised.  keep: keep record and page of
    each case in a subfolder of folder/records; cases without them are run again.  Raises InputError if another process
    runs this part, or if parts of another division are running.
    """
    comm = ranks_beside(how.get("executor"))
    for place in (folder / "cases", folder / "cases" / part.folder):
        refuse_link(place)
    with claimed(folder, comm, shared=True), claimed(folder / "cases" / part.folder, comm):
        for other in sorted((folder / "cases").glob("part-*-of-*")):
            if other.name.rpartition("-")[2] != str(part.of):  # it may be computing the same cases
                refuse_link(other)
                with claimed(other, comm):
                    pass
        say(warnings(planned.base, part.of_all(planned.changes)))
        _compute(planned, part, folder, say, **how)


def _compute(
    planned: Plan,
    part: Part | None,
    folder: Path,
    say: Callable[[list[str]], None],
    retry: bool = False,
    executor: Any = None,
    limit: float | None = None,
    keep: bool = False,
) -> None:
    deadline = math.inf if limit is None else clock.time() + limit
    running, kept = (str(Path(folder) / name) for name in (RUNNING, RECORDS))
    how = partial(evaluate, base=planned.base, running=running, deadline=deadline, keep=kept if keep else None)
    for name in (RUNNING, RECORDS):
        refuse_link(Path(folder) / name)
    if keep:
        with claimed(kept, ranks_beside(executor), shared=True):
            pass  # or it cannot hold them

    def anew(result: Row) -> bool:
        return retry if result["status"] != "done" else keep and not _record_of(folder, result)

    place, again = "" if part is None else part.folder, anew if retry or keep else None
    options: dict[str, Any] = {"again": again, "executor": executor, "failed": failed, "say": say}
    compute(how, planned.share(part), folder, part=place, work=partial(_work, planned.base), **options)


def _work(base: Scene, case: Row) -> float:
    """Estimated time of a case; 0 for an invalid one."""
    try:
        return seconds_of(varied(base, case["changes"]))
    except InputError:
        return 0.0


def _record_of(folder: Path, case: Row) -> str:
    """Folder with the kept record and page of a case, relative to the sweep's; empty if there is none."""
    found = f"{RECORDS}/{key({name: case[name] for name in ('base', 'changes')})}"
    return found if (Path(folder) / found / "page.html").is_file() else ""


def status(planned: Plan, folder: Path, part: Part | None = None) -> Row:
    """Progress of a sweep: numbers of cases done, failed, missing and begun, and mean time of a case.
    Also reasons of failures with their counts, sentences about damaged files, and results of other programs."""
    store, names = store_in(folder), [key(case) for case in planned.share(part)]
    reasons: Counter[str] = Counter()
    times = []
    for result in filter(None, store.results([name for name in names if name in store.entries])):
        if result["status"] == "done":
            times.append(result["seconds"])
        else:
            reasons[result["status"]] += 1
    done, failed = len(times), sum(reasons.values())
    return {
        "cases": len(names),
        "done": done,
        "failed": failed,
        "missing": len(names) - done - failed,
        "begun": sum(path.is_dir() for path in (Path(folder) / RUNNING).glob("*")),
        "seconds": sum(times) / done if done else math.nan,
        "reasons": reasons,
        "damaged": store.damaged,
        "foreign": store.foreign,
    }


def collected(planned: Plan, folder: Path) -> xr.Dataset:
    """Write sweep.nc and its figure from the results so far; returns the dataset.

    Cases without a result have the status "not computed".  Raises InputError if there is no result at all.
    """
    if not (Path(folder) / "cases").is_dir():
        raise InputError(f"{folder} holds no results of a sweep: it has no folder cases.")
    with claimed(folder, shared=True):
        return _written(planned, Path(folder))


def _written(planned: Plan, folder: Path) -> xr.Dataset:
    store, cases = store_in(folder), planned.cases
    rows, cut, dates = [], [], [""]
    for case, found in zip(cases, store.results([key(case) for case in cases]), strict=True):
        result = found or MISSING
        rows.append(case | {name: result[name] for name in ("status", "statistics")})  # samples are large
        rows[-1]["criteria"] = (result.get("sample") or {}).get("criteria", [])
        cut.append(result.get("cut", 0.0))
        dates.append(result.get("created", ""))
    enlist(folder, [folder / name for name in FILES["sweep"]], "sweep")
    dataset = collect(rows)
    about = {"units": "1", "long_name": "part of the steps that failed and were retried with smaller ones"}
    dataset["cut_steps"] = "case", np.array(cut), about
    about = {"title": planned.base.title, "scene": planned.base.to_toml(), "source": printable(planned.source)}
    versions = {f"version_{name}": value for name, value in compat.versions().items()}  # of who collects the cases
    dataset.attrs |= about | {"computed_by": f"dolfbuoy {__version__}", "created": max(dates)} | versions
    records = [_record_of(folder, case) for case in cases] if (folder / RECORDS).is_dir() else []
    if any(records):
        about = {"long_name": "folder of the record, from that of the sweep"}
        dataset["record"] = ("case", np.array(records, dtype=object), about)
    with replacing(folder / "sweep.nc") as part:
        dataset.to_netcdf(part, engine="netcdf4")
    style.save(draw(dataset), folder / "sweep")
    write_pages(folder, "sweep.nc")
    return dataset
