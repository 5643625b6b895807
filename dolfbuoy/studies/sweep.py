"""Many variants of one scene: statistics of each run, spread over ranks, kept case by case."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import xarray as xr
from mpi4py import MPI

from ..api import simulate
from ..check import derived
from ..errors import InputError
from ..parallel.cases import evaluate_all
from ..results import style
from ..results.folder import claimed
from ..results.many import collect, draw
from ..results.statistics import statistics
from ..scene import Scene, build_scene, load_scene
from ..scene.variants import cases_of, check_known


def evaluate(case: dict) -> dict:
    """Run one case on this rank alone; a case that fails is a result too, with its reason."""
    try:
        record = simulate(build_scene(json.loads(case["scene"]), case["changes"]), comm=MPI.COMM_SELF)
    except Exception as error:  # whatever it is, the others go on
        return {"status": f"{type(error).__name__}: {error}", "statistics": {}}
    return {"status": "done", "statistics": statistics(record)}


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


def sweep(scene, vary, table, folder: Path, say: Callable = lambda sentences: None) -> xr.Dataset | None:
    """Run all cases and write folder/sweep.nc, sweep.png and .svg; the dataset on rank 0, None on the others.

    Finished cases, failed ones included, are kept in folder/cases and not computed again; all ranks take part and share
    the folder.  say: called with the warnings about the cases, before the first is run.  Raises InputError for a bad
    scene, bad cases, or a folder where nothing can be written.
    """
    base = load_scene(scene)
    changes = cases_of(vary, table)
    for key in dict.fromkeys(key for change in changes for key in change):
        check_known(base, key)
    check_wavelength(base, changes)
    data = json.dumps(base.to_dict(), sort_keys=True)
    with claimed(folder, MPI.COMM_WORLD):
        say(warnings(base, changes))
        rows = evaluate_all(evaluate, [{"scene": data, "changes": change} for change in changes], Path(folder))
    if rows is None:
        return None
    dataset = collect(rows)
    dataset.attrs["title"] = base.title
    dataset.to_netcdf(folder / "sweep.nc", engine="netcdf4")
    style.save(draw(dataset), folder / "sweep")
    return dataset
