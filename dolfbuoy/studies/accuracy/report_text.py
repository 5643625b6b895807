"""Evaluation and text of `report`: tables, sentences and recommendations from the rows of its cases."""

import math
from typing import Any

from ...results import measured as acc
from ...results.compare import Curve, percent, reach
from ...results.style import COLORS, PAGE, Figure, new_figure, plain_ticks
from ...results.tables import groups, unit_of
from ...results.tables import markdown as table_of
from ...scene.sections import SCHEMES
from ..study import Row
from . import work_precision as wp

#: Accuracies in the tables, and the quantity of most tables.
ACCURACIES = (0.01, 0.001)
QUANTITY = "tension_top"
ERROR_IN_TIME = f"scheme_error_{QUANTITY}"
BE, BDF2, ALPHA = SCHEMES
#: Period of the pendulum, as in Sect. 5.1 of the paper [s], and its amplitude [rad].
PERIOD, SWING = 5.0, 0.02


def _own(rows: list[Row]) -> Row:
    """The row of the scene's own settings."""
    return next(row for row in rows if row["own"])


def own_elements(rows: list[Row]) -> list[Row]:
    """Successful cases on the scene's own elements."""
    own = _own(rows)
    return [r for r in rows if (r["pair"], r["cells"]) == (own["pair"], own["cells"]) and not r["reason"]]


def _in_time(rows: list[Row], scheme: str) -> list[tuple[float, float, float]]:
    """(step, error in time, seconds) of a scheme at fixed steps on the scene's own elements."""
    chosen = [row for row in own_elements(rows) if row["scheme"] == scheme and not row["tolerance"]]
    return [(row["step"], row[ERROR_IN_TIME], row["wall"]) for row in chosen]


def _reached(points: Any) -> dict[str, Any]:
    """Size and seconds at which a family of cases reaches each of the ACCURACIES; see `compare.reach`."""
    return {f"{accuracy:g}": reach(points, accuracy) for accuracy in ACCURACIES}


def schemes(rows: list[Row], period: float) -> list[Row]:
    """Per scheme at fixed steps: error in time at the paper's step, step and seconds for the ACCURACIES."""
    table = []
    for scheme, name in SCHEMES.items():
        points = _in_time(rows, scheme)
        curve, needed = Curve([point[:2] for point in points if point[1]]), _reached(points)
        for found in filter(None, needed.values()):
            found["per_period"] = period / found["size"]
        line = {"scheme": scheme, "name": name, "order": curve.order, "at_paper_step": curve(_own(rows)["step"])}
        table.append(line | needed)
    return table


def adaptive(rows: list[Row]) -> list[Row]:
    """Each adaptive case next to fixed steps of the same scheme and error in time."""
    table = []
    for row in (row for row in own_elements(rows) if row["tolerance"] and row.get(ERROR_IN_TIME)):
        error = row[ERROR_IN_TIME]
        fixed = reach(_in_time(rows, row["scheme"]), error)
        if fixed and fixed["note"] != "at_most":
            line = {"tolerance": row["tolerance"], "error": error, "seconds": row["wall"]}
            table.append(line | {"fixed_seconds": fixed["seconds"], "ratio": row["wall"] / fixed["seconds"]})
    return table


def pairs(rows: list[Row]) -> list[Row]:
    """Per element pair, from cases at one small step: elements and seconds for the ACCURACIES."""
    table = []
    for pair, chosen in groups(rows, "pair").items():
        needed = _reached([(1 / r["cells"], r[f"bound_{QUANTITY}"], r["wall"]) for r in chosen])
        for found in filter(None, needed.values()):
            found["cells"] = math.ceil(1 / found["size"] - 1e-9)
        table.append({"pair": pair} | needed)
    return table


def judge(scene: Row) -> Row:
    """Evaluate a scene: its facts and tables."""
    rows, small = scene["rows"], (ALPHA, scene["space_step"], None, None)
    spaces = [r for r in rows if (r["scheme"], r["step"], r["tolerance"], r["reason"]) == small]
    return scene | {
        "schemes": schemes(rows, scene["period"]),
        "adaptive": adaptive(rows),
        "pairs": pairs(spaces),
        "spaces": sorted(spaces, key=lambda r: (r["pair"], r["cells"])),
        "sentences": [
            make(rows, QUANTITY, accuracy) for accuracy in ACCURACIES for make in (wp.sentence, wp.sentence_of_maximum)
        ],
    }


