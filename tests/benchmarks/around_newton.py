"""What surrounds Newton's method in a step: all that is done outside PETSc's solve, with the record of every step.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/around_newton.py [SCENE ...]

Time scheme, start of Newton, what is given as a function of time, forces at the ends, record; bringing the record to
the disk is not counted: at most a fiftieth of a run goes there.  Each number is the smallest of many groups of steps.
"""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from machine import sentence
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results.recorder import Recorder

WARM_UP, GROUPS, STEPS = 100, 80, 20


class Clocked:
    """PETSc's SNES, whose solves are timed."""

    def __init__(self, snes):
        self._snes, self.seconds = snes, 0.0

    def __getattr__(self, name):
        return getattr(self._snes, name)

    def solve(self, *arguments):
        """Solve."""
        begin = time.perf_counter()
        self._snes.solve(*arguments)
        self.seconds += time.perf_counter() - begin


def milliseconds(scene) -> tuple[float, float, float]:
    """Of a step with its record, of PETSc's solve in it, and of the rest."""
    simulation = Simulation(load_scene(scene, time__end=1e5), MPI.COMM_SELF)
    simulation.newton.snes = snes = Clocked(simulation.newton.snes)
    with TemporaryDirectory() as folder:
        recorder, march, rows = Recorder(simulation, Path(folder)), simulation.run(), []
        recorder.pause = np.inf
        recorder.save()
        for group in range(GROUPS + WARM_UP // STEPS):
            snes.seconds, begin = 0.0, time.perf_counter()
            for _ in range(STEPS):
                recorder.add(*next(march))
            whole = time.perf_counter() - begin
            if group >= WARM_UP // STEPS:
                rows.append([whole, snes.seconds, whole - snes.seconds])
    simulation.problem.destroy()
    return tuple(1e3 / STEPS * np.min(rows, axis=0))


if __name__ == "__main__":
    print(sentence())
    for scene in sys.argv[1:] or ("driven", "short", "long"):
        whole, inside, outside = milliseconds(scene)
        print(f"{scene}: {whole:.3f} ms a step, {inside:.3f} in Newton, {outside:.4f} around it, {outside / whole:.0%}")
