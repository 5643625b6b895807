"""Judgement and words of `report`: what the rows of its cases say, as tables, sentences and recommendations."""

import math
import platform
from pathlib import Path

import matplotlib
import numpy as np

from ..results.style import COLORS, PAGE, STYLE, new_figure
from . import accuracy as acc
from . import work_precision as wp
from .pilot import Curve

#: Accuracies in the tables, and the quantity of most of them.
ACCURACIES = (0.01, 0.001)
QUANTITY = "tension_top"
BE, BDF2, ALPHA = acc.SCHEMES


def machine() -> str:
    """The processor on which the times were taken."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


# -- what it takes to reach an accuracy --------------------------------------------------------------------------------


def reach(points, accuracy: float) -> dict | None:
    """Size and seconds at which a family has this error; points: (size, error, seconds), errors grow with the size.

    Powers between the measurements, and beyond the finest (`extrapolated`), where the work is inverse to the size; the
    coarsest as it is, if that is good enough (`at_most`).  None of fewer than two points, or where they have no order.
    """
    points = sorted(point for point in points if point[1])
    curve = Curve([point[:2] for point in points])
    if len(points) < 2 or curve.order < 0.3:
        return None
    sizes, seconds = np.log([p[0] for p in points]), np.log([p[2] for p in points])
    if accuracy >= curve.error[-1]:
        size, beyond = curve.x[-1], "at_most"
    elif accuracy < curve.error[0]:
        size, beyond = curve.x[0] * (accuracy / curve.error[0]) ** (1 / curve.order), "extrapolated"
    else:
        size, beyond = math.exp(np.interp(math.log(accuracy), np.log(curve.error), np.log(curve.x))), ""
    wall = math.exp(np.interp(math.log(size), sizes, seconds)) * max(1.0, curve.x[0] / size)
    return {"size": float(size), "seconds": wall, "note": beyond}


def own_elements(rows: list[dict]) -> list[dict]:
    """Cases on the scene's own elements that ran."""
    own = next(row for row in rows if row["own"])
    alike = [row for row in rows if (row["pair"], row["cells"]) == (own["pair"], own["cells"])]
    return [row for row in alike if not row["reason"]]


def schemes(rows: list[dict], period: float) -> list[dict]:
    """Per scheme at fixed steps: error in time at the paper's step, step and seconds for the ACCURACIES."""
    paper = next(row for row in rows if row["own"])
    table = []
    for scheme, name in acc.SCHEMES.items():
        chosen = [row for row in own_elements(rows) if row["scheme"] == scheme and not row["tolerance"]]
        points = [(row["step"], row[f"scheme_error_{QUANTITY}"], row["wall"]) for row in chosen]
        curve = Curve([point[:2] for point in points if point[1]])
        line = {"scheme": scheme, "name": name, "order": curve.order, "at_paper_step": curve(paper["step"])}
        for accuracy in ACCURACIES:
            found = reach(points, accuracy)
            line[f"{accuracy:g}"] = found and found | {"per_period": period / found["size"]}
        table.append(line)
    return table


def adaptive(rows: list[dict]) -> list[dict]:
    """Each adaptive case beside fixed steps of the same scheme and error in time."""
    table = []
    for row in own_elements(rows):
        error = row.get(f"scheme_error_{QUANTITY}")
        if not row["tolerance"] or not error:
            continue
        same = [r for r in own_elements(rows) if r["scheme"] == row["scheme"] and not r["tolerance"]]
        fixed = reach([(r["step"], r[f"scheme_error_{QUANTITY}"], r["wall"]) for r in same], error)
        if fixed and fixed["note"] != "at_most":
            line = {"tolerance": row["tolerance"], "error": error, "seconds": row["wall"]}
            table.append(line | {"fixed_seconds": fixed["seconds"], "ratio": row["wall"] / fixed["seconds"]})
    return table


def pairs(rows: list[dict], step: float) -> list[dict]:
    """Per element pair at one small step: elements and seconds for the ACCURACIES."""
    chosen, table = _at_step(rows, step), []
    for pair in dict.fromkeys(row["pair"] for row in chosen):
        points = [(1 / r["cells"], r[f"bound_{QUANTITY}"], r["wall"]) for r in chosen if r["pair"] == pair]
        line = {"pair": pair}
        for accuracy in ACCURACIES:
            found = reach(points, accuracy)
            line[f"{accuracy:g}"] = found and found | {"cells": math.ceil(1 / found["size"] - 1e-9)}
        table.append(line)
    return table


def _at_step(rows, step):
    """Cases of generalized-alpha at this step that ran."""
    return [r for r in rows if (r["scheme"], r["step"], r["tolerance"], r["reason"]) == (ALPHA, step, None, None)]


