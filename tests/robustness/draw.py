"""Do the recorded cases notice wrong changes that nobody chose?  Draws some over all modules, and tries one at a time.

    OMP_NUM_THREADS=1 .venv/bin/python tests/robustness/draw.py --seed 7 [--count 150] [--jobs 2] [--only PART ...]

A module is drawn in proportion to its lines, of it a statement, and of that one small change: a comparison, an
operator, a number, a condition, an argument, a call that is left out.  What never changes anything is not drawn: the
order of what `max` compares or of equal arguments, `strict` of `zip`.  The cases of tests/recorded that run the
statement follow, the quickest first, in fresh processes whose import is given the changed source; nothing on the disk
changes.  What no case notices meets the tests that name what it is in, and is printed as a difference if these pass
too, to be read: it may change nothing.  The lines that each case runs are found first, with `coverage`
(pip install coverage), and kept in the folder --kept.  Five minutes for these, then four changes a minute on two cores.
"""

import argparse
import ast
import contextlib
import hashlib
import importlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from changed import install
from drawn import ROOT, Change, modules

TESTS = ROOT / "tests"
#: What is imported before a process is forked: nothing that starts MPI.
READY = ("matplotlib.pyplot", "netCDF4", "numpy", "pydantic", "pytest", "rich.console", "scipy.signal", "xarray")
LIKELY, LONG_PATIENCE = 8, 480  #: test files for a change, and seconds for them
PATIENCE = 60  #: seconds beyond three times those of the unchanged cases until it counts as endless
BATCH = 15  #: seconds of cases that share a process
SAME = "the same"


# -- a process for each case ------------------------------------------------------------------------------------------


