"""A run that is stopped and resumed equals an uninterrupted run, in every recorded number to the last bit.

Source: the uninterrupted run, bit for bit.
"""

import itertools
import os
import shutil
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from dynamics_helpers import DRAGGED, MOORED, merged
from helpers import REFERENCE
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.results import checkpoint, recorder
from dolfbuoy.results.record import read
from dolfbuoy.scene.buoy import HAS_THEM

GROWTH = [[-20.0, 1.0, 1.0], [-2.0, 1.5, 1.3]]
TOP = {"kind": "prescribed", "position": [12.0, 0.5, -3.5], "amplitude": [0.1, 0.2, 1.0], "period": 5.0, "ramp": 1.0}
TIME = {"end": 0.6, "step": 0.02, "output_every": 0.1}
LINE = {**MOORED["cable"], "axial_stiffness": 1e6, "elements": 3}
HULL = {**MOORED["buoy"], "fairleads": {"side": [1.0, 0.0, 0.2]}}
NETWORK = {  # two buoys on a bed, a clump that sinks to it, and a leg that parts before the run is stopped
    "sea": MOORED["sea"],
    "current": MOORED["current"],
    "waves": merged(MOORED["waves"], ramp=0.2),
    "seabed": {"friction": 0.6},
    "joint": [{"name": "clump", "mass": 300.0, "volume": 0.02, "drag_area": 0.1}],
    "buoy": [{**HULL, "name": "left"}, {**HULL, "name": "right"}],
    "cable": [
        {**LINE, "name": "west", "from": [-10.0, 0.0, -20.0], "to": "left", "length": 26.0},
        {**LINE, "name": "east", "from": [16.0, 3.0, -20.0], "to": "right", "length": 30.0},
        {**LINE, "name": "south", "from": [4.0, -12.0, -20.0], "to": "right.side", "length": 30.0},
        {**LINE, "name": "port", "from": "left.side", "to": "clump", "length": 24.0, "fails_at": {"time": 0.2}},
        {**LINE, "name": "starboard", "from": "clump", "to": "right", "length": 24.0},
    ],
    "time": TIME,
}
SCENES = {
    "moored buoy": merged(MOORED, cable__elements=6, waves__ramp=0.2, time=TIME),
    "irregular sea": merged(
        MOORED,
        cable__elements=6,
        waves=None,
        time=TIME,
    )
    | {"waves": {"spectrum": "jonswap", "significant_height": 1.5, "peak_period": 5.0, "ramp": 0.2}},
    "waves of the hull's own": merged(
        MOORED,
        cable__elements=6,
        waves__ramp=0.2,
        time=TIME,
        **dict.fromkeys((f"buoy__{name}" for name in HAS_THEM), None),
        buoy__potential_flow=str(REFERENCE / "truncated_cylinder.nc"),
        buoy__drift="newman",
    ),
    "steep wave": merged(MOORED, cable__elements=6, waves=None, time=TIME)
    | {"waves": {"theory": "stream", "height": 2.0, "period": 5.0, "ramp": 0.2}},
    "cable": {"sea": MOORED["sea"], "cable": merged(MOORED["cable"], elements=6, top=TOP), "time": TIME},
    "on a bed": {
        "sea": MOORED["sea"],
        "cable": merged(MOORED["cable"], length=30.0, elements=6, top=TOP | {"ramp": 0.2}, marine_growth=GROWTH),
        "seabed": {"friction": 0.6},
        "time": TIME,
    },
    "pulled on a bed, P3-P2": {
        "sea": MOORED["sea"],
        "cable": merged(
            MOORED["cable"], length=30.0, elements=4, top=TOP | {"ramp": 0.2}, position_degree=3, tension_degree=2
        ),
        "seabed": {"friction": 0.6, "start": "pulled"},
        "time": TIME,
    },
    "buoy": {
        "sea": MOORED["sea"],
        "buoy": MOORED["buoy"],
        "waves": merged(MOORED["waves"], ramp=0.2),
        "initial": {"buoy_angular_velocity": [0.1, -0.2, 0.3]},
        "time": TIME,
    },
    "bending": merged(
        MOORED,
        cable__elements=4,
        cable__bending_stiffness=1e5,
        cable__to_end={"direction": [0.0, 0.0, 1.0]},
        waves__ramp=0.2,
        time=TIME,
    ),
    "network": NETWORK,
    "sinker that is dragged": merged(DRAGGED, time=None) | {"time": TIME},
}
SCHEMES = ("backward-euler", "bdf2", "generalized-alpha")


class Stop(Exception):
    """Somebody pulled the plug."""


def stop_after(steps):
    """A `progress` that ends a run after this many steps."""
    count = itertools.count(1)

    def progress(simulation, iterations):
        if next(count) == steps:
            raise Stop

    return progress


