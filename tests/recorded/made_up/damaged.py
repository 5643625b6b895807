"""Files and folders that are not what they must be, each with the sentence it ends in."""

import json
import os
import shutil
from contextlib import chdir
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from unittest.mock import patch

import h5py
import numpy as np
import xarray as xr
from told import MOORED, refused

import dolfbuoy
from dolfbuoy import load_scene, writing
from dolfbuoy.elsewhere import _check_temporary_folder
from dolfbuoy.formats import files
from dolfbuoy.linear.potential_flow import read_capytaine
from dolfbuoy.model import feasible, memory_fit
from dolfbuoy.results import checkpoint, folder, paraview, record, running, statistics
from dolfbuoy.scene import potential_flow, stream, wave_files
from dolfbuoy.scene.buoy import HAS_THEM

REFERENCE = Path(__file__).parents[2] / "reference"
RESULTS = ("results.nc", "scene.toml", checkpoint.NAME)


def of_potential_flow():
    """A file of Capytaine without what is read of it, or with what cannot be."""
    good = xr.load_dataset(REFERENCE / "truncated_cylinder.nc")
    print(sorted(good), dict(good.sizes), f"accepted {potential_flow.fault_of(good)!r}")
    finite = good.isel(omega=np.flatnonzero(np.isfinite(good.omega.values)))
    force = {name: good[name] for name in good if "complex" in good[name].dims}
    other = {
        "no added mass": good.drop_vars("added_mass"),
        "no force": good.drop_vars(list(force)),
        "no omega = inf": finite,
        "off the axis": good.assign(rotation_center=("point", [0.0, 1e-3, -1.0])),
        "on the axis": good.assign(rotation_center=("point", [0.0, 0.0, -1.0])),
        "other waves": good.assign_coords(wave_direction=good.wave_direction + 1.0),
        "no heave": good.assign_coords(radiating_dof=[str(x.values) + "!" for x in good.radiating_dof]),
        "negative": good.assign(radiation_damping=-good.radiation_damping),
        "no number": good.assign(added_mass=good.added_mass * np.nan),
        "drift": good.isel(drift_row=[0, 1, 2]),
        "few": good.isel(omega=[0, 1, -1]),
    }
    for name, data in other.items():
        try:
            print(name, "|", potential_flow.fault_of(data) or "accepted")
        except (KeyError, AttributeError) as error:
            print(name, "|", type(error).__name__)
    table = potential_flow._read(good)
    buoy = MOORED["buoy"] | {"added_mass": 0.0, "axial_added_mass": 0.0}
    buoy = {key: value for key, value in buoy.items() if key not in HAS_THEM}
    scene = MOORED | {"buoy": buoy | {"potential_flow": table}}
    refused(
        partial(load_scene, scene, **{"buoy.potential_flow.omega": table["omega"][::-1]}),
        partial(load_scene, scene, **{"buoy.potential_flow.damping": table["damping"][:-1]}),
        partial(load_scene, scene, **{"buoy.potential_flow": "words.toml"}),
        partial(load_scene, scene, gravity=0.0, waves=None),
        partial(load_scene, scene | {"waves": {"theory": "stream", "height": 0.3, "wavelength": 30.0, "order": 9}}),
        partial(load_scene, scene, **{"buoy.drift": "newman", "buoy.potential_flow.mean_drift": None}),
        partial(load_scene, scene, **{"buoy.memory_order": 21}),
    )
    waves = good.isel(omega=np.flatnonzero(np.isfinite(good.omega.values) & (good.omega.values > 0)))
    for name, data in {"backwards": waves.assign_coords(omega=-waves.omega), "empty": waves * np.nan}.items():
        Path(f"{name}.nc").unlink(missing_ok=True)
        data.to_netcdf(f"{name}.nc")
        refused(partial(read_capytaine, f"{name}.nc"))
    omega = np.linspace(0.5, 3.0, 9)
    with patch.object(memory_fit, "_fit", lambda *_: []):
        try:
            memory_fit.fitted(omega, np.ones((9, 1, 1)), np.ones((9, 1, 1)), 2)
        except ValueError as error:
            print(error)


def refused_value(*calls):
    """Print the sentences of values, which the scene puts behind the name of the key."""
    for call in calls:
        try:
            print(f"accepted: {call()!r:.80}")
        except ValueError as error:
            print(f"refused: {' '.join(str(error).split())}")


