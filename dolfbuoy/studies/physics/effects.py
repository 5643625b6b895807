"""Importance and cost of each effect of a scene: left out of the scene, and added alone to the barest one.

The barest scene is cable, buoy and hydrostatics.  A change is the rms difference over the run after its ramp, relative
to the range (max - min) of the full run; the change of the maximum likewise.  Cost is measured in two ways:

- operations: distinct nodes of the residual's expression graph, after expansion of derivatives and tensor algebra,
  without constants, coefficients and arguments.  A subexpression used twice is computed and counted once.
  The number depends on the scene alone, not on machine, compiler or mesh.
- time per step: processor time, median over steps of both scenes taken in turn, so that both see the same load.

The masses of a buoy (point masses, inertia) are not an effect: leaving them out removes nothing from the form.
"""

import math
import time as clock
from collections.abc import Collection, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.corealg.traversal import unique_pre_traversal

from ...elsewhere import MPI
from ...errors import InputError, SolveError
from ...model import effects as model
from ...motion.simulation import Simulation
from ...parallel.cases import evaluate_all, with_file
from ...results import compare
from ...results import measured as acc
from ...results.style import COLORS, PAGE, PALETTE, Figure, legend_below, new_figure
from ...results.tables import groups
from ...scene import Scene, load_scene, settings
from ...scene.settings import everywhere
from .. import sea
from ..study import Row, Table

#: Number of steps of both scenes timed in turn.
TIMED = 200


def request(scene: Scene | str, t_end: float | None, threshold: str) -> Row:
    """The scene until t_end, by default the ramp and two periods, and the threshold as a number."""
    return {
        "scene": settings.shortened(load_scene(scene), t_end),
        "threshold": compare.parse_accuracy(threshold, "--threshold"),
    }


def effects_of(scene: Scene) -> list[str]:
    """Names of the effects of the scene that can be left out."""
    return [effect.name for effect in model.called_by(scene) if effect.removable]


def operations(form: ufl.Form) -> int:
    """Distinct operations of a form, once derivatives and tensor algebra are expanded: a number of the form alone."""
    expanded = expand_derivatives(apply_algebra_lowering(form))
    nodes = {node for integral in expanded.integrals() for node in unique_pre_traversal(integral.integrand())}
    return sum(not node._ufl_is_terminal_ for node in nodes)


def variant(scene: Scene, left_out: Collection[str] = (), only: Collection[str] | None = None) -> Scene:
    """The scene without `left_out`; with `only`, the barest scene plus these.  Raises InputError if that is invalid."""
    if only is not None:
        left_out = [name for name in effects_of(scene) if name not in only]
    effects = [e for e in model.EFFECTS if e.name in left_out]
    changes: Row = {e.key: e.neutral for e in effects} | {key: None for e in effects for key in e.brings}
    places: Row = {}
    for key, value in changes.items():
        if key.rpartition(".")[0] not in changes:  # it would bring back a section left out as a whole
            places |= everywhere(scene, key, value)
    return load_scene(scene, **places)


BASES: dict[str, Row] = {"full": {}, "barest": {"only": []}}


def cases(scene: Scene, bases: list[Row]) -> list[Row]:
    """Every effect left out, and every effect alone."""
    names, files = effects_of(scene), {case["base"]: case["file"] for case in bases}
    found = [_case(scene, files, "without", name, {"left_out": [name]}, "full") for name in names]
    return found + [_case(scene, files, "alone", name, {"only": [name]}, "barest") for name in names]


def _case(scene: Scene, files: dict[str, str], mode: str, name: str, choice: Row, base: str) -> Row:
    row = {"study": "effects", "mode": mode, "effect": name, "choice": choice, "base": base}
    return row | {"files": files, "scene": scene.to_dict()}


