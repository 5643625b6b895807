"""Fixtures of several files of tests."""

import pytest


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

    monkeypatch.setattr(cli.out, "width", 300)
    monkeypatch.setattr(cli.err, "width", 300)
    return run
