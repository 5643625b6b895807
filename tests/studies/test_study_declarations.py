"""What studies declare in their files of words is what their modules use, and makes their commands.

Source: the modules' own text, and the help that typer makes.
"""

import ast
import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dolfbuoy import studies
from dolfbuoy.commands.study import app
from dolfbuoy.studies.declaration import STUDIES, declared
from dolfbuoy.studies.study import Table, run_command, save

FOLDER = Path(studies.__file__).parent
#: Modules with a file of words; the report's sentences are its own.
SPEAKING = sorted(file.with_suffix(".py") for file in FOLDER.rglob("*.toml") if file.with_suffix(".py").is_file())


def said_in(module: Path) -> set[str]:
    """Texts in a module: among them the names of its sentences."""
    return {node.value for node in ast.walk(ast.parse(module.read_text())) if isinstance(node, ast.Constant)}


@pytest.mark.parametrize("module", SPEAKING, ids=lambda module: module.stem)
def test_every_sentence_is_said(module):
    """Each is named in the module, whole or as the end of a name that is put together."""
    texts = {text for text in said_in(module) if isinstance(text, str)}
    for name in declared(str(module)).words:
        assert (
            name in texts
            or any(text and name.endswith(text) for text in texts if text.startswith("_"))
            or any(text.endswith("_") and name.startswith(text) for text in texts)
        ), name


@pytest.mark.parametrize("module", SPEAKING, ids=lambda module: module.stem)
def test_every_sentence_that_is_said_is_there(module):
    words = declared(str(module)).words
    for name in re.findall(r'(?:WORDS\.say|\bsay)\("(\w+)"', module.read_text()):
        assert name in words


@pytest.mark.parametrize("name", STUDIES)
def test_a_command_has_the_options_of_its_study(name):
    """All are in its help, and are what `request`, or else `cases`, takes."""
    declaration, module = declared(STUDIES[name]), import_module(f"dolfbuoy.studies.{STUDIES[name]}")
    shown = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "200", "TERM": "dumb"}).output
    assert f"dolfbuoy study {name}" in declaration.help
    for option in declaration.options:
        assert (option.metavar if option.argument else f"--{option.name.replace('_', '-')}") in shown
        if option.default not in (None, False):
            assert str(option.default) in shown
    taken = inspect.signature(getattr(module, "request", None) or getattr(module, "compute", None) or module.cases)
    names = {option.name for option in declaration.options} - {"out"}
    free = any(p.kind is p.VAR_KEYWORD for p in taken.parameters.values())
    assert names <= set(taken.parameters) or free
    assert {"tables"} <= set(vars(module))


def test_options_of_wrong_kind_are_refused():
    done = CliRunner().invoke(app, ["slack", "--t-end", "3"])
    assert done.exit_code == 2
    assert "15" in done.output


def test_a_table_is_written_and_read(tmp_path):
    """Rows of different keys share one header; a table without a figure has no picture."""
    save(tmp_path, Table("name", [{"a": 1, "b": None}, {"a": 2.5, "c": "x"}], notes=["said"]))
    assert (tmp_path / "name.csv").read_text().splitlines() == ["a,b,c", "1,,", "2.5,,x"]
    assert sorted(file.name for file in tmp_path.iterdir()) == [".dolfbuoy.json", "name.csv", "name.json"]


def test_a_study_that_fails_is_exit_code_1(monkeypatch, tmp_path):
    from dolfbuoy.studies.stability import inf_sup

    monkeypatch.setattr(inf_sup, "cases", list)
    monkeypatch.setattr(inf_sup, "tables", lambda rows: [Table("", rows, passed=False)])
    assert not run_command("inf-sup", tmp_path)
    assert CliRunner().invoke(app, ["inf-sup", "--out", str(tmp_path)]).exit_code == 1
    monkeypatch.setattr(inf_sup, "tables", lambda rows: [Table("", rows)])
    assert run_command("inf-sup", tmp_path)
    assert CliRunner().invoke(app, ["inf-sup", "--out", str(tmp_path)]).exit_code == 0
