"""`dolfbuoy statistics`: statistics of runs, their ramps left out."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from ..errors import InputError
from ..parallel.ranks import rank
from .app import app
from .shared import OverwriteOption, default_folder, number, out_option, print_kept_criteria, print_table, say

if TYPE_CHECKING:
    import xarray as xr

#: Sets that are printed; netCDF has them all.
MOST_SETS = 20
FoldersArgument = Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of runs or sweeps.")]
PointOption = Annotated[
    str | None,
    typer.Option("--point", metavar="X,Y", help="Where the water is looked at \\[m; default: the buoy's start]."),
]
ScatterOption = Annotated[
    Path | None,
    typer.Option("--scatter", help="CSV of a sweep's keys and probability: fatigue and extremes of a life."),
]
#: Label, name and numbers of a series.
Series = tuple[str, str, "xr.Dataset"]
#: Title, headings and rows of a table.
Shown = tuple[str, list[str], list[list[str]]]


@app.command()
def statistics(
    folders: FoldersArgument,
    start: Annotated[
        float | None, number("--from", "What comes before does not count \\[s; default: the end of the ramp].")
    ] = None,
    point: PointOption = None,
    exponent: Annotated[
        float | None,
        typer.Option("--exponent", help="m of the equivalent load \\[default: that of --curve, else 3]."),
    ] = None,
    curve: Annotated[
        str | None,
        typer.Option(
            "--curve",
            "--constant",
            help="Fatigue curve in place of the scene's: 'API studless', or K with its unit, '6e10 MPa^3', '1e15 N^3'.",
        ),
    ] = None,
    corrosion: Annotated[
        float | None, number("--corrosion", "Diameter that bars of chains have lost \\[m; default: the scene's].")
    ] = None,
    safety: Annotated[
        float | None, number("--safety-factor", "Factor that lives are divided by \\[default: the scene's].")
    ] = None,
    frequency: Annotated[
        float, typer.Option("--frequency", help="Cycles of the equivalent load per second \\[Hz].")
    ] = 1.0,
    scatter: ScatterOption = None,
    years: Annotated[
        float, typer.Option("--years", help="In which the largest value of --scatter occurs once.")
    ] = 50.0,
    design: Annotated[
        Path | None, typer.Option("--design", help="Run in a design wave, compared with the extremes of the seeds.")
    ] = None,
    folder: Annotated[Path | None, out_option("results/statistics-NAME")] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Spectral moments, peaks, cycles and extremes of runs.  Example: dolfbuoy statistics results/short"""
    from ..elsewhere import MPI
    from ..results.folder import claimed
    from ..results.lifetime import against_seeds, lifetime
    from ..results.sample import Fatigue
    from ..results.statistics import run_of, runs_of, together
    from ..results.statistics_figures import FIGURES, draw_all
    from ..results.style import files_of
    from ..writing import refuse_present, replacing

    folder = default_folder(folder, f"statistics-{Path(os.path.realpath(folders[0])).name}")
    with claimed(folder, MPI.COMM_WORLD):
        if rank() != 0:
            return
        names = ("statistics.nc", *(["lifetime.nc"] if scatter else []), *(["design.nc"] if design else []))
        figures = [file for name in FIGURES for file in files_of(folder / name)]
        refuse_present([*(folder / name for name in names), *figures], overwrite)
        fatigue = Fatigue(_exponent(exponent, curve), None, frequency, curve, corrosion, safety)
        runs = runs_of(folders, start, _point(point))
        made = [together(runs, fatigue)]
        if scatter:
            made.append(lifetime(runs, scatter, fatigue, years))
        if design:
            made.append(against_seeds(runs, run_of(design)))
        for name, dataset in zip(names, made, strict=True):
            with replacing(folder / name) as part:
                dataset.to_netcdf(part, engine="netcdf4")
        draw_all(made[0], folder)
    show(made[0], folder)
    if scatter:
        _show_life(made[1], folder)
    if design:
        _show_design(made[-1], folder / names[-1])


