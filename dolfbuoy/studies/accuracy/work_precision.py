"""Error against wall time over pairs, cells, schemes, steps and Newton tolerances: the cost of accuracy.

The reference is a run of generalized-alpha with P3-P2, more unknowns and a quarter of the smallest step.  The
difference from the run at twice its step and half its cells gives its own error (Richardson, order 2); errors below
three times that are not resolved.  An accuracy counts as met only if the Newton tolerance is at most a hundredth of it.
If it is also required of the maximum, both errors must meet it, as that of a maximum alone may vanish by chance.
"""

import itertools
from collections.abc import Iterable, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from ...check.accuracy import seconds_of
from ...elsewhere import MPI
from ...errors import InputError, SolveError
from ...parallel.cases import evaluate_all, with_file
from ...results import compare
from ...results import measured as acc
from ...results.compare import Error, Reference, percent
from ...results.measured import Run
from ...results.style import COLORS, PAGE, PALETTE, Figure, Line2D, legend_below, new_figure, plain_ticks
from ...results.tables import rounded
from ...scene import Scene, load_scene, settings
from ...scene.sections import SCHEMES
from ...scene.settings import Space, Stepping
from ..study import Row, Table
from .linear_answer import linear_answer

ACCURACIES = (0.1, 0.01, 0.001)
#: Largest ratio of Newton tolerance to accuracy.
TIGHTER = 0.01
#: Keys of a case that are not shown.
HIDDEN = ("study", "scene", "reference", "file")

#: Name of the largest value of each quantity, in a sentence.
LARGEST = {name: f"largest {text}" for name, text in acc.QUANTITIES.items()}

#: Key that determines the compiled forms.
structure = itemgetter("pair")


def request(
    scene: Scene | str,
    t_end: float | None,
    pairs: str | None,
    cells: str | None,
    schemes: str | None,
    steps: str | None,
    tolerances: Any,
    newton: Any,
    repeats: int,
) -> Row:
    """The scene until t_end, by default the ramp and four periods, its largest step, and the settings."""
    whole, tolerances = load_scene(scene), settings.parse_numbers("--tolerances", tolerances)
    if tolerances and max(tolerances) >= 1:
        raise InputError(f"--tolerances {tolerances}: must be below 1.")
    newton = settings.parse_numbers("--newton", newton)
    if not newton or max(newton) >= 1:
        raise InputError(f"--newton {newton}: must be numbers below 1.")
    if t_end is not None and not t_end > settings.ramp_of(whole):
        raise InputError(f"--t-end {t_end:g}: must be after the ramp, which ends at {settings.ramp_of(whole):g} s.")
    if schemes and not set(schemes.split(",")) <= set(SCHEMES):
        raise InputError(f"--schemes {schemes}: must be some of {', '.join(SCHEMES)}, with commas.")
    return {
        "scene": settings.shortened(whole, t_end, periods=4),
        "largest": settings.largest_step(whole),
        "pairs": parse_pairs(pairs),
        "cells": settings.parse_numbers("--cells", cells, int),
        "schemes": schemes.split(",") if schemes else None,
        "steps": settings.parse_numbers("--steps", steps),
        "tolerances": tolerances,
        "newton": newton,
        "repeats": repeats,
    }


def default_steps(scene: Scene) -> list[float]:
    """Default steps: from a fiftieth of the period down to a 500th, or from the scene's step up."""
    if period := settings.period_of(scene):
        steps = [period / n for n in (500, 250, 100, 50)]
    else:
        steps = [settings.check_time(scene).step * n for n in (1, 2, 5, 10)]
    return [float(f"{step:.2g}") for step in steps]


def steppings(
    schemes: Sequence[str],
    steps: Sequence[float],
    tolerances: Sequence[float],
    largest: float | None = None,
    newton: Sequence[float] = (settings.NEWTON,),
) -> list[Stepping]:
    """Fixed steps of every scheme, and tolerances of second-order schemes, each with every Newton tolerance.

    largest: of adaptive steps.
    """
    fixed = [(scheme, step, None, None) for scheme in schemes for step in steps]
    second = [scheme for scheme in schemes if scheme != "backward-euler"]
    adaptive = [(scheme, min(steps), tolerance, largest) for scheme in second for tolerance in tolerances]
    return [Stepping(*size, newton=of_newton) for of_newton in newton for size in [*fixed, *adaptive]]


