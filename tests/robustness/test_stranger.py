"""An untrusted scene reads and writes no file outside its folder, and sends nothing but text to a terminal.

Source: folders with files that must stay unread, and the messages instead.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
import tomli_w

from dolfbuoy.errors import InputError
from dolfbuoy.meshes import cable_nodes, write_line
from dolfbuoy.scene import load_scene, merged

NODES = np.array([0.0, 1.0, 3.0, 10.5, 22.0])


def line(path):
    """A line mesh of the cable."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_line(path, np.column_stack([NODES, 0 * NODES, 0 * NODES]))
    return path


@pytest.fixture
def folder(tmp_path):
    """Of the scene; beside it lies what is none of its business."""
    line(tmp_path / "outside" / "line.vtu")
    line(tmp_path / "outside" / "line.xdmf")
    inner = tmp_path / "scene"
    inner.mkdir()
    return inner


def scene_with(folder, elements):
    path = folder / "scene.toml"
    data = load_scene("short").to_dict()
    data["cable"]["elements"] = elements
    path.write_text(tomli_w.dumps(data))
    return path


def refusal(path):
    with pytest.raises(InputError) as caught:
        load_scene(path)
    said = str(caught.value)
    assert said.startswith("cable.elements = ")
    assert said.isprintable()
    return said


@pytest.mark.parametrize("name", ["line.vtu", "meshes/line.vtk", "line.xdmf", "./line.vtu"])
def test_files_below_the_scene_are_read_from_wherever_one_stands(folder, tmp_path, monkeypatch, name):
    line(folder / name)
    path = scene_with(folder, name)
    for place in (tmp_path, folder):
        monkeypatch.chdir(place)
        cable = load_scene(path).network.pieces[0].section
        np.testing.assert_allclose(cable_nodes(cable.length, cable.elements), NODES, rtol=1e-12)


def test_complete_scene_does_not_need_the_file(folder, tmp_path):
    line(folder / "line.vtu")
    load_scene(scene_with(folder, "line.vtu")).save(tmp_path / "complete.toml")
    assert load_scene(tmp_path / "complete.toml") == load_scene(folder / "scene.toml")


@pytest.mark.parametrize(
    "name", ["../outside/line.vtu", "x/../../outside/line.vtu", "{}/outside/line.vtu", "~/line.vtu"]
)
def test_paths_that_lead_out(folder, tmp_path, name):
    said = refusal(scene_with(folder, name.format(tmp_path)))
    assert ("path below the folder" in said) or ("not found" in said)


@pytest.mark.parametrize("link", ["file", "folder", "chain"])
def test_links_that_lead_out(folder, tmp_path, link):
    outside = tmp_path / "outside"
    if link == "folder":
        (folder / "meshes").symlink_to(outside)
    else:
        (folder / "meshes").mkdir()
        (folder / "first.vtu").symlink_to(outside / "line.vtu")
        target = folder / "first.vtu" if link == "chain" else outside / "line.vtu"
        (folder / "meshes" / "line.vtu").symlink_to(target)
    assert "link that leaves the folder" in refusal(scene_with(folder, "meshes/line.vtu"))


def test_links_within_the_folder_are_followed(folder):
    line(folder / "meshes" / "line.vtu")
    (folder / "same.vtu").symlink_to("meshes/line.vtu")
    assert len(load_scene(scene_with(folder, "same.vtu")).network.pieces[0].section.elements) == 4


def test_only_files_are_opened(folder):
    os.mkfifo(folder / "pipe.vtu")  # opening it would wait for ever
    (folder / "folder.vtu").mkdir()
    for name in ("pipe.vtu", "folder.vtu"):
        assert "not found" in refusal(scene_with(folder, name))


@pytest.mark.parametrize("key", ["waves.elevation", "waves.spectrum", "waves.components", "cable.elements", "library"])
@pytest.mark.parametrize("name", ["loop", "a" * 300, "loop/x", "x/" * 2000 + "y", "a" * 255 + "/b"])
def test_names_that_lead_nowhere(folder, key, name):
    """Links in a circle, and names that are too long."""
    (folder / "loop").symlink_to("pool")
    (folder / "pool").symlink_to("loop")
    data = merged(load_scene("short").to_dict(), **{key: name})
    (folder / "scene.toml").write_text(tomli_w.dumps(data))
    with pytest.raises(InputError) as caught:
        load_scene(folder / "scene.toml")
    assert str(caught.value).isprintable()
    assert "not found" in str(caught.value)


@pytest.mark.parametrize("name", ["line.inp", "line.pvtu", "line.med", "line", "line.npy", "line.py"])
def test_formats_that_may_refer_to_other_files(folder, name):
    (folder / name).write_text("*INCLUDE, INPUT=/etc/passwd\n")
    assert "these formats" in refusal(scene_with(folder, name))