def evaluate(case: Row) -> Row:
    """Changes and costs against the base, or the reason why a scene is invalid.  A base's run is saved in `file`.

    "components": only the costs, with no more wave components than the crests need, against the full scene.
    """
    scene = load_scene(case["scene"])
    if "components" in case:
        return side_by_side(scene, load_scene(scene, waves__components=case["components"]))
    files, base = case["files"], case["base"]
    names = acc.quantities_of(scene)
    try:
        if files and not Path(files[base]).is_file():
            raise SolveError(f"the {base} scene, to compare with, does not run")
        changed = variant(scene, **case["choice"])
        run = acc.compute(changed, names)
        if "file" in case:
            run.save(case["file"])
            return {"reason": None}
        result: Row = {"reason": None} | side_by_side(variant(scene, **BASES[base]), changed)
    except (InputError, SolveError) as error:
        return {"reason": str(error)}
    full = compare.Reference(acc.Run.kept(files["full"]), acc.window_start(scene))  # its ranges are the unit
    reference = full if base == "full" else compare.Reference(acc.Run.kept(files[base]), full.start, full)
    for name in names:
        found = reference.error(run, name)
        result |= {f"change_{name}": found.rms, f"max_change_{name}": found.maximum}
    return result


def side_by_side(base: Scene, changed: Scene) -> Row:
    """Costs of both scenes, with steps taken in turn, so that disturbances of the machine affect both."""
    pair: list[Simulation] = []
    spent: tuple[list[float], list[float]] = ([], [])
    try:
        pair = [Simulation(base, MPI.COMM_SELF)]
        pair.append(Simulation(changed, MPI.COMM_SELF))
        runs = [simulation.run() for simulation in pair]
        for k in range(2 * TIMED):
            i = (k + k // 2) % 2  # 0 1, 1 0, 0 1, ...: neither is always the first
            begin = clock.process_time()
            if next(runs[i], None) is not None:
                spent[i].append(clock.process_time() - begin)
        first, second = (float(np.median(times)) for times in spent)
        costs = {"step_time": second, "base_step_time": first, "time_ratio": second / first}
        for prefix, simulation in zip(("", "base_"), reversed(pair), strict=True):
            system = simulation.problem.system
            costs[f"{prefix}unknowns"] = system.unknowns
            costs[f"{prefix}operations"] = sum(operations(form) for _, form in simulation.problem.residuals())
            costs[f"{prefix}forms"] = len(system.residuals) + len(system.jacobians)
        return costs
    finally:
        for simulation in pair:
            simulation.problem.destroy()


def largest(row: Row, names: Sequence[str], prefix: str = "change_") -> tuple[float, str]:
    """Largest change of a row and its quantity."""
    return max((row[prefix + name], name) for name in names)


def judge(rows: list[Row], names: Sequence[str], threshold: float) -> tuple[list[str], list[str]]:
    """Effects that the scene needs for the threshold, and superfluous ones; one that cannot be removed is needed."""
    removed = [row for row in rows if row["mode"] == "without"]
    needed = [row["effect"] for row in removed if row["reason"] or largest(row, names)[0] > threshold]
    return needed, [row["effect"] for row in removed if row["effect"] not in needed]


def notes(rows: list[Row], names: Sequence[str], threshold: float) -> list[str]:
    """Sentences on needed and superfluous effects."""
    removed = {row["effect"]: row for row in rows if row["mode"] == "without"}
    chosen, limit = judge(rows, names, threshold), compare.percent(threshold)

    def of(row: Row) -> str:
        if row["reason"]:
            return f"{row['effect']} (without it: {row['reason'].rstrip('.')})"
        change, name = largest(row, names)
        return f"{row['effect']} ({acc.QUANTITIES[name]} {compare.percent(change)})"

    needed, vain = (", ".join(of(removed[name]) for name in some) or "nothing" for some in chosen)
    found = [f"For {limit} this scene needs: {needed}.", f"For {limit} this scene pays in vain for: {vain}."]
    for name in chosen[1]:
        change, quantity = largest(removed[name], names, "max_change_")
        if change > threshold:
            moved = f"the maximum of {acc.QUANTITIES[quantity]} by {compare.percent(change)}"
            found.append(f"But {name} moves {moved}.")
    for row in (row for row in rows if row["mode"] == "together"):
        changed, verdict = row["reason"], ""
        if not changed:
            change, name = largest(row, names)
            verdict = "; " if change <= threshold else ", together they count; "
            changed = f"{acc.QUANTITIES[name]} changes by {compare.percent(change)}"
            verdict += f"a step takes {100 * row['time_ratio']:.0f} % of its time."
        found.append(f"Without all of these at once: {changed}{verdict}")
    return [
        *found,
        "Changes: rms after the ramp, relative to the range of the full run.  Operations: distinct nodes of the "
        "residual's expression graph.  Time per step: processor time, median over at most "
        f"{TIMED} steps of both in turn.",
    ]


COSTS = {key: key for key in ("effect", "unknowns", "operations", "forms")} | {"time": "ms per step"}
#: Mode -> words in the tables for its rows, and for the base of comparison.
MODES = {
    "without": ("it is left out", "without it, compared with the full scene"),
    "alone": ("it is added alone to the barest scene", "with it alone, compared with the barest scene"),
}


def questions(rows: list[Row], names: Sequence[str]) -> list[Table]:
    """A table for every question, rows in order of change; impossible removals come first."""
    by_mode, tables = groups(rows, "mode"), []
    heads = {"effect": "effect"} | {name: acc.QUANTITIES[name].replace(" ", "\n") for name in names}
    for mode, (when, compared) in MODES.items():
        ranked = sorted(by_mode[mode], key=lambda row: -math.inf if row["reason"] else -largest(row, names)[0])
        shown = ranked + (by_mode.get("together", []) if mode == "without" else [])
        why = [f"{row['effect']} ({mode}): {row['reason']}" for row in shown if row["reason"]]
        title = f"\nWhat changes when {when}: rms / maximum [%]"
        shown = [r | {"effect": "all in vain at once"} if r["mode"] == "together" else r for r in shown]
        lines = [_shown(row, names) for row in shown]
        costs = f"\nWhat a step costs {compared}"
        tables += [Table("", lines, title, heads, why), Table("", lines, costs, COSTS)]
    return tables


def _shown(row: Row, names: Sequence[str]) -> Row:
    """Changes and costs of a row as text."""
    line = {"effect": row["effect"]}
    if row["reason"]:
        return line | dict.fromkeys(names, "impossible")
    line |= {n: f"{_share(row[f'change_{n}'])} / {_share(row[f'max_change_{n}'])}" for n in names}
    line |= {key: f"{row[key] - row[f'base_{key}']:+d}" for key in ("unknowns", "operations", "forms")}
    milliseconds = 1e3 * (row["step_time"] - row["base_step_time"])
    return line | {"time": f"{milliseconds:+.2f} ({100 * row['time_ratio'] - 100:+.0f} %)"}


def _share(change: float) -> str:
    """A change in percent, to two digits, without powers of ten."""
    if 0 < change < 1e-4:
        return "<0.01"
    return f"{float(f'{100 * change:.2g}'):g}" if change < 100 else ">9999"


def draw(rows: list[Row], names: Sequence[str], threshold: float) -> Figure:
    """Left: change when an effect is left out.  Right: its fraction of the time per step."""
    without = [row for row in rows if row["mode"] == "without"]
    places = {effect: -k for k, effect in enumerate(dict.fromkeys(row["effect"] for row in without))}
    figure = new_figure(PAGE, 1.3 + 0.36 * len(places))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.7, 1))
    done = [row for row in without if not row["reason"]]
    values = [100 * row[f"change_{name}"] for row in done for name in names if row[f"change_{name}"] > 0]
    floor = max(min([*values, 100 * threshold]) / 2, 1e-4)
    height = 0.8 / len(names)
    for k, (name, color) in enumerate(zip(names, PALETTE, strict=False)):
        y = [places[row["effect"]] + 0.4 - (k + 0.5) * height for row in done]
        x = [max(100 * row[f"change_{name}"], floor) - floor for row in done]
        left.barh(y, x, height, left=floor, color=color, label=acc.QUANTITIES[name])
    for row in (row for row in without if row["reason"]):
        left.text(floor, places[row["effect"]], " impossible without", va="center", color=COLORS["ink"], fontsize=7)
    left.axvline(100 * threshold, color=COLORS["ink"], lw=0.8, ls="--")
    left.set(xscale="log", xlabel="rms change when left out, of the full run's range [%]")
    left.set_xlim(floor, None)
    for mode, sign, color, label in (
        ("without", -1, COLORS["green"], "time per step saved when left out"),
        ("alone", 1, COLORS["sand"], "time per step added to the barest scene"),
    ):
        chosen = [row for row in rows if row["mode"] == mode and not row["reason"]]
        x = [sign * 1e3 * (row["step_time"] - row["base_step_time"]) for row in chosen]
        right.barh([places[row["effect"]] - 0.2 * sign for row in chosen], x, 0.36, color=color, label=label)
    right.axvline(0, color=COLORS["ink"], lw=0.6)
    right.set_xlabel("processor time per step [ms]")
    for axes in (left, right):
        axes.grid(False, axis="y")
    left.set_yticks(list(places.values()), list(places))
    left.set_ylim(0.6 - len(places), 0.6)
    legend_below(figure, 0.5, 3)
    return figure


