"""Cost of a step of several lines beside that of one with as many elements: CPU time per element, side by side.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/legs.py [--blocks 60]

Legs of 20 elements hang between fixed anchors and one float whose wave-driven motion pulls at them; the line in one
piece has the same elements, loads and drive.  All take their steps in turn, ten at a time; the medians of the blocks
are shown, and how far their quarters are apart.
"""

import argparse
import math
import time

import numpy as np
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.tables import show

ROPE = {"line_density": 12.0, "diameter": 0.05, "axial_stiffness": 3e6, "added_mass": 1.0, "normal_drag": 1.2}
SEA = {"sea": {"depth": 50.0}, "waves": {"amplitude": 1.0, "period": 6.0, "ramp": 2.0}}
TIME = {"time": {"end": 1e4, "step": 0.05, "scheme": "bdf2"}}
EACH, STEPS, BEFORE = 20, 10, 100


def legs(count):
    """A float on so many legs."""
    angles = 2 * math.pi * np.arange(count) / count
    feet = [[40 * math.cos(a), 40 * math.sin(a), -50.0] for a in angles]
    cables = [
        ROPE | {"name": f"leg{k}", "from": foot, "to": "float", "length": 62.0, "elements": EACH}
        for k, foot in enumerate(feet)
    ]
    body = {"name": "float", "mass": 100.0, "volume": 2.0 + 0.6 * count, "drag_area": 5.0, "added_mass": 0.5}
    return SEA | TIME | {"cable": cables, "joint": [body]}


def one(elements):
    """A line in one piece whose top is driven."""
    top = {
        "kind": "prescribed",
        "position": [40.0, 0.0, -2.0],
        "amplitude": [0.5, 0.0, 0.5],
        "period": 6.0,
        "ramp": 2.0,
    }
    return SEA | TIME | {"cable": ROPE | {"length": 65.0, "elements": elements, "top": top}}


class Case:
    """A scene that goes on, block by block."""

    def __init__(self, name, scene, elements):
        self.name, self.elements = name, elements
        self.simulation = Simulation(load_scene(scene), MPI.COMM_SELF)
        self.steps, self.seconds, self.iterations = self.simulation.run(), [], 0
        for _ in range(BEFORE):
            next(self.steps)

    def block(self):
        """Ten steps."""
        begin = time.process_time()
        self.iterations += sum(next(self.steps)[1] for _ in range(STEPS))
        self.seconds.append((time.process_time() - begin) / STEPS)

    def row(self):
        """What the table says of it."""
        low, middle, high = np.percentile(self.seconds, [25, 50, 75])
        return {
            "case": self.name, "elements": self.elements, "ms a step": 1e3 * middle, "quarters": 1e3 * (high - low),
            "us a step and element": 1e6 * middle / self.elements,
            "Newton": self.iterations / (len(self.seconds) * STEPS),
        }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=60)
    blocks = parser.parse_args().blocks
    cases = []
    for count in (3, 12, 50):
        cases.append(Case(f"{count} legs", legs(count), EACH * count))
        cases.append(Case("one line", one(EACH * count), EACH * count))
    for _ in range(blocks):
        for case in cases:
            case.block()
    columns = {name: name for name in cases[0].row()}
    show("Several lines and one", [case.row() for case in cases], columns)


if __name__ == "__main__":
    main()