@pytest.fixture
def few_checkpoints(monkeypatch):
    """A checkpoint about every eighth step, however fast the machine is: a clock that ticks when it is looked at."""
    ticks = itertools.count()
    monkeypatch.setattr(recorder, "clock", SimpleNamespace(monotonic=lambda: float(next(ticks))))
    monkeypatch.setattr(recorder.Recorder, "pause", 7.0)
    monkeypatch.setattr(recorder.Recorder, "share", 1e9)


def assert_same(run, expected):
    assert set(run.variables) == set(expected.variables)
    for name in expected.variables:
        values = run[name].values
        assert np.array_equal(values, expected[name].values, equal_nan=values.dtype.kind == "f"), name
    for name in set(expected.attrs) - {"created", "wall_time_s"}:
        assert run.attrs[name] == expected.attrs[name], name


def stopped(scene, folder, steps):
    """Rows of the record and of the checkpoint of a run that was broken off."""
    with pytest.raises(Stop):
        dolfbuoy.simulate(scene, out=folder, progress=stop_after(steps))
    return len(read(folder / "results.nc").time), checkpoint.load(folder, 1).rows["time"]


#: Of scenes but this the schemes but the first are slow tests: what they add to the past does not depend on the scheme.
OF_ALL_SCHEMES = "moored buoy"
CASES = [
    pytest.param(name, scheme, h, marks=[pytest.mark.slow] * (name != OF_ALL_SCHEMES and (k > 0 or h is not None)))
    for name, (k, scheme), h in itertools.product(SCENES, enumerate(SCHEMES), (None, 1e-2))
]


