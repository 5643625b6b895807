"""About an equilibrium, on the command line: small motions, stiffness, and how far loads push it."""

import time
from typing import Annotated

import numpy as np
import typer

from ..errors import InputError
from ..results.tables import force_unit
from .shared import (
    OutOption,
    SceneArgument,
    SetOption,
    folder_of,
    load,
    out,
    page_of,
    rank,
    say_warnings,
    table_of,
)

DirectionOption = Annotated[
    float, typer.Option("--direction", help="Of surge and of the figures' plane, from x \\[deg].")
]
#: Motions that are shown, factor, unit.
MOTIONS = [(name, 1.0, "m") for name in ("surge", "sway", "heave")]
MOTIONS += [(name, float(np.degrees(1)), "deg") for name in ("roll", "pitch")]
#: Amplitude of the runs beside small waves [m].
SMALL = 1e-3
#: Part of its amplitudes by which those of a run may change in the end without a word.
UNSETTLED = 0.01
#: Damping ratios below this are rounding.
NO_DAMPING = 1e-9
#: Part of the largest stiffness that is shown as 0.
ROUNDING = 1e-10
PlotOption = Annotated[bool, typer.Option("--plot/--no-plot", help="Draw figures.")]


def modes(
    scene: SceneArgument,
    number: Annotated[int, typer.Option("--number", min=1, help="Of modes, the slowest first.")] = 10,
    direction: DirectionOption = 0.0,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
    paraview: Annotated[bool, typer.Option("--paraview", help="Write the shapes, moving, for ParaView.")] = False,
):
    """Natural periods, damping and shapes about the equilibrium.  Example: dolfbuoy modes short --number 10"""
    from ..linear_api import modes as find
    from ..results.mode_figures import draw_modes
    from ..results.mode_record import KINDS
    from ..results.stiffness_record import on_friction

    loaded, folder = load(scene, assign), folder_of(scene, folder)
    found = find(loaded, number, folder, direction_deg=direction)
    if rank() != 0:
        return
    title = f"Modes of {loaded.title or scene}, {folder / 'modes.nc'}"
    shown = table_of(title, "", "what moves", "period [s]", "omega [rad/s]", "damping ratio", "residual", "")
    for i in range(found.sizes["mode"]):
        mode = found.isel(mode=i)
        numbers = [_number_of(mode[name].item()) for name in ("period", "omega", "damping_ratio")]
        shown.add_row(str(i + 1), mode.name.item(), *numbers, f"{mode.residual.item():.0e}", KINDS[mode.kind.item()])
    out.print(shown)
    for note in on_friction(loaded):
        out.print(note, soft_wrap=True)
    if plot:
        drawn = draw_modes(folder, found, loaded, paraview, direction)
        out.print(f"{len(drawn)} files in {folder}", soft_wrap=True)
        page_of("modes.nc", folder)


def _number_of(value):
    """A number of a mode; damping that is rounding is none."""
    return "-" if np.isnan(value) else f"{value:.5g}" if abs(value) > NO_DAMPING else "0"


def stiffness(scene: SceneArgument, folder: OutOption = None, assign: SetOption = None):
    """Restoring matrices of mooring and hull at the equilibrium.  Example: dolfbuoy stiffness short"""
    from ..linear_api import stiffness as find
    from ..results.response_record import each_buoy
    from ..results.stiffness_record import notes

    loaded, folder = load(scene, assign), folder_of(scene, folder)
    found = find(loaded, folder)
    if rank() != 0:
        return
    for of_buoy, one in each_buoy(found):
        _show_stiffness(of_buoy, one)
    for note in notes(found, loaded):
        out.print(note, soft_wrap=True)


def _show_stiffness(of_buoy, found):
    """Matrices of a buoy, and the eigenvalues of their symmetric parts."""
    for name in ("mooring", "hull", "total"):
        title = f"{found[name].attrs['long_name']}{of_buoy}; N and N m for 1 m and 1 rad"
        shown = table_of(f"\n{title}", "", *found.motion.values.tolist())
        for row, values in zip(found.reaction.values.tolist(), _without_rounding(found[name].values), strict=True):
            shown.add_row(row, *map(_stiffness_text, values))
        out.print(shown)
    title = f"\nEigenvalues of the symmetric parts{of_buoy}, turns at the radius of gyration [N/m]"
    shown = table_of(title, "", *map(str, range(1, 7)))
    for name in ("mooring", "hull", "total"):
        shown.add_row(name, *map(_stiffness_text, _without_rounding(found[f"{name}_eigenvalue"].values)))
    out.print(shown)


def _without_rounding(values):
    """0 for what is very small beside the largest number."""
    largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    return np.where(np.abs(values) < ROUNDING * largest, 0.0, values)


