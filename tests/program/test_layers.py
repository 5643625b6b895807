"""Layers of the package: permitted imports, checked in the source.

Source: the source, parsed as a syntax tree; the order of layers is written by hand.
"""

import ast
import functools
import graphlib
from pathlib import Path

import pytest

import dolfbuoy
import dolfbuoy.forms
import dolfbuoy.meshes

#: From top to bottom.  A folder or module imports what stands in lines below its own, and what is in itself.
LAYERS = (
    ("commands",),
    ("studies",),
    ("page",),
    ("sensitivity",),
    ("api", "linear_api", "check", "coupling"),
    ("accuracy",),
    ("results", "motion", "linear", "formats"),
    ("statics",),
    ("model",),
    ("solver", "scene"),
    ("parallel",),
    ("elsewhere", "writing", "core"),
    ("forms", "meshes", "scenes", "errors", "roots", "version"),
)
#: Within a line: what a scheme leaves of a motion stands in the summary of a run; linear motions begin where runs do.
BESIDE = {("results", "motion"), ("linear", "motion")}
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}
ROOT = "dolfbuoy"  # the package itself: its version, and the interface at first use
PLACES = {ROOT: dolfbuoy, f"{ROOT}.forms": dolfbuoy.forms, f"{ROOT}.meshes": dolfbuoy.meshes}


def modules():
    """Dotted name -> file of everything that is installed."""
    found = {}
    for package, module in PLACES.items():
        folder = Path(module.__file__).parent
        for file in sorted(folder.rglob("*.py")):
            parts = file.relative_to(folder).with_suffix("").parts
            found[".".join([package, *(parts[:-1] if parts[-1] == "__init__" else parts)])] = file
    return found


FILES = modules()


def tree_of(name):
    """Syntax tree of a module.

    None is kept: they were three quarters of all objects of a run of tests, and whoever looks for garbage, as every
    sixteenth problem that ends does, looks at all of them.
    """
    return ast.parse(FILES[name].read_text())


def statements(tree):
    """All nodes of a tree but those that only a type checker reads."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)):
            yield node
            yield from statements(node)


def targets(name, node):
    """Absolute names that a node of the module `name` imports."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = [node.module] if node.module else []
    if node.level:
        package = name.split(".") if FILES[name].name == "__init__.py" else name.split(".")[:-1]
        base = [*package[: len(package) - node.level + 1], *base]
    base = ".".join(base)
    return [f"{base}.{alias.name}" if f"{base}.{alias.name}" in FILES else base for alias in node.names]


@functools.cache
def imports():
    """(importing module, imported one of this package or foreign name) of every import, wherever it stands."""
    return [(name, to) for name in FILES for node in statements(tree_of(name)) for to in targets(name, node)]


@functools.cache
def within():
    """Those of this package."""
    return sorted({(name, to) for name, to in imports() if to.split(".")[0] == ROOT})


def folder(name):
    """The folder or module of a dotted name that LAYERS speaks of; the package itself counts as the interface."""
    return name.split(".")[1] if "." in name else "api"


def wrong_way(edges):
    """Imports that run up or beside."""
    pairs = [(name, to, folder(name), folder(to)) for name, to in edges]
    return [
        f"{name} -> {to}"
        for name, to, a, b in pairs
        if a != b and LEVEL[b] <= LEVEL[a] and (a, b) not in BESIDE and name != ROOT
    ]


def circle(edges):
    """Names along a circle of imports, or nothing."""
    graph = {name: {to for other, to in edges if other == name} for name, _ in edges}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def test_all_that_is_imported_is_there():
    assert len(within()) > 150
    assert {to for _, to in within()} <= set(FILES)
    assert {folder(name) for name in FILES} <= set(LEVEL)


def test_no_import_runs_back_up():
    assert wrong_way(within()) == []


def test_nobody_starts_petsc_before_the_solver_does():
    """`dolfbuoy.solver` tells PETSc to leave signals alone: folders that import dolfinx or PETSc import it first."""
    starters = {name for name, to in imports() if to.split(".")[0] in ("dolfinx", "petsc4py", "slepc4py")}
    folders = {name.rpartition(".")[0] for name in starters if not name.startswith(f"{ROOT}.solver")}
    assert folders >= {f"{ROOT}.model", f"{ROOT}.motion"}
    inside = {f"{ROOT}.results"}  # in a function, long after
    assert {f for f in folders - inside if (f, f"{ROOT}.solver") not in within()} == set()


def test_no_import_runs_in_a_circle():
    assert circle(within()) == []


@pytest.mark.parametrize(
    ("name", "to"),
    [
        ("model.buoy", "api"),
        ("forms.sea", "errors"),
        ("motion.start", "results.observe"),
        ("scene.reading", "solver.jit"),
    ],
)
def test_an_import_the_wrong_way_is_found(name, to):
    edge = (f"{ROOT}.{name}", f"{ROOT}.{to}")
    assert wrong_way([*within(), edge]) == [" -> ".join(edge)]


def test_a_circle_is_found():
    edge = (f"{ROOT}.scene.petsc_options", f"{ROOT}.scene.sections")
    assert set(edge) <= set(circle([*within(), edge]))


def test_forms_import_ufl_only():
    """And of the standard library what their type hints need."""
    foreign = {to.split(".")[0] for name, to in imports() if name.startswith(f"{ROOT}.forms")}
    assert foreign == {"ufl", "typing", "collections", ROOT}
    assert all(to.startswith(f"{ROOT}.forms") for name, to in within() if name.startswith(f"{ROOT}.forms"))


def functions(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def test_functions_of_the_forms_say_what_they_take_and_give():
    found = [
        (name, function) for name in FILES if name.startswith(f"{ROOT}.forms") for function in functions(tree_of(name))
    ]
    assert len(found) > 40
    for name, function in found:
        arguments = [a for a in function.args.args if a.arg != "self"]
        assert function.returns is not None, f"{name}.{function.name}"
        assert all(a.annotation is not None for a in arguments), f"{name}.{function.name}"


def test_at_most_eight_modules_lie_directly_in_the_package():
    assert len(list(Path(dolfbuoy.__file__).parent.glob("*.py"))) <= 8


def test_nothing_is_asserted_at_run_time():
    """Python -O leaves assertions out, and their words are no sentences."""
    found = [
        f"{name}:{node.lineno}" for name in FILES for node in ast.walk(tree_of(name)) if isinstance(node, ast.Assert)
    ]
    assert found == []
