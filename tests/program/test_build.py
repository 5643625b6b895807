"""Compilation of the core: options of each file, fallbacks if a compiler refuses, choice of headers, messages.

Source: the flags of gcc, written by hand; made-up compiler calls; locks as the kernel sees them.
"""

import errno
import logging
import os
import signal
import stat
import subprocess
import zlib
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from dolfbuoy.core import build
from dolfbuoy.errors import InputError
from dolfbuoy.solver import c_code, compat, instructions, jit

STRICT = ["-Wall", "-Wextra", "-Werror"]
FILES = ["loop.c", "newton.c", "step.c", "waves.c", "sample.c", "hull.c", "radiation.c", "bed.c", "bend.c"]


@pytest.fixture
def attempts(monkeypatch):
    """Calls of the compiler by `build.core`, of which the first ones, as many as were asked for, fail."""
    calls = []

    def with_python(target, units, options, libraries):
        calls.append(({unit.file.name: list(unit.options) for unit in units}, list(options), libraries))
        if len(calls) <= calls_that_fail[0]:
            raise InputError("refused")
        return "built"

    calls_that_fail = [0]
    monkeypatch.setattr(build, "_with_python", with_python)
    monkeypatch.setattr(build, "_includes", lambda petsc: [f"-isystem{petsc.folder}/include"])
    monkeypatch.setattr(build, "_library_of", lambda module: f"/lib/of/{module}")
    return calls, calls_that_fail


@pytest.mark.parametrize(
    ("machine", "tried"),
    [
        ("x86_64", [(STRICT, True), ([], True), ([], False)]),
        ("aarch64", [(STRICT, False), ([], False)]),
    ],
)
@pytest.mark.parametrize(("takes_data", "more"), [(False, []), (True, ["-DKERNEL_TAKES_DATA"])])
def test_options_of_every_attempt(machine, tried, takes_data, more, attempts, monkeypatch):
    """Sums as NumPy's in loops and steps, vectors of sines where there is libmvec; without warnings as errors then."""
    calls, failing = attempts
    monkeypatch.setattr(build.platform, "machine", lambda: machine)
    failing[0] = len(tried) - 1
    petsc = build.Petsc("/petsc", "arch", 8, "module.so")
    assert build.core(Path("/cache/core.so"), ["-mavx2"], takes_data, petsc) == "built"
    common = ["-DPETSC_INT_BYTES=8", *more, f"-I{build.FOLDER}", "-isystem/petsc/include"]
    exact = ["-ffp-contract=off", "-mavx2"]
    expected = []
    for warnings, fast in tried:
        own = {"loop.c": exact, "step.c": exact, "waves.c": ["-ffast-math"] if fast else []}
        units = {name: [*common, *warnings, *own.get(name, [])] for name in FILES}
        expected.append((units, common, ["/lib/of/module.so", *(["-lmvec"] if fast else []), "-lm"]))
    assert calls == expected
    failing[0], calls[:] = len(tried), []
    with pytest.raises(InputError, match="refused"):
        build.core(Path("/cache/core.so"), ["-mavx2"], takes_data, petsc)
    assert len(calls) == len(tried)


def test_what_the_compiler_is_told(tmp_path, monkeypatch):
    """Each file by itself, then all objects and libraries together; CC may have options."""
    calls = []

    def run(command, folder):
        calls.append([word.replace(str(folder), "FOLDER") for word in command])
        Path(command[-1]).touch()

    monkeypatch.setenv("CC", "ccache 'my cc'")
    monkeypatch.delenv(build.VARIABLE, raising=False)
    monkeypatch.setattr(build, "_run", run)
    units = [build.Unit(Path("/src/a.c"), ["-DA"]), build.Unit(Path("/src/b.c"))]
    build.shared_library(tmp_path / "x.so", units, ["-lz"])
    flags = ["-c", "-fPIC", "-fvisibility=hidden", "-O3", "-g0", "-fno-math-errno", "-fno-trapping-math"]
    both = [["/src/b.c", "-o", "FOLDER/b.o"], ["-DA", "/src/a.c", "-o", "FOLDER/a.o"]]
    assert sorted(calls[:2]) == sorted(["ccache", "my cc", *flags, *words] for words in both)
    assert calls[2:] == [["ccache", "my cc", "-shared", "FOLDER/a.o", "FOLDER/b.o", "-lz", "-o", "FOLDER/whole"]]
    assert [file.name for file in tmp_path.iterdir()] == ["x.so"]
    monkeypatch.setenv(build.VARIABLE, "1")
    assert build.sanitized() == build.SANITIZED != ()


