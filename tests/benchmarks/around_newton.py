"""What surrounds Newton's method in a step: all that is done outside of it, with the record of every step.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/around_newton.py [SCENE ...]

Time scheme, start of Newton, what is given as a function of time, forces at the ends, record; bringing the record to
the disk is not counted: at most a fiftieth of a run goes there.  Each number is the smallest of many groups of steps,
this process's time on the processor.
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


def milliseconds(scene) -> tuple[float, float, float]:
    """Of a step with its record, of Newton's method in it, and of the rest."""
    simulation = Simulation(load_scene(scene, time__end=1e5), MPI.COMM_SELF)
    numbers = simulation.newton.numbers
    numbers.clocked = True
    with TemporaryDirectory() as folder:
        recorder, march, rows = Recorder(simulation, Path(folder)), simulation.run(), []
        recorder.pause = np.inf
        recorder.save()
        for group in range(GROUPS + WARM_UP // STEPS):
            numbers.seconds, begin = 0.0, time.process_time()
            for _ in range(STEPS):
                recorder.add(*next(march))
            whole = time.process_time() - begin
            if group >= WARM_UP // STEPS:
                rows.append([whole, numbers.seconds, whole - numbers.seconds])
    simulation.problem.destroy()
    return tuple(1e3 / STEPS * np.min(rows, axis=0))


if __name__ == "__main__":
    print(sentence())
    for scene in sys.argv[1:] or ("driven", "short", "long"):
        whole, inside, outside = milliseconds(scene)
        print(f"{scene}: {whole:.3f} ms a step, {inside:.3f} in Newton, {outside:.4f} around it, {outside / whole:.0%}")
