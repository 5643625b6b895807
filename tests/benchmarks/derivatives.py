"""What derivatives cost: the loops of a run without them, and by one number and by three, timed in turns.

    OMP_NUM_THREADS=1 .venv/bin/python tests/benchmarks/derivatives.py [SCENE ...] [--turns 5]

Seconds on the processor from the first step to the last, with all that is noted, in those of the run with its record:
by the first number, and by each of the two others.  Each is the least of the turns.
"""

import time

import numpy as np
from bars import loop, printed

from dolfbuoy import load_scene
from dolfbuoy.sensitivity.derivatives import of_run
from dolfbuoy.sensitivity.parameters import parameters_of

#: Scene -> (end [s], numbers).
SCENES = {
    "driven": (20.0, ("cable.line_density", "cable.length", "cable.normal_drag")),
    "short": (20.0, ("buoy.mass", "current.speed", "cable.normal_drag")),
    "long": (20.0, ("cable.line_density", "cable.length", "cable.normal_drag")),
    "three-legs": (20.0, ("buoy.mass", "current.speed", "waves.amplitude")),
    "chain-on-bed": (30.0, ("cable.line_density", "seabed.friction", "cable.top.amplitude")),
}


def following(scene, keys):
    """Seconds of a run's steps with derivatives by these numbers."""
    times = []
    of_run(scene, parameters_of(scene, keys), progress=lambda _: times.append(time.process_time()))
    return (times[-1] - times[0]) * len(times) / (len(times) - 1)


def row(name, turns):
    """Cells of a scene: seconds of the run, shares."""
    end, keys = SCENES[name]
    scene = load_scene(load_scene(name, time__end=end), accuracy=None)
    runs = [(loop(scene)[1], following(scene, keys[:1]), following(scene, keys)) for _ in range(turns)]
    plain, first, three = np.min(runs, axis=0)
    return [name, f"{plain:.3f}", f"{first / plain - 1:.2f}", f"{(three - first) / 2 / plain:.2f}"]


if __name__ == "__main__":
    printed(__doc__, SCENES, ["scene", "loop [s]", "first number", "each further one"], row)
