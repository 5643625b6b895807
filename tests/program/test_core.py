"""The C core: compiled without warnings, clean in C analysers, built once and completely, with petsc4py's own PETSc.

Source: gcc, cppcheck, AddressSanitizer and UndefinedBehaviorSanitizer; sums by hand.
"""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from petsc4py import PETSc

import dolfbuoy
from dolfbuoy.core import build
from dolfbuoy.errors import InputError
from dolfbuoy.solver import c_code, compat, numbering

ROOT = Path(__file__).parents[2]
LOCK = "dolfbuoy.lock"
#: In seconds under the sanitizers: every file of the core, and kernels in vectors.
SANITIZED = "program/test_vector_ops.py", "program/test_simd.py", "program/test_hooks.py", "forms/test_kinematics.py"
SANITIZED += ("program/test_callbacks.py::test_what_a_hook_raises_ends_the_solve",)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache of its own."""
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path / "cache")
    return tmp_path / "cache"


def test_built_once_and_whole(cache, monkeypatch):
    """Strictly, apart and then moved into place; nothing else stays."""
    make, asked = build.core, []
    monkeypatch.setattr(build, "core", lambda *args: (asked.append(args), make(*args)))
    monkeypatch.setattr(build, "_LENIENT", ())  # no second attempt, with warnings
    first, again = (c_code.core.__wrapped__() for _ in range(2))
    make(*asked[0])  # as another process that could not wait: file systems without locks
    assert len(asked) == 1
    assert {str(file) for file in cache.iterdir()} == {first.__spec__.origin, str(cache / LOCK)}
    values, x, scale, places = np.zeros(3), np.array([2.0, 3.0]), np.array([1.0, 10.0]), np.array([2, 0], np.int32)
    arrays = {"values": values, "scale": scale, "places": places}
    for library in (first, again):
        values[:] = 0
        given = {name: c_code.address(array) for name, array in arrays.items()}
        library.lib.put(library.ffi.new("scaled *", {**given, "n": 2}), c_code.address(x))
        np.testing.assert_array_equal(values, [30, 0, 2])


def test_without_a_compiler(cache, monkeypatch):
    """One sentence, and nothing half done in the cache."""
    monkeypatch.setenv("CC", "/nonexistent/compiler")
    with pytest.raises(InputError, match="needs a C compiler"):
        c_code.core.__wrapped__()
    assert [file.name for file in cache.iterdir()] == [LOCK]


def test_a_compiler_that_fails(cache, tmp_path, monkeypatch):
    """What it says first of an error is passed on."""
    (tmp_path / "broken.c").write_text("int broken(void) { return missing; }")
    with pytest.raises(InputError, match=r"error: .missing. undeclared"):
        build.shared_library(tmp_path / "broken.so", [build.Unit(tmp_path / "broken.c")])
    assert not (tmp_path / "broken.so").exists()


def test_petsc_is_that_of_petsc4py():
    """A number that is set through C is read through petsc4py, and both have the same PetscInt."""
    core = c_code.core()
    assert core.ffi.sizeof("PetscInt") == np.dtype(PETSc.IntType).itemsize
    A = PETSc.Mat().createAIJ((2, 2), comm=PETSc.COMM_SELF)
    numbering.preallocate(A, np.array([0, 1]), np.array([1, 1]))
    numbering.set_values(A, np.array([3.0, -7.0]))
    assert (A[0, 1], A[1, 1]) == (3.0, -7.0)
    A.destroy()


def test_no_c_in_strings():
    """C stands in files that C's tools can read."""
    statement = re.compile(r"^\s*(#include|typedef|static|for \(|if \(|return .*;$|double \**\w+ =)", re.M)
    found = []
    for folder in (Path(dolfbuoy.__file__).parent, ROOT / "forms", ROOT / "meshes"):
        for file in folder.rglob("*.py"):
            strings = (n.value for n in ast.walk(ast.parse(file.read_text())) if isinstance(n, ast.Constant))
            found += [file.name for text in strings if isinstance(text, str) and len(statement.findall(text)) > 1]
    assert found == []


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="Debian's cppcheck is not installed")
def test_cppcheck():
    defined = ["-DLANES=1", '-DKERNEL="core.h"', "-DNAME=kernel", "-DPETSC_INT_BYTES=4"]
    given = ["--enable=warning,performance,portability", "--inline-suppr", "--error-exitcode=3", "--quiet", *defined]
    files = [build.FOLDER / name for name in build.SOURCES]
    done = subprocess.run(["cppcheck", *given, *files], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_sanitizers(tmp_path):
    """A part of the tests, with the core and the kernels in vectors compiled for them; leaks are Python's."""
    compiler = os.environ.get("CC") or "gcc"
    library = subprocess.run([compiler, "-print-file-name=libasan.so"], capture_output=True, text=True).stdout.strip()
    given = {"LD_PRELOAD": library, "ASAN_OPTIONS": "detect_leaks=0", build.VARIABLE: "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
    command += [str(ROOT / "tests" / name) for name in SANITIZED]
    done = subprocess.run(command, env=os.environ | given, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert re.search(r"\d+ passed", done.stdout)
