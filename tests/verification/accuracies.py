"""Accuracies that were asked for: whether the outputs have them, and what the search for settings took.

    .venv/bin/python -m tests.verification.accuracies [--only NAME] [--out DIR]

Scenes as they are shipped, with `accuracy.target` of 1 % of the usual outputs (`run SCENE --accuracy 1%`).  The truth
is BDF2 with P2-P1, a quarter of the step and twice the elements that were found; how far it may be off is what changes
from the run of half of both.  Asked: each output within 1 % of the truth, or the run refused; seconds on the processor
of all runs at most 2.5 times those of the last, with the part of its steps.
"""

import time
import warnings
from pathlib import Path
from typing import Annotated

import typer

from dolfbuoy import simulate
from dolfbuoy.accuracy.bars import Bar
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.accuracy.target import USUAL, scale_of
from dolfbuoy.errors import NotAccurate
from dolfbuoy.parallel.cases import evaluate_all
from dolfbuoy.results.after_ramp import scene_of
from dolfbuoy.scene import load_scene
from dolfbuoy.scene.settings import Space, Stepping, fitting, space_of, with_settings
from dolfbuoy.studies.study import Table

from .script import kept, make, start

SCENES = ("driven", "three-legs", "short", "storm", "chain-on-bed")
ACCURACY, COST = 0.01, 2.5
#: Halvings of the step, and the factor of elements, of the truth and of the run that it is held against.
FINE = ((4, 2.0), (2, 1.0))


def _timed(scene, **accuracy):
    """(Record, why its accuracy was not reached, seconds on the processor)."""
    begin, refused = time.process_time(), None
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        try:
            record = simulate(scene, **accuracy)
        except NotAccurate as error:
            record, refused = error.record, str(error)
    return record, refused, time.process_time() - begin


def _bars(record) -> dict[Output, Bar]:
    names = zip(record.output.values.tolist(), record.output_of.values.tolist(), strict=True)
    outputs = [Output(*name.rsplit(".", 1), part) for name, part in names]
    return dict(
        zip(outputs, map(Bar, record.bar_value.values, record.bar.values, record.bar_verdict.values), strict=True)
    )


def evaluate(case: dict) -> dict:
    """Every output that was asked for of a scene, with its bar and error over its scale; seconds."""
    scene = load_scene(case["scene_of"])
    simulate(scene, time__end=2 * scene.time.step)  # what is loaded once is no part of the seconds
    record, refused, whole = _timed(scene, accuracy={"target": ACCURACY})
    found = load_scene(scene_of(record), accuracy=None)
    last = _timed(found, accuracy={"estimate": "time"})[2]
    space, step, truths = space_of(found), found.time.step, []
    for halvings, factor in FINE:
        finer = fitting(scene, Space(2, 1, round(factor * space.cells)))
        truth = with_settings(found, finer, Stepping("bdf2", step / halvings))
        truths.append(_bars(simulate(truth, accuracy={"estimate": "time"})))
    bars, rows = _bars(record), []
    for output in (output for output in bars if str(output) in USUAL):
        scale, (true, other) = scale_of(output, truths[0]), (one[output].value for one in truths)
        bar = bars[output]
        numbers = {"error": abs(bar.value - true) / scale, "own": abs(true - other) / scale, "bar": bar.bar / scale}
        rows.append({"output": str(output), "of": output.part, "verdict": bar.verdict} | numbers)
    settings = f"{space}{Stepping('bdf2', step)}"
    return {"rows": rows, "refused": refused, "settings": settings, "seconds": whole, "last": last}


COLUMNS = {"scene": "scene", "settings": "settings", "worst": "output", "error_percent": "error [%]"}
COLUMNS |= {"own_percent": "truth [%]", "bar_percent": "its bar [%]", "seconds": "CPU [s]", "cost": "over the last run"}
COLUMNS |= {"said": "said"}


def judged(name: str, found: dict) -> dict:
    """The line of a scene: its least accurate output."""
    worst = max(found["rows"], key=lambda row: row["error"])
    line = {"scene": name, "settings": found["settings"], "worst": f"{worst['output']} {worst['of']}".rstrip()}
    line |= {f"{key}_percent": 100 * worst[key] for key in ("error", "own", "bar")}
    line |= {"seconds": found["seconds"], "cost": found["seconds"] / found["last"]}
    return line | {"said": found["refused"] or "reached"}


def study(folder: Path, only: str) -> list[Table]:
    """The table, and whether what is asked holds."""
    names = [name for name in SCENES if only in name]
    found = evaluate_all(evaluate, [{"scene_of": name} for name in names], kept(folder, __file__))
    if found is None:
        return []
    lines = [judged(name, one) for name, one in zip(names, found, strict=True)]
    lies = [line["scene"] for line in lines if line["said"] == "reached" and line["error_percent"] > 100 * ACCURACY]
    dear = [line["scene"] for line in lines if line["cost"] > COST]
    notes = [f"Said to be reached, and off by more than {100 * ACCURACY:g} %: {', '.join(lies) or 'none'}."]
    notes.append(f"More than {COST:g} times the last run: {', '.join(dear) or 'none'}.")
    numbers = [row | {"scene": name} for name, one in zip(names, found, strict=True) for row in one["rows"]]
    table = Table("accuracies", lines, "Accuracies that were asked for", COLUMNS, notes, passed=not lies and not dear)
    return [table, Table("accuracies-numbers", numbers)]


def main(
    only: Annotated[str, typer.Option("--only", help="Scenes whose name has this in it.")] = "",
    out: Annotated[Path | None, typer.Option("--out", help="Folder of the results.")] = None,
) -> None:
    """Accuracies that were asked for, against truth."""
    make("accuracies", study, out, only=only)


if __name__ == "__main__":
    start(main)
