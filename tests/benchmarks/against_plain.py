"""The fast path against the plain one (tests/support/plain.py), side by side: the paper's short cable, backward Euler.

    .venv/bin/python tests/benchmarks/against_plain.py [--scene short] [--steps 400]

The two take turns, ten steps each, so that whatever else the machine does falls on both.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from mpi4py import MPI

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from machine import sentence
from plain import simulation

from dolfbuoy import load_scene
from dolfbuoy.motion.simulation import Simulation

TURN = 10


def main(name, steps):
    scene = load_scene(name)
    runs = {"fast": Simulation(scene, MPI.COMM_SELF), "plain": simulation(scene, estimated=True)}
    marches = {key: made.run() for key, made in runs.items()}
    seconds = {key: [] for key in runs}
    for turn in range(steps // TURN + 1):
        for key, march in marches.items():
            begin = time.process_time()
            for _ in range(TURN):
                next(march)
            if turn:  # the first one warms up
                seconds[key].append((time.process_time() - begin) / TURN)
    print(sentence())
    typical = {key: float(np.median(values)) for key, values in seconds.items()}
    for key, values in seconds.items():
        print(
            f"{key:6s} {1e3 * typical[key]:8.2f} ms per step (quartiles {1e3 * np.quantile(values, 0.25):.2f} to "
            f"{1e3 * np.quantile(values, 0.75):.2f})"
        )
    print(
        f"{name}, {steps} steps: the plain implementation takes {typical['plain'] / typical['fast']:.1f} times as long"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="short")
    parser.add_argument("--steps", type=int, default=400)
    arguments = parser.parse_args()
    main(arguments.scene, arguments.steps)