def parse_pairs(text: str | None) -> list[tuple[int, int]] | None:
    """`1-0,2-1` or `P1-P0,P2-P1` -> [(1, 0), (2, 1)]; raises InputError."""
    if text is None:
        return None
    try:
        split = [pair.upper().replace("P", "").split("-") for pair in text.split(",")]
        pairs = [(int(mu), int(nu)) for mu, nu in split]
        good = all(0 <= nu < mu <= 8 for mu, nu in pairs)
    except ValueError:
        good = False
    if not good:
        raise InputError(f"--pairs {text}: must be pairs with mu > nu, for example 1-0,2-1.")
    return pairs


def reference_cases(scene: Scene, spaces_: Sequence[Space], steps: Any, folder: Path) -> list[Row]:
    """Cases of the reference's check (half its cells, twice its step) and of the reference, each with its file."""
    space = coarse = Space()
    step, nodes = min(steps) / 4, max(space.mu * space.cells for space in spaces_)
    if nodes:
        space = settings.fitting(scene, Space(3, 2, 2 * -(-nodes // 4)))
        coarse = settings.fitting(scene, Space(space.mu, space.nu, space.cells // 2))
    return [
        with_file(case_of(scene, s, Stepping("generalized-alpha", h), "reference"), folder, name)
        for name, s, h in (("check", coarse, 2 * step), ("reference", space, step))
    ]


def cases(scene: Scene, chosen: Iterable[tuple[Space, Stepping]], reference: Row, repeats: int) -> list[Row]:
    """A case of each (Space, Stepping), without duplicates, with the scene's own settings first."""
    own = (settings.space_of(scene), settings.stepping_of(scene))
    more = {"repeats": repeats, "reference": reference["file"]}
    return [case_of(scene, *pair, "case") | more | {"own": pair == own} for pair in dict.fromkeys([own, *chosen])]


def case_of(scene: Scene, space: Space, stepping: Stepping, kind: str) -> Row:
    """Case: the scene with these settings, and their names."""
    what = {"pair": space.pair, "cells": space.cells, "scheme": stepping.scheme, "step": stepping.step}
    what |= {"tolerance": stepping.tolerance, "newton": stepping.newton}
    changed = settings.with_settings(scene, space, stepping).to_dict()
    return {"study": f"work-precision {kind}", **what, "scene": changed}


def work(case: Row) -> float:
    """Estimated time of a case relative to others."""
    return seconds_of(load_scene(case["scene"])) * int(case.get("repeats", 1))


def evaluate_reference(case: Row) -> Row:
    """Compute a fine run, with its quantities in `file`, and the linear response's estimate."""
    scene = load_scene(case["scene"])
    run = acc.compute(scene, acc.quantities_of(scene))
    run.save(case["file"])
    linear = [linear_answer(scene, run, name, acc.window_start(scene)) for name in run.values]
    return {"wall": run.wall, "unknowns": run.unknowns, "linear": [text for text in linear if text]}


def evaluate(case: Row) -> Row:
    """Errors and times of a case, or the reason of its failure.  With a key `file`, writes its quantities there."""
    scene = load_scene(case["scene"])
    names = acc.quantities_of(scene)
    try:
        run = acc.compute(scene, names, case["repeats"])
    except SolveError as error:
        return {"reason": str(error)}
    if "file" in case:
        run.save(case["file"])
    reference = Reference(Run.kept(case["reference"]), acc.window_start(scene))
    result: Row = {"reason": None, "wall": run.wall, "cpu": run.cpu, "steps": run.steps, "unknowns": run.unknowns}
    result |= {"iterations": run.iterations, "rejected": run.rejected, "failed": run.failed}
    for name in names:
        found = reference.error(run, name)
        result |= {f"error_{name}": found.rms, f"max_error_{name}": found.maximum}
    return result


def judged(found: list[Row], scene: Scene, check: Row, reference: Row) -> tuple[list[Row], dict[str, Error]]:
    """Marked rows of the cases without HIDDEN keys, and the reference's own errors."""
    fine, coarse = Reference(Run.kept(reference["file"]), acc.window_start(scene)), Run.kept(check["file"])
    changes = {name: fine.error(coarse, name) for name in acc.quantities_of(scene)}
    own = {name: Error(compare.own_error([c.rms]), compare.own_error([c.maximum])) for name, c in changes.items()}
    return mark([{k: v for k, v in row.items() if k not in HIDDEN} for row in found], own), own


def mark(rows: list[Row], own: Row) -> list[Row]:
    """Add `bound_Q`, and `resolved_Q` (False if the reference is not fine enough), to every case.
    The same for the maximum."""
    for row in rows:
        for name, error in own.items():
            for which, limit in (("", error.rms), ("max_", error.maximum)):
                value = row.get(f"{which}error_{name}")
                row[f"{which}resolved_{name}"] = None if value is None else compare.resolved(value, limit)
                row[f"{which}bound_{name}"] = None if value is None else compare.bound(value, limit)
    return rows


def bound_of(row: Row, name: str, largest: bool) -> float | None:
    """Upper bound of the rms error of a row, with `largest` also of the maximum's; None if it failed."""
    rms = row.get(f"bound_{name}")
    return max(rms, row[f"max_bound_{name}"]) if largest and rms is not None else rms


def front(rows: list[Row], name: str, largest: bool = False) -> list[Row]:
    """Pareto front of wall time and error of a quantity, fastest first; with `largest`, also of the maximum."""
    bounds = [(row, bound_of(row, name, largest)) for row in rows]
    done = [(row, bound) for row, bound in bounds if bound is not None]
    return [done[i][0] for i in compare.pareto([(row["wall"], bound) for row, bound in done])]


def cheapest(rows: list[Row], name: str, accuracy: float, largest: bool = False) -> Row | None:
    """The fastest row that meets an accuracy; None if there is none."""
    allowed = [row for row in rows if row["newton"] <= TIGHTER * accuracy * (1 + 1e-9)]
    found = ((row, bound_of(row, name, largest)) for row in front(allowed, name, largest))
    return next((row for row, bound in found if bound is not None and bound <= accuracy), None)


def describe(row: Row) -> str:
    """Settings of a row in words."""
    stepping = Stepping(row["scheme"], row["step"], row["tolerance"], newton=row["newton"])
    cells = f"{row['pair']}, {row['cells']} elements, " if row["cells"] else ""
    return f"{cells}{stepping}"


def sentence(rows: list[Row], name: str, accuracy: float) -> str:
    """Sentences to quote: the cheapest settings that meet the accuracy, compared with the scene's own."""
    what, good = f"{percent(accuracy)} in {acc.QUANTITIES[name]}", cheapest(rows, name, accuracy)
    text = f"{what}: {describe(good)}: {rounded(good['wall'])} s" if good else f"{what}: none of the cases"
    own = next((row for row in rows if row["own"]), None)
    if own is None:
        return text + "."
    text += f"; the scene's own setting ({describe(own)})"
    if own["reason"]:
        return text + " fails."
    less = "" if own[f"resolved_{name}"] else "less than "
    return f"{text}: {less}{percent(own[f'bound_{name}'])} in {rounded(own['wall'])} s."


def sentence_of_maximum(rows: list[Row], name: str, accuracy: float) -> str:
    """The same including the maximum: the cheapest settings, if they differ from those for the rms alone."""
    what = f"{percent(accuracy)} in {LARGEST[name]} too"
    rms, both = (cheapest(rows, name, accuracy, largest) for largest in (False, True))
    if both is None:
        return f"{what}: none of the cases."
    if both is rms:
        return f"{what}: the same settings, off by {shown(both, name, 'max_')}."
    text = f"{what}: the cheapest settings change, to {describe(both)}: {rounded(both['wall'])} s"
    return text + (f"; with those for the rms it is off by {shown(rms, name, 'max_')}." if rms else ".")


def notes(rows: list[Row], own: Row, fine: Row, ranks: int = 1) -> list[str]:
    """The answer in words."""
    errors = ", ".join(f"{acc.QUANTITIES[name]} {percent(error.rms)}" for name, error in own.items())
    messages = [f"Reference: {describe(fine)}; its own error (Richardson): {errors}."]
    for name, accuracy in itertools.product(own, ACCURACIES):
        messages += [sentence(rows, name, accuracy), sentence_of_maximum(rows, name, accuracy)]
    for name in own:
        count = sum(row[f"resolved_{name}"] is False for row in rows)
        if count:
            messages.append(
                f"{acc.QUANTITIES[name].capitalize()}, not resolved (below 3 times the reference's own error, which "
                f"bound stands in place of theirs): {count} of {len(rows)} cases."
            )
    messages += [f"Failed: {describe(row)}: {row['reason']}" for row in rows if row["reason"]]
    messages += [f"For screening, the {words}" for words in fine.get("linear", ())]
    messages.append(
        "Time: the stepping loop alone, median of the repeats; forms compiled and equilibrium found before."
    )
    shared = f"{ranks} cases ran at once: their times share the machine, and are longer than alone."
    return messages + ([shared] if ranks > 1 else [])


def front_rows(rows: list[Row], names: Sequence[str]) -> list[Row]:
    """Table of the Pareto fronts: for the rms of each quantity, and including its maximum."""
    lines, keys = [], ("pair", "cells", "scheme", "step", "tolerance", "newton", "wall")
    chosen = [(name, largest, row) for name in names for largest in (False, True) for row in front(rows, name, largest)]
    for name, largest, row in chosen:
        quantity = LARGEST[name] if largest else acc.QUANTITIES[name]
        line = {"quantity": quantity, "settings": describe(row)} | {key: row[key] for key in keys}
        line |= {"error": shown(row, name), "max_error": shown(row, name, "max_")}
        line |= {"step": None if row["tolerance"] else row["step"], "resolved": row[f"resolved_{name}"]}
        lines.append(line)
    return lines


def shown(row: Row, name: str, which: str = "") -> str:
    """The error of a row in percent, or an upper bound."""
    error, bound = row[f"{which}error_{name}"], row[f"{which}bound_{name}"]
    return percent(bound) if error == bound else f"< {percent(bound)}"


_MARKERS = dict(zip(SCHEMES, itertools.cycle("so^vDP")))


def draw(rows: list[Row], own: Row) -> Figure:
    """Error over time, a panel per quantity: colour = pair, marker = scheme, hollow = adaptive, line = Pareto front."""
    width = 2 if len(own) > 1 else 1
    height = -(-len(own) // width)
    figure = new_figure(PAGE if width > 1 else 0.7 * PAGE, 2.6 * height + 0.8)
    panels = figure.subplots(height, width, squeeze=False, sharex=True).ravel()
    colors = dict(zip(dict.fromkeys(row["pair"] for row in rows), itertools.cycle(PALETTE), strict=False))
    for axes, (name, error) in zip(panels, own.items(), strict=False):
        _panel(axes, rows, name, error.rms, colors)
    for axes in panels[len(own) :]:
        axes.set_visible(False)
    for axes in panels[max(0, len(own) - width) : len(own)]:
        axes.set_xlabel("time of the stepping loop [s]")
        axes.tick_params(labelbottom=True)
    ink, dots, none = {"color": COLORS["ink"]}, {"ls": "none", "ms": 4}, {"mfc": "none", "ls": "none"}
    styles = {pair: dots | {"color": color, "marker": "D"} for pair, color in colors.items()}
    styles |= {SCHEMES[row["scheme"]]: dots | ink | {"marker": _MARKERS[row["scheme"]]} for row in rows}
    if any(row["tolerance"] is not None for row in rows):
        styles["hollow: adaptive"] = dots | ink | {"marker": "o", "mfc": "none"}
    styles |= {"the scene's own": none | ink | {"marker": "*", "ms": 9}, "Pareto front": ink | {"lw": 0.8}}
    styles["not resolved"] = {"color": "#eeeeee", "lw": 5}
    legend_below(figure, 0.45, 5, [Line2D([], [], label=label, **style) for label, style in styles.items()])
    return figure


def _panel(axes: Any, rows: list[Row], name: str, reference_error: float, colors: dict[str, str]) -> None:
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
    axes.axhspan(bottom, max(bottom, 100 * compare.RESOLVED * reference_error), color="#eeeeee", lw=0, zorder=0)
    axes.set_ylim(bottom=bottom)
    plain_ticks(axes)


COLUMNS = {"quantity": "quantity", "settings": "settings", "wall": "time [s]"}
COLUMNS |= {"error": "error", "max_error": "of maximum"}


def study(
    folder: Path,
    scene: Scene,
    pairs: list[tuple[int, int]] | None = None,
    cells: list[int] | None = None,
    schemes: list[str] | None = None,
    steps: list[float] | None = None,
    tolerances: Sequence[float] = (),
    repeats: int = 3,
    **more: Any,
) -> list[Table]:
    """Tables of all cases and of the Pareto fronts; `scene` with the desired end.

    more: largest (of adaptive steps) and newton (tolerances).
    """
    end = settings.check_time(scene).end
    if not acc.quantities_of(scene):
        raise InputError("This scene has none of the quantities that the study compares.")
    steps = steps or default_steps(scene)
    room = settings.spaces(scene, pairs, cells)
    ways = steppings(schemes or tuple(SCHEMES), steps, tolerances, **more)
    check, fine = reference_cases(scene, room, steps, folder)
    references = evaluate_all(evaluate_reference, [check, fine], folder, structure, work)
    chosen = cases(scene, itertools.product(room, ways), fine, repeats)
    found = evaluate_all(evaluate, chosen, folder, structure, work)
    if found is None or references is None:
        return []
    rows, own = judged(found, scene, check, fine)
    messages = notes(rows, own, references[1], MPI.COMM_WORLD.size)
    title = f"Pareto front: error and time until t = {end:g} s; {{folder}}"
    return [
        Table("work-precision", rows, scene.title, notes=messages, figure=draw(rows, own)),
        Table("work-precision-front", front_rows(rows, list(own)), title, COLUMNS, messages),
    ]
