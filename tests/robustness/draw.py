"""Do the recorded cases notice wrong changes that nobody chose?  Draws some over all modules, and tries one at a time.

    OMP_NUM_THREADS=1 .venv/bin/python tests/robustness/draw.py --seed 7 [--count 150] [--jobs 2] [--only PART ...]

A module is drawn in proportion to its lines, of it a statement, and of that one small change: a comparison, an
operator, a number, a condition, an argument, a call that is left out.  The cases of tests/recorded that run the
statement follow, the quickest first, in fresh processes whose import is given the changed source; nothing on the disk
changes.  What no case notices meets the tests that name what it is in, and is printed as a difference if these pass
too, to be read: it may change nothing.  The lines that each case runs are found first, with `coverage`
(pip install coverage), and kept in the folder --kept.
"""

import argparse
import ast
import contextlib
import copy
import difflib
import importlib.machinery
import io
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests"
#: What is imported before a process is forked: nothing that starts MPI.
READY = ("matplotlib.pyplot", "netCDF4", "numpy", "pydantic", "pytest", "rich.console", "scipy.signal", "xarray")
SWAPS = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.Add: ast.Sub, ast.Sub: ast.Add,
    ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult, ast.FloorDiv: ast.Div, ast.Mod: ast.FloorDiv,
    ast.And: ast.Or, ast.Or: ast.And, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
TWINS = {"min": "max", "sin": "cos", "any": "all", "floor": "ceil", "argmin": "argmax", "minimum": "maximum"}
TWINS |= {other: one for one, other in TWINS.items()}
PATIENCE = 60  #: seconds beyond three times those of the unchanged cases until it counts as endless
BATCH = 15  #: seconds of cases that share a process
SAME = "the same"


def modules(only=()) -> dict[str, Path]:
    """Modules of the program by their names, of those parts of it."""
    found = {}
    for package, folder in (("dolfbuoy", "dolfbuoy"), ("dolfbuoy.forms", "forms"), ("dolfbuoy.meshes", "meshes")):
        for path in sorted((ROOT / folder).rglob("*.py")):
            inside = path.relative_to(ROOT / folder).with_suffix("")
            name = ".".join([package, *inside.parts]).removesuffix(".__init__")
            if not only or any(part in str(path.relative_to(ROOT)) for part in only):
                found[name] = path
    return found


# -- changes ----------------------------------------------------------------------------------------------------------


def statements(tree) -> list[ast.stmt]:
    """Statements that can be wrong: no imports, no documentation, none that only types need."""
    found, todo = [], [tree]
    while todo:
        node = todo.pop()
        for child in ast.iter_child_nodes(node):
            idle = isinstance(child, ast.Import | ast.ImportFrom | ast.Pass | ast.Global)
            if idle or (isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test)):
                continue
            todo.append(child)
            text = isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            if isinstance(child, ast.stmt) and not text:
                found.append(child)
    return sorted(found, key=lambda one: (one.lineno, one.col_offset))


def own(statement):
    """Expressions of a statement itself, without those of statements in it, and without types."""
    todo = [child for child in ast.iter_child_nodes(statement) if not isinstance(child, ast.stmt)]
    if isinstance(statement, ast.AnnAssign):
        todo = [statement.value] if statement.value else []
    elif isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
        todo = [*statement.args.defaults, *filter(None, statement.args.kw_defaults)]
    elif isinstance(statement, ast.ClassDef):
        todo = []
    while todo:
        node = todo.pop(0)
        if not isinstance(node, ast.stmt):
            yield node
            todo += [one for one in ast.iter_child_nodes(node) if not isinstance(one, ast.stmt | ast.JoinedStr)]


def number(x, pick):
    """Another number near one."""
    if isinstance(x, bool):
        return not x
    if isinstance(x, int):
        return pick([x + 1, x - 1]) if x else 1
    return pick([x * 1.1, x * 2, x / 2]) if x else 1.0


def variants(statement, pick):
    """(node, what stands in its place) of every small change of a statement; None: nothing."""
    for node in own(statement):
        made = copy.copy(node)
        match node:
            case ast.Compare(ops=[op, *_]) if type(op) in SWAPS:
                made.ops = [SWAPS[type(op)](), *node.ops[1:]]
                yield node, made
            case ast.BinOp(op=op) if type(op) in SWAPS:
                made.op = SWAPS[type(op)]()
                yield node, made
            case ast.BoolOp(op=op):
                made.op = SWAPS[type(op)]()
                yield node, made
                yield node, pick(node.values)
            case ast.UnaryOp(op=ast.USub() | ast.Not()):
                yield node, node.operand
            case ast.Constant(value=bool() | int() | float()):
                yield node, ast.Constant(number(node.value, pick))
            case ast.IfExp():
                yield node, pick([node.body, node.orelse])
            case ast.Call():
                if len(node.args) > 1:
                    made.args = [node.args[1], node.args[0], *node.args[2:]]
                    yield node, made
                if node.keywords:
                    less = copy.copy(node)
                    less.keywords = node.keywords[:-1]
                    yield node, less
            case ast.Name(id=name) if name in TWINS:
                yield node, ast.Name(TWINS[name])
            case ast.Attribute(attr=name) if name in TWINS:
                made.attr = TWINS[name]
                yield node, made
    match statement:
        case ast.If(test=test) | ast.While(test=test):
            yield test, ast.UnaryOp(ast.Not(), test)
        case ast.AugAssign(op=op) if type(op) in SWAPS:
            made = copy.copy(statement)
            made.op = SWAPS[type(op)]()
            yield statement, made
        case ast.Expr(value=ast.Call()):
            yield statement, None
        case ast.Break():
            yield statement, ast.Continue()
        case ast.Continue():
            yield statement, ast.Break()


