"""The linear response to waves on the command line, and runs in time beside it."""

import time
from typing import Annotated

import numpy as np
import typer

from ..errors import InputError
from .app import app
from .linear import PlotOption
from .shared import (
    OutOption,
    SceneArgument,
    SetOption,
    draw_into,
    finite,
    folder_of,
    load,
    out,
    print_table,
    rank,
    say_warnings,
    table_of,
)

#: Motions that are shown, factor, unit.
MOTIONS = [(name, 1.0, "m") for name in ("surge", "sway", "heave")]
MOTIONS += [(name, float(np.degrees(1)), "deg") for name in ("roll", "pitch")]
#: Amplitude of the runs beside small waves [m].
SMALL = 1e-3
#: Part of its amplitudes by which those of a run may change in the end without a word.
UNSETTLED = 0.01
#: Periods of a table [s], of many.
SHOWN = (2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 20, 25, 30)


@app.command()
def response(
    scene: SceneArgument,
    periods: Annotated[str | None, typer.Option("--periods", help="\\[s], a,b,c or start:stop:step.")] = None,
    height: Annotated[
        float | None,
        typer.Option(
            "--height", min=0, callback=finite, help="Regular waves, for the drag \\[m, default: the scene's]."
        ),
    ] = None,
    significant: Annotated[
        float | None,
        typer.Option("--significant-height", min=0, callback=finite, help="Of an irregular sea \\[m]."),
    ] = None,
    peak: Annotated[
        float | None, typer.Option("--peak-period", min=0.1, callback=finite, help="Of an irregular sea \\[s].")
    ] = None,
    gamma: Annotated[float, typer.Option("--gamma", min=1, callback=finite, help="Of its peak.")] = 3.3,
    spreading: Annotated[
        float | None,
        typer.Option(
            "--spreading", min=0, callback=finite, help="s of its cos^2s of half the angle \\[default: none]."
        ),
    ] = None,
    direction: Annotated[
        float | None,
        typer.Option("--direction", callback=finite, help="Of the waves \\[deg, default: the scene's]."),
    ] = None,
    verify: Annotated[
        str | None,
        typer.Option("--verify", metavar="PERIODS", help="Runs in time beside it, at these periods \\[s], or 'sea'."),
    ] = None,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
):
    """Linear response to waves: motions, tensions, spectra.  Example: dolfbuoy response short --verify 5,8

    --verify runs in time beside it: '5,8' in regular waves of these periods, 'sea' in the irregular sea, '5,sea' both.
    """
    from ..linear.response import check_periods
    from ..linear.spectrum import irregular_waves
    from ..linear_api import PERIODS
    from ..linear_api import response as find
    from ..results.response_record import HELD, LINEAR, warnings
    from ..scene.variants import numbers_of

    if (significant is None) != (peak is None):
        raise InputError("--significant-height: goes with --peak-period, both or none.")
    if spreading is not None and peak is None:
        raise InputError("--spreading: goes with --significant-height and --peak-period.")
    loaded, folder = load(scene, assign), folder_of(scene, folder)
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
    out.print(f"{LINEAR}  {len(requested)} periods took {seconds:.2g} s.", soft_wrap=True)
    if any(end.kind == "prescribed" for piece in loaded.network.pieces for end in piece.ends):
        out.print(HELD, soft_wrap=True)
    say_warnings(warnings(found))
    runs = _verified(found, loaded, checked, height)
    if in_sea:
        _verify_in_sea(loaded, waves)
    if plot:
        _draw_response(found, runs, folder)


def _show_response(found, folder):
    """Amplitudes at a few periods, and standard deviations."""
    from ..results.response_record import each_buoy, each_tension

    few = _few_periods(found)
    for key, words in (("rao", "small waves"), ("rao_drag", f"waves of {found.attrs.get('height_m', 0):g} m")):
        if f"{key}_tension" not in found:
            continue
        title = f"\n{folder / 'response.nc'}, amplitudes per metre in {words}"
        for what, amplitudes in _amplitudes(few, key):
            rows = zip(few.period.values, *amplitudes.values(), strict=True)
            rows = [(f"{T:g}", *(f"{value:.4g}" for value in values)) for T, *values in rows]
            print_table(f"{title}{what}", ("period [s]", *amplitudes), rows)
    if "tension_std" in found:
        shown = table_of("\nStandard deviations in the irregular sea", "", "standard deviation", "mean", "unit")
        for of_buoy, one in each_buoy(found) if "motion_std" in found else ():
            for name, factor, unit in MOTIONS:
                shown.add_row(f"{name}{of_buoy}", f"{factor * one.motion_std.sel(motion=name).item():.4g}", "", unit)
        for name, one in each_tension(found):
            shown.add_row(name, f"{one.tension_std.item():.5g}", f"{one.tension_mean.item():.5g}", "N")
        out.print(shown)


