"""README files: their scene and Python example run, their numbers are measured, and the names in them exist.

Source: the existing files, commands and keys.
"""

import re
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.main import get_command

from dolfbuoy import figures, load_scene, simulate
from dolfbuoy.check import check
from dolfbuoy.commands.main import app

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "tests" / "benchmarks" / "results"
README = (ROOT / "README.md").read_text()
FOLDERS = ("forms", "meshes", "dolfbuoy", "tests", "docker", ".ci")
TEXTS = sorted([*ROOT.glob("*.md"), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.md"))])
#: What a checkout has and an image of docker/Dockerfile has not, see .dockerignore.
whole_tree = pytest.mark.skipif(not (ROOT / ".ci").is_dir(), reason="an image leaves out what is not the program")


def block(language):
    """The one block of code of that language in the README at the top."""
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
    return found


def test_readme_is_one_that_a_newcomer_reads():
    assert len(README.splitlines()) <= 150
    for command in ("dolfbuoy run short", "pytest"):
        assert f"\n    sh docker/install.sh && .venv/bin/{command} " in README


def test_scene_and_python_of_the_readme_run(tmp_path, monkeypatch, capsys):
    scene, code = block("toml"), block("python")
    assert [len([line for line in text.splitlines() if line]) for text in (scene, code)] == [9, 4]
    monkeypatch.chdir(tmp_path)
    Path("buoy.toml").write_text(scene)
    names = {}
    exec(code, names)
    rest, record = names["rest"], names["record"]
    assert load_scene("buoy.toml").title == tomllib.loads(scene)["title"] == record.attrs["title"]
    assert record.attrs["failed_steps"] == 0
    assert record.time[-1] == 20.0
    lying = record.length_on_bed.values > 0  # else there is no touchdown
    assert np.isfinite(record.touchdown.values[lying]).all()
    assert all(np.isfinite(record[name]).all() for name in record.data_vars if name != "touchdown")
    assert record.cable_tension.min() > 0
    assert float(capsys.readouterr().out.split()[0]) == pytest.approx(
        record.tension_top.max().item() / rest.tension_top.item(), abs=0.005
    )


def test_the_picture_is_of_this_scene():
    """The file keeps title and legend as its description, with the tensions and forces: a run has the same now."""
    figure = figures.snapshot(simulate(tomllib.loads(block("toml"))))
    said = [text.get_text() for text in (*figure.texts, *figure.legends[0].get_texts())]
    with Image.open(ROOT / "dolfbuoy" / "scenes" / "moored-buoy.png") as picture:
        assert picture.text["Description"].splitlines() == [text.replace("\xa0", " ") for text in said]


@pytest.mark.parametrize("section", ["seabed", "waves", "current", "wind"])
def test_a_line_of_the_scene_is_an_effect(section):
    with_it = tomllib.loads(block("toml"))
    without = {key: value for key, value in with_it.items() if key != section}
    before, after = (set(check(load_scene(scene)).effects) for scene in (with_it, without))
    assert after < before
    words = {"seabed": "bed"}.get(section, section)
    assert all(words in name or "Froude-Krylov" in name for name in before - after)


def test_times_of_the_readme_are_measured_ones():
    """Each pair of times in the table of speed stands, with its ratio, in the table that it sums up."""
    measured = (RESULTS / "times.md").read_text()
    header = "| | 1 % | MoorDyn | | 0.1 % | MoorDyn | |"
    rows = README[README.index(header) :].split("\n\n")[0].splitlines()[2:]
    cells = [[cell.strip().removesuffix(" s") for cell in row.strip("|").split("|")] for row in rows]
    assert len(cells) == 10
    for name, *found in cells:
        for dolfbuoy, moordyn, faster in zip(found[::3], found[1::3], found[2::3], strict=True):
            if moordyn != "missed":
                pattern = rf"\| {re.escape(moordyn)} ± [^\n]*\| {re.escape(dolfbuoy)} ± [^|]*\| {re.escape(faster)} \|"
                assert re.search(pattern, measured), (name, dolfbuoy, moordyn)


@cache
def anchors(path):
    """Names of the headings of a markdown file, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@whole_tree
@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)\s]+)\)", path.read_text()):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        file = (path.parent / name).resolve() if name else path
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


def named_files(text):
    """Paths from the root of this tree that a text names, in commands and tables as well as in sentences."""
    folders = "|".join(map(re.escape, FOLDERS))
    return [found.rstrip(".") for found in re.findall(rf"(?<![\w./-])((?:{folders})/[\w./*-]*)", text)]


@whole_tree
@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_named_files_exist(path):
    text = re.sub(r"\]\([^)\s]+\)", "]", path.read_text())  # links are another matter
    missing = [name for name in named_files(text) if not any(ROOT.glob(name.rstrip("/")))]
    assert missing == []
    beside = [path.parent, path.parent / "results"]
    sources = re.findall(r"`([\w-]+\.(?:py|md|sh|png))`", text)
    assert [name for name in sources if not any((folder / name).exists() for folder in beside)] == []


def test_named_commands_exist():
    group = get_command(app)
    named = set()
    for path in TEXTS:
        text = path.read_text()
        code = [*re.findall(r"`([^`\n]+)`", text), *re.findall(r"^    (?:\$ )?(.*)$", text, flags=re.MULTILINE)]
        named |= {found for line in code for found in re.findall(r"\bdolfbuoy (study [a-z][a-z-]+|[a-z]+)", line)}
    assert len(named) > 15
    studies = {f"study {name}" for name in group.get_command(None, "study").commands}
    assert named <= {*group.list_commands(None), *studies}
    assert studies <= named


def test_named_files_are_found():
    text = "see `forms/cable.py`, `tests/nothing.py -k x`; sh docker/install.sh, ./docker, results/short, dolfbuoy/."
    assert named_files(text) == ["forms/cable.py", "tests/nothing.py", "docker/install.sh", "dolfbuoy/"]