def in_a_process(work, seconds):
    """What `work` returns, a text, in a process of its own; "endless" after so many seconds, "ended" if it dies."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.setsid()
        os.close(reading)
        null = os.open(os.devnull, os.O_RDWR)
        for k in range(3):
            os.dup2(null, k)
        told = "ended"
        try:
            told = work()
        except BaseException as error:
            told = f"{type(error).__name__}: {error}"[:200]
        finally:
            os.write(writing, told.encode()[:60000])
            os._exit(0)
    os.close(writing)
    end, told = time.monotonic() + seconds, None
    while time.monotonic() < end and told is None:
        if os.waitpid(pid, os.WNOHANG)[0]:
            told = "ended"
        else:
            time.sleep(0.05)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)
    if told is None:
        os.waitpid(pid, 0)
    with os.fdopen(reading) as pipe:
        os.set_blocking(pipe.fileno(), False)
        said = pipe.read() or ""
    return said or told or "endless"


def run_case(name):
    """The first lines of a recorded case that differ, joined; "" if none does."""
    from record import command_line, lines_of, path_of
    from test_as_recorded import differences

    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        lines = lines_of(name, Path(folder), command_line())
        os.chdir("/")
    return " / ".join(differences(path_of(name).read_text().splitlines(), lines))


def reached(name):
    """Lines that a case runs, by file, its seconds, and how it differs without any change."""
    import coverage

    found = coverage.Coverage(data_file=None, source=[str(ROOT / name) for name in ("dolfbuoy", "forms", "meshes")])
    begin = time.monotonic()
    found.start()
    differs = run_case(name)
    found.stop()
    data = found.get_data()
    files = {str(Path(file).relative_to(ROOT)): sorted(data.lines(file)) for file in data.measured_files()}
    return {"seconds": time.monotonic() - begin, "differs": differs, "files": files}


def reached_by_all(kept, jobs):
    """Name of each case -> `reached`, from the folder if it is there."""
    from record import CASES

    kept.mkdir(parents=True, exist_ok=True)

    def one(name):
        path = kept / f"{name}.json"
        if not path.is_file():
            problem = in_a_process(lambda: path.write_text(json.dumps(reached(name))) and "done", 900)
            if problem != "done":
                print(f"{name}: {problem}", file=sys.stderr)
                return None
        return json.loads(path.read_text())

    with ThreadPoolExecutor(jobs) as pool:
        found = dict(zip(CASES, pool.map(one, CASES), strict=True))
    for name, case in found.items():
        if case and case["differs"]:
            print(f"{name} differs without any change, and notices nothing: {case['differs'][:300]}", file=sys.stderr)
    return {name: case for name, case in found.items() if case and not case["differs"]}


def batches(names, cases):
    """Names in groups that take BATCH seconds, the quickest first."""
    found, room = [], 0.0
    for name in sorted(names, key=lambda name: cases[name]["seconds"]):
        room -= cases[name]["seconds"]
        if room < 0:
            found.append([])
            room = BATCH
        found[-1].append(name)
    return found


def noticed(change, cases):
    """What notices a change: a case, how; "" if none does."""
    file = str(change.path.relative_to(ROOT))
    running = [name for name, case in cases.items() if set(case["files"].get(file, ())) & set(change.lines)]
    for names in batches(running, cases):

        def work(names=names):
            install(change.name, str(change.path), change.source)
            return next((f"{name}: {found}" for name in names if (found := run_case(name))), SAME)

        told = in_a_process(work, 3 * sum(cases[name]["seconds"] for name in names) + PATIENCE)
        if told != SAME:
            return told[:160]
    return ""


# -- tests that name what is changed ----------------------------------------------------------------------------------

SITE = """
import json, pathlib, sys
sys.path.append({here!r})
import changed
changed.install(*json.loads(pathlib.Path({given!r}).read_text()))
"""


def likely(change) -> list[Path]:
    """Test files that name the module, or a function or class that the changed line is in, at most LIKELY of them."""
    package, _, stem = change.name.rpartition(".")
    names = [
        node.name
        for node in ast.walk(ast.parse(change.path.read_text()))
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.lineno <= change.lines[0] <= node.end_lineno
    ]
    found = {}
    for path in sorted(TESTS.rglob("test_*.py")):
        text = path.read_text()
        found[path] = sum(8 for name in names if len(name) > 4 and re.search(rf"\b{name}\b", text))
        found[path] += 6 * bool(re.search(rf"{re.escape(change.name)}\b", text)) + 3 * (stem in path.stem)
        found[path] += 6 * bool(re.search(rf"from {re.escape(package)} import[^\n]*\b{stem}\b", text))
        found[path] += min(text.count(stem), 50) / 100 if found[path] else 0  # of many with a common word
    return sorted((path for path, points in found.items() if points), key=lambda path: -found[path])[:LIKELY]


def failing(change, tests) -> str:
    """The first of these test files' tests that fails under a change; "" if none does."""
    if not tests:
        return ""
    with tempfile.TemporaryDirectory() as folder:
        site, given = Path(folder) / "sitecustomize.py", Path(folder) / "given.json"
        site.write_text(SITE.format(here=str(Path(__file__).parent), given=str(given)))
        given.write_text(json.dumps([change.name, str(change.path), change.source]))
        environment = os.environ | {"PYTHONPATH": folder, "PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": "300"}
        command = [sys.executable, "-m", "pytest", "-qx", "--tb=no", "-rfE", "-p", "no:cacheprovider", *map(str, tests)]
        try:
            run = subprocess.run(
                command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=LONG_PATIENCE
            )
        except subprocess.TimeoutExpired:
            return "endless"
    lines = [line for line in run.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return lines[0] if lines else "" if run.returncode in (0, 5) else f"pytest ends with {run.returncode}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="number of the first change that is tried")
    parser.add_argument("--only", nargs="+", default=(), metavar="PART", help="modules with one of these in their path")
    parser.add_argument("--kept", type=Path, default=Path(tempfile.gettempdir()) / "dolfbuoy-reached")
    options = parser.parse_args()
    sys.path[:0] = [str(TESTS), str(TESTS / "support"), str(TESTS / "recorded")]
    for name in READY:
        importlib.import_module(name)
    sources = "".join(path.read_text() for path in modules().values())
    cases = reached_by_all(options.kept / hashlib.sha256(sources.encode()).hexdigest()[:12], options.jobs)
    changes = Change.drawn(options.seed, options.count, options.only)
    areas, missed = Counter(), Counter()

    def one(k):
        change = changes[k]
        told = noticed(change, cases) or failing(change, likely(change))
        area = change.path.relative_to(ROOT).parts
        area = area[1] if area[0] == "dolfbuoy" and len(area) > 2 else area[0]
        areas[area] += 1
        missed[area] += not told
        print(f"[{k}] {change.path.relative_to(ROOT)}:{change.lines[0]} {told or 'MISSED'}", flush=True)
        if not told:
            print(change.diff, flush=True)

    with ThreadPoolExecutor(options.jobs) as pool:
        list(pool.map(one, range(options.first, len(changes))))
    print("area: drawn, missed;", "; ".join(f"{area}: {n}, {missed[area]}" for area, n in sorted(areas.items())))
    print(f"{areas.total() - missed.total()} of {areas.total()} are noticed")


if __name__ == "__main__":
    main()
