"""Error against wall time over pairs, cells, schemes and steps of a scene: what accuracy costs.

The reference is a run of generalized-alpha with P3-P2, more unknowns and a quarter of the smallest step.  The
difference from the run at twice its step and half its cells gives its own error (Richardson, order 2); what is below
three times that is not resolved.
"""

import itertools
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.lines import Line2D
from mpi4py import MPI

from ..errors import InputError, SolveError
from ..results.style import COLORS, PAGE, STYLE, new_figure
from ..scene import Scene, load_scene
from . import accuracy as acc
from .accuracy import Error, Reference, Run, Space, Stepping, percent
from .common import evaluate_all, save, show

ACCURACIES = (0.1, 0.01, 0.001)
TOLERANCES = (1e-3, 1e-4, 1e-5)
#: What of a case is not shown.
HIDDEN = ("study", "scene", "reference", "file")


# -- cases -------------------------------------------------------------------------------------------------------------


def spaces(scene: Scene, pairs=None, cells=None) -> list[Space]:
    """Pairs times numbers of elements; by default 1/4, 1/2 and all of the scene's elements."""
    if scene.cable is None:
        return [Space()]
    n = acc.space_of(scene).cells
    cells = cells or sorted({max(2, n // 4), max(2, n // 2), n})
    return [Space(*pair, k) for pair in pairs or ((1, 0), (2, 1), (3, 2)) for k in cells]


def default_steps(scene: Scene) -> list[float]:
    """From a fiftieth of the period down to a 500th, or from the scene's step up."""
    period = acc.period_of(scene)
    steps = [period / n for n in (500, 250, 100, 50)] if period else [scene.time.step * n for n in (1, 2, 5, 10)]
    return [float(f"{step:.2g}") for step in steps]


def steppings(schemes, steps, tolerances) -> list[Stepping]:
    """Fixed steps of every scheme, and tolerances of those of second order."""
    fixed = [Stepping(scheme, step) for scheme in schemes for step in steps]
    second = [scheme for scheme in schemes if scheme != "backward-euler"]
    return fixed + [Stepping(scheme, min(steps), tol) for scheme in second for tol in tolerances]


def finest(spaces_: list[Space], steps) -> tuple[Space, float]:
    """Elements and step of the reference."""
    if not spaces_[0].mu:
        return Space(), min(steps) / 4
    nodes = max(space.mu * space.cells for space in spaces_)
    return Space(3, 2, 2 * -(-nodes // 4)), min(steps) / 4


def reference_cases(scene: Scene, spaces_, steps, folder) -> list[dict]:
    """The check of the reference (half its cells, twice its step) and the reference, each with its file."""
    space, step = finest(spaces_, steps)
    coarse = Space(space.mu, space.nu, space.cells // 2)
    return [
        case_of(scene, s, Stepping("generalized-alpha", h), "reference")
        | {"file": str(Path(folder) / "cases" / f"{name}-{_label(scene, s, h)}.npz")}
        for name, s, h in (("check", coarse, 2 * step), ("reference", space, step))
    ]


def _label(scene, space, step):
    return f"{space.mu}-{space.cells}-{step:.6g}-{scene.time.end:.6g}"


def cases(scene: Scene, settings, reference: dict, repeats: int) -> list[dict]:
    """A case of each (Space, Stepping), once, and the scene's own settings first."""
    own = (acc.space_of(scene), acc.stepping_of(scene))
    more = {"repeats": repeats, "reference": reference["file"]}
    return [case_of(scene, *pair, "case") | more | {"own": pair == own} for pair in dict.fromkeys([own, *settings])]


def case_of(scene: Scene, space: Space, stepping: Stepping, kind: str) -> dict:
    """The scene with these settings, and what they are."""
    settings = {"pair": space.pair, "cells": space.cells, "scheme": stepping.scheme, "step": stepping.step}
    changed = acc.with_settings(scene, space, stepping).to_dict()
    return {"study": f"work-precision {kind}", **settings, "tolerance": stepping.tolerance, "scene": changed}


def structure(case: dict) -> tuple:
    """What decides which forms are compiled."""
    return (case["pair"],)


def evaluate_reference(case: dict) -> dict:
    """A fine run, its quantities in `file`."""
    scene = load_scene(case["scene"])
    run = acc.compute(scene, acc.quantities_of(scene))
    write_run(case["file"], run)
    return {"wall": run.wall, "unknowns": run.unknowns}


def write_run(file, run: Run) -> None:
    """Times and quantities of a run, for `read_run`."""
    np.savez_compressed(file, t=run.t, **run.values)


def read_run(file) -> Run:
    with np.load(file) as data:
        return Run(data["t"], {name: data[name] for name in data.files if name != "t"})


def evaluate(case: dict) -> dict:
    """Errors and times of one case; a case that fails says why.  With a key `file` its quantities go there."""
    scene = load_scene(case["scene"])
    names = acc.quantities_of(scene)
    try:
        run = acc.compute(scene, names, case["repeats"])
    except SolveError as error:
        return {"reason": str(error)}
    if "file" in case:
        write_run(case["file"], run)
    reference = Reference(read_run(case["reference"]), acc.window_start(scene))
    result = {"reason": None, "wall": run.wall, "cpu": run.cpu, "steps": run.steps, "unknowns": run.unknowns}
    result |= {"iterations": run.iterations, "rejected": run.rejected, "failed": run.failed}
    for name in names:
        error = reference.error(run, name)
        result |= {f"error_{name}": error.rms, f"max_error_{name}": error.maximum}
    return result


# -- judgement ---------------------------------------------------------------------------------------------------------


def reference_errors(scene: Scene, check: dict, reference: dict) -> dict:
    """Own error of the reference in every quantity."""
    fine = Reference(read_run(reference["file"]), acc.window_start(scene))
    coarse = read_run(check["file"])
    changes = {name: fine.error(coarse, name) for name in acc.quantities_of(scene)}
    return {name: Error(acc.own_error([c.rms]), acc.own_error([c.maximum])) for name, c in changes.items()}


def mark(rows: list[dict], own: dict) -> list[dict]:
    """Add what every case proves: `bound_Q`, and `resolved_Q`, False where the reference is not fine enough; the same
    of the maximum."""
    for row in rows:
        for name, error in own.items():
            for which, limit in (("", error.rms), ("max_", error.maximum)):
                value = row.get(f"{which}error_{name}")
                row[f"{which}resolved_{name}"] = None if value is None else acc.resolved(value, limit)
                row[f"{which}bound_{name}"] = None if value is None else acc.bound(value, limit)
    return rows


def front(rows: list[dict], name: str) -> list[dict]:
    """Pareto front of wall time and error of a quantity, from the fastest on."""
    done = [row for row in rows if row.get(f"bound_{name}") is not None]
    return [done[i] for i in acc.pareto([(row["wall"], row[f"bound_{name}"]) for row in done])]


def describe(row: dict) -> str:
    """Settings of a row as one would say them."""
    stepping = Stepping(row["scheme"], row["step"], row["tolerance"])
    cells = f"{row['pair']}, {row['cells']} elements, " if row["cells"] else ""
    return f"{cells}{stepping}"


def sentence(rows: list[dict], name: str, accuracy: float) -> str:
    """What one would quote: the cheapest settings that meet the accuracy, and the scene's own beside them."""
    what = f"{percent(accuracy)} in {acc.QUANTITIES[name]}"
    good = [row for row in front(rows, name) if row[f"bound_{name}"] <= accuracy]
    said = f"{what}: {describe(good[0])}: {good[0]['wall']:.2g} s" if good else f"{what}: none of the cases"
    own = next((row for row in rows if row["own"]), None)
    if own is None:
        return said + "."
    if own["reason"]:
        return f"{said}; the scene's own setting ({describe(own)}) fails."
    less = "" if own[f"resolved_{name}"] else "less than "
    return f"{said}; the scene's own setting ({describe(own)}): {less}{percent(own[f'bound_{name}'])} in " + (
        f"{own['wall']:.2g} s."
    )


def notes(rows: list[dict], own: dict, fine: dict, ranks: int = 1) -> list[str]:
    """The answer in words."""
    names = ", ".join(f"{acc.QUANTITIES[name]} {percent(error.rms)}" for name, error in own.items())
    said = [f"Reference: {describe(fine)}; its own error (Richardson): {names}."]
    said += [sentence(rows, name, accuracy) for name in own for accuracy in ACCURACIES]
    for name in own:
        open_ = sum(row[f"resolved_{name}"] is False for row in rows)
        if open_:
            said.append(
                f"{acc.QUANTITIES[name].capitalize()}, not resolved (below 3 times the reference's own error, which "
                f"bound stands in place of theirs): {open_} of {len(rows)} cases."
            )
    said += [f"Failed: {describe(row)}: {row['reason']}" for row in rows if row["reason"]]
    said.append("Time: the stepping loop alone, median of the repeats; forms compiled and equilibrium found before.")
    if ranks > 1:
        said.append(f"{ranks} cases ran at once: their times share the machine, and are longer than alone.")
    return said


def front_rows(rows: list[dict], names) -> list[dict]:
    """Table of the Pareto fronts."""
    table = []
    for name in names:
        for row in front(rows, name):
            settings = {key: row[key] for key in ("pair", "cells", "scheme")}
            settings |= {"step": None if row["tolerance"] else row["step"], "tolerance": row["tolerance"]}
            errors = {"error": _shown(row, name, ""), "max_error": _shown(row, name, "max_")}
            line = {"quantity": acc.QUANTITIES[name], "settings": describe(row), **settings, "wall": row["wall"]}
            table.append(line | errors | {"resolved": row[f"resolved_{name}"]})
    return table


def _shown(row, name, which):
    error, bound = row[f"{which}error_{name}"], row[f"{which}bound_{name}"]
    return percent(bound) if error == bound else f"< {percent(bound)}"


COLUMNS = {"quantity": "quantity", "settings": "settings", "wall": "time [s]", "error": "error"}
COLUMNS |= {"max_error": "of maximum"}


# -- figure ------------------------------------------------------------------------------------------------------------

_PALETTE = [COLORS[name] for name in ("blue", "red", "green", "orange", "sky", "sand")]
_MARKERS = {"backward-euler": "s", "bdf2": "o", "generalized-alpha": "^"}


@matplotlib.rc_context(STYLE)
def draw(rows: list[dict], own: dict):
    """Error over time, a panel per quantity: colour = pair, marker = scheme, hollow = adaptive, line = Pareto front."""
    width = 2 if len(own) > 1 else 1
    height = -(-len(own) // width)
    figure = new_figure(PAGE if width > 1 else 0.7 * PAGE, 2.6 * height + 0.8)
    panels = figure.subplots(height, width, squeeze=False, sharex=True).ravel()
    colors = dict(zip(dict.fromkeys(row["pair"] for row in rows), itertools.cycle(_PALETTE), strict=False))
    for axes, (name, error) in zip(panels, own.items(), strict=False):
        _panel(axes, rows, name, error.rms, colors)
    for axes in panels[len(own) :]:
        axes.set_visible(False)
    for axes in panels[max(0, len(own) - width) : len(own)]:
        axes.set_xlabel("time of the stepping loop [s]")
        axes.tick_params(labelbottom=True)
    figure.legend(handles=_handles(rows, colors), loc="lower center", ncol=5)
    room = 0.45 / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, room, 1, 1 - room))  # room for the legend
    return figure


def _panel(axes, rows, name, reference_error, colors):
    axes.set(xscale="log", yscale="log", title=acc.QUANTITIES[name].capitalize(), ylabel="rms error / range [%]")
    for row in rows:
        if row.get(f"bound_{name}") is None:
            continue
        color, hollow = colors[row["pair"]], row["tolerance"] is not None
        style = {"mfc": "none" if hollow else color, "mec": color, "ms": 4, "mew": 0.8}
        style["alpha"] = 0.9 if row[f"resolved_{name}"] else 0.3
        axes.plot(row["wall"], 100 * row[f"bound_{name}"], _MARKERS[row["scheme"]], **style)
        if row["own"]:
            axes.plot(row["wall"], 100 * row[f"bound_{name}"], "*", ms=10, mfc="none", mec=COLORS["ink"], mew=0.9)
    best = front(rows, name)
    axes.plot([r["wall"] for r in best], [100 * r[f"bound_{name}"] for r in best], "-", color=COLORS["ink"], lw=0.8)
    bottom = axes.get_ylim()[0]
    axes.axhspan(bottom, max(bottom, 100 * acc.RESOLVED * reference_error), color="#eeeeee", lw=0, zorder=0)
    axes.set_ylim(bottom=bottom)
    acc.plain_ticks(axes)


def _handles(rows, colors):
    dots = {"ls": "none", "ms": 4}
    handles = [Line2D([], [], color=color, marker="D", label=pair, **dots) for pair, color in colors.items()]
    used = dict.fromkeys(row["scheme"] for row in rows)
    handles += [Line2D([], [], color=COLORS["ink"], marker=_MARKERS[s], label=acc.SCHEMES[s], **dots) for s in used]
    if any(row["tolerance"] is not None for row in rows):
        handles.append(Line2D([], [], color=COLORS["ink"], marker="o", mfc="none", label="hollow: adaptive", **dots))
    star = {"marker": "*", "mfc": "none", "ms": 9, "ls": "none"}
    handles.append(Line2D([], [], color=COLORS["ink"], label="the scene's own", **star))
    handles.append(Line2D([], [], color=COLORS["ink"], lw=0.8, label="Pareto front"))
    handles.append(Line2D([], [], color="#eeeeee", lw=5, label="not resolved"))
    return handles


# -- command -----------------------------------------------------------------------------------------------------------


def run(folder, scene: Scene, pairs=None, cells=None, schemes=None, steps=None, tolerances=TOLERANCES, repeats=3):
    """Evaluate, save and show the study; `scene` with the end that is wanted."""
    if scene.time is None:
        raise InputError("Missing section [time]: a run needs at least its keys end and step.")
    names = acc.quantities_of(scene)
    if not names:
        raise InputError("This scene has none of the quantities that the study compares.")
    steps = steps or default_steps(scene)
    room = spaces(scene, pairs, cells)
    stepping = steppings(schemes or tuple(acc.SCHEMES), steps, tolerances)
    check, fine = reference_cases(scene, room, steps, folder)
    evaluate_all(evaluate_reference, [check, fine], folder, structure)
    settings = itertools.product(room, stepping)
    found = evaluate_all(evaluate, cases(scene, settings, fine, repeats), folder, structure)
    if found is None:
        return
    own = reference_errors(scene, check, fine)
    rows = mark([{k: v for k, v in row.items() if k not in HIDDEN} for row in found], own)
    said = notes(rows, own, fine, MPI.COMM_WORLD.size)
    table = front_rows(rows, own)
    save(folder, "work-precision", rows, draw(rows, own), said)
    save(folder, "work-precision-front", table)
    show(f"Pareto front: error and time until t = {scene.time.end:g} s; {folder}", table, COLUMNS, said)


# -- options of the command line ---------------------------------------------------------------------------------------


def load(scene, t_end: float | None) -> Scene:
    """The scene until t_end, by default the ramp and four periods."""
    return acc.shortened(load_scene(scene), t_end, periods=4)


def parse_pairs(text: str | None) -> list[tuple[int, int]] | None:
    """`1-0,2-1` or `P1-P0,P2-P1` -> [(1, 0), (2, 1)]; raises InputError."""
    if text is None:
        return None
    try:
        pairs = [tuple(int(degree) for degree in pair.upper().replace("P", "").split("-")) for pair in text.split(",")]
        good = all(len(pair) == 2 and 0 <= pair[1] < pair[0] <= 8 for pair in pairs)
    except ValueError:
        good = False
    if not good:
        raise InputError(f"--pairs {text}: must be pairs with mu > nu, for example 1-0,2-1.")
    return pairs


def parse_numbers(option: str, text: str | None, kind=float) -> list | None:
    """Positive numbers with commas, or `none`; raises InputError."""
    if text is None:
        return None
    try:
        numbers = [kind(part) for part in text.split(",")] if text != "none" else []
    except ValueError:
        numbers = [-1]
    if not all(0 < number < float("inf") for number in numbers):
        raise InputError(f"{option} {text}: must be positive numbers with commas.")
    return numbers


def parse_schemes(text: str | None) -> list[str] | None:
    """Names with commas; raises InputError."""
    schemes = text.split(",") if text else None
    if schemes and not set(schemes) <= set(acc.SCHEMES):
        raise InputError(f"--schemes {text}: must be some of {', '.join(acc.SCHEMES)}, with commas.")
    return schemes
