"""Samples of runs, read from their records, folders or sweeps, and what makes runs a set."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..errors import InputError
from ..parallel.cases import store_in
from ..scene import Scene
from ..scene.variants import SEED, in_words
from .after_ramp import scene_of
from .record import fitting, read
from .sample import sample_of


@dataclass(frozen=True)
class Run:
    """A sample, the name of its run, what makes runs a set, and what the cases of a sweep change but for the seed.

    seconds: of computing.
    """

    name: str
    sample: dict[str, Any]
    set: str
    changes: dict[str, Any] | None = None
    seconds: float = np.nan


def runs_of(sources: Iterable[Any], start: float | None = None, point: Sequence[float] | None = None) -> list[Run]:
    """Runs of records, of folders of runs, and of folders of sweeps, whose cases are runs each.  Raises InputError."""
    found = []
    for k, source in enumerate(sources):
        if not isinstance(source, xr.Dataset) and (Path(source) / "cases").is_dir():
            if start is not None or point is not None:
                raise InputError(f"{source}: a sweep keeps no records: its statistics begin after the ramp.")
            found += _cases_in(Path(source))
        else:
            found.append(run_of(source, k, start, point))
    if not found:
        raise InputError("There is no run to make statistics of.")
    return found


def _cases_in(folder: Path) -> list[Run]:
    """Runs of a sweep; those that failed, or end in their ramp, are left out."""
    found = []
    for result in store_in(folder).results():
        if result and result.get("sample"):
            changes = result["changes"]
            state = {key: value for key, value in changes.items() if key != SEED}
            same = json.dumps([result["base"], state], sort_keys=True)
            found.append(Run(in_words(changes), result["sample"], same, state, result["seconds"]))
    if not found:
        raise InputError(f"{folder} holds no case of a sweep that has run beyond its ramp.")
    return sorted(found, key=lambda run: (run.set, run.name))


def run_of(
    source: xr.Dataset | str | Path, number: int = 0, start: float | None = None, point: Sequence[float] | None = None
) -> Run:
    """Run of a record, or of the folder of one.  Raises InputError."""
    if isinstance(source, xr.Dataset):
        record, name = source, f"run {number}"
    elif (Path(source) / "results.nc").is_file():
        record, name = read(Path(source) / "results.nc"), str(source)
    else:
        raise InputError(f"{source} is not the folder of a run: it has no results.nc.")
    try:
        scene, seconds = scene_of(record), record.attrs.get("wall_time_s", np.nan)
        with fitting(name):
            return Run(name, sample_of(record, scene, start, point), set_of(scene), seconds=seconds)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def set_of(scene: Scene) -> str:
    """Equal for scenes that differ in their seed only."""
    data = scene.to_dict()
    data.pop("title", None)
    data.get("waves", {}).pop("seed", None)
    return json.dumps(data, sort_keys=True)