def test_a_cache_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    def run(command, folder):
        raise PermissionError(errno.EACCES, "Permission denied", f"{folder}/a.o")

    monkeypatch.setattr(build, "_run", run)
    with pytest.raises(PermissionError) as raised:
        build.shared_library(tmp_path / "x.so", [build.Unit(Path("/src/a.c"))])
    error = raised.value
    assert (error.errno, error.strerror, error.filename) == (errno.EACCES, "Permission denied", str(tmp_path / "x.so"))


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("echo one >&2; echo 'f.c:1: error: two' >&2; echo 'error: three' >&2; exit 1", "f.c:1: error: two"),
        ("echo ' warned' >&2; echo more >&2; exit 1", "warned"),
        ("exit 3", "sh ended with 3"),
    ],
)
def test_the_first_error_is_passed_on(script, said, tmp_path):
    with pytest.raises(InputError) as raised:
        build._run(["sh", "-c", script], tmp_path)
    assert str(raised.value) == f"C code cannot be compiled, dolfbuoy needs a C compiler: {said}."


def test_headers_are_those_of_petsc_and_of_the_first_mpi_that_has_one(tmp_path, monkeypatch):
    """mpicc may be missing, and pkg-config may know another name."""
    for name in ("petsc/include", "petsc/arch/include", "mpi", "other"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "mpi" / "mpi.h").touch()
    asked, petsc = [], build.Petsc(str(tmp_path / "petsc"), "arch", 4, "")

    def run(command, cwd, capture_output, text):
        asked.append(command)
        if command[0] == "mpicc":
            raise FileNotFoundError
        there = {"mpi-c": f"-I{tmp_path}/other", "ompi-c": f"-I{tmp_path}/other -I{tmp_path}/mpi -I/none -DX"}
        return SimpleNamespace(stdout=there[command[-1]])

    monkeypatch.setattr(subprocess, "run", run)
    own = [f"-isystem{tmp_path}/petsc/include", f"-isystem{tmp_path}/petsc/arch/include"]
    assert build._includes(petsc) == [*own, f"-isystem{tmp_path}/other", f"-isystem{tmp_path}/mpi"]
    assert [command[-1] for command in asked] == ["-show", "mpi-c", "ompi-c"]
    monkeypatch.setattr(
        subprocess, "run", lambda command, **_: asked.append(command) or SimpleNamespace(stdout=f"gcc -I{tmp_path}/mpi")
    )
    asked.clear()
    assert build._includes(petsc) == [*own, f"-isystem{tmp_path}/mpi"]
    assert len(asked) == 1


def elsewhere(asked):
    """A small number that a function returns in another process; 9 if it raises."""
    process = os.fork()
    if not process:
        code = 9
        try:
            code = int(asked())
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


# -- what is kept -----------------------------------------------------------------------------------------------------


def test_a_file_is_made_once_for_all_that_it_depends_on(tmp_path, monkeypatch):
    """Its name says what it was made for; sanitizers make another one; while it is made the lock is held."""
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path)
    monkeypatch.delenv(build.VARIABLE, raising=False)
    made = []

    def make(path):
        def asked():  # a lock of one process is open to itself
            handle = os.open(tmp_path / "dolfbuoy.lock", os.O_RDWR)
            return jit._holder(handle, zlib.crc32(path.name.encode())) != os.getppid()

        made.append((path, elsewhere(asked)))
        path.touch()

    names = [c_code.kept("lanes", key, make).name for key in ("one", "one", "two")]
    monkeypatch.setenv(build.VARIABLE, "1")
    names.append(c_code.kept("lanes", "one", make).name)
    assert [path.name for path, _ in made] == [names[0], *names[2:]]
    assert {failed for _, failed in made} == {0}
    assert len(set(names)) == 3
    assert all(name.startswith("dolfbuoy_lanes_") and name.endswith(".so") for name in names)


def test_what_another_process_has_made_meanwhile_is_not_made_again(tmp_path, monkeypatch):
    monkeypatch.setattr(compat, "jit_cache", lambda: tmp_path)
    begun = jit.alone

    def alone(folder, name):
        (tmp_path / name).touch()
        return begun(folder, name)

    monkeypatch.setattr(jit, "alone", alone)
    assert c_code.kept("lanes", "key", None).exists()