def _stiffness_text(value):
    return f"{value:.5g}" if np.isfinite(value) else "rigid" if value > 0 else "-rigid"


def offsets(
    scene: SceneArgument,
    force: Annotated[str | None, typer.Option("--force", help="Sizes \\[N], a,b,c or start:stop:step.")] = None,
    current: Annotated[str | None, typer.Option("--current", help="Or speeds at the surface \\[m/s].")] = None,
    directions: Annotated[str, typer.Option("--directions", help="Of the load, from x \\[deg].")] = "0:330:30",
    buoy: Annotated[
        str | None, typer.Option("--buoy", help="Of several, which the force acts on \\[default: each].")
    ] = None,
    folder: OutOption = None,
    assign: SetOption = None,
    plot: PlotOption = True,
):
    """Offsets and tensions under loads from many sides.  Example: dolfbuoy offsets short --force 0:5000:500"""
    from ..api import offsets as find
    from ..results.offset_record import sentences
    from ..scene.variants import numbers_of

    if (force is None) == (current is None):
        raise InputError("--force: must be given, or --current, and not both.")
    what, sizes = ("force", numbers_of("--force", force)) if force else ("current", numbers_of("--current", current))
    turns = list(dict.fromkeys(angle % 360 for angle in numbers_of("--directions", directions)))
    loaded, folder = load(scene, assign), folder_of(scene, folder)
    if buoy is not None and what == "current":
        raise InputError("--buoy: goes with --force, a current flows past all of them.")
    found = find(loaded, sizes, turns, what, folder, buoys=None if buoy is None else [buoy])
    if rank() != 0:
        return
    _show_offsets(found, what, folder)
    say_warnings(sentences(found))
    if plot:
        _draw_offsets(found, loaded, folder)


def _show_offsets(found, what, folder):
    """Largest offset and tension of each direction, and the watch circle of the largest load."""
    from ..results.offset_record import top_tension
    from ..results.response_record import each_buoy

    unit, factor = force_unit(found.tension_top.values)
    title, buoys = f"Largest offset and tension towards each side, {folder / 'offsets.nc'}", each_buoy(found)
    offsets = [f"offset{of_buoy} [m]" for of_buoy, _ in buoys]
    shown = table_of(title, "direction [deg]", f"at {what}", *offsets, f"tension at the top [{unit}]")
    for direction in found.direction.values:
        one = found.sel(direction=direction)
        if not one.found.any():
            continue
        moved = [part.sel(direction=direction).offset for _, part in buoys] if "offset" in one else []
        row = int(np.nanargmax(np.max(moved, axis=0))) if moved else -1
        texts = [f"{values.values[row]:.5g}" for values in moved] or ["-"] * len(buoys)
        tension = f"{factor * top_tension(one).max().item():.5g}"
        shown.add_row(f"{direction:g}", f"{one[what].values[row]:g}", *texts, tension)
    out.print(shown)
    for of_buoy, one in buoys if found.sizes["direction"] > 2 else ():
        last = one.isel({what: -1})
        x, y = np.round(last.watch_centre.values, 9) + 0.0
        words = f"the watch circle{of_buoy} has a radius of {last.watch_radius.item():.4g} m about ({x:.4g}, {y:.4g})"
        if np.isfinite(x):
            size = f"{last[what].item():g} {'N' if what == 'force' else 'm/s'}"
            out.print(f"At {size} {words}.", soft_wrap=True)


def _draw_offsets(found, scene, folder):
    from ..results.folder import enlist
    from ..results.offset_figures import offset_curves
    from ..results.style import files_of, save
    from ..scene.network import network_of

    held = [end.top.position[:2] for piece in network_of(scene).pieces for end in piece.ends if end.held]
    target = folder / "figures" / "offsets"
    enlist(folder, files_of(target), "offsets")
    target.parent.mkdir(exist_ok=True)
    save(offset_curves(found, held), target)
    out.print(f"figure: {target}.png", soft_wrap=True)


