"""A C program calling libdolfbuoy gets the results of a Python Session, to the last bit.

Source: the same steps in Python; the exit codes in the header.
"""

import ctypes
import shlex
import subprocess
import sysconfig
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from own_body import example, furthest

from dolfbuoy import InputError, Session, load_scene
from dolfbuoy.coupling import library, served
from dolfbuoy.results.record import read

WAVES = {"amplitude": 0.8, "period": 5.0, "ramp": 0.2}
SCENE = {
    "sea": MOORED["sea"],
    "waves": WAVES,
    "cable": merged(MOORED["cable"], elements=6, top={"kind": "fixed", "position": [12.0, 0.5, -3.5]}),
    "time": {"end": 1.0, "step": 0.02, "scheme": "bdf2"},
}
SOURCE = Path(__file__).parents[1] / "support" / "client.c"


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """The compiled client, and a scene next to it."""
    folder = tmp_path_factory.mktemp("client")
    library.build(folder / library.LIBRARY)
    (folder / library.HEADER).write_text((library.FOLDER / library.HEADER).read_text())
    compiler = shlex.split(sysconfig.get_config_var("CC"))
    options = ["-Wall", "-Wextra", "-Werror", f"-I{folder}", f"-L{folder}", "-ldolfbuoy", f"-Wl,-rpath,{folder}", "-lm"]
    subprocess.run([*compiler, SOURCE, "-o", folder / "client", *options], check=True)
    load_scene(SCENE).save(folder / "scene.toml")
    return folder / "client"


def run(client, *arguments):
    return subprocess.run([client, *map(str, arguments)], capture_output=True, text=True, timeout=300)


def test_a_program_in_c_steps_as_python_does(client, tmp_path):
    done = run(client, client.parent / "scene.toml", tmp_path / "c")
    assert done.returncode == 0, done.stdout + done.stderr
    first, *steps, water, code, message = done.stdout.splitlines()
    assert first.split() == ["3", "3", "0", "12", "0.5", "-3.5"]
    found = []
    with Session(SCENE, tmp_path / "python", driven="cable.to") as s:
        for k in range(1, 21):
            s.drive("cable.to", [12.0, 0.5, -3.5 + 0.125 * k * k / 64], velocity=[0, 0, 0.25 * k / 64 / 0.02])
            s.step(0.02)
            found.append([s.t, *s.pull("cable.to")])
        eta = s.elevation([[0.0, 0.0, 0.0], [10.0, 5.0, 0.0]])
        expected = [*eta, s.values()["tension_top"][0]]
    np.testing.assert_array_equal([[float(x) for x in line.split()] for line in steps], found)
    np.testing.assert_array_equal([float(x) for x in water.split()], expected)
    assert (code, message) == ("2", "dt = nan: must be a positive number of seconds.")
    one, two = (read(tmp_path / name / "results.nc") for name in ("c", "python"))
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name].values, two[name].values)


@pytest.mark.parametrize(
    ("assignment", "sentence"),
    [
        ("waves.period=0", "waves.period"),
        ("cable.top.kind=free", "driven = 'cable.to': the scene does not hold it"),
        ("time=none", "time: must be given"),
    ],
)
def test_what_is_not_possible_is_a_number_and_a_sentence(client, tmp_path, assignment, sentence):
    done = run(client, client.parent / "scene.toml", tmp_path / "none", assignment)
    assert done.returncode == 2
    assert done.stdout.startswith(f"2 {sentence}")
    assert done.stderr == ""


def test_a_body_of_ones_own_coupled_by_the_library(client, tmp_path):
    """The README's example steps the functions of the header in place of a Session."""
    names = example()
    load_scene(names["scene"]).save(tmp_path / "scene.toml")
    lib = ctypes.CDLL(str(client.parent / library.LIBRARY))
    lib.dolfbuoy_create.restype = lib.dolfbuoy_message.restype = ctypes.c_void_p
    x, f, t, number = (ctypes.c_double * 7)(), (ctypes.c_double * 6)(), ctypes.c_double(), ctypes.c_int()

    class Coupled:
        def __init__(self, scene, driven):
            self.s = ctypes.c_void_p(lib.dolfbuoy_create(str(tmp_path / "scene.toml").encode()))
            assert lib.dolfbuoy_drive(self.s, driven[0].encode()) == lib.dolfbuoy_init(self.s) == 0

        def __enter__(self):
            return self

        def __exit__(self, *_):
            assert lib.dolfbuoy_close(self.s) == 0

        def state(self, name):
            assert lib.dolfbuoy_now(self.s, ctypes.byref(t), x, f) == 0
            return np.array(x[:3]), np.array(x[3:])

        def save(self):
            if number.value:
                assert lib.dolfbuoy_forget(self.s, number) == 0
            assert lib.dolfbuoy_save(self.s, ctypes.byref(number)) == 0
            return number

        def restore(self, here):
            assert lib.dolfbuoy_restore(self.s, here) == 0

        def drive(self, name, position, orientation):
            x[:] = [*position, *orientation]

        def step(self, dt):
            assert lib.dolfbuoy_step(self.s, x, None, f, ctypes.byref(t), ctypes.c_double(dt)) == 0

        def pulls(self, name):
            return np.array(f[:3]), np.array(f[3:])

    names["dolfbuoy"] = SimpleNamespace(Session=Coupled)
    assert furthest(names["coupled"]()) < 1e-6


def test_a_missing_scene_is_a_sentence(client, tmp_path):
    done = run(client, tmp_path / "nowhere.toml", tmp_path / "none")
    assert done.returncode == 2
    assert "nowhere.toml" in done.stdout


def test_a_client_has_all_that_is_driven_in_one_array():
    client = served.Client(MOORED | {"time": SCENE["time"]})
    with pytest.raises(InputError, match="dolfbuoy_init must be called before"):
        client.sizes()
    client.names += ["buoy", "cable.from"]
    client.open()
    with pytest.raises(InputError, match="can no longer be changed"):
        client.choose(client.names.clear)
    with pytest.raises(InputError, match="number = 1: must be one that dolfbuoy_save gave"):
        client.restore(1)
    assert client.sizes() == (10, 9)
    x = client.places()
    np.testing.assert_array_equal(x[7:], [0, 0, -20])
    client.step(x + [0, 0, 0.01, *7 * [0]], np.array([0, 0, 0.5, 0, 0, 0, 0, 0, 0.2]), 0.02)
    s = client.session
    np.testing.assert_allclose(s.state("buoy").velocity, [0, 0, 0.5], atol=1e-12)
    np.testing.assert_array_equal(s.paths["cable.from"].end[2], [0, 0, 0.2])
    np.testing.assert_array_equal(client.forces()[:3], s.pulls("buoy").force)
    np.testing.assert_array_equal(client.forces()[6:], s.pull("cable.from"))
    np.testing.assert_array_equal(client.values("buoy_position", 3), x[:3] + [0, 0, 0.01])
    with pytest.raises(InputError, match=r"'tension_top' with 2 numbers: must be of .*tension_top \(1\)"):
        client.values("tension_top", 2)
    client.close()


def test_the_command_writes_both_and_replaces_nothing_unasked(tmp_path, call):
    assert "-ldolfbuoy" in call("library", "--out", tmp_path / "lib")[1]
    assert {file.name for file in (tmp_path / "lib").iterdir()} == {library.HEADER, library.LIBRARY}
    (tmp_path / "lib" / library.HEADER).write_text("mine")
    assert call("library", "--out", tmp_path / "lib")[0] == 2
    assert (tmp_path / "lib" / library.HEADER).read_text() == "mine"
