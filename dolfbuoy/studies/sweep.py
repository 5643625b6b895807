"""Many variants of one scene: statistics of each run, spread over ranks, kept case by case."""

import csv
import itertools
import json
import math
import tomllib
from concurrent.futures import as_completed
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpi4py import MPI
from rich.console import Console
from rich.progress import track

from ..api import simulate
from ..errors import InputError
from ..parallel import interruption
from ..results.record import SERIES
from ..scene import build_scene, load_scene, parse_assignment
from . import common

#: What is said of every recorded quantity over the whole run.
STATISTICS = ("minimum", "maximum", "mean", "standard_deviation", "dominant_period")
#: Recorded, but about the solver.
EFFORT = ("time_step", "newton_iterations")


# -- cases -------------------------------------------------------------------------------------------------------------


def parse_vary(text: str) -> tuple[str, list]:
    """`key=a,b,c` or `key=start:stop:step` (stop included) -> (key, values).  Raises InputError."""
    key, equals, values = (part.strip() for part in text.partition("="))
    if not key or not equals or not values:
        raise InputError(f"--vary {text}: must have the form section.key=a,b,c or section.key=start:stop:step.")
    if ":" in values:
        return key, _range(text, values.split(":"))
    try:
        return key, tomllib.loads(f"values = [{values}]")["values"]
    except tomllib.TOMLDecodeError:  # bare words
        found = [value.strip() for value in values.split(",")]
    if not all(found):
        raise InputError(f"--vary {text}: there is an empty value between the commas.")
    return key, [parse_assignment(f"{key}={value}")[1] for value in found]


def _range(text, parts):
    try:
        start, stop, step = (float(part) for part in parts)
        count = math.floor((stop - start) / step + 1e-9) + 1
    except (ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f"--vary {text}: a range must be start:stop:step in finite numbers, step not zero.") from None
    if count < 1:
        raise InputError(f"--vary {text}: the range is empty.")
    values = [float(f"{start + i * step:.12g}") for i in range(count)]  # 0.3, not 0.30000000000000004
    return [int(v) for v in values] if all(part.strip().lstrip("+-").isdigit() for part in parts) else values


def cases_of(vary: list[str], table: Path | None) -> list[dict]:
    """Changes of each case: all combinations of `vary`, or the rows of a CSV file whose header names keys."""
    if (table is None) == (not vary):
        raise InputError("A sweep needs either --vary (once or more) or --table.")
    if table is not None:
        return _rows(table)
    keys, values = zip(*(parse_vary(text) for text in vary), strict=True)
    if len(set(keys)) < len(keys):
        raise InputError(f"--vary: {max(keys, key=keys.count)} is given more than once.")
    return [dict(zip(keys, combination, strict=True)) for combination in itertools.product(*values)]


def _rows(table):
    try:
        with open(table, newline="", encoding="utf-8-sig") as file:
            header, *rows = [row for row in csv.reader(file) if row] or [[]]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"--table {table}: cannot be read as a CSV file: {error}.") from None
    if not rows:
        raise InputError(f"--table {table}: it needs a header of keys and at least one row.")
    if not all(key.strip() for key in header) or len(set(header)) < len(header):
        raise InputError(f"--table {table}: every column needs a key of its own in the header, not {','.join(header)}.")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header) or not all(value.strip() for value in row):
            raise InputError(f"--table {table}: row {number} does not have one value for each of {', '.join(header)}.")
    return [dict(parse_assignment(f"{k}={v}") for k, v in zip(header, row, strict=True)) for row in rows]


def _known(scene, key):
    """Refuse a key that no scene has; whether its values are good shows case by case."""
    try:
        build_scene(scene.to_dict(), {key: scene.to_dict()})
    except InputError as error:
        if "Unknown key" in str(error) or "is not a section" in str(error):
            raise InputError(f"{key}: {error}") from None


# -- one case ----------------------------------------------------------------------------------------------------------


def evaluate(case: dict) -> dict:
    """Run one case on this rank alone; a case that fails is a result too, with its reason."""
    try:
        record = simulate(build_scene(json.loads(case["scene"]), case["changes"]), comm=MPI.COMM_SELF)
    except Exception as error:  # whatever it is, the others go on
        result = {"status": f"{type(error).__name__}: {error}", "statistics": {}}
    else:
        result = {"status": "done", "statistics": statistics(record)}
    interruption.check()
    return result


