"""Statistics of runs that differ in their seed, of several such sets, and of the cases of a sweep.

Runs whose scenes are equal but for `waves.seed` form a set: their cycles and peaks are pooled, and a Gumbel
distribution is fitted to the largest values of the runs.

Samples of runs are read from records, folders or sweeps.
"""

import itertools
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError
from ..parallel.cases import store_in
from ..scene import Scene
from ..scene.variants import SEED, in_words
from .after_ramp import scene_of
from .bars import STATISTICS as BARS
from .criteria import Verdict, governing, over_cases
from .extremes import COVERED, DURATION, HOURS, Gumbel, fit_gumbel
from .labelled import Variable, unit_and_name
from .offsets import smallest_circle
from .quantities import declared
from .record import fitting, read
from .sample import LASTS, NUMBERS, STATISTICS, YEAR, Fatigue, pair_of, sample_of
from .series import OF_PART, Columns, described, place_of, spoken


@dataclass(frozen=True)
class Run:
    """Name and sample of a run, the key of its set, and the changes of a case of a sweep other than the seed.

    seconds: computing time.
    """

    name: str
    sample: dict[str, Any]
    set: str
    changes: dict[str, Any] | None = None
    seconds: float = np.nan


def runs_of(sources: Iterable[Any], start: float | None = None, point: Sequence[float] | None = None) -> list[Run]:
    """Runs from records, folders of runs, and folders of sweeps, of which each case is a run.  Raises InputError."""
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
    """Runs of a sweep, without those that failed or end within their ramp."""
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
    """Run from a record, or from the folder of one.  Raises InputError."""
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
    """Key of a set: equal for scenes that differ only in their seed."""
    data = scene.to_dict()
    data.pop("title", None)
    data.get("waves", {}).pop("seed", None)
    return json.dumps(data, sort_keys=True)


def collect(rows: list[dict[str, Any]]) -> xr.Dataset:
    """One dataset over the dimension `case`: varied keys, status, and <quantity>_<statistic>."""
    keys = list(dict.fromkeys(key for row in rows for key in row["changes"]))
    data = {key.replace(".", "_"): ("case", _column([row["changes"][key] for row in rows])) for key in keys}
    data["status"] = ("case", np.array([row["status"] for row in rows], dtype=object))
    data |= _judged(rows) | _lasting_least(rows)
    columns = Columns(label for row in rows for label in row["statistics"])
    numbers = [row["statistics"] for row in rows]
    known = {number for row in numbers for one in row.values() for number in one}
    data |= columns.table(numbers, STATISTICS, "case")
    data |= columns.table(numbers, sorted(known - set(STATISTICS)), "case", complete=False)  # lives, error bars
    judged = over_cases((in_words(row["changes"]), row) for row in rows)
    return xr.Dataset(data, columns.names, attrs={"varied": ", ".join(keys), **_in_words(judged)})


def _in_words(judged: list[Verdict]) -> dict[str, str]:
    """Attribute with the row of the governing part for each criterion, if there is any."""
    return {"criteria": json.dumps([one.row() for one in governing(judged)])} if judged else {}


