"""Worth and cost of each effect of a scene: left out of the scene, and added alone to the barest one.

The barest scene is cable, buoy and hydrostatics.  A change is the rms difference over the run, without the ramp at its
start, relative to the range (max - min) of the full run; the change of the maximum likewise.  Cost is counted twice:

- operations: distinct nodes of the residual's expression graph, after derivatives and tensor algebra are expanded and
  without constants, coefficients and arguments.  A subexpression that is used twice is computed and counted once.
  The number depends on the scene alone, not on machine, compiler or mesh.
- time per step: processor time, median over steps of both scenes taken in turn, so that both see the same machine.

What a buoy is made of (point masses, inertia) is no effect: nothing in the form would vanish with it.
"""

import math
import time as clock
from operator import itemgetter
from pathlib import Path

import numpy as np

from ...elsewhere import MPI
from ...errors import InputError, SolveError
from ...model import effects as model
from ...motion.simulation import Simulation
from ...parallel.cases import evaluate_all, with_file
from ...results import compare
from ...results import measured as acc
from ...results.style import COLORS, PAGE, PALETTE, legend_below, new_figure
from ...results.tables import groups
from ...scene import Scene, load_scene, settings
from ...scene.settings import everywhere
from ...solver import floor
from .. import sea
from ..study import Table

#: What decides which forms of a base are compiled.
structure = itemgetter("base")

#: Steps of both scenes that are timed in turn.
TIMED = 200


def request(scene, t_end: float | None, threshold: str) -> dict:
    """The scene until t_end, by default the ramp and two periods, and the threshold as a number."""
    return {
        "scene": settings.shortened(load_scene(scene), t_end),
        "threshold": compare.parse_accuracy(threshold, "--threshold"),
    }


def effects_of(scene: Scene) -> list[str]:
    """Names of the effects that the scene calls for and that can be left out."""
    return [effect.name for effect in model.called_by(scene) if effect.removable]


def variant(scene: Scene, left_out=(), only=None) -> Scene:
    """The scene less `left_out`; with `only` the barest scene and these.  Raises InputError if that is no scene."""
    if only is not None:
        left_out = [name for name in effects_of(scene) if name not in only]
    changes, places = {e.key: e.neutral for e in model.EFFECTS if e.name in left_out}, {}
    for key, value in changes.items():
        if key.rpartition(".")[0] not in changes:  # it would bring back the section that is left out as a whole
            places |= everywhere(scene, key, value)
    return load_scene(scene, **places)


BASES = {"full": {}, "barest": {"only": []}}


def base_cases(scene: Scene, folder) -> list[dict]:
    """The full scene and the barest one, each with the file of its run."""
    return [with_file(_case(scene, {}, "base", base, choice, base), folder, base) for base, choice in BASES.items()]


def cases(scene: Scene, bases: list[dict]) -> list[dict]:
    """Every effect left out, and every effect alone."""
    names, files = effects_of(scene), {case["base"]: case["file"] for case in bases}
    found = [_case(scene, files, "without", name, {"left_out": [name]}, "full") for name in names]
    return found + [_case(scene, files, "alone", name, {"only": [name]}, "barest") for name in names]


def _case(scene, files, mode, name, choice, base):
    row = {"study": "effects", "mode": mode, "effect": name, "choice": choice, "base": base}
    return row | {"files": files, "scene": scene.to_dict()}


def evaluate(case: dict) -> dict:
    """Changes against the base, and costs beside it; a scene that cannot be says why.  The run of a base goes to
    `file`."""
    scene, files, base = load_scene(case["scene"]), case["files"], case["base"]
    names = acc.quantities_of(scene)
    try:
        if files and not Path(files[base]).is_file():
            raise SolveError(f"the {base} scene, to compare with, does not run")
        changed = variant(scene, **case["choice"])
        run = acc.compute(changed, names)
        if "file" in case:
            run.save(case["file"])
            return {"reason": None}
        result = {"reason": None} | side_by_side(variant(scene, **BASES[base]), changed)
    except (InputError, SolveError) as error:
        return {"reason": str(error)}
    reference = _reference(files, base, acc.window_start(scene))
    for name in names:
        error = reference.error(run, name)
        result |= {f"change_{name}": error.rms, f"max_change_{name}": error.maximum}
    return result


