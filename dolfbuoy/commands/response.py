"""The linear response to waves on the command line, and runs in time to compare with."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from ..errors import InputError
from ..parallel.ranks import rank
from ..results.tables import rounded
from . import shared as cli
from .app import app

if TYPE_CHECKING:
    import xarray as xr

    from ..scene import Scene
    from ..scene.waves import Waves

#: Motions that are shown, factor, unit.
MOTIONS = [(name, 1.0, "m") for name in ("surge", "sway", "heave")]
MOTIONS += [(name, float(np.degrees(1)), "deg") for name in ("roll", "pitch")]
#: Amplitude of runs in small waves [m].
SMALL = 1e-3
#: Part of its amplitudes by which those of a run may change in the end without a word.
UNSETTLED = 0.01
#: Periods of a table [s], of many.
SHOWN = (2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 20, 25, 30)

Number = float | None


@app.command()
def response(
    scene: cli.SceneArgument,
    periods: Annotated[str | None, typer.Option("--periods", help="\\[s], a,b,c or start:stop:step.")] = None,
    height: Annotated[
        Number, cli.number("--height", "Regular waves, for the drag \\[m, default: the scene's].", min=0)
    ] = None,
    significant: Annotated[Number, cli.number("--significant-height", "Of an irregular sea \\[m].", min=0)] = None,
    peak: Annotated[Number, cli.number("--peak-period", "Of an irregular sea \\[s].", min=0.1)] = None,
    gamma: Annotated[float, cli.number("--gamma", "Of its peak.", min=1)] = 3.3,
    spreading: Annotated[
        Number, cli.number("--spreading", "s of its cos^2s of half the angle \\[default: none].", min=0)
    ] = None,
    direction: Annotated[Number, cli.number("--direction", "Of the waves \\[deg, default: the scene's].")] = None,
    verify: Annotated[
        str | None,
        typer.Option("--verify", metavar="PERIODS", help="Compare with runs in time at these periods \\[s], or 'sea'."),
    ] = None,
    folder: cli.OutOption = None,
    assign: cli.SetOption = None,
    plot: cli.PlotOption = True,
) -> None:
    """Linear response to waves: motions, tensions, spectra.  Example: dolfbuoy response short --verify 5,8

    --verify compares with runs: '5,8' in regular waves of these periods, 'sea' in the irregular sea, '5,sea' in both.
    """
    from ..linear.spectrum import check_periods, irregular_waves
    from ..linear_api import PERIODS
    from ..linear_api import response as find
    from ..results.linear_record import HELD, LINEAR, warnings
    from ..scene.variants import numbers_of

    if (significant is None) != (peak is None):
        raise InputError("--significant-height: goes with --peak-period, both or none.")
    if spreading is not None and peak is None:
        raise InputError("--spreading: goes with --significant-height and --peak-period.")
    loaded, folder = cli.load(scene, assign), cli.folder_of(scene, folder)
    sea = None if peak is None else (significant, peak, gamma, spreading)
    checked, in_sea = _to_verify(verify)
    waves = irregular_waves(loaded, sea, direction)
    if in_sea and waves is None:
        raise InputError("--verify sea: there is none; give --significant-height and --peak-period.")
    if height is None and loaded.waves is not None and not loaded.waves.irregular:
        height = 2 * loaded.waves.size
    requested = numbers_of("--periods", periods) if periods is not None else PERIODS.tolist()
    check_periods("--periods", requested)
    check_periods("--verify", checked)
    requested = sorted({*requested, *checked})
    began = time.monotonic()
    found = find(loaded, requested, height, sea, direction, folder)
    if rank() != 0:
        return
    seconds = time.monotonic() - began
    _show_response(found, folder)
    cli.say(f"{LINEAR}  {len(requested)} periods took {rounded(seconds)} s.")
    if any(end.kind == "prescribed" for piece in loaded.network.pieces for end in piece.ends):
        cli.say(HELD)
    cli.say_warnings(warnings(found))
    runs = _verified(found, loaded, checked, height)
    if in_sea and waves is not None:
        _verify_in_sea(loaded, waves)
    if plot:
        _draw_response(found, runs, folder)


def _show_response(found: "xr.Dataset", folder: Path) -> None:
    """Print amplitudes at a few periods, and standard deviations."""
    from ..results.linear_record import each_buoy, each_tension

    few = _few_periods(found)
    for key, words in (("rao", "small waves"), ("rao_drag", f"waves of {found.attrs.get('height_m', 0):g} m")):
        for what, sizes in _amplitudes(few, key).items() if f"{key}_tension" in found else ():
            table = np.column_stack(list(sizes.values()))
            rows = [[f"{T:g}", *(f"{x:.4g}" for x in row)] for T, row in zip(few.period.values, table, strict=True)]
            title = f"\n{folder / 'response.nc'}, amplitudes per metre in {words}{what}"
            cli.print_table(title, ("period [s]", *sizes), rows)
    if "tension_std" in found:
        rows = []
        for of_buoy, one in each_buoy(found) if "motion_std" in found else ():
            for name, factor, unit in MOTIONS:
                deviation = factor * one.motion_std.sel(motion=name).item()
                rows.append([f"{name}{of_buoy}", f"{deviation:.4g}", "", unit])
        for name, one in each_tension(found):
            rows.append([name, f"{one.tension_std.item():.5g}", f"{one.tension_mean.item():.5g}", "N"])
        title = "\nStandard deviations in the irregular sea"
        cli.print_table(title, ("", "standard deviation", "mean", "unit"), rows)


def _few_periods(found: "xr.Dataset") -> "xr.Dataset":
    """All periods if they are not many, else some of SHOWN, or some evenly spread."""
    T = found.period.values
    if len(T) <= len(SHOWN):
        return found
    chosen = np.flatnonzero(np.isin(np.round(T, 6), SHOWN))
    return found.isel(period=chosen if len(chosen) > 4 else np.linspace(0, len(T) - 1, len(SHOWN)).round().astype(int))


def _amplitudes(found: "xr.Dataset", key: str) -> dict[str, dict[str, Any]]:
    """End of a title -> name -> amplitudes over the periods: one table, or of each buoy, tops and anchors."""
    from ..results.labelled import complex_of
    from ..results.linear_record import each_buoy, each_tension

    tables, tensions = {}, each_tension(found)
    for of_buoy, one in each_buoy(found) if key in found else ():
        sizes = {name: factor * np.abs(complex_of(one[key].sel(motion=name))) for name, factor, _ in MOTIONS}
        tables[f"{of_buoy.replace(' of ', ', ')} [m, deg]"] = sizes
    pulls = {name: np.abs(complex_of(one[f"{key}_tension"])) for name, one in tensions}
    if len(tables) <= 1 and len(tensions) <= 2:
        return {" [m, deg, N]": {name: values for one in tables.values() for name, values in one.items()} | pulls}
    for end in ("tension_top", "tension_anchor"):
        of_end = {name.removeprefix(f"{end}_"): values for name, values in pulls.items() if name.startswith(end)}
        tables |= {f", {end} [N]": of_end} if of_end else {}
    return tables


def _to_verify(text: str | None) -> tuple[list[float], bool]:
    """Periods [s] of the option --verify, and True if it names the irregular sea."""
    from ..scene.settings import parse_numbers

    words = [word.strip() for word in text.split(",")] if text else []
    numbers = ",".join(word for word in words if word != "sea")
    return (parse_numbers("--verify", numbers) or [] if numbers else []), "sea" in words


def _verified(found: "xr.Dataset", scene: "Scene", periods: list[float], height: float | None) -> list[dict[str, Any]]:
    """Runs in time at some periods, and how far the linear amplitudes are from theirs."""
    from ..results.labelled import complex_of
    from ..results.linear_record import each_buoy, each_tension
    from ..studies.physics.response_runs import compared, measured

    runs, key = [], "rao_drag" if "rao_drag_tension" in found else "rao"
    for T in periods:
        one, own = found.sel(period=T), dict[str, Any]()
        for of_buoy, part in each_buoy(one) if key in one else ():
            own |= {f"{n}{of_buoy}": complex_of(part[key].sel(motion=n)) for n in part.motion.values.tolist()}
        own |= {name: complex_of(part[f"{key}_tension"]) for name, part in each_tension(one)}
        run: dict[str, Any] = measured(scene, T, found.attrs["direction_deg"], height / 2 if height else SMALL)
        cli.say(f"{T:g} s against a run of {rounded(run['seconds'])} s: {_differences(compared(own, run))}")
        if run["unsettled"] > UNSETTLED:
            change = f"its amplitudes still change by up to {100 * run['unsettled']:.2g} %"
            cli.say_warnings([f"The run of {T:g} s waves has not settled, {change}: in still water little damps it."])
        runs.append({"period": T} | run)
    return runs


def _verify_in_sea(scene: "Scene", waves: "Waves") -> None:
    """A run in the irregular sea, and how far the linear standard deviations are from its own."""
    from ..studies.physics.response_runs import compared, measured_in_sea

    own, run = measured_in_sea(scene, waves)
    words = f"a run of {rounded(run['seconds'])} s in {run['time']:.4g} s of it, both in the same components"
    cli.say(f"The sea, in {rounded(own['seconds'])} s, against {words}: {_differences(compared(own, run))}")


def _differences(found: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:+.1f} %" for name, value in found.items())


def _draw_response(found: "xr.Dataset", runs: list[dict[str, Any]], folder: Path) -> None:
    from ..results.linear_figures import amplitudes, spectra

    figures = {"response_amplitudes": amplitudes(found, runs)}
    figures |= {"response_spectra": spectra(found)} if "tension_std" in found else {}
    cli.draw_into(folder, "response", **figures)
    cli.say(f"{2 * len(figures)} figures in {folder / 'figures'}")