def statistics(record: xr.Dataset) -> dict[str, dict[str, float]]:
    """STATISTICS of every scalar series and every component of a vector series, in the units of the record.

    Mean and standard deviation are over time (trapezoidal rule), whatever the steps; see also `dominant_period`.
    """
    t, result = record.time.values, {}
    weights = np.convolve(np.diff(t), [0.5, 0.5]) if len(t) > 1 else np.ones(1)
    for name, variable in record.data_vars.items():
        if variable.dims[:1] != ("time",) or name in EFFORT:
            continue
        columns = variable.values.reshape(len(t), -1)
        labels = [name] if variable.ndim == 1 else [f"{name}_{label}" for label in record[variable.dims[1]].values]
        for label, x in zip(labels, columns.T, strict=True):
            mean = float(np.average(x, weights=weights))
            deviation = float(np.sqrt(np.average((x - mean) ** 2, weights=weights)))
            period = dominant_period(t, x, noise=1e-9 * np.abs(columns).max())
            values = (float(x.min()), float(x.max()), mean, deviation, period)
            result[label] = dict(zip(STATISTICS, values, strict=True))
    return result


def dominant_period(t, x, noise=0.0) -> float:
    """Period of the oscillation that is largest in the second half of the run [s]; nan if there is none.

    The largest peak of the Fourier amplitudes between one period in that half and two samples, then least squares for
    trend, cosine and sine at a free frequency: exact for a sinusoid on a trend, at any steps.  Amplitudes below `noise`
    (in the units of x) do not count.
    """
    late = t >= 0.5 * (t[0] + t[-1])
    t, x = t[late] - t[-1], x[late]
    if len(t) < 8 or np.ptp(x) <= 2 * noise:
        return math.nan
    window = np.sin(np.pi * (t - t[0]) / (t[-1] - t[0])) ** 2
    frequency = _peak(t, x)
    for _ in range(50):
        basis, phase = _basis(t, frequency), 2 * np.pi * frequency * t
        fit = np.linalg.lstsq(basis * window[:, None], x * window, rcond=None)[0]
        slope = 2 * np.pi * t * (fit[3] * np.cos(phase) - fit[2] * np.sin(phase))  # of the fit, by frequency
        linear = np.column_stack([basis, slope]) * window[:, None]
        change = np.linalg.lstsq(linear, (x - basis @ fit) * window, rcond=None)[0][-1]
        frequency += float(np.clip(change, -0.2 / -t[0], 0.2 / -t[0]))
        if not 0.5 / -t[0] < frequency < 0.5 * (len(t) - 1) / -t[0]:
            return math.nan
        if abs(change) <= 1e-13 * frequency:
            break
    return 1 / frequency if np.hypot(fit[2], fit[3]) > noise else math.nan


def _basis(t, frequency):
    phase = 2 * np.pi * frequency * t
    return np.column_stack([np.ones_like(t), t / -t[0], np.cos(phase), np.sin(phase)])


def _peak(t, x):
    """Frequency of the largest Fourier amplitude, on a grid of an eighth of the resolution."""
    grid = np.linspace(t[0], t[-1], len(t))
    y = np.interp(grid, t, x)
    y = (y - np.polynomial.Polynomial.fit(grid, y, 1)(grid)) * np.hanning(len(y))
    amplitude = np.abs(np.fft.rfft(y, 8 * len(y)))
    amplitude[:8] = 0.0  # less than one period
    return np.argmax(amplitude) / (8 * len(y) * (grid[1] - grid[0]))


# -- all cases ---------------------------------------------------------------------------------------------------------


def sweep(scene, vary, table, folder: Path) -> xr.Dataset | None:
    """Run all cases and write folder/sweep.nc, sweep.png and .svg; the dataset on rank 0, None on the others.

    Finished cases, failed ones included, are kept in folder/cases and not computed again.  With several ranks the first
    hands out the cases and keeps the results (no other needs the folder), the others compute.  Raises InputError for a
    bad scene or bad cases.
    """
    base = load_scene(scene)
    changes = cases_of(vary, table)
    for key in dict.fromkeys(key for change in changes for key in change):
        _known(base, key)
    data = json.dumps(base.to_dict(), sort_keys=True)
    rows = _evaluate_all([{"scene": data, "changes": change} for change in changes], Path(folder))
    if rows is None:
        return None
    dataset = collect(rows)
    dataset.attrs["title"] = base.title
    dataset.to_netcdf(folder / "sweep.nc", engine="netcdf4")
    figure = draw(dataset)
    FigureCanvasAgg(figure)
    for suffix in ("png", "svg"):
        figure.savefig(folder / f"sweep.{suffix}", dpi=200)
    return dataset


def _evaluate_all(cases, folder):
    """[{**case, **evaluate(case)}, ...] in the order of the cases; None on all ranks but 0."""
    if MPI.COMM_WORLD.size == 1:
        return _collect_rows(cases, folder, lambda missing: ((i, evaluate(cases[i])) for i in missing))
    from mpi4py.futures import MPICommExecutor

    with MPICommExecutor(MPI.COMM_WORLD, root=0) as pool:
        if pool is None:
            return None

        def spread(missing):
            futures = {pool.submit(evaluate, cases[i]): i for i in missing}
            try:
                for future in as_completed(futures):
                    yield futures[future], future.result()
            finally:
                for future in futures:
                    future.cancel()

        return _collect_rows(cases, folder, spread)