def _reference(files, base, start):
    """The run of a base, whose changes count relative to the ranges of the full one."""
    full = compare.Reference(acc.Run.kept(files["full"]), start)
    return full if base == "full" else compare.Reference(acc.Run.kept(files[base]), start, full)


def side_by_side(base: Scene, changed: Scene) -> dict:
    """Costs of both scenes; their steps are taken in turn, so that they share whatever disturbs the machine."""
    pair = []
    try:
        pair = [Simulation(base, MPI.COMM_SELF)]
        pair.append(Simulation(changed, MPI.COMM_SELF))
        runs, spent = [simulation.run() for simulation in pair], ([], [])
        for k in range(2 * TIMED):
            i = (k + k // 2) % 2  # 0 1, 1 0, 0 1, ...: neither is always the first
            begin = clock.process_time()
            if next(runs[i], None) is not None:
                spent[i].append(clock.process_time() - begin)
        return _costs(pair, spent)
    finally:
        for simulation in pair:
            simulation.problem.destroy()


def _costs(pair, spent):
    base, changed = pair
    first, second = (float(np.median(times)) for times in spent)
    costs = {"step_time": second, "base_step_time": first, "time_ratio": second / first}
    for prefix, simulation in (("", changed), ("base_", base)):
        system = simulation.problem.system
        costs[f"{prefix}unknowns"] = system.unknowns
        costs[f"{prefix}operations"] = sum(floor.operations(form) for _, form in simulation.problem.residuals())
        costs[f"{prefix}forms"] = len(system.residuals) + len(system.jacobians)
    return costs


def evaluate_components(case: dict) -> dict:
    """Costs with no more components of the sea than its crests need, beside the full scene."""
    scene = load_scene(case["scene"])
    return side_by_side(scene, load_scene(scene, waves__components=case["components"]))


def _components(folder, scene, threshold):
    """A row for an irregular sea: what its components cost, if fewer are enough; None on all ranks but 0."""
    needed = sea.components_for(scene, threshold) if sea.has_seeds(scene) else 0
    case = {"study": "effects", "mode": "components", "components": needed, "scene": scene.to_dict()}
    return evaluate_all(evaluate_components, [case] if needed and needed < scene.waves.components else [], folder)


def _of_the_sea(rows, scene, threshold):
    """Sentences on what its statistics take."""
    if not sea.has_seeds(scene):
        return []
    said = [sea.of_components(scene, threshold), sea.of_statistics(scene)]
    for row in (row for row in rows if row["mode"] == "components"):
        said[0] += f"  With {row['components']} a step takes {100 * row['time_ratio']:.0f} % of its time."
    return said


def largest(row: dict, names, prefix="change_") -> tuple[float, str]:
    """Largest change of a row and its quantity."""
    return max((row[prefix + name], name) for name in names)


def judge(rows: list[dict], names, threshold: float) -> tuple[list[str], list[str]]:
    """Effects that the scene needs for the threshold, and those in vain; an impossible removal is a need."""
    removed = [row for row in rows if row["mode"] == "without"]
    needed = [row["effect"] for row in removed if row["reason"] or largest(row, names)[0] > threshold]
    return needed, [row["effect"] for row in removed if row["effect"] not in needed]


def _said_of(row, names):
    if row["reason"]:
        return f"{row['effect']} (without it: {row['reason'].rstrip('.')})"
    change, name = largest(row, names)
    return f"{row['effect']} ({acc.QUANTITIES[name]} {compare.percent(change)})"


def notes(rows: list[dict], names, threshold: float) -> list[str]:
    """Sentences on what the scene needs and what it pays for in vain."""
    removed = {row["effect"]: row for row in rows if row["mode"] == "without"}
    chosen, limit = judge(rows, names, threshold), compare.percent(threshold)
    needed, vain = (", ".join(_said_of(removed[name], names) for name in some) or "nothing" for some in chosen)
    said = [f"For {limit} this scene needs: {needed}.", f"For {limit} this scene pays in vain for: {vain}."]
    for name in chosen[1]:
        change, quantity = largest(removed[name], names, "max_change_")
        if change > threshold:
            moved = f"the maximum of {acc.QUANTITIES[quantity]} by {compare.percent(change)}"
            said.append(f"But {name} moves {moved}.")
    said += [_together(row, names, threshold) for row in rows if row["mode"] == "together"]
    return [
        *said,
        "Changes: rms after the ramp, relative to the range of the full run.  Operations: distinct nodes of the "
        "residual's expression graph.  Time per step: processor time, median over at most "
        f"{TIMED} steps of both in turn.",
    ]


def _together(row, names, threshold):
    if row["reason"]:
        return f"Without all of these at once: {row['reason']}"
    change, name = largest(row, names)
    changed = f"{acc.QUANTITIES[name]} changes by {compare.percent(change)}"
    verdict = "" if change <= threshold else ", together they count"
    return (
        f"Without all of these at once: {changed}{verdict}; a step takes {100 * row['time_ratio']:.0f} % of its time."
    )


COSTS = {key: key for key in ("effect", "unknowns", "operations", "forms")} | {"time": "ms per step"}
#: Mode -> how the tables call its rows, and what they stand beside.
MODES = {
    "without": ("it is left out", "without it, beside the full scene"),
    "alone": ("it is added alone to the barest scene", "with it alone, beside the barest scene"),
}


def questions(rows: list[dict], names) -> list[Table]:
    """A table for every question, its rows by the size of what they change; what is impossible comes first."""
    by_mode, tables = groups(rows, "mode"), []
    heads = {"effect": "effect"} | {name: acc.QUANTITIES[name].replace(" ", "\n") for name in names}
    for mode, (when, beside) in MODES.items():
        ranked = sorted(by_mode[mode], key=lambda row: -math.inf if row["reason"] else -largest(row, names)[0])
        shown = ranked + (by_mode.get("together", []) if mode == "without" else [])
        why = [f"{row['effect']} ({mode}): {row['reason']}" for row in shown if row["reason"]]
        title = f"\nWhat changes when {when}: rms / maximum [%]"
        tables += [
            Table("", [_changes(row, names) for row in shown], title, heads, why),
            Table("", [_costs_beside(row) for row in shown], f"\nWhat a step costs {beside}", COSTS),
        ]
    return tables


def _label(row):
    return "all in vain at once" if row["mode"] == "together" else row["effect"]


def _changes(row, names):
    if row["reason"]:
        return {"effect": _label(row)} | dict.fromkeys(names, "impossible")
    return {"effect": _label(row)} | {
        name: f"{_share(row[f'change_{name}'])} / {_share(row[f'max_change_{name}'])}" for name in names
    }


def _share(change):
    """In percent, with two digits and without powers of ten."""
    if 0 < change < 1e-4:
        return "<0.01"
    return f"{float(f'{100 * change:.2g}'):g}" if change < 100 else ">9999"


def _costs_beside(row):
    line = {"effect": _label(row)}
    if not row["reason"]:
        line |= {key: f"{row[key] - row[f'base_{key}']:+d}" for key in ("unknowns", "operations", "forms")}
        milliseconds = 1e3 * (row["step_time"] - row["base_step_time"])
        line["time"] = f"{milliseconds:+.2f} ({100 * row['time_ratio'] - 100:+.0f} %)"
    return line


def draw(rows: list[dict], names, threshold: float):
    """Left: what leaving an effect out changes.  Right: the share of a step's time that it takes."""
    effects = list(dict.fromkeys(row["effect"] for row in rows if row["mode"] == "without"))
    figure = new_figure(PAGE, 1.3 + 0.36 * len(effects))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.7, 1))
    places = {effect: -k for k, effect in enumerate(effects)}
    _draw_changes(left, rows, names, places, threshold)
    _draw_times(right, rows, places)
    left.set_yticks(list(places.values()), list(places))
    left.set_ylim(0.6 - len(effects), 0.6)
    legend_below(figure, 0.5, 3)
    return figure


