"""Table of hard cases: tests of this program's checkout, each run by pytest.

A case is a test function of tests/robustness/test_hard_*.py; its docstring states the question and the behaviour of a
reliable program, and its measurements are the properties "happened" of its report.
"""

import hashlib
import inspect
import os
from contextlib import redirect_stdout
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ..errors import InputError
from ..parallel.cases import evaluate_all
from ..results.folder import enlist
from ..results.tables import markdown
from ..writing import write_text
from .study import Row, Table

TESTS = Path(__file__).parents[2] / "tests" / "robustness"
COLUMNS = {"name": "case", "asked": "asked", "must_show": "must show", "happened": "happened", "verdict": ""}
#: Without the plugin that collects garbage several times at the end of each run.
QUIET = ("-q", "-p", "no:cacheprovider", "-p", "no:unraisableexception", "-m", "slow or not slow")


def _pytest(*arguments: object) -> tuple[list[Any], list[Any]]:
    """(tests, reports of their phases) of a silent pytest run in this process.  Raises InputError without pytest."""
    try:
        import pytest
    except ImportError:
        raise InputError("study hard-cases: the hard cases are run by pytest, which is not installed.") from None
    found: list[Any] = []
    reports: list[Any] = []
    plugin = SimpleNamespace(
        pytest_collection_modifyitems=lambda items: found.extend(items),
        pytest_runtest_logreport=lambda report: reports.append(report),
    )
    with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
        if pytest.main([*QUIET, *map(str, arguments)], plugins=[plugin]) == pytest.ExitCode.INTERRUPTED:
            raise KeyboardInterrupt
    return found, reports


def cases(only: str | None = None, slow: bool = False) -> list[Row]:
    """Every case; only: prefix of names, includes expensive cases; slow: include the expensive cases."""
    files = sorted(TESTS.glob("test_hard_*.py"))
    if not files:
        raise InputError(
            "study hard-cases: the hard cases are tests/robustness/test_hard_*.py of a checkout of dolfbuoy, and this "
            "installation is none."
        )
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    items, _ = _pytest("--collect-only", *files)
    known = {item.name.removeprefix("test_").replace("_", "-"): item for item in items}
    dear = {name for name, item in known.items() if any(mark.args for mark in item.iter_markers("slow"))}
    chosen = [name for name in known if (name.startswith(only) if only else slow or name not in dear)]
    if not chosen:
        raise InputError(f"--only {only}: no case is called so; there are {', '.join(known)}.")
    found: list[Row] = []
    for name, item in ((name, known[name]) for name in chosen):
        asked, _, must_show = " ".join((inspect.getdoc(item.function) or "").split()).partition(" Must show: ")
        case = {"study": "hard-cases", "name": name, "test": item.nodeid, "tests": digest}
        words = {"group": item.path.stem.removeprefix("test_hard_"), "asked": asked.rstrip(".")}
        found.append(case | words | {"must_show": must_show.rstrip(".")})
    return found


def evaluate(case: Row) -> Row:
    """Outcome of one case: its measurements, whether it passed, and if not the reason."""
    _, reports = _pytest(TESTS.parents[1] / case["test"])
    crashes = [getattr(report.longrepr, "reprcrash", None) for report in reports if report.failed]
    failed = [crash.message if crash else "it was not set up" for crash in crashes]
    happened = [text for report in reports[-1:] for name, text in report.user_properties if name == "happened"]
    passed = bool(happened) and not failed
    return {
        "happened": "; ".join(happened),
        "passed": passed,
        "failed": failed,
        "verdict": "pass" if passed else "FAIL",
    }


def study(folder: Path, only: str | None = None, slow: bool = False) -> list[Table]:
    """The catalogue with its verdicts, also as hard-cases.md; all cases must pass."""
    rows = evaluate_all(evaluate, cases(only, slow), folder)
    if rows is None:
        return []
    rows = [{key: value for key, value in row.items() if key not in ("study", "test", "tests")} for row in rows]
    enlist(folder, [Path(folder) / "hard-cases.md"], "study")
    write_text(Path(folder) / "hard-cases.md", markdown("", rows, COLUMNS))
    passed = [row["passed"] for row in rows]
    notes = [f"{sum(passed)} of {len(rows)} cases pass."]
    return [Table("hard-cases", rows, "Hard cases; {folder}", COLUMNS, notes, passed=all(passed))]