def of_tables():
    """Files of tables over time, frequency or place."""
    for name, text in {
        "words.csv": "t, eta\n0, 1\nlater, 2\n",
        "short.csv": "# of one wave\n0, 1\n1\n",
        "named.csv": "t; eta\n\n0; 1 # first\n1  2\n",
        "header.csv": "t, eta\n",
        "long.csv": "0 1 2\n",
    }.items():
        Path(name).write_text(text)
        refused_value(lambda name=name: wave_files._columns(Path(name), 2))
    Path("bytes.csv").write_bytes(b"\xff\xfe0 1\n")
    t, freq = ("time", [2.0, 3.0]), ("freq", [0.1, 0.2])
    level, flow = ("depth", [0.0, 9.0]), (("time", "depth"), [[0.1, 0.2], [0.3, 0.4]])
    for name, data in {
        "still": xr.Dataset({"x": ("time", [0.0, 1.0])}, {"time": t}),
        "wide": xr.Dataset({"x": flow, "time": t}),
        "weeks": xr.Dataset({"u": flow, "v": flow}, {"time": (*t, {"units": "weeks since then"}), "depth": level}),
        "line": xr.Dataset({"u": ("time", [0.1, 0.2]), "v": ("time", [0.1, 0.2])}, {"time": t}),
        "sea": xr.Dataset({"efth": ("freq", [1.0, 2.0])}, {"freq": freq}),
    }.items():
        data.to_netcdf(f"{name}.nc")
    refused_value(
        lambda: wave_files._columns(Path("bytes.csv"), 2),
        lambda: wave_files._motions(Path("still.nc")),
        lambda: wave_files._motions(Path("wide.nc")),
        lambda: wave_files._stream(Path("weeks.nc")),
        lambda: wave_files._stream(Path("sea.nc")),
        lambda: wave_files._stream(Path("line.nc")),
        lambda: wave_files._directional(Path("sea.nc")),
        lambda: wave_files._directional(Path("still.nc")),
    )
    rows = xr.DataArray(np.zeros(5), dims="time")
    for most in (4, 5):
        refused_value(lambda most=most: wave_files._check_size(rows, True, "x must be a series", most))


def of_hdf5():
    """Numbers that an HDF5 file takes from elsewhere."""
    from dolfbuoy.scene.mesh_file import check_hdf5, inside

    with h5py.File("whole.h5", "w") as file:
        file["a/b"] = [1.0, 2.0]
    with h5py.File("linked.h5", "w") as file:
        file["c"] = h5py.ExternalLink("whole.h5", "/a")
    with h5py.File("inner.h5", "w") as file:
        file["a/b"] = [1.0]
        file["a/c"] = h5py.SoftLink("/a/b")
    with h5py.File("virtual.h5", "w") as file:
        layout = h5py.VirtualLayout((2,), "f8")
        layout[:] = h5py.VirtualSource("whole.h5", "a/b", (2,))
        file.create_virtual_dataset("v", layout)
    with h5py.File("external.h5", "w") as file:
        file.create_dataset("x", (2,), "f8", external=[("raw", 0, 16)])
    Path("torn.h5").write_bytes(Path("whole.h5").read_bytes()[:96])
    for name in ("whole", "linked", "inner", "virtual", "external"):
        refused_value(lambda name=name: check_hdf5(Path(f"{name}.h5")))
    try:
        check_hdf5(Path("torn.h5"))
    except ValueError as error:
        print(str(error).partition("(")[0])
    Path("below").mkdir()
    Path("below/out.h5").symlink_to("../whole.h5")
    Path("below/round.h5").symlink_to("round.h5")
    names = ("out.h5", "round.h5", "../whole.h5", "/etc/hosts", "C:\\x", "none.h5", "x" * 300)
    refused_value(*(partial(inside, Path("below"), name) for name in names))