def _draw_changes(axes, rows, names, places, threshold):
    done = [row for row in rows if row["mode"] == "without" and not row["reason"]]
    values = [100 * row[f"change_{name}"] for row in done for name in names if row[f"change_{name}"] > 0]
    floor = max(min([*values, 100 * threshold]) / 2, 1e-4)
    height = 0.8 / len(names)
    for k, (name, color) in enumerate(zip(names, PALETTE, strict=False)):
        y = [places[row["effect"]] + 0.4 - (k + 0.5) * height for row in done]
        x = [max(100 * row[f"change_{name}"], floor) - floor for row in done]
        axes.barh(y, x, height, left=floor, color=color, label=acc.QUANTITIES[name])
    for row in rows:
        if row["mode"] == "without" and row["reason"]:
            axes.text(floor, places[row["effect"]], " impossible without", va="center", color=COLORS["ink"], fontsize=7)
    axes.axvline(100 * threshold, color=COLORS["ink"], lw=0.8, ls="--")
    axes.set(xscale="log", xlabel="rms change when left out, of the full run's range [%]")
    axes.set_xlim(floor, None)
    axes.grid(False, axis="y")


def _draw_times(axes, rows, places):
    for mode, shift, color, label in (
        ("without", 0.2, COLORS["green"], "time per step saved when left out"),
        ("alone", -0.2, COLORS["sand"], "time per step added to the barest scene"),
    ):
        chosen = [row for row in rows if row["mode"] == mode and not row["reason"]]
        sign = -1 if mode == "without" else 1
        x = [sign * 1e3 * (row["step_time"] - row["base_step_time"]) for row in chosen]
        axes.barh([places[row["effect"]] + shift for row in chosen], x, 0.36, color=color, label=label)
    axes.axvline(0, color=COLORS["ink"], lw=0.6)
    axes.set_xlabel("processor time per step [ms]")
    axes.grid(False, axis="y")


