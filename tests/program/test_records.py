"""Files of a run on disk: while running, after a kill, and for running it again; and iteration counts.

Source: the file on disk; kills at arbitrary times.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
import warnings

import netCDF4
import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged

import dolfbuoy
import dolfbuoy.results.record
from dolfbuoy import InputError, figures, load_scene
from dolfbuoy.results.parts import alone
from dolfbuoy.results.quantities import QUANTITIES
from dolfbuoy.results.record import read, seal

SCENE = merged(MOORED, cable__elements=6, waves__ramp=0.5, time={"end": 0.3, "step": 0.02, "output_every": 0.1})

LABELS = {"xyz", "quaternion", "cable", "buoy", "attachment", "anchor"}
ALWAYS = {"time", "time_step", "newton_iterations"}
CABLE = {"tension_top", "tension_anchor", "anchor_force", "end_tension"}
CABLE |= {"frame", "cable_position", "cable_tension", "s", "s_cell"}
CABLE |= {f"cable_{what}_{fold}" for what in ("position", "tension") for fold in ("minimum", "maximum")}
BUOY = {
    "buoy_position",
    "buoy_orientation",
    "linear_momentum",
    "angular_momentum",
    "cone_angle",
    "roll",
    "pitch",
    "yaw",
}
MOORING = {"mooring_point", "mooring_force"}
WATER = {"surface_elevation", "displaced_mass"}
UNITS = {
    "time": "s",
    "time_step": "s",
    "frame": "s",
    "tension_top": "N",
    "tension_anchor": "N",
    "anchor_force": "N",
    "end_tension": "N",
    "mooring_force": "N",
    "cable_tension": "N",
    "buoy_position": "m",
    "mooring_point": "m",
    "cable_position": "m",
    "surface_elevation": "m",
    "s": "m",
    "displaced_mass": "kg",
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return folder, dolfbuoy.simulate(SCENE, out=folder)


def test_every_variable_is_there(finished):
    folder, run = finished
    with xr.open_dataset(folder / "results.nc", decode_times=False) as on_disk:
        names = set(on_disk.variables)
        assert names >= ALWAYS | CABLE | BUOY | MOORING | WATER
        for name in names - LABELS:
            assert on_disk[name].attrs["units"], name
            assert on_disk[name].attrs["long_name"], name
            assert np.all(np.isfinite(on_disk[name])), name
        for name, unit in UNITS.items():
            assert on_disk[name].attrs["units"] == unit, name
        assert on_disk.identical(run)
    for attribute in ("unknowns", "effects", "wall_time_s", "version_dolfinx", "version_petsc"):
        assert attribute in run.attrs
    assert run.attrs["version_dolfbuoy"] == dolfbuoy.__version__
    # 6 elements: 6 free nodes of 3, 6 tensions, and the 19 of the buoy
    assert run.attrs["unknowns"] == 6 * 3 + 6 + 19


def test_steps_lie_together_in_the_file_and_frames_alone(finished):
    """So a series is read by few pieces, and a frame by one."""
    with netCDF4.Dataset(finished[0] / "results.nc") as file:
        assert file["tension_top"].chunking()[0] > 100
        assert file["cable_position"].chunking()[0] == 1


def test_variables_are_consistent(finished):
    run = alone(finished[1])
    assert run.time.values == pytest.approx(0.02 * np.arange(16), abs=1e-12)
    assert run.time_step.values[1:] == pytest.approx(np.diff(run.time), abs=1e-12)
    assert run.newton_iterations.values[1:].min() >= 1
    assert run.frame.values == pytest.approx([0.0, 0.1, 0.2, 0.3], abs=1e-12)
    assert run.s.values == pytest.approx(np.linspace(0, 22, 7), abs=1e-12)
    assert run.cable_tension.shape == (4, 6)
    assert run.tension_top.values == pytest.approx(np.linalg.norm(run.end_tension, axis=1), rel=1e-14)
    assert np.array_equal(run.end_tension, -run.mooring_force)
    at = [0, 5, 10, 15]
    assert run.cable_position.values[:, -1] == pytest.approx(run.mooring_point.values[at], abs=1e-10)
    assert run.cable_tension.values[:, 0] == pytest.approx(run.tension_anchor.values[at], rel=1e-12)
    assert list(run.xyz.values) == ["x", "y", "z"]
    # the surface above C is that of the wave
    t, x = run.time.values, run.buoy_position.values[:, 0]
    ramp = np.where(t < 0.5, 0.5 * (1 - np.cos(np.pi * t / 0.5)), 1.0)
    omega = 2 * np.pi / 5.0
    k = omega**2 / 9.81
    for _ in range(100):
        k = omega**2 / (9.81 * np.tanh(k * 20.0))
    assert run.surface_elevation.values == pytest.approx(0.8 * ramp * np.cos(k * x - omega * t), abs=1e-10)


@pytest.fixture(scope="module")
def files(finished):
    """Paths of the records of a run and of an equilibrium."""
    folder, _ = finished
    dolfbuoy.solve_static(SCENE, out=folder)
    return {"run": folder / "results.nc", "static": folder / "static.nc"}


@pytest.mark.parametrize("kind", ["run", "static"])
def test_files_tell_what_they_hold(files, kind):
    """As CF asks for it: conventions, units, names; the scene that reproduces them; where nodes and elements are."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with xr.open_dataset(files[kind]) as record:
            record.load()
    assert record.attrs["Conventions"] == "CF-1.9"
    assert record.attrs["source"] == f"dolfbuoy {dolfbuoy.__version__}"
    assert load_scene(tomllib.loads(record.attrs["scene"])) == load_scene(SCENE)
    for name, variable in record.variables.items():
        assert variable.dtype.kind in (
            "i" if name in QUANTITIES and QUANTITIES[name].integer else "OU" if name in LABELS else "f"
        ), name
        assert variable.attrs["long_name"], name
        assert name in LABELS or variable.attrs["units"], name
        assert "_FillValue" not in variable.encoding, name
    assert set(record.cable_position.coords) >= {"s", "xyz"}
    assert set(record.cable_tension.coords) >= {"s_cell"}
    assert record.s_cell.values == pytest.approx((record.s.values[1:] + record.s.values[:-1]) / 2)
    named = {v.attrs["standard_name"]: n for n, v in record.variables.items() if "standard_name" in v.attrs}
    assert named == {
        "sea_surface_height_above_mean_sea_level": "surface_elevation",
        "platform_roll_starboard_down": "roll",
        "platform_pitch_fore_down": "pitch",
        "platform_yaw_fore_port": "yaw",
    }


