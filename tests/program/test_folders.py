"""A folder of results: nothing is lost, two runs do not mix, and damaged or unwritable files are reported.

Source: the files before and after, byte for byte; the promises of dolfbuoy/results/README.md.
"""

import itertools
import json
import subprocess
import sys

import numpy as np
import pytest
from chains import CHAIN, OTHER
from dynamics_helpers import MOORED, merged
from mpi_helpers import needs_mpirun, start

import dolfbuoy
from dolfbuoy import api
from dolfbuoy.check import check
from dolfbuoy.errors import InputError
from dolfbuoy.results import checkpoint, folder, recorder
from dolfbuoy.results.record import read


def contents(path):
    """Name -> bytes of all files but the lock, which is empty."""
    return {str(f.relative_to(path)): f.read_bytes() for f in path.rglob("*") if f.is_file() and f.name != folder.LOCK}


def refused(done, *words):
    """One sentence that holds the words, and exit code 2."""
    code, _, err = done
    assert code == 2, err
    assert err.strip().count("\n") == 0, err
    assert "Traceback" not in err
    for word in words:
        assert word in err, err


class Stop(Exception):
    """Somebody pulled the plug."""


def stopped(scene, out):
    """A run that was broken off after its third step, with a checkpoint."""
    count = itertools.count(1)

    def progress(simulation, iterations):
        if next(count) == 3:
            raise Stop

    with pytest.raises(Stop):
        dolfbuoy.simulate(scene, out=out, progress=progress)


# -- what is replaced --------------------------------------------------------------------------------------------------


def test_a_file_of_the_user_is_never_replaced(call, files, monkeypatch):
    """Nor is anything computed before that is found; `--overwrite` is about results only."""
    monkeypatch.setattr(api, "Simulation", None)
    own = "# how I found these numbers\n" + (files / "chain.toml").read_text()
    for name, command in (("scene.toml", "run"), ("results.nc", "run"), ("static.toml", "static")):
        (files / name).write_text(own)
        for option in ([], ["--overwrite"]):
            refused(call(command, "chain.toml", "--out", ".", *option), name, "move it away")
        assert (files / name).read_text() == own
        (files / name).unlink()


def test_the_same_run_again_prints_its_table(call, files, monkeypatch):
    code, first, _ = call("run", "chain.toml", "--out", "out", "--no-plot")
    assert code == 0
    before = contents(files / "out")
    monkeypatch.setattr(api, "Simulation", None)
    code, second, err = call("run", "chain.toml", "--out", "out", "--no-plot")
    assert (code, err) == (0, "")
    assert "complete already" in second
    assert second.partition("Run, ")[2] == first.partition("Run, ")[2]
    assert contents(files / "out") == before
    again = dolfbuoy.simulate(CHAIN, out="out")
    assert np.array_equal(again.cable_position, read(files / "out" / "results.nc").cable_position)


@pytest.mark.parametrize("change", [["other.toml"], ["chain.toml", "--t-end", "0.04"]])
def test_a_record_of_another_scene_is_replaced_with_overwrite_only(call, files, change):
    dolfbuoy.simulate(CHAIN, out="out")
    before = contents(files / "out")
    refused(call("run", *change, "--out", "out"), "out", "another scene", "--overwrite")
    with pytest.raises(InputError, match="another scene"):
        dolfbuoy.simulate(OTHER, out="out")
    assert contents(files / "out") == before
    assert call("run", *change, "--out", "out", "--overwrite", "--no-plot")[0] == 0
    assert contents(files / "out")["results.nc"] != before["results.nc"]
    assert contents(files / "out")["scene.toml"] != before["scene.toml"]


def test_old_figures_go_with_their_run(call, files):
    """The user's own beside them stay."""
    assert call("run", "chain.toml", "--out", "out", "--paraview")[0] == 0
    (files / "out" / "figures" / "mine.png").write_text("mine")
    drawn = {name for name in contents(files / "out") if name.endswith((".png", ".vtu")) and "mine" not in name}
    assert len(drawn) > 8
    assert call("run", "other.toml", "--out", "out", "--overwrite", "--no-plot")[0] == 0
    left = contents(files / "out")
    assert not drawn & set(left)
    assert not (files / "out" / "paraview").exists()
    assert left["figures/mine.png"] == b"mine"