class Change:
    """One wrong change: `name` of the module, its `path`, `line` of the statement, `source` with it."""

    def __init__(self, name, path, rng):
        self.name, self.path, text = name, path, path.read_text()
        lines = text.splitlines(keepends=True)
        starts = [0]
        for line in lines:
            starts.append(starts[-1] + len(line.encode()))
        while True:
            statement = rng.choice(statements(ast.parse(text)))
            if found := list(variants(statement, rng.choice)):
                break
        node, made = rng.choice(found)
        put = "pass" if made is None else ast.unparse(ast.fix_missing_locations(made))
        if isinstance(made, ast.expr) and not isinstance(made, ast.Constant | ast.Name | ast.Call):
            put = f"({put})"
        raw = text.encode()
        begin, end = (starts[row - 1] + column for row, column in self.span(node))
        self.source = (raw[:begin] + put.encode() + raw[end:]).decode()
        self.lines = range(statement.lineno, statement.end_lineno + 1)
        self.diff = "".join(difflib.unified_diff(lines, self.source.splitlines(keepends=True), n=1)).split("\n", 2)[2]

    @staticmethod
    def span(node):
        return (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)

    @classmethod
    def drawn(cls, seed, count, only):
        """Distinct ones that can be compiled."""
        rng, found, seen = random.Random(seed), [], set()
        paths = modules(only)
        sizes = [len(path.read_text().splitlines()) for path in paths.values()]
        while len(found) < count:
            ((name, path),) = rng.choices(list(paths.items()), sizes)
            if not any(True for one in statements(ast.parse(path.read_text())) for _ in variants(one, rng.choice)):
                continue
            one = cls(name, path, rng)
            with contextlib.suppress(SyntaxError):
                compile(one.source, str(path), "exec")
                if one.diff and (key := (name, one.diff)) not in seen:
                    seen.add(key)
                    found.append(one)
        return found


# -- a process for each case ------------------------------------------------------------------------------------------


class Given(importlib.machinery.SourceFileLoader):
    """Loads a module from a text."""

    def __init__(self, name, path, source):
        super().__init__(name, str(path))
        self.source = source

    def get_code(self, fullname):
        return compile(self.source, self.path, "exec", dont_inherit=True)


class Finder:
    """Finds a module that is given."""

    def __init__(self, change):
        self.change = change

    def find_spec(self, name, path=None, target=None):
        if name == self.change.name:
            loader, package = Given(name, self.change.path, self.change.source), self.change.path.stem == "__init__"
            spec = importlib.machinery.ModuleSpec(name, loader, origin=str(self.change.path), is_package=package)
            spec.has_location = True
            if package:
                spec.submodule_search_locations = [str(self.change.path.parent)]
            return spec
        return None


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
    from record import lines_of, path_of
    from test_as_recorded import differences

    from dolfbuoy.commands import main as cli

    cli.out.width = cli.err.width = 300

    def call(*arguments):
        sys.argv = ["dolfbuoy", *map(str, arguments)]
        out, err, code = io.StringIO(), io.StringIO(), 0
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                cli.main()
            except SystemExit as stop:
                code = stop.code or 0
        return code, out.getvalue(), err.getvalue()

    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        lines = lines_of(name, Path(folder), call)
        os.chdir("/")
    return " / ".join(differences(path_of(name).read_text().splitlines(), lines))


def reached(name):
    """JSON of the lines that a case runs, by file, and of its seconds."""
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
    """What notices a change: a case, how; "" if none does, "-" if none runs it."""
    file = str(change.path.relative_to(ROOT))
    running = [name for name, case in cases.items() if set(case["files"].get(file, ())) & set(change.lines)]
    for names in batches(running, cases):

        def work(names=names):
            sys.meta_path.insert(0, Finder(change))
            return next((f"{name}: {found}" for name in names if (found := run_case(name))), SAME)

        told = in_a_process(work, 3 * sum(cases[name]["seconds"] for name in names) + PATIENCE)
        if told != SAME:
            return told[:160]
    return "" if running else "-"


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
    cases = reached_by_all(options.kept, options.jobs)
    changes = Change.drawn(options.seed, options.count, options.only)
    areas, missed = Counter(), Counter()

    def one(k):
        told, change = noticed(changes[k], cases), changes[k]
        area = change.path.relative_to(ROOT).parts
        area = area[1] if area[0] == "dolfbuoy" and len(area) > 2 else area[0]
        areas[area] += 1
        if told in ("", "-"):
            missed[area] += 1
            how = "MISSED" if told == "" else "NOT RUN"
            print(f"[{k}] {how} {change.path.relative_to(ROOT)}\n{change.diff}", flush=True)
        else:
            print(f"[{k}] {change.path.relative_to(ROOT)}:{change.lines[0]} {told}", flush=True)

    with ThreadPoolExecutor(options.jobs) as pool:
        list(pool.map(one, range(options.first, len(changes))))
    print("area: drawn, not noticed;", "; ".join(f"{area}: {n}, {missed[area]}" for area, n in sorted(areas.items())))
    print(f"{areas.total() - missed.total()} of {areas.total()} are noticed by recorded cases")


if __name__ == "__main__":
    main()
