"""Compile the C code of this folder: `core` (cffi's API mode), and `simd.c` with the text of a kernel."""

import ctypes
import os
import platform
import shlex
import subprocess
import sysconfig
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from ..errors import InputError

FOLDER = Path(__file__).parent
SOURCES = "loop.c", "newton.c", "step.c", "waves.c", "sample.c", "hull.c", "radiation.c", "bed.c", "bend.c"
#: Square roots without errno and comparisons without traps; results remain IEEE.
OPTIMISED = ("-O3", "-g0", "-fno-math-errno", "-fno-trapping-math")
#: No fused multiply-add: sums equal those of NumPy to the last bit.
EXACT = ("-ffp-contract=off",)
FAST = ("-ffast-math",)
STRICT = ("-Wall", "-Wextra", "-Werror")
#: Checks at run time; Python must have been started with libasan in LD_PRELOAD.
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer", "-g")
_LENIENT = ((), True), ((), False)  # (warnings, vectors) to try if a compiler fails
VARIABLE = "DOLFBUOY_SANITIZE"  #: 1: compile with `SANITIZED`


class Unit(NamedTuple):
    """A C file and its own compiler options."""

    file: Path
    options: Sequence[str] = ()


class Petsc(NamedTuple):
    """The PETSc to link: that of petsc4py."""

    folder: str  #: PETSC_DIR
    arch: str
    int_bytes: int
    module: str  #: file of petsc4py's extension module, which has loaded the library


def sanitized() -> tuple[str, ...]:
    """Compiler and linker options requested by the environment."""
    return SANITIZED if os.environ.get(VARIABLE) == "1" else ()


def declarations() -> str:
    """The parts of core.h read by cffi."""
    text = (FOLDER / "core.h").read_text()
    parts = ("#ifdef FOR_CFFI\n", "#endif"), ("/* From here on cffi reads too: no preprocessor. */", "/* To here. */")
    return "".join(text.partition(begin)[2].partition(end)[0] for begin, end in parts)


def core(target: Path, instructions: Sequence[str], takes_data: bool, petsc: Petsc) -> None:
    """Compile the core to an extension module `target`.

    instructions: options for the vector instructions of this processor.  takes_data: FFCx kernels have one more
    argument.  A compiler with additional warnings, or without libmvec, is supported as well.
    Raises InputError without a C compiler.
    """
    defined = [f"-DPETSC_INT_BYTES={petsc.int_bytes}", *(["-DKERNEL_TAKES_DATA"] if takes_data else [])]
    common = [*defined, f"-I{FOLDER}", *_includes(petsc)]
    vectors = platform.machine() == "x86_64"
    attempts = [(STRICT, vectors), *((warnings, fast and vectors) for warnings, fast in _LENIENT)]
    for warnings, fast in attempts:
        exact = [*EXACT, *instructions]
        own = {"loop.c": exact, "step.c": exact, "waves.c": FAST if fast else ()}
        units = [Unit(FOLDER / name, [*common, *warnings, *own.get(name, ())]) for name in SOURCES]
        libraries = [_library_of(petsc.module), *(["-lmvec"] if fast else []), "-lm"]
        try:
            return _with_python(target, units, common, libraries)
        except InputError:
            if (warnings, fast) == attempts[-1]:
                raise


def _with_python(target, units, options, libraries):
    from cffi import FFI, recompiler

    builder = FFI()
    builder.cdef(declarations())
    with TemporaryDirectory() as folder:
        glue = Path(folder) / "glue.c"
        recompiler.make_c_source(builder, target.name.split(".")[0], '#include "core.h"\n', str(glue))
        python = [f"-isystem{sysconfig.get_path(name)}" for name in ("include", "platinclude")]
        shared_library(target, [*units, Unit(glue, [*options, *python])], libraries)


def shared_library(target: Path, units: Sequence[Unit], libraries: Sequence[str] = ()) -> None:
    """Compile and link C files in a temporary folder, then move the result: other processes see all of it or nothing.

    Raises InputError if they cannot be compiled, OSError if `target` cannot be written.
    """
    compiler = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")
    try:
        with TemporaryDirectory(dir=target.parent) as folder:
            objects = [f"{folder}/{unit.file.stem}.o" for unit in units]
            always = (*compiler, "-c", "-fPIC", "-fvisibility=hidden", *OPTIMISED, *sanitized())
            calls = [[*always, *u.options, str(u.file), "-o", to] for u, to in zip(units, objects, strict=True)]
            with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as cores:
                list(cores.map(partial(_run, folder=folder), calls))
            whole = f"{folder}/whole"
            _run([*compiler, "-shared", *sanitized(), *objects, *libraries, "-o", whole], folder)
            os.replace(whole, target)
    except PermissionError as error:
        raise PermissionError(error.errno, error.strerror, str(target)) from None


def _run(command, folder):
    """Run a command in a given folder, so that files in the current one are ignored."""
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise InputError(f"dolfbuoy needs a C compiler, and {command[0]} cannot be run: {error.strerror}.") from None
    if done.returncode:
        said = (done.stderr.strip() or f"{command[0]} ended with {done.returncode}").splitlines()
        errors = [line for line in said if "error" in line]
        raise InputError(f"C code cannot be compiled, dolfbuoy needs a C compiler: {(errors or said)[0]}.")


def _includes(petsc):
    """Options for the folders of petscsnes.h and of mpi.h, which it includes, with their warnings suppressed."""
    folders = [Path(petsc.folder) / "include", Path(petsc.folder) / petsc.arch / "include"]
    asked = ["mpicc", "-show"], ["pkg-config", "--cflags-only-I", "mpi-c"], ["pkg-config", "--cflags-only-I", "ompi-c"]
    for command in asked:
        try:
            done = subprocess.run(command, cwd="/", capture_output=True, text=True)
        except OSError:
            continue
        found = [Path(word[2:]) for word in shlex.split(done.stdout) if word.startswith("-I")]
        if any((folder / "mpi.h").exists() for folder in found):
            folders += found
            break
    return [f"-isystem{folder}" for folder in folders if folder.is_dir()]


class _Place(ctypes.Structure):
    """Dl_info of <dlfcn.h>."""

    _fields_ = [("file", ctypes.c_char_p), ("base", ctypes.c_void_p)]
    _fields_ += [("symbol", ctypes.c_char_p), ("address", ctypes.c_void_p)]


def place_of(address: int) -> tuple[str, str]:
    """File of the shared library that contains the function at an address, and the function's name."""
    place = _Place()
    ctypes.CDLL(None).dladdr(ctypes.c_void_p(address), ctypes.byref(place))
    return place.file.decode(), (place.symbol or b"").decode()


def _library_of(module):
    """The PETSc library loaded by an extension module."""
    return place_of(ctypes.cast(ctypes.CDLL(module).SNESSolve, ctypes.c_void_p).value)[0]
