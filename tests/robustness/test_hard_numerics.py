"""Demanding time steps, starts and records.

Source: the same run in one piece, equilibria, files on disk.
"""

import numpy as np
import pytest
from hard import INF, MOORED, said, sound_run, static, whole, with_

from dolfbuoy.scene import load_scene


def _short(**time) -> dict:
    return with_(load_scene("short").to_dict(), time=time)


@pytest.mark.slow
def test_large_steps(found):
    """`short` with 10 and 100 times the paper's step: 0.1 s, 1 s.  Must show: ends, cut steps said; the mean tension
    stays near that of small steps; the damping is as foretold.
    """
    from dolfbuoy.results.summary import remaining_amplitude

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


def test_tiny_step(found):
    """`short` with dt = 1e-5 s: accelerations divide by 1e-10.  Must show: no noise in the tension, fast Newton."""
    record = sound_run(found, _short(end=2e-4, step=1e-5))
    tension = record.tension_top.values
    found.below("noise of the top tension", np.abs(np.diff(tension, 2)).max() / tension[0], 1e-6)
    found.below("its change in 0.2 ms of calm", np.ptp(tension) / tension[0], 1e-6)
    found.below("iterations per step", record.newton_iterations[1:].mean(), 4)
    found.below("failed steps", record.attrs["failed_steps"], 0)


@pytest.mark.slow
def test_far_start(found):
    """A moored buoy let go 10 m beside and 1 m above its place, tilted by 60 degrees.  Must show: it comes to its
    equilibrium.
    """
    from hard import turned

    scene = with_(MOORED, current={"speed": 0.5}, time={"end": 200.0, "step": 0.1})
    rest = static(scene)
    place = rest.buoy_position.values
    start = {"buoy_position": [place[0] - 10.0, 0.0, 1.0], "buoy_orientation": turned(60.0)}
    record = sound_run(found, with_(scene, initial=start))
    off = np.linalg.norm(record.buoy_position[-1].values - place)
    found.below("from the equilibrium after 200 s", off, 1e-9, " m")
    found.remark(f"{record.attrs['failed_steps']} steps were cut")


def test_inconsistent_velocity(found):
    """A buoy that is to move with 3 m/s along its inextensible, taut, vertical cable.  Must show: the velocity is
    projected: nothing along the cable, no spike of 1/dt in the tension.
    """
    scene = with_(MOORED, cable={"axial_stiffness": INF, "length": 19.6, "elements": 4})
    scene = with_(scene, time={"end": 0.05, "step": 0.005})
    rest = static(scene)
    record = sound_run(found, with_(scene, initial__buoy_velocity=[0.5, 0.0, 3.0]))
    found.below("p_z/M at the start", abs(float(record.linear_momentum[0, 2])) / 700, 1e-6, " m/s")
    ratio = float(record.tension_top.max()) / float(rest.tension_top)
    found.below("largest tension / that at rest", ratio, 1.05)


@pytest.mark.slow
def test_cut_steps(found):
    """`driven-slack` at twenty times its step, Newton allowed three iterations: steps that it cannot take.  Must show:
    cut, retried, grown back to the nominal step, counted and reported.
    """
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
