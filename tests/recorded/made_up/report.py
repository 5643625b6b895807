"""`study accuracy` on made-up runs: a known motion, plus errors that are powers of step and element size.

The runs last no time; seconds are made up too, in proportion to steps and unknowns.
"""

import json
import math
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from dolfbuoy.errors import SolveError
from dolfbuoy.results import measured
from dolfbuoy.results.measured import Run
from dolfbuoy.scene import load_scene, settings
from dolfbuoy.studies.accuracy import report, report_text, work_precision

ORDERS = {"backward-euler": (1, 0.4), "bdf2": (2, 3.0), "generalized-alpha": (2, 1.0)}


def computed(scene, names, repeats=1):
    """A run of a scene whose errors are known; one that fails."""
    space, stepping = settings.space_of(scene), settings.stepping_of(scene)
    order, constant = ORDERS[stepping.scheme]
    step = stepping.step if stepping.tolerance is None else 0.1 * stepping.tolerance ** (1 / 3)
    if stepping.scheme == "bdf2" and space.mu == 1 and stepping.step > 0.15:
        raise SolveError("Made up to fail.")
    t = np.append(np.arange(0, scene.time.end - 0.5 * step, step), scene.time.end)
    phase = 2 * math.pi * t / settings.period_of(scene)
    off = constant * step**order + 0.5 * (space.mu * space.cells) ** -(space.mu + 0.5)
    values = {
        "tension_top": 7e3 + 2e3 * np.cos(phase) + 2e3 * off * np.sin(phase + 0.7),
        "tension_anchor": 4e3 + 1e3 * np.cos(phase + 0.4) + 3e3 * off * np.cos(2 * phase),
        "buoy_position": np.column_stack([5 + np.cos(phase), 0.1 * np.sin(phase), (1 + off) * np.sin(phase)]),
        "cone_angle": 8 + (4 + off) * np.sin(phase),
    }
    unknowns, steps = 5 * space.mu * space.cells + 13, len(t) - 1
    wall = steps * unknowns * 1e-4 * (0.8 if stepping.scheme == "backward-euler" else 1.0)
    counts = steps, 3 * steps, 2 if stepping.tolerance else 0, 0, unknowns
    return Run(t, {name: values[name].reshape(len(t), -1) for name in names}, wall, 0.9 * wall, *counts)


def static(study, folder, figures, cells):
    """Rows of Fig. 2 of three pairs, with errors that are powers."""
    print(study.__module__, Path(folder).name, figures, cells)
    pairs = ((1, 0), (2, 1), (3, 2))
    rows = [
        {"mu": mu, "nu": nu, "cells": n, "r_L2": 0.3 / n ** (mu + 1), "T_L2": 0.2 / n**mu}
        | {"order_r_L2": mu + 1.0, "order_T_L2": mu + 0.01}
        for mu, nu in pairs
        for n in cells
    ]
    return SimpleNamespace(rows={"figure2-neumann": rows})


def told():
    """The plans of both reports, and what the quick one says, writes and draws."""
    for plans in (report.FULL, report.QUICK):
        for name, plan in plans.items():
            print(name, plan)
            scene = load_scene(name)
            for space, stepping in report.settings_of(settings.shortened(scene, plan.end), plan, 0.3):
                print(space, stepping)
            for kind, case in report.fine_cases(scene, plan, Path("work")).items():
                print(kind, *list(case.values())[:7], case["scene"]["time"])
    print("pendulums", report.pendulum_cases(True), report.pendulum_cases(False))
    print("one", report.pendulum("bdf2", 0.02, 3.0))
    left = {"backward-euler": (0.5, 0.51), "bdf2": (0.98, 0.97), "generalized-alpha": (1.0, 0.999)}
    free = {name: dict(zip(("remaining", "theory"), pair, strict=True)) for name, pair in left.items()}
    linear = "linear response: 1 s, made up."
    with (
        patch.object(measured, "compute", computed),
        patch.object(measured, "machine", lambda: "a machine"),
        patch.object(report, "run_study", static),
        patch.object(report, "evaluate_pendulum", lambda case: free[case["scheme"]]),
        patch.object(work_precision, "linear_answer", lambda scene, run, name, start: f"{name} {start:g}: {linear}"),
    ):
        report.run(Path("report"), quick=True)
    for scene in json.loads(Path("report/report.json").read_text())["scenes"]:
        for row in scene["rows"]:
            print(" ".join(f"{value:.5g}" for key, value in row.items() if "error" in key and value is not None))
    line = {"scheme": "bdf2", "name": "BDF2", "0.01": {"seconds": 3.0, "size": 0.1, "per_period": 50.0}}
    euler = {"scheme": "backward-euler", "name": "backward Euler", "0.01": {"seconds": 9.0, "size": 0.01}}
    scenes = [{"schemes": [line, euler]}, {"schemes": [euler | {"0.01": None}, line]}]
    print("default", report_text.default_scheme({"scenes": scenes}))


told()
