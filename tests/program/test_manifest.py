"""The manifest of the program's own files in a folder, entry by entry, and decisions based on it.

Source: entries written by hand; the files present afterwards.
"""

import hashlib
import json
import shlex
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from chains import CHAIN

from dolfbuoy import InputError, load_scene
from dolfbuoy.results import folder

SCENE, OTHER = load_scene(CHAIN), load_scene(CHAIN, time__end=9.0)
DIGEST = hashlib.sha256(SCENE.to_toml().encode()).hexdigest()
FILES = ["results.nc", "scene.toml", "checkpoint.npz"]


@pytest.fixture(autouse=True)
def command(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["/usr/bin/dolfbuoy", "run", "my scene.toml"])


def listed(path):
    return json.loads((path / ".dolfbuoy.json").read_text())


def entry(**more):
    return {"scene": DIGEST, "command": "dolfbuoy run 'my scene.toml'", "finished": False, "files": FILES} | more


def test_what_is_noted_of_a_run(tmp_path):
    """From its begin to its end, with files that come later, once each."""
    folder.begin(tmp_path, "run", SCENE)
    assert listed(tmp_path) == {"run": entry()}
    assert (tmp_path / "scene.toml").read_text() == SCENE.to_toml()
    more = [tmp_path / "figures" / "tension.png", tmp_path / "page.html"]
    folder.enlist(tmp_path, [*more, more[0]])
    folder.enlist(tmp_path, more[1:])
    assert listed(tmp_path) == {"run": entry(files=[*FILES, "figures/tension.png", "page.html"])}
    folder.finish(tmp_path, "run", OTHER)
    folder.remark(tmp_path, "run", case="a = 1")
    known = listed(tmp_path)["run"]
    assert known == entry(
        files=[*FILES, "figures/tension.png", "page.html"], finished=True, requested=folder.digest(OTHER), case="a = 1"
    )
    assert folder.remarks(tmp_path, "run") == known
    assert folder.remarks(tmp_path, "static") == {}
    folder.enlist(tmp_path, [tmp_path / "modes.html"], "modes")
    assert listed(tmp_path) == {"run": known, "modes": {"files": ["modes.html"]}}
    folder.begin(tmp_path, "run", OTHER)
    assert listed(tmp_path) == {"run": entry(scene=folder.digest(OTHER)), "modes": {"files": ["modes.html"]}}


def test_what_a_run_leaves_goes_when_another_begins(tmp_path):
    """Files of its own, and folders that are empty then; what a link leads to stays."""
    folder.begin(tmp_path, "run", SCENE)
    (tmp_path / "figures").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "paraview").symlink_to(tmp_path / "elsewhere")
    files = [tmp_path / name for name in ("figures/a.png", "paraview/b.vtu", "page.html", "results.nc")]
    folder.enlist(tmp_path, files)
    for file in files:
        file.write_text("x")
    folder.begin(tmp_path, "run", OTHER)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".dolfbuoy.json", "elsewhere", "paraview", "scene.toml"]
    assert (tmp_path / "elsewhere" / "b.vtu").exists()


def test_a_run_that_goes_on_keeps_its_files(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "verify", lambda path: None)
    folder.begin(tmp_path, "run", SCENE)
    folder.enlist(tmp_path, [tmp_path / "page.html"])
    folder.finish(tmp_path, "run")
    waited = []
    folder.go_on(tmp_path, SCENE, SimpleNamespace(rank=0, size=1, barrier=lambda: waited.append(listed(tmp_path))))
    assert [before["run"]["finished"] for before in waited] == [True]  # ranks read the scene until then
    assert listed(tmp_path) == {"run": entry(files=[*FILES, "page.html"])}
    folder.go_on(tmp_path, OTHER)
    assert listed(tmp_path) == {"run": entry(files=[*FILES, "page.html"], scene=folder.digest(OTHER))}
    assert load_scene(tmp_path / "scene.toml") == OTHER