def compute(folder: Path, scene: Scene, threshold: float) -> list[Row] | None:
    """Each effect left out and alone, and all superfluous ones left out at once; None on all ranks but 0."""
    names = acc.quantities_of(scene)
    if not names or not effects_of(scene):
        raise InputError("SCENE: must have an effect that can be left out, and a quantity to compare.")
    bases = [with_file(_case(scene, {}, "base", base, how, base), folder, base) for base, how in BASES.items()]
    evaluate_all(evaluate, bases, folder, itemgetter("base"))
    rows = evaluate_all(evaluate, cases(scene, bases), folder)  # different forms, which `compat` compiles in turn
    vain = MPI.COMM_WORLD.bcast(judge(rows, names, threshold)[1] if rows is not None else None)
    if len(vain) > 1:
        files = {case["base"]: case["file"] for case in bases}
        together = _case(scene, files, "together", "all of these", {"left_out": vain}, "full")
        both = evaluate_all(evaluate, [together], folder)
        rows = None if rows is None or both is None else rows + both
    needed = sea.components_for(scene, threshold) if sea.has_seeds(scene) else 0
    case = {"study": "effects", "mode": "components", "components": needed, "scene": scene.to_dict()}
    waves: Any = scene.waves
    enough = needed and needed < waves.components
    fewer = evaluate_all(evaluate, [case] if enough else [], folder)
    return None if rows is None or fewer is None else rows + fewer


def study(folder: Path, scene: Scene, threshold: float = 0.01) -> list[Table]:
    """Tables: all rows in one file, shown question by question."""
    rows = compute(folder, scene, threshold)
    if rows is None:
        return []
    names, hidden = acc.quantities_of(scene), ("study", "scene", "files", "choice", "base")
    rows = [{k: v for k, v in row.items() if k not in hidden} for row in rows]
    end = scene.time.end if scene.time else 0.0
    messages, tables = notes(rows, names, threshold), questions(rows, names)
    if sea.has_seeds(scene):
        components = sea.of_components(scene, threshold)
        for row in (row for row in rows if row["mode"] == "components"):
            components += f"  With {row['components']} a step takes {100 * row['time_ratio']:.0f} % of its time."
        messages += [components, sea.of_statistics(scene)]
    tables[0].title = f"Effects of the scene until t = {end:g} s; {{folder}}\n{tables[0].title}"
    tables[-1].notes = messages
    return [Table("effects", rows, notes=messages, figure=draw(rows, names, threshold)), *tables]
