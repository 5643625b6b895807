"""All rows of the table against MoorDyn, timed in one run: seconds for the same accuracy, on one core.

    .venv/bin/pip install -e '.[benchmark]'
    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/times.py [--only NAME] [--repeats N] [--quick] [--out DIR]

MoorDyn runs at the settings that against_moordyn.py and moored_buoy.py found for it (times.toml).  dolfbuoy's errors
are measured anew, and its settings made stricter or coarser until they just do; Newton's tolerance is a hundredth of
the accuracy.  For rows of new_rows.py the settings of both programs are looked for.  Then the programs take turns, row
by row, as often as there are repeats.  The table shows medians and half the range of CPU seconds of the steps alone.
"""

import argparse
import math
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import cable_runs
import machine
import moordyn_runs
import moored_buoy
import new_rows
import numpy as np
from cable_runs import END, coarsened, error_of, extrapolated, kept_of, settings_text
from comparison import table, write_markdown
from moordyn_input import Numerics

from dolfbuoy.api import solve_static
from dolfbuoy.errors import SolveError
from dolfbuoy.results import measured as acc
from dolfbuoy.scene import load_scene, settings
from dolfbuoy.scene.settings import Space, Stepping
from dolfbuoy.studies.study import Table, save

ROWS = tomllib.loads((Path(__file__).parent / "times.toml").read_text())
#: Elements and steps to a period of the reference (P3-P2), doubled twice.
REFERENCE = {"cable": {"short": (6, 240), "long": (16, 240)}, "buoy": {"short": (6, 120), "long": (16, 120)}}
ACCURACIES = (0.01, 0.001)


@dataclass
class Row:
    """A case at an accuracy; theirs(), ours(): CPU seconds of END once; shown: the cells of the table."""

    theirs: object
    ours: object
    shown: dict
    seconds: dict = field(default_factory=lambda: {"moordyn": [], "dolfbuoy": []})

    def time(self):
        """Both programs once."""
        self.seconds["moordyn"].append(self.theirs())
        self.seconds["dolfbuoy"].append(self.ours())

    def cells(self):
        """For `comparison.table`."""
        found = dict(self.shown)
        for program, seconds in self.seconds.items():
            found[f"{program}_cpu"], found[f"{program}_spread"] = np.median(seconds), np.ptp(seconds) / 2
        return found | {"ratio": found["moordyn_cpu"] / found["dolfbuoy_cpu"]}


class Mooring:
    """A driven cable or a moored buoy that both programs know: dolfbuoy's reference and what its settings miss."""

    def __init__(self, kind, cable, stiffness=None):
        self.kind, self.cable, self.stiffness, self.known = kind, cable, stiffness, {}
        self.until = cable_runs.compared_until(self.scene(END)) if kind == "cable" else moored_buoy.UNTIL[cable]
        self.period = settings.period_of(self.scene(END))
        cells, steps = REFERENCE[kind][cable]
        ways = [([3, 2, cells * 2**k], ["generalized-alpha", self.period / (steps * 2**k)]) for k in range(3)]
        self.reference = extrapolated(*(self.run({"space": space, "stepping": how}) for space, how in ways))

    def scene(self, end):
        """As long as this."""
        if self.kind == "cable":
            return cable_runs.scene_of(self.cable, self.stiffness, end)
        return moored_buoy.scene_of(self.cable, end)

    def set(self, chosen, end):
        """The scene with these settings."""
        return settings.with_settings(self.scene(end), Space(*chosen["space"]), Stepping(*chosen["stepping"]))

    def run(self, chosen):
        """Last period of a run of dolfbuoy."""
        scene = self.set(chosen, self.until)
        try:
            return kept_of(acc.compute(scene, ["tension_top"]), scene)
        except SolveError:
            return {"curve": None}

    def error(self, chosen):
        """Of settings."""
        key = str(chosen)
        if key not in self.known:
            self.known[key] = error_of(self.run(chosen), self.reference)
        return self.known[key]

    def fitted(self, given, accuracy):
        """The cheapest of the given settings, made stricter and coarser until they just do, and their error."""
        found = []
        for mu, nu, cells, scheme, step in given:
            chosen = {"space": [mu, nu, cells], "stepping": [scheme, step, None, None, accuracy / 100]}
            for _ in range(8):
                if self.error(chosen) <= accuracy:
                    break
                cells, step = round(1.15 * cells + 0.5), 0.85 * step
                chosen = {"space": [mu, nu, cells], "stepping": [scheme, step, None, None, accuracy / 100]}
            found.append(coarsened(chosen, self.error(chosen), accuracy, self.error))
        return min(found, key=lambda pair: (pair[1] > accuracy, self.seconds(pair[0])))

    def seconds(self, chosen):
        """Of the whole run."""
        return acc.compute(self.set(chosen, END), ["tension_top"]).cpu

    def lumped(self, numerics, per_call, seconds):
        """A function that times MoorDyn for about so many seconds, scaled to END."""
        scene = self.scene(END)
        if self.kind == "buoy":
            scene = load_scene(scene, initial__buoy_position=solve_static(scene).buoy_position.values.tolist())
        length = moordyn_runs.PROBE * numerics.step
        end = min(END, length * seconds / max(_cpu(moordyn_runs.run(scene, numerics, length, per_call)), 1e-3))
        return lambda: _cpu(moordyn_runs.run(scene, numerics, end, per_call)) * END / end