def of_folders():
    """Folders of results in which something is missing, damaged, or another's."""
    scene = load_scene("driven", **{"time.end": 0.2})
    before = os.umask(0)  # what others may do is up to the user's umask, and to nothing else
    dolfbuoy.simulate(scene, out="run", progress=lambda *_: None)
    os.umask(before)
    for path in sorted(Path("run").rglob("*")):
        print(path, oct(path.stat().st_mode & 0o7777))
    changed = Path("run/scene.toml").read_text()

    def without(name, change):
        shutil.copytree("run", name)
        change(Path(name))
        return name

    def cut(place):
        (place / "results.nc").write_bytes((place / "results.nc").read_bytes()[:-5000])

    def damage(place):
        data = bytearray((place / "results.nc").read_bytes())
        data[len(data) // 2] ^= 1
        (place / "results.nc").write_bytes(data)

    def rewrite(text, other):
        return lambda place: (place / "scene.toml").write_text(changed.replace(text, other))

    def repacked(place, **other):
        with np.load(place / RESULTS[2]) as leaves:
            kept = dict(leaves)
        np.savez(place / RESULTS[2], **kept | other)

    again = [
        *(without(f"no_{k}", lambda place, name=name: (place / name).unlink()) for k, name in enumerate(RESULTS)),
        without("edited", rewrite("\naxial_stiffness = ", "\naxial_stiffness = 1")),
        without("broken", lambda place: (place / "scene.toml").write_text("cable = 3\n")),
        without("toml", lambda place: (place / "scene.toml").write_text("cable = [\n")),
        without("torn", lambda place: (place / RESULTS[2]).write_bytes(b"PK")),
        without("older", lambda place: repacked(place, format=np.array(1))),
        without("negative", lambda place: repacked(place, **{"rows/time": np.array(-1)})),
    ]
    refused(
        *(partial(checkpoint.load, name, 1) for name in again),
        partial(checkpoint.load, "run", 2),
        partial(checkpoint.load, "run", 1, 0.1),
        partial(dolfbuoy.simulate, resume="run", out="b"),
        partial(dolfbuoy.simulate, scene, resume="run"),
        partial(dolfbuoy.simulate, resume="run", **{"gravity": 1.0}),
    )
    refused(
        *(partial(paraview.read_run, name) for name in (*again[:2], "broken", "none")),
        partial(paraview.read_run, without("cut", cut)),
        partial(paraview.read_run, without("damaged", damage)),
        partial(paraview.read_run, without("renamed", rewrite("[cable]\n", "[cable]\nname = 'b'\n"))),
        partial(record.check_format, {"version_dolfbuoy": "0.1", "format": 1}, "a.nc"),
        partial(record.check_format, {}, "a.nc"),
    )
    kept = SimpleNamespace(kept=np.zeros(3))
    refused(
        partial(running.Extremes.restore, kept, np.zeros(4)),
        partial(running.Extremes.restore, kept, np.zeros(3, dtype=int)),
        partial(running.Extremes.restore, kept, np.ones(3)),
    )
    Path("sweep/cases").mkdir(parents=True)
    refused(partial(statistics.runs_of, ["sweep"], start=1.0), partial(statistics.runs_of, ["sweep"]))
    Path("file").write_text("")
    for name, content in {
        "listed": {"run": {"files": ["../x"]}},
        "kinds": {"walk": {"files": []}},
        "table": {"run": {"files": "results.nc"}},
        "entry": {"run": {"files": [3]}},
    }.items():
        Path(name).mkdir()
        Path(name, folder.MANIFEST).write_text(json.dumps(content))
    Path("words").mkdir()
    Path("words", folder.MANIFEST).write_text("no json")
    Path("pipe").mkdir()
    Path("pipe", folder.MANIFEST).mkdir()
    Path("theirs").mkdir()
    Path("theirs/results.nc").write_text("a diary")
    Path("linked").symlink_to("theirs")
    names = ("listed", "kinds", "table", "entry", "words", "pipe", "theirs", "edited", "empty")
    refused(
        *(partial(folder.holds, name, "run", scene) for name in names),
        partial(folder.holds, "run", "run", load_scene(scene, gravity=9.0)),
        partial(folder.holds, "edited", "run", scene, overwrite=True),
        partial(folder._lock, Path("file"), shared=False),
        partial(folder._lock, Path("file/below"), shared=False),
        partial(writing.refuse_link, "linked"),
        partial(writing.refuse_link, "linked", writing.GIVEN),
        partial(writing.refuse_link, "theirs"),
        partial(writing.refuse_present, [Path("none"), Path("file")]),
        partial(writing.refuse_present, [Path("file")], overwrite=True),
        partial(writing.refuse_present, [Path("none")]),
    )
    held = folder._lock(Path("run"), shared=False)
    refused(partial(folder._lock, Path("run"), shared=True))
    os.close(held)


def of_machines():
    """What is missing here, or too small."""
    with patch.dict(os.environ, {"TMPDIR": "nowhere/at/all"}):
        refused(_check_temporary_folder)
    os.mkfifo("fifo")
    with open("large.txt", "wb") as file:
        file.truncate(files.MOST_BYTES + 1)
    for name in ("fifo", "large.txt", "none.txt"):
        refused(partial(files.read, "moordyn", Path(name)))
    with patch.object(feasible, "memory", lambda: 0.6e6):
        lines = load_scene("driven", **{"cable.elements": 400})
        buoys = load_scene("free-buoy")
        refused(partial(feasible.check_feasible, lines), partial(feasible.check_feasible, buoys))
    refused(partial(feasible.check_feasible, load_scene("driven", **{"cable.elements": 400})))
    waves = ((3.0, 4, 2.0), (3.0, 6, 20.0), (0.9, 4, 2.0), (1.2, 5, 2.0), (4.4, 12, 20.0), (5.0, 20, 20.0))
    k = 2 * np.pi / 30.0
    refused(*(partial(stream.steady_wave, high, None, deep, 9.81, 0.0, order, k) for high, order, deep in waves))


with TemporaryDirectory() as place, chdir(place):  # nothing that is written here is worth a record
    of_potential_flow()
    of_tables()
    of_hdf5()
    of_folders()
    of_machines()
