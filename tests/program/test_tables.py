"""Tables on a terminal, in a pipe and in a file: only a terminal limits the width.

Source: the given rows, read back from the text.
"""

import io
import subprocess
import sys

import pytest

from dolfbuoy.results import tables
from dolfbuoy.results.tables import newtons, plain

ROW = {
    "length": "in [m], [sea]",
    "what": "a sentence that is a good deal longer than a terminal is wide, " * 3,
    "size": 1.23456789,
    "none": None,
}
COLUMNS = {"length": "H [m]", "what": "what is said", "size": "how large", "none": "nothing"}


class Terminal(io.StringIO):
    """Text that says it goes to a terminal."""

    def isatty(self):
        return True


def shown(monkeypatch, file):
    monkeypatch.setattr(sys, "stdout", file)
    tables.show("Title", [ROW, ROW], COLUMNS, ["a note [s] " * 30])
    return file.getvalue().splitlines()


def test_a_table_in_a_file_is_not_cut(monkeypatch):
    """Every cell is there, whole, in one line, brackets too; numbers have four digits and stand right."""
    title, head, rule, *rows, note = shown(monkeypatch, io.StringIO())
    assert title.strip() == "Title"
    assert [cell.strip() for cell in head.split("┃")] == list(COLUMNS.values())
    assert len(rows) == 2
    for row in rows:
        assert [cell.strip() for cell in row.split("│")] == [ROW["length"], ROW["what"].strip(), "1.235", "-"]
        assert row.endswith(" -")
        assert len(row) == len(rule) > 150
    assert note == "a note [s] " * 30


@pytest.mark.parametrize(
    ("values", "heading", "cells"),
    [
        ([1500.0, None, -20], "T [kN]", ["1.5", "-", "-0.02"]),
        ([999.0, float("nan"), -20], "T [N]", ["999", "nan", "-20"]),
        ([float("inf"), 0, 1.0], "T [N]", ["inf", "0", "1"]),
        ([None, None, None], "T [N]", ["-", "-", "-"]),
    ],
)
def test_forces_have_the_unit_of_their_size(monkeypatch, values, heading, cells):
    file = io.StringIO()
    monkeypatch.setattr(sys, "stdout", file)
    tables.show("", [{"T": value, "x": 5000.0} for value in values], {"T": "T [N]", "x": "x [m]"})
    head, _, *rows = [line for line in file.getvalue().splitlines() if line.strip()]
    assert [cell.strip() for cell in head.split("┃")] == [heading, "x [m]"]
    assert [[cell.strip() for cell in row.split("│")] for row in rows] == [[cell, "5000"] for cell in cells]


@pytest.mark.parametrize("columns", ["40", "70"])
def test_a_table_on_a_terminal_is_as_wide_as_it(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(tables, "out", tables.Output(no_color=True, force_terminal=False))
    lines = shown(monkeypatch, Terminal())
    assert len(lines) > 10
    assert max(len(line) for line in lines[:-1]) <= int(columns)


def test_a_command_in_a_pipe(tmp_path):
    """The table of a study whose columns do not fit into 80."""
    command = [sys.executable, "-m", "dolfbuoy.commands.main", "study", "hull", "free-buoy", "--runs", "none"]
    how = {"capture_output": True, "text": True, "timeout": 300, "check": True}
    done = subprocess.run([*command, "--out", str(tmp_path)], **how)
    assert "…" not in done.stdout
    heads = [line for line in done.stdout.splitlines() if "wavelength [m]" in line]
    assert len(heads) == 1
    assert "pitch/slope" in heads[0]
    assert len(heads[0]) > 80


def test_a_reader_that_has_read_enough():
    """`| head`: the command ends without a word, and without PETSc's."""
    command = [sys.executable, "-m", "dolfbuoy.commands.entry", "check", "short"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert "Tethered buoy" in process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode in (0, 1)  # click ends with 1, Python with 0, and neither with a signal


def test_numbers_in_words():
    """Four digits without the exponent of a large number; rounding is nothing; kilonewtons from 1000 N on."""
    numbers = (-4.68e4, 123456.0, 0.0012346, -7.965e-13, 1e-8, 2.0, 3e20, 1.23456e-5, 1.2e15, 9.99e14)
    words = [
        "-46800",
        "123500",
        "0.001235",
        "0",
        "0.00000001",
        "2",
        "3e+20",
        "0.00001235",
        "1.2e+15",
        "999000000000000",
    ]
    assert [plain(x) for x in numbers] == words
    assert [newtons(x) for x in (-4.68e4, 999.96, -12.5, 1e-12)] == ["-46.8 kN", "1000 N", "-12.5 N", "0 N"]


def test_a_table_stands_at_the_left_without_an_edge(monkeypatch):
    """Title and notes as they are, columns to the right but for those that are named; the unit is that of the size."""
    file = io.StringIO()
    monkeypatch.setattr(sys, "stdout", file)
    rows = [{"a": 1234.5678, "b": "x"}, {"a": 2.0, "b": "long word"}]
    tables.show("A title [m]", rows, {"a": "first [N]", "b": "second"}, ["A note [bold]."])
    words = tables.table("T", ["one", "two"], ["two"])
    words.add_row("a [i]", "b")
    tables.out.print(words)
    assert [line.rstrip() for line in file.getvalue().splitlines()] == [
        "A title [m]",
        "first [kN] ┃    second",
        "━" * 11 + "╇" + "━" * 10,
        "     1.235 │         x",
        "     0.002 │ long word",
        "A note [bold].",
        "T",
        "one   ┃ two",
        "━" * 6 + "╇" + "━" * 4,
        "a [i] │   b",
    ]


def test_a_table_in_markdown():
    """Bars in cells are escaped, lines joined; without a title none."""
    rows = [{"a": 1.5, "b": "x|y\nz"}, {"a": None}]
    text = "| a | b |\n|---|---|\n| 1.5 | x\\|y z |\n| - | - |"
    assert tables.markdown("T", rows, {"a": "a", "b": "b"}, ["one", "two"]) == f"## T\n\n{text}\n\none\n\ntwo\n"
    assert tables.markdown("", rows, {"a": "a", "b": "b"}) == f"{text}\n"
    found = tables.groups([{"k": 1, "m": 2}, {"k": 3, "m": 2}, {"k": 1, "m": 4}], "k")
    assert {key: [row["m"] for row in rows] for key, rows in found.items()} == {1: [2, 4], 3: [2]}
    assert list(tables.groups([{"k": 1, "m": 2}], "k", "m")) == [(1, 2)]
