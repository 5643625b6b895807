"""The table of tests/README.md is up to date with the test files.

Source: the docstrings of the files.
"""

import pytest
from readme import FOLDERS, README, TESTS, claim_and_source, known_seconds, seconds_of, table, with_table


def test_the_table_is_up_to_date():
    """All but the seconds; `tests/readme.py` makes it anew."""
    text = README.read_text()
    assert with_table(text, known_seconds(text)) == text


def test_every_test_is_in_a_folder_of_the_table():
    """And no two files have the same name, which pytest could not tell apart."""
    files = list(TESTS.rglob("test_*.py"))
    assert {file.parent.name for file in files} == set(FOLDERS)
    assert len({file.name for file in files}) == len(files)


def test_a_file_without_a_source_is_refused(tmp_path):
    (tmp_path / "test_it.py").write_text('"""A claim."""\n')
    with pytest.raises(ValueError, match=r"test_it\.py: .*no line 'Source"):
        claim_and_source(tmp_path / "test_it.py")


def test_seconds_come_from_a_run(tmp_path):
    """Those of all cases of a file; what was not run keeps its own."""
    cases = (
        '<testcase classname="tests.forms.test_sea" time="1.4"/><testcase classname="tests.forms.test_sea" time="2"/>'
    )
    (tmp_path / "run.xml").write_text(f"<testsuites><testsuite>{cases}</testsuite></testsuites>")
    assert seconds_of(tmp_path / "run.xml") == {"test_sea": pytest.approx(3.4)}
    assert known_seconds(table({"test_sea": "3", "test_hull": "17"})) == {
        name: {"test_sea": "3", "test_hull": "17"}.get(name, "") for name in known_seconds(table({}))
    }
