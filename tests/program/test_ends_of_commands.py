"""Start and end of commands in this process: the entry point, invalid options, exit codes and final messages.

Source: the same words by hand; made-up errors and streams.
"""

import gc
import importlib
import logging
import os
import sys
from types import SimpleNamespace

import click
import pytest
import typer

from dolfbuoy import InputError
from dolfbuoy.commands import app as group
from dolfbuoy.commands import entry, main
from dolfbuoy.commands.shared import Interrupted
from dolfbuoy.parallel import interruption, ranks

# -- how it ends -------------------------------------------------------------------------------------------------------


def test_last_words_come_after_all_others(monkeypatch):
    """What was printed is written before the message."""
    told = []
    monkeypatch.setattr(main.sys, "stdout", SimpleNamespace(flush=lambda: told.append("flushed")))
    monkeypatch.setattr(ranks, "end", lambda say, code: told.append(code))
    main._fail("It fails", 7)
    assert told == ["flushed", 7]


@pytest.fixture
def pipe(tmp_path, monkeypatch):
    """A call that puts a file in the place of a standard output that nobody reads any more; another one that writes
    more to it, and reads the file."""

    def flush():
        raise BrokenPipeError

    def written():
        os.write(file.fileno(), b"more")
        return (tmp_path / "pipe").read_bytes()

    with (tmp_path / "pipe").open("w") as file:
        gone = SimpleNamespace(fileno=file.fileno, flush=flush)
        yield lambda: monkeypatch.setattr(main.sys, "stdout", gone), written


def test_what_cannot_be_written_goes_nowhere(pipe, monkeypatch):
    told, (close, written) = [], pipe
    monkeypatch.setattr(ranks, "end", lambda say, code: told.append(code))
    close()
    main._fail("It fails", 7)
    assert (told, written()) == ([7], b"")


def test_a_pipe_that_is_closed_is_no_failure(pipe, monkeypatch):
    def app(**_):
        raise BrokenPipeError

    close, written = pipe
    monkeypatch.setattr(main, "app", app)
    close()
    with pytest.raises(SystemExit) as stop:
        main.main()
    assert (stop.value.code, written()) == (0, b"")


@pytest.mark.parametrize(
    ("error", "received", "several", "code", "said"),
    [
        (ValueError("odd"), True, False, 130, "Interrupted.\n"),
        (ValueError("odd"), False, True, 1, "ValueError: odd\nError on rank 3; this is a fault of the program.\n"),
        (SystemExit(2), True, False, 130, "Interrupted.\n"),
        (OSError("torn"), False, False, 1, "Error: cannot read or write: torn.\n"),
        (OSError(5, "broken"), False, False, 1, "Error: cannot read or write: broken.\n"),
        (OSError(5, "broken", "a\nb"), False, False, 1, "Error: cannot read or write a\\nb: broken.\n"),
        (KeyboardInterrupt(), False, False, 130, "Interrupted.\n"),
    ],
)
def test_ways_to_end(error, received, several, code, said, monkeypatch, capsys):
    def app(standalone_mode):
        assert standalone_mode
        interruption._received = received
        raise error

    monkeypatch.setattr(main, "app", app)
    monkeypatch.setattr(interruption, "_received", False)
    monkeypatch.setattr(ranks, "several", lambda: several)
    monkeypatch.setattr(main, "rank", lambda: 3)
    monkeypatch.setattr(interruption, "listen", lambda: None)
    with pytest.raises(SystemExit) as stop:
        main.main()
    err = capsys.readouterr().err
    assert stop.value.code == code
    assert err == said or ("Traceback" in err and err.endswith(said))


@pytest.mark.parametrize("error", [ValueError("odd"), ImportError("no such thing", name="elsewhere"), SystemExit(3)])
def test_faults_of_the_program_have_their_traceback(error, monkeypatch):
    def app(**_):
        raise error

    monkeypatch.setattr(main, "app", app)
    with pytest.raises(type(error)) as raised:
        main.main()
    assert raised.value is error


