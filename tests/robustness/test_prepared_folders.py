"""Links planted among the results are never followed, and the user's files are not changed.

Source: every file name a command writes, occupied beforehand by a link or a user's file.
"""

import os

import pytest

OWN = "what the user wrote\n"
DRAWN = "run {scene} --t-end 0.02 --paraview --svg --out {folder}"
RUN = "run {scene} --t-end 0.02 --no-plot --out {folder}"
SWEEP = "sweep {scene} --vary time.end=0.01 --out {folder}"
#: command: names in its folder, taken one by one; a slash behind a name: a link to a folder.
PREPARED = {
    RUN: (
        *(".results.nc.part", ".checkpoint.npz.part", ".scene.toml.part", "..dolfbuoy.json.part"),
        *("results.nc", "scene.toml", "checkpoint.npz", ".dolfbuoy.lock"),
    ),
    DRAWN: (
        *("figures/", "paraview/", "figures/tension.png", "figures/.tension.svg.part", "paraview/cable_0000.vtu"),
        *("paraview/.cable.pvd.part", "page.html", ".page.html.part"),
    ),
    "static {scene} --out {folder}": ("static.nc", ".static.nc.part", "static.toml", ".static.toml.part"),
    "export moordyn {scene} --out {folder}": ("lines.txt", ".lines.txt.part"),
    SWEEP: (
        *("sweep.nc", "sweep.png", "sweep.svg", "sweep.html", ".sweep.nc.part", ".sweep.png.part"),
        *("cases/", "cases/rank-0.jsonl", "running/", "records/"),
    ),
    f"{SWEEP} --keep": ("records/",),
    f"{SWEEP} --part 1/1": ("cases/", "cases/part-1-of-1/", "cases/part-1-of-2/"),
}
LINKS = [(command, name) for command, names in PREPARED.items() for name in names]
#: command: files that it would replace, of the user's own.
WRITTEN = {
    RUN: ("results.nc", "scene.toml", "checkpoint.npz"),
    "static {scene} --out {folder}": ("static.nc", "static.toml"),
    "export moordyn {scene} --out {folder}": ("lines.txt",),
    SWEEP: ("sweep.nc", "sweep.png", "sweep.svg", "sweep.html"),
    "statistics {record} --out {folder} --from 0.001": ("statistics.nc", "exceedance.png", "circle.svg"),
    "compare moordyn {scene} --out {folder}": ("comparison.json", "comparison.png"),
    "advise {scene} --accuracy 5% --quantity tension_anchor --out {folder}/work --write {folder}/mine.toml": (
        "mine.toml",
    ),
    "modes {scene} --number 2 --out {folder}": ("modes.nc", "modes.toml", "modes.html"),
    "stiffness short --out {folder}": ("stiffness.nc", "stiffness.toml"),
    "offsets short --force 0,100 --directions 0 --out {folder}": ("offsets.nc", "offsets.toml"),
    "response short --periods 4:6:1 --out {folder}": ("response.nc", "response.toml"),
    "periodic driven --out {folder}": ("periodic.nc", "periodic.toml"),
    "import moordyn {lines} --out {folder}/mine.toml": ("mine.toml",),
    "new {folder}/mine": ("mine.toml",),
    "library --out {folder}": ("libdolfbuoy.so", "dolfbuoy.h"),
    "fmu {scene} --drive chain.from --out {folder}/mine.fmu": ("mine.fmu",),
    "sensitivity {scene} --static --by cable.length --out {folder}": ("sensitivity.nc", "figures/tornado.svg"),
    "uncertain {scene} --set uncertain.gravity=0.1 --out {folder}": ("uncertain.nc",),
    "design {scene} --vary cable.length=1..2 --least cable.length --out {folder}": ("design.nc", "designed.toml"),
}
FILES = [(command, name) for command, names in WRITTEN.items() for name in names]


@pytest.fixture
def outside(tmp_path):
    """What a link leads to."""
    place = tmp_path / "outside"
    (place / "inner").mkdir(parents=True)
    (place / "file").write_text(OWN)
    return place


@pytest.fixture
def line(call, files, tmp_path):
    """A function that makes a command line of one of the above."""

    def made(command, folder):
        if "{lines}" in command:
            call("export", "moordyn", "hanging-chain", "--out", tmp_path / "moordyn")
        scene, lines = tmp_path / "chain.toml", tmp_path / "moordyn" / "lines.txt"
        filled = command.format(scene=scene, folder=folder, record=tmp_path / "record", lines=lines)
        return filled.split()

    return made


def contents(place):
    return {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}


@pytest.mark.parametrize("target", ["there", "gone"])
@pytest.mark.parametrize(("command", "name"), LINKS)
def test_prepared_links_lead_nowhere(call, line, outside, tmp_path, command, name, target):
    """They are replaced, or refused in one sentence."""
    folder = tmp_path / "stranger"
    link = folder / name.rstrip("/")
    link.parent.mkdir(parents=True)
    inside = "inner" if name.endswith("/") else "file"
    link.symlink_to(outside / (inside if target == "there" else f"new-{inside}"))
    before = contents(outside), sorted(outside.rglob("*"))
    code, _, said = call(*line(command, folder))
    assert (contents(outside), sorted(outside.rglob("*"))) == before
    assert "Traceback" not in said
    assert code in (0, 1, 2), said
    if code:
        assert said.splitlines()[-1].startswith("Error: ")
        assert str(folder) in said


@pytest.mark.parametrize(("command", "name"), FILES)
def test_files_of_the_user_stay(call, line, tmp_path, command, name):
    """And the refusal names them, before anything is computed."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text(OWN)
    code, _, said = call(*line(command, folder))
    assert code == 2, said
    assert str(folder / name) in said
    assert said.count("\n") == 1
    assert (folder / name).read_text() == OWN


@pytest.mark.parametrize(("command", "name"), [case for case in FILES if "--write" in case[0] or "export" in case[0]])
def test_what_may_be_overwritten(call, line, tmp_path, command, name):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / name).write_text(OWN)
    code, _, said = call(*line(command, folder), "--overwrite")
    assert code == 0, said
    assert (folder / name).read_text() != OWN


@pytest.mark.parametrize("command", [RUN, SWEEP, "export moordyn {scene}"])
def test_a_default_folder_is_no_link(call, line, outside, monkeypatch, tmp_path, command):
    monkeypatch.chdir(tmp_path)
    os.symlink(outside / "inner", "results")
    code, _, said = call(*line(command.removesuffix(" --out {folder}"), ""))
    assert code == 2
    assert "results is a link" in said
    assert list((outside / "inner").iterdir()) == []


def test_own_results_are_replaced(call, line, tmp_path):
    """The sweep's, when the same command goes on; they are noted as the program's."""
    for _ in range(2):
        code, _, said = call(*line(SWEEP, tmp_path / "mine"))
        assert code == 0, said


def test_a_file_among_the_cases_stays(call, line, tmp_path):
    """Where the results of the first process go; they go to another file then, and are found there."""
    folder = tmp_path / "mine"
    own = folder / "cases" / "rank-0.jsonl"
    own.parent.mkdir(parents=True)
    own.write_text(OWN)
    for _ in range(2):
        code, _, said = call(*line(SWEEP, folder))
        assert code == 0, said
        assert own.read_text() == OWN
        assert sorted(path.name for path in own.parent.glob("*.jsonl")) == ["rank-0-1.jsonl", "rank-0.jsonl"]
        assert len((own.parent / "rank-0-1.jsonl").read_text().splitlines()) == 1