def test_there_is_a_dimension_also_of_what_there_is_one(files):
    """Cable, buoy and attachment, with their names; which cable and segment nodes and elements are of."""
    run, static = (read(file) for file in files.values())
    for record, first in ((run, ("time",)), (static, ())):
        assert (record.cable.item(), record.buoy.item(), record.attachment.item()) == ("cable", "buoy", "cable.to")
        assert record.tension_top.dims == (*first, "cable")
        assert record.anchor_force.dims == (*first, "cable", "xyz")
        assert record.buoy_position.dims == (*first, "buoy", "xyz")
        assert record.mooring_force.dims == (*first, "attachment", "xyz")
        for name in ("cable_of_node", "cable_of_cell", "segment_of_cell"):
            assert not record[name].any()


def test_the_same_scene_in_double_brackets_has_the_same_record(finished):
    """But for its text and its times."""
    respelled = dict(SCENE, cable=[SCENE["cable"]], buoy=[SCENE["buoy"]])
    other = dolfbuoy.simulate(respelled)
    for name in finished[1].variables:
        assert other[name].dims == finished[1][name].dims, name
        assert np.array_equal(other[name].values, finished[1][name].values), name


OLD = r"was written by an older dolfbuoy \(0\.2\.0\), without the dimensions cable and buoy"


def as_of_before(file):
    """Make a record one that dolfbuoy 0.2.0 could have written, as far as its attributes say."""
    with netCDF4.Dataset(file, "a") as record:
        record.delncattr("format")
        record.version_dolfbuoy = "0.2.0"
    seal(file)


def test_an_old_record_is_refused(finished, tmp_path, call):
    """In one sentence that says why and what to do, by whatever reads it: commands and Python."""
    shutil.copytree(finished[0], folder := tmp_path / "old")
    as_of_before(folder / "results.nc")
    for command in (["plot", folder], ["page", folder], ["statistics", folder], ["run", "--resume", folder]):
        code, _, errors = call(*command)
        assert code == 2, command
        assert re.search(OLD, " ".join(errors.split())), command
        assert "Traceback" not in errors
    with pytest.raises(InputError, match=OLD):
        dolfbuoy.simulate(SCENE, out=folder)
    with xr.open_dataset(folder / "results.nc") as old, pytest.raises(InputError, match=OLD):
        figures.tension(old)
    again = dolfbuoy.simulate(SCENE, out=folder, overwrite=True)
    assert again.tension_top.dims == ("time", "cable")


def test_an_old_checkpoint_is_refused(finished, tmp_path, call):
    shutil.copytree(finished[0], folder := tmp_path / "old")
    with np.load(folder / "checkpoint.npz") as leaves:
        np.savez(folder / "checkpoint.npz", **(dict(leaves) | {"format": np.array(3)}))
    code, _, errors = call("run", "--resume", folder, "--t-end", "0.4")
    assert code == 2
    assert "has format 3, and this version resumes format 5 only" in " ".join(errors.split())