@pytest.mark.parametrize("looks_on", [True, False])
def test_who_looks_on_is_told_what_takes_long(looks_on, monkeypatch):
    """Notices of the compiler, and no other logs."""
    log = logging.Logger("made up")
    made = SimpleNamespace(getLogger=lambda name: {"dolfbuoy": log}[name], StreamHandler=logging.StreamHandler)
    monkeypatch.setattr(main, "logging", made)
    monkeypatch.setattr(main, "app", lambda standalone_mode: None)
    monkeypatch.setattr(main.sys, "stderr", SimpleNamespace(isatty=lambda: looks_on, flush=lambda: None))
    main.main()
    from dolfbuoy.solver.jit import NOTICE

    assert [type(one) for one in log.handlers] == [logging.StreamHandler] * looks_on
    assert (log.level, log.propagate) == ((NOTICE, False) if looks_on else (0, True))


# -- the entry ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def begun(monkeypatch):
    """What the entry does, in order."""
    told = []
    monkeypatch.setattr(entry.gc, "set_threshold", lambda count: told.append(count))
    monkeypatch.setattr(entry.sys, "setdlopenflags", told.append)
    monkeypatch.setattr(entry, "_open_streams", lambda: told.append("streams"))
    for name in ("listen", "ignore"):
        monkeypatch.setattr(interruption, name, lambda name=name: told.append(name))
    monkeypatch.delenv("PYDANTIC_DISABLE_PLUGINS", raising=False)
    monkeypatch.setattr(main, "main", lambda: told.append(os.environ["PYDANTIC_DISABLE_PLUGINS"]))
    return told


def test_the_entry(begun, monkeypatch):
    """Nothing is collected of what imports leave; signals are noted from before the imports to the end."""
    entry.main()
    assert begun == [300_000, "streams", os.RTLD_LAZY, "listen", "1", "ignore"]
    assert gc.get_threshold()[0] != 300_000  # this process goes on as it was
    monkeypatch.setenv("PYDANTIC_DISABLE_PLUGINS", "own")
    entry.main()
    assert begun[-2] == "own"


@pytest.mark.parametrize(
    ("error", "received", "ends"),
    [
        (SystemExit(3), True, SystemExit(3)),
        (ValueError("odd"), False, ValueError("odd")),
        (ValueError("odd"), True, SystemExit(130)),
        (KeyboardInterrupt(), True, SystemExit(130)),
    ],
)
def test_ends_of_the_entry(begun, error, received, ends, monkeypatch, capsys):
    def command():
        raise error

    monkeypatch.setattr(main, "main", command)
    monkeypatch.setattr(interruption, "_received", received)
    with pytest.raises(type(ends)) as raised:
        entry.main()
    assert raised.value.args == ends.args
    assert begun[-1] == "ignore"
    assert capsys.readouterr() == ("", "Interrupted.\n" if ends.args == (130,) else "")


@pytest.mark.parametrize(("given", "moved"), [(7, True), (0, False)])
def test_streams_that_are_closed(given, moved, monkeypatch, capsys):
    """Are nothing from the null device, at the number that they had; without an output nothing is done."""
    told, real = [], [sys.stdout, sys.stderr]
    made = SimpleNamespace(devnull="null", O_RDWR=2, open=lambda *how: told.append(how) or given)
    made.dup2, made.close = (lambda *numbers: told.append(numbers)), lambda number: told.append(number)
    made.fdopen = lambda number, mode: (number, mode)
    streams = SimpleNamespace(stdin=None, stdout=real[0], stderr=real[1])
    monkeypatch.setattr(entry, "os", made)
    monkeypatch.setattr(entry, "sys", streams)
    entry._open_streams()
    assert (streams.stdin, streams.stdout) == ((0, "r"), real[0])
    assert told == [("null", 2), *([(7, 0), 7] if moved else [])]

    def left(code):
        raise SystemExit(code)

    streams.stdout, streams.exit = None, left
    with pytest.raises(SystemExit) as stop:
        entry._open_streams()
    assert (stop.value.code, streams.stdout) == (1, (1, "w"))
    said = "Error: standard output is closed; > /dev/null takes what is printed.\n"
    assert capsys.readouterr().err == said