def response(
    scene: SceneArgument,
    periods: Annotated[str | None, typer.Option("--periods", help="\\[s], a,b,c or start:stop:step.")] = None,
    height: Annotated[
        float | None,
        typer.Option("--height", min=0, help="Regular waves, for the drag \\[m, default: the scene's]."),
    ] = None,
    significant: Annotated[
        float | None, typer.Option("--significant-height", min=0, help="Of an irregular sea \\[m].")
    ] = None,
    peak: Annotated[float | None, typer.Option("--peak-period", min=0.1, help="Of an irregular sea \\[s].")] = None,
    gamma: Annotated[float, typer.Option("--gamma", min=1, help="Of its peak.")] = 3.3,
    spreading: Annotated[
        float | None, typer.Option("--spreading", min=0, help="s of its cos^2s of half the angle \\[default: none].")
    ] = None,
    direction: Annotated[
        float | None, typer.Option("--direction", help="Of the waves \\[deg, default: the scene's].")
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
    asked = numbers_of("--periods", periods) if periods is not None else PERIODS.tolist()
    if min(asked) <= 0:
        raise InputError(f"--periods {periods}: must be positive.")
    asked = sorted({*asked, *checked})
    began = time.monotonic()
    found = find(loaded, asked, height, sea, direction, folder)
    if rank() != 0:
        return
    seconds = time.monotonic() - began
    _show_response(found, folder)
    out.print(f"{LINEAR}  {len(asked)} periods took {seconds:.2g} s.", soft_wrap=True)
    if _ends_move(loaded):
        out.print(HELD, soft_wrap=True)
    say_warnings(warnings(found))
    runs = _verified(found, loaded, checked, height)
    if in_sea:
        _verify_in_sea(loaded, waves)
    if plot:
        _draw_response(found, runs, folder)


def _show_response(found, folder):
    """Amplitudes at a few periods, and standard deviations."""
    from ..results.response_record import each_buoy

    for key, words in (("rao", "small waves"), ("rao_drag", f"waves of {found.attrs.get('height_m', 0):g} m")):
        if f"{key}_tension" not in found:
            continue
        whole = np.isclose(found.period.values % 1, 0)
        few = found.isel(period=whole) if whole.any() else found
        amplitudes = _amplitudes(few, key)
        title = f"\nAmplitudes per metre in {words}, {folder / 'response.nc'} [m, deg, N]"
        shown = table_of(title, "period [s]", *amplitudes)
        for T, *values in zip(few.period.values, *amplitudes.values(), strict=True):
            shown.add_row(f"{T:g}", *(f"{value:.4g}" for value in values))
        out.print(shown)
    if "tension_std" in found:
        shown = table_of("\nStandard deviations in the irregular sea", "", "standard deviation", "mean", "unit")
        for of_buoy, one in each_buoy(found) if "motion_std" in found else ():
            for name, factor, unit in MOTIONS:
                shown.add_row(f"{name}{of_buoy}", f"{factor * one.motion_std.sel(motion=name).item():.4g}", "", unit)
        for name in found.tension.values.tolist():
            one = found.sel(tension=name)
            shown.add_row(name, f"{one.tension_std.item():.5g}", f"{one.tension_mean.item():.5g}", "N")
        out.print(shown)


def _amplitudes(found, key):
    """Name -> amplitudes over the periods, of motions [m, deg] and tensions [N]."""
    from ..results.response_record import complex_of, each_buoy

    sizes = {}
    for of_buoy, one in each_buoy(found) if key in found else ():
        for name, factor, _ in MOTIONS:
            sizes[f"{name}{of_buoy}"] = factor * np.abs(complex_of(one[key].sel(motion=name)))
    for name in found.tension.values.tolist():
        sizes[name] = np.abs(complex_of(found[f"{key}_tension"].sel(tension=name)))
    return sizes


def _to_verify(text):
    """(periods [s], whether the irregular sea) of the option --verify."""
    from ..scene.settings import parse_numbers

    words = [word.strip() for word in text.split(",")] if text else []
    numbers = ",".join(word for word in words if word != "sea")
    return (parse_numbers("--verify", numbers) if numbers else []), "sea" in words


def _ends_move(scene):
    from ..scene.network import network_of

    return any(end.kind == "prescribed" for piece in network_of(scene).pieces for end in piece.ends)


def _verified(found, scene, periods, height):
    """Runs in time at some periods, and how far the linear amplitudes are from theirs."""
    from ..results.response_record import complex_of, each_buoy
    from ..studies.physics.response_runs import compared, measured

    runs, key = [], "rao_drag" if "rao_drag_tension" in found else "rao"
    for T in periods:
        one, own = found.sel(period=T), {}
        for of_buoy, part in each_buoy(one) if key in one else ():
            own |= {f"{n}{of_buoy}": complex_of(part[key].sel(motion=n)) for n in part.motion.values.tolist()}
        own |= {n: complex_of(one[f"{key}_tension"].sel(tension=n)) for n in one.tension.values.tolist()}
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
    from ..results.folder import enlist
    from ..results.response_figures import amplitudes, spectra
    from ..results.style import files_of, save

    figures = {"amplitudes": amplitudes(found, runs)} | ({"spectra": spectra(found)} if "tension_std" in found else {})
    for name, figure in figures.items():
        target = folder / "figures" / f"response_{name}"
        enlist(folder, files_of(target), "response")
        target.parent.mkdir(exist_ok=True)
        save(figure, target)
    out.print(f"{2 * len(figures)} figures in {folder / 'figures'}", soft_wrap=True)


def add_to(app: typer.Typer) -> None:
    """Make them commands of an application."""
    for command in (modes, stiffness, offsets, response):
        app.command()(command)
