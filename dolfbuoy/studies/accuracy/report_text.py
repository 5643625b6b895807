"""Judgement and words of `report`: what the rows of its cases say, as tables, sentences and recommendations."""

import math
from pathlib import Path

from ...results import compare
from ...results import measured as acc
from ...results.compare import Curve, reach
from ...results.style import COLORS, PAGE, STYLE, matplotlib, new_figure, plain_ticks
from ...results.tables import unit_of
from ...scene import settings
from ..declaration import declared
from . import work_precision as wp

WORDS = declared(__file__)
#: Accuracies in the tables, and the quantity of most of them.
ACCURACIES = (0.01, 0.001)
QUANTITY = "tension_top"
BE, BDF2, ALPHA = settings.SCHEMES
#: Of the pendulum, as in the paper's Sect. 5.1 [s], and how far it swings [rad].
PERIOD, SWING = 5.0, 0.02


def own_elements(rows: list[dict]) -> list[dict]:
    """Cases on the scene's own elements that ran."""
    own = next(row for row in rows if row["own"])
    alike = [row for row in rows if (row["pair"], row["cells"]) == (own["pair"], own["cells"])]
    return [row for row in alike if not row["reason"]]


def schemes(rows: list[dict], period: float) -> list[dict]:
    """Per scheme at fixed steps: error in time at the paper's step, step and seconds for the ACCURACIES."""
    paper = next(row for row in rows if row["own"])
    table = []
    for scheme, name in settings.SCHEMES.items():
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
    scenes, found = facts["scenes"], default_scheme(facts)
    said = [_of_scheme(scene, accuracy) for scene in scenes for accuracy in ACCURACIES]
    if found:
        ratios = " and ".join(f"{ratio:.2g}" for ratio in found["ratios"])
        said.append(WORDS.say("default", **found | {"ratios": ratios}))
    else:
        said.append(WORDS.say("no_default"))
    for scene in scenes:
        said += [_of_pair(scene, accuracy) for accuracy in ACCURACIES]
        said += [_of_tolerance(scene, row) for row in scene["adaptive"]]
    return [sentence for sentence in said if sentence]


def _of_scheme(scene, accuracy):
    key, line = f"{accuracy:g}", cheapest(scene, accuracy)
    if line is None:
        return ""

    def say(word, other, **more):
        return WORDS.say(word, **other[key] | {"name": other["name"], "seconds": _seconds(other[key])} | more)

    others = ", ".join(say("other_scheme", other) for other in scene["schemes"] if other is not line and other[key])
    return say("scheme", line, scene=scene["name"], accuracy=compare.percent(accuracy), others=others)


def _of_pair(scene, accuracy):
    key = f"{accuracy:g}"
    able = [line for line in scene["pairs"] if line[key]]
    if not able:
        return ""

    def say(word, line, **more):
        return WORDS.say(word, pair=line["pair"], cells=line[key]["cells"], seconds=_seconds(line[key]), **more)

    best = min(able, key=lambda line: line[key]["seconds"])
    others = ", ".join(say("other_pair", line) for line in able if line is not best)
    beside = f"; {others}" if others else ""
    return say("pair", best, scene=scene["name"], accuracy=compare.percent(accuracy), beside=beside)


def _of_tolerance(scene, row):
    verdict = "dearer" if row["ratio"] > 1.05 else "cheaper" if row["ratio"] < 0.95 else "as dear"
    numbers = {"error": compare.percent(row["error"]), "seconds": _plain(row["seconds"])}
    numbers |= {"fixed": _plain(row["fixed_seconds"]), "tolerance": row["tolerance"]}
    return WORDS.say("tolerance", scene=scene["name"], verdict=verdict, **numbers)


_NOTES = {"": "", "extrapolated": " (extrapolated)", "at_most": " (the coarsest tried)"}


def _seconds(found):
    return f"{_plain(found['seconds'])} s{_NOTES[found['note']]}"


def _plain(number):
    """Two digits, without powers of ten."""
    return f"{float(f'{number:.2g}'):g}"


# -- report.md ---------------------------------------------------------------------------------------------------------


