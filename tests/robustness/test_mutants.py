"""Every wrong change in the list can be applied; whether tests detect it is reported by the command that applies it.

Source: the files themselves.
"""

import ast
from collections import Counter
from pathlib import Path

import pytest
from drawn import Change, modules
from mutants import ROOT, Copy, all_changes, fault

CHANGES = all_changes()


def test_there_are_enough_of_them_each_with_a_name():
    assert len(CHANGES) >= 80
    assert [name for name, count in Counter(c.name for c in CHANGES).items() if count > 1] == []


@pytest.mark.parametrize("file", sorted({c.file for c in CHANGES}))
def test_every_change_applies_and_leaves_a_program(file):
    """What is to be changed occurs once; what comes out is another program, of Python if the file is."""
    text = (ROOT / file).read_text()
    for change in (c for c in CHANGES if c.file == file):
        assert fault(change) is None
        right, wrong = text, text.replace(change.old, change.new)
        if file.endswith(".py"):
            right, wrong = ast.dump(ast.parse(right)), ast.dump(ast.parse(wrong))
        assert wrong != right, change.name


def test_the_tests_that_are_likely_to_notice_are_there():
    assert all(c.tests for c in CHANGES)
    for test in sorted({test for c in CHANGES for test in c.tests}):
        file, *name = test.split("::")
        assert (ROOT / "tests" / file).is_file(), test
        assert not name or f"def {name[0]}(" in (ROOT / "tests" / file).read_text(), test


def test_a_change_that_does_not_apply_is_named():
    change = CHANGES[0]._replace(name="nothing", old="no such words")
    assert fault(change) == f"nothing: its old text occurs 0 times in {change.file}."
    assert fault(change._replace(file="forms/none.py")) == "nothing: there is no forms/none.py."


def test_the_copy_is_what_is_tested(tmp_path):
    """A change is noticed, and gone afterwards; a test that asks for the place of the package finds the copy."""
    copy, test = Copy(tmp_path), "tests/test_place.py"
    (copy.root / test).write_text(
        "import dolfbuoy.forms.wind as w\ndef test():\n"
        f"    assert w.__file__.startswith({str(copy.root)!r}) and w.SMOOTHING_HEIGHT == 1e-3\n"
    )
    change = CHANGES[0]._replace(file="forms/wind.py", old="SMOOTHING_HEIGHT = 1e-3", new="SMOOTHING_HEIGHT = 2e-3")
    before = Path(ROOT / "forms/wind.py").read_text()
    assert copy.failures([test]) == []
    assert copy.with_change(change, [test], 60) == [f"{test}::test"]
    assert (copy.root / "forms/wind.py").read_text() == before == (ROOT / "forms/wind.py").read_text()


def test_changes_that_are_drawn():
    """The same ones by the same number; each is a program, and another one; what is only said of a module stays."""
    drawn = [Change.drawn(seed, 12, ("dolfbuoy/model/growth", "forms/")) for seed in (3, 3, 4)]
    sources = [[one.source for one in some] for some in drawn]
    assert sources[0] == sources[1] != sources[2]
    for one in drawn[0]:
        right, wrong = (ast.parse(text) for text in (one.path.read_text(), one.source))
        assert ast.dump(right) != ast.dump(wrong)
        assert ast.get_docstring(right) == ast.get_docstring(wrong)
        assert modules()[one.name] == one.path