def judge(scene: dict) -> dict:
    """The facts of a scene with their tables."""
    rows = scene["rows"]
    return scene | {
        "schemes": schemes(rows, scene["period"]),
        "adaptive": adaptive(rows),
        "pairs": pairs(rows, scene["space_step"]),
        "spaces": sorted(_at_step(rows, scene["space_step"]), key=lambda r: (r["pair"], r["cells"])),
        "sentences": [wp.sentence(rows, QUANTITY, accuracy) for accuracy in ACCURACIES],
    }


def static_rows(rows: list[dict]) -> list[dict]:
    """Errors of Fig. 2's pairs on the finest mesh of at most 16 elements, with their orders."""
    cells = max(row["cells"] for row in rows if row["cells"] <= 16)
    keys = ("cells", "r_L2", "T_L2", "order_r_L2", "order_T_L2")
    return [
        {"pair": f"P{row['mu']}-P{row['nu']}"} | {key: row[key] for key in keys}
        for row in rows
        if row["cells"] == cells
    ]


def scheme_rows(facts: dict) -> list[dict]:
    """The tables of the schemes as flat rows."""
    flat = []
    for scene in facts["scenes"]:
        for line in scene["schemes"]:
            row = {"scene": scene["name"], "scheme": line["scheme"], "order": line["order"]}
            row["error_at_paper_step"] = line["at_paper_step"]
            for accuracy in ACCURACIES:
                found = line[f"{accuracy:g}"] or {}
                row |= {f"{key}_for_{accuracy:g}": found.get(key) for key in ("size", "seconds", "note")}
            flat.append(row)
    return flat


# -- what follows ------------------------------------------------------------------------------------------------------


def cheapest(scene: dict, accuracy: float) -> dict | None:
    """The scheme that reaches the accuracy in the least time at fixed steps."""
    able = [line for line in scene["schemes"] if line[f"{accuracy:g}"]]
    return min(able, key=lambda line: line[f"{accuracy:g}"]["seconds"], default=None)


def default_scheme(facts: dict) -> dict | None:
    """Another default than backward Euler: a scheme that is the cheapest in every scene for 1 %, by a factor of two at
    least, with a step per period that is enough in all of them.  None if there is none."""
    best = [cheapest(scene, ACCURACIES[0]) for scene in facts["scenes"]]
    names = {line["scheme"] for line in best if line}
    if None in best or len(names) != 1 or names == {BE}:
        return None
    key, ratios = f"{ACCURACIES[0]:g}", []
    for scene, line in zip(facts["scenes"], best, strict=True):
        euler = next(other for other in scene["schemes"] if other["scheme"] == BE)[key]
        ratios.append(euler["seconds"] / line[key]["seconds"] if euler else math.inf)
    if min(ratios) < 2:
        return None
    per_period = math.ceil(max(line[key]["per_period"] for line in best))
    return {"scheme": names.pop(), "name": best[0]["name"], "per_period": per_period, "ratios": ratios}


def recommendations(facts: dict) -> list[str]:
    """Plain sentences, each from the numbers above it."""
    said, found = [], default_scheme(facts)
    for scene in facts["scenes"]:
        said += [_of_scheme(scene, accuracy) for accuracy in ACCURACIES]
    if found:
        said.append(
            f'Unless it is the paper that is to be reproduced, set `scheme = "{found["scheme"]}"` with at least '
            f"{found['per_period']} steps per wave period: it is the cheapest way to 1 % in both scenes, and backward "
            f"Euler takes {' and '.join(f'{ratio:.2g}' for ratio in found['ratios'])} times as long."
        )
    else:
        said.append("No scheme is the cheapest in both scenes by a factor of two: the default stays as it is.")
    for scene in facts["scenes"]:
        said += [_of_pair(scene, accuracy) for accuracy in ACCURACIES]
        said += [_of_tolerance(scene, row) for row in scene["adaptive"]]
    return [sentence for sentence in said if sentence]


def _of_scheme(scene, accuracy):
    key, line = f"{accuracy:g}", cheapest(scene, accuracy)
    if line is None:
        return ""
    others = [
        f"{other['name']} {_seconds(other[key])} at dt {other[key]['size']:.2g} s"
        for other in scene["schemes"]
        if other is not line and other[key]
    ]
    return (
        f"`{scene['name']}`, {acc.percent(accuracy)} in time alone: {line['name']}, {_seconds(line[key])} at dt "
        f"{line[key]['size']:.2g} s ({line[key]['per_period']:.0f} steps per period); {', '.join(others)}."
    )