def xdmf(folder, change):
    """An XDMF mesh in the scene's folder with its text changed."""
    path = line(folder / "line.xdmf")
    text = path.read_text()
    assert "line.h5:" in text
    path.write_text(change(text))
    return scene_with(folder, "line.xdmf")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("line.h5:", "../outside/line.h5:"), "below the folder"),
        (lambda text: text.replace("line.h5:", "{outside}/line.h5:"), "below the folder"),
        (lambda text: text.replace("line.h5:", "gone.h5:"), "not found"),
        (lambda text: text.replace('Format="HDF"', 'Format="Binary"'), "Format 'BINARY'"),
        (lambda text: text.replace("<Domain>", '<xi:include xmlns:xi="x" href="/etc/passwd"/><Domain>'), "include"),
        (lambda text: f'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>{text}', "document type"),
        (lambda text: text[:100], "no XDMF file"),
    ],
)
def test_references_of_xdmf(folder, tmp_path, change, words):
    path = xdmf(folder, lambda text: change(text).replace("{outside}", str(tmp_path / "outside")))
    assert words in refusal(path)


#: In a process of its own: HDF5 1.10 does not survive, at the end of a process, that it wrote a virtual data set.
ELSEWHERE = """
import sys
import h5py

kind, changed, other = sys.argv[1:]
with h5py.File(changed, "a") as file:
    name = next(iter(file))
    numbers = file[name][...]
    del file[name]
    if kind == "link":
        file[name] = h5py.ExternalLink(other, f"/{name}")
    elif kind == "soft link":
        file[name] = h5py.SoftLink("/elsewhere")
    elif kind == "external":
        file.create_dataset(name, numbers.shape, numbers.dtype, external=[(other, 0, numbers.nbytes)])
    else:
        layout = h5py.VirtualLayout(numbers.shape, numbers.dtype)
        layout[...] = h5py.VirtualSource(other, name, numbers.shape)
        file.create_virtual_dataset(name, layout)
"""


@pytest.mark.parametrize("kind", ["link", "external", "virtual", "soft link"])
def test_references_of_hdf5(folder, tmp_path, kind):
    path = xdmf(folder, lambda text: text)
    files = [str(folder / "line.h5"), str(tmp_path / "outside" / "line.h5")]
    subprocess.run([sys.executable, "-c", ELSEWHERE, kind, *files], check=True)
    assert "must hold its numbers itself" in refusal(path)


@pytest.mark.parametrize(
    "content", [b"", b"\x00" * 100, b"<VTKFile", b"<?xml version='1.0'?><VTKFile type='x'/>", b"{}"]
)
@pytest.mark.parametrize("suffix", ["vtu", "vtk", "msh", "mesh", "xdmf"])
def test_garbage_is_no_mesh(folder, suffix, content):
    (folder / f"line.{suffix}").write_bytes(content)
    refusal(scene_with(folder, f"line.{suffix}"))


def test_the_user_may_name_any_file(folder, tmp_path, monkeypatch):
    """On the command line and in Python; a relative path is seen from where he stands."""
    path, mesh = scene_with(folder, 20), tmp_path / "outside" / "line.vtu"
    for name in (str(mesh), "../outside/line.vtu"):
        monkeypatch.chdir(folder)
        assert len(load_scene(path, cable__elements=name).network.pieces[0].section.elements) == 4
        assert len(load_scene(path, **{"cable": {"elements": name}}).network.pieces[0].section.elements) == 4


def test_control_characters_reach_no_terminal(call, folder):
    """Of names of files and keys, in errors of any kind."""
    assert str(InputError("\x1b]0;evil\x07 two\nlines")) == r"\x1b]0;evil\x07 two\nlines"
    evil = folder / "\x1b[31mevil\n.toml"
    evil.write_text("'\x9b31m' = 1\n")
    for arguments in (["check", evil], ["check", "short", "--set", f"cable.elements={evil}"], ["plot", evil]):
        code, out, err = call(*arguments)
        assert code == 2
        assert not {"\x1b", "\x9b", "\x07"} & set(out + err)
        assert err.count("\n") == 1


def test_no_file_is_written(call, folder, monkeypatch):
    """Whatever a scene asks PETSc for."""
    monkeypatch.chdir(folder)
    for option in ("snes_view", "snes_monitor", "ksp_view_mat", "ksp_view_rhs", "ksp_monitor", "log_view"):
        assert call("check", "short", "--set", f"solver.petsc.{option}=ascii:{folder}/written")[0] == 2
    assert not list(folder.iterdir())
