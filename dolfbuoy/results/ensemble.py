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
from .sample import FIXED_POINT, NUMBERS, sample_of
from .statistics import OF_PART, Spread, described

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
    """Over `run` and, if it is of one, `cable` or `buoy`: <series>_<number> of NUMBERS, <series>_equivalent_load,
    <series>_damage.  Over `set` and the same: the circle of offsets, <series>_most_probable (.., bound) of 3 h, and u
    and b of its distribution.  <series>_peak, with _peak_exceedance, and <series>_range, with _range_count: pooled over
    the set that _peak_set and _range_set number, of the cable or buoy that _peak_cable, ... names.
    """
    names = list(dict.fromkeys(run.set for run in runs))
    member = np.array([names.index(run.set) for run in runs])
    seconds = np.array([run.seconds for run in runs], dtype=float)
    spread = Spread(_labels(runs, "series"))
    data = {"seconds": ("run", seconds, {"units": "s", "long_name": "computing time"})}
    data |= _numbers(runs, spread) | _wear(runs, fatigue, spread) | _circles(runs, member, spread.names.get("buoy"))
    for kept, make in (("peaks", _peaks), ("cycles", _ranges)):
        pools = {
            label: [_pooled(runs, member == k, kept, label) for k in range(len(names))] for label in _labels(runs, kept)
        }
        for name in dict.fromkeys(label.partition(OF_PART)[0] for label in pools):
            data |= make(name, {label: pool for label, pool in pools.items() if label.partition(OF_PART)[0] == name})
    found, notes = _extremes(runs, member, spread)
    coordinates = {
        "run": ("run", [run.name for run in runs]),
        "set": ("set", np.arange(len(names))),
        "set_of_run": ("run", member),
        **spread.names,
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


def _labels(runs, kept):
    """Of the series, peaks or cycles of runs."""
    return list(dict.fromkeys(label for run in runs for label in run.sample[kept]))


def _over_runs(runs, get: Callable):
    return np.array([get(run.sample) for run in runs], dtype=float)


def _numbers(runs, spread):
    said = {key: {"units": "s", "long_name": text} for key, text in _TIMES.items()}
    data = {key: ("run", _over_runs(runs, lambda s, key=key: s[key]), said[key]) for key in _TIMES}
    labels = _labels(runs, "series")
    for number in NUMBERS:

        def column(label, number=number):
            return _over_runs(runs, lambda s: s["series"].get(label, {}).get(number, np.nan))

        for name, (dims, values) in spread({label: column(label) for label in labels}, "run").items():
            unit, text = described(name)
            unit = {"skewness": "1", "period": "s", "memory": "s"}.get(number, unit)
            said = {"units": unit, "long_name": f"{number.replace('_', ' ')}: {text}"}
            data[f"{name}_{number}"] = dims, values, said
            if number == "standard_deviation" and name in ELEVATIONS:
                data |= _of_the_sea(name, dims, values, text)
    return data


def _of_the_sea(name, dims, deviation, text):
    """Variance and significant height of an elevation; its mean period is there already."""
    height = {"units": "m", "long_name": f"significant height 4 sqrt(m0): {text}"}
    return {
        f"{name}_m0": (dims, deviation**2, {"units": "m2", "long_name": f"variance m0: {text}"}),
        f"{name}_Hs": (dims, 4 * deviation, height),
    }


_TIMES = {"start": "first instant that counts", "duration": "length of the time that counts"}


def _wear(runs, fatigue, spread):
    """Equivalent loads, and with a constant Miner sums."""
    data, labels = {}, _labels(runs, "cycles")

    def ranges(sample, label):
        return map(np.array, sample["cycles"].get(label, ([], [])))

    def load(label):
        m, f = fatigue.exponent, fatigue.frequency
        return _over_runs(runs, lambda s: cycles.equivalent_load(*ranges(s, label), m, f * s["duration"]))

    def damage(label):
        return _over_runs(runs, lambda s: cycles.miner_sum(*ranges(s, label), fatigue.exponent, fatigue.constant))

    for name, (dims, values) in spread({label: load(label) for label in labels}, "run").items():
        unit, text = described(name)
        said = {"units": unit, "long_name": f"damage-equivalent range: {text}"}
        data[f"{name}_equivalent_load"] = dims, values, said
    if fatigue.constant:
        for name, (dims, values) in spread({label: damage(label) for label in labels}, "run").items():
            said = {"units": "1", "long_name": f"Miner sum of the run: {described(name)[1]}"}
            data[f"{name}_damage"] = dims, values, said
    return data


def _circles(runs, member, buoys):
    """The smallest circle around the tracks of each set, anywhere and about the anchor; the hulls of the tracks."""
    if not any(run.sample.get("corners") for run in runs):
        return {}
    tracks = {
        (i, j): run.sample.get("corners", {}).get(b, []) for i, run in enumerate(runs) for j, b in enumerate(buoys)
    }
    size = (member.max() + 1, len(buoys))
    circles, watch = np.full((3, *size), np.nan), np.full(size, np.nan)
    for k, j in np.ndindex(size):
        mine = np.flatnonzero(member == k)
        points = [point for i in mine for point in tracks[i, j]]
        if points:
            centre, radius = smallest_circle(np.array(points))
            circles[:, k, j] = *centre, radius
            watch[k, j] = max(runs[i].sample.get("watch_circle", {}).get(buoys[j], np.nan) for i in mine)
    text, dims = "the smallest circle that holds the tracks of C", ("set", "buoy")
    corners = [(member[i], buoys[j], *point) for (i, j), track in tracks.items() for point in track]
    sets, names, x, y = zip(*corners, strict=True)
    told = {"units": "m", "long_name": "corners of the convex hull of the track of C"}
    return {
        "circle_x": (dims, circles[0], {"units": "m", "long_name": f"x of the middle of {text}"}),
        "circle_y": (dims, circles[1], {"units": "m", "long_name": f"y of the middle of {text}"}),
        "circle_radius": (dims, circles[2], {"units": "m", "long_name": f"radius of {text}"}),
        "watch_circle_radius": (dims, watch, {"units": "m", "long_name": f"about the anchor: radius of {text}"}),
        "corner_set": ("corner", np.array(sets), {"long_name": "set"}),
        "corner_buoy": ("corner", np.array(names), {"long_name": "buoy"}),
        "corner_x": ("corner", np.array(x), told),
        "corner_y": ("corner", np.array(y), told),
    }


def _pooled(runs, members, kept, label):
    """(values, counts) of the runs of a set."""
    pairs = [run.sample[kept].get(label, ([], [])) for run, mine in zip(runs, members, strict=True) if mine]
    return tuple(np.concatenate([np.asarray(pair[i], dtype=float) for pair in pairs]) for i in range(2))


def _peaks(name, pools):
    unit, text = described(name)
    ordered = {label: [cycles.exceedance(*pool) for pool in of_sets] for label, of_sets in pools.items()}
    said = {"": (unit, f"peaks: {text}"), "_exceedance": ("1", "probability that a peak is as high or higher")}
    return _ragged(f"{name}_peak", ordered, said)


def _ranges(name, pools):
    unit, text = described(name)
    said = {"": (unit, f"rainflow ranges: {text}"), "_count": ("1", "cycles of this range, half cycles as 0.5")}
    return _ragged(f"{name}_range", pools, said)


def _ragged(name, pools, said):
    """Variables of different lengths for each set, one behind the other; {name}_set numbers the sets, and {name}_cable,
    or whatever they are of, names it.

    pools: label -> [(values of one, values of the other variable), ...] of each set.  said: ending -> (unit, text).
    """
    over, parts = f"{name}_number", [(Spread.place(label), pools[label]) for label in pools]
    dimension = parts[0][0][0]
    lengths = [[len(pair[0]) for pair in of_sets] for _, of_sets in parts]
    data = {
        f"{name}_set": (over, np.concatenate([np.repeat(np.arange(len(n)), n) for n in lengths]), {"long_name": "set"})
    }
    if dimension:
        names = np.repeat([part for (_, part), _ in parts], [sum(n) for n in lengths])
        data[f"{name}_{dimension}"] = (over, names, {"long_name": dimension})
    for i, (ending, (unit, text)) in enumerate(said.items()):
        values = np.concatenate([pair[i] for _, of_sets in parts for pair in of_sets])
        data[name + ending] = (over, values, {"units": unit, "long_name": text})
    return data


def gumbels(runs: list[Run], label: str) -> tuple[Gumbel, float]:
    """(Gumbel's distribution of the largest values of the runs of one set, length of a run [s]).  Raises InputError."""
    lengths = np.array([run.sample["duration"] for run in runs])
    if np.ptp(lengths) > 1e-6 * lengths.max():
        raise InputError("the runs are not equally long, and their largest values not of one distribution")
    return fit_gumbel([run.sample["series"][label]["maximum"] for run in runs]), float(lengths[0])


def _extremes(runs, member, spread):
    """(variables over set, sentences about what there is not)."""
    columns, reasons, sets = {}, {}, member.max() + 1
    for label in _labels(runs, "peaks"):
        rows = columns[label] = np.full((sets, 5), np.nan)
        for k in range(sets):
            try:
                gumbel, length = gumbels([run for run, m in zip(runs, member, strict=True) if m == k], label)
            except InputError as error:
                reasons.setdefault(str(error), []).append((k, label))
                continue
            times = HOURS * 3600 / length
            rows[k] = gumbel.most_probable(times), *gumbel.interval(times), gumbel.location, gumbel.scale
    data = {}
    for name, (dims, rows) in spread(columns, "set", "bound").items():
        if np.isfinite(rows).any():
            data |= _extreme(name, dims, rows)
    return data, list(_told(reasons, sets))


def _extreme(name, dims, rows):
    unit, text = described(name)
    told = {"units": unit, "long_name": f"most probable largest value of {HOURS:g} h: {text}"}
    scale = {"units": unit, "long_name": f"of Gumbel's distribution of the largest value of a run: {text}"}
    return {
        f"{name}_most_probable": (dims, rows[..., :3], told),
        f"{name}_gumbel_location": (dims[:-1], rows[..., 3], scale),
        f"{name}_gumbel_scale": (dims[:-1], rows[..., 4], scale),
    }


def _told(reasons: dict, sets: int) -> Iterable[str]:
    """A sentence for each reason why something has no distribution."""
    for reason, missing in reasons.items():
        where = {k for k, _ in missing}
        labels = sorted({label for _, label in missing})
        which = "" if sets == 1 else f" in {len(where)} of {sets} sets"
        yield f"No most probable maximum of {HOURS:g} h{which} ({len(labels)} series, {labels[0]} first): {reason}."