def test_which_results_are_there_already(tmp_path):
    """Finished ones of the scene, or of the one that was asked for; others are refused, or replaced."""
    assert not folder.holds(tmp_path, "run", SCENE)
    folder.begin(tmp_path, "run", SCENE)
    assert not folder.holds(tmp_path, "run", OTHER)  # there is no record yet
    (tmp_path / "results.nc").touch()
    assert not folder.holds(tmp_path, "run", SCENE)
    with pytest.raises(InputError, match="holds the results of another scene"):
        folder.holds(tmp_path, "run", OTHER)
    assert not folder.holds(tmp_path, "run", OTHER, overwrite=True)
    (tmp_path / "checkpoint.npz").touch()
    with pytest.raises(InputError, match=f"run --resume {shlex.quote(str(tmp_path))} goes on with it"):
        folder.holds(tmp_path, "run", SCENE)
    folder.finish(tmp_path, "run", OTHER)
    assert [folder.holds(tmp_path, "run", scene) for scene in (SCENE, OTHER)] == [True, True]
    assert not folder.holds(tmp_path, "run", SCENE, overwrite=True)
    folder.remark(tmp_path, "run", session=True)
    with pytest.raises(InputError, match="holds the results of another scene"):
        folder.holds(tmp_path, "run", SCENE)


def test_what_takes_no_time_is_kept_whole(tmp_path):
    """Record, scene and entry; where nothing may be written it is said before."""
    made = xr.Dataset({"a": ("x", np.array([1.0, np.nan]))}, attrs={"title": "t"})
    folder.make_ready(tmp_path / "new", "static", SCENE)
    folder.make_ready(None, "static", SCENE)
    folder.keep(tmp_path / "new", "static", SCENE, made)
    files = ["static.nc", "static.toml"]
    assert listed(tmp_path / "new") == {"static": entry(files=files, finished=True)}
    assert folder.holds(tmp_path / "new", "static", SCENE)
    with xr.open_dataset(tmp_path / "new" / "static.nc") as kept:
        assert kept.identical(made)
        assert "_FillValue" not in kept.a.encoding
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "static.nc").write_text("mine")
    for call in (folder.make_ready, lambda *arguments: folder.keep(*arguments, made)):
        with pytest.raises(InputError, match=r"static\.nc would be replaced"):
            call(tmp_path / "mine", "static", SCENE)
    with pytest.raises(InputError, match=r"static\.nc would be replaced"):
        folder.refuse_own(tmp_path / "mine", ["other.nc", "static.nc"], "static")
    folder.refuse_own(tmp_path / "mine", ["other.nc"], "static")


def test_a_folder_in_the_place_of_a_file_is_the_users(tmp_path):
    """A link is not followed: it is the program's if its name is."""
    folder.begin(tmp_path, "static", SCENE)
    (tmp_path / "static.nc").symlink_to(tmp_path / "nowhere")
    assert not folder.holds(tmp_path, "static", SCENE, overwrite=True)
    (tmp_path / "static.nc").unlink()
    (tmp_path / "static.nc").mkdir()
    with pytest.raises(InputError, match=r"static\.nc would be replaced"):
        folder.holds(tmp_path, "static", SCENE, overwrite=True)


@pytest.mark.parametrize(
    ("text", "good"),
    [
        ('{"run": {"files": ["results.nc", "figures/a_b.png", "a-b.csv"]}}', True),
        ('{"run": {"files": []}, "sweep": {"files": ["sweep.nc"]}}', True),
        ("{}", True),
        ('{"run": {"files": ["../a.png"]}}', False),
        ('{"run": {"files": ["figures/a.b.png"]}}', False),
        ('{"run": {"files": ["mine.toml"]}}', False),
        ('{"run": {"files": [3]}}', False),
        ('{"run": {"files": "results.nc"}}', False),
        ('{"run": {}}', False),
        ('{"other": {"files": []}}', False),
        ("[]", False),
        ("{", False),
    ],
)
def test_lists_that_are_the_programs(tmp_path, text, good):
    (tmp_path / ".dolfbuoy.json").write_text(text)
    if good:
        assert folder._manifest(tmp_path) == json.loads(text)
        return
    with pytest.raises(InputError, match="is damaged: take another folder"):
        folder._manifest(tmp_path)
