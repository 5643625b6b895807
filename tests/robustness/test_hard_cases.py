"""The catalogue of hard cases, one test each, and the machinery that runs it.

Source: bounds of each case's own closed form, quadrature, growth rate or program.
"""

import json

import pytest

from dolfbuoy.errors import InputError
from dolfbuoy.studies.hard_cases import CATALOGUE, case, runner
from dolfbuoy.studies.study import run

#: Seconds rather than tenths of a second: they belong to the study and to the slow tests.
LONG = {
    "arch-run", "breaking-wave", "capsized", "capsized-moored", "cut-steps", "disk-full", "driven-inextensible-limit",
    "dropped", "falling-chain", "far-start", "gm-negative", "horizontal", "hundred-turns", "kill-9", "large-steps",
    "resume", "shaken-2hz", "spinning", "straight-run", "straight-tension-only", "whip",
}  # fmt: skip


def _parameter(one):
    slow = one.slow or one.name in LONG
    return pytest.param(one, id=one.name, marks=pytest.mark.slow if slow else ())


@pytest.mark.parametrize("one", [_parameter(one) for one in CATALOGUE.values()])
def test_hard_case(one):
    result = one.evaluate()
    assert result["passed"], "; ".join(result["failed"])
    assert result["happened"]


def test_every_name_is_known():
    assert CATALOGUE.keys() >= LONG


@pytest.fixture
def two_cases(monkeypatch):
    """A catalogue of one case that passes and one that breaks."""

    def good(found):
        found.close("one", 1.0, 1.0, 1e-9)

    def bad(found):
        found.below("two", 2.0, 1.0)
        raise ArithmeticError("no such number")

    cases = [case.HardCase(name, "test", "asked | this", "shown", check) for name, check in (("a", good), ("b", bad))]
    monkeypatch.setattr(case, "CATALOGUE", {c.name: c for c in cases})
    monkeypatch.setattr(runner, "CATALOGUE", case.CATALOGUE)


@pytest.mark.usefixtures("two_cases")
def test_the_study_tells_what_failed(tmp_path, capsys):
    """Table, JSON and markdown; a broken check is a failed case, with all it said."""
    assert run(runner, tmp_path, only="a").passed
    assert not run(runner, tmp_path).passed
    assert "1 of 2 cases pass" in capsys.readouterr().out
    rows = json.loads((tmp_path / "hard-cases.json").read_text())["rows"]
    assert [row["passed"] for row in rows] == [True, False]
    assert len(rows[1]["failed"]) == 2
    assert "ArithmeticError: no such number" in rows[1]["happened"]
    lines = (tmp_path / "hard-cases.md").read_text().splitlines()
    assert len(lines) == 4
    assert "asked \\| this" in lines[2]
    assert "1 of 2 cases pass" in (tmp_path / "tables.md").read_text()
    with pytest.raises(InputError, match="no case is called so; there are a, b"):
        run(runner, tmp_path, only="c")


def test_findings_do_not_pass_what_is_not_a_number():
    found = case.Findings()
    found.below("size", float("nan"), 1.0)
    found.close("value", float("nan"), 1.0, 1.0)
    found.close("value", float("inf"), 1.0, 1.0)
    found.says([], "words")
    assert len(found.failed) == 4
    nothing = case.HardCase("n", "g", "a", "m", lambda found: None).evaluate()
    assert not nothing["passed"]
