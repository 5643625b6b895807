"""`dolfbuoy statistics`: statistics of runs, their ramps left out."""

import os
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..errors import InputError
from ..parallel.ranks import rank
from .app import app
from .shared import OverwriteOption, default_folder, finite, out, out_option, table_of

#: Sets that are printed; netCDF has them all.
MOST_SETS = 20
FoldersArgument = Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of runs or sweeps.")]
StartOption = Annotated[
    float | None,
    typer.Option(
        "--from", callback=finite, help="What comes before does not count \\[s; default: the end of the ramp]."
    ),
]
PointOption = Annotated[
    str | None,
    typer.Option("--point", metavar="X,Y", help="Where the water is looked at \\[m; default: the buoy's start]."),
]
ExponentOption = Annotated[float, typer.Option("--exponent", help="m of the S-N curve N = K S^-m.")]
ConstantOption = Annotated[
    float | None,
    typer.Option("--constant", help="K of the S-N curve, S the range of the tension in N; for Miner sums."),
]
ScatterOption = Annotated[
    Path | None,
    typer.Option("--scatter", help="CSV of a sweep's keys and probability: fatigue and extremes of a life."),
]
YearsOption = Annotated[float, typer.Option("--years", help="In which the largest value of --scatter occurs once.")]
FrequencyOption = Annotated[float, typer.Option("--frequency", help="Cycles of the equivalent load per second \\[Hz].")]


@app.command()
def statistics(
    folders: FoldersArgument,
    start: StartOption = None,
    point: PointOption = None,
    exponent: ExponentOption = 3.0,
    constant: ConstantOption = None,
    frequency: FrequencyOption = 1.0,
    scatter: ScatterOption = None,
    years: YearsOption = 50.0,
    folder: out_option("results/statistics-NAME") = None,
    overwrite: OverwriteOption = False,
):
    """Spectral moments, peaks, cycles and extremes of runs.  Example: dolfbuoy statistics results/short"""
    from ..elsewhere import MPI
    from ..results.folder import claimed
    from ..results.statistics import Fatigue, lifetime, runs_of, together
    from ..results.statistics_figures import FIGURES, draw_all
    from ..results.style import files_of
    from ..writing import refuse_present, replacing

    folder = default_folder(folder, f"statistics-{Path(os.path.realpath(folders[0])).name}")
    with claimed(folder, MPI.COMM_WORLD):
        if rank() != 0:
            return
        names = ("statistics.nc", *(["lifetime.nc"] if scatter else []))
        figures = [file for name in FIGURES for file in files_of(folder / name)]
        refuse_present([*(folder / name for name in names), *figures], overwrite)
        fatigue = Fatigue(exponent, constant, frequency)
        runs = runs_of(folders, start, _point(point))
        found = together(runs, fatigue)
        life = None if scatter is None else lifetime(runs, scatter, fatigue, years)
        with replacing(folder / "statistics.nc") as part:
            found.to_netcdf(part, engine="netcdf4")
        if life is not None:
            with replacing(folder / "lifetime.nc") as part:
                life.to_netcdf(part, engine="netcdf4")
        draw_all(found, folder)
    show(found, folder)
    if life is not None:
        _show_life(life, folder)


def _point(text):
    from ..scene.quantities import number_of

    if text is None:
        return None
    try:
        x, y = (number_of(part) for part in text.split(","))
    except ValueError:
        x = y = np.nan
    if not np.isfinite([x, y]).all():
        raise InputError(f"--point {text}: must be X,Y in metres.")
    return x, y


def show(found, folder):
    """The tables of every set."""
    from ..results.quantities import shown_in
    from ..results.series import each_series

    for k in range(min(found.sizes["set"], MOST_SETS)):
        mine = found.isel(run=found.set_of_run.values == k, set=k)
        series = each_series(mine, "mean", shown_in("statistics"))
        out.print(_numbers(series, _title(mine, found, folder)))
        fatigue, extremes = _fatigue(series, found.attrs), _extremes(series)
        for table in (_sea(series), fatigue, extremes, _certainty(series), *_circles(mine)):
            if table is not None:
                out.print(table)
    if found.sizes["set"] > MOST_SETS:
        out.print(f"... and {found.sizes['set'] - MOST_SETS} sets more", highlight=False)
    for note in filter(None, found.attrs["notes"].split("\n")):
        out.print(note, soft_wrap=True, markup=False, highlight=False)


