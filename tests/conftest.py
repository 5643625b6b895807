"""Fixtures of several files of tests."""

import sys

import pytest


def pytest_collection_finish():
    """Seldom look for garbage: among all that pytest holds of all tests it takes a third of a second each time."""
    problem = sys.modules.get("dolfbuoy.model.problem")
    if problem is not None:
        problem.COLLECTED = 64


@pytest.fixture
def call(monkeypatch, capsys):
    """call("run", "short", ...): a command line in this process; (exit code, standard output, standard error)."""
    from dolfbuoy.commands import main as cli

    def run(*arguments):
        monkeypatch.setattr("sys.argv", ["dolfbuoy", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    # else usage names `python -m pytest`
    monkeypatch.setattr(sys.modules["__main__"], "__package__", None, raising=False)
    monkeypatch.setattr(cli.out, "width", 300)
    monkeypatch.setattr(cli.err, "width", 300)
    return run


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder to work in, with the two scenes of `chains`."""
    from chains import CHAIN, OTHER

    from dolfbuoy import load_scene
    from dolfbuoy.parallel import interruption

    load_scene(CHAIN).save(tmp_path / "chain.toml")
    load_scene(OTHER).save(tmp_path / "other.toml")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(interruption, "_received", False)  # a test that interrupts leaves it behind
    return tmp_path