def test_run_and_equilibrium_say_the_same_of_a_variable(files):
    run, static = (dolfbuoy.results.record.read(file) for file in files.values())
    assert len(static.variables) > 20
    for name in set(static.variables):
        assert static[name].attrs == run[name].attrs, name
    assert set(static.coords) == set(run.coords) - {"time", "frame"}


def test_a_scene_of_any_length_is_in_the_record(tmp_path):
    """HDF5 keeps no more than 64 kB of an attribute in one place."""
    points = np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, -3.0], 5000).tolist()
    scene = {
        "title": "A rope of 3 m at 60°",
        "cable": {"length": 3.0, "line_density": 2.0, "elements": 4, "top": {"kind": "free"}},
        "initial": {"kind": "polyline", "points": points},
        "time": {"end": 0.02, "step": 0.01},
    }
    run = dolfbuoy.simulate(scene, out=tmp_path)
    assert len(run.attrs["scene"]) > 2**16
    assert load_scene(tomllib.loads(run.attrs["scene"])) == load_scene(scene)


def test_absent_parts_leave_no_variables():
    scene = {
        "cable": {"length": 3.0, "line_density": 2.0, "elements": 4, "top": {"kind": "free", "force": [1.0, 2.0, 0.0]}},
        "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.8, 0.0, -2.4]]},
        "time": {"end": 0.05, "step": 0.01},
    }
    run = alone(dolfbuoy.simulate(scene))
    assert not (BUOY | MOORING | WATER) & set(run.variables)
    assert set(run.variables) >= ALWAYS | CABLE
    assert run.end_tension.values == pytest.approx(np.tile([1.0, 2.0, 0.0], (6, 1)))


def test_scene_file_reproduces_the_run(finished, tmp_path):
    folder, run = finished
    assert load_scene(folder / "scene.toml") == load_scene(SCENE)
    again = dolfbuoy.simulate(folder / "scene.toml", out=tmp_path)
    for name in run.variables:
        assert np.array_equal(run[name].values, again[name].values), name
    assert (tmp_path / "scene.toml").read_text() == (folder / "scene.toml").read_text()


LONG_RUN = """
import json, sys
import dolfbuoy
from dolfbuoy.results.recorder import Recorder

Recorder.pause, Recorder.share = 0.2, 0.5  # what is computed comes to the disk soon
dolfbuoy.simulate(json.loads(sys.argv[1]), out=sys.argv[2])
"""


def test_readable_while_running_and_after_a_kill(tmp_path):
    scene = merged(SCENE, time={"end": 20000.0, "step": 0.02, "output_every": 0.1})
    process = subprocess.Popen(
        [sys.executable, "-c", LONG_RUN, json.dumps(scene), str(tmp_path)],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    file, lengths = tmp_path / "results.nc", []
    try:
        limit = time.monotonic() + 120
        while len(set(lengths)) < 3 and time.monotonic() < limit:
            assert process.poll() is None, "the run ended by itself"
            if file.exists():
                with xr.open_dataset(file, decode_times=False) as run:
                    lengths.append(len(run.load().time))
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert len(set(lengths)) >= 3
    assert lengths == sorted(lengths)
    with xr.open_dataset(file, decode_times=False) as run:
        run = run.load()
    assert len(run.time) >= lengths[-1] > 10
    assert run.time.values == pytest.approx(0.02 * np.arange(len(run.time)), abs=1e-9)
    for name in run.variables:
        assert np.all(run[name].values == run[name].values), name  # no fill values: every row is complete
    last_frame = np.floor(run.time.values[-1] / 0.1 + 1e-6) * 0.1
    assert run.frame.values == pytest.approx(np.arange(0, last_frame + 0.05, 0.1), abs=1e-9)
    # what is on disk is the start of the run that was not killed
    whole = dolfbuoy.simulate(SCENE)
    n = len(whole.time)
    assert run.buoy_position.values[:n] == pytest.approx(whole.buoy_position.values, rel=1e-12)


@pytest.mark.parametrize("name", ["short", "long"])
def test_iterations_of_the_shipped_scenes(name):
    """At dt = 0.01 s at most 3.5 Newton iterations a step on average, and no step fails."""
    run = dolfbuoy.simulate(load_scene(name, time__end=5.0, time__step=0.01))
    assert run.attrs["failed_steps"] == 0
    assert len(run.time) == 501
    assert run.newton_iterations.values[1:].mean() <= 3.5
    assert np.abs(run.buoy_position - run.buoy_position[0]).max() > 0.05


def test_iterations_of_a_moored_buoy():
    """The same for a short cable in waves and current."""
    run = dolfbuoy.simulate(merged(MOORED, waves__ramp=1.0, time={"end": 3.0, "step": 0.01}))
    assert run.attrs["failed_steps"] == 0
    assert run.newton_iterations.values[1:].mean() <= 3.5
    assert np.abs(run.buoy_position - run.buoy_position[0]).max() > 0.2