def _of_pair(scene, accuracy):
    key = f"{accuracy:g}"
    able = [line for line in scene["pairs"] if line[key]]
    if not able:
        return ""
    best = min(able, key=lambda line: line[key]["seconds"])
    others = [f"{line['pair']} {_cells(line[key])} in {_seconds(line[key])}" for line in able if line is not best]
    beside = f"; {', '.join(others)}" if others else ""
    return (
        f"`{scene['name']}`, elements for {acc.percent(accuracy)}: {best['pair']}, {_cells(best[key])}, "
        f"{_seconds(best[key])}{beside}."
    )


def _of_tolerance(scene, row):
    verdict = "dearer" if row["ratio"] > 1.05 else "cheaper" if row["ratio"] < 0.95 else "as dear"
    return (
        f"`{scene['name']}`: adaptive BDF2 with tolerance {row['tolerance']:g} has {acc.percent(row['error'])} in "
        f"{_plain(row['seconds'])} s, a fixed step of the same error takes {_plain(row['fixed_seconds'])} s: {verdict}."
    )


_NOTES = {"": "", "extrapolated": " (extrapolated)", "at_most": " (the coarsest tried)"}


def _seconds(found):
    return f"{_plain(found['seconds'])} s{_NOTES[found['note']]}"


def _plain(number):
    """Two digits, without powers of ten."""
    return f"{float(f'{number:.2g}'):g}"


def _cells(found):
    return f"{found['cells']} elements"


# -- report.md ---------------------------------------------------------------------------------------------------------


def _table(headings, rows):
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def markdown(facts: dict) -> str:
    """The report."""
    parts = ["# What accuracy costs"]
    if facts["quick"]:
        parts.append("**A quick trial of the report: its numbers are not worth quoting.**")
    parts.append(_introduction(facts))
    for scene in facts["scenes"]:
        parts += [f"## `{scene['name']}`", _of_scene(scene)]
    parts += ["## Element pairs", _static(facts), *(_pairs(scene) for scene in facts["scenes"])]
    parts += ["## Time schemes", _schemes(facts), _pendulum(facts)]
    parts += [_extremes(scene) for scene in facts["scenes"]]
    parts += ["## What follows", "\n".join(f"- {sentence}" for sentence in facts["recommendations"])]
    return "\n\n".join(part for part in parts if part) + "\n"


def _introduction(facts):
    ends = " and ".join(
        f"`{s['name']}` until t = {s['end']:g} s (errors count from {s['start']:g} s, after the ramp)"
        for s in facts["scenes"]
    )
    repeats = facts["scenes"][0]["repeats"]
    return (
        f"Runs are shortened: {ends}. Errors are rms differences from a finer reference over that window, relative to "
        f"the range of the quantity in it. Times are those of the stepping loop, median of {repeats}, one core "
        f"({facts['machine']}). Made by `dolfbuoy report`."
    )


def _of_scene(scene):
    name = scene["name"]
    picture = f"![error over time, {name}](work-precision-{name}.png)"
    front = [row for row in scene["fronts"] if row["quantity"] == acc.QUANTITIES[QUANTITY]]
    table = _table(
        ["Pareto front", "time", "top tension, rms", "its maximum"],
        [(row["settings"], f"{_plain(row['wall'])} s", row["error"], row["max_error"]) for row in front],
    )
    quoted = "\n".join(f"> {sentence}\n>" for sentence in scene["sentences"]).removesuffix("\n>")
    failed = [note for note in scene["notes"] if note.startswith(("Reference", "Failed"))]
    return "\n\n".join([quoted, picture, table, *failed])


def _static(facts):
    rows = facts["static"]
    return f"Static errors (Fig. 2, Neumann end, {rows[0]['cells']} elements), and their observed orders:\n\n" + _table(
        ["pair", "r, L2", "order", "T, L2", "order"],
        [
            (r["pair"], f"{r['r_L2']:.1e}", _order(r["order_r_L2"]), f"{r['T_L2']:.1e}", _order(r["order_T_L2"]))
            for r in rows
        ],
    )


def _order(order):
    return "-" if order is None else f"{order:.2f}"


def _pairs(scene):
    own = next(row for row in scene["rows"] if row["own"])
    names = [name for name in ("tension_top", "tension_anchor", "buoy_position") if f"bound_{name}" in own]
    head = f"`{scene['name']}`, generalized-alpha at dt {scene['space_step']:g} s:"
    table = _table(
        ["pair", "elements", "unknowns", "time", *(acc.QUANTITIES[name] for name in names)],
        [
            (r["pair"], r["cells"], r["unknowns"], f"{_plain(r['wall'])} s", *(_bound(r, name) for name in names))
            for r in scene["spaces"]
        ],
    )
    return head + "\n\n" + table


