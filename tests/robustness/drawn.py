"""Small wrong changes, drawn at random over the modules of the program (draw.py)."""

import ast
import contextlib
import copy
import difflib
import random
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SWAPS = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.Add: ast.Sub, ast.Sub: ast.Add,
    ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult, ast.FloorDiv: ast.Div, ast.Mod: ast.FloorDiv,
    ast.And: ast.Or, ast.Or: ast.And, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
TWINS = {"min": "max", "sin": "cos", "any": "all", "floor": "ceil", "argmin": "argmax", "minimum": "maximum"}
#: Functions of which the order of the first two arguments means nothing.
EVEN = {"min", "max", "minimum", "maximum", "hypot", "inner", "isclose", "array_equal"}
TWINS |= {other: one for one, other in TWINS.items()}


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
            idle = isinstance(node, ast.keyword) and node.arg == "strict"  # of `zip`, of what is as long
            within = [] if idle else ast.iter_child_nodes(node)
            todo += [one for one in within if not isinstance(one, ast.stmt | ast.JoinedStr)]


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
                name = getattr(node.func, "attr", getattr(node.func, "id", ""))
                if len(node.args) > 1 and name not in EVEN and ast.dump(node.args[0]) != ast.dump(node.args[1]):
                    made.args = [node.args[1], node.args[0], *node.args[2:]]
                    yield node, made
                if node.keywords and (name, node.keywords[-1].arg) != ("zip", "strict"):
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
        found = difflib.unified_diff(lines, self.source.splitlines(keepends=True), n=1)
        self.diff = "".join(list(found)[2:])  # behind the names of the files; empty if nothing has changed

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
