"""The catalogue as a study: run it, keep it, show it."""

from pathlib import Path

from ...errors import InputError
from ...parallel.cases import evaluate_all
from ...results.folder import enlist
from ...results.tables import markdown
from ...writing import write_text
from ..declaration import declared
from ..study import Table
from .case import CATALOGUE

WORDS = declared(__file__)
#: Columns of the catalogue as a file.
CATALOGUED = {"name": "case", "asked": "asked", "must_show": "must show", "happened": "happened", "verdict": ""}


def cases(only: str | None = None, slow: bool = False) -> list[dict]:
    """Plain dicts; only: a name or the beginning of names (slow ones included); slow: the expensive ones too."""
    chosen = [c for c in CATALOGUE.values() if (c.name.startswith(only) if only else slow or not c.slow)]
    if not chosen:
        raise InputError(WORDS.say("unknown", only=only, names=", ".join(CATALOGUE)))
    return [{"study": "hard-cases", "name": c.name} for c in chosen]


def evaluate(case: dict) -> dict:
    """Outcome of one case."""
    return CATALOGUE[case["name"]].evaluate()


def compute(folder, only: str | None = None, slow: bool = False) -> list[dict] | None:
    """What happened in every case, kept as the catalogue's table too; None on all ranks but 0."""
    rows = evaluate_all(evaluate, cases(only, slow), folder)
    if rows is not None:
        rows = [_row(row) for row in rows]
        enlist(folder, [Path(folder) / "hard-cases.md"], "study")
        write_text(Path(folder) / "hard-cases.md", markdown("", rows, CATALOGUED))
    return rows


def _row(row):
    case = CATALOGUE[row["name"]]
    words = {"name": case.name, "group": case.group, "asked": case.asked, "must_show": case.must_show}
    measured = {key: row[key] for key in ("happened", "passed", "failed")}
    return words | measured | {"verdict": "pass" if row["passed"] else "FAIL"}


def tables(rows: list[dict], **_) -> list[Table]:
    """The catalogue with its verdicts; it is to pass as a whole."""
    passed = [row["passed"] for row in rows]
    notes = [WORDS.say("count", passed=sum(passed), all=len(rows))]
    return [Table("hard-cases", rows, WORDS.say("title"), WORDS.columns, notes, passed=all(passed))]
