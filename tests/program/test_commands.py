"""A command is declared once, in one module of a folder of commands, and needs no change elsewhere.

Source: the number of shipped scenes, counted through the Python interface.
"""

import sys

import pytest

from dolfbuoy import commands
from dolfbuoy.commands.app import app
from dolfbuoy.scene import shipped_scenes

TALLY = "dolfbuoy.commands.tally"
MODULE = '''"""The number of shipped scenes."""

from dolfbuoy.commands.app import app
from dolfbuoy.commands.shared import out


@app.command("{name}")
def count(least: int = 0):
    """Number of shipped scenes.  Example: dolfbuoy {name}"""
    from dolfbuoy.scene import shipped_scenes

    out.print(f"{{len(shipped_scenes())}} scenes, more than {{least}}")
'''


@pytest.fixture(params=["tally", "count"])
def name(request, tmp_path, monkeypatch):
    """Name of a command that the program does not have, of its module's name or another."""
    (tmp_path / "tally.py").write_text(MODULE.format(name=request.param))
    monkeypatch.setattr(commands, "__path__", [*commands.__path__, str(tmp_path)])
    yield request.param
    app.registered_commands[:] = [c for c in app.registered_commands if c.callback.__module__ != TALLY]
    sys.modules.pop(TALLY, None)
    vars(commands).pop("tally", None)


def test_a_new_command_runs(call, name):
    assert call(name, "--least", "3") == (0, f"{len(shipped_scenes())} scenes, more than 3\n", "")
    assert call(name, "--most", "3")[0] == 2


def test_a_new_command_is_in_the_help(call, name):
    code, out, _ = call("--help")
    assert (code, "Number of shipped scenes." in out) == (0, True)
    assert "Did you mean" in call(f"{name}x")[2]


def test_without_its_module_it_is_unknown(call):
    assert call("tally")[0] == call("count")[0] == 2
    assert "Number of shipped scenes." not in call("--help")[1]


def test_each_command_stands_once():
    """A second command of one name would silently take the place of the first."""
    named = [info.name or info.callback.__name__ for info in app.registered_commands]
    named += [info.name for info in app.registered_groups]
    assert len(named) == len(set(named)) >= 9