def test_characters_that_a_stream_does_not_have(monkeypatch):
    """Are shown as escapes, on both streams; a stream of another kind is left alone."""
    told = []
    streams = [SimpleNamespace(reconfigure=lambda errors, k=k: told.append((k, errors))) for k in (1, 2)]
    monkeypatch.setattr(entry.sys, "stdout", streams[0])
    monkeypatch.setattr(entry.sys, "stderr", streams[1])
    entry._open_streams()
    assert told == [(1, "backslashreplace"), (2, "backslashreplace")]
    monkeypatch.setattr(entry.sys, "stdout", SimpleNamespace())
    entry._open_streams()
    assert told[2:] == [(2, "backslashreplace")]


def test_modules_of_commands(monkeypatch):
    """The one of its name or its function first, all for what nobody is named; none that starts the program."""
    modules = group._modules()
    assert "sweep" in modules
    assert modules == sorted(modules)
    assert not {"entry", "main", "__init__"} & set(modules)
    asked, own = [], group._Group(name="made up")
    monkeypatch.setattr(group._Group, "_import", lambda self, names: asked.append(names))
    assert own.get_command(None, "sweep") is None
    assert asked == [["sweep"], modules]
    for name, module in (
        ("modes", ["linear"]),
        ("import", ["formats"]),
        ("study", ["study"]),
        ("mode", []),
        ("m.*", []),
    ):
        assert own.get_command(None, name) is None
        assert asked[-2:] == [module, modules]
    own.commands["stiffness"] = click.Command("stiffness")
    assert own.get_command(None, "stiffness").name == "stiffness"
    assert len(asked) == 12


@pytest.mark.parametrize("received", [True, False])
def test_an_interruption_of_a_command(received, monkeypatch):
    """Ends in our own words, whatever it was turned into; in those of the command, if it has any."""
    monkeypatch.setattr(interruption, "_received", received)
    for error, ends in (
        (ValueError("odd"), "Interrupted." if received else "odd"),
        (Interrupted("What is left."), "What is left."),
    ):

        def invoke(self, ctx, error=error):
            raise error

        monkeypatch.setattr(group.TyperGroup, "invoke", invoke)
        with pytest.raises(Interrupted if received else type(error), match=ends):
            group._Group(name="made up").invoke(None)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--number", "3"], None),
        (["--number=3", "--direction", "-1e3"], None),
        (["--set", "a=1", "--set", "b=2"], None),
        (["--number", "1_0"], "--number 1_0: must be a number in plain digits, such as 10 or 0.5."),
        (["--number=1_0"], "--number 1_0: must be a number in plain digits, such as 10 or 0.5."),
        (["--direction", "\u0663"], "--direction \u0663: must be a number in plain digits, such as 10 or 0.5."),
        (["--out", "1_0"], None),
        (["--out", " "], "--out '': must not be empty."),
        (["--out="], "--out '': must not be empty."),
        (["--svg"], None),
        (["--out", "a", "--out=b"], "--out: must be given once; what it takes several of stands in it with commas."),
    ],
)
def test_options_that_nobody_means(arguments, said):
    command = typer.main.get_command(group.app).get_command(None, "modes")
    if said is None:
        group._check_options(command, arguments)
        return
    with pytest.raises(InputError) as error:
        group._check_options(command, arguments)
    assert str(error.value) == said


def test_nothing_is_held_or_received_at_first():
    name = interruption.__name__
    with pytest.MonkeyPatch.context() as patch:
        patch.delitem(sys.modules, name)
        fresh = importlib.import_module(name)
    importlib.import_module("dolfbuoy.parallel").interruption = interruption
    assert fresh is not interruption
    assert (fresh._held, fresh._received) == (False, False)
