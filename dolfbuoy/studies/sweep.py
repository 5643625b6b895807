"""Many variants of one scene: statistics of each run, spread over ranks, parts or an executor, kept case by case."""

import hashlib
import json
import math
import re
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import xarray as xr
from mpi4py import MPI

from ..check import derived
from ..errors import InputError
from ..page.folder import write_pages
from ..parallel.cases import compute, rows_of, store_in
from ..results import style
from ..results.folder import claimed
from ..results.many import collect, draw
from ..results.record import replacing
from ..scene import Scene, build_scene, load_scene
from ..scene.variants import cases_of, check_known, latin_hypercube, with_seeds
from .one_case import evaluate, failed

#: What `status` and `collect` say of a case that has no result.
MISSING = {"status": "not computed", "statistics": {}, "sample": None}
#: Folder of the cases that are being computed, below that of the sweep.
RUNNING = Path("cases") / "running"


@dataclass(frozen=True)
class Plan:
    """The cases of a sweep: changes of a scene, one dict for each."""

    base: Scene
    changes: list[dict]

    @property
    def cases(self) -> list[dict]:
        """As `parallel.cases` takes them."""
        data = json.dumps(self.base.to_dict(), sort_keys=True)
        base = hashlib.sha256(data.encode()).hexdigest()[:12]
        return [{"scene": data, "base": base, "changes": change} for change in self.changes]

    def share(self, part: "Part | None") -> list[dict]:
        """The cases of a part, or all."""
        return self.cases if part is None else self.cases[part.number - 1 :: part.of]


