"""Linear answers beside runs in time of few steps: `response --verify`, and the sentence of `study work-precision`."""

import itertools
import sys
from functools import partial
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from dolfbuoy import load_scene
from dolfbuoy.commands import main as cli
from dolfbuoy.studies.accuracy import linear_answer
from dolfbuoy.studies.physics import response_runs

FEW = {"GROWING": 2, "SETTLING": 1, "FITTED": 2, "STEPS": 20, "BEFORE": 4, "SEEN": 6}
SMALL = "--set cable.elements=8 --set cable.axial_stiffness=2e5"


def by_command():
    """At a period and in a sea: surge to pitch, and tensions."""
    clock = SimpleNamespace(monotonic=partial(next, itertools.count(0.0, 7.0)))
    words = f"dolfbuoy response short {SMALL} --periods 6 --height 0.2 --significant-height 0.3 --peak-period 5"
    words = f"{words} --verify 6,sea --no-plot --out verified".split()
    with patch.multiple(response_runs, time=clock, **FEW), patch.object(sys, "argv", words):
        try:
            cli.main()
        except SystemExit as end:
            print("exit code", end.code or 0)


def answers():
    """A regular wave and a sea, of a made-up run."""
    clock = SimpleNamespace(monotonic=partial(next, itertools.count(0.0, 3.0)))
    t = np.arange(0.0, 40.0, 0.25)
    values = {name: 3e3 + size * np.cos(t)[:, None] for name, size in (("tension_top", 1200.0), ("cone_angle", 2.0))}
    values["buoy_position"] = np.outer(np.cos(t), [0.4, 0.0, 0.3])
    run = SimpleNamespace(t=t, values=values, wall=50.0)
    sea = {"waves__spectrum": "jonswap", "waves__significant_height": 0.8, "waves__peak_period": 5.0}
    sea |= {"waves__amplitude": None, "waves__period": None, "waves__wavelength": None, "waves__components": 9}
    for more, names in (({}, ["tension_top", "cone_angle"]), (sea, ["buoy_position"])):
        scene = load_scene("short", cable__elements=4, **more)
        for name in names:
            with patch.object(linear_answer, "time", clock):
                print(name, linear_answer.linear_answer(scene, run, name, 10.0))


by_command()
answers()