def test_a_figure_of_the_user_is_not_drawn_over(call, files):
    dolfbuoy.simulate(CHAIN, out="out")
    own = files / "out" / "figures" / "tension.png"
    own.parent.mkdir()
    own.write_text("mine")
    refused(call("plot", "out"), "figures/tension.png", "move it away")
    assert own.read_text() == "mine"
    own.unlink()
    for _ in range(2):
        assert call("plot", "out")[0] == 0


def test_an_overwritten_run_stays_until_the_new_one_begins(files, monkeypatch):
    dolfbuoy.simulate(CHAIN, out="out")
    before = contents(files / "out")

    def fails(*_, **__):
        raise Stop

    monkeypatch.setattr(api, "Simulation", fails)
    with pytest.raises(Stop):
        dolfbuoy.simulate(OTHER, out="out", overwrite=True)
    assert contents(files / "out") == before


def test_a_stopped_run_of_the_same_scene(call, files, monkeypatch):
    """It is said that --resume goes on and --overwrite begins anew; both do."""
    monkeypatch.setattr(recorder.Recorder, "pause", 0.0)
    monkeypatch.setattr(recorder.Recorder, "share", 1e9)
    stopped(CHAIN, "out")
    before = contents(files / "out")
    refused(call("run", "chain.toml", "--out", "out"), "run --resume out", "--overwrite")
    refused(call("run", "other.toml", "--out", "out"), "another scene", "--overwrite")
    assert contents(files / "out") == before
    assert call("run", "--resume", "out", "--no-plot")[0] == 0
    assert call("run", "chain.toml", "--out", "out", "--no-plot")[1].startswith("The run in out is complete already")
    stopped(CHAIN, "new")
    assert call("run", "chain.toml", "--out", "new", "--overwrite", "--no-plot")[0] == 0
    assert read("new/results.nc").sizes["time"] == read("out/results.nc").sizes["time"] == 6


def test_a_run_that_was_killed_before_it_noted_its_end(call, files):
    """Complete, but for the note: --resume says so, and notes it."""
    dolfbuoy.simulate(CHAIN, out="out")
    manifest = json.loads((files / "out" / folder.MANIFEST).read_text())
    manifest["run"]["finished"] = False
    (files / "out" / folder.MANIFEST).write_text(json.dumps(manifest))
    assert "already complete" in call("run", "--resume", "out")[1]
    assert "complete already" in call("run", "chain.toml", "--out", "out", "--no-plot")[1]


def test_an_equilibrium_beside_a_run(call, files):
    """Each has its own scene; neither spoils the other."""
    dolfbuoy.simulate(CHAIN, out="out")
    run = contents(files / "out")
    assert call("static", "other.toml", "--out", "out")[0] == 0
    both = contents(files / "out")
    assert {"static.nc", "static.toml"} == set(both) - set(run)
    assert all(both[name] == run[name] for name in set(run) - {folder.MANIFEST})
    assert dolfbuoy.load_scene("out/static.toml") == dolfbuoy.load_scene(OTHER)
    refused(call("static", "chain.toml", "--out", "out"), "another scene", "--overwrite")
    assert call("static", "chain.toml", "--out", "out", "--overwrite")[0] == 0
    dolfbuoy.simulate(resume="out", time__end=0.14)
    assert dolfbuoy.load_scene("out/scene.toml").time.end == 0.14


@pytest.mark.parametrize(
    "manifest",
    ["", "[]", '{"run": []}', '{"run": {"files": ["../chain.toml"]}}', '{"run": {"files": ["mine.txt"]}}', '{"a": 1}'],
)
def test_a_list_from_a_stranger_removes_nothing(call, files, manifest):
    """A damaged list of files, or one that names what dolfbuoy never writes, ends in a sentence."""
    (files / "out").mkdir()
    (files / "out" / "mine.txt").write_text("mine")
    (files / "out" / folder.MANIFEST).write_text(manifest)
    refused(call("run", "chain.toml", "--out", "out", "--overwrite"), folder.MANIFEST, "damaged")
    assert (files / "chain.toml").exists()
    assert (files / "out" / "mine.txt").exists()


