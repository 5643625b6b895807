"""Where warnings of `check` come and go along a number of a scene: between values, and then nearer by halves."""

import math
import re

import numpy as np
from told import MOORED, ROPE, SHIP

from dolfbuoy import InputError, load_scene
from dolfbuoy.check.report import derived
from dolfbuoy.model.feasible import check_feasible

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
VALUES, HALVINGS, WORDS = 5, 5, 14
SEA = {"spectrum": "jonswap", "significant_height": 2.0, "peak_period": 7.0, "components": 40}
WAVE = {"amplitude": 0.5, "period": 6.0}
BASE = MOORED | {"waves": WAVE, "current": None}
IN_A_SEA = BASE | {"waves": SEA}
HULL = BASE["buoy"] | {"added_mass": "spar", "wave_damping": None}
LOOSE = {
    "cable": ROPE | {"from": [0.0, 0.0, -10.0], "slack": "tension-only", "top": {"kind": "free"}, "diameter": 0.02}
}
LOOSE |= {"sea": {"depth": 10.0}, "time": {"end": 1.0, "step": 0.01}}
RAOS = [[period, 0.0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0] for period in (5.0, 9.0)]
STILL = [0.0, 0.0, 0.0]
#: (what, scene, first and last value, what it changes).
ALONG = [
    ("waves.amplitude", BASE, (0.05, 6.0), lambda x: {"waves.amplitude": x}),
    ("waves.period", BASE, (1.5, 25.0), lambda x: {"waves.period": x}),
    ("waves.wavelength", BASE, (20.0, 160.0), lambda x: {"waves.wavelength": x}),
    ("waves.amplitude of 1.5 s", BASE, (0.01, 0.4), lambda x: {"waves": {"amplitude": x, "period": 1.5}}),
    ("time.step", BASE, (0.01, 2.0), lambda x: {"time.step": x}),
    ("sea.depth", BASE, (19.0, 200.0), lambda x: {"sea.depth": x}),
    ("buoy.mass", BASE, (50.0, 2e4), lambda x: {"buoy.mass": x}),
    ("buoy.center_of_mass", BASE, (0.1, 6.0), lambda x: {"buoy.center_of_mass": x}),
    ("buoy.axial_drag", BASE, (0.01, 30.0), lambda x: {"buoy.axial_drag": x, "waves.period": 2.5}),
    ("mass of a spar", BASE | {"buoy": HULL}, (50.0, 5e3), lambda x: {"buoy.mass": x}),
    ("significant height", IN_A_SEA, (0.2, 15.0), lambda x: {"waves.significant_height": x}),
    ("peak period", IN_A_SEA, (1.5, 20.0), lambda x: {"waves.peak_period": x}),
    ("crest", IN_A_SEA, (0.5, 9.0), lambda x: {"waves.crest": x, "waves.crest_time": 1.0}),
    ("crest time", IN_A_SEA, (0.5, 9.0), lambda x: {"waves.crest": 2.0, "waves.crest_time": x, "time.end": 5.0}),
    ("size of a tide", BASE, (0.1, 9.0), lambda x: {"sea.tide": [[0.0, 0.0], [1e5, x]]}),
    ("turn of a tide", BASE, (0.01, 1.0), lambda x: {"sea.tide": [[0, 0], [1e4, 1], [2e4, 1 + x], [3e4, 1], [4e4, 0]]}),
    ("hour of a tide", BASE, (9.0, 2e3), lambda x: {"sea.tide": [[0.0, 0.0], [x, 1.0]]}),
    (
        "time of a current",
        BASE,
        (3.0, 900.0),
        lambda x: {"current": {"speed": 1.0, "over_time": [[0.0, 1.0, 0.0], [x, 1.5, 0.0]]}},
    ),
    ("step of a snap", LOOSE, (1e-3, 0.1), lambda x: {"time.step": x}),
    ("cable.damping", LOOSE, (1e-3, 10.0), lambda x: {"cable.damping": x}),
    ("part", LOOSE, (0.2, 3.0), lambda x: {"cable.fails_at": {"time": x}}),
    (
        "period of raos",
        {key: part for key, part in SHIP.items() if key != "take_off"} | {"sea": {"depth": 12.0}},
        (2.0, 20.0),
        lambda x: {
            "vessel": [SHIP["vessel"][0] | {"raos": RAOS}],
            "waves": {"amplitude": 0.1, "period": x},
            "cable": [SHIP["cable"][0] | {"diameter": 0.02}],
            "joint": None,
        },
    ),
    *(
        (
            name,
            LOOSE,
            ends,
            lambda x, rows=rows: {"cable.top": {"kind": "prescribed", "position": [9.0, 0.0, -3.0], "motion": rows(x)}},
        )
        for name, ends, rows in (
            ("end of a motion", (0.3, 3.0), lambda x: [[0.0, *STILL], [x / 2, 0.01, 0.0, 0.0], [x, *STILL]]),
            (
                "turn of a motion",
                (0.01, 1.0),
                lambda x: [[0, 0, 0, 0], [1, 1, 0, 0], [2, 1 + x, 0, 0], [3, 1, 0, 0], [4, 0, 0, 0]],
            ),
            (
                "jump of a motion",
                (0.05, 8.0),
                lambda x: [[t / 4, 0.1 * math.sin(t / 3) + x * (t > 9), 0.0, 0.0] for t in range(20)],
            ),
        )
    ),
]


def said(scene, change, x):
    """The warnings with a value, without their numbers, or the refusal."""
    try:
        found = load_scene(scene, **change(x))
        check_feasible(found)
        sentences = derived(found).warnings
    except InputError as error:
        sentences = [f"refused: {error}"]
    return {" ".join(NUMBER.sub("#", sentence).split()[:WORDS]) for sentence in sentences}


def told():
    """What comes and goes, and where."""
    for name, scene, (first, last), change in ALONG:
        values = np.geomspace(first, last, VALUES)
        rows = [said(scene, change, float(x)) for x in values]
        print(f"{name} from {first:g}:", *sorted(rows[0]))
        for low, high, before, after in zip(values, values[1:], rows, rows[1:], strict=False):
            for sentence in sorted(before ^ after):
                a, b, there = float(low), float(high), sentence in after
                for _ in range(HALVINGS):
                    middle = math.sqrt(a * b)
                    a, b = (a, middle) if (sentence in said(scene, change, middle)) == there else (middle, b)
                print(f"  {a:.3g} to {b:.3g}: {'+' if there else '-'} {sentence}")


told()