@pytest.mark.parametrize(("name", "scheme", "tolerance"), CASES)
def test_bit_for_bit(name, scheme, tolerance, tmp_path, few_checkpoints):
    scene = merged(SCENES[name], time__scheme=scheme, time__tolerance=tolerance)
    if tolerance and "dragged" in name and scheme == "generalized-alpha":
        scene = merged(scene, time__spectral_radius=0.0)  # with more of it a jerk of the line feeds on every step
    expected = dolfbuoy.simulate(scene)
    steps = len(expected.time) - 1
    if tolerance:
        assert np.ptp(expected.time_step.values[1:]) > 1e-4  # the control is at work
    rows, kept = stopped(scene, tmp_path, 3 * steps // 4)
    assert 4 < kept <= rows <= steps
    assert tolerance or kept < rows  # there is something to cut off
    assert_same(dolfbuoy.simulate(resume=tmp_path), expected)


@pytest.mark.parametrize("scheme", SCHEMES[:2])
def test_bit_for_bit_where_the_tension_jumps(scheme, tmp_path, few_checkpoints):
    """A rope that is shaken: its steps are smaller than those asked for, and just then it is stopped."""
    shaken = {"kind": "prescribed", "position": [20.02, 0.0, 0.0], "amplitude": [0.0064, 0.0, 0.0], "period": 0.08}
    cable = {"length": 20.0, "line_density": 1.0, "axial_stiffness": 1e6, "damping": 2e3, "elements": 6, "top": shaken}
    scene = {"gravity": 0.0, "cable": cable | {"slack": "tension-only"}, "time": {"end": 0.3, "step": 0.04}}
    scene = merged(scene, time__scheme=scheme)
    expected = dolfbuoy.simulate(scene)
    assert expected.attrs["rejected_steps"] > 3
    stopped(scene, tmp_path, 10)
    assert_same(dolfbuoy.simulate(resume=tmp_path), expected)


def test_stopped_again_and_again(tmp_path, few_checkpoints):
    scene = merged(SCENES["moored buoy"], time__scheme="bdf2")
    stopped(scene, tmp_path, 13)
    for _ in range(2):
        with pytest.raises(Stop):
            dolfbuoy.simulate(resume=tmp_path, progress=stop_after(10))
    assert_same(dolfbuoy.simulate(resume=tmp_path), dolfbuoy.simulate(scene))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_after_a_failed_solve(scheme, tmp_path, few_checkpoints, monkeypatch):
    """For a while only small steps succeed; later none at all, until the trouble has passed."""
    scene, step, broken = merged(SCENES["moored buoy"], time__scheme=scheme), Simulation.step, [0.4]

    def troubled(simulation, h, judge=None):
        if simulation.t >= broken[0] or (0.1 <= simulation.t < 0.3 and h > 0.006):
            raise SolveError("DIVERGED_MAX_IT")
        return step(simulation, h, judge)

    monkeypatch.setattr(Simulation, "step", troubled)
    with pytest.raises(SolveError, match=r"At t = 0\.4 s.*DIVERGED_MAX_IT"):
        dolfbuoy.simulate(scene, out=tmp_path)
    assert checkpoint.load(tmp_path, 1).t > 0.2
    broken[0] = np.inf
    expected = dolfbuoy.simulate(scene)
    assert expected.attrs["failed_steps"] > 5
    assert_same(dolfbuoy.simulate(resume=tmp_path), expected)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_finished_run_can_be_lengthened(scheme, tmp_path):
    scene = merged(SCENES["moored buoy"], time__scheme=scheme)
    dolfbuoy.simulate(scene, out=tmp_path, time__end=0.3)
    assert_same(dolfbuoy.simulate(resume=tmp_path, time__end=0.6), dolfbuoy.simulate(scene))
    assert dolfbuoy.load_scene(tmp_path / "scene.toml") == dolfbuoy.load_scene(scene)


# -- several ranks -----------------------------------------------------------------------------------------------------

RANKS = """
import itertools, json, shutil, sys
from types import SimpleNamespace
import dolfbuoy
from dolfbuoy.results import recorder

ticks, what = itertools.count(), sys.argv[2]
recorder.clock = SimpleNamespace(monotonic=lambda: float(next(ticks)))
recorder.Recorder.pause, recorder.Recorder.share = 7.0, 1e9

def keep(simulation, iterations):
    if simulation.control.accepted == 20 and simulation.comm.rank == 0:
        shutil.copytree(name + ", whole", name)

for name, scene in json.load(open(sys.argv[1])).items():
    if what == "resume":
        dolfbuoy.simulate(resume=name)
    else:
        dolfbuoy.simulate(scene, out=name + ", whole", progress=keep)
"""


#: What `network` has not; its parts alone are slow tests.
ON_RANKS = [*(("moored buoy", scheme) for scheme in SCHEMES), ("network", "bdf2"), ("sinker that is dragged", "bdf2")]
PARTS_ON_RANKS = [("cable", "bdf2"), ("on a bed", "bdf2"), ("buoy", "bdf2")]


@pytest.mark.mpi
@needs_mpirun
@pytest.mark.parametrize("cases", [ON_RANKS, pytest.param(PARTS_ON_RANKS, marks=pytest.mark.slow)])
def test_two_ranks(tmp_path, cases):
    """What was kept of a run in the middle is taken up, and is the run that went on."""
    scenes = {f"{name}, {scheme}": merged(SCENES[name], time__scheme=scheme) for name, scheme in cases}
    scenes["adaptive"] = merged(SCENES["moored buoy"], time__scheme="bdf2", time__tolerance=1e-2)
    for what in ("keep", "resume"):
        done = start_scenes(2, scenes, tmp_path, RANKS, what)
        assert done.returncode == 0, done.stderr[-3000:]
        if what == "keep":
            for name in scenes:
                assert 4 < checkpoint.load(tmp_path / name, 2).rows["time"] < 21
            with pytest.raises(InputError, match=r"on 2 MPI ranks; it cannot be resumed on 1"):
                dolfbuoy.simulate(resume=tmp_path / "adaptive")
    for name in scenes:
        run, whole = (read(tmp_path / folder / "results.nc") for folder in (name, f"{name}, whole"))
        assert_same(run, whole)


# -- the command line --------------------------------------------------------------------------------------------------


def command(*arguments):
    return [sys.executable, "-m", "dolfbuoy.commands.main", *map(str, arguments)]


def finished(*arguments, **options):
    return subprocess.run(command(*arguments), capture_output=True, text=True, timeout=300, **options)


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGKILL])
def test_signal_in_mid_run(tmp_path, number):
    scene = dolfbuoy.load_scene(merged(SCENES["moored buoy"], time__end=1000.0, time__scheme="bdf2"))
    scene.save(tmp_path / "input.toml")
    folder = tmp_path / "run"
    process = subprocess.Popen(
        command("run", tmp_path / "input.toml", "--out", folder, "--no-plot"),
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a background shell ignores it
    )
    reached, deadline = 0.0, time.monotonic() + 120
    while reached == 0:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.1)
        reached = checkpoint.load(folder, 1).t if (folder / checkpoint.NAME).exists() else 0.0
    process.send_signal(number)
    assert process.wait(60) in (130, -signal.SIGKILL)
    end = np.ceil(checkpoint.load(folder, 1).t) + 1.0
    done = finished("run", "--resume", folder, "--t-end", end, "--no-plot")
    assert done.returncode == 0, done.stderr
    assert_same(read(folder / "results.nc"), dolfbuoy.simulate(scene, time__end=end))