def _title(mine, found, folder):
    runs = f"{mine.run.values[0]}" if mine.sizes["run"] == 1 else f"{mine.sizes['run']} runs"
    which = f"set {int(mine.set)}: " if found.sizes["set"] > 1 else ""
    length = f"{float(mine.duration.mean()):g} s from t = {float(mine.start.mean()):g} s on"
    return f"{which}{runs}, {length}, {folder / 'statistics.nc'}"


def _unit(mine, name):
    from ..results.tables import unit_of

    sizes = [mine[f"{name}_{part}"].values for part in ("minimum", "maximum")]
    return unit_of(np.array(sizes), mine[f"{name}_mean"].attrs["units"])


def _numbers(series, title):
    """Means over the runs, extremes of all."""
    table = table_of(
        title, "series", "unit", "mean", "deviation", "skewness", "minimum", "maximum", "period [s]", "peaks"
    )
    for said, name, mine in series:
        unit, factor = _unit(mine, name)
        how = {"mean": np.mean, "standard_deviation": np.mean, "minimum": np.min, "maximum": np.max}
        mean, deviation, low, high = (factor * f(mine[f"{name}_{part}"].values) for part, f in how.items())
        mean = mean if abs(mean) > 1e-9 * max(abs(low), abs(high)) else 0.0  # no rounding noise
        skewness, period = (float(mine[f"{name}_{part}"].mean()) for part in ("skewness", "period"))
        peaks = f"{_count(mine, name):g}" if f"{name}_peak" in mine else ""
        row = [f"{mean:.4g}", f"{deviation:.4g}", f"{skewness:.2f}", f"{low:.4g}", f"{high:.4g}", f"{period:.4g}"]
        table.add_row(said.replace("_", " "), unit, *row, peaks)
    return table


def _count(mine, name):
    return int((mine[f"{name}_peak_set"].values == int(mine.set)).sum())


def _sea(series):
    from ..results.quantities import QUANTITIES

    series = [(said, name, mine) for said, name, mine in series if f"{name}_m0" in mine]
    if not series:
        return None
    table = table_of("\nThe sea, mean over the runs", "where", "m0 [m²]", "Hs [m]", "Tz [s]")
    for said, name, mine in series:
        where = said.replace(name, QUANTITIES[name].place)
        table.add_row(where, *(f"{float(mine[f'{name}_{part}'].mean()):.5g}" for part in ("m0", "Hs", "period")))
    return table


def _fatigue(series, how):
    from ..results.statistics import YEAR

    series = [(said, name, mine) for said, name, mine in series if f"{name}_equivalent_load" in mine]
    if not series:
        return None
    damaged = "constant" in how
    title = f"\nFatigue, m = {how['exponent']:g}, equivalent load at {how['frequency_Hz']:g} Hz"
    table = table_of(title, "series", "equivalent load", *(["Miner sum per year"] if damaged else []))
    for said, name, mine in series:
        unit, factor = _unit(mine, name)
        load = (mine[f"{name}_equivalent_load"].values ** how["exponent"]).mean() ** (1 / how["exponent"])
        row = [f"{factor * load:.4g} {unit}"]
        if damaged:
            row.append(f"{float(mine[f'{name}_damage'].sum() / mine.duration.sum()) * YEAR:.4g}")
        table.add_row(said.replace("_", " "), *row)
    return table