def _collect_rows(cases, folder, results):
    """Results of the cases without a file are written one by one, as they come; then all files are read."""
    store = folder / "cases"
    store.mkdir(parents=True, exist_ok=True)
    files = [store / f"{common._key(case)}.json" for case in cases]
    missing = list({file: i for i, file in enumerate(files) if not file.is_file()}.values())  # a case may come twice
    if missing:
        for i, result in track(results(missing), "cases", len(missing), console=Console(stderr=True)):
            common._write_json(files[i], result)
    return [{**case, **json.loads(file.read_text())} for case, file in zip(cases, files, strict=True)]


def collect(rows: list[dict]) -> xr.Dataset:
    """One dataset over the dimension `case`: varied keys, status, and <quantity>_<statistic>."""
    keys = list(dict.fromkeys(key for row in rows for key in row["changes"]))
    data = {key.replace(".", "_"): ("case", _column([row["changes"][key] for row in rows])) for key in keys}
    data["status"] = ("case", np.array([row["status"] for row in rows], dtype=object))
    for name in dict.fromkeys(name for row in rows for name in row["statistics"]):
        _, unit, long_name = SERIES.get(name) or SERIES[name.rpartition("_")[0]]
        for statistic in STATISTICS:
            values = [row["statistics"].get(name, {}).get(statistic, np.nan) for row in rows]
            period = statistic == "dominant_period"
            attributes = {"units": "s" if period else unit, "long_name": f"{statistic.replace('_', ' ')}: {long_name}"}
            data[f"{name}_{statistic}"] = ("case", np.array(values, dtype=float), attributes)
    return xr.Dataset(data, attrs={"varied": ", ".join(keys)})


def _column(values):
    """Numbers as numbers, anything else (words, lists) as text."""
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return np.array(values)
    return np.array([v if isinstance(v, str) else json.dumps(v) for v in values], dtype=object)


#: Quantities in the figure, those of them that are there.
SHOWN = ("tension_top", "tension_anchor", "buoy_position_x", "buoy_position_z", "cone_angle")


def draw(dataset: xr.Dataset) -> Figure:
    """Mean and range of the main quantities: over the first varied key if it is a number, a colour for each combination
    of the others; else, or where these are too many to tell apart, case by case."""
    names = [name for name in SHOWN if f"{name}_mean" in dataset]
    figure = Figure(figsize=(6.4, 1.9 * max(len(names), 1) + 0.8), layout="constrained")
    axes = np.atleast_1d(figure.subplots(max(len(names), 1), 1, sharex=True))
    label, groups = _groups(dataset)
    width = 0.015 * max(np.ptp(np.concatenate([x for _, x, _ in groups])), 1e-12)
    for axis, name in zip(axes, names, strict=False):
        mean, low, high = (dataset[f"{name}_{s}"] for s in ("mean", "minimum", "maximum"))
        for k, (group, x, cases) in enumerate(groups):
            good = np.isfinite(mean.values[cases])
            cases = cases[good]
            place, m = x[good] + width * (k - (len(groups) - 1) / 2), mean.values[cases]
            reach = np.maximum([m - low.values[cases], high.values[cases] - m], 0.0)  # rounding of the mean
            axis.errorbar(place, m, reach, fmt="o", markersize=3.5, capsize=2.5, linewidth=1, label=group)
        axis.set_ylabel(f"{name.replace('_', ' ')} [{mean.attrs['units']}]", fontsize="small")
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel(label)
    if len(groups) > 1:
        axes[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize="small", frameon=False)
    title = dataset.attrs.get("title", "")
    figure.suptitle(f"{title}\nmean and range over the run".strip(), fontsize="medium")
    return figure


def _groups(dataset):
    """Label of the abscissa, and (label, abscissa, cases) of each group of points."""
    keys = dataset.attrs["varied"].split(", ")
    first, *others = (dataset[key.replace(".", "_")].values for key in keys)
    labels = [
        ", ".join(f"{k.rpartition('.')[2]} = {v[i]}" for k, v in zip(keys[1:], others, strict=True))
        for i in range(len(first))
    ]
    different = list(dict.fromkeys(labels))
    points = set(zip(labels, first.tolist(), strict=True))
    crowded = len(different) > 9 or max(map(len, different)) > 40
    if first.dtype.kind not in "if" or crowded or len(points) < len(first):
        return "case", [("", np.arange(len(first)), np.arange(len(first)))]
    members = [np.flatnonzero([label == group for label in labels]) for group in different]
    return keys[0], [(group, first[m], m) for group, m in zip(different, members, strict=True)]
