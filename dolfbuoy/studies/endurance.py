"""A long run without drift or growth: extremes and means of window after window of the same length.

The waves are periodic, so once the start has died out every window that holds whole periods must show the same numbers.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from mpi4py import MPI

from .. import simulate
from ..errors import InputError
from ..results import checkpoint
from ..results.style import PAGE, STYLE, new_figure
from ..scene import load_scene
from . import common

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
HEADINGS = {
    "until": "until [s]",
    "top_max": "max |T_bnd| [N]",
    "top_min": "min |T_bnd| [N]",
    "anchor_max": "max T_h(0) [N]",
    "cone_max": "max cone [deg]",
    "x_mean": "mean x [m]",
    "y_mean": "mean y [m]",
    "z_mean": "mean z [m]",
    "unit_error": "max ||q|-1|",
    "newton": "Newton/step",
}


def load(name, duration, step, scheme):
    """The scene of the long run; frames are few."""
    return load_scene(name, time={"end": duration, "step": step, "scheme": scheme, "output_every": duration / 100})


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
    """The record of `scene` in `folder`/run; one that was stopped goes on."""
    folder = Path(folder) / "run"
    try:
        same = checkpoint.load(folder, MPI.COMM_WORLD.size, scene.time.end).scene == scene
    except InputError:
        same = False
    return simulate(resume=folder, time__end=scene.time.end) if same else simulate(scene, out=folder)


def run(folder: Path, scene, length: float, skip: int, tolerance: float) -> bool:
    """Run, print, write endurance.json, .csv, .png and .svg; whether everything is as it should be."""
    if scene.time.end < (skip + 2) * length * (1 - 1e-9):
        raise InputError(f"--duration {scene.time.end:g}: fewer than {skip + 2} windows of {length:g} s.")
    record = long_run(scene, folder)
    if MPI.COMM_WORLD.rank != 0:
        return True
    rows = windows(record, length)
    verdict = judge(record, rows, skip, tolerance)
    notes = [
        f"{'ok    ' if value <= allowed else 'FAILED'} {what}: {value:.3g} (allowed {allowed:.3g})"
        for what, value, allowed in verdict
    ]
    common.save(folder, "endurance", rows, figure(rows), notes)
    time = scene.time
    common.show(
        f"{scene.title}: {time.end:g} s, {time.scheme}, step {time.step:g} s, windows of {length:g} s",
        rows,
        {key: heading for key, heading in HEADINGS.items() if key in rows[0]},
        [f"changes behind window {skip}, relative to the range of the quantity:", *notes],
    )
    return all(value <= allowed for _, value, allowed in verdict)


def figure(rows):
    """Every quantity over the windows, as difference from its last value."""
    with mpl.rc_context(STYLE):
        shown = new_figure(PAGE, 3.2)
        axes = shown.subplots()
        for name in (n for n in QUANTITIES if n in rows[0]):
            values = np.array([row[name] for row in rows])
            axes.plot([row["until"] for row in rows], values - values[-1], ".-", label=HEADINGS[name])
        axes.set_xlabel("t [s]")
        axes.set_ylabel("difference from the last window")
        axes.set_yscale("symlog", linthresh=1e-6)
        axes.legend(ncol=2)
    return shown