@dataclass(frozen=True)
class Part:
    """Part `number` of `of`, counted from 1: every `of`-th case."""

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> "Part":
        """From i/n.  Raises InputError."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip())
        if not found or not 1 <= int(found[1]) <= int(found[2]):
            raise InputError(f"--part {text}: must be i/n, part i of n, with i from 1 to n.")
        return cls(int(found[1]), int(found[2]))

    @property
    def folder(self) -> str:
        """Of the store, below that of all cases."""
        return f"part-{self.number}-of-{self.of}"

    def __str__(self):
        return f"part {self.number} of {self.of}"


def plan(scene, vary, table, seeds: int | None = None, latin: int | None = None) -> Plan:
    """What a sweep consists of; seeds, latin: see `variants.with_seeds`, `variants.latin_hypercube`.

    Raises InputError for a bad scene or bad cases.
    """
    base = load_scene(scene)
    changes = cases_of(vary, table) if latin is None else latin_hypercube(vary, table, latin)
    changes = changes if seeds is None else with_seeds(changes, seeds)
    for key in dict.fromkeys(key for change in changes for key in change):
        check_known(base, key)
    check_wavelength(base, changes)
    return Plan(base, changes)


def warnings(base: Scene, changes: list[dict]) -> list[str]:
    """What `check` warns of in the cases, each kind once, with the first case of it and their number."""
    found = {}
    for change in changes:
        try:
            sentences = derived(build_scene(base.to_dict(), change)).warnings
        except InputError:  # its status will say so
            continue
        for text in sentences:
            found.setdefault(re.sub(r"[-+.e\d]*\d", "#", text), []).append((change, text))
    return [
        f"{len(cases)} of {len(changes)} cases, the first with "
        f"{', '.join(f'{key} = {value}' for key, value in cases[0][0].items())}: {cases[0][1]}"
        for cases in found.values()
    ]


def check_wavelength(base, changes):
    """Refuse to vary the period of waves whose wavelength stays: but for one case none would keep the dispersion."""
    wavelength = base.waves.wavelength if base.waves else None
    keys = {key for change in changes for key in change}
    if wavelength is not None and "waves.period" in keys and not keys & {"waves", "waves.wavelength"}:
        raise InputError(
            f"waves.wavelength = {wavelength}: would stay while waves.period varies; take it away with --set "
            "waves.wavelength= (dispersion gives it then), or vary it too."
        )


def sweep(
    scene,
    vary,
    table,
    folder: Path,
    say: Callable = lambda sentences: None,
    seeds: int | None = None,
    latin: int | None = None,
    **how,
) -> xr.Dataset | None:
    """Run all cases and write folder/sweep.nc, sweep.png and .svg; the dataset on rank 0, None on the others.

    Finished cases, failed ones included, are kept in folder/cases and not computed again; all ranks take part and share
    the folder.  say: called with the warnings about the cases, before the first is run.  seeds, latin: see `plan`.
    how: retry, executor and limit, see `run_part`.  Raises InputError for a bad scene, bad cases, or a folder where
    nothing can be written.
    """
    planned, folder = plan(scene, vary, table, seeds, latin), Path(folder)
    with claimed(folder, MPI.COMM_WORLD):
        say(warnings(planned.base, planned.changes))
        _compute(planned.cases, folder, "", say, **how)
        return _written(planned, folder) if MPI.COMM_WORLD.rank == 0 else None


def run_part(
    planned: Plan,
    folder: Path,
    part: Part,
    say: Callable = lambda sentences: None,
    **how,
) -> None:
    """Run the cases of one part and keep them in folder/cases, beside other parts that other processes run.

    how: retry: cases that failed are run again.  executor: see `parallel.cases.compute`.  limit: seconds of wall time,
    after which the running case is left with a checkpoint and interruption.TimeUp is raised.
    Raises InputError if another process runs this part, or parts of another division are being run.
    """
    with claimed(folder, MPI.COMM_WORLD, shared=True), claimed(folder / "cases" / part.folder, MPI.COMM_WORLD):
        _check_division(folder, part)
        _compute(planned.share(part), folder, part.folder, say, **how)


def _compute(cases, folder, part, say, retry=False, executor=None, limit=None):
    deadline = math.inf if limit is None else clock.time() + limit
    how = partial(evaluate, running=str(Path(folder) / RUNNING), deadline=deadline)
    again = (lambda result: result["status"] != "done") if retry else (lambda result: False)
    compute(how, cases, folder, part=part, again=again, executor=executor, failed=failed, say=say)


def _check_division(folder, part):
    """Refuse to compute cases that a part of another division may be computing now."""
    for other in sorted((folder / "cases").glob("part-*-of-*")):
        if other.name.rpartition("-")[2] != str(part.of):
            with claimed(other, MPI.COMM_WORLD):
                pass


def status(planned: Plan, folder: Path, part: Part | None = None) -> dict:
    """How far a sweep is: numbers of cases that are done, failed, missing and begun, seconds they took on the average,
    reasons of failures with their numbers, sentences about damaged files, and results of other programs."""
    store, cases = store_in(folder), planned.share(part)
    rows = rows_of(cases, folder, MISSING)
    reasons = {}
    for row in rows:
        if row["status"] not in ("done", MISSING["status"]):
            reasons[row["status"]] = reasons.get(row["status"], 0) + 1
    times = [row["seconds"] for row in rows if row["status"] == "done"]
    done, gone = len(times), sum(row["status"] == MISSING["status"] for row in rows)
    return {
        "cases": len(rows),
        "done": done,
        "failed": len(rows) - done - gone,
        "missing": gone,
        "begun": sum(path.is_dir() for path in (Path(folder) / RUNNING).glob("*")),
        "seconds": sum(times) / done if done else math.nan,
        "reasons": reasons,
        "damaged": store.damaged,
        "foreign": store.foreign,
    }


def collected(planned: Plan, folder: Path) -> xr.Dataset:
    """Write sweep.nc and its figure from what the parts have computed so far; the dataset.

    Cases without a result have the status "not computed".  Raises InputError if there is no result at all.
    """
    if not (Path(folder) / "cases").is_dir():
        raise InputError(f"{folder} holds no results of a sweep: it has no folder cases.")
    with claimed(folder, shared=True):
        return _written(planned, Path(folder))


def _written(planned, folder):
    dataset = collect(rows_of(planned.cases, folder, MISSING))
    dataset.attrs |= {"title": planned.base.title, "scene": planned.base.to_toml()}
    with replacing(folder / "sweep.nc") as part:
        dataset.to_netcdf(part, engine="netcdf4")
    style.save(draw(dataset), folder / "sweep")
    write_pages(folder, "sweep.nc")
    return dataset