def _extremes(series):
    series = [one for one in series if f"{one[1]}_most_probable" in one[2]]
    series = [(said, n, mine) for said, n, mine in series if np.isfinite(mine[f"{n}_most_probable"][0])]
    if not series:
        return None
    table = table_of("\nMost probable maximum of 3 h, and its 95 % interval", "series", "unit", "maximum", "from", "to")
    for said, name, mine in series:
        unit, factor = _unit(mine, name)
        values = (f"{factor * value:.4g}" for value in mine[f"{name}_most_probable"].values)
        table.add_row(said.replace("_", " "), unit, *values)
    return table


def _certainty(series):
    """Error of deviations and extremes from these runs, and the number of runs for extremes to 5 % above the mean."""
    from ..results.compare import duration
    from ..results.extremes import Gumbel, deviation_uncertainty

    series = [(said, name, mine) for said, name, mine in series if np.isfinite(mine[f"{name}_memory"]).any()]
    if not series:
        return None
    mine = series[0][2]
    runs, length, each = mine.sizes["run"], float(mine.duration.mean()), float(mine.seconds.mean())
    times = mine.attrs["hours"] * 3600 / length
    table = table_of(
        "\nHow well they are known, 19 times in 20",
        *("series", "deviation", "maximum of 3 h, above the mean", "runs for 5 % of it", "computing"),
    )
    for said, name, mine in series:
        row = [
            f"+- {100 * deviation_uncertainty(float(mine[f'{name}_memory'].mean()), runs * length):.2g} %",
            "",
            "",
            "",
        ]
        if f"{name}_gumbel_scale" in mine and np.isfinite(mine[f"{name}_gumbel_scale"]):
            largest = Gumbel(float(mine[f"{name}_gumbel_location"]), float(mine[f"{name}_gumbel_scale"]), runs)
            mean = float(mine[f"{name}_mean"].mean())
            needed = largest.runs_needed(0.05, times, mean)
            row[1:] = f"+- {100 * largest.uncertainty(runs, times, mean):.2g} %", f"{needed}", duration(needed * each)
        table.add_row(said.replace("_", " "), *row)
    return table


def _show_life(life, folder):
    """A row of each series."""
    from ..results.tables import unit_of

    title = f"\nA life in these seas, {100 * life.attrs['probability']:.4g} % of the time, {folder / 'lifetime.nc'}"
    once = f"once in {life.attrs['years']:g} years"
    table = table_of(title, "series", "Miner sum per year", "life [years]", "equivalent load", once)
    series, parts = life.series.values.tolist(), life.part.values.tolist()
    for k, (name, part) in enumerate(zip(series, parts, strict=True)):
        damage, years, load, largest = (
            float(life[n][k]) for n in ("damage_per_year", "life", "equivalent_load", "largest")
        )
        if not np.isfinite([damage, load, largest]).any():
            continue  # no cycles damage it, and its seeds are too few
        unit, factor = unit_of([x for x in (load, largest) if np.isfinite(x)], str(life.unit[k].item()))
        forces = (f"{factor * x:.4g} {unit}" if np.isfinite(x) else "-" for x in (load, largest))
        said = f"{name} of {part}" if series.count(name) > 1 else name
        table.add_row(
            said.replace("_", " "), *(f"{x:.4g}" if np.isfinite(x) else "-" for x in (damage, years)), *forces
        )
    out.print(table)
    if life.attrs["notes"]:
        out.print(life.attrs["notes"], soft_wrap=True, markup=False, highlight=False)


def _circles(mine):
    """A table of each buoy."""
    for buoy in mine.buoy.values.tolist() if "circle_radius" in mine else ():
        one, of = mine.sel(buoy=buoy), f" of {buoy}" if mine.sizes["buoy"] > 1 else ""
        title = f"\nOffsets: the smallest circle that holds the track of C{of}"
        table = table_of(title, "middle", "x [m]", "y [m]", "radius [m]")
        table.add_row("anywhere", *(f"{float(one[f'circle_{part}']):.4g}" for part in ("x", "y", "radius")))
        if np.isfinite(one.watch_circle_radius):
            table.add_row("the anchor", "", "", f"{float(one.watch_circle_radius):.4g}")
        yield table
