"""Hard demands on steps, starts and records."""

import os
import signal
import subprocess
import sys
import tempfile
import time as clock
from pathlib import Path

import numpy as np
from mpi4py import MPI

from ...api import simulate
from ...results.record import read
from ...scene import load_scene
from .case import hard_case
from .tools import INF, MOORED, run, said, sound_run, static, whole, with_


def _short(**time) -> dict:
    return with_(load_scene("short").to_dict(), time=time)


@hard_case
def large_steps(found):
    from ...results.summary import remaining_amplitude

    records = {step: whole(_short(end=20.0, step=step)) for step in (0.02, 0.1, 1.0)}
    mean, swing = {}, {}
    for step, record in records.items():
        last = record.tension_top.sel(time=slice(10.0, None))
        mean[step], swing[step] = float(last.mean()), float(last.max() - last.min())
        found.finite(record)
        cut = record.attrs["failed_steps"]
        found.remark(f"step {step} s: {cut} steps cut")
        if cut:
            found.says(said(_short(end=20.0, step=step), record), "failed and were retried")
    found.close("mean top tension at 0.1 s", mean[0.1], mean[0.02], 0.05, " N")
    found.holds(
        f"swings {swing[0.02]:.4g}, {swing[0.1]:.4g}, {swing[1.0]:.4g} N fall with the step",
        swing[0.02] > swing[0.1] > swing[1.0],
    )
    left = remaining_amplitude(5.0, load_scene(_short(end=120.0, step=0.1)))
    found.close("left of a free 5 s motion after 120 s at 0.1 s", left, 8.266e-05, 1e-3)


@hard_case
def tiny_step(found):
    record = sound_run(found, _short(end=2e-4, step=1e-5))
    tension = record.tension_top.values
    found.below("noise of the top tension", np.abs(np.diff(tension, 2)).max() / tension[0], 1e-6)
    found.below("its change in 0.2 ms of calm", np.ptp(tension) / tension[0], 1e-6)
    found.below("iterations per step", record.newton_iterations[1:].mean(), 4)
    found.below("failed steps", record.attrs["failed_steps"], 0)


@hard_case
def far_start(found):
    from .buoy import turned

    scene = with_(MOORED, current={"speed": 0.5}, time={"end": 200.0, "step": 0.1})
    rest = static(scene)
    place = rest.buoy_position.values
    start = {"buoy_position": [place[0] - 10.0, 0.0, 1.0], "buoy_orientation": turned(60.0)}
    record = sound_run(found, with_(scene, initial=start))
    off = np.linalg.norm(record.buoy_position[-1].values - place)
    found.below("from the equilibrium after 200 s", off, 1e-9, " m")
    found.remark(f"{record.attrs['failed_steps']} steps were cut")


@hard_case
def inconsistent_velocity(found):
    scene = with_(MOORED, cable={"axial_stiffness": INF, "length": 19.6, "elements": 4})
    scene = with_(scene, time={"end": 0.05, "step": 0.005})
    rest = static(scene)
    record = sound_run(found, with_(scene, initial__buoy_velocity=[0.5, 0.0, 3.0]))
    found.below("p_z/M at the start", abs(float(record.linear_momentum[0, 2])) / 700, 1e-6, " m/s")
    ratio = float(record.tension_top.max()) / float(rest.tension_top)
    found.below("largest tension / that at rest", ratio, 1.05)


@hard_case
def cut_steps(found):
    scene = with_(load_scene("driven-slack").to_dict(), solver__petsc={"snes_max_it": 3})
    scene = with_(scene, time={"end": 10.0, "step": 0.2})
    record = whole(scene)
    found.finite(record)
    steps = record.time_step.values[1:]
    found.holds(f"{record.attrs['failed_steps']} steps failed", record.attrs["failed_steps"] > 0)
    cut = np.flatnonzero(steps < 0.19)
    found.holds(f"smallest step {steps.min():.3g} s", len(cut) > 0)
    found.holds("full steps after the first cut", len(cut) > 0 and np.any(steps[cut[0] :] > 0.199))
    found.below("end of the record off by", abs(float(record.time[-1]) - 10.0), 1e-9, " s")
    found.says(said(scene, record), "failed and were retried")


@hard_case
def zero_length(found):
    record = sound_run(found, _short(end=0.0, step=0.01))
    found.holds("one instant, t = 0", record.time.values.tolist() == [0.0])


@hard_case
def kill_9(found):
    with tempfile.TemporaryDirectory() as folder:
        process = _start("run", "hanging-chain", "--out", folder, "--t-end", "1e5", "--no-plot")
        file = Path(folder) / "results.nc"
        _wait(lambda: file.is_file() and read(file).sizes["time"] > 100)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        record = read(file)
    found.holds(f"ended by signal {-process.returncode}", process.returncode == -signal.SIGKILL)
    found.finite(record)
    time = record.time.values
    found.holds(f"{len(time)} instants in order", bool(np.all(np.diff(time) > 0)))


@hard_case
def resume(found):
    for scheme in ("backward-euler", "bdf2", "generalized-alpha"):
        scene = with_(MOORED, waves={"period": 5.0, "amplitude": 0.5, "ramp": 0.2})
        scene = with_(scene, cable__elements=6, time={"end": 0.4, "step": 0.02, "scheme": scheme})
        at_once = whole(scene)
        with tempfile.TemporaryDirectory() as folder:
            run(scene, out=folder, time__end=0.14)
            parts = simulate(resume=folder, comm=MPI.COMM_SELF, time__end=0.4)
        ends = (at_once.sizes["time"], parts.sizes["time"])
        found.holds(f"{scheme}: {ends[0]} and {ends[1]} instants", ends[0] == ends[1])
        series = [name for name, v in at_once.variables.items() if v.dims[:1] == ("time",)]
        same = all(np.array_equal(at_once[name].values, parts[name].values) for name in series)
        found.holds(f"{scheme}: all {len(series)} series identical", same)


@hard_case
def disk_full(found):
    limit = 600_000
    small = f"from mpi4py import MPI; import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit})); "
    run(with_(load_scene("hanging-chain").to_dict(), time__end=0.01))  # its forms are compiled without that limit
    with tempfile.TemporaryDirectory() as folder:
        process = _start("run", "hanging-chain", "--out", folder, "--t-end", "1e5", "--no-plot", before=small)
        _, errors = process.communicate(timeout=300)
        sentence = errors.decode().strip().splitlines()[-1]
        record = read(Path(folder) / "results.nc")
    found.holds(f"exit code {process.returncode}", process.returncode == 1)
    found.says(sentence.replace(folder, "."), "cannot read or write")
    found.holds("no traceback", b"Traceback" not in errors)
    found.finite(record)
    found.holds(f"{record.sizes['time']} instants on disk", record.sizes["time"] > 0)


def _start(*arguments, before=""):
    """dolfbuoy's command in a process of its own, outside of any MPI run; before: statements that come first."""
    mpi, keep = ("OMPI_", "PMIX_", "PRTE_", "PMI_"), ("OMPI_MCA", "OMPI_ALLOW")
    environment = {k: v for k, v in os.environ.items() if not k.startswith(mpi) or k.startswith(keep)}
    call = [sys.executable, "-c", f"{before}from dolfbuoy.commands.main import main; main()", *arguments]
    return subprocess.Popen(call, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def _wait(ready, seconds=120.0):
    begin = clock.monotonic()
    while not ready():
        if clock.monotonic() - begin > seconds:
            raise TimeoutError(f"nothing happened in {seconds:g} s")
        clock.sleep(0.05)
