"""What error bars cost: the loops of a run, of the part of the steps and of the companions, timed in turns.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/bars.py [SCENE ...] [--turns 5]

Seconds on the processor from the first step to the last, with all that is recorded; the rest are shares of those of the
run: its companions, what the corrected trajectory adds, and both.  Each is the median of the turns, of shares of those
of the same turn.  `all` is how much more `simulate` takes with bars than without, set-up and files too: of a run that
takes a quarter of a second the second set-up, which does not grow with the run.
"""

import argparse
import math
import time
import warnings
from functools import partial

import numpy as np
from machine import sentence
from mpi4py import MPI

from dolfbuoy import load_scene, simulate
from dolfbuoy.accuracy.companion import companion_around, companion_of, events_of, followed
from dolfbuoy.motion.corrected import Corrected, can_follow
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.recorder import Unwritten
from dolfbuoy.scene.settings import Space, Stepping, period_of, ramp_of, with_settings


def bdf2(name, end, step, cells=None):
    """A shipped scene with this scheme; of one line as many elements of P1-P0 as are given."""
    scene = load_scene(name, time={"scheme": "bdf2", "step": step, "end": end})
    return scene if cells is None else with_settings(scene, Space(1, 0, cells), Stepping("bdf2", step))


SCENES = {
    "short, backward Euler": lambda: load_scene("short", time__end=50.0),
    "short": lambda: bdf2("short", 50.0, 0.05, 20),
    "driven": lambda: bdf2("driven", 50.0, 0.05),
    "three-legs": lambda: bdf2("three-legs", 40.0, 0.05),
    "chain-on-bed": lambda: load_scene("chain-on-bed"),
    "lazy-wave": lambda: bdf2("lazy-wave", 60.0, 0.1),
    "storm": lambda: bdf2("storm", 120.0, 0.05, 10),
    "long": lambda: bdf2("long", 60.0, 0.06),
    "short, 30 periods": lambda: bdf2("short", 160.0, 0.05, 20),
    "driven, 38 periods": lambda: bdf2("driven", 200.0, 0.05),
    "storm, 63 periods": lambda: bdf2("storm", 400.0, 0.05, 10),
}


class Whole(Unwritten):
    """With the shapes of the lines, which a companion has not."""

    shapes = True


def loop(scene, corrected=None, recorder=Whole, progress=lambda: None):
    """(Series, seconds from the first step to the last); progress: called after every step."""
    simulation = Simulation(scene, MPI.COMM_SELF)
    recorder = recorder(simulation, corrected=corrected)
    begin = time.process_time()
    for step, iterations in simulation.run():
        recorder.add(step, iterations)
        progress()
    seconds = time.process_time() - begin
    record = recorder.series()
    simulation.problem.destroy()
    return record, seconds


def whole(scene):
    """Seconds of `simulate`."""
    begin = time.process_time()
    simulate(scene)
    return time.process_time() - begin


def row(name, turns):
    """Cells of a scene: periods, seconds, shares."""
    plain = SCENES[name]()
    scene = load_scene(plain, accuracy={"estimate": "both"})
    record, _ = loop(plain)
    companions = [companion_of(scene), *(companion_around(scene, one) for one in events_of(scene, record))]
    follow = partial(Corrected, until=followed(scene)) if can_follow(scene) else None
    found = []
    for _ in range(turns):
        seconds = loop(plain)[1]
        coarse = sum(loop(one, recorder=Unwritten)[1] for one in companions) / seconds
        steps = loop(plain, follow)[1] / seconds - 1 if follow else 0.0
        found.append((seconds, coarse, steps, coarse + steps, whole(scene) / whole(plain) - 1))
    seconds, *shares = np.median(found, axis=0)
    period = period_of(plain)
    periods = (plain.time.end - ramp_of(plain)) / period if period else math.nan
    return [name, f"{periods:.3g}", f"{seconds:.3f}", *(f"{share:.2f}" for share in shares)]


HEADINGS = ["scene", "periods after the ramp", "loop [s]", "companions", "steps", "both", "all"]


def printed(text, scenes, headings, row):
    """Command line of a benchmark with these words: print a table with a row of each scene."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join(scenes))
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    print(f"{sentence()}\n\n| {' | '.join(headings)} |\n|---|{'---:|' * (len(headings) - 1)}")
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        for name in options.scenes or scenes:
            print(f"| {' | '.join(row(name, options.turns))} |", flush=True)


if __name__ == "__main__":
    printed(__doc__, SCENES, HEADINGS, row)