def _judged(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The governing criterion of each case, and its margin in per cent of the limit (negative: not met)."""
    every = [governing(over_cases([("", row)])) for row in rows]
    worst = [min(found, key=lambda one: one.use, default=None) for found in every]
    if not any(worst):
        return {}
    names = [f"{one.criterion} {one.part}".strip() if one else "" for one in worst]
    left = [100 * one.use if one else np.nan for one in worst]
    return {
        "criterion": ("case", np.array(names, dtype=object), {"long_name": "the criterion that governs, and its part"}),
        "criterion_left": ("case", left, unit_and_name("%", "left of its limit; negative: missed")),
    }


def _lasting_least(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The shortest fatigue life of each case, if its counted time is repeated, and the place."""
    every = [{label: one["life"] for label, one in row["statistics"].items() if "life" in one} for row in rows]
    if not any(every):
        return {}
    where = [min(lives, key=lives.__getitem__, default="") for lives in every]
    years = [lives.get(label, np.nan) for lives, label in zip(every, where, strict=True)]
    named = {"long_name": "where the shortest life is"}
    return {
        "shortest_life": ("case", years, unit_and_name("year", "shortest life by fatigue, were it so for ever")),
        "shortest_life_of": ("case", np.array([spoken(label) for label in where], dtype=object), named),
    }


def _column(values: list[Any]) -> NDArray[Any]:
    """Numbers as numbers, anything else (words, lists) as text."""
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return np.array(values)
    return np.array([v if isinstance(v, str) else json.dumps(v) for v in values], dtype=object)


def statistics(
    runs: xr.Dataset | str | Path | Iterable[xr.Dataset | str | Path],
    start: float | None = None,
    point: Sequence[float] | None = None,
    **fatigue: Any,
) -> xr.Dataset:
    """Statistics of runs without the ramp: a dataset over `run` and `set`, see `together`.

    runs: records, folders of runs or of sweeps, or one of these.  start [s], point [m]: see `sample_of`, not for
    sweeps.  fatigue: the fields of Fatigue.  Raises InputError for a folder without a run, a run that ends in the ramp,
    or a bad number.
    """
    runs = [runs] if isinstance(runs, xr.Dataset | str | Path) else list(runs)
    return together(runs_of(runs, start, point), Fatigue(**fatigue))


def together(runs: list[Run], fatigue: Fatigue) -> xr.Dataset:
    """Dataset of statistics over `run` and `set` and, for series of a part, over `cable`, `buoy`, ...

    Over `run`: <series>_<number> of NUMBERS, _equivalent_load, _damage and, with error bars, _maximum_bar and so on.
    Over `set`: the circle of offsets, <series>_most_probable (.., bound) of 3 h, and u and b of its distribution.
    Pooled: <series>_peak with _peak_exceedance and <series>_range with _range_count, by _peak_set, _peak_cable, ...
    """
    names = list(dict.fromkeys(run.set for run in runs))
    sets, member = [[run for run in runs if run.set == name] for name in names], [names.index(run.set) for run in runs]
    samples, columns = [run.sample for run in runs], Columns(labels_of(runs, "series"))
    data = {
        "seconds": ("run", [float(run.seconds) for run in runs], unit_and_name("s", "computing time")),
        "start": ("run", [s["start"] for s in samples], unit_and_name("s", "first instant that counts")),
        "duration": ("run", [s["duration"] for s in samples], unit_and_name("s", "length of the time that counts")),
    }
    series = [sample["series"] for sample in samples]
    data |= columns.table(series, NUMBERS, "run")
    data |= columns.table(series, [LASTS], "run", complete=False)
    data |= columns.table(series, BARS.values(), "run", complete=False)
    curves: dict[str, list[str]] = {}
    further = _further(runs, fatigue, curves)
    _age(runs, member, further, fatigue)
    data |= columns.table(further, FURTHER, "run", complete=False)
    if curves:
        factors = [fatigue.factor(sample) for sample in samples]
        data["safety_factor"] = "run", factors, unit_and_name("1", "factor that the life is divided by")
    data |= _circles(sets, columns.names.get("buoy", []))
    words = "peaks", "probability that a peak is as high or higher"
    data |= _pools(sets, "peaks", "peak", "exceedance", words)
    words = "rainflow ranges", "cycles of this range, half cycles as 0.5"
    data |= _pools(sets, "cycles", "range", "count", words)
    found, notes = _extremes(sets, columns)
    coordinates = {"run": [run.name for run in runs], "set": np.arange(len(sets)), "set_of_run": ("run", member)}
    if found:
        coordinates["bound"] = ["estimate", "low", "high"]
    attributes: dict[str, Any] = {
        "exponent": fatigue.exponent,
        "frequency_Hz": fatigue.frequency,
        "hours": HOURS,
        "covered": COVERED,
    }
    attributes |= {"constant": fatigue.constant} if fatigue.constant else {}
    attributes |= _in_words(over_cases((run.name if len(runs) > 1 else "", run.sample) for run in runs))
    attributes["notes"] = "\n".join([*_parted(runs), *notes, *curves_in_words(curves)])
    return xr.Dataset(data | found, coordinates | columns.names, attrs=attributes)


def _parted(runs: list[Run]) -> list[str]:
    """A sentence about runs in which lines parted."""
    gone = [run for run in runs if run.sample.get("parted")]
    if not gone:
        return []
    first = f"{gone[0].name}: {gone[0].sample['parted']}"
    which = first if len(runs) == 1 else f"in {len(gone)} of {len(runs)} runs, {first}"
    return [f"Lines parted, {which}; numbers mix what was before and after, unless --from is later than that."]


def labels_of(runs: list[Run], kept: str) -> list[str]:
    """Labels of the series, peaks or cycles of runs."""
    return list(dict.fromkeys(label for run in runs for label in run.sample[kept]))


#: Statistics of some series only: of elevations, and of series with cycles.
FURTHER = ("m0", "Hs", "equivalent_load", "damage", "life")


def _further(runs: list[Run], fatigue: Fatigue, curves: dict[str, list[str]]) -> list[dict[str, dict[str, float]]]:
    """FURTHER of each run, with damage for series with a curve; adds the series of each curve to `curves`."""
    rows: list[dict[str, dict[str, float]]] = []
    for sample in (run.sample for run in runs):
        deviations = {label: numbers["standard_deviation"] for label, numbers in sample["series"].items()}
        elevations = {label: d for label, d in deviations.items() if declared(place_of(label).name).place}
        row = {label: {"m0": deviation * deviation, "Hs": 4 * deviation} for label, deviation in elevations.items()}
        for label in labels_of(runs, "cycles"):
            row[label] = {"equivalent_load": fatigue.equivalent_load(sample, label)}
            if label in sample["cycles"] and (damage := fatigue.damage(sample, label)) is not None:
                row[label]["damage"] = damage.sum
                curves.setdefault(damage.curve, []).append(label)
        rows.append(row)
    return rows


def _age(runs: list[Run], member: Any, rows: list[dict[str, dict[str, float]]], fatigue: Fatigue) -> None:
    """Add the life of corroding lines, from the damage of all runs of their set, to the rows of `_further`."""
    for one in set(member):
        mine = [k for k, number in enumerate(member) if number == one]
        if not any(runs[k].sample.get("fatigue", {}).get("corrosion_rate") for k in mine):
            continue
        for label in rows[mine[0]]:
            known = [k for k in mine if "damage" in rows[k].get(label, {})]
            if known == mine:
                length = sum(runs[k].sample["duration"] for k in mine)
                yearly = YEAR * sum(rows[k][label]["damage"] for k in mine) / length
                for k in mine:
                    rows[k][label]["life"] = fatigue.life(runs[mine[0]].sample, label, yearly)


def curves_in_words(curves: dict[str, list[str]]) -> list[str]:
    """A sentence about each fatigue curve."""
    found = []
    for curve, every in curves.items():
        labels = list(dict.fromkeys(every))
        which = ", ".join(labels) if len(labels) < 4 else f"{len(labels)} series, {labels[0]} first"
        found.append(f"Fatigue by {curve}: {which}.")
    return found


def shortest_life(labels: list[str], lives: list[float], factor: float) -> list[str]:
    """A sentence about the series with the shortest life."""
    known = {label: life for label, life in zip(labels, lives, strict=True) if math.isfinite(life)}
    if not known:
        return []
    where = min(known, key=known.__getitem__)
    over = f", {known[where] / factor:.4g} years over the safety factor {factor:g}" if factor > 1 else ""
    return [f"The shortest life is {known[where]:.4g} years, of {where}{over}."]


def exceedance(values: NDArray[Any], counts: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """(values in decreasing order, probability that a peak is as high or higher): i/(N + 1) for the i-th of N."""
    order = np.argsort(values)[::-1]
    above = np.cumsum(counts[order])
    return values[order], above / (above[-1] + 1) if len(above) else above


def _pools(sets: list[list[Run]], kept: str, ending: str, other: str, words: tuple[str, str]) -> dict[str, Any]:
    """Peaks or cycles pooled over the runs of each set, with the number of the set and the name of the part."""
    data: dict[str, Variable] = {}
    by_name: dict[str, list[tuple[Any, ...]]] = {}
    for label in labels_of([run for runs in sets for run in runs], kept):
        for k, runs in enumerate(sets):
            pairs = zip(*(pair_of(run.sample, kept, label) for run in runs), strict=True)
            pair = [np.concatenate(column) for column in pairs]
            row = k, place_of(label), *(exceedance(*pair) if kept == "peaks" else pair)
            by_name.setdefault(place_of(label).name, []).append(row)
    for name, rows in by_name.items():
        (numbers, places, values, counts), (unit, text) = zip(*rows, strict=True), described(name)
        name, over, lengths = f"{name}_{ending}", f"{name}_{ending}_number", [len(column) for column in values]
        data[f"{name}_set"] = over, np.repeat(numbers, lengths), {"long_name": "set"}
        if dimension := places[0].dimension:
            parts = np.repeat([place.part for place in places], lengths)
            data[f"{name}_{dimension}"] = over, parts, {"long_name": dimension}
        data[name] = over, np.concatenate(values), unit_and_name(unit, f"{words[0]}: {text}")
        data[f"{name}_{other}"] = over, np.concatenate(counts), unit_and_name("1", words[1])
    return data


def _circles(sets: list[list[Run]], buoys: list[str]) -> dict[str, Any]:
    """The smallest circles around the tracks of each set, free and about the anchor, and the tracks' convex hulls."""
    tracks = {}
    for (k, runs), buoy in itertools.product(enumerate(sets), buoys):
        corners = [point for run in runs for point in run.sample.get("corners", {}).get(buoy, [])]
        if corners:
            tracks[k, buoy] = np.array(corners)
    if not tracks:
        return {}
    circles = np.full((4, len(sets), len(buoys)), np.nan)
    for (k, buoy), points in tracks.items():
        centre, radius = smallest_circle(points)
        farthest = (run.sample["series"].get(f"offset{OF_PART}{buoy}", {}) for run in sets[k])
        watch = max(numbers.get("maximum", np.nan) for numbers in farthest)
        circles[:, k, buoys.index(buoy)] = *centre, radius, watch
    text = "the smallest circle that holds the tracks of C"
    words = {"circle_x": "x of the middle of", "circle_y": "y of the middle of", "circle_radius": "radius of"}
    words |= {"watch_circle_radius": "about the anchor: radius of"}
    data: dict[str, Variable] = {
        name: (("set", "buoy"), values, unit_and_name("m", f"{what} {text}"))
        for (name, what), values in zip(words.items(), circles, strict=True)
    }
    numbers, names = zip(*(place for place, points in tracks.items() for _ in points), strict=True)
    data["corner_set"] = "corner", np.array(numbers), {"long_name": "set"}
    data["corner_buoy"] = "corner", np.array(names), {"long_name": "buoy"}
    for name, column in zip("xy", np.concatenate([*tracks.values()]).T, strict=True):
        data[f"corner_{name}"] = "corner", column, unit_and_name("m", "corners of the convex hull of the track of C")
    return data


def gumbels(runs: list[Run], label: str) -> tuple[Gumbel, float]:
    """(Gumbel distribution of the largest values of the runs of a set, length of a run [s]).  Raises InputError."""
    lengths = np.array([run.sample["duration"] for run in runs])
    if np.ptp(lengths) > 1e-6 * lengths.max():
        raise InputError("the runs are not equally long, and their largest values not of one distribution")
    if any(label not in run.sample["series"] for run in runs):
        raise InputError("not all runs have it")
    return fit_gumbel([run.sample["series"][label]["maximum"] for run in runs]), float(lengths[0])


def _extremes(sets: list[list[Run]], columns: Columns) -> tuple[dict[str, Any], list[str]]:
    """(variables over `set`, sentences about extremes that cannot be given)."""
    found: dict[str, NDArray[Any]] = {}
    reasons: dict[str, list[tuple[int, str]]] = {}
    data: dict[str, Variable] = {}
    for label in labels_of([run for runs in sets for run in runs], "peaks"):
        rows = found[label] = np.full((len(sets), 5), np.nan)
        for k, runs in enumerate(sets):
            if not any(label in run.sample["series"] for run in runs):
                continue  # it is of another scene
            try:
                gumbel, length = gumbels(runs, label)
            except InputError as error:
                reasons.setdefault(str(error), []).append((k, label))
                continue
            times = DURATION / length
            rows[k] = gumbel.most_probable(times), *gumbel.interval(times), gumbel.location, gumbel.scale
    of_run = "of Gumbel's distribution of the largest value of a run"
    for which, ending, words, dims in (
        (slice(3), "most_probable", f"most probable largest value of {HOURS:g} h", ("set", "bound")),
        (3, "gumbel_location", of_run, ("set",)),
        (4, "gumbel_scale", of_run, ("set",)),
    ):
        data |= columns.variables({label: rows[:, which] for label, rows in found.items()}, ending, words, dims)
    notes = []
    for reason, missing in reasons.items():
        where, labels = {k for k, _ in missing}, sorted({label for _, label in missing})
        part = f" in {len(where)} of {len(sets)} sets" if len(sets) > 1 else ""
        what = f"No most probable maximum of {HOURS:g} h{part}"
        notes.append(f"{what} ({len(labels)} series, {labels[0]} first): {reason}.")
    return {name: one for name, one in data.items() if np.isfinite(one[1]).any()}, notes