def compute(folder: Path, scene: Scene, threshold: float) -> list[dict] | None:
    """Every effect left out and alone, and all at once that are in vain; None on all ranks but 0."""
    names = acc.quantities_of(scene)
    if not names or not effects_of(scene):
        raise InputError("SCENE: must have an effect that can be left out, and a quantity to compare.")
    bases = base_cases(scene, folder)
    evaluate_all(evaluate, bases, folder, structure)
    rows = evaluate_all(evaluate, cases(scene, bases), folder)  # forms of their own: `compat` compiles them in turn
    vain = MPI.COMM_WORLD.bcast(judge(rows, names, threshold)[1] if rows is not None else None)
    if len(vain) > 1:
        files = {case["base"]: case["file"] for case in bases}
        together = _case(scene, files, "together", "all of these", {"left_out": vain}, "full")
        both = evaluate_all(evaluate, [together], folder)
        rows = rows + both if rows is not None else None
    fewer = _components(folder, scene, threshold)
    return rows + fewer if rows is not None else None


def study(folder: Path, scene: Scene, threshold: float = 0.01) -> list[Table]:
    """All rows in one file; shown question by question."""
    rows = compute(folder, scene, threshold)
    if rows is None:
        return []
    names, hidden = acc.quantities_of(scene), ("study", "scene", "files", "choice", "base")
    rows = [{k: v for k, v in row.items() if k not in hidden} for row in rows]
    said, tables = notes(rows, names, threshold) + _of_the_sea(rows, scene, threshold), questions(rows, names)
    tables[0].title = f"Effects of the scene until t = {scene.time.end:g} s; {{folder}}\n{tables[0].title}"
    tables[-1].notes = said
    return [Table("effects", rows, notes=said, figure=draw(rows, names, threshold)), *tables]
