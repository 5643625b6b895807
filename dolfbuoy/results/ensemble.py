"""Statistics of a run, of runs that differ in their seed, or of several such sets, in one dataset.

Runs whose scenes are equal but for `waves.seed` are a set: their cycles and peaks are pooled, and the largest value of
each is one of the maxima that Gumbel's distribution is fitted to.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from ..errors import InputError
from ..parallel.cases import store_in
from ..scene import Scene
from ..scene.variants import SEED
from . import cycles
from .behind_ramp import scene_of
from .certainty import HOURS
from .extremes import COVERED, Gumbel, fit_gumbel
from .offsets import smallest_circle
from .record import UNFIT, read, undamaged
from .sample import ADDED, FIXED_POINT, NUMBERS, sample_of
from .statistics import described

#: Series that are elevations of the water.
ELEVATIONS = ("surface_elevation", FIXED_POINT)


@dataclass(frozen=True)
class Fatigue:
    """An S-N curve, N = constant S^-exponent, S the range of the tension [N]; and what equivalent loads refer to.

    constant: cycles to failure times N^exponent; None: no Miner sum.  frequency: of the equivalent load [Hz].
    """

    exponent: float = 3.0
    constant: float | None = None
    frequency: float = 1.0

    def __post_init__(self):
        for name in ("exponent", "constant", "frequency"):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise InputError(f"{name} = {value}: must be a positive number.")


@dataclass(frozen=True)
class Run:
    """A sample, the name of its run, what makes runs a set, and what the cases of a sweep change but for the seed.

    seconds: of computing.
    """

    name: str
    sample: dict
    set: str
    changes: dict | None = None
    seconds: float = np.nan


def statistics(runs, start: float | None = None, point=None, **fatigue) -> xr.Dataset:
    """Statistics of runs, the ramp left out: a dataset over `run` and `set`, see `together`.

    runs: records, folders of runs or of sweeps, or one of them.  start [s], point [m]: see `sample.sample_of`, not of
    sweeps.  fatigue: the fields of Fatigue.  Raises InputError for a folder without a run, a run that ends in the ramp,
    or a bad number.
    """
    runs = [runs] if isinstance(runs, xr.Dataset | str | Path) else list(runs)
    return together(runs_of(runs, start, point), Fatigue(**fatigue))


def runs_of(sources, start: float | None = None, point=None) -> list[Run]:
    """Of records, folders of runs, and folders of sweeps, whose cases are runs each.  Raises InputError."""
    found = []
    for k, source in enumerate(sources):
        if not isinstance(source, xr.Dataset) and (Path(source) / "cases").is_dir():
            if start is not None or point is not None:
                raise InputError(f"{source}: a sweep keeps no records: its statistics begin behind the ramp.")
            found += _cases_in(Path(source))
        else:
            found.append(_run(source, k, start, point))
    if not found:
        raise InputError("There is no run to make statistics of.")
    return found


def _cases_in(folder):
    """Runs of a sweep; those that failed, or end in their ramp, are left out."""
    found = []
    for result in store_in(folder).results():
        if not result.get("sample"):
            continue
        changes = result["changes"]
        name = ", ".join(f"{key} = {value}" for key, value in changes.items())
        state = {key: value for key, value in changes.items() if key != SEED}
        found.append(
            Run(name, result["sample"], json.dumps([result["base"], state], sort_keys=True), state, result["seconds"])
        )
    if not found:
        raise InputError(f"{folder} holds no case of a sweep that has run beyond its ramp.")
    return sorted(found, key=lambda run: (run.set, run.name))


def _run(source, number, start, point):
    if isinstance(source, xr.Dataset):
        record, name = source, f"run {number}"
    else:
        record, name = read_folder(Path(source)), str(source)
    try:
        scene, seconds = scene_of(record), record.attrs.get("wall_time_s", np.nan)
        with undamaged(name, UNFIT):
            return Run(name, sample_of(record, scene, start, point), set_of(scene), seconds=seconds)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def read_folder(folder: Path) -> xr.Dataset:
    """The record in the folder of a run.  Raises InputError."""
    if not (folder / "results.nc").is_file():
        raise InputError(f"{folder} is not the folder of a run: it has no results.nc.")
    return read(folder / "results.nc")


def set_of(scene: Scene) -> str:
    """Equal for scenes that differ in their seed only."""
    data = scene.to_dict()
    data.pop("title", None)
    data.get("waves", {}).pop("seed", None)
    return json.dumps(data, sort_keys=True)


def together(runs: list[Run], fatigue: Fatigue) -> xr.Dataset:
    """Over `run`: <series>_<number> of NUMBERS, <series>_equivalent_load, <series>_damage.  Over `set`: the circle of
    offsets, <series>_most_probable(set, bound) of 3 h, and u and b of its distribution.  <series>_peak, with
    _peak_exceedance, and <series>_range, with _range_count: pooled over the set that _peak_set and _range_set number.
    """
    names = list(dict.fromkeys(run.set for run in runs))
    member = np.array([names.index(run.set) for run in runs])
    seconds = np.array([run.seconds for run in runs], dtype=float)
    data = {"seconds": ("run", seconds, {"units": "s", "long_name": "computing time"})}
    data |= _numbers(runs) | _wear(runs, fatigue) | _circles(runs, member, len(names))
    for kept, pool in (("peaks", _peaks), ("cycles", _ranges)):
        for label in dict.fromkeys(label for run in runs for label in run.sample[kept]):
            data |= pool(label, [_pooled(runs, member == k, kept, label) for k in range(len(names))])
    found, notes = _extremes(runs, member, len(names))
    coordinates = {
        "run": ("run", [run.name for run in runs]),
        "set": ("set", np.arange(len(names))),
        "set_of_run": ("run", member),
    }
    if found:
        coordinates["bound"] = ("bound", ["estimate", "low", "high"])
    return xr.Dataset(data | found, coordinates, attrs=_attributes(fatigue, _parted(runs) + notes))


def _attributes(fatigue, notes):
    told = {"exponent": fatigue.exponent, "frequency_Hz": fatigue.frequency, "hours": HOURS, "covered": COVERED}
    return told | ({"constant": fatigue.constant} if fatigue.constant else {}) | {"notes": "\n".join(notes)}


def _parted(runs):
    """A sentence about runs in which lines parted."""
    gone = [run for run in runs if run.sample.get("parted")]
    if not gone:
        return []
    first = f"{gone[0].name}: {gone[0].sample['parted']}"
    which = first if len(runs) == 1 else f"in {len(gone)} of {len(runs)} runs, {first}"
    return [f"Lines parted, {which}; numbers mix what was before and after, unless --from is later than that."]


def described_here(label: str) -> tuple[str, str]:
    """(unit, long name) of a series of a sample."""
    return ADDED[label] if label in ADDED else described(label)


def _over_runs(runs, get: Callable, unit, text):
    return "run", np.array([get(run.sample) for run in runs], dtype=float), {"units": unit, "long_name": text}


def _numbers(runs):
    data = {key: _over_runs(runs, lambda s, key=key: s[key], "s", text) for key, text in _TIMES.items()}
    for label in dict.fromkeys(label for run in runs for label in run.sample["series"]):
        unit, text = described_here(label)
        for number in NUMBERS:
            units = {"skewness": "1", "period": "s", "memory": "s"}.get(number, unit)

            def get(sample, label=label, number=number):
                return sample["series"].get(label, {}).get(number, np.nan)

            data[f"{label}_{number}"] = _over_runs(runs, get, units, f"{number.replace('_', ' ')}: {text}")
        if label in ELEVATIONS:
            data |= _of_the_sea(label, data[f"{label}_standard_deviation"][1], text)
    return data


def _of_the_sea(label, deviation, text):
    """Variance and significant height of an elevation; its mean period is there already."""
    return {
        f"{label}_m0": ("run", deviation**2, {"units": "m2", "long_name": f"variance m0: {text}"}),
        f"{label}_Hs": ("run", 4 * deviation, {"units": "m", "long_name": f"significant height 4 sqrt(m0): {text}"}),
    }


_TIMES = {"start": "first instant that counts", "duration": "length of the time that counts"}


def _wear(runs, fatigue):
    """Equivalent loads, and with a constant Miner sums."""
    data = {}
    for label in dict.fromkeys(label for run in runs for label in run.sample["cycles"]):
        unit, text = described_here(label)

        def load(sample, label=label):
            ranges, counts = map(np.array, sample["cycles"].get(label, ([], [])))
            return cycles.equivalent_load(ranges, counts, fatigue.exponent, fatigue.frequency * sample["duration"])

        def damage(sample, label=label):
            ranges, counts = map(np.array, sample["cycles"].get(label, ([], [])))
            return cycles.miner_sum(ranges, counts, fatigue.exponent, fatigue.constant)

        data[f"{label}_equivalent_load"] = _over_runs(runs, load, unit, f"damage-equivalent range: {text}")
        if fatigue.constant:
            data[f"{label}_damage"] = _over_runs(runs, damage, "1", f"Miner sum of the run: {text}")
    return data


def _circles(runs, member, sets):
    """The smallest circle around the tracks of each set, anywhere and about the anchor; the hulls of the tracks."""
    tracks = [np.reshape(run.sample.get("corners", []), (-1, 2)) for run in runs]
    if not any(len(track) for track in tracks):
        return {}
    circles, watch = np.full((sets, 3), np.nan), np.full(sets, np.nan)
    for k in range(sets):
        mine = np.flatnonzero(member == k)
        points = np.concatenate([tracks[i] for i in mine])
        if len(points):
            centre, radius = smallest_circle(points)
            circles[k] = *centre, radius
            watch[k] = max(runs[i].sample.get("watch_circle", np.nan) for i in mine)
    text = "the smallest circle that holds the tracks of C"
    x, y = np.concatenate(tracks).T
    told = {"units": "m", "long_name": "corners of the convex hull of the track of C"}
    return {
        "circle_x": ("set", circles[:, 0], {"units": "m", "long_name": f"x of the middle of {text}"}),
        "circle_y": ("set", circles[:, 1], {"units": "m", "long_name": f"y of the middle of {text}"}),
        "circle_radius": ("set", circles[:, 2], {"units": "m", "long_name": f"radius of {text}"}),
        "watch_circle_radius": ("set", watch, {"units": "m", "long_name": f"about the anchor: radius of {text}"}),
        "corner_set": ("corner", np.repeat(member, [len(track) for track in tracks]), {"long_name": "set"}),
        "corner_x": ("corner", x, told),
        "corner_y": ("corner", y, told),
    }


def _pooled(runs, members, kept, label):
    """(values, counts) of the runs of a set."""
    pairs = [run.sample[kept].get(label, ([], [])) for run, mine in zip(runs, members, strict=True) if mine]
    return tuple(np.concatenate([np.asarray(pair[i], dtype=float) for pair in pairs]) for i in range(2))


def _peaks(label, pools):
    unit, text = described_here(label)
    ordered = [cycles.exceedance(*pool) for pool in pools]
    return _ragged(
        f"{label}_peak",
        {
            "": ([values for values, _ in ordered], unit, f"peaks: {text}"),
            "_exceedance": ([share for _, share in ordered], "1", "probability that a peak is as high or higher"),
        },
    )


def _ranges(label, pools):
    unit, text = described_here(label)
    return _ragged(
        f"{label}_range",
        {
            "": ([values for values, _ in pools], unit, f"rainflow ranges: {text}"),
            "_count": ([counts for _, counts in pools], "1", "cycles of this range, half cycles as 0.5"),
        },
    )


def _ragged(name, columns):
    """Variables of different lengths for each set, one behind the other; {name}_set numbers the sets."""
    lengths = [len(values) for values in columns[""][0]]
    data = {f"{name}_set": (f"{name}_number", np.repeat(np.arange(len(lengths)), lengths), {"long_name": "set"})}
    for suffix, (values, unit, text) in columns.items():
        data[name + suffix] = (f"{name}_number", np.concatenate(values), {"units": unit, "long_name": text})
    return data


def gumbels(runs: list[Run], label: str) -> tuple[Gumbel, float]:
    """(Gumbel's distribution of the largest values of the runs of one set, length of a run [s]).  Raises InputError."""
    lengths = np.array([run.sample["duration"] for run in runs])
    if np.ptp(lengths) > 1e-6 * lengths.max():
        raise InputError("the runs are not equally long, and their largest values not of one distribution")
    return fit_gumbel([run.sample["series"][label]["maximum"] for run in runs]), float(lengths[0])


def _extremes(runs, member, sets):
    """(variables over set, sentences about what there is not)."""
    data, reasons = {}, {}
    for label in dict.fromkeys(label for run in runs for label in run.sample["peaks"]):
        rows = np.full((sets, 5), np.nan)
        for k in range(sets):
            try:
                gumbel, length = gumbels([run for run, m in zip(runs, member, strict=True) if m == k], label)
            except InputError as error:
                reasons.setdefault(str(error), []).append((k, label))
                continue
            times = HOURS * 3600 / length
            rows[k] = gumbel.most_probable(times), *gumbel.interval(times), gumbel.location, gumbel.scale
        if np.isfinite(rows).any():
            data |= _extreme(label, rows)
    return data, list(_told(reasons, sets))


def _extreme(label, rows):
    unit, text = described_here(label)
    told = {"units": unit, "long_name": f"most probable largest value of {HOURS:g} h: {text}"}
    scale = {"units": unit, "long_name": f"of Gumbel's distribution of the largest value of a run: {text}"}
    return {
        f"{label}_most_probable": (("set", "bound"), rows[:, :3], told),
        f"{label}_gumbel_location": ("set", rows[:, 3], scale),
        f"{label}_gumbel_scale": ("set", rows[:, 4], scale),
    }


def _told(reasons: dict, sets: int) -> Iterable[str]:
    """A sentence for each reason why something has no distribution."""
    for reason, missing in reasons.items():
        where = {k for k, _ in missing}
        labels = sorted({label for _, label in missing})
        which = "" if sets == 1 else f" in {len(where)} of {sets} sets"
        yield f"No most probable maximum of {HOURS:g} h{which} ({len(labels)} series, {labels[0]} first): {reason}."
