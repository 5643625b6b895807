"""From command to first step: a new process, the imports of `dolfbuoy run`, equilibrium, set-up, one step.

    .venv/bin/python tests/benchmarks/startup.py [SCENE ...]

The forms are compiled before the clock starts.
"""

import subprocess
import sys
import time

import numpy as np
from machine import sentence

REPEATS = 7
CHILD = """
import sys
import dolfbuoy.commands.main
from dolfbuoy import load_scene, simulate
scene = load_scene(sys.argv[1])
simulate(load_scene(scene, time__end=scene.time.step), progress=lambda *_: print("stepped", flush=True))
"""


def seconds(scene: str) -> list[float]:
    """Wall seconds until the first step is done, of several processes; one before them compiles."""
    found = []
    for _ in range(REPEATS + 1):
        begin = time.perf_counter()
        with subprocess.Popen([sys.executable, "-c", CHILD, scene], stdout=subprocess.PIPE, text=True) as child:
            said = child.stdout.readline()
            found.append(time.perf_counter() - begin)
        if said != "stepped\n":
            sys.exit(f"{scene}: no step was done.")
    return found[1:]


if __name__ == "__main__":
    print(sentence())
    for scene in sys.argv[1:] or ("short", "long"):
        found = seconds(scene)
        print(f"{scene}: {np.median(found):.2f} s from command to first step ({min(found):.2f} to {max(found):.2f} s)")