def _cpu(run):
    """Seconds of a run; nan if it diverged."""
    return run.cpu if run else math.nan


def known_rows(options):
    """Of times.toml."""
    moorings, rows = {}, []
    for kind in ("cable", "buoy"):
        for given in ROWS[kind]:
            of = f", EA x {given['stiffness']:g}" if kind == "cable" else " cable"
            name = f"{'' if kind == 'cable' else 'buoy, '}{given['cable']}{of}"
            if options.only not in name:
                continue
            print(name, given["accuracy"], file=sys.stderr, flush=True)
            key = kind, given["cable"], given.get("stiffness")
            if key not in moorings:
                moorings[key] = Mooring(*key)
            rows.append(known_row(moorings[key], name, given, options))
    return rows


def known_row(mooring, name, given, options):
    """A Row of times.toml."""
    scheme, segments, step, error = given["moordyn"]
    per_call = cable_runs.PER_CALL if mooring.kind == "cable" else moored_buoy.PER_CALL
    theirs = mooring.lumped(Numerics(segments, scheme, step), per_call, options.repeat_seconds)
    chosen, own = mooring.fitted(given["dolfbuoy"], given["accuracy"])
    shown = {"case": name, "accuracy": given["accuracy"], "aim": given.get("aim")}
    shown |= {"moordyn_settings": f"{scheme}, {segments} segments, dt {step:.2g} s", "moordyn_error": error}
    shown |= {"dolfbuoy_settings": settings_text(chosen), "dolfbuoy_error": own}
    shown |= {"dolfbuoy_note": "misses the accuracy" if own > given["accuracy"] else ""}
    return Row(theirs, lambda: mooring.seconds(chosen), shown)


def fresh_rows(options):
    """Of new_rows.py, and what is to be said of their limits."""
    rows, notes = [], []
    for name, make in new_rows.PROBLEMS.items():
        if options.only not in name:
            continue
        print(name, file=sys.stderr, flush=True)
        problem = make()
        segments = problem.segments[: 3 if options.quick else None]
        theirs, limit = new_rows.cheapest_lumped(problem, ACCURACIES, segments)
        ours, own = new_rows.cheapest_own(problem, ACCURACIES)
        away = new_rows.apart(own, limit, problem)
        notes.append(f"{name}: each error is against the program's own limit; these are {100 * away:.2g} % apart.")
        for accuracy, their, our in zip(ACCURACIES, theirs, ours, strict=True):
            if their is None or our is None:
                notes.append(f"{name}, {100 * accuracy:g} %: {'MoorDyn' if their is None else 'dolfbuoy'} misses it.")
                continue
            rows.append(fresh_row(problem, name, accuracy, their, our, options))
    return rows, notes


def fresh_row(problem, name, accuracy, their, our, options):
    """A Row of new_rows.py."""
    (segments, given, error), (chosen, own) = their, our
    length = problem.scene.time.end
    end = min(length, length * options.repeat_seconds / max(new_rows.lumped_seconds(given, length / 5) * 5, 1e-3))
    shown = {"case": name, "accuracy": accuracy, "aim": None, "moordyn_error": error, "dolfbuoy_error": own}
    shown |= {"moordyn_settings": f"RK2, {segments} segments, dt {given.step:.2g} s"}
    cells, steps, newton = chosen
    stepping = Stepping(problem.scheme, problem.period / steps, newton=newton)
    shown |= {"dolfbuoy_settings": f"{Space(2, 1, cells)}{stepping}"}
    scene = new_rows.settled(problem, *chosen)
    return Row(
        lambda: new_rows.lumped_seconds(given, end) * END / end,
        lambda: acc.compute(scene, ["tension_top"]).cpu * END / length,
        shown,
    )


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/times"))
    parser.add_argument("--only", default="", help="rows whose name has this in it")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--repeat-seconds", type=float, default=4.0, help="of a repeat of MoorDyn, at most")
    parser.add_argument("--quick", action="store_true", help="a trial: few segments of the new rows")
    options = parser.parse_args()
    rows, notes = known_rows(options), []
    more, said = fresh_rows(options)
    rows, notes = rows + more, notes + said
    for _ in range(options.repeats):
        for row in rows:
            row.time()
    cells = [row.cells() for row in rows]
    notes += [machine.sentence(), f"Median and half the range of {options.repeats} runs, CPU seconds for {END:g} s."]
    table(cells, notes)
    save(options.out, Table("moordyn", cells, notes=notes))
    write_markdown(options.out / "moordyn.md", cells, notes)


if __name__ == "__main__":
    main()