def static_rows(rows: list[Row]) -> list[Row]:
    """Errors of Fig. 2's pairs on the finest mesh of at most 16 elements, with their orders."""
    cells = max(row["cells"] for row in rows if row["cells"] <= 16)
    keys = ("cells", "r_L2", "T_L2", "order_r_L2", "order_T_L2")
    finest = [row for row in rows if row["cells"] == cells]
    return [{"pair": f"P{row['mu']}-P{row['nu']}"} | {key: row[key] for key in keys} for row in finest]


def scheme_rows(facts: Row) -> list[Row]:
    """The tables of the schemes as flat rows."""
    flat = []
    for name, line in ((scene["name"], line) for scene in facts["scenes"] for line in scene["schemes"]):
        row = {"scene": name, "scheme": line["scheme"], "order": line["order"]}
        row["error_at_paper_step"] = line["at_paper_step"]
        for accuracy in ACCURACIES:
            found = line[f"{accuracy:g}"] or {}
            row |= {f"{key}_for_{accuracy:g}": found.get(key) for key in ("size", "seconds", "note")}
        flat.append(row)
    return flat


def _cheapest(lines: list[Row], key: str) -> tuple[Row | None, list[Row]]:
    """The fastest scheme or pair that reaches an accuracy, and the others that reach it."""
    able = [line for line in lines if line[key]]
    best = min(able, key=lambda line: line[key]["seconds"], default=None)
    return best, [line for line in able if line is not best]


def default_scheme(facts: Row) -> Row | None:
    """A better default than backward Euler: a scheme at least twice as fast for 1 % in every scene, or None.
    With a step per period that is small enough in all scenes."""
    key, ratios = f"{ACCURACIES[0]:g}", []
    found = [_cheapest(scene["schemes"], key)[0] for scene in facts["scenes"]]
    best = [line for line in found if line]
    names = {line["scheme"] for line in best}
    if len(best) < len(found) or len(names) != 1 or names == {BE}:
        return None
    for scene, line in zip(facts["scenes"], best, strict=True):
        euler = next(other for other in scene["schemes"] if other["scheme"] == BE)[key]
        ratios.append(euler["seconds"] / line[key]["seconds"] if euler else math.inf)
    if min(ratios) < 2:
        return None
    per_period = math.ceil(max(line[key]["per_period"] for line in best))
    return {"scheme": names.pop(), "name": best[0]["name"], "per_period": per_period, "ratios": ratios}


def recommendations(facts: Row) -> list[str]:
    """Plain sentences, each from the numbers above it."""
    found = default_scheme(facts)
    messages = [_of_all(scene, "schemes", accuracy) for scene in facts["scenes"] for accuracy in ACCURACIES]
    if found:
        ratios = " and ".join(f"{ratio:.2g}" for ratio in found["ratios"])
        messages.append(
            f'Unless it is the paper that is to be reproduced, set `scheme = "{found["scheme"]}"` with at least '
            f"{found['per_period']} steps per wave period: it is the cheapest way to 1 % in both scenes, and backward "
            f"Euler takes {ratios} times as long."
        )
    else:
        messages.append("No scheme is the cheapest in both scenes by a factor of two: the default stays as it is.")
    for scene in facts["scenes"]:
        messages += [_of_all(scene, "pairs", accuracy) for accuracy in ACCURACIES]
        for row in scene["adaptive"]:
            verdict = "dearer" if row["ratio"] > 1.05 else "cheaper" if row["ratio"] < 0.95 else "as dear"
            messages.append(
                f"`{scene['name']}`: adaptive BDF2 with tolerance {row['tolerance']:g} has {percent(row['error'])} in "
                f"{_plain(row['seconds'])} s, a fixed step of the same error takes {_plain(row['fixed_seconds'])} s: "
                f"{verdict}."
            )
    return [sentence for sentence in messages if sentence]