def _few_periods(found):
    """All if they are not many, else some of SHOWN, or some evenly spread."""
    T = found.period.values
    if len(T) <= len(SHOWN):
        return found
    chosen = np.flatnonzero(np.isin(np.round(T, 6), SHOWN))
    return found.isel(period=chosen if len(chosen) > 4 else np.linspace(0, len(T) - 1, len(SHOWN)).round().astype(int))


def _amplitudes(found, key):
    """[(what, name -> amplitudes over the periods)] of tables: one, or of a network of each buoy, tops and anchors."""
    from ..results.labelled import complex_of
    from ..results.response_record import each_buoy, each_tension

    tables, tensions = [], each_tension(found)
    for of_buoy, one in each_buoy(found) if key in found else ():
        sizes = {name: factor * np.abs(complex_of(one[key].sel(motion=name))) for name, factor, _ in MOTIONS}
        tables.append((f"{of_buoy.replace(' of ', ', ')} [m, deg]", sizes))
    pulls = {name: np.abs(complex_of(one[f"{key}_tension"])) for name, one in tensions}
    if len(tables) <= 1 and len(tensions) <= 2:
        return [(" [m, deg, N]", {name: values for _, one in tables for name, values in one.items()} | pulls)]
    for end in ("tension_top", "tension_anchor"):
        of_end = {name.removeprefix(f"{end}_"): values for name, values in pulls.items() if name.startswith(end)}
        tables += [(f", {end} [N]", of_end)] if of_end else []
    return tables


def _to_verify(text):
    """(periods [s], whether the irregular sea) of the option --verify."""
    from ..scene.settings import parse_numbers

    words = [word.strip() for word in text.split(",")] if text else []
    numbers = ",".join(word for word in words if word != "sea")
    return (parse_numbers("--verify", numbers) if numbers else []), "sea" in words


def _verified(found, scene, periods, height):
    """Runs in time at some periods, and how far the linear amplitudes are from theirs."""
    from ..results.labelled import complex_of
    from ..results.response_record import each_buoy, each_tension
    from ..studies.physics.response_runs import compared, measured

    runs, key = [], "rao_drag" if "rao_drag_tension" in found else "rao"
    for T in periods:
        one, own = found.sel(period=T), {}
        for of_buoy, part in each_buoy(one) if key in one else ():
            own |= {f"{n}{of_buoy}": complex_of(part[key].sel(motion=n)) for n in part.motion.values.tolist()}
        own |= {name: complex_of(part[f"{key}_tension"]) for name, part in each_tension(one)}
        run = measured(scene, T, found.attrs["direction_deg"], height / 2 if height else SMALL)
        out.print(
            f"{T:g} s against a run of {run['seconds']:.2g} s: {_differences(compared(own, run))}", soft_wrap=True
        )
        if run["unsettled"] > UNSETTLED:
            words = (
                f"its amplitudes still change by up to {100 * run['unsettled']:.2g} %: in still water little damps it."
            )
            say_warnings([f"The run of {T:g} s waves has not settled, {words}"])
        runs.append({"period": T} | run)
    return runs


def _verify_in_sea(scene, waves):
    """A run in the irregular sea, and how far the linear standard deviations are from its own."""
    from ..studies.physics.response_runs import compared, measured_in_sea

    own, run = measured_in_sea(scene, waves)
    words = f"a run of {run['seconds']:.2g} s in {run['time']:.4g} s of it, both in the same components"
    out.print(
        f"The sea, in {own['seconds']:.2g} s, against {words}: {_differences(compared(own, run))}", soft_wrap=True
    )


def _differences(found):
    return ", ".join(f"{name} {value:+.1f} %" for name, value in found.items())


def _draw_response(found, runs, folder):
    from ..results.response_figures import amplitudes, spectra

    figures = {"amplitudes": amplitudes(found, runs)} | ({"spectra": spectra(found)} if "tension_std" in found else {})
    for name, figure in figures.items():
        draw_into(folder, "response", f"response_{name}", figure)
    out.print(f"{2 * len(figures)} figures in {folder / 'figures'}", soft_wrap=True)
