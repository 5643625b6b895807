"""The scheme and step with which `dolfbuoy new` begins a scene like a shipped one: what error bars recommend.

    .venv/bin/python -m tests.verification.first_steps       # writes dolfbuoy/scenes/steps.json; two minutes

The ramp and four periods with the scene's own elements, BDF2 and equal steps, halved from a 20th of the period on until
the bars that a run with twice the step gives the largest tensions and the cone angle are within 0.7 %: then the largest
of the rounded steps that the second order allows, and a 50th of the period.  A scene that has no such step down to a
640th keeps its own.
"""

import json
import math
from pathlib import Path

from dolfbuoy.accuracy.target import ENOUGH, judged
from dolfbuoy.results.compare import nice_numbers
from dolfbuoy.scene import load_scene, shipped_scenes
from dolfbuoy.scene.settings import Stepping, period_of, shortened, space_of, with_settings
from dolfbuoy.studies.accuracy.cheapest import tried

FILE = Path(__file__).parents[2] / "dolfbuoy" / "scenes" / "steps.json"
ACCURACY, FIRST, LEVELS, FEWEST = 0.01, 20, 6, 50


def recommended(name: str) -> float | None:
    """The step [s] for a shipped scene; None without a period, or where no bar is within the accuracy."""
    scene = load_scene(name)
    if scene.time is None or period_of(scene) is None:
        return None
    scene = load_scene(shortened(scene, periods=4), accuracy={"target": ACCURACY})
    coarse = None
    for level in range(LEVELS):
        step = period_of(scene) / FIRST / 2**level
        fine = tried(with_settings(scene, space_of(scene), Stepping("bdf2", step)))
        if coarse is not None and not isinstance(fine, Exception):
            share = judged(scene, fine, coarse).worst
            if share <= ENOUGH:
                longest = min(step * math.sqrt(ENOUGH / max(share, 1e-12)), 2 * step, period_of(scene) / FEWEST)
                return max(nice_numbers(step / 10, longest))
        coarse = fine
    return None


def main() -> None:
    """Write the file."""
    steps = {}
    for name in shipped_scenes():
        step = recommended(name)
        print(name, step, flush=True)
        if step is not None:
            steps[name] = {"scheme": "bdf2", "step": step}
    FILE.write_text(json.dumps(steps, indent=1) + "\n")


if __name__ == "__main__":
    main()
