"""The catalogue as a study: run it, keep it, show it."""

import hashlib
from pathlib import Path

from mpi4py import MPI

from ...errors import InputError
from ..common import evaluate_all, save, show
from .case import CATALOGUE

COLUMNS = {"name": "case", "asked": "asked", "must_show": "must show", "happened": "happened", "verdict": ""}


def cases(only: str | None = None, slow: bool = False) -> list[dict]:
    """Cases as plain dicts; only: a name or the beginning of names (slow ones included); slow: the expensive ones too.

    A case that is kept on disk counts for the same program only: `program` is a digest of its source.
    """
    chosen = [c for c in CATALOGUE.values() if (c.name.startswith(only) if only else slow or not c.slow)]
    if not chosen:
        raise InputError(f"--only {only}: no case is called so; there are {', '.join(CATALOGUE)}.")
    program = _digest()
    return [{"study": "hard-cases", "name": c.name, "program": program} for c in chosen]


def _digest():
    root = Path(__file__).parents[2]
    from ... import forms, meshes

    folders = [root, *(Path(m.__file__).parent for m in (forms, meshes))]
    files = sorted({f for folder in folders for f in folder.rglob("*.py")})
    return hashlib.sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


def evaluate(case: dict) -> dict:
    """Outcome of one case."""
    return CATALOGUE[case["name"]].evaluate()


def markdown(rows: list[dict]) -> str:
    """The catalogue as a table."""
    lines = ["| case | asked | must show | happened | |", "|---|---|---|---|---|"]
    for row in rows:
        cells = [row["name"], row["asked"], row["must_show"], row["happened"], row["verdict"]]
        lines.append("| " + " | ".join(str(c).replace("|", "\\|").replace("\n", " ") for c in cells) + " |")
    return "\n".join(lines) + "\n"


def run(folder, only: str | None = None, slow: bool = False) -> bool:
    """Evaluate, save and show; whether all passed (the same on every rank)."""
    rows = evaluate_all(evaluate, cases(only, slow), folder)
    passed = None
    if rows is not None:
        rows = [_row(row) for row in rows]
        passed = all(row["passed"] for row in rows)
        count = sum(row["passed"] for row in rows)
        notes = [f"{count} of {len(rows)} cases pass."]
        save(folder, "hard-cases", rows, notes=notes)
        (Path(folder) / "hard-cases.md").write_text(markdown(rows))
        show(f"Hard cases; {folder}", rows, COLUMNS, notes)
    return MPI.COMM_WORLD.bcast(passed)


def _row(row):
    case = CATALOGUE[row["name"]]
    result = {"name": case.name, "group": case.group, "asked": case.asked, "must_show": case.must_show}
    return (
        result
        | {k: row[k] for k in ("happened", "passed", "failed")}
        | {"verdict": "pass" if row["passed"] else "FAIL"}
    )
