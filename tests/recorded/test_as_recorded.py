"""What commands print, draw and write is what they did when `lines/` was recorded.

Source: the program itself, whose numbers other tests show to be right: nothing here does, but none changes unseen.
After a change on purpose: `python tests/recorded/record.py NAME`, and read what differs.
"""

import difflib

import dolfinx
import pytest
from fingerprint import NUMBER, difference
from record import CASES, lines_of, path_of

#: Where integers are those of the version that `lines/` were recorded with; in others iterations may differ.
EXACT = dolfinx.__version__.startswith("0.5.")


@pytest.mark.parametrize("name", CASES)
def test_as_recorded(name, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found, recorded = lines_of(name, tmp_path, call), path_of(name).read_text().splitlines()
    assert differences(recorded, found) == []


def differences(recorded, found):
    """The first lines that differ in words, or in numbers by more than rounding."""
    old, new = ([NUMBER.sub("#", line) for line in lines] for lines in (recorded, found))
    told = []
    for kind, i, j, k, m in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes() if old != new else ():
        if kind != "equal":
            told += [f"- {line}" for line in recorded[i:j]] + [f"+ {line}" for line in found[k:m]]
    if not told:
        pairs = zip(recorded, found, strict=True)
        told = [f"{line}: {why}" for line, other in pairs if (why := difference(line, other, EXACT))]
    return told[:12]


@pytest.mark.parametrize(
    ("recorded", "found", "differs"),
    [
        ("a 1.234 kN", "a 1.235 kN", False),
        ("a 1.234 kN", "a 1.236 kN", True),
        ("a 1.2 kN", "a 1.21 kN", False),
        ("a 1.2 kN", "a 1.25 kN", True),
        ("at most 1e+07", "at most 1.5e+07", True),
        ("at most 1e+07", "at most 2e+07", True),
        ("at least 0.1", "at least 0.2", True),
        ("a residual of 3e-16", "a residual of 7e-17", False),
        ("a 7 steps", "a 8 steps", True),
        ("a 7 steps", "b 7 steps", True),
        ("x [3] ~ 1.00000e+00 2.00000e+02 3.0", "x [3] ~ 1.00300e+00 2.00000e+02 3.0", False),
        ("x [3] ~ 1.00000e+00 2.00000e+02 3.0", "x [3] ~ 1.00500e+00 2.00000e+02 3.0", True),
        ("x [3] ~ 1.00000e+00 2.00000e+02 3.0", "x [4] ~ 1.00000e+00 2.00000e+02 3.0", True),
    ],
)
def test_what_is_a_difference(recorded, found, differs):
    assert (differences([recorded], [found]) != []) == differs
