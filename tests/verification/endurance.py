"""A long run without drift or growth: extremes and means of window after window of the same length.

    .venv/bin/python -m tests.verification.endurance [SCENE] [--duration 300 --window 50]

The waves are periodic, so once the start has died out every window that holds whole periods must show the same numbers.
"""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from dolfbuoy.api import simulate
from dolfbuoy.errors import InputError
from dolfbuoy.results import checkpoint
from dolfbuoy.results.parts import alone
from dolfbuoy.scene import Scene, load_scene
from dolfbuoy.studies.study import Table, refuse_network

from .script import make, start

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


COLUMNS = {
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


def study(folder: Path, scene: Scene, window: float, skip: int, tolerance: float) -> list[Table]:
    """The windows, and whether everything is as it should be."""
    if not 0 < window < math.inf:
        raise InputError(f"--window {window:g}: must be a positive number of seconds.")
    if scene.time.end < (skip + 2) * window * (1 - 1e-9):
        raise InputError(f"--duration {scene.time.end:g}: fewer than {skip + 2} windows of {window:g} s.")
    record, time = long_run(scene, folder), scene.time
    if MPI.COMM_WORLD.rank:
        return []
    rows = windows(record, window)
    verdict = judge(record, rows, skip, tolerance)
    passed = [bool(value <= allowed) for _, value, allowed in verdict]
    notes = [
        f"{'ok    ' if good else 'FAILED'} {what}: {value:.3g} (allowed {allowed:.3g})"
        for good, (what, value, allowed) in zip(passed, verdict, strict=True)
    ]
    head = f"changes behind window {skip}, relative to the range of the quantity:"
    columns = {key: heading for key, heading in COLUMNS.items() if key in rows[0]}
    how = f"{time.end:g} s, {time.scheme}, step {time.step:g} s, Newton to {scene.solver.step_tolerance:g}"
    return [
        Table("endurance", rows, notes=notes, passed=all(passed)),
        Table("", rows, f"{scene.title}: {how}, windows of {window:g} s", columns, [head, *notes]),
    ]


def main(
    scene: str = typer.Argument("short", help="Of a moored buoy in waves."),
    duration: Annotated[float, typer.Option(help="Length of the run [s].")] = 10000.0,
    step: Annotated[float, typer.Option(help="Time step [s].")] = 0.1,
    scheme: Annotated[str, typer.Option(help="Of second order, or the step must be small.")] = "bdf2",
    newton: Annotated[float, typer.Option(help="Newton's tolerance.")] = 1e-9,
    window: Annotated[float, typer.Option(help="Whole periods [s].")] = 1000.0,
    skip: Annotated[int, typer.Option(min=0, help="Windows in which the start dies out.")] = 1,
    tolerance: Annotated[float, typer.Option(help="Allowed change between windows, of the range.")] = 1e-6,
    out: Path | None = None,
) -> None:
    """A long run without drift or growth."""
    judged = {"window": window, "skip": skip, "tolerance": tolerance}
    make("endurance", study, out, **request(scene, duration, step, scheme, newton, **judged))


if __name__ == "__main__":
    start(main)