def test_a_complete_run_says_so(call, tmp_path):
    dolfbuoy.simulate(SCENES["buoy"], out=tmp_path, time__end=0.1)
    before = (tmp_path / "results.nc").read_bytes()
    code, out, _ = call("run", "--resume", tmp_path)
    assert code == 0
    assert "already complete: t = 0.1 s" in out
    assert (tmp_path / "results.nc").read_bytes() == before
    assert len(dolfbuoy.simulate(resume=tmp_path).time) == 6


def edit(path, old, new):
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def other_format(path):
    content = dict(np.load(path)) | {"format": np.array(99)}
    np.savez(path, **content)


REFUSALS = {
    "no run": (lambda d: shutil.rmtree(d), [], ["no run", "scene.toml"]),
    "no checkpoint": (lambda d: (d / "checkpoint.npz").unlink(), [], ["no run", "checkpoint.npz"]),
    "no record": (lambda d: (d / "results.nc").unlink(), [], ["no run", "results.nc"]),
    "another scene": (lambda d: edit(d / "scene.toml", "\nmass = 400.0", "\nmass = 410.0"), [], ["buoy.mass"]),
    "another format": (lambda d: other_format(d / "checkpoint.npz"), [], ["format 99", "format 5"]),
    "half a file": (lambda d: os.truncate(d / "checkpoint.npz", 1000), [], ["checkpoint.npz", "not a checkpoint"]),
    "no file": (lambda d: (d / "checkpoint.npz").write_text("x"), [], ["checkpoint.npz", "not a checkpoint"]),
    "end in the past": (lambda d: None, ["--t-end", "0.04"], ["0.04", "t = 0.1 s"]),
    "other settings": (lambda d: None, ["--set", "buoy.mass=410"], ["--resume", "--set"]),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals_are_one_sentence(case, call, tmp_path):
    spoil, options, words = REFUSALS[case]
    dolfbuoy.simulate(SCENES["buoy"], out=tmp_path / "run", time__end=0.1)
    spoil(tmp_path / "run")
    code, _, err = call("run", "--resume", tmp_path / "run", *options)
    assert code == 2
    assert err.strip().count("\n") == 0
    for word in words:
        assert word in err


def test_a_record_shorter_than_its_checkpoint_is_refused(tmp_path):
    dolfbuoy.simulate(SCENES["buoy"], out=tmp_path, time__end=0.1)
    old = (tmp_path / "results.nc").read_bytes()
    dolfbuoy.simulate(resume=tmp_path, time__end=0.2)
    (tmp_path / "results.nc").write_bytes(old)
    with pytest.raises(InputError, match="shorter than at its checkpoint"):
        dolfbuoy.simulate(resume=tmp_path, time__end=0.3)


def test_scene_or_resume(call, tmp_path):
    for arguments in (["run"], ["run", "short", "--resume", tmp_path]):
        code, _, err = call(*arguments)
        assert code == 2
        assert "SCENE: must be given, or --resume DIR, and not both" in err


def test_a_new_run_drops_the_old_checkpoint(tmp_path, monkeypatch):
    """Killed before its first checkpoint, it must not be taken up at that of another run."""

    def killed(*_):
        raise Stop

    dolfbuoy.simulate(SCENES["buoy"], out=tmp_path, time__end=0.1)
    monkeypatch.setattr(checkpoint, "write", killed)
    with pytest.raises(Stop):
        dolfbuoy.simulate(SCENES["buoy"], out=tmp_path, overwrite=True)
    with pytest.raises(InputError, match=r"no run that can be resumed: it has no checkpoint\.npz"):
        dolfbuoy.simulate(resume=tmp_path)


# -- zero length ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "tolerance"), [*((name, None) for name in SCENES), ("moored buoy", 1e-2)])
def test_zero_length(name, tolerance, tmp_path):
    """The record holds the initial state, which is also that of a longer run."""
    scene = merged(SCENES[name], time__tolerance=tolerance)
    run = dolfbuoy.simulate(scene, out=tmp_path, time__end=0.0)
    longer = dolfbuoy.simulate(scene, time__end=0.02)
    assert run.time.values.tolist() == [0.0]
    for variable in run.data_vars:
        in_time = longer[variable].dims[0] in ("time", "frame")
        first = longer[variable].values[:1] if in_time else longer[variable].values
        nowhere = variable in ("touchdown", "parted_at")  # nothing lies, nothing has parted
        if not nowhere:
            assert np.isfinite(run[variable].values).all(), variable
        if "_minimum" in variable or "_maximum" in variable:
            continue  # of all steps, of which one run has more
        assert np.array_equal(run[variable].values, first, equal_nan=nowhere), variable


def test_zero_length_on_the_command_line(call, tmp_path):
    code, out, err = call("run", "short", "--t-end", "0", "--out", tmp_path)
    assert code == 0, err
    assert "tension at the top" in out
    assert (tmp_path / "figures" / "tension.png").stat().st_size > 5000
