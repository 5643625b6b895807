"""The study runner and its commands: files, exit codes, and the table of hard cases.

Source: made-up studies and cases, counted by hand.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import mpi_helpers
import pytest
from mpi_helpers import environment
from typer.testing import CliRunner

from dolfbuoy.commands.study import studies
from dolfbuoy.errors import InputError
from dolfbuoy.studies import hard_cases
from dolfbuoy.studies.accuracy import inf_sup
from dolfbuoy.studies.study import Table, run_command, save

COMMANDS = [command.name or command.callback.__name__ for command in studies.registered_commands]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example(name):
    shown = CliRunner().invoke(studies, [name, "--help"], env={"COLUMNS": "200", "TERM": "dumb"}).output
    assert f"dolfbuoy study {name}" in shown
    assert "results/study-NAME" in shown


def test_options_of_wrong_kind_are_refused():
    done = CliRunner().invoke(studies, ["work-precision", "short", "--repeats", "0"])
    assert done.exit_code == 2
    assert "--repeats" in done.output


@pytest.mark.parametrize("name", ["tables.md", "made-up.json", "made-up.csv", "made-up.png"])
def test_files_of_the_user_are_refused_before_the_work(tmp_path, name):
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=f"{name} would be replaced"):
        run_command("made-up", lambda folder: pytest.fail("computed"), tmp_path)
    assert (tmp_path / name).read_text() == "mine"


def test_a_table_is_written_and_read(tmp_path):
    """Rows of different keys share one header; a table without a figure has no picture."""
    save(tmp_path, Table("name", [{"a": 1, "b": None}, {"a": 2.5, "c": "x"}], notes=["said"]))
    assert (tmp_path / "name.csv").read_text().splitlines() == ["a,b,c", "1,,", "2.5,,x"]
    assert sorted(file.name for file in tmp_path.iterdir()) == [".dolfbuoy.json", "name.csv", "name.json"]


@pytest.mark.parametrize("passed", [True, False])
def test_a_study_that_fails_is_exit_code_1(monkeypatch, tmp_path, passed):
    monkeypatch.setattr(inf_sup, "study", lambda folder: [Table("", [], columns={"a": "b"}, passed=passed)])
    assert run_command("inf-sup", inf_sup.study, tmp_path) is passed
    assert CliRunner().invoke(studies, ["inf-sup", "--out", str(tmp_path)]).exit_code == (0 if passed else 1)


CASES = '''
import pytest
from hard import Findings


@pytest.fixture
def found(request):
    return Findings(request.node)


def test_good_one(found):
    """Asked | this.  Must show: that."""
    found.close("one", 1.0, 1.0, 1e-9)


def test_bad_one(found):
    """Asked.  Must show: what it does not."""
    found.remark("before")
    found.below("two", 2.0, 1.0)


@pytest.mark.slow("expensive")
def test_dear_one(found):
    """Nothing is measured.  Must show: a failure."""
'''


@pytest.fixture
def hard(tmp_path):
    """What `study hard-cases` prints of cases that pass, fail, and measure nothing, in place of the hard ones; in a
    process of its own, since it runs pytest."""
    place = tmp_path / "checkout" / "tests" / "robustness"
    place.mkdir(parents=True)
    settings = '[tool.pytest.ini_options]\nmarkers = ["slow: or not"]\n'
    (tmp_path / "checkout" / "pyproject.toml").write_text(settings)
    (place / "test_hard_made_up.py").write_text(CASES)
    paths = os.pathsep.join(filter(None, [str(Path(mpi_helpers.__file__).parent), os.environ.get("PYTHONPATH")]))

    def printed(*options):
        arguments = "dolfbuoy", "study", "hard-cases", "--out", tmp_path / "out", *options
        code = SCRIPT.format(place=str(place), arguments=[*map(str, arguments)])
        program = [sys.executable, "-c", code]
        done = subprocess.run(program, capture_output=True, text=True, env=environment(PYTHONPATH=paths), timeout=300)
        return done.returncode, done.stdout + done.stderr

    return printed


SCRIPT = """
import sys
from pathlib import Path
from dolfbuoy.commands.main import main
from dolfbuoy.studies import hard_cases

hard_cases.TESTS, sys.argv = Path({place!r}), {arguments!r}
main()
"""


@pytest.mark.slow
def test_hard_cases_in_a_table(hard, tmp_path):
    """Table, JSON and markdown; what was measured of a case that fails is told too."""
    assert hard("--only", "good")[0] == 0
    code, printed = hard()
    assert code == 1
    assert "1 of 2 cases pass." in printed
    good, bad = json.loads((tmp_path / "out" / "hard-cases.json").read_text())["rows"]
    assert (good["passed"], bad["passed"]) == (True, False)
    assert bad["happened"] == "before; two 2 (at most 1)"
    assert "two 2 (at most 1)" in bad["failed"][0]
    lines = (tmp_path / "out" / "hard-cases.md").read_text().splitlines()
    assert lines[2].startswith("| good-one | Asked \\| this | that | one 1, expected 1")
    assert "1 of 2 cases pass" in (tmp_path / "out" / "tables.md").read_text()
    assert "1 of 3 cases pass" in hard("--slow")[1]
    code, printed = hard("--only", "c")
    assert (code, "no case is called so; there are good-one, bad-one, dear-one" in printed) == (2, True)


def test_hard_cases_belong_to_a_checkout(tmp_path, monkeypatch):
    monkeypatch.setattr(hard_cases, "TESTS", tmp_path)
    with pytest.raises(InputError, match=r"tests/robustness/test_hard_\*\.py of a checkout"):
        hard_cases.cases()