@pytest.mark.parametrize("arch", [None, "linux"])
def test_the_core_is_made_for_this_processor_and_this_petsc(arch, monkeypatch):
    """With what petsc4py was built with, and loaded by its name without what interpreters add to it."""
    asked, path, int_bytes = [], Path("/cache/core_1.cpython.so"), c_code.core().ffi.sizeof("PetscInt")
    monkeypatch.setattr(c_code, "kept", lambda name, key, make: make(path) or asked.append(name) or path)
    monkeypatch.setattr(build, "core", lambda *given: asked.append(given))
    monkeypatch.setattr(jit, "load", lambda *given: given)
    monkeypatch.setattr(c_code.petsc4py, "get_config", lambda: {"PETSC_DIR": "/petsc", "PETSC_ARCH": arch})
    assert c_code.core.__wrapped__() == ("core_1", Path("/cache"))
    petsc = build.Petsc("/petsc", arch or "", int_bytes, c_code.PETSc.__file__)
    assert asked == [(path, instructions.best().options, compat.KERNEL_TAKES_DATA, petsc), "core"]


@pytest.mark.parametrize("size", [1, 7, 8, 9, 100])
def test_vectors_begin_where_the_largest_register_may(size):
    """At multiples of 64 bytes, whatever the allocator gives."""
    for array in [c_code.aligned(size) for _ in range(20)]:
        assert (array.shape, array.dtype, array.any()) == ((size,), float, False)
        assert array.__array_interface__["data"][0] % 64 == 0


def test_lanes_fill_a_register():
    """Of 128, 256 and 512 bits."""
    assert {one.name: 64 * one.lanes for one in instructions.SETS} == {"baseline": 128, "avx2": 256, "avx512": 512}


@pytest.mark.parametrize(
    ("flags", "largest", "found"),
    [
        ("sse2", "", ["baseline"]),
        ("sse2 avx2", "", ["baseline", "avx2"]),
        ("avx2 avx512f", "", ["baseline", "avx2"]),
        ("avx512dq avx512f avx2", "", ["baseline", "avx2", "avx512"]),
        ("avx512dq avx512f avx2", "avx2", ["baseline", "avx2"]),
        ("avx512dq avx512f avx2", "baseline", ["baseline"]),
        ("sse2", "avx512", ["baseline"]),
    ],
)
def test_instructions_are_those_that_the_first_processor_names(flags, largest, found, tmp_path, monkeypatch):
    (tmp_path / "cpuinfo").write_text(
        f"processor : 0\nflags\t\t: {flags}\nprocessor : 1\nflags : avx2 avx512f avx512dq\n"
    )
    monkeypatch.setattr(instructions, "Path", lambda name: {"/proc/cpuinfo": tmp_path / "cpuinfo"}[name])
    monkeypatch.setattr(instructions, "processor_flags", instructions.processor_flags.__wrapped__)
    monkeypatch.setenv(instructions.VARIABLE, largest)
    assert [one.name for one in instructions.available()] == found
    assert instructions.best().name == found[-1]


@pytest.mark.parametrize("text", [None, "processor : 0\n"])
def test_without_flags_there_is_the_baseline(text, tmp_path, monkeypatch):
    monkeypatch.setattr(instructions, "Path", lambda name: tmp_path / "cpuinfo")
    if text:
        (tmp_path / "cpuinfo").write_text(text)
    assert instructions.processor_flags.__wrapped__() == frozenset()


# -- locks ------------------------------------------------------------------------------------------------------------


def test_each_name_has_a_byte_of_its_own(tmp_path):
    """Of a file that only its owner reads, as another process sees it; free again afterwards."""
    place, lock = zlib.crc32(b"form"), tmp_path / "a" / "cache" / "dolfbuoy.lock"

    def seen():
        handle = os.open(lock, os.O_RDWR)
        found = [jit._holder(handle, place + more) for more in (-1, 0, 1)]
        return [[0, 0, 0], [0, os.getppid(), 0]].index(found)

    for _ in range(2):
        with jit.alone(lock.parent, "form") as locked:
            assert (locked, elsewhere(seen)) == (True, 1)
        assert elsewhere(seen) == 0
    assert stat.S_IMODE(lock.stat().st_mode) == 0o600


def test_without_locks_it_is_said_and_a_helper_waits_for_nobody(tmp_path, monkeypatch):
    def refuses(kind):
        def lock(handle, name):
            raise kind

        monkeypatch.setattr(jit, "_lock", lock)

    refuses(OSError(errno.ENOLCK, "no locks"))
    with jit.alone(tmp_path, "form") as locked:
        assert locked is False
    refuses(BlockingIOError())
    with pytest.raises(BlockingIOError), jit.alone(tmp_path, "form"):
        pass