def _bound(row, name):
    less = "" if row[f"resolved_{name}"] else "< "
    return less + acc.percent(row[f"bound_{name}"])


def _schemes(facts):
    picture = "![error of the schemes over time](schemes.png)"
    step = next(row for row in facts["scenes"][0]["rows"] if row["own"])["step"]
    tables = []
    for scene in facts["scenes"]:
        rows = [
            (
                s["name"],
                f"{s['order']:.2f}",
                acc.percent(s["at_paper_step"]),
                *(_reached(s[f"{a:g}"]) for a in ACCURACIES),
            )
            for s in scene["schemes"]
        ]
        headings = [f"`{scene['name']}`", "order", f"error at dt {step:g} s"]
        tables.append(_table(headings + [f"for {acc.percent(a)}" for a in ACCURACIES], rows))
    return (
        "Error in time alone, of the top tension: the scene's own elements against the same ones at a much smaller "
        "step; seconds and steps by powers between the measured ones.\n\n" + "\n\n".join([*tables, picture])
    )


def _reached(found):
    return f"{_seconds(found)}, dt {found['size']:.2g} s" if found else "not reached"


def _pendulum(facts):
    rows = facts["pendulum"]
    end, step = rows[0]["end"], rows[0]["step"]
    rule = math.exp(-2 * math.pi**2 * step * end / 5.0**2)
    return (
        f"Backward Euler damps: of a free motion of period P it leaves about exp(-2 pi^2 dt t/P^2), here "
        f"{100 * rule:.1f} %. A rigid pendulum (one inextensible element) of 5 s after {end:g} s at dt {step:g} s:\n\n"
    ) + _table(
        ["scheme", "amplitude left, computed", "linear theory"],
        [(acc.SCHEMES[r["scheme"]], f"{100 * r['remaining']:.2f} %", f"{100 * r['theory']:.2f} %") for r in rows],
    )


def _extremes(scene):
    end, step = scene["whole"]
    own = next(row for row in scene["rows"] if row["own"])
    head = (
        f"`{scene['name']}` until {end:g} s on its own elements: backward Euler at dt {own['step']:g} s beside "
        f"generalized-alpha at dt {step:g} s, after the ramp; differences relative to the range."
    )
    rows = []
    for r in scene["extremes"]:
        factor = 1e-3 if r["unit"] == "N" else 1.0
        unit = "kN" if r["unit"] == "N" else r["unit"]
        for which in ("largest", "smallest"):
            a, b = r[f"{which}_own"], r[f"{which}_second"]
            change = 100 * (a - b) / r["range_second"]
            rows.append(
                (f"{which} {r['quantity']}", f"{factor * a:.4g} {unit}", f"{factor * b:.4g} {unit}", f"{change:+.2f} %")
            )
    return head + "\n\n" + _table(["", "backward Euler", "second order", "difference"], rows)


# -- figure ------------------------------------------------------------------------------------------------------------

_LOOKS = {BE: ("red", "s"), BDF2: ("blue", "o"), ALPHA: ("green", "^")}


@matplotlib.rc_context(STYLE)
def draw(scenes: list[dict]):
    """Error in time of the top tension over seconds, a panel per scene."""
    figure = new_figure(PAGE, 2.8)
    panels = figure.subplots(1, len(scenes), squeeze=False, sharey=True)[0]
    for axes, scene in zip(panels, scenes, strict=True):
        axes.set(xscale="log", yscale="log", title=scene["name"], xlabel="time of the stepping loop [s]")
        for scheme, (color, marker) in _LOOKS.items():
            for fixed, style in ((True, "-"), (False, "--")):
                _line(axes, scene["rows"], scheme, fixed, {"color": COLORS[color], "marker": marker, "ls": style})
        acc.plain_ticks(axes)
    panels[0].set_ylabel("error in time of the top tension [%]")
    panels[0].legend()
    return figure


def _line(axes, rows, scheme, fixed, look):
    error = f"scheme_error_{QUANTITY}"
    chosen = [r for r in own_elements(rows) if r["scheme"] == scheme and (not r["tolerance"]) == fixed and r.get(error)]
    if chosen:
        chosen.sort(key=lambda row: row["wall"])
        label = acc.SCHEMES[scheme] + ("" if fixed else ", adaptive")
        look |= {} if fixed else {"mfc": "white"}
        axes.plot([r["wall"] for r in chosen], [100 * r[error] for r in chosen], ms=4, label=label, **look)
