"""Untrusted records, checkpoints and manifests: no other file is read, and bad ones are refused in one sentence.

Source: records with altered scene, numbers or bytes.
"""

import json
import random
import shutil
import subprocess
import sys

import netCDF4
import numpy as np
import pytest

from dolfbuoy import load_scene, modes, simulate
from dolfbuoy.results import folder as folders
from dolfbuoy.results.record import save, seal

SECRET = "0.000 7.125\n"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of a short run and of modes; never changed."""
    folder = tmp_path_factory.mktemp("made")
    scene = load_scene("short", cable__elements=4, time={"end": 0.03, "step": 0.01})
    simulate(scene, out=folder)
    found = modes(scene, number=2)
    folders.begin(folder, "modes", scene)
    save(found, folder / "modes.nc")
    return folder


@pytest.fixture
def folder(made, tmp_path):
    place = tmp_path / "stranger"
    shutil.copytree(made, place)
    (tmp_path / "secret.txt").write_text(SECRET)
    return place


def with_scene(file, text):
    with netCDF4.Dataset(file, "a") as record:
        if text is None:
            record.delncattr("scene")
        else:
            record.setncattr("scene", text)
    seal(file)


def said(call, *line):
    """What a command said; it must be a refusal."""
    code, out, err = call(*line)
    assert code == 2, out + err
    assert "Traceback" not in err
    *bar, last = err.splitlines()
    assert last.startswith("Error: ")
    assert all("Newton/step" in shown for shown in bar)
    return last


def commands(folder):
    yield ("statistics", folder, "--from", "0.001", "--out", folder.with_name("all"))
    yield ("page", folder)


NAMED = {
    "mesh": ("elements = 4", "elements = '{secret}'"),
    "below": ("elements = 4", "elements = 'secret.vtu'"),
    "spectrum": ("[waves]", "[waves]\nspectrum = '{secret}'"),
    "elevation": ("[waves]", "[waves]\nelevation = '{secret}'"),
    "components": ("[waves]", "[waves]\ncomponents = '{secret}'"),
    "library": ("[sea]", "library = '{secret}'\n[sea]"),
}


@pytest.mark.parametrize("kind", NAMED)
@pytest.mark.parametrize("file", ["results.nc", "modes.nc"])
def test_a_scene_in_a_record_names_no_file(call, folder, kind, file):
    text = load_scene("short", cable__elements=4, time={"end": 0.03, "step": 0.01}).to_toml()
    old, new = NAMED[kind]
    text = text.replace("elements = [\n    [\n        5.5,\n        4,\n    ],\n]", "elements = 4")
    assert old in text
    text = text.replace(old, new.format(secret=folder.with_name("secret.txt")), 1)
    with_scene(folder / file, text)
    if file == "modes.nc":
        (folder / "results.nc").unlink()
        assert "its scene cannot be read" in said(call, "page", folder)
    else:
        assert "its scene cannot be read" in said(call, *next(commands(folder)))
    assert "7.125" not in "".join(path.read_text() for path in folder.rglob("*.html"))


@pytest.mark.parametrize(
    "text", ["[", "", "x = 1", "title = 3", None, "'" * 1000, "a." * 100 + "b = 1", 7, "[cable]\n"]
)
@pytest.mark.parametrize("file", ["results.nc", "modes.nc"])
def test_what_is_no_scene(call, folder, text, file):
    with_scene(folder / file, text)
    if file == "modes.nc":
        (folder / "results.nc").unlink()
        said(call, "page", folder)
    else:
        said(call, *next(commands(folder)))


OTHERS = ("free-buoy", "hanging-chain", "two-buoys")


@pytest.mark.parametrize("other", ["three-legs", *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)])
def test_a_scene_of_another_record(call, folder, other):
    """A sentence, or numbers; the page is made from the scene beside the record."""
    with_scene(folder / "results.nc", load_scene(other).to_toml())
    load_scene(other).save(folder / "scene.toml")
    for line in (*commands(folder), ("plot", folder), ("run", "--resume", folder)):
        code, out, err = call(*line)
        assert code in (0, 2), out + err
        assert "Traceback" not in err


#: In a process of its own, see test_stranger.
ELSEWHERE = """
import sys, h5py
kind, changed, other = sys.argv[1:]
with h5py.File(changed, "a") as file:
    name, size = "tension_top", file["time"].size
    del file[name]
    if kind == "link":
        file[name] = h5py.ExternalLink(other, "/x")
    elif kind == "external":
        file.create_dataset(name, (size,), "f8", external=[(other, 0, 8 * size)])
    else:
        layout = h5py.VirtualLayout((size,), "f8")
        layout[...] = h5py.VirtualSource(other, "x", (size,))
        file.create_virtual_dataset(name, layout)