# -- who writes --------------------------------------------------------------------------------------------------------


def test_a_second_run_in_a_folder_is_refused(call, files):
    """As long as the first goes on, and no longer."""
    seen = []

    def progress(simulation, iterations):
        if not seen:
            seen.append(call("run", "chain.toml", "--out", "out", "--overwrite"))
            seen.append(call("sweep", "chain.toml", "--vary", "gravity=5,6", "--out", "out"))
            with pytest.raises(InputError, match="in use by another run"):
                dolfbuoy.simulate(resume="out")

    run = dolfbuoy.simulate(CHAIN, out="out", progress=progress)
    for done in seen:
        refused(done, "out is in use by another run")
    assert np.array_equal(run.cable_position, dolfbuoy.simulate(CHAIN).cable_position)
    assert call("run", "chain.toml", "--out", "out", "--no-plot")[0] == 0


def test_the_lock_ends_with_its_process(files):
    """Of two processes the second waits for nothing; after `kill -9` of the first the folder is free."""
    lines = "from dolfbuoy.results.folder import claimed", "with claimed('out'): print(1, flush=True); input()"
    command = [sys.executable, "-c", "\n".join(lines)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"1\n"
    with pytest.raises(InputError, match="in use"):
        dolfbuoy.simulate(CHAIN, out="out")
    process.kill()
    process.communicate()
    assert dolfbuoy.simulate(CHAIN, out="out").sizes["time"] == 6


@pytest.mark.mpi
@needs_mpirun
def test_two_ranks_refuse_with_one_sentence(files):
    dolfbuoy.simulate(OTHER, out="out")
    before = contents(files / "out")
    run = ["-m", "dolfbuoy.commands.main", "run", "chain.toml", "--no-plot", "--out", "out"]
    done = start(2, run, files)
    assert done.returncode == 2
    assert done.stderr.count("another scene") == 1
    assert contents(files / "out") == before
    done = start(2, [*run, "--overwrite"], files)
    assert done.returncode == 0, done.stderr
    assert dolfbuoy.load_scene("out/scene.toml") == dolfbuoy.load_scene(CHAIN)


UNWRITABLE = {
    "a file": ("chain.toml", "it is a file"),
    "a device": ("/dev/null", "it is a file"),
    "below a file": ("chain.toml/out", "Not a directory"),
    "no files there": ("/proc/out", "No such file"),
    "too long": ("x" * 300, "too long"),
}


@pytest.mark.parametrize("case", UNWRITABLE)
@pytest.mark.parametrize("command", ["run", "static", "sweep", "advise", "study effects", "study accuracy"])
def test_what_cannot_be_written_is_found_first(call, files, monkeypatch, case, command):
    """Before a form is compiled; as root too."""
    from dolfbuoy.model.problem import Problem

    monkeypatch.setattr(Problem, "__init__", None)
    path, reason = UNWRITABLE[case]
    options = [] if command == "study accuracy" else ["chain.toml"]
    options += ["--vary", "gravity=5,6"] if command == "sweep" else []
    refused(call(*command.split(), *options, "--out", path), path, reason)


# -- what is damaged ---------------------------------------------------------------------------------------------------


def empty(path):
    path.write_bytes(b"")


def halve(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def garbage(path):
    path.write_bytes(np.random.default_rng(3).bytes(5000))


@pytest.mark.parametrize("name", ["results.nc", "scene.toml", "checkpoint.npz"])
@pytest.mark.parametrize("damage", [empty, halve, garbage])
def test_a_damaged_file_is_named(call, files, name, damage):
    dolfbuoy.simulate(CHAIN, out="out")
    damage(files / "out" / name)
    refused(call("run", "--resume", "out", "--t-end", "0.2"), f"out/{name} is damaged")
    if name != "checkpoint.npz":
        refused(call("plot", "out"), f"out/{name} is damaged")
    if name == "results.nc":
        refused(call("run", "chain.toml", "--out", "out"), f"out/{name} is damaged", "--overwrite")
        assert call("run", "chain.toml", "--out", "out", "--overwrite", "--no-plot")[0] == 0


@pytest.mark.parametrize("name", ["results.nc", "checkpoint.npz"])
def test_no_flipped_bit_in_what_counts_goes_unseen(files, name):
    """Either the file is refused, or every number in it is what it was."""
    expected = dolfbuoy.simulate(CHAIN, out="out")
    path = files / "out" / name
    whole, state = path.read_bytes(), checkpoint.load("out", 1)
    places, refusals = np.random.default_rng(7).integers(0, 8 * len(whole), 200), 0
    for place in places:
        spoilt = bytearray(whole)
        spoilt[place // 8] ^= 1 << place % 8
        path.write_bytes(spoilt)
        try:
            found = read(path) if name == "results.nc" else checkpoint.load("out", 1)
        except InputError:
            refusals += 1
            continue
        if name == "results.nc":
            for variable in expected.data_vars:
                assert np.array_equal(found[variable], expected[variable]), (place, variable)
        else:
            assert np.array_equal(found.states[0]["u"], state.states[0]["u"]), place
    assert refusals > 20


def test_an_edited_scene_is_said(call, files):
    dolfbuoy.simulate(CHAIN, out="out")
    assert "no longer the scene" not in call("plot", "out")[1]
    file = files / "out" / "scene.toml"
    file.write_text(file.read_text().replace("line_density = 0.5", "line_density = 0.6"))
    code, out, _ = call("plot", "out")
    assert code == 0
    assert "Warning: out/scene.toml is no longer the scene of the run" in out
    edited = file.read_text()
    refused(call("run", "--resume", "out", "--t-end", "0.2"), "out/scene.toml", "cable.line_density")
    refused(call("run", "other.toml", "--out", "out", "--overwrite"), "out/scene.toml", "move it away")
    assert file.read_text() == edited


# -- warnings of the scene ---------------------------------------------------------------------------------------------

STEEP = merged(MOORED, cable__elements=2, waves={"amplitude": 2.0, "period": 3.0}, time={"end": 0.02, "step": 0.02})


def test_a_run_says_what_check_warns_of(call, files):
    """Every sentence that needs no equilibrium, once, before the run."""
    dolfbuoy.load_scene(STEEP).save(files / "steep.toml")
    expected = [text for text in check(dolfbuoy.load_scene(STEEP)).warnings if "At rest" not in text]
    said = [text for text in expected if "breaking" in text or "D/lambda" in text or "GM" in text]
    assert len(said) >= 1
    code, out, err = call("run", "steep.toml", "--out", "out", "--no-plot")
    assert code == 0, err
    for text in said:
        assert out.count(text) == 1
        assert out.index(text) < out.index("results.nc")


def test_a_sweep_says_of_how_many_cases(call, files):
    dolfbuoy.load_scene(STEEP).save(files / "steep.toml")
    _, out, _ = call("sweep", "steep.toml", "--vary", "waves.amplitude=0.1,1.5,2", "--out", "out")
    (line,) = (line for line in out.splitlines() if "breaking" in line)
    assert line.startswith("Warning: 2 of 3 cases, the first with waves.amplitude = 1.5: The wave")


def test_which_folder_can_go_on(tmp_path):
    """One with all files of a run of the same scene, that no session stepped."""
    scene = dolfbuoy.load_scene(CHAIN)
    folder.begin(tmp_path, "run", scene)
    assert not folder.can_resume(tmp_path, scene)
    for name in ("results.nc", "checkpoint.npz"):
        (tmp_path / name).touch()
    assert folder.can_resume(tmp_path, scene)
    other = dolfbuoy.load_scene(scene, time__end=9.0)
    assert not folder.can_resume(tmp_path, other)
    assert (folder.is_edited(tmp_path, scene), folder.is_edited(tmp_path, other)) == (False, True)
    assert not folder.is_edited(tmp_path / "nowhere", scene)
    folder.remark(tmp_path, "run", session=True)
    assert not folder.can_resume(tmp_path, scene)
    assert not folder.holds(tmp_path, "run", scene, overwrite=True)
