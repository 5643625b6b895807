"""A scene compared with MoorDyn: tensions and motions over the second half of two runs with the same start.

MoorDyn is an independent code (lumped masses, explicit steps); parts of a scene that it lacks are named.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from ..accuracy.bars import NONE
from ..api import simulate
from ..errors import InputError, SolveError
from ..formats.moordyn_run import Series, moordyn_module, run
from ..formats.to_moordyn import Numerics, Start, export, start_of
from ..model.rigid import axis_offset, rotation_of
from ..results.quantities import QUANTITIES
from ..results.style import COLORS, PAGE, STYLE, legend_above, matplotlib, new_figure, save
from ..scene import Scene
from ..statics.catenary import Array
from .study import Row

#: Number of retries of a diverging run, each with half the step.
TRIES = 4
#: Series that vary by less than this fraction of their size are constants: differences are relative to that size.
CONSTANT = 1e-3
AXES = "xyz"
#: Times, and series by name.
Times = tuple[Array, dict[str, Array]]


@dataclass
class Comparison:
    """rows: of the table.  notes: parts missing in MoorDyn's input.  ours, theirs: times and series by name."""

    rows: list[Row]
    notes: list[str]
    ours: Times
    theirs: Times


def beginning(scene: Scene) -> Start:
    """Start of a run of the scene: at rest, or where its [initial] puts it."""
    step = {} if scene.time else {"time.step": 1.0}
    return start_of(simulate(scene, **{"time.end": 0.0} | step).isel(time=0))


def compare(scene: Scene, end: float | None = None, segments: int = 1) -> Comparison:
    """Run a scene with dolfbuoy and with MoorDyn.

    end: of both runs [s], by default the scene's.  segments: of MoorDyn per element of a line.  Raises InputError for a
    scene without cable or [time], or without MoorDyn; SolveError if MoorDyn diverges.
    """
    moordyn_module()
    if not scene.network.pieces or scene.time is None:
        raise InputError("a comparison needs a scene with a cable and [time].")
    end = end or scene.time.end
    scene = scene.model_copy(update={"time": scene.time.model_copy(update={"end": end})})
    record = simulate(scene, accuracy={"estimate": "companion"})
    start, step = start_of(record.isel(time=0)), None
    for _ in range(TRIES):
        written = export(scene, start, Numerics(step=step, segments=segments))
        theirs = run(written, end)
        if theirs is not None:
            break
        step = written.step / 2
    else:
        raise SolveError(f"MoorDyn diverges, with steps of {written.step:.3g} s too.")
    ours = record.time.values, _ours(record, scene)
    series = theirs.t, _named(theirs, scene)
    units = {name: "N" if "tension" in name else "m" for name in ours[1] if name in series[1]}
    bars = _bars(record)
    rows = [_row(name, unit, ours, series, end / 2, bars.get(name)) for name, unit in units.items()]
    return Comparison(rows, [str(note) for note in written.notes], ours, series)


def _ours(record: xr.Dataset, scene: Scene) -> dict[str, Array]:
    network, found = scene.network, {}
    for k, name in enumerate(network.cables):
        for end, force in (("top", record.end_tension), ("anchor", record.anchor_force)):
            found[f"{name}: tension_{end}"] = np.linalg.norm(force.values[:, k], axis=-1)
    for name, buoy in network.buoys.items():
        if "buoy_position" in record:
            one, down = record.sel(buoy=name), axis_offset(buoy, 0.0)
            keel = one.buoy_position.values + [rotation_of(q) @ down for q in one.buoy_orientation.values]
            found |= {f"{name}: keel {axis}": keel[:, i] for i, axis in enumerate(AXES)}
    return found


def _named(series: Series, scene: Scene) -> dict[str, Array]:
    network, found = scene.network, {}
    for k, name in enumerate(network.cables):
        found[f"{name}: tension_top"] = series.tension[:, network.last_of(k), 1]
        found[f"{name}: tension_anchor"] = series.tension[:, network.first_of(k), 0]
    for k, name in enumerate(network.buoys):
        found |= {f"{name}: keel {axis}": series.body[:, k, i] for i, axis in enumerate(AXES)}
    return found


def _bars(record: xr.Dataset) -> dict[str, float]:
    """Error bars of the largest tensions by name, without unknown ones."""
    ends = {"tension_top.max": "tension_top", "anchor.max": "tension_anchor"}
    columns = (record[name].values.tolist() for name in ("output_of", "output", "bar", "bar_verdict"))
    rows = zip(*columns, strict=True)
    return {f"{part}: {ends[output]}": bar for part, output, bar, verdict in rows if output in ends and verdict != NONE}


def _row(name: str, unit: str, ours: Times, theirs: Times, start: float, bar: float | None) -> Row:
    """Row of the table: mean and extremes of both, our error bar of the largest and whether they differ by more.
    Also the rms difference relative to our range or, for a constant, to its value."""
    t, values = ours[0], ours[1][name]
    other = np.interp(t, theirs[0], theirs[1][name])
    late = t >= start
    a, b = values[late], other[late]
    difference = float(np.sqrt(np.mean((a - b) ** 2)))
    row: Row = {"quantity": name, "unit": unit}
    for what, of in (("mean", np.mean), ("least", np.min), ("largest", np.max)):
        row |= {what: float(of(a)), f"{what}_moordyn": float(of(b))}
    apart = abs(row["largest"] - row["largest_moordyn"])
    row |= {"bar": bar, "beyond": None if bar is None else "yes" if apart > bar else "no"}
    span, size = float(np.ptp(a)), float(np.abs(a).max())
    whole, scale = ("range", span) if span > CONSTANT * size else ("value", size)
    return row | {"difference": difference, "of": whole, "relative": difference / scale if scale else float("nan")}


@matplotlib.rc_context(STYLE)  # type: ignore[untyped-decorator]  # matplotlib has no types
def draw(found: Comparison, folder: Path) -> list[Path]:
    """Both programs' tensions and motions over time; returns the files."""
    names = [row["quantity"] for row in found.rows if "anchor" not in row["quantity"]][:12]
    figure = new_figure(PAGE, 1.2 + 1.1 * len(names))
    axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for ax, name in zip(axes, names, strict=True):
        factor = 1e-3 if "tension" in name else 1.0
        seen = []
        for (t, series), label, style in ((found.ours, "dolfbuoy", "-"), (found.theirs, "MoorDyn", "--")):
            ax.plot(t, factor * series[name], style, color=COLORS["blue" if style == "-" else "red"], label=label)
            seen.append(factor * series[name][t >= (0 if style == "-" else t[-1] / 2)])
        low, high = min(x.min() for x in seen), max(x.max() for x in seen)  # without the initial shock of MoorDyn
        room = 0.06 * (high - low) or 1.0
        ax.set_ylim(low - room, high + room)
        ax.set_ylabel(f"{_in_words(name)}\n[{'kN' if factor < 1 else 'm'}]")
    legend_above(axes[0], 2)
    axes[-1].set_xlabel("time [s]")
    return save(figure, folder / "comparison")


def _in_words(name: str) -> str:
    """`PART: what` of a series, as a label of its axis."""
    part, _, quantity = name.rpartition(": ")
    known = QUANTITIES.get(quantity)
    return "\n".join(filter(None, (part, (known and known.compared) or quantity.replace("_", " "))))