def markdown(facts: dict) -> str:
    """The report."""
    scenes, free = facts["scenes"], facts["pendulum"]
    end, step = free[0]["end"], free[0]["step"]
    parts = {
        "trial": WORDS.say("trial") + "\n\n" if facts["quick"] else "",
        "ends": " and ".join(WORDS.say("end", **scene) for scene in scenes),
        "static": _table(WORDS.columns["static"], map(_static, facts["static"])),
        "pendulum": _table(WORDS.columns["pendulum"], map(_pendulum, free)),
        "recommendations": "\n".join(f"- {sentence}" for sentence in facts["recommendations"]),
    }
    for name, part in (("scenes", _scene), ("pairs", _pairs), ("schemes", _schemes), ("extremes", _extremes)):
        parts[name] = "\n\n".join(part(scene) for scene in scenes)
    numbers = {"repeats": scenes[0]["repeats"], "machine": facts["machine"], "cells": facts["static"][0]["cells"]}
    damping = {"rule": 100 * math.exp(-2 * math.pi**2 * step * end / PERIOD**2), "period": PERIOD}
    template = Path(__file__).with_suffix(".txt").read_text(encoding="utf-8")
    return template.format(**parts, **numbers, **damping, end=end, step=step)


def _table(headings, rows):
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def _scene(scene):
    front = [row for row in scene["fronts"] if row["quantity"] == acc.QUANTITIES[QUANTITY]]
    cells = [(row["settings"], f"{_plain(row['wall'])} s", row["error"], row["max_error"]) for row in front]
    quoted = "\n".join(f"> {sentence}\n>" for sentence in scene["sentences"]).removesuffix("\n>")
    said = WORDS.say("scene", name=scene["name"], sentences=quoted, front=_table(WORDS.columns["front"], cells))
    return "\n\n".join([said, *(note for note in scene["notes"] if note.startswith(("Reference", "Failed")))])


def _static(row):
    orders = ("-" if row[key] is None else f"{row[key]:.2f}" for key in ("order_r_L2", "order_T_L2"))
    return row["pair"], f"{row['r_L2']:.1e}", next(orders), f"{row['T_L2']:.1e}", next(orders)


def _pairs(scene):
    names = [n for n in ("tension_top", "tension_anchor", "buoy_position") if f"bound_{n}" in _own(scene)]
    rows = [
        (row["pair"], row["cells"], row["unknowns"], f"{_plain(row['wall'])} s", *(_bound(row, name) for name in names))
        for row in scene["spaces"]
    ]
    table = _table(WORDS.columns["pairs"] + [acc.QUANTITIES[name] for name in names], rows)
    return WORDS.say("pairs", **scene, table=table)


def _own(scene):
    return next(row for row in scene["rows"] if row["own"])


def _bound(row, name):
    less = "" if row[f"resolved_{name}"] else "< "
    return less + compare.percent(row[f"bound_{name}"])


def _schemes(scene):
    keys, step = [f"{accuracy:g}" for accuracy in ACCURACIES], _own(scene)["step"]
    rows = [
        (
            line["name"],
            f"{line['order']:.2f}",
            compare.percent(line["at_paper_step"]),
            *(_reached(line[key]) for key in keys),
        )
        for line in scene["schemes"]
    ]
    headings = [f"`{scene['name']}`", "order", f"error at dt {step:g} s"]
    return _table(headings + [f"for {compare.percent(accuracy)}" for accuracy in ACCURACIES], rows)


def _reached(found):
    return f"{_seconds(found)}, dt {found['size']:.2g} s" if found else "not reached"


def _pendulum(row):
    return settings.SCHEMES[row["scheme"]], f"{100 * row['remaining']:.2f} %", f"{100 * row['theory']:.2f} %"


def _extremes(scene):
    rows = []
    for row in scene["extremes"]:
        unit, factor = unit_of([value for value in row.values() if isinstance(value, float)], row["unit"])
        for which in ("largest", "smallest"):
            a, b = row[f"{which}_own"], row[f"{which}_second"]
            change = f"{100 * (a - b) / row['range_second']:+.2f} %"
            rows.append((f"{which} {row['quantity']}", f"{factor * a:.4g} {unit}", f"{factor * b:.4g} {unit}", change))
    (end, step), table = scene["whole"], _table(WORDS.columns["extremes"], rows)
    return WORDS.say("extremes", name=scene["name"], end=end, step=step, own=_own(scene)["step"], table=table)


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
        plain_ticks(axes)
    panels[0].set_ylabel("error in time of the top tension [%]")
    panels[0].legend()
    return figure


def _line(axes, rows, scheme, fixed, look):
    error = f"scheme_error_{QUANTITY}"
    chosen = [r for r in own_elements(rows) if r["scheme"] == scheme and (not r["tolerance"]) == fixed and r.get(error)]
    if chosen:
        chosen.sort(key=lambda row: row["wall"])
        label = settings.SCHEMES[scheme] + ("" if fixed else ", adaptive")
        look |= {} if fixed else {"mfc": "white"}
        axes.plot([r["wall"] for r in chosen], [100 * r[error] for r in chosen], ms=4, label=label, **look)
