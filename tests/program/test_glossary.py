"""The glossary of dolfbuoy/README.md: each term appears once, and everything it names exists in the program.

Source: the keys of the scene language, the registry of quantities and the files of the repository.
"""

import re
from pathlib import Path

import pytest

import dolfbuoy
from dolfbuoy.results.quantities import QUANTITIES
from dolfbuoy.scene.keys import list_keys

TEXT = (Path(__file__).parents[2] / "dolfbuoy" / "README.md").read_text(encoding="utf-8")
ROWS = [line.strip("| ").split(" | ") for line in TEXT.splitlines() if re.match(r"\| (?!term)", line)]
FORMS = Path(dolfbuoy.__file__).parent


def stands(place):
    """True if a place of the glossary is a file, a key of a scene or a quantity of a record."""
    if place.endswith(".py"):
        return (FORMS / place).is_file()
    return place in ({key.name for key in list_keys()} if "." in place else QUANTITIES)


def test_every_term_stands_once():
    terms = [row[0] for row in ROWS]
    assert len(terms) == len(set(terms)) >= 80


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_term_names_a_place_in_the_program(row):
    line = next(line for line in TEXT.splitlines() if line.startswith(f"| {row[0]} |"))
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert len(cells) == 5
    assert re.fullmatch(r"[A-Z0-9].*\.", cells[3])
    assert stands(cells[4].strip("`")), cells[4]


def test_a_wrong_place_is_seen():
    assert not any(map(stands, ("cable.lenght", "statics/nothing.py", "tension_middle")))
