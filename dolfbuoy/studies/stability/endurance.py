"""A long run without drift or growth: extremes and means of window after window of the same length.

The waves are periodic, so once the start has died out every window that holds whole periods must show the same numbers.
"""

import math
from pathlib import Path

import numpy as np
from mpi4py import MPI

from ...api import simulate
from ...errors import InputError
from ...results import checkpoint
from ...results.parts import alone
from ...results.style import PAGE, new_figure
from ...scene import load_scene
from ..declaration import declared
from ..study import Table, refuse_network

WORDS = declared(__file__)

#: name: (how to reduce a window, record variable, component); sizes are judged against the spread of the whole run
QUANTITIES = {
    "top_max": (np.max, "tension_top", None),
    "top_min": (np.min, "tension_top", None),
    "anchor_max": (np.max, "tension_anchor", None),
    "cone_max": (np.max, "cone_angle", None),
    "x_mean": (np.mean, "buoy_position", 0),
    "y_mean": (np.mean, "buoy_position", 1),
    "z_mean": (np.mean, "buoy_position", 2),
}


def request(scene, duration: float, step: float, scheme: str, newton: float, **judged) -> dict:
    """The scene of the long run, of which frames are few, and how its windows are judged."""
    if not 0 < judged.get("tolerance", 1.0) < math.inf:
        raise InputError(f"--tolerance {judged['tolerance']:g}: must be a positive number.")
    time = {"end": duration, "step": step, "scheme": scheme, "output_every": duration / 100}
    scene = load_scene(scene, time=time, solver={"step_tolerance": newton})
    refuse_network(scene)
    return {"scene": scene, **judged}


def windows(record, length: float) -> list[dict]:
    """One row of QUANTITIES for every full window of `length` [s]; the initial state belongs to none."""
    t, rows = record.time.values, []
    for k in range(int(t[-1] / length + 1e-6)):
        inside = (t > k * length * (1 + 1e-12) + 1e-9) & (t <= (k + 1) * length + 1e-9)
        row = {"until": (k + 1) * length}
        for name, (reduce, variable, component) in QUANTITIES.items():
            if variable in record:
                values = record[variable].values[inside]
                row[name] = float(reduce(values if component is None else values[:, component]))
        if "buoy_orientation" in record:
            row["unit_error"] = float(abs(np.linalg.norm(record.buoy_orientation.values[inside], axis=1) - 1).max())
        row["newton"] = float(record.newton_iterations.values[inside].mean())
        rows.append(row)
    return rows


def judge(record, rows: list[dict], skip: int, tolerance: float) -> list[tuple[str, float, float]]:
    """(what, found, allowed): changes between windows behind the first `skip`, relative to the spread of the run.

    Trend: of the straight line through the windows, over their whole length.
    """
    kept, found = rows[skip:], []
    begin = record.time.values > rows[skip - 1]["until"] if skip else slice(None)
    for name, (_, variable, component) in QUANTITIES.items():
        if variable not in record:
            continue
        values = record[variable].values[begin]
        spread = float(np.ptp(values if component is None else values[:, component])) or 1.0
        series = np.array([row[name] for row in kept])
        found.append((f"{name}, largest change", float(np.ptp(series)) / spread, tolerance))
        if len(series) > 2:
            trend = np.polyfit(np.linspace(0, 1, len(series)), series, 1)[0]
            found.append((f"{name}, trend", abs(float(trend)) / spread, tolerance / 2))
    if "unit_error" in rows[0]:
        found.append(("||q| - 1|", max(row["unit_error"] for row in rows), 1e-12))
    for name in ("failed_steps", "linear_solver_fallbacks"):
        found.append((name.replace("_", " "), float(record.attrs[name]), 0.0))
    invalid = sum(int((~np.isfinite(record[name])).sum()) for name in record.data_vars)
    found.append(("values that are not finite", float(invalid), 0.0))
    return found


def long_run(scene, folder: Path):
    """The record, see `alone`, of `scene` in `folder`/run; one that was stopped goes on."""
    folder = Path(folder) / "run"
    try:
        same = checkpoint.load(folder, MPI.COMM_WORLD.size, scene.time.end).scene == scene
    except InputError:
        same = False
    resumed = {"resume": folder, "time__end": scene.time.end}
    return alone(simulate(**resumed) if same else simulate(scene, out=folder, overwrite=True))


def compute(folder: Path, scene, window: float, skip: int, **_):
    """The record, if the run is long enough for its windows; None on all ranks but 0."""
    if not 0 < window < math.inf:
        raise InputError(f"--window {window:g}: must be a positive number of seconds.")
    if scene.time.end < (skip + 2) * window * (1 - 1e-9):
        raise InputError(f"--duration {scene.time.end:g}: fewer than {skip + 2} windows of {window:g} s.")
    record = long_run(scene, folder)
    return record if MPI.COMM_WORLD.rank == 0 else None


def tables(record, scene, window: float, skip: int, tolerance: float) -> list[Table]:
    """The windows, and whether everything is as it should be."""
    rows = windows(record, window)
    verdict = judge(record, rows, skip, tolerance)
    passed = [bool(value <= allowed) for _, value, allowed in verdict]
    notes = [
        WORDS.say("verdict", good="ok    " if good else "FAILED", what=what, value=value, allowed=allowed)
        for good, (what, value, allowed) in zip(passed, verdict, strict=True)
    ]
    head, time = WORDS.say("head", skip=skip), scene.time
    columns = {key: heading for key, heading in WORDS.columns.items() if key in rows[0]}
    run = {"end": time.end, "scheme": time.scheme, "step": time.step, "window": window}
    run["newton"] = scene.solver.step_tolerance
    title = WORDS.say("title", title=scene.title, **run)
    return [
        Table("endurance", rows, notes=notes, figure=draw(rows), passed=all(passed)),
        Table("", rows, title, columns, [head, *notes]),
    ]


def draw(rows: list[dict]):
    """Every quantity over the windows, as difference from its last value."""
    figure = new_figure(PAGE, 3.2)
    axes = figure.subplots()
    for name in (n for n in QUANTITIES if n in rows[0]):
        values = np.array([row[name] for row in rows])
        axes.plot([row["until"] for row in rows], values - values[-1], ".-", label=WORDS.columns[name])
    axes.set(xlabel="t [s]", ylabel="difference from the last window")
    axes.set_yscale("symlog", linthresh=1e-6)
    axes.legend(ncol=2)
    return figure
