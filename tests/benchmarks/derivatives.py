"""What derivatives cost: the loops of a run without them, and by one number, by three and by fifteen, which take turns.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/derivatives.py [SCENE ...] [--turns 5]

Seconds from the first step to the last, with all that is noted, in those of the run with its record: by the first
number, by each of the two others, and of the whole run with fifteen.  All of them go on by turns of a few steps within
one process, so that a machine that is slow for a while is so for all; of the same few steps the least of all counts.
"""

import threading
import time

import numpy as np
from bars import loop, printed

from dolfbuoy import load_scene
from dolfbuoy.sensitivity.derivatives import of_run
from dolfbuoy.sensitivity.parameters import parameters_of

FEW = 40  #: steps of a turn
#: Scene -> (end [s], numbers).
SCENES = {
    "driven": (20.0, ("cable.line_density", "cable.length", "cable.normal_drag")),
    "short": (20.0, ("buoy.mass", "current.speed", "cable.normal_drag")),
    "long": (20.0, ("cable.line_density", "cable.length", "cable.normal_drag")),
    "three-legs": (20.0, ("buoy.mass", "current.speed", "waves.amplitude")),
    "chain-on-bed": (30.0, ("cable.line_density", "seabed.friction", "cable.top.amplitude")),
}
MANY = {"short": 15}  #: so many of the scene's numbers, the first ones


class Turns:
    """Loops that go on by turns; each is a function that is given another one, to be called after every step."""

    def __init__(self, loops):
        self.loops, self.main = loops, threading.Semaphore(0)
        self.gates = [threading.Semaphore(0) for _ in loops]
        self.seconds = [[] for _ in loops]
        self.running = [True] * len(loops)

    def _follow(self, k):
        self.gates[k].acquire()
        steps, begin = 0, None

        def step(*_):
            nonlocal steps, begin
            steps += 1
            if steps % FEW == 0:
                if begin is not None:
                    self.seconds[k].append(time.perf_counter() - begin)
                self.main.release()
                self.gates[k].acquire()
                begin = time.perf_counter()

        try:
            self.loops[k](step)
        finally:
            self.running[k] = False
            self.main.release()

    def run(self):
        """Seconds of every few steps but the first ones, (loops, turns)."""
        threads = [threading.Thread(target=self._follow, args=(k,)) for k in range(len(self.loops))]
        for thread in threads:
            thread.start()
        while any(self.running):
            for k, gate in enumerate(self.gates):
                if self.running[k]:
                    gate.release()
                    self.main.acquire()
        for thread in threads:
            thread.join()
        least = min(map(len, self.seconds))
        return np.array([seconds[:least] for seconds in self.seconds])


def following(scene, keys):
    """Loop of a run with derivatives by these numbers."""
    return lambda step: of_run(scene, parameters_of(scene, keys), progress=step)


def row(name, turns):
    """Cells of a scene: seconds of the run, shares."""
    end, keys = SCENES[name]
    scene = load_scene(load_scene(name, time__end=end), accuracy=None)
    loops = [lambda step: loop(scene, progress=step), following(scene, keys[:1]), following(scene, keys)]
    if name in MANY:
        loops.append(following(scene, [p.key for p in parameters_of(scene)][: MANY[name]]))
    run, first, three, *many = np.min([Turns(loops).run() for _ in range(turns)], axis=0).sum(axis=1)
    cells = [f"{run:.3f}", f"{first / run - 1:.2f}", f"{(three - first) / 2 / run:.2f}"]
    return [name, *cells, f"{many[0] / run:.1f}" if many else ""]


if __name__ == "__main__":
    printed(__doc__, SCENES, ["scene", "loop [s]", "first number", "each further one", "run with fifteen"], row)
