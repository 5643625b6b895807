"""Many variants of one scene: statistics of each run, spread over ranks, kept case by case."""

import csv
import itertools
import json
import math
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpi4py import MPI

from .api import simulate
from .errors import InputError, SolveError
from .observe import effects
from .scene import build_scene, load_scene, parse_assignment
from .studies.common import evaluate_all

#: What is said of every recorded quantity.
STATISTICS = ("minimum", "maximum", "mean", "standard_deviation", "dominant_period")


def parse_vary(text: str) -> tuple[str, list]:
    """`key=a,b,c` or `key=start:stop:step` (stop included) -> (key, values).  Raises InputError."""
    key, equals, values = text.partition("=")
    if not equals or not values:
        raise InputError(f"--vary {text}: must have the form section.key=a,b,c or section.key=start:stop:step.")
    if ":" not in values:
        return key, [parse_assignment(f"{key}={value}")[1] for value in values.split(",")]
    try:
        start, stop, step = (float(part) for part in values.split(":"))
        count = math.floor((stop - start) / step + 1e-9) + 1
    except (ValueError, ZeroDivisionError):
        raise InputError(f"--vary {text}: a range must be start:stop:step in numbers, step not zero.") from None
    if count < 1:
        raise InputError(f"--vary {text}: the range is empty.")
    return key, [start + i * step for i in range(count)]


def cases_of(vary: list[str], table: Path | None) -> list[dict]:
    """Changes of each case: all combinations of `vary`, or the rows of a CSV file whose header names keys."""
    if (table is None) == (not vary):
        raise InputError("A sweep needs either --vary (once or more) or --table.")
    if table is None:
        keys, values = zip(*(parse_vary(text) for text in vary), strict=True)
        return [dict(zip(keys, combination, strict=True)) for combination in itertools.product(*values)]
    if not table.is_file():
        raise InputError(f"--table {table}: there is no such file.")
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise InputError(f"--table {table}: it has no rows.")
    return [dict(parse_assignment(f"{key}={value}") for key, value in row.items()) for row in rows]


def evaluate(case: dict) -> dict:
    """Run one case on this rank; a case that fails is a result too, with its reason."""
    try:
        scene = build_scene(json.loads(case["scene"]), case["changes"])
        record = simulate(scene, comm=MPI.COMM_SELF)
    except (InputError, SolveError) as error:
        return {"status": f"{type(error).__name__}: {error}", "statistics": {}}
    return {"status": "done", "statistics": statistics(record)}


def statistics(record: xr.Dataset) -> dict[str, dict[str, float]]:
    """STATISTICS of every scalar series and every component of a vector series.

    The dominant period is that of the largest amplitude of the second half of the run [s], 0 for a constant.
    """
    t, result = record.time.values, {}
    for name, variable in record.data_vars.items():
        if variable.dims[:1] != ("time",) or name in ("time_step", "newton_iterations"):
            continue
        columns = variable.values.reshape(len(t), -1)
        labels = [name] if columns.shape[1] == 1 else [f"{name}_{label}" for label in record[variable.dims[1]].values]
        for label, x in zip(labels, columns.T, strict=True):
            weights = np.gradient(t) if len(t) > 1 else np.ones(1)
            mean = float(np.average(x, weights=weights))
            deviation = float(np.sqrt(np.average((x - mean) ** 2, weights=weights)))
            values = (float(x.min()), float(x.max()), mean, deviation, dominant_period(t, x))
            result[label] = dict(zip(STATISTICS, values, strict=True))
    return result


def dominant_period(t, x) -> float:
    """Period of the largest Fourier amplitude of x in the second half of the run, by parabolic interpolation [s]."""
    late = t >= 0.5 * (t[0] + t[-1])
    if late.sum() < 8:
        return 0.0
    grid = np.linspace(t[late][0], t[-1], int(late.sum()))
    y = np.interp(grid, t, x)
    y = (y - y.mean()) * np.hanning(len(y))
    amplitude = np.abs(np.fft.rfft(y, 8 * len(y)))  # padded: a fine grid of frequencies
    k = int(np.argmax(amplitude[1:])) + 1
    if amplitude[k] <= 1e-9 * max(np.abs(x).max(), 1e-300) * len(y):
        return 0.0
    return float(8 * len(y) * (grid[1] - grid[0]) / k)


def sweep(scene, vary, table, folder: Path) -> xr.Dataset | None:
    """Run all cases and write folder/sweep.nc, sweep.png and .svg; the dataset on rank 0, None on the others.

    Finished cases are kept in folder/cases and not computed again.  Raises InputError for a bad scene or bad cases.
    """
    base = load_scene(scene)
    changes = cases_of(vary, table)
    for change in changes:
        for key in change:
            _known(base, key)
    data = json.dumps(base.to_dict(), sort_keys=True)
    cases = [{"scene": data, "changes": change} for change in changes]
    rows = evaluate_all(evaluate, cases, folder, structure=_structure)
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


def _known(scene, key):
    """Refuse a key that no scene has; whether its values are good shows case by case."""
    try:
        build_scene(scene.to_dict(), {key: scene.to_dict()})
    except InputError as error:
        if "Unknown key" in str(error) or "is not a section" in str(error):
            raise InputError(f"{key}: {error}") from None


def _structure(case):
    """What decides which forms a case compiles."""
    try:
        scene = build_scene(json.loads(case["scene"]), case["changes"])
    except InputError:
        return "refused"
    c, waves, current = scene.cable, scene.waves, scene.current
    degrees = (c.position_degree, c.tension_degree, c.strain, c.strain_form) if c else ()
    profile = current and (len(current.profile) if isinstance(current.profile, list) else current.profile)
    return repr((effects(scene), degrees, waves and waves.stretching, profile, scene.solver.quadrature_degree))


def collect(rows: list[dict]) -> xr.Dataset:
    """One dataset over the dimension `case`: varied keys, status, and <quantity>_<statistic>."""
    keys = list(dict.fromkeys(key for row in rows for key in row["changes"]))
    data = {key.replace(".", "_"): ("case", np.array([row["changes"].get(key) for row in rows])) for key in keys}
    data["status"] = ("case", np.array([row["status"] for row in rows], dtype=object))
    for name in dict.fromkeys(name for row in rows for name in row["statistics"]):
        for statistic in STATISTICS:
            values = [row["statistics"].get(name, {}).get(statistic, np.nan) for row in rows]
            data[f"{name}_{statistic}"] = ("case", np.array(values, dtype=float))
    return xr.Dataset(data, attrs={"varied": ", ".join(keys)})


def draw(dataset: xr.Dataset) -> Figure:
    """Mean and range of the main quantities, case by case."""
    wanted = ("tension_top", "tension_anchor", "buoy_position_x", "buoy_position_z", "cone_angle")
    names = [name for name in wanted if f"{name}_mean" in dataset]
    figure = Figure(figsize=(6.4, 1.9 * max(len(names), 1)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(max(len(names), 1), 1, sharex=True))
    cases = np.arange(dataset.sizes["case"])
    for axis, name in zip(axes, names, strict=False):
        mean, low, high = (dataset[f"{name}_{s}"].values for s in ("mean", "minimum", "maximum"))
        axis.vlines(cases, low, high, color="0.6", linewidth=3, label="range")
        axis.plot(cases, mean, "o", color="C0", markersize=4, label="mean")
        axis.set_ylabel(name.replace("_", " "))
        axis.grid(alpha=0.3)
    axes[0].legend(loc="best", fontsize="small")
    axes[-1].set_xlabel("case")
    return figure
