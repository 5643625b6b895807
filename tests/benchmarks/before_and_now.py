"""What a step and a start cost beside an earlier version, side by side: the table of the work on speed.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/before_and_now.py PYTHON [--equal-to PYTHON] [SCENE ...]

PYTHON: that of an earlier version's own virtual environment, in a worktree of its commit.  --equal-to: of a version
whose results `short` and `long` are compared with instead, where physics has changed since.
In each of five turns every version runs every scene as it is shipped, record and all, and starts anew: seconds on the
processor per step are medians of groups of 50 steps; those of a start, on the processor and by the clock, run from the
command to the end of the first step, with forms compiled and Python's bytecode kept, as where the program is
installed.  Shares of a step, and Newton's iterations over their floor, are of this version.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from around_newton import milliseconds
from machine import sentence

from dolfbuoy import load_scene

sys.path.insert(0, str(Path(__file__).parents[1]))

from verification.step_cost import measure

TURNS = 5
AIMS = {"driven": 3.0, "short": 3.5, "long": 2.0}
RUN = """
import sys, time
import numpy as np
from dolfbuoy import load_scene, simulate
times = []
record = simulate(load_scene(sys.argv[1]), progress=lambda *_: times.append(time.process_time()))
np.savez(sys.argv[2], **{name: values.values for name, values in record.data_vars.items()})
print(1e3 * float(np.median(np.diff(times[500::50]))) / 50)
"""
START = """
import os, sys, time
import rich.progress

def first(*_, **__):
    print(time.process_time(), time.monotonic() - float(begin), flush=True)
    os._exit(0)

rich.progress.Progress.update = first
begin = sys.argv.pop()
sys.argv = ["dolfbuoy", "run", sys.argv[1], "--out", sys.argv[2] + "-start", "--no-plot"]
try:
    from dolfbuoy.commands.entry import main
except ImportError:
    from dolfbuoy.cli import main
main()
"""


def said(python, script, *arguments, **environment) -> list[float]:
    """The numbers that a script prints last."""
    command = [python, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment)
    if done.returncode:
        sys.exit(f"{python}: {done.stderr.strip().splitlines()[-1]}")
    return [float(number) for number in done.stdout.splitlines()[-1].split()]


def start(python, name, folder, turn) -> list[float]:
    """Seconds of a start, on the processor and by the clock; the first of a folder makes the bytecode."""
    kept = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(folder / "bytecode")}
    return said(python, START, name, folder / f"{name}-{turn}", time.monotonic(), **kept)


def apart(one, other) -> float:
    """Largest difference of what two runs have recorded both, relative to its range."""
    worst = 0.0
    with np.load(one) as a, np.load(other) as b:
        for name in set(a.files) & set(b.files) - {"newton_iterations"}:
            if a[name].shape == b[name].shape and np.issubdtype(a[name].dtype, np.floating):
                size = np.ptp(b[name]) or np.abs(b[name]).max() or 1.0
                worst = max(worst, float(np.abs(a[name] - b[name]).max() / size))
    return worst


def median(values, digits=3) -> str:
    """With the spread."""
    low, middle, high = (f"{np.quantile(values, q):.{digits}g}" for q in (0, 0.5, 1))
    return f"{middle} ({low} to {high})"


def row(name, old, equal_to, folder) -> list[str]:
    """The cells of a scene."""
    versions = {"old": old, "new": sys.executable}
    steps, starts = ({key: [] for key in versions} for _ in range(2))
    for key, python in versions.items():
        start(python, name, folder, f"{key}-warm")
    for turn in range(TURNS):
        for key, python in versions.items():
            steps[key] += said(python, RUN, name, folder / f"{name}-{key}.npz")
            starts[key].append(start(python, name, folder, f"{key}-{turn}"))
    oracle = "old" if equal_to is None or name == "driven" else "equal"
    if oracle == "equal":
        said(equal_to, RUN, name, folder / f"{name}-equal.npz")
    difference = apart(folder / f"{name}-new.npz", folder / f"{name}-{oracle}.npz")
    shares = [100 * outside / whole for whole, _, outside in (milliseconds(name) for _ in range(TURNS))]
    floors = [[measure(load_scene(name), 300, keep)["ratio"] for _ in range(TURNS)] for keep in (False, True)]
    faster = np.divide(steps["old"], steps["new"])
    (old, by_clock), (new, now_by_clock) = (np.transpose(starts[key]) for key in versions)
    aim = f"{AIMS[name]:g}" if name in AIMS else ""
    cells = [f"`{name}`", median(steps["old"]), median(steps["new"]), median(faster), aim, f"{difference:.0e}"]
    cells += [median(old), median(new), median(new / old), median(now_by_clock / by_clock), median(shares, 2)]
    return cells + [median(ratios) for ratios in floors]


HEADINGS = ["", "ms a step, before", "now", "times faster", "aim", "difference"]
HEADINGS += ["s to the first step, before", "now", "ratio (aim 0.6)", "ratio by the clock", "% around Newton (aim 20)"]
HEADINGS += ["iteration over floor, new Jacobians (aim 1.5)", "kept (aim 2)"]


def main(old, equal_to, scenes):
    print(sentence(), flush=True)
    print("| " + " | ".join(HEADINGS) + " |\n|" + "---|" * len(HEADINGS))
    with TemporaryDirectory() as folder:
        for name in scenes:
            print("| " + " | ".join(row(name, old, equal_to, Path(folder))) + " |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", metavar="PYTHON")
    parser.add_argument("--equal-to", metavar="PYTHON")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=list(AIMS))
    arguments = parser.parse_args()
    main(arguments.old, arguments.equal_to, arguments.scenes)