"""


@pytest.mark.parametrize("kind", ["link", "external", "virtual"])
def test_numbers_in_another_file(call, folder, kind):
    other = folder.with_name("other.h5")
    with netCDF4.Dataset(other, "w") as file:
        file.createDimension("n", 4)
        file.createVariable("x", "f8", ("n",))[:] = 1.0
    subprocess.run([sys.executable, "-c", ELSEWHERE, kind, folder / "results.nc", other], check=True)
    seal(folder / "results.nc")
    for line in (*commands(folder), ("plot", folder), ("run", "--resume", folder)):
        said(call, *line)


def flipped(content, dice):
    """With a bit changed, or cut off somewhere."""
    place = dice.randrange(len(content))
    if dice.random() < 0.3:
        return content[:place]
    return content[:place] + bytes([content[place] ^ 1 << dice.randrange(8)]) + content[place + 1 :]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))])
def test_flipped_bits(call, made, tmp_path, seed):
    """Of records, checkpoints and manifests, fifty for each seed: refused, or harmless."""
    dice = random.Random(seed)
    for number in range(50):
        place = tmp_path / str(number)
        shutil.copytree(made, place)
        file = place / ("results.nc", "checkpoint.npz", ".dolfbuoy.json")[number % 3]
        file.write_bytes(flipped(file.read_bytes(), dice))
        line = (("run", "--resume", place, "--no-plot"), ("statistics", place, "--from", "0.001", "--out", place / "s"))
        code, out, err = call(*line[0 if file.suffix != ".nc" else number // 3 % 2])
        assert code in (0, 2), out + err
        assert "Traceback" not in err
        shutil.rmtree(place)


@pytest.mark.parametrize(
    "change",
    [
        lambda tree: tree.pop("scene"),
        lambda tree: tree.pop("next_frame"),
        lambda tree: tree.update(scene=np.array("[")),
        lambda tree: tree.update(scene=np.array("library = '/etc/hostname'")),
        lambda tree: tree.update(format=np.array("3")),
        lambda tree: tree.update({"rows/time": np.array(-1)}),
        lambda tree: tree.update({"rows/time": np.array("x")}),
        lambda tree: tree.update({"states/0/t": np.array("x")}),
        lambda tree: tree.update({"states/0/u": np.zeros(3)}),
        lambda tree: tree.update({"states/7/u": np.zeros(3)}),
        *(
            lambda tree, wrong=wrong: tree.update({"states/0/past/0/count": np.array(wrong)})
            for wrong in ("x", 1.5, -1, 10**6)
        ),
        lambda tree: tree.update({"states/0/past/0/steps_since_start": np.array("x")}),
        lambda tree: [tree.pop(name) for name in list(tree) if name.startswith("states")],
    ],
)
def test_a_checkpoint_of_another_shape(call, folder, change):
    file = folder / "checkpoint.npz"
    with np.load(file) as leaves:
        tree = dict(leaves)
    change(tree)
    np.savez(file, **tree)
    said(call, "run", "--resume", folder, "--t-end", "0.05", "--no-plot")


@pytest.mark.parametrize(
    "change",
    [
        lambda record: record.delncattr("wall_time_s"),
        lambda record: record.setncattr("wall_time_s", "x"),
        lambda record: record.delncattr("created"),
        lambda record: record.renameVariable("xyz", "abc"),
        lambda record: record.renameVariable("s", "arc"),
    ],
)
def test_a_record_that_cannot_be_lengthened(call, folder, change):
    """It lacks what every record has: a sentence that names the file."""
    with netCDF4.Dataset(folder / "results.nc", "a") as record:
        change(record)
    seal(folder / "results.nc")
    assert "results.nc" in said(call, "run", "--resume", folder, "--t-end", "0.05", "--no-plot")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        "null",
        '{"run": []}',
        '{"run": {"files": ["../x"]}}',
        '{"x": {"files": []}}',
        "\udcff",
        "[" * 9999,
    ],
)
def test_a_manifest_that_is_none(call, folder, text):
    (folder / ".dolfbuoy.json").write_bytes(text.encode(errors="surrogateescape"))
    assert ".dolfbuoy.json" in said(call, "run", "short", "--t-end", "0.01", "--out", folder)
    (folder / ".dolfbuoy.json").write_text(json.dumps({}))
    assert "would be replaced" in said(call, "run", "short", "--t-end", "0.01", "--out", folder)
