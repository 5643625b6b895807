"""Cost of a step of lines that bend beside that of the same lines without: CPU time, side by side.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/stiff_lines.py [--blocks 20]

All cases of a scene take their steps in turn, one block after the other, until the scene's end; the ratio is the
median of the blocks'.  Half a minute where nothing else runs.
"""

import argparse
import itertools
import time

import numpy as np
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.tables import markdown

#: Scene -> time [s].
SCENES = {"driven": 60.0, "long": 30.0, "short": 60.0, "lazy-wave": 60.0}
STIFFNESSES = 0.0, 1e2, 1e4, 1e6


class Case:
    """A scene with this EI [N m^2], block by block; with 0 the scene as it is, that takes compression."""

    def __init__(self, scene, EI, end):
        cable = {"bending_stiffness": EI, "slack": "compressive"}
        found = load_scene(scene, cable=cable, time={"end": end})
        self.scene, self.EI, self.seconds = scene, EI, []
        self.simulation = Simulation(found, MPI.COMM_SELF)
        self.steps, self.count = self.simulation.run(), round(end / found.time.step)

    def block(self, blocks):
        """Its share of the steps."""
        begin, steps = time.process_time(), self.count // blocks
        for _ in itertools.islice(self.steps, steps):
            pass
        self.seconds.append((time.process_time() - begin) / steps)

    def row(self, beside):
        """What the table says of it; beside: the case without bending."""
        numbers, ratios = self.simulation.newton.numbers, np.divide(self.seconds, beside.seconds)
        return {
            "scene": self.scene, "EI": f"{self.EI:g}", "unknowns": self.simulation.system.unknowns,
            "us a step": 1e6 * np.median(self.seconds), "ratio": np.median(ratios),
            "quarters": float(np.subtract(*np.percentile(ratios, [75, 25]))),
            "iterations": self.simulation.iterations / self.count, "matrices": numbers.jacobians_total / self.count,
        }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=20)
    blocks, rows = parser.parse_args().blocks, []
    for scene, end in SCENES.items():
        cases = [Case(scene, EI, end) for EI in STIFFNESSES]
        for _ in range(blocks):
            for case in cases:
                case.block(blocks)
        rows += [case.row(cases[0]) for case in cases]
    print(markdown("", rows, {name: name for name in rows[0]}))


if __name__ == "__main__":
    main()
