"""Does the suite notice wrong physics and wrong numbers?  Applies small wrong changes, one at a time, to a copy.

    OMP_NUM_THREADS=1 .venv/bin/python tests/robustness/mutants.py [--only NAME ...] [--all-tests] [--jobs N]

Each change (of `wrong_changes.toml`) meets its likely tests first, and with --all-tests, if it survives them, the whole
essential suite.  What caught a change counts only if it passes on the unchanged copy.  The exit code is 1 if less than
95 % of the changes are caught, 2 if one of them does not apply.
"""

import argparse
import os
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.markup import escape
from rich.table import Table

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("dolfbuoy", "forms", "meshes", "tests", "pyproject.toml", "README.md")
LEAST = 0.95
#: Seconds until a run of the likely tests, or of the suite, is given up: a change may make a loop endless.
PATIENCE, LONG_PATIENCE = 600, 3600

#: Imports the package from the copy, whatever is installed.
SITE = """
import importlib.util, sys

ROOT = {root!r}
PLACES = {{"dolfbuoy": "/dolfbuoy", "dolfbuoy.forms": "/forms", "dolfbuoy.meshes": "/meshes"}}

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name in PLACES:
            place = ROOT + PLACES[name]
            file = place + "/__init__.py"
            return importlib.util.spec_from_file_location(name, file, submodule_search_locations=[place])

sys.meta_path.insert(0, Finder)
"""


class Change(NamedTuple):
    """What is wrong, where, the tests that are likely to notice, and what no test can notice."""

    name: str
    file: str
    old: str
    new: str
    tests: list[str]
    why: str = ""


def all_changes() -> list[Change]:
    """Those of wrong_changes.toml."""
    files = tomllib.loads(Path(__file__).with_name("wrong_changes.toml").read_text())
    return [
        Change(name, file, **{"tests": rows["likely"], **change})
        for file, rows in files.items()
        for name, change in rows.items()
        if name != "likely"
    ]


def fault(change, root=ROOT) -> str | None:
    """What keeps a change from being applied, in a sentence; None if nothing does."""
    path = root / change.file
    if not path.is_file():
        return f"{change.name}: there is no {change.file}."
    count = path.read_text().count(change.old)
    return None if count == 1 else f"{change.name}: its old text occurs {count} times in {change.file}."


class Copy:
    """A scratch copy of the tree, from which the package is imported."""

    def __init__(self, folder):
        self.root, self.site = Path(folder) / "tree", Path(folder) / "site"
        self.root.mkdir(parents=True)
        self.site.mkdir()
        for name in COPIED:
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, self.root / name, ignore=shutil.ignore_patterns("__pycache__", ".*"))
            else:
                shutil.copy(ROOT / name, self.root)
        (self.site / "sitecustomize.py").write_text(SITE.format(root=str(self.root)))

    def failures(self, tests, patience=PATIENCE, first=True) -> list[str]:
        """Names of the tests that fail (the first one only), of all the essential ones if none are named."""
        command = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-rfE", "-p", "no:cacheprovider", *tests]
        # no .pyc: a change within a second that keeps the size of a file would not be seen
        environment = os.environ | {"PYTHONPATH": str(self.site), "PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": "1000"}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        run = subprocess.Popen(
            command + ["-x"] * first, cwd=self.root, env=environment, start_new_session=True, **pipes
        )
        try:
            out, _ = run.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            os.killpg(run.pid, signal.SIGKILL)
            run.communicate()
            return [f"no end after {patience} s"]
        found = [line.split(" - ")[0].split(maxsplit=1)[1] for line in out.splitlines() if _names_a_failure(line)]
        if not found and run.returncode != 0:
            raise RuntimeError(f"pytest {' '.join(tests)}\n{out[-2000:]}")
        return found

    def with_change(self, change, tests, patience) -> list[str]:
        """The first failure under a change."""
        path = self.root / change.file
        right = path.read_text()
        path.write_text(right.replace(change.old, change.new))
        try:
            return self.failures(tests, patience)
        finally:
            path.write_text(right)


def _names_a_failure(line):
    return line.startswith(("FAILED ", "ERROR "))


def caught_by(copy, change, all_tests) -> str | None:
    """Name of the test that fails under a change; None if it survives."""
    found = copy.with_change(change, [f"tests/{name}" for name in change.tests], PATIENCE)
    if not found and all_tests:
        found = copy.with_change(change, [], LONG_PATIENCE)
    return found[0] if found else None


def apply_all(changes, all_tests, jobs, say) -> dict[str, str | None]:
    """Name of each change -> what caught it."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ThreadPoolExecutor(jobs) as pool:
        copies = queue.SimpleQueue()
        for i in range(jobs):
            copies.put(Copy(f"{folder}/{i}"))

        def one(change):
            copy = copies.get()
            try:
                catcher = caught_by(copy, change, all_tests)
            finally:
                copies.put(copy)
            say(f"{change.name}: {'survived' if catcher is None else catcher}")
            return catcher

        found = dict(zip([c.name for c in changes], pool.map(one, changes), strict=True))
        catchers = sorted({catcher for catcher in found.values() if catcher and "::" in catcher})
        unreliable = copies.get().failures(catchers, LONG_PATIENCE, first=False) if catchers else []
    for test in unreliable:
        say(f"{test} fails without any change: it catches nothing.")
    return {name: None if catcher in unreliable else catcher for name, catcher in found.items()}


def table_of(changes, found) -> Table:
    table = Table("change", "file", "caught by, or why it is not", show_edge=False)
    for change in changes:
        said = found[change.name] or f"SURVIVED {change.why}"
        table.add_row(escape(change.name), change.file, escape(said.removeprefix("tests/")))
    return table


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", help="changes whose name or file contains one of these")
    parser.add_argument("--all-tests", action="store_true", help="the whole essential suite for what survives")
    parser.add_argument("--jobs", type=int, default=1, help="so many copies at a time")
    options = parser.parse_args()
    chosen = [
        c for c in all_changes() if not options.only or any(part in f"{c.name} {c.file}" for part in options.only)
    ]
    faults = [text for text in map(fault, chosen) if text]
    if faults or not chosen:
        print("\n".join(faults) or "No change has such a name.", file=sys.stderr)
        sys.exit(2)
    found = apply_all(chosen, options.all_tests, options.jobs, lambda text: print(text, flush=True))
    Console(width=None if sys.stdout.isatty() else 200).print(table_of(chosen, found))
    caught = sum(catcher is not None for catcher in found.values())
    print(f"{caught} of {len(chosen)} wrong changes are caught: {100 * caught / len(chosen):.1f} %")
    sys.exit(0 if caught >= LEAST * len(chosen) else 1)


if __name__ == "__main__":
    main()