def _exponent(exponent: float | None, curve: str | None) -> float:
    """Exponent of the equivalent load.  Raises InputError for a curve that there is not, or that has no unit."""
    from ..scene.fatigue import FORMS, curve_of
    from ..scene.quantities import number_of

    if curve is None:
        return 3.0 if exponent is None else exponent
    try:
        number_of(curve)
    except ValueError:
        pass
    else:
        raise InputError(f"--constant {curve}: needs the unit of the ranges with its exponent, like {FORMS}.")
    try:
        return curve_of(curve).exponent if exponent is None else exponent
    except ValueError as error:
        raise InputError(f"--curve {curve}: {error}.") from None


def _point(text: str | None) -> tuple[float, float] | None:
    from ..scene.quantities import number_of

    if text is None:
        return None
    try:
        x, y = (number_of(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--point {text}: must be X,Y in metres.") from None
    return x, y


def show(found: "xr.Dataset", folder: Path) -> None:
    """Print the tables of every set, and what governs of the criteria."""
    from ..results.quantities import shown_in
    from ..results.series import each_series

    for k in range(min(found.sizes["set"], MOST_SETS)):
        mine = found.isel(run=found.set_of_run.values == k, set=k)
        series = each_series(mine, "mean", shown_in("statistics"))
        series = [one for one in series if np.isfinite(one[2][f"{one[1]}_mean"]).any()]  # others are of other sets
        tables = [_numbers(series, _title(mine, found, folder)), _sea(series), _fatigue(series, found.attrs)]
        for title, headings, rows in (*tables, _extremes(series), _certainty(series), *_circles(mine)):
            if rows:
                print_table(title, headings, rows)
    if found.sizes["set"] > MOST_SETS:
        say(f"... and {found.sizes['set'] - MOST_SETS} sets more")
    print_kept_criteria(found)
    say(*filter(None, found.attrs["notes"].split("\n")))


def _title(mine: "xr.Dataset", found: "xr.Dataset", folder: Path) -> str:
    runs = f"{mine.run.values[0]}" if mine.sizes["run"] == 1 else f"{mine.sizes['run']} runs"
    which = f"set {int(mine.set)}: " if found.sizes["set"] > 1 else ""
    length = f"{float(mine.duration.mean()):g} s from t = {float(mine.start.mean()):g} s on"
    return f"{which}{runs}, {length}, {folder / 'statistics.nc'}"


def _unit(mine: "xr.Dataset", name: str) -> tuple[str, float]:
    from ..results.tables import unit_of

    sizes = [mine[f"{name}_{part}"].values for part in ("minimum", "maximum")]
    return unit_of(np.array(sizes), mine[f"{name}_mean"].attrs["units"])


def _numbers(series: list[Series], title: str) -> Shown:
    """Means over the runs, extremes of all, and the highest level of any that was exceeded for LASTING seconds."""
    from ..results.sample import LASTS
    from ..results.series import LASTING

    rows = []
    for label, name, mine in series:
        unit, factor = _unit(mine, name)
        how: dict[str, Any] = {"mean": np.mean, "standard_deviation": np.mean, "minimum": np.min, "maximum": np.max}
        mean, deviation, low, high = (factor * f(mine[f"{name}_{part}"].values) for part, f in how.items())
        mean = mean if abs(mean) > 1e-9 * max(abs(low), abs(high)) else 0.0  # no rounding noise
        skewness, period = (float(mine[f"{name}_{part}"].mean()) for part in ("skewness", "period"))
        has_peaks = f"{name}_peak" in mine
        peaks = f"{int((mine[f'{name}_peak_set'].values == int(mine.set)).sum()):g}" if has_peaks else ""
        row = [
            f"{mean:.4g}",
            f"{deviation:.4g}",
            f"{skewness:.2f}" if np.isfinite(skewness) else "-",
            f"{low:.4g}",
            f"{high:.4g}",
        ]
        lasting = mine[f"{name}_{LASTS}"].values.max() if f"{name}_{LASTS}" in mine else np.nan
        row += [f"{factor * lasting:.4g}" if np.isfinite(lasting) else "", _or_dash(period)]
        rows.append([label.replace("_", " "), unit, *row, peaks])
    names = ["series", "unit", "mean", "deviation", "skewness", "minimum", "maximum", f"for {LASTING:g} s"]
    return title, [*names, "period [s]", "peaks"], rows


def _sea(series: list[Series]) -> Shown:
    from ..results.quantities import QUANTITIES

    rows = []
    for label, name, mine in _having(series, "m0"):
        values = (float(mine[f"{name}_{part}"].mean()) for part in ("m0", "Hs", "period"))
        rows.append([label.replace(name, QUANTITIES[name].place), *(f"{value:.5g}" for value in values)])
    return "\nThe sea, mean over the runs", ["where", "m0 [m²]", "Hs [m]", "Tz [s]"], rows


def _having(series: list[Series], number: str) -> list[Series]:
    """The series that have a number."""
    return [one for one in series if f"{one[1]}_{number}" in one[2]]


def _fatigue(series: list[Series], how: dict[Any, Any]) -> Shown:
    from ..results.sample import YEAR

    rows, worn = [], bool(_having(series, "damage"))
    factor = max((float(mine.safety_factor.max()) for *_, mine in series if "safety_factor" in mine), default=1.0)
    for label, name, mine in _having(series, "equivalent_load"):
        unit, scale = _unit(mine, name)
        load = (mine[f"{name}_equivalent_load"].values ** how["exponent"]).mean() ** (1 / how["exponent"])
        rows.append([label.replace("_", " "), f"{scale * load:.4g} {unit}"])
        if worn:
            damage = float(mine[f"{name}_damage"].sum(skipna=False)) if f"{name}_damage" in mine else np.nan
            yearly = damage / float(mine.duration.sum()) * YEAR
            life = float(mine[f"{name}_life"].mean()) if f"{name}_life" in mine else np.nan
            rows[-1] += [_or_dash(yearly), *_lives(yearly, factor, life)]
    title = f"\nFatigue, m = {how['exponent']:g}, equivalent load at {how['frequency_Hz']:g} Hz"
    return title, ["series", "equivalent load", *(["Miner sum per year", *_of_lives(factor)] if worn else [])], rows


def _or_dash(number: float) -> str:
    return f"{number:.4g}" if np.isfinite(number) else "-"


def _of_lives(factor: float) -> list[str]:
    """Headings of the columns of `_lives`."""
    return ["life [years]", *([f"over safety factor {factor:g}"] if factor > 1 else [])]


def _lives(yearly: float, factor: float, life: float) -> list[str]:
    """Life of what corrodes, else by a Miner sum of a year, as it is and over the safety factor."""
    if not np.isfinite(life):
        life = 1 / yearly if yearly > 0 else np.nan
    return [_or_dash(life), *([_or_dash(life / factor)] if factor > 1 else [])]


def _extremes(series: list[Series]) -> Shown:
    rows = []
    for label, name, mine in _having(series, "most_probable"):
        values = mine[f"{name}_most_probable"].values
        unit, factor = _unit(mine, name)
        if np.isfinite(values[0]):
            rows.append([label.replace("_", " "), unit, *(f"{factor * value:.4g}" for value in values)])
    return "\nMost probable maximum of 3 h, and its 95 % interval", ["series", "unit", "maximum", "from", "to"], rows


def _certainty(series: list[Series]) -> Shown:
    """Error of deviations and extremes from these runs, and the number of runs for extremes to 5 % above the mean."""
    from ..parallel.cases import duration
    from ..results.extremes import Gumbel, deviation_uncertainty

    rows = []
    for label, name, mine in series:
        if not np.isfinite(mine[f"{name}_memory"]).any():
            continue
        runs, length, each = mine.sizes["run"], float(mine.duration.mean()), float(mine.seconds.mean())
        times = mine.attrs["hours"] * 3600 / length
        error = deviation_uncertainty(float(mine[f"{name}_memory"].mean()), runs * length)
        row = [f"+- {100 * error:.2g} %", "", "", ""]
        if f"{name}_gumbel_scale" in mine and np.isfinite(mine[f"{name}_gumbel_scale"]):
            largest = Gumbel(float(mine[f"{name}_gumbel_location"]), float(mine[f"{name}_gumbel_scale"]), runs)
            mean = float(mine[f"{name}_mean"].mean())
            needed = largest.runs_needed(0.05, times, mean)
            row[1:] = f"+- {100 * largest.uncertainty(runs, times, mean):.2g} %", f"{needed}", duration(needed * each)
        rows.append([label.replace("_", " "), *row])
    names = ["series", "deviation", "maximum of 3 h, above the mean", "runs for 5 % of it", "computing"]
    return "\nHow well they are known, 19 times in 20", names, rows


def _circles(mine: "xr.Dataset") -> Iterator[Shown]:
    """A table of each buoy."""
    for buoy in mine.buoy.values.tolist() if "circle_radius" in mine else ():
        one, of = mine.sel(buoy=buoy), f" of {buoy}" if mine.sizes["buoy"] > 1 else ""
        rows = [["anywhere", *(f"{float(one[f'circle_{part}']):.4g}" for part in ("x", "y", "radius"))]]
        if np.isfinite(one.watch_circle_radius):
            rows.append(["the anchor", "", "", f"{float(one.watch_circle_radius):.4g}"])
        title = f"\nOffsets: the smallest circle that holds the track of C{of}"
        yield title, ["middle", "x [m]", "y [m]", "radius [m]"], rows


def _show_design(found: "xr.Dataset", file: Path) -> None:
    from ..results.tables import unit_of

    rows = []
    for one in (found.isel(series=k) for k in range(found.sizes["series"])):
        values = np.array([float(one.largest), float(one.most_probable)])
        unit, factor = unit_of(values, str(one.unit.item()))
        label = f"{one.series.item()} of {one.part.item()}" if one.part.item() else str(one.series.item())
        rows.append([label.replace("_", " "), unit, *(f"{factor * x:.4g}" for x in values), f"{float(one.above):.2g}"])
    names = ["series", "unit", "design wave", "most probable of 3 h", "probability that 3 h exceed it"]
    print_table(f"\nThe design wave against the seeds, {file}", names, rows)


def _show_life(life: "xr.Dataset", folder: Path) -> None:
    """Print a row of each series, and notes."""
    from ..results.tables import unit_of

    rows, series, parts = [], life.series.values.tolist(), life.part.values.tolist()
    safety = float(life.attrs["safety_factor"])
    for k, (name, part) in enumerate(zip(series, parts, strict=True)):
        damage, load, largest = (float(life[number][k]) for number in ("damage_per_year", "equivalent_load", "largest"))
        if not np.isfinite([damage, load, largest]).any():
            continue  # no cycles damage it, and its seeds are too few
        unit, factor = unit_of([x for x in (load, largest) if np.isfinite(x)], str(life.unit[k].item()))
        label = f"{name} of {part}" if series.count(name) > 1 else name
        texts = [_or_dash(damage), *_lives(damage, safety, float(life.life[k]))]
        texts += [f"{factor * x:.4g} {unit}" if np.isfinite(x) else "-" for x in (load, largest)]
        rows.append([label.replace("_", " "), *texts])
    title = f"\nA life in these seas, {100 * life.attrs['probability']:.4g} % of the time, {folder / 'lifetime.nc'}"
    once = f"once in {life.attrs['years']:g} years"
    headings = ["series", "Miner sum per year", *_of_lives(safety), "equivalent load", once]
    print_table(title, headings, rows)
    say(*filter(None, life.attrs["notes"].split("\n")))
