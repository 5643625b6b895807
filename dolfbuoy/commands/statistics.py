"""`dolfbuoy statistics`: what runs say together, their ramps left out."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..errors import InputError
from ..parallel.ranks import rank
from .shared import OverwriteOption, default_folder, finite, out, out_option, table_of

#: Sets that are printed; netCDF has them all.
MOST_SETS = 20
#: Series in the tables, those of them that are there; netCDF has them all.
SHOWN = (
    "tension_top",
    "tension_anchor",
    "buoy_position_x",
    "buoy_position_y",
    "buoy_position_z",
    "offset",
    "roll",
    "pitch",
    "cone_angle",
    "surface_elevation",
    "fixed_point_elevation",
)
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
    Path | None, typer.Option("--scatter", help="CSV of a sweep's keys and probability: wear and extremes of a life.")
]
YearsOption = Annotated[float, typer.Option("--years", help="In which the largest value of --scatter occurs once.")]
FrequencyOption = Annotated[float, typer.Option("--frequency", help="Cycles of the equivalent load per second \\[Hz].")]


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
    from mpi4py import MPI

    from ..results.ensemble import Fatigue, runs_of, together
    from ..results.folder import claimed
    from ..results.lifetime import lifetime
    from ..results.statistics_figures import FIGURES, draw_all
    from ..results.style import files_of
    from ..writing import refuse_present, replacing

    folder = default_folder(folder, f"statistics-{folders[0].resolve().name}")
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
    for k in range(min(found.sizes["set"], MOST_SETS)):
        mine = found.isel(run=found.set_of_run.values == k, set=k)
        known = [name.removesuffix("_mean") for name in mine if name.endswith("_mean")]
        names = [name for shown in SHOWN for name in known if name == shown or name.startswith(f"{shown}_")]
        out.print(_numbers(mine, names, _title(mine, found, folder)))
        fatigue, extremes = _fatigue(mine, names, found.attrs), _extremes(mine, names)
        for table in (_sea(mine), fatigue, extremes, _certainty(mine, names), _circle(mine)):
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


def _numbers(mine, names, title):
    """Means over the runs, extremes of all."""
    table = table_of(
        title, "series", "unit", "mean", "deviation", "skewness", "minimum", "maximum", "period [s]", "peaks"
    )
    for name in names:
        unit, factor = _unit(mine, name)
        how = {"mean": np.mean, "standard_deviation": np.mean, "minimum": np.min, "maximum": np.max}
        mean, deviation, low, high = (factor * f(mine[f"{name}_{part}"].values) for part, f in how.items())
        mean = mean if abs(mean) > 1e-9 * max(abs(low), abs(high)) else 0.0  # no rounding noise
        skewness, period = (float(mine[f"{name}_{part}"].mean()) for part in ("skewness", "period"))
        peaks = f"{_count(mine, name):g}" if f"{name}_peak" in mine else ""
        row = [f"{mean:.4g}", f"{deviation:.4g}", f"{skewness:.2f}", f"{low:.4g}", f"{high:.4g}", f"{period:.4g}"]
        table.add_row(name.replace("_", " "), unit, *row, peaks)
    return table


def _count(mine, name):
    return int((mine[f"{name}_peak_set"].values == int(mine.set)).sum())


def _sea(mine):
    names = [name for name in ("surface_elevation", "fixed_point_elevation") if f"{name}_m0" in mine]
    if not names:
        return None
    table = table_of("\nThe sea, mean over the runs", "where", "m0 [m²]", "Hs [m]", "Tz [s]")
    for name, where in zip(names, ("at the buoy", "at a fixed point")[-len(names) :], strict=True):
        table.add_row(where, *(f"{float(mine[f'{name}_{part}'].mean()):.5g}" for part in ("m0", "Hs", "period")))
    return table


def _fatigue(mine, names, how):
    from ..results.cycles import YEAR

    names = [name for name in names if f"{name}_equivalent_load" in mine]
    if not names:
        return None
    worn = "constant" in how
    title = f"\nFatigue, m = {how['exponent']:g}, equivalent load at {how['frequency_Hz']:g} Hz"
    table = table_of(title, "series", "equivalent load", *(["Miner sum per year"] if worn else []))
    for name in names:
        unit, factor = _unit(mine, name)
        load = (mine[f"{name}_equivalent_load"].values ** how["exponent"]).mean() ** (1 / how["exponent"])
        row = [f"{factor * load:.4g} {unit}"]
        if worn:
            row.append(f"{float(mine[f'{name}_damage'].sum() / mine.duration.sum()) * YEAR:.4g}")
        table.add_row(name.replace("_", " "), *row)
    return table


def _extremes(mine, names):
    names = [n for n in names if f"{n}_most_probable" in mine and np.isfinite(mine[f"{n}_most_probable"][0])]
    if not names:
        return None
    table = table_of("\nMost probable maximum of 3 h, and its 95 % interval", "series", "unit", "maximum", "from", "to")
    for name in names:
        unit, factor = _unit(mine, name)
        values = (f"{factor * value:.4g}" for value in mine[f"{name}_most_probable"].values)
        table.add_row(name.replace("_", " "), unit, *values)
    return table


def _certainty(mine, names):
    """How well these runs tell deviations and extremes, and how many tell the extremes to 5 % above the mean."""
    from ..results.certainty import deviation_known, part_known, runs_needed
    from ..results.compare import duration
    from ..results.extremes import Gumbel

    names = [name for name in names if np.isfinite(mine[f"{name}_memory"]).any()]
    if not names:
        return None
    runs, length, each = mine.sizes["run"], float(mine.duration.mean()), float(mine.seconds.mean())
    times = mine.attrs["hours"] * 3600 / length
    table = table_of(
        "\nHow well they are known, 19 times in 20",
        *("series", "deviation", "maximum of 3 h, above the mean", "runs for 5 % of it", "computing"),
    )
    for name in names:
        row = [f"+- {100 * deviation_known(float(mine[f'{name}_memory'].mean()), runs * length):.2g} %", "", "", ""]
        if f"{name}_gumbel_scale" in mine and np.isfinite(mine[f"{name}_gumbel_scale"]):
            largest = Gumbel(float(mine[f"{name}_gumbel_location"]), float(mine[f"{name}_gumbel_scale"]), runs)
            mean = float(mine[f"{name}_mean"].mean())
            needed = runs_needed(largest, 0.05, times, mean)
            row[1:] = f"+- {100 * part_known(largest, runs, times, mean):.2g} %", f"{needed}", duration(needed * each)
        table.add_row(name.replace("_", " "), *row)
    return table


def _show_life(life, folder):
    """A row of each series."""
    from ..results.tables import unit_of

    title = f"\nA life in these seas, {100 * life.attrs['probability']:.4g} % of the time, {folder / 'lifetime.nc'}"
    once = f"once in {life.attrs['years']:g} years"
    table = table_of(title, "series", "Miner sum per year", "life [years]", "equivalent load", once)
    for k, name in enumerate(life.series.values):
        wear, years, load, largest = (
            float(life[n][k]) for n in ("damage_per_year", "life", "equivalent_load", "largest")
        )
        if not np.isfinite([wear, load, largest]).any():
            continue  # nothing wears it, and its seeds are too few
        unit, factor = unit_of([x for x in (load, largest) if np.isfinite(x)], str(life.unit[k].item()))
        forces = (f"{factor * x:.4g} {unit}" if np.isfinite(x) else "-" for x in (load, largest))
        table.add_row(
            str(name).replace("_", " "), *(f"{x:.4g}" if np.isfinite(x) else "-" for x in (wear, years)), *forces
        )
    out.print(table)
    if life.attrs["notes"]:
        out.print(life.attrs["notes"], soft_wrap=True, markup=False, highlight=False)


def _circle(mine):
    if "circle_radius" not in mine:
        return None
    table = table_of(
        "\nOffsets: the smallest circle that holds the track of C", "middle", "x [m]", "y [m]", "radius [m]"
    )
    table.add_row("anywhere", *(f"{float(mine[f'circle_{part}']):.4g}" for part in ("x", "y", "radius")))
    if np.isfinite(mine.watch_circle_radius):
        table.add_row("the anchor", "", "", f"{float(mine.watch_circle_radius):.4g}")
    return table


def add_to(app: typer.Typer) -> None:
    """Make it a command of an application."""
    app.command()(statistics)