def _of_all(scene: Row, kind: str, accuracy: float) -> str:
    """The cheapest scheme or pair of elements for an accuracy, and the others."""
    key = f"{accuracy:g}"
    best, others = _cheapest(scene[kind], key)
    if best is None:
        return ""
    lines = [(line, line[key], _seconds(line[key])) for line in (best, *others)]
    if kind == "schemes":
        what = f"{percent(accuracy)} in time alone"
        parts = [f"{line['name']} {seconds} at dt {found['size']:.2g} s" for line, found, seconds in lines]
        parts[0] += f" ({best[key]['per_period']:.0f} steps per period)"
    else:
        what = f"elements for {percent(accuracy)}"
        parts = [f"{line['pair']} {found['cells']} elements in {seconds}" for line, found, seconds in lines]
    return f"`{scene['name']}`, {what}: {parts[0]}{'; ' if others else ''}{', '.join(parts[1:])}."


_NOTES = {"": "", "extrapolated": " (extrapolated)", "at_most": " (the coarsest tried)"}


def _seconds(found: Any) -> str:
    return f"{_plain(found['seconds'])} s{_NOTES[found['note']]}"


def _plain(number: float) -> str:
    """A number to two digits, without powers of ten."""
    return f"{float(f'{number:.2g}'):g}"


FRONT = {"settings": "Pareto front", "wall": "time [s]", "error": "top tension, rms", "max_error": "its maximum"}
STATIC = {"pair": "pair", "r_L2": "r, L2", "order_r_L2": "order", "T_L2": "T, L2", "order_T_L2": "order"}
PENDULUM = {"scheme": "scheme", "remaining": "amplitude left, computed", "theory": "linear theory"}
EXTREMES = {"what": "", "own": "backward Euler", "second": "second order", "difference": "difference"}


def markdown(facts: Row) -> str:
    """The report as Markdown."""
    scenes, free, cells = facts["scenes"], facts["pendulum"], facts["static"][0]["cells"]
    end, step = free[0]["end"], free[0]["step"]
    ends = " and ".join(
        f"`{s['name']}` until t = {s['end']:g} s (errors count from {s['start']:g} s, after the ramp)" for s in scenes
    )
    parts = [
        "# What accuracy costs",
        *(["**A quick trial of the report: its numbers are not worth quoting.**"] if facts["quick"] else []),
        f"Runs are shortened: {ends}. Errors are differences from a finer reference over that window, rms and of the "
        "maximum, relative to the range of the quantity in it. Times are those of the stepping loop, median of "
        f"{scenes[0]['repeats']}, one core ({facts['machine']}). Made by `dolfbuoy study accuracy`.",
        *map(_scene, scenes),
        "## Element pairs",
        f"Static errors (Fig. 2, Neumann end, {cells} elements), and their observed orders:",
        table_of("", facts["static"], STATIC),
        *map(_pairs, scenes),
        "## Time schemes",
        "Error in time alone, of the top tension: the scene's own elements against the same ones at a much smaller "
        "step; seconds and steps by powers between the measured ones.",
        *map(_schemes, scenes),
        "![error of the schemes over time](schemes.png)",
        "Backward Euler damps: of a free motion of period P it leaves about exp(-2 pi^2 dt t/P^2), here "
        f"{100 * math.exp(-2 * math.pi**2 * step * end / PERIOD**2):.1f} %. A rigid pendulum (one inextensible "
        f"element) of {PERIOD:g} s after {end:g} s at dt {step:g} s:",
        table_of("", [row | {"scheme": SCHEMES[row["scheme"]]} for row in free], PENDULUM),
        *map(_extremes, scenes),
        "## What follows",
        "\n".join(f"- {sentence}" for sentence in facts["recommendations"]),
    ]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _scene(scene: Row) -> str:
    quoted = "\n>\n".join(f"> {sentence}" for sentence in scene["sentences"])
    picture = f"![error over time, {scene['name']}](work-precision-{scene['name']}.png)"
    rms, largest = (
        [row for row in scene["fronts"] if row["quantity"] == names[QUANTITY]] for names in (acc.QUANTITIES, wp.LARGEST)
    )
    reference = [note for note in scene["notes"] if note.startswith(("Reference", "Failed"))]
    of_both = FRONT | {"settings": "Pareto front of rms and maximum"}
    tables = table_of("", rms, FRONT), table_of("", largest, of_both, reference)
    return "\n\n".join([f"## `{scene['name']}`", quoted, picture, *tables])