@pytest.mark.parametrize(("steps", "cores", "helpers"), [(1, 4, 0), (2, 4, 1), (4, 3, 2), (4, 1, 0), (3, 3, 2)])
def test_one_helper_for_every_other_core_and_step(steps, cores, helpers, monkeypatch):
    """None where one process takes them all; called once."""
    called = []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)))
    monkeypatch.setattr(jit, "_helper", lambda given: called.append(given))
    monkeypatch.setattr(jit._team, "helpers", [])
    given = [print] * steps
    monkeypatch.setattr(jit._team, "steps", given)
    jit._call_helpers()
    jit._call_helpers()
    assert called == [given] * helpers


def test_a_helper_is_silent_and_ends_as_it_is_told_to(tmp_path, capfd):
    """It knows that it is one, takes its steps from the last one on, and goes on where one fails."""

    def told(name, text):
        with open(tmp_path / "told", "a") as file:
            file.write(f"{name}: {text}\n")

    def step():
        os.write(1, b"one")
        os.write(2, b"two")
        signals = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
        told("helper", (jit._team.is_helper, os.read(0, 1), signals == (signal.default_int_handler, signal.SIG_DFL)))

    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        process = jit._helper([partial(told, "first", 1), step, partial(int, "x"), partial(told, "last", 4)])
        assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (tmp_path / "told").read_text() == "last: 4\nhelper: (True, b'', True)\nfirst: 1\n"
    assert capfd.readouterr() == ("", "")
    assert not jit._team.is_helper


def test_the_log_is_as_it_was_after_the_compiler():
    before = logging.root.manager.disable
    with jit.quiet_compiler():
        assert logging.root.manager.disable == logging.INFO
    assert logging.root.manager.disable == before != logging.INFO


# -- the compiler of one process --------------------------------------------------------------------------------------


class Compiler:
    """As dolfinx's: looks once, then compiles, if the claim of another process does not stand in its way."""

    def __init__(self, folder, there=False, claimed=0, words="remove {}/form.c)"):
        self.there, self.claimed, self.claim, self.words = there, claimed, folder / "form.c", words.format(folder)
        self.options = []

    def __call__(self, form, **options):
        if not self.there and jit.ffcx_jit.get_cached_module is jit._cached_module:
            raise jit._NotCompiledError("form")
        self.options.append(options)
        if self.claimed:
            self.claimed -= 1
            raise TimeoutError(f"waited; (2) {self.words}")
        return "compiled", form


def compiled(compiler, folder, **options):
    return jit.one_at_a_time(compiler, "jit", lambda: folder)("a form", **options)


def test_what_is_compiled_waits_for_nobody(tmp_path, monkeypatch):
    monkeypatch.setattr(jit, "alone", None)
    compiler = Compiler(tmp_path, there=True)
    assert compiled(compiler, tmp_path, jit={"own": 1}) == ("compiled", "a form")
    assert compiler.options == [{"jit": {"own": 1}}]


@pytest.mark.parametrize(("locks", "seconds"), [(True, 2), (False, 600)])
@pytest.mark.parametrize("given", [None, {"own": 1}])
def test_waiting_is_short_where_no_other_process_can_be_at_work(locks, seconds, given, tmp_path, monkeypatch):
    if not locks:
        monkeypatch.setattr(jit, "_lock", lambda *_: (_ for _ in ()).throw(OSError()))
    compiler = Compiler(tmp_path)
    assert compiled(compiler, tmp_path, jit=given) == ("compiled", "a form")
    assert compiler.options == [{"jit": {**(given or {}), "timeout": seconds}}]


@pytest.mark.parametrize("left", [True, False])
def test_a_claim_that_was_left_behind_is_removed(left, tmp_path):
    """By whoever holds the lock; another process may have done it."""
    if left:
        (tmp_path / "form.c").touch()
    compiler = Compiler(tmp_path, claimed=1)
    assert compiled(compiler, tmp_path) == ("compiled", "a form")
    assert len(compiler.options) == 2
    assert not (tmp_path / "form.c").exists()


@pytest.mark.parametrize("why", ["no locks", "other words", "again"])
def test_a_claim_that_may_be_alive_stays(why, tmp_path, monkeypatch):
    (tmp_path / "form.c").touch()
    if why == "no locks":
        monkeypatch.setattr(jit, "_lock", lambda *_: (_ for _ in ()).throw(OSError()))
    words = "nothing of it" if why == "other words" else "remove {}/form.c)"
    compiler = Compiler(tmp_path, claimed=2, words=words)
    with pytest.raises(TimeoutError):
        compiled(compiler, tmp_path)
    assert (tmp_path / "form.c").exists() == (why != "again")
    assert len(compiler.options) == 1 + (why == "again")
    assert jit.ffcx_jit.get_cached_module is not jit._cached_module