def _pairs(scene: Row) -> str:
    names = [n for n in ("tension_top", "tension_anchor", "buoy_position") if f"bound_{n}" in _own(scene["rows"])]
    rows = [row | {name: wp.shown(row, name) for name in names} for row in scene["spaces"]]
    columns = {"pair": "pair", "cells": "elements", "unknowns": "unknowns", "wall": "time [s]"}
    table = table_of("", rows, columns | {name: acc.QUANTITIES[name] for name in names})
    return f"`{scene['name']}`, generalized-alpha at dt {scene['space_step']:g} s:\n\n{table}"


def _schemes(scene: Row) -> str:
    keys, step = [f"{accuracy:g}" for accuracy in ACCURACIES], _own(scene["rows"])["step"]
    rows = [line | {"at_paper_step": percent(line["at_paper_step"])} for line in scene["schemes"]]
    for row, key in ((row, key) for row in rows for key in keys):
        row[key] = f"{_seconds(row[key])}, dt {row[key]['size']:.2g} s" if row[key] else "not reached"
    columns = {"name": f"`{scene['name']}`", "order": "order", "at_paper_step": f"error at dt {step:g} s"}
    return table_of("", rows, columns | {key: f"for {percent(float(key))}" for key in keys})


def _extremes(scene: Row) -> str:
    rows, (end, step) = [], scene["whole"]
    for row in scene["extremes"]:
        unit, factor = unit_of([value for value in row.values() if isinstance(value, float)], row["unit"])
        for which in ("largest", "smallest"):
            own, second = row[f"{which}_own"], row[f"{which}_second"]
            shown = {"own": f"{factor * own:.4g} {unit}", "second": f"{factor * second:.4g} {unit}"}
            shown["difference"] = f"{100 * (own - second) / row['range_second']:+.2f} %"
            rows.append({"what": f"{which} {row['quantity']}"} | shown)
    steps = f"backward Euler at dt {_own(scene['rows'])['step']:g} s and generalized-alpha at dt {step:g} s"
    where = f"`{scene['name']}` until {end:g} s on its own elements: {steps}"
    return f"{where}, after the ramp; differences relative to the range.\n\n{table_of('', rows, EXTREMES)}"


_LOOKS = {BE: ("red", "s"), BDF2: ("blue", "o"), ALPHA: ("green", "^")}


def draw(scenes: list[Row]) -> Figure:
    """Error in time of the top tension over seconds, a panel per scene."""
    figure = new_figure(PAGE, 2.8)
    panels = figure.subplots(1, len(scenes), squeeze=False, sharey=True)[0]
    for axes, scene in zip(panels, scenes, strict=True):
        axes.set(xscale="log", yscale="log", title=scene["name"], xlabel="time of the stepping loop [s]")
        for scheme, (color, marker) in _LOOKS.items():
            for fixed, style in ((True, "-"), (False, "--")):
                alike = [r for r in own_elements(scene["rows"]) if r["scheme"] == scheme and r.get(ERROR_IN_TIME)]
                chosen = sorted((r for r in alike if (not r["tolerance"]) == fixed), key=lambda row: row["wall"])
                look = {"color": COLORS[color], "marker": marker, "ls": style} | ({} if fixed else {"mfc": "white"})
                look["label"] = SCHEMES[scheme] + ("" if fixed else ", adaptive")
                if chosen:
                    error = [100 * r[ERROR_IN_TIME] for r in chosen]
                    axes.plot([r["wall"] for r in chosen], error, ms=4, **look)
        plain_ticks(axes)
    panels[0].set_ylabel("error in time of the top tension [%]")
    panels[0].legend()
    return figure
